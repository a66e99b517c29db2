# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Contour tracking in a sampling plane (paper, sections III-C and V), on anything that can answer a ray."""

import math
from collections.abc import Callable, Sequence
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike

from ..arguments import (
    LARGEST,
    Array,
    finite_array,
    list_of,
    number,
    shown,
    unit_vector,
)
from .contour import (
    CREASE,
    EXTENT,
    NO_CONTACT,
    NOT_MONGE,
    Contour,
    SamplingPlane,
    Vector,
    cross,
    dot,
    scaled,
    tangent_of,
    vector_of,
)

# What a crease is, and what is too steep: benchmarks.refusals counts what they refuse.
MAX_TURN = math.cos(math.radians(45.0))  # between contacts; a sharper turn is a crease to a finger
MAX_TILT = math.cos(math.radians(75.0))  # against the normal at the point; beyond, slopes exceed 3.7
LEAST_IN_PLANE = 1e-3  # Least share of a surface normal in the sampling plane.
MOST_CONTACTS = 10_000  # on half a contour


class Surface(Protocol):
    """Anything that can be touched."""

    def ray_cast(
        self, origin: Vector, direction: Vector, distance: float
    ) -> tuple[Sequence[float], Sequence[float]] | None:
        """The first point hit within `distance` along the unit `direction`, and the unit normal there."""


# A touch in a sampling plane: where, and the part of the surface normal in the plane; both in space.
_Contact = tuple[complex, complex, Vector, Vector]
_Cast = Callable[[complex, complex, float], _Contact | None]  # start, direction and distance of a ray


def track(
    surface: Surface,
    point: ArrayLike,
    outward: ArrayLike,
    planes: Sequence[SamplingPlane],
    *,
    extent: float,
    step: float,
    noise: float = 0.0,
    rng: np.random.Generator | int | None = None,
    tangent: ArrayLike | None = None,
) -> list[Contour]:
    """Slides a finger over `surface` both ways from `point`, once in each plane.

    point, outward : (3,), the reference point and the outward normal; a sheet can be touched from either side
    planes : azimuths measured from `tangent`, see SamplingPlane.axes
    extent, step : lengths along the curve, of each half and between contacts
    noise : standard deviation of the sensor, in the plane along the curve's normal; drawn from `rng`

    One Contour a plane, running from azimuth + 180 degrees to azimuth, the point itself in it, exact.
    Raises ValueError for bad numbers, and where there is no surface at the point.
    """
    p = finite_array("point", point, (3,), LARGEST)
    n = vector_of(unit_vector("outward", outward))
    planes = list_of("planes", planes, SamplingPlane)
    step = number("step", step, above=0.0)
    extent = number("extent", extent, above=0.0)
    if extent < step:
        raise ValueError(f"step: expected no more than the extent {extent:g}, got {step:g}")
    if extent / step > MOST_CONTACTS:
        raise ValueError(
            f"step: expected at least a {MOST_CONTACTS}th of the extent {extent:g}, got {step:g}"
        )
    noise, generator = number("noise", noise, least=0.0), generator_of(rng)
    count = math.floor(extent / step * (1.0 + 1e-6))  # both may come out of float32
    e1 = tangent_of(n, tangent)
    start, up, side = _first_contact(surface, vector_of(p), n, e1, step)
    contours = []
    for plane in planes:
        t, u, across = plane.floats(n, e1)
        cast, up_in_plane = _section(surface, start, t, u, side), complex(dot(up, t), dot(up, u))
        # Turned by a quarter, clockwise, the curve's normal is its tangent.
        back, ahead = (_half_contour(cast, up_in_plane, turn, n, count, step) for turn in (1j, -1j))
        points = np.array([*back[0][::-1], tuple(p), *ahead[0]])
        normals = np.array([*back[1][::-1], up, *ahead[1]])
        if noise:
            offsets = generator.normal(0.0, noise, len(points))
            offsets[len(back[0])] = 0.0  # the point stays where it is
            points += offsets[:, None] * _in_plane(normals, across)
        contours.append(Contour(points, np.array(across), normals, noise, (back[2], ahead[2])))
    return contours


def generator_of(rng: np.random.Generator | int | None) -> np.random.Generator:
    """Raises ValueError for what is no seed."""
    try:
        return np.random.default_rng(rng)
    except (TypeError, ValueError):
        raise ValueError(
            f"rng: expected a Generator or a whole number of 0 or more, got {shown(rng)}"
        ) from None


def _in_plane(normals: Array, across: Vector) -> Array:
    """The curve's unit normals, by those of the surface; shorter where these have next to none of it."""
    in_plane = normals - np.outer(normals @ across, across)
    return in_plane / np.maximum(np.linalg.norm(in_plane, axis=1, keepdims=True), LEAST_IN_PLANE)


def _first_contact(
    surface: Surface, p: Vector, n: Vector, e1: Vector, step: float
) -> tuple[Vector, Vector, float]:
    """The contact at the reference point, the normal there on the side of `n`, and that side's sign."""
    reach = 0.1 * step  # shorter than a step: a wall close above the point is not the point's
    e2 = cross(n, e1)
    # On an edge or a vertex of a mesh a ray may slip between the faces: a hair's breadth beside it does not.
    for aside, length in ((e1, 0.0), (e1, 1e-3), (e2, 1e-3), (e1, -1e-3), (e2, -1e-3)):
        contact = _section(surface, p, aside, n, 1.0)(complex(length * step, reach), -1j, 2.0 * reach)
        if contact is not None:
            _, _, found, up = contact
            side = math.copysign(1.0, dot(up, n))
            return found, scaled(up, side), side
    raise ValueError(
        f"point: expected one on the surface, got one with no surface within {reach:g} along the normal"
    )


def _section(surface: Surface, origin: Vector, t: Vector, u: Vector, side: float) -> _Cast:
    """The rays of the sampling plane through `origin` that holds t and u, both unit, as a complex plane.

    In Python floats: a contact costs its ray casts, not a dozen numpy calls.
    """
    (x0, y0, z0), (tx, ty, tz), (ux, uy, uz), ray_cast = origin, t, u, surface.ray_cast

    def cast(start: complex, direction: complex, distance: float) -> _Contact | None:
        """What the surface answers; direction is unit."""
        a, b, c, d = start.real, start.imag, direction.real, direction.imag
        hit = ray_cast(
            (x0 + a * tx + b * ux, y0 + a * ty + b * uy, z0 + a * tz + b * uz),
            (c * tx + d * ux, c * ty + d * uy, c * tz + d * uz),
            distance,
        )
        if hit is None:
            return None
        try:
            (x, y, z), (nx, ny, nz) = hit
            # NaN fails every comparison, so it is refused too.
            sound = abs(x) + abs(y) + abs(z) <= LARGEST and abs(nx * nx + ny * ny + nz * nz - 1.0) < 1e-2
        except (TypeError, ValueError, OverflowError):
            sound = False
        if not sound:
            raise ValueError(f"surface: expected a point and its unit normal from ray_cast, got {shown(hit)}")
        nx, ny, nz = side * nx, side * ny, side * nz
        dx, dy, dz = x - x0, y - y0, z - z0
        at = complex(dx * tx + dy * ty + dz * tz, dx * ux + dy * uy + dz * uz)
        up = complex(nx * tx + ny * ty + nz * tz, nx * ux + ny * uy + nz * uz)
        return at, up, (x, y, z), (nx, ny, nz)

    return cast


def _half_contour(
    cast: _Cast, up: complex, turn: complex, n: Vector, count: int, step: float
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
        at, new_up, point, normal = contact
        length = abs(new_up)
        # Where the surface lies in the plane there is no curve to follow.
        if length < LEAST_IN_PLANE or (new_up * up.conjugate()).real < MAX_TURN * length:
            return points, normals, CREASE
        if dot(normal, n) < MAX_TILT:
            return points, normals, NOT_MONGE
        up = new_up / length
        points.append(point)
        normals.append(normal)
    return points, normals, EXTENT


def _next_contact(cast: _Cast, at: complex, ahead: complex, up: complex, step: float) -> _Contact | None:
    """The contact one `step` from `at`, by a ray from above back along the curve's normal.

    A step along the tangent lands farther than a step along the curve, so where that is more than
    0.1 % the ray is cast once more from where the chord has the right length.
    """
    forward = step
    for _ in range(2):
        contact = cast(at + forward * ahead + step * up, -up, 2.0 * step)
        if contact is None:
            return None
        chord = abs(contact[0] - at)
        if not 0.5 * step < chord < 2.0 * step:
            raise ValueError(
                f"surface: expected hits on the rays, about {step:g} apart, got one {chord:g} from the last"
            )
        if abs(chord - step) <= 1e-3 * step:
            break
        forward *= step / chord
    return contact
