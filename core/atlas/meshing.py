# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The surface of a field as triangles: marching tetrahedra on a body-centered lattice, near the patches only.

Each tetrahedron is cut as its signs say (Doi and Koide 1991), so what comes out is a manifold, closed but for
where the field ends. The lattice is that of Labelle and Shewchuk 2007: its tetrahedra are all alike. Vertices
then move along the surface to even out, and onto it.
"""

from collections.abc import Generator
from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..arguments import Array
from .charts import MARGIN, Charts
from .field import Blend
from .join import Felt, told

Indices = NDArray[np.intp]

CELL = 2.1  # edges of the mesh in a cell of the lattice
CLIP = 0.25  # share of a lattice edge: how far a vertex is off its ends at least
ROOM = 1.2  # cubes: how far from their surface patches are asked at least
JUMP = 3.0  # slope of the field beyond which it jumps, from wall to wall, and has no surface
SPECK = 40  # triangles: smaller pieces of the mesh are left out, but for the largest
SMOOTHINGS, SMOOTHING_SHARE = 3, 0.6  # passes, and share of the way to the mean of its neighbors
FIELD_AT_ONCE = 3000  # places of the field in a step
MOST_CELLS = 20_000_000  # of a patch: more points would not fit into memory
LEAST_DIVISOR = 1e-300  # that a vector is divided by
FACE_CORNERS = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)])  # corners of a face, from its center


class Mesh(NamedTuple):
    """vertices (n, 3), triangles (m, 3) counterclockwise from outside, std (n,), index of a patch (n,)."""

    vertices: Array
    triangles: Indices
    std: Array
    patch: Indices

    @property
    def normals(self) -> Array:
        """Outward unit normals of the vertices (n, 3): means of those of their triangles, by area."""
        a, b, c = (self.vertices[self.triangles[:, i]] for i in range(3))
        normals = np.zeros_like(self.vertices)
        np.add.at(normals, self.triangles, np.cross(b - a, c - a)[:, None])
        return normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), LEAST_DIVISOR)

    @property
    def is_closed(self) -> bool:
        """Whether each edge of a triangle belongs to another triangle too."""
        edges = np.sort(self.triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
        keys = edges[:, 0] * len(self.vertices) + edges[:, 1]
        counts = np.unique(keys, return_counts=True)[1]
        return bool((counts == 2).all())


def meshed(charts: Charts, felt: Felt, edge: float) -> Generator[float, None, Mesh]:
    """The mesh of the patches' field with edges about as long as asked; yields the share that is done."""
    size = CELL * edge
    cells = yield from _cells(charts, size)
    yield 0.0
    lattice, tetrahedra = _tetrahedra(cells)
    yield 0.0
    points = 0.5 * size * lattice.astype(np.float64)
    values, known = np.zeros(len(points)), np.zeros(len(points), dtype=bool)
    for start in range(0, len(points), FIELD_AT_ONCE):
        some = slice(start, start + FIELD_AT_ONCE)
        field = told(charts, felt, points[some], ROOM * size)
        values[some], known[some] = field.distance, field.node >= 0
        yield 0.5 * start / len(points)
    ends, triangles = _cut(tetrahedra, values, known, size)
    yield 0.5
    a, b = ends.T
    share = np.clip(values[a] / (values[a] - values[b]), CLIP, 1.0 - CLIP)[:, None]
    vertices = (1.0 - share) * points[a] + share * points[b]
    for done in range(SMOOTHINGS + 1):
        if done:
            vertices = _evened(vertices, field.normal, triangles)
            yield 0.5 + 0.5 * done / (SMOOTHINGS + 1)
        parts = []
        for start in range(0, max(len(vertices), 1), FIELD_AT_ONCE):
            some = slice(start, start + FIELD_AT_ONCE)
            vertices[some], part = _onto(charts, felt, vertices[some], 0.5 * size)
            parts.append(part)
            yield 0.5 + 0.5 * (done + start / max(len(vertices), 1)) / (SMOOTHINGS + 1)
        field = Blend(*(np.concatenate(values) for values in zip(*parts, strict=True)))
    return _felt(vertices, triangles, field)


def _felt(vertices: Array, triangles: Indices, field: Blend) -> Mesh:
    """The mesh without triangles that reach beyond what was felt, and without specks at rims."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    triangles = triangles[(field.node >= 0)[triangles].all(axis=1)]
    links = np.ones(2 * len(triangles)), (triangles[:, :2].ravel(), triangles[:, 1:].ravel())
    piece = connected_components(coo_matrix(links, (len(vertices),) * 2))[1][triangles[:, 0]]
    sizes = np.bincount(piece, minlength=1)
    triangles = triangles[sizes[piece] >= min(SPECK, sizes.max())]
    used, index = np.unique(triangles, return_inverse=True)
    return Mesh(vertices[used], index.reshape(-1, 3), field.std[used], field.node[used])


def _cells(charts: Charts, size: float) -> Generator[float, None, Indices]:
    """The cubes that patches pass through, and those beside them, (n, 3); yields 0 after each patch."""
    found = []
    for node in range(len(charts.radii)):
        half = MARGIN * charts.rims[node].max()
        count = 2 * int(np.ceil(2.0 * half * charts.radii[node] / size)) + 1  # odd: the origin is one
        if count**2 > MOST_CELLS:
            raise ValueError(
                f"edge: expected a few thousand edges at most across a patch, got {size / CELL:g}"
            )
        line = np.linspace(-half, half, count)
        x, y = (axis.ravel() for axis in np.meshgrid(line, line))
        each = np.full(len(x), node)
        inside = charts.shares(x, y, each) < MARGIN
        points, _ = charts.world(each[inside], x[inside], y[inside])
        found.append(_unique(np.floor(points / size).astype(np.intp)))
        yield 0.0
    cells = _unique(np.vstack(found))
    beside = np.vstack([np.zeros((1, 3), dtype=np.intp), np.eye(3, dtype=np.intp), -np.eye(3, dtype=np.intp)])
    return _unique((cells[:, None] + beside).reshape(-1, 3))


def _unique(rows: Indices) -> Indices:
    """Rows (n, 3) of whole numbers, each once."""
    return rows[np.unique(_keys(rows), return_index=True)[1]]


def _keys(rows: Indices) -> Indices:
    """One number for each of rows (n, 3) of whole numbers."""
    low = rows.min(axis=0)
    across = rows.max(axis=0) - low + 1
    off = rows - low
    keys: Indices = (off[:, 0] * across[1] + off[:, 1]) * across[2] + off[:, 2]
    return keys


def _tetrahedra(cells: Indices) -> tuple[Indices, Indices]:
    """Lattice points (n, 3), in halves of a cube, and tetrahedra (m, 4) on all faces between two cubes."""
    corners = []
    keys = _keys(np.vstack([cells, cells.min(axis=0) - 1, cells.max(axis=0) + 1]))[:-2]
    across = cells.max(axis=0) - cells.min(axis=0) + 3
    order = np.argsort(keys)
    steps = (across[1] * across[2], across[2], 1)
    for axis in range(3):
        at = np.searchsorted(keys[order], keys + steps[axis])
        both = keys[order][np.minimum(at, len(keys) - 1)] == keys + steps[axis]
        center = 2 * cells[both] + 1
        ahead = np.eye(3, dtype=np.intp)[axis]
        e1, e2 = np.eye(3, dtype=np.intp)[[(axis + 1) % 3, (axis + 2) % 3]]
        face = [center + ahead + i * e1 + j * e2 for i, j in FACE_CORNERS]
        corners += [
            np.stack([center, center + 2 * ahead, face[k], face[(k + 1) % 4]], axis=1) for k in range(4)
        ]
    flat = np.concatenate(corners).reshape(-1, 3)
    _, first, index = np.unique(_keys(flat), return_index=True, return_inverse=True)
    return flat[first], index.reshape(-1, 4)


def _cut(
    tetrahedra: Indices, values: Array, known: NDArray[np.bool_], size: float
) -> tuple[Indices, Indices]:
    """Lattice edges (n, 2) that the surface crosses, and its triangles (m, 3) between these crossings."""
    inside = values < 0.0
    signs = inside[tetrahedra]
    mixed = signs.any(axis=1) & ~signs.all(axis=1) & known[tetrahedra].all(axis=1)
    # Two corners of a tetrahedron are an edge of a cube apart at most.
    at = values[tetrahedra]
    mixed &= np.ptp(at, axis=1) <= JUMP * size
    tetrahedra, signs = tetrahedra[mixed], signs[mixed]
    case = signs @ (1 << np.arange(4))
    table = _table()
    corners = [tetrahedra[case == code][:, table[code]].reshape(-1, 2) for code in range(1, 15)]
    ends = np.sort(np.concatenate(corners), axis=1)
    keys = ends[:, 0] * len(values) + ends[:, 1]
    _, first, index = np.unique(keys, return_index=True, return_inverse=True)
    return ends[first], index.reshape(-1, 3)


@cache
def _table() -> dict[int, Indices]:
    """For each set of corners inside, as bits: the vertices of k triangles, counterclockwise from outside.

    A vertex lies on an edge, which is a pair of corners: (3 k, 2), three rows a triangle.
    """
    place = np.array([(-1, -1, -1), (1, -1, -1), (0, 1, -1), (0, 0, 1)], dtype=float)
    if np.linalg.det(place[1:] - place[0]) < 0.0:
        place[[0, 1]] = place[[1, 0]]
    found = {}
    for code in range(1, 15):
        ins = [i for i in range(4) if code >> i & 1]
        out = [i for i in range(4) if not code >> i & 1]
        if len(ins) == 2:
            ring = [(ins[0], out[0]), (ins[0], out[1]), (ins[1], out[1]), (ins[1], out[0])]
            triangles = [[ring[0], ring[1], ring[2]], [ring[0], ring[2], ring[3]]]
        else:
            triangles = [[(i, o) for i in ins for o in out]]
        middle = place[out].mean(axis=0) - place[ins].mean(axis=0)
        for k, triangle in enumerate(triangles):
            a, b, c = (place[list(pair)].mean(axis=0) for pair in triangle)
            if np.cross(b - a, c - a) @ middle < 0.0:
                triangles[k] = triangle[::-1]
        found[code] = np.array(triangles, dtype=np.intp).reshape(-1, 2)
    return found


def _onto(charts: Charts, felt: Felt, points: Array, most: float) -> tuple[Array, Blend]:
    """Points moved onto the surface by a step along the gradient, and the field before that step."""
    field = told(charts, felt, points)
    step = np.clip(field.distance, -most, most)
    return points - step[:, None] * field.normal, field


def _evened(vertices: Array, normal: Array, triangles: Indices) -> Array:
    """Vertices moved along the surface, towards the mean of their neighbors; those of a border stay."""
    from scipy.sparse import coo_matrix

    a, b = triangles[:, [0, 1, 2]].ravel(), triangles[:, [1, 2, 0]].ravel()
    n = len(vertices)
    links = coo_matrix((np.ones(len(a)), (a, b)), (n, n)).tocsr()
    border = np.asarray((abs(links - links.T)).sum(axis=1)).ravel() > 0.0
    links = links + links.T
    counts = np.asarray(links.sum(axis=1)).ravel()
    move = links @ vertices / np.maximum(counts, 1.0)[:, None] - vertices
    move -= np.einsum("ni,ni->n", move, normal)[:, None] * normal
    move[border | (counts == 0.0)] = 0.0
    moved: Array = vertices + SMOOTHING_SHARE * move
    return moved
