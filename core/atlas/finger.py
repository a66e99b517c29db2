# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A finger that moves freely over an object, by rays.

It moves ahead, down, back and up, each from where the last way ended. So it bumps into walls and bends around
edges.
"""

import math
from typing import NamedTuple

import numpy as np

from ..arguments import Array
from ..contours.contour import Vector, along, cross, dot, scaled, tangent_of
from ..contours.finger import SAME_SHEET_COSINE, Contact, Hit, Surface, contact_of, first_contact

# python -m benchmarks.atlas judges these.
DISK_PLACES = 36  # A disk around a contact is felt at this number of places.
LOW = 0.1  # The finger comes down on a place from at most this share of the radius above it.
ABOVE = 0.6  # The finger is this share of the disk's radius above a contact when it feels around it.
HAIR = 0.02  # The finger slides along the surface this share of the radius above it.
FACING = 0.34  # The cosine of 70 degrees: what turns away by more is another sheet.


class Finger(NamedTuple):
    """A finger that moves freely over a surface.

    side : 1 if the surface's normals are on the side of the finger, -1 if they are on the other
    """

    surface: Surface
    side: float

    def ahead(self, point: Vector, normal: Vector, t: Vector, radius: float, s: float) -> Contact | None:
        """The first contact of a finger that goes s ahead, along t, from a point, then down, back and up.

        radius : that of the patch on whose rim the point lies
        """
        down, height = scaled(normal, -1.0), min(s, LOW * radius)
        # The patch may end a little beyond its surface.
        above = (along(along(point, normal, height), t, start) for start in (0.0, -0.5 * s))
        landed = next(filter(None, (self.met(p, down, 2.0 * height) for p in above)), None)
        if landed is None:
            return None
        at = along(landed[0], normal, HAIR * radius)
        for way, length in ((t, s), (down, 1.5 * s), (scaled(t, -1.0), 2.5 * s), (normal, 1.5 * s)):
            hit = self.surface.ray_cast(at, way, length)
            if hit is not None:
                return self._felt(hit, way)
            at = along(at, way, length)
        return None

    def disk(self, point: Vector, normal: Vector, tangent: Vector, radius: float) -> Array:
        """A contact, and those felt from above on a disk around it: points and normals, (k, 2, 3).

        Places behind a wall and surface that faces away are left out.

        tangent : not along the normal; the disk's places are turned from it
        """
        down, above = scaled(normal, -1.0), along(point, normal, HAIR * radius)
        roof = self.surface.ray_cast(above, normal, ABOVE * radius)
        height = ABOVE * radius if roof is None else 0.5 * math.dist(point, roof[0])
        hits, raised, far = [(point, normal)], along(point, normal, height), height + ABOVE * radius
        for way in _disk_around(normal, tangent):
            length = math.hypot(*way)
            # The finger does not get through a wall.
            if self.surface.ray_cast(raised, scaled(way, 1.0 / length), length * radius) is not None:
                continue
            felt = self.met(along(raised, way, radius), down, far)
            if felt is not None and dot(felt[1], normal) > FACING:
                hits.append(felt)
        return np.array(hits)

    def met(self, start: Vector, way: Vector, length: float) -> Contact | None:
        """The first contact of a finger that comes along a unit direction, or None."""
        return self._felt(self.surface.ray_cast(start, way, length), way)

    def near(
        self, point: Vector, normal: Vector, length: float, cosine: float = SAME_SHEET_COSINE
    ) -> Contact | None:
        """The contact along a normal within a length of a point, if the surface there faces much alike.

        cosine : of the largest angle between the normals
        """
        felt = self.met(along(point, normal, length), scaled(normal, -1.0), 2.0 * length)
        return felt if felt is not None and dot(felt[1], normal) > cosine else None

    def _felt(self, hit: Hit | None, way: Vector) -> Contact | None:
        """The contact where a ray in this direction has hit, or None if it came from inside the object."""
        contact = None if hit is None else contact_of(hit, self.side)
        return None if contact is None or dot(contact[1], way) >= 0.0 else contact


def finger_at(surface: Surface, point: Vector, outward: Vector, step: float) -> Finger:
    """The finger on the outer side of a surface at a point of it, which is felt from a tenth of a step above.

    Raises ValueError if no surface is there.
    """
    return Finger(surface, first_contact(surface, point, outward, tangent_of(outward, None), step)[2])


def _disk_around(normal: Vector, tangent: Vector) -> list[Vector]:
    """Places (DISK_PLACES, 3) spread evenly over the unit disk across a unit normal, as in a sunflower."""
    e1, golden = tangent_of(normal, tangent), math.pi * (3.0 - math.sqrt(5.0))
    e2, places = cross(normal, e1), []
    for i in range(DISK_PLACES):
        out = math.sqrt((i + 0.5) / DISK_PLACES)
        places.append(along(scaled(e1, out * math.cos(i * golden)), e2, out * math.sin(i * golden)))
    return places
