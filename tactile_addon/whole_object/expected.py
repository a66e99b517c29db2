# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""How many touches a whole object will take, and how long, as a few touches of it show."""

from time import perf_counter
from typing import Any

import bpy
import numpy as np

from ... import core
from ...core.arguments import many
from ...core.triangles import triangle_cross
from ..touch import units
from ..touch.detached_mesh import DetachedMesh
from ..touch.types import Object
from .both_ways import THIN_SHARE
from .object_report import FACETED
from .object_touches import tolerance_of

PLACES, SEED = 600, 0  # A few of these random places are touched for the estimate.
# The time of a touch with its part of joining, and that of a mesh, as multiples of the time of a touch that
# is tried: python -m benchmarks.add_menu.
JOINING, MESHING = 3.3, 60.0
# Edges are a quarter of a wall that is thinner than the size by the first factor or more. Walls that are
# thinner by the second one have no shorter edges.
THIN, THINNEST = 16.0, 133.0


class Expected:
    """What is expected of an object, kept until it or a number changes, because a dialog draws it often."""

    def __init__(self) -> None:
        self._given: tuple[Any, ...] | None = None
        self._mesh: DetachedMesh | None = None
        self._words = ""
        self.is_faceted = False  # Whether touches would feel the facets of the object one by one.
        self.warnings: list[str] = []

    def words(
        self, target: Object, context: bpy.types.Context, tolerance: float, accuracy: str, noise: float
    ) -> str:
        """A sentence on the tolerance, the touches and the seconds of an object that will be touched.

        Raises ValueError, with a sentence, for an object that cannot be touched.
        """
        depsgraph = context.evaluated_depsgraph_get()
        vertices = target.evaluated_get(depsgraph).data.vertices if target.type == "MESH" else ()
        shape = target.session_uid, len(vertices)
        given = shape, tolerance, accuracy, noise
        if given != self._given:
            if self._given is None or self._given[0] != shape:
                self._mesh = DetachedMesh(target, depsgraph)
            tolerance = tolerance or tolerance_of(self._mesh.size, accuracy, noise)
            touches, seconds, share, wall = expected(self._mesh, tolerance, noise)
            self.is_faceted = share >= FACETED
            self.warnings = ["Touches will feel its facets one by one"] if self.is_faceted else []
            if wall < THIN_SHARE:
                self.warnings.append(f"Walls of {100.0 * wall:.2g} % of its size may be bridged or pierced")
            self._given = given
            about = f"{many(touches, 'touch', 'touches')}, {units.duration(seconds)}"
            unit = units.unit_of_report(context.scene, {"size": self._mesh.size})  # as the panel has
            self._words = f"Tolerance {units.length(tolerance, unit)}: about {about}"
        return self._words


def expected(mesh: DetachedMesh, tolerance: float, noise: float) -> tuple[int, float, float, float]:
    """About how many touches a DetachedMesh takes, seconds, its share with few facets, its thinnest wall's.

    Raises ValueError if no touch is possible.
    """
    import scipy.interpolate  # noqa: F401  # The import takes half a second, which is not a touch's.

    area = 0.5 * float(np.linalg.norm(triangle_cross(mesh.points[mesh.triangles]), axis=1).sum())
    places = core.scattered(mesh.points, mesh.triangles, PLACES, np.random.default_rng(SEED))
    begin = perf_counter()
    touches, tried, patches = core.expected_touches(
        mesh, *places, area, tolerance=tolerance, noise=noise, rng=SEED
    )
    each = (perf_counter() - begin) / tried
    areas = np.array([r.domain.area for r in patches])
    share = float(np.average([mesh.is_of_facets(r) for r in patches], weights=areas))
    wall = core.thinnest_wall(mesh, *places, mesh.size) / mesh.size
    return units.rough(touches), (MESHING * fineness(wall) + JOINING * touches) * each, share, wall


def fineness(wall: float) -> float:
    """How many times as many triangles a surface has if its thinnest wall has this share of the size."""
    return float(np.clip(1.0 / wall, THIN, THINNEST) / THIN) ** 2
