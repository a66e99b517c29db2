# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The buttons of the panels besides picking: planes, another touch, deletion."""

import math
from collections.abc import Mapping
from typing import Any

import bpy
from bpy.props import IntProperty, StringProperty

from ..scene import patch_object, patch_record
from ..touch.settings import MOST_PLANES, TARGET, length_property, silent
from ..touch.types import Object, OperatorMixin, Outcome
from ..touch.wording import added_planes
from . import probe, touch_again
from .operators import (
    is_in_object_mode,
    is_unlocked,
    make_active,
    polls,
    report_done,
    reports_errors,
    surface_of,
    target_object,
    waiting,
)

SUBDIVISIONS = 3  # A target gets this many levels at once,
MOST_FACES = 500_000  # as long as it has no more faces then.


class _ProbeOperator(OperatorMixin):
    """For operators on the active probe, or on that of the active patch, to inherit."""

    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        hint = "Select a probe, or pick a reference point first"
        return (
            polls(cls, probe.probe_of(context.view_layer.objects.active), hint)
            and is_in_object_mode(cls, context, "Probes are changed")
            and is_unlocked(cls, context)
        )


class _PlaneOperator(_ProbeOperator):
    """For operators that change the number of planes to inherit; they do nothing at the `limit`."""

    limit, why_not = MOST_PLANES, "A patch has six planes at most: remove one first"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        active = probe.probe_of(context.view_layer.objects.active)
        return super().poll(context) and polls(
            cls, active.tactile_probe.plane_count != cls.limit, cls.why_not
        )


class TACTILE_OT_add_plane(_PlaneOperator, bpy.types.Operator):
    """Feel along one more plane, as far and as often as along the others: the one that tells most"""

    bl_idname = "tactile.add_plane"
    bl_label = "Add Suggested Plane"

    def execute(self, context: bpy.types.Context) -> Outcome:
        found = probe.probe_of(context.view_layer.objects.active)
        record, settings = probe.record_of(found) or {}, found.tactile_probe
        with silent():
            # A touch that chose its lengths anew would not be the one whose deviation was promised.
            for name in ("extent", "step"):
                setattr(settings, name, getattr(settings, name) or record.get(name, 0.0))
            _add(settings, record.get("suggested_plane"))
            touch_again.refresh(found, context)
        return {"FINISHED"}


class TACTILE_OT_add_planes(_PlaneOperator, bpy.types.Operator):
    """Feel along more planes, each time the one that tells most, until it is enough or none would help"""

    bl_idname = "tactile.add_planes"
    bl_label = "Add Planes While They Help"

    tolerance: length_property(
        "Tolerance", "Standard deviation of the height to reach; 0 goes on as long as a plane helps"
    )

    @reports_errors
    def execute(self, context: bpy.types.Context) -> Outcome:
        found = probe.probe_of(context.view_layer.objects.active)
        depsgraph = context.evaluated_depsgraph_get()
        touched = touch_again.touch_at(found, depsgraph, complete=True, tolerance=self.tolerance)
        with silent():
            for plane in touched.report["added_planes"]:
                _add(found.tactile_probe, plane)
            touch_again.adopt(found, touched, depsgraph, complete=True)
        return report_done(self, added_planes(touched.report))


def _add(settings: Any, suggested: Mapping[str, Any] | None) -> None:
    """Adds one more plane, at the suggested azimuth, or with the angles it had before."""
    number = settings.plane_count
    if suggested is not None:
        settings.azimuths[number] = math.radians(suggested["azimuth"])
        settings.tilts[number] = 0.0
    settings.plane_count = number + 1
    settings.active_plane = number


class TACTILE_OT_remove_plane(_PlaneOperator, bpy.types.Operator):
    """Remove this sampling plane"""

    bl_idname = "tactile.remove_plane"
    bl_label = "Remove Plane"

    limit, why_not = 3, "A patch needs three planes"
    plane: IntProperty(name="Plane", description="Index of the plane, from 0", min=0, max=MOST_PLANES - 1)

    @reports_errors
    def execute(self, context: bpy.types.Context) -> Outcome:
        found = probe.probe_of(context.view_layer.objects.active)
        settings = found.tactile_probe
        count = settings.plane_count
        if self.plane >= count:
            raise ValueError(f"There are {count} planes, 0 to {count - 1}: choose one of them")
        with silent():
            for name in ("azimuths", "tilts"):
                values = list(getattr(settings, name))
                values.append(values.pop(self.plane))
                setattr(settings, name, values)
            settings.plane_count -= 1
            touch_again.refresh(found, context)
        return {"FINISHED"}


class TACTILE_OT_update(_ProbeOperator, bpy.types.Operator):
    """Touch again with the numbers and at the place of the probe"""

    bl_idname = "tactile.update"
    bl_label = "Touch Again"

    def execute(self, context: bpy.types.Context) -> Outcome:
        found = probe.probe_of(context.view_layer.objects.active)
        with waiting(context):
            touch_again.refresh(found, context)
        if found.tactile_probe.message:
            self.report({"WARNING"}, found.tactile_probe.message)
        return {"FINISHED"}


class TACTILE_OT_add_subdivision(_ProbeOperator, bpy.types.Operator):
    """Smooth the target by a Subdivision modifier or one more level; edges to stay sharp need a crease"""

    bl_idname = "tactile.add_subdivision"
    bl_label = "Add Subdivision"

    target: TARGET

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        active = context.view_layer.objects.active
        if probe.probe_of(active) is not None:
            return super().poll(context)
        is_mesh = active is not None and active.type == "MESH"
        hint = "Select the mesh object to subdivide, or what was felt of it"
        return polls(cls, is_mesh, hint) and is_in_object_mode(cls, context, "Modifiers are added")

    @reports_errors
    def execute(self, context: bpy.types.Context) -> Outcome:
        surface, target = surface_of(context), target_object(context, self.target)
        if not target.is_editable or target.type != "MESH":
            raise ValueError("The target cannot be changed: make it local first")
        _subdivide(target)
        context.view_layer.update()  # Live probes touch again.
        if surface is not None:
            patch_record.mark_subdivided(surface)
            return report_done(self, f'"{target.name}" is subdivided: touch it all over again')
        return {"FINISHED"}


def _subdivide(target: Object) -> None:
    """Gives an object a Subdivision Surface modifier, or one more level of the one it has."""
    modifier: Any = next((m for m in reversed(target.modifiers) if m.type == "SUBSURF"), None)
    if modifier is None:
        modifier, faces = target.modifiers.new("Subdivision", "SUBSURF"), max(len(target.data.polygons), 1)
        level = min(max(int(math.log(MOST_FACES / faces, 4.0)), 1), SUBDIVISIONS)
    else:
        level = modifier.levels + 1
    modifier.levels, modifier.render_levels = level, max(level, modifier.render_levels)
    modifier.show_viewport = True


class TACTILE_OT_delete(_ProbeOperator, bpy.types.Operator):
    """Delete the probe with its patch; the mesh that was touched stays"""

    bl_idname = "tactile.delete"
    bl_label = "Delete Probe and Patch"

    def execute(self, context: bpy.types.Context) -> Outcome:
        found = probe.probe_of(context.view_layer.objects.active)
        target = found.tactile_probe.target
        patch_object.remove_objects([obj for obj in (probe.patch_of(found), found) if obj is not None])
        if target is not None:  # What comes next, as another pick, is about it.
            make_active(context, target)
        return {"FINISHED"}


class TACTILE_OT_activate(bpy.types.Operator):
    """Make this probe the active object, and show where it is"""

    bl_idname = "tactile.activate"
    bl_label = "Go to Probe"
    bl_options = {"UNDO", "INTERNAL"}

    name: StringProperty(name="Name", description="Name of the probe", options={"SKIP_SAVE"})

    @reports_errors
    def execute(self, context: bpy.types.Context) -> Outcome:
        found: Object | None = context.view_layer.objects.get(self.name)
        if found is None:
            raise ValueError(f'There is no probe "{self.name}" in this view layer')
        make_active(context, found)
        return {"FINISHED"}


OPERATORS = (
    TACTILE_OT_add_plane,
    TACTILE_OT_add_planes,
    TACTILE_OT_remove_plane,
    TACTILE_OT_update,
    TACTILE_OT_add_subdivision,
    TACTILE_OT_delete,
    TACTILE_OT_activate,
)
