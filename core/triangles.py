# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Rows of vectors and of triangles."""

import numpy as np

from .arguments import Array

LEAST_DIVISOR = 1e-300  # No vector is divided by less.


def row_dot(u: Array, v: Array) -> Array:
    """The dot products (...) of vectors (..., 3)."""
    return np.einsum("...i,...i->...", u, v)


def normalized(vectors: Array) -> Array:
    """The vectors (..., 3) scaled to length 1; 0 stays 0."""
    return vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), LEAST_DIVISOR)


def triangle_cross(triangles: Array) -> Array:
    """The cross products (..., 3) of two sides of triangles (..., 3, 3).

    They are normal to the triangles, and their lengths are twice the areas.
    """
    a, b, c = np.moveaxis(triangles, -2, 0)
    return np.cross(b - a, c - a)


def middles_of_parts(n: int) -> Array:
    """The barycentric coordinates (n^2, 3) of the middles of n^2 equal parts of a triangle.

    Lines parallel to the sides divide each side into n.
    """
    i, j = (index.ravel() for index in np.indices((n, n)))
    up, down = i + j < n, i + j < n - 1
    first, second = (np.concatenate([(each[up] + 1 / 3), (each[down] + 2 / 3)]) / n for each in (i, j))
    return np.column_stack([first, second, 1.0 - first - second])


def cut_to_edges(
    points: Array, triangles: Array, owners: Array, longest: float
) -> tuple[Array, Array, Array]:
    """Triangles (m, 3) between points (n, 3), cut until no edge is longer; each has the owner, (m,), it had.

    Triangles are halved at the middle of their longest edge. A neighbor may not be, which leaves no gap, as
    triangles are flat.
    """
    while True:
        corners = points[triangles]
        sides = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2)
        large = sides.max(axis=1) > longest
        if not large.any():
            return points, triangles, owners
        first = sides[large].argmax(axis=1)[:, None]
        a, b, c = np.take_along_axis(triangles[large], (first + np.arange(3)) % 3, axis=1).T
        ends, number = np.unique(np.sort(np.column_stack([a, b]), axis=1), axis=0, return_inverse=True)
        middle = len(points) + number.ravel()
        points = np.vstack([points, points[ends].mean(axis=1)])
        halves = [triangles[~large], np.column_stack([a, middle, c]), np.column_stack([middle, b, c])]
        triangles = np.vstack(halves).astype(np.int32)
        owners = np.concatenate([owners[~large], owners[large], owners[large]])
