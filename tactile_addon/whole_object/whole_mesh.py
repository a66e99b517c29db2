# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What touches all over an object put into the scene: patches while they grow, then one surface."""

import math

import bpy
import numpy as np
from mathutils import Matrix

from ..scene import colors, patch_object, patch_record, undo
from ..scene.mesh_data import emission, fill
from ..scene.viewports import show_colors

SHARP = math.radians(30.0)  # Edges at which faces are turned by more are creases.
RINGS, SPOKES = (0.5, 1.0), 24  # While a patch is one of many, it is drawn with these rings and spokes.


class GrowingPatches:
    """An object that shows the patches found so far, until it is removed."""

    def __init__(self, scene, surface):
        """`surface` is the DetachedMesh that is touched."""
        mesh = bpy.data.meshes.new(f"{surface.name} Touches")
        obj = bpy.data.objects.new(mesh.name, mesh)
        obj.show_in_front, obj.matrix_world = True, Matrix.Translation(surface.origin)
        scene.collection.objects.link(obj)  # A collection of its own might be left empty.
        with undo.after_step():  # There is an undo step when the operator ends.
            undo.note_added(obj)
        obj.data.materials.append(emission("Tactile Curvature", attribute=patch_record.COLOR))
        self._uid, self._patches = obj.session_uid, []
        show_colors()

    def add(self, found):
        """Shows these core.Reconstructions, too, unless somebody has deleted the object."""
        obj = self._object()
        if obj is None or not found:
            return
        self._patches += [_disk(r) for r in found]
        points, curvatures = (np.concatenate(parts) for parts in zip(*self._patches, strict=True))
        count = 1 + SPOKES * len(RINGS)
        triangles = np.concatenate([_fan() + count * i for i in range(len(self._patches))])
        shades = colors.diverging(curvatures, colors.symmetric_range(curvatures, 1e-30))
        fill(obj.data, points, triangles, [(patch_record.COLOR, "FLOAT_COLOR", shades)])

    def remove(self):
        """Deletes the object, if it is still there."""
        obj = self._object()
        if obj is not None:
            patch_object.remove_objects([obj])

    def _object(self):
        return next((obj for obj in bpy.data.objects if obj.session_uid == self._uid), None)


def _disk(r):
    """Points (n, 3) of a patch, on rings around its middle, and their Gaussian curvatures (n,)."""
    angles = np.linspace(0.0, 2.0 * np.pi, SPOKES, endpoint=False)
    unit = np.column_stack([np.cos(angles), np.sin(angles)])
    x, y = r.domain.points_at(np.vstack([np.zeros((1, 2)), *(share * unit for share in RINGS)])).T
    return r.frame.to_world(np.column_stack([x, y, r.height(x, y)])), r.patch.gaussian_curvature(x, y)


def _fan():
    """The triangles (m, 3) between the points of a disk."""
    a, b = np.arange(SPOKES), np.roll(np.arange(SPOKES), -1)
    inner, outer = 1 + a, 1 + SPOKES + a
    return np.vstack(
        [
            np.column_stack([np.zeros_like(a), inner, 1 + b]),
            np.column_stack([inner, outer, 1 + SPOKES + b]),
            np.column_stack([inner, 1 + SPOKES + b, 1 + b]),
        ]
    )


def insert(scene, name, whole, report):
    """Adds a WholeSurface of the object with this name to the scene, and returns the new object."""
    mesh = bpy.data.meshes.new(f"{name} {'Touched' if 'touches' in report else 'Joined'}")
    obj = bpy.data.objects.new(mesh.name, mesh)
    obj.matrix_world, obj.show_in_front = Matrix.Translation(whole.origin), True
    patch_object.collection(scene).objects.link(obj)
    mesh.materials.append(emission("Tactile Curvature", attribute=patch_record.COLOR))
    found = whole.mesh
    attributes = [
        *((key, "FLOAT", values) for key, values in whole.curvatures.items()),
        ("height_std", "FLOAT", found.std),
        ("deviation", "FLOAT", whole.deviation),
        ("patch", "INT", found.patch.astype(np.int32)),
        (patch_record.COLOR, "FLOAT_COLOR", np.ones((len(found.vertices), 4))),
    ]
    fill(mesh, found.vertices, found.triangles, attributes)
    mesh.shade_smooth()
    mesh.set_sharp_from_angle(angle=SHARP)
    obj[patch_record.ATLAS_RECORD] = report | {"source": name, "object": obj.name}
    obj[patch_record.GRAPH] = whole.graph
    patch_object.recolor(obj)
    show_colors()
    return obj
