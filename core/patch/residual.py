# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What a real surface is beside a polynomial: a Gaussian process over the tangent plane.

Beside the paper. The heights are phi' b + g, where phi are the terms of degree 1 to 6 under the prior of
joint_fit.py, and g has zero mean and the covariance

    k(p, q) = sum_i v_i M(|p - q| / l_i),  M(d) = (1 + a) exp(-a),  a = sqrt(3) d,

a Matern kernel of order 3/2. On scans it comes nearer than order 5/2, and its mean still has second
derivatives. residual_evidence.py finds the variances v_i and the noise that is left; the reference
point is a contact like the others. All is in unit radius and in the Darboux frame.

With g = k(p, u)' c for places u of contacts, what the contacts say is a Gaussian over 27 coefficients and
one c for each place. What no place tells adds the covariance k(p, p) - k(p, u)' k(u, u)^-1 k(u, p).
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..arguments import Array
from ..lapack import cholesky, solved
from .differential_geometry import Derivatives
from .monge import TERMS, derived_monomials, monomials

LENGTHS = np.array([0.4, 1.6])  # The lengths l_i, as shares of the radius (benchmarks.real).
DISTANCES_AT_ONCE = 6000  # So many distances fit into a processor's cache.
KERNEL_ROUNDING = 1e-9  # This share of its mean is added to the diagonal of k(u, u), so that it has a factor.
PARTIALS = [(0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2)]


@dataclass(frozen=True, eq=False)
class Residual:
    """What the surface is beside the mean of a Posterior, in its frame and in unit radius.

    With k(u, u) = L L' and the features f(p) = (phi(p), L^-1 k(u, p)), the covariance of heights is k(p, q)
    less the part of it that f tells, plus f(p)' A^-1 f(q), where A = factor factor' is the precision.

    places : (m, 2), the places u
    variances : (2,), of g, for each of LENGTHS
    mean : (27 + m,), coefficients of the terms, less the Posterior's mean; and of k(p, places)
    factor : (27 + m, 27 + m), lower triangular
    noise : (), standard deviation of a contact
    """

    places: Array
    variances: Array
    mean: Array
    factor: Array
    noise: Array

    @property
    def size(self) -> float:
        """The standard deviation of g far from the point, as a share of the radius."""
        return math.sqrt(float(self.variances.sum()))

    def height(self, x: Array, y: Array) -> Array:
        """The height that the residual adds to the Posterior's mean at n points, (n,)."""
        terms, weights = self.mean[: len(TERMS)], self.mean[len(TERMS) :]
        p = np.column_stack([x, y])
        return monomials(x, y, TERMS) @ terms + weighted_kernel(p, self.places, self.variances, weights)

    def derivatives(self, x: Array, y: Array) -> Derivatives:
        """Height, slopes and second derivatives of the residual at n points."""
        terms = np.einsum("kmn,m->kn", derived_monomials(x, y, TERMS, PARTIALS), self.mean[: len(TERMS)])
        p = np.column_stack([x, y])
        return Derivatives(*(terms + _derived(p, self.places, self.variances, self.mean[len(TERMS) :])))

    def height_std(self, x: Array, y: Array) -> Array:
        """Standard deviations of the height at n points, (n,)."""
        p = np.column_stack([x, y])
        told, left = self.whitened(p)
        variance = np.einsum("in,in->n", left, left) - np.einsum("in,in->n", told, told)
        return np.sqrt(np.maximum(self.variances.sum() + variance, 0.0))

    def height_covariance(self, p: Array, q: Array) -> Array:
        """Covariances of the heights at points (..., n, 2) and (..., m, 2), (..., n, m)."""
        return self._covariance(p, self.signed(p), q, self.signed(q))

    def covariances_with(self, q: Array) -> Callable[[Array], tuple[Array, Array]]:
        """A function: covariances of heights at points (..., n, 2) with those at q (m, 2), and each other."""
        at_q = self.signed(q)

        def covariances(p: Array) -> tuple[Array, Array]:
            """Covariances of heights at p with those at q, (..., n, m), and with each other, (..., n, n)."""
            if p is self.places:  # There the features tell all of k.
                terms = monomials(p[:, 0], p[:, 1], TERMS).T
                left = solved(self.factor, np.vstack([terms, self.places_factor.T])).T
                return left @ at_q[:, len(p) :].T, left @ left.T
            at_p = self.signed(p)
            return self._covariance(p, at_p, q, at_q), self._covariance(p, at_p, p, at_p)

        return covariances

    def _covariance(self, p: Array, at_p: Array, q: Array, at_q: Array) -> Array:
        """The covariances of heights at p and q, given what `signed` gives for both."""
        covariance, told = kernel(p, q, self.variances), at_p.copy()
        told[..., : len(self.places)] *= -1.0
        covariance += told @ np.swapaxes(at_q, -1, -2)
        return covariance

    def signed(self, p: Array) -> Array:
        """Both results of `whitened` for points (..., n, 2), side by side, (..., n, 27 + 2 m)."""
        return np.vstack(self.whitened(p.reshape(-1, 2))).T.reshape(*p.shape[:-1], -1)

    def whitened(self, p: Array) -> tuple[Array, Array]:
        """L^-1 k(places, p), (m, n), and factor^-1 f(p), (27 + m, n), at points (n, 2)."""
        terms = monomials(p[:, 0], p[:, 1], TERMS).T
        return whitened(self.places_factor, self.factor, terms, kernel(self.places, p, self.variances))

    @cached_property
    def places_factor(self) -> Array:
        """The factor L of k(u, u), (m, m), lower triangular."""
        return places_factor(kernel(self.places, self.places, self.variances))


def places_factor(within: Array) -> Array:
    """The factor L of k(u, u), (m, m), lower triangular; `within` is k(u, u), which is used up."""
    np.einsum("ii->i", within)[:] += KERNEL_ROUNDING * within.trace() / len(within)  # a view
    return cholesky(within)


def whitened(places: Array, factor: Array, terms: Array, told: Array) -> tuple[Array, Array]:
    """Residual.whitened by its two factors, for terms (27, n) and k(places, p) (m, n), or sums of such."""
    told = solved(places, told)
    return told, solved(factor, np.vstack([terms, told]))


def kernel(p: Array, q: Array, variances: Array) -> Array:
    """Covariances of g at points (..., n, 2) and (..., m, 2), (..., n, m), for variances (2,)."""
    one, other = kernels(p, q)
    one *= variances[0]
    other *= variances[1]
    one += other
    return one


def kernels(p: Array, q: Array) -> list[Array]:
    """Kernels of unit variance, (..., n, m), for each of LENGTHS."""
    return _maternes(distances(p, q))


def weighted_kernel(p: Array, q: Array, variances: Array, weights: Array) -> Array:
    """k(p, q) @ weights at points (n, 2) and (m, 2), (n,)."""
    total, rows = np.empty(len(p)), max(1, DISTANCES_AT_ONCE // max(len(q), 1))
    for start in range(0, len(p), rows):
        one, other = _maternes(distances(p[start : start + rows], q))
        total[start : start + rows] = one @ (variances[0] * weights) + other @ (variances[1] * weights)
    return total


def distances(p: Array, q: Array) -> Array:
    """Distances of points (..., n, 2) and (..., m, 2), (..., n, m)."""
    apart, across = (p[..., :, None, i] - q[..., None, :, i] for i in (0, 1))
    apart *= apart
    across *= across
    apart += across
    return np.sqrt(apart, out=apart)


def _maternes(distance: Array) -> list[Array]:
    """M of distances (...), which are used up, for each of LENGTHS; one follows from the other."""
    # This works in place, because passes over memory take most of the time.
    short, long = LENGTHS.tolist()
    a = np.multiply(distance, math.sqrt(3.0) / long, out=distance)
    decay, ratio = np.exp(-a), long / short
    other = ratio * a
    other += 1.0
    # numpy takes as long to raise to the power 4 as for an exponential, and much less to square twice.
    other *= np.square(np.square(decay)) if ratio == 4.0 else decay**ratio
    a += 1.0
    a *= decay
    return [other, a]


def _derived(p: Array, places: Array, variances: Array, weights: Array) -> Array:
    """k(p, places) @ weights at points (n, 2) and its derivatives by p, (6, n), in the order of PARTIALS."""
    total = np.zeros((len(PARTIALS), len(p)))
    for variance, length in zip(variances, LENGTHS, strict=True):
        total += variance * (_derived_matern(p[:, None] - places, length) @ weights)
    return total


def _derived_matern(apart: Array, length: float) -> Array:
    """M(|apart| / length) for (..., 2) and its derivatives, (6, ...), in the order of PARTIALS."""
    x, y = np.moveaxis(apart, -1, 0)
    a, b = math.sqrt(3.0) / length * np.hypot(x, y), 3.0 / length**2
    slope = -b * np.exp(-a)
    height = (1.0 + a) * np.exp(-a)
    bend = -b * slope / np.maximum(a, 1e-300)  # It is multiplied by less than a^2.
    second = slope + bend * x**2, bend * x * y, slope + bend * y**2
    return np.array([height, slope * x, slope * y, *second])
