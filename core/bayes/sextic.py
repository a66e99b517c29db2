# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Polynomials given contacts and measured normals: a linear model under a Gaussian prior, in stacks.

This is the surface's model where the process has the amplitude 0 (Rasmussen and Williams 2006, 2.1).
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..arguments import Array
from ..lapack import cholesky, inverse_lower, solved_definite
from ..patch.monge import TERMS, monomials
from .evidence import ROUNDING, Hyperparameters, hyperparameters
from .normals import slope_equations
from .posterior import SurfacePosterior
from .prior import FREE, PRIOR_SCALE

LEAST_FREEDOM = 5.0  # The least number of degrees of freedom: to few contacts a prior adds some.


class Sextics(NamedTuple):
    """Heights of n contacts ~ terms @ coefficients, all less the prior's mean; and the normal equations.

    rows : (b, 28, n), the 27 terms and the heights
    weights : (b, n)
    heights, slopes : (b, 28, 28), normal equations [[gram, rhs], [rhs', y'y]] of contacts, and of measured
        normals in units of their deviations; the latter are 0 without normals
    pivot : (b, 27), what the contacts' mean terms have of a share in the height at the origin
    offset : (b,), the variance that this height keeps when the terms are known, over that of the noise
    """

    rows: Array
    weights: Array
    heights: Array
    slopes: Array
    pivot: Array
    offset: Array

    @property
    def counts(self) -> Array:
        """The number of contacts, (b,)."""
        return (self.weights > 0.0).sum(axis=1, dtype=float)

    def residuals(self, coefficients: Array) -> Array:
        """What the coefficients (b, 27) do not explain of the heights, (b, n)."""
        return self.rows[:, -1] - (coefficients[:, None] @ self.rows[:, :-1])[:, 0]

    def equations(self, noise: Array) -> Array:
        """What contacts and normals add to the precision and to its product with the mean, (b, 28, 28)."""
        return self.heights / (noise**2)[:, None, None] + self.slopes

    def hyperparameters(
        self, floor: Array, which: slice | NDArray[np.bool_] = slice(None)
    ) -> Hyperparameters:
        """Prior variances and noise, at least `floor` (b,), of some of the touches."""
        return hyperparameters(self.heights[which], self.counts[which], self.slopes[which], floor[which])


def sextics(local: Array, weights: Array, expected: Array, normals: Array, point_std: Array) -> Sextics:
    """The equations of contacts (b, n, 3) and their weights (b, n), less the prior's means (b, 27).

    normals : (b, n, 3), measured normals over their standard deviations, or (b, 0, 3)
    point_std : (b,), standard deviation of the height at the origin before contacts are known, over that of
        a contact

    The height at the origin is one more coefficient, with the prior N(0, point_std^2), and is eliminated: if
    m is the mean of all rows over contacts of the total weight W, it is f (m_28 - m_1..27' b), and known to
    the variance f / W, with the f of `offset_share`.
    """
    b, n = weights.shape
    rows = np.empty((b, len(TERMS) + 1, n))
    rows[:, :-1] = monomials(local, TERMS).swapaxes(1, 2)
    np.subtract(local[..., 2], (expected[:, None] @ rows[:, :-1])[:, 0], out=rows[:, -1])
    squared, pivot, offset = rows, np.zeros((b, len(TERMS))), np.zeros(b)
    if point_std.any():
        total, share = weights.sum(axis=1), offset_share(weights, point_std)
        means = (rows @ weights[..., None])[..., 0] / total[:, None]
        # Their squares are those of all rows less f W m m', without a difference that rounds.
        squared = rows - ((1.0 - np.sqrt(1.0 - share))[:, None] * means)[..., None]
        rows -= (share[:, None] * means)[..., None]
        pivot, offset = share[:, None] * means[:, :-1], share / total
    heights = (squared * weights[:, None]) @ squared.transpose(0, 2, 1)
    slopes = np.zeros_like(heights)
    if normals.size:
        partials, steepness = slope_equations(normals, local, weights)
        steepness = steepness[..., None] - partials @ expected[..., None]
        columns = np.concatenate([partials, steepness], axis=2)
        slopes = columns.transpose(0, 2, 1) @ columns
    return Sextics(rows, weights, heights, slopes, pivot, offset)


def offset_share(weights: Array, point_std: Array) -> Array:
    """The share (b,) of the mean residual of contacts that is a height at the origin, of `sextics`."""
    ratio = weights.sum(axis=1) * point_std**2
    return ratio / (1.0 + ratio)


def mean_given(data: Sextics, hyper: Hyperparameters) -> Array:
    """The mean of the coefficients less the prior's mean, (b, 27) (Rasmussen and Williams 2006, eq. 2.8)."""
    bordered = data.equations(hyper.noise)
    precision = _with_prior(bordered[:, :-1, :-1].copy(), hyper.prior)
    return np.array(
        [solved_definite(*system) for system in zip(precision, bordered[:, :-1, -1], strict=True)]
    )


def with_scatter(data: Sextics, coefficients: Array, normals: Array) -> Sextics:
    """The equations with the variances of measured normals times their reduced chi^2, if that is above 1.

    It is that about polynomials: where the surface has a texture, its normals (b, n, 3) scatter by more than
    their own deviation.

    coefficients : (b, 27), less the prior's mean
    """
    residual = np.pad(coefficients, ((0, 0), (0, 1)), constant_values=-1.0)
    freedom = 2.0 * np.count_nonzero(normals.any(axis=2) & (data.weights > 0.0), axis=1) - FREE
    chi2 = np.einsum("bi,bij,bj->b", residual, data.slopes, residual) / np.maximum(freedom, 1.0)
    return data._replace(slopes=data.slopes / np.maximum(chi2, 1.0)[:, None, None])


def posterior_given(mean: Array, data: Sextics, hyper: Hyperparameters) -> SurfacePosterior:
    """The posteriors about the means (b, 27)."""
    gram = data.equations(hyper.noise)[:, :-1, :-1]
    visibility = _visibility(gram)
    root = np.zeros((len(mean), len(TERMS) + 1, len(TERMS) + 1))
    for factor, precision in zip(root, _with_prior(gram.copy(), hyper.prior), strict=True):
        factor[:-1, :-1] = inverse_lower(cholesky(precision))
    # Waviness and noise are estimates, so deviations are those of a Student t of this freedom.
    freedom = np.maximum(data.counts - FREE, LEAST_FREEDOM)
    root *= np.sqrt(freedom / (freedom - 2.0))[:, None, None]
    if data.offset.any():
        root[:, :-1, -1] = -(root[:, :-1, :-1] @ data.pivot[..., None])[..., 0]
        root[:, -1, -1] = hyper.noise * np.sqrt(data.offset)
    return SurfacePosterior(mean, root, hyper.noise, visibility)


def _visibility(gram: Array) -> Array:
    """The visibility of a SurfacePosterior, given what contacts add to the precision, (b, 27, 27)."""
    gram = gram.copy()
    diagonal = np.einsum("bii->bi", gram)  # a view
    # What is added exceeds what rounding takes from directions that no contact shows, and is far below noise.
    diagonal += ROUNDING * diagonal.sum(axis=1)[:, None]
    return PRIOR_SCALE * np.linalg.cholesky(gram)[:, FREE:, FREE:].transpose(0, 2, 1)


def _with_prior(precision: Array, prior: Array) -> Array:
    """A precision (b, 27, 27), to which that of the prior with these variances (b, 27) is added in place."""
    np.einsum("bii->bi", precision)[:] += 1.0 / prior  # a view
    return precision
