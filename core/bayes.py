# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The accurate fit: one Bayesian linear solve for everything at once, which knows what it cannot see.

Beside the paper. Near the reference point the surface is taken for a polynomial of degree 6, in unit
radius and in its Darboux frame. Slopes and second derivatives are free. The coefficient a_ij of a
higher degree is a length^(1 - i - j): where the curvature changes over a length l it has the size
l^(1 - i - j), so its prior is

    a_ij ~ N(m_ij, (waviness^(i + j - 1) / 10)^2)    with waviness = L / l.

m are the quartic and sextic of a surface that goes on with the curvatures it has at the point. The
waviness and the noise of the contacts follow from their marginal likelihood on a grid.
"""

import math
from typing import NamedTuple

import numpy as np

from .arguments import Array
from .monge import MongePatch, monomials
from .posterior import FREE, ORDERS, TERMS, Posterior
from .tracking import cross

POWERS = ORDERS[FREE:] - 1.0  # of the waviness
# Chosen with benchmarks.accuracy.
SCALE = 0.1
WAVINESS = np.geomspace(0.15, 1.3, 6)
USUAL_WAVINESS, WAVINESS_SPREAD = 0.6, 0.5  # median and sigma of its log-normal prior
MISFIT = 2e-3  # of the radius: no surface is a polynomial, so the noise is never less
NOISES = 8  # grid points, from the floor up
PASSES = 8  # at most: two that turn the frame to what they found, and more for what is outlying
SETTLED = 0.1  # of a weight, between passes
UMBILIC = 1e-4  # the difference of curvatures that is none; heights change by an eighth of it
LEVEL = 5e-3  # slope left over; it changes heights by its product with a slope and a height
OUTLYING = 5.0  # standard deviations
STUDENT = 4.0  # degrees of freedom


class _System(NamedTuple):
    """Heights (n,) ~ basis (n, 27) @ b, less the prior's mean; and the same after QR with weights.

    triangle (27, 27) @ b ~ target (27,) in the sense of least squares, which leaves `square` over.
    """

    basis: Array
    heights: Array
    triangle: Array
    target: Array
    square: float


class _Hyperparameters(NamedTuple):
    """The waviness, its geometric mean; the prior variances (22,), averaged over it; and the noise."""

    waviness: float
    variances: Array
    noise: float


def joint_fit(
    contacts: Array, k1: float, k2: float, tangent: Array, accuracy: float
) -> tuple[Array, Posterior]:
    """The Darboux frame and the surface that the contacts show, and how well they show it.

    contacts : (n, 3), in unit radius, in a frame near to the Darboux frame
    k1, k2 : a first guess of the curvatures along its axes
    tangent : (3,), in that frame, which d1 is to follow
    accuracy : standard deviation of a contact, at least

    Returns the columns d1, d2, n (3, 3) in the frame given, and the posterior in the new one, where
    the means of the slopes and of the mixed second derivative are 0. Where a residual is beyond
    OUTLYING standard deviations, contacts weigh as under a Student t distribution.
    """
    floor = max(accuracy, MISFIT)
    axes, weights = np.eye(3), np.ones(len(contacts))
    hyper = _Hyperparameters(USUAL_WAVINESS, (SCALE * USUAL_WAVINESS**POWERS) ** 2, floor)
    for step in range(PASSES):
        prior_mean = _prior_mean(k1, k2)
        system = _system(contacts @ axes, prior_mean, weights)
        if step > 0:
            hyper = _evidence(system, _noises(system, floor))
        # The heights come out nearest with the typical prior, the intervals cover with the averaged one.
        prior = (SCALE * hyper.waviness**POWERS) ** 2
        solution = _covariance(system, prior, hyper.noise) @ (system.triangle.T @ system.target)
        solution /= hyper.noise**2
        mean = prior_mean + solution
        axes, k1, k2, angle = _turned(axes, mean, tangent)
        if step > 1 or (step == 1 and math.hypot(mean[0], mean[1]) <= LEVEL):
            before, weights = weights, _student_weights(system.heights - system.basis @ solution, floor)
            if np.abs(weights - before).max() <= SETTLED:
                break
    posterior = _posterior(mean, system, hyper).turned(angle)
    posterior.mean[:FREE] = 0.0, 0.0, k1 / 2.0, 0.0, k2 / 2.0
    return axes, posterior


def posterior_of(patch: MongePatch, contacts: Array, accuracy: float) -> Posterior:
    """What contacts (n, 3) leave open, in the frame of a patch, where the patch is the mean.

    All in unit radius. The noise is what the patch leaves over at the contacts, or `accuracy`.
    """
    system = _system(contacts, np.zeros(len(TERMS)), np.ones(len(contacts)))
    x, y, z = contacts.T
    residual = math.sqrt(np.mean((z - patch.height(x, y)) ** 2))
    hyper = _evidence(system, np.array([max(residual, accuracy, MISFIT)]))
    mean = np.zeros(len(TERMS))
    mean[[2, 4]] = patch.k1 / 2.0, patch.k2 / 2.0
    mean[FREE : FREE + len(patch.coefficients)] = patch.coefficients
    return _posterior(mean, system, hyper)


def _prior_mean(k1: float, k2: float) -> Array:
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


def _system(local: Array, prior_mean: Array, weights: Array) -> _System:
    x, y, z = local.T
    basis = monomials(x, y, TERMS)
    heights = z - basis @ prior_mean
    size = len(TERMS) + 1
    rows = np.zeros((max(len(z), size), size))  # as many as QR needs for a whole triangle
    rows[: len(z), :-1], rows[: len(z), -1] = basis, heights
    rows[: len(z)] *= np.sqrt(weights)[:, None]
    triangle: Array = np.linalg.qr(rows, mode="r")  # type: ignore[assignment]
    return _System(basis, heights, triangle[:-1, :-1], triangle[:-1, -1], float(triangle[-1, -1] ** 2))


def _noises(system: _System, floor: float) -> Array:
    """A grid of the noise, from the floor to beyond what the quadric leaves over."""
    left = float(system.target[FREE:] @ system.target[FREE:]) + system.square
    largest = 2.0 * floor + 3.0 * math.sqrt(left / len(system.basis))
    return floor * (largest / floor) ** (np.arange(NOISES) / (NOISES - 1.0))


def _evidence(system: _System, noises: Array) -> _Hyperparameters:
    """Waviness and noise by their marginal likelihood, the free terms projected out (REML).

    target ~ N(0, K), K = triangle prior triangle' + noise^2. One Cholesky factor of K bordered by the
    target, [[K, t], [t', c]], has log |K| in its diagonal and t' K^-1 t in the last of it.
    """
    triangle, target = system.triangle[FREE:, FREE:], system.target[FREE:]
    size = len(target)
    variances = (SCALE * WAVINESS[:, None] ** POWERS) ** 2
    explained = (triangle * variances[:, None, :]) @ triangle.T
    corner = 2.0 * (target @ target) / noises[0] ** 2 + 1.0  # more than t' K^-1 t
    bordered = np.zeros((len(WAVINESS), len(noises), size + 1, size + 1))
    bordered[:, :, :size, :size] = explained[:, None]
    bordered[:, :, :size, size] = bordered[:, :, size, :size] = target
    bordered[:, :, size, size] = corner
    # Beside the noise, what rounding leaves of contacts that are no surface.
    rounding = 1e-13 * np.trace(explained, axis1=1, axis2=2)
    diagonal = np.arange(size)
    bordered[:, :, diagonal, diagonal] += (noises**2 + rounding[:, None])[:, :, None]
    factors = np.diagonal(np.linalg.cholesky(bordered), axis1=2, axis2=3)
    others = len(system.basis) - len(TERMS)  # directions no term explains
    likelihood = -0.5 * (
        2.0 * np.sum(np.log(factors[:, :, :size]), axis=2)
        + (corner - factors[:, :, size] ** 2)
        + others * np.log(noises**2)
        + system.square / noises**2
        + (np.log(WAVINESS / USUAL_WAVINESS) / WAVINESS_SPREAD)[:, None] ** 2
    )
    weights = np.exp(likelihood - likelihood.max())
    weights /= weights.sum()
    by_waviness = weights.sum(axis=1)
    return _Hyperparameters(
        float(np.exp(by_waviness @ np.log(WAVINESS))),
        by_waviness @ variances,
        float(np.sqrt(weights.sum(axis=0) @ noises**2)),
    )


def _posterior(mean: Array, system: _System, hyper: _Hyperparameters) -> Posterior:
    covariance = _covariance(system, hyper.variances, hyper.noise)
    return Posterior(mean, covariance, hyper.noise, system.triangle[FREE:, FREE:] * (SCALE / hyper.noise))


def _covariance(system: _System, variances: Array, noise: float) -> Array:
    precision = system.triangle.T @ system.triangle / noise**2
    # A slope or second derivative of 100 is no surface; and with that no contacts make it singular.
    precision[np.diag_indices(len(TERMS))] += np.concatenate([np.full(FREE, 1e-4), 1.0 / variances])
    return np.linalg.inv(precision)


def _student_weights(residuals: Array, floor: float) -> Array:
    """Weights of the contacts, (n,): all 1 where no residual is outlying."""
    deviation = max(floor, 1.4826 * float(np.median(np.abs(residuals))))
    ratios = np.abs(residuals) / deviation
    if ratios.max() <= OUTLYING:
        return np.ones(len(residuals))
    return (STUDENT + 1.0) / (STUDENT + ratios**2)


def _turned(axes: Array, mean: Array, tangent: Array) -> tuple[Array, float, float, float]:
    """The axes tilted to a surface's normal and turned to its principal directions; k1, k2; that angle."""
    sx, sy, xx, xy, yy = mean[:FREE].tolist()
    n = axes @ np.array([-sx, -sy, 1.0]) / math.sqrt(1.0 + sx**2 + sy**2)
    tx, ty, _ = (tangent @ axes).tolist()
    half, angle = math.hypot(xx - yy, xy), 0.5 * math.atan2(-xy, yy - xx)
    if half <= UMBILIC * max(1.0, abs(xx), abs(yy)):
        half, angle = 0.0, math.atan2(ty, tx)
    if math.cos(angle) * tx + math.sin(angle) * ty < 0.0:
        angle += math.pi
    d1 = math.cos(angle) * axes[:, 0] + math.sin(angle) * axes[:, 1]
    d1 -= (d1 @ n) * n
    d1 /= math.sqrt(d1 @ d1)
    return np.column_stack([d1, cross(n, d1), n]), xx + yy - half, xx + yy + half, angle
