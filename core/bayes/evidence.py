# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The hyperparameters by the marginal likelihood of the contacts: waviness, amplitude of the process, noise.

They are averages over a grid. Where the amplitude is 0 the heights are those of a polynomial, and their
likelihood follows from 27 x 27 matrices, in stacks of touches. Where it is not, a matrix has a row for each
contact, and the waviness is USUAL_WAVINESS, because the process explains the rest.
"""

from functools import cache, partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..arguments import Array
from ..lapack import cholesky_in_place
from .prior import FREE, USUAL_WAVINESS, prior_variances

# Chosen with benchmarks.accuracy.
WAVINESS = np.geomspace(0.15, 1.3, 6)
WAVINESS_SPREAD = 0.5  # The waviness has a log-normal prior with the median USUAL_WAVINESS and this sigma.
NOISES = 5  # The grid of the noise has so many points, from the floor up.
FREE_PRECISION = 1e-4  # Prior precision of the five free terms: nearly none, it keeps the matrix invertible.
ROUNDING = 1e-13  # Rounding takes at most this share of a system's trace.
UNLIKELY = 1400.0  # The exponential of half this difference of -2 log likelihood is still a number.
GROUP = 4  # The likelihoods of so many touches are computed at once (benchmarks.speed).
# Chosen with benchmarks.real.
AMPLITUDES = np.array([0.003, 0.01, 0.04, 0.14, 0.5])  # Grid of the process's deviation, in unit radius.
SEXTIC_WAVINESS = np.array([0.3, 0.6, 1.2])  # The waviness of the polynomials that a process competes with.
PROCESS_NOISES, MIDDLE = 3, 1  # Grid points of the noise, up to what the sextic leaves; the middle one.
ODDS = 0.2  # There is a process from these odds on: it costs a smooth surface little.
NEGLIGIBLE = 160.0  # If -2 log likelihood exceeds the best by more, no other noise is tried.
# Prior variance of slopes and second derivatives beside a process: with 100 they run away if curves end
# early.
FREE_VARIANCE = 0.06
# The log likelihood counts by this share: neighbors on a curve do not tell of waves between curves.
TEMPER = 0.1


def precision_of(waviness: Array, free: float) -> Array:
    """Prior precisions of the coefficients, (..., 27), for waviness (...) and the precision of free terms."""
    higher = 1.0 / prior_variances(waviness)
    return np.concatenate([np.full((*higher.shape[:-1], FREE), free), higher], axis=-1)


VARIANCES = prior_variances(WAVINESS)
PRECISIONS = precision_of(WAVINESS, FREE_PRECISION)
LOG_VARIANCES = np.log(VARIANCES)
UNUSUAL = (np.log(WAVINESS / USUAL_WAVINESS) / WAVINESS_SPREAD) ** 2  # -2 log of the waviness's prior.


class NormalEquations(NamedTuple):
    """The normal equations gram @ coefficients = rhs of b touches with `contacts` (b,), as one matrix each.

    bordered : (b, 28, 28), [[gram, rhs], [rhs', square]]; square is the sum of the squares of the heights
    """

    bordered: Array
    contacts: Array

    def at(self, which: slice | NDArray[np.bool_]) -> "NormalEquations":
        """Those of some of the touches."""
        return NormalEquations(self.bordered[which], self.contacts[which])

    @property
    def gram(self) -> Array:
        """The matrix of the normal equations, (b, 27, 27)."""
        return self.bordered[:, :-1, :-1]

    @property
    def rhs(self) -> Array:
        """The right-hand side of the normal equations, (b, 27)."""
        return self.bordered[:, :-1, -1]


class Hyperparameters(NamedTuple):
    """Prior variances (b, 22), typical for the waviness and averaged over it, and the noise (b,)."""

    typical: Array
    variances: Array
    noise: Array


class ProcessHyperparameters(NamedTuple):
    """Variances (2,) of the process, for each of LENGTHS, the noise, and whether contacts ask for it."""

    variances: Array
    noise: float
    use_gp: bool


def neg2_log_evidence(
    heights: NormalEquations, slopes: NormalEquations | None, precision: Array, noises: Array
) -> Array:
    """-2 log marginal likelihood of b touches without a process, (b, w, n), up to a constant.

    heights : of the contacts; slopes : of measured normals, in units of their deviations
    precision : (w, 27), of the prior; noises : (b, n)

    With the precision A = gram / noise^2 + slopes' gram + prior^-1 (Rasmussen and Williams 2006, equation
    2.11) and rhs likewise, it is log |A| + log |prior| + n log noise^2 + y'y / noise^2 - rhs' A^-1 rhs. The
    Cholesky factor of [[A, rhs], [rhs', y'y / noise^2]] has log |A| in its diagonal, and the last two terms
    in the last of it.
    """
    bordered = heights.bordered[:, None] / (noises**2)[..., None, None]
    if slopes is not None:
        bordered += slopes.bordered[:, None]
    # Adding 1 changes no ratio of likelihoods and keeps rounding from leaving less than 0 over.
    bordered[..., -1, -1] += 1.0 + ROUNDING * np.einsum("bnii->bn", bordered)
    bordered = bordered[:, None].repeat(len(precision), axis=1)
    np.einsum("bwnii->bwni", bordered)[..., :-1] += precision[:, None]  # a view
    pivots = np.einsum("bwnii->bwni", np.linalg.cholesky(bordered))
    found: Array = 2.0 * np.log(pivots[..., :-1]).sum(axis=-1) + pivots[..., -1] ** 2
    found += (heights.contacts[:, None] * np.log(noises**2))[:, None]
    return found - np.log(precision).sum(axis=1)[:, None]


def noise_grid(heights: NormalEquations, floor: Array) -> Array:
    """A grid of the noise, (b, NOISES), from the floor (b,) to beyond what a quadric leaves of contacts."""
    which = [*range(FREE), -1]
    bordered = heights.bordered[:, which][:, :, which]
    np.einsum("bii->bi", bordered)[:] += ROUNDING * np.einsum("bii->b", bordered)[:, None]  # a view
    left = np.linalg.cholesky(bordered)[:, -1, -1]  # the root of the sum of squares
    largest = 2.0 + 3.0 / floor * left / np.sqrt(heights.contacts)
    found: Array = floor[:, None] * largest[:, None] ** np.linspace(0.0, 1.0, NOISES)
    return found


def hyperparameters(
    heights: NormalEquations, slopes: NormalEquations | None, floor: Array
) -> Hyperparameters:
    """Waviness and noise of b touches without a process, in groups that fit into a processor's cache."""
    noises, found = noise_grid(heights, floor), []
    for start in range(0, len(noises), GROUP):
        group = slice(start, start + GROUP)
        some = heights.at(group), slopes and slopes.at(group)
        found.append(neg2_log_evidence(*some, PRECISIONS, noises[group]))
    return averaged(np.concatenate(found), noises)


def averaged(neg2_log: Array, noises: Array) -> Hyperparameters:
    """Averages over the grid of waviness and noise, given -2 log likelihood (b, 6, 5) at its points."""
    neg2_log = (neg2_log + UNUSUAL[:, None]).reshape(len(noises), -1)
    weights = np.exp(0.5 * np.maximum(neg2_log.min(axis=1)[:, None] - neg2_log, -UNLIKELY))
    weights = (weights / weights.sum(axis=1)[:, None]).reshape(len(noises), len(WAVINESS), -1)
    by_waviness, by_noise = weights.sum(axis=2), weights.sum(axis=1)
    return Hyperparameters(
        np.exp(by_waviness @ LOG_VARIANCES),
        by_waviness @ VARIANCES,
        np.sqrt(np.einsum("bn,bn->b", by_noise, noises**2)),
    )


def process_hyperparameters(
    rows: Array, kernels: list[Array], least: float, most: float
) -> ProcessHyperparameters:
    """Variances and noise of a touch with a process, and whether its contacts ask for one.

    rows : (28, m), the terms and the heights of contacts, each times the root of its weight
    kernels : (m, m) each, of unit variance, likewise; least, most : bounds of the noise
    """
    noises = least * (most / least) ** np.linspace(0.0, 1.0, PROCESS_NOISES)
    with_it = process_neg2_log_evidence(rows, kernels, noises)
    equations = NormalEquations((rows @ rows.T)[None], np.array([float(rows.shape[1])]))
    sextics, precision = np.array([[most]]), precision_of(SEXTIC_WAVINESS, 1.0 / FREE_VARIANCE)
    # What is added there to -2 log likelihood is taken off again.
    without = neg2_log_evidence(equations, None, precision, sextics)[0, :, 0] - 1.0
    lowest = min(with_it.min(), without.min())
    p, p_sextic = np.exp(-0.5 * (with_it - lowest)), np.exp(-0.5 * (without - lowest))
    shares = p**TEMPER / (p**TEMPER).sum()
    noise = float(np.sqrt(shares.sum(axis=(0, 1)) @ noises**2))
    use_gp = bool(p.mean() > ODDS * p_sextic.mean())
    return ProcessHyperparameters(shares.sum(axis=2) @ AMPLITUDES**2, noise, use_gp)


@cache
def process_prior() -> Array:
    """Prior variances (27,) of the coefficients beside a process."""
    return 1.0 / precision_of(np.array(USUAL_WAVINESS), 1.0 / FREE_VARIANCE)


def process_neg2_log_evidence(rows: Array, kernels: list[Array], noises: Array) -> Array:
    """-2 log likelihood for each length, amplitude and noise, (2, 5, 3); inf where it was not computed.

    Heights ~ N(0, K) with K = basis prior basis' + v k + noise^2 (Rasmussen and Williams 2006, equation
    2.40). The middle noise comes first, from the middle amplitude on to where others only become worse. Other
    noises are tried where the likelihood of a length and an amplitude is not NEGLIGIBLE.
    """
    basis, heights = rows[:-1].T, rows[-1]
    m, size = len(heights), len(AMPLITUDES)
    terms, work, *kernels_of = np.zeros((2 + len(kernels), m + 1, m + 1))
    terms[:m, :m] = (basis * process_prior()) @ basis.T
    terms[:m, m] = terms[m, :m] = heights
    found = np.full((len(kernels), size, PROCESS_NOISES), np.inf)
    at_one = partial(_neg2_log_at, terms, work, 2.0 * float(heights @ heights))
    squares, noise_squares = (AMPLITUDES**2).tolist(), (noises**2).tolist()
    for within, kernel, row in zip(kernels, kernels_of, found, strict=True):
        kernel[:m, :m] = within
        for side in (range(size // 2, size), range(size // 2 - 1, -1, -1)):
            before = row[side.start - side.step, MIDDLE]
            for at in side:
                row[at, MIDDLE] = now = at_one(kernel, squares[at], noise_squares[MIDDLE])
                if now > max(before, found.min() + NEGLIGIBLE):
                    break
                before = now
    for length, at in np.argwhere(found[..., MIDDLE] < found.min() + NEGLIGIBLE).tolist():
        for i in (i for i in range(PROCESS_NOISES) if i != MIDDLE):
            found[length, at, i] = at_one(kernels_of[length], squares[at], noise_squares[i])
    return found


def _neg2_log_at(
    terms: Array, work: Array, twice: float, kernel: Array, variance: float, noise: float
) -> float:
    """-2 log likelihood for one variance of the process and one squared noise.

    terms, work, kernel : (m + 1, m + 1), bordered by the heights; twice : twice the sum of the heights'
        squares
    """
    np.multiply(kernel, variance, out=work)
    work += terms
    diagonal = work.reshape(-1)[:: len(work) + 1]
    diagonal += noise
    corner = diagonal[-1] = twice / noise + 1.0  # It exceeds heights' K^-1 heights.
    pivots = cholesky_in_place(work)
    return 2.0 * float(np.log(pivots[:-1]).sum()) + corner - float(pivots[-1]) ** 2
