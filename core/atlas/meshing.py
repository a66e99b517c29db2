# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The surface of a field as triangles: tetrahedra near the patches are cut, as its signs at corners say.

Where a wall or a gap is thinner than a tetrahedron, this is split first, so that no hole is left. What comes
out is a manifold, closed but for where nothing was felt. Vertices then move along the surface to even out,
and onto it.
"""

from collections.abc import Generator
from typing import NamedTuple

import numpy as np

from ..arguments import Array
from ..patch.tetrahedra import Indices, crossed_twice, cut, evened, split, tetrahedra_of, unique
from .charts import MARGIN, Charts
from .field import Blend, Felt
from .join import told

# python -m benchmarks.atlas judges these.
CELL = 2.1  # A cube of the lattice is as long as so many edges of the mesh.
CLIP = 0.25  # A vertex is at least this share of a lattice edge from both ends of it.
ROOM = 1.2  # Patches are asked within at least so many cubes of their surface.
SPLITS = 3  # So many times tetrahedra are split where a wall is thinner than they are.
SHARES = np.array([0.2, 0.35, 0.5, 0.65, 0.8])  # A thin wall is looked for at these shares of a lattice edge.
# A thin wall is deeper than so many edges of the mesh and so many deviations together: less is an error.
THIN, UNCERTAIN = 0.1, 2.0
SPECK = 40  # Pieces of the mesh with fewer triangles are left out, except the largest.
SMOOTHINGS = 3  # So often vertices move toward their neighbors' mean.
FAR, STEPS = 0.05, 3  # Vertices that were off by more edges are moved onto the surface again, so often.
FIELD_AT_ONCE = 3000  # A step asks the field at so many places.
CELLS_AT_ONCE = 60_000  # A step looks for thin walls in so many tetrahedra.
MOST_CELLS = 20_000_000  # More sample points of one patch would not fit into memory.
LEAST_DIVISOR = 1e-300  # No vector is divided by less.


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
        a, b, c = (self.vertices[self.triangles[:, i]] for i in range(3))
        normals = np.zeros_like(self.vertices)
        np.add.at(normals, self.triangles, np.cross(b - a, c - a)[:, None])
        return normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), LEAST_DIVISOR)

    @property
    def is_closed(self) -> bool:
        """Whether each edge belongs to exactly two triangles."""
        edges = np.sort(self.triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
        keys = edges[:, 0] * len(self.vertices) + edges[:, 1]
        counts = np.unique(keys, return_counts=True)[1]
        return bool((counts == 2).all())


def meshed(charts: Charts, felt: Felt, edge: float) -> Generator[float, None, Mesh]:
    """The mesh of the patches' field, its edges about as long as `edge`; yields the share that is done."""
    size = CELL * edge
    cells = yield from _cells(charts, felt, size)
    yield 0.0
    lattice, tetrahedra = yield from tetrahedra_of(cells)
    yield 0.0
    points = 0.5 * size * lattice.astype(np.float64)
    field = yield from _asked(charts, felt, points, ROOM * size, 0.0)
    new = 0
    for _ in range(SPLITS):
        known = len(points)
        tetrahedra, points, field = yield from _thin_walls(charts, felt, tetrahedra, points, field, edge, new)
        new = known
    ends, triangles = cut(tetrahedra, field.distance, size)
    yield 0.5
    a, b = ends.T
    share = field.distance[a] / (field.distance[a] - field.distance[b])
    share = np.clip(share, CLIP, 1.0 - CLIP)[:, None]
    vertices = (1.0 - share) * points[a] + share * points[b]
    vertices, field = yield from _settled(charts, felt, vertices, triangles, edge)
    return _felt(vertices, triangles, field)


def _settled(
    charts: Charts, felt: Felt, vertices: Array, triangles: Indices, edge: float
) -> Generator[float, None, tuple[Array, Blend]]:
    """Vertices (k, 3) evened out on the surface, and the field there; yields the share that is done."""
    most = 0.5 * CELL * edge
    field = yield from _onto(charts, felt, vertices, most)
    for _ in range(SMOOTHINGS):
        vertices = evened(vertices, field.normal, triangles)
        yield 0.75
    field = yield from _onto(charts, felt, vertices, most)
    far = np.flatnonzero(np.abs(field.distance) > FAR * edge)
    for _ in range(STEPS):
        moved = vertices[far]
        again = yield from _onto(charts, felt, moved, most)
        for old, new in zip((vertices, *field), (moved, *again), strict=True):
            old[far] = new
        far = far[np.abs(again.distance) > FAR * edge]
    return vertices, field


def _onto(charts: Charts, felt: Felt, vertices: Array, most: float) -> Generator[float, None, Blend]:
    """Moves vertices (k, 3) onto the surface, in place and by a length at most; returns the field before."""
    field = yield from _asked(charts, felt, vertices, 0.0, 0.75)
    vertices -= np.clip(field.distance, -most, most)[:, None] * field.normal
    return field


def _asked(
    charts: Charts, felt: Felt, points: Array, room: float, so_far: float
) -> Generator[float, None, Blend]:
    """The field at many points (k, 3); yields the share of the mesh that is done."""
    parts = []
    for start in range(0, max(len(points), 1), FIELD_AT_ONCE):
        parts.append(told(charts, felt, points[start : start + FIELD_AT_ONCE], room))
        yield so_far
    return Blend(*(np.concatenate(values) for values in zip(*parts, strict=True)))


def _thin_walls(
    charts: Charts, felt: Felt, tetrahedra: Indices, points: Array, field: Blend, edge: float, new: int
) -> Generator[float, None, tuple[Indices, Array, Blend]]:
    """Tetrahedra, points and the field with a point more on each edge that the surface crosses twice.

    A wall or a gap lies between its ends, which are on one side, and the cut would have a hole there. Only
    tetrahedra with points from number `new` on are looked at. Yields the share of the mesh that is done.
    """
    some = tetrahedra[(tetrahedra >= new).any(axis=1)]
    parts = []
    for start in range(0, max(len(some), 1), CELLS_AT_ONCE):
        few = some[start : start + CELLS_AT_ONCE]
        parts.append(crossed_twice(few, points, field.distance, field.normal))
        yield 0.5
    edges = np.unique(np.vstack(parts), axis=0)
    a, b = points[edges].transpose(1, 0, 2)[:, :, None]
    between = (a + SHARES[:, None] * (b - a)).reshape(-1, 3)
    found = yield from _asked(charts, felt, between, ROOM * CELL * edge, 0.5)
    depth = -np.sign(field.distance[edges[:, :1]]) * found.distance.reshape(-1, len(SHARES))
    depth -= UNCERTAIN * found.std.reshape(depth.shape)
    thin = np.flatnonzero(depth.max(axis=1) > THIN * edge)
    deepest = thin * len(SHARES) + depth[thin].argmax(axis=1)
    tetrahedra = split(tetrahedra, edges[thin], len(points))
    yield 0.5
    field = Blend(*(np.concatenate([old, new[deepest]]) for old, new in zip(field, found, strict=True)))
    return tetrahedra, np.concatenate([points, between[deepest]]), field


def _felt(vertices: Array, triangles: Indices, field: Blend) -> Mesh:
    """The mesh without the triangles that reach beyond what was felt, and without specks at rims."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    triangles = triangles[np.isfinite(field.std)[triangles].all(axis=1)]
    links = np.ones(2 * len(triangles)), (triangles[:, :2].ravel(), triangles[:, 1:].ravel())
    piece = connected_components(coo_matrix(links, (len(vertices),) * 2))[1][triangles[:, 0]]
    sizes = np.bincount(piece, minlength=1)
    triangles = triangles[sizes[piece] >= min(SPECK, sizes.max())]
    used, index = np.unique(triangles, return_inverse=True)
    return Mesh(vertices[used], index.reshape(-1, 3), field.std[used], field.node[used])


def _cells(charts: Charts, felt: Felt, size: float) -> Generator[float, None, Indices]:
    """The cubes of patches and contacts, and those beside them, (n, 3); yields 0 after each patch."""
    found = []
    for node in range(len(charts.radii)):
        half = MARGIN * charts.rims[node].max()
        count = 2 * int(np.ceil(2.0 * half * charts.radii[node] / size)) + 1  # Odd: the origin is one.
        if count**2 > MOST_CELLS:
            raise ValueError(
                f"edge: expected a few thousand edges at most across a patch, got {size / CELL:g}"
            )
        line = np.linspace(-half, half, count)
        x, y = (axis.ravel() for axis in np.meshgrid(line, line))
        each = np.full(len(x), node)
        inside = charts.shares(x, y, each) < MARGIN
        points, _ = charts.world(each[inside], x[inside], y[inside])
        found.append(unique(np.floor(points / size).astype(np.intp)))
        yield 0.0
    found.append(unique(np.floor(felt.points / size).astype(np.intp)))
    cells = unique(np.vstack(found))
    beside = np.vstack([np.zeros((1, 3), dtype=np.intp), np.eye(3, dtype=np.intp), -np.eye(3, dtype=np.intp)])
    return unique((cells[:, None] + beside).reshape(-1, 3))
