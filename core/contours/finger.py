# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A finger that moves by rays from contact to contact in a sampling plane (paper, section V)."""

import math
from collections.abc import Callable, Generator, Sequence
from typing import Protocol

from ..arguments import LARGEST, shown
from .contour import CREASE, NO_CONTACT, NOT_MONGE, Vector, cross, dot, scaled

# benchmarks.refusals of e20b52a counted what these refuse.
MAX_TURN = math.cos(math.radians(45.0))  # A sharper turn between two contacts is a crease to a finger.
# A normal tilted more against that at the point has slopes above 3.7.
MAX_TILT = math.cos(math.radians(75.0))
LEAST_IN_PLANE = 1e-3  # A surface normal has at least this share in the sampling plane.
# The surface is that of a patch if the cosine between their normals is more, that of 40 degrees: an edge of
# 45 that is crossed aslant turns less in the plane (python -m benchmarks.atlas --shapes).
SAME_SHEET_COSINE = 0.77

Hit = tuple[Sequence[float], Sequence[float]]  # A point and a normal, as a surface answers.
Contact = tuple[Vector, Vector]  # A point of the surface and its outward normal.


class Surface(Protocol):
    """Anything that can be touched.

    Normals are outward, or on one side of a sheet, wherever rays come from. Normals that face the ray, as
    many ray casters answer, do as well: only where a patch is off by half of the thickness of a wall or more,
    the wall's other side may pass for the surface.
    """

    def ray_cast(self, origin: Vector, direction: Vector, distance: float) -> "Hit | None":
        """The first point within `distance` along the unit `direction` and the unit normal there, or None."""


class NoContactError(ValueError):
    """Rays that are to meet the surface next to a contact do not."""


def checked(surface: Surface) -> Surface:
    """The surface. Raises ValueError if it is nothing that can be touched."""
    if not callable(getattr(surface, "ray_cast", None)):
        raise ValueError(f"surface: expected an object with the method ray_cast, got {shown(surface)}")
    return surface


# A contact: its place and the surface normal, both in the sampling plane as complex numbers, and both in
# space.
_PlaneContact = tuple[complex, complex, Vector, Vector]
# It takes start, direction and distance of a ray.
_Cast = Callable[[complex, complex, float], _PlaneContact | None]


def first_contact(
    surface: Surface, p: Vector, n: Vector, e1: Vector, step: float
) -> tuple[Vector, Vector, float]:
    """The contact at the reference point, the normal there on the side of `n`, and that side's sign."""
    reach = 0.1 * step  # It is shorter than a step, because a wall close above does not belong to the point.
    e2 = cross(n, e1)
    # On an edge or a vertex of a mesh a ray may slip between the faces. A hair's breadth aside it does not.
    for aside, length in ((e1, 0.0), (e1, 1e-3), (e2, 1e-3), (e1, -1e-3), (e2, -1e-3)):
        contact = section(surface, p, aside, n, 1.0)(complex(length * step, reach), -1j, 2.0 * reach)
        if contact is not None:
            _, _, place, up = contact
            side = math.copysign(1.0, dot(up, n))
            return place, scaled(up, side), side
    raise NoContactError(
        f"point: expected one on the surface, got one with no surface within {reach:.3g} along the normal: "
        "move it onto the surface, or away from a corner"
    )


def section(surface: Surface, origin: Vector, t: Vector, u: Vector, side: float) -> _Cast:
    """The rays of the sampling plane through `origin` that holds t and u, both unit, as a complex plane.

    It uses Python floats, because a dozen numpy calls would take longer than a contact's rays.
    """
    (x0, y0, z0), (tx, ty, tz), (ux, uy, uz), ray_cast = origin, t, u, surface.ray_cast

    def cast(start: complex, direction: complex, distance: float) -> _PlaneContact | None:
        """The contact of a ray along the unit `direction`, or None."""
        a, b, c, d = start.real, start.imag, direction.real, direction.imag
        hit = ray_cast(
            (x0 + a * tx + b * ux, y0 + a * ty + b * uy, z0 + a * tz + b * uz),
            (c * tx + d * ux, c * ty + d * uy, c * tz + d * uz),
            distance,
        )
        if hit is None:
            return None
        (x, y, z), (nx, ny, nz) = contact_of(hit, side)
        dx, dy, dz = x - x0, y - y0, z - z0
        at = complex(dx * tx + dy * ty + dz * tz, dx * ux + dy * uy + dz * uz)
        up = complex(nx * tx + ny * ty + nz * tz, nx * ux + ny * uy + nz * uz)
        return at, up, (x, y, z), (nx, ny, nz)

    return cast


def contact_of(hit: Hit, side: float) -> Contact:
    """The point and `side` times the normal that a surface answered. Raises ValueError if these are none."""
    try:
        (x, y, z), (nx, ny, nz) = hit
        # Surfaces may answer in single precision, in which the rays of a finger would stray.
        x, y, z, nx, ny, nz = map(float, (x, y, z, nx, ny, nz))
        # NaN fails every comparison, so it is refused, too.
        sound = abs(x) + abs(y) + abs(z) <= LARGEST and abs(nx * nx + ny * ny + nz * nz - 1.0) < 1e-2
    except (TypeError, ValueError, OverflowError):
        sound = False
    if not sound:
        raise ValueError(f"surface: expected a point and its unit normal of ray_cast, got {shown(hit)}")
    return (x, y, z), (side * nx, side * ny, side * nz)


def contacts(
    cast: _Cast, up: complex, turn: complex, n: Vector, step: float, least_cosine: float
) -> Generator[tuple[Vector, Vector], None, str]:
    """Yields contacts with surface normals on one side of the reference point 0, and returns why they end.

    up : the curve's normal at the point; `turn` times it is the way ahead
    n : the surface's normal there
    least_cosine : of the angle between the normals of two contacts; where the surface bends more is a crease
    """
    at, last = 0j, n
    if abs(up) < LEAST_IN_PLANE:
        return CREASE
    up /= abs(up)
    while True:
        ahead = turn * up
        # A finger bumps into a wall, behind which the ray from above would come down.
        if cast(at + step * up, ahead, step) is not None:
            return CREASE
        contact = _next_contact(cast, at, ahead, up, step)
        if contact is None:
            # A flank is below the point, or behind it if the edge is sharper than 90 degrees.
            flank = cast(at + step * ahead - 0.5 * step * up, -ahead, 2.0 * step)
            return NO_CONTACT if flank is None else CREASE
        at, new_up, point, normal = contact
        length = abs(new_up)
        is_sharp = (new_up * up.conjugate()).real < MAX_TURN * length or dot(normal, last) < least_cosine
        # If the surface lies in the plane, there is no curve to follow.
        if length < LEAST_IN_PLANE or is_sharp:
            return CREASE
        if dot(normal, n) < MAX_TILT:
            return NOT_MONGE
        up, last = new_up / length, normal
        yield point, normal


def _next_contact(cast: _Cast, at: complex, ahead: complex, up: complex, step: float) -> _PlaneContact | None:
    """The contact one `step` from `at`, by a ray from above back along the curve's normal.

    A step along the tangent leads farther than a step along the curve. If that is more than 0.1 %, the ray is
    cast once more from where the chord has the right length.
    """
    forward = step
    for _ in range(2):
        contact = cast(at + forward * ahead + step * up, -up, 2.0 * step)
        if contact is None:
            return None
        chord = abs(contact[0] - at)
        if not 0.5 * step < chord < 2.0 * step:
            raise NoContactError(
                f"surface: expected hits on the rays, some {step:g} apart, got one {chord:g} from the last"
            )
        if abs(chord - step) <= 1e-3 * step:
            break
        forward *= step / chord
    return contact
