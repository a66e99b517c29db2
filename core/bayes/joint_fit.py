# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The fit of polynomials, which finds their Darboux frames and weighs outliers down, many touches at once.

Not in the paper. Each pass solves for all coefficients in the axes so far; then the axes turn to the normal
and the principal directions that were found, and outlying contacts are weighed down. All functions fit b
touches at once: with one touch, most of the time goes into calling numpy.
"""

import math
from statistics import median
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..arguments import DECIMALS, Array
from ..contours.contour import along, cross, dot, scaled
from ..contours.local_geometry import UMBILIC
from ..verdict import SIGNIFICANT
from .evidence import Hyperparameters
from .posterior import SurfacePosterior
from .prior import FREE, USUAL_VARIANCES, prior_mean
from .sextic import Sextics, mean_given, posterior_given, sextics, with_scatter

# The noise is at least this share of the radius, because no surface is a polynomial. With less the waviness
# follows what polynomials leave, and automatic touches end earlier (benchmarks.model, e20b52a).
MISFIT = 2e-3
# benchmarks.accuracy judges these, and the outliers of benchmarks.stability the last.
# The largest number of passes: two turn the frame to what they found, others are for outliers.
PASSES = 8
SETTLED_WEIGHT = 0.1  # A fit is settled when no weight changes by more between passes.
ALIKE_CURVATURES = 1e-4  # Curvatures that differ by less count as alike; heights change by an eighth of it.
LEVEL = 5e-3  # Axes are level when the slope is less: heights change by its product with slope and height.
STUDENT = 4.0  # Outliers weigh as under a Student t distribution of this many degrees of freedom.


class Observations(NamedTuple):
    """What b touches have felt, in unit radius and in a frame near to the Darboux frame.

    contacts : (b, n, 3); normals : (b, n, 3), over their standard deviation, 0 where there is none; or
        (b, 0, 3) without
    tangent : (b, 3), which d1 is to follow
    noise : (b,), standard deviation of a contact, at least; noise_is_known : (b,), whether it is no more
    point_std : (b,), standard deviation of the height at the origin, before contacts are known
    """

    contacts: Array
    normals: Array
    tangent: Array
    noise: Array
    noise_is_known: NDArray[np.bool_]
    point_std: Array

    def at(self, which: NDArray[np.bool_]) -> "Observations":
        """Those of some of the touches."""
        return Observations._make(values[which] for values in self)


class _State(NamedTuple):
    """What a pass changes: axes (b, 3, 3), k1 and k2 (b,), weights (b, n), and hyperparameters."""

    axes: Array
    k1: Array
    k2: Array
    weights: Array
    prior: Array
    noise: Array

    def at(self, which: NDArray[np.bool_]) -> "_State":
        """The state of some of the touches."""
        return _State._make(values[which] for values in self)


def joint_fit(
    given: Observations, weights: Array, k1: Array, k2: Array
) -> tuple[Array, SurfacePosterior, Array]:
    """The Darboux frames and the polynomials that the contacts of b touches show, and how well they do.

    weights : (b, n), 1 for a contact, 0 where there is none
    k1, k2 : (b,), a first guess of the curvatures along the given axes

    Returns the columns d1, d2, n (b, 3, 3) in the frame given, the posteriors in the new one, where
    the means of the slopes and of the mixed second derivative are 0, and the weights (b, n) that the
    contacts have in the end: where one is beyond SIGNIFICANT standard deviations, they weigh as under a
    Student t distribution.
    """
    given = given._replace(noise=np.maximum(given.noise, MISFIT))
    usual = USUAL_VARIANCES[None].repeat(len(k1), axis=0)
    state = _State(_first_axes(given.contacts, weights, k1, k2), k1, k2, weights, usual, given.noise)
    results: list[Array] = []
    active = np.arange(len(k1))  # The touches that are not settled yet.
    for step in range(PASSES):
        state, settled, of = _pass(given, state, step)
        if of is None:
            continue
        arrays = [state.axes, of.mean, of.root, of.noise, of.visibility, state.weights]
        results = results or arrays
        for result, array in zip(results, arrays, strict=True):
            result[active] = array
        if settled.all():
            break
        active, given, state = active[~settled], given.at(~settled), state.at(~settled)
    axes, mean, root, noise, visibility, weights = results
    return axes, SurfacePosterior(mean, root, noise, visibility), weights


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
    given: Observations, state: _State, step: int
) -> tuple[_State, NDArray[np.bool_], SurfacePosterior | None]:
    """One fit in the axes and with the weights so far: a mask of settled touches; posteriors if any is."""
    expected = prior_mean(state.k1, state.k2)
    local, normals = given.contacts @ state.axes, given.normals @ state.axes
    data = sextics(local, state.weights, expected, normals, given.point_std / given.noise)
    hyper = _hyperparameters(state, data, given.noise, step)
    off_expected = mean_given(data, hyper)
    if normals.size:
        data = with_scatter(data, off_expected, normals)
        off_expected = mean_given(data, hyper)
    mean, weights = expected + off_expected, state.weights
    # Outliers show only once the axes are level.
    settled = np.full(len(mean), step > 0)
    if step == 1:
        settled = np.hypot(mean[:, 0], mean[:, 1]) <= LEVEL
    if settled.any():
        students = _student_weights(data.residuals(off_expected), weights > 0.0, given.noise)
        weights = np.where(settled[:, None], students, weights)
        settled &= (np.abs(weights - state.weights).max(axis=1) <= SETTLED_WEIGHT) | (step == PASSES - 1)
    # Axes follow the first curve in the end only, because the prior depends on them.
    tangent = np.where(settled[:, None], given.tangent, state.axes[..., 0])
    updates = map(frame_update, state.axes, mean, tangent)
    axes, k1, k2, angle = (np.array(values) for values in zip(*updates, strict=True))
    state = _State(axes, k1, k2, weights, hyper.prior, hyper.noise)
    if not settled.any():
        return state, settled, None
    surface = posterior_given(mean, data, hyper).rotated(angle)
    surface.mean[:, [0, 1, 3]] = 0.0
    surface.mean[:, 2], surface.mean[:, 4] = k1 / 2.0, k2 / 2.0
    return state, settled, surface


def _hyperparameters(state: _State, data: Sextics, floor: Array, step: int) -> Hyperparameters:
    """Waviness and noise, which are estimated anew after the first pass and while contacts are outliers."""
    stale = ((state.weights > 0.0) & (state.weights < 1.0)).any(axis=1) | (step == 1)
    if not stale.any():
        return Hyperparameters(state.prior, state.noise)
    likely, prior, noise = data.hyperparameters(floor, stale), state.prior.copy(), state.noise.copy()
    prior[stale], noise[stale] = likely.prior, likely.noise
    return Hyperparameters(prior, noise)


def posterior_of(k1: float, k2: float, contacts: Array, noise: float, point_std: float) -> SurfacePosterior:
    """The posterior of contacts (n, 3) in a given frame with curvatures k1 and k2, all in unit radius."""
    return posteriors_of(k1, k2, contacts, np.ones((1, len(contacts))), noise, point_std).at(0)


def posteriors_of(
    k1: float,
    k2: float,
    contacts: Array,
    weights: Array,
    noise: float,
    point_std: float,
    by_evidence: bool = True,
) -> SurfacePosterior:
    """What `posterior_of` gives for b different weights (b, n) of the contacts.

    by_evidence : whether waviness and noise follow from the contacts. If not, they are the usual waviness and
        the given noise, or MISFIT if that is more, which is quick

    k1, k2 : those of the prior's mean
    """
    b = len(weights)
    expected = prior_mean(np.array([k1]), np.array([k2])).repeat(b, axis=0)
    local = contacts[None].repeat(b, axis=0)
    floor, usual = np.full(b, max(noise, MISFIT)), USUAL_VARIANCES[None].repeat(b, axis=0)
    data = sextics(local, weights, expected, normals=local[:, :0], point_std=point_std / floor)
    hyper = data.hyperparameters(floor) if by_evidence else Hyperparameters(usual, floor)
    return posterior_given(expected + mean_given(data, hyper), data, hyper)


def _student_weights(residuals: Array, present: NDArray[np.bool_], floor: Array) -> Array:
    """Weights of the contacts, (b, n): all 1 if none of a touch is outlying, 0 where there is no contact."""
    misses, weights = np.abs(residuals), present.astype(float)
    for i in np.flatnonzero((present & (misses > SIGNIFICANT * floor[:, None])).any(axis=1)):
        ratios = misses[i] / max(floor[i], 1.4826 * median(misses[i][present[i]].tolist()))
        if ratios[present[i]].max() > SIGNIFICANT:
            weights[i] *= (STUDENT + 1.0) / (STUDENT + ratios**2)
    return weights


def frame_update(axes: Array, mean: Array, tangent: Array) -> tuple[Array, float, float, float]:
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
