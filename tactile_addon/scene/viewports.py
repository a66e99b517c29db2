# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Whether viewports show vertices' colors and objects of a size, how to make them, and whether one drags."""

from collections.abc import Iterator
from typing import Any

import bpy

NEAREST, FARTHEST = 0.02, 20.0  # The distances, in sizes of an object, between which it is shown.
# If a view is clipped nearer than at this share of the size, which Blender itself does not do below 1 cm, its
# depths are so coarse that a patch and the mesh run through each other.
COARSE, OWN = 5e-4, 0.01
GESTURES = ("TRANSFORM_OT_", "TACTILE_OT_")


def shows_colors(space: Any) -> bool:
    """Whether a 3D viewport draws the colors of vertices."""
    kind = space.shading.type
    return kind in ("MATERIAL", "RENDERED") or (kind == "SOLID" and space.shading.color_type == "VERTEX")


def has_gesture() -> bool:
    """Whether something is being dragged in any window, which then keeps pointers to it."""
    windows = bpy.context.window_manager.windows
    names = [operator.bl_idname for window in windows for operator in window.modal_operators]
    return any(name.startswith(GESTURES) or "_move" in name for name in names)


def _viewports() -> Iterator[Any]:
    """The spaces of all 3D viewports. A file made without a window has some, too, in which it is opened."""
    areas = (area for screen in bpy.data.screens for area in screen.areas if area.type == "VIEW_3D")
    return (area.spaces.active for area in areas)


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
        space.clip_start = min(max(space.clip_start, min(COARSE * size, OWN)), NEAREST * size)
        space.clip_end = max(space.clip_end, FARTHEST * size)
