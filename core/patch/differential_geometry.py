# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The differential geometry of a surface z(x, y): normal, fundamental forms, curvatures."""

from dataclasses import dataclass

import numpy as np

from ..arguments import Array


@dataclass(frozen=True, eq=False)
class Derivatives:
    """The height and partial derivatives of a surface z(x, y), all of one shape (...), and its curvatures."""

    z: Array
    x: Array
    y: Array
    xx: Array
    xy: Array
    yy: Array

    @property
    def normal(self) -> Array:
        """The unit normal on the side of +z, (..., 3)."""
        n = np.stack([-self.x, -self.y, np.ones_like(self.x)], axis=-1)
        return n / np.linalg.norm(n, axis=-1, keepdims=True)

    @property
    def gaussian_curvature(self) -> Array:
        """K = (LN - M^2) / (EG - F^2), in 1/length^2."""
        return (self.xx * self.yy - self.xy**2) / (1.0 + self.x**2 + self.y**2) ** 2

    @property
    def mean_curvature(self) -> Array:
        """H = (EN - 2FM + GL) / 2(EG - F^2), in 1/length."""
        e, f, g = 1.0 + self.x**2, self.x * self.y, 1.0 + self.y**2
        # EG - F^2 equals E + G - 1, which does not cancel on steep surfaces; L, M, N are z_xx, z_xy, z_yy
        # over its square root.
        return (e * self.yy - 2.0 * f * self.xy + g * self.xx) / (2.0 * (e + g - 1.0) ** 1.5)

    @property
    def principal_curvatures(self) -> tuple[Array, Array]:
        """kappa1 <= kappa2, in 1/length."""
        mean = self.mean_curvature
        # H^2 - K is (kappa1 - kappa2)^2 / 4, which rounding may take below 0 at umbilics.
        half = np.sqrt(np.maximum(mean**2 - self.gaussian_curvature, 0.0))
        return mean - half, mean + half

    @property
    def shape_index(self) -> Array:
        """-2 / pi atan((kappa1 + kappa2) / (kappa2 - kappa1)): 1 on a convex cap, 0 on a saddle, -1 in a cup.

        A planar point has none (Koenderink and van Doorn, 1992), and gets 0, the middle of the range.
        """
        k1, k2 = self.principal_curvatures
        return np.arctan2(k1 + k2, k2 - k1) * (-2.0 / np.pi)

    @property
    def curvedness(self) -> Array:
        """sqrt((kappa1^2 + kappa2^2) / 2), in 1/length."""
        k1, k2 = self.principal_curvatures
        return np.sqrt(0.5 * (k1**2 + k2**2))
