# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Sharp edges and corners of a mesh: vertices where the walls of two or three patches meet.

Beside the paper; like the extended marching cubes of Kobbelt et al. 2001. An edge of the mesh whose ends lie
on two walls crosses their crease. The end that is near the crease moves onto it, or the edge is split there.
At a corner one triangle has its vertices on three walls.
"""

from collections.abc import Generator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..arguments import Array
from ..patch.tetrahedra import Indices, sides_of, split_sides
from .charts import Charts
from .field import wall_facing

# python -m benchmarks.atlas judges these.
SHARP = 0.87  # Two walls meet at a crease where the cosine between their normals is less.
AWAY = 1.5  # A crease is at most so many edges of the mesh from the middle of the edge that crosses it.
SNAP = 0.35  # A vertex that is nearer to a crease than this share of an edge moves onto it.
NEWTON = 3  # The planes of walls are intersected so often.
ROUND = 0.25  # A crease that is farther than this share of an edge from another patch is rounded.
SIDES_AT_ONCE = 1000  # A step intersects so many walls.
LEAST = 1e-12  # Walls are parallel below this share of their squared sines.


class Creased(NamedTuple):
    """Vertices (n, 3), triangles (m, 3), and a vertex beside each of the last k vertices, `parents` (k,)."""

    vertices: Array
    triangles: Indices
    parents: Indices


def creased(
    charts: Charts, vertices: Array, triangles: Indices, normals: Array, edge: float
) -> Generator[float, None, Creased]:
    """The mesh with vertices on all creases and corners; yields the share that is done.

    normals : (n, 3), those of the walls on which the vertices (n, 3) lie
    edge : the length of the edges
    """
    vertices, free = vertices.copy(), np.ones(len(vertices), dtype=bool)
    sides = sides_of(triangles, len(vertices))
    yield 0.9
    sharp = np.einsum("ni,ni->n", normals[sides[:, 0]], normals[sides[:, 1]]) < SHARP
    sides = sides[sharp]
    beside = np.zeros(len(vertices), dtype=bool)
    beside[sides] = True
    some = triangles[beside[triangles].all(axis=1)]
    a, b, c = normals[some].transpose(1, 0, 2)
    turned = [np.einsum("ni,ni->n", u, v) < SHARP for u, v in ((a, b), (b, c), (c, a))]
    some = some[np.all(turned, axis=0)]
    corners, met = _intersections(charts, vertices[some], normals[some], edge)
    for corner, ends in zip(corners[met], some[met], strict=True):
        if free[ends].all():
            nearest = ends[np.argmin(((vertices[ends] - corner) ** 2).sum(axis=1))]
            vertices[nearest], free[nearest] = corner, False
    yield 0.9
    sides = sides[free[sides].all(axis=1)]
    parts = []
    for few in np.array_split(sides, len(sides) // SIDES_AT_ONCE + 1):
        parts.append(_intersections(charts, vertices[few], normals[few], edge))
        yield 0.9
    points, met = (np.concatenate(values) for values in zip(*parts, strict=True))
    sides, points = sides[met], points[met]
    away = np.linalg.norm(vertices[sides] - points[:, None], axis=2)
    nearer = away.argmin(axis=1)
    order = np.argsort(away.min(axis=1), kind="stable")
    order = order[away.min(axis=1)[order] < SNAP * edge]
    moved, first = np.unique(sides[order, nearer[order]], return_index=True)
    vertices[moved], free[moved] = points[order[first]], False
    left = free[sides].all(axis=1)
    split = split_sides(triangles, sides[left], len(vertices))
    return Creased(np.vstack([vertices, points[left]]), split, sides[left, 0])


def _intersections(
    charts: Charts, places: Array, normals: Array, edge: float
) -> tuple[Array, NDArray[np.bool_]]:
    """Points (n, 3) where walls meet, and whether they do (n,).

    places, normals : (n, 2 or 3, 3), a place on each wall, and its normal there
    """
    count, middle = normals.shape[1], places.mean(axis=1)
    apart = np.linalg.norm(places - np.roll(places, 1, axis=1), axis=2).max(axis=1)
    near = AWAY * np.maximum(edge, apart)
    points, met = middle.copy(), np.ones(len(places), dtype=bool)
    for _ in range(NEWTON):
        up = normals.copy()
        # Where no patch reaches, the wall goes on as a plane.
        distance = np.einsum("nki,nki->nk", points[:, None] - places, normals)
        for i in range(count):
            wall = wall_facing(charts, points, normals[:, i], near)
            there = wall.node >= 0
            up[there, i], distance[there, i] = wall.normal[there], wall.distance[there]
        gram = up @ np.swapaxes(up, 1, 2)
        for i in range(count):
            met &= np.abs(gram[:, i, i - 1]) < SHARP
        gram[~met] = np.eye(count)
        steps = np.linalg.solve(gram + LEAST * np.eye(count), distance[..., None])
        points -= np.where(met[:, None], (up * steps).sum(axis=1), 0.0)
        met &= np.linalg.norm(points - middle, axis=1) < near
    between = normals.sum(axis=1)
    between /= np.maximum(np.linalg.norm(between, axis=1, keepdims=True), LEAST)
    pairs = charts.pairs(points, edge)
    toward = np.einsum("mi,mi->m", pairs.normal, between[pairs.place])
    own = np.einsum("mi,mji->mj", pairs.normal, normals[pairs.place]).max(axis=1)
    rounded = (toward > own) & (pairs.share < 1.0) & (np.abs(pairs.distance) > 0.02 * edge)
    met[pairs.place[rounded]] = False
    return points, met
