# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Contours of very many contacts, or with rests, as fewer: each the mean of neighbors along the curve.

The fit takes the places of contacts in the tangent plane for exact. Noise in all directions also scatters
contacts sideways, off their sampling plane, and many of them would then seem to show the shape next to it.
The mean of k neighbors has a kth of their variance, and determines heights as well. Contacts of a finger at
rest share one error, so a rest weighs as much as any other place of the curve.
"""

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..arguments import DECIMALS, Array
from .contour import Contour, consistently_oriented
from .curves import WINDOW, distances_from_point

# With this many contacts a contour no fit is worse, with noise in all directions (tests: test_thinning).
MOST_CONTACTS = 100
# test_thinning judges these: no rest may ruin a fit, and no contacts without one may change.
CELLS = 1000  # The curve's longer side has this many cells. A place is a cell and its neighbors.
RESTING = 4  # A place with more times the usual number of contacts is a rest.
TANGENT_SHARE = 1 / 16  # This share of the cells with contacts shows the tangent, also of a steep curve.


def thinned(contour: Contour, point: Array) -> tuple[Contour, int]:
    """The contour of at most MOST_CONTACTS means without the point, and the number of contacts in each mean.

    It runs as the given contour does; noise and normal_std are those of the means. A rest counts as the usual
    number of contacts. At most MOST_CONTACTS without a rest stay as they are.
    """
    r = contour.points - point
    if len(r) <= MOST_CONTACTS and not _may_rest(r):
        return contour, 1
    distance, off_point = distances_from_point(r)
    r, distance = r[off_point], distance[off_point]
    if len(r) <= RESTING:
        return contour, 1
    along, weights = _along(r, distance)
    order = np.argsort(along, kind="stable")
    weights = weights[order]
    starts, size = _groups(weights, int(np.count_nonzero(along < 0.0)))
    if size <= 1 and weights.min() == 1.0:
        return contour, 1
    totals = np.add.reduceat(weights, starts)[:, None]

    def means(values: Array) -> Array:
        """The means (m, 3) of the groups among values (n, 3)."""
        return np.add.reduceat(weights[:, None] * values[order], starts, axis=0) / totals

    normals, noise, std = contour.normals, contour.noise, contour.normal_std
    root = math.sqrt(size)
    fewer = replace(
        contour,
        points=point + means(r),
        normals=None if normals is None else means(consistently_oriented(normals[off_point], order, starts)),
        noise=None if noise is None else noise / root,
        normal_std=None if std is None else std / root,
    )
    return fewer, size


def _may_rest(r: Array) -> bool:
    """Whether contacts (n, 3), relative to the point, may have a rest; a quick no for most that have none."""
    distance = np.sqrt(np.einsum("ni,ni->n", r, r))
    distance.sort()
    gaps = distance[RESTING:] - distance[:-RESTING]
    return len(gaps) > 0 and float(gaps.min()) <= 3.0 / CELLS * float(distance[-1])


def _along(r: Array, distance: Array) -> tuple[Array, Array]:
    """Distances (n,) of contacts (n, 3) from the point, below 0 on one side of it, and their weights up to 1.

    The sign makes them rise with the index.
    """
    # Contacts too few for a rest may be stray ones, far out, which do not show the curve's length.
    cells = np.ceil(distance * (CELLS / np.partition(distance, -RESTING)[-RESTING]))
    cells = np.minimum(cells, 2 * CELLS).astype(np.intp)
    counts = np.bincount(cells)
    # Contacts near the point show the tangent, because a steep curve's longest axis is its normal.
    filled = np.cumsum(counts > 0)
    near = np.flatnonzero(cells <= np.searchsorted(filled, max(WINDOW, TANGENT_SHARE * filled[-1])))
    moments = r[near].T @ (r[near] / counts[cells[near], None])
    along = np.copysign(distance, r @ np.linalg.eigh(moments)[1][:, -1])
    along *= np.copysign(1.0, (np.arange(len(along)) - (len(along) - 1) / 2.0) @ along)
    cells = 2 * CELLS + np.where(along < 0.0, -cells, cells)
    return along, _weights(np.bincount(cells))[cells]


def _weights(counts: NDArray[np.intp]) -> Array:
    """The weight (m,) of a contact in each cell along a curve, given the numbers of contacts (m,) there."""
    crowd = np.maximum(np.convolve(counts, np.ones(3), mode="same"), 1.0)
    shares = counts / crowd
    places = shares.sum()
    # The usual number is a mean over the length, in which rests do not count.
    usual = places / (shares / crowd).sum() if places > MOST_CONTACTS else 1.0
    return np.where(crowd > RESTING * usual, usual / crowd, 1.0)


def _groups(weights: Array, before: int) -> tuple[NDArray[np.intp], int]:
    """The starts (m,) of groups of contacts with weights (n,), `before` of them before the point; their size.

    The size is the weight that each has at least, about.
    """
    totals = float(weights[:before].sum()), float(weights[before:].sum())
    size = math.ceil(sum(map(round, totals)) / MOST_CONTACTS)
    middles = (np.cumsum(weights) - 0.5 * weights - totals[0]).round(DECIMALS)
    # Groups are counted from the point outward, so that the way in which a contour runs makes no difference.
    behind, ahead = (max(1, round(total) // size) if total else 0 for total in totals)
    before_point = (np.arange(-behind, 0) * (totals[0] / max(behind, 1))).round(DECIMALS)
    after_point = (np.arange(ahead) * (totals[1] / max(ahead, 1))).round(DECIMALS)
    starts = middles.searchsorted(before_point, side="right"), middles.searchsorted(after_point)
    return np.unique(np.concatenate(starts)), size
