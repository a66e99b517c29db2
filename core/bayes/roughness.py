# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""How rough a surface is, by one linear solve: what a sextic of usual waviness leaves of what was felt.

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
# A slope that is off by one counts as a height off by this share of L: with 0, and as many fits, touches of
SLOPE = 0.05  # scans have 3 % less area.
NOISY = 1.5  # Contacts may be off by this multiple of their noise for no other reason.


def roughness(contacts: Array, normals: Array, noise: float) -> float:
    """How far contacts (n, 3), relative to the point, are off a sextic of usual waviness, in units of L.

    normals : (n, 3), unit normals of the surface, 0 where unknown; how far they are off counts, too

    The sextic is over the plane through the point that is nearest to the contacts, and is fitted to them
    alone. What `noise` explains is left out.
    """
    axes = np.linalg.eigh(contacts.T @ contacts)[1][:, ::-1]
    local = contacts @ axes
    radius = math.sqrt((local[:, :2] ** 2).sum(axis=1).max())
    if radius == 0.0:
        return 0.0
    local /= radius
    weights, expected = np.ones((1, len(local))), np.zeros((1, len(TERMS)))
    data = sextics(local[None], weights, expected, SLOPE * (normals @ axes)[None], np.zeros(1))
    usual = Hyperparameters(USUAL_VARIANCES[None], np.array([MISFIT]))
    mean = mean_given(data._replace(slopes=np.zeros_like(data.slopes)), usual)
    off, steepness = data.residuals(mean)[0], np.append(mean[0], -1.0)
    squares = float(off @ off + steepness @ data.slopes[0] @ steepness)
    variance = squares / max(len(off) - EXPLAINED_TERMS, 1)
    return math.sqrt(max(variance - (NOISY * noise / radius) ** 2, 0.0))
