# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The coefficients of (1) from the contacts (IV): least squares, quadratic variation, and the start of TAGC.

Everything here is in unit radius and in the Darboux frame, and kappa1 and kappa2 are known. So lambda is a
pure number, the weight of the mean square error f against a curvature integral over the domain.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..arguments import Array
from ..patch.domain import GRID, Domain
from ..patch.monge import PARTIALS, MongePatch, derived_monomials, exponents, monomials


@dataclass(frozen=True, eq=False)
class Problem:
    """Equation (1) at n contacts: basis (n, m) @ coefficients (m,) ~ remainder (n,) above the quadric."""

    quadric: MongePatch
    degree: int
    basis: Array
    remainder: Array


def problem(k1: float, k2: float, degree: int, points: Array) -> Problem:
    """The problem (5) for the terms of degree 3 to `degree` at local contacts (n, 3)."""
    quadric = MongePatch(k1, k2, np.empty(0))
    x, y, z = points.T
    return Problem(quadric, degree, monomials(points, exponents(3, degree)), z - quadric.height(x, y))


def condition_number(basis: Array) -> float:
    """The largest over the smallest singular value of a basis, or 1e16 if it does not have full rank."""
    singular = np.linalg.svd(basis, compute_uv=False)
    return float(singular[0] / max(singular[-1], 1e-16 * singular[0])) if singular.size else 1.0


def least_squares(data: Problem) -> Array:
    """The minimum of f(a), equation (5); only what rounding leaves is cut off."""
    return np.linalg.lstsq(data.basis, data.remainder, rcond=None)[0]


def quadratic_variation(data: Problem, domain: Domain, weight: float) -> Array:
    """The minimum of the integral of z_xx^2 + 2 z_xy^2 + z_yy^2 plus lambda f(a) (V), a linear solve."""
    bends, quadric_bends, h = on_grid(data, domain, PARTIALS[3:])
    factors = h * np.sqrt([1.0, 2.0, 1.0])
    share = np.sqrt(weight / len(data.basis))
    rows = [share * data.basis, *(f * bend.T for f, bend in zip(factors, bends, strict=True))]
    target = np.concatenate([share * data.remainder, (-factors[:, None] * quadric_bends).ravel()])
    return np.linalg.lstsq(np.vstack(rows), target, rcond=None)[0]


def on_grid(data: Problem, domain: Domain, orders: list[tuple[int, int]]) -> tuple[Array, Array, float]:
    """k derivatives of the terms, (k, terms, m), and the quadric, (k, m), on the m points of (8); and h."""
    points, h = domain.grid(GRID)
    terms = derived_monomials(points, exponents(2, data.degree), orders).swapaxes(1, 2)
    quadric_bends = 0.5 * (data.quadric.k1 * terms[:, 0] + data.quadric.k2 * terms[:, 2])
    return terms[:, 3:], quadric_bends, h


def tagc_start(data: Problem, half_curves: Sequence[Array]) -> Array:
    """The start a(0): (5) over the contacts and artificial points between them (IV-B).

    half_curves : (n_i, 3) each, outward from the reference point, sorted by azimuth

    The paper leaves the artificial points open. Here a line joins the k-th contacts of neighboring half
    curves, and is cut at 1/4, 1/2 and 3/4.
    """
    between = []
    for one, other in zip(half_curves, [*half_curves[1:], half_curves[0]], strict=True):
        pairs = min(len(one), len(other))
        between += [(1.0 - t) * one[:pairs] + t * other[:pairs] for t in (0.25, 0.5, 0.75)]
    artificial = problem(data.quadric.k1, data.quadric.k2, data.degree, np.vstack(between))
    basis = np.vstack([data.basis, artificial.basis])
    return np.linalg.lstsq(basis, np.concatenate([data.remainder, artificial.remainder]), rcond=None)[0]
