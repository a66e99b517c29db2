# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The surface of many patches as triangles: dual contouring (Ju et al. 2002) with the planes of patches.

Not in the paper. Each cell of a lattice with corners inside and outside gets one vertex, at the place nearest
to the planes of the patches along its edges: on walls, creases and at corners that is one rule. Each edge of
the lattice between inside and outside gets a quadrilateral between the vertices of its four cells.
"""

from collections.abc import Generator
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from ..arguments import Array
from ..steps import chunked
from ..triangles import normalized, row_dot, triangle_cross
from .charts import PLACES_AT_ONCE, Charts
from .connectivity import Indices
from .field import INSIDE, Blend, nearest_sheet, sheet_facing
from .indicator import Indicator
from .lattice import Lattice, lattice_at_level, turned

# python -m benchmarks.atlas --shapes judges these.
BAND = 1.5  # Patches count within this many cells of the indicator, or pitches, of a point.
CROSSED = 0.5  # A plane that passes an edge by this many pitches counts as well, if no other crosses it.
# Walls that meet go on to this share of their rims, which are a little short at corners: with 1 and with
CORNER = 1.02  # 1.06 more corners of boxes and brackets are cut by over a tolerance.
SLACK = 1.0  # A vertex is at most this many pitches outside of its cell: the tip of a crease may be there.
SOFT = 0.07  # A vertex does not move along planes that turn less, as mean squares of their sines: with .02 a
# surface without creases has folds, as around Suzanne's eyes (some three times as many).
ITERATIONS = 4  # With one, a cube's edges are off by 1e-4 of its size.
# Vertices start this share of the way from where edges are crossed to the centers of cells: next to a point
# of the lattice all these places are one. Without, an ellipsoid has folds; with .5 some edges are cut.
CENTERED = 0.15
LEVEL = 1e-6  # The weight of the indicator's level beside planes of patches.
FACING = 0.95  # A sheet faces as the planes of a vertex do if the cosine between their normals is more.
# A quadrilateral whose diagonals are this many pitches apart has a vertex of its own, at the place nearest to
BENT = 0.1  # the planes around its four cells. Without, an L is off by over five tolerances at its corners.


class Sides(NamedTuple):
    """Sheets near the points of a lattice (n,).

    points : (n,), in order
    nearest : the sheets of the nearest patches
    inside, outside : those of the nearest patches that put the points inside or outside
    side : (n,), -1 or 1 if patches put them inside or outside, and no patch near denies it; otherwise
        0, and also beyond the rims of all patches
    """

    points: Indices
    nearest: Blend
    inside: Blend
    outside: Blend
    side: Array


class Surface(NamedTuple):
    """Vertices (n, 3) and triangles (m, 3), counterclockwise from outside.

    std, patch : (n,), the deviation of the surface, and the patch of most weight; inf and -1 where none is
    rho, triangle_rho : (n,) and (m,), how far out they are on the patch where they are least so, or inf
    """

    vertices: Array
    triangles: Indices
    std: Array
    patch: Indices
    rho: Array
    triangle_rho: Array


def dual_contour(charts: Charts, indicator: Indicator, pitch: float) -> Generator[float, None, Surface]:
    """The closed surface of patches, with edges about as long as the pitch; yields the share that is done."""
    from scipy.sparse import csr_array

    lattice, edges, sides = yield from _turned_at_creases(charts, indicator, pitch)
    places, planes = _planes(lattice, sides, edges)
    yield 0.7
    lower, axis = np.divmod(edges, 3)
    u, v = lattice.strides[(axis + 1) % 3], lattice.strides[(axis + 2) % 3]
    quads = np.stack([lower, lower - u, lower - u - v, lower - v], axis=1)
    outside = ~lattice.inside(lower)
    quads[outside] = quads[outside, ::-1]
    cells, index = np.unique(quads, return_inverse=True)
    quads = index.reshape(-1, 4)
    yield 0.7
    ends = np.arange(0, quads.size + 1, 4)
    around = csr_array((np.ones(quads.size), quads.ravel(), ends), (len(quads), len(cells)))
    vertices, up = _vertices(around.T, places, planes, lattice.places(cells) + 0.5 * pitch, pitch)
    quads, bent = _cut(vertices, quads, planes.normal, pitch)
    centers = vertices[quads[bent]].mean(axis=1)
    middles = _vertices(around[bent] @ around.T, places, planes, centers, pitch)
    vertices, up = (np.concatenate(both) for both in zip((vertices, up), middles, strict=True))
    yield 0.8
    own = planes.at(np.append(_least_uncertain(quads, planes, len(cells)), bent))
    steps = chunked(partial(_on_sheet, charts, pitch), PLACES_AT_ONCE, 0.9, vertices, up, *own)
    vertices, *fields = yield from steps
    sheet = Blend(*fields)
    triangles, quad = _triangles(quads, bent, len(cells))
    return Surface(vertices, triangles, sheet.std, sheet.patch, sheet.rho, planes.rho[quad])


def _turned_at_creases(
    charts: Charts, indicator: Indicator, pitch: float
) -> Generator[float, None, tuple[Lattice, Indices, Sides]]:
    """A lattice, its edges (n,) whose ends are on different sides, and the Sides of these ends.

    The level of the indicator is up to a cell inside of a convex crease, and outside of a concave one. Points
    that are that near to the level, and that patches put on their other side, are turned layer by layer.
    """
    lattice, edges = yield from lattice_at_level(indicator, pitch)
    layers, band = int(np.ceil(indicator.cell / pitch)) + 1, BAND * max(indicator.cell, pitch)
    some = partial(_sides, charts, band)
    points = np.unique(lattice.ends(edges))
    fields = yield from chunked(some, PLACES_AT_ONCE, 0.6, lattice.places(points))
    for _ in range(layers):
        side = fields[-1]
        wrong = points[(side != 0.0) & ((side < 0.0) != lattice.inside(points))]
        lattice, done = turned(lattice, wrong)
        edges = lattice.crossed(np.union1d(edges, lattice.edges_around(done)))
        new = np.setdiff1d(lattice.ends(edges), points)
        parts = yield from chunked(some, PLACES_AT_ONCE, 0.6, lattice.places(new))
        points = np.append(points, new)
        order = np.argsort(points, kind="stable")
        points = points[order]
        fields = tuple(np.concatenate(both)[order] for both in zip(fields, parts, strict=True))
    count = len(Blend._fields)
    nearest, inside, outside = (Blend(*fields[i * count : (i + 1) * count]) for i in range(3))
    return lattice, edges, Sides(points, nearest, inside, outside, fields[-1])


def _sides(charts: Charts, band: float, places: Array) -> tuple[Any, ...]:
    """The fields of the Sides of places (n, 3), by the patches within the length `band` of these."""
    pairs, count = charts.pairs(places, band), len(places)
    sheets, side = [*nearest_sheet(charts, pairs, count)], np.zeros(count)
    for way in (-1.0, 1.0):
        some = pairs.chosen(np.sign(pairs.distance) == way)
        side += way * (np.bincount(some.point_index, minlength=count) > 0)
        sheets += nearest_sheet(charts, some, count)
    # A wall ends at its rim. Where it meets another, both go on to the corner.
    up = np.stack([np.bincount(pairs.point_index, column, count) for column in pairs.normal.T], axis=1)
    walls_meet = np.linalg.norm(up, axis=1) < FACING * np.bincount(pairs.point_index, minlength=count)
    within = pairs.rho < np.where(walls_meet, CORNER, INSIDE)[pairs.point_index]
    return *sheets, np.where(np.bincount(pairs.point_index, within, count) > 0.0, side, 0.0)


def _planes(lattice: Lattice, sides: Sides, edges: Indices) -> tuple[Array, Blend]:
    """Places (n, 3) where the surface crosses edges (n,), and the sheets there.

    The plane is that of the nearest sheet at the outer or the inner end, whichever misses the edge by less.
    If that is by CROSSED or more, it is the nearest one that puts an end on its side; if these miss by as
    much, it is the level of the indicator, which has no patch.
    """
    one, other = lattice.ends(edges)
    is_inside = lattice.inside(one)
    inner, outer = np.where(is_inside, one, other), np.where(is_inside, other, one)
    origin = lattice.places(inner)
    way = lattice.places(outer) - origin
    a, b = (np.searchsorted(sides.points, ends) for ends in (inner, outer))
    best = sides.nearest.at(b)
    shares, missed = _crossing(best, way, 1.0)
    for sheet, end, replaced_from in (
        (sides.nearest.at(a), 0.0, 0.0),
        (sides.outside.at(b), 1.0, CROSSED),
        (sides.inside.at(a), 0.0, CROSSED),
    ):
        share, miss = _crossing(sheet, way, end)
        is_better = (miss < missed) & (missed >= replaced_from)
        best = sheet.where(is_better, best)
        shares, missed = np.where(is_better, share, shares), np.where(is_better, miss, missed)
    at_inner, at_outer = (lattice.indicator.at(places) for places in (origin, origin + way))
    level = np.clip(at_inner / np.where(at_inner > at_outer, at_inner - at_outer, 1.0), 0.0, 1.0)
    is_felt = missed < CROSSED
    places = origin + np.where(is_felt, shares, level)[:, None] * way
    nothing = np.full(len(edges), np.inf)
    unfelt = Blend(level, nothing, lattice.indicator.outward(places), np.full(len(edges), -1), nothing)
    return places, best.where(is_felt, unfelt)


def _crossing(sheet: Blend, way: Array, end: float) -> tuple[Array, Array]:
    """Where planes cross edges (n,), as a share of these, and by how much they miss them; inf for no patch.

    way : (n, 3), from the inner ends of edges to the outer ones
    end : 0 or 1, the share of the edges at which the sheets are
    """
    along = row_dot(sheet.normal, way)
    is_crossed = (sheet.patch >= 0) & (along > 0.0)
    shares = end - sheet.distance / np.where(is_crossed, along, 1.0)
    return shares, np.where(is_crossed, np.maximum(np.abs(shares - 0.5) - 0.5, 0.0), np.inf)


def _least_uncertain(quads: Indices, planes: Blend, count: int) -> Indices:
    """The planes (count,) of least deviation among those (n,) around each cell.

    quads : (n, 4), the cells around each plane
    """
    order = np.argsort(-planes.std, kind="stable")
    best = np.zeros(count, dtype=np.intp)
    best[quads[order]] = order[:, None]
    return best


def _vertices(around: Any, places: Array, planes: Blend, centers: Array, pitch: float) -> tuple[Array, Array]:
    """The vertices (m, 3) around centers (m, 3), and mean normals (m, 3) there.

    They minimize the squares of distances to planes, from between the mean of the places where these cross
    edges and the center.

    around : (m, n), sparse, the weights of planes (n,) through places (n, 3)
    """
    normals = planes.normal
    weights = around.multiply(np.where(planes.patch < 0, LEVEL, 1.0)).tocsr()
    total = weights.sum(axis=1)[:, None]

    def mean(values: Array) -> Array:
        """Means (m, i) of values (n, i) over the planes around each center."""
        return (weights @ values) / total

    crossed, up = mean(places), mean(normals)
    start = crossed + CENTERED * (centers - crossed)
    square = mean((normals[:, :, None] * normals[:, None]).reshape(-1, 9)).reshape(-1, 3, 3)
    right = mean(row_dot(normals, places)[:, None] * normals) - np.einsum("mij,mj->mi", square, start)
    # The step s minimizes |square s - right|^2 + SOFT^2 |s|^2, and again from there (iterated Tikhonov
    # regularization): it keeps what SOFT takes off where planes meet, and still does not move along them.
    soft = square @ square + SOFT**2 * np.eye(3)
    step = np.zeros_like(right)
    for _ in range(ITERATIONS):
        left = right - np.einsum("mij,mj->mi", square, step)
        step += np.linalg.solve(soft, square @ left[..., None])[..., 0]
    reach = (0.5 + SLACK) * pitch
    return np.clip(start + step, centers - reach, centers + reach), up


def _on_sheet(charts: Charts, reach: float, vertices: Array, up: Array, *own: Any) -> tuple[Any, ...]:
    """Vertices (n, 3) moved onto the sheets that face as they do, and the fields of these.

    On a crease no sheet does: there vertices stay, and have the fields of their planes.

    reach : a sheet is within this length
    up : (n, 3), mean normals of planes
    """
    up = normalized(up)
    sheet = sheet_facing(charts, vertices, up, 2.0 * reach)
    is_facing = (row_dot(sheet.normal, up) > FACING) & (np.abs(sheet.distance) < reach)
    moved = vertices - np.where(is_facing, sheet.distance, 0.0)[:, None] * sheet.normal
    return moved, *sheet.where(is_facing, Blend(*own))


def _cut(vertices: Array, quads: Indices, normals: Array, pitch: float) -> tuple[Indices, Indices]:
    """Quadrilaterals (n, 4) turned so that their first diagonal cuts them, and those (m,) that are bent.

    It is the diagonal whose triangles face as normals (n, 3) do. Where the two pass each other at a distance
    there is a crease or a corner that no vertex is on.
    """
    other = np.roll(quads, -1, axis=1)

    def facing(some: Indices) -> Array:
        """The least cosine (n,) between the two triangles of quadrilaterals and their normals."""
        halves = (triangle_cross(vertices[some[:, corners]]) for corners in ([0, 1, 2], [0, 2, 3]))
        one, other = (row_dot(normalized(half), normals) for half in halves)
        least: Array = np.minimum(one, other)
        return least

    quads = np.where((facing(quads) >= facing(other))[:, None], quads, other)
    a, b, c, d = vertices[quads.T]
    apart = np.abs(row_dot(a + c - b - d, normalized(np.cross(c - a, d - b))))
    return quads, np.flatnonzero(apart > 2.0 * BENT * pitch)


def _triangles(quads: Indices, bent: Indices, first: int) -> tuple[Indices, Indices]:
    """The triangles (k, 3) of quadrilaterals (n, 4), and of which each is one, (k,).

    bent : (m,), those with a vertex in their middle: `first` and the following
    """
    flat = np.setdiff1d(np.arange(len(quads)), bent)
    middles = np.arange(first, first + len(bent))
    sides = [np.column_stack([quads[bent][:, [i, (i + 1) % 4]], middles]) for i in range(4)]
    halves = [quads[flat][:, corners] for corners in ([0, 1, 2], [0, 2, 3])]
    return np.concatenate(halves + sides), np.concatenate([np.tile(flat, 2), np.tile(bent, 4)])
