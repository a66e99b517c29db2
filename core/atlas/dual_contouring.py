# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The surface of many patches as triangles: dual contouring (Ju et al. 2002) with the planes of patches.

Not in the paper. Each cell of a lattice that has corners inside and outside gets one vertex, at the place
nearest to the planes of the patches along its edges: on walls, creases and at corners that is one rule. Each
edge of the lattice between inside and outside gets a quadrilateral between the vertices of its four cells.
"""

from collections.abc import Generator
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..arguments import Array
from ..steps import chunked
from ..triangles import normalized, row_dot, triangle_cross
from .charts import Charts
from .connectivity import Indices
from .field import INSIDE, Blend, nearest_sheet, sheet_facing
from .indicator import Indicator
from .lattice import Lattice, lattice_at_level, turned

# python -m benchmarks.atlas --shapes judges these.
VALID = 0.5
LEVEL = 1e-6  # The level of the indicator weighs this much beside patches.
FACING = 0.95  # A sheet faces as a vertex does if the cosine between their normals is more.
BAND = 2.0  # Patches count within this many cells of the indicator, or of the lattice, of a point.
ALIKE = 0.87  # Normals at both ends of an edge are of one wall if the cosine between them is more.
SOFT = 0.03  # Planes that together turn less than this do not move a vertex along themselves.
SLACK = 1.0  # A vertex is at most this many pitches outside of its cell: a crease may be beside it.
SWEEPS = 12  # A vertex that is held in its cell is moved along each axis this often.
PLACES_AT_ONCE = 3000  # A step takes this many places.


class Sides(NamedTuple):
    """The nearest sheets of patches that put places (n,) inside, and of those that put them outside.

    Where there are none it is the nearest sheet, and the level of the indicator where there is no patch.
    """

    inside: Blend
    outside: Blend
    side: Array  # (n,), -1 where all patches put a place inside, 1 where all put it outside, 0 elsewhere


class Surface(NamedTuple):
    """Vertices (n, 3) and triangles (m, 3), counterclockwise from outside.

    std, patch : (n,), the deviation of the surface, and the patch of most weight; inf and -1 where none is
    rho : (m,), how far out triangles are on the patch where they are least so; inf where no patch is
    """

    vertices: Array
    triangles: Indices
    std: Array
    patch: Indices
    rho: Array


def dual_contour(charts: Charts, indicator: Indicator, pitch: float) -> Generator[float, None, Surface]:
    """The closed surface of patches, with edges about as long as the pitch; yields the share that is done."""
    band = BAND * max(indicator.cell, pitch)
    lattice, edges, points, sides = yield from _sides_of_points(charts, indicator, pitch, band)
    lower = edges // 3
    places, planes = _planes(lattice, sides, points, edges)
    yield 0.7
    u, v = lattice.strides[(edges + 1) % 3], lattice.strides[(edges + 2) % 3]
    quads = np.stack([lower, lower - u, lower - u - v, lower - v], axis=1)
    outside = ~lattice.inside(lower)
    quads[outside] = quads[outside, ::-1]
    cells, index = np.unique(quads, return_inverse=True)
    quads = index.reshape(-1, 4)
    yield 0.7
    vertices, up = _vertices(quads, places, planes, lattice.places(cells), pitch)
    yield 0.8
    own = _least_uncertain(quads, planes, len(cells))
    move = partial(_on_sheet, charts, SLACK * pitch)
    vertices, *sheet = yield from chunked(move, PLACES_AT_ONCE, 0.9, vertices, up, *own)
    return Surface(vertices, _cut(vertices, quads, planes.normal), sheet[1], sheet[3], np.tile(planes.rho, 2))


def _sides(charts: Charts, indicator: Indicator, band: float, places: Array) -> tuple[Array, ...]:
    """The fields of the Sides of places (n, 3): patches within a length of these count."""
    pairs, count = charts.pairs(places, band), len(places)
    every, side, found = nearest_sheet(charts, pairs, count), np.zeros(count), []
    for way in (-1.0, 1.0):
        some = pairs.chosen(np.sign(pairs.distance) == way)
        sheet = nearest_sheet(charts, some, count)
        side += np.where(sheet.patch < 0, 0.0, way)
        found += [*sheet.where(sheet.patch >= 0, every)]
    is_near = (every.rho < INSIDE) & (np.abs(every.distance) < indicator.cell)
    return *found, np.where(is_near, side, 0.0)


def _sides_of_points(
    charts: Charts, indicator: Indicator, pitch: float, band: float
) -> Generator[float, None, tuple[Lattice, Indices, Indices, Sides]]:
    """A lattice, its edges between inside and outside, the points at their ends, in order, and their Sides.

    The indicator's level is up to a cell inside of a convex crease, and outside of a concave one. Points
    within that which all patches put on their other side are turned, layer by layer.
    """
    lattice, edges = yield from lattice_at_level(indicator, pitch)
    points, fields = np.zeros(0, dtype=np.intp), None
    layers = int(np.ceil(indicator.cell / pitch)) + 1
    for layer in range(layers + 1):
        new = np.setdiff1d(lattice.ends(edges), points)
        parts = yield from chunked(
            partial(_sides, charts, indicator, band), PLACES_AT_ONCE, 0.6, lattice.places(new)
        )
        points = np.append(points, new)
        order = np.argsort(points, kind="stable")
        points = points[order]
        fields = parts if fields is None else [
            np.concatenate(both)[order] for both in zip(fields, parts, strict=True)
        ]
        side = fields[-1]
        if layer == layers:
            break
        wrong = points[(side != 0.0) & ((side < 0.0) != lattice.inside(points))]
        lattice, done = turned(lattice, wrong)
        if not len(done):
            break
        edges = lattice.crossed(np.union1d(edges, lattice.edges_around(done)))
        yield 0.6
    return lattice, edges, points, Sides(Blend(*fields[:5]), Blend(*fields[5:10]), side)


def _planes(lattice: Lattice, sides: Sides, points: Indices, edges: Indices) -> tuple[Array, Blend]:
    """Where the surface crosses edges (n,), (n, 3), and the sheets there.

    At a convex crease it is the first plane of both ends from inside, and the last at a concave one. Where
    the plane of neither end crosses the edge, it is the level of the indicator, which has no patch.
    """
    one, other = lattice.ends(edges)
    inside = lattice.inside(one)
    start, end = np.where(inside, one, other), np.where(inside, other, one)
    a = Blend(*(values[np.searchsorted(points, start)] for values in sides.inside))
    b = Blend(*(values[np.searchsorted(points, end)] for values in sides.outside))
    origin = lattice.places(start)
    way = lattice.places(end) - origin
    at_end, at_start = a.distance + row_dot(a.normal, way), b.distance - row_dot(b.normal, way)
    of_a, of_b = _zero(a.distance, at_end), _zero(at_start, b.distance)
    missed = np.array(
        [
            np.where((sheet.patch >= 0) & (last > first), np.maximum(np.abs(at - 0.5) - 0.5, 0.0), np.inf)
            for sheet, first, last, at in ((a, a.distance, at_end, of_a), (b, at_start, b.distance, of_b))
        ]
    )
    by_a, by_b = (missed <= missed.min(axis=0)) & (missed < VALID)
    apart = way - b.distance[:, None] * b.normal + a.distance[:, None] * a.normal
    is_convex = row_dot(b.normal - a.normal, apart) > 0.0
    is_a = by_a & ~by_b
    found, at = a.where(is_a, b), np.where(is_a, of_a, of_b)
    level = np.clip(_zero(lattice.indicator.at(origin), lattice.indicator.at(origin + way)), 0.0, 1.0)
    none = ~by_a & ~by_b
    places = origin + np.where(none, level, at)[:, None] * way
    up = lattice.indicator.outward(places)
    unfelt = Blend(level, np.full(len(at), np.inf), up, np.full(len(at), -1), np.full(len(at), np.inf))
    return places, unfelt.where(none, found)


def _zero(a: Array, b: Array) -> Array:
    """The share of the way from values a (n,) to values b (n,) where a line between them is 0."""
    return a / np.where(a == b, 1.0, a - b)


def _least_uncertain(quads: Indices, planes: Blend, count: int) -> Blend:
    """The sheets of the planes of least deviation around each of `count` cells."""
    order = np.argsort(-planes.std, kind="stable")
    best = np.zeros(count, dtype=np.intp)
    best[quads[order]] = order[:, None]
    return Blend(*(values[best] for values in planes))


def _vertices(quads: Indices, places: Array, planes: Blend, corners: Array, pitch: float) -> tuple[Array, Array]:
    """The vertices (m, 3) of cells whose lowest corners are given, (m, 3), and mean normals (m, 3) there.

    quads : (n, 4), the cells around planes (n,) through places (n, 3)
    """
    count, normals = len(corners), planes.normal
    weights = np.repeat(np.where(planes.patch < 0, LEVEL, 1.0), 4)
    total = np.bincount(quads.ravel(), weights, count)

    def mean(values: Array) -> Array:
        """Means (m,) over the planes around each cell."""
        return np.bincount(quads.ravel(), weights * np.repeat(values, 4), count) / total

    middle, up = (np.stack([mean(v) for v in values.T], axis=1) for values in (places, normals))
    square = np.empty((count, 3, 3))
    for i, j in ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)):
        square[:, i, j] = square[:, j, i] = mean(normals[:, i] * normals[:, j])
    off = row_dot(normals, places)
    right = np.stack([mean(n * off) for n in normals.T], axis=1) - np.einsum("mij,mj->mi", square, middle)
    # Least squares of the normal equations, held at the middle where planes hardly turn.
    right = np.einsum("mij,mj->mi", square, right)
    square = square @ square + SOFT**2 * np.eye(3)
    step = np.linalg.solve(square, right[..., None])[..., 0]
    low, high = corners - SLACK * pitch - middle, corners + (1.0 + SLACK) * pitch - middle
    out = np.flatnonzero(((step < low) | (step > high)).any(axis=1))
    held, low, high = np.clip(step[out], low[out], high[out]), low[out], high[out]
    for _ in range(SWEEPS):  # coordinate descent to the least squares in the box
        for i in range(3):
            left = right[out, i] - row_dot(square[out, i], held)
            held[:, i] = np.clip(held[:, i] + left / square[out, i, i], low[:, i], high[:, i])
    step[out] = held
    return middle + step, up


def _on_sheet(
    charts: Charts, reach: float, vertices: Array, up: Array, *own: Array
) -> tuple[Array, ...]:
    """Vertices (n, 3) moved onto the sheet that faces as they do, and the fields of the sheets at them.

    On a crease none does: what is left there are the sheets of its planes.

    reach : vertices within this length of the sheet move
    up : (n, 3), mean normals of planes; own : the fields of the sheets of one of these
    """
    up = normalized(up)
    sheet = sheet_facing(charts, vertices, up, 2.0 * reach)
    is_facing = (row_dot(sheet.normal, up) > FACING) & (np.abs(sheet.distance) < reach)
    moved = vertices - np.where(is_facing, sheet.distance, 0.0)[:, None] * sheet.normal
    return moved, *sheet.where(is_facing, Blend(*own))


def _cut(vertices: Array, quads: Indices, normals: Array) -> Indices:
    """Quadrilaterals (n, 4) cut along the diagonal whose triangles (2 n, 3) face as their planes do."""
    def facing(some: Indices) -> Array:
        return np.min([row_dot(normalized(triangle_cross(vertices[some[:, each]])), normals)
                       for each in ([0, 1, 2], [0, 2, 3])], axis=0)
    other = np.roll(quads, -1, axis=1)
    quads = np.where((facing(quads) >= facing(other))[:, None], quads, other)
    return np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
