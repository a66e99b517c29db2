# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Where what was felt ends, and how a finger goes on from there.

Patches cover an object when each place of their rims lies inside another, or the finger that goes on beyond
it comes to what is covered, or to nothing. It moves by rays alone, ahead, down, back and up, each from where
the last one ended: so it bumps into walls and bends around edges.
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
from .charts import DISK_PLACES, Charts, disk_around
from .field import FACING, INSIDE, covered
from .join import charts_of

RIM = 24  # places of a rim
REACHES = (0.35, 0.12, 0.04)  # shares of the radius that the finger goes on, until it finds anything new
DISK_REACHES = 3.0  # times this: the radius of the disk, at most the patch's, in which that is measured
SLIVER = 0.03  # share of the disk: the blend of patches bridges less
TRIES = 3  # touches that a place of a rim is worth
LOOK = 7  # more places that are looked at with the first
TOUCHES_APART = 2.2  # radii between touches that are made side by side
LOW = 0.1  # share of the radius: how high above a place the finger is when it comes down
ABOVE = 0.6  # share of the radius: how high the finger is above what it feels around a contact
HAIR = 0.02  # share of a reach: how high the finger is above the surface

Hit = tuple[Sequence[float], Sequence[float]]  # what a surface answers
Contact = tuple[Vector, Vector]  # a point of the surface and its outward normal


@dataclass(frozen=True, eq=False)
class Place:
    """A place on a rim, with the normal and the way ahead, (3,) each; and the size of its patch.

    tried : where touches that went on from it were, (3,) each
    """

    point: Vector
    normal: Vector
    ahead: Vector
    radius: float
    tried: tuple[Vector, ...] = ()


class Next(NamedTuple):
    """Where to touch, (3,) each, the area that it would bring, and from which place of a rim."""

    point: Array
    outward: Array
    gain: float
    place: Place


@dataclass(eq=False)
class Frontier:
    """What was felt, and a queue of the places on its rims, by the area that a touch there can bring at most.

    side : 1 where the surface's normals are on the side of the finger, -1 where they are on the other
    least : the area that a touch has to bring
    left : places where touches brought nothing

    What a place can bring only shrinks as patches come, so it is measured again only once it is the first.
    """

    surface: Surface
    side: float
    least: float = 0.0
    charts: Charts | None = None
    queue: list[tuple[float, int, Place]] = field(default_factory=list)
    pushed: int = 0
    left: list[Place] = field(default_factory=list)

    def add(self, r: Reconstruction, goes_on: bool = True) -> None:
        """Takes in a patch that was felt, with the places of its rim where others may go on from there."""
        chart = charts_of([r], deviations=False)
        self.charts = chart if self.charts is None else self.charts.joined(chart)
        for p, n, t in zip(*chart.rim(RIM, 1.01 * INSIDE), strict=True) if goes_on else ():
            self.push(Place(vector_of(p), vector_of(n), vector_of(t), r.radius), np.pi * r.radius**2)

    def push(self, place: Place, gain: float) -> None:
        """Queues a place of a rim by the area that a touch there may bring."""
        self.pushed += 1
        heapq.heappush(self.queue, (-gain, self.pushed, place))

    def tried(self, touch: Next) -> None:
        """Queues the place of a touch that was made once more: something may be left beyond it."""
        place, at = touch.place, vector_of(touch.point)
        self.push(replace(place, tried=(*place.tried, at)), touch.gain)

    def taking(self, count: int) -> Generator[None, None, list[Next]]:
        """The touches that bring most, at most so many, far from each other; none where all is covered.

        Yields before places are looked at, some at once.
        """
        self._forget_covered()
        found: list[Next] = []
        aside: list[tuple[float, int, Place]] = []
        known: dict[Place, Next | None] = {}
        while self.queue and len(found) < count:
            entry = heapq.heappop(self.queue)
            place = entry[2]
            if any(_is_near(place, other) for other in found):
                aside.append(entry)
                continue
            if len(place.tried) >= TRIES:
                self.left.append(place)
                continue
            if place not in known:
                yield
                some = [place, *(next_[2] for next_ in heapq.nsmallest(LOOK, self.queue))]
                some = [place for place in some if place not in known]
                known.update(zip(some, self.beyond(some), strict=True))
            touch = known[place]
            if touch is None:
                continue
            if self.queue and touch.gain < -self.queue[0][0]:
                self.push(place, touch.gain)
            else:
                found.append(touch)
        for entry in aside:
            heapq.heappush(self.queue, entry)
        return found

    def uncovered(self, charts: Charts) -> Generator[None, None, list[Place]]:
        """Places where a touch would bring something beside joined patches, but there was none, or in vain.

        Patches alone may be off at their rims by so much that others seem not to cover them. Yields before
        each place where touches were in vain.
        """
        self.charts = charts
        found = still_open([place for _, _, place in sorted(self.queue)], charts)
        for place in still_open(self.left, charts):
            yield
            if self.beyond([place])[0] is not None:
                found.append(place)
        return found

    def _forget_covered(self) -> None:
        """Places that patches have come to cover, all at once."""
        still = {id(place) for place in still_open([place for _, _, place in self.queue], self.charts)}
        self.queue = [entry for entry in self.queue if id(entry[2]) in still]
        heapq.heapify(self.queue)

    def beyond(self, places: Sequence[Place]) -> list[Next | None]:
        """The touches that go on from places; None where one would bring nothing."""
        found: list[Next | None] = [None] * len(places)
        for share in REACHES:
            left = [i for i, touch in enumerate(found) if touch is None]
            if not left:
                break
            disks = [self.disk(places[i], share) for i in left]
            for i, hits, new in zip(left, disks, self._uncovered(disks), strict=True):
                if len(new) and new[0] == 0:
                    found[i] = self._touch(places[i], share, hits, new)
        return found

    def _uncovered(self, disks: Sequence[list[Contact]]) -> list[NDArray[np.intp]]:
        """Which contacts of each disk no patch covers."""
        assert self.charts is not None
        flat = np.array([contact for hits in disks for contact in hits]).reshape(-1, 2, 3)
        free = ~covered(self.charts, flat[:, 0], flat[:, 1])
        ends = np.cumsum([len(hits) for hits in disks])
        return [np.flatnonzero(some) for some in np.split(free, ends[:-1])]

    def _touch(self, place: Place, share: float, hits: list[Contact], new: NDArray[np.intp]) -> Next | None:
        """The touch in the middle of those of a disk's contacts that are new, if it brings enough."""
        disk = math.pi * (min(1.0, DISK_REACHES * share) * place.radius) ** 2
        area = len(new) / (DISK_PLACES + 1) * disk
        if area <= max(SLIVER * disk, self.least):
            return None
        point, outward = hits[new[_between(np.array([hits[i][0] for i in new]), place.tried)]]
        return Next(np.array(point), np.array(outward), area, place)

    def felt(self, hit: Hit | None, way: Vector) -> Contact | None:
        """The contact of a ray that goes that way; none at its back: there the finger is inside."""
        if hit is None:
            return None
        normal = scaled(vector_of(hit[1]), self.side)
        return (vector_of(hit[0]), normal) if dot(normal, way) < 0.0 else None

    def ahead(self, place: Place, s: float) -> Contact | None:
        """The first contact of a finger that goes s ahead from a place, then down, back and up."""
        up, down, t = place.normal, scaled(place.normal, -1.0), place.ahead
        height = min(s, LOW * place.radius)
        for start in (0.0, -0.5 * s):  # the patch may end a little beyond its surface
            above = along(along(place.point, up, height), t, start)
            found = self.felt(self.surface.ray_cast(above, down, 2.0 * height), down)
            if found is not None:
                break
        else:
            return None
        at = along(found[0], up, HAIR * place.radius)
        for way, length in ((t, s), (down, 1.5 * s), (scaled(t, -1.0), 2.5 * s), (up, 1.5 * s)):
            hit = self.surface.ray_cast(at, way, length)
            if hit is not None:
                return self.felt(hit, way)
            at = along(at, way, length)
        return None

    def disk(self, place: Place, share: float) -> list[Contact]:
        """The contact that is a share of the radius ahead of a place, if any, and those on a disk around it.

        Rays onto the disk measure it: beyond an edge there is nothing to add.
        """
        contact = self.ahead(place, share * place.radius)
        if contact is None:
            return []
        point, normal = contact
        radius, down = min(1.0, DISK_REACHES * share) * place.radius, scaled(normal, -1.0)
        above = self.surface.ray_cast(along(point, normal, HAIR * radius), normal, ABOVE * radius)
        height = ABOVE * radius if above is None else 0.5 * math.dist(point, above[0])
        hits = [contact]
        for start in (along(point, normal, height) + disk_around(normal, place.ahead) * radius).tolist():
            felt = self.felt(self.surface.ray_cast(start, down, height + ABOVE * radius), down)
            if felt is not None and dot(felt[1], normal) > FACING:
                hits.append(felt)
        return hits


def still_open(places: Sequence[Place], charts: Charts | None) -> list[Place]:
    """The places that no patch covers."""
    if charts is None or not places:
        return list(places)
    points, normals = (np.array([getattr(p, name) for p in places]) for name in ("point", "normal"))
    return [place for place, gone in zip(places, covered(charts, points, normals), strict=True) if not gone]


def _is_near(place: Place, touch: Next) -> bool:
    room = TOUCHES_APART * max(place.radius, touch.place.radius)
    return math.dist(place.point, touch.point) < room


def _between(points: Array, tried: Sequence[Vector]) -> int:
    """Which of the points (n, 3) is in the middle of them, or farthest from where touches were in vain."""
    if not tried:
        return int(np.argmin(((points - points.mean(axis=0)) ** 2).sum(axis=1)))
    apart = points[:, None] - np.array(tried)
    return int(np.argmax((apart**2).sum(axis=2).min(axis=1)))
