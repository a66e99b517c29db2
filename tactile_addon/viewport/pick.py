# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Pick Reference Point: hover to see how the surface lies, click to have a probe and a patch there."""

from typing import Any

import bpy
from bpy.props import BoolProperty

from ..probes import anchor, change_handlers, probe, touch_again
from ..probes.operators import (
    has_mesh,
    is_in_object_mode,
    make_active,
    report_done,
    report_error,
    reports_errors,
    target_object,
)
from ..scene import patch_record
from ..scene.viewports import redraw, show_colors, show_size
from ..stability_map.map_object import inputs_of, touched_near
from ..touch.settings import (
    NAMES,
    UNSAVED,
    PlacedTouch,
    draw_all,
    given,
    silent,
    touch_arguments,
)
from ..touch.touch_object import Touched, touch
from ..touch.types import Object, Outcome
from ..touch.wording import curvatures, sentence, verdict
from . import overlay
from .mouse import draw_hints, large_meshes, place_of, point_below

NAVIGATION = ("MIDDLEMOUSE", "WHEEL", "TRACKPAD", "NDOF", "NUMPAD", "MOUSEROTATE", "MOUSESMARTZOOM", "HOME")
HINTS = (
    ("MOUSE_LMB", "Touch Here"),
    ("MOUSE_RMB", "Cancel"),
    ("EVENT_ESC", "Cancel"),
    ("MOUSE_MMB", "Navigate"),
)


class TACTILE_OT_pick(PlacedTouch, bpy.types.Operator):
    """Click on a mesh: a probe there feels the surface and keeps a patch of it up to date"""

    bl_idname = "tactile.pick"
    bl_label = "Pick Reference Point"
    bl_options = {"REGISTER", "UNDO", "PRESET"}

    new: BoolProperty(
        name="New Probe",
        description="Make a new probe instead of moving the active one",
        options=UNSAVED,
    )
    at_once: BoolProperty(
        name="At Once",
        description="Touch where the mouse is, without asking for a click",
        options={"HIDDEN", *UNSAVED},
    )
    parent: BoolProperty(
        name="Move With Target",
        description="Make a new probe a child of the touched object, so that it moves with the object",
        default=True,
    )

    # Where the mouse came last, if nothing can have moved it since: a busy Blender hears of a click late, and
    # takes it to be where the mouse is by then. The tool has each move of the mouse noted for its click.
    _mouse: tuple[int, int] | None = None

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return is_in_object_mode(cls, context, "Points are picked") and has_mesh(cls, context)

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> Outcome:
        if event.type == "MOUSEMOVE":
            TACTILE_OT_pick._mouse = place_of(event)
            return {"PASS_THROUGH"}
        if context.area is None or context.area.type != "VIEW_3D":
            return report_error(self, ValueError("Points are picked in a 3D viewport: start the pick there"))
        active = context.view_layer.objects.active
        if active is not None and active.type == "MESH":
            show_size(max(active.dimensions[:]))
        self._area, self._large = context.area, large_meshes(context)
        for name in NAMES:  # Blender remembers those of the last pick, which suited another object.
            self.properties.property_unset(name)
        try:
            self._inherit(context)
        except ValueError as error:
            return report_error(self, error)
        # The drawing may outlive this operator by a redraw, so it gets a dict and not the operator.
        self._seen: dict[str, Any] = {}
        self._drawings = overlay.add_drawings(overlay.PICK_DRAWINGS, self._seen)
        context.window.cursor_modal_set("EYEDROPPER")
        context.workspace.status_text_set(lambda header, _: draw_hints(header.layout, HINTS))
        if self.at_once:
            return self._press(context, self._mouse or place_of(event))
        context.window_manager.modal_handler_add(self)
        self._mouse = place_of(event)
        self._hover(context, self._mouse)
        return {"RUNNING_MODAL"}

    def modal(self, context: bpy.types.Context, event: bpy.types.Event) -> Outcome:
        if event.type in {"ESC", "RIGHTMOUSE"}:
            self.cancel(context)
            return {"CANCELLED"}
        if event.type.startswith(NAVIGATION) or (event.type == "LEFTMOUSE" and event.alt):
            self._mouse = self._seen["changes"] = None
            return {"PASS_THROUGH"}
        if event.type == "MOUSEMOVE":
            self._mouse = place_of(event)
            self._hover(context, self._mouse)
        if event.type == "LEFTMOUSE" and event.value == "PRESS":
            return self._press(context, self._mouse or place_of(event))
        return {"RUNNING_MODAL"}

    def _press(self, context: bpy.types.Context, mouse: tuple[int, int]) -> Outcome:
        """Makes the probe below the mouse; where no touch is possible, a pick goes on and the tool ends."""
        # The preview is the touch, unless something has changed since.
        is_seen = self._seen.get("changes") == change_handlers.changes and self._seen["mouse"] == mouse
        words = self._words if is_seen else self._hover(context, mouse)
        touched = self._seen["touched"]
        if touched is None and not self.at_once:
            self._seen["refusal"] = words
            return {"RUNNING_MODAL"}
        self.cancel(context)
        if touched is None:
            self.report({"WARNING"}, words)
            return {"CANCELLED"}
        self.target, self.location = touched.report["source"], touched.result.point
        self.outward = touched.result.frame.axes[:, 2]
        return self._make(context, touched)

    def cancel(self, context: bpy.types.Context) -> None:
        """Removes everything that shows that a pick is going on."""
        for drawing in self._drawings:
            bpy.types.SpaceView3D.draw_handler_remove(drawing, "WINDOW")
        context.window.cursor_modal_restore()
        context.workspace.status_text_set(None)
        self._area.header_text_set(None)
        redraw(context, "WINDOW")

    @reports_errors
    def execute(self, context: bpy.types.Context) -> Outcome:
        self._inherit(context)
        touched = touch(
            target_object(context, self.target),
            context.evaluated_depsgraph_get(),
            given(self, "location") or context.scene.cursor.location.to_tuple(),
            toward=given(self, "outward"),
            **touch_arguments(self),
        )
        return self._make(context, touched)

    def _make(self, context: bpy.types.Context, touched: Touched) -> Outcome:
        """Gives the probe to be moved, or a new one, the patch of a touch."""
        depsgraph, moved = context.evaluated_depsgraph_get(), self._moved(context)
        target = bpy.data.objects[touched.report["source"]]
        found = moved or probe.make(context, target)
        settings = found.tactile_probe
        with_target = anchor.is_attached(found) if moved else self.parent
        with silent():
            settings.target, settings.is_probe, settings.lost = target, True, ""
            if with_target and found.parent != target:
                anchor.attach(found, target)
            for name in NAMES:
                setattr(settings, name, getattr(self, name))
            touch_again.adopt(found, touched, depsgraph, complete=True)
        make_active(context, found)
        show_colors(context.space_data)
        show_size(touched.surface.size)
        report = probe.record_of(found)
        return report_done(self, verdict(report), report["status"] == "ok")

    def draw(self, context: bpy.types.Context) -> None:
        layout = self.layout
        layout.use_property_split = True
        layout.prop(self, "target")
        layout.prop(self, "location")
        layout.prop(self, "parent")
        draw_all(layout, self)

    def _moved(self, context: bpy.types.Context) -> Object | None:
        """The probe to be moved, or None if a new one is to be made."""
        return None if self.new else probe.probe_of(context.view_layer.objects.active)

    def _inherit(self, context: bpy.types.Context) -> None:
        """Takes settings that are not set from the probe to be moved or from the active map.

        Raises ValueError if the probe cannot be changed.
        """
        active: Object = context.view_layer.objects.active
        moved, inputs = self._moved(context), {}
        if moved is not None:
            probe.require_unlocked(moved)
            inputs = {name: getattr(moved.tactile_probe, name) for name in NAMES}
        elif active is not None and patch_record.MAP_RECORD in active:
            inputs = inputs_of(active)
        for name, value in inputs.items():
            if not self.properties.is_property_set(name):
                setattr(self, name, value)

    def _hover(self, context: bpy.types.Context, mouse: tuple[int, int]) -> str:
        """Touches below the mouse for the preview, and returns what there is to say of it.

        The header has no room for a sentence, so a refusal is drawn next to the mouse.
        """
        words = short = "Move over a mesh to touch it"
        if self._large:  # Blender builds trees of their faces then.
            short += f" (the first touch of {', '.join(sorted(self._large))} takes a while)"
        self._seen |= {
            "touched": None,
            "refusal": None,
            "mouse": mouse,
            "changes": change_handlers.changes,
        }
        try:
            found = point_below(context, mouse)
            if found is not None:
                obj, location, eye = found
                active = context.view_layer.objects.active
                if (patch_record.touched_record(active) or {}).get("source") == obj.name:
                    location = touched_near(active, location)
                depsgraph, arguments = context.evaluated_depsgraph_get(), touch_arguments(self)
                self._seen["touched"] = touched = touch(obj, depsgraph, location, toward=eye, **arguments)
                is_sure = touched.report["status"] == "ok"
                bends = f"principal curvatures {curvatures(touched.report)}"
                words = short = f"{obj.name}: {bends if is_sure else verdict(touched.report)}"
        except ValueError as error:
            words = self._seen["refusal"] = sentence(error)
            short = "No touch is possible here"
        self._area.header_text_set(f"Pick Reference Point     {short}")
        redraw(context, "WINDOW")
        self._words = words
        return words


class TactileTool(bpy.types.WorkSpaceTool):
    bl_space_type, bl_context_mode = "VIEW_3D", "OBJECT"
    bl_idname = "tactile.tool"
    bl_label = "Tactile Probe"
    bl_description = "Click on a mesh to place a probe there or to move the active probe there"
    bl_icon = "ops.paint.eyedropper_add"
    bl_keymap = tuple(
        (TACTILE_OT_pick.bl_idname, {"type": kind, "value": value}, {"properties": [("at_once", True)]})
        for kind, value in (("LEFTMOUSE", "PRESS"), ("MOUSEMOVE", "ANY"))
    )


def register_tool() -> None:
    """Adds the tool to the toolbar."""
    bpy.utils.register_tool(TactileTool, after={"builtin.measure"})


def unregister_tool() -> None:
    """Takes the tool out of the toolbar."""
    bpy.utils.unregister_tool(TactileTool)
    # Blender itself leaves the tool's keys among the user's keys.
    user = bpy.context.window_manager.keyconfigs.user
    for keymap in [keymap for keymap in user.keymaps if keymap.name.endswith(f", {TactileTool.bl_label}")]:
        user.keymaps.remove(keymap)
