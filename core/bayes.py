# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The accurate fit: one Bayesian linear solve for everything at once, which knows what it cannot see.

Beside the paper. Near the reference point the surface is taken for a polynomial of degree 6, in unit
radius and in its Darboux frame. Slopes and second derivatives are free. The coefficient a_ij of a
higher degree is a length^(1 - i - j): where the curvature changes over a length l it has the size
l^(1 - i - j), so its prior is

    a_ij ~ N(m_ij, (waviness^(i + j - 1) / 10)^2)    with waviness = L / l.

m are the quartic and sextic of a surface that goes on with the curvatures it has at the point. The
waviness and the noise of the contacts follow from their marginal likelihood (evidence.py).

All functions fit b touches at once: of one, most of the time goes into calling numpy.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .arguments import Array
from .contour import cross
from .evidence import (
    FREE_PRECISION,
    SCALE,
    USUAL_WAVINESS,
    Hyperparameters,
    NormalEquations,
    Restricted,
    evidence,
    evidence_with_slopes,
    noises,
    prior_variances,
    restricted,
)
from .monge import monomials
from .posterior import FREE, TERMS, Posterior
from .slopes import slope_equations

MISFIT = 2e-3  # of the radius: no surface is a polynomial, so the noise is never less
PASSES = 8  # at most: two that turn the frame to what they found, and more for what is outlying
SETTLED = 0.1  # of a weight, between passes
UMBILIC = 1e-4  # the difference of curvatures that is none; heights change by an eighth of it
LEVEL = 5e-3  # slope left over; it changes heights by its product with a slope and a height
OUTLYING = 5.0  # standard deviations
STUDENT = 4.0  # degrees of freedom


class _System(NamedTuple):
    """Heights (b, n) ~ basis (b, n, 27) @ coefficients, less the prior's mean; and its normal equations.

    gram (b, 27, 27) and seen (b, 27) are basis' basis and basis' heights, weighted. slopes (b, 2n, 27)
    @ coefficients ~ steepness (b, 2n) in units of their deviation, weighted; None without normals.
    """

    basis: Array
    heights: Array
    gram: Array
    seen: Array
    slopes: Array | None = None
    steepness: Array | None = None


class _Touches(NamedTuple):
    """What a pass of the fit needs to know of b touches; the last four are what it changes."""

    contacts: Array
    normals: Array  # (b, 0, 3) without
    tangent: Array
    floor: Array
    axes: Array
    k1: Array
    k2: Array
    weights: Array


def joint_fit(
    contacts: Array,
    weights: Array,
    k1: Array,
    k2: Array,
    tangent: Array,
    accuracy: Array,
    normals: Array | None = None,
) -> tuple[Array, Posterior]:
    """The Darboux frames and the surfaces that the contacts of b touches show, and how well they show them.

    contacts : (b, n, 3), in unit radius, in a frame near to the Darboux frame
    weights : (b, n), 1 for a contact, 0 where there is none
    k1, k2 : (b,), a first guess of the curvatures along its axes
    tangent : (b, 3), in that frame, which d1 is to follow
    accuracy : (b,), standard deviation of a contact, at least
    normals : (b, n, 3), measured, over their standard deviation; 0 where there is none

    Returns the columns d1, d2, n (b, 3, 3) in the frame given, and the posteriors in the new one, where
    the means of the slopes and of the mixed second derivative are 0. Where a residual is beyond
    OUTLYING standard deviations, contacts weigh as under a Student t distribution.
    """
    axes = np.eye(3)[None].repeat(len(contacts), axis=0)
    given = contacts[:, :0] if normals is None else normals
    touches = _Touches(contacts, given, tangent, np.maximum(accuracy, MISFIT), axes, k1, k2, weights)
    pending, found = np.arange(len(contacts)), []
    for step in range(PASSES):
        touches, settled, posterior = _pass(touches, step)
        if posterior is not None:
            found.append((pending[settled], touches.axes[settled], *posterior))
        if settled.all():
            break
        if not settled.any():
            continue
        touches, pending = _Touches(*(values[~settled] for values in touches)), pending[~settled]
    if len(found) == 1:  # all at once, as nearly always: in the order they came
        return found[0][1], Posterior(*found[0][2:])
    order, turns, *posteriors = (np.concatenate(parts) for parts in zip(*found, strict=True))
    back = np.argsort(order)
    return turns[back], Posterior(*(values[back] for values in posteriors))


def _pass(touches: _Touches, step: int) -> tuple[_Touches, NDArray[np.bool_], Posterior | None]:
    """The fit in the axes and with the weights so far; which touches are settled, and their posteriors."""
    prior_mean = np.array([_prior_mean(*pair) for pair in zip(touches.k1, touches.k2, strict=True)])
    local = touches.contacts @ touches.axes
    system = _system(local, touches.weights, prior_mean)
    if touches.normals.shape[1]:
        slopes, steepness = slope_equations(touches.normals @ touches.axes, local, touches.weights)
        steepness -= (slopes @ prior_mean[..., None])[..., 0]
        system = system._replace(slopes=slopes, steepness=steepness)
    data = None if step == 0 else restricted(system.basis, system.heights, touches.weights)
    if data is None:
        waviness = np.full(len(prior_mean), USUAL_WAVINESS)
        hyper = Hyperparameters(waviness, prior_variances(waviness), touches.floor)
    elif system.slopes is None:
        hyper = evidence(data, noises(data, touches.floor))
    else:
        hyper = evidence_with_slopes(*_normal_equations(system, touches.weights), noises(data, touches.floor))
    solution = _solution(system, hyper)
    mean = prior_mean + solution
    turned = [_turned(*touch) for touch in zip(touches.axes, mean, touches.tangent, strict=True)]
    axes, k1, k2, angle = (np.array(values) for values in zip(*turned, strict=True))
    # Outliers show against a surface in level axes.
    level = np.hypot(mean[:, 0], mean[:, 1]) <= LEVEL if step < 2 else np.full(len(mean), True)
    weights, settled, posterior = touches.weights, np.full(len(mean), step == PASSES - 1), None
    if data is not None and level.any():
        residuals = system.heights - (system.basis @ solution[..., None])[..., 0]
        weights = np.where(level[:, None], _student_weights(residuals, weights > 0.0, touches.floor), weights)
        settled |= level & (np.abs(weights - touches.weights).max(axis=1) <= SETTLED)
    if data is not None and settled.any():
        which = slice(None) if settled.all() else settled
        posterior = _posterior(mean, system, data, hyper, touches.weights).at(which).turned(angle[which])
        posterior.mean[:, [0, 1, 3]] = 0.0
        posterior.mean[:, 2], posterior.mean[:, 4] = k1[settled] / 2.0, k2[settled] / 2.0
    return touches._replace(axes=axes, k1=k1, k2=k2, weights=weights), settled, posterior


def posterior_of(k1: float, k2: float, contacts: Array, accuracy: float) -> Posterior:
    """What contacts (n, 3) say in a frame and about curvatures that are given; all in unit radius."""
    weights, prior_mean = np.ones((1, len(contacts))), _prior_mean(k1, k2)[None]
    system = _system(contacts[None], weights, prior_mean)
    data = restricted(system.basis, system.heights, weights)
    hyper = evidence(data, noises(data, np.array([max(accuracy, MISFIT)])))
    return _posterior(prior_mean + _solution(system, hyper), system, data, hyper, weights).at(0)


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


def _system(local: Array, weights: Array, prior_mean: Array) -> _System:
    flat = local.reshape(-1, 3)
    basis = monomials(flat[:, 0], flat[:, 1], TERMS).reshape(*weights.shape, -1)
    heights = local[..., 2] - (basis @ prior_mean[..., None])[..., 0]
    weighted = np.swapaxes(weights[..., None] * basis, 1, 2)
    return _System(basis, heights, weighted @ basis, (weighted @ heights[..., None])[..., 0])


def _normal_equations(system: _System, weights: Array) -> tuple[NormalEquations, NormalEquations]:
    """Of the heights and of the slopes."""
    square = (weights * system.heights**2).sum(axis=1)
    heights = NormalEquations(system.gram, system.seen, square, (weights > 0.0).sum(axis=1, dtype=float))
    assert system.slopes is not None and system.steepness is not None
    turned, steepness = np.swapaxes(system.slopes, 1, 2), system.steepness
    return heights, NormalEquations(
        turned @ system.slopes, (turned @ steepness[..., None])[..., 0], (steepness**2).sum(axis=1)
    )


def _solution(system: _System, hyper: Hyperparameters) -> Array:
    """The likeliest coefficients less the prior's mean, (b, 27)."""
    # The heights come out nearest with the typical prior, the intervals cover with the averaged one.
    precision = _precision(system, prior_variances(hyper.waviness), hyper.noise)
    seen = (system.seen / hyper.noise[:, None] ** 2)[..., None]
    if system.slopes is not None and system.steepness is not None:
        seen = seen + np.swapaxes(system.slopes, 1, 2) @ system.steepness[..., None]
    solution: Array = np.linalg.solve(precision, seen)
    return solution[..., 0]


def _posterior(
    mean: Array, system: _System, data: Restricted, hyper: Hyperparameters, weights: Array
) -> Posterior:
    covariance = np.linalg.inv(_precision(system, hyper.variances, hyper.noise))
    visibility = data.triangle * (SCALE / hyper.noise)[:, None, None]
    if system.slopes is not None:
        # What the slopes show of the free terms too: the QR of all there is, each in its deviation.
        rows = np.concatenate(
            [np.sqrt(weights)[..., None] * system.basis / hyper.noise[:, None, None], system.slopes], axis=1
        )
        triangle: Array = np.linalg.qr(rows, mode="r")  # type: ignore[assignment]
        visibility = SCALE * triangle[:, FREE:, FREE:]
    return Posterior(mean, covariance, hyper.noise, visibility)


def _precision(system: _System, variances: Array, noise: Array) -> Array:
    """(b, 27, 27), the inverse of the covariance."""
    precision = system.gram / noise[:, None, None] ** 2
    if system.slopes is not None:
        precision = precision + np.swapaxes(system.slopes, 1, 2) @ system.slopes
    diagonal = np.einsum("bii->bi", precision)  # a view
    diagonal[:, :FREE] += FREE_PRECISION  # with that no contacts make it singular
    diagonal[:, FREE:] += 1.0 / variances
    return precision


def _student_weights(residuals: Array, present: NDArray[np.bool_], floor: Array) -> Array:
    """Weights of the contacts, (b, n): all 1 where none of a touch is outlying; 0 where there is none."""
    misses = np.abs(residuals)
    if np.all(misses <= OUTLYING * floor[:, None]):  # as most often: no need to look closer
        return present.astype(float)
    ordered, row = np.sort(np.where(present, misses, np.inf), axis=1), np.arange(len(misses))
    count = present.sum(axis=1)
    median = 0.5 * (ordered[row, (count - 1) // 2] + ordered[row, count // 2])
    deviation = np.maximum(floor, 1.4826 * median)
    if np.all(ordered[row, count - 1] <= OUTLYING * deviation):
        return present.astype(float)
    ratios = misses / deviation[:, None]
    outlying = ordered[row, count - 1] > OUTLYING * deviation
    return np.where(present, np.where(outlying[:, None], (STUDENT + 1.0) / (STUDENT + ratios**2), 1.0), 0.0)


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
