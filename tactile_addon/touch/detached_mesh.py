# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A mesh to be touched many times, whatever happens to the scene meanwhile; and what has happened."""

import math
import zlib

import numpy as np
from mathutils.bvhtree import BVHTree

from .evaluated_mesh import PlacedMesh, coordinates, disabled, evaluated_object


class DetachedMesh(PlacedMesh):
    """The evaluated mesh of an object as it was, to be touched many times; nothing in it is Blender's scene.

    All is in the directions of the world, from the object's origin: so rounding knows no place in the world.

    name, matrix : of the object, its transform
    points, normals : (n, 3), of the vertices; has_face : (n,), which of them are in a face
    faces : (m, 3), indices of the first vertices of each
    size : the longest edge of the box around all faces, in the world
    spacing : how far apart neighboring float32 numbers are at most, in the mesh
    """

    def __init__(self, obj, depsgraph):
        """Raises ValueError, with a sentence, where `obj` cannot be touched."""
        evaluated, linear, _ = evaluated_object(obj, depsgraph)
        co = coordinates(obj.name, evaluated)
        mesh = evaluated.data
        # No reference to the object: somebody may delete it.
        self.name, self._uid = obj.name, obj.session_uid
        self._checksum, self.matrix = zlib.crc32(co), obj.matrix_world.copy()
        farthest = float(np.abs(co).max()) * np.linalg.norm(linear, axis=0).max()
        self.spacing = farthest * np.finfo(np.float32).eps
        normals = np.empty_like(co)
        mesh.vertex_normals.foreach_get("vector", normals.ravel())
        corners = np.empty(len(mesh.loops), dtype=np.int32)
        mesh.loops.foreach_get("vertex_index", corners)
        starts = np.empty(len(mesh.polygons), dtype=np.int32)
        mesh.polygons.foreach_get("loop_start", starts)
        self.faces = corners[starts[:, None] + np.arange(3)]
        self.has_face = np.zeros(len(co), dtype=bool)
        self.has_face[corners] = True
        # What is loose cannot be touched, and may be far off.
        self.size = float((np.ptp(co[self.has_face], axis=0) * np.linalg.norm(linear, axis=0)).max())
        self.points, self.normals = co @ linear.T, normals @ np.linalg.inv(linear)
        self.normals /= np.maximum(np.linalg.norm(self.normals, axis=1, keepdims=True), 1e-30)
        try:
            self._tree = BVHTree.FromObject(obj, depsgraph)  # its rays take half the time of the object's own
        except ValueError as error:
            raise disabled(obj) from error
        rays = self._tree.ray_cast
        super().__init__(linear, np.zeros(3), lambda *ray: rays(*ray)[:2])

    def require_source(self, context):
        """The object that was taken, where it was. Raises ValueError, with a sentence, where it is not."""
        found = next((o for o in context.view_layer.objects if o.session_uid == self._uid), None)
        if found is None:
            raise ValueError(f'"{self.name}" is gone, so touching was stopped')
        if context.mode != "OBJECT" or found.mode != "OBJECT":
            raise ValueError("Touching was stopped because Object Mode was left: start it again")
        if found.matrix_world != self.matrix:
            raise ValueError(f'"{self.name}" was moved while it was touched: start again')
        return found

    def require_same(self, context):
        """The object, as `require_source` finds it, if it is of the same shape; raises ValueError if not."""
        found = self.require_source(context)
        evaluated, _, _ = evaluated_object(found, context.evaluated_depsgraph_get())
        if zlib.crc32(coordinates(found.name, evaluated)) != self._checksum:
            raise ValueError(f'"{self.name}" was changed while it was touched: start again')
        return found

    @property
    def origin(self):
        """Where all begins, in the world."""
        return np.array(self.matrix.translation)

    def project(self, location):
        """A point of the mesh near a place, the unit normal there, and the distance."""
        point, normal = self._nearest(self._to_local(location))
        if point is None:
            raise ValueError("The location is too far away to be measured: set it on the surface")
        if not any(normal):
            raise ValueError("The location is on a face of no area: move it, or dissolve degenerate faces")
        point = self._to_world(point)
        return point, self._normal_to_world(normal), math.dist(location, point)

    def _nearest(self, local):
        return self._tree.find_nearest(local)[:2]
