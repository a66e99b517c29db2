# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The 3D viewport below the mouse, the line from there into the scene, and hints on what its buttons do."""

from collections.abc import Iterable
from typing import Any

import bpy
from mathutils import Vector

WIDE = ("EVENT_ESC", "EVENT_CTRL")  # These icons reach into the text on their right.


def draw_hints(layout: bpy.types.UILayout, hints: Iterable[tuple[Any, str]]) -> None:
    """Draws hints, (icon, text) each, on mouse and keys in the status bar."""
    for icon, text in hints:
        if icon in WIDE:
            layout.label(icon=icon)
            layout.separator()
            layout.label(text=text)
        else:
            layout.label(text=text, icon=icon)


def is_over(region: bpy.types.Region, x: float, y: float) -> bool:
    """Whether a place of the window, in pixels, is in a region."""
    return 0 <= x - region.x < region.width and 0 <= y - region.y < region.height


def viewport_below(
    context: bpy.types.Context, event: bpy.types.Event
) -> tuple[Any, bpy.types.Region, Any] | None:
    """(space, region, view) of the 3D viewport below the mouse, or None if it is over anything else."""
    for area in context.screen.areas:
        inside = [region for region in area.regions if is_over(region, event.mouse_x, event.mouse_y)]
        if area.type == "VIEW_3D" and inside and all(region.type == "WINDOW" for region in inside):
            return area.spaces.active, inside[0], inside[0].data
    return None


def mouse_ray(
    region: bpy.types.Region, view: bpy.types.RegionView3D, event: bpy.types.Event
) -> tuple[Vector, Vector]:
    """(origin, direction) of the line below the mouse in a viewport, in the world.

    The functions of view3d_utils invert the whole projection. This does not, because it would be off by many
    pixels if the clipping range is a million times as long as what is seen.
    """
    x = 2.0 * (event.mouse_x - region.x) / region.width - 1.0
    y = 2.0 * (event.mouse_y - region.y) / region.height - 1.0
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
