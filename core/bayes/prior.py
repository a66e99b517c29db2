# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The prior of the polynomial's coefficients, in unit radius.

Slopes and second derivatives are free. The coefficient b_ij of a higher degree is a length^(1 - i - j): where
the curvature changes over a length l it has the size l^(1 - i - j), so its prior is

    b_ij ~ N(m_ij, (waviness^(i + j - 1) / 10)^2)    with waviness = L / l.

m are the quartic and sextic of a surface that keeps the curvatures it has at the point.
"""

import numpy as np

from ..arguments import Array
from ..patch.monge import TERMS

FREE = 5  # The terms x, y, x^2, xy and y^2 come first.
FREE_VARIANCE = 1e4  # Their prior variance is nearly infinite: it keeps matrices invertible.
ORDERS = TERMS.sum(axis=1).astype(float)
PRIOR_SCALE = 0.1  # Chosen with benchmarks.accuracy, as are the waviness's median and grid.
USUAL_WAVINESS = 0.6


def prior_variances(waviness: Array) -> Array:
    """Prior variances of the coefficients, (..., 27), for waviness (...)."""
    higher = (PRIOR_SCALE * waviness[..., None] ** (ORDERS - 1.0)) ** 2
    return np.where(ORDERS < 3.0, FREE_VARIANCE, higher)


USUAL_VARIANCES = prior_variances(np.array(USUAL_WAVINESS))


def prior_mean(k1: Array, k2: Array) -> Array:
    """The prior's mean, (b, 27): the quartic and sextic of a surface that keeps its curvatures (b,).

    With Q = (k1 x^2 + k2 y^2) / 2 and G = |grad Q|^2 they are Q G / 4 and Q G^2 / 8, as on a sphere and a
    cylinder. The coefficient of x^2 y^2 is k1 k2^2 / 4 on a torus whose parallels have the curvature k2 at
    the point, and k1^2 k2 / 4 if they have k1: the prior takes the mean of both.
    """
    return np.array([_mean_of_one(*pair) for pair in zip(k1.tolist(), k2.tolist(), strict=True)])


def remainder(x: Array, y: Array, k1: float, k2: float) -> Array:
    """The heights (n,) of a surface that keeps its curvatures, in unit radius, less those of its sextic.

    They are 2 Q / (1 + sqrt(1 - G)), exact on a sphere and a cylinder, with Q and G as in `prior_mean`.
    """
    k1, k2 = _within_radius(k1), _within_radius(k2)
    q, g = 0.5 * (k1 * x**2 + k2 * y**2), np.minimum((k1 * x) ** 2 + (k2 * y) ** 2, 1.0)
    beyond: Array = 2.0 * q / (1.0 + np.sqrt(1.0 - g)) - q * (1.0 + g / 4.0 + g**2 / 8.0)
    return beyond


def _within_radius(curvature: float) -> float:
    """A curvature in unit radius as the prior takes it: no surface keeps a radius of curvature below L."""
    return min(max(curvature, -1.0), 1.0)


def _mean_of_one(k1: float, k2: float) -> list[float]:
    """The prior's mean of one surface, in Python floats."""
    k1, k2 = _within_radius(k1), _within_radius(k2)
    a, b = k1**2, k2**2
    mean = [0.0] * len(TERMS)
    mean[9:14:2] = k1 * a / 8.0, (k1 * b + k2 * a) / 8.0, k2 * b / 8.0
    mean[20:27:2] = (
        k1 * a**2 / 16.0,
        (2.0 * k1 * a * b + k2 * a**2) / 16.0,
        (k1 * b**2 + 2.0 * k2 * a * b) / 16.0,
        k2 * b**2 / 16.0,
    )
    return mean
