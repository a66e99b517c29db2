# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The surface of an atlas, step by step, whether it was touched or measured; nothing in the scene changes."""

import json
from collections.abc import Generator
from typing import Any

import numpy as np

from ... import core
from ...core.steps import part_of
from ..touch.touch_report import verdict_report
from ..touch.types import Array

CURVED_AT_ONCE = 1000  # A step computes the curvatures at this many vertices.


class WholeSurface:
    """The mesh and the graph of an atlas, in the directions of the world and relative to `origin`.

    atlas, mesh : core.Atlas and core.Mesh
    curvatures : by name, (n,) each, at the vertices of the mesh, as from Atlas.curvatures
    deviation : (n,), signed distances of the vertices from the mesh that was touched; 0 if there was none
    graph : JSON, in the world

    Only the atlas is there before the steps are done.
    """

    def __init__(self, atlas: core.Atlas, origin: Array) -> None:
        self.atlas, self.origin = atlas, np.array(origin, dtype=float)
        self._in_doubt = 0

    def steps(self, edge: float) -> Generator[float, None, None]:
        """Does everything, as a generator that yields the share that is done; `edge` is a length or 0."""
        if edge:
            self.mesh = yield from part_of(self.atlas.meshing(edge), 0.0, 0.8)
        else:
            self.mesh = self.atlas.reference.mesh  # Its edges have the suggested length.
        if not len(self.mesh.triangles):
            raise ValueError("The patches are too small for triangles of that edge length: use a shorter one")
        points, normals = self.mesh.vertices, self.mesh.normals
        self.deviation, parts = np.zeros(len(points)), []
        for start in range(0, len(points), CURVED_AT_ONCE):
            some = slice(start, start + CURVED_AT_ONCE)
            parts.append(self.atlas.curvatures_at(points[some], normals[some]))
            yield 0.8
        self.curvatures = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
        for r in self.atlas.patches:
            self._in_doubt += r.status != "ok"  # The first time this takes a while.
            yield 0.9
        graph = self._graph()
        yield 0.9
        self.graph = json.dumps(graph, allow_nan=False)
        yield 0.9

    def _graph(self) -> dict[str, Any]:
        """The graph of Atlas.to_dict, moved to the world."""
        found = self.atlas.to_dict()
        frames, touch = [node["frame"] for node in found["nodes"]], found["next_touch"]
        for place, key in (
            *((frame, "origin") for frame in frames),
            *((edge, "curve") for edge in found["edges"]),
            *((place, "point") for place in [*found["uncovered"], *([touch] if touch else [])]),
        ):
            place[key] = (np.array(place[key]) + self.origin).tolist()
        return found

    def report(self) -> dict[str, Any]:
        """What was found, as a dict of plain values."""
        atlas, mesh = self.atlas, self.mesh
        return {
            **verdict_report(self.doubts(), atlas.message),
            "patches": len(atlas.patches),
            "in_doubt": self._in_doubt,
            "edges": len(atlas.edges),
            "is_closed": mesh.is_closed and not atlas.uncovered,
            "vertices": len(mesh.vertices),
            "triangles": len(mesh.triangles),
            "edge": mesh.edge,
            "unknown_curvatures": int(np.isinf(self.curvatures["mean_curvature_std"]).sum()),
            "height_std": float(mesh.std[np.isfinite(mesh.std)].mean()),  # It is inf where nothing was felt.
            "radius": float(np.median([r.radius for r in atlas.patches])),
        }

    def doubts(self) -> list[core.Doubt]:
        """The doubts of the atlas, or that its surface has holes only as it is shown."""
        doubts = list(self.atlas.doubts)
        if not doubts and self.mesh.rims > self.atlas.reference.mesh.rims:
            doubts.append(core.Doubt("holes"))
        return doubts
