# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Whether a surface explains contacts: at most few are off it, and no two of these are side by side."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..arguments import Array

# A contact is off a surface by more than TOO_FAR deviations. At most the share FEW are, and no two that are
# side by side: otherwise a rib of a 25th of the radius is an error of few contacts (benchmarks.real), and a
# dent that holds 2 % of the contacts is erased (benchmarks.measured --features).
TOO_FAR, FEW = 5.0, 0.01


def too_far(distance: Array, std: Array, noise: Array | float) -> NDArray[np.bool_]:
    """Which contacts (n,) are off a surface by more than its deviation and their noise explain."""
    far: NDArray[np.bool_] = np.abs(distance) > TOO_FAR * np.hypot(std, noise)
    return far


def are_few(far: NDArray[np.bool_], beside: NDArray[np.bool_]) -> bool:
    """Whether few contacts are off, and none beside another.

    far : (n,), which are off
    beside : (n, k), which contacts are beside each; an index, or itself where there is none
    """
    return not (far.mean() > FEW or (far[:, None] & far[beside]).any())
