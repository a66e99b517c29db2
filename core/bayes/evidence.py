# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The hyperparameters by the marginal likelihood of the contacts: waviness, amplitude of the process, noise.

They are averages over a grid. Where the amplitude is 0 the heights are those of a polynomial, and their
likelihood follows from 27 x 27 matrices, in stacks of touches. Where it is not, a matrix has a row for each
contact, and the waviness is USUAL_WAVINESS, because the process explains the rest.
"""

from functools import partial
from typing import NamedTuple

import numpy as np

from ..arguments import Array
from ..lapack import cholesky_diagonal, on_one_thread
from .prior import FREE, USUAL_VARIANCES, USUAL_WAVINESS, prior_variances

# Chosen with benchmarks.accuracy.
WAVINESS = np.geomspace(0.15, 1.3, 6)
WAVINESS_SPREAD = 0.5  # The waviness has a log-normal prior with the median USUAL_WAVINESS and this sigma.
UNUSUAL = (np.log(WAVINESS / USUAL_WAVINESS) / WAVINESS_SPREAD) ** 2  # -2 log of that prior.
VARIANCES = prior_variances(WAVINESS)
NOISES = np.linspace(0.0, 1.0, 5)  # The logarithms of the noise, as shares of the way from floor to most.
ROUNDING = 1e-13  # Rounding takes at most this share of a system's trace.
QUADRIC = np.array([*range(FREE), -1])  # The rows of a quadric and of the heights.
UNLIKELY = 1400.0  # The exponential of half this difference of -2 log likelihood is still a number.
GROUP = 4  # The number of touches whose likelihoods are computed at once (benchmarks.speed, e20b52a).
# Chosen with benchmarks.real.
AMPLITUDES = np.array([0.003, 0.01, 0.04, 0.14, 0.5])  # Grid of the process's deviation, in unit radius.
PROCESS_NOISES, MIDDLE = 3, 1  # Grid points of the noise, up to what the sextic leaves; the middle one.
ODDS = 0.2  # There is a process from these odds on: it costs a smooth surface little.
NEGLIGIBLE = 160.0  # If -2 log likelihood exceeds the best by more, no other noise is tried.
# Largest prior variance of slopes and second derivatives in a model with a process: with 100 they run away if
# curves end early.
MOST_VARIANCE = 0.06
# The prior variances of the polynomials that a process competes with, by their waviness.
SEXTIC_VARIANCES = np.minimum(prior_variances(np.array([0.3, 0.6, 1.2])), MOST_VARIANCE)
# The power of the likelihood in a model with a process, because neighbors on a curve show no waves between
# curves.
POWER = 0.1


class Hyperparameters(NamedTuple):
    """Prior variances of the coefficients (..., 27), the noise (...), variances of the process (2,)."""

    prior: Array
    noise: Array
    process: Array = np.zeros(2)


def neg2_log_evidence(heights: Array, counts: Array, slopes: Array, prior: Array, noises: Array) -> Array:
    """-2 log marginal likelihood of b touches without a process, (b, w, n), up to a constant.

    heights : (b, 28, 28), [[gram, rhs], [rhs', y'y]] of `counts` contacts (b,); slopes : (b, 28, 28),
        likewise, of measured normals in units of their deviations; 0 without any
    prior : (w, 27), variances; noises : (b, n)

    With the precision A = gram / noise^2 + slopes' gram + prior^-1 (Rasmussen and Williams 2006, equation
    2.11) and rhs likewise, it is log |A| + log |prior| + n log noise^2 + y'y / noise^2 - rhs' A^-1 rhs. The
    Cholesky factor of [[A, rhs], [rhs', y'y / noise^2]] has log |A| in its diagonal, and the last two terms
    in the last of it.
    """
    bordered = heights[:, None] / (noises**2)[..., None, None] + slopes[:, None]
    # Adding 1 changes no ratio of likelihoods and keeps rounding from leaving less than 0 over.
    bordered[..., -1, -1] += 1.0 + ROUNDING * np.einsum("bnii->bn", bordered)
    bordered = bordered[:, None].repeat(len(prior), axis=1)
    np.einsum("bwnii->bwni", bordered)[..., :-1] += (1.0 / prior)[:, None]  # a view
    pivots = np.einsum("bwnii->bwni", np.linalg.cholesky(bordered))
    neg2_log: Array = 2.0 * np.log(pivots[..., :-1]).sum(axis=-1) + pivots[..., -1] ** 2
    return neg2_log + (counts[:, None] * np.log(noises**2))[:, None] + np.log(prior).sum(axis=1)[:, None]


def noise_grid(heights: Array, counts: Array, floor: Array) -> Array:
    """A grid of the noise, (b, 5), from the floor (b,) to beyond what a quadric leaves of contacts."""
    bordered = heights[:, QUADRIC[:, None], QUADRIC]
    np.einsum("bii->bi", bordered)[:] += ROUNDING * np.einsum("bii->b", bordered)[:, None]  # a view
    left = np.linalg.cholesky(bordered)[:, -1, -1]  # the root of the sum of squares
    largest = 2.0 + 3.0 / floor * left / np.sqrt(counts)
    return floor[:, None] * largest[:, None] ** NOISES


def hyperparameters(heights: Array, counts: Array, slopes: Array, floor: Array) -> Hyperparameters:
    """Prior variances and noise, at least `floor` (b,), of b touches without a process.

    They are means over the grid of the variances and of the squared noise, weighted by the likelihood.

    heights, counts, slopes : as in `neg2_log_evidence`

    They are found in groups that fit into a processor's cache.
    """
    noises = noise_grid(heights, counts, floor)
    groups = [slice(start, start + GROUP) for start in range(0, len(noises), GROUP)]
    neg2_logs = [neg2_log_evidence(heights[g], counts[g], slopes[g], VARIANCES, noises[g]) for g in groups]
    p = likelihoods(np.concatenate(neg2_logs) + UNUSUAL[:, None])
    noise = np.sqrt(np.einsum("bn,bn->b", p.sum(axis=1), noises**2))
    return Hyperparameters(p.sum(axis=2) @ VARIANCES, noise)


def likelihoods(neg2_log: Array, power: float = 1.0) -> Array:
    """Likelihoods on grids, (b, k, l), to this power and normalized on each grid, given -2 log of them."""
    differences = neg2_log.min(axis=(1, 2), keepdims=True) - neg2_log
    p = np.exp(0.5 * power * np.maximum(differences, -UNLIKELY))
    return p / p.sum(axis=(1, 2), keepdims=True)


@on_one_thread
def process_hyperparameters(
    rows: Array, kernels: list[Array], least: float, most: float
) -> tuple[Hyperparameters, bool]:
    """Hyperparameters of a touch with a process, and whether it is likely enough.

    rows : (28, m), the terms and the heights of contacts, each times the root of its weight
    kernels : (m, m) each, of unit variance, likewise; least, most : bounds of the noise
    """
    noises = least * (most / least) ** np.linspace(0.0, 1.0, PROCESS_NOISES)
    prior = np.minimum(USUAL_VARIANCES, MOST_VARIANCE)
    neg2_logs = process_neg2_log_evidence(rows, kernels, prior, noises)
    p = likelihoods(neg2_logs.reshape(1, len(kernels), -1), POWER).reshape(neg2_logs.shape)
    noise = np.sqrt(p.sum(axis=(0, 1)) @ noises**2)
    gram, count = (rows @ rows.T)[None], np.array([rows.shape[1]])
    # If polynomials had only the largest noise, a process would explain white noise that is below it.
    # What is added there to -2 log likelihood is taken off again.
    without = neg2_log_evidence(gram, count, 0.0 * gram, SEXTIC_VARIANCES, noises[None]) - 1.0
    best = min(neg2_logs.min(), without.min())
    use_gp = np.exp(0.5 * (best - neg2_logs)).mean() > ODDS * np.exp(0.5 * (best - without)).mean()
    return Hyperparameters(prior, noise, p.sum(axis=2) @ AMPLITUDES**2), bool(use_gp)


def process_neg2_log_evidence(rows: Array, kernels: list[Array], prior: Array, noises: Array) -> Array:
    """-2 log likelihood for each length, amplitude and noise, (2, 5, 3); inf where it was not computed.

    prior : (27,), variances

    The middle noise comes first, from the middle amplitude on to where others only become worse. Other
    noises are tried where the likelihood of a length and an amplitude is not NEGLIGIBLE.
    """
    at, size = partial(_neg2_log_at, *_bordered(rows, kernels, prior)), len(AMPLITUDES)
    neg2_logs = np.full((len(kernels), size, PROCESS_NOISES), np.inf)
    for i, row in enumerate(neg2_logs):
        for side in (range(size // 2, size), range(size // 2 - 1, -1, -1)):
            before = row[side.start - side.step, MIDDLE]
            for j in side:
                row[j, MIDDLE] = now = at(i, float(AMPLITUDES[j]), float(noises[MIDDLE]))
                if now > max(before, neg2_logs.min() + NEGLIGIBLE):
                    break
                before = now
    for i, j in np.argwhere(neg2_logs[..., MIDDLE] < neg2_logs.min() + NEGLIGIBLE).tolist():
        for k in {*range(PROCESS_NOISES)} - {MIDDLE}:
            neg2_logs[i, j, k] = at(i, float(AMPLITUDES[j]), float(noises[k]))
    return neg2_logs


def _bordered(rows: Array, kernels: list[Array], prior: Array) -> tuple[Array, list[Array], Array, float]:
    """What the terms add to K, the kernels, and room for K, (m + 1, m + 1), bordered by the heights; y'y."""
    m = rows.shape[1]
    terms, work, *bordered = np.zeros((2 + len(kernels), m + 1, m + 1))
    terms[:m, :m] = (rows[:-1].T * prior) @ rows[:-1]
    terms[:m, m] = terms[m, :m] = rows[-1]
    for matrix, kernel in zip(bordered, kernels, strict=True):
        matrix[:m, :m] = kernel
    return terms, bordered, work, float(rows[-1] @ rows[-1])


def _neg2_log_at(
    terms: Array, kernels: list[Array], work: Array, square: float, i: int, amplitude: float, noise: float
) -> float:
    """-2 log likelihood with the process of length i and this amplitude, log |K| + y' K^-1 y.

    Heights are y ~ N(0, K) with K = basis prior basis' + amplitude^2 k + noise^2 (Rasmussen and Williams
    2006, equation 2.40).
    """
    np.multiply(kernels[i], amplitude**2, out=work)
    work += terms
    diagonal = work.reshape(-1)[:: len(work) + 1]
    diagonal += noise**2
    corner = diagonal[-1] = 2.0 * square / noise**2 + 1.0  # It exceeds y' K^-1 y.
    pivots = cholesky_diagonal(work)
    return 2.0 * float(np.log(pivots[:-1]).sum()) + corner - float(pivots[-1]) ** 2
