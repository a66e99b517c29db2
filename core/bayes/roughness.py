# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""How rough a surface is, by one linear solve: what a sextic of usual waviness leaves of its contacts.

A fit takes twenty times as long, and is of little use where contacts are too rough for a sure patch.
"""

import math

import numpy as np

from ..arguments import Array
from ..lapack import solved_definite
from ..patch.monge import TERMS, monomials
from ..verdict import SIGNIFICANT
from .joint_fit import MISFIT
from .prior import USUAL_VARIANCES

# benchmarks.extents of e20b52a judged this.
EXPLAINED_TERMS = 15  # Three curves show this many of the 27 terms, which take as many degrees of freedom.


def roughness(contacts: Array, noise: float) -> float:
    """How far contacts (n, 3), relative to the point, are off a sextic of usual waviness, in units of L.

    The sextic is over the plane through the point that is nearest to them. The variance that `noise` may have
    is left out, up to SIGNIFICANT standard deviations of its estimate.
    """
    local = contacts @ np.linalg.eigh(contacts.T @ contacts)[1][:, ::-1]
    radius = math.sqrt((local[:, :2] ** 2).sum(axis=1).max())
    if radius == 0.0:
        return 0.0
    local /= radius
    basis, heights = monomials(local, TERMS), local[:, 2]
    precision = basis.T @ basis
    precision.flat[:: len(TERMS) + 1] += MISFIT**2 / USUAL_VARIANCES
    off = heights - basis @ solved_definite(precision, heights @ basis)
    freedom = max(len(off) - EXPLAINED_TERMS, 1)
    explained = (1.0 + SIGNIFICANT * math.sqrt(2.0 / freedom)) * (noise / radius) ** 2
    return math.sqrt(max(float(off @ off) / freedom - explained, 0.0))
