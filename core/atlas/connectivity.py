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
    """The sparse matrix (n, n) of bool of links between nodes i and links[i], of (n, k), both ways."""
    from scipy.sparse import coo_array

    n, k = links.shape
    ways = coo_array((np.ones(n * k, dtype=bool), (np.arange(n).repeat(k), links.ravel())), (n, n)).tocsr()
    return ways.maximum(ways.T)


def pieces_of(graph: Any, some: Indices) -> Indices:
    """The connected component (m,) of each of some nodes of a graph, by the links among these only."""
    from scipy.sparse.csgraph import connected_components

    pieces: Indices = connected_components(graph[some][:, some], directed=False)[1]
    return pieces
