# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What dragging a handle does: a plane turns or tilts, the extent grows, the point slides along."""

import math
from typing import Any

import bpy
import numpy as np
from bpy.props import EnumProperty, IntProperty
from mathutils import Matrix, Vector
from mathutils.geometry import intersect_line_plane

from ..probes import anchor, probe, touch_again
from ..scene.patch_record import CURVES
from ..touch import units
from ..touch.settings import MOST_PLANES, STEEPEST
from ..touch.surface import MeshSurface
from ..touch.touch_object import plane_axes
from ..touch.types import Object, Outcome
from .mouse import draw_hints, line_of_sight, mouse_ray, place_of

DRAG_TURN, DRAG_TILT, DRAG_EXTENT, POINT = "TURN", "TILT", "EXTENT", "POINT"
# If the sine of the angle between view and plane is less, nothing can be dragged in the plane, or not well.
EDGE_ON, STEEP = 0.03, 0.5
SNAP = math.radians(5.0)  # With Ctrl, angles change by this step.
PRECISE = 0.1  # With Shift, this share of the mouse's way counts.
TIPS = {
    DRAG_TURN: "Turn plane {}",
    DRAG_TILT: "Tilt plane {}",
    DRAG_EXTENT: "Change how far to feel",
    POINT: "Slide the point over the surface",
}
HINTS = (
    ("MOUSE_LMB", "Confirm"),
    ("MOUSE_RMB", "Cancel"),
    ("EVENT_CTRL", "Snap"),
    ("EVENT_SHIFT", "Precise"),
)


class TACTILE_OT_drag(bpy.types.Operator):
    """Drag to slide the probe over the surface, to turn or tilt a sampling plane, or to feel farther"""

    bl_idname = "tactile.drag"
    bl_label = "Drag Probe"
    bl_options = {"UNDO", "INTERNAL", "BLOCKING"}

    what: EnumProperty(
        name="What",
        items=[
            (DRAG_TURN, "Turn", "Turn a sampling plane about the normal"),
            (DRAG_TILT, "Tilt", "Lean a sampling plane to the side"),
            (DRAG_EXTENT, "Extent", "Change how far to feel"),
            (POINT, "Point", "Slide over the surface"),
        ],
    )
    plane: IntProperty(name="Plane", min=0, max=MOST_PLANES - 1)

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return shown_probe(context) is not None

    @classmethod
    def description(cls, context: bpy.types.Context, properties: Any) -> str:
        """The tooltip of a handle."""
        return TIPS[properties.what].format(properties.plane + 1)

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> Outcome:
        found = shown_probe(context)
        if self.what in (DRAG_TURN, DRAG_TILT):
            found.tactile_probe.active_plane = self.plane
        self._matrix = found.matrix_world.copy()
        self._center = self._matrix.translation
        # The handle follows the mouse from here on. Where the button went down is not known, because a busy
        # Blender hears of it late, when the mouse is already elsewhere.
        self._before = self._value = self._free = self._last = self._get(context)
        if self.what == DRAG_EXTENT:
            self._take_rim(context, event)
        below = None if self.what == POINT else self._below(context, event)
        if self.what != POINT and below is None:
            self.report({"WARNING"}, "The plane is seen edge on: turn the view to drag this handle")
            return {"CANCELLED"}
        if self.what in (DRAG_TURN, DRAG_TILT) and math.cos(below - self._before) < 0.0:
            self._last += math.pi  # The handle is at the other end.
        context.workspace.status_text_set(lambda header, _: draw_hints(header.layout, HINTS))
        context.window_manager.modal_handler_add(self)
        self._say(context)
        return {"RUNNING_MODAL"}

    def _take_rim(self, context: bpy.types.Context, event: bpy.types.Event) -> None:
        """Lets the mouse drag the rim of the patch where that is nearest, in the plane across the normal."""
        origin, direction = mouse_ray(context.region, context.region_data, place_of(event))
        patch = probe.patch_near(context.object)
        rim = [patch.matrix_world @ Vector(place) for place in np.reshape(patch[CURVES]["rim"][0], (-1, 3))]
        nearest = min(rim, key=lambda place: (place - origin).cross(direction).length)
        self._center = self._center + (nearest - self._center).project(self._matrix.col[2].xyz)
        self._last = (nearest - self._center).length

    def modal(self, context: bpy.types.Context, event: bpy.types.Event) -> Outcome:
        if event.type in {"ESC", "RIGHTMOUSE"}:
            self._set(context, self._before)
            self.cancel(context)
            return {"CANCELLED"}
        if event.type == "LEFTMOUSE" and event.value == "RELEASE":
            self.cancel(context)
            return {"FINISHED"}
        if event.type == "MOUSEMOVE":
            self._follow(context, event)
        return {"RUNNING_MODAL"}

    def _follow(self, context: bpy.types.Context, event: bpy.types.Event) -> None:
        """Changes the value as the mouse has moved, or puts the point below the mouse."""
        if self.what == POINT:
            self._slide(context, event)
            return
        now = self._below(context, event)
        if now is None:
            return
        pace = PRECISE if event.shift else 1.0
        if self.what == DRAG_EXTENT:
            self._free *= (now / self._last) ** pace
            value = self._free
        else:
            self._free += pace * math.remainder(now - self._last, 2.0 * math.pi)
            value = SNAP * round(self._free / SNAP) if event.ctrl else self._free
        self._last = now
        if self.what == DRAG_TILT:
            value = min(max(value, -STEEPEST), STEEPEST)
        self._set(context, value)

    def _slide(self, context: bpy.types.Context, event: bpy.types.Event) -> None:
        """Puts the probe on the surface below the mouse, and turns it as the normal turns."""
        origin, direction = mouse_ray(context.region, context.region_data, place_of(event))
        depsgraph = context.evaluated_depsgraph_get()
        space: Any = context.space_data
        try:
            surface = MeshSurface(probe.probe_of(context.object).tactile_probe.target, depsgraph, sound=True)
            if not context.region_data.is_perspective:
                origin -= space.clip_end * direction
            hit = surface.ray_cast(origin.to_tuple(), direction.to_tuple(), 4.0 * space.clip_end)
            if hit is None:
                return
            _, outward, _ = surface.project(self._matrix.translation.to_tuple())
        except (ValueError, AttributeError):  # The target is gone or cannot be touched; the panel says so.
            return
        upright, normal = self._matrix.col[2].xyz.normalized(), Vector(hit[1])
        if upright.dot(outward) < 0.0:  # It stays inside or outside the mesh.
            normal.negate()
        turn = upright.rotation_difference(normal) @ self._matrix.to_quaternion()
        self._set(context, Matrix.LocRotScale(list(hit[0]), turn, self._matrix.to_scale()))

    def _below(self, context: bpy.types.Context, event: bpy.types.Event) -> float | None:
        """The angle of the mouse, or its distance from the point; None on the point and edge-on."""
        origin, direction = mouse_ray(context.region, context.region_data, place_of(event))
        center, normal = self._center, self._matrix.col[2].xyz.normalized()
        e1 = self._matrix.col[0].xyz.normalized()
        right, up = e1, normal.cross(e1)
        if self.what == DRAG_TILT:
            settings = probe.probe_of(context.object).tactile_probe
            t = Vector(plane_axes(self._matrix, settings, self.plane)[:, 0].tolist())
            right, up, normal = normal, normal.cross(t), t
        sight = line_of_sight(context.region_data, center)
        if min(abs(way.dot(normal)) for way in (direction, sight)) < EDGE_ON:
            return None
        at = intersect_line_plane(origin, origin + direction, center, normal)
        if at is None or (at - center).length == 0.0:
            return None
        if self.what == DRAG_EXTENT:
            return (at - center).length
        return math.atan2((at - center).dot(up), (at - center).dot(right))

    def _get(self, context: bpy.types.Context) -> Any:
        found = probe.probe_of(context.object)
        settings = found.tactile_probe
        if self.what == POINT:
            return self._matrix
        if self.what == DRAG_EXTENT:
            return settings.extent or probe.record_of(found)["extent"]
        return (settings.azimuths if self.what == DRAG_TURN else settings.tilts)[self.plane]

    def _set(self, context: bpy.types.Context, value: Any) -> None:
        found = probe.probe_of(context.object)
        settings, self._value = found.tactile_probe, value
        if self.what == POINT:
            anchor.put(found, value)
        elif self.what == DRAG_EXTENT:
            settings.extent = value
        else:
            (settings.azimuths if self.what == DRAG_TURN else settings.tilts)[self.plane] = value
        self._say(context)

    def _say(self, context: bpy.types.Context) -> None:
        if self.what == POINT:
            words = "Point on " + probe.probe_of(context.object).tactile_probe.target.name
        elif self.what == DRAG_EXTENT:
            words = f"Extent {units.say_of(probe.record_of(context.object), self._value)}"
        else:
            angle = "Azimuth" if self.what == DRAG_TURN else "Tilt"
            words = f"{angle} {self.plane + 1}: {math.degrees(self._value):.1f}°"
        context.area.header_text_set(words)

    def cancel(self, context: bpy.types.Context) -> None:
        """Ends the gesture, and touches again; Blender calls it, too, when it ends the operator itself."""
        context.area.header_text_set(None)
        context.workspace.status_text_set(None)
        found = probe.probe_of(context.object)
        if found.tactile_probe.live:
            touch_again.refresh(found, context)


def shown_probe(context: bpy.types.Context) -> Object | None:
    """The probe whose handles are shown: the active one, or that of the active patch; or None."""
    found = probe.probe_of(context.object)
    if found is None or not found.visible_get() or probe.lock_of(found) is not None:
        return None
    return found if probe.record_of(found) is not None else None
