# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""How evenly a surface bends along its curves, and so how well these show its curvatures at the point.

Not in the paper. A smooth surface turns between contacts as it does around them. One of few facets, or with a
fold, turns at few places: its contacts show a curvature as a rule of integration with as few nodes would, and
those within a facet share an error. The fit explains such contacts, so its own deviation has neither of both.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..arguments import SMALLEST, Array
from ..contours.contour import Contour
from ..contours.curves import RIDGE
from ..contours.local_geometry import Frame
from ..lapack import solved_square
from ..verdict import SIGNIFICANT

# M bends, or LEAST_BENDS if there are fewer, show a curvature to the share (FEW_BENDS / M)^3. Fewer than
# FEW_BENDS are those of folds or facets (benchmarks.curvatures: folds, tips of cones; a cylinder of 24 facets
# has more). With 3 and 2, curvatures across folds without normals are off by over five deviations.
FEW_BENDS, LEAST_BENDS = 3.5, 3.0
# The steps around one whose median rate of turning is even: two folds are in up to four of them.
STEPS_AROUND = 9
FOLD_BEND = 3.0  # A fold by an angle a bends a patch by up to 3 a / L, if it is next to the point.
MOST_CHORDS = 24  # A curve without normals has at most this number of chords, as a touch has steps.
SHORT_STEP = 0.1  # Steps count as this share of the mean at least: contacts in one place are no fold.
# Turns beyond even ones are no folds if they are less, in radians, for no surface bends evenly. Without this,
# intervals of curvature hold in 98 to 100 % on exact surfaces (benchmarks.curvatures).
LEAST_FOLD = math.radians(1.8)
ROUNDED_TURN = 1e-6  # A curve whose normals turn by less, in radians, turns by rounding.


class Bends(NamedTuple):
    """How unevenly a surface bends along curves.

    second : (3, c), the second derivatives of x^2, xy and y^2 along each of c curves
    stds : (c,), deviations of the curvatures along these that too few bends leave, in unit radius
    contacts_per_bend : how many contacts share a bend, 1 or more
    folded : the largest |sum of turns beyond even ones| / H of a curve of fewer bends than FEW_BENDS
    """

    second: Array
    stds: Array
    contacts_per_bend: float
    folded: float

    def with_few(self, covariance: Array) -> Array:
        """The covariance (3, 3) of a fit's coefficients of x^2, xy and y^2, and what few bends add to it.

        Along each curve, the curvature is as uncertain as few bends leave it, or as the fit does if that is
        more.
        """
        second = self.second
        left = np.maximum(self.stds**2 - np.einsum("ic,ij,jc->c", second, covariance, second), 0.0)
        # Outliers may leave two curves.
        inverse = solved_square(second @ second.T + RIDGE * np.eye(3), second)
        both: Array = covariance + (inverse * left) @ inverse.T
        return both


def bends_of(
    contours: Sequence[Contour], frame: Frame, radius: float, noise: float, quadratic: Array
) -> Bends:
    """The bends along contours, by their normals or else by the chords between their contacts.

    noise : of a contact without normals, in unit radius
    quadratic : (3,), the patch's coefficients of x^2, xy and y^2 in unit radius

    Along a curve, the surface turns by d over each step h from contact to contact. With H = sum h these count
    as M = n (sum |d|)^2 / (H sum d^2 / h) bends: n if the turns of the n steps are as their lengths, and one
    if there is a single one of n even steps. The turns beyond even ones, which the steps around each show,
    count likewise, as M'. The deviation of a curve is a factor, which falls with M', times the difference
    between the curvature of the patch and the even one at the point. That counts as at least |sum of the
    turns beyond even ones| / H, and at most as the largest that these allow.
    """
    kinds = [
        [c for c in contours if (c.normals is None) is bare and len(c.points) > 2] for bare in (False, True)
    ]
    of_kinds = [_bends(_turns(kind, frame, radius, noise)) for kind in kinds if kind]
    x, y, turned, contacts, factors, mean, most, even = np.concatenate([np.empty((8, 0)), *of_kinds], axis=1)
    second = 2.0 * np.array([x * x, x * y, y * y])
    stds = factors * np.clip(np.abs(quadratic @ second - even), mean, most)
    sharing = float(turned @ contacts) / max(float(turned.sum()), SMALLEST)
    return Bends(second, stds, max(sharing, 1.0), float(mean[factors > 1.0].max(initial=0.0)))


class _Turns(NamedTuple):
    """The turns of c curves from contact to contact, m in all.

    toward : (c, 2), the direction of each curve in the tangent plane
    curve : (m,), the curve of each turn
    middles : (m,), where the turns are along their curves, in unit radius
    steps, turns : (m,), the steps h in unit radius, and the turns d in radians, above 0 where it is concave
    stds : (m,), deviations of the turns
    is_felt : whether these are turns of normals, which are the same all over a facet
    """

    toward: Array
    curve: NDArray[np.intp]
    middles: Array
    steps: Array
    turns: Array
    stds: Array
    is_felt: bool


def _turns(contours: Sequence[Contour], frame: Frame, radius: float, noise: float) -> _Turns:
    """The turns of curves of three contacts or more, of which all have normals or none has."""
    sizes = np.array([len(contour.points) for contour in contours])
    curve = np.arange(len(sizes)).repeat(sizes)
    local = frame.to_local(np.concatenate([contour.points for contour in contours])) / radius
    reach = np.hypot(local[:, 0], local[:, 1])
    farthest = np.lexsort((reach, curve))[sizes.cumsum() - 1]
    toward = local[farthest, :2] / np.maximum(reach[farthest, None], SMALLEST)
    along = np.einsum("ni,ni->n", local[:, :2], toward[curve])
    order = np.lexsort((along, curve))
    if is_felt := contours[0].normals is not None:
        normals = np.concatenate([contour.normals for contour in contours])[order]
        # Products of the largest numbers have to be finite.
        normals = normals / max(float(np.abs(normals).max()), 1e-300) @ frame.axes
        along, angles = along[order], _angles(normals, toward[curve])
        stds = np.array([contour.normal_std or 0.0 for contour in contours])[curve]
    else:
        curve, along, angles, stds = _chords(curve, along[order], local[order, 2], noise)
    first, second = _neighbors(curve)
    middles, steps = 0.5 * (along[second] + along[first]), along[second] - along[first]
    turns, stds = angles[second] - angles[first], np.hypot(stds[first], stds[second])
    return _Turns(toward, curve[second], middles, steps, turns, stds, is_felt)


def _angles(normals: Array, toward: Array) -> Array:
    """The angles (n,) of a surface along directions (n, 2), by its normals (n, 3) of any side and length."""
    across = np.copysign(1.0, normals[:, 2]) * np.einsum("ni,ni->n", normals[:, :2], toward)
    return np.arctan2(-across, np.abs(normals[:, 2]))


def _chords(
    curve: NDArray[np.intp], along: Array, heights: Array, noise: float
) -> tuple[NDArray[np.intp], Array, Array, Array]:
    """Curves, middles, angles and their deviations, (m,), of the chords between contacts (n,) in order."""
    last = np.bincount(curve) - 1
    if last.max() > MOST_CHORDS:
        rank, last = np.arange(len(curve)) - curve.searchsorted(curve), last[curve]
        chosen = rank * MOST_CHORDS // last > (rank - 1) * MOST_CHORDS // last
        curve, along, heights = curve[chosen], along[chosen], heights[chosen]
    first, second = _neighbors(curve)
    lengths = np.maximum(along[second] - along[first], SMALLEST)
    angles = np.arctan2(heights[second] - heights[first], lengths)
    # Neighbors have a contact in common, so the deviation of a turn is the square root of 6 in place of 4.
    stds = math.sqrt(3.0) * noise / lengths
    return curve[second], 0.5 * (along[first] + along[second]), angles, stds


def _neighbors(curve: NDArray[np.intp]) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """The indices (m,) of pairs that follow each other on the same curve, among the n of `curve` in order."""
    second = (curve[1:] == curve[:-1]).nonzero()[0] + 1
    return second - 1, second


def _even(of: _Turns) -> Array:
    """The rates of turning (m,) that steps have around each turn: a fold does not change their median.

    Beyond the ends of a curve its last steps follow in reverse order.
    """
    # scipy 1.15's median_filter is 0 for three values or fewer, and takes twice as long.
    rates, half = of.turns / np.maximum(of.steps, SMALLEST), STEPS_AROUND // 2
    start, last = of.curve.searchsorted(of.curve)[:, None], np.bincount(of.curve)[of.curve][:, None] - 1
    around = np.arange(len(rates))[:, None] - start + np.arange(-half, half + 1)
    mirrored = last - np.abs(around % np.maximum(2 * last, 1) - last)
    return np.sort(rates[start + mirrored], axis=1)[:, half]


def _unexplained(of: _Turns, beyond: Array) -> Array:
    """The turns (m,) beyond even ones; 0 where noise explains a turn and its sums with either neighbor."""
    stds = np.maximum(of.stds, 1e-300)
    pairs = np.abs(beyond[1:] + beyond[:-1]) * (of.curve[1:] == of.curve[:-1])
    pairs /= np.maximum(stds[1:], stds[:-1])
    off = np.maximum.reduce([np.abs(beyond) / stds, np.append(pairs, 0.0), np.append(0.0, pairs)])
    return np.where(off > SIGNIFICANT, beyond, 0.0)


def _with_neighbors(of: _Turns, turns: Array, beyond: Array) -> Array:
    """Those turns (m,) beyond even ones that noise does not explain, `beyond` (m,), and their neighbors.

    A contact that is off turns chords one way, twice as far back, and again, which is no bend; noise may
    explain the lesser ones.
    """
    near, joined = beyond != 0.0, of.curve[1:] == of.curve[:-1]
    near = near | np.append(near[1:] & joined, False) | np.append(False, near[:-1] & joined)
    return np.where(near, turns, 0.0)


def _without_outliers(of: _Turns, turns: Array) -> Array:
    """The turns (m,) of medians of three angles: a single contact that turns there and back is an outlier."""
    before, after = -turns[:-1], turns[1:]
    medians = np.maximum(np.minimum(before, after), np.minimum(np.maximum(before, after), 0.0))
    moved = medians * (of.curve[1:] == of.curve[:-1])
    return turns + np.append(moved, 0.0) - np.append(0.0, moved)


def _counted(of: _Turns, turns: Array) -> tuple[Array, Array]:
    """The sums (c,) of the absolute turns (m,) of curves, and how many bends (c,) these are.

    Without normals, a fold between two contacts turns chords at both, and is the sum of both turns.
    """
    curve, number, squared = of.curve, np.bincount(of.curve), turns**2
    length = np.maximum(np.bincount(curve, of.steps), SMALLEST)
    turned = np.asarray(np.bincount(curve, np.abs(turns)), dtype=float)
    if not of.is_felt:
        squared[1:] += 2.0 * np.maximum(turns[1:] * turns[:-1], 0.0) * (curve[1:] == curve[:-1])
    squares = np.bincount(curve, squared / np.maximum(of.steps, (SHORT_STEP * length / number)[curve]))
    bends: Array = np.where(
        turned > ROUNDED_TURN, number * turned**2 / np.maximum(length * squares, 1e-300), number
    )
    return turned, bends


def _bends(of: _Turns) -> Array:
    """What c curves show, (8, c): x and y; the sum of turns and the contacts in a bend; and, for turns beyond
    even ones, the share of few bends, their mean and the most they bend a patch; the even curvature.
    """
    curve, number, even = of.curve, np.bincount(of.curve), _even(of)
    around = even * of.steps
    beyond = _unexplained(of, of.turns - around)
    turned, bends = _counted(of, around + _unexplained(of, _without_outliers(of, of.turns) - around))
    contacts = np.maximum(number / bends, 1.0) if of.is_felt else np.ones(len(bends))
    _, few = _counted(of, beyond)
    folds = np.where(np.abs(beyond) > LEAST_FOLD, beyond, 0.0)
    most = np.bincount(curve, np.abs(folds))
    net = np.bincount(curve, _with_neighbors(of, of.turns - around, folds))
    mean = np.abs(net) / np.maximum(np.bincount(curve, of.steps), SMALLEST)
    at_point = np.lexsort((np.abs(of.middles), curve))[number.cumsum() - number]
    shares = (FEW_BENDS / np.maximum(few, LEAST_BENDS)) ** 3
    return np.array([*of.toward.T, turned, contacts, shares, mean, FOLD_BEND * most, even[at_point]])
