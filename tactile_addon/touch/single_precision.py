# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Whether a surface fits into single precision, which Blender's meshes, attributes and places have."""

import numpy as np

from .types import Array

# The squares of lengths between these, and of their inverses, are numbers in single precision.
LARGEST_SINGLE, SMALLEST_SINGLE = 1e15, 1e-15
PLACE_ROUNDING = 0.1  # Far from the origin rounding may move a surface by this share of its radius.


def require_single(what: str, radius: float, place: Array) -> None:
    """Raises ValueError for a surface too large, too small or too far away for Blender's numbers.

    what : a word for it; radius : a length; place : (3,), its middle in the world
    """
    far = float(np.abs(place).max())
    if not (radius >= SMALLEST_SINGLE and radius + far <= LARGEST_SINGLE):
        raise ValueError(
            f"The {what} has a radius of {radius:.3g} and reaches to {radius + far:.3g}, and "
            f"Blender's numbers range from {SMALLEST_SINGLE:g} to {LARGEST_SINGLE:g}: use another "
            "unit of length"
        )
    gap = float(np.spacing(np.float32(far)))
    if gap > PLACE_ROUNDING * radius:
        raise ValueError(
            f"Neighboring coordinates at the {what} are {gap:.2g} apart in single precision, too coarse for "
            f"its radius of {radius:.3g}: move the origin of the contacts nearer to them"
        )
