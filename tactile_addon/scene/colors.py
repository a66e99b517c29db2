# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The diverging colors of curvature: blue below zero, pale green at zero, red above."""

import numpy as np
from numpy.typing import ArrayLike

from ..touch.types import Array

# ColorBrewer's RdBu in nine steps (sRGB), which color-blind readers can tell apart. Its middle is not white
# but pale green, because a flat patch would look like the gray mesh around it.
COLOR_STOPS = np.array([
    (33, 102, 172), (67, 147, 195), (146, 197, 222), (209, 229, 240), (225, 250, 220),
    (253, 219, 199), (244, 165, 130), (214, 96, 77), (178, 24, 43),
]) / 255.0  # fmt: skip

UNKNOWN = (0.5, 0.5, 0.5, 1.0)  # The color of what has no value, in sRGB.


def symmetric_range(values: Array, floor: float) -> float:
    """The r of a scale -r..r: the 98th percentile of |values|, so a few wild ones do not bleach the rest."""
    return max(float(np.percentile(np.abs(values), 98)), floor) if len(values) else floor


def shades(values: ArrayLike, limit: float) -> Array:
    """The colors of values (n,) on a scale from -limit to limit, as sRGB with alpha, (n, 4)."""
    at = np.clip(np.asarray(values) / limit, -1.0, 1.0)
    srgb = np.column_stack(
        [np.interp(at, np.linspace(-1.0, 1.0, len(COLOR_STOPS)), stop) for stop in COLOR_STOPS.T]
    )
    return np.column_stack([srgb, np.ones(len(srgb))])
