# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Marching tetrahedra on a body-centered lattice. Beside the paper.

Each tetrahedron is cut as its signs say (Doi and Koide 1991), so what comes out is a manifold. The lattice is
that of Labelle and Shewchuk 2007: its tetrahedra are all alike.
"""

from collections.abc import Generator
from functools import cache
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from ..arguments import Array

Indices = NDArray[np.intp]

# python -m benchmarks.atlas judges these.
JUMP = 3.0  # Where the field is steeper it jumps from wall to wall and has no surface.
TURN = 0.5  # The surface may cross an edge twice if the cosine between the gradients at its ends is less.
SMOOTHING_SHARE = 0.6  # Vertices move this share of the way to their neighbors' mean.
FACE_CORNERS = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)])  # The corners of a face, from its center.


def unique(rows: Indices) -> Indices:
    """The different ones among rows (n, 3) of whole numbers."""
    return rows[np.unique(_keys(rows), return_index=True)[1]]


def _keys(rows: Indices) -> Indices:
    """A number (n,) for each of the rows (n, 3) of whole numbers, equal only for equal rows."""
    low = rows.min(axis=0)
    return np.ravel_multi_index(tuple((rows - low).T), tuple(rows.max(axis=0) - low + 1))


def tetrahedra_of(cells: Indices) -> Generator[float, None, tuple[Indices, Indices]]:
    """Lattice points (n, 3), in halves of a cube, and tetrahedra (m, 4) on all faces between two cubes.

    Yields 0 between its parts.
    """
    corners = []
    numbers = _keys(np.vstack([cells, cells.min(axis=0) - 1, cells.max(axis=0) + 1]))[:-2]
    across = cells.max(axis=0) - cells.min(axis=0) + 3
    order = np.argsort(numbers)
    steps = (across[1] * across[2], across[2], 1)
    for axis in range(3):
        at = np.searchsorted(numbers[order], numbers + steps[axis])
        both = numbers[order][np.minimum(at, len(numbers) - 1)] == numbers + steps[axis]
        center = 2 * cells[both] + 1
        ahead = np.eye(3, dtype=np.intp)[axis]
        e1, e2 = np.eye(3, dtype=np.intp)[[(axis + 1) % 3, (axis + 2) % 3]]
        face = [center + ahead + i * e1 + j * e2 for i, j in FACE_CORNERS]
        corners += [
            np.stack([center, center + 2 * ahead, face[k], face[(k + 1) % 4]], axis=1) for k in range(4)
        ]
    yield 0.0
    low = 2 * cells.min(axis=0)
    shape, keys, different = tuple(2 * cells.max(axis=0) + 4 - low), [], []
    for some in corners:
        keys.append(np.ravel_multi_index(tuple((some - low).reshape(-1, 3).T), shape))
        different.append(np.unique(keys[-1]))
        yield 0.0
    known, index = np.unique(np.concatenate(different)), []
    for each in keys:
        index.append(np.searchsorted(known, each))
        yield 0.0
    points: Indices = np.stack(np.unravel_index(known, shape), axis=1) + low
    return points, np.concatenate(index).reshape(-1, 4)


def crossed_twice(tetrahedra: Indices, points: Array, values: Array, normals: Array) -> Indices:
    """Edges (n, 2) on one side of the surface that it may cross twice, for it turns between their ends."""
    ends = tetrahedra[:, list(combinations(range(4), 2))].reshape(-1, 2)
    a, b = ends.T
    some = np.flatnonzero((values[a] < 0.0) == (values[b] < 0.0))
    some = some[np.einsum("ni,ni->n", normals[a[some]], normals[b[some]]) < TURN]
    lengths = np.linalg.norm(points[a[some]] - points[b[some]], axis=1)
    some = some[np.abs(values[a[some]]) + np.abs(values[b[some]]) < lengths]
    return np.unique(np.sort(ends[some], axis=1), axis=0)


def split(tetrahedra: Indices, edges: Indices, new: int) -> Indices:
    """Tetrahedra with points new, new + 1, ... on edges (n, 2), so that all around one are cut in two."""
    concerned = np.isin(tetrahedra, edges).sum(axis=1) > 1
    some = tetrahedra[concerned]
    for k, (a, b) in enumerate(edges.tolist()):
        on = (some == a).any(axis=1) & (some == b).any(axis=1)
        halves = [np.where(some[on] == end, new + k, some[on]) for end in (a, b)]
        some = np.concatenate([some[~on], *halves])
    return np.concatenate([tetrahedra[~concerned], some])


def cut(tetrahedra: Indices, values: Array, size: float) -> tuple[Indices, Indices]:
    """Lattice edges (n, 2) that the surface crosses, and its triangles (m, 3) between these crossings."""
    inside = values < 0.0
    signs = inside[tetrahedra]
    mixed = signs.any(axis=1) & ~signs.all(axis=1)
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


def evened(vertices: Array, normal: Array, triangles: Indices) -> Array:
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
