# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The mesh of an object as Blender evaluates it: its vertices, transform, checksum; a look at its faces."""

import math
import zlib
from collections.abc import Callable, Sequence
from typing import Any

import bpy
import numpy as np

from ... import core
from .types import Array, Object, Point, Triple

SHORT_SHARE = 0.05  # In most cases the mesh is within this share of the reach.
FLATTEST = 1e6  # Scales along an object's axes differ by less, so that single precision holds its inverse.
SEEN = 100  # The faults of this many shapes are kept, because a mesh of a million faces takes a second.
# Where vertices are rounded by more of the size, faces coincide: touches say so by themselves.
ROUNDED = 1e-3
FARTHEST_VERTEX = 1e15  # Vertices are no farther away, so that single precision can hold squared distances.
_faults: dict[tuple[int, int], str] = {}


def read_array(items: Any, key: str, width: int = 1, dtype: Any = np.float32) -> Array:
    """The property `key` of n items: (n,), or (n, width) for vectors."""
    values = np.empty(width * len(items), dtype=dtype)
    items.foreach_get(key, values)
    return values if width == 1 else values.reshape(-1, width)


def checksum_of(obj: Object, depsgraph: bpy.types.Depsgraph) -> int:
    """A checksum of the shape of the evaluated mesh in the object's coordinates.

    Raises ValueError, with a sentence, if the object cannot be touched.
    """
    evaluated, _, _ = evaluated_object(obj, depsgraph)
    return zlib.crc32(coordinates(evaluated).data)


def is_disabled(obj: Object) -> bool:
    """Whether an object is disabled in viewports. As the parent of another it may still be evaluated."""
    return obj.hide_viewport or (
        bool(obj.users_collection) and all(found.hide_viewport for found in obj.users_collection)
    )


def disabled(obj: Object) -> ValueError:
    """The error to raise for an object that Blender has not evaluated."""
    require_in_scene(obj)
    return ValueError(
        f'"{obj.name}" is disabled in viewports or excluded from the view layer: enable it there'
    )


def require_in_scene(obj: Object) -> None:
    """Raises ValueError, with a sentence, if an object is only in another scene than this one."""
    scenes = [scene.name for scene in obj.users_scene]
    if scenes and bpy.context.scene.name not in scenes:
        raise ValueError(
            f'"{obj.name}" is in the scene "{scenes[0]}": go there, or choose an object of this scene'
        )


def evaluated_object(obj: Object, depsgraph: bpy.types.Depsgraph) -> tuple[Object, Array, Array]:
    """The evaluated object and its transform: linear part and origin.

    Raises ValueError, with a sentence, if it cannot be touched.
    """
    if obj.type != "MESH":
        raise ValueError(f'"{obj.name}" is not a mesh: select a mesh object, or convert this one')
    if is_disabled(obj):
        raise disabled(obj)
    evaluated = obj.evaluated_get(depsgraph)
    if obj.data.is_editmode:
        # The evaluated mesh is an empty shell around the edited one until `to_mesh` makes it.
        evaluated.to_mesh()
        evaluated.to_mesh_clear()
    try:  # This ray starts beyond everything, so it needs an evaluated mesh, but no tree of its faces.
        evaluated.ray_cast((1e18, 0.0, 0.0), (1.0, 0.0, 0.0), distance=1e-30, depsgraph=depsgraph)
    except RuntimeError as error:
        raise disabled(obj) from error
    matrix = np.array(evaluated.matrix_world, dtype=float)
    require_invertible(obj.name, matrix)
    if not len(evaluated.data.polygons):
        raise ValueError(f'"{obj.name}" has no faces to touch: add some')
    return evaluated, matrix[:3, :3], matrix[:3, 3]


def coordinates(evaluated: Object) -> Array:
    """The coordinates of all vertices in an evaluated object, (n, 3) float32.

    Raises ValueError, with a sentence, if any is at a place that cannot be touched.
    """
    mesh, matrix = evaluated.data, np.array(evaluated.matrix_world, dtype=float)
    position: Any = mesh.attributes.get("position")  # It is 30 times as fast. There is none in edit mode.
    co = read_array(mesh.vertices, "co", 3) if position is None else read_array(position.data, "vector", 3)
    largest = max(float(co.max()), -float(co.min()))  # If any is NaN, both are.
    if not math.isfinite(largest):
        wrong = np.count_nonzero(~np.isfinite(co).all(axis=1))
        raise ValueError(
            f'"{evaluated.name}" has vertices whose coordinates are not finite, {wrong} of {len(co)}: delete '
            "them, or correct its modifiers"
        )
    reach = np.max([largest, largest * np.abs(matrix[:3, :3]).max(), np.abs(matrix[:3, 3]).max()])
    if not reach <= FARTHEST_VERTEX:  # NaN fails every comparison, so it is refused, too.
        raise ValueError(
            f'"{evaluated.name}" reaches farther than {FARTHEST_VERTEX:g} from the origin: scale it down'
        )
    return co


def size_of(evaluated: Object, linear: Array) -> float:
    """The longest edge of the object's bounding box, in the world."""
    edges = np.ptp(np.array(evaluated.bound_box), axis=0)
    return float((edges * np.linalg.norm(linear, axis=0)).max())


def require_invertible(name: str, matrix: Array) -> None:
    """Raises ValueError, with a sentence, if the transform (4, 4) is not finite or has no inverse."""
    if not np.isfinite(matrix).all():
        raise ValueError(f'"{name}" has a location, rotation or scale that is not finite: set it again')
    if not np.linalg.cond(matrix[:3, :3]) < FLATTEST:  # NaN, as of zeros, fails every comparison.
        raise ValueError(
            f'"{name}" has a scale of 0 in some direction, or {FLATTEST:g} times less than in another: '
            "give it another scale"
        )


def require_oriented(evaluated: Object, co: Array) -> None:
    """Raises ValueError, with a sentence, if faces of an evaluated object point inward or are doubled.

    Contacts need normals that point outward, so it is looked at before the first touch.

    co : (n, 3), the coordinates of its vertices
    """
    mesh, name = evaluated.data, evaluated.name
    if np.spacing(np.abs(co).max()) > ROUNDED * np.ptp(co, axis=0).max():
        return
    index: Any = mesh.attributes.get(".corner_vert")  # It is 100 times as fast. There is none in edit mode.
    items, key = (mesh.loops, "vertex_index") if index is None else (index.data, "value")
    corners = read_array(items, key, dtype=np.int32)
    shape = zlib.crc32(co.data), zlib.crc32(corners.data)
    if shape not in _faults:
        if len(_faults) >= SEEN:
            _faults.clear()
        starts = read_array(mesh.polygons, "loop_start", dtype=np.int32)
        _faults[shape] = core.orientation_fault(co, corners, starts)
    if _faults[shape] == core.DOUBLED:
        raise ValueError(
            f'"{name}" has faces that lie on others and face the opposite way: use Merge by Distance in Edit '
            "Mode, then Recalculate Outside"
        )
    if _faults[shape] == core.INWARD:
        raise ValueError(f'"{name}" has faces that point inward: use Recalculate Outside in Edit Mode')


class PlacedMesh:
    """A mesh that is touched in other axes than its own: it transforms rays, and what they find.

    The transform is computed in Python floats. mathutils rounds to float32, which far from the world's
    origin is coarser than the mesh, and a numpy call would take longer than the ray.

    linear, origin : (3, 3) and (3,), the transform
    cast : like ray_cast, in the mesh's own coordinates; its point is None if the ray meets nothing

    Subclasses have `_nearest`, which gives the (point, normal) nearest to a point, in the mesh's coordinates.
    """

    _nearest: Callable[[Triple], Any]

    def __init__(self, linear: Array, origin: Array, cast: Callable[[Point, Point, float], Any]) -> None:
        self._linear, self._origin, self._cast = linear, origin, cast
        self._inverse = np.linalg.inv(linear)
        self._rows, self._inverse_rows, self._normal_rows, self._at = (
            array.tolist() for array in (linear, self._inverse, self._inverse.T, origin)
        )
        # Most scans are neither moved nor turned nor scaled.
        self._is_in_place = np.array_equal(linear, np.eye(3)) and not origin.any()

    def ray_cast(self, origin: Point, direction: Point, distance: float) -> tuple[Triple, Triple] | None:
        """(point, unit normal) where the ray first meets the mesh within `distance`, or None."""
        if self._is_in_place:
            point, normal = self._cast(origin, direction, distance)
            return None if point is None or not any(normal) else (point, normal)
        local = product(self._inverse_rows, *direction)
        point, normal = self._cast(self._to_local(origin), local, distance * math.hypot(*local))
        # A face without area has no normal and cannot be felt.
        if point is None or not any(normal):
            return None
        return self._to_world(point), self._normal_to_world(normal)

    def deviations(self, points: Array, normals: Array, reach: float) -> Array:
        """Signed distances (n,) of world points to the mesh, positive outside it.

        They are measured along the unit normals (n, 3): from outside if the mesh is near, otherwise in both
        directions up to `reach`. If both meet nothing, as over a hole, the nearest point of the mesh counts.
        """
        short = SHORT_SHARE * reach  # A long ray that meets nothing takes long.
        starts, downs = points + short * normals, -normals
        rays = list(zip(starts.tolist(), downs.tolist(), strict=True))
        hits = [self.ray_cast(start, down, 2.0 * short) for start, down in rays]
        return np.array(
            [
                self._deviation(points[i], normals[i], reach)
                if hit is None
                else math.dist(rays[i][0], hit[0]) - short
                for i, hit in enumerate(hits)
            ]
        )

    def _deviation(self, point: Array, normal: Array, reach: float) -> float:
        """The signed distance of a point that the mesh is not near to along the normal."""
        point, normal, down = point.tolist(), normal.tolist(), (-normal).tolist()
        hits = [(sign, self.ray_cast(point, way, reach)) for sign, way in ((-1.0, normal), (1.0, down))]
        found = [sign * math.dist(point, hit[0]) for sign, hit in hits if hit is not None]
        if found:
            return min(found, key=abs)
        foot = self._to_world(self._nearest(self._to_local(point))[0])
        return math.copysign(math.dist(point, foot), np.dot(normal, np.subtract(point, foot)))

    def _foot(self, near: Point, location: Point) -> tuple[Triple, Triple, float]:
        """The point nearest to the world point `near` as the mesh measures, its normal, its distance."""
        point, normal = self._nearest(self._to_local(near))
        if point is None:
            raise ValueError("The location is too far away to be measured: set it on the surface")
        if not any(normal):
            raise ValueError("The location is on a face of no area: move it, or dissolve degenerate faces")
        point = self._to_world(point)
        return point, self._normal_to_world(normal), math.dist(location, point)

    def _to_world(self, point: Point) -> Triple:
        x, y, z = product(self._rows, *point)
        return x + self._at[0], y + self._at[1], z + self._at[2]

    def _to_local(self, point: Point) -> Triple:
        return product(
            self._inverse_rows, point[0] - self._at[0], point[1] - self._at[1], point[2] - self._at[2]
        )

    def _normal_to_world(self, normal: Point) -> Triple:
        """The normal by the inverse transpose: it stays outward under any scale, even one that mirrors."""
        x, y, z = product(self._normal_rows, *normal)
        length = math.hypot(x, y, z)
        return x / length, y / length, z / length


def product(rows: Sequence[Sequence[float]], x: float, y: float, z: float) -> Triple:
    """A matrix, as rows of Python floats, times a vector."""
    (a, b, c), (d, e, f), (g, h, i) = rows
    return a * x + b * y + c * z, d * x + e * y + f * z, g * x + h * y + i * z
