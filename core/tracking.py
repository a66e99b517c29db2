# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Contour tracking in a sampling plane (paper, sections III-C and V), on anything that can answer a ray."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike

from .arguments import LARGEST, Array, finite_array, list_of, number, shown, unit_vector

MAX_TURN = math.cos(math.radians(45.0))  # between contacts; a sharper turn is a crease to a finger
MAX_TILT = math.cos(math.radians(75.0))  # against the normal at the point; beyond, slopes exceed 3.7
COARSE = 0.01  # of a curve's size; coordinates rounded by more say nothing about curvature
LEAST_IN_PLANE = 1e-3  # of a surface normal
MOST_CONTACTS = 10_000  # on half a contour
EXTENT, NO_CONTACT, CREASE, NOT_MONGE = "extent", "no contact", "crease", "Monge assumption lost"

Vector = tuple[float, float, float]


class Surface(Protocol):
    """Anything that can be touched."""

    def ray_cast(
        self, origin: Vector, direction: Vector, distance: float
    ) -> tuple[Sequence[float], Sequence[float]] | None:
        """The first point hit within `distance` along the unit `direction`, and the unit normal there."""


class _Contact(NamedTuple):
    """A touch in a sampling plane: where, and the part of the surface normal in the plane; both in space."""

    at: complex
    up: complex
    point: Vector
    normal: Vector


Cast = Callable[[complex, complex, float], _Contact | None]  # start, direction and distance of a ray


@dataclass(frozen=True)
class SamplingPlane:
    """A plane through the reference point, holding the tangent at `azimuth`, leaning by `tilt` (radians)."""

    azimuth: float
    tilt: float = 0.0

    def axes(self, normal: ArrayLike, tangent: ArrayLike | None = None) -> Array:
        """Columns t (the tangent), u (up, in the plane) and t x u (the plane's normal), (3, 3).

        Azimuth 0 is `tangent` projected onto the tangent plane of `normal`; without one world X, or
        world Y where X is within 26 degrees of the normal. Raises ValueError where `tangent` is
        along the normal, or the tilt is not between -90 and 90 degrees.
        """
        n = _vector(unit_vector("normal", normal))
        return np.array(self._axes(n, _tangent(n, tangent))).T

    def _axes(self, n: Vector, e1: Vector) -> tuple[Vector, Vector, Vector]:
        azimuth, tilt = number("azimuth", self.azimuth), number("tilt", self.tilt)
        if abs(tilt) >= math.pi / 2:
            raise ValueError(f"tilt: wanted less than 90 degrees, got {math.degrees(tilt):g}")
        t = _along(_scaled(e1, math.cos(azimuth)), cross(n, e1), math.sin(azimuth))
        u = _along(_scaled(n, math.cos(tilt)), cross(n, t), math.sin(tilt))
        return t, u, cross(t, u)


@dataclass(frozen=True)
class Contour:
    """A tracked contour: the contacts along one curve through the reference point.

    points : (n, 3), in any order, the reference point among them or not
    plane_normal : (3,), of the sampling plane, or None for a curve of unknown plane or of none
    normals : (n, 3), the surface normal at each contact, of any length, outward or inward; or None
    noise : standard deviation of the contacts, or None where it is not known
    stops : why tracking ended at the first and at the last point, or None
    normal_std : standard deviation of normals that were measured, in radians; the fit by "bayes" then takes
        them for slopes. None where they are not to be fitted, as the paper's methods never do.

    Raises ValueError for another shape, for numbers that are not finite, for numbers of single
    precision too far from the origin, and for measured normals without a direction.
    """

    points: Array
    plane_normal: Array | None = None
    normals: Array | None = None
    noise: float | None = None
    stops: tuple[str, str] | None = None
    normal_std: float | None = None

    def __post_init__(self) -> None:
        points = finite_array("points", self.points, (None, 3), LARGEST)
        single = getattr(self.points, "dtype", None) == np.float32
        if single and len(points):
            spacing = float(np.spacing(np.abs(points).max().astype(np.float32)))
            if spacing > COARSE * np.ptp(points, axis=0).max() > 0.0:
                raise ValueError(
                    f"points: numbers of single precision are {spacing:g} apart here, too coarse for a curve "
                    "of this size: wanted coordinates relative to a point near by, or double precision"
                )
        object.__setattr__(self, "points", points)
        if self.plane_normal is not None:
            object.__setattr__(self, "plane_normal", unit_vector("plane_normal", self.plane_normal))
        if self.normals is not None:
            normals = finite_array("normals", self.normals, (len(points), 3))
            object.__setattr__(self, "normals", normals)
        if self.noise is not None:
            object.__setattr__(self, "noise", number("noise", self.noise, least=0.0))
        if self.stops is not None and len(list_of("stops", self.stops, str)) != 2:
            raise ValueError(f"stops: wanted two words, got {shown(self.stops)}")
        if self.normal_std is not None:
            object.__setattr__(self, "normal_std", number("normal_std", self.normal_std, least=0.0))
            if self.normals is None:
                raise ValueError("normal_std: wanted measured normals that it is of, got none")
            if not np.abs(self.normals).max(axis=1, initial=0.0).all():
                raise ValueError("normals: wanted directions where normal_std is given, got (0, 0, 0)")


def track(
    surface: Surface,
    point: ArrayLike,
    normal: ArrayLike,
    planes: Sequence[SamplingPlane],
    *,
    extent: float,
    step: float,
    noise: float = 0.0,
    rng: np.random.Generator | int | None = None,
    tangent: ArrayLike | None = None,
) -> list[Contour]:
    """Slides a finger over `surface` both ways from `point`, once in each plane.

    point, normal : (3,), the reference point and the outward normal; a sheet can be touched from either side
    planes : azimuths measured from `tangent`, see SamplingPlane.axes
    extent, step : lengths along the curve, of each half and between contacts
    noise : standard deviation of the sensor, in the plane along the curve's normal; drawn from `rng`

    One Contour a plane, running from azimuth + 180 degrees to azimuth, the point itself in it, exact.
    Raises ValueError for bad numbers, and where there is no surface at the point.
    """
    p = finite_array("point", point, (3,), LARGEST)
    n = _vector(unit_vector("normal", normal))
    planes = list_of("planes", planes, SamplingPlane)
    step = number("step", step, above=0.0)
    extent = number("extent", extent, above=0.0)
    if extent < step:
        raise ValueError(f"step: wanted no more than the extent {extent:g}, got {step:g}")
    if extent / step > MOST_CONTACTS:
        raise ValueError(f"step: wanted at least a {MOST_CONTACTS}th of the extent {extent:g}, got {step:g}")
    noise = number("noise", noise, least=0.0)
    try:
        generator = np.random.default_rng(rng)
    except (TypeError, ValueError):
        raise ValueError(
            f"rng: wanted a Generator or a whole number of 0 or more, got {shown(rng)}"
        ) from None
    count = math.floor(extent / step * (1.0 + 1e-6))  # both may come out of float32
    e1 = _tangent(n, tangent)
    start, up, side = _first_contact(surface, _vector(p), n, e1, step)
    contours = []
    for plane in planes:
        t, u, across = plane._axes(n, e1)
        cast, up_in_plane = _section(surface, start, t, u, side), complex(_dot(up, t), _dot(up, u))
        # Turned by a quarter, clockwise, the curve's normal is its tangent.
        back, ahead = (_half_contour(cast, up_in_plane, turn, n, count, step) for turn in (1j, -1j))
        points = np.array([*back[0][::-1], tuple(p), *ahead[0]])
        normals = np.array([*back[1][::-1], up, *ahead[1]])
        if noise:
            in_plane = normals - np.outer(normals @ across, across)
            # The point, which stays where it is, may have no normal in the plane.
            in_plane /= np.maximum(np.linalg.norm(in_plane, axis=1, keepdims=True), LEAST_IN_PLANE)
            offsets = generator.normal(0.0, noise, len(points))
            offsets[len(back[0])] = 0.0
            points += offsets[:, None] * in_plane
        contours.append(Contour(points, np.array(across), normals, noise, (back[2], ahead[2])))
    return contours


def _tangent(n: Vector, tangent: ArrayLike | None) -> Vector:
    """The unit vector across the unit n that azimuths are measured from; see SamplingPlane.axes."""
    if tangent is None:
        tangent = (0.0, 1.0, 0.0) if abs(n[0]) > 0.9 else (1.0, 0.0, 0.0)
    given = _vector(unit_vector("tangent", tangent))
    e1 = _along(given, n, -_dot(given, n))
    length = math.hypot(*e1)
    if length < 1e-6:
        raise ValueError("tangent: wanted a direction across the normal, got one along it")
    return _scaled(e1, 1.0 / length)


def _first_contact(
    surface: Surface, p: Vector, n: Vector, e1: Vector, step: float
) -> tuple[Vector, Vector, float]:
    """The contact at the reference point, the normal there on the side of `n`, and that side's sign."""
    reach = 0.1 * step  # shorter than a step: a wall close above the point is not the point's
    e2 = cross(n, e1)
    # On an edge or a vertex of a mesh a ray may slip between the faces: a hair's breadth beside it does not.
    for aside, length in ((e1, 0.0), (e1, 1e-3), (e2, 1e-3), (e1, -1e-3), (e2, -1e-3)):
        hit = surface.ray_cast(
            _along(_along(p, aside, length * step), n, reach), _scaled(n, -1.0), 2.0 * reach
        )
        if hit is not None:
            found, up = map(_vector, _answer(hit))
            side = math.copysign(1.0, _dot(up, n))
            return found, _scaled(up, side), side
    raise ValueError(
        f"point: wanted one on the surface, got one with no surface within {reach:g} along the normal"
    )


def _section(surface: Surface, origin: Vector, t: Vector, u: Vector, side: float) -> Cast:
    """The rays of the sampling plane through `origin` that holds t and u, both unit, as a complex plane.

    In Python floats: a contact costs its ray casts, not a dozen numpy calls.
    """
    (x0, y0, z0), (tx, ty, tz), (ux, uy, uz) = origin, t, u

    def cast(start: complex, direction: complex, distance: float) -> _Contact | None:
        """What the surface answers; direction is unit."""
        a, b, c, d = start.real, start.imag, direction.real, direction.imag
        hit = surface.ray_cast(
            (x0 + a * tx + b * ux, y0 + a * ty + b * uy, z0 + a * tz + b * uz),
            (c * tx + d * ux, c * ty + d * uy, c * tz + d * uz),
            distance,
        )
        if hit is None:
            return None
        (x, y, z), (nx, ny, nz) = _answer(hit)
        nx, ny, nz = side * nx, side * ny, side * nz
        dx, dy, dz = x - x0, y - y0, z - z0
        at = complex(dx * tx + dy * ty + dz * tz, dx * ux + dy * uy + dz * uz)
        up = complex(nx * tx + ny * ty + nz * tz, nx * ux + ny * uy + nz * uz)
        return _Contact(at, up, (x, y, z), (nx, ny, nz))

    return cast


def _answer(hit: tuple[Sequence[float], Sequence[float]]) -> tuple[Vector, Vector]:
    """A surface's point and normal. Raises ValueError where they are none."""
    try:
        (x, y, z), (nx, ny, nz) = hit
        # Of NaN nothing is true.
        if abs(x) + abs(y) + abs(z) <= LARGEST and abs(nx * nx + ny * ny + nz * nz - 1.0) < 1e-2:
            return (x, y, z), (nx, ny, nz)
    except (TypeError, ValueError, OverflowError):
        pass
    raise ValueError(f"surface: wanted a point and its unit normal of ray_cast, got {shown(hit)}")


def _half_contour(
    cast: Cast, up: complex, turn: complex, n: Vector, count: int, step: float
) -> tuple[list[Vector], list[Vector], str]:
    """Contacts, surface normals and the reason of the stop on one side of the reference point, which is 0.

    up : the curve's normal there, `turn` times which is the way ahead
    """
    points: list[Vector] = []
    normals: list[Vector] = []
    at = 0j
    if abs(up) < LEAST_IN_PLANE:
        return points, normals, CREASE
    up /= abs(up)
    for _ in range(count):
        ahead = turn * up
        # A finger bumps into a wall; the ray from above would come down behind it.
        if cast(at + step * up, ahead, step) is not None:
            return points, normals, CREASE
        contact = _next_contact(cast, at, ahead, up, step)
        if contact is None:
            # A flank is found under the point, and behind it where the edge is sharper than 90 degrees.
            flank = cast(at + step * ahead - 0.5 * step * up, -ahead, 2.0 * step)
            return points, normals, NO_CONTACT if flank is None else CREASE
        length = abs(contact.up)
        # Where the surface lies in the plane there is no curve to follow.
        if length < LEAST_IN_PLANE or (contact.up * up.conjugate()).real < MAX_TURN * length:
            return points, normals, CREASE
        if _dot(contact.normal, n) < MAX_TILT:
            return points, normals, NOT_MONGE
        at, up = contact.at, contact.up / length
        points.append(contact.point)
        normals.append(contact.normal)
    return points, normals, EXTENT


def _next_contact(cast: Cast, at: complex, ahead: complex, up: complex, step: float) -> _Contact | None:
    """The contact one `step` from `at`, by a ray from above back along the curve's normal.

    A step along the tangent lands farther than a step along the curve, so where that is more than
    0.1 % the ray is cast once more from where the chord has the right length.
    """
    forward = step
    for _ in range(2):
        contact = cast(at + forward * ahead + step * up, -up, 2.0 * step)
        if contact is None:
            return None
        chord = abs(contact.at - at)
        if not 0.5 * step < chord < 2.0 * step:
            raise ValueError(
                f"surface: wanted hits on the rays, some {step:g} apart, got one {chord:g} from the last"
            )
        if abs(chord - step) <= 1e-3 * step:
            break
        forward *= step / chord
    return contact


def _vector(v: Sequence[float] | Array) -> Vector:
    x, y, z = v
    return float(x), float(y), float(z)


def _dot(a: Vector, b: Vector) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a: Vector | Array, b: Vector | Array) -> Vector:
    """a x b, of vectors or of arrays of which the first axis has three elements; np.cross is slow."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def _scaled(a: Vector, factor: float) -> Vector:
    return factor * a[0], factor * a[1], factor * a[2]


def _along(a: Vector, direction: Vector, length: float) -> Vector:
    return a[0] + length * direction[0], a[1] + length * direction[1], a[2] + length * direction[2]
