# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The surface of a whole object as triangles: the indicator has its topology, and the patches its place.

Tetrahedra on the indicator's surface are cut, which is closed by construction. Vertices then move onto the
patches that face as the indicator does. Triangles where no patch is are left out.
"""

from collections.abc import Callable, Generator
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..arguments import Array
from ..steps import chunked
from ..triangles import normalized, row_dot, triangle_cross
from .charts import MARGIN, Charts
from .creases import insert_creases
from .field import INSIDE, SurfaceSample, surface_at
from .finger import FACING
from .indicator import Indicator
from .tetrahedra import (
    Indices,
    connected_pieces,
    keyed_sides,
    march,
    smoothed,
    subdivided,
    tetrahedra_of,
    unique,
)

# python -m benchmarks.atlas judges these.
CELL = 2.1  # A cube of the lattice is as long as this many edges of the mesh.
CLIP = 0.25  # A vertex is at least this share of a lattice edge from both ends of it.
SMOOTHINGS = 3  # This often vertices move toward their neighbors' mean.
NEAREST = 8  # A place is felt if it is close to one of this many contacts that are nearest:
BETWEEN = 1.5  # within this multiple of the distance of its own neighbors,
ONE_SIDED = 0.82  # if the mean of the directions to these is shorter; it is 2 / pi on a straight border.
BRIDGED = 4.0  # Holes that are not larger than this many squares, of a cell or the tolerance, are bridged.
# Vertices that were off by more cells, or are of folded triangles, are moved again, this often.
FAR, STEPS = 0.05, 4
WALL = 0.25  # Edges are at most this share of the thinnest wall, so that none is lost between them.
CONTINUED_STD = 0.25  # The deviation of what is continued beyond all patches is this share of the way there.
BAND = 5.0  # The surface is within this many cells of the level of the indicator.
HALVINGS = 5  # This many halvings of an edge of the lattice find the level.
LATTICE_AT_ONCE = 100_000  # A step takes this many points of the lattice,
PLACES_AT_ONCE = 3000  # or the surface near this many places.
# The squares of an edge and of a cube's side take so much memory, and a mesh takes at most so much.
EDGE_BYTES, LATTICE_BYTES, MOST_BYTES = 900.0, 17_000.0, 2e9


class Mesh(NamedTuple):
    """Vertices (n, 3) and triangles (m, 3), counterclockwise from outside.

    std : (n,), standard deviation of the distance to the true surface, a length
    patch : (n,), index of the patch of most weight
    """

    vertices: Array
    triangles: Indices
    std: Array
    patch: Indices

    @property
    def normals(self) -> Array:
        """Outward unit normals of the vertices, (n, 3): means of the triangles' normals, weighted by area."""
        across, count = triangle_cross(self.vertices[self.triangles]).repeat(3, axis=0), len(self.vertices)
        return normalized(
            np.stack([np.bincount(self.triangles.ravel(), way, count) for way in across.T], axis=1)
        )

    @property
    def edge(self) -> float:
        """The median length of the edges; 0 without triangles."""
        if not len(self.triangles):
            return 0.0
        a, b = self.vertices[self.triangles[:, :2]].transpose(1, 0, 2)
        return float(np.median(np.linalg.norm(b - a, axis=1)))

    @property
    def border(self) -> Indices:
        """The edges (k, 2) of one triangle only, each as this triangle has it."""
        sides, keys, once, _ = self._sides
        return sides[once][np.argsort(keys[once])]

    @property
    def sides_on_border(self) -> Indices:
        """The number of sides (m,) of each triangle that are on the border."""
        return self._sides[2].reshape(-1, 3).sum(axis=1)

    def chosen(self, which: NDArray[np.bool_]) -> "Mesh":
        """Some of the triangles, and their vertices."""
        used = np.bincount(self.triangles[which].ravel(), minlength=len(self.vertices)) > 0
        index = np.cumsum(used) - 1
        return Mesh(self.vertices[used], index[self.triangles[which]], self.std[used], self.patch[used])

    @property
    def _sides(self) -> tuple[Indices, Indices, NDArray[np.bool_], bool]:
        """The sides (3 m, 2) of all triangles, and numbers (3 m,) that are equal for the same edge.

        Also which sides (3 m,) no other triangle has, and whether each edge belongs to exactly two.
        """
        sides, keys = keyed_sides(self.triangles, len(self.vertices))
        order = np.sort(keys)
        first = np.flatnonzero(np.diff(order, prepend=-1))
        counts = np.diff(first, append=len(order))
        once = order[first[counts == 1]]
        at = np.searchsorted(once, keys)
        return sides, keys, np.append(once, -1)[at] == keys, bool((counts == 2).all())

    @property
    def is_closed(self) -> bool:
        """Whether there are triangles, and each edge belongs to exactly two."""
        return len(self.triangles) > 0 and self._sides[3]


Felt = Callable[[Array, Array], Array]  # Distances (n,) by which a surface is off places; inf where unfelt.


class MeasuredContacts(NamedTuple):
    """Contacts that were measured: there the surface was felt, though patches may leave gaps between them.

    points, normals : (n, 3)
    reach : (n,), how far neighbors reach around each
    links : (n, k), some of these
    """

    points: Array
    normals: Array
    reach: Array
    links: Indices

    def off(self, points: Array, normals: Array) -> Array:
        """How far contacts are from places (k, 3) with normals (k, 3) between them, (k,).

        It is inf for places that are not between contacts, or if none near them faces alike.
        """
        from scipy.spatial import cKDTree

        away, at = cKDTree(self.points).query(points, NEAREST)
        alike = np.einsum("kbi,ki->kb", self.normals[at], normals) > FACING
        ways = normalized(self.points[self.links[at]] - points[:, None, None])
        between = np.linalg.norm(ways.mean(axis=2), axis=2) < ONE_SIDED
        is_felt = (alike & between & (away < BETWEEN * self.reach[at])).any(axis=1)
        return np.where(is_felt, away[:, 0], np.inf)


def memory_of(vertices: Array, triangles: Indices, edge: float, lattice: float = np.inf) -> float:
    """About how many bytes it takes to mesh the surface of triangles (m, 3) with edges of a length.

    lattice : the length of the lattice's cubes, if it is known
    """
    area = 0.5 * float(np.linalg.norm(triangle_cross(vertices[triangles]), axis=1).sum())
    return area * max(EDGE_BYTES / edge / edge, LATTICE_BYTES / lattice / lattice)


def shortest_edge(vertices: Array, triangles: Indices) -> float:
    """The shortest edge with which the surface of triangles (m, 3) can be meshed in about 2 GB of memory."""
    return float(np.sqrt(memory_of(vertices, triangles, 1.0) / MOST_BYTES))


def lattice_of(indicator: Indicator, edge: float) -> tuple[float, int]:
    """The length of the lattice's cubes, and how often edges are halved, for triangles with such edges."""
    size, halvings = CELL * edge, 0
    while size < 0.5 * indicator.cell:
        size, halvings = 2.0 * size, halvings + 1
    return size, halvings


def meshed(
    charts: Charts,
    indicator: Indicator,
    edge: float,
    ended: Callable[[Array], NDArray[np.bool_]] | None = None,
    felt: Felt | None = None,
    span: float = 0.0,
) -> Generator[float, None, tuple[Mesh, Mesh]]:
    """The mesh of the surface, and that of what the indicator has where nothing was felt.

    edge : about the length of its edges, which are shorter than a quarter of the thinnest wall
    ended : which of places (n, 3) are beyond the ends of a mesh of the surface that was made before
    felt : how far the surface is off places (n, 3) with normals (n, 3), if it was felt there, too
    span : a length, at least a cell of the indicator; holes of up to BRIDGED squares of it are bridged

    Yields the share that is done.
    """
    span = max(span, indicator.cell)
    edge = min(edge, WALL * indicator.resolved)
    size, halvings = lattice_of(indicator, edge)
    vertices, up, triangles = yield from _level(indicator, size)
    band = max(BAND * indicator.cell, CLIP * size)
    vertices, surface = yield from _project_and_smooth(charts, indicator, vertices, up, triangles, band)
    for _ in range(halvings):
        vertices, triangles = subdivided(vertices, triangles)
        up = indicator.outward(vertices)
        yield 0.7
        vertices, surface = yield from _project_and_smooth(charts, indicator, vertices, up, triangles, band)
    yield 0.9
    old = np.arange(len(vertices))
    vertices, triangles, parents, unfelt = yield from insert_creases(
        charts, vertices, triangles, surface.normal, edge
    )
    yield 0.9
    surface = SurfaceSample._make(values[np.append(old, parents)] for values in surface)
    surface = surface._replace(std=np.hypot(surface.std, CONTINUED_STD * unfelt))
    return (yield from _trim_unfelt(vertices, triangles, surface, indicator, ended, felt, span))


def _level(indicator: Indicator, size: float) -> Generator[float, None, tuple[Array, Array, Indices]]:
    """Vertices (n, 3) near the level of the indicator, the way outward (n, 3) and triangles (m, 3).

    size : the length of a cube of the lattice
    """
    cells = yield from _cells(indicator, size)
    lattice, tetrahedra = yield from tetrahedra_of(cells)
    points = 0.5 * size * lattice.astype(np.float64)
    (values,) = yield from chunked(lambda some: (-indicator.at(some),), LATTICE_AT_ONCE, 0.1, points)
    ends, triangles = march(tetrahedra, values)
    yield 0.2
    a, b = points[ends].transpose(1, 0, 2)
    vertices, up = yield from chunked(partial(_crossings, indicator), PLACES_AT_ONCE, 0.2, a, b)
    return vertices, up, triangles


def _crossings(indicator: Indicator, a: Array, b: Array) -> tuple[Array, Array]:
    """Vertices where edges from a to b, (n, 3) each, cross the level of the indicator, but for CLIP.

    Also the way outward where they do, (n, 3) each.
    """
    low, high = np.zeros(len(a)), np.ones(len(a))
    is_inside = indicator.at(a) > 0.0
    for _ in range(HALVINGS):  # The indicator is a step, so its values do not show how far the level is.
        middle = 0.5 * (low + high)
        same = (indicator.at(a + middle[:, None] * (b - a)) > 0.0) == is_inside
        low, high = np.where(same, middle, low), np.where(same, high, middle)
    level, clipped = 0.5 * (low + high)[:, None], np.clip(low, CLIP, 1.0 - CLIP)[:, None]
    return a + clipped * (b - a), indicator.outward(a + level * (b - a))


def _cells(indicator: Indicator, size: float) -> Generator[float, None, Indices]:
    """The cubes around the grid's cells where the indicator changes its sign, and adjacent ones, (n, 3)."""
    found, length = [], len(indicator.values)
    rows = max(1, 500_000 * length // indicator.values.size)
    for start in range(0, length - 1, rows):
        every = some = indicator.values[start : start + rows + 1] > 0.0
        for axis in range(3):
            before, after = ((slice(None),) * axis + (part,) for part in (slice(None, -1), slice(1, None)))
            every, some = every[before] & every[after], some[before] | some[after]
        found.append(np.argwhere(some & ~every) + np.array([start, 0, 0]))
        yield 0.0
    low = indicator.low + indicator.cell * np.vstack(found)
    # A cell of the grid is in at most two cubes along an axis, or three.
    ways = (0.0, 1.0) if size >= indicator.cell else (0.0, 0.5, 1.0)
    ends = [np.floor((low + way * indicator.cell) / size).astype(np.intp) for way in ways]
    cells = ends[0]
    for which in np.ndindex(3 * (len(ways),)):
        shifted = unique(np.stack([ends[i][:, axis] for axis, i in enumerate(which)], axis=1))
        cells = unique(np.vstack([cells, shifted]))
        yield 0.0
    shifts = np.vstack([np.zeros((1, 3), dtype=np.intp), np.eye(3, dtype=np.intp), -np.eye(3, dtype=np.intp)])
    return unique((cells[:, None] + shifts).reshape(-1, 3))


def _project_and_smooth(
    charts: Charts, indicator: Indicator, vertices: Array, up: Array, triangles: Indices, band: float
) -> Generator[float, None, tuple[Array, SurfaceSample]]:
    """Vertices (k, 3) projected onto the surface, with tangential Laplacian smoothing, and the surface there.

    up : (k, 3), outward directions
    band : the length within which the surface lies

    Folded triangles, and vertices that are still off the surface, are projected again, at most STEPS times.
    Yields the share that is done.
    """
    surface = yield from _project_onto_surface(charts, indicator, vertices, up, band)
    far = np.abs(surface.distance) > FAR * indicator.cell
    yield from _reproject(charts, indicator, vertices, up, surface, far, band)
    for _ in range(SMOOTHINGS):
        vertices = smoothed(vertices, surface.normal, triangles)
        yield 0.5
    surface = yield from _project_onto_surface(charts, indicator, vertices, up, band)
    for _ in range(STEPS):
        far = np.abs(surface.distance) > FAR * indicator.cell
        folded = _folded(vertices, surface.normal, triangles)
        if folded.any():
            vertices[folded] = smoothed(vertices, surface.normal, triangles)[folded]
        if not (far | folded).any():
            break
        yield from _reproject(charts, indicator, vertices, up, surface, far | folded, band)
    return vertices, surface


def _reproject(
    charts: Charts,
    indicator: Indicator,
    vertices: Array,
    up: Array,
    surface: SurfaceSample,
    which: NDArray[np.bool_],
    band: float,
) -> Generator[float, None, None]:
    """Moves some of the vertices (k, 3) onto the surface again, and changes both in place."""
    some = np.flatnonzero(which)
    moved = vertices[some]
    again = yield from _project_onto_surface(charts, indicator, moved, up[some], band)
    for old, new in zip((vertices, *surface), (moved, *again), strict=True):
        old[some] = new


def _folded(vertices: Array, normals: Array, triangles: Indices) -> NDArray[np.bool_]:
    """Which vertices (n,) are of triangles that face against the normals (n, 3) of the surface."""
    against = row_dot(triangle_cross(vertices[triangles]), normals[triangles].sum(axis=1)) < 0.0
    return np.bincount(triangles[against].ravel(), minlength=len(vertices)) > 0


def _project_onto_surface(
    charts: Charts, indicator: Indicator, vertices: Array, up: Array, band: float
) -> Generator[float, None, SurfaceSample]:
    """Moves vertices (k, 3) onto the surface, in place; returns the surface where they were before."""
    surface = SurfaceSample._make(
        (
            yield from chunked(
                lambda places, ups: surface_at(charts, indicator, places, ups, band),
                PLACES_AT_ONCE,
                0.5,
                vertices,
                up,
            )
        )
    )
    vertices -= np.clip(surface.distance, -band, band)[:, None] * surface.normal
    return surface


def _trim_unfelt(
    vertices: Array,
    triangles: Indices,
    surface: SurfaceSample,
    indicator: Indicator,
    ended: Callable[[Array], NDArray[np.bool_]] | None,
    felt: Felt | None,
    span: float,
) -> Generator[float, None, tuple[Mesh, Mesh]]:
    """The mesh without triangles where nothing was felt, and these; yields the share that is done.

    Between patches it goes on up to where these may be continued, but not from a rim into the void. What is
    as small as some cells of the indicator is bridged. A later mesh ends where the first one did,
    where most of what lies beyond patches is off the first.
    """
    yield 0.9
    near = surface.rho < MARGIN
    inside = near & ((surface.rho < INSIDE) | (surface.creases > 0))
    off = np.where(inside, 0.0, np.inf)
    if felt is not None:
        others = np.flatnonzero(~inside)
        (off[others],) = yield from chunked(
            lambda some: (felt(vertices[some], indicator.outward(vertices[some])),),
            PLACES_AT_ONCE,
            0.9,
            others,
        )
        inside[others] = np.isfinite(off[others])
    beyond = triangles[~inside[triangles].all(axis=1)]
    count, piece = connected_pieces(beyond[:, :2].ravel(), beyond[:, 1:].ravel(), len(vertices))
    yield 0.9
    meets_inside = np.bincount(piece[inside], minlength=count) > 0
    gone = ~inside & ~meets_inside[piece]
    if ended is None:
        # Each vertex has a third of its triangles' area, so that a hole is as large with any length of edges.
        far = np.linalg.norm(triangle_cross(vertices[beyond]), axis=1) / 6.0 * (~near[beyond]).sum(axis=1)
        gone |= ~inside & (np.bincount(piece[beyond[:, 0]], far, count) > BRIDGED * span**2)[piece]
    else:
        outer = np.flatnonzero(~inside & ~gone)
        (beyond_end,) = yield from chunked(lambda some: (ended(some),), PLACES_AT_ONCE, 0.9, vertices[outer])
        most = np.bincount(piece[outer], np.where(beyond_end, 1.0, -1.0), count) > 0.0
        gone[outer] = most[piece[outer]]
        off[~gone] = 0.0
    yield 0.9
    std = np.where(surface.patch < 0, indicator.cell, surface.std)
    std = np.hypot(std, np.minimum(off, span))
    mesh, unfelt = Mesh(vertices, triangles, std, surface.patch), gone[triangles].any(axis=1)
    return mesh.chosen(~unfelt), mesh.chosen(unfelt)
