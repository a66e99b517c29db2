# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Where what was felt ends, and how a finger goes on from there.

Patches cover an object when nothing is left of their rims: each place of a rim lies inside another patch, or
the finger that goes on beyond it comes to what is covered, or to nothing. It moves by rays alone, ahead,
down, back and up, each from where the last one ended: so it bumps into walls and bends around edges.
"""

import heapq
import math
from collections.abc import Generator, Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..arguments import Array
from ..contours.contour import Vector, along, dot, scaled, vector_of
from ..contours.finger import Surface
from ..reconstruction.result import Reconstruction
from .charts import AZIMUTHS, DISK_PLACES, Charts, disk_around
from .field import FACING, LAYER
from .join import charts_of

RIM = 24  # places of a rim
INSIDE = 1.0  # of a domain's radius: farther out a place is not covered
REACHES = (0.35, 0.12, 0.04)  # of the radius, that the finger goes on; the first that finds what is new
DISK_REACHES = 3.0  # of these, the radius of the disk around it that tells how much, at most the patch's
SLIVER = 0.03  # of the disk: less is bridged by what blends patches
TRIES = 3  # touches that a place of a rim is worth
TOUCHES_APART = 2.2  # radii between touches that are made side by side
LOW = 0.1  # of the radius, that the finger is above a place when it comes down
ABOVE = 0.6  # of the radius, that the finger is above what it feels around
HAIR = 0.02  # of a reach, that the finger is above the surface


Contact = tuple[Vector, Vector]  # a point of the surface and its outward normal


@dataclass(frozen=True, eq=False)
class Place:
    """A place on a rim, with the normal and the way ahead, (3,) each; and the size of its patch."""

    point: Vector
    normal: Vector
    ahead: Vector
    radius: float
    tries: int = 0


class Next(NamedTuple):
    """Where to touch, (3,) each, the area that it would bring, and from which place of a rim."""

    point: Array
    outward: Array
    gain: float
    place: Place


@dataclass(eq=False)
class Frontier:
    """What was felt, and the places of its rims, by an area that touches there bring at most.

    side : 1 where the surface's normals are on the side of the finger, -1 where they are on the other

    What a touch brings only becomes less, so that no other need be asked anew before it is the first.
    """

    surface: Surface
    side: float
    charts: Charts | None = None
    queue: list[tuple[float, int, Place]] = field(default_factory=list)
    pushed: int = 0
    left: list[Place] = field(default_factory=list)

    def add(self, r: Reconstruction) -> None:
        """A patch that was felt."""
        chart = charts_of([r], deviations=False)
        self.charts = chart if self.charts is None else self.charts.joined(chart)
        for place in rim_of(chart, r):
            self.push(place, np.pi * r.radius**2)

    def push(self, place: Place, gain: float) -> None:
        """A place of a rim whose touch may bring so much."""
        self.pushed += 1
        heapq.heappush(self.queue, (-gain, self.pushed, place))

    def tried(self, touch: Next) -> None:
        """What was touched: its place is looked at again."""
        self.push(replace(touch.place, tries=touch.place.tries + 1), touch.gain)

    def taking(self, count: int) -> Generator[None, None, list[Next]]:
        """The touches that bring most, at most so many, far from each other; none where all is covered.

        Yields before each place that is looked at.
        """
        self._forget_covered()
        found: list[Next] = []
        aside: list[tuple[float, int, Place]] = []
        while self.queue and len(found) < count:
            entry = heapq.heappop(self.queue)
            place = entry[2]
            if any(_is_near(place, other) for other in found):
                aside.append(entry)
                continue
            yield
            touch = self.beyond(place)
            if touch is None:
                continue
            if self.queue and touch.gain < -self.queue[0][0]:
                self.push(place, touch.gain)
            else:
                found.append(touch)
        for entry in aside:
            heapq.heappush(self.queue, entry)
        return found

    def uncovered(self) -> list[Place]:
        """Places where a touch would bring something, but there was none, or it brought nothing."""
        self._forget_covered()
        return [place for _, _, place in sorted(self.queue)] + still_open(self.left, self.charts)

    def _forget_covered(self) -> None:
        """Places that patches have come to cover, all at once."""
        still = {id(place) for place in still_open([place for _, _, place in self.queue], self.charts)}
        self.queue = [entry for entry in self.queue if id(entry[2]) in still]
        heapq.heapify(self.queue)

    def beyond(self, place: Place) -> Next | None:
        """The touch that goes on from a place; None where it would bring nothing."""
        if place.tries >= TRIES:
            self.left.append(place)
            return None
        for share in REACHES:
            contact = self.ahead(place, share * place.radius)
            if contact is None or self.covered(*contact):
                continue
            radius = min(1.0, DISK_REACHES * share) * place.radius
            gain, middle = self.around(contact, place, radius)
            if gain > SLIVER * math.pi * radius**2:
                return Next(np.array(middle[0]), np.array(middle[1]), gain, place)
        return None

    def felt(self, hit: tuple[Sequence[float], Sequence[float]]) -> Contact:
        """A hit with the normal on the side of the finger."""
        return vector_of(np.asarray(hit[0])), scaled(vector_of(np.asarray(hit[1])), self.side)

    def ahead(self, place: Place, s: float) -> Contact | None:
        """The first contact of a finger that goes s ahead from a place, then down, back and up."""
        up, down, t = place.normal, scaled(place.normal, -1.0), place.ahead
        height = min(s, LOW * place.radius)
        for start in (0.0, -0.5 * s):  # the patch may end a little beyond its surface
            found = self.toward(along(along(place.point, up, height), t, start), down, 2.0 * height)
            if found is not None:
                break
        else:
            return None
        at = along(found[0], up, HAIR * place.radius)
        for way, length in ((t, s), (down, 1.5 * s), (scaled(t, -1.0), 2.5 * s), (up, 1.5 * s)):
            if self.surface.ray_cast(at, way, length) is not None:
                return self.toward(at, way, length)
            at = along(at, way, length)
        return None

    def toward(self, start: Vector, way: Vector, length: float) -> Contact | None:
        """The first contact on a ray; none at the back of a surface: there the finger would be inside."""
        hit = self.surface.ray_cast(start, way, length)
        return None if hit is None or dot(self.felt(hit)[1], way) >= 0.0 else self.felt(hit)

    def covered(self, point: Vector, normal: Vector) -> bool:
        """Whether a place lies inside a patch that faces its way."""
        return bool(self.is_covered(np.array([point]), np.array([normal]))[0])

    def is_covered(self, points: Array, normals: Array) -> NDArray[np.bool_]:
        """Which of (k, 3) do."""
        assert self.charts is not None
        return covered(self.charts, points, normals)

    def around(self, contact: Contact, place: Place, radius: float) -> tuple[float, Contact]:
        """The area of a disk around a contact that is not covered, and the contact in the middle of that.

        By rays onto a disk around the contact: beyond an edge there is nothing to add.
        """
        point, normal = contact
        down = scaled(normal, -1.0)
        above = self.surface.ray_cast(along(point, normal, HAIR * radius), normal, ABOVE * radius)
        height = ABOVE * radius if above is None else 0.5 * math.dist(point, above[0])
        hits = [contact]
        for offset in disk_around(normal, place.ahead) * radius:
            start = along(along(point, normal, height), vector_of(offset), 1.0)
            hit = self.surface.ray_cast(start, down, height + ABOVE * radius)
            felt = None if hit is None else self.felt(hit)
            if felt is not None and dot(felt[1], normal) > FACING:
                hits.append(felt)
        points, normals = np.array([h[0] for h in hits]), np.array([h[1] for h in hits])
        new = np.flatnonzero(~self.is_covered(points, normals))
        off = points[new] - points[new].mean(axis=0)
        middle = hits[new[np.argmin((off**2).sum(axis=1))]]
        return len(new) / (DISK_PLACES + 1) * math.pi * radius**2, middle


def covered(charts: Charts, points: Array, normals: Array) -> NDArray[np.bool_]:
    """Which of the places (k, 3) lie inside a patch that faces their way."""
    pairs = charts.pairs(points)
    on = pairs.share < INSIDE
    on &= np.abs(pairs.distance) < LAYER * charts.radii[pairs.node]
    on &= np.einsum("mi,mi->m", pairs.normal, normals[pairs.place]) > FACING
    found: NDArray[np.bool_] = np.bincount(pairs.place[on], minlength=len(points)) > 0
    return found


def still_open(places: Sequence[Place], charts: Charts | None) -> list[Place]:
    """Those of places that no patch covers."""
    if charts is None or not places:
        return list(places)
    points, normals = (np.array([getattr(p, name) for p in places]) for name in ("point", "normal"))
    return [place for place, gone in zip(places, covered(charts, points, normals), strict=True) if not gone]


def side_of(surface: Surface, point: Array, outward: Array, reach: float) -> float:
    """1 where the surface's normals at a point are on the side of `outward`, -1 where on the other."""
    up = vector_of(outward)
    hit = surface.ray_cast(along(vector_of(point), up, reach), scaled(up, -1.0), 2.0 * reach)
    return 1.0 if hit is None else math.copysign(1.0, dot(vector_of(np.asarray(hit[1])), up))


def _is_near(place: Place, touch: Next) -> bool:
    room = TOUCHES_APART * max(place.radius, touch.place.radius)
    return math.dist(place.point, touch.point) < room


def rim_of(chart: Charts, r: Reconstruction) -> list[Place]:
    """Places of the rim of a patch, alone in its charts."""
    turns = 2.0 * np.pi * np.arange(RIM) / RIM
    out = 1.01 * INSIDE * chart.rims[0, :: AZIMUTHS // RIM, None]
    xy = out * np.stack([np.cos(turns), np.sin(turns)], axis=1)
    none = np.zeros(RIM, dtype=np.intp)
    points, normals = chart.world(none, *xy.T)
    ahead = (xy / np.linalg.norm(xy, axis=1, keepdims=True)) @ r.frame.axes[:, :2].T
    ahead -= np.einsum("ki,ki->k", ahead, normals)[:, None] * normals
    ahead /= np.maximum(np.linalg.norm(ahead, axis=1, keepdims=True), 1e-12)
    each = zip(points, normals, ahead, strict=True)
    return [Place(vector_of(p), vector_of(n), vector_of(t), r.radius) for p, n, t in each]
