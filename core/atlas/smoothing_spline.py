# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Heights as a smoothing spline through contacts and across normals, as smooth as these show it to be.

Not in the paper. It is a cubic B-spline on SIDE x SIDE knots. Its prior is that of a surface with random
third derivatives, which leaves quadrics free (Wahba 1990, on knots as by Eilers and Marx 1996). The size of
these derivatives, and the deviations of contacts and normals follow from the marginal likelihood; outlying
contacts weigh as under a Student t distribution. Equations are banded, however many contacts there are. All
is in unit radius.
"""

from collections.abc import Sequence
from functools import cache
from math import comb
from typing import Any, NamedTuple

import numpy as np

from ..arguments import Array
from ..lapack import on_one_thread
from .cubic_spline import CUBIC, SIDE, bases

# python -m benchmarks.atlas chose these.
ORDER = 3  # The order of the random derivatives. With 2 as a choice, patches are 4 % farther off.
FREE = ORDER * (ORDER + 1) // 2  # This many terms are free.
ROUGHNESS = (0.03, 0.1, 0.3, 1.0, 3.0, 10.0, 30.0)  # The grid of the derivatives' size.
NOISE_FACTORS = (1.0, 2.0, 4.0, 8.0)  # The grid of the noise, in units of the least noise.
SLOPE_STDS = (0.01, 0.02, 0.04, 0.08, 0.16, 0.32)  # The grid of the normals' deviation, which facets have.
START, MIDDLE = 3, 2  # It begins at these places of the grids of roughness and of the normals' deviation.
PASSES = 2  # If the noise is above its floor, hyperparameters are searched this often. With one, a tenth of
# outlying contacts makes a fit some tens of times worse (test_smoothing_spline).
FAR_OFF, STUDENT = 3.0, 4.0  # Outliers are off by more deviations, and weigh as under t of this freedom.
LEAST_COSINE = 0.2  # A normal does not count if the cosine of its angle to the axis is less.
WIDTH = CUBIC * SIDE + CUBIC  # The width of the band.
SPLINE_ROUNDING = 1e-9  # This share of its largest element keeps the matrix invertible.


class Spline(NamedTuple):
    """The coefficients (SIDE, SIDE) of heights, and their standard deviations (k, k) at every other knot."""

    coefficients: Array
    stds: Array


class _Equations(NamedTuple):
    """Normal equations of heights and slopes of unit deviation, and the prior's matrix.

    bands : (3, SIDE^2 (WIDTH + 1)), those of matrices, column by column: of the prior, heights, slopes
    rights, squares, counts : (2, SIDE^2), (2,) and (2,), right sides, sums of squares and numbers of data
    """

    bands: Array
    rights: Array
    squares: Array
    counts: Array


class _Hyperparameters(NamedTuple):
    """The size of the random derivatives, and the deviations of contacts and normals."""

    roughness: float
    noise: float
    slope_std: float


class _Solution(NamedTuple):
    """A solution and its evidence.

    neg2_log_evidence : -2 log marginal likelihood of the hyperparameters
    factor : the band of the Cholesky factor L of the normal equations' matrix
    whitened : (SIDE^2,), L^-1 times their right side
    """

    neg2_log_evidence: float
    hyperparameters: _Hyperparameters
    factor: Array
    whitened: Array

    def coefficients(self) -> Array:
        """The coefficients (SIDE^2,)."""
        return _triangular(self.factor, self.whitened, "T")


@on_one_thread
def smoothing_spline(contacts: Array, normals: Array, weights: Array, half: float, noise: float) -> Spline:
    """The spline of contacts and unit normals, (n, 3) each.

    weights : (n,), by which these count at first; later by how far off the contacts are
    half : half the side of the square of knots
    noise : noise floor, the standard deviation that a contact has at least
    """
    knots, basis = bases(contacts[:, 0], contacts[:, 1], half)
    up = np.maximum(normals[:, 2], LEAST_COSINE)
    values = np.column_stack([contacts[:, 2], -normals[:, :2] / up[:, None]]).T
    # A slope s has 1 + s^2 times the deviation.
    certainty = np.where(normals[:, 2] > LEAST_COSINE, up**4, 0.0)
    heights = _design(knots, basis[:1]), values[0]
    slopes = _design(knots, basis[1:]), values[1:].ravel()
    hyperparameters = _Hyperparameters(ROUGHNESS[START], noise, SLOPE_STDS[MIDDLE])
    grids = {"slope_std": SLOPE_STDS, "roughness": ROUGHNESS}
    grids["noise"] = tuple(noise * factor for factor in NOISE_FACTORS)
    equations = _equations([heights, slopes], [weights, np.tile(weights * certainty, 2)])
    for _ in range(PASSES):
        best = _solved(equations, hyperparameters, half)
        for name, grid in grids.items():
            best = _ascended(equations, best, name, grid, half)
        residuals = np.abs(heights[0] @ best.coefficients() - heights[1])
        weights, hyperparameters = _student(residuals, best.hyperparameters.noise), best.hyperparameters
        equations = _equations([heights, slopes], [weights, np.tile(weights * certainty, 2)])
        if hyperparameters.noise == noise:
            break  # Outlying contacts, which make the noise look larger, did not count.
    best = _solved(equations, hyperparameters, half)
    return Spline(best.coefficients().reshape(SIDE, SIDE), _stds(best.factor))


def _equations(data: Sequence[tuple[Any, Array]], weights: Sequence[Array]) -> _Equations:
    """The equations of heights and slopes, each a design matrix and m values, with their weights (m,)."""
    sums = []
    for (design, values), w in zip(data, weights, strict=True):
        weighted = design.T.multiply(w).tocsr()
        sums.append((_band(weighted @ design), weighted @ values, w @ values**2, np.count_nonzero(w)))
    bands, *others = (np.array(parts) for parts in zip(*sums, strict=True))
    return _Equations(np.vstack([penalty(), bands]), *others)


def _ascended(
    equations: _Equations, best: _Solution, name: str, grid: tuple[float, ...], half: float
) -> _Solution:
    """The likeliest solution that is found by steps of one hyperparameter up or down its grid."""
    start = grid.index(getattr(best.hyperparameters, name))
    for way in (grid[start + 1 :], grid[:start][::-1]):
        before = best
        for value in way:
            change: dict[str, Any] = {name: value}
            tried = _solved(equations, best.hyperparameters._replace(**change), half)
            if tried.neg2_log_evidence >= best.neg2_log_evidence:
                break
            best = tried
        if best is not before:
            break
    return best


def _solved(equations: _Equations, hyperparameters: _Hyperparameters, half: float) -> _Solution:
    """The penalized least squares solution for given hyperparameters, by a banded Cholesky factor L L' = A.

    neg2_log_evidence is y'y - |L^-1 b|^2 + log |A| - log |prior precision| and the terms of the noise, in
    unit radius, up to a constant.
    """
    from scipy.linalg import cholesky_banded

    pitch = 2.0 * half / (SIDE - 1)
    precision = pitch ** (2 - 2 * ORDER) / hyperparameters.roughness**2
    stds = np.array([hyperparameters.noise, hyperparameters.slope_std])
    neg2_log_evidence = equations.squares @ stds**-2.0 + 2.0 * equations.counts @ np.log(stds)
    neg2_log_evidence -= (SIDE**2 - FREE) * np.log(precision)
    matrix = (np.array([precision, *stds**-2.0]) @ equations.bands).reshape(SIDE**2, WIDTH + 1).T
    matrix[0] += SPLINE_ROUNDING * matrix[0].max()
    factor = cholesky_banded(matrix, overwrite_ab=True, lower=True, check_finite=False)
    whitened = _triangular(factor, stds**-2.0 @ equations.rights, "N")
    neg2_log_evidence += 2.0 * np.log(factor[0]).sum() - whitened @ whitened
    return _Solution(float(neg2_log_evidence), hyperparameters, factor, whitened)


def _triangular(factor: Array, right: Array, trans: str) -> Array:
    """L^-1, or L^-T with "T", times right sides (SIDE^2,) or (SIDE^2, k), for a Cholesky factor L."""
    from scipy.linalg.lapack import dtbtrs

    solved: Array = dtbtrs(factor, right, uplo="L", trans=trans)[0]
    return solved.reshape(right.shape)


def _design(knots: Any, basis: Array) -> Any:
    """The sparse matrix (c n, SIDE^2) from coefficients to data, for bases (c, n, 16) at knots (n, 16)."""
    from scipy.sparse import csr_array

    columns, starts = np.tile(knots.ravel(), len(basis)), np.arange(0, basis.size + 1, 16)
    return csr_array((basis.ravel(), columns, starts), (len(starts) - 1, SIDE**2))


def _student(residuals: Array, std: float) -> Array:
    """The weights (n,) of contacts that are off by `residuals` (n,)."""
    # Of a narrow steep patch, no contact may have its foot on it.
    median = float(np.median(residuals)) if len(residuals) else 0.0
    ratios = residuals / max(std, 1.4826 * median)
    return np.where(ratios > FAR_OFF, (STUDENT + 1.0) / (STUDENT + ratios**2), 1.0)


def _stds(factor: Array) -> Array:
    """Deviations (k, k) at every other knot."""
    stds: Array = np.linalg.norm(_triangular(factor, _heights_at_coarse_knots(), "N"), axis=0)
    return stds.reshape((SIDE + 1) // 2, -1)


@cache
def _heights_at_coarse_knots() -> Array:
    """What coefficients contribute to the heights at every other knot, (SIDE^2, k)."""
    x, y = np.meshgrid(*2 * [np.linspace(-1.0, 1.0, SIDE)[::2]], indexing="ij")
    at, basis = bases(x.ravel(), y.ravel(), 1.0)
    heights = np.zeros((SIDE**2, len(at)), order="F")
    np.add.at(heights, (at, np.arange(len(at))[:, None]), basis[0])
    return heights


@cache
def penalty() -> Array:
    """The lower band of P, flat: c' P c is the sum of squares of all differences of ORDER of coefficients c.

    Mixed ones count as often as they occur.
    """
    from scipy.sparse import csr_matrix, kron

    differences = (csr_matrix(np.diff(np.eye(SIDE), k, axis=0)) for k in range(ORDER + 1))
    squares = [d.T @ d for d in differences]
    return _band(sum(comb(ORDER, k) * kron(squares[ORDER - k], squares[k]) for k in range(ORDER + 1)))


def _band(matrix: Any) -> Array:
    """The lower band of a sparse symmetric matrix, column by column, (SIDE^2 (WIDTH + 1),)."""
    entries = matrix.tocoo()
    low = entries.row >= entries.col
    band = np.zeros((SIDE**2, WIDTH + 1))
    band[entries.col[low], (entries.row - entries.col)[low]] = entries.data[low]
    return band.ravel()
