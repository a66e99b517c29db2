# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Whether a surface explains contacts: at most few are off it, and no two of these are side by side."""

import numpy as np
from numpy.typing import NDArray

from ..arguments import Array
from ..verdict import SIGNIFICANT

# At most this share of the contacts is off a surface by SIGNIFICANT deviations, and no two that are side by
# side: otherwise a rib of a 25th of the radius is an error of few contacts, and a dent that holds 2 %
# of an object's contacts is erased (benchmarks.measured --features).
FEW = 0.01


def too_far(distances: Array, stds: Array | float) -> NDArray[np.bool_]:
    """Which contacts (n,) are farther from a surface than these deviations (n,), or this one, explain."""
    far: NDArray[np.bool_] = np.abs(distances) > SIGNIFICANT * np.asarray(stds)
    return far


def are_few(far: NDArray[np.bool_], next_is_far: NDArray[np.bool_]) -> bool:
    """Whether few contacts (n,) are too far from a surface, and no two neighbors.

    next_is_far : (n,), whether a neighbor of each is too far
    """
    return not (far.mean() > FEW or (far & next_is_far).any())
