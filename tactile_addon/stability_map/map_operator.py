# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Stability Map: touches all over an object; in slices in a window, at once from a script."""

import sys
from time import perf_counter

import bpy
from bpy.props import BoolProperty, FloatProperty, StringProperty

from ..probes import probe
from ..probes.operators import make_active, report_error, target_object
from ..scene import patch_record
from ..touch.settings import NAMES, TouchSettings, draw_all, draw_chosen, touch_arguments
from ..touch.wording import sentence
from . import map_object
from .map_report import map_summary
from .stability import StabilityMap, expected_count

SLICE = 0.05  # seconds of work between two events
SAY = 1.0  # seconds between two lines of progress
UNSAVED = {"SKIP_SAVE", "SKIP_PRESET"}


class TACTILE_OT_stability_map(TouchSettings, bpy.types.Operator):
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
        description="Distance between the points that are touched; 0 for a quarter of the extent",
        subtype="DISTANCE",
        soft_min=0.0,
    )
    progress: BoolProperty(
        name="Progress",
        description="Print progress to stderr, where there is no window to show it",
        options={"HIDDEN", *UNSAVED},
    )

    _timer = None  # while it is running in a window

    @classmethod
    def poll(cls, context):
        if context.mode != "OBJECT":
            cls.poll_message_set("Maps are made in Object Mode: leave this mode first")
            return False
        return True

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

    def execute(self, context):
        try:
            target = target_object(context, self.target)
            self._begin(context, target)
        except ValueError as error:
            return report_error(self, error)
        if not getattr(self, "_in_window", False):
            self._run()
            return self._finish(context)
        self._timer = context.window_manager.event_timer_add(0.01, window=context.window)
        context.workspace.status_text_set(_progress(self._map))
        context.window_manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def _begin(self, context, target):
        # No reference to the target: whatever happens to the scene, the touches go on in a snapshot of it.
        self._name, self._uid = target.name, target.session_uid
        self._map = StabilityMap(
            target, context.evaluated_depsgraph_get(), spacing=self.spacing, **touch_arguments(self)
        )
        self._steps = self._map.steps()

    def _run(self):
        """All steps at once; says now and then how far they are, where that is wanted."""
        said = perf_counter()
        for _ in self._steps:
            if self.progress and perf_counter() > said + SAY:
                said = perf_counter()
                print(f"{self._map.done} of {len(self._map.chosen)} points", file=sys.stderr, flush=True)

    def modal(self, context, event):
        if event.type == "ESC" and event.value == "PRESS":
            return self._stopped(context)
        if event.type != "TIMER":
            return {"PASS_THROUGH"}
        try:
            self._target(context)
            end = perf_counter() + SLICE
            for _ in self._steps:
                if perf_counter() > end:
                    context.workspace.status_text_set(_progress(self._map))
                    return {"PASS_THROUGH"}
        except ValueError as error:
            self._leave(context)
            return report_error(self, error)
        self._leave(context)
        return self._finish(context)

    def _stopped(self, context):
        """Esc ends it with what there is so far."""
        if not self._map.done:
            self._leave(context)
            return {"CANCELLED"}
        self._steps = self._map.spread()  # the rest is done as before
        return {"RUNNING_MODAL"}

    def _leave(self, context):
        """Takes away all that shows that it is going on."""
        context.window_manager.event_timer_remove(self._timer)
        context.workspace.status_text_set(None)

    def cancel(self, context):
        """Blender's, where it ends the operator itself: by the dialog, a new file or a closed window."""
        if self._timer is not None:
            self._leave(context)
            print("Stability Map: stopped, for the file or the window was closed", file=sys.stderr)

    def _target(self, context):
        """The target, if it is still what it was when it was first touched; raises ValueError if not."""
        found = next((o for o in context.view_layer.objects if o.session_uid == self._uid), None)
        if found is None:
            raise ValueError(f'"{self._name}" is gone: the map of it was stopped')
        if context.mode != "OBJECT" or found.mode != "OBJECT":
            raise ValueError("The map was stopped, for Object Mode was left: start it again")
        if found.matrix_world != self._map.surface.matrix:
            raise ValueError(f'"{self._name}" was moved while it was touched: start again')
        return found

    def _finish(self, context):
        try:
            target = self._target(context)
            self._map.require_same(target, context.evaluated_depsgraph_get())
        except ValueError as error:
            return report_error(self, error)
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


def _progress(touched):
    """What draws the status bar meanwhile; it may outlive the operator by a redraw."""

    def draw(header, context):
        layout, count = header.layout, len(touched.chosen)
        layout.label(text="", icon="EVENT_ESC")
        layout.label(text=" Stop and Keep")
        row = layout.row()
        row.ui_units_x = 16
        row.progress(
            factor=touched.done / max(count, 1), text=f"Stability Map: {touched.done} of {count} points"
        )
        layout.separator_spacer()

    return draw
