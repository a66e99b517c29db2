# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The export of patches: File > Export."""

import math
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import bpy
from bpy.props import BoolProperty, StringProperty
from bpy_extras.io_utils import ExportHelper

from ... import core
from ...core.arguments import many
from ..probes import probe
from ..probes.operators import polls, report_done, report_error
from ..scene import patch_record
from ..touch.types import Object, OperatorMixin, Outcome
from . import contact_file, patch_table


class ObjectExport(ExportHelper, OperatorMixin):  # type: ignore[misc]  # of `invoke`, by the stubs
    """For operators that write what is active to inherit: a patch, by itself or its probe."""

    if TYPE_CHECKING:  # At run time this would hide the property of ExportHelper.
        filepath: str
    filename_ext: str
    write: Callable[[Object], None]
    hint = "Select a patch or its probe first"

    @staticmethod
    def written(context: bpy.types.Context) -> Object | None:
        """The object to write, or None."""
        return probe.patch_near(context.view_layer.objects.active)

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return polls(cls, cls.written(context), cls.hint)

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> Outcome:
        if not self.filepath:
            self.filepath = bpy.path.clean_name(self.written(context).name) + self.filename_ext
        return super().invoke(context, event)

    def execute(self, context: bpy.types.Context) -> Outcome:
        try:
            self.write(self.written(context))
        except (OSError, ValueError) as error:
            return report_error(self, error)
        return report_done(self, f'Wrote "{Path(self.filepath).name}"')


class TACTILE_OT_export_contacts(ObjectExport, bpy.types.Operator):
    """Write the contacts of the active patch as CSV, in the scene's units"""

    bl_idname = "tactile.export_contacts"
    bl_label = "Export Contact Data"
    filename_ext = ".csv"
    filter_glob: StringProperty(default="*.csv", options={"HIDDEN"})

    def write(self, patch: Object) -> None:
        settings = bpy.context.scene.unit_settings
        named = core.UNIT_METERS.items() if settings.system != "NONE" else ()
        # An imported file brings numbers of this unit back as they are.
        unit = next(
            (name for name, meters in named if math.isclose(meters, settings.scale_length, rel_tol=1e-6)), ""
        )
        contacts = contact_file.contacts_of(patch_record.reconstruction_of(patch))
        contact_file.write(self.filepath, contacts._replace(unit=unit))


class TACTILE_OT_export_patch(ObjectExport, bpy.types.Operator):
    """Write the active patch as JSON: polynomial, frame, domain, covariance; as core.from_dict reads it"""

    bl_idname = "tactile.export_patch"
    bl_label = "Export Patch"
    filename_ext = ".json"
    filter_glob: StringProperty(default="*.json", options={"HIDDEN"})

    def write(self, patch: Object) -> None:
        contact_file.write_patch(self.filepath, patch_record.reconstruction_of(patch))


class TACTILE_OT_export_table(bpy.types.Operator, ExportHelper):  # type: ignore[misc]  # as above
    """Write what all patches have found as CSV, one row a probe, in the scene's units"""

    bl_idname = "tactile.export_table"
    bl_label = "Export Table of Patches"
    filename_ext = ".csv"
    if TYPE_CHECKING:
        filepath: str
    filter_glob: StringProperty(default="*.csv", options={"HIDDEN"})
    use_selection: BoolProperty(
        name="Selected Only", description="Write the selected probes and patches only", default=False
    )

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        patches = patch_table.patches_of(context.view_layer.objects)
        return polls(cls, patches, "There is no patch to export: pick a reference point first")

    def execute(self, context: bpy.types.Context) -> Outcome:
        objects = context.view_layer.objects
        try:
            patches = patch_table.patches_of(objects.selected if self.use_selection else objects)
            patch_table.write(self.filepath, patches, context.scene)
        except (OSError, ValueError) as error:
            return report_error(self, error)
        count, name = many(len(patches), "patch", "patches"), Path(self.filepath).name
        return report_done(self, f'Wrote a table of {count}: "{name}"')


def draw_export(self: bpy.types.Menu, context: bpy.types.Context) -> None:
    self.layout.operator(TACTILE_OT_export_contacts.bl_idname, text="Contact Data (.csv)")
    self.layout.operator(TACTILE_OT_export_patch.bl_idname, text="Tactile Patch (.json)")
    self.layout.operator(TACTILE_OT_export_table.bl_idname, text="Table of Tactile Patches (.csv)")


CLASSES = (TACTILE_OT_export_contacts, TACTILE_OT_export_patch, TACTILE_OT_export_table)
MENUS = (("TOPBAR_MT_file_export", draw_export),)
