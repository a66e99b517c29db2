# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A whole object as what it was felt to be: the paper's graph of patches, and one surface of all of them."""

from collections.abc import Generator
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ..arguments import LARGEST, Array, finite_array, number
from ..reconstruction.result import Reconstruction
from .boundaries import Edge, edges_of
from .charts import Charts
from .field import AGREE, DIFFER, LAYER, blended, node_weights
from .frontier import FACING, INSIDE, Place
from .meshing import SMALLEST, Mesh, meshed

TURNS, OUTWARD = 16, 6  # samples of each patch, from which what is far away is measured


class NextTouch(NamedTuple):
    """Where to touch next, (3,) each, and what it would bring: the area that is not known well enough."""

    point: Array
    outward: Array
    gain: float


class _Samples(NamedTuple):
    """Points and normals (n, 3) of the surface, deviations (n,), and a tree; at an open rim they are inf."""

    points: Array
    normals: Array
    stds: Array
    tree: Any


@dataclass(frozen=True, eq=False)
class Atlas:
    """Patches that overlap, nodes of a graph whose edges are the curves where one takes over from another.

    patches : of n nodes
    charts : the same as tables
    tolerance : that they were felt to, a length; None where there was none
    uncovered : places of rims beyond which there is something that was not felt
    """

    patches: tuple[Reconstruction, ...]
    charts: Charts
    tolerance: float | None = None
    uncovered: tuple[Place, ...] = ()

    @cached_property
    def edges(self) -> list[Edge]:
        """Pairs of patches that share a boundary, with it."""
        return edges_of(self.charts)

    @property
    def status(self) -> str:
        """ "ok" or "uncertain"."""
        return self._verdict[0]

    @property
    def message(self) -> str:
        """The status in a sentence, with advice."""
        return self._verdict[1]

    @cached_property
    def _verdict(self) -> tuple[str, str]:
        if self.uncovered:
            return "uncertain", (
                f"The patches end at {len(self.uncovered)} places where the object goes on: allow more "
                "touches, or a larger tolerance."
            )
        rough = len(self._uncertain)
        if rough:
            return "uncertain", (
                f"{rough} of {len(self.patches)} patches are less certain than the tolerance: touch there "
                "once more, or take a larger one."
            )
        return "ok", "The object was felt wherever a finger could go on."

    @cached_property
    def _uncertain(self) -> list[int]:
        """Patches less certain than the tolerance, the worst first."""
        return self.charts.less_certain_than(np.inf if self.tolerance is None else self.tolerance)

    def next_touch(self) -> NextTouch | None:
        """Where the next touch would bring most; None where all is covered as well as was asked for."""
        if self.uncovered:
            place = max(self.uncovered, key=lambda place: place.radius)
            area = np.pi * place.radius**2
            return NextTouch(np.array(place.point), np.array(place.normal), area)
        if not self._uncertain:
            return None
        worst = self._uncertain[0]
        return NextTouch(*self.charts.least_certain(worst), self.patches[worst].domain.area)

    def distance(self, points: ArrayLike) -> tuple[Array, Array]:
        """Signed distances (n,) of points (n, 3), negative inside, and their standard deviations (n,).

        Beyond the patches' reach the distance is that of the nearest place that was felt, and the deviation
        inf where that is at an open rim, so that something unfelt might be nearer.
        """
        p = finite_array("points", points, (None, 3), LARGEST)
        field = blended(self.charts, p)
        distance, std, far = field.distance.copy(), field.std.copy(), np.flatnonzero(field.node < 0)
        if len(far):
            distance[far], std[far] = self._far(p[far])
        return distance, std

    def _far(self, points: Array) -> tuple[Array, Array]:
        """By the nearest sample: on the side that it faces, as far as it is."""
        samples = self._samples
        away, nearest = samples.tree.query(points)
        ahead = np.einsum("ni,ni->n", points - samples.points[nearest], samples.normals[nearest])
        return np.copysign(away, ahead), samples.stds[nearest]

    @cached_property
    def _samples(self) -> _Samples:
        from scipy.spatial import cKDTree

        charts, count = self.charts, len(self.patches)
        turns = 2.0 * np.pi * np.arange(TURNS) / TURNS
        node = np.repeat(np.arange(count), TURNS * OUTWARD)
        rays = np.tile(np.repeat(np.stack([np.cos(turns), np.sin(turns)]), OUTWARD, axis=1), count)
        out = np.tile(np.arange(1, OUTWARD + 1) / OUTWARD, TURNS * count)
        x, y = rays * out / np.maximum(charts.shares(rays[0], rays[1], node), 1e-9)
        points, normals = charts.world(node, x, y)
        pairs = charts.pairs(points)
        other = (pairs.share < INSIDE) & (pairs.node != node[pairs.place])
        other &= np.einsum("mi,mi->m", pairs.normal, normals[pairs.place]) > FACING
        inside = np.bincount(pairs.place[other], minlength=len(points)) > 0
        stds = blended(charts, points).std
        stds[(out == 1.0) & ~inside] = np.inf
        return _Samples(points, normals, stds, cKDTree(points))

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
        stds, radii = self.charts.mean_stds, self.charts.radii
        chords = np.sqrt(4.0 * stds / np.maximum(bends, stds / radii**2))
        return float(np.median(np.minimum(chords, 0.5 * radii)))

    def curvatures(self, mesh: Mesh) -> dict[str, Array]:
        """Gaussian and mean curvature, shape index and curvedness (n,) at the vertices of its mesh, by name.

        K and H are means of what the patches say there, each as it counts in the blended surface; the others
        follow from these. Where no patch has a say, all are 0.
        """
        gauss, mean = _blended_curvatures(self.charts, mesh)
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


def _blended_curvatures(charts: Charts, mesh: Mesh) -> tuple[Array, Array]:
    """Means of K and H (n,) at the vertices, over the patches of the vertices' own wall."""
    pairs = charts.pairs(mesh.vertices)
    facing = np.einsum("mi,mi->m", pairs.normal, mesh.normals[pairs.place])
    weights = node_weights(charts, pairs) * np.clip((facing - DIFFER) / (AGREE - DIFFER), 0.0, 1.0)
    radii = charts.radii[pairs.node]
    weights *= np.abs(pairs.distance) < LAYER * radii
    x, y = charts.local(mesh.vertices, pairs.place, pairs.node)[:, :2].T
    curvatures = charts.curvatures(x, y, pairs.node)
    count = len(mesh.vertices)
    total = np.maximum(np.bincount(pairs.place, weights, count), SMALLEST)
    gauss, mean = (np.bincount(pairs.place, weights * each, count) / total for each in curvatures)
    return gauss, mean
