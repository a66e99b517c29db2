# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""How rough a surface is, by one linear solve: what a sextic of usual waviness leaves of its contacts.

A fit takes twenty times as long and tells no more where this alone forbids to trust it.
"""

import math

import numpy as np

from ..arguments import Array
from ..patch.monge import TERMS
from .evidence import USUAL_WAVINESS, Hyperparameters, prior_variances
from .joint_fit import MISFIT
from .linear_system import linear_system, solution

EXPLAINED_TERMS = 15  # of the 27, that three curves show: so many contacts a sextic goes through by itself
NOISY = 1.5  # times their noise, that contacts are off for no other reason


def roughness(contacts: Array, noise: float) -> float:
    """The deviation of contacts (n, 3), relative to the reference point, from a sextic, as a share of L.

    In the plane through the point that is nearest to them; less what noise, their deviation, explains of it.
    """
    local = contacts @ np.linalg.eigh(contacts.T @ contacts)[1][:, ::-1]
    radius = math.sqrt((local[:, :2] ** 2).sum(axis=1).max())
    if radius == 0.0:
        return 0.0
    local /= radius
    nothing, usual = np.zeros((1, len(TERMS))), prior_variances(np.array([USUAL_WAVINESS]))
    system = linear_system(local[None], np.ones((1, len(local))), nothing, local[None, :0])
    off = system.residuals(solution(system, Hyperparameters(usual, usual, np.array([MISFIT]))))[0]
    variance = float(off @ off) / max(len(off) - EXPLAINED_TERMS, 1)
    return math.sqrt(max(variance - (NOISY * noise / radius) ** 2, 0.0))
