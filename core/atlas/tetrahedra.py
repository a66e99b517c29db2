# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Marching tetrahedra on a body-centered lattice. Not in the paper.

Each tetrahedron is cut by its signs (Doi and Koide 1991), so what comes out is a manifold. The lattice is
that of Labelle and Shewchuk 2007: its tetrahedra are all alike.
"""

from collections.abc import Generator
from functools import cache

import numpy as np
from numpy.typing import NDArray

from ..arguments import Array

Indices = NDArray[np.intp]

# python -m benchmarks.atlas judges these.
SMOOTHING_SHARE = 0.6  # Vertices move this share of the way to their neighbors' mean.
FACE_CORNERS = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)])  # The corners of a face, from its center.


def unique(rows: Indices) -> Indices:
    """The different ones among rows (n, 3) of whole numbers."""
    low = rows.min(axis=0)
    keys = np.ravel_multi_index(tuple((rows - low).T), tuple(rows.max(axis=0) - low + 1))
    return rows[np.unique(keys, return_index=True)[1]]


def _different(numbers: Indices) -> Indices:
    """The different ones among whole numbers, in order; numpy's own way is ten times as slow."""
    order = np.sort(numbers, axis=None)
    return order[np.diff(order, prepend=order[:1] - 1) > 0]


def tetrahedra_of(cells: Indices) -> Generator[float, None, tuple[Indices, Indices]]:
    """Lattice points (n, 3), in halves of a cube, and tetrahedra (m, 4) on all faces between two cubes.

    cells : (k, 3), the lowest corners of the cubes, in cubes

    Yields 0 between its parts.
    """
    low = 2 * cells.min(axis=0)
    shape = tuple(2 * cells.max(axis=0) + 4 - low)
    strides = np.array([shape[1] * shape[2], shape[2], 1])
    # A lattice point is a number, so all corners of a tetrahedron are at fixed offsets from a center.
    centers = (2 * cells + 1 - low) @ strides
    order, faces, distinct = np.sort(centers), [], np.zeros(0, dtype=np.intp)
    for ahead, e1, e2 in (np.roll(strides, -axis) for axis in range(3)):
        at = np.minimum(np.searchsorted(order, centers + 2 * ahead), len(order) - 1)
        some = centers[order[at] == centers + 2 * ahead, None]
        faces.append(some + np.array([0, 2 * ahead, *(ahead + FACE_CORNERS @ (e1, e2))]))
        distinct = _different(np.concatenate([distinct, _different(faces[-1])]))
        yield 0.0
    index = []
    for each in faces:
        points_of_face = np.searchsorted(distinct, each)
        index += [points_of_face[:, [0, 1, 2 + k, 2 + (k + 1) % 4]] for k in range(4)]
        yield 0.0
    points: Indices = np.stack(np.unravel_index(distinct, shape), axis=1) + low
    return points, np.concatenate(index)


def march(tetrahedra: Indices, values: Array) -> tuple[Indices, Indices]:
    """Lattice edges (n, 2) that the surface crosses, and its triangles (m, 3) between these crossings.

    tetrahedra : (k, 4), lattice points
    values : at all lattice points, negative inside
    """
    signs = (values < 0.0)[tetrahedra]
    mixed = signs.any(axis=1) & ~signs.all(axis=1)
    tetrahedra, signs = tetrahedra[mixed], signs[mixed]
    case = signs @ (1 << np.arange(4))
    corners = [tetrahedra[case == code][:, ends].reshape(-1, 2) for code, ends in _table().items()]
    ends = np.concatenate(corners)
    keys = ends.min(axis=1) * len(values) + ends.max(axis=1)
    distinct = _different(keys)
    crossed: Indices = np.stack(np.divmod(distinct, len(values)), axis=1)
    return crossed, np.searchsorted(distinct, keys).reshape(-1, 3)


@cache
def _table() -> dict[int, Indices]:
    """For each set of corners inside, as bits: the vertices of k triangles, counterclockwise from outside.

    A vertex lies on an edge, which is a pair of corners: (3 k, 2), three rows a triangle.
    """
    place = np.array([(-1, -1, -1), (1, -1, -1), (0, 1, -1), (0, 0, 1)], dtype=float)
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


def smoothed(vertices: Array, normal: Array, triangles: Indices) -> Array:
    """Vertices (n, 3) moved towards the mean of their neighbors, across their unit normals (n, 3).

    Those on the border of the triangles (m, 3) stay.
    """
    from scipy.sparse import coo_matrix

    a, b = triangles[:, [0, 1, 2]].ravel(), triangles[:, [1, 2, 0]].ravel()
    links = coo_matrix((np.ones(len(a)), (a, b)), (len(vertices),) * 2).tocsr()
    border = np.asarray((abs(links - links.T)).sum(axis=1)).ravel() > 0.0
    links = links + links.T
    counts = np.asarray(links.sum(axis=1)).ravel()
    move = links @ vertices / np.maximum(counts, 1.0)[:, None] - vertices
    move -= np.einsum("ni,ni->n", move, normal)[:, None] * normal
    move[border | (counts == 0.0)] = 0.0
    return vertices + SMOOTHING_SHARE * move


def keyed_sides(triangles: Indices, count: int) -> tuple[Indices, Indices]:
    """The sides (3 m, 2) of triangles (m, 3) between `count` vertices, triangle by triangle.

    Also numbers (3 m,) that are equal for the same edge, whichever way a triangle goes along it.
    """
    sides = triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    return sides, sides.min(axis=1) * count + sides.max(axis=1)


def sides_of(triangles: Indices, count: int) -> Indices:
    """The different edges (n, 2) of triangles (m, 3) between `count` vertices, the lower index first."""
    _, keys = keyed_sides(triangles, count)
    return np.stack(np.divmod(_different(keys), count), axis=1)


def subdivided(vertices: Array, triangles: Indices) -> tuple[Array, Indices]:
    """Vertices (n, 3) and triangles (m, 3) with a vertex more in the middle of each edge."""
    sides = sides_of(triangles, len(vertices))
    return np.vstack([vertices, vertices[sides].mean(axis=1)]), split_sides(triangles, sides, len(vertices))


def connected_pieces(i: Indices, j: Indices, count: int) -> tuple[int, Indices]:
    """The number of connected components of a graph, and the one of each of `count` nodes, (count,).

    i, j : (m,), the nodes that are linked, both ways
    """
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    return connected_components(coo_matrix((np.ones(len(i)), (i, j)), (count, count)), directed=False)


def split_sides(triangles: Indices, sides: Indices, new: int) -> Indices:
    """Triangles (m, 3) split at vertices new, new + 1, ... on sides (n, 2), the lower index first."""
    if not len(sides):
        return triangles
    keys = sides[:, 0] * new + sides[:, 1]
    order = np.argsort(keys)
    wanted = keyed_sides(triangles, new)[1].reshape(-1, 3)
    at = np.minimum(np.searchsorted(keys[order], wanted), len(keys) - 1)
    middle = np.where(keys[order][at] == wanted, new + order[at], -1)
    halves = (middle >= 0).sum(axis=1)
    found = [triangles[halves == 0]]
    for count in (1, 2, 3):
        some, mid = triangles[halves == count], middle[halves == count]
        # With one side split, it comes first; with two, the whole one comes last.
        turn = np.argmax(mid >= 0, axis=1) if count == 1 else (np.argmin(mid, axis=1) + 1) % 3
        turned = (turn[:, None] + np.arange(3)) % 3
        (a, b, c), (p, q, r) = np.take_along_axis(some, turned, 1).T, np.take_along_axis(mid, turned, 1).T
        parts = {
            1: [(a, p, c), (p, b, c)],
            2: [(p, b, q), (a, p, q), (a, q, c)],
            3: [(a, p, r), (p, b, q), (r, q, c), (p, q, r)],
        }[count]
        found += [np.stack(part, axis=1) for part in parts]
    return np.concatenate(found)
