# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The graph (paper, VI): its nodes as data, and its edges, the curves where two patches weigh the same.

The curvatures along edges are those of the patches' polynomials.
"""

from collections.abc import Generator
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..arguments import Array
from ..reconstruction.deviations import gaussian_curvature_stds
from ..reconstruction.result import Reconstruction
from ..reconstruction.serialization import polynomial_dict
from .charts import MARGIN, Charts
from .field import LAYER, argmin_per_point, node_weights
from .finger import FACING

# Boundaries are looked for on this many rays from each patch's middle, at this many places.
RAYS, RAY_PLACES = 32, 16


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
    """A patch of mean deviation `std` as a node of the graph, in plain values: its place and its shape."""
    return {
        "frame": {"origin": r.frame.origin.tolist(), "axes": r.frame.axes.tolist()},
        "radius": r.radius,
        "polynomial": polynomial_dict(r.patch),
        "domain": r.domain.ends.tolist(),
        "mean_height_std": std,
        **{name: getattr(r, name) for name in ("status", "message")},
    }


def edges_of(charts: Charts) -> Generator[float, None, list[Edge]]:
    """All pairs of patches that share a boundary, which is taken from the patch more of whose rays cross it.

    Yields the share that is done.
    """
    parts, count = [], len(charts.radii)
    for node in range(count):
        parts.append(_crossings(charts, node))
        yield 0.9 * (node + 1) / count
    nodes, others, rays, points, angles = (np.concatenate(values) for values in zip(*parts, strict=True))
    pairs: dict[tuple[int, int], list[int]] = {}
    for i, pair in enumerate(zip(nodes.tolist(), others.tolist(), strict=True)):
        pairs.setdefault(pair, []).append(i)
    edges = []
    for pair in sorted({(min(p), max(p)) for p in pairs}):
        which = max(pairs.get(pair, []), pairs.get(pair[::-1], []), key=len)
        # In the order of their rays, beginning after the widest gap between two.
        gaps = np.diff(rays[which], append=rays[which[0]] + RAYS)
        turned = np.roll(which, -1 - int(np.argmax(gaps)))
        edges.append(Edge(pair, points[turned], angles[turned]))
        yield 1.0
    return edges


def gaussian_curvature_of(r: Reconstruction, points: Array) -> tuple[Array, Array]:
    """K of a patch's polynomial at points (m, 3) on it, (m,), and standard deviations (m,), in 1/length^2."""
    x, y, _ = r.frame.to_local(points).T
    return r.patch.gaussian_curvature(x, y), gaussian_curvature_stds(r, x, y)


def _crossings(
    charts: Charts, node: int
) -> tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.intp], Array, Array]:
    """Where one patch gives way to others, on k rays from its middle.

    Returns its index and that of the other patch, the ray, (k,) each, the point (k, 3), and the angle between
    both normals (k,), in radians.
    """
    turns = 2.0 * np.pi * np.arange(RAYS) / RAYS
    out = MARGIN * np.arange(1, RAY_PLACES + 1) / (RAY_PLACES + 1)
    rays = np.stack([np.cos(turns), np.sin(turns)], axis=1)
    unit = 1.0 / np.maximum(charts.shares(rays[:, 0], rays[:, 1], np.full(RAYS, node)), 1e-9)
    xy = (rays * unit[:, None])[:, None] * out[:, None]
    points, normals = charts.world(np.full(RAYS * RAY_PLACES, node), *xy.reshape(-1, 2).T)
    pairs = charts.pairs(points)
    weights = node_weights(charts, pairs)
    cosine = np.einsum("mi,mi->m", pairs.normal, normals[pairs.point_index])
    same_sheet = (np.abs(pairs.distance) < LAYER * charts.radii[pairs.patch]) & (cosine > FACING)
    own = pairs.patch == node
    mine = np.bincount(pairs.point_index[own], weights[own], len(points))
    others = np.where(same_sheet & ~own, weights, 0.0)
    which = argmin_per_point(pairs.point_index, -others, len(points))
    best = np.append(others, 0.0)[which]
    ratio = np.log(np.maximum(best, 1e-300)) - np.log(np.maximum(mine, 1e-300))
    ratio = ratio.reshape(RAYS, RAY_PLACES)
    lost = ratio > 0.0
    ray = np.flatnonzero(lost.any(axis=1))
    at = lost[ray].argmax(axis=1)
    before = np.maximum(at - 1, 0)
    a, b = np.where(at > 0, ratio[ray, before], 0.0), ratio[ray, at]
    share = np.clip(-a / np.where(b - a > 0.0, b - a, 1.0), 0.0, 1.0)
    place = ray * RAY_PLACES + at
    flat = (1.0 - share)[:, None] * xy[ray, before] + share[:, None] * xy[ray, at]
    point, _ = charts.world(np.full(len(ray), node), *flat.T)
    angle = np.arccos(np.clip(cosine[which[place]], -1.0, 1.0))
    return np.full(len(ray), node), pairs.patch[which[place]], ray, point, angle
