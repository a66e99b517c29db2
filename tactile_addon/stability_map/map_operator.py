# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Stability Map: touches all over an object; in slices in a window, at once from a script."""

import bpy
from bpy.props import BoolProperty, FloatProperty, StringProperty

from ..probes import probe
from ..probes.in_slices import InSlices
from ..probes.operators import has_target, make_active, report_error, target_object
from ..scene import patch_record
from ..touch.settings import NAMES, TouchSettings, draw_all, draw_chosen, touch_arguments
from ..touch.wording import sentence
from . import map_object
from .map_report import map_summary
from .stability import StabilityMap, expected_count

UNSAVED = {"SKIP_SAVE", "SKIP_PRESET"}


class TACTILE_OT_stability_map(InSlices, TouchSettings, bpy.types.Operator):
    """Touch a mesh all over and paint a copy of it: where a patch can be trusted, and where there is none"""

    bl_idname = "tactile.stability_map"
    bl_label = "Stability Map"
    bl_options = {"UNDO", "PRESET"}

    target: StringProperty(
        name="Target",
        description="Name of the mesh object to touch; empty for the active object",
        options=UNSAVED,
    )
    spacing: FloatProperty(
        name="Spacing",
        description="Distance between the points that are touched; 0 uses a quarter of the extent",
        subtype="DISTANCE",
        soft_min=0.0,
    )
    progress: BoolProperty(
        name="Progress",
        description="Print progress to stderr where there is no window to show it",
        options={"HIDDEN", *UNSAVED},
    )

    stop = "Stop and Keep"
    meanwhile = {"PASS_THROUGH"}  # the touches are in a snapshot

    @classmethod
    def poll(cls, context):
        if context.mode != "OBJECT":
            cls.poll_message_set("Maps are made in Object Mode: leave this mode first")
            return False
        return has_target(cls, context)

    def invoke(self, context, event):
        if bpy.app.background:
            return self.execute(context)
        self._in_window = True
        found = probe.probe_of(context.view_layer.objects.active)
        for name in NAMES if found is not None else ():
            setattr(self, name, getattr(found.tactile_probe, name))
        try:
            self.target = target_object(context, self.target).name
        except ValueError as error:
            return report_error(self, error)
        return context.window_manager.invoke_props_dialog(self, confirm_text="Touch")

    def _begin(self, context):
        target = target_object(context, self.target)
        # No reference to the target: whatever happens to the scene, the touches go on in a snapshot of it.
        self._name, self._uid = target.name, target.session_uid
        self._map = StabilityMap(
            target, context.evaluated_depsgraph_get(), spacing=self.spacing, **touch_arguments(self)
        )
        self._steps = self._map.steps()

    def _stopped(self, context):
        """Esc ends it with what there is so far."""
        if not self._map.done:
            self._leave(context)
            return {"CANCELLED"}
        self._steps = self._map.spread()  # the rest is done as before
        return {"RUNNING_MODAL"}

    def _done(self):
        done, count = self._map.done, len(self._map.chosen)
        return f"Stability Map: {done} of {count} points", done / max(count, 1)

    def _check(self, context):
        self._target(context)

    def _target(self, context):
        """The target, if it is still what it was when it was first touched; raises ValueError if not."""
        found = next((o for o in context.view_layer.objects if o.session_uid == self._uid), None)
        if found is None:
            raise ValueError(f'"{self._name}" was deleted while it was touched, so its map was stopped')
        if context.mode != "OBJECT" or found.mode != "OBJECT":
            raise ValueError("The map was stopped because Object Mode was left: start it again")
        if found.matrix_world != self._map.surface.matrix:
            raise ValueError(f'"{self._name}" was moved while it was touched: start again')
        return found

    def _finish(self, context):
        target = self._target(context)
        self._map.require_same(target, context.evaluated_depsgraph_get())
        painted = map_object.insert(context, target, self._map)
        make_active(context, painted)
        record = painted[patch_record.MAP_RECORD].to_dict()
        self.report({"INFO"} if record["patches"] else {"WARNING"}, map_summary(record))
        return {"FINISHED"}

    def _about(self, context):
        """What is going to be touched, and at how many points; or why not."""
        try:
            target = target_object(context, self.target)
            depsgraph = context.evaluated_depsgraph_get()
            count = expected_count(target, depsgraph, self.extent, self.spacing)
        except ValueError as error:
            return sentence(error)
        return f"{target.name}: about {count} points are touched"

    def draw(self, context):
        layout = self.layout
        layout.use_property_split, layout.use_property_decorate = True, False
        layout.prop_search(self, "target", context.scene, "objects")
        layout.label(text=self._about(context), translate=False)
        draw_chosen(layout, self, "spacing")
        layout.separator()
        draw_all(layout, self)
