# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Signed distances from the surface of an object: the nearest place on its mesh, moved onto the patches."""

from collections.abc import Generator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..arguments import Array
from ..triangles import SAME, closest_point, normalized, row_dot, triangle_cross
from .charts import Charts
from .connectivity import Indices
from .field import sheet_facing
from .indicator import Indicator
from .meshing import Mesh

# python -m benchmarks.atlas judges these.
NEAREST = 3  # The nearest triangle is looked for at this many of the nearest vertices.
AHEAD = 0.95  # The normal at a foot gives the sign if the cosine of its angle to the way there is more.
SAGITTA = 0.5  # The surface is within this share of an edge of a place on the mesh.
PREPARED = ("tree", "fans", "edge", "normals", "is_open", "angles")  # Each is found once for a mesh.
CLOSED = 0.25  # Where the indicator is farther from its level, felt area is around it: it knows the side.
# python -m benchmarks.measured judges these: where the surface goes on unfelt,
REACHES = 3.0  # the outside is known this many times farther than the foot is from the border,
ABOVE = 0.12  # and up to this share of the size.
TURNED = 1.0  # Beyond the border it goes on turned by this angle, in radians, at two deviations.
ON_SIDE = 1e-6  # A foot with a smaller weight of a vertex is on the side across from it.


@dataclass(frozen=True, eq=False)
class ReferenceMesh:
    """The mesh of a whole object from which distances are measured, and the indicator that it follows.

    unfelt : what the indicator has where nothing was felt; None if a finger has looked for what is there
    """

    mesh: Mesh
    indicator: Indicator
    unfelt: Mesh | None = None

    @cached_property
    def tree(self) -> Any:
        """A KD-tree of the vertices."""
        from scipy.spatial import cKDTree

        return cKDTree(self.mesh.vertices, compact_nodes=False, balanced_tree=False)  # twice as fast to build

    @cached_property
    def fans(self) -> Indices:
        """The triangles at each vertex, (n, most); the first one again where there are fewer."""
        corners = self.mesh.triangles.ravel()
        order = np.argsort(corners, kind="stable")
        counts = np.bincount(corners, minlength=len(self.mesh.vertices))
        start, steps = np.cumsum(counts) - counts, np.arange(counts.max())
        return order[start[:, None] + np.where(steps < counts[:, None], steps, 0)] // 3

    @cached_property
    def edge(self) -> float:
        """The median length of the edges."""
        return self.mesh.edge

    @cached_property
    def normals(self) -> Array:
        """Unit normals of the triangles, (m, 3)."""
        return normalized(triangle_cross(self.mesh.vertices[self.mesh.triangles]))

    @cached_property
    def is_open(self) -> NDArray[np.bool_]:
        """Whether the mesh ends at each vertex, (n,)."""
        return np.bincount(self.mesh.border.ravel(), minlength=len(self.mesh.vertices)) > 0

    @cached_property
    def angles(self) -> Array:
        """The angles at each vertex (n,) of its triangles together: 2 pi where the surface is flat."""
        corners = self.mesh.vertices[self.mesh.triangles]
        sides = np.roll(corners, -1, axis=1) - corners
        across = np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1)[:, None]
        angles = np.arctan2(across, -row_dot(sides, np.roll(sides, 1, axis=1)))
        count = len(self.mesh.vertices)
        return np.bincount(self.mesh.triangles.ravel(), angles.ravel(), count).astype(np.float64)

    def widened(self, factor: float) -> "ReferenceMesh":
        """A mesh of the same triangles whose deviations are larger by a factor."""
        wider = replace(self, mesh=self.mesh._replace(std=factor * self.mesh.std))
        vars(wider).update({name: vars(self)[name] for name in PREPARED if name in vars(self)})
        return wider

    def prepared(self) -> Generator[float, None, None]:
        """Finds what distances need, in steps; yields 1 after each."""
        for name in PREPARED:
            getattr(self, name)
            yield 1.0

    def feet(self, points: Array) -> tuple[Array, Indices, Array, NDArray[np.bool_]]:
        """The nearest places (n, 3) on the mesh; triangles, deviations, and whether it ends there, (n,).

        Of triangles that are as near, it is the one that is most across the way to the place.
        """
        count = min(NEAREST, len(self.mesh.vertices))
        nearest = self.tree.query(points, count)[1].reshape(len(points), count)
        some = self.fans[nearest].reshape(len(points), count * self.fans.shape[1])
        feet, weights = closest_point(self.mesh.vertices[self.mesh.triangles[some]], points[:, None])
        off = points[:, None] - feet
        away = np.linalg.norm(off, axis=2)
        across = np.abs(row_dot(off, self.normals[some]))
        as_near = away <= (1.0 + SAME) * away.min(axis=1, keepdims=True)
        best = np.argmax(np.where(as_near, across, -1.0), axis=1)
        row = np.arange(len(points))
        triangle = some[row, best]
        corners = self.mesh.triangles[triangle]
        ends = (self.is_open[corners] | (weights[row, best] < ON_SIDE)).all(axis=1)
        std = row_dot(weights[row, best], self.mesh.std[corners])
        return feet[row, best], triangle, std, ends

    def ended(self, points: Array) -> NDArray[np.bool_]:
        """Which of points (n, 3) are beyond where the mesh ends, or an edge off it as behind a sheet."""
        if not self.is_open.any():
            return np.zeros(len(points), dtype=bool)
        feet, _, _, ends = self.feet(points)
        return ends | (np.linalg.norm(points - feet, axis=1) > self.edge)

    def distances(self, charts: Charts, points: Array) -> tuple[Array, Array]:
        """Signed distances (n,) of places (n, 3), and deviations (n,), inf beyond where the mesh ends."""
        feet, triangle, std, ends = self.feet(points)
        up = self.normals[triangle]
        side = row_dot(points - feet, up)
        # What is farther from a place of the mesh is another part of the surface.
        surface = sheet_facing(charts, feet, up, SAGITTA * self.edge)
        off = points - feet + surface.distance[:, None] * surface.normal
        ahead, away = row_dot(off, surface.normal), np.linalg.norm(off, axis=1)
        smooth = np.abs(ahead) > AHEAD * away
        side = np.where(smooth & (surface.patch >= 0), ahead, side)
        behind = self.indicator.at(points)
        if not self.is_open.any():
            side = np.where(np.abs(behind) > CLOSED, -behind, side)
        std = np.where(surface.patch < 0, std, surface.std)
        if self.unfelt is not None and self.is_open.any():
            rim = self._rim.query(points)[0]
            return self._distances_near_border(away, side, ahead, rim, std, behind, ends)
        return np.copysign(away, side), np.where(ends, np.inf, std)

    def _distances_near_border(
        self,
        away: Array,
        side: Array,
        ahead: Array,
        rim: Array,
        std: Array,
        behind: Array,
        ends: NDArray[np.bool_],
    ) -> tuple[Array, Array]:
        """Signed distances (n,) where the surface goes on unfelt beyond the border, and deviations (n,).

        away, side : (n,), distances and their signs; ahead : (n,), the part along the normals at the feet
        rim : (n,), distances from the border; behind : (n,), the indicator; ends : (n,), feet on the border

        What goes on beyond the border may come nearer than the foot, by as much as the place is farther away
        than the foot is from the border. Behind the surface the inside is known within a cell and where other
        parts close it, and above it the outside where these do not contradict it. The surface is known up to
        an edge beyond the border.
        """
        to_border = np.sqrt(np.maximum(rim**2 - away**2, 0.0))
        across = np.sqrt(np.maximum(away**2 - ahead**2, 0.0))
        shallow = self.indicator.cell
        above = np.maximum(REACHES * to_border, ABOVE * self.indicator.size)
        inside = (away < shallow) | ((behind > CLOSED) & ~ends)
        outside = (away < above) & ((behind < 0.0) | (away < shallow))
        known = np.where(side < 0.0, inside, outside) & (~ends | (across < self.mesh.edge))
        nearer = 0.5 * (away * (1.0 - np.cos(TURNED)) - to_border * np.sin(TURNED))
        growth = np.where(ends, np.maximum(across, away - shallow), nearer)
        distance = np.where(ends, ahead, np.copysign(away, side))
        return distance, np.where(known, np.hypot(std, np.maximum(growth, 0.0)), np.inf)

    @cached_property
    def _rim(self) -> Any:
        """A KD-tree of the vertices on the border."""
        from scipy.spatial import cKDTree

        return cKDTree(self.mesh.vertices[self.is_open])
