# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The geometry of a patch: a surface over a part of the tangent plane, and its place in the world."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..arguments import Array, finite_array
from ..contours.local_geometry import Frame
from .differential_geometry import Derivatives
from .domain import GRID, Domain
from .monge import HeightField

SIMILARITY_TOLERANCE = 1e-4  # A similarity in single precision may be off by this.
POINTS_AT_ONCE = 20_000  # Distances of this number of points take 50 MB, those of millions gigabytes.


@dataclass(frozen=True, eq=False)
class Geometry(HeightField):
    """The surface of a patch in its frame, with lengths in the caller's unit.

    frame : the Darboux frame at the reference point
    radius : L, the largest distance of a contact from the point in the tangent plane
    surface : the heights, in unit radius
    domain : the part of the tangent plane over which the surface is valid
    """

    frame: Frame
    radius: float
    surface: HeightField
    domain: Domain

    def derivatives(self, x: ArrayLike, y: ArrayLike) -> Derivatives:
        """Height, slopes and second derivatives at local (x, y)."""
        d = self.surface.derivatives(np.divide(x, self.radius), np.divide(y, self.radius))
        return Derivatives(
            self.radius * d.z, d.x, d.y, d.xx / self.radius, d.xy / self.radius, d.yy / self.radius
        )

    def height(self, x: ArrayLike, y: ArrayLike) -> Array:
        """The height z at local (x, y)."""
        return self.radius * self.surface.height(np.divide(x, self.radius), np.divide(y, self.radius))

    def moved(self, matrix: ArrayLike) -> "Geometry":
        """This geometry after a similarity (4, 4) of the world; raises what `similarity` raises."""
        scale, turn, shift = similarity(matrix)
        return Geometry(
            Frame(scale * turn @ self.frame.origin + shift, turn @ self.frame.axes),
            scale * self.radius,
            self.surface,
            self.domain.scaled(scale),
        )


def similarity(matrix: ArrayLike) -> tuple[float, Array, Array]:
    """The scale, rotation R (3, 3) and shift (3,) of a matrix (4, 4) that takes p to scale R p + shift.

    Raises ValueError if it stretches, shears or mirrors, or scales by 0.
    """
    m = finite_array("matrix", matrix, (4, 4))
    scale = float(np.cbrt(np.linalg.det(m[:3, :3])))
    u, stretches, v = np.linalg.svd(m[:3, :3])
    even = scale > 0.0 and np.abs(stretches / scale - 1.0).max() <= SIMILARITY_TOLERANCE
    if not even or np.abs(m[3] - (0.0, 0.0, 0.0, 1.0)).max() > 0.0:
        raise ValueError("matrix: expected a rotation, one scale above 0 and a shift, got another matrix")
    return scale, u @ v, m[:3, 3]


def fit_error(surface: HeightField, points: ArrayLike) -> float:
    """Equation (6): the mean of |z(x_k, y_k) - z_k| over local points (n, 3), in their length."""
    x, y, z = np.asarray(points, dtype=float).T
    return float(np.mean(np.abs(surface.height(x, y) - z)))


def distances(surface: HeightField, points: ArrayLike) -> Array:
    """Euclidean distances (n,) of local points (n, 3) to the surface."""
    local = finite_array("points", points, (None, 3))
    parts = [local[i : i + POINTS_AT_ONCE] for i in range(0, len(local), POINTS_AT_ONCE)]
    off = [np.linalg.norm(surface.closest_point(part) - part, axis=1) for part in parts]
    return np.concatenate([np.empty(0), *off])


def total_absolute_curvature(surface: HeightField, domain: Domain) -> float:
    """The integral of |K| over the patch (8)."""
    points, h = domain.grid(GRID)
    d = surface.derivatives(*points.T)
    return h**2 * float(np.sum(np.abs(d.gaussian_curvature) * np.sqrt(1.0 + d.x**2 + d.y**2)))


def overlapped(geometry: Geometry, vertices: ArrayLike) -> NDArray[np.intp]:
    """The indices (m,) of those world vertices (n, 3) that lie over the domain.

    A closed object has another side over the same domain. So a vertex counts only if it is within the radius
    of the tangent plane. `reachable` has whether a finger on the patch could meet it.
    """
    local, radius = geometry.frame.to_local(vertices), geometry.radius
    near = np.flatnonzero((np.abs(local) <= 2.0 * radius).all(axis=1) & (np.abs(local[:, 2]) <= radius))
    return near[geometry.domain.contains(local[near, 0], local[near, 1])]
