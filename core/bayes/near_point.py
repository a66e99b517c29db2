# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Whether the contacts near the point show other curvatures than the patch has.

Not in the paper. A patch has the curvatures of a quartic over QUARTIC_SHARE of the radius. Where a tip or a
fold bends the patch, the quartic of least squares of the contacts within this share has other ones.
"""

import numpy as np

from ..arguments import Array
from ..lapack import solved_square
from ..patch.monge import TERMS, monomials
from .evidence import ROUNDING
from .posterior import QUARTIC_SHARE, SurfacePosterior, bent, normal_curvature_variances, terms_to
from .prior import FREE

CONTACTS_PER_RANK = 1.5  # The least number of contacts, as a multiple of the rank, that shows residuals.


def curvature_contradiction(contacts: Array, posterior: SurfacePosterior, covariance: Array) -> float:
    """The deviations, at most, by which a normal curvature is off that of the contacts near the point.

    contacts : (n, 3), without the reference point, in the frame and in unit radius
    posterior : of all contacts; covariance : (3, 3), of its coefficients of x^2, xy and y^2

    It is 0 if there are too few contacts to judge.
    """
    near = contacts[np.hypot(contacts[:, 0], contacts[:, 1]) <= QUARTIC_SHARE]
    if not len(near):
        return 0.0
    basis = monomials(near, TERMS)[:, : terms_to(4)]
    gram = basis.T @ basis
    inverse = solved_square(gram + ROUNDING * gram.trace() * np.eye(len(gram)), np.eye(len(gram)))
    rank = float((inverse * gram).sum())
    if len(near) < CONTACTS_PER_RANK * rank:
        return 0.0
    solution = inverse @ basis.T
    quartic, rows = solution @ near[:, 2], solution[2:FREE]
    left = near[:, 2] - basis @ quartic
    variance = float(left @ left) / (len(near) - rank)
    off = quartic[2:FREE] - posterior.polynomial[2:FREE]
    variances = normal_curvature_variances(covariance + variance * rows @ rows.T)
    return float((np.abs(bent() @ off) / np.sqrt(np.maximum(variances, 1e-300))).max())
