# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The linear system of the fit in bayes.py: contacts and measured slopes against terms under their prior."""

from typing import NamedTuple

import numpy as np

from ..arguments import Array
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
    prior_variances,
)
from .measured_slopes import slope_equations
from .posterior import FREE, Posterior


class System(NamedTuple):
    """Heights (b, n) ~ basis (b, n, 27) @ coefficients, less the prior's mean; and its normal equations.

    gram (b, 27, 27) and seen (b, 27) are basis' basis and basis' heights, weighted. slopes (b, 2n, 27)
    @ coefficients ~ steepness (b, 2n) in units of their deviation, weighted; None without normals.
    pivot (b, 27) is 0 where surfaces pass through the origin. Where their height there is free it is the mean
    of the basis over the contacts; the basis is less that, and the heights are less their mean.
    """

    basis: Array
    heights: Array
    gram: Array
    seen: Array
    slopes: Array | None = None
    steepness: Array | None = None
    pivot: Array = np.zeros(len(TERMS))


def prior_mean(k1: float, k2: float) -> Array:
    """The prior's mean, (27,): the quartic and sextic of a surface that goes on with its curvatures.

    With Q = (k1 x^2 + k2 y^2) / 2 and G = |grad Q|^2 they are Q G / 4 and Q G^2 / 8, as on a sphere and
    a cylinder. A torus, whose parallels have k2 at the point, has k1 k2^2 / 4 for x^2 y^2: here is the
    mean of that and of the other case.
    """
    # Where the radius of curvature is less than L no surface goes on like that.
    k1, k2 = (min(max(k, -1.0), 1.0) for k in (k1, k2))
    a, b = k1**2, k2**2
    mean = np.zeros(len(TERMS))
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

    normals : (b, n, 3), measured, over their standard deviations, or (b, 0, 3)
    through : whether the surfaces pass through the origin
    """
    flat = local.reshape(-1, 3)
    basis = monomials(flat[:, 0], flat[:, 1], TERMS).reshape(*weights.shape, -1)
    heights = local[..., 2] - (basis @ expected[..., None])[..., 0]
    pivot = np.zeros_like(expected)
    if not through:
        shares = weights[:, None] / weights.sum(axis=1)[:, None, None]
        pivot = (shares @ basis)[:, 0]
        basis, heights = basis - pivot[:, None], heights - (shares @ heights[..., None])[..., 0]
    weighted = np.swapaxes(weights[..., None] * basis, 1, 2)
    system = System(basis, heights, weighted @ basis, (weighted @ heights[..., None])[..., 0], pivot=pivot)
    if not normals.shape[1]:
        return system
    slopes, steepness = slope_equations(normals, local, weights)
    return system._replace(slopes=slopes, steepness=steepness - (slopes @ expected[..., None])[..., 0])


def hyperparameters(system: System, data: Restricted, weights: Array, floor: Array) -> Hyperparameters:
    """The most likely waviness and noise; `data` is what the system's heights say of the higher terms."""
    if system.slopes is None:
        return evidence(data, noises(data, floor))
    assert system.steepness is not None
    turned, steepness = np.swapaxes(system.slopes, 1, 2), system.steepness
    slopes = NormalEquations(
        turned @ system.slopes, (turned @ steepness[..., None])[..., 0], (steepness**2).sum(axis=1)
    )
    return evidence_with_slopes(of_heights(system, weights), slopes, noises(data, floor))


def of_heights(system: System, weights: Array) -> NormalEquations:
    """The normal equations of the heights alone."""
    square = (weights * system.heights**2).sum(axis=1)
    return NormalEquations(system.gram, system.seen, square, (weights > 0.0).sum(axis=1, dtype=float))


def solution(system: System, hyper: Hyperparameters) -> Array:
    """The likeliest coefficients less the prior's mean, (b, 27)."""
    # The heights come out nearest with the typical prior, the intervals cover with the averaged one.
    precision = _precision(system, prior_variances(hyper.waviness), hyper.noise)
    seen = (system.seen / hyper.noise[:, None] ** 2)[..., None]
    if system.slopes is not None and system.steepness is not None:
        seen = seen + np.swapaxes(system.slopes, 1, 2) @ system.steepness[..., None]
    solution: Array = np.linalg.solve(precision, seen)
    return solution[..., 0]


def posterior(
    mean: Array, system: System, data: Restricted, hyper: Hyperparameters, weights: Array
) -> Posterior:
    """What is left open, under the averaged prior, about the means (b, 27)."""
    covariance = np.linalg.inv(_precision(system, hyper.variances, hyper.noise))
    visibility = data.triangle * (PRIOR_SCALE / hyper.noise)[:, None, None]
    if system.slopes is not None:
        # What the slopes show of the free terms too: the QR of all there is, each in its deviation.
        rows = np.concatenate(
            [np.sqrt(weights)[..., None] * system.basis / hyper.noise[:, None, None], system.slopes], axis=1
        )
        triangle: Array = np.linalg.qr(rows, mode="r")  # type: ignore[assignment]
        visibility = PRIOR_SCALE * triangle[:, FREE:, FREE:]
    return Posterior(mean, covariance, hyper.noise, visibility, _level(covariance, system, hyper, weights))


def _level(covariance: Array, system: System, hyper: Hyperparameters, weights: Array) -> Array:
    """The level of a Posterior: the contacts' mean height less what the terms are at the pivot."""
    level = np.zeros((len(weights), len(TERMS) + 1))
    if system.pivot.any():
        level[:, 1:] = -(covariance @ system.pivot[..., None])[..., 0]
        level[:, 0] = hyper.noise**2 / weights.sum(axis=1) - np.einsum("bi,bi->b", level[:, 1:], system.pivot)
    return level


def _precision(system: System, variances: Array, noise: Array) -> Array:
    """(b, 27, 27), the inverse of the covariance."""
    precision = system.gram / noise[:, None, None] ** 2
    if system.slopes is not None:
        precision = precision + np.swapaxes(system.slopes, 1, 2) @ system.slopes
    diagonal = np.einsum("bii->bi", precision)  # a view
    diagonal[:, :FREE] += FREE_PRECISION  # This keeps it invertible whatever the contacts are.
    diagonal[:, FREE:] += 1.0 / variances
    return precision
