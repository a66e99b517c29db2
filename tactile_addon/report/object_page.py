# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The page of a whole object: its surface from three sides, and how far off is the mesh that was touched."""

from ..scene import patch_record
from ..scene.colors import shades, symmetric_range
from ..scene.mesh_data import values
from ..whole_object.object_report import object_summary, object_table_rows, unit_of
from . import drawing, page, parts, views

TOLERANCES = (0.5, 1.0, 2.0, 5.0)


def object_page(obj):
    """The page of the surface of a whole object."""
    record = obj[patch_record.ATLAS_RECORD].to_dict()
    unit, off = unit_of(record), values(obj.data, "deviation").astype(float)
    areas = parts.vertex_areas(values(obj.data, "position").astype(float), parts.corners(obj.data))
    limit = symmetric_range(off, parts.LEAST_RANGE)
    scale = page.figure(drawing.scale(limit, parts.label(1, unit)), "deviation, red outside of the mesh")
    reaches = [(f"± {times:g} × the tolerance", times * record["tolerance"]) for times in TOLERANCES]
    words = "Shares of the area by its distance from the mesh. The outermost bars count all beyond."
    sections = [
        page.verdict(object_summary(record), record["is_closed"]),
        page.section("Pictures", *views.three_sides(obj.data, shades(off, limit)), scale),
        page.section("Deviations", parts.spread(off, areas, unit, words)),
        page.section("Tolerance bands", parts.bands(off, areas, record["height_std"], unit, reaches)),
        *parts.ending(object_table_rows(record), record),
    ]
    return page.page(f"{obj.name}: the surface of {record['source']}", sections)
