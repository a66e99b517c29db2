# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A mesh object of the scene as a surface to touch: as Blender evaluates it, in world coordinates."""

import math
from functools import cached_property, partial
from typing import Any

import bpy
import numpy as np

from .evaluated_mesh import PlacedMesh, coordinates, evaluated_object, require_oriented, size_of
from .types import Array, Object, Point, Triple

VERTICES_AT_ONCE = 100_000  # So many take some megabytes; ten million took 230.
WALK = 8  # The most steps on the way to the nearest point of a stretched object; mostly two or three do.
AT_VERTEX = 1e-4  # A point that is nearer to a vertex than this share of its face's size is that vertex.
SMOOTH = 0.77  # The cosine between the normals of a vertex and of each of its faces is more, but on a crease.


class MeshSurface(PlacedMesh):
    """The evaluated mesh of an object, which core.track touches through `ray_cast`.

    sound : whether all its vertices are known to be at finite places, and its faces to point outward, which
        takes time to check
    name : of the object; size : the longest edge of its bounding box, in the world
    """

    def __init__(self, obj: Object, depsgraph: bpy.types.Depsgraph, sound: bool = False) -> None:
        """Raises ValueError, with a sentence, if `obj` cannot be touched."""
        evaluated, linear, origin = evaluated_object(obj, depsgraph)
        rays = evaluated.ray_cast  # Looking up a function of Blender takes longer than calling it.

        def cast(start: Point, direction: Point, distance: float) -> Any:
            hit, point, normal, _ = rays(start, direction, distance=distance, depsgraph=depsgraph)
            return (point, normal) if hit else (None, None)

        super().__init__(linear, origin, cast)
        self._mesh, self._object = evaluated.data, evaluated
        self._closest = partial(evaluated.closest_point_on_mesh, depsgraph=depsgraph)
        self.name, self.size = obj.name, size_of(evaluated, linear)
        if not sound:
            require_oriented(evaluated, self._co)

    @cached_property
    def _co(self) -> Array:
        return coordinates(self._object)

    def vertices_near(self, point: Point, radius: float, most: int | None = None) -> Array:
        """The vertices (n, 3) in the world within `radius` of a world point.

        If these are more than `most`, there is only each second, third, ... of them.
        """
        # A sphere in the world is an ellipsoid in the object, which its longest axis bounds.
        reach, at = radius * np.linalg.norm(self._inverse, ord=2), np.array(self._to_local(point), np.float32)

        def within(co: Array) -> Array:
            local = co - at
            return co[np.einsum("ij,ij->i", local, local) <= reach**2]

        parts = np.array_split(self._co, len(self._co) // VERTICES_AT_ONCE + 1)
        near = np.concatenate([within(part) for part in parts])
        stride = 1 if most is None else max(math.ceil(len(near) / most), 1)
        return near[::stride] @ self._linear.T + self._origin

    def project(self, location: Point) -> tuple[Triple, Triple, float]:
        """The (point, unit normal) of the mesh nearest to the world `location`, and the distance.

        At a vertex no face is nearer than the others, so the normal there is the vertex's, unless that is on
        a crease.
        """
        found = self._walk(location, location)
        gram = self._linear.T @ self._linear
        stretched = not np.allclose(gram, gram[0, 0] * np.eye(3), rtol=0.0, atol=1e-4 * gram[0, 0])
        if stretched and found[2] > 1e-3 * self.size:
            # In a stretched object, the nearest point may be on another sheet than in the world.
            offsets = self._co @ self._linear.T - np.subtract(location, self._origin)
            nearest = self._co[np.argmin(np.einsum("ij,ij->i", offsets, offsets))]
            found = min(found, self._walk(self._to_world(nearest.tolist()), location), key=lambda f: f[2])
        point, normal, distance = found
        return point, self._vertex_normal(point, normal), distance

    def _vertex_normal(self, point: Triple, normal: Triple) -> Triple:
        """The unit normal of the vertex at a world point, if that is like `normal`; else `normal`."""
        number = self.face_near(point)
        gaps = np.linalg.norm(self.corners_of(number) - point, axis=1)
        corner = int(np.argmin(gaps))
        if gaps[corner] > AT_VERTEX * gaps.max():
            return normal
        vertex = self._mesh.polygons[number].vertices[corner]
        mean = np.array(self._mesh.vertex_normals[vertex].vector) @ self._inverse
        mean /= max(float(np.linalg.norm(mean)), 1e-30)
        return mean.tolist() if np.dot(mean, normal) > SMOOTH else normal

    def _walk(self, start: Point, location: Point) -> tuple[Triple, Triple, float]:
        """The nearest point, downhill from the one that is nearest to `start` as the object measures.

        Each step goes to the foot of the perpendicular on the face found, as long as that is nearer.
        """
        found = self._foot(start, location)
        for _ in range(WALK):
            point, normal, distance = found
            height = np.dot(np.subtract(location, point), normal)
            ahead = self._foot(np.subtract(location, height * np.array(normal)), location)
            if ahead[2] >= (1.0 - 1e-6) * distance:
                break
            found = ahead
        return found

    def spacing(self, point: Point) -> float:
        """The distance of neighboring float32 numbers at a world point, in the world and in the mesh."""
        scale = np.linalg.norm(self._linear, axis=0).max()
        world, local = (
            np.spacing(np.abs(p).astype(np.float32)).max() for p in (point, self._to_local(point))
        )
        return float(max(world, scale * local))

    def facet(self, point: Point) -> float:
        """The longest edge of the face nearest to a world point."""
        corners = self.corners_of(self.face_near(point))
        return float(np.linalg.norm(corners - np.roll(corners, 1, axis=0), axis=1).max())

    def face_near(self, point: Point) -> int:
        """The number of the face nearest to a world point."""
        return self._closest(self._to_local(point))[3]

    def corners_of(self, number: int) -> Array:
        """The corners (k, 3) of a face in the world, in order; counterclockwise, unless it is mirrored."""
        vertices = self._mesh.vertices
        co = np.array([vertices[i].co[:] for i in self._mesh.polygons[number].vertices])
        return co @ self._linear.T + self._origin

    def _nearest(self, local: Triple) -> Any:
        """The nearest (point, normal) in object coordinates."""
        found, point, normal, _ = self._closest(local)
        return (point, normal) if found else (None, None)
