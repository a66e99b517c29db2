# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Edges of triangles, and what is connected by edges."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

Indices = NDArray[np.intp]


def keyed_sides(triangles: Indices, count: int) -> tuple[Indices, Indices]:
    """The sides (3 m, 2) of triangles (m, 3) between `count` vertices, triangle by triangle.

    Also numbers (3 m,) that are equal for the same edge, whichever way a triangle goes along it.
    """
    sides = triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    return sides, sides.min(axis=1) * count + sides.max(axis=1)


def connected_pieces(i: Indices, j: Indices, count: int) -> tuple[int, Indices]:
    """The number of connected components of a graph, and the one of each of `count` nodes, (count,).

    i, j : (m,), the nodes that are linked, both ways
    """
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    return connected_components(coo_matrix((np.ones(len(i)), (i, j)), (count, count)), directed=False)


def graph_of(links: Indices) -> Any:
    """The sparse matrix (n, n) of bool whose row i has the nodes links[i], of (n, k), each once."""
    from scipy.sparse import coo_array

    n, k = links.shape
    return coo_array((np.ones(n * k, dtype=bool), (np.arange(n).repeat(k), links.ravel())), (n, n)).tocsr()


def pieces_of(graph: Any, some: Indices) -> Indices:
    """The connected component (m,) of each of some nodes of a graph, by the links between these alone."""
    from scipy.sparse.csgraph import connected_components

    pieces: Indices = connected_components(graph[some][:, some], directed=False)[1]
    return pieces


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
    split = [triangles[halves == 0]]
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
        split += [np.stack(part, axis=1) for part in parts]
    return np.concatenate(split)
