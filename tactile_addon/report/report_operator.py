# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Export Report: the page of the active patch or stability map as a file."""

from pathlib import Path

import bpy
from bpy.props import StringProperty
from bpy_extras.io_utils import ExportHelper

from ..files import whole_file
from ..probes import probe
from ..probes.operators import report_error
from ..scene import patch_record
from .map_page import map_page
from .object_page import object_page
from .patch_page import patch_page


def write(path, obj):
    """The page of a patch, map or whole object as the file `path`.

    Raises ValueError where the patch was edited, OSError where the file cannot be written.
    """
    pages = {patch_record.MAP_RECORD: map_page, patch_record.ATLAS_RECORD: object_page}
    make = next((pages[key] for key in pages if key in obj), patch_page)
    whole_file.write_text(path, make(obj))


def _reported(context):
    """The map or whole object that is active, or the patch that the active object belongs to, or None."""
    obj = context.view_layer.objects.active
    alone = (patch_record.MAP_RECORD, patch_record.ATLAS_RECORD)
    return obj if obj is not None and any(key in obj for key in alone) else probe.patch_near(obj)


class TACTILE_OT_export_report(ExportHelper, bpy.types.Operator):
    """Write one page for a browser: pictures, deviations, tolerance bands, numbers, settings and versions"""

    bl_idname = "tactile.export_report"
    bl_label = "Export Report"
    filename_ext = ".html"
    filter_glob: StringProperty(default="*.html", options={"HIDDEN"})

    @classmethod
    def poll(cls, context):
        if _reported(context) is None:
            cls.poll_message_set(
                "Select a patch, its probe or its contours, a stability map or a touched object first"
            )
            return False
        return True

    def invoke(self, context, event):
        if not self.filepath:
            self.filepath = bpy.path.clean_name(_reported(context).name) + self.filename_ext
        return super().invoke(context, event)

    def execute(self, context):
        try:
            write(self.filepath, _reported(context))
        except (OSError, ValueError) as error:
            return report_error(self, error)
        self.report({"INFO"}, f'Wrote "{Path(self.filepath).name}"')
        return {"FINISHED"}


def draw_export(self, context):
    self.layout.operator(TACTILE_OT_export_report.bl_idname, text="Tactile Report (.html)")


MENUS = (("TOPBAR_MT_file_export", draw_export),)
