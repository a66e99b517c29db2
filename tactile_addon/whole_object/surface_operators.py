# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The panel's buttons for the surface of a whole object: where it is farthest off, and another mesh of it."""

from typing import Any

import bpy
import numpy as np
from bpy.props import IntProperty
from mathutils import Vector

from ..probes.operators import is_in_object_mode, make_active, polls, report_done, report_error, surface_of
from ..scene import patch_record
from ..scene.mesh_data import DEVIATION, own_mesh, values
from ..touch import units
from ..touch.evaluated_mesh import read_array
from ..touch.settings import length_property
from ..touch.types import Object, Outcome, Point
from . import whole_mesh
from .object_operator import EDGE, Growing, WithTouches, keep, touches_of
from .object_report import deviation, object_summary
from .object_touches import ObjectTouches

SEEN = 1.0  # The place is seen from so many sizes of the object, so that what is around it is seen, too.
REACHED = 0.5  # A surface with less than this share of the largest deviation does not reach the object there.


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

    def execute(self, context: bpy.types.Context) -> Outcome:
        obj = surface_of(context)
        try:
            patch_record.require_colored(obj)
        except ValueError as error:
            return report_error(self, error)
        record = obj[patch_record.ATLAS_RECORD].to_dict()
        place = Vector(np.subtract(record["deviation_place"], record["origin"]))
        own_mesh(obj)
        nearest = _select_nearest(obj.data, place)
        largest, there = record["deviation_max"], abs(values(obj.data, DEVIATION)[nearest.index])
        is_reached = there >= REACHED * largest or largest <= record["edge"]
        make_active(context, obj)
        place, turn = obj.matrix_world @ place, obj.matrix_world.to_quaternion()
        view = context.region_data
        if view is not None:
            view.view_perspective = "ORTHO" if view.view_perspective == "ORTHO" else "PERSP"
            view.view_location = place
            view.view_rotation = (turn @ nearest.normal).to_track_quat("Z", "Y")
            view.view_distance = SEEN * record["size"] * obj.matrix_world.median_scale
        obj.tactile_colors = DEVIATION
        off, source = deviation(record, "max"), record["source"]
        reach = "" if is_reached else ", which does not reach it"
        self.report({"INFO"}, f'Here "{source}" is {off} off the surface{reach}')
        return {"FINISHED"}


def _select_nearest(mesh: bpy.types.Mesh, place: Point) -> Any:
    """Selects the vertex nearest to a place, and nothing else, and returns it."""
    nearest = int(np.argmin(((read_array(mesh.vertices, "co", 3) - np.array(place)) ** 2).sum(axis=1)))
    for parts in (mesh.vertices, mesh.edges, mesh.polygons):
        parts.foreach_set("select", np.zeros(len(parts), dtype=bool))
    mesh.vertices[nearest].select = True
    mesh.update()
    return mesh.vertices[nearest]


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


CLASSES = (TACTILE_OT_look_farthest, TACTILE_OT_mesh_again, TACTILE_OT_continue_touching)
