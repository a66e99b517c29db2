# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A whole object as what it was felt to be: the paper's graph of patches, and one surface of all of them."""

from collections.abc import Generator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from ..arguments import LARGEST, Array, finite_array, number
from ..reconstruction.result import Reconstruction
from .boundaries import Edge, edges_of
from .charts import Charts
from .field import AGREE, DIFFER, LAYER, blended, node_weights
from .meshing import SMALLEST, Mesh, meshed


@dataclass(frozen=True, eq=False)
class Atlas:
    """Patches that overlap, nodes of a graph whose edges are the curves where one takes over from another.

    patches : of n nodes
    charts : the same as tables
    tolerance : that they were felt to, a length; None where there was none
    uncovered : places of rims that the touches have left
    """

    patches: tuple[Reconstruction, ...]
    charts: Charts
    tolerance: float | None = None
    uncovered: int = 0

    @cached_property
    def edges(self) -> list[Edge]:
        """Pairs of patches that share a boundary, with it."""
        return edges_of(self.charts)

    def distance(self, points: ArrayLike) -> tuple[Array, Array]:
        """Signed distances (n,) of points (n, 3), negative inside, and their standard deviations (n,).

        Beyond the patches' reach the distance is that of the nearest felt place, and the deviation inf where
        something unfelt might be nearer.
        """
        p = finite_array("points", points, (None, 3), LARGEST)
        field = blended(self.charts, p)
        return field.distance, field.std

    def mesh(self, edge: float) -> Mesh:
        """The surface as triangles whose edges are about as long as asked.

        Watertight where the object was felt all round, open where it was not.
        """
        steps = self.meshing(edge)
        try:
            while True:
                next(steps)
        except StopIteration as end:
            mesh: Mesh = end.value
            return mesh

    def suggested_edge(self) -> float:
        """An edge at which triangles are off the surface by half its deviation, in the median of the patches.

        A chord e of a circle of curvature k is off it by k e^2 / 8; an edge is no longer than half a radius.
        """
        bends = np.array([max(abs(r.patch.k1), abs(r.patch.k2)) for r in self.patches])
        stds = np.array([r.mean_height_std for r in self.patches])
        radii = np.array([r.radius for r in self.patches])
        chords = np.sqrt(4.0 * stds / np.maximum(bends, stds / radii**2))
        return float(np.median(np.minimum(chords, 0.5 * radii)))

    def curvatures(self, mesh: Mesh) -> dict[str, Array]:
        """Gaussian and mean curvature, shape index and curvedness (n,) at the vertices of its mesh, by name.

        K and H are means of what the patches say there, each as it counts in the blended surface; the others
        follow from these. Where no patch has a say, all are 0.
        """
        gauss, mean = _blended_curvatures(self, mesh)
        half = np.sqrt(np.maximum(mean**2 - gauss, 0.0))  # of the difference of kappa1 and kappa2
        return {
            "gaussian_curvature": gauss,
            "mean_curvature": mean,
            "shape_index": np.arctan2(mean, half) * (-2.0 / np.pi),
            "curvedness": np.sqrt(mean**2 + half**2),
        }

    def meshing(self, edge: float) -> Generator[float, None, Mesh]:
        """What `mesh` does, in steps: yields the share that is done, and returns the mesh."""
        return meshed(self.charts, number("edge", edge, above=0.0))


def _blended_curvatures(atlas: Atlas, mesh: Mesh) -> tuple[Array, Array]:
    """Means of K and H (n,) at the vertices, over the patches of the vertices' own wall."""
    charts = atlas.charts
    pairs = charts.pairs(mesh.vertices)
    facing = np.einsum("mi,mi->m", pairs.normal, mesh.normals[pairs.place])
    weights = node_weights(charts, pairs) * np.clip((facing - DIFFER) / (AGREE - DIFFER), 0.0, 1.0)
    radii = charts.radii[pairs.node]
    weights *= np.abs(pairs.distance) < LAYER * radii
    x, y = charts.local(mesh.vertices, pairs.place, pairs.node)[:, :2].T * radii
    curvatures, order = np.zeros((2, len(x))), np.argsort(pairs.node, kind="stable")
    for at in np.split(order, np.flatnonzero(np.diff(pairs.node[order])) + 1):
        d = atlas.patches[pairs.node[at[0]]].patch.derivatives(x[at], y[at])
        curvatures[:, at] = d.gaussian_curvature, d.mean_curvature
    count = len(mesh.vertices)
    total = np.maximum(np.bincount(pairs.place, weights, count), SMALLEST)
    gauss, mean = (np.bincount(pairs.place, weights * each, count) / total for each in curvatures)
    return gauss, mean
