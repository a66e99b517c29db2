# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Rows of vectors and of triangles."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from .arguments import Array

Indices = NDArray[np.integer[Any]]

LEAST_DIVISOR = 1e-300  # No vector is divided by less.
SAME = 1e-6  # Lengths that differ by a smaller share are the same, however a kernel rounds.


def row_dot(u: Array, v: Array) -> Array:
    """The dot products (...) of vectors (..., 3)."""
    return np.einsum("...i,...i->...", u, v)


def normalized(vectors: Array) -> Array:
    """The vectors (..., 3) scaled to length 1; 0 stays 0."""
    return vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), LEAST_DIVISOR)


def far_apart(points: Array, lengths: Array | float) -> list[int]:
    """The indices of points (n, 3), in order, each farther from those before it than their lengths (n,)."""
    left, chosen, lengths = np.arange(len(points)), [], np.broadcast_to(lengths, len(points))
    while len(left):
        first = int(left[0])
        chosen.append(first)
        left = left[1:][np.linalg.norm(points[left[1:]] - points[first], axis=1) > lengths[first]]
    return chosen


def triangle_cross(triangles: Array) -> Array:
    """The cross products (..., 3) of two sides of triangles (..., 3, 3).

    They are normal to the triangles, and their lengths are twice the areas.
    """
    a, b, c = np.moveaxis(triangles, -2, 0)
    return np.cross(b - a, c - a)


def closest_point(triangles: Array, points: Array) -> tuple[Array, Array]:
    """The places (..., 3) of triangles (..., 3, 3) nearest to points (..., 3), and their weights (..., 3)."""
    a, b, c = np.moveaxis(triangles, -2, 0)
    ab, ac, ap = b - a, c - a, points - a

    d1, d2 = row_dot(ab, ap), row_dot(ac, ap)
    aa, bb, cc = row_dot(ab, ab), row_dot(ab, ac), row_dot(ac, ac)
    area = np.maximum(aa * cc - bb * bb, LEAST_DIVISOR)
    v, w = (cc * d1 - bb * d2) / area, (aa * d2 - bb * d1) / area
    inside = (v >= 0.0) & (w >= 0.0) & (v + w <= 1.0)
    # Else the nearest place is on one of the three sides.
    on_ab = np.clip(d1 / np.maximum(aa, LEAST_DIVISOR), 0.0, 1.0)
    on_ac = np.clip(d2 / np.maximum(cc, LEAST_DIVISOR), 0.0, 1.0)
    on_bc = np.clip((d2 - d1 + aa - bb) / np.maximum(aa - 2.0 * bb + cc, LEAST_DIVISOR), 0.0, 1.0)
    zero = np.zeros_like(v)
    tried = np.stack(
        [np.stack(shares, axis=-1) for shares in ((on_ab, zero), (zero, on_ac), (1.0 - on_bc, on_bc))],
        axis=-2,
    )
    off = ap[..., None, :] - tried[..., :1] * ab[..., None, :] - tried[..., 1:] * ac[..., None, :]
    best = np.argmin(row_dot(off, off), axis=-1)[..., None, None]
    side = np.take_along_axis(tried, best, axis=-2)[..., 0, :]
    v, w = np.where(inside, v, side[..., 0]), np.where(inside, w, side[..., 1])
    return a + v[..., None] * ab + w[..., None] * ac, np.stack([1.0 - v - w, v, w], axis=-1)


def middles_of_parts(n: int) -> Array:
    """The barycentric coordinates (n^2, 3) of the middles of n^2 equal parts of a triangle.

    Lines parallel to the sides divide each side into n.
    """
    i, j = (index.ravel() for index in np.indices((n, n)))
    up, down = i + j < n, i + j < n - 1
    first, second = (np.concatenate([(axis[up] + 1 / 3), (axis[down] + 2 / 3)]) / n for axis in (i, j))
    return np.column_stack([first, second, 1.0 - first - second])


def cut_to_edges(points: Array, triangles: Indices, longest: float) -> tuple[Array, Indices, Indices]:
    """Points (n, 3 or more) and triangles (m, 3) without longer edges; which given triangle each is of, (m,).

    Triangles are halved at the middle of their longest edge. A neighbor may not be, which leaves no gap, as
    triangles are flat. Points may have more columns than coordinates.
    """
    whole = np.arange(len(triangles))
    while True:
        corners = points[triangles, :3]
        sides = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2)
        large = sides.max(axis=1) > longest
        if not large.any():
            return points, triangles, whole
        first = sides[large].argmax(axis=1)[:, None]
        a, b, c = np.take_along_axis(triangles[large], (first + np.arange(3)) % 3, axis=1).T
        ends, number = np.unique(np.sort(np.column_stack([a, b]), axis=1), axis=0, return_inverse=True)
        middle = len(points) + number.ravel()
        points = np.vstack([points, points[ends].mean(axis=1)])
        halves = [triangles[~large], np.column_stack([a, middle, c]), np.column_stack([middle, b, c])]
        triangles = np.vstack(halves).astype(np.int32)
        whole = np.concatenate([whole[~large], whole[large], whole[large]])
