# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Surfaces z(x, y) over their tangent plane, their differential geometry, and the one of equation (1)."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..arguments import Array
from .differential_geometry import Derivatives


@cache
def exponents(lowest: int, highest: int) -> NDArray[np.intp]:
    """The powers (m, 2) of the terms x^i y^j of these degrees in the order of (1): 30 21 12 03 40 31 ..."""
    terms = [(i, d - i) for d in range(lowest, highest + 1) for i in range(d, -1, -1)]
    array = np.array(terms, dtype=np.intp).reshape(-1, 2)
    array.flags.writeable = False
    return array


DEGREE = 6  # The default fit sees all terms up to this degree at once.
TERMS = exponents(1, DEGREE)
QUADRIC, QUARTIC = exponents(0, 2), exponents(0, 4)
PARTIALS = [(0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2)]  # The orders (dx, dy) of Derivatives.


def monomials(points: Array, terms: NDArray[np.intp]) -> Array:
    """The values (..., m) of the terms (m, 2) at points (..., 2), or (..., 3), whose z does not count."""
    if terms is not TERMS:
        return derived_monomials(points, terms, PARTIALS[:1])[0]
    # This is the most frequent case, done degree by degree.
    x, y = points[..., 0].ravel(), points[..., 1].ravel()
    values = np.empty((len(TERMS), len(x)))
    values[0], values[1], start = x, y, 0
    for d in range(2, DEGREE + 1):
        end = start + d
        np.multiply(values[start:end], x, out=values[end : end + d])
        np.multiply(values[end - 1], y, out=values[end + d])
        start = end
    return values.T.reshape(*points.shape[:-1], len(terms))


def derived_monomials(points: Array, terms: NDArray[np.intp], orders: Sequence[tuple[int, int]]) -> Array:
    """The values (k, ..., m) of k derivatives (dx, dy) of the terms (m, 2) at points (..., 2) or (..., 3)."""
    (i, j), (x, y) = terms.T, points.reshape(-1, points.shape[-1]).T[:2]
    powers = np.ones((int(terms.max(initial=0)) + 1, 2, len(x)))
    powers[1:] = x, y
    x_powers, y_powers = np.cumprod(powers, axis=0).swapaxes(0, 1)
    derived = np.empty((len(orders), len(terms), len(x)))
    for values, (dx, dy) in zip(derived, orders, strict=True):
        # If a derivative of a term is 0, its factor is 0, whatever power is multiplied with it.
        np.multiply(x_powers[np.maximum(i - dx, 0)], y_powers[np.maximum(j - dy, 0)], out=values)
        for exponent, times in ((i, dx), (j, dy)):
            for k in range(times):
                values *= (exponent - k)[:, None]
    return derived.swapaxes(1, 2).reshape(len(orders), *points.shape[:-1], len(terms))


class HeightField:
    """A surface z(x, y), which subclasses define by its derivatives.

    All methods take x and y of one shape, or of shapes that broadcast, and return that shape.
    """

    def derivatives(self, x: ArrayLike, y: ArrayLike) -> Derivatives:
        """Height, slopes and second derivatives at (x, y)."""
        raise NotImplementedError

    def height(self, x: ArrayLike, y: ArrayLike) -> Array:
        """z(x, y)."""
        return self.derivatives(x, y).z

    def normal(self, x: ArrayLike, y: ArrayLike) -> Array:
        """The unit normal on the side of +z at (x, y), (..., 3)."""
        return self.derivatives(x, y).normal

    def gaussian_curvature(self, x: ArrayLike, y: ArrayLike) -> Array:
        """K at (x, y), in 1/length^2."""
        return self.derivatives(x, y).gaussian_curvature

    def mean_curvature(self, x: ArrayLike, y: ArrayLike) -> Array:
        """H at (x, y), in 1/length."""
        return self.derivatives(x, y).mean_curvature

    def principal_curvatures(self, x: ArrayLike, y: ArrayLike) -> tuple[Array, Array]:
        """kappa1 <= kappa2 at (x, y), in 1/length."""
        return self.derivatives(x, y).principal_curvatures

    def shape_index(self, x: ArrayLike, y: ArrayLike) -> Array:
        """The shape index at (x, y): 1 on a convex cap, 0 on a saddle or plane, -1 in a cup."""
        return self.derivatives(x, y).shape_index

    def curvedness(self, x: ArrayLike, y: ArrayLike) -> Array:
        """The root mean square of kappa1 and kappa2 at (x, y), in 1/length."""
        return self.derivatives(x, y).curvedness

    def closest_point(self, points: ArrayLike) -> Array:
        """The foot on the surface of each local point, (n, 3) -> (n, 3).

        Newton's method minimizes the squared distance for all points at once, from the vertical projection
        on. A step that does not shorten the distance is halved.
        """
        q = np.asarray(points, dtype=float)
        foot, damping = q[:, :2].copy(), np.ones(len(q))
        nearest = np.abs(self.height(*foot.T) - q[:, 2])
        close_enough = 1e-11 * np.abs(q).max(initial=0.0)
        active = np.arange(len(q))
        for _ in range(50):
            step = damping[active, None] * _newton_step(self, foot[active], q[active])
            trial = foot[active] + step
            lifted = np.column_stack([trial, self.height(*trial.T)])
            distance = np.linalg.norm(lifted - q[active], axis=1)
            nearer = distance <= nearest[active]
            foot[active[nearer]], nearest[active[nearer]] = trial[nearer], distance[nearer]
            damping[active] = np.where(nearer, np.minimum(2.0 * damping[active], 1.0), 0.5 * damping[active])
            active = active[np.abs(step).max(axis=1, initial=0.0) > close_enough]
            if not len(active):
                break
        return np.column_stack([foot, self.height(*foot.T)])


@dataclass(frozen=True, eq=False)
class MongePatch(HeightField):
    """z = (k1 x^2 + k2 y^2) / 2 + sum a_ij x^i y^j, equation (1), in the local frame.

    k1, k2 : the principal curvatures at the origin, k1 <= k2, in 1/length
    coefficients : a30 a21 a12 a03 a40 a31 a22 a13 a04 ..., a_ij in length^(1 - i - j)
    """

    k1: float
    k2: float
    coefficients: Array

    @property
    def degree(self) -> int:
        """The degree d of (1)."""
        # There are (d + 1) (d + 2) / 2 - 6 coefficients.
        return (math.isqrt(8 * len(self.coefficients) + 49) - 3) // 2

    def scaled(self, factor: float) -> "MongePatch":
        """This surface with every length multiplied by `factor`."""
        orders = exponents(3, self.degree).sum(axis=1)
        return MongePatch(self.k1 / factor, self.k2 / factor, self.coefficients * factor ** (1.0 - orders))

    def derivatives(self, x: ArrayLike, y: ArrayLike) -> Derivatives:
        """Height, slopes and second derivatives at (x, y)."""
        return Derivatives(*self._evaluate(x, y, PARTIALS))

    def height(self, x: ArrayLike, y: ArrayLike) -> Array:
        """z(x, y)."""
        return self._evaluate(x, y, PARTIALS[:1])[0]

    def _evaluate(self, x: ArrayLike, y: ArrayLike, orders: list[tuple[int, int]]) -> Array:
        """The derivatives (m, ...) of m orders (dx, dy)."""
        a = np.concatenate([[self.k1 / 2.0, 0.0, self.k2 / 2.0], self.coefficients])
        return polynomial_derivatives(a, exponents(2, self.degree), x, y, orders)


def polynomial_derivatives(
    coefficients: Array, terms: NDArray[np.intp], x: ArrayLike, y: ArrayLike, orders: list[tuple[int, int]]
) -> Array:
    """The derivatives (m, ...) of m orders (dx, dy) of a sum of all terms (k, 2) of some degrees.

    They follow from tables of the coefficients (k,), times x^i, times y^j.
    """
    x_array, y_array = np.broadcast_arrays(np.asarray(x, dtype=float), np.asarray(y, dtype=float))
    count, (i, j) = int(terms[-1].sum()) + 1, terms.T
    table = np.zeros((count, count))
    table[j, i] = coefficients
    tables = [_derivative_matrix(count, dy) @ table @ _derivative_matrix(count, dx).T for dx, dy in orders]
    powers = np.ones((count, 2, x_array.size))
    powers[1:] = x_array.ravel(), y_array.ravel()
    powers = np.cumprod(powers, axis=0)
    rows = (np.concatenate(tables) @ powers[:, 0]).reshape(len(orders), count, -1)
    return np.einsum("mjn,jn->mn", rows, powers[:, 1]).reshape(len(orders), *x_array.shape)


@cache
def _derivative_matrix(powers: int, order: int) -> Array:
    """The matrix (powers, powers) that takes coefficients of x^i to those of the derivative of this order."""
    return np.linalg.matrix_power(np.diag(np.arange(1.0, powers), 1), order)


def _newton_step(surface: HeightField, foot: Array, q: Array) -> Array:
    """Newton steps (n, 2) of places `foot` (n, 2) on a surface toward those nearest to points q (n, 3).

    They are -H^-1 g, by the gradient and the Hessian of half the squared distance. Where H is not positive
    definite, it is without the second derivatives of the height, as in Gauss-Newton.
    """
    d = surface.derivatives(*foot.T)
    residual = d.z - q[:, 2]
    gx, gy = foot[:, 0] - q[:, 0] + residual * d.x, foot[:, 1] - q[:, 1] + residual * d.y
    hxx, hxy, hyy = (
        1.0 + d.x**2 + residual * d.xx,
        d.x * d.y + residual * d.xy,
        1.0 + d.y**2 + residual * d.yy,
    )
    is_convex = (hxx > 0.0) & (hxx * hyy - hxy**2 > 0.0)
    hxx = np.where(is_convex, hxx, 1.0 + d.x**2)
    hxy = np.where(is_convex, hxy, d.x * d.y)
    hyy = np.where(is_convex, hyy, 1.0 + d.y**2)
    det = np.where(is_convex, hxx * hyy - hxy**2, 1.0 + d.x**2 + d.y**2)
    return np.column_stack([hxy * gy - hyy * gx, hxy * gx - hxx * gy]) / det[:, None]
