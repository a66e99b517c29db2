# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Heights as a smoothing spline with the least third derivatives through contacts and across normals.

Beside the paper. It is a cubic B-spline on SIDE x SIDE knots. Its prior is that of a surface with random
third derivatives (Wahba 1990, on knots as by Eilers and Marx 1996), so that quadrics are free. The size of
these and the deviations of contacts and normals follow from the marginal likelihood; outliers weigh as under
a Student t distribution. Equations are banded, however many contacts there are. All is in unit radius.
"""

from functools import cache
from math import comb
from typing import Any, NamedTuple

import numpy as np

from ..arguments import Array

# python -m benchmarks.atlas chose these.
SIDE = 21  # There are so many knots along each axis, evenly spaced over [-half, half].
ROUGHNESS = (0.03, 0.1, 0.3, 1.0, 3.0, 10.0)  # The grid of the size of third derivatives.
NOISE_FACTORS = (1.0, 2.0, 4.0, 8.0)  # The grid of the noise, in units of the least noise.
SLOPE_STDS = (0.01, 0.02, 0.04, 0.08, 0.16, 0.32)  # The grid of the normals' deviation, which facets have.
START = 3, 0, 2  # The search begins at these places of the three grids.
SIZE_PASSES = 2  # So often sizes are found, each time with a solve for weights after it.
FAR_OFF, STUDENT = 3.0, 4.0  # Outliers are off by more deviations, and weigh as under t of this freedom.
LEAST_COSINE = 0.2  # A normal tells nothing if the cosine of its angle to the axis is less.
ORDER, CUBIC = 3, 3
WIDTH = CUBIC * SIDE + CUBIC  # The width of the band.
RANK = SIDE**2 - ORDER * (ORDER + 1) // 2
SPLINE_ROUNDING = 1e-9


class Spline(NamedTuple):
    """The coefficients (SIDE, SIDE) of heights, and the standard deviations (SIDE, SIDE) at the knots."""

    coefficients: Array
    stds: Array


class _Equations(NamedTuple):
    """Normal equations of data of unit deviation: the matrix's band, right side, sum of squares, number."""

    band: Array
    right: Array
    square: float
    size: float


class _Solution(NamedTuple):
    """-2 log likelihood, the band of the Cholesky factor, and the coefficients (SIDE^2,)."""

    surprise: float
    factor: Array
    coefficients: Array


def smoothing_spline(contacts: Array, normals: Array, weights: Array, half: float, noise: float) -> Spline:
    """The spline of contacts and unit normals, (n, 3) each, which count by weights (n,).

    half : half the side of the square of knots
    noise : least standard deviation of a contact
    """
    heights, *slopes = bases(contacts[:, 0], contacts[:, 1], half)
    up = np.maximum(normals[:, 2], LEAST_COSINE)
    asked = -normals[:, :2] / up[:, None]
    # A slope s has 1 + s^2 times the deviation.
    certainty = np.where(normals[:, 2] > LEAST_COSINE, up**4, 0.0)
    sizes, sloping = [grid[i] for grid, i in zip(_grids(noise), START, strict=True)], weights * certainty
    for _ in range(SIZE_PASSES):
        data = [_equations([heights], weights, contacts[:, 2:]), _equations(slopes, sloping, asked)]
        found = _likeliest(data, sizes, half, noise)
        off = np.abs(contacts[:, 2] - heights @ found.coefficients)
        across = np.stack([by @ found.coefficients for by in slopes], axis=1) - asked
        turned = np.sqrt(certainty) * np.hypot(*across.T)
        outlying = _student(off, sizes[1])
        weights, sloping = outlying, outlying * certainty * _student(turned, sizes[2])
    data = [_equations([heights], weights, contacts[:, 2:]), _equations(slopes, sloping, asked)]
    found = _solved(data, sizes, half)
    return Spline(found.coefficients.reshape(SIDE, SIDE), _stds(found.factor, half))


def _grids(noise: float) -> tuple[Any, Any, Any]:
    return ROUGHNESS, tuple(noise * np.array(NOISE_FACTORS)), SLOPE_STDS


def _likeliest(data: list[_Equations], sizes: list[float], half: float, noise: float) -> _Solution:
    """The likeliest solution, by steps of one size after the other up or down; changes `sizes` in place."""
    best = _solved(data, sizes, half)
    for i, grid in enumerate(_grids(noise)):
        start = grid.index(sizes[i])
        for way in (grid[start + 1 :], grid[:start][::-1]):
            for size in way:
                tried = _solved(data, [*sizes[:i], size, *sizes[i + 1 :]], half)
                if tried.surprise >= best.surprise:
                    break
                best, sizes[i] = tried, size
            if sizes[i] != grid[start]:
                break
    return best


def _solved(data: list[_Equations], sizes: list[float], half: float) -> _Solution:
    from scipy.linalg import cho_solve_banded, cholesky_banded

    roughness, *stds = sizes
    pitch = 2.0 * half / (SIDE - 1)
    matrix, right = _penalty() * (pitch ** (2 - 2 * ORDER) / roughness**2), np.zeros(SIDE**2)
    surprise = 2.0 * RANK * np.log(roughness)
    for some, std in zip(data, stds, strict=True):
        matrix += some.band / std**2
        right += some.right / std**2
        surprise += some.square / std**2 + 2.0 * some.size * np.log(std)
    matrix[0] += SPLINE_ROUNDING * matrix[0].max()
    factor = cholesky_banded(matrix, overwrite_ab=True, lower=True, check_finite=False)
    found = cho_solve_banded((factor, True), right, check_finite=False)
    surprise += 2.0 * np.log(factor[0]).sum() - right @ found
    return _Solution(float(surprise), factor, found)


def _equations(bases: list[Any], weights: Array, values: Array) -> _Equations:
    """The normal equations that fit bases (n, SIDE^2) times coefficients to the columns of values (n, k)."""
    matrix = sum(basis.T @ basis.multiply(weights[:, None]) for basis in bases)
    right = sum(basis.T @ (weights * column) for basis, column in zip(bases, values.T, strict=True))
    square = float(weights @ (values**2).sum(axis=1))
    return _Equations(_band(matrix), right, square, float(len(bases) * np.count_nonzero(weights)))


def _student(misses: Array, std: float) -> Array:
    """The weights (n,) of contacts that are off by `misses` (n,)."""
    ratios = misses / max(std, 1.4826 * float(np.median(misses)))
    return np.where(ratios > FAR_OFF, (STUDENT + 1.0) / (STUDENT + ratios**2), 1.0)


def _stds(factor: Array, half: float) -> Array:
    """Deviations (SIDE, SIDE), computed at every other knot, because they are smooth and take the longest."""
    from scipy.linalg import cho_solve_banded

    coarse = slice(None, None, 2)
    knots = np.linspace(-half, half, SIDE)[coarse]
    x, y = (axis.ravel() for axis in np.meshgrid(knots, knots, indexing="ij"))
    basis = bases(x, y, half)[0].toarray()
    told = cho_solve_banded((factor, True), basis.T, check_finite=False)
    some = np.sqrt(np.maximum(np.einsum("ki,ik->k", basis, told), 0.0))
    return between(some.reshape(len(knots), -1))


def between(some: Array) -> Array:
    """Values (SIDE, SIDE) at all knots, interpolated from those at every other knot."""
    full, coarse = np.empty((SIDE, SIDE)), slice(None, None, 2)
    full[coarse, coarse] = some
    full[1::2, coarse] = 0.5 * (some[:-1] + some[1:])
    full[:, 1::2] = 0.5 * (full[:, :-2:2] + full[:, 2::2])
    return full


def bases(x: Array, y: Array, half: float) -> list[Any]:
    """Sparse matrices (n, SIDE^2) that give heights and slopes along x and y at n places by coefficients."""
    from scipy.sparse import csr_matrix

    pitch = 2.0 * half / (SIDE - 1)
    (column, *by_x), (row, *by_y) = (weights_at(along / pitch) for along in (x, y))
    steps = np.arange(-1, 3)
    knots = (column[:, None, None] + steps[:, None]) * SIDE + row[:, None, None] + steps
    starts = np.arange(0, 16 * len(x) + 1, 16)
    return [
        csr_matrix(
            (((by_x[i][:, :, None] * by_y[j][:, None]) / pitch ** (i + j)).ravel(), knots.ravel(), starts),
            shape=(len(x), SIDE**2),
        )
        for i, j in ((0, 0), (1, 0), (0, 1))
    ]


def weights_at(at: Array) -> tuple[Any, Array, Array]:
    """The knots before places (m,), in steps from the middle; weights (m, 4) of four knots, and slopes."""
    at = np.clip(at + 0.5 * (SIDE - 1), 1.0, SIDE - 2.0 - SPLINE_ROUNDING)
    knot = at.astype(np.intp)
    powers = np.vander(at - knot, 4, increasing=True)
    values, slopes = _tables()
    return knot, powers @ values, powers[:, :3] @ slopes


@cache
def _tables() -> tuple[Array, Array]:
    values = (
        np.array([[1.0, 4.0, 1.0, 0.0], [-3.0, 0.0, 3.0, 0.0], [3.0, -6.0, 3.0, 0.0], [-1.0, 3.0, -3.0, 1.0]])
        / 6.0
    )
    return values, values[1:] * np.array([[1.0], [2.0], [3.0]])


@cache
def _penalty() -> Array:
    """The band of the sum of squares of all third derivatives, by differences, for knots at distance 1."""
    from scipy.sparse import csr_matrix, kron

    steps = [csr_matrix(np.diff(np.eye(SIDE), k, axis=0)) for k in range(ORDER + 1)]
    parts = [
        comb(ORDER, k) * kron(a.T @ a, b.T @ b)
        for k, (a, b) in enumerate(zip(steps[::-1], steps, strict=True))
    ]
    return _band(sum(parts))


def _band(matrix: Any) -> Array:
    """The lower band of a sparse symmetric matrix, as LAPACK has it."""
    entries = matrix.tocoo()
    low = entries.row >= entries.col
    band = np.zeros((WIDTH + 1, SIDE**2))
    band[(entries.row - entries.col)[low], entries.col[low]] = entries.data[low]
    return band
