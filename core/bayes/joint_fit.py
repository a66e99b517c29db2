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

from ..arguments import Array
from ..contours.contour import along, cross, dot, scaled
from .evidence import USUAL_WAVINESS, Hyperparameters, prior_variances, restricted
from .linear_system import (
    System,
    hyperparameters,
    linear_system,
    posterior,
    prior_mean,
    solution,
)
from .posterior import FREE, Posterior

# benchmarks.accuracy judges MISFIT, and the outliers of benchmarks.stability judge the last two.
MISFIT = 2e-3  # The noise is at least this share of the radius, because no surface is a polynomial.
# There are at most so many passes: two turn the frame to what they found, others are for outliers.
PASSES = 8
SETTLED_WEIGHT = 0.1  # A fit is settled when no weight changes by more between passes.
STALE_WEIGHT = 0.5  # Waviness and noise are found anew when a weight has changed by more since.
ALIKE_CURVATURES = 1e-4  # Curvatures that differ by less count as alike; heights change by an eighth of it.
LEVEL = 5e-3  # Axes are level when the slope is less: heights change by its product with slope and height.
OUTLYING = 5.0  # A contact off by more standard deviations is an outlier.
STUDENT = 4.0  # Outliers weigh as under a Student t distribution of so many degrees of freedom.


class _Touches(NamedTuple):
    """What a pass of the fit has to know of b touches. It changes all fields from the axes on.

    told : (b, n), the weights for which waviness, noise and triangle (evidence.py) were found
    """

    contacts: Array
    normals: Array  # (b, 0, 3) without
    tangent: Array
    floor: Array
    axes: Array
    k1: Array
    k2: Array
    weights: Array
    typical: Array
    variances: Array
    noise: Array
    triangle: Array
    told: Array

    @property
    def hyper(self) -> Hyperparameters:
        """Waviness and noise."""
        return Hyperparameters(self.typical, self.variances, self.noise)

    def at(self, which: NDArray[np.bool_]) -> "_Touches":
        """Some of these touches."""
        return _Touches(*(values[which] for values in self))


def joint_fit(
    contacts: Array,
    weights: Array,
    k1: Array,
    k2: Array,
    tangent: Array,
    noise: Array,
    normals: Array | None = None,
    through: bool = True,
) -> tuple[Array, Posterior, Array]:
    """The Darboux frames and the surfaces that the contacts of b touches show, and how well they show them.

    contacts : (b, n, 3), in unit radius, in a frame near to the Darboux frame
    weights : (b, n), 1 for a contact, 0 where there is none
    k1, k2 : (b,), a first guess of the curvatures along its axes
    tangent : (b, 3), in that frame, which d1 is to follow
    noise : (b,), standard deviation of a contact, at least
    normals : (b, n, 3), measured normals, over their standard deviation; 0 where there is none
    through : whether the surfaces pass through the origin; if not, their height there is free

    Returns the columns d1, d2, n (b, 3, 3) in the frame given, the posteriors in the new one, where
    the means of the slopes and of the mixed second derivative are 0, and the weights (b, n) that the
    contacts have in the end: where one is beyond OUTLYING standard deviations, they weigh as under a
    Student t distribution.
    """
    axes = np.eye(3)[None].repeat(len(contacts), axis=0)
    given = contacts[:, :0] if normals is None else normals
    floor, usual = np.maximum(noise, MISFIT), prior_variances(np.full(len(contacts), USUAL_WAVINESS))
    unknown = np.zeros((*usual.shape, usual.shape[1]))
    first = axes, k1, k2, weights, usual, usual, floor, unknown, weights
    touches = _Touches(contacts, given, tangent, floor, *first)
    pending, found = np.arange(len(contacts)), []
    for step in range(PASSES):
        touches, settled, surface = _pass(touches, step, through)
        if surface is not None:
            found.append((pending[settled], touches.axes[settled], touches.weights[settled], *surface))
        if settled.all():
            break
        if not settled.any():
            continue
        touches, pending = touches.at(~settled), pending[~settled]
    if len(found) == 1:  # All have settled at once, as nearly always, so they are in order.
        return found[0][1], Posterior(*found[0][3:]), found[0][2]
    order, turns, found_weights, *surfaces = (np.concatenate(parts) for parts in zip(*found, strict=True))
    back = np.argsort(order)
    return turns[back], Posterior(*(values[back] for values in surfaces)), found_weights[back]


def _pass(
    touches: _Touches, step: int, through: bool
) -> tuple[_Touches, NDArray[np.bool_], Posterior | None]:
    """One fit in the axes and with the weights so far: a mask of settled touches, and their posteriors."""
    expected = prior_mean(touches.k1, touches.k2)
    local, normals = touches.contacts @ touches.axes, touches.normals @ touches.axes
    system = linear_system(local, touches.weights, expected, normals, through)
    if step:
        stale = np.abs(touches.weights - touches.told).max(axis=1) > STALE_WEIGHT
        touches = _with_evidence(touches, system, stale | (step == 1))
    found = solution(system, touches.hyper)
    mean = expected + found
    found_axes = [turned(*touch) for touch in zip(touches.axes, mean, touches.tangent, strict=True)]
    axes, k1, k2, angle = (np.array(values) for values in zip(*found_axes, strict=True))
    # Outliers can be told only once the axes are level.
    level = np.hypot(mean[:, 0], mean[:, 1]) <= LEVEL if step < 2 else np.full(len(mean), True)
    weights, settled, surface = touches.weights, np.full(len(mean), step == PASSES - 1), None
    if step and level.any():
        told = _student_weights(system.residuals(found), weights > 0.0, touches.floor)
        weights = np.where(level[:, None], told, weights)
        settled |= level & (np.abs(weights - touches.weights).max(axis=1) <= SETTLED_WEIGHT)
    if step and settled.any():
        which = slice(None) if settled.all() else settled
        surface = posterior(mean, system, touches.triangle, touches.hyper, touches.weights)
        surface = surface.at(which).turned(angle[which])
        surface.mean[:, [0, 1, 3]] = 0.0
        surface.mean[:, 2], surface.mean[:, 4] = k1[settled] / 2.0, k2[settled] / 2.0
    return touches._replace(axes=axes, k1=k1, k2=k2, weights=weights), settled, surface


def _with_evidence(touches: _Touches, system: System, stale: NDArray[np.bool_]) -> _Touches:
    """The touches, where waviness and noise of the stale ones (b,) are found anew from their systems."""
    if not stale.any():
        return touches
    some = system if stale.all() else system.at(stale)
    data = restricted(some.equations)
    found = *hyperparameters(some, data, touches.floor[stale]), data.triangle, touches.weights[stale]
    if stale.all():
        return _Touches(*touches[:-5], *found)
    changed = _Touches(*touches[:-5], *(values.copy() for values in touches[-5:]))
    for values, new in zip(changed[-5:], found, strict=True):
        values[stale] = new
    return changed


def posterior_of(k1: float, k2: float, contacts: Array, noise: float) -> Posterior:
    """The posterior of contacts (n, 3) in a given frame with curvatures k1 and k2, all in unit radius."""
    return posteriors_of(k1, k2, contacts, np.ones((1, len(contacts))), noise).at(0)


def posteriors_of(
    k1: float, k2: float, contacts: Array, weights: Array, noise: float, by_evidence: bool = True
) -> Posterior:
    """What `posterior_of` gives for b different weights (b, n) of the contacts.

    by_evidence : whether waviness and noise follow from the contacts. If not, they are the usual waviness and
        the given noise, which is quick; the visibility is 0 then
    """
    b = len(weights)
    expected, local = prior_mean(np.full(b, k1), np.full(b, k2)), contacts[None].repeat(b, axis=0)
    system = linear_system(local, weights, expected, local[:, :0])
    floor, usual = np.full(b, max(noise, MISFIT)), prior_variances(np.full(b, USUAL_WAVINESS))
    triangle, hyper = np.zeros((b, *2 * usual.shape[1:])), Hyperparameters(usual, usual, floor)
    if by_evidence:
        data = restricted(system.equations)
        triangle, hyper = data.triangle, hyperparameters(system, data, floor)
    return posterior(expected + solution(system, hyper), system, triangle, hyper, weights)


def _student_weights(residuals: Array, present: NDArray[np.bool_], floor: Array) -> Array:
    """Weights of the contacts, (b, n): all 1 if none of a touch is outlying, 0 where there is no contact."""
    misses = np.abs(residuals)
    if np.all(misses <= OUTLYING * floor[:, None]):  # This is so in most cases, and quick to find out.
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


def turned(axes: Array, mean: Array, tangent: Array) -> tuple[Array, float, float, float]:
    """The axes tilted to a surface's normal and turned to its principal directions; k1, k2; the angle turned.

    mean : coefficients of the surface in the axes (3, 3); tangent : (3,), which d1 is to follow
    """
    # Python floats are faster than arrays of three elements.
    sx, sy, xx, xy, yy = mean[:FREE].tolist()
    d1, d2, up = axes.T.tolist()
    given = tangent.tolist()
    n = scaled(along(along(up, d1, -sx), d2, -sy), 1.0 / math.sqrt(1.0 + sx**2 + sy**2))
    tx, ty = dot(given, d1), dot(given, d2)
    half, angle = math.hypot(xx - yy, xy), 0.5 * math.atan2(-xy, yy - xx)
    if half <= ALIKE_CURVATURES * max(1.0, abs(xx), abs(yy)):
        half, angle = 0.0, math.atan2(ty, tx)
    if math.cos(angle) * tx + math.sin(angle) * ty < 0.0:
        angle += math.pi
    d1 = along(scaled(d1, math.cos(angle)), d2, math.sin(angle))
    d1 = along(d1, n, -dot(d1, n))
    d1 = scaled(d1, 1.0 / math.sqrt(dot(d1, d1)))
    return np.array([d1, cross(n, d1), n]).T, xx + yy - half, xx + yy + half, angle
