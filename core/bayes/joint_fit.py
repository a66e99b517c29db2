# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The fit of polynomials, which finds their Darboux frames and weighs outliers down, many touches at once.

Beside the paper. Each pass solves for all coefficients in the axes so far; then the axes turn to the normal
and the principal directions that were found, and outlying contacts are weighed down. All functions fit b
touches at once: of one, most of the time goes into calling numpy.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..arguments import Array
from ..contours.contour import along, cross, dot, scaled
from ..contours.local_geometry import UMBILIC
from .evidence import Hyperparameters, hyperparameters
from .posterior import SurfacePosterior
from .prior import FREE, USUAL_WAVINESS, prior_mean, prior_variances
from .sextic import Sextics, mean_given, posterior_given, sextics, with_scatter

# benchmarks.accuracy judges MISFIT, and the outliers of benchmarks.stability judge the last two.
MISFIT = 2e-3  # The noise is at least this share of the radius, because no surface is a polynomial.
# There are at most so many passes: two turn the frame to what they found, others are for outliers.
PASSES = 8
SETTLED_WEIGHT = 0.1  # A fit is settled when no weight changes by more between passes.
STALE_WEIGHT = 0.5  # Waviness and noise are found anew when a weight has changed by more since.
ALIKE_CURVATURES = 1e-4  # Curvatures that differ by less count as alike; heights change by an eighth of it.
LEVEL = 5e-3  # Axes are level when the slope is less: heights change by its product with slope and height.
OUTLYING = 5.0  # A contact off by more standard deviations is an outlier.
DECIMALS = 9  # Heights and distances count to so many decimals, so that rounding does not choose.
STUDENT = 4.0  # Outliers weigh as under a Student t distribution of so many degrees of freedom.


class _Given(NamedTuple):
    """What b touches are fitted to.

    contacts : (b, n, 3); normals : (b, n, 3), or (b, 0, 3) without
    tangent : (b, 3); floor : (b,), the least noise
    """

    contacts: Array
    normals: Array
    tangent: Array
    floor: Array


class _State(NamedTuple):
    """What a pass knows of b touches, and changes.

    axes : (b, 3, 3); k1, k2 : (b,); weights : (b, n)
    typical, variances, noise : the hyperparameters, which were found with the weights `of_weights` (b, n)
    """

    axes: Array
    k1: Array
    k2: Array
    weights: Array
    typical: Array
    variances: Array
    noise: Array
    of_weights: Array

    @property
    def hyper(self) -> Hyperparameters:
        """Waviness and noise."""
        return Hyperparameters(self.typical, self.variances, self.noise)


def joint_fit(
    contacts: Array,
    weights: Array,
    k1: Array,
    k2: Array,
    tangent: Array,
    noise: Array,
    normals: Array | None = None,
    through: bool = True,
) -> tuple[Array, SurfacePosterior, Array]:
    """The Darboux frames and the polynomials that the contacts of b touches show, and how well they do.

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
    axes = _first_axes(contacts, weights, k1, k2)
    floor, usual = np.maximum(noise, MISFIT), prior_variances(np.full(len(contacts), USUAL_WAVINESS))
    given = _Given(contacts, contacts[:, :0] if normals is None else normals, tangent, floor)
    state = _State(axes, k1, k2, weights, usual, usual, floor, weights)
    pending, found = np.arange(len(contacts)), []
    for step in range(PASSES):
        state, settled, surface = _pass(given, state, step, through)
        if surface is not None:
            parts = surface.mean, surface.root, surface.noise, surface.visibility
            found.append((pending[settled], state.axes[settled], state.weights[settled], *parts))
        if settled.all():
            break
        if not settled.any():
            continue
        given, state = _Given(*(v[~settled] for v in given)), _State(*(v[~settled] for v in state))
        pending = pending[~settled]
    if len(found) == 1:  # All have settled at once, as nearly always, so they are in order.
        return found[0][1], SurfacePosterior(*found[0][3:]), found[0][2]
    order, turns, found_weights, *surfaces = (np.concatenate(parts) for parts in zip(*found, strict=True))
    back = np.argsort(order)
    mean, root, noise, visibility = (values[back] for values in surfaces)
    return turns[back], SurfacePosterior(mean, root, noise, visibility), found_weights[back]


def _first_axes(contacts: Array, weights: Array, k1: Array, k2: Array) -> Array:
    """The axes (b, 3, 3) of the first pass: as given, or at an umbilic toward the highest contact.

    At an umbilic the given ones follow the first curve, whichever that is, and the prior depends on axes. On
    a plane they are toward the farthest contact.
    """
    axes = np.eye(3)[None].repeat(len(contacts), axis=0)
    for i in np.flatnonzero(k2 - k1 <= 2.0 * UMBILIC * np.maximum(1.0, np.abs(k1))):
        away = np.hypot(contacts[i, :, 0], contacts[i, :, 1]) * weights[i]
        heights = (np.abs(contacts[i, :, 2]) * weights[i]).round(DECIMALS)
        chosen = np.argmax(heights if heights.any() else away.round(DECIMALS))
        if away[chosen]:
            x, y = contacts[i, chosen, :2] / away[chosen]
            axes[i, :2, :2] = (x, -y), (y, x)
    return axes


def _pass(
    given: _Given, state: _State, step: int, through: bool
) -> tuple[_State, NDArray[np.bool_], SurfacePosterior | None]:
    """One fit in the axes and with the weights so far: a mask of settled touches, and their posteriors."""
    expected = prior_mean(state.k1, state.k2)
    local, normals = given.contacts @ state.axes, given.normals @ state.axes
    data = sextics(local, state.weights, expected, normals, through)
    if step:
        stale = np.abs(state.weights - state.of_weights).max(axis=1) > STALE_WEIGHT
        state = _with_evidence(state, data, given.floor, stale | (step == 1))
    found = mean_given(data, state.hyper)
    if data.slopes is not None:
        data = with_scatter(data, found)
        found = mean_given(data, state.hyper)
    mean = expected + found
    # Outliers can be told only once the axes are level.
    level = np.hypot(mean[:, 0], mean[:, 1]) <= LEVEL if step < 2 else np.full(len(mean), True)
    weights, settled, surface = state.weights, np.full(len(mean), step == PASSES - 1), None
    if step and level.any():
        students = _student_weights(data.residuals(found), weights > 0.0, given.floor)
        weights = np.where(level[:, None], students, weights)
        settled |= level & (np.abs(weights - state.weights).max(axis=1) <= SETTLED_WEIGHT)
    # Axes follow the first curve in the end only, because the prior depends on them.
    tangent = np.where(settled[:, None], given.tangent, state.axes[..., 0])
    found_axes = [turned(*touch) for touch in zip(state.axes, mean, tangent, strict=True)]
    axes, k1, k2, angle = (np.array(values) for values in zip(*found_axes, strict=True))
    if step and settled.any():
        which = slice(None) if settled.all() else settled
        surface = posterior_given(mean, data, state.hyper).at(which).rotated(angle[which])
        surface.mean[:, [0, 1, 3]] = 0.0
        surface.mean[:, 2], surface.mean[:, 4] = k1[settled] / 2.0, k2[settled] / 2.0
    return state._replace(axes=axes, k1=k1, k2=k2, weights=weights), settled, surface


def _with_evidence(state: _State, data: Sextics, floor: Array, stale: NDArray[np.bool_]) -> _State:
    """The state, where waviness and noise of the stale touches (b,) are found anew."""
    if not stale.any():
        return state
    some = data if stale.all() else data.at(stale)
    found = *hyperparameters(some.heights, some.slopes, floor[stale]), state.weights[stale]
    if stale.all():
        return _State(*state[:-4], *found)
    changed = _State(*state[:-4], *(values.copy() for values in state[-4:]))
    for values, new in zip(changed[-4:], found, strict=True):
        values[stale] = new
    return changed


def posterior_of(k1: float, k2: float, contacts: Array, noise: float) -> SurfacePosterior:
    """The posterior of contacts (n, 3) in a given frame with curvatures k1 and k2, all in unit radius."""
    return posteriors_of(k1, k2, contacts, np.ones((1, len(contacts))), noise).at(0)


def posteriors_of(
    k1: float, k2: float, contacts: Array, weights: Array, noise: float, by_evidence: bool = True
) -> SurfacePosterior:
    """What `posterior_of` gives for b different weights (b, n) of the contacts.

    by_evidence : whether waviness and noise follow from the contacts. If not, they are the usual waviness and
        the given noise, which is quick
    """
    b = len(weights)
    expected, local = prior_mean(np.full(b, k1), np.full(b, k2)), contacts[None].repeat(b, axis=0)
    data = sextics(local, weights, expected, local[:, :0])
    floor, usual = np.full(b, max(noise, MISFIT)), prior_variances(np.full(b, USUAL_WAVINESS))
    hyper = Hyperparameters(usual, usual, floor)
    if by_evidence:
        hyper = hyperparameters(data.heights, None, floor)
    return posterior_given(expected + mean_given(data, hyper), data, hyper)


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
