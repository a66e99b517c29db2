# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A whole object as it was felt (paper, VI): the graph of its patches, and one surface of all of them."""

from collections.abc import Generator, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..arguments import LARGEST, Array, finite_array, many, number
from ..contours.contour import Contour, SamplingPlane
from ..reconstruction.result import Reconstruction
from ..reconstruction.serialization import plain
from ..steps import chunked, result_of
from ..triangles import LEAST_DIVISOR, far_apart, triangle_cross
from ..verdict import FINER, TOUCHES, Doubt, Judged, beyond
from .borders import Border, snapped_to_border
from .boundaries import Edge, edges_of, gaussian_curvature_of, node_dict
from .charts import PLACES_AT_ONCE, Charts
from .curvature import NormalSamples, curvatures_of, sheets_of
from .field import Blend, sheet_facing
from .frontier import RimPlace
from .indicator import Indicator
from .meshing import MOST_BYTES, WALL, Felt, MeasuredContacts, Mesh, memory_of, meshed
from .reference_mesh import ReferenceMesh
from .samples import indicated

FINE, SHARE = 1.0 / 160.0, 1.0 / 60.0  # Edges chosen by the curvature are between these shares of the size.
LIMIT, ROUGH = 1.5, 0.01  # Deviations are above LIMIT tolerances on at most the share ROUGH of the surface.
# What is off the surface by more tolerances is of something else: a patch ends there, and a contact
# contradicts the surface if it is off by so many deviations, too.
NEAR, OFF_STDS = 3.0, 5.0
THIN = 0.9  # Walls are resolved from this share of the thickness that cells are made for.
BORDER = 2.0  # Beyond the border of the mesh it does from this many edges away.
WITHIN_90 = 1.645  # This many deviations are a 90 % interval.
CURVED_AT_ONCE = 1000  # Curvatures are found at this many places at once.
APART = 0.3  # The next touch is this many radii from those that failed.
TURNS, STEPS = (0.0, 60.0, 120.0), 12  # The planes of the next touch, and the steps of a half curve.
GRAPH_VERSION = 2  # The version of the graph as plain values.


class NextTouch(NamedTuple):
    """Where to touch next, and how.

    point, outward : (3,), a place that may be off the object where nothing was felt, and the way outward
    directions : (k, 3), the tangents of sampling planes through both, in the world
    extent, step : the length of each half curve, and from contact to contact
    gain : the area there that is not known well enough
    """

    point: Array
    outward: Array
    directions: Array
    extent: float
    step: float
    gain: float


class Check(NamedTuple):
    """Contacts of a finger that comes from outside, all round.

    points, normals : (n, 3), where it met the object
    missed : (k, 3), places of the surface that it did not meet
    at_random : the number of contacts at random places, which come first; at the others errors are likely
    """

    points: Array
    normals: Array
    missed: Array
    at_random: int


NO_CHECK = Check(np.zeros((0, 3)), np.zeros((0, 3)), np.zeros((0, 3)), 0)


def suggested_edge(patches: Sequence[Reconstruction], charts: Charts, indicator: Indicator) -> float:
    """The edge at which triangles are off the surface by half its deviation, as a median of the patches.

    A chord e of a circle of curvature k is off it by k e^2 / 8. The edge is at most a sixtieth of the size,
    and short enough for the thinnest wall.
    """
    bends = np.array([max(abs(r.patch.k1), abs(r.patch.k2)) for r in patches])
    stds, radii = charts.mean_stds, charts.radii
    chords = np.sqrt(4.0 * stds / np.maximum(bends, stds / radii**2))
    edge = float(np.clip(np.median(chords), FINE * indicator.size, SHARE * indicator.size))
    return min(edge, WALL * indicator.resolved)


def joined_surface(
    patches: Sequence[Reconstruction],
    charts: Charts,
    tolerance: float | None,
    felt: Felt | None = None,
) -> Generator[float, None, ReferenceMesh]:
    """The joined surface of patches, as a mesh with edges of the suggested length; yields the share done.

    felt : as in `meshed`
    """
    indicator = yield from indicated(charts, tolerance)
    edge = suggested_edge(patches, charts, indicator)
    mesh, unfelt = yield from meshed(charts, indicator, edge, None, felt, tolerance or 0.0)
    return ReferenceMesh(mesh, indicator, unfelt)


def _touch_at(point: Array, outward: Array, ahead: ArrayLike, extent: float, gain: float) -> NextTouch:
    """A touch with sampling planes at 0, 60 and 120 degrees from the direction ahead."""
    planes = (SamplingPlane(turn) for turn in np.radians(TURNS))
    directions = np.array([plane.axes(outward, ahead)[:, 0] for plane in planes])
    return NextTouch(point, outward, directions, extent, extent / STEPS, gain)


@dataclass(frozen=True, eq=False)
class Atlas(Judged):
    """Overlapping patches: the nodes of a graph (paper, VI) whose edges are the curves where they meet.

    patches : the n nodes
    charts : the same patches as tables
    reference : the joined surface as a mesh, and the inside of the object
    tolerance : mean deviation of the height that the touches were to reach, a length; None if there was none
    uncovered : places on rims beyond which the object goes on unfelt
    check : contacts from outside that the patches do not have
    taps : contacts between the curves of each patch, to which the joined patches are fitted, too
    border : where a finger felt the surface end; None if there was none
    is_cut_short : whether touches ended because no more were allowed, or were stopped
    contacts : those that were measured before; None if they were felt for this atlas
    contradictions : doubts about these, the gravest first; agreement : a sentence on them if there is none
    unexplained : where most of those that do not agree are together, and where contacts are too far apart
    """

    patches: tuple[Reconstruction, ...]
    charts: Charts
    reference: ReferenceMesh
    tolerance: float | None = None
    uncovered: tuple[RimPlace, ...] = ()
    check: Check = NO_CHECK
    taps: tuple[Contour, ...] = ()
    border: Border | None = None
    is_cut_short: bool = False
    contacts: MeasuredContacts | None = None
    contradictions: tuple[Doubt, ...] = ()
    agreement: str = ""
    unexplained: tuple[RimPlace, ...] = ()

    def __repr__(self) -> str:
        mesh, size = self.reference.mesh, self.reference.indicator.size
        ended = "closed" if mesh.is_closed else f"open at {many(len(mesh.border), 'edge', 'edges')}"
        return (
            f"Atlas, {self.status}: {self.message}\n"
            f"  {many(len(self.patches), 'patch', 'patches')}, size {size:.4g}, "
            f"{many(len(self.uncovered), 'uncovered place', 'uncovered places')}\n"
            f"  mesh of {len(mesh.triangles)} triangles, {ended}, edges {self.reference.edge:.3g}, "
            f"+- {mesh.std.mean() if len(mesh.std) else 0.0:.2g} in the mean"
        )

    @cached_property
    def edges(self) -> list[Edge]:
        """All pairs of patches that share a boundary, each with this boundary."""
        return edges_of(self.charts, self.reference.mesh)

    def bends(self, edge: Edge) -> tuple[Array, Array]:
        """Gaussian curvatures (2, m) of both patches along their boundary, and standard deviations (2, m).

        They follow from the polynomials of the touches, which are less certain at a rim than at the point.
        """
        curvatures, stds = zip(
            *(gaussian_curvature_of(self.patches[node], edge.curve) for node in edge.nodes), strict=True
        )
        return np.array(curvatures), np.array(stds)

    @property
    def message(self) -> str:
        """The gravest doubt in a sentence with advice, or that there is none."""
        message = "The object was felt everywhere a finger could reach."
        return self.agreement or message if self.gravest is None else str(self.gravest)

    def _doubting(self) -> Iterator[Doubt]:
        """Reasons to doubt it, the gravest first."""
        yield from self.contradictions
        if self.uncovered:
            places = (many(len(self.uncovered), "place", "places"),)
            felt = "cut_short" if self.is_cut_short else "goes_on"
            yield Doubt(felt if self.contacts is None else "unfelt", len(self.uncovered), words=places)
        inside = self.reference.indicator
        if inside.thinnest < THIN * inside.resolved:
            yield Doubt("thin", inside.thinnest / inside.size, inside.resolved / inside.size)
        yield from beyond("rough", self._rough[0], ROUGH)
        wrong = int(self.contradicting.sum()) + len(self.check.missed)
        if wrong:
            rays = (str(len(self.check.points) + len(self.check.missed)),)
            yield Doubt("rays", wrong, words=rays, useless=(FINER if self.is_cut_short else TOUCHES,))

    @property
    def is_rough(self) -> bool:
        """Whether more of the surface than the share ROUGH is less certain than LIMIT tolerances."""
        return self._rough[0] > ROUGH

    @cached_property
    def _rough(self) -> tuple[float, int]:
        """The share of the surface less certain than LIMIT tolerances; the least certain vertex, or -1."""
        mesh = self.reference.mesh
        if self.tolerance is None or not len(mesh.triangles):
            return 0.0, -1
        areas = np.linalg.norm(triangle_cross(mesh.vertices[mesh.triangles]), axis=1)
        rough = mesh.std[mesh.triangles].max(axis=1) > LIMIT * self.tolerance
        return float(areas[rough].sum() / areas.sum()), int(np.argmax(mesh.std))

    @cached_property
    def _contacts(self) -> tuple[Array, Array]:
        """Signed distances and deviations (n,) of the contacts of the check."""
        if not len(self.check.points):
            return np.zeros(0), np.zeros(0)
        return self.distance(self.check.points)

    @property
    def contradicting(self) -> NDArray[np.bool_]:
        """Which contacts of the check (n,) are farther from the surface than is explained."""
        _, stds = self._contacts
        return self._farther(np.maximum(OFF_STDS * stds, NEAR * (self.tolerance or 0.0)))

    @property
    def improvable(self) -> NDArray[np.intp]:
        """The contacts of the check (k,) over a tolerance from the surface, where a touch improves it.

        None is nearer to one before it than that is to the surface: a touch that finds another part of the
        object is continued there.
        """
        far = np.flatnonzero(self._farther(self.tolerance or 0.0))
        away = np.abs(self._contacts[0])
        far = far[np.argsort(-away[far], kind="stable")]
        return far[far_apart(self.check.points[far], away[far])]

    def _farther(self, length: Array | float) -> NDArray[np.bool_]:
        """Which contacts of the check (n,) are farther from the surface than lengths (n,)."""
        distance, std = self._contacts
        # The mesh may end an edge or so before a border of the object.
        return np.abs(distance) > np.where(np.isinf(std), BORDER * self.reference.edge, length)

    def widened(self) -> "Atlas":
        """The atlas with deviations so large that 90 % of its check's contacts are in the 90 % interval.

        Those that contradict the surface do not count: they are of something else.
        """
        distance, std = (values[: self.check.at_random] for values in self._contacts)
        felt = np.isfinite(std) & ~self.contradicting[: self.check.at_random]
        if not felt.any():
            return self
        stds = np.abs(distance[felt]) / np.maximum(std[felt], LEAST_DIVISOR)
        factor = max(float(np.quantile(stds, 0.9)) / WITHIN_90, 1.0)
        charts, reference = self.charts.widened(factor), self.reference.widened(factor)
        return replace(self, charts=charts, reference=reference)

    def next_touch(self, failed: ArrayLike = ()) -> NextTouch | None:
        """Where the next touch would bring most, or None if all is covered to the tolerance and explained.

        failed : (k, 3), points of touches that did not reach the object; the next one is elsewhere, or None
        """
        tried = finite_array("failed", failed, (None, 3), LARGEST) if np.size(failed) else np.empty((0, 3))
        places = *self.uncovered, *self.unexplained
        for place in sorted(places, key=lambda place: -(place.area or place.radius)):
            point, away = np.array(place.point), APART * place.radius
            if (np.linalg.norm(tried - point, axis=1) > away).all():
                area = place.area or np.pi * place.radius**2
                return _touch_at(point, np.array(place.normal), place.ahead, place.radius, area)
        if places or not self.is_rough:
            return None
        vertex, mesh = self._rough[1], self.reference.mesh
        patch = self.patches[mesh.patch[vertex]]
        d1 = patch.frame.axes[:, 0]
        return _touch_at(mesh.vertices[vertex], mesh.normals[vertex], d1, patch.radius, patch.domain.area)

    def distance(self, points: ArrayLike) -> tuple[Array, Array]:
        """Signed distances (n,) of points (n, 3), negative inside, and their standard deviations (n,).

        It is the distance of the nearest place on the surface. If that is on an open rim,
        something unfelt might be nearer, and the deviation is inf.
        """
        p = finite_array("points", points, (None, 3), LARGEST)
        return result_of(chunked(partial(self.reference.distances, self.charts), PLACES_AT_ONCE, 1.0, p))

    def mesh(self, edge: float) -> Mesh:
        """The surface as triangles whose edges are about of this length.

        It is closed if the object was felt all round, and open where it was not.
        """
        return result_of(self.meshing(edge))

    def suggested_edge(self) -> float:
        """The length of the edges of the reference mesh."""
        return suggested_edge(self.patches, self.charts, self.reference.indicator)

    def longest_edge(self) -> float:
        """The longest edge with which the thinnest wall is not lost; `meshing` makes none that are longer."""
        return WALL * self.reference.indicator.resolved

    def curvatures(self, mesh: Mesh) -> dict[str, Array]:
        """The curvatures of `curvatures_at` at the vertices of a mesh of this atlas."""
        return self.curvatures_at(mesh.vertices, mesh.normals)

    def curvatures_at(self, points: Array, normals: Array) -> dict[str, Array]:
        """Curvatures (n,) at points of the surface (n, 3) with outward unit normals (n, 3), by name.

        They are Gaussian and mean curvature, each with its standard deviation under its name and "_std",
        shape index and curvedness. Where they are unknown, which is near creases and rims and where there
        is no surface, these are 0 and the deviations inf.
        """
        steps = chunked(partial(curvatures_of, self._sheets), CURVED_AT_ONCE, 1.0, points, normals)
        gauss, mean, *stds = result_of(steps)
        half = np.sqrt(np.maximum(mean**2 - gauss, 0.0))  # half the difference of kappa1 and kappa2
        return {
            "gaussian_curvature": gauss,
            "gaussian_curvature_std": stds[0],
            "mean_curvature": mean,
            "mean_curvature_std": stds[1],
            "shape_index": np.arctan2(mean, half) * (-2.0 / np.pi),
            "curvedness": np.sqrt(mean**2 + half**2),
        }

    @cached_property
    def _sheets(self) -> NormalSamples:
        mesh = self.reference.mesh
        normals = mesh.normals
        some = partial(sheet_facing, self.charts, near=self.reference.edge)
        sheet = Blend._make(result_of(chunked(some, PLACES_AT_ONCE, 1.0, mesh.vertices, normals)))
        return sheets_of(mesh, np.where(sheet.patch[:, None] < 0, normals, sheet.normal))

    def meshing(self, edge: float) -> Generator[float, None, Mesh]:
        """Makes the `mesh` in steps: yields the share that is done, and returns the mesh.

        Raises ValueError for edges that are longer than the object, that make no triangle, or that take
        too much memory.
        """
        edge, indicator = number("edge", edge, above=0.0), self.reference.indicator
        if edge > indicator.size:
            raise ValueError(
                f"edge: expected at most the size of what was felt, {indicator.size:.3g}, got {edge:.3g}"
            )
        memory = memory_of(*self.reference.mesh[:2], edge)
        if memory > MOST_BYTES:
            raise ValueError(
                f"edge: expected triangles that take {1e-9 * MOST_BYTES:g} GB of memory or less, got "
                f"{edge:.3g}, which takes {1e-9 * memory:.3g} GB: use a longer one"
            )
        mesh, _ = yield from meshed(
            self.charts, indicator, edge, self.reference.ended, self.contacts and self.contacts.off
        )
        mesh = mesh if self.border is None else snapped_to_border(mesh, self.border)
        if not len(mesh.triangles):
            raise ValueError(f"edge: expected one for which there is room, got {edge:.3g}: use a shorter one")
        return mesh

    def to_dict(self) -> dict[str, Any]:
        """The graph as JSON has it: a dict of numbers, words, lists and dicts, in the caller's unit.

        nodes : frame, radius, polynomial (1), ends of the domain, deviation and status of each patch
        edges : indices of two nodes, their boundary curve, and the angle of their normals along it
        uncovered, next_touch : where the object goes on, and where a touch would bring most, or None

        The `to_dict` of each patch has all of it, and is thirty times as large.
        """
        touch, stds = self.next_touch(), self.charts.mean_stds
        return {
            "version": GRAPH_VERSION,
            **{name: getattr(self, name) for name in ("status", "message", "tolerance")},
            "doubts": [doubt.to_dict() for doubt in self.doubts],
            "nodes": [node_dict(r, float(std)) for r, std in zip(self.patches, stds, strict=True)],
            "edges": [edge.to_dict() for edge in self.edges],
            "uncovered": [{"point": list(p.point), "outward": list(p.normal)} for p in self.uncovered],
            "next_touch": None if touch is None else plain(touch._asdict()),
        }
