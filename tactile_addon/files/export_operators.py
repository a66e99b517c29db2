# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The export of patches, each by itself or all as one table for spreadsheets and scripts: File > Export."""

import csv
import io
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import bpy
from bpy.props import BoolProperty, StringProperty
from bpy_extras.io_utils import ExportHelper

from ... import core
from ...core.arguments import many
from ..probes import probe
from ..probes.operators import polls, report_done, reports_errors
from ..scene import patch_record
from ..touch import units
from ..touch.types import Object, OperatorMixin, Outcome
from ..touch.wording import cell
from . import contact_file, whole_file

# Keys of the report, and the power of length in the unit of each.
NUMBER_POWERS = {
    **dict.fromkeys(("k1", "k1_std", "k2", "k2_std"), -1),
    **dict.fromkeys(("gaussian_curvature", "gaussian_curvature_std"), -2),
    **dict.fromkeys(("mean_curvature", "mean_curvature_std", "curvedness"), -1),
    "shape_index": 0,
    **dict.fromkeys(("height_std", "fit_error", "vertex_distance_mean", "vertex_distance_max"), 1),
    **dict.fromkeys(("radius", "extent", "step", "noise"), 1),
    **dict.fromkeys(("degree", "contacts"), 0),
}
WORD_COLUMNS = ("source", "method", "status", "message")


class ObjectExport(ExportHelper, OperatorMixin):  # type: ignore[misc]  # of `invoke`, by the stubs
    """For operators that write something to inherit: the active patch, by itself or its probe, or else."""

    if TYPE_CHECKING:  # At run time this would hide the property of ExportHelper.
        filepath: str
    filename_ext: str
    write: Callable[[Any], str | None]  # It may say what it has written.
    hint = "Select a patch or its probe first"

    @staticmethod
    def written(context: bpy.types.Context) -> Any:
        """What to write, if there is anything."""
        return probe.patch_near(context.view_layer.objects.active)

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return polls(cls, cls.written(context), cls.hint)

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> Outcome:
        written = self.written(context)
        if not self.filepath and isinstance(written, bpy.types.Object):
            self.filepath = bpy.path.clean_name(written.name) + self.filename_ext
        return super().invoke(context, event)

    @reports_errors
    def execute(self, context: bpy.types.Context) -> Outcome:
        words = self.write(self.written(context)) or "Wrote"
        return report_done(self, f'{words} "{Path(self.filepath).name}"')


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


class TACTILE_OT_export_table(ObjectExport, bpy.types.Operator):
    """Write what all patches have found as CSV, one row a probe, in the scene's units"""

    bl_idname = "tactile.export_table"
    bl_label = "Export Table of Patches"
    filename_ext = ".csv"
    filter_glob: StringProperty(default="*.csv", options={"HIDDEN"})
    hint = "There is no patch to export: pick a reference point first"
    use_selection: BoolProperty(
        name="Selected Only", description="Write the selected probes and patches only", default=False
    )

    @staticmethod
    def written(context: bpy.types.Context) -> list[Object]:
        return patches_of(context.view_layer.objects)

    def write(self, patches: list[Object]) -> str:
        if self.use_selection:
            patches = patches_of(bpy.context.view_layer.objects.selected)
        write_table(self.filepath, patches, bpy.context.scene)
        return f"Wrote a table of {many(len(patches), 'patch', 'patches')}:"


def patches_of(objects: Iterable[Object]) -> list[Object]:
    """The patches among objects, or that belong to probes among them, by name."""
    patches = {probe.patch_near(obj) for obj in objects} - {None}
    return sorted((patch for patch in patches if probe.record_of(patch) is not None), key=lambda p: p.name)


def write_table(path: str | Path, patches: Sequence[Object], scene: bpy.types.Scene) -> None:
    """Writes a .csv with a header that names the unit, and a row for each patch; unknown fields are empty.

    The row of a patch that was edited has only its name and a message. Raises ValueError if there are no
    patches.
    """
    if not patches:
        raise ValueError("There is no patch to export: pick a reference point first")
    records = [probe.record_of(patch) for patch in patches]
    unit = units.unit_of(scene, max(record["radius"] for record in records))
    rows = [_row(*pair, unit) for pair in zip(patches, records, strict=True)]
    text = io.StringIO()
    table = csv.DictWriter(text, max(rows, key=len))  # Other ends of lines leave "\r" in a name unquoted.
    table.writeheader()
    table.writerows(rows)
    whole_file.write_text(path, text.getvalue())


def _row(patch: Object, record: Mapping[str, Any], unit: units.Unit) -> dict[str, str]:
    """The row of a patch as a dict of headings and values."""
    owner = probe.probe_of(patch)
    named = {"probe": cell(owner.name) if owner else "", "patch": cell(patch.name)}
    try:
        with patch_record.reading(patch):
            return named | _numbers(record, unit) | {key: cell(record[key]) for key in WORD_COLUMNS}
    except ValueError as error:
        return named | {"message": cell(str(error))}


def _numbers(record: Mapping[str, Any], unit: units.Unit) -> dict[str, str]:
    """The numbers of a report in words, by headings."""
    numbers = {_heading("xyz"[i], 1, unit): x / unit[1] for i, x in enumerate(record["frame"]["origin"])}
    numbers |= dict(zip(("nx", "ny", "nz"), record["frame"]["normal"], strict=True))
    for key, power in NUMBER_POWERS.items():
        numbers[_heading(key, power, unit)] = record[key] / unit[1] ** power if key in record else None
    return {key: "" if value is None else f"{value:.9g}" for key, value in numbers.items()}


def _heading(name: str, power: int, unit: units.Unit) -> str:
    symbol = units.symbol(power, unit)
    return f"{name} [{symbol}]" if symbol else name


def draw_export(self: bpy.types.Menu, context: bpy.types.Context) -> None:
    self.layout.operator(TACTILE_OT_export_contacts.bl_idname, text="Contact Data (.csv)")
    self.layout.operator(TACTILE_OT_export_patch.bl_idname, text="Tactile Patch (.json)")
    self.layout.operator(TACTILE_OT_export_table.bl_idname, text="Table of Tactile Patches (.csv)")
    self.layout.operator("tactile.export_report", text="Tactile Report (.html)")


CLASSES = (TACTILE_OT_export_contacts, TACTILE_OT_export_patch, TACTILE_OT_export_table)
MENUS = (("TOPBAR_MT_file_export", draw_export),)
