# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Stability Map: touches all over an object; in slices in a window, at once from a script."""

import bpy

from ...core.arguments import many
from ..probes import probe
from ..probes.in_slices import AllOver, Progress
from ..probes.operators import make_active, report_done, target_object
from ..scene import patch_record
from ..touch import units
from ..touch.settings import NAMES, TouchSettings, length_property, touch_arguments
from ..touch.types import Object, Outcome
from . import map_object
from .stability import StabilityMap, expected_count, seconds_each


class TACTILE_OT_stability_map(AllOver, TouchSettings, bpy.types.Operator):
    """Touch a mesh all over and paint a copy of it: where a patch can be trusted, and where there is none"""

    bl_idname = "tactile.stability_map"
    bl_label = "Stability Map"
    bl_options = {"UNDO", "PRESET"}

    spacing: length_property(
        "Spacing",
        "Distance between the points that are touched; 0 uses half of the extent, or a 16th of the "
        "object's size where the extent is automatic",
    )

    stop, section = "Stop and Keep", "map"
    shown = ("target", "spacing", "extent", "noise", "seed")  # All else is as the active probe has it.

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> Outcome:
        found = probe.probe_of(context.view_layer.objects.active)
        for name in NAMES if found is not None and not bpy.app.background else ():
            setattr(self, name, getattr(found.tactile_probe, name))
        return super().invoke(context, event)

    def _begin(self, context: bpy.types.Context) -> None:
        self._map = StabilityMap(
            target_object(context, self.target),
            context.evaluated_depsgraph_get(),
            spacing=self.spacing,
            **touch_arguments(self),
        )
        self._steps = self._map.steps()

    def _stopped(self, context: bpy.types.Context) -> Outcome:
        """Keeps the touches so far when Esc is pressed."""
        if not self._map.done:
            self._leave(context)
            return {"CANCELLED"}
        self._steps = self._map.spread()
        return {"RUNNING_MODAL"}

    def _done(self) -> Progress:
        done, count = self._map.done, len(self._map.places)
        return f"Stability Map: {done} of {many(count, 'point', 'points')}", done / max(count, 1)

    def _check(self, context: bpy.types.Context) -> None:
        self._map.surface.require_source(context)

    def _finish(self, context: bpy.types.Context) -> Outcome:
        painted = map_object.insert(context, self._map.surface.require_same(context), self._map)
        make_active(context, painted)
        record = painted[patch_record.MAP_RECORD].to_dict()
        return report_done(self, map_object.map_summary(record), record["patches"] > 0)

    def _estimate(self, context: bpy.types.Context, target: Object) -> str:
        """A sentence on what will be touched at how many points."""
        depsgraph = context.evaluated_depsgraph_get()
        count = expected_count(target, depsgraph, self.extent, self.spacing)
        seconds = count * seconds_each(target, depsgraph, touch_arguments(self))
        words = f"about {many(units.rough(count), 'touch', 'touches')}, {units.duration(seconds)}"
        return f"{target.name}: {words}"
