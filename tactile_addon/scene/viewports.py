# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Whether viewports show vertices' colors and objects of a size, how to make them, and whether one drags."""

from collections.abc import Iterator
from typing import Any

import bpy

NEAREST, FARTHEST = 0.02, 20.0  # The distances, in sizes of an object, between which it is shown.
# If a view is clipped nearer than at this share of the size, as Blender itself does from 20 m on, its depths
# are so coarse that a patch or a map and the mesh run through each other.
COARSE = 5e-4
GESTURES = ("TRANSFORM_OT_", "TACTILE_OT_")


def shows_colors(space: Any) -> bool:
    """Whether a 3D viewport draws the colors of vertices."""
    kind = space.shading.type
    return kind in ("MATERIAL", "RENDERED") or (kind == "SOLID" and space.shading.color_type == "VERTEX")


def has_gesture() -> bool:
    """Whether something is being dragged in any window, which then keeps pointers to it."""
    running = [each for window in bpy.context.window_manager.windows for each in window.modal_operators]
    return any(each.bl_idname.startswith(GESTURES) or "_move" in each.bl_idname for each in running)


def _viewports() -> Iterator[Any]:
    """The spaces of all 3D viewports. A file made without a window has some, too, in which it is opened."""
    for screen in bpy.data.screens:
        yield from (area.spaces.active for area in screen.areas if area.type == "VIEW_3D")


def redraw(context: bpy.types.Context, kind: str) -> None:
    """Has the regions of a kind drawn again in all viewports of the window; none while that is closed."""
    for area in context.window.screen.areas if context.window else ():
        for region in area.regions if area.type == "VIEW_3D" else ():
            if region.type == kind:
                region.tag_redraw()


def show_colors(chosen: Any = None) -> None:
    """Makes a viewport, and all that nobody has set otherwise, draw colors of vertices in Solid shading."""
    for space in _viewports():
        if space.shading.color_type == "MATERIAL":
            space.shading.color_type = "VERTEX"
    if chosen is not None and chosen.type == "VIEW_3D":
        chosen.shading.color_type = "VERTEX"


def show_size(size: float) -> None:
    """Makes all viewports show an object of this size from near by and from afar, if they do not yet."""
    for space in _viewports() if size > 0.0 else ():
        space.clip_start = min(max(space.clip_start, COARSE * size), NEAREST * size)
        space.clip_end = max(space.clip_end, FARTHEST * size)
