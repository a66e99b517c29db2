# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Sharp edges and corners of a mesh: vertices where the sheets of two or three patches meet.

Not in the paper; like the extended marching cubes of Kobbelt et al. 2001. An edge of the mesh whose ends lie
on two sheets crosses their crease. The end that is near the crease moves onto it, or the edge is split there.
At a corner one triangle has its vertices on three sheets.
"""

from collections.abc import Generator, Iterator

import numpy as np
from numpy.typing import NDArray

from ..arguments import Array
from ..steps import chunked
from ..triangles import normalized, row_dot
from .charts import Charts
from .field import sheet_facing
from .tetrahedra import Indices, sides_of, split_sides

# python -m benchmarks.atlas judges these.
SHARP = 0.87  # Two sheets meet at a crease where the cosine between their normals is less.
AWAY = 1.5  # A crease is at most this many edges of the mesh from the middle of the edge that crosses it.
SNAP = 0.35  # A vertex that is nearer to a crease than this share of an edge moves onto it.
NEWTON = 3  # The planes of sheets are intersected this often.
ROUND = 0.02  # A crease that is farther than this share of an edge from another patch is rounded.
SIDES_AT_ONCE = 1000  # A step intersects this many sheets.
LEAST = 1e-12  # Sheets are parallel below this share of their squared sines.


def insert_creases(
    charts: Charts, vertices: Array, triangles: Indices, normals: Array, edge: float
) -> Generator[float, None, tuple[Array, Indices, Indices, Array]]:
    """The mesh with vertices on all creases and corners; yields the share that is done.

    normals : (n, 3), those of the sheets on which the vertices (n, 3) lie
    edge : the length of the edges

    Returns vertices (n + k, 3) and triangles (m, 3); for each of the k new vertices an old one next to it,
    (k,); and how far from what patches reach the vertices are that moved or came, (n + k,).
    """
    vertices, free, unfelt = vertices.copy(), np.ones(len(vertices), dtype=bool), np.zeros(len(vertices))
    sides = sides_of(triangles, len(vertices))
    yield 0.9
    sides = sides[row_dot(normals[sides[:, 0]], normals[sides[:, 1]]) < SHARP]
    at_crease = np.bincount(sides.ravel(), minlength=len(vertices)) > 0
    some = triangles[at_crease[triangles].all(axis=1)]
    a, b, c = normals[some].transpose(1, 0, 2)
    some = some[np.all([row_dot(u, v) < SHARP for u, v in ((a, b), (b, c), (c, a))], axis=0)]
    for corner, beyond, at in _corners(charts, vertices, normals, some, edge):
        vertices[at], unfelt[at], free[at] = corner, beyond, False
    yield 0.9
    sides = sides[free[sides].all(axis=1)]
    points, off, met = yield from chunked(
        lambda places, ups: _intersections(charts, places, ups, edge),
        SIDES_AT_ONCE,
        0.9,
        vertices[sides],
        normals[sides],
    )
    sides, points, off = sides[met], points[met], off[met]
    moved, to = _nearest(vertices, sides, points, edge)
    vertices[moved], unfelt[moved], free[moved] = points[to], off[to], False
    left = free[sides].all(axis=1)
    split = split_sides(triangles, sides[left], len(vertices))
    unfelt = np.concatenate([unfelt, off[left]])
    return np.vstack([vertices, points[left]]), split, sides[left, 0], unfelt


def _nearest(vertices: Array, sides: Indices, points: Array, edge: float) -> tuple[Indices, Indices]:
    """The ends of sides that are near to the points (n, 3) on these, and the point nearest to each."""
    away = np.linalg.norm(vertices[sides] - points[:, None], axis=2)
    order = np.argsort(away.min(axis=1), kind="stable")
    order = order[away.min(axis=1)[order] < SNAP * edge]
    ends, first = np.unique(sides[order, away.argmin(axis=1)[order]], return_index=True)
    return ends, order[first]


def _corners(
    charts: Charts, vertices: Array, normals: Array, triangles: Indices, edge: float
) -> Iterator[tuple[Array, float, int]]:
    """Corners (3,) of triangles on three sheets, how far patches are from there, and vertices to move.

    Near a tip several triangles have the same corner: the vertex is of as many of these as possible.
    """
    corners, off, met = _intersections(charts, vertices[triangles], normals[triangles], edge)
    corners, off, triangles = corners[met], off[met], triangles[met]
    while len(corners):
        same = np.linalg.norm(corners - corners[0], axis=1) < SNAP * edge
        ends, counts = np.unique(triangles[same], return_counts=True)
        ends = ends[counts == counts.max()]
        nearest = ends[np.argmin(((vertices[ends] - corners[0]) ** 2).sum(axis=1))]
        yield corners[0], float(off[0]), int(nearest)
        left = ~same & (triangles != nearest).all(axis=1)
        corners, off, triangles = corners[left], off[left], triangles[left]


def _intersections(
    charts: Charts, places: Array, normals: Array, edge: float
) -> tuple[Array, Array, NDArray[np.bool_]]:
    """The points (n, 3) where sheets meet, how far patches are from there (n,), and whether they meet (n,).

    places, normals : (n, 2 or 3, 3), a place on each sheet, and its normal there
    """
    count, middle = normals.shape[1], places.mean(axis=1)
    longest = np.linalg.norm(places - np.roll(places, 1, axis=1), axis=2).max(axis=1)
    near = AWAY * np.maximum(edge, longest)
    points, met = middle.copy(), np.ones(len(places), dtype=bool)
    for _ in range(NEWTON):
        up, felt = normals.copy(), np.zeros(len(places), dtype=bool)
        # Where no patch reaches, the sheet goes on as a plane.
        distance = row_dot(points[:, None] - places, normals)
        for i in range(count):
            sheet = sheet_facing(charts, points, normals[:, i], near)
            there = sheet.patch >= 0
            felt |= there
            up[there, i], distance[there, i] = sheet.normal[there], sheet.distance[there]
        steps, apart = _least_norm_steps(up, distance)
        met &= apart
        points += np.where(met[:, None], steps, 0.0)
        met &= np.linalg.norm(points - middle, axis=1) < near
    if count == 3:  # Near a tip the sheets of patches merge, but the planes of the vertices still meet there.
        distance = row_dot(middle[:, None] - places, normals)
        steps, apart = _least_norm_steps(normals, distance)
        tip = ~met & apart & (np.linalg.norm(steps, axis=1) < near)
        points, met, felt = np.where(tip[:, None], middle + steps, points), met | tip, felt & ~tip
    between = normalized(normals.sum(axis=1))
    pairs = charts.pairs(points, edge)
    toward = row_dot(pairs.normal, between[pairs.point_index])
    own = np.einsum("mi,mji->mj", pairs.normal, normals[pairs.point_index]).max(axis=1)
    rounded = (toward > own) & (pairs.rho < 1.0) & (np.abs(pairs.distance) > ROUND * edge)
    met[pairs.point_index[rounded]] = False
    return points, np.where(felt, 0.0, np.linalg.norm(points - middle, axis=1)), met


def _least_norm_steps(normals: Array, distance: Array) -> tuple[Array, NDArray[np.bool_]]:
    """The least steps (n, 3) onto k planes, -N' (N N')^-1 d, with normals N (n, k, 3) at distances d (n, k).

    Also whether each pair of planes is turned by SHARP, (n,).
    """
    gram, count = normals @ np.swapaxes(normals, 1, 2), normals.shape[1]
    apart = np.all([np.abs(gram[:, i, i - 1]) < SHARP * gram[:, i, i] for i in range(count)], axis=0)
    gram[~apart] = np.eye(count)
    steps = np.linalg.solve(gram + LEAST * np.eye(count), distance[..., None])
    return -(normals * steps).sum(axis=1), apart
