# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A whole object as it was felt (paper, VI): the graph of its patches, and one surface of all of them."""

from collections.abc import Generator
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..arguments import LARGEST, Array, finite_array, number
from ..contours.finger import FACING
from ..exploration.side_by_side import result_of
from ..reconstruction.result import Reconstruction
from ..reconstruction.serialization import plain
from .boundaries import Edge, blended_curvatures, edges_of, gaussian_curvature_of, node_dict
from .charts import Charts
from .field import INSIDE, Felt, blended, nearest_feet
from .frontier import Place
from .join import felt_by, told
from .meshing import Mesh, meshed

AHEAD = 0.9  # The normal at a foot tells the side if the cosine of its angle to the way there is more.
CLOSE = 0.02  # Farther than this share of a radius from a patch the distance is that of the nearest foot.
OFF_SURFACE = 3.0  # A place of a patch that is off the field by more deviations is none of the surface.
GRAPH_VERSION = 1  # The version of the graph as plain values.
SAMPLE_TURNS, SAMPLES_OUTWARD = 16, 6  # From far away distances are those of so many samples of each patch.


class NextTouch(NamedTuple):
    """Where to touch next, (3,) each, and the gain: the area there that is not known well enough."""

    point: Array
    outward: Array
    gain: float


class _Samples(NamedTuple):
    """Points (n, 3) of the surface, deviations (n,), inf at an open rim, how far apart, and a KD-tree."""

    points: Array
    stds: Array
    apart: Array
    tree: Any


@dataclass(frozen=True, eq=False)
class Atlas:
    """Overlapping patches: the nodes of a graph (paper, VI) whose edges are the curves where they meet.

    patches : the n nodes
    charts : the same patches as tables
    tolerance : mean deviation of the height that the touches were to reach, a length; None if there was none
    uncovered : places on rims beyond which the object goes on unfelt
    """

    patches: tuple[Reconstruction, ...]
    charts: Charts
    tolerance: float | None = None
    uncovered: tuple[Place, ...] = ()

    @cached_property
    def edges(self) -> list[Edge]:
        """All pairs of patches that share a boundary, each with this boundary."""
        edges: list[Edge] = result_of(edges_of(self.charts))
        return edges

    def bounding(self) -> Generator[float, None, None]:
        """Finds `edges` in steps: yields the share that is done."""
        if "edges" not in vars(self):
            vars(self)["edges"] = yield from edges_of(self.charts)  # where cached_property looks

    def bends(self, edge: Edge) -> tuple[Array, Array]:
        """Gaussian curvatures (2, m) of both patches along their boundary, and standard deviations (2, m).

        They follow from the polynomials of the touches, which are less certain at a rim than at the point.
        """
        curvatures, stds = zip(
            *(gaussian_curvature_of(self.patches[node], edge.curve) for node in edge.nodes), strict=True
        )
        return np.array(curvatures), np.array(stds)

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
        count = len(self.uncovered)
        if count:
            places = "one place" if count == 1 else f"{count} places"
            return "uncertain", (
                f"The patches end at {places} where the object goes on: allow more touches or a larger "
                "tolerance."
            )
        rough = len(self._uncertain)
        if rough:
            return "uncertain", (
                f"{rough} of {len(self.patches)} patches are less certain than the tolerance: touch "
                "there again or use a larger tolerance."
            )
        return "ok", "The object was felt everywhere a finger could reach."

    @cached_property
    def _uncertain(self) -> list[int]:
        """Indices of the patches less certain than the tolerance, the worst first."""
        return self.charts.less_certain_than(np.inf if self.tolerance is None else self.tolerance)

    def next_touch(self) -> NextTouch | None:
        """Where the next touch would bring most, or None if all is covered to the tolerance."""
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

        Far from the surface it is the distance of the nearest place on it. If that is on an open rim,
        something unfelt might be nearer, and the deviation is inf.
        """
        p = finite_array("points", points, (None, 3), LARGEST)
        field = told(self.charts, self._felt, p)
        distance, std, near = field.distance.copy(), field.std.copy(), np.isfinite(field.std)
        far = np.flatnonzero(~near | (np.abs(distance) > CLOSE * self.charts.radii[field.node]))
        if len(far):
            distance[far], std[far] = self._far(p[far], distance[far], near[far])
        return distance, std

    def _far(self, points: Array, guess: Array, near: NDArray[np.bool_]) -> tuple[Array, Array]:
        """Distances and deviations (n,) from the nearest feet; the field says a guess, and if it is near."""
        samples = self._samples
        nearest = samples.tree.query(points)[1]
        feet, field = nearest_feet(self.charts, points, samples.points[nearest])
        off, apart = points - feet, samples.apart[nearest]
        away, ahead = np.linalg.norm(off, axis=1), np.einsum("ni,ni->n", off, field.normal)
        # If the way to the foot is not along its normal, the foot is at an edge, or another is nearer.
        missed = np.minimum(away - np.abs(ahead), apart**2 / np.maximum(2.0 * away, 1e-300))
        std = np.where(np.isfinite(samples.stds[nearest]), np.hypot(field.std, missed), np.inf)
        # At an edge the normal of one wall does not tell the side, and beyond it a patch may go on.
        side = np.where(~near & (np.abs(ahead) > AHEAD * away), ahead, guess)
        return np.copysign(away, side), std

    @cached_property
    def _felt(self) -> Felt:
        return felt_by(self.patches, self.charts)

    @cached_property
    def _samples(self) -> _Samples:
        from scipy.spatial import cKDTree

        charts, count = self.charts, len(self.patches)
        turns = 2.0 * np.pi * np.arange(SAMPLE_TURNS) / SAMPLE_TURNS
        node = np.repeat(np.arange(count), SAMPLE_TURNS * SAMPLES_OUTWARD)
        rays = np.tile(np.repeat(np.stack([np.cos(turns), np.sin(turns)]), SAMPLES_OUTWARD, axis=1), count)
        out = np.tile(np.arange(1, SAMPLES_OUTWARD + 1) / SAMPLES_OUTWARD, SAMPLE_TURNS * count)
        x, y = rays * out / np.maximum(charts.shares(rays[0], rays[1], node), 1e-9)
        points, normals = charts.world(node, x, y)
        pairs = charts.pairs(points)
        other = (pairs.share < INSIDE) & (pairs.node != node[pairs.place])
        other &= np.einsum("mi,mi->m", pairs.normal, normals[pairs.place]) > FACING
        inside = np.bincount(pairs.place[other], minlength=len(points)) > 0
        field, apart = blended(charts, points), np.pi / SAMPLE_TURNS * charts.radii[node]
        field.std[(out == 1.0) & ~inside] = np.inf
        # At a rim, or beyond an edge, a patch may be off the surface of all.
        on = np.abs(field.distance) <= OFF_SURFACE * field.std
        return _Samples(points[on], field.std[on], apart[on], cKDTree(points[on]))

    def mesh(self, edge: float) -> Mesh:
        """The surface as triangles whose edges are about as long as asked.

        It is closed if the object was felt all round, and open where it was not.
        """
        mesh: Mesh = result_of(self.meshing(edge))
        return mesh

    def suggested_edge(self) -> float:
        """The edge at which triangles are off the surface by half its deviation, as a median of the patches.

        A chord e of a circle of curvature k is off it by k e^2 / 8. The edge is at most half a radius long.
        """
        bends = np.array([max(abs(r.patch.k1), abs(r.patch.k2)) for r in self.patches])
        stds, radii = self.charts.mean_stds, self.charts.radii
        chords = np.sqrt(4.0 * stds / np.maximum(bends, stds / radii**2))
        return float(np.median(np.minimum(chords, 0.5 * radii)))

    def curvatures(self, mesh: Mesh) -> dict[str, Array]:
        """The curvatures of `curvatures_at` at the vertices of a mesh of this atlas."""
        return self.curvatures_at(mesh.vertices, mesh.normals)

    def curvatures_at(self, points: Array, normals: Array) -> dict[str, Array]:
        """Gaussian and mean curvature, shape index and curvedness (n,) at points of the surface, by name.

        points, normals : (n, 3)

        K and H are means over the polynomials (1) of the touches there, each with its patch's weight in the
        blended surface; the others follow from these. Where there is no patch, all are 0. Joined patches are
        not asked, because they follow facets, which makes their second derivatives rougher.
        """
        gauss, mean = blended_curvatures(self.patches, self.charts, points, normals)
        half = np.sqrt(np.maximum(mean**2 - gauss, 0.0))  # half the difference of kappa1 and kappa2
        return {
            "gaussian_curvature": gauss,
            "mean_curvature": mean,
            "shape_index": np.arctan2(mean, half) * (-2.0 / np.pi),
            "curvedness": np.sqrt(mean**2 + half**2),
        }

    def meshing(self, edge: float) -> Generator[float, None, Mesh]:
        """Makes the `mesh` in steps: yields the share that is done, and returns the mesh."""
        edge, size = number("edge", edge, above=0.0), float(np.ptp(self._felt.points, axis=0).max())
        if edge > size:
            raise ValueError(f"edge: expected at most the size of what was felt, {size:.3g}, got {edge:.3g}")
        return meshed(self.charts, self._felt, edge)

    def to_dict(self) -> dict[str, Any]:
        """The graph as JSON has it: a dict of numbers, words, lists and dicts, in the caller's unit.

        nodes : frame, radius, polynomial (1), ends of the domain, deviation and status of each patch
        edges : indices of two nodes, their boundary curve, and the angle of their normals along it
        uncovered, next_touch : where the object goes on, and where a touch would bring most, or None

        The `to_dict` of each patch tells all about it, and is thirty times as large.
        """
        touch, stds = self.next_touch(), self.charts.mean_stds
        return {
            "version": GRAPH_VERSION,
            **{name: getattr(self, name) for name in ("status", "message", "tolerance")},
            "nodes": [node_dict(r, float(std)) for r, std in zip(self.patches, stds, strict=True)],
            "edges": [edge.to_dict() for edge in self.edges],
            "uncovered": [{"point": list(p.point), "outward": list(p.normal)} for p in self.uncovered],
            "next_touch": None if touch is None else plain(touch._asdict()),
        }
