# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Whether contacts ask for a residual, how large it is, and what they say of it.

There is none if a sextic describes the contacts to their noise, nor if it describes most of them and makes
all as likely, counting outliers, as a residual does. Otherwise the variances of the residual and the noise
follow from the marginal likelihood on a grid. The waviness is USUAL_WAVINESS: the residual explains the rest.
"""

import math
from functools import cache, partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..arguments import Array
from ..lapack import cholesky, cholesky_in_place, solved, solved_definite
from ..patch.monge import TERMS, monomials
from ..patch.residual import Residual, kernels, places_factor
from .evidence import USUAL_WAVINESS, prior_variances
from .measured_slopes import slope_equations
from .posterior import FREE

# Chosen with benchmarks.real.
ROUGH_MISFIT = 5e-4  # Beside a residual the noise is at least this share of the radius: facets and rounding.
AMPLITUDES = np.array([0.003, 0.01, 0.04, 0.14, 0.5])  # Grid of the residual's deviation, in unit radius.
ALONE = np.array([0.3, 0.6, 1.2])  # Grid of the waviness of a surface without a residual.
RESIDUAL_NOISES, MIDDLE = 3, 1  # Grid points of the noise, up to what the sextic leaves; the middle one.
RESIDUAL_UPWARD = np.arange(RESIDUAL_NOISES) / (RESIDUAL_NOISES - 1.0)
MOST_PLACES = 150  # About so many contacts at most carry a residual and tell how large it is.
ODDS = 0.2  # There is a residual from these odds on: it costs a smooth surface little.
NEGLIGIBLE = 160.0  # If -2 log likelihood exceeds the best by more, no other noise is tried.
# Prior variance of slopes and second derivatives beside a residual: with 100 they run away if curves end
# early.
FREE_VARIANCE = 0.06
# The log likelihood counts by this share: neighbors on a curve do not tell of waves between curves.
TEMPER = 0.1


class Observations(NamedTuple):
    """What a touch has felt, in unit radius and in a frame near to its Darboux frame.

    contacts : (n, 3)
    weights : (n,), above 0
    least, most : bounds of the contacts' noise
    normals : (n, 3), measured normals over their standard deviation; None if there are none
    ranks : (n,), of the contacts on each half of a curve, from the rim, and of those beside
    """

    contacts: Array
    weights: Array
    least: float
    most: float
    normals: Array | None
    ranks: NDArray[np.intp]

    def moved(self, turn: Array, scale: float) -> "Observations":
        """This touch in the axes `turn` (3, 3), with lengths divided by `scale`."""
        return self._replace(
            contacts=self.contacts @ turn / scale,
            least=self.least / scale,
            most=self.most / scale,
            normals=None if self.normals is None else self.normals @ turn,
        )


class System(NamedTuple):
    """What the fits of a touch with a residual are made of.

    basis : (n, 27), terms at the contacts; heights : (n,)
    places : (m,), indices of the contacts that carry the residual
    kernels : (n, m) each, kernels of unit variance between contacts and places
    """

    basis: Array
    heights: Array
    places: NDArray[np.intp]
    kernels: list[Array]


def system_of(touch: Observations) -> System:
    """The system of a touch."""
    flat = touch.contacts[:, :2]
    basis = monomials(flat[:, 0], flat[:, 1], TERMS)
    # They are evenly spread on each half of a curve, whichever way it runs and whichever curve is the first.
    places = np.flatnonzero(touch.ranks * min(len(flat), MOST_PLACES) % len(flat) < MOST_PLACES)
    return System(basis, touch.contacts[:, 2], places, kernels(flat, flat[places]))


class Sizes(NamedTuple):
    """Variances (2,) of the residual and the noise, averaged over a grid; whether a residual is asked for."""

    variances: Array
    noise: float
    asked: bool


def sizes(touch: Observations, system: System) -> Sizes:
    """How large residual and noise are, and whether a residual is asked for, by the marginal likelihood.

    Heights ~ N(0, K) with K = basis prior basis' + v k + noise^2. As in evidence.py, one Cholesky factor of K
    bordered by the heights gives their likelihood; the row of each contact is times the root of its weight.
    """
    basis, heights, kernels_within = _weighted(touch, system)
    noises = touch.least * (touch.most / touch.least) ** RESIDUAL_UPWARD
    with_it = _surprises(basis, heights, kernels_within, noises)
    without = _surprises_alone(basis / touch.most, heights / touch.most)
    without += 2.0 * len(heights) * math.log(touch.most)
    least = min(with_it.min(), without.min())
    p, p_alone = np.exp(-0.5 * (with_it - least)), np.exp(-0.5 * (without - least))
    shares = p**TEMPER / (p**TEMPER).sum()
    noise = float(np.sqrt(shares.sum(axis=(0, 1)) @ noises**2))
    return Sizes(shares.sum(axis=2) @ AMPLITUDES**2, noise, bool(p.mean() > ODDS * p_alone.mean()))


def _weighted(touch: Observations, system: System) -> tuple[Array, Array, list[Array]]:
    """Basis, heights and kernels of the places, each row times the root of its weight."""
    if len(system.places) == len(touch.weights) and touch.weights.min() == 1.0:
        return system.basis, system.heights, system.kernels
    root = np.sqrt(touch.weights[system.places])
    within = [root[:, None] * k[system.places] * root for k in system.kernels]
    return root[:, None] * system.basis[system.places], root * system.heights[system.places], within


def _prior(waviness: float) -> Array:
    """Prior variances (27,) of the coefficients beside a residual."""
    return np.concatenate([np.full(FREE, FREE_VARIANCE), prior_variances(np.array(waviness))])


def _surprises(basis: Array, heights: Array, kernels_within: list[Array], noises: Array) -> Array:
    """-2 log likelihood for each length, amplitude and noise, (2, 5, 3); inf where it was not computed.

    The middle noise comes first, from the middle amplitude on to where others only become worse. Other noises
    are tried where the likelihood of a length and an amplitude is not NEGLIGIBLE.
    """
    m, size = len(heights), len(AMPLITUDES)
    terms, work, *kernels_of = np.zeros((2 + len(kernels_within), m + 1, m + 1))
    terms[:m, :m] = (basis * _prior(USUAL_WAVINESS)) @ basis.T
    terms[:m, m] = terms[m, :m] = heights
    found = np.full((len(kernels_within), size, RESIDUAL_NOISES), np.inf)
    surprise = partial(_surprise, terms, work, 2.0 * float(heights @ heights))
    squares, noise_squares = (AMPLITUDES**2).tolist(), (noises**2).tolist()
    for within, kernel, surprises in zip(kernels_within, kernels_of, found, strict=True):
        kernel[:m, :m] = within
        for side in (range(size // 2, size), range(size // 2 - 1, -1, -1)):
            before = surprises[side.start - side.step, MIDDLE]
            for at in side:
                surprises[at, MIDDLE] = now = surprise(kernel, squares[at], noise_squares[MIDDLE])
                if now > max(before, found.min() + NEGLIGIBLE):
                    break
                before = now
    for length, at in np.argwhere(found[..., MIDDLE] < found.min() + NEGLIGIBLE).tolist():
        for i in (i for i in range(RESIDUAL_NOISES) if i != MIDDLE):
            found[length, at, i] = surprise(kernels_of[length], squares[at], noise_squares[i])
    return found


def _surprise(terms: Array, work: Array, twice: float, kernel: Array, variance: float, noise: float) -> float:
    """-2 log likelihood for one variance of the residual and one squared noise.

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


def _surprises_alone(basis: Array, heights: Array) -> Array:
    """-2 log likelihood without a residual for each of ALONE, (3,), in units of noise.

    It follows from the terms' precision, bordered by what the heights say of them.
    """
    rows, (precisions, logs) = np.column_stack([basis, heights]), _priors_alone()
    bordered = np.tile(rows.T @ rows, (len(ALONE), 1, 1))
    np.einsum("kii->ki", bordered)[:] += precisions  # a view
    pivots = np.einsum("kii->ki", np.linalg.cholesky(bordered))
    surprises: Array = 2.0 * np.log(pivots[:, :-1]).sum(axis=1) + logs + pivots[:, -1] ** 2 - 1.0
    return surprises


@cache
def _priors_alone() -> tuple[Array, Array]:
    """Prior precisions (3, 28) for each of ALONE, with 1 for the heights, and sums of log variances (3,)."""
    priors = np.array([_prior(waviness) for waviness in ALONE])
    # Adding 1 for the heights keeps rounding from leaving less than 0 over.
    return np.column_stack([1.0 / priors, np.ones(len(ALONE))]), np.log(priors).sum(axis=1)


def mean_given(touch: Observations, system: System, sizes: Sizes) -> Array:
    """Means of the terms and of the factors c of k(p, places), (27 + m,), by one Cholesky factor."""
    if touch.normals is not None or len(system.places) < len(touch.weights):
        return fitted(touch, system, sizes.variances, sizes.noise).mean
    (basis, heights, within), (one, other) = _weighted(touch, system), sizes.variances
    prior = _prior(USUAL_WAVINESS)
    matrix = (basis * prior) @ basis.T
    matrix += one * within[0] + other * within[1]
    matrix.flat[:: len(matrix) + 1] += sizes.noise**2
    solution = solved_definite(matrix, heights)
    return np.concatenate([prior * (solution @ basis), np.sqrt(touch.weights) * solution])


def fitted(touch: Observations, system: System, variances: Array, noise: float) -> Residual:
    """The residual, given its variances and the noise.

    The unknowns are the coefficients of the terms and of L^-1 k(u, p), because the latter have the prior
    precision 1, which makes the system well-conditioned.
    """
    index, terms = system.places, len(TERMS)
    to_points = variances[0] * system.kernels[0] + variances[1] * system.kernels[1]
    places = places_factor(to_points[index])
    # If each contact is a place, the features are the factor itself.
    whole = len(index) == len(to_points)
    features = np.hstack([system.basis, places if whole else solved(places, to_points.T).T])
    weighted = features * (np.sqrt(touch.weights) / noise)[:, None]
    precision = weighted.T @ weighted
    seen = weighted.T @ (system.heights * np.sqrt(touch.weights) / noise)
    precision.flat[:: len(precision) + 1] += np.append(1.0 / _prior(USUAL_WAVINESS), np.ones(len(index)))
    if touch.normals is not None:
        _add_slopes(touch, precision, seen)
    factor = cholesky(precision)
    mean = solved(factor, solved(factor, seen), transposed=True)
    mean[terms:] = solved(places, mean[terms:], transposed=True)
    residual = Residual(touch.contacts[index, :2], variances, mean, factor, np.array(noise))
    vars(residual)["places_factor"] = places  # This saves finding it again.
    return residual


def _add_slopes(touch: Observations, precision: Array, seen: Array) -> None:
    """Adds what measured normals say of the terms to the system, in place."""
    assert touch.normals is not None
    given = touch.normals, touch.contacts, touch.weights
    slopes, steepness = (part[0] for part in slope_equations(*(each[None] for each in given)))
    precision[: len(TERMS), : len(TERMS)] += slopes.T @ slopes
    seen[: len(TERMS)] += slopes.T @ steepness
