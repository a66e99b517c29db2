# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Touch All Over: touches that grow over an object by themselves, and what they are expected to take."""

from collections.abc import Iterator
from time import perf_counter

import bpy
import numpy as np
from bpy.props import EnumProperty, FloatVectorProperty, IntProperty

from ... import core
from ...core.arguments import many
from ...core.triangles import triangle_cross
from ..probes import probe
from ..probes.in_slices import AllOver, InSlices, Progress
from ..probes.operators import make_active, report_done, target_object
from ..probes.probe_operators import TACTILE_OT_add_subdivision
from ..scene import patch_record
from ..touch import units
from ..touch.detached_mesh import DetachedMesh
from ..touch.settings import NOISE, UNSAVED, given, length_property
from ..touch.types import Object, Outcome
from . import whole_mesh
from .both_ways import THIN_SHARE
from .object_report import FACETED, object_summary
from .object_touches import ObjectTouches, tolerance_of

EDGE = length_property(
    "Edge Length",
    "Length of the edges of the surface's triangles, at most about a quarter of the thinnest wall; 0 "
    "chooses it by the curvature",
)
ACCURACIES = [
    ("quick", "Quick", "A tolerance of 1/200 of the object's size: few touches, details are lost"),
    ("normal", "Normal", "A tolerance of 1/500 of the object's size"),
    ("fine", "Fine", "A tolerance of 1/1250 of the object's size: many touches"),
]
PLACES, SEED = 600, 0  # A few of these random places are touched for the estimate.
# The time of a touch with its part of joining, and that of a mesh, as multiples of the time of a touch that
# is tried: python -m benchmarks.add_menu.
JOINING, MESHING = 3.3, 60.0
# Edges are a quarter of a wall that is thinner than the size by the first factor or more. Walls that are
# thinner by the second one have no shorter edges.
THIN, THINNEST = 16.0, 133.0
# The ObjectTouches of the last surface by the session_uid of its object; one at most.
kept: dict[int, ObjectTouches] = {}


def keep(obj: Object, touches: ObjectTouches) -> None:
    """Keeps the touches that made an object, so that its mesh can be made again without new touches."""
    kept.clear()
    kept[obj.session_uid] = touches


def touches_of(obj: Object | None) -> ObjectTouches | None:
    """The ObjectTouches that made an object, or None if they are no longer there."""
    return None if obj is None else kept.get(obj.session_uid)


class WithTouches(InSlices):
    """For operators to inherit that make the surface of a whole object from ObjectTouches, `_touches`."""

    _touches: ObjectTouches

    def _done(self) -> Progress:
        share = self._touches.share
        return f"{self._touches.words}: {share:.0%}", share


class Growing(WithTouches):
    """For operators that touch an object all over: patches appear, and Esc keeps them."""

    stop = "Stop Touching and Keep"
    stopped = "Stopped: no surface was kept"
    _growing: whole_mesh.GrowingPatches | None = None
    _is_ending = False  # Esc was pressed once.

    def _go_on(self, context: bpy.types.Context) -> Outcome:
        self._growing = whole_mesh.GrowingPatches(context.scene, self._touches.surface)
        return super()._go_on(context)

    def _shown(self) -> Iterator[None]:
        """The steps of the touches. In a window, patches appear between them."""
        shown = 0
        for _ in self._touches.steps():
            if self._growing is not None:
                self._growing.add(self._touches.found[shown:], self._touches.rims[shown:])
            shown = len(self._touches.found)
            yield

    def _check(self, context: bpy.types.Context) -> None:
        self._touches.surface.require_source(context)

    def _stopped(self, context: bpy.types.Context) -> Outcome:
        """Has the patches so far joined. If Esc is pressed again, nothing is kept."""
        if self._is_ending or not self._touches.found:
            return super()._stopped(context)
        self._is_ending, self.stop = True, "Discard the Surface"
        self._touches.is_stopped = True
        return {"RUNNING_MODAL"}

    def _leave(self, context: bpy.types.Context) -> None:
        super()._leave(context)
        if self._growing is not None:
            self._growing.remove()
            self._growing = None


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


class TACTILE_OT_touch_all_over(Growing, AllOver, bpy.types.Operator):
    """Touch an object all over, from one point on, and join the patches to one surface"""

    bl_idname = "tactile.touch_all_over"
    bl_label = "Touch All Over"
    bl_options = {"UNDO", "PRESET"}

    location: FloatVectorProperty(
        name="Location",
        subtype="TRANSLATION",
        description="Where to begin; if not set, the probe's point or any place that works",
        options=UNSAVED,
    )
    tolerance: length_property(
        "Tolerance",
        "Standard deviation to reach for the height of each patch; 0 leaves it to the accuracy",
    )
    accuracy: EnumProperty(
        name="Accuracy",
        description="The tolerance as a share of the object's size, unless it is given",
        items=ACCURACIES,
        default="normal",
    )
    noise: NOISE
    seed: IntProperty(
        name="Seed", description="Seed of the noise and of the place to begin", default=0, min=0
    )
    most: IntProperty(
        name="Most Touches",
        description="Number of touches after which to stop",
        default=1000,
        min=1,
        soft_max=10_000,
    )
    edge: EDGE

    shown = ("target", "accuracy", "tolerance", "edge", "noise")
    _mesh: DetachedMesh
    _shape: tuple[int, int] | None = None  # What it is of: the object and the number of its vertices.
    _warnings: list[str]
    _is_faceted = False  # Whether touches would feel the facets of the object one by one.

    def _begin(self, context: bpy.types.Context) -> None:
        target, found = target_object(context, self.target), probe.probe_of(context.view_layer.objects.active)
        location = given(self, "location")
        if location is None and found is not None and found.tactile_probe.target == target:
            location = list(found.matrix_world.translation)
        self._touches = ObjectTouches(
            target,
            context.evaluated_depsgraph_get(),
            location=location,
            **{
                name: getattr(self, name)
                for name in ("tolerance", "accuracy", "noise", "seed", "most", "edge")
            },
        )
        self._steps = self._shown()

    def _finish(self, context: bpy.types.Context) -> Outcome:
        target = self._touches.surface.require_same(context)
        made = whole_mesh.insert(context.scene, target.name, self._touches.whole, self._touches.report())
        keep(made, self._touches)
        make_active(context, made)
        record = made[patch_record.ATLAS_RECORD].to_dict()
        return report_done(self, object_summary(record), record["status"] == "ok")

    def _estimate(self, context: bpy.types.Context, target: Object) -> str:
        """A sentence on the tolerance, the touches and the seconds. The mesh is kept until it changes."""
        depsgraph = context.evaluated_depsgraph_get()
        vertices = target.evaluated_get(depsgraph).data.vertices if target.type == "MESH" else ()
        if (target.session_uid, len(vertices)) != self._shape:
            self._mesh, self._shape = DetachedMesh(target, depsgraph), (target.session_uid, len(vertices))
        tolerance = self.tolerance or tolerance_of(self._mesh.size, self.accuracy, self.noise)
        touches, seconds, share, wall = expected(self._mesh, tolerance, self.noise)
        self._is_faceted = share >= FACETED
        self._warnings = ["Touches will feel its facets one by one"] * self._is_faceted
        if wall < THIN_SHARE:
            self._warnings.append(f"Walls of {100.0 * wall:.2g} % of its size may be bridged or pierced")
        words = units.say_of({"size": self._mesh.size}, tolerance)  # in the unit that the panel has
        return f"Tolerance {words}: about {many(touches, 'touch', 'touches')}, {units.duration(seconds)}"

    def draw(self, context: bpy.types.Context) -> None:
        super().draw(context)
        for warning in self._warnings if self._shape else ():
            self.layout.label(text=warning, icon="ERROR")
        if self._is_faceted:
            idname = TACTILE_OT_add_subdivision.bl_idname
            self.layout.operator(idname, icon="MOD_SUBSURF").target = self.target
