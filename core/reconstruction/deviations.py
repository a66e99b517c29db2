# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Deviations of Gaussian curvature over a patch."""

import numpy as np

from ..arguments import Array
from ..bayes.prior import FREE
from ..lapack import solved
from ..patch.monge import PARTIALS, TERMS, derived_monomials
from .result import Reconstruction

# Surfaces have terms beyond a sextic's, which count more and more outward: at a radius from the middle the
# deviation of K is larger by the exponential of this (python -m benchmarks.atlas).
OUTWARD_STD = 1.3


def gaussian_curvature_stds(r: Reconstruction, x: Array, y: Array) -> Array:
    """Standard deviations (m,) of K of a patch's polynomial at local x and y, (m,) each, in 1/length^2.

    They follow from the gradient of K in the coefficients and, since that does not suffice at a rim, from
    the second-order variance of z_xx z_yy - z_xy^2 for normally distributed second derivatives. Coefficients
    of x^2, xy and y^2 are as certain as those of the curvatures at the point.
    """
    by = derived_monomials(np.stack([x, y], axis=-1) / r.radius, TERMS, PARTIALS[1:])
    derivatives, fitted, widening = by @ r.posterior.polynomial, r.posterior.covariance, np.eye(len(TERMS))
    factor, wanted = np.linalg.cholesky([fitted[2:FREE, 2:FREE], r.curvature_covariance])
    widening[2:FREE, 2:FREE] = solved(factor, wanted.T, transposed=True).T
    covariance = widening @ fitted @ widening.T
    zx, zy, zxx, zxy, zyy = derivatives[:, :, None]
    steep = 1.0 + zx**2 + zy**2
    k = (zxx * zyy - zxy**2) / steep**2
    gradient = (zyy * by[2] + zxx * by[4] - 2.0 * zxy * by[3]) / steep**2
    gradient -= 4.0 * k / steep * (zx * by[0] + zy * by[1])
    first = np.einsum("mi,mi->m", gradient @ covariance, gradient)
    c = np.einsum("ami,bmi->abm", by[2:] @ covariance, by[2:])
    second = c[0, 0] * c[2, 2] + c[0, 2] ** 2 + 2.0 * c[1, 1] ** 2 - 4.0 * c[0, 1] * c[1, 2]
    variance = first + second / steep[:, 0] ** 4
    wider: Array = np.exp(OUTWARD_STD * (x**2 + y**2) / r.radius**2)
    return wider * np.sqrt(np.maximum(variance, 0.0)) / r.radius**2
