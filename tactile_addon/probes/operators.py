# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The operator behind the menu entry, the scripts and the command line."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import wraps
from typing import Any

import bpy

from ..scene import patch_object, patch_record
from ..touch.settings import UNSAVED, PlacedTouch, draw_all, given, length_property, touch_arguments
from ..touch.touch_object import completed, touch
from ..touch.types import Object, Outcome
from ..touch.wording import sentence, verdict
from .probe import is_result, lock_of, probe_of, record_of

CONVERTIBLE = {"FONT": "text", "CURVE": "curve", "SURFACE": "surface", "META": "metaball"}


def report_error(operator: bpy.types.Operator, error: Exception) -> Outcome:
    """Lets an operator report what is wrong, and returns what ends it."""
    operator.report({"ERROR"}, sentence(error))
    return {"CANCELLED"}


def reports_errors(execute: Callable[[Any, bpy.types.Context], Outcome]) -> Callable[..., Outcome]:
    """An `execute` that reports a ValueError or an OSError as what is wrong, and ends the operator."""

    @wraps(execute)
    def reporting(self: Any, context: bpy.types.Context) -> Outcome:
        try:
            return execute(self, context)
        except (OSError, ValueError) as error:
            return report_error(self, error)

    return reporting


class TACTILE_OT_reconstruct(PlacedTouch, bpy.types.Operator):
    """Feel the surface along curves through a point and rebuild the patch around it"""

    bl_idname = "tactile.reconstruct"
    bl_label = "Fit Tactile Patch"
    bl_options = {"REGISTER", "UNDO", "PRESET"}

    tolerance: length_property(
        "Tolerance",
        "Add planes until the height is accurate to this or no plane would help; if not set, add none",
        options=UNSAVED,
    )

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if context.area is not None and not is_in_object_mode(cls, context, "Patches are fitted"):
            return False  # Scripts, which have no area, need not leave a mode.
        return has_target(cls, context)

    @reports_errors
    def execute(self, context: bpy.types.Context) -> Outcome:
        with waiting(context):
            touched = touch(
                target_object(context, self.target),
                context.evaluated_depsgraph_get(),
                given(self, "location") or context.scene.cursor.location.to_tuple(),
                outward=given(self, "outward"),
                tolerance=self.tolerance if self.properties.is_property_set("tolerance") else None,
                **touch_arguments(self),
            )
        touched = completed(touched)
        make_active(context, patch_object.insert(context.scene, touched))
        return report_done(self, verdict(touched.report), touched.report["status"] == "ok")

    def draw(self, context: bpy.types.Context) -> None:
        layout = self.layout
        layout.use_property_split = True
        layout.prop(self, "target")
        # If they are not set, the cursor and the surface decide, which zeros would prevent.
        for name in filter(self.properties.is_property_set, ("location", "outward")):
            layout.prop(self, name)
        draw_all(layout, self)
        is_set = self.properties.is_property_set("tolerance")
        layout.prop(self, "tolerance", text="Tolerance" if is_set else "Tolerance (Off)")


def report_done(operator: bpy.types.Operator, words: str, is_good: bool = True) -> Outcome:
    """Lets an operator report what it has done, as a warning unless that is good; returns what ends it."""
    operator.report({"INFO"} if is_good else {"WARNING"}, words)
    return {"FINISHED"}


def target_object(context: bpy.types.Context, name: str) -> Object:
    """The object to touch: by name, or the active one, or that of the active patch, map or whole object."""
    obj = context.view_layer.objects.active
    record, found = record_of(obj) or patch_record.touched_record(obj), probe_of(obj)
    if not name and found is not None and found.tactile_probe.target is not None:
        return found.tactile_probe.target
    if not name and record is not None:
        name = record["source"]
    if name:
        obj = bpy.data.objects.get(name)
    if obj is None:
        raise ValueError(
            f'There is no object "{name}" in the scene: name one of its mesh objects'
            if name
            else "No object is active: select the mesh object to touch"
        )
    return obj


def surface_of(context: bpy.types.Context) -> Object | None:
    """The active object if it is a whole object, or None."""
    obj: Object = context.view_layer.objects.active
    return obj if obj is not None and patch_record.ATLAS_RECORD in obj else None


@contextmanager
def waiting(context: bpy.types.Context) -> Iterator[None]:
    """Shows in a window that it takes a while, as the first touch of a large mesh, which builds a tree."""
    if bpy.app.background or context.window is None:
        yield
        return
    context.window.cursor_modal_set("WAIT")
    try:
        yield
    finally:
        context.window.cursor_modal_restore()


def polls(operator: type[Any], condition: object, message: str) -> bool:
    """Whether a condition holds; if not, Blender shows the message as the reason for the gray button."""
    if not condition:
        operator.poll_message_set(message)
    return bool(condition)


def is_in_object_mode(operator: type[Any], context: bpy.types.Context, what: str) -> bool:
    """Whether the mode is Object Mode; if it is not, the operator's poll says so."""
    return polls(operator, context.mode == "OBJECT", f"{what} in Object Mode: leave this mode first")


def has_mesh(operator: type[Any], context: bpy.types.Context) -> bool:
    """Whether the view layer has a mesh that can be touched; if not, the operator's poll says so."""
    found = any(obj.type == "MESH" and not is_result(obj) for obj in context.view_layer.objects)
    return polls(operator, found, no_mesh(context))


def no_mesh(context: bpy.types.Context) -> str:
    """What to do where there is no mesh to touch, in a sentence."""
    for obj in context.view_layer.objects:
        if obj.type in CONVERTIBLE:
            return f"Convert the {CONVERTIBLE[obj.type]} to a mesh (Object > Convert)"
    return "There is no mesh to touch: add one (Shift A), or import a scan (File > Import)"


def has_target(operator: type[Any], context: bpy.types.Context) -> bool:
    """Whether the active object of a viewport can be touched or leads to one that can; poll says why not."""
    if context.area is None or context.area.type != "VIEW_3D":  # A script may name one.
        return True
    try:
        obj = target_object(context, "")
    except ValueError as error:
        return has_mesh(operator, context) and polls(operator, False, sentence(error))
    return polls(operator, obj.type == "MESH", "Select the mesh object to touch")


def is_unlocked(operator: type[Any], context: bpy.types.Context) -> bool:
    """Whether the active object's probe or patch can be changed; the operator's poll says why not."""
    lock = lock_of(context.view_layer.objects.active)
    return polls(operator, lock is None, lock or "")


def make_active(context: bpy.types.Context, obj: Object) -> None:
    """Selects only the new object, unless that would leave an edit mode or its collection is excluded."""
    context.view_layer.update()  # After `blender -b FILE -c` it would not know the new object yet.
    objects = context.view_layer.objects
    if context.mode != "OBJECT" or obj.name not in objects:
        return
    for selected in list(objects.selected):
        selected.select_set(False)
    obj.select_set(True)
    objects.active = obj
