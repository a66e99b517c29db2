# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The graph (paper, VI): its nodes as data, and its edges, the curves where two patches weigh the same.

The curvatures along edges are those of the patches' polynomials.
"""

from typing import Any, NamedTuple

import numpy as np

from ..arguments import Array
from ..reconstruction.deviations import gaussian_curvature_stds
from ..reconstruction.result import Reconstruction
from ..reconstruction.serialization import polynomial_dict
from ..triangles import row_dot
from .charts import Charts
from .connectivity import keyed_sides
from .finger import FACING
from .meshing import Mesh


class Edge(NamedTuple):
    """Two patches that share a boundary.

    nodes : their indices
    curve : (m, 3), points of the boundary
    angle : (m,), angles between their normals there, in radians
    """

    nodes: tuple[int, int]
    curve: Array
    angle: Array

    def to_dict(self) -> dict[str, Any]:
        """The edge as plain values."""
        return {"nodes": list(self.nodes), "curve": self.curve.tolist(), "angle": self.angle.tolist()}


def node_dict(r: Reconstruction, std: float) -> dict[str, Any]:
    """A patch as a node of the graph, in plain values.

    std : the mean standard deviation of the height of the joined patch, a length
    """
    return {
        "frame": {"origin": r.frame.origin.tolist(), "axes": r.frame.axes.tolist()},
        "radius": r.radius,
        "polynomial": polynomial_dict(r.patch),
        "domain": r.domain.ends.tolist(),
        "mean_height_std": std,
        "status": r.status,
        "message": r.message,
    }


def edges_of(charts: Charts, mesh: Mesh) -> list[Edge]:
    """All pairs of patches that share a boundary on the mesh of their surface.

    It passes between two vertices where different patches have the most weight.
    """
    sides, keys = keyed_sides(mesh.triangles, len(mesh.vertices))
    sides = sides[np.unique(keys, return_index=True)[1]]
    nodes = np.sort(mesh.patch[sides], axis=1)
    which = (nodes[:, 0] >= 0) & (nodes[:, 0] < nodes[:, 1])
    nodes, middles = nodes[which], mesh.vertices[sides[which]].mean(axis=1)
    (x, y, _), (u, v, _) = (charts.local(middles, np.arange(len(nodes)), patch) for patch in nodes.T)
    points, one = charts.world(nodes[:, 0], x, y)
    cosine, turns = row_dot(one, charts.world(nodes[:, 1], u, v)[1]), np.arctan2(y, x)
    order = np.lexsort((turns, *nodes.T[::-1]))
    order = order[cosine[order] > FACING]  # At a crease there are two sheets.
    pairs, first = np.unique(nodes[order], axis=0, return_index=True)
    edges = []
    for pair, some in zip(pairs.tolist(), np.split(order, first)[1:], strict=True):
        # In the order around the first patch, beginning after the widest gap between two.
        gaps = np.diff(turns[some], append=turns[some[0]] + 2.0 * np.pi)
        some = np.roll(some, -1 - int(np.argmax(gaps)))
        edges.append(Edge(tuple(pair), points[some], np.arccos(np.minimum(cosine[some], 1.0))))
    return edges


def gaussian_curvature_of(r: Reconstruction, points: Array) -> tuple[Array, Array]:
    """K of a patch's polynomial at points (m, 3) on it, (m,), and standard deviations (m,), in 1/length^2."""
    x, y, _ = r.frame.to_local(points).T
    return r.patch.gaussian_curvature(x, y), gaussian_curvature_stds(r, x, y)
