# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""How evenly a surface bends along its curves, and so how well these show its curvatures at the point.

Not in the paper. A smooth surface turns a little between all contacts. One of few facets, or with a fold,
turns at few places: its contacts show a curvature as a rule of integration with as few nodes would, and those
within a facet share an error. The fit explains such contacts, so its own deviation has neither of both.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..arguments import SMALLEST, Array
from ..contours.contour import Contour
from ..contours.local_geometry import Frame

# M bends, or LEAST if there are fewer, show a curvature to the share (FEW / M)^3. Fewer than FEW are those of
# folds or facets (benchmarks.curvatures: folds, tips of cones; a cylinder of 24 facets has more). With 3 and
# 2, curvatures across folds without normals are off by over five deviations.
FEW, LEAST = 3.5, 3.0
EXPLAINED = 5.0  # Turns that are off the median by fewer deviations are explained by noise.
CHORDS = 24  # A curve without normals has at most this number of chords, as a touch has steps.
RIDGE = 1e-12  # It is added to the equations of x^2, xy and y^2, because outliers may leave two curves.
FLAT = 1e-6  # A curve whose normals turn by less, in radians, turns by rounding.


class Bends(NamedTuple):
    """How unevenly a surface bends along curves.

    second : (3, c), the second derivatives of x^2, xy and y^2 along each of c curves
    stds : (c,), deviations of the curvatures along these for want of bends, in unit radius
    contacts : how many contacts share a bend, 1 or more
    folded : the largest mean curvature of a curve of fewer than FEW bends, in unit radius
    """

    second: Array
    stds: Array
    contacts: float
    folded: float

    @property
    def covariance(self) -> Array:
        """The covariance (3, 3) of the coefficients of x^2, xy and y^2 in unit radius, for want of bends."""
        second = self.second
        inverse = np.linalg.solve(second @ second.T + RIDGE * np.eye(3), second)
        covariance: Array = (inverse * self.stds**2) @ inverse.T
        return covariance


def bends_of(contours: Sequence[Contour], frame: Frame, radius: float, noise: float, terms: Array) -> Bends:
    """The bends along contours, by their normals or else by the chords between their contacts.

    noise : of a contact without normals, in unit radius
    terms : (3,), the patch's coefficients of x^2, xy and y^2 in unit radius

    Along a curve, the surface turns by d over each step h from contact to contact. With H = sum h these count
    as M = n (sum |d|)^2 / (H sum d^2 / h) bends: n if the turns of the n steps are as their lengths, and one
    if there is a single one of n even steps. Turns that noise explains count as even. What these show is the
    mean curvature of the curve or, if that is larger, the curvature of the patch.
    """
    kinds = [
        [c for c in contours if (c.normals is None) is bare and len(c.points) > 2] for bare in (False, True)
    ]
    each = [_bends(_turns(kind, frame, radius, noise)) for kind in kinds if kind]
    x, y, turned, shares, bent, contacts = np.concatenate([np.empty((6, 0)), *each], axis=1)
    second = 2.0 * np.array([x * x, x * y, y * y])
    stds = shares * np.maximum(bent, np.abs(terms @ second))
    sharing = float(turned @ contacts) / max(float(turned.sum()), SMALLEST)
    return Bends(second, stds, max(sharing, 1.0), float(bent[shares > 1.0].max(initial=0.0)))


class _Turns(NamedTuple):
    """The turns of c curves from contact to contact, m in all.

    toward : (c, 2), the direction of each curve in the tangent plane
    curve : (m,), the curve of each turn
    steps, turns : (m,), the steps h in unit radius, and the turns d in radians
    is_felt : whether these are turns of normals, which are the same all over a facet
    """

    toward: Array
    curve: NDArray[np.intp]
    steps: Array
    turns: Array
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
        along, angles = along[order], _angles(normals, toward[curve], curve)
        stds = np.array([contour.normal_std or 0.0 for contour in contours])[curve]
    else:
        curve, along, angles, stds = _chords(curve, along[order], local[order, 2], noise)
    first, second = _neighbors(curve)
    curve, steps, turns = curve[second], along[second] - along[first], angles[second] - angles[first]
    turns = _evened(curve, turns, steps, np.hypot(stds[first], stds[second]))
    return _Turns(toward, curve, steps, turns, is_felt)


def _angles(normals: Array, toward: Array, curve: NDArray[np.intp]) -> Array:
    """The angles (n,) of normals (n, 3), of any side and length, from that of the point along a curve."""
    across = np.copysign(1.0, normals[:, 2]) * np.einsum("ni,ni->n", normals[:, :2], toward)
    angles = np.arctan2(across, np.abs(normals[:, 2]))
    # One contact alone that turns another way and back is an outlier.
    at = (curve[2:] == curve[:-2]).nonzero()[0] + 1
    before, now, after = angles[at - 1], angles[at], angles[at + 1]
    angles[at] = np.maximum(np.minimum(before, now), np.minimum(np.maximum(before, now), after))
    return angles


def _chords(
    curve: NDArray[np.intp], along: Array, heights: Array, noise: float
) -> tuple[NDArray[np.intp], Array, Array, Array]:
    """Curves, middles, angles and their deviations, (m,), of the chords between contacts (n,) in order."""
    last = np.bincount(curve) - 1
    if last.max() > CHORDS:
        rank, last = np.arange(len(curve)) - curve.searchsorted(curve), last[curve]
        chosen = rank * CHORDS // last > (rank - 1) * CHORDS // last
        curve, along, heights = curve[chosen], along[chosen], heights[chosen]
    first, second = _neighbors(curve)
    lengths = np.maximum(along[second] - along[first], SMALLEST)
    angles = np.arctan2(heights[second] - heights[first], lengths)
    # Neighbors have a contact in common, so the deviation of a turn is the square root of 6 in place of 4.
    return curve[second], 0.5 * (along[first] + along[second]), angles, math.sqrt(3.0) * noise / lengths


def _neighbors(curve: NDArray[np.intp]) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """The indices (m,) of pairs that follow each other on the same curve, among the n of `curve` in order."""
    second = (curve[1:] == curve[:-1]).nonzero()[0] + 1
    return second - 1, second


def _evened(curve: NDArray[np.intp], turns: Array, steps: Array, stds: Array) -> Array:
    """The turns (m,) over steps (m,), of which those that their deviations explain follow the mean bend."""
    if not stds.any():
        return turns
    ordered, ends = turns[np.lexsort((turns, curve))], np.bincount(curve).cumsum()
    middle = ends + np.append(0, ends[:-1])
    medians = 0.5 * (ordered[(middle - 1) // 2] + ordered[middle // 2])
    even = np.abs(turns - medians[curve]) <= EXPLAINED * stds
    means = np.bincount(curve, even * turns) / np.maximum(np.bincount(curve, even * steps), SMALLEST)
    return np.where(even, means[curve] * steps, turns)


def _bends(of: _Turns) -> Array:
    """What c curves show, (6, c): x and y, the sum of turns, a share, the mean curvature, contacts in a bend.

    The share is that to which the bends show a curvature.
    """
    curve, number = of.curve, np.bincount(of.curve)
    length, turned = np.maximum(np.bincount(curve, of.steps), SMALLEST), np.bincount(curve, np.abs(of.turns))
    squares = np.bincount(curve, of.turns**2 / np.maximum(of.steps, (1e-3 * length / number)[curve]))
    turned[turned <= FLAT] = 0.0
    bends = np.where(turned > 0.0, number * turned**2 / np.maximum(length * squares, 1e-300), number)
    shares, bent = (FEW / np.maximum(bends, LEAST)) ** 3, np.abs(np.bincount(curve, of.turns)) / length
    contacts = np.maximum(number / bends, 1.0) if of.is_felt else np.ones(len(bends))
    return np.array([*of.toward.T, turned, shares * (turned > 0.0), bent, contacts])
