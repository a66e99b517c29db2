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

from ..arguments import Array
from ..contours.contour import Contour, unit_normals
from ..contours.local_geometry import Frame
from ..patch.monge import TERMS, monomials
from .posterior import largest_curvature_std
from .prior import FREE

# M bends show the mean curvature of a curve to the share (FEW_BENDS / M)^3 (benchmarks.curvatures: folds).
FEW_BENDS = 3.5
EXPLAINED = 4.0  # Turns that are off the median by fewer deviations are explained by noise.
CHORDS = 24  # A curve without normals has at most this number of chords, as a touch has steps.
FLAT = 1e-6  # A curve whose normals turn by less, in radians, turns by rounding.


class Bends(NamedTuple):
    """How unevenly a surface bends along curves.

    covariance : (3, 3), of the coefficients of x^2, xy and y^2 in unit radius, for want of bends
    contacts : how many contacts share a bend, 1 or more
    """

    covariance: Array
    contacts: float

    @property
    def std(self) -> float:
        """The largest deviation of a normal curvature for want of bends, in unit radius."""
        return largest_curvature_std(self.covariance)


class _Turns(NamedTuple):
    """A curve's direction (x, y) in the tangent plane, its length in unit radius, and its turns (n,).

    is_felt : whether these are turns of normals, which are the same all over a facet
    """

    x: float
    y: float
    length: float
    turns: Array
    is_felt: bool


def bends_of(contours: Sequence[Contour], frame: Frame, radius: float, noise: float) -> Bends:
    """The bends along contours, by their normals or else by the chords between their contacts.

    noise : of a contact without normals, in unit radius

    Along a curve, turns d from contact to contact count as M = (sum |d|)^2 / sum d^2 bends: as many as there
    are turns if all are equal, and one if there is a single one. Turns that noise explains count as equal.
    """
    of_each = (_turns(contour, frame, radius, noise) for contour in contours)
    each = [_uneven(of) for of in of_each if of is not None]
    x, y, turned, stds, contacts = np.array(each).reshape(-1, 5).T
    if not turned.any():
        return Bends(np.zeros((3, 3)), 1.0)
    inverse = np.linalg.pinv(2.0 * monomials(np.column_stack([x, y]), TERMS[2:FREE]))
    return Bends((inverse * stds**2) @ inverse.T, float(np.average(contacts, weights=turned)))


def _turns(contour: Contour, frame: Frame, radius: float, noise: float) -> _Turns | None:
    """The turns along one contour, or None if it is too short to have any."""
    local = frame.to_local(contour.points) / radius
    reach = np.hypot(local[:, 0], local[:, 1])
    if len(local) < 3 or reach.max() == 0.0:
        return None
    x, y = (local[np.argmax(reach), :2] / reach.max()).tolist()
    along = local[:, :2] @ (x, y)
    order = np.argsort(along, kind="stable")
    if contour.normals is None:
        turns, std = _turns_of_chords(along[order], local[order, 2], noise)
    else:
        normals = (unit_normals(contour.normals) @ frame.axes)[order]
        # Normals may be those of either side.
        angles = np.unwrap(np.arctan2(normals[:, :2] @ (x, y), normals[:, 2]), period=np.pi)
        # One contact alone that turns another way and back is an outlier.
        angles[1:-1] = np.median([angles[:-2], angles[1:-1], angles[2:]], axis=0)
        turns = np.diff(angles)
        std = np.full(len(turns), math.sqrt(2.0) * (contour.normal_std or 0.0))
    even = np.abs(turns - np.median(turns)) <= EXPLAINED * std
    turns[even] = turns[even].mean() if even.any() else 0.0
    return _Turns(x, y, float(np.ptp(along)), turns, contour.normals is not None)


def _turns_of_chords(along: Array, heights: Array, noise: float) -> tuple[Array, Array]:
    """The turns (m,) from chord to chord of contacts (n,) along a curve, and their deviations (m,)."""
    chosen = np.unique(np.linspace(0, len(along) - 1, CHORDS + 1).round().astype(np.intp))
    steps = np.maximum(np.diff(along[chosen]), 1e-300)
    angles = np.arctan2(np.diff(heights[chosen]), steps)
    return np.diff(angles), noise * math.sqrt(6.0) / np.minimum(steps[1:], steps[:-1])


def _uneven(of: _Turns) -> tuple[float, float, float, float, float]:
    """x, y, the sum of turns, the deviation of the curvature for want of bends, and contacts in a bend."""
    turned, most = float(np.abs(of.turns).sum()), len(of.turns)
    if turned <= FLAT:
        return of.x, of.y, 0.0, 0.0, 1.0
    bends = turned**2 / float(of.turns @ of.turns)
    share = FEW_BENDS**3 * max(bends**-3 - most**-3, 0.0)
    std = share * abs(float(of.turns.sum())) / of.length
    return of.x, of.y, turned, std, most / bends if of.is_felt else 1.0
