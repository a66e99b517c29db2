# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Which part of a 3D viewport nothing covers, such as the sidebar, headers and Blender's own gizmo."""

from collections.abc import Iterator
from typing import Any

import bpy
from mathutils import Vector

# These are pixels at resolution scale 1: width of the navigation buttons, and their height below the axes.
BUTTONS = (50, 140)
AXES = 1.25  # The axes over them take this multiple of their size in the preferences, in both directions.


def free_strip(context: bpy.types.Context, high: float, wide: float) -> tuple[float, float, float]:
    """(left, right, bottom) of the lowest strip of this height that nothing covers.

    wide : the operator's panel in the corner is beside the strip if so much is left, else the strip is above
    """
    left, right, bottom, top = _uncovered(context)
    right -= max((width for width, tall in _navigation(context) if high > top - bottom - tall), default=0.0)
    for x, y, hud in _others(context):
        if hud.type == "HUD" and right - wide < x + hud.width:
            bottom = max(bottom, y + hud.height)
    return left, right, bottom


def is_free(context: bpy.types.Context, place: Vector | None, margin: float) -> bool:
    """Whether a place of the region is in the view and farther than a margin from all that covers it."""
    if place is None:
        return False
    left, right, bottom, top = _uncovered(context)
    if not (left + margin < place.x < right - margin and bottom + margin < place.y < top - margin):
        return False
    boxes = [(right - wide, top - tall, right, top) for wide, tall in _navigation(context)]
    huds = ((x, y, other) for x, y, other in _others(context) if other.type == "HUD")
    boxes += [(x, y, x + hud.width, y + hud.height) for x, y, hud in huds]
    return not any(
        low_x - margin < place.x < high_x + margin and low_y - margin < place.y < high_y + margin
        for low_x, low_y, high_x, high_y in boxes
    )


def _uncovered(context: bpy.types.Context) -> tuple[float, float, float, float]:
    """(left, right, bottom, top) of the part of the region between those at its sides."""
    others = list(_others(context))
    left = max([0.0, *(x + other.width for x, _, other in others if other.alignment == "LEFT")])
    right = min([float(context.region.width), *(x for x, _, other in others if other.alignment == "RIGHT")])
    bottom = max([0.0, *(y + other.height for _, y, other in others if other.alignment == "BOTTOM")])
    top = min([float(context.region.height), *(y for _, y, other in others if other.alignment == "TOP")])
    return left, right, bottom, top


def _others(context: bpy.types.Context) -> Iterator[tuple[float, float, bpy.types.Region]]:
    """The other regions that are shown, and where they begin as seen from the corner of the context's."""
    for other in context.area.regions:
        if other.type != "WINDOW" and min(other.width, other.height) > 1:
            yield other.x - context.region.x, other.y - context.region.y, other


def _navigation(context: bpy.types.Context) -> list[tuple[float, float]]:
    """Widths and heights, from the corner of what is uncovered on, of the navigation's axes and buttons."""
    space: Any = context.space_data
    if not (space.show_gizmo and space.show_gizmo_navigate):
        return []
    scale, size = context.preferences.system.ui_scale, context.preferences.view.gizmo_size_navigate_v3d
    axes = AXES * scale * size
    return [(axes, axes), (BUTTONS[0] * scale, axes + BUTTONS[1] * scale)]
