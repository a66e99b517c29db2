# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Whether a patch fits into single precision, which Blender's meshes, attributes and places have."""

import numpy as np

# The squares of lengths between these, and of their inverses, are numbers in single precision.
LARGEST_SINGLE, SMALLEST_SINGLE = 1e15, 1e-15


def require_single(result):
    """Raises ValueError for a patch too large, too small or too far away for Blender's numbers."""
    reach = result.radius + float(np.abs(result.frame.origin).max())
    if not (result.radius >= SMALLEST_SINGLE and reach <= LARGEST_SINGLE):
        raise ValueError(
            f"The patch has a radius of {result.radius:.3g} and reaches to {reach:.3g}, and "
            f"Blender's numbers range from {SMALLEST_SINGLE:g} to {LARGEST_SINGLE:g}: use another "
            "unit of length"
        )
