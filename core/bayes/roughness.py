# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""How rough a surface is, by one linear solve: what a sextic of usual waviness leaves of its contacts.

A fit takes twenty times as long, and is of little use where contacts are too rough for a sure patch.
"""

import math

import numpy as np

from ..arguments import Array
from ..patch.monge import TERMS
from .evidence import Hyperparameters
from .joint_fit import MISFIT
from .prior import USUAL_VARIANCES
from .sextic import mean_given, sextics

# benchmarks.extents of e20b52a judged these.
EXPLAINED_TERMS = 15  # Three curves show this many of the 27 terms, which take as many degrees of freedom.
NOISY = 1.5  # Contacts may be off by this multiple of their noise for no other reason.


def roughness(contacts: Array, noise: float) -> float:
    """How far contacts (n, 3), relative to the point, are off a sextic of usual waviness, in units of L.

    The sextic is over the plane through the point that is nearest to them. What `noise` explains is left out.
    """
    local = contacts @ np.linalg.eigh(contacts.T @ contacts)[1][:, ::-1]
    radius = math.sqrt((local[:, :2] ** 2).sum(axis=1).max())
    if radius == 0.0:
        return 0.0
    local /= radius
    data = sextics(
        local[None], np.ones((1, len(local))), np.zeros((1, len(TERMS))), local[None, :0], np.zeros(1)
    )
    usual = Hyperparameters(USUAL_VARIANCES[None], np.array([MISFIT]))
    off = data.residuals(mean_given(data, usual))[0]
    variance = float(off @ off) / max(len(off) - EXPLAINED_TERMS, 1)
    return math.sqrt(max(variance - (NOISY * noise / radius) ** 2, 0.0))
