# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A mesh to be touched many times, whatever happens to the scene meanwhile."""

import math
import zlib

import numpy as np
from mathutils.bvhtree import BVHTree

from .evaluated_mesh import coordinates, disabled, evaluated_object, product, size_of


class MeshSnapshot:
    """The evaluated mesh of an object as it was, to be touched many times; nothing in it is Blender's scene.

    All is in the directions of the world, from the object's origin: so rounding knows no place in the world.

    points, normals : (n, 3), of the vertices; has_face : (n,), which of them are in a face
    size : as in MeshSurface; spacing : how far apart neighboring float32 numbers are at most, in the mesh
    checksum, matrix : another for another shape; the object's transform
    """

    def __init__(self, obj, depsgraph):
        """Raises ValueError, with a sentence, where `obj` cannot be touched."""
        evaluated, linear, _ = evaluated_object(obj, depsgraph)
        co = coordinates(obj.name, evaluated)
        mesh = evaluated.data
        self.checksum, self.matrix = zlib.crc32(co), obj.matrix_world.copy()
        self.size = size_of(evaluated, linear)
        farthest = float(np.abs(co).max()) * np.linalg.norm(linear, axis=0).max()
        self.spacing = farthest * np.finfo(np.float32).eps
        normals = np.empty_like(co)
        mesh.vertex_normals.foreach_get("vector", normals.ravel())
        corners = np.empty(len(mesh.loops), dtype=np.int32)
        mesh.loops.foreach_get("vertex_index", corners)
        self.has_face = np.zeros(len(co), dtype=bool)
        self.has_face[corners] = True
        self.points, self.normals = co @ linear.T, normals @ np.linalg.inv(linear)
        self.normals /= np.maximum(np.linalg.norm(self.normals, axis=1, keepdims=True), 1e-30)
        try:
            self._cast = BVHTree.FromObject(obj, depsgraph).ray_cast  # half the time of the object's own
        except ValueError as error:
            raise disabled(obj) from error
        if not np.array_equal(linear, np.eye(3)):
            self.ray_cast = _transformed(self._cast, linear)

    def ray_cast(self, origin, direction, distance):
        """(point, unit normal) where the ray first meets the mesh within `distance`, or None."""
        point, normal, _, _ = self._cast(origin, direction, distance)
        return (point, normal) if point is not None and any(normal) else None


def _transformed(cast, linear):
    """MeshSnapshot.ray_cast for an object that is turned or scaled, whose own rays are `cast`."""
    inverse = np.linalg.inv(linear)
    rows, back, normal_rows = (array.tolist() for array in (linear, inverse, inverse.T))

    def ray_cast(origin, direction, distance):
        local = product(back, *direction)
        found = cast(product(back, *origin), local, distance * math.hypot(*local))
        point, (x, y, z) = found[0], found[1] or (0.0, 0.0, 0.0)
        if point is None or not (x or y or z):
            return None
        x, y, z = product(normal_rows, x, y, z)
        length = math.hypot(x, y, z)
        return product(rows, *point), (x / length, y / length, z / length)

    return ray_cast
