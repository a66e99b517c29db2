# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Where what was felt ends, and how a finger goes on from there.

Patches cover an object when each place on their rims lies inside another patch, or a finger that goes on from
there meets only what is covered, or nothing.
"""

import heapq
import math
from collections.abc import Generator, Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..arguments import Array
from ..contours.contour import Contour, Vector, cross, dot, tangent_of, vector_of
from ..contours.finger import Contact
from ..reconstruction.result import Reconstruction
from ..triangles import SAME, far_apart, normalized, triangle_cross
from .charts import AZIMUTHS, PLACES_AT_ONCE, Charts
from .connectivity import connected_pieces
from .field import INSIDE, covered
from .finger import DISK_PLACES, Finger
from .join import stacked, tabulate
from .meshing import Mesh
from .reference_mesh import ReferenceMesh
from .rims import radial_extent

# python -m benchmarks.atlas judges these.
RIM = 24  # Each rim has this many places.
# The finger taps each patch at these shares of its rim, on every first or second ray to RIM places.
BETWEEN = ((0.97, 1), (0.6, 2))
REACHES = (0.35, 0.12, 0.04)  # The finger goes on by these shares of the radius, until something is new.
DISK_REACHES = 3.0  # What is new is measured on a disk of this many reaches, at most the patch's radius.
BORDER_RADIUS = 5.0  # The radius of a place on the border of a mesh, in edges.
AGAIN_APART = 0.5  # The distance between such places, and between touches there, in radii.
SLIVER = 0.03  # The blend of patches bridges what is new if it is less than this share of the disk.
IN_VAIN = 2.0  # What is within this many radii of the least patch of a touch in vain brings nothing, too.
TRIES = 3  # Touches go on from a place at most this many times.
LOOK = 15  # This many other places are looked at together with the first of the queue, which is faster.
ALONG = 0.9  # A direction is along another if the cosine of the angle between them is more.
TOUCHES_APART = 2.2  # Touches that are made side by side are this many radii apart.

# Kernels of linear algebra round differently, which may not choose between what is equal but for rounding.
GAIN_DIGITS = 9  # Gains are areas in the caller's unit, and equal if this many significant digits are.


@dataclass(frozen=True, eq=False)
class RimPlace:
    """A place on a rim, its normal and the way away from its patch, (3,) each, and the radius of the patch.

    tried : where touches that went on from it were, (3,) each
    felt : what no patch covers on the disk at a share of REACHES, (k, 2, 3); none once its middle is covered
    area : what is missing around it, at most a disk of that radius, if that is known
    """

    point: Vector
    normal: Vector
    ahead: Vector
    radius: float
    tried: tuple[Vector, ...] = ()
    felt: dict[float, Array] = field(default_factory=dict)
    area: float | None = None


class Next(NamedTuple):
    """Where to touch, the outward direction, (3,) each, the area that it would bring, and whence."""

    point: Array
    outward: Array
    gain: float
    place: RimPlace


@dataclass(eq=False)
class Frontier:
    """The patches that were felt, and a queue of the places on their rims.

    near : the finger feels a patch where the surface is within this length of it
    least : the least area that a touch has to bring
    noise : standard deviation of the contacts between curves, drawn from `rng`
    taps : these contacts, for each patch
    failed_points : where touches that could not make a patch were, (3,) each

    The first place is the one that can bring most. That only shrinks as patches come, so only there it is
    measured again.
    """

    finger: Finger
    near: float
    least: float = 0.0
    noise: float = 0.0
    rng: np.random.Generator = field(default_factory=np.random.default_rng)
    taps: list[Contour] = field(default_factory=list)
    failed_points: list[Vector] = field(default_factory=list)
    charts: Charts = field(init=False)
    queue: list[tuple[float, int, RimPlace]] = field(default_factory=list)
    pushed: int = 0

    def add(self, r: Reconstruction, goes_on: float = 0.0) -> bool:
        """Takes in a patch, and the places of its rim. Returns whether the finger felt it.

        goes_on : a length; patches that the finger feels to be smaller have no places
        """
        rim = radial_extent(r, self.finger, self.near)
        radius = r.radius * math.sqrt(np.mean(rim**2))
        if radius <= 0.0:
            return False
        chart = stacked([r], [tabulate(r, rim, deviations=False)])
        self.charts = self.charts.joined(chart) if self.taps else chart
        self.taps.append(self._felt_between(chart))
        for p, n, t in zip(*chart.rim(RIM, 1.01 * INSIDE), strict=True) if radius >= goes_on else ():
            self.push(RimPlace(vector_of(p), vector_of(n), vector_of(t), r.radius), np.pi * r.radius**2)
        return True

    def _felt_between(self, chart: Charts) -> Contour:
        """Contacts between the curves of a patch, where the finger taps it."""
        around = np.arange(0, AZIMUTHS, AZIMUTHS // RIM)
        xy = np.hstack([share * chart.rim_at(around[::step]) for share, step in BETWEEN])
        places = chart.world(np.zeros(xy.shape[1], dtype=np.intp), *xy)
        felt = np.array(self.felt_near(*places)).reshape(-1, 2, 3)
        points, normals = felt.transpose(1, 0, 2)
        return Contour(points + self.rng.normal(0.0, self.noise, (len(points), 1)) * normals, normals=normals)

    def felt_near(self, points: Array, normals: Array) -> list[Contact]:
        """The contacts of the finger near places (n, 3) with normals (n, 3), where there are some."""
        places = zip(points, normals, strict=True)
        contacts = (self.finger.near(vector_of(p), vector_of(n), self.near) for p, n in places)
        return [contact for contact in contacts if contact is not None]

    def push(self, place: RimPlace, gain: float) -> None:
        """Queues a place by the area that a touch there may bring."""
        self.pushed += 1
        heapq.heappush(self.queue, (-_rounded(gain), self.pushed, place))

    def tried(self, touch: Next) -> None:
        """Queues the place of a touch again after the touch was made: something may be left beyond it."""
        self.push(replace(touch.place, tried=(*touch.place.tried, vector_of(touch.point))), touch.gain)

    def next_touches(self, count: int) -> Generator[None, None, list[Next]]:
        """At most `count` touches, far apart, that bring most. Yields each time before it looks at places."""
        yield from self._forget_covered()
        chosen: list[Next] = []
        aside: list[tuple[float, int, RimPlace]] = []
        touches: dict[RimPlace, Next | None] = {}
        while self.queue and len(chosen) < count:
            _, _, place = entry = heapq.heappop(self.queue)
            distances = ((other, TOUCHES_APART * max(place.radius, other.place.radius)) for other in chosen)
            if any(math.dist(place.point, other.point) < apart for other, apart in distances):
                aside.append(entry)
                continue
            if len(place.tried) >= TRIES:
                continue
            if place not in touches:
                yield
                others = (other for _, _, other in heapq.nsmallest(LOOK, self.queue) if other not in touches)
                some = [place, *others]
                touches.update(zip(some, self.beyond(some), strict=True))
            touch = touches[place]
            if touch is not None and self.queue and touch.gain < -self.queue[0][0]:
                self.push(place, touch.gain)
            elif touch is not None:
                chosen.append(touch)
        for entry in aside:
            heapq.heappush(self.queue, entry)
        return chosen

    def uncovered(self, reference: ReferenceMesh) -> Generator[float, None, list[tuple[RimPlace, Contact]]]:
        """Places on the border of a mesh beyond which the object goes on, each with a contact there.

        Yields 1 after each.
        """
        uncovered = []
        for place in border_places(reference.mesh):
            yield 1.0
            contacts = np.concatenate([self._ahead(place, share) for share in REACHES])
            # Across a notch the finger meets the mesh again.
            off = contacts[reference.ended(contacts[:, 0])]
            if len(off):
                uncovered.append((place, (vector_of(off[-1, 0]), vector_of(off[-1, 1]))))
        return uncovered

    def unfelt(self, mesh: Mesh) -> Generator[float, None, list[tuple[RimPlace, Contact]]]:
        """Places of pieces of a closed surface where nothing was felt, each with a contact there.

        In a piece they are as far apart as the sides of a square of its area. Pieces on most of which the
        finger meets nothing are no surface, as beyond a border. Yields 1 after each.
        """
        unfelt, sides, normals = [], mesh.triangles, mesh.normals
        count, piece = connected_pieces(sides[:, :2].ravel(), sides[:, 1:].ravel(), len(mesh.vertices))
        areas = 0.5 * np.linalg.norm(triangle_cross(mesh.vertices[sides]), axis=1)
        for one, side in enumerate(np.sqrt(np.bincount(piece[sides[:, 0]], areas, count)).tolist()):
            yield 1.0
            some = np.flatnonzero(piece == one)
            away = np.linalg.norm(mesh.vertices[some] - mesh.vertices[some].mean(axis=0), axis=1)
            some = some[np.argsort(away, kind="stable")]
            some = some[np.unique(np.linspace(0, len(some) - 1, DISK_PLACES).astype(np.intp))]
            contacts = self.felt_near(mesh.vertices[some], normals[some])
            if 2 * len(contacts) > len(some):
                chosen = [contacts[i] for i in far_apart(np.array(contacts)[:, 0], side)]
                unfelt += [(RimPlace(*c, tangent_of(c[1], None), side), c) for c in chosen]
        return unfelt

    def _forget_covered(self) -> Generator[None, None, None]:
        """Takes the places that patches now cover out of the queue; yields between its steps."""
        still: list[tuple[float, int, RimPlace]] = []
        for start in range(0, len(self.queue), PLACES_AT_ONCE):
            some = self.queue[start : start + PLACES_AT_ONCE]
            free = self._free(np.array([(place.point, place.normal) for _, _, place in some]))
            still += [entry for entry, is_free in zip(some, free, strict=True) if is_free]
            yield
        self.queue = still
        heapq.heapify(self.queue)

    def beyond(self, places: Sequence[RimPlace]) -> list[Next | None]:
        """The touch that goes on from each place, or None if it would bring nothing."""
        touches: list[Next | None] = [None] * len(places)
        for share in REACHES:
            left = [i for i, touch in enumerate(touches) if touch is None]
            some = [places[i] for i in left]
            new = [place for place in some if share not in place.felt]
            middles = self._uncovered_part([self._ahead(place, share) for place in new])
            for place, middle in zip(new, middles, strict=True):
                place.felt[share] = self._disk(place, middle, share) if len(middle) else middle
            disks = self._uncovered_part([place.felt[share] for place in some])
            for i, place, disk in zip(left, some, disks, strict=True):
                place.felt[share] = disk
                touches[i] = self._touch(place, share)
        return touches

    def _ahead(self, place: RimPlace, share: float) -> Array:
        """The contact of the finger that goes on from a place, (1, 2, 3), or none, (0, 2, 3)."""
        reach = share * place.radius
        contact = self.finger.ahead(place.point, place.normal, place.ahead, place.radius, reach)
        return np.array([contact] if contact else []).reshape(-1, 2, 3)

    def _disk(self, place: RimPlace, middle: Array, share: float) -> Array:
        """What the finger feels around a contact (1, 2, 3) beyond a place, (k, 2, 3)."""
        rim = cross(place.normal, place.ahead)  # An edge along the rim leaves this across the normal.
        point, normal = map(vector_of, middle[0])
        tangent = place.ahead if abs(dot(normal, rim)) > ALONG else rim
        return self.finger.disk(point, normal, tangent, min(1.0, DISK_REACHES * share) * place.radius)

    def _uncovered_part(self, disks: Sequence[Array]) -> list[Array]:
        """What no patch covers of disks (k, 2, 3), each: nothing if one covers the first contact, the middle.

        What patches cover stays covered.
        """
        if not disks:
            return []
        free = np.split(self._free(np.concatenate(disks)), np.cumsum([len(disk) for disk in disks])[:-1])
        return [disk[which & which[:1]] for disk, which in zip(disks, free, strict=True)]

    def _free(self, contacts: Array) -> NDArray[np.bool_]:
        """Which of the contacts (k, 2, 3) no patch covers."""
        return ~covered(self.charts, contacts[:, 0], contacts[:, 1])

    def _touch(self, place: RimPlace, share: float) -> Next | None:
        """The touch in the middle of what is uncovered on a disk that was felt, if it brings enough."""
        hits, disk = place.felt[share], math.pi * (min(1.0, DISK_REACHES * share) * place.radius) ** 2
        if self.failed_points and len(hits):
            apart = ((hits[:, 0, None] - np.array(self.failed_points)) ** 2).sum(axis=2).min(axis=1)
            hits = hits[apart > IN_VAIN**2 * self.least / math.pi]
        area = len(hits) / (DISK_PLACES + 1) * disk
        if area <= max(SLIVER * disk, self.least):
            return None
        point, outward = hits[_between(hits[:, 0], place.tried)]
        return Next(point, outward, _rounded(area), place)


def _rounded(gain: float) -> float:
    """A gain without the digits that differ by rounding, both where it is compared and where it is queued."""
    return float(f"{gain:.{GAIN_DIGITS - 1}e}")


def _between(points: Array, tried: Sequence[Vector]) -> int:
    """The index of the point (n, 3) in the middle of all, or farthest from where touches were in vain."""
    if tried:
        squares = -((points[:, None] - np.array(tried)) ** 2).sum(axis=2).min(axis=1)
    else:
        squares = ((points - points.mean(axis=0)) ** 2).sum(axis=1)
    return int(np.argmax(squares <= squares.min() + SAME * np.abs(squares).max()))


def border_places(mesh: Mesh) -> Iterator[RimPlace]:
    """Places on the border of a mesh, some edges apart, with the way beyond it."""
    corners, radius = mesh.vertices[mesh.border], BORDER_RADIUS * mesh.edge
    ups = normalized(mesh.normals[mesh.border].sum(axis=1))
    ways = normalized(np.cross(corners[:, 1] - corners[:, 0], ups))
    some = np.flatnonzero(ways.any(axis=1))  # Triangles without an area have no way beyond them.
    middles = corners.mean(axis=1)
    for i in some[far_apart(middles[some], AGAIN_APART * radius)]:
        yield RimPlace(vector_of(middles[i]), vector_of(ups[i]), vector_of(ways[i]), radius)
