# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The reconstruction as an object of the scene: the patch."""

import json
from collections.abc import Sequence

import bpy
import numpy as np
from mathutils import Matrix

from ... import core
from ..touch.touch_object import Touched
from ..touch.types import Array, Object
from .family import add
from .mesh_data import (
    ABOVE,
    COLOR,
    DEVIATION,
    GAUSSIAN_STD,
    HEIGHT_STD,
    NORMAL,
    PLACE,
    POSITION,
    emission,
    fill,
    own_mesh,
    values,
    write,
)
from .patch_record import (
    CURVES,
    QUANTITIES_OF_A_FIT,
    RECONSTRUCTION,
    RECORD,
    VERDICT,
    curves_of,
    matrix_of,
    place,
)
from .shown import recolor, share
from .undo import note_added
from .viewports import show_colors

COLLECTION = "Tactile Patches"
# It is drawn above the mesh by as much as it may be below it: by these shares of its radius at least and at
# most, and by this multiple of its height's deviation until it is compared with the mesh.
DRAWN_ABOVE, MOST_ABOVE, DEVIATIONS = 5e-3, 0.12, 3.0


def insert(scene: bpy.types.Scene, touched: Touched, parent: Object | None = None) -> Object:
    """Adds a patch to `scene`, in a collection of its own, and returns the patch object."""
    name = f"{touched.report['source']} Patch"
    patch: Object = bpy.data.objects.new(name, bpy.data.meshes.new(name))
    patch.show_in_front = True  # It would lie in the surface it describes.
    patch.visible_shadow = False  # Rendered, it is above that, and a rim of shadow would be around it.
    collection(scene).objects.link(patch)
    patch.data.materials.append(emission("Tactile Curvature", COLOR))
    note_added(patch)
    patch.parent = parent
    add(patch)
    rewrite(patch, touched)
    show_colors()
    return patch


def remove_objects(objects: Sequence[Object]) -> None:
    """Deletes objects, with what nothing else uses: their meshes, materials, and an empty collection."""
    meshes = [obj.data for obj in objects if obj.data is not None]
    for obj in objects:
        bpy.data.objects.remove(obj)
    meshes = [mesh for mesh in meshes if not mesh.users]
    materials = {material for mesh in meshes for material in mesh.materials if material is not None}
    bpy.data.batch_remove(meshes)
    bpy.data.batch_remove([material for material in materials if not material.users])
    bpy.data.batch_remove(empty_collections())


def empty_collections() -> list[bpy.types.Collection]:
    """The collections of patches that have nothing in them."""
    return [c for c in bpy.data.collections if _is_own(c) and not (c.objects or c.children)]


def _is_own(collection: bpy.types.Collection) -> bool:
    """Whether a collection is one of patches that can be used: no library's, nor the override of one."""
    is_ours = collection.is_editable and collection.override_library is None
    return is_ours and collection.name.partition(".")[0] == COLLECTION  # There may be a second one.


def rewrite(patch: Object, touched: Touched) -> None:
    """Changes the patch to that of another touch, in place."""
    own_mesh(patch)
    if touched.report["is_verified"] or PLACE not in patch.data.attributes:
        _fill_patch(patch, touched)
    else:
        _follow(patch, touched)
    patch[CURVES] = curves_of(touched.result)
    place(patch, Matrix(matrix_of(touched.result.frame.axes, touched.result.frame.origin).tolist()))
    patch[ABOVE] = _above(patch, touched)
    patch[RECORD] = touched.report | {"patch": patch.name}
    patch.pop(RECONSTRUCTION, None)
    patch.pop(VERDICT, None)
    recolor(patch)
    if touched.report["is_verified"]:
        patch[RECONSTRUCTION] = json.dumps(core.to_dict(touched.result), allow_nan=False)
        share(patch)


def _above(patch: Object, touched: Touched) -> float:
    """How far above the mesh a patch is drawn where it would lie in it."""
    radius, deepest = touched.result.radius, DEVIATIONS * touched.report["height_std"]
    if touched.report["is_verified"] and touched.surface is not None:
        deepest = max(deepest, -float(values(patch.data, DEVIATION).min()))
    return min(deepest + DRAWN_ABOVE * radius, MOST_ABOVE * radius)


def collection(scene: bpy.types.Scene) -> bpy.types.Collection:
    """The collection of a scene's patches, made if there is none."""
    found = next(filter(_is_own, scene.collection.children_recursive), None)
    if found is None:
        found = bpy.data.collections.new(COLLECTION)
        scene.collection.children.link(found)
        note_added(found)
    return found


def _fill_patch(obj: Object, touched: Touched) -> None:
    """Fills the mesh with the patch in its Darboux frame; deviations are 0 until the patch is verified."""
    result, frame = touched.result, touched.result.frame
    points, triangles = result.mesh()
    d = result.geometry.derivatives(*points[:, :2].T)
    deviation = np.zeros(len(points))
    if touched.report["is_verified"] and touched.surface is not None:
        world = frame.to_world(points), d.normal @ frame.axes.T
        deviation = touched.surface.deviations(*world, result.radius)
    attributes = [
        *((name, _shown(name, result, points)) for name in QUANTITIES_OF_A_FIT),
        (GAUSSIAN_STD, core.gaussian_curvature_stds(result, *points[:, :2].T)),
        (DEVIATION, deviation),
        (NORMAL, d.normal),
        (PLACE, np.column_stack([result.domain.places(points[:, :2]), np.zeros(len(points))])),
        (COLOR, np.ones((len(points), 4))),
    ]
    fill(obj.data, points, triangles, attributes)


def _follow(obj: Object, touched: Touched) -> None:
    """Moves the vertices to the patch of another touch, each at its place in the domain.

    Only the values that the colors show are brought up to date, because a gesture shows no others.
    """
    result, mesh = touched.result, obj.data
    plane = result.domain.points_at(values(mesh, PLACE)[:, :2])
    d = result.geometry.derivatives(*plane.T)
    points = np.column_stack([plane, d.z])
    write(mesh, POSITION, points)
    write(mesh, NORMAL, d.normal)
    if obj.tactile_colors in QUANTITIES_OF_A_FIT:
        write(mesh, obj.tactile_colors, _shown(obj.tactile_colors, result, points))


def _shown(name: str, result: core.Reconstruction, points: Array) -> Array:
    """The values (n,) of the quantity `name` at points (n, 3) of a surface; curvatures are those of (1)."""
    return getattr(result if name == HEIGHT_STD else result.patch, name)(*points[:, :2].T)
