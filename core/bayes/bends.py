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

from ..arguments import SMALLEST, Array
from ..contours.contour import Contour, unit_normals
from ..contours.local_geometry import Frame
from ..patch.monge import TERMS, monomials
from .prior import FREE

# M bends, or two if there are fewer, show the mean curvature of a curve to the share (FEW / M)^3. Fewer than
# FEW are those of folds or facets (benchmarks.curvatures: folds; a cylinder of 24 facets has more).
FEW = 3.0
EXPLAINED = 5.0  # Turns that are off the median by fewer deviations are explained by noise.
CHORDS = 24  # A curve without normals has at most this number of chords, as a touch has steps.
FLAT = 1e-6  # A curve whose normals turn by less, in radians, turns by rounding.


class Bends(NamedTuple):
    """How unevenly a surface bends along curves.

    covariance : (3, 3), of the coefficients of x^2, xy and y^2 in unit radius, for want of bends
    contacts : how many contacts share a bend, 1 or more
    folded : the largest mean curvature of a curve of fewer than FEW bends, in unit radius
    """

    covariance: Array
    contacts: float
    folded: float


def bends_of(contours: Sequence[Contour], frame: Frame, radius: float, noise: float) -> Bends:
    """The bends along contours, by their normals or else by the chords between their contacts.

    noise : of a contact without normals, in unit radius

    Along a curve, the surface turns by d over each step h from contact to contact. With H = sum h these count
    as M = n (sum |d|)^2 / (H sum d^2 / h) bends: n if the turns of the n steps are as their lengths, and one
    if there is a single one of n even steps. Turns that noise explains count as even.
    """
    each = [_bends(*turns) for contour in contours if (turns := _turns(contour, frame, radius, noise))]
    x, y, turned, shares, bent, contacts = np.array(each).reshape(-1, 6).T
    if not turned.any():
        return Bends(np.zeros((3, 3)), 1.0, 0.0)
    inverse = np.linalg.pinv(2.0 * monomials(np.column_stack([x, y]), TERMS[2:FREE]))
    covariance = (inverse * (shares * bent) ** 2) @ inverse.T
    folded = float(bent[shares > 1.0].max(initial=0.0))
    return Bends(covariance, float(turned @ contacts / turned.sum()), folded)


def _turns(
    contour: Contour, frame: Frame, radius: float, noise: float
) -> tuple[float, float, Array, Array, bool] | None:
    """A curve's direction (x, y) in the tangent plane, its steps h (n,), and its turns d (n,).

    Also whether these are turns of normals, which are the same all over a facet. It is None for less than
    three contacts, or contacts in one place.
    """
    local = frame.to_local(contour.points) / radius
    reach = np.hypot(local[:, 0], local[:, 1])
    if len(local) < 3 or reach.max() == 0.0:
        return None
    x, y = (local[reach.argmax(), :2] / reach.max()).tolist()
    along = local[:, 0] * x + local[:, 1] * y
    order = along.argsort(kind="stable")
    along = along[order]
    if contour.normals is None:
        return (x, y, *_turns_of_chords(along, local[order, 2], noise), False)
    normals = unit_normals(contour.normals[order]) @ frame.axes
    # Normals may be of either side.
    across = normals[:, 0] * x + normals[:, 1] * y
    angles = np.arctan2(np.copysign(1.0, normals[:, 2]) * across, np.abs(normals[:, 2]))
    # One contact alone that turns another way and back is an outlier.
    before, at, after = angles[:-2], angles[1:-1], angles[2:]
    angles[1:-1] = np.maximum(np.minimum(before, at), np.minimum(np.maximum(before, at), after))
    steps, std = np.diff(along), math.sqrt(2.0) * (contour.normal_std or 0.0)
    return x, y, steps, _evened(np.diff(angles), steps, np.array(std)), True


def _turns_of_chords(along: Array, heights: Array, noise: float) -> tuple[Array, Array]:
    """Steps (n,) between the middles of chords of a curve, and its turns (n,) from chord to chord."""
    chosen = np.unique(np.linspace(0, len(along) - 1, CHORDS + 1).round().astype(np.intp))
    lengths = np.maximum(np.diff(along[chosen]), SMALLEST)
    turns = np.diff(np.arctan2(np.diff(heights[chosen]), lengths))
    steps = 0.5 * (lengths[1:] + lengths[:-1])
    return steps, _evened(turns, steps, noise * math.sqrt(6.0) / np.minimum(lengths[1:], lengths[:-1]))


def _evened(turns: Array, steps: Array, stds: Array) -> Array:
    """The turns (n,) over steps (n,), of which those that their deviations explain follow the mean bend."""
    if not stds.any():
        return turns
    even = np.abs(turns - np.median(turns)) <= EXPLAINED * stds
    mean = turns[even].sum() / max(float(steps[even].sum()), SMALLEST)
    return np.where(even, mean * steps, turns)


def _bends(
    x: float, y: float, steps: Array, turns: Array, is_felt: bool
) -> tuple[float, float, float, float, float, float]:
    """x, y, the sum of turns, the share to which they show the mean curvature, this, contacts in a bend."""
    turned, most, length = float(np.abs(turns).sum()), len(turns), float(steps.sum())
    if turned <= FLAT:
        return x, y, 0.0, 0.0, 0.0, 1.0
    bends = most * turned**2 / (length * float(turns @ (turns / np.maximum(steps, 1e-3 * length / most))))
    share, bent = (FEW / max(bends, 2.0)) ** 3, abs(float(turns.sum())) / length
    return x, y, turned, share, bent, max(most / bends, 1.0) if is_felt else 1.0
