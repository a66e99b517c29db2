# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The covariance of the process g, and of its derivatives: Matern kernels of order 3/2 at two lengths.

    k(p, q) = sum_i v_i M(|p - q| / l_i),  M(d) = (1 + a) exp(-a),  a = sqrt(3) d

(Rasmussen and Williams 2006, equation 4.17). On scans order 3/2 comes nearer than order 5/2, and away from
the contacts its mean has second derivatives. Places are in unit radius.
"""

import math

import numpy as np

from ..arguments import Array
from ..lapack import cholesky

LENGTHS = np.array([0.4, 1.6])  # The lengths l_i, as shares of the radius (benchmarks.real).
DISTANCES_AT_ONCE = 6000  # The number of distances that fit into a processor's cache.
KERNEL_ROUNDING = 1e-9  # This share of its mean is added to the diagonal of k(u, u), so that it has a factor.


def places_factor(within: Array) -> Array:
    """The factor L of k(u, u), (m, m), lower triangular; `within` is k(u, u), which is used up."""
    np.einsum("ii->i", within)[:] += KERNEL_ROUNDING * within.trace() / len(within)  # a view
    return cholesky(within)


def kernel(p: Array, q: Array, variances: Array) -> Array:
    """Covariances of g at points (..., n, 2) and (..., m, 2), (..., n, m), for variances (2,)."""
    one, other = kernels(p, q)
    one *= variances[0]
    one += variances[1] * other
    return one


def weighted_kernel(p: Array, q: Array, variances: Array, weights: Array) -> Array:
    """k(p, q) @ weights at points (n, 2) and (m, 2), (n,)."""
    total, rows = np.empty(len(p)), max(1, DISTANCES_AT_ONCE // max(len(q), 1))
    for start in range(0, len(p), rows):
        one, other = kernels(p[start : start + rows], q)
        total[start : start + rows] = one @ (variances[0] * weights) + other @ (variances[1] * weights)
    return total


def distances(p: Array, q: Array) -> Array:
    """Distances of points (..., n, 2) and (..., m, 2), (..., n, m)."""
    apart, across = (p[..., :, None, i] - q[..., None, :, i] for i in (0, 1))
    apart *= apart
    across *= across
    apart += across
    return np.sqrt(apart, out=apart)


def kernels(p: Array, q: Array) -> list[Array]:
    """Kernels of unit variance at points (..., n, 2) and (..., m, 2), (..., n, m), for each of LENGTHS.

    One follows from the other.
    """
    # This works in place, because passes over memory take most of the time.
    short, long = LENGTHS.tolist()
    a = distances(p, q)
    a *= math.sqrt(3.0) / long
    decay, ratio = np.exp(-a), long / short
    other = ratio * a
    other += 1.0
    # numpy takes as long to raise to the power 4 as for an exponential, and much less to square twice.
    other *= np.square(np.square(decay)) if ratio == 4.0 else decay**ratio
    a += 1.0
    a *= decay
    return [other, a]


def derived_kernel(p: Array, places: Array, variances: Array) -> Array:
    """k(p, places) of points (n, 2) and (m, 2), and its derivatives by p: (6, n, m), ordered as PARTIALS."""
    components = zip(variances, LENGTHS, strict=True)
    return sum(v * _derived_matern(p[:, None] - places, length) for v, length in components)


def _derived_matern(apart: Array, length: float) -> Array:
    """M(|apart| / length) for (..., 2), and its derivatives by apart: (6, ...), 1, x, y, xx, xy and yy."""
    x, y = np.moveaxis(apart, -1, 0)
    a, b = math.sqrt(3.0) / length * np.hypot(x, y), 3.0 / length**2
    decay = np.exp(-a)
    # M' / r, and its derivative over r, which is multiplied by x^2, x y or y^2, at 0 by 0.
    first, second = -b * decay, b**2 * decay / np.maximum(a, 1e-300)
    hessian = first + second * x**2, second * x * y, first + second * y**2
    return np.array([(1.0 + a) * decay, first * x, first * y, *hessian])
