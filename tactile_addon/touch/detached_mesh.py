# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A mesh that can be touched many times, whatever happens to the scene, and can tell what has happened."""

import zlib
from time import perf_counter
from typing import Any

import bmesh
import bpy
import numpy as np
from mathutils import Matrix
from mathutils.bvhtree import BVHTree

from ... import core
from .evaluated_mesh import (
    PlacedMesh,
    checksum_of,
    coordinates,
    evaluated_object,
    read_array,
    require_in_scene,
    require_oriented,
)
from .types import Array, Object, Point, Triple

PAUSE = 50.0  # The time until the shape is compared again, as a multiple of the time that this takes.
SIMILAR = 1e-5  # Lengths along all axes of an object are alike up to this share, which float32 numbers have.


class DetachedMesh(PlacedMesh):
    """The evaluated mesh of an object as it was; nothing in it points to Blender's scene.

    It is in the directions of the world, relative to the object's origin, so that its place does not round
    it.

    name, matrix : name and transform of the object
    points : (n, 3), of the vertices; has_face : (n,), whether they belong to a face
    faces : (m, 3), the first three vertices of each face
    triangles : (k, 3), all faces in triangles, counterclockwise from outside; owners : (k,), their faces
    size : the longest edge of the box around all faces, in the world
    spacing : the largest distance of neighboring float32 numbers in the mesh
    """

    points: Array

    def __init__(self, obj: Object, depsgraph: bpy.types.Depsgraph) -> None:
        """Raises ValueError, with a sentence, if `obj` cannot be touched."""
        evaluated, linear, _ = evaluated_object(obj, depsgraph)
        co = coordinates(evaluated)
        require_oriented(evaluated, co)
        # It keeps no reference to the object, which somebody may delete.
        self.name, self._uid = obj.name, obj.session_uid
        self._checksum, self.matrix = zlib.crc32(co.data), obj.matrix_world.copy()
        self._compared_until = 0.0
        farthest = float(np.abs(co).max()) * np.linalg.norm(linear, axis=0).max()
        self.spacing = farthest * np.finfo(np.float32).eps
        mesh = evaluated.data
        mesh.calc_loop_triangles()
        corners = read_array(mesh.loops, "vertex_index", dtype=np.int32)
        starts = read_array(mesh.polygons, "loop_start", dtype=np.int32)
        self.triangles = read_array(mesh.loop_triangles, "vertices", 3, np.int32)
        self.owners = read_array(mesh.loop_triangles, "polygon_index", dtype=np.int32)
        self.faces = corners[starts[:, None] + np.arange(3)]
        self._corners, self._starts = corners, np.append(starts, len(corners))
        if np.linalg.det(linear) < 0.0:
            self.triangles = self.triangles[:, ::-1]
        self.has_face = np.bincount(corners, minlength=len(co)) > 0
        # Loose vertices cannot be touched and may be far away.
        self.size = float((np.ptp(co[self.has_face], axis=0) * np.linalg.norm(linear, axis=0)).max())
        self.points = co @ linear.T
        scale = np.linalg.norm(linear, axis=0).mean()
        if np.allclose(linear.T @ linear, scale**2 * np.eye(3), rtol=0.0, atol=SIMILAR * scale**2):
            # Its rays take half the time of the object's own.
            self._tree = BVHTree.FromObject(obj, depsgraph)
        else:
            self._tree, linear = _tree_in_world(mesh, linear), np.eye(3)
        rays = self._tree.ray_cast
        super().__init__(linear, np.zeros(3), lambda *ray: rays(*ray)[:2])

    def require_source(self, context: bpy.types.Context) -> Object:
        """The object it was made from. Raises ValueError, with a sentence, if that is gone or was moved.

        Now and then it also does what `require_same` does, so that long work does not go on in vain.
        """
        found = next((o for o in context.view_layer.objects if o.session_uid == self._uid), None)
        if found is None:
            for left in (obj for obj in bpy.data.objects if obj.session_uid == self._uid):
                require_in_scene(left)
            raise ValueError(f'"{self.name}" is gone, so touching was stopped')
        if context.mode != "OBJECT" or found.mode != "OBJECT":
            raise ValueError("Touching was stopped because Object Mode was left: start it again")
        if found.matrix_world != self.matrix:
            raise ValueError(f'"{self.name}" was moved while it was touched: start again')
        begin = perf_counter()
        if begin >= self._compared_until:
            if checksum_of(found, context.evaluated_depsgraph_get()) != self._checksum:
                raise ValueError(f'"{self.name}" was changed while it was touched: start again')
            self._compared_until = perf_counter() + PAUSE * (perf_counter() - begin)
        return found

    def require_same(self, context: bpy.types.Context) -> Object:
        """The object that `require_source` finds. Raises ValueError if that has another shape now."""
        self._compared_until = 0.0
        return self.require_source(context)

    def open_edge_distance(self, place: Array) -> float:
        """How far a place is from the nearest edge that has one face only, as around a hole."""
        return core.open_edge_distance(self.points, self._corners, self._starts[:-1], place)

    @property
    def origin(self) -> Array:
        """The origin of the points, in the world."""
        return np.array(self.matrix.translation, dtype=float)

    def project(self, location: Point) -> tuple[Triple, Triple, float]:
        """The point of the mesh nearest to a place, the unit normal there, and the distance."""
        return self._foot(location, location)

    def feet(self, points: Array) -> Array:
        """The points (n, 3) of the mesh nearest to places (n, 3); the place itself if it is too far away."""
        found = ((self._tree.find_nearest(self._to_local(at))[0], at) for at in points.tolist())
        return np.array([at if foot is None else self._to_world(foot) for foot, at in found])

    def _nearest(self, local: Any) -> Any:
        return self._tree.find_nearest(local)[:2]

    def face_near(self, point: Point) -> int:
        """The number of the face nearest to a point."""
        return self._tree.find_nearest(self._to_local(point))[2]

    def corners_of(self, number: int) -> Array:
        """The corners (k, 3) of a face, in order."""
        start, end = self._starts[number : number + 2]
        return self.points[self._corners[start:end]]

    def is_of_facets(self, r: core.Reconstruction) -> bool:
        """Whether the curvature of a touch is that of facets, before anything else that is in doubt."""
        gravest = core.with_facets(r, self).gravest
        return gravest is not None and gravest.code == "facets"


def _tree_in_world(mesh: bpy.types.Mesh, linear: Array) -> BVHTree:
    """The tree of a mesh in the directions of the world.

    Under different scales along its axes, what is nearest in the mesh's own coordinates is not nearest here.
    """
    copy = bmesh.new()
    try:
        copy.from_mesh(mesh)
        copy.transform(Matrix(linear.tolist()).to_4x4())
        if np.linalg.det(linear) < 0.0:
            bmesh.ops.reverse_faces(copy, faces=copy.faces[:])
        copy.normal_update()
        return BVHTree.FromBMesh(copy)
    finally:
        copy.free()
