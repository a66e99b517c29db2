# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Sampling planes and the contours in them (paper, section II), and vectors as Python floats."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..arguments import (
    LARGEST,
    Array,
    finite_array,
    list_of,
    number,
    number_or_none,
    set_fields,
    shown,
    unit_vector,
    unit_vectors,
)

# Coordinates that are rounded by more than this share of a curve's size do not show curvature.
CURVE_ROUNDING = 0.01
EXTENT, NO_CONTACT, CREASE, NOT_MONGE = "extent", "no contact", "crease", "Monge assumption lost"
UNEXPLAINED = "fit no longer matched"
WHERE = {  # The stops in words.
    EXTENT: "at the greatest extent allowed",
    NO_CONTACT: "at an edge",
    CREASE: "at a crease",
    NOT_MONGE: "where the surface turns away",
    UNEXPLAINED: "where the patch could no longer be trusted",
}
SURFACE_ENDS = (NO_CONTACT, CREASE)  # The surface ends at these stops,
SURFACE_STOPS = (*SURFACE_ENDS, NOT_MONGE)  # and itself ends a curve at these.

Vector = tuple[float, float, float]


@dataclass(frozen=True)
class SamplingPlane:
    """A plane through the reference point (paper, II): it holds the tangent at `azimuth`, leaning by `tilt`.

    Both angles are in radians. Other planes are equal if both are.

    direction : the tangent in the world, which does not depend on where azimuths begin; None if not given
    """

    azimuth: float
    tilt: float = 0.0
    direction: Vector | None = field(default=None, compare=False)

    def axes(self, normal: ArrayLike, tangent: ArrayLike | None = None) -> Array:
        """Columns t (the tangent), u (up, in the plane) and t x u (the plane's normal), (3, 3).

        Azimuth 0 is `tangent`, (3,), projected onto the tangent plane of `normal`, (3,). Without a tangent it
        is world X, or world Y if X is within 26 degrees of the normal. Raises ValueError if `tangent` is
        along the normal, or the tilt is not between -90 and 90 degrees.
        """
        n = vector_of(unit_vector("normal", normal))
        return np.array(self.axes_of_unit_vectors(n, tangent_of(n, tangent))).T

    def axes_of_unit_vectors(self, n: Vector, e1: Vector) -> tuple[Vector, Vector, Vector]:
        """`axes` for the unit normal n and the unit tangent e1 at azimuth 0, in Python floats."""
        azimuth, tilt = number("azimuth", self.azimuth), number("tilt", self.tilt)
        if abs(tilt) >= math.pi / 2:
            raise ValueError(f"tilt: expected less than 90 degrees, got {math.degrees(tilt):g}")
        t = along(scaled(e1, math.cos(azimuth)), cross(n, e1), math.sin(azimuth))
        u = along(scaled(n, math.cos(tilt)), cross(n, t), math.sin(tilt))
        return t, u, cross(t, u)


@dataclass(frozen=True, eq=False)
class Contour:
    """A tracked contour: the contacts along one curve through the reference point.

    points : (n, 3), in any order, with or without the reference point
    plane_normal : (3,), normal of the sampling plane, or None without one or if it is unknown
    normals : (n, 3), the surface normal at each contact, of any length, outward or inward; or None
    noise : standard deviation of the contacts, or None if it is unknown
    stops : why tracking ended at the first and at the last point, or None
    normal_std : standard deviation of measured normals, in radians, with which "bayes" fits them as slopes;
      None leaves them out. The paper's methods never use them
    ball : radius of a ball whose centers the points are; None if they are contacts

    Repeated contacts, as of a sensor at rest, are kept once, with the mean of their normals, because they add
    no information.

    Raises ValueError for another shape, for numbers that are not finite, for numbers of single
    precision too far from the origin, and for measured normals without a direction.
    """

    points: Array
    plane_normal: Array | None = None
    normals: Array | None = None
    noise: float | None = None
    stops: tuple[str, str] | None = None
    normal_std: float | None = None
    ball: float | None = None

    def __post_init__(self) -> None:
        points = finite_array("points", self.points, (None, 3), LARGEST)
        if getattr(self.points, "dtype", None) == np.float32 and len(points):
            spacing = float(np.spacing(np.abs(points).max().astype(np.float32)))
            if spacing > CURVE_ROUNDING * np.ptp(points, axis=0).max() > 0.0:
                raise ValueError(
                    f"points: numbers of single precision are {spacing:g} apart here, too coarse for a curve "
                    "of this size: expected coordinates relative to a nearby point, or double precision"
                )
        up, normals = self.plane_normal, self.normals
        set_fields(
            self,
            points=points,
            plane_normal=None if up is None else unit_vector("plane_normal", up),
            normals=None if normals is None else finite_array("normals", normals, (len(points), 3)),
            noise=number_or_none("noise", self.noise, least=0.0),
            stops=None if self.stops is None else tuple(list_of("stops", self.stops, str)),
            normal_std=number_or_none("normal_std", self.normal_std, least=0.0),
            ball=number_or_none("ball", self.ball, above=0.0),
        )
        if self.stops is not None and len(self.stops) != 2:
            raise ValueError(f"stops: expected two words, got {shown(self.stops)}")
        if self.normal_std is not None:
            if self.normals is None:
                raise ValueError("normal_std: expected the measured normals that it belongs to, got none")
            if not np.abs(self.normals).max(axis=1, initial=0.0).all():
                raise ValueError("normals: expected directions where normal_std is given, got (0, 0, 0)")
        self._keep_distinct()

    def _keep_distinct(self) -> None:
        """Keeps the first of each group of equal contacts, with the mean of their normals."""
        order, starts = equal_points(self.points)
        if len(starts) == len(order):
            return
        firsts = np.argsort(order[starts])
        set_fields(self, points=self.points[order[starts]][firsts])
        if self.normals is not None:
            sums = np.add.reduceat(consistently_oriented(self.normals, order, starts)[order], starts, axis=0)
            set_fields(self, normals=sums[firsts])

    @property
    def size(self) -> float:
        """The diagonal of the box around its points, a length."""
        return float(np.linalg.norm(np.ptp(self.points, axis=0)))

    def distance_to(self, point: Array) -> float:
        """The distance of its nearest contact from a point (3,), or infinity if it has no contacts."""
        return float(np.linalg.norm(self.points - point, axis=1).min(initial=np.inf))

    def part(self, which: slice | NDArray[Any], stops: tuple[str, str] | None) -> "Contour":
        """The contour of some of its contacts, or of all in another order."""
        normals = None if self.normals is None else self.normals[which]
        return self.with_valid(points=self.points[which], normals=normals, stops=stops)

    def copied(self) -> "Contour":
        """A copy whose arrays cannot be written to."""
        arrays = {key: read_only(value) for key, value in vars(self).items() if isinstance(value, np.ndarray)}
        return self.with_valid(**arrays)

    def with_valid(self, **values: Any) -> "Contour":
        """The contour with other values, which are valid, so that none is checked again."""
        contour = object.__new__(Contour)
        set_fields(contour, **vars(self) | values)
        return contour

    def moved(self, scale: float, rotation: Array, start: Array, end: Array) -> "Contour":
        """The contour moved by p -> end + scale R (p - start), where R is a rotation (3, 3).

        If `start` is one of its points, `end` is exactly one of the new points, in spite of rounding.
        """
        return replace(
            self,
            points=end + scale * (self.points - start) @ rotation.T,
            plane_normal=None if self.plane_normal is None else rotation @ self.plane_normal,
            normals=None if self.normals is None else self.normals @ rotation.T,
            noise=None if self.noise is None else scale * self.noise,
            ball=None if self.ball is None else scale * self.ball,
        )


def contours_of(name: str, given: Sequence[ArrayLike | Contour]) -> list[Contour]:
    """The Contours of a list of Contours and arrays (n, 3). Raises ValueError with its `name`."""
    contours = []
    for i, curve in enumerate(list_of(name, given, object)):  # type: ignore[arg-type]
        try:
            contours.append(curve if isinstance(curve, Contour) else Contour(curve))  # type: ignore[arg-type]
        except ValueError as error:
            raise ValueError(f"{name}[{i}]: {str(error).removeprefix('points: ')}") from None
    return contours


def outward_of(outward: ArrayLike | None, felt: Iterable[object]) -> Array:
    """The unit vector (3,) to the outer side: as given, or that of the mean normal of Contours among `felt`.

    Raises ValueError if it is None and no normal was measured.
    """
    if outward is not None:
        return unit_vector("outward", outward)
    normals = [curve.normals for curve in felt if isinstance(curve, Contour) and curve.normals is not None]
    directions = np.vstack([np.empty((0, 3)), *normals])
    mean = unit_vectors("normals", directions[directions.any(axis=1)]).sum(axis=0)
    if not mean.any():
        raise ValueError("outward: expected a direction, because no contact has a normal, got None")
    return unit_vector("outward", mean)


def read_only(array: Array) -> Array:
    """A copy of an array that cannot be written to."""
    copy = array.copy()
    copy.setflags(write=False)
    return copy


def equal_points(points: Array) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """An order (n,) in which equal points of (n, 3) follow each other, and the start of each group in it.

    In its group the first point comes first.
    """
    order = np.lexsort(points.T)
    changes = np.any([np.diff(column[order]) != 0.0 for column in points.T], axis=0)
    return order, np.flatnonzero(np.append(True, changes)[: len(order)])


def unit_normals(normals: Array) -> Array:
    """Normals (n, 3) of any length, scaled to length 1; (0, 0, 0) stays."""
    unit = normals / np.maximum(np.abs(normals).max(axis=1), 1e-300)[:, None]
    lengths = np.sqrt(np.einsum("ni,ni->n", unit, unit))
    return np.asarray(unit / np.maximum(lengths, 1e-300)[:, None])


def consistently_oriented(normals: Array, order: NDArray[np.intp], starts: NDArray[np.intp]) -> Array:
    """Unit normals (n, 3), each flipped to the side of the first in its group; (0, 0, 0) stays.

    order, starts : groups of contacts, as `equal_points` returns them
    """
    unit = unit_normals(normals)
    group = np.empty(len(order), dtype=np.intp)
    group[order] = np.searchsorted(starts, np.arange(len(order)), side="right") - 1
    side = np.einsum("ni,ni->n", unit, unit[order[starts]][group])
    return np.where(side[:, None] < 0.0, -unit, unit)


def stops_at(contours: Iterable[Contour], point: Sequence[float] | Array, reach: float = 0.0) -> list[str]:
    """Why half curves end within the length `reach` of a point (3,) already: it is at a crease or an edge."""
    return [
        stop
        for contour in contours
        for end, stop in zip((0, -1), contour.stops or (), strict=False)
        if stop in SURFACE_STOPS and math.dist(contour.points[end], point) <= reach
    ]


def tangent_of(n: Vector, tangent: ArrayLike | None) -> Vector:
    """The unit vector across the unit normal n from which azimuths are measured; see SamplingPlane.axes."""
    given = (0.0, 1.0, 0.0) if abs(n[0]) > 0.9 else (1.0, 0.0, 0.0)
    if tangent is not None:
        given = vector_of(unit_vector("tangent", tangent))
    e1 = along(given, n, -dot(given, n))
    length = math.hypot(*e1)
    if length < 1e-6:
        raise ValueError("tangent: expected a direction across the normal, got one along it")
    return scaled(e1, 1.0 / length)


def vector_of(v: Sequence[float] | Array) -> Vector:
    """The vector in Python floats, because in inner loops a numpy call takes longer than its work."""
    x, y, z = v
    return float(x), float(y), float(z)


def dot(a: Vector, b: Vector) -> float:
    """The dot product of two vectors."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a: Vector | Array, b: Vector | Array) -> Vector:
    """The cross product of vectors, or of arrays whose first axis has three elements; np.cross is slow."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def scaled(a: Vector, factor: float) -> Vector:
    """A vector times a factor."""
    return factor * a[0], factor * a[1], factor * a[2]


def along(a: Vector, direction: Vector, length: float) -> Vector:
    """The point that is `length` times `direction` away from a."""
    return a[0] + length * direction[0], a[1] + length * direction[1], a[2] + length * direction[2]
