# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Whole objects to touch, by signed distances known in closed form; and the topology of a mesh."""

import itertools
import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

HAIR = 1e-12  # Distances below this share of the coordinates are rounding.
# A ray that goes on beside a wall after this many steps takes none shorter than the length.
MOST_STEPS, GRAZING = 2000, 1e-6


@dataclass(frozen=True)
class Solid:
    """Answers rays by sphere tracing: steps of its signed distance, from outside or from inside.

    distance : of a point (x, y, z), negative inside, and never larger than the true one
    start, outward : a point on it, and the normal there
    """

    distance: Callable
    start: tuple
    outward: tuple

    def ray_cast(self, origin, direction, distance):
        (x, y, z), (a, b, c), f = origin, direction, self.distance
        gone, side = 0.0, math.copysign(1.0, f(x, y, z))
        hair = HAIR * max(1.0, abs(x) + abs(y) + abs(z))
        for count in itertools.count():
            if gone > distance:
                return None
            step = side * f(x + gone * a, y + gone * b, z + gone * c)
            if step < hair and gone > 0.0:
                point = x + gone * a, y + gone * b, z + gone * c
                return point, self.normal(*point)
            gone += max(step, hair if count < MOST_STEPS else GRAZING)

    def normal(self, x, y, z, h=1e-6):
        f = self.distance
        n = f(x + h, y, z) - f(x - h, y, z), f(x, y + h, z) - f(x, y - h, z), f(x, y, z + h) - f(x, y, z - h)
        length = math.hypot(*n)
        return n[0] / length, n[1] / length, n[2] / length

    def distances(self, points):
        return np.array([self.distance(*p) for p in np.asarray(points).tolist()])

    def placed(self, scale=1.0, shift=(0.0, 0.0, 0.0)):
        """This solid elsewhere, in another unit."""
        u, v, w = shift
        return Solid(
            lambda x, y, z: scale * self.distance((x - u) / scale, (y - v) / scale, (z - w) / scale),
            tuple(scale * s + t for s, t in zip(self.start, shift, strict=True)),
            self.outward,
        )


def ball(radius=1.0):
    return Solid(lambda x, y, z: math.hypot(x, y, z) - radius, (0.0, 0.0, radius), (0.0, 0.0, 1.0))


def ring(big=1.0, small=0.4):
    """A torus around z."""
    return Solid(
        lambda x, y, z: math.hypot(math.hypot(x, y) - big, z) - small,
        (big + small, 0.0, 0.0),
        (1.0, 0.0, 0.0),
    )


def block(a=1.0, b=0.7, c=0.5):
    def distance(x, y, z):
        u, v, w = abs(x) - a, abs(y) - b, abs(z) - c
        return math.hypot(max(u, 0.0), max(v, 0.0), max(w, 0.0)) + min(max(u, v, w), 0.0)

    walls = tuple(
        (tuple(side * row), size) for row, size in zip(np.eye(3), (a, b, c), strict=True) for side in (1, -1)
    )
    return Convex(distance, (0.05, 0.03, c), (0.0, 0.0, 1.0), walls)


def rounded(radius, a=1.0, b=0.7, c=0.5):
    """A block whose edges and corners are rounded."""
    inner = block(a - radius, b - radius, c - radius)
    return Solid(lambda x, y, z: inner.distance(x, y, z) - radius, (0.05, 0.03, c), (0.0, 0.0, 1.0))


def slotted(width=0.1, depth=0.4):
    """A block with a slot along y."""
    whole = block()

    def distance(x, y, z):
        return max(whole.distance(x, y, z), -max(abs(x - 0.4) - width / 2.0, whole.walls[4][1] - depth - z))

    return Solid(distance, whole.start, whole.outward)


def pinned(radius=0.04, length=0.8):
    """A block with a pin that stands on it."""
    low = block(0.5, 0.5, 0.3)

    def distance(x, y, z):
        aside, along = math.hypot(x - 0.2, y - 0.1) - radius, abs(z - 0.3) - length
        pin = math.hypot(max(aside, 0.0), max(along, 0.0)) + min(max(aside, along), 0.0)
        return min(low.distance(x, y, z), pin)

    return Solid(distance, (-0.2, -0.1, 0.3), (0.0, 0.0, 1.0))


def prism(sides, radius=1.0, half=0.6):
    """A regular prism around z; its distance is that of the planes of its walls."""
    turns = 2.0 * np.pi * (np.arange(sides) + 0.5) / sides
    walls = [((math.cos(t), math.sin(t), 0.0), radius * math.cos(math.pi / sides)) for t in turns]
    walls += [((0.0, 0.0, 1.0), half), ((0.0, 0.0, -1.0), half)]
    normals, sizes = (np.array(values) for values in zip(*walls, strict=True))
    return Convex(
        lambda x, y, z: float((normals @ (x, y, z) - sizes).max()),
        (0.05, 0.03, half),
        (0.0, 0.0, 1.0),
        tuple(walls),
    )


def bracket(turn, inner=0.35, height=0.4):
    """Two walls of thickness `inner` that meet at a right angle, as an L of size 1; `turn` is (3, 3)."""
    rows = np.asarray(turn).tolist()

    def distance(x, y, z):
        u, v, w = (r[0] * x + r[1] * y + r[2] * z for r in rows)
        outer = max(abs(u - 0.5) - 0.5, abs(v - 0.5) - 0.5, abs(w) - 0.5 * height)
        return max(outer, min(u, v) - inner)

    along = np.asarray(turn)
    return Solid(
        distance,
        tuple((0.4 * along[0] + 0.1 * along[1] + 0.5 * height * along[2]).tolist()),
        tuple(along[2].tolist()),
    )


def cone(radius=0.4, height=1.0):
    """A cone on the plane z = 0, with its tip on z."""
    slope = math.hypot(radius, height)

    def distance(x, y, z):
        r = math.hypot(x, y)
        side = (height * (r - radius) + radius * z) / slope
        along = min(max((radius * (radius - r) + height * z) / slope, 0.0), slope)  # from the base to the tip
        on_side = math.hypot(r - radius + along * radius / slope, z - along * height / slope)
        if max(side, -z) <= 0.0:
            return max(side, -z)
        return min(on_side, math.hypot(max(r - radius, 0.0), z))

    return Solid(distance, (radius / 2.0, 0.0, height / 2.0), (height / slope, 0.0, radius / slope))


@dataclass(frozen=True)
class Convex(Solid):
    """A solid of flat walls, which answer rays at once: walking along a wall takes many steps.

    walls : outward unit normals n and lengths d; inside, n x < d for all of them
    """

    walls: tuple

    def edges(self, count):
        """`count` points on each edge, (k, 3)."""
        normals, sizes = (np.array(values) for values in zip(*self.walls, strict=True))
        found = []
        for i, j in zip(*np.triu_indices(len(sizes), 1), strict=True):
            along = np.cross(normals[i], normals[j])
            if np.linalg.norm(along) < 1e-9:
                continue
            rows = np.array([normals[i], normals[j], along])
            middle = np.linalg.solve(rows, [sizes[i], sizes[j], 0.0])
            room, slope = sizes - normals @ middle, normals @ along
            ends = np.divide(room, slope, out=np.zeros(len(room)), where=np.abs(slope) > 1e-9)
            low, high = ends[slope < -1e-9].max(), ends[slope > 1e-9].min()
            if low < high and (room[np.abs(slope) <= 1e-9] > -1e-9).all():
                found.append(middle + np.linspace(low, high, count)[:, None] * along)
        return np.vstack(found)

    def ray_cast(self, origin, direction, distance):
        enters, leaves = (-math.inf, None), (math.inf, None)
        for normal, size in self.walls:
            room = size - sum(n * o for n, o in zip(normal, origin, strict=True))
            slope = sum(n * d for n, d in zip(normal, direction, strict=True))
            if slope == 0.0 and room < 0.0:
                return None
            if slope < 0.0:
                enters = max(enters, (room / slope, normal), key=lambda at: at[0])
            elif slope > 0.0:
                leaves = min(leaves, (room / slope, normal), key=lambda at: at[0])
        gone, normal = enters if enters[0] > 0.0 else leaves
        if enters[0] > leaves[0] or not 0.0 < gone <= distance:
            return None
        return tuple(o + gone * d for o, d in zip(origin, direction, strict=True)), normal


def egg(across=0.6, along=1.0):
    """An ellipsoid around z; its distance is that of first order less a tenth, so as not to be too large."""

    def distance(x, y, z):
        r = math.hypot(x / across, y / across, z / along)
        steep = math.hypot(x / across**2, y / across**2, z / along**2)
        return min(across, along) * (r - 1.0) if steep < 1e-9 or r < 0.5 else 0.9 * r * (r - 1.0) / steep

    return Solid(distance, (0.0, 0.0, along), (0.0, 0.0, 1.0))


def ring_curvatures(points, big=1.0, small=0.4):
    """Gaussian and mean curvature (n,) of a ring at points (n, 3)."""
    out = np.hypot(points[:, 0], points[:, 1]) - big
    cosine = out / np.hypot(out, points[:, 2])
    k1, k2 = -1.0 / small, -cosine / (big + small * cosine)
    return k1 * k2, 0.5 * (k1 + k2)


def egg_curvatures(points, across=0.6, along=1.0):
    """Gaussian and mean curvature (n,) of an egg at points (n, 3)."""
    squares = np.array([across, across, along]) ** 2
    steep, product = (points**2 / squares**2).sum(axis=1), squares.prod()
    mean = ((points**2).sum(axis=1) - squares.sum()) / (2.0 * product * steep**1.5)
    return 1.0 / (product * steep**2), mean


@dataclass(frozen=True)
class Topology:
    """Edges with one triangle, edges with more than two, Euler's number, and the pieces."""

    open: int
    tangled: int
    euler: int
    pieces: int


def topology(triangles):
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    sides = np.sort(np.vstack([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]), axis=1)
    edges, counts = np.unique(sides, axis=0, return_counts=True)
    used = np.unique(triangles)
    n = len(used)
    ends = np.searchsorted(used, edges)
    pieces, _ = connected_components(coo_matrix((np.ones(len(ends)), tuple(ends.T)), (n, n)))
    return Topology(
        int((counts == 1).sum()), int((counts > 2).sum()), n - len(edges) + len(triangles), pieces
    )
