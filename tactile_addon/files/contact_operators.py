# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The import of measured contours: File > Import, and files that are dropped into a viewport."""

import json
from pathlib import Path
from typing import TYPE_CHECKING

import bpy
from bpy.props import (
    BoolProperty,
    CollectionProperty,
    EnumProperty,
    FloatProperty,
    FloatVectorProperty,
    StringProperty,
)
from bpy_extras.io_utils import ImportHelper

from ... import core
from ...core.arguments import many
from ..probes.in_slices import InSlices, Progress
from ..probes.operators import is_in_object_mode, make_active, report_done, reports_errors
from ..scene import patch_object
from ..touch.settings import FitSettings, draw_fit, given, length_property
from ..touch.types import Outcome
from ..touch.units import length
from ..touch.wording import verdict
from ..whole_object import whole_mesh
from ..whole_object.object_report import object_summary
from . import measured

UNIT_ITEMS = [
    (
        "FILE",
        "From File",
        "Use the unit that the columns name; without one, use the numbers as they are",
    ),
    ("NONE", "As They Are", "Use the numbers as lengths of the scene, whatever the file says"),
    *((unit, unit, f"Numbers are lengths in {unit}") for unit in core.UNIT_METERS),
]


class TACTILE_OT_import_contacts(InSlices, FitSettings, bpy.types.Operator, ImportHelper):
    """Rebuild the surface patch, or the whole surface, that measured contours and strokes show"""

    bl_idname = "tactile.import_contacts"
    bl_label = "Import Contact Data"
    bl_options = {"REGISTER", "UNDO", "PRESET"}
    stopped = "Stopped: nothing was imported"

    if TYPE_CHECKING:  # At run time this would hide the property of ImportHelper.
        filepath: str
    filter_glob: StringProperty(default="*.csv;*.tsv;*.txt;*.ply", options={"HIDDEN"})
    directory: StringProperty(subtype="DIR_PATH", options={"HIDDEN", "SKIP_SAVE"})
    files: CollectionProperty(type=bpy.types.OperatorFileListElement, options={"HIDDEN", "SKIP_SAVE"})
    unit: EnumProperty(name="Unit", description="Unit of the numbers in the file", items=UNIT_ITEMS)
    whole: BoolProperty(
        name="Whole Object",
        description="Cover all contacts with patches, and join these to one surface",
        options={"SKIP_PRESET"},
    )
    tolerance: length_property(
        "Tolerance",
        "Standard deviation to reach for heights of a whole object, in the scene's unit; 0 uses 1.2 "
        "% of each patch",
        precision=4,
    )
    point: FloatVectorProperty(
        name="Reference Point",
        subtype="TRANSLATION",
        description="The point where the curves meet, or a place among strokes; if not set, the "
        "file's, or the point nearest to all curves",
        options={"SKIP_SAVE", "SKIP_PRESET"},
    )
    exact_point: StringProperty(
        description="The reference point as text, in place of the other, because Blender's numbers have "
        "single precision",
        options={"HIDDEN", "SKIP_SAVE", "SKIP_PRESET"},
    )
    strokes: BoolProperty(
        name="Strokes",
        description="No curve passes through the reference point, which is only a place among them",
        options={"SKIP_PRESET"},
    )
    radius: length_property(
        "Radius",
        "Use strokes up to this distance from the reference point, in units of the scene; 0 uses all",
        min=0.0,
        precision=4,
    )
    outward: FloatVectorProperty(
        name="Outward",
        subtype="XYZ",
        description="A direction that points to the outer side of the surface, if no normals were measured "
        "and contacts do not close around the object",
        options={"HIDDEN", "SKIP_SAVE", "SKIP_PRESET"},
    )
    flip: BoolProperty(name="Flip", description="Use the other side of the surface as its outer side")
    noise: length_property(
        "Noise",
        "Standard deviation of a contact, in units of the scene; 0 if it is not known",
        min=0.0,
        precision=4,
    )
    normal_std: FloatProperty(
        name="Normal Deviation",
        subtype="ANGLE",
        description="Standard deviation of the measured normals, to fit them too; 0 leaves them out",
        min=0.0,
        soft_max=0.5,
    )

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return context.area is None or is_in_object_mode(cls, context, "Contacts are imported")

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> Outcome:
        self._in_window = not bpy.app.background
        return self.invoke_popup(context)  # A file was dropped; without one, the file browser opens.

    @reports_errors
    def execute(self, context: bpy.types.Context) -> Outcome:
        named = [str(Path(self.directory) / each.name) for each in self.files if each.name]
        self._paths = named or [self.filepath]
        try:
            scale = context.scene.unit_settings.scale_length
            self._contacts = measured.read(self._paths, self.unit, scale, self.whole)
            return super().execute(context) if self.whole else self._patch(context)
        except MemoryError as error:
            raise ValueError("There are more contacts than fit into memory: use fewer of them") from error

    def _patch(self, context: bpy.types.Context) -> Outcome:
        """Adds the patch around one point."""
        touched = measured.fit(
            Path(self._paths[0]).name,
            self._contacts,
            point=json.loads(self.exact_point) if self.exact_point else given(self, "point"),
            outward=given(self, "outward"),
            flip=self.flip,
            all_strokes=self.strokes,
            radius=self.radius,
            noise=self.noise,
            normal_std=self.normal_std,
            method=self.method,
            degree=self.degree or "auto",
            weight=self.weight or None,
            solver=self.solver,
        )
        make_active(context, patch_object.insert(context.scene, touched))
        report, summary = touched.report, verdict(touched.report)
        if "misses" in report:
            summary += f"; curves miss their common point by {length(max(report['misses']))} at most"
        return report_done(self, summary, report["status"] == "ok")

    def _begin(self, context: bpy.types.Context) -> None:
        self._object = measured.MeasuredObject(
            self._contacts,
            outward=given(self, "outward"),
            flip=self.flip,
            tolerance=self.tolerance,
            noise=self.noise,
        )
        self._steps = self._object.steps()

    def _done(self) -> Progress:
        return f"Joining {many(len(self._paths), 'file', 'files')}", self._share

    def _finish(self, context: bpy.types.Context) -> Outcome:
        more = f" and {len(self._paths) - 1} more" if len(self._paths) > 1 else ""
        report = self._object.report()
        made = whole_mesh.insert(context.scene, Path(self._paths[0]).name + more, self._object.whole, report)
        make_active(context, made)
        return report_done(self, object_summary(report), report["status"] == "ok")

    def draw(self, context: bpy.types.Context) -> None:
        of_whole = "outward", "flip", "noise", "tolerance"
        of_patch = "point", "strokes", "radius", "flip", "noise", "normal_std"
        self.shown = ("unit", "whole", *(of_whole if self.whole else of_patch))
        super().draw(context)
        if not self.whole:
            draw_fit(self.layout, self)


class TACTILE_FH_contacts(bpy.types.FileHandler):
    bl_idname = "TACTILE_FH_contacts"
    bl_label = "Contact Data"
    bl_import_operator = TACTILE_OT_import_contacts.bl_idname
    bl_file_extensions = ".csv;.ply"

    @classmethod
    def poll_drop(cls, context: bpy.types.Context) -> bool:
        return context.area is not None and context.area.type == "VIEW_3D"


def draw_import(self: bpy.types.Menu, context: bpy.types.Context) -> None:
    self.layout.operator(TACTILE_OT_import_contacts.bl_idname, text="Contact Data (.csv, .ply)")


CLASSES = (TACTILE_OT_import_contacts, TACTILE_FH_contacts)
MENUS = (("TOPBAR_MT_file_import", draw_import),)
