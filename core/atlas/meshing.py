# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The surface of a whole object as triangles, which end where nothing was felt."""

from collections.abc import Callable, Generator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..arguments import Array
from ..steps import chunked
from ..triangles import normalized, triangle_cross
from .charts import Charts
from .connectivity import Indices, connected_pieces, keyed_sides
from .dual_contouring import PLACES_AT_ONCE, Surface, dual_contour
from .field import AGREE, INSIDE
from .indicator import Indicator

# python -m benchmarks.atlas judges these.
NEAREST = 8  # A place is felt if it is close to one of this many contacts that are nearest:
BETWEEN = 1.5  # within this multiple of the distance of its own neighbors,
ONE_SIDED = 0.82  # if the mean of the directions to these is shorter; it is 2 / pi on a straight border.
BRIDGED = 4.0  # Holes that are not larger than this many cells of the indicator are bridged.
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

    def near(self, points: Array, normals: Array) -> NDArray[np.bool_]:
        """Which places (k, 3) with normals (k, 3) are between contacts, of which a near one faces alike."""
        from scipy.spatial import cKDTree

        away, at = cKDTree(self.points).query(points, NEAREST)
        alike = np.einsum("kbi,ki->kb", self.normals[at], normals) > AGREE
        ways = normalized(self.points[self.links[at]] - points[:, None, None])
        between = np.linalg.norm(ways.mean(axis=2), axis=2) < ONE_SIDED
        return (alike & between & (away < BETWEEN * self.reach[at])).any(axis=1)


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
    contacts: MeasuredContacts | None = None,
) -> Generator[float, None, tuple[Mesh, Mesh]]:
    """The mesh of the surface, and that of what the indicator has where nothing was felt.

    edge : about the length of its edges, which are shorter than a quarter of the thinnest wall
    ended : which of places (n, 3) are beyond the ends of a mesh of the surface that was made before
    contacts : the surface was felt there, too

    Yields the share that is done.
    """
    surface = yield from dual_contour(charts, indicator, min(edge, WALL * indicator.resolved))
    return (yield from _trim_unfelt(surface, indicator, ended, contacts))


def _trim_unfelt(
    surface: Surface,
    indicator: Indicator,
    ended: Callable[[Array], NDArray[np.bool_]] | None,
    contacts: MeasuredContacts | None,
) -> Generator[float, None, tuple[Mesh, Mesh]]:
    """The mesh without triangles where nothing was felt, and these; yields the share that is done.

    Between patches it goes on, but not from a rim into the void. What is as small as some cells of the
    indicator is bridged. A later mesh ends where the first one did, where most of what lies beyond patches is
    off the first.
    """
    yield 0.9
    vertices, triangles, std, patch, rho, triangle_rho = surface
    is_beyond, middles = triangle_rho >= INSIDE, vertices[triangles].mean(axis=1)
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
        is_large = np.bincount(hole, areas, holes)[hole] > BRIDGED * indicator.cell**2
        gone[where[is_hole][is_large]] = True
    else:
        (off,) = yield from chunked(lambda some: (ended(some),), PLACES_AT_ONCE, 0.9, middles[is_beyond])
        gone |= np.bincount(where, np.where(off, 1.0, -1.0), count) > 0.0
    yield 0.9
    unfelt = np.flatnonzero(is_beyond)[gone[where]]
    if contacts is not None:
        normals = normalized(triangle_cross(vertices[triangles[unfelt]]))
        unfelt = unfelt[~contacts.near(middles[unfelt], normals)]
    mesh = Mesh(vertices, triangles, np.where(patch < 0, indicator.cell, std), patch)
    is_unfelt = np.bincount(unfelt, minlength=len(triangles)) > 0
    return mesh.chosen(~is_unfelt), mesh.chosen(is_unfelt)
