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
from .lapack import on_one_thread

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


class _Columns(NamedTuple):
    """Columns of n values each, of which normal equations are sums with the weights of n contacts.

    bands, rights : sparse, ((WIDTH + 1) SIDE^2, n) and (SIDE^2, n), what each contact brings
    squares : (n,), sums over the columns; columns : their number
    """

    bands: Any
    rights: Any
    squares: Array
    columns: int

    def weighted(self, weights: Array) -> _Equations:
        """The normal equations of contacts that count by weights (n,)."""
        band = (self.bands @ weights).reshape(WIDTH + 1, SIDE**2)
        square, size = float(weights @ self.squares), float(self.columns * np.count_nonzero(weights))
        return _Equations(band, self.rights @ weights, square, size)


class _Solution(NamedTuple):
    """-2 log likelihood, the band of the Cholesky factor L, and the right side (SIDE^2,) divided by L."""

    surprise: float
    factor: Array
    halfway: Array

    def coefficients(self) -> Array:
        """The coefficients (SIDE^2,)."""
        return _divided(self.factor, self.halfway, "T")


@on_one_thread
def smoothing_spline(contacts: Array, normals: Array, weights: Array, half: float, noise: float) -> Spline:
    """The spline of contacts and unit normals, (n, 3) each, which count by weights (n,).

    half : half the side of the square of knots
    noise : least standard deviation of a contact
    """
    knots, basis = bases(contacts[:, 0], contacts[:, 1], half)
    up = np.maximum(normals[:, 2], LEAST_COSINE)
    asked = np.column_stack([contacts[:, 2], -normals[:, :2] / up[:, None]]).T
    heights, slopes = _columns(knots, basis[:1], asked[:1]), _columns(knots, basis[1:], asked[1:])
    # A slope s has 1 + s^2 times the deviation.
    certainty = np.where(normals[:, 2] > LEAST_COSINE, up**4, 0.0)
    sizes, sloping = [grid[i] for grid, i in zip(_grids(noise), START, strict=True)], weights * certainty
    for _ in range(SIZE_PASSES):
        data = [heights.weighted(weights), slopes.weighted(sloping)]
        found = _likeliest(data, sizes, half, noise)
        off = np.einsum("cnk,nk->cn", basis, found.coefficients()[knots]) - asked
        turned = np.sqrt(certainty) * np.hypot(off[1], off[2])
        weights = _student(np.abs(off[0]), sizes[1])
        sloping = weights * certainty * _student(turned, sizes[2])
    found = _solved([heights.weighted(weights), slopes.weighted(sloping)], sizes, half)
    return Spline(found.coefficients().reshape(SIDE, SIDE), _stds(found.factor))


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
    from scipy.linalg import cholesky_banded

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
    halfway = _divided(factor, right, "N")
    surprise += 2.0 * np.log(factor[0]).sum() - halfway @ halfway
    return _Solution(float(surprise), factor, halfway)


def _divided(factor: Array, right: Array, trans: str) -> Array:
    """The right side (SIDE^2,) or (SIDE^2, k) divided by a Cholesky factor, or by its transpose with "T"."""
    from scipy.linalg.lapack import dtbtrs

    found: Array = dtbtrs(factor, right, uplo="L", trans=trans)[0]
    return found.reshape(right.shape)


def _columns(knots: Any, basis: Array, values: Array) -> _Columns:
    """What n contacts bring to the fit of bases (c, n, 16) at knots (n, 16) to values (c, n)."""
    from scipy.sparse import csc_matrix

    # A contact has 16 coefficients, so 136 pairs of them are in the band of the matrix's lower half.
    one, other = np.tril_indices(16)
    diagonal = (knots[:, one] - knots[:, other]) * SIDE**2
    pairs = np.einsum("cnp,cnp->np", basis[:, :, one], basis[:, :, other])
    rights = np.einsum("cnk,cn->nk", basis, values)
    parts = []
    for each, rows, size in ((pairs, diagonal + knots[:, other], WIDTH + 1), (rights, knots, 1)):
        starts = np.arange(0, each.size + 1, each.shape[1])
        shape = size * SIDE**2, len(knots)
        parts.append(csc_matrix((each.ravel(), rows.ravel(), starts), shape=shape))
    return _Columns(parts[0], parts[1], (values**2).sum(axis=0), len(basis))


def _student(misses: Array, std: float) -> Array:
    """The weights (n,) of contacts that are off by `misses` (n,)."""
    ratios = misses / max(std, 1.4826 * float(np.median(misses)))
    return np.where(ratios > FAR_OFF, (STUDENT + 1.0) / (STUDENT + ratios**2), 1.0)


def _stds(factor: Array) -> Array:
    """Deviations (SIDE, SIDE), computed at every other knot, because they are smooth and take the longest."""
    coarse = _heights_at_coarse_knots()
    some = np.sqrt((_divided(factor, coarse, "N") ** 2).sum(axis=0))
    return between(some.reshape((SIDE + 1) // 2, -1))


@cache
def _heights_at_coarse_knots() -> Array:
    """What coefficients contribute to the heights at every other knot, (SIDE^2, k)."""
    x, y = np.meshgrid(*2 * [np.linspace(-1.0, 1.0, SIDE)[::2]], indexing="ij")
    at, basis = bases(x.ravel(), y.ravel(), 1.0)
    found = np.zeros((SIDE**2, len(at)), order="F")
    np.add.at(found, (at, np.arange(len(at))[:, None]), basis[0])
    return found


def between(some: Array) -> Array:
    """Values (SIDE, SIDE) at all knots, interpolated from those at every other knot."""
    full, coarse = np.empty((SIDE, SIDE)), slice(None, None, 2)
    full[coarse, coarse] = some
    full[1::2, coarse] = 0.5 * (some[:-1] + some[1:])
    full[:, 1::2] = 0.5 * (full[:, :-2:2] + full[:, 2::2])
    return full


def bases(x: Array, y: Array, half: float) -> tuple[Any, Array]:
    """The 16 knots (n, 16) that tell of n places, and their shares (3, n, 16) in height and slopes there."""
    pitch = 2.0 * half / (SIDE - 1)
    (column, *by_x), (row, *by_y) = (weights_at(along / pitch) for along in (x, y))
    steps = np.arange(-1, 3)
    knots = (column[:, None, None] + steps[:, None]) * SIDE + row[:, None, None] + steps
    orders = ((0, 0), (1, 0), (0, 1))
    found = [by_x[i][:, :, None] * by_y[j][:, None] / pitch ** (i + j) for i, j in orders]
    return knots.reshape(-1, 16), np.array(found).reshape(3, -1, 16)


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
