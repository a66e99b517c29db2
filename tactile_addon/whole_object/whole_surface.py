# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The surface of an atlas, step by step, whether it was touched or measured; nothing in the scene changes."""

import numpy as np


class WholeSurface:
    """What an atlas looks like, and its graph; lengths are in the directions of the world, from `origin`.

    atlas, mesh : core.Atlas and core.Mesh; curvatures : as of Atlas.curvatures
    deviation : signed distances (n,) of the mesh's vertices to what was touched; 0 where that was no mesh

    Mesh, curvatures and the atlas's edges are there once the steps are done.
    """

    def __init__(self, atlas, origin):
        self.atlas, self.origin = atlas, np.array(origin, dtype=float)

    def steps(self, edge):
        """Does all of it; `edge` is a length, or 0. A generator, which yields the share that is done."""
        steps = self.atlas.meshing(edge or self.atlas.suggested_edge())
        while True:
            try:
                yield 0.8 * next(steps)
            except StopIteration as end:
                self.mesh = end.value
                break
        self.deviation = np.zeros(len(self.mesh.vertices))
        self.curvatures = self.atlas.curvatures(self.mesh)
        for share in self.atlas.bounding():
            yield 0.8 + 0.2 * share

    def graph(self):
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
            "in_doubt": sum(r.status != "ok" for r in atlas.patches),
            "edges": len(atlas.edges),
            "is_closed": mesh.is_closed,
            "vertices": len(mesh.vertices),
            "triangles": len(mesh.triangles),
            "height_std": float(mesh.std[np.isfinite(mesh.std)].mean()),  # where it was felt
            "radius": float(np.median([r.radius for r in atlas.patches])),
        }
