# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The surface of an atlas, step by step, whether it was touched or measured; nothing in the scene changes."""

import json

import numpy as np

CURVED_AT_ONCE = 3000  # vertices that are given their curvatures in a step


class WholeSurface:
    """What an atlas looks like, and its graph; lengths are in the directions of the world, from `origin`.

    atlas, mesh : core.Atlas and core.Mesh; curvatures : as of Atlas.curvatures
    deviation : signed distances (n,) of the mesh's vertices to what was touched; 0 where that was no mesh

    graph : as JSON

    All but the atlas are there once the steps are done.
    """

    def __init__(self, atlas, origin):
        self.atlas, self.origin = atlas, np.array(origin, dtype=float)
        self._in_doubt = 0

    def steps(self, edge):
        """Does all of it; `edge` is a length, or 0. A generator, which yields the share that is done."""
        steps = self.atlas.meshing(edge or self.atlas.suggested_edge())
        while True:
            try:
                yield 0.8 * next(steps)
            except StopIteration as end:
                self.mesh = end.value
                break
        if not len(self.mesh.triangles):
            raise ValueError("The patches are too small for triangles of that edge length: use a shorter one")
        points, normals = self.mesh.vertices, self.mesh.normals
        self.deviation, parts = np.zeros(len(points)), []
        for start in range(0, len(points), CURVED_AT_ONCE):
            some = slice(start, start + CURVED_AT_ONCE)
            parts.append(self.atlas.curvatures_at(points[some], normals[some]))
            yield 0.8
        self.curvatures = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
        for share in self.atlas.bounding():
            yield 0.8 + 0.1 * share
        for r in self.atlas.patches:
            self._in_doubt += r.status != "ok"  # which takes a while, once
            yield 0.9
        graph = self._graph()
        yield 0.9
        self.graph = json.dumps(graph, allow_nan=False)
        yield 0.9

    def _graph(self):
        """The graph of patches as Atlas.to_dict has it, in the world."""
        found = self.atlas.to_dict()
        frames, touch = [node["frame"] for node in found["nodes"]], found["next_touch"]
        for place, key in (
            *((frame, "origin") for frame in frames),
            *((edge, "curve") for edge in found["edges"]),
            *((place, "point") for place in [*found["uncovered"], *([touch] if touch else [])]),
        ):
            place[key] = (np.array(place[key]) + self.origin).tolist()
        return found

    def report(self):
        """What there is to say, a dict of plain values."""
        atlas, mesh = self.atlas, self.mesh
        return {
            "status": atlas.status,
            "message": atlas.message,
            "patches": len(atlas.patches),
            "in_doubt": self._in_doubt,
            "edges": len(atlas.edges),
            "is_closed": mesh.is_closed,
            "vertices": len(mesh.vertices),
            "triangles": len(mesh.triangles),
            "height_std": float(mesh.std[np.isfinite(mesh.std)].mean()),  # where it was felt
            "radius": float(np.median([r.radius for r in atlas.patches])),
        }
