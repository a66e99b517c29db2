# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""How wavy a surface is, and how noisy its contacts are: by marginal likelihood, for joint_fit.py."""

from typing import NamedTuple

import numpy as np

from ..arguments import Array
from ..patch.monge import TERMS
from .posterior import FREE, ORDERS

WAVINESS_POWERS = ORDERS[FREE:] - 1.0  # The prior deviation of each term is this power of the waviness.
# Chosen with benchmarks.accuracy.
PRIOR_SCALE = 0.1
WAVINESS = np.geomspace(0.15, 1.3, 6)
USUAL_WAVINESS, WAVINESS_SPREAD = 0.6, 0.5  # Median and sigma of the waviness's log-normal prior.
NOISES = 5  # The grid of the noise has so many points, from the floor up.
UPWARD = np.arange(NOISES) / (NOISES - 1.0)
FREE_PRECISION = 1e-4  # Prior precision of the five free terms: nearly none, it keeps the matrix invertible.
ROUNDING = 1e-13  # Rounding takes at most this share of a system's trace.
UNLIKELY = 1400.0  # The exponential of half this difference of -2 log likelihood is still a number.
GROUP = 4  # The likelihoods of so many touches are computed at once (benchmarks.speed).


class Restricted(NamedTuple):
    """What b touches say of the terms of degree 3 to 6, whatever the free terms are.

    triangle (b, 22, 22) @ coefficients ~ target (b, 22) in the sense of least squares, which leaves the sum
    of squares `square` (b,); each touch has `contacts` (b,) contacts.
    """

    triangle: Array
    target: Array
    square: Array
    contacts: Array


class Hyperparameters(NamedTuple):
    """Prior variances (b, 22), typical for the waviness and averaged over it, and the noise (b,)."""

    typical: Array
    variances: Array
    noise: Array


class NormalEquations(NamedTuple):
    """The normal equations gram @ coefficients = seen of b touches with `contacts` (b,), as one matrix each.

    bordered : (b, 28, 28), [[gram, seen], [seen', square]]
    """

    bordered: Array
    contacts: Array

    @property
    def gram(self) -> Array:
        """The matrix of the normal equations, (b, 27, 27)."""
        return self.bordered[:, :-1, :-1]

    @property
    def seen(self) -> Array:
        """The right side of the normal equations, (b, 27)."""
        return self.bordered[:, :-1, -1]

    @property
    def square(self) -> Array:
        """The sum of the squares of the heights, (b,)."""
        return self.bordered[:, -1, -1]


def prior_variances(waviness: Array) -> Array:
    """Prior variances of the coefficients of degree 3 to 6, (..., 22), for waviness (...)."""
    return (PRIOR_SCALE * waviness[..., None] ** WAVINESS_POWERS) ** 2


VARIANCES = prior_variances(WAVINESS)
LOG_VARIANCES = np.log(VARIANCES)
UNUSUAL = (np.log(WAVINESS / USUAL_WAVINESS) / WAVINESS_SPREAD) ** 2  # -2 log of the waviness's prior.


def restricted(data: NormalEquations) -> Restricted:
    """What contacts say of the higher terms, by a Cholesky factor of their system bordered by the heights."""
    bordered = data.bordered.copy()
    diagonal = np.einsum("bii->bi", bordered)  # a view
    # What is added exceeds what rounding takes from directions that no contact shows, and is far below noise.
    whole = diagonal.cumsum(axis=1)
    diagonal[:, :-1] += ROUNDING * whole[:, -2:-1]
    diagonal[:, -1] += ROUNDING * whole[:, -1]
    triangle: Array = np.linalg.cholesky(bordered).transpose(0, 2, 1)
    target, square = triangle[:, FREE:-1, -1], triangle[:, -1, -1] ** 2
    return Restricted(triangle[:, FREE:-1, FREE:-1], target, square, data.contacts)


def noises(data: Restricted, floor: Array) -> Array:
    """A grid of the noise, (b, NOISES), from the floor to beyond what a quadric leaves of the contacts."""
    left = np.einsum("bi,bi->b", data.target, data.target) + data.square
    largest = 2.0 + 3.0 / floor * np.sqrt(left / data.contacts)
    return floor[:, None] * largest[:, None] ** UPWARD


def evidence(data: Restricted, noises: Array) -> Hyperparameters:
    """Waviness and noise by their marginal likelihood, in groups that fit into a processor's cache."""
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
    triangle, target, squares = data.triangle, data.target, noises**2
    b, size = target.shape
    explained = (triangle[:, None] * VARIANCES[:, None]) @ triangle.transpose(0, 2, 1)[:, None]
    corner = 2.0 * np.einsum("bi,bi->b", target, target) / squares[:, 0] + 1.0  # c exceeds t' K^-1 t
    bordered = np.empty((b, len(WAVINESS), noises.shape[1], size + 1, size + 1))
    bordered[..., :size, :size] = explained[:, :, None]
    bordered[..., :size, size] = bordered[..., size, :size] = target[:, None, None]
    # Rounding counts as noise, lest contacts that are no surface leave a matrix without a factor.
    rounding = ROUNDING * np.einsum("bwii->bw", explained)
    diagonal = np.einsum("...ii->...i", bordered)  # a view
    diagonal[..., :size] += (squares[:, None] + rounding[..., None])[..., None]
    diagonal[..., size] = corner[:, None, None]
    factors = np.einsum("...ii->...i", np.linalg.cholesky(bordered))
    others = (data.contacts - len(TERMS))[:, None]  # the number of directions that no term explains
    whole = others * np.log(squares) + data.square[:, None] / squares + corner[:, None]
    surprise = 2.0 * np.log(factors[..., :size]).sum(axis=3) - factors[..., size] ** 2 + whole[:, None]
    return _averaged(surprise, noises)


def _averaged(surprise: Array, noises: Array) -> Hyperparameters:
    """Averages over the grid of waviness and noise, given -2 log likelihood (b, 6, 5) at its points."""
    surprise = (surprise + UNUSUAL[:, None]).reshape(len(noises), -1)
    weights = np.exp(0.5 * np.maximum(surprise.min(axis=1)[:, None] - surprise, -UNLIKELY))
    weights = (weights / weights.sum(axis=1)[:, None]).reshape(len(noises), len(WAVINESS), -1)
    by_waviness, by_noise = weights.sum(axis=2), weights.sum(axis=1)
    return Hyperparameters(
        np.exp(by_waviness @ LOG_VARIANCES),
        by_waviness @ VARIANCES,
        np.sqrt(np.einsum("bn,bn->b", by_noise, noises**2)),
    )


def evidence_with_slopes(heights: NormalEquations, slopes: NormalEquations, noises: Array) -> Hyperparameters:
    """The evidence where measured slopes, in units of their deviations, tell of the waviness too.

    Slopes leave no term free, so all coefficients are integrated out, by the determinant lemma. With the
    precision A = gram / noise^2 + slopes' gram + prior^-1 and v = A @ the likeliest coefficients, the
    Cholesky factor of [[A, v], [v', square]] has log |A| in its diagonal, and what is left over in the last
    of it.
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
    # Adding 1 changes no ratio of likelihoods and keeps rounding from leaving less than 0 over.
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
