# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The surface of a whole object as triangles, which end where nothing was felt."""

from collections.abc import Callable, Generator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..arguments import Array
from ..steps import chunked
from ..triangles import normalized, row_dot, triangle_cross
from .charts import PLACES_AT_ONCE, Charts
from .connectivity import Indices, connected_pieces, keyed_sides
from .dual_contouring import Surface, dual_contour
from .field import AGREE, INSIDE
from .indicator import Indicator

# python -m benchmarks.atlas judges these.
NEAREST = 8  # A place is felt if it is close to one of this many contacts that are nearest:
BETWEEN = 1.5  # within this multiple of the distance of its own neighbors,
ONE_SIDED = 0.82  # if the mean of the directions to these is shorter; it is 2 / pi on a straight border.
BRIDGED = 4.0  # Holes that are not larger than this many squares, of a cell or the tolerance, are bridged.
WALL = 0.25  # Edges are at most this share of the thinnest wall, so that none is lost between them.
# The square of an edge takes so much memory, and a mesh takes at most so much.
EDGE_BYTES, MOST_BYTES = 1300.0, 2e9


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
        """The median length of the triangles' sides; 0 without triangles."""
        if not len(self.triangles):
            return 0.0
        ends = self.vertices[self.triangles]
        return float(np.median(np.linalg.norm(ends - np.roll(ends, 1, axis=1), axis=2)))

    @property
    def border(self) -> Indices:
        """The edges (k, 2) of one triangle only, each as this triangle has it."""
        sides, keys, once, _ = self._sides
        return sides[once][np.argsort(keys[once])]

    @property
    def rims(self) -> int:
        """The number of connected parts of the border: where the object ends, and around holes."""
        ends, index = np.unique(self.border, return_inverse=True)
        a, b = index.reshape(-1, 2).T
        return connected_pieces(a, b, len(ends))[0] if len(ends) else 0

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
        _, edge, counts = np.unique(keys, return_inverse=True, return_counts=True)
        return sides, keys, counts[edge] == 1, bool((counts == 2).all())

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
        """How far the nearest contacts are above or below places (k, 3) with normals (k, 3), (k,).

        It is inf for places that are not between contacts, or if none near them faces alike.
        """
        from scipy.spatial import cKDTree

        away, at = cKDTree(self.points).query(points, NEAREST)
        alike = np.einsum("kbi,ki->kb", self.normals[at], normals) > AGREE
        ways = normalized(self.points[self.links[at]] - points[:, None, None])
        between = np.linalg.norm(ways.mean(axis=2), axis=2) < ONE_SIDED
        is_felt = (alike & between & (away < BETWEEN * self.reach[at])).any(axis=1)
        return np.where(is_felt, np.abs(row_dot(self.points[at[:, 0]] - points, normals)), np.inf)


def memory_of(vertices: Array, triangles: Indices, edge: float) -> float:
    """About how many bytes it takes to mesh the surface of triangles (m, 3) with edges of a length."""
    area = 0.5 * float(np.linalg.norm(triangle_cross(vertices[triangles]), axis=1).sum())
    return area * EDGE_BYTES / edge / edge


def shortest_edge(vertices: Array, triangles: Indices) -> float:
    """The shortest edge with which the surface of triangles (m, 3) can be meshed in about 2 GB of memory."""
    return float(np.sqrt(memory_of(vertices, triangles, 1.0) / MOST_BYTES))


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
    surface = yield from dual_contour(charts, indicator, min(edge, WALL * indicator.resolved))
    middles = surface.vertices[surface.triangles].mean(axis=1)
    off = np.where(surface.triangle_rho >= INSIDE, np.inf, 0.0)
    if felt is not None:
        beyond = np.flatnonzero(off)
        normals = normalized(triangle_cross(surface.vertices[surface.triangles[beyond]]))
        steps = chunked(lambda *some: (felt(*some),), PLACES_AT_ONCE, 0.9, middles[beyond], normals)
        (off[beyond],) = yield from steps
    span = max(span, indicator.cell)
    is_unfelt = yield from _unfelt(surface, middles, np.isinf(off), ended, span)
    std = np.where(surface.patch < 0, indicator.cell, surface.std)
    if ended is None:
        # Where no patch is, what is bridged may be anywhere within the span.
        off[np.isinf(off) & (surface.patch[surface.triangles] >= 0).any(axis=1)] = 0.0
        between = np.zeros(len(std))
        np.maximum.at(between, surface.triangles.ravel(), np.minimum(off, span / np.sqrt(3.0)).repeat(3))
        std = np.maximum(np.where(surface.patch < 0, 0.0, std), between)
    mesh = Mesh(surface.vertices, surface.triangles, std, surface.patch)
    return mesh.chosen(~is_unfelt), mesh.chosen(is_unfelt)


def _unfelt(
    surface: Surface,
    middles: Array,
    is_beyond: NDArray[np.bool_],
    ended: Callable[[Array], NDArray[np.bool_]] | None,
    span: float,
) -> Generator[float, None, NDArray[np.bool_]]:
    """Which triangles (m,) with middles (m, 3) are where nothing was felt; yields the share that is done.

    Between patches the surface goes on, but not from a rim into the void. What is as small as some squares of
    the span is bridged. A later mesh ends where the first one did, where most of what lies beyond patches is
    off the first.

    is_beyond : (m,), which of them are beyond what was felt
    """
    yield 0.9
    vertices, triangles, rho = surface.vertices, surface.triangles, surface.rho
    beyond, inside = triangles[is_beyond], triangles[~is_beyond]
    count, piece = connected_pieces(beyond[:, :2].ravel(), beyond[:, 1:].ravel(), len(vertices))
    yield 0.9
    gone = np.bincount(piece[inside.ravel()], minlength=count) == 0
    where = piece[beyond[:, 0]]
    if ended is None:
        # A hole is as large with any length of edges; along creases there are many that are tiny.
        is_hole = np.isinf(rho[beyond]).all(axis=1)
        sides, _ = keyed_sides(beyond[is_hole], len(vertices))
        holes, some = connected_pieces(sides[:, 0], sides[:, 1], len(vertices))
        areas = 0.5 * np.linalg.norm(triangle_cross(vertices[beyond[is_hole]]), axis=1)
        hole = some[beyond[is_hole, 0]]
        is_large = np.bincount(hole, areas, holes)[hole] > BRIDGED * span**2
        gone[where[is_hole][is_large]] = True
    else:
        (off,) = yield from chunked(lambda some: (ended(some),), PLACES_AT_ONCE, 0.9, middles[is_beyond])
        gone |= np.bincount(where, np.where(off, 1.0, -1.0), count) > 0.0
    yield 0.9
    is_gone = is_beyond.copy()
    is_gone[is_beyond] = gone[where]
    return is_gone
