# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Whether the contacts near the point, by themselves, show other curvatures than the patch has.

Not in the paper. A patch has the curvatures of a quartic over QUARTIC_SHARE of the radius. Where a tip or a
fold bends the patch, the quartic of least squares of the contacts within this share has other ones.
"""

import numpy as np

from ..arguments import Array
from ..patch.monge import QUARTIC, monomials
from .posterior import QUARTIC_SHARE, SurfacePosterior, bent
from .prior import FREE

INVISIBLE = 1e-6  # Directions of smaller singular values, as a share of the largest, are invisible.
ENOUGH = 1.5  # The least number of contacts, as a multiple of the rank, that shows what a quartic leaves.


def curvature_contradiction(contacts: Array, posterior: SurfacePosterior, covariance: Array) -> float:
    """The deviations, at most, by which a normal curvature is off that of the contacts near the point.

    contacts : (n, 3), besides the reference point, in the frame and in unit radius
    posterior : of all contacts; covariance : (3, 3), of its coefficients of x^2, xy and y^2

    It is 0 if there are too few contacts to judge.
    """
    near = contacts[np.hypot(contacts[:, 0], contacts[:, 1]) <= QUARTIC_SHARE]
    basis = monomials(near, QUARTIC)[:, 1:]
    u, singular, v = np.linalg.svd(basis, full_matrices=False)
    shown = singular > INVISIBLE * singular[:1]
    rank = int(shown.sum())
    if not rank or len(near) < ENOUGH * rank:
        return 0.0
    inverse = v[shown].T / singular[shown]
    quartic = inverse @ (u[:, shown].T @ near[:, 2])
    left = near[:, 2] - basis @ quartic
    variance = float(left @ left) / (len(near) - rank)
    rows = inverse[2:FREE]
    off = quartic[2:FREE] - posterior.polynomial[2:FREE]
    directions = bent()
    variances = np.einsum("ni,ij,nj->n", directions, covariance + variance * rows @ rows.T, directions)
    return float(np.max(np.abs(directions @ off) / np.sqrt(np.maximum(variances, 1e-300))))
