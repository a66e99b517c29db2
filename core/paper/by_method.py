# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The coefficients of (1) by one of the paper's methods (IV), in unit radius."""

import numpy as np

from ..arguments import Array
from ..contours.curves import Curves
from ..patch.domain import Domain
from . import least_squares, tagc

PAPER_METHODS = ("tagc", "quadratic-variation", "least-squares")
SOLVERS = ("fast", "descent")
# Default weights lambda L^2. That of TAGC is the paper's, 9.99/mm^2 at L = 10 mm. The paper minimizes
# quadratic variation subject to f = 0, to which 1e5 comes near.
WEIGHTS = {"tagc": 1e3, "quadratic-variation": 1e5}


def coefficients(
    curves: Curves,
    k1: float,
    k2: float,
    degree: int,
    domain: Domain,
    method: str,
    weight: float | None,
    solver: str,
) -> tuple[Array, bool]:
    """The coefficients (m,) of (1) for the curves of one touch and these curvatures; whether it converged.

    weight : lambda L^2, None for the default of WEIGHTS; degree, method and solver are those of `reconstruct`
    """
    data = least_squares.problem(k1, k2, degree, curves.points[curves.present])
    if method == "least-squares":
        return least_squares.least_squares(data), True
    weight = WEIGHTS[method] if weight is None else weight
    if method == "quadratic-variation":
        return least_squares.quadratic_variation(data, domain, weight), True
    objective = tagc.Objective(data, domain, weight)
    if solver == "descent":
        return tagc.descent_minimum(objective, least_squares.tagc_start(data, _half_curves(curves)))
    # On convex surfaces (9) has many minima, and starting from the quadric leads to lower ones.
    return tagc.newton_minimum(objective, np.zeros(data.basis.shape[1]))


def _half_curves(curves: Curves) -> list[Array]:
    """The contacts (n_i, 3) of each half curve, from the point outward; half curves are sorted by azimuth."""
    halves = []
    for points, present, along, (x, y, _) in zip(
        curves.points, curves.present, curves.along, curves.tangents, strict=True
    ):
        halves.append((np.arctan2(-y, -x), points[present & (along < 0.0)][::-1]))
        halves.append((np.arctan2(y, x), points[present & (along > 0.0)]))
    return [half for _, half in sorted(halves, key=lambda half: half[0]) if len(half)]
