# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The page of a whole object: its surface from three sides, and how far it is off the mesh."""

from collections.abc import Mapping
from typing import Any

import bpy
import numpy as np

from ..scene import patch_record
from ..scene.attributes import DEVIATION, POSITION
from ..scene.colors import shades, symmetric_range
from ..scene.mesh_data import corners_of, values
from ..touch.arrays import read_array
from ..touch.types import Object
from ..touch.units import Unit
from ..whole_object.object_report import object_summary, object_table_rows, unit_of
from . import drawing, page, parts, views

TOLERANCES = (0.5, 1.0, 2.0, 5.0)
SCALE_WORDS = {
    "deviation": "deviation, red outside of the mesh",
    "height_std": "standard deviation",
}


def object_page(obj: Object) -> str:
    """The page of a whole object. Raises ValueError if it was edited."""
    patch_record.require_colored(obj)
    record = obj[patch_record.ATLAS_RECORD].to_dict()
    was_touched = "touches" in record
    sections = [
        page.verdict(f"{object_summary(record)}. {record['message']}", record["status"] == "ok"),
        _pictures(obj.data, unit_of(record), "deviation" if was_touched else "height_std"),
        *(_deviations(obj.data, record) if was_touched else ()),
        *parts.ending(object_table_rows(record), record, unit_of(record)),
    ]
    return page.page(f"{obj.name}: the surface of a whole object", sections)


def _pictures(mesh: bpy.types.Mesh, unit: Unit, shown: str) -> str:
    found = values(mesh, shown)
    limit = symmetric_range(found, parts.LEAST_RANGE)
    low = 0.0 if shown in patch_record.POSITIVE else -1.0
    scale = page.figure(drawing.scale(limit, parts.label(1, unit), low), SCALE_WORDS[shown])
    shown_colors = shades(found, limit)[read_array(mesh.loops, "vertex_index", dtype=np.int32)]
    return page.section("Pictures", *views.three_sides(mesh, shown_colors), scale)


def _deviations(mesh: bpy.types.Mesh, record: Mapping[str, Any]) -> list[str]:
    unit, off = unit_of(record), values(mesh, DEVIATION)
    areas = parts.vertex_areas(values(mesh, POSITION), corners_of(mesh))
    reaches = [(f"± {times:g} × the tolerance", times * record["tolerance"]) for times in TOLERANCES]
    words = "Shares of the area by its distance from the mesh. The outermost bars count all larger distances."
    return [
        page.section("Deviations", parts.spread(off, areas, unit, words)),
        page.section("Tolerance bands", parts.bands(off, areas, record["height_std"], unit, reaches)),
    ]
