# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The mean deviation of the heights of many patches at once, and deviations of Gaussian curvature."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..arguments import Array
from ..bayes.posterior import coefficients_of
from ..bayes.prior import FREE
from ..patch.monge import PARTIALS, TERMS, derived_monomials, monomials
from .result import Reconstruction

# Surfaces have terms beyond a sextic's, which count more and more outward: at a radius from the middle the
# deviation of K is larger by the exponential of this (python -m benchmarks.atlas).
OUTWARD_STD = 1.3


def mean_height_stds(results: Sequence[Reconstruction]) -> list[float]:
    """The mean_height_std of each, computed together, which is several times as fast as one by one."""
    of_sextics = iter(_mean_stds_of_sextics([r for r in results if not r.posterior.amplitude]))
    return [r.radius * next(of_sextics) if not r.posterior.amplitude else r.mean_height_std for r in results]


def with_height_stds(results: Sequence[Reconstruction]) -> list[Reconstruction]:
    """Reconstructions with `known_height_std`, computed for all at once; status and message need it first."""
    # For those with a process the mean has been computed from `node_stds`, which they keep.
    pairs = zip(results, mean_height_stds(results), strict=True)
    return [replace(r, known_height_std=std) if not r.posterior.amplitude else r for r, std in pairs]


def _mean_stds_of_sextics(results: Sequence[Reconstruction]) -> list[float]:
    """The mean deviations, in unit radius, of results without a process."""
    nodes = [r.domain.nodes for r in results]
    most = max((len(weights) for _, weights in nodes), default=0)
    points, weights = np.zeros((len(results), most, 2)), np.zeros((len(results), most))
    for i, (r, (at, weight)) in enumerate(zip(results, nodes, strict=True)):
        points[i, : len(at)], weights[i, : len(at)] = at / r.radius, weight
    # A patch by another method departs from the posterior's mean, too.
    off = np.array([
        np.zeros(len(TERMS))
        if r.method == "bayes"
        else r.posterior.mean - coefficients_of(r.patch.scaled(1.0 / r.radius))
        for r in results
    ]).reshape(-1, len(TERMS), 1)  # fmt: skip
    root = np.array([r.posterior.root for r in results]).reshape(-1, *2 * [len(TERMS) + 1])
    basis = monomials(points, TERMS)
    left = basis @ root[..., :-1].swapaxes(1, 2) + root[:, None, :, -1]
    variance = np.einsum("bni,bni->bn", left, left) + (basis @ off)[..., 0] ** 2
    means: Array = np.einsum("bn,bn->b", weights, np.sqrt(variance))
    return means.tolist()


def gaussian_curvature_stds(r: Reconstruction, x: Array, y: Array) -> Array:
    """Standard deviations (m,) of K of a patch's polynomial at local x and y, (m,) each, in 1/length^2.

    They follow from the gradient of K in the coefficients and, since that does not suffice at a rim, from
    the second-order variance of z_xx z_yy - z_xy^2 for normally distributed second derivatives. Few bends
    widen them as they do those of curvatures at the point.
    """
    by = derived_monomials(np.stack([x, y], axis=-1) / r.radius, TERMS, PARTIALS[1:])
    derivatives, covariance = by @ r.posterior.polynomial, r.posterior.covariance.copy()
    covariance[2:FREE, 2:FREE] = r.curvature_covariance
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
