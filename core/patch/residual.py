# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What a real surface is beside a polynomial: a Gaussian process over the tangent plane.

Beside the paper. The heights are phi' b + g, phi the terms of degree 1 to 6 under the prior of joint_fit.py
and g of zero mean and of the covariance

    sum_i v_i M(|p - q| / l_i),  M(d) = (1 + a) exp(-a),  a = sqrt(3) d,

a Matern's of order 3/2: on scans it comes nearer than that of 5/2, and its mean still has second
derivatives. residual_evidence.py finds the variances v_i and the noise that is left; the reference
point is a contact like the others. All is in unit radius and in the Darboux frame.

g = k(p, u)' c for places u of contacts, so what the contacts say of it is a Gaussian over 27 coefficients
and one c for each place; and what no place tells adds k(p, p) - k(p, u)' k(u, u)^-1 k(u, p).
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..arguments import Array
from .differential_geometry import Derivatives
from .monge import TERMS, derived_monomials, monomials

LENGTHS = np.array([0.4, 1.6])  # of the radius; with benchmarks.real
DISTANCES_AT_ONCE = 6000  # distances at once: they fit into a processor's cache
KERNEL_ROUNDING = 1e-9  # Share of k(u, u).
PARTIALS = [(0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2)]


@dataclass(frozen=True, eq=False)
class Residual:
    """What the surface is beside the mean of a Posterior, in its frame and in unit radius.

    With k(u, u) = L L' and the features f(p) = (phi(p), L^-1 k(u, p)), heights have the covariance
    k(p, q) less the part of it that f tells, and f(p)' A^-1 f(q), A = factor factor' the precision.

    places : (m, 2), of contacts
    variances : (2,), of g, for each of LENGTHS
    mean : (27 + m,), of the terms, less the Posterior's mean; and of k(p, places)
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
        """What it adds to the Posterior's mean height at n points, (n,)."""
        terms, weights = self.mean[: len(TERMS)], self.mean[len(TERMS) :]
        p = np.column_stack([x, y])
        return monomials(x, y, TERMS) @ terms + weighted_kernel(p, self.places, self.variances, weights)

    def derivatives(self, x: Array, y: Array) -> Derivatives:
        """The kernel with its slopes and second derivatives."""
        terms = np.einsum("kmn,m->kn", derived_monomials(x, y, TERMS, PARTIALS), self.mean[: len(TERMS)])
        p = np.column_stack([x, y])
        return Derivatives(*(terms + _derived(p, self.places, self.variances, self.mean[len(TERMS) :])))

    def height_std(self, x: Array, y: Array) -> Array:
        """Standard deviations of the height at n points, (n,)."""
        p = np.column_stack([x, y])
        told, left = self.whitened(p)
        variance = own_variance(p, self.variances)
        variance += np.einsum("in,in->n", left, left) - np.einsum("in,in->n", told, told)
        return np.sqrt(np.maximum(variance, 0.0))

    def height_covariance(self, p: Array, q: Array) -> Array:
        """Covariances of the heights at points (..., n, 2) and (..., m, 2), (..., n, m)."""
        return self._covariance(p, self.signed(p), q, self.signed(q))

    def covariances_with(self, q: Array) -> Callable[[Array], tuple[Array, Array]]:
        """The covariances of heights at points (..., n, 2) with those at q, (m, 2), and with each other."""
        at_q = self.signed(q)

        def covariances(p: Array) -> tuple[Array, Array]:
            """Covariances of heights at p with those at q, (..., n, m), and with each other, (..., n, n)."""
            if p is self.places:  # at which the places tell all of k
                terms = monomials(p[:, 0], p[:, 1], TERMS).T
                left = solved(self.factor, np.vstack([terms, self.places_factor.T])).T
                return left @ at_q[:, len(p) :].T, left @ left.T
            at_p = self.signed(p)
            return self._covariance(p, at_p, q, at_q), self._covariance(p, at_p, p, at_p)

        return covariances

    def _covariance(self, p: Array, at_p: Array, q: Array, at_q: Array) -> Array:
        """The covariances of heights, from what `signed` gives of the points."""
        covariance, told = kernel(p, q, self.variances), at_p.copy()
        told[..., : len(self.places)] *= -1.0
        covariance += told @ np.swapaxes(at_q, -1, -2)
        return covariance

    def signed(self, p: Array) -> Array:
        """What `whitened` gives of points (..., n, 2), side by side, (..., n, 27 + 2 m)."""
        return np.vstack(self.whitened(p.reshape(-1, 2))).T.reshape(*p.shape[:-1], -1)

    def whitened(self, p: Array) -> tuple[Array, Array]:
        """L^-1 k(places, p), (m, n), and factor^-1 f(p), (27 + m, n), at points (n, 2)."""
        terms = monomials(p[:, 0], p[:, 1], TERMS).T
        return whitened(self.places_factor, self.factor, terms, kernel(self.places, p, self.variances))

    @cached_property
    def places_factor(self) -> Array:
        """L of k(u, u), (m, m)."""
        return places_factor(kernel(self.places, self.places, self.variances))


def places_factor(within: Array) -> Array:
    """L of k(u, u) of places, (m, m), lower triangular."""
    np.einsum("ii->i", within)[:] += KERNEL_ROUNDING * within.trace() / len(within)  # a view
    return cholesky(within)


def cholesky(matrix: Array) -> Array:
    """Its lower triangular factor; of (m, m), which is used up. scipy's is some times as fast as numpy's."""
    from scipy.linalg.lapack import dpotrf

    factor, failed = dpotrf(matrix.T, lower=0, clean=1, overwrite_a=1)
    if failed:
        raise np.linalg.LinAlgError("the matrix is not positive definite")
    lower: Array = factor.T
    return lower


def cholesky_in_place(matrix: Array) -> Array:
    """The diagonal of a triangular factor, which takes the place of the matrix (m, m): its upper triangle."""
    from scipy.linalg.lapack import dpotrf

    dpotrf(matrix.T, lower=1, clean=0, overwrite_a=1)
    return matrix.reshape(-1)[:: len(matrix) + 1]


def solved_definite(matrix: Array, right: Array) -> Array:
    """matrix^-1 @ right, of a positive definite matrix (m, m), whose lower triangle is used up, and (m,)."""
    from scipy.linalg.lapack import dposv

    _, found, failed = dposv(matrix.T, right, lower=0, overwrite_a=1)
    if failed:
        raise np.linalg.LinAlgError("the matrix is not positive definite")
    solution: Array = found
    return solution


def inverse_definite(matrix: Array) -> Array:
    """matrix^-1 of a positive definite matrix (m, m), whose lower triangle is used up."""
    from scipy.linalg.lapack import dpotri

    upper: Array = dpotri(cholesky(matrix).T, lower=0, overwrite_c=1)[0]
    upper += upper.T
    upper.flat[:: len(upper) + 1] *= 0.5
    return upper


def whitened(places: Array, factor: Array, terms: Array, told: Array) -> tuple[Array, Array]:
    """Residual.whitened by the two factors, of terms (27, n) and k(places, p), (m, n), or of sums of such."""
    told = solved(places, told)
    return told, solved(factor, np.vstack([terms, told]))


def solved(factor: Array, right: Array, transposed: bool = False) -> Array:
    """factor^-1 @ right, or factor'^-1 @ right, of a lower triangular matrix (m, m)."""
    from scipy.linalg.lapack import dtrtrs

    found: Array = dtrtrs(factor.T, right, lower=0, trans=0 if transposed else 1)[0]
    return found


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


def own_variance(p: Array, variances: Array) -> Array:
    """k(p, p) at points (n, 2), (n,)."""
    return np.full(len(p), variances.sum())


def _maternes(distance: Array) -> list[Array]:
    """M of distances (...), which are used up, over each of LENGTHS; the shorter's by the other's."""
    # In place, for passes over memory take most of the time.
    short, long = LENGTHS.tolist()
    a = np.multiply(distance, math.sqrt(3.0) / long, out=distance)
    decay, ratio = np.exp(-a), long / short
    other = ratio * a
    other += 1.0
    # numpy raises to 4 as slowly as it finds an exponential, and squares twice at once.
    other *= np.square(np.square(decay)) if ratio == 4.0 else decay**ratio
    a += 1.0
    a *= decay
    return [other, a]


def _derived(p: Array, places: Array, variances: Array, weights: Array) -> Array:
    """k(p, places) @ weights at points (n, 2) and its derivatives by p, (6, n), as PARTIALS says."""
    total = np.zeros((len(PARTIALS), len(p)))
    for variance, length in zip(variances, LENGTHS, strict=True):
        total += variance * (_derived_matern(p[:, None] - places, length) @ weights)
    return total


def _derived_matern(apart: Array, length: float) -> Array:
    """M(|apart| / length) of (..., 2) and its derivatives, (6, ...), as PARTIALS says."""
    x, y = np.moveaxis(apart, -1, 0)
    a, b = math.sqrt(3.0) / length * np.hypot(x, y), 3.0 / length**2
    slope = -b * np.exp(-a)
    height = (1.0 + a) * np.exp(-a)
    bend = -b * slope / np.maximum(a, 1e-300)  # times what is less than a^2
    second = slope + bend * x**2, bend * x * y, slope + bend * y**2
    return np.array([height, slope * x, slope * y, *second])
