# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The geometry of a patch: a surface over a part of the tangent plane, and its place in the world."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..arguments import Array, finite_array
from ..contours.local_geometry import Frame
from .differential_geometry import Derivatives
from .domain import GRID, Domain
from .monge import HeightField, MongePatch
from .residual import Residual
from .triangulation import patch_mesh

EVEN = 1e-4  # A similarity in single precision may be off by so much.

NEAR_POINT = 0.6  # This share of a residual's deviation is left at the point (benchmarks.real).


@dataclass(frozen=True, eq=False)
class Geometry(HeightField):
    """The surface of a patch in its frame, with lengths in the caller's unit.

    frame : the Darboux frame at the reference point
    radius : L, the largest distance of a contact from the point in the tangent plane
    polynomial : equation (1)
    domain : the part of the tangent plane over which the surface is valid
    residual : difference of the surface from the polynomial, in unit radius, or None
    """

    frame: Frame
    radius: float
    polynomial: MongePatch
    domain: Domain
    residual: Residual | None = None

    def derivatives(self, x: ArrayLike, y: ArrayLike) -> Derivatives:
        """Height, slopes and second derivatives at local (x, y)."""
        d = self.polynomial.derivatives(x, y)
        if self.residual is None:
            return d
        shape, (u, v) = d.z.shape, self.in_unit_radius(x, y)
        orders = {"z": 1.0, "x": 0.0, "y": 0.0, "xx": -1.0, "xy": -1.0, "yy": -1.0}  # Powers of length.
        beside = self.residual.derivatives(u, v)
        return Derivatives(**{
            name: getattr(d, name) + self.radius**order * getattr(beside, name).reshape(shape)
            for name, order in orders.items()
        })  # fmt: skip

    def height(self, x: ArrayLike, y: ArrayLike) -> Array:
        """The height z at local (x, y)."""
        if self.residual is None:
            return self.polynomial.height(x, y)
        z = self._whole.height(*self.in_unit_radius(x, y))
        return self.radius * z.reshape(np.broadcast_shapes(np.shape(x), np.shape(y)))

    @cached_property
    def _whole(self) -> Residual:
        """The residual with the polynomial among its terms, in unit radius."""
        assert self.residual is not None
        mean, first = self.residual.mean.copy(), self.polynomial.scaled(1.0 / self.radius)
        mean[2:5:2] += 0.5 * first.k1, 0.5 * first.k2
        mean[5 : 5 + len(first.coefficients)] += first.coefficients
        return replace(self.residual, mean=mean)

    def in_unit_radius(self, x: ArrayLike, y: ArrayLike) -> tuple[Array, Array]:
        """Local x and y, raveled to (n,) each, in units of L."""
        x_array, y_array = np.broadcast_arrays(np.asarray(x, dtype=float), np.asarray(y, dtype=float))
        return x_array.ravel() / self.radius, y_array.ravel() / self.radius

    def widening(self, x: ArrayLike, y: ArrayLike) -> Array:
        """The factor (n,) of the residual's deviations at local (x, y).

        Near the point, where curves meet, real surfaces are smoother than their covariance says, and near the
        rim they are rougher. The mean over the domain is 1.
        """
        points = np.column_stack([np.ravel(v) for v in np.broadcast_arrays(x, y)])
        if self.residual is None:
            return np.ones(len(points))
        return _widened(np.linalg.norm(self.domain.places(points), axis=1))

    @property
    def node_widening(self) -> Array:
        """The `widening` at the nodes of the domain, (n,)."""
        outward = self.domain.node_places
        return np.ones(len(outward)) if self.residual is None else _widened(outward)

    def contains(self, x: ArrayLike, y: ArrayLike) -> NDArray[np.bool_]:
        """Whether each local (x, y) lies in the domain or on its boundary; in the shape of x and y."""
        return self.domain.contains(x, y)

    def mesh(self, tolerance: float) -> tuple[Array, NDArray[np.intp]]:
        """The patch as points (n, 3), in the frame, and counterclockwise triangles (m, 3).

        It is off the surface by no more than the tolerance.
        """
        return patch_mesh(self, self.domain, tolerance)

    def moved(self, matrix: ArrayLike) -> "Geometry":
        """This geometry after a similarity (4, 4) of the world; raises what `similarity` raises."""
        scale, turn, shift = similarity(matrix)
        return Geometry(
            Frame(scale * turn @ self.frame.origin + shift, turn @ self.frame.axes),
            scale * self.radius,
            self.polynomial.scaled(scale),
            self.domain.scaled(scale),
            self.residual,
        )


def _widened(outward: Array) -> Array:
    """The factors of the deviation for places at these shares of the domain's radius."""
    return NEAR_POINT + 1.5 * (1.0 - NEAR_POINT) * outward


def similarity(matrix: ArrayLike) -> tuple[float, Array, Array]:
    """The scale, rotation R (3, 3) and shift (3,) of a matrix (4, 4) that takes p to scale R p + shift.

    Raises ValueError if it stretches, shears or mirrors, or scales by 0.
    """
    m = finite_array("matrix", matrix, (4, 4))
    scale = float(np.cbrt(np.linalg.det(m[:3, :3])))
    u, stretches, v = np.linalg.svd(m[:3, :3])
    even = scale > 0.0 and np.abs(stretches / scale - 1.0).max() <= EVEN
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
    return np.linalg.norm(surface.closest_point(local) - local, axis=1)


def total_absolute_curvature(surface: HeightField, domain: Domain) -> float:
    """The integral of |K| over the patch (8)."""
    points, h = domain.grid(GRID)
    d = surface.derivatives(*points.T)
    w = 1.0 + d.x**2 + d.y**2
    return h**2 * float(np.sum(np.abs(d.xx * d.yy - d.xy**2) * w**-1.5))


def overlapped(geometry: Geometry, vertices: ArrayLike, normals: ArrayLike) -> NDArray[np.intp]:
    """The indices (m,) of those world vertices (n, 3) that lie over the domain; normals are (n, 3).

    A closed object has another side over the same domain. So a vertex counts only if its normal points to the
    side of the patch's normal, and it is within the radius of the tangent plane. `reachable` tells whether
    another layer of the object hides it from a finger.
    """
    local, radius = geometry.frame.to_local(vertices), geometry.radius
    near = np.flatnonzero((np.abs(local) <= 2.0 * radius).all(axis=1) & (np.abs(local[:, 2]) <= radius))
    facing = near[np.asarray(normals, dtype=float)[near] @ geometry.frame.axes[:, 2] > 0.0]
    return facing[geometry.contains(local[facing, 0], local[facing, 1])]
