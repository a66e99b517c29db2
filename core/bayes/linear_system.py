# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The linear system of joint_fit.py: contacts and measured slopes against terms under their prior."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..arguments import Array
from ..lapack import inverse_definite, solved_definite
from ..patch.monge import TERMS, monomials
from .evidence import (
    FREE_PRECISION,
    PRIOR_SCALE,
    Hyperparameters,
    NormalEquations,
    Restricted,
    evidence,
    evidence_with_slopes,
    noises,
)
from .measured_slopes import slope_equations
from .posterior import FREE, Posterior

LEAST_FREEDOM = 5.0  # Few contacts count as so many degrees of freedom, because a prior adds to them.


class System(NamedTuple):
    """Heights of n contacts ~ terms @ coefficients, all less the prior's mean; and the normal equations.

    rows : (b, 28, n), the 27 terms and the heights
    equations : the weighted products of the rows
    slopes : (b, 2n, 27), slopes @ coefficients ~ steepness (b, 2n) in units of their deviation, weighted;
        None without normals
    pivot : (b, 27), mean of the terms over the contacts, for surfaces that need not pass through the origin:
        the rows are then less their means. None for surfaces that do
    """

    rows: Array
    equations: NormalEquations
    slopes: Array | None = None
    steepness: Array | None = None
    pivot: Array | None = None

    def at(self, which: NDArray[np.bool_]) -> "System":
        """The systems of some of the b touches."""
        rows, equations, *beside = self
        some = NormalEquations(*(part[which] for part in equations))
        return System(rows[which], some, *(part if part is None else part[which] for part in beside))

    def residuals(self, coefficients: Array) -> Array:
        """What the coefficients (b, 27) do not explain of the heights, (b, n)."""
        left: Array = self.rows[:, -1] - (coefficients[:, None] @ self.rows[:, :-1])[:, 0]
        return left


def prior_mean(k1: Array, k2: Array) -> Array:
    """The prior's mean, (b, 27): the quartic and sextic of a surface that goes on with its curvatures (b,).

    With Q = (k1 x^2 + k2 y^2) / 2 and G = |grad Q|^2 they are Q G / 4 and Q G^2 / 8, as on a sphere and a
    cylinder. The coefficient of x^2 y^2 is k1 k2^2 / 4 on a torus whose parallels have the curvature k2 at
    the point, and k1^2 k2 / 4 if they have k1: the prior takes the mean of both.
    """
    return np.array([_going_on(*pair) for pair in zip(k1.tolist(), k2.tolist(), strict=True)])


def _going_on(k1: float, k2: float) -> list[float]:
    """The prior's mean of one surface, in Python floats."""
    # No surface goes on with a radius of curvature below L.
    k1, k2 = min(max(k1, -1.0), 1.0), min(max(k2, -1.0), 1.0)
    a, b = k1**2, k2**2
    mean = [0.0] * len(TERMS)
    mean[9:14:2] = k1 * a / 8.0, (k1 * b + k2 * a) / 8.0, k2 * b / 8.0
    mean[20:27:2] = (
        k1 * a**2 / 16.0,
        (2.0 * k1 * a * b + k2 * a**2) / 16.0,
        (k1 * b**2 + 2.0 * k2 * a * b) / 16.0,
        k2 * b**2 / 16.0,
    )
    return mean


def linear_system(
    local: Array, weights: Array, expected: Array, normals: Array, through: bool = True
) -> System:
    """The linear system of contacts (b, n, 3) and their weights (b, n), less the prior's means (b, 27).

    normals : (b, n, 3), measured normals over their standard deviations, or (b, 0, 3)
    through : whether the surfaces pass through the origin
    """
    b, n = weights.shape
    rows, pivot = np.empty((b, len(TERMS) + 1, n)), None
    terms = monomials(local[..., 0].ravel(), local[..., 1].ravel(), TERMS)
    rows[:, :-1] = terms.T.reshape(-1, b, n).transpose(1, 0, 2)
    np.subtract(local[..., 2], (expected[:, None] @ rows[:, :-1])[:, 0], out=rows[:, -1])
    if not through:
        means = np.einsum("bin,bn->bi", rows, weights / weights.sum(axis=1)[:, None])
        rows -= means[..., None]
        pivot = means[:, :-1]
    bordered = (rows * weights[:, None]) @ rows.transpose(0, 2, 1)
    system = System(rows, NormalEquations(bordered, (weights > 0.0).sum(axis=1, dtype=float)), pivot=pivot)
    if not normals.shape[1]:
        return system
    slopes, steepness = slope_equations(normals, local, weights)
    return system._replace(slopes=slopes, steepness=steepness - (slopes @ expected[..., None])[..., 0])


def hyperparameters(system: System, data: Restricted, floor: Array) -> Hyperparameters:
    """Waviness and noise by their evidence; `data` is what the system's heights say of the higher terms."""
    if system.slopes is None or system.steepness is None:
        return evidence(data, noises(data, floor))
    rows = np.concatenate([system.slopes, system.steepness[..., None]], axis=2)
    slopes = NormalEquations(rows.transpose(0, 2, 1) @ rows, system.equations.contacts)
    return evidence_with_slopes(system.equations, slopes, noises(data, floor))


def solution(system: System, hyper: Hyperparameters) -> Array:
    """The likeliest coefficients less the prior's mean, (b, 27)."""
    # Heights are nearest with the typical prior, and intervals are true with the averaged one.
    precision = _precision(system, hyper.typical, hyper.noise)
    seen = system.equations.seen / (hyper.noise**2)[:, None]
    if system.slopes is not None and system.steepness is not None:
        seen = seen + (system.steepness[:, None] @ system.slopes)[:, 0]
    return np.array([solved_definite(*each) for each in zip(precision, seen, strict=True)])


def posterior(
    mean: Array, system: System, triangle: Array, hyper: Hyperparameters, weights: Array
) -> Posterior:
    """The posteriors about the means (b, 27), under the averaged prior; triangle is that of Restricted."""
    covariance = np.array(
        [inverse_definite(each) for each in _precision(system, hyper.variances, hyper.noise)]
    )
    # Waviness and noise are estimates, so deviations are those of a Student t of this freedom.
    freedom = np.maximum(system.equations.contacts - FREE, LEAST_FREEDOM)
    covariance *= (freedom / (freedom - 2.0))[:, None, None]
    visibility = triangle * (PRIOR_SCALE / hyper.noise)[:, None, None]
    if system.slopes is not None:
        # Slopes show the free terms too, so this is the QR of all rows, each in units of its deviation.
        basis = (np.sqrt(weights) / hyper.noise[:, None])[..., None] * system.rows[:, :-1].transpose(0, 2, 1)
        rows = np.concatenate([basis, system.slopes], axis=1)
        whole: Array = np.linalg.qr(rows, mode="r")  # type: ignore[assignment]
        visibility = PRIOR_SCALE * whole[:, FREE:, FREE:]
    return Posterior(mean, covariance, hyper.noise, visibility, _level(covariance, system, hyper, weights))


def _level(covariance: Array, system: System, hyper: Hyperparameters, weights: Array) -> Array:
    """The level of a Posterior: of the contacts' mean height less the surface at the pivot."""
    level = np.zeros((len(weights), len(TERMS) + 1))
    if system.pivot is not None:
        level[:, 1:] = -(covariance @ system.pivot[..., None])[..., 0]
        level[:, 0] = hyper.noise**2 / weights.sum(axis=1) - np.einsum("bi,bi->b", level[:, 1:], system.pivot)
    return level


def _precision(system: System, variances: Array, noise: Array) -> Array:
    """The inverse of the coefficients' covariance, (b, 27, 27)."""
    precision = system.equations.gram / (noise**2)[:, None, None]
    if system.slopes is not None:
        precision += np.swapaxes(system.slopes, 1, 2) @ system.slopes
    diagonal = np.einsum("bii->bi", precision)  # a view
    diagonal[:, :FREE] += FREE_PRECISION  # This keeps it invertible whatever the contacts are.
    diagonal[:, FREE:] += 1.0 / variances
    return precision
