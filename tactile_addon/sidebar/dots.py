# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Icons for the rows of the sampling planes: dots in the colors of their handles and curves."""

from typing import Any

import bpy.utils.previews
import numpy as np

from ..viewport.curves import PLANE_COLORS

SIDE, RADIUS = 32, 10.0  # of the icon and of its dot, in pixels
_icons = None


def dot(plane: int) -> int:
    """The icon's number for the plane with this index."""
    return _icons[str(plane)].icon_id


def register() -> None:
    global _icons
    _icons = bpy.utils.previews.new()
    x = np.arange(SIDE) - 0.5 * (SIDE - 1)
    cover = np.clip(RADIUS + 0.5 - np.hypot(x, x[:, None]), 0.0, 1.0)
    for plane, color in enumerate(PLANE_COLORS):
        icon: Any = _icons.new(str(plane))
        icon.icon_size = icon.image_size = SIDE, SIDE
        pixels = np.dstack([*(c * cover for c in color), cover]).ravel()
        icon.icon_pixels_float = icon.image_pixels_float = pixels.tolist()


def unregister() -> None:
    bpy.utils.previews.remove(_icons)
