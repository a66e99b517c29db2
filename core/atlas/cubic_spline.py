# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Cubic B-splines on a square of SIDE x SIDE knots."""

from typing import Any

import numpy as np

from ..arguments import Array

# There are this many knots along each axis, evenly spaced over [-half, half]; benchmarks.atlas chose it.
SIDE, CUBIC = 23, 3
EDGE_ROUNDING = 1e-9  # Places at the edge of the square are so much inside, as a share of the pitch.
# The weights of four knots as polynomials of the share of the way between the middle two; and their slopes.
VALUES = np.array([[1, -3, 3, -1], [4, 0, -6, 3], [1, 3, 3, -3], [0, 0, 0, 1]]) / 6.0
VALUES_AND_SLOPES = np.vstack([VALUES, np.pad(VALUES[:, 1:] * np.arange(1, 4), ((0, 0), (0, 1)))])


def bases(x: Array, y: Array, half: float) -> tuple[Any, Array]:
    """The 16 knots (n, 16) around n places, and their shares (3, n, 16) in height and slopes there."""
    pitch = 2.0 * half / (SIDE - 1)
    (column, *by_x), (row, *by_y) = (bspline_weights(along / pitch) for along in (x, y))
    steps = np.arange(-1, 3)
    knots = (column[:, None, None] + steps[:, None]) * SIDE + row[:, None, None] + steps
    shares = [
        by_x[i].T[:, :, None] * by_y[j].T[:, None] / pitch ** (i + j) for i, j in ((0, 0), (1, 0), (0, 1))
    ]
    return knots.reshape(-1, 16), np.array(shares).reshape(3, -1, 16)


def bspline_weights(at: Array) -> tuple[Any, Array, Array]:
    """The knots before places, in steps from the middle, (...); weights (4, ...) of four knots, and slopes.

    The spline ends one step inside the square: what is beyond counts as on its edge.
    """
    at = np.minimum(np.maximum(at + 0.5 * (SIDE - 1), 1.0), SIDE - 2.0 - EDGE_ROUNDING)
    knot = at.astype(np.intp)
    both = cubics(VALUES_AND_SLOPES, at - knot)
    return knot, both[:4], both[4:]


def cubics(coefficients: Array, t: Array) -> Array:
    """Cubic polynomials at t (...), (k, ...); coefficients (k, 4) are those of 1, t, t^2 and t^3."""
    powers = np.empty((4, *t.shape))
    powers[0], powers[1] = 1.0, t
    np.multiply(t, t, out=powers[2])
    np.multiply(powers[2], t, out=powers[3])
    return (coefficients @ powers.reshape(4, t.size)).reshape(len(coefficients), *t.shape)
