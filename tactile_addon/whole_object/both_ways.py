# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""How far a surface is off the mesh that was touched, and back, all over their faces; and why that is."""

import math
from collections.abc import Callable, Generator, Iterator, Mapping
from itertools import product
from typing import Any, TypeAlias

import numpy as np
from mathutils.bvhtree import BVHTree

from ... import core
from ...core.steps import part_of
from ...core.triangles import middles_of_parts, normalized, triangle_cross
from ..touch.detached_mesh import DetachedMesh
from ..touch.types import Array, Point
from ..touch.units import say_of

PLACES, SEED = 10_000, 0  # The number of places on the faces of each, and the most vertices, to compare.
STARTS = 24  # From so many of them the farthest place of all is looked for, as in `_climb`,
MOVES = 20  # by so many moves, half as long after each that would lead back.
AT_ONCE, BACK_AT_ONCE = 1000, 300  # The number of places of the surface, or of the mesh, for a step.
LIFT = 1e-4  # Rays begin this share of the size away from a place.
# The indicator of a surface has at most 200 cells along the object, of which a wall needs three.
THIN_SHARE = 3.0 / 200.0
HIDDEN_SHARE = 0.1  # A place is nearly hidden if at most this share of the rays around it meets nothing.
AXES = np.vstack([np.eye(3), -np.eye(3)])
# The directions from a place, 50: along the axes, as the holes of parts are, and between these.
WAYS = [way for way in product(range(-2, 3), repeat=3) if math.gcd(*way) == 1 and math.hypot(*way) < 2.3]
DIRECTIONS = normalized(np.array(WAYS, dtype=float))

Nearest: TypeAlias = Callable[[Point], tuple[Point, float]]


class BothWays:
    """The deviations of a surface from the mesh that was touched, and back, found step by step.

    deviation : (n,), signed distances of the surface from the mesh, positive outside it: of each vertex, or
        of a place on a face around it that is farther off, as both ends of a long edge may be on the mesh
    mean : the mean distance of the surface from the mesh and of the mesh from the surface, by area
    within : the smaller share of both areas, of surface and mesh, that is within the tolerance of the other
    felt : the share of the mesh's area that is
    largest, place : the largest distance of either from the other, and where that is, (3,)

    Places of the mesh that no finger could reach, because the mesh hides them, do not count.
    """

    def __init__(self, target: DetachedMesh, mesh: core.Mesh, tolerance: float) -> None:
        """`target` is the DetachedMesh that was touched, and `mesh` the core.Mesh of what was felt."""
        self._target, self._mesh, self._tolerance = target, mesh, tolerance
        self.deviation = np.zeros(len(mesh.vertices))
        self.mean, self.within, self.felt = 0.0, 1.0, 1.0
        self.largest, self.place = 0.0, mesh.vertices[0]
        self._apart = 0.0  # How far places are apart, about.

    def steps(self) -> Iterator[float]:
        """Does everything, as a generator that yields the share that is done."""
        vertices, corners = self._mesh.vertices, self._mesh.vertices[self._mesh.triangles]
        yield 0.0
        yield from part_of(self._off_target(vertices, self._mesh.normals, self.deviation), 0.0, 0.3)
        across = triangle_cross(corners)
        shares = middles_of_parts(max(round(math.sqrt(PLACES / len(corners))), 1))
        middles = (shares @ corners).reshape(-1, 3)
        off = np.zeros(len(middles))
        yield 0.3
        normals = np.repeat(normalized(across), len(shares), axis=0)
        yield from part_of(self._off_target(middles, normals, off), 0.3, 0.6)
        self._spread(off.reshape(-1, len(shares)))
        there, areas = np.abs(off), np.repeat(np.linalg.norm(across, axis=1), len(shares))
        self._apart = math.sqrt(0.5 * float(areas.sum()) / PLACES)
        yield 0.6
        self._tree = BVHTree.FromPolygons(
            vertices.tolist(), self._mesh.triangles.tolist(), all_triangles=True
        )
        yield 0.7
        yield from part_of(self._climb(middles, there, self._to_surface, self._to_mesh), 0.7, 0.8)
        target, rng = self._target, np.random.default_rng(SEED)
        spread, _ = core.scattered(target.points, target.triangles, PLACES, rng)
        felt, back = yield from self._off_surface(spread)
        ends = target.points[target.has_face]
        yield from self._off_surface(ends[:: len(ends) // PLACES + 1])
        yield from part_of(self._climb(felt, back, self._to_mesh, self._to_seen), 0.8, 1.0)
        back = back if len(back) else np.zeros(1)
        self.mean = 0.5 * float(np.average(there, weights=areas) + back.mean())
        self.felt = float((back <= self._tolerance).mean())
        self.within = min(float(np.average(there <= self._tolerance, weights=areas)), self.felt)

    def _off_target(self, points: Array, normals: Array, off: Array) -> Generator[float, None, None]:
        """Fills in the signed distances (n,) of points (n, 3) of the surface; yields the share done."""
        for start in range(0, len(points), AT_ONCE):
            some = slice(start, start + AT_ONCE)
            gaps = points[some] - self._target.feet(points[some])
            found = np.linalg.norm(gaps, axis=1)
            off[some] = np.copysign(found, np.sum(gaps * normals[some], axis=1))
            self._note(points[some], found)
            yield start / len(points)

    def _spread(self, off: Array) -> None:
        """Gives vertices the largest of the distances (m, p) on faces around them, if these are larger."""
        off = off[np.arange(len(off)), np.abs(off).argmax(axis=1)]
        order, around = np.argsort(np.abs(off)), np.zeros(len(self.deviation))
        around[self._mesh.triangles[order]] = off[order][:, None]  # The last, which is the largest, stays.
        farther = np.abs(around) > np.abs(self.deviation)
        self.deviation[farther] = around[farther]

    def _off_surface(self, points: Array) -> Generator[float, None, tuple[Array, Array]]:
        """Those points (n, 3) of the mesh that are not hidden, and how far they are off; yields the share."""
        seen: list[int] = []
        found: list[float] = []
        for number, point in enumerate(points.tolist()):
            off = self._to_surface(point)[1]
            if off <= self._tolerance or not self._is_hidden(points[number]):
                seen.append(number)
                found.append(off)
            if number % BACK_AT_ONCE == 0:
                yield 0.8
        self._note(points[seen], np.array(found))
        return points[seen], np.array(found)

    def _climb(
        self, places: Array, off: Array, to_same: Nearest, to_other: Nearest
    ) -> Generator[float, None, None]:
        """Goes on from the farthest of places (n, 3), at distances (n,), to where it is farther still.

        to_same, to_other : the nearest place on their own surface, or on the other, and its distance
        """
        for number, place in enumerate(places[np.argsort(off)[::-1][:STARTS]]):
            ahead, best = self._apart, to_other(place.tolist())[1]
            for _ in range(MOVES):
                around = [to_same(beside)[0] for beside in (place + ahead * AXES).tolist()]
                farther = [to_other(beside)[1] for beside in around]
                if max(farther) > best:
                    best = max(farther)
                    place = np.array(around[farther.index(best)])
                else:
                    ahead *= 0.5
            self._note(place[None], np.array([best]))
            yield number / STARTS

    def _to_mesh(self, point: Point) -> tuple[Point, float]:
        """The place of the mesh nearest to a point, and its distance."""
        (place,) = self._target.feet(np.array([point])).tolist()
        return place, math.dist(place, point)

    def _to_surface(self, point: Point) -> tuple[Point, float]:
        """The place of the surface nearest to a point, and its distance."""
        place, _, _, distance = self._tree.find_nearest(point)
        return place, distance

    def _to_seen(self, point: Point) -> tuple[Point, float]:
        """The place of the surface nearest to one of the mesh, and its distance; 0 if that one is hidden."""
        place, distance = self._to_surface(point)
        if distance > self.largest and self._is_hidden(np.array(point)):
            return place, 0.0
        return place, distance

    def _is_hidden(self, point: Array) -> bool:
        """Whether rays from a place of the mesh meet it again in all directions."""
        return all(math.isfinite(room(self._target, point, way)) for way in DIRECTIONS)

    def _note(self, points: Array, off: Array) -> None:
        """Keeps the largest of the distances (n,) of points (n, 3)."""
        if len(off) and off.max() > self.largest:
            self.largest, self.place = float(off.max()), points[np.argmax(off)]


def room(surface: DetachedMesh, place: Array, way: Array) -> float:
    """How far the next wall is from a place of the mesh along a direction; inf if there is none."""
    start = (place + LIFT * surface.size * way).tolist()
    hit = surface.ray_cast(start, way.tolist(), 2.0 * surface.size)
    return math.inf if hit is None else math.dist(hit[0], place)


def why_far(
    surface: DetachedMesh,
    place: Array,
    off: float,
    patch: core.Reconstruction | None,
    report: Mapping[str, Any],
) -> core.Doubt | None:
    """The doubt about a place (3,) where mesh and surface are `off` apart; None without a cause.

    patch : what was felt nearest to the place, if anything was; report : whose unit lengths have
    """
    foot, normal = (np.array(vector) for vector in surface.project(place.tolist())[:2])
    narrow = narrowest(surface, foot, normal)
    words = say_of(report, off), say_of(report, narrow)
    # Where the edge itself is nearest, both are the same length, but for rounding.
    if surface.open_edge_distance(place) <= 1.001 * off:
        code = "open_edges"
    elif narrow <= THIN_SHARE * surface.size:
        code = "narrow"
    elif _free_share(surface, foot, normal) <= HIDDEN_SHARE:
        code = "hidden"
    elif patch is not None and surface.is_of_facets(patch):
        code = "single_facets"
    else:
        return None
    return core.Doubt(code, off, words=words)


def narrowest(surface: DetachedMesh, foot: Array, normal: Array) -> float:
    """How far the next wall is from a place of the mesh, above it or below it."""
    return min(room(surface, foot, sign * normal) for sign in (-1.0, 1.0))


def _free_share(surface: DetachedMesh, foot: Array, normal: Array) -> float:
    """The share of rays on the outer side of a place of the mesh that meet nothing."""
    ways = DIRECTIONS[DIRECTIONS @ normal > 0.0]
    return sum(math.isinf(room(surface, foot, way)) for way in ways) / len(ways)
