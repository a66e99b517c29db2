# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""How wavy a surface is, and how noisy its contacts are: by marginal likelihood, for the fit of bayes.py."""

from typing import NamedTuple

import numpy as np

from ..arguments import Array
from ..patch.monge import TERMS
from .posterior import FREE, ORDERS

WAVINESS_POWERS = ORDERS[FREE:] - 1.0  # Powers of the waviness, one for each term.
# Chosen with benchmarks.accuracy.
PRIOR_SCALE = 0.1
WAVINESS = np.geomspace(0.15, 1.3, 6)
USUAL_WAVINESS, WAVINESS_SPREAD = 0.6, 0.5  # median and sigma of its log-normal prior
NOISES = 5  # grid points, from the floor up
FREE_PRECISION = 1e-4  # Prior precision of the five free terms: nearly none, it keeps the matrix invertible.
ROUNDING = 1e-13  # Share of the trace of a system.
GROUP = 4  # touches whose likelihoods are computed at once (benchmarks.speed)


class Restricted(NamedTuple):
    """What contacts say of the terms of degree 3 to 6, whatever the free ones are.

    triangle (b, 22, 22) @ coefficients ~ target (b, 22) in the sense of least squares, which leaves
    `square` (b,) over; there are so many `contacts` (b,).
    """

    triangle: Array
    target: Array
    square: Array
    contacts: Array


class Hyperparameters(NamedTuple):
    """Waviness (b,), its geometric mean; prior variances (b, 22), averaged over it; and noise (b,)."""

    waviness: Array
    variances: Array
    noise: Array


class NormalEquations(NamedTuple):
    """gram (b, 27, 27) @ coefficients ~ seen (b, 27), of data of this sum of squares (b,)."""

    gram: Array
    seen: Array
    square: Array
    contacts: Array = np.zeros(0)  # (b,), how many


def prior_variances(waviness: Array) -> Array:
    """Prior variances of the coefficients of degree 3 to 6, (..., 22), for waviness (...)."""
    return (PRIOR_SCALE * waviness[..., None] ** WAVINESS_POWERS) ** 2


VARIANCES = prior_variances(WAVINESS)
UNUSUAL = (np.log(WAVINESS / USUAL_WAVINESS) / WAVINESS_SPREAD) ** 2  # -2 log of the waviness's prior


def restricted(data: NormalEquations) -> Restricted:
    """What contacts say of the higher terms, by a Cholesky factor of their system bordered by the heights."""
    b, size = data.seen.shape
    bordered = np.empty((b, size + 1, size + 1))
    bordered[:, :size, :size] = data.gram
    bordered[:, :size, size] = bordered[:, size, :size] = data.seen
    bordered[:, size, size] = data.square
    diagonal = np.einsum("bii->bi", bordered)  # a view
    # More than rounding takes from what no contact shows, and far less than noise hides.
    diagonal += ROUNDING * np.cumsum(diagonal, axis=1)[:, [-2] * size + [-1]]
    triangle: Array = np.swapaxes(np.linalg.cholesky(bordered), 1, 2)
    target, square = triangle[:, FREE:-1, -1], triangle[:, -1, -1] ** 2
    return Restricted(triangle[:, FREE:-1, FREE:-1], target, square, data.contacts)


def noises(data: Restricted, floor: Array) -> Array:
    """A grid of the noise, (b, 5), from the floor to beyond what the quadric leaves over."""
    left = (data.target**2).sum(axis=1) + data.square
    largest = 2.0 * floor + 3.0 * np.sqrt(left / data.contacts)
    return floor[:, None] * (largest / floor)[:, None] ** (np.arange(NOISES) / (NOISES - 1.0))


def evidence(data: Restricted, noises: Array) -> Hyperparameters:
    """Waviness and noise by their marginal likelihood, group by group: one fits into a processor's cache."""
    if len(noises) <= GROUP:
        return _evidence_of(data, noises)
    groups = [slice(start, start + GROUP) for start in range(0, len(noises), GROUP)]
    found = [_evidence_of(Restricted(*(part[group] for part in data)), noises[group]) for group in groups]
    return Hyperparameters(*(np.concatenate(parts) for parts in zip(*found, strict=True)))


def _evidence_of(data: Restricted, noises: Array) -> Hyperparameters:
    """Waviness and noise by the marginal likelihood of the restricted data (REML).

    target ~ N(0, K), K = triangle prior triangle' + noise^2. One Cholesky factor of K bordered by the
    target, [[K, t], [t', c]], has log |K| in its diagonal and t' K^-1 t in the last of it.
    """
    triangle, target = data.triangle, data.target
    b, size = target.shape
    explained = (triangle[:, None] * VARIANCES[:, None]) @ np.swapaxes(triangle, 1, 2)[:, None]
    corner = 2.0 * (target**2).sum(axis=1) / noises[:, 0] ** 2 + 1.0  # more than t' K^-1 t
    bordered = np.zeros((b, len(WAVINESS), noises.shape[1], size + 1, size + 1))
    bordered[..., :size, :size] = explained[:, :, None]
    bordered[..., :size, size] = bordered[..., size, :size] = target[:, None, None]
    bordered[..., size, size] = corner[:, None, None]
    # Beside the noise, what rounding leaves of contacts that are no surface.
    rounding = 1e-13 * np.trace(explained, axis1=2, axis2=3)
    diagonal = np.einsum("...ii->...i", bordered)  # a view
    diagonal[..., :size] += (noises[:, None] ** 2 + rounding[..., None])[..., None]
    factors = np.diagonal(np.linalg.cholesky(bordered), axis1=3, axis2=4)
    others = (data.contacts - len(TERMS))[:, None, None]  # directions no term explains
    surprise = (
        2.0 * np.log(factors[..., :size]).sum(axis=3)
        + (corner[:, None, None] - factors[..., size] ** 2)
        + others * np.log(noises[:, None] ** 2)
        + (data.square[:, None] / noises**2)[:, None]
    )
    return _averaged(surprise, noises)


def _averaged(surprise: Array, noises: Array) -> Hyperparameters:
    """Over a grid of waviness and noise, by -2 log likelihood there (b, 6, 5) and the waviness's prior."""
    likelihood = -0.5 * (surprise + UNUSUAL[:, None])
    with np.errstate(under="ignore"):  # what is that unlikely counts for nothing
        weights = np.exp(likelihood - likelihood.max(axis=(1, 2), keepdims=True))
        weights /= weights.sum(axis=(1, 2), keepdims=True)
    by_waviness = weights.sum(axis=2)
    return Hyperparameters(
        np.exp(by_waviness @ np.log(WAVINESS)),
        by_waviness @ VARIANCES,
        np.sqrt((weights.sum(axis=1) * noises**2).sum(axis=1)),
    )


def evidence_with_slopes(heights: NormalEquations, slopes: NormalEquations, noises: Array) -> Hyperparameters:
    """The evidence where measured slopes, in units of their deviations, tell of the waviness too.

    Slopes leave no term free, so all coefficients are integrated out, by the determinant lemma: with the
    precision A = gram / noise^2 + slopes' gram + prior^-1 and v = A @ the likeliest coefficients, one
    Cholesky factor of [[A, v], [v', square]] has log |A| in its diagonal and what is left over in the last.
    """
    size, at_noise = len(TERMS), noises[:, None, :, None]
    bordered = np.zeros((*(len(noises), len(WAVINESS), noises.shape[1]), size + 1, size + 1))
    diagonal = np.einsum("...ii->...i", bordered)  # a view
    bordered[..., :size, :size] = heights.gram[:, None, None] / at_noise[..., None] ** 2
    bordered[..., :size, :size] += slopes.gram[:, None, None]
    diagonal[..., :FREE] += FREE_PRECISION
    diagonal[..., FREE:size] += 1.0 / VARIANCES[:, None]
    seen = heights.seen[:, None, None] / at_noise**2 + slopes.seen[:, None, None]
    bordered[..., :size, size] = bordered[..., size, :size] = seen
    # One more, lest rounding leaves less than nothing over.
    square = (heights.square[:, None] / noises**2 + slopes.square[:, None])[:, None] + 1.0
    bordered[..., size, size] = square
    factors = np.diagonal(np.linalg.cholesky(bordered), axis1=3, axis2=4)
    surprise = (
        2.0 * np.log(factors[..., :size]).sum(axis=3)
        + np.log(VARIANCES).sum(axis=1)[:, None]
        + factors[..., size] ** 2
        + heights.contacts[:, None, None] * np.log(noises[:, None] ** 2)
    )
    return _averaged(surprise, noises)
