# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Touch All Over: touches that grow over an object by themselves; and the buttons of their surface."""

from collections.abc import Iterator, Sequence
from typing import Any

import bpy
import numpy as np
from bpy.props import EnumProperty, FloatVectorProperty, IntProperty
from mathutils import Vector

from ... import core
from ..probes import probe
from ..probes.in_slices import AllOver, InSlices, Progress
from ..probes.operators import (
    is_in_object_mode,
    make_active,
    polls,
    report_done,
    reports_errors,
    surface_of,
    target_object,
)
from ..scene import patch_record
from ..scene.mesh_data import DEVIATION, values
from ..touch import units
from ..touch.detached_mesh import DetachedMesh
from ..touch.evaluated_mesh import read_array
from ..touch.settings import NOISE, UNSAVED, given, length_property
from ..touch.touch_object import FARTHEST_SHARE
from ..touch.types import Object, Outcome
from . import whole_mesh
from .both_ways import DIRECTIONS, LIFT, THIN_SHARE
from .object_report import FACETED, deviation, object_summary
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
# Walls are measured at PLACES random places before it begins, and the first TRIED of these are touched.
PLACES, TRIED, SEED = 600, 12, 0
SEEN = 1.0  # The place is seen from so many sizes of the object, so that what is around it is seen, too.
REACHED = 0.5  # A surface with less than this share of the largest deviation does not reach the object there.
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
                self._growing.add(self._touches.explored[shown:], self._touches.rims[shown:])
            shown = len(self._touches.explored)
            yield

    def _check(self, context: bpy.types.Context) -> None:
        self._touches.surface.require_source(context)

    def _stopped(self, context: bpy.types.Context) -> Outcome:
        """Has the patches so far joined. If Esc is pressed again, nothing is kept."""
        if self._is_ending or not self._touches.explored:
            return super()._stopped(context)
        self._is_ending, self.stop = True, "Discard the Surface"
        self._touches.is_stopped = True
        return {"RUNNING_MODAL"}

    def _leave(self, context: bpy.types.Context) -> None:
        super()._leave(context)
        if self._growing is not None:
            self._growing.remove()
            self._growing = None


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
    _warnings: Sequence[str] = ()
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
        """A sentence on the tolerance; and warnings. The mesh is kept until it changes."""
        if self._is_reshaped:
            self._mesh = DetachedMesh(target, context.evaluated_depsgraph_get())
        mesh = self._mesh
        tolerance = self.tolerance or tolerance_of(mesh.size, self.accuracy, self.noise)
        points, outward = core.scattered(mesh.points, mesh.triangles, PLACES, np.random.default_rng(SEED))
        options: dict[str, Any] = {"largest_std": tolerance, "noise": self.noise, "rng": SEED}
        options["farthest"] = FARTHEST_SHARE * mesh.size
        tried = core.explore_many(mesh, points[:TRIED], outward[:TRIED], **options)
        patches = [e.result for e in tried if not isinstance(e, ValueError)]
        facets = sum(r.domain.area for r in patches if mesh.is_of_facets(r))
        self._is_faceted = facets > FACETED * sum(r.domain.area for r in patches)
        warnings = ["Touches will feel its facets one by one"] * self._is_faceted
        wall = core.thinnest_wall(mesh, points, outward, mesh.size) / mesh.size
        if wall < THIN_SHARE:
            warnings.append(f"Walls of {100.0 * wall:.2g} % of its size may be bridged or pierced")
        self._warnings = warnings
        return f"Tolerance {units.say_of({'size': mesh.size}, tolerance)}"  # in the unit that the panel has

    def draw(self, context: bpy.types.Context) -> None:
        super().draw(context)
        for warning in self._warnings:
            self.layout.label(text=warning, icon="ERROR")
        if self._is_faceted:
            self.layout.operator("tactile.add_subdivision", icon="MOD_SUBSURF").target = self.target


class TACTILE_OT_look_farthest(bpy.types.Operator):
    """Look where surface and mesh are farthest apart, in the middle of the view, and show deviations"""

    bl_idname = "tactile.look_farthest"
    bl_label = "Look at Largest Deviation"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        obj = surface_of(context)
        was_touched = obj is not None and "deviation_place" in obj[patch_record.ATLAS_RECORD]
        hint = "Select the surface of a whole object that was touched"
        return polls(cls, was_touched, hint) and is_in_object_mode(cls, context, "Surfaces are looked at")

    @reports_errors
    def execute(self, context: bpy.types.Context) -> Outcome:
        obj = surface_of(context)
        patch_record.require_colored(obj)
        record = obj[patch_record.ATLAS_RECORD].to_dict()
        place = Vector(np.subtract(record["deviation_place"], record["origin"]))
        off = read_array(obj.data.vertices, "co", 3) - np.array(place)
        nearest = obj.data.vertices[int(np.argmin((off**2).sum(axis=1)))]
        largest, there = record["deviation_max"], abs(values(obj.data, DEVIATION)[nearest.index])
        is_reached = there >= REACHED * largest or largest <= record["edge"]
        make_active(context, obj)
        place, turn = obj.matrix_world @ place, obj.matrix_world.to_quaternion()
        view = context.region_data
        if view is not None:
            view.view_perspective = "ORTHO" if view.view_perspective == "ORTHO" else "PERSP"
            view.view_location = place
            sight = _free_sight(obj.evaluated_get(context.evaluated_depsgraph_get()), nearest, record["size"])
            view.view_rotation = (turn @ sight).to_track_quat("Z", "Y")
            view.view_distance = SEEN * record["size"] * obj.matrix_world.median_scale
        obj.tactile_colors = DEVIATION
        words = f'Here "{record["source"]}" is {deviation(record, "max")} off the surface'
        return report_done(self, words if is_reached else f"{words}, which does not reach it")


def _free_sight(seen: Object, vertex: Any, far: float) -> Vector:
    """The direction most along a vertex's normal from where nothing that near hides the vertex, if any."""
    ways = [vertex.normal, *sorted(map(Vector, DIRECTIONS), key=vertex.normal.dot, reverse=True)]
    start = vertex.co + LIFT * far * vertex.normal
    return next((way for way in ways if not seen.ray_cast(start, way, distance=far)[0]), vertex.normal)


class OnSurface(WithTouches):
    """For operators that make the active surface of a whole object anew, from the touches that are kept."""

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        hint = "Only the last surface that was touched has its touches in memory"
        has_touches = polls(cls, touches_of(surface_of(context)), hint)
        return has_touches and is_in_object_mode(cls, context, "Surfaces are made")

    def _kept(self, context: bpy.types.Context) -> ObjectTouches:
        """The touches of the active surface, whose object is made anew."""
        obj = surface_of(context)
        patch_record.require_colored(obj)
        self._uid, self._name = obj.session_uid, obj.name
        return touches_of(obj)

    def _object(self, context: bpy.types.Context) -> Object:
        """The object of the surface. Raises ValueError, with a sentence, if it is gone or may be edited."""
        found = next((obj for obj in context.view_layer.objects if obj.session_uid == self._uid), None)
        if found is None:
            raise ValueError(f'"{self._name}" is gone, so it was not made again')
        if context.mode != "OBJECT":
            raise ValueError("Meshing was stopped because Object Mode was left: start it again")
        return found

    def _rewrite(self, context: bpy.types.Context) -> dict[str, Any]:
        """Gives the object its new surface, and returns the record of that."""
        obj = self._object(context)
        report = self._touches.report() | {"source": obj[patch_record.ATLAS_RECORD]["source"]}
        whole_mesh.rewrite(obj, self._touches.whole, report)
        keep(obj, self._touches)
        return obj[patch_record.ATLAS_RECORD].to_dict()


class TACTILE_OT_mesh_again(OnSurface, bpy.types.Operator):
    """Make the surface again with edges of another length, from the same touches"""

    bl_idname = "tactile.mesh_again"
    bl_label = "Change Edge Length"
    bl_options = {"UNDO"}

    edge: EDGE

    stop = "Keep It as It Was"
    shown = ("edge",)
    stopped = "Stopped: the surface stays as it was"

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> Outcome:
        return self._confirm(context, "Mesh Again")

    def _begin(self, context: bpy.types.Context) -> None:
        self._touches = self._kept(context).again(self.edge)
        self._steps = self._touches.meshing()

    def _check(self, context: bpy.types.Context) -> None:
        self._object(context)

    def _finish(self, context: bpy.types.Context) -> Outcome:
        record = self._rewrite(context)
        summary = object_summary(record)
        if self.edge > self._touches.whole.atlas.longest_edge():
            summary += f"; edges are {units.say_of(record, record['edge'])} long, as thin walls need"
        return report_done(self, summary)


class TACTILE_OT_continue_touching(Growing, OnSurface, bpy.types.Operator):
    """Go on touching the object from where its surface ended, with more touches or to a smaller tolerance"""

    bl_idname = "tactile.continue_touching"
    bl_label = "Continue Touching"
    bl_options = {"UNDO"}

    tolerance: length_property(
        "Tolerance", "Standard deviation to reach for the height of each patch; 0 keeps that of the surface"
    )
    more: IntProperty(
        name="More Touches",
        description="Number of further touches after which to stop",
        default=1000,
        min=1,
        soft_max=10_000,
    )

    shown = ("tolerance", "more")
    stopped = "Stopped: the surface stays as it was"

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> Outcome:
        return self._confirm(context, "Continue")

    def _begin(self, context: bpy.types.Context) -> None:
        before = self._kept(context)
        before.surface.require_same(context)
        self._touches = before.continued(self.tolerance or before.tolerance, self.more)
        self._steps = self._shown()

    def _finish(self, context: bpy.types.Context) -> Outcome:
        self._touches.surface.require_same(context)
        record = self._rewrite(context)
        return report_done(self, object_summary(record), record["status"] == "ok")


CLASSES = (
    TACTILE_OT_touch_all_over,
    TACTILE_OT_look_farthest,
    TACTILE_OT_mesh_again,
    TACTILE_OT_continue_touching,
)
