# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What is below the mouse: viewport, line into the scene and mesh; and hints on what its buttons do."""

from collections.abc import Iterable, Sequence
from typing import Any

import bpy
from mathutils import Matrix, Vector

from ..probes import probe
from ..scene import patch_record
from ..touch.surface import MeshSurface
from ..touch.types import Object, Point

LAYERS = 64  # The most patches and hidden objects through which the mouse reaches.
MANY_FACES = 200_000  # The first touch of a mesh with more faces takes a noticeable time.


def draw_hints(layout: bpy.types.UILayout, hints: Iterable[tuple[Any, str]]) -> None:
    """Draws hints, (icon, text) each, on mouse and keys in the status bar."""
    for icon, text in hints:
        layout.label(text="", icon=icon)
        layout.label(text=f" {text}")  # Icons of words, such as Esc, reach to the right.


def place_of(event: bpy.types.Event) -> tuple[int, int]:
    """The place of the mouse in the window, in pixels."""
    return event.mouse_x, event.mouse_y


def is_over(region: bpy.types.Region, x: float, y: float) -> bool:
    """Whether a place of the window, in pixels, is in a region."""
    return 0 <= x - region.x < region.width and 0 <= y - region.y < region.height


def viewport_below(
    context: bpy.types.Context, mouse: Sequence[float]
) -> tuple[Any, bpy.types.Region, Any] | None:
    """(space, region, view) of the 3D viewport at a place of the window, or None if that is anything else."""
    for area in context.screen.areas:
        inside = [region for region in area.regions if is_over(region, *mouse)]
        if area.type == "VIEW_3D" and inside and all(region.type == "WINDOW" for region in inside):
            return area.spaces.active, inside[0], inside[0].data
    return None


def mouse_ray(
    region: bpy.types.Region, view: bpy.types.RegionView3D, mouse: Sequence[float]
) -> tuple[Vector, Vector]:
    """(origin, direction) of the line below a place of the window in a viewport, in the world.

    The functions of view3d_utils invert the whole projection. This does not, because it would be off by many
    pixels if the clipping range is a million times as long as what is seen.
    """
    x = 2.0 * (mouse[0] - region.x) / region.width - 1.0
    y = 2.0 * (mouse[1] - region.y) / region.height - 1.0
    window: Any = view.window_matrix
    to_world: Any = view.view_matrix.inverted()
    if view.is_perspective:
        ahead = Vector(((x + window[0][2]) / window[0][0], (y + window[1][2]) / window[1][1], -1.0))
        return to_world.translation, (to_world.to_3x3() @ ahead).normalized()
    aside = Vector(((x - window[0][3]) / window[0][0], (y - window[1][3]) / window[1][1], 0.0))
    return to_world @ aside, -to_world.col[2].xyz.normalized()


def line_of_sight(view: bpy.types.RegionView3D, point: Vector) -> Vector:
    """The direction from the eye to a point of the world."""
    to_world: Any = view.view_matrix.inverted_safe()
    if view.is_perspective:
        return (point - to_world.translation).normalized()
    return -to_world.col[2].xyz.normalized()


def large_meshes(context: bpy.types.Context) -> set[str]:
    """Names of the visible objects whose first touch takes a noticeable time."""
    depsgraph = context.evaluated_depsgraph_get()
    visible: list[Object] = [obj.evaluated_get(depsgraph) for obj in context.visible_objects]
    return {o.name for o in visible if o.type == "MESH" and len(o.data.polygons) > MANY_FACES}


def point_below(
    context: bpy.types.Context, mouse: Sequence[float]
) -> tuple[Object, list[float], Vector] | None:
    """(object, location, direction toward the eye) of the mesh at a place of the window, or None.

    Raises ValueError for an object that cannot be touched.
    """
    viewport = viewport_below(context, mouse)
    if viewport is None:
        return None
    space, region, view = viewport
    eye, direction = mouse_ray(region, view, mouse)
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
