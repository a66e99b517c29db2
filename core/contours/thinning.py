# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Contours of very many contacts as fewer, each the mean of neighbors along the curve.

The fit takes the places of contacts in the tangent plane for exact. Noise in all directions also scatters
contacts sideways, off their sampling plane, and many of them would then seem to tell the shape beside it. The
mean of k neighbors has a kth of their variance, and tells as much of the heights.
"""

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..arguments import Array
from .contour import Contour
from .curves import WINDOW, besides_point

# With so many contacts a contour no fit is worse, with noise in all directions (tests: test_thinning).
MOST_CONTACTS = 100


def thinned(contour: Contour, point: Array) -> tuple[Contour, int]:
    """The contour of at most MOST_CONTACTS means besides the point, and the number of contacts in each mean.

    It runs as the given contour does; noise and normal_std are those of the means.
    """
    if len(contour.points) <= MOST_CONTACTS:
        return contour, 1
    r = contour.points - point
    beside = np.flatnonzero(besides_point(r)[1])
    size = math.ceil(len(beside) / MOST_CONTACTS)
    if size <= 1:
        return contour, 1
    r = r[beside]
    along = _along(r, max(WINDOW * size, len(r) // 4))
    order = np.argsort(along, kind="stable")
    before = int(np.count_nonzero(along < 0.0))
    starts = np.concatenate([_starts(0, before, size), _starts(before, len(order), size)])
    counts = np.diff(starts, append=len(order))[:, None]

    def means(values: Array) -> Array:
        """The means (m, 3) of the groups among values (n, 3)."""
        return np.add.reduceat(values[order], starts, axis=0) / counts

    normals, noise, std = contour.normals, contour.noise, contour.normal_std
    root = math.sqrt(size)
    fewer = replace(
        contour,
        points=point + means(r),
        normals=None if normals is None else means(_alike(normals[beside], order, starts)),
        noise=None if noise is None else noise / root,
        normal_std=None if std is None else std / root,
    )
    return fewer, size


def _along(r: Array, count: int) -> Array:
    """Signed places (n,) of contacts (n, 3) along their curve, in the direction in which they run."""
    # It takes the tangent of `count` contacts near the point, because a steep curve's longest axis is its
    # normal.
    order = np.argsort(np.einsum("ni,ni->n", r, r), kind="stable")
    near = r[order[:count]]
    along = r @ np.linalg.eigh(near.T @ near)[1][:, -1]
    along *= np.copysign(1.0, (np.arange(len(along)) - (len(along) - 1) / 2.0) @ along)
    return along


def _alike(normals: Array, order: NDArray[np.intp], starts: NDArray[np.intp]) -> Array:
    """The normals (n, 3) with length 1, or 0, each on the side of the first in its group."""
    unit = normals / np.maximum(np.abs(normals).max(axis=1, keepdims=True), 1e-300)
    unit /= np.maximum(np.linalg.norm(unit, axis=1, keepdims=True), 1e-300)
    group = np.empty(len(order), dtype=np.intp)
    group[order] = np.searchsorted(starts, np.arange(len(order)), side="right") - 1
    side = np.einsum("ni,ni->n", unit, unit[order[starts]][group])
    return np.where(side[:, None] < 0.0, -unit, unit)


def _starts(first: int, last: int, size: int) -> NDArray[np.intp]:
    """The starts of groups of about this size among places from first to last."""
    count = max(1, (last - first) // size) if last > first else 0
    return first + np.arange(count, dtype=np.intp) * (last - first) // max(count, 1)
