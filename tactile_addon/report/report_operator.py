# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Export Report: the page of the active patch, stability map or whole object as a file."""

from pathlib import Path

import bpy
from bpy.props import StringProperty

from ..files import whole_file
from ..files.export_operators import ObjectExport
from ..probes import probe
from ..scene import patch_record
from ..touch.types import Object
from .pages import map_page, object_page, patch_page


def write(path: str | Path, obj: Object) -> None:
    """Writes the page of a patch, map or whole object as the file `path`.

    Raises ValueError if the object was edited, and OSError if the file cannot be written.
    """
    pages = {patch_record.MAP_RECORD: map_page, patch_record.ATLAS_RECORD: object_page}
    make = next((pages[key] for key in pages if key in obj), None)
    given = (obj,) if make else (obj, patch_record.reconstruction_of(obj))
    with patch_record.reading(obj):
        text = (make or patch_page)(*given)
    whole_file.write_text(path, text)


class TACTILE_OT_export_report(ObjectExport, bpy.types.Operator):
    """Write one page for a browser: pictures, deviations, tolerance bands, numbers, settings and versions"""

    bl_idname = "tactile.export_report"
    bl_label = "Export Report"
    filename_ext = ".html"
    filter_glob: StringProperty(default="*.html", options={"HIDDEN"})

    hint = "Select a patch, its probe, a stability map or a touched object first"

    @staticmethod
    def written(context: bpy.types.Context) -> Object | None:
        obj: Object = context.view_layer.objects.active
        records = (patch_record.MAP_RECORD, patch_record.ATLAS_RECORD)
        return obj if obj is not None and any(key in obj for key in records) else probe.patch_near(obj)

    def write(self, obj: Object) -> None:
        write(self.filepath, obj)


def draw_export(self: bpy.types.Menu, context: bpy.types.Context) -> None:
    self.layout.operator(TACTILE_OT_export_report.bl_idname, text="Tactile Report (.html)")


MENUS = (("TOPBAR_MT_file_export", draw_export),)
