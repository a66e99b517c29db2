# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Contours of very many contacts as fewer, each the mean of neighbors along the curve.

The fit takes the places of contacts in the tangent plane for exact. Noise in all directions also scatters
contacts sideways, off their sampling plane, and many of them would then seem to show the shape next to it.
The mean of k neighbors has a kth of their variance, and determines heights as well.
"""

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..arguments import Array
from .contour import Contour, consistently_oriented
from .curves import WINDOW, distances_from_point

# With this many contacts a contour no fit is worse, with noise in all directions (tests: test_thinning).
MOST_CONTACTS = 100


def thinned(contour: Contour, point: Array) -> tuple[Contour, int]:
    """The contour of at most MOST_CONTACTS means besides the point, and the number of contacts in each mean.

    It runs as the given contour does; noise and normal_std are those of the means.
    """
    if len(contour.points) <= MOST_CONTACTS:
        return contour, 1
    r = contour.points - point
    off_point = np.flatnonzero(distances_from_point(r)[1])
    size = math.ceil(len(off_point) / MOST_CONTACTS)
    if size <= 1:
        return contour, 1
    r = r[off_point]
    along = _signed_positions(r, max(WINDOW * size, len(r) // 4))
    order = np.argsort(along, kind="stable")
    before = int(np.count_nonzero(along < 0.0))
    # Groups are counted from the point outward, so that the way in which a contour runs makes no difference.
    behind, ahead = _group_bounds(before, size), _group_bounds(len(order) - before, size)
    starts = np.concatenate([before - behind[:0:-1], before + ahead[:-1]])
    counts = np.diff(starts, append=len(order))[:, None]

    def means(values: Array) -> Array:
        """The means (m, 3) of the groups among values (n, 3)."""
        return np.add.reduceat(values[order], starts, axis=0) / counts

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


def _signed_positions(r: Array, count: int) -> Array:
    """Signed positions (n,) of contacts (n, 3) on the principal axis of the `count` nearest ones.

    Contacts are relative to the point. The sign makes positions rise with the index.
    """
    # It takes the tangent of `count` contacts near the point, because a steep curve's longest axis is its
    # normal.
    near = r[np.argsort(np.einsum("ni,ni->n", r, r), kind="stable")[:count]]
    along = r @ np.linalg.eigh(near.T @ near)[1][:, -1]
    along *= np.copysign(1.0, (np.arange(len(along)) - (len(along) - 1) / 2.0) @ along)
    return along


def _group_bounds(length: int, size: int) -> NDArray[np.intp]:
    """The bounds, from 0 to the length, of groups of about this size; only 0 if the length is 0."""
    count = max(1, length // size) if length else 0
    return np.arange(count + 1, dtype=np.intp) * length // max(count, 1)
