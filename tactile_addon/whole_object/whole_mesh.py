# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What touches all over an object put into the scene: patches while they grow, then one surface."""

import math
from collections.abc import Sequence
from typing import Any

import bpy
import numpy as np
from mathutils import Matrix

from ... import core
from ..scene import colors, patch_object, patch_record, undo
from ..scene.mesh_data import (
    ABOVE,
    COLOR,
    CORNERS,
    DEVIATION,
    HEIGHT_STD,
    NODE,
    emission,
    fill,
    own_mesh,
    write,
)
from ..scene.shown import bend_range, recolor
from ..scene.viewports import show_colors, show_size
from ..touch.detached_mesh import DetachedMesh
from ..touch.types import Array, Object
from .whole_surface import WholeSurface

SHARP = math.radians(30.0)  # Edges at which faces are turned by more are creases.
# While a patch is one of many, it is drawn with these rings around its middle, the last of which is its dark
# rim, and spokes.
RINGS, SPOKES = (0.25, 0.5, 0.75, 0.95, 1.0), 48
RIM_COLOR = (0.15, 0.15, 0.15, 1.0)
# It is above its place by one to four times this share of the object's size, or of its own if that is less:
# overlapping patches at one height would flicker. Multiples of the golden section are far apart from those
# before them.
LAYER, OWN_LAYER, LAYERS = 6e-4, 2e-2, 3
GOLDEN_SECTION = 0.5 * (math.sqrt(5.0) - 1.0)
# The whole surface, where it is not drawn in front, is drawn above the mesh by this share of the size, and
# patches by twice as much, because their rims and straight edges may be below the mesh.
DRAWN_ABOVE = 5e-3


class GrowingPatches:
    """An object that shows the patches found so far, until it is removed."""

    def __init__(self, scene: bpy.types.Scene, surface: DetachedMesh) -> None:
        """`surface` is the DetachedMesh that is touched."""
        mesh = bpy.data.meshes.new(f"{surface.name} Touches")
        obj: Object = bpy.data.objects.new(mesh.name, mesh)
        # It is not drawn in front: patches on the far side would show through.
        obj.matrix_world = Matrix.Translation(list(surface.origin))
        scene.collection.objects.link(obj)  # A collection of its own might be left empty.
        with undo.after_step():  # There is an undo step when the operator ends.
            undo.note_added(obj)
        obj.data.materials.append(emission("Tactile Surface", COLOR))
        # The points of each, its mean curvatures there, its larger principal curvature, and its area.
        self._patches: list[tuple[Array, Array, float, float]] = []
        obj[ABOVE] = 2.0 * DRAWN_ABOVE * surface.size
        self._uid, self._size = obj.session_uid, surface.size
        show_colors()
        show_size(surface.size)

    def add(self, explored: Sequence[core.Exploration], rims: Sequence[Array]) -> None:
        """Shows the patches of these, too, up to their rims, unless somebody has deleted the object."""
        objects = self._objects()
        if not objects or not explored:
            return
        for r, rim in zip((each.result for each in explored), rims, strict=True):
            points, mean_curvature = _disk(r, rim)
            layer = min(LAYER * self._size, OWN_LAYER * float(np.median(rim)))
            layer *= 1.0 + LAYERS * (GOLDEN_SECTION * len(self._patches) % 1.0)
            points += layer * r.frame.axes[:, 2]
            bend = max(abs(r.k1) - r.k1_std, abs(r.k2) - r.k2_std, 0.0)
            self._patches.append((points, mean_curvature, bend, float(np.mean(rim**2))))
        placed, mean_curvatures, bends, areas = zip(*self._patches, strict=True)
        count = 1 + SPOKES * len(RINGS)
        triangles = np.concatenate([_fan() + count * i for i in range(len(self._patches))])
        shades = colors.shades(np.concatenate(mean_curvatures), bend_range(bends, areas, self._size))
        shades.reshape(-1, count, 4)[:, -SPOKES:] = RIM_COLOR
        fill(objects[0].data, np.concatenate(placed), triangles, [(COLOR, shades)])

    def remove(self) -> None:
        """Deletes the object, if it is still there."""
        patch_object.remove_objects(self._objects())

    def _objects(self) -> list[Object]:
        """The object, or none if somebody has deleted it."""
        return [obj for obj in bpy.data.objects if obj.session_uid == self._uid]


def _disk(r: core.Reconstruction, rim: Array) -> tuple[Array, Array]:
    """Points (n, 3) of a patch, on rings around its middle, and what is certain of mean curvatures there.

    rim : (k SPOKES,), the radii of the patch all round, where the finger felt it end
    """
    angles = np.linspace(0.0, 2.0 * np.pi, SPOKES, endpoint=False)
    edge = rim[:: len(rim) // SPOKES, None] * np.column_stack([np.cos(angles), np.sin(angles)])
    x, y = np.vstack([np.zeros((1, 2)), *(share * edge for share in RINGS)]).T
    mean_curvature = r.patch.mean_curvature(x, y)
    certain = np.maximum(np.abs(mean_curvature) - 0.5 * (r.k1_std + r.k2_std), 0.0)
    points = r.frame.to_world(np.column_stack([x, y, r.height(x, y)]))
    return points, np.copysign(certain, mean_curvature)


def _fan() -> Array:
    """The triangles (m, 3) between the points of a disk."""
    inner = np.arange(SPOKES * len(RINGS)).reshape(-1, SPOKES)
    a, b = inner.ravel(), np.roll(inner, -1, axis=1).ravel()
    halves = [np.column_stack([a, a + SPOKES, b + SPOKES]), np.column_stack([a, b + SPOKES, b])]
    triangles = np.maximum(np.vstack(halves) - SPOKES + 1, 0)  # The innermost ring is one point.
    return triangles[triangles[:, 0] != triangles[:, 2]]


def insert(scene: bpy.types.Scene, name: str, whole: WholeSurface, report: dict[str, Any]) -> Object:
    """Adds a WholeSurface of the object with this name to the scene, and returns the new object."""
    mesh = bpy.data.meshes.new(f"{name} Surface")
    obj = bpy.data.objects.new(mesh.name, mesh)
    obj.matrix_world = Matrix.Translation(list(whole.origin))
    patch_object.collection(scene).objects.link(obj)
    mesh.materials.append(emission("Tactile Surface", COLOR))
    rewrite(obj, whole, report | {"source": name})
    show_colors()
    return obj


def rewrite(obj: Object, whole: WholeSurface, report: dict[str, Any]) -> None:
    """Gives the object of a whole surface the mesh, the report and the graph of a WholeSurface."""
    own_mesh(obj)
    mesh, found = obj.data, whole.mesh
    attributes = [
        *whole.curvatures.items(),
        (HEIGHT_STD, found.std),
        (DEVIATION, whole.deviation),
        (NODE, found.patch.astype(np.int32)),
    ]
    fill(mesh, found.vertices, found.triangles, attributes)
    write(mesh, COLOR, np.ones((found.triangles.size, 4)), CORNERS)
    mesh.shade_smooth()
    mesh.set_sharp_from_angle(angle=SHARP)
    obj[patch_record.ATLAS_RECORD] = report | {"object": obj.name}
    obj[patch_record.GRAPH] = whole.graph
    obj[ABOVE] = DRAWN_ABOVE * float(np.ptp(found.vertices, axis=0).max())
    # In front of the object the far side of an incomplete surface would fill what was not felt.
    obj.show_in_front = not report.get("uncovered")
    recolor(obj)
