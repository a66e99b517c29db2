# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Which mesh is below the mouse, and where."""

from collections.abc import Iterator

import bpy
from mathutils import Matrix, Vector

from ..probes import probe
from ..scene import patch_record
from ..touch.surface import MeshSurface
from ..touch.types import Object, Point
from .mouse import mouse_ray, viewport_below

LAYERS = 64  # The most patches and hidden objects through which the mouse reaches.
MANY_FACES = 200_000  # The first touch of a mesh with more faces takes a noticeable time.


def large_meshes(context: bpy.types.Context) -> set[str]:
    """Names of the visible objects whose first touch takes a noticeable time."""
    depsgraph = context.evaluated_depsgraph_get()
    meshes: Iterator[Object] = (
        obj for obj in context.view_layer.objects if obj.type == "MESH" and obj.visible_get()
    )
    return {obj.name for obj in meshes if len(obj.evaluated_get(depsgraph).data.polygons) > MANY_FACES}


def point_below(
    context: bpy.types.Context, event: bpy.types.Event
) -> tuple[Object, list[float], Vector] | None:
    """(object, location, direction toward the eye) of the mesh below the mouse, or None if there is none.

    Raises ValueError for an object that cannot be touched.
    """
    viewport = viewport_below(context, event)
    if viewport is None:
        return None
    space, region, view = viewport
    eye, direction = mouse_ray(region, view, event)
    # An orthographic view also shows what is behind its origin.
    start = eye if view.is_perspective else eye - space.clip_end * direction
    depsgraph = context.evaluated_depsgraph_get()
    cast = context.scene.ray_cast
    for _ in range(LAYERS):
        hit, point, _, _, found, matrix = cast(depsgraph, start, direction)
        if not hit:
            return None
        obj = _touched_by_map(found.original, space)
        if not probe.is_result(obj) and (obj != found.original or obj.visible_in_viewport_get(space)):
            if obj == found.original:  # A map's own transform differs from its source's by rounding.
                _require_touchable(obj, matrix)
            # The ray is cast again from close by, because from far away it is not exact.
            surface = MeshSurface(obj, depsgraph)
            depth = (point - eye).dot(direction) - surface.size
            start = eye + (max(depth, 0.0) if view.is_perspective else depth) * direction
            felt = surface.ray_cast(start, direction, 2.0 * surface.size)
            place: Point = point if felt is None else felt[0]
            return obj, list(place), -direction
        # The ray goes on behind the object by more than rounding. From far away that would be more than a
        # small object, so the place is found again from close by.
        back = 1e-3 * (point - start).length
        hit, near, *_ = cast(depsgraph, point - back * direction, direction)
        start = (near if hit else point) + 1e-5 * max(back, point.length) * direction
    return None


def _touched_by_map(obj: Object, space: bpy.types.SpaceView3D) -> Object:
    """The object that a map or a whole object was made from, if that is visible; else `obj` itself."""
    record = patch_record.touched_record(obj)
    source = record and bpy.data.objects.get(record["source"])
    return obj if source is None or source.visible_in_viewport_get(space) else source


def _require_touchable(obj: Object, matrix: Matrix) -> None:
    """Raises ValueError if a ray has hit what cannot be touched: an instance, or another type than a mesh."""
    if obj.type != "MESH":
        raise ValueError(f'"{obj.name}" is not a mesh: convert it to one first')
    if matrix != obj.matrix_world:
        raise ValueError(f'This is an instance of "{obj.name}": make it real to touch it')
