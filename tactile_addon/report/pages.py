# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Export Report: the pages of a patch, of a stability map and of a whole object as files for a browser."""

from collections.abc import Iterator, Mapping
from functools import partial
from pathlib import Path
from typing import Any

import bpy
import numpy as np
from bpy.props import StringProperty

from ... import core
from ..files import whole_file
from ..files.export_operators import ObjectExport
from ..probes import probe
from ..scene import patch_record
from ..scene.colors import shades, symmetric_range
from ..scene.mesh_data import DEVIATION, HEIGHT_STD, MAP_COLOR, POSITION, REASON, corners_of, values
from ..stability_map import map_object
from ..stability_map.stability import NOTHING
from ..touch import units
from ..touch.evaluated_mesh import read_array
from ..touch.types import Array, Object
from ..touch.wording import readable_rows, verdict
from ..whole_object.object_report import object_summary, object_table_rows
from . import page, parts

OUTERMOST = "The outermost bars count all larger distances."
TOLERANCES = (0.5, 1.0, 2.0, 5.0)  # The bands of a whole object.
# What pictures show: attribute, words, and the power of length in its unit.
SHOWN = (
    ("gaussian_curvature", "Gaussian curvature", -2),
    (HEIGHT_STD, "standard deviation of the height", 1),
    (DEVIATION, "deviation from the mesh, red outside it", 1),
)


def patch_page(patch: Object, r: core.Reconstruction) -> str:
    """The page of a patch object and its core.Reconstruction."""
    record = patch[patch_record.RECORD].to_dict()
    off, weights, words = _deviations(patch, r, record)
    bands = parts.shares_of(r.radius, "radius")
    sections = [
        page.verdict(f"{verdict(record)}. {record['message']}", record["status"] == "ok"),
        page.section("Pictures", *_pictures(patch, r, record)),
        *parts.deviations(off, weights, r.mean_height_std, record, bands, f"{words} {OUTERMOST}"),
        *parts.ending(readable_rows(record), record),
    ]
    return page.page(f"{patch.name}: a patch of {record['source']}", sections)


def _pictures(patch: Object, r: core.Reconstruction, record: Mapping[str, Any]) -> Iterator[str]:
    points, corners = values(patch.data, POSITION), corners_of(patch.data)
    contacts = r.contacts[:, :2] * record["radius"] / r.radius  # The object's mesh has this scale.
    for attribute, title, power in SHOWN if _has_mesh(record) else SHOWN[:-1]:
        found = values(patch.data, attribute)
        limit, scale = _scale(attribute, found, power, record)
        picture = page.triangles(points[:, :2], corners, shades(found[corners].mean(axis=1), limit), contacts)
        yield page.figure(f"{picture}<br>{scale}", f"{title}, along the normal, with the contacts")


def _scale(attribute: str, found: Array, power: int, record: Mapping[str, Any]) -> tuple[float, str]:
    """The range of the colors of values (n,), and a picture of them."""
    limit = symmetric_range(found, parts.LEAST_RANGE)
    low = 0.0 if attribute in patch_record.POSITIVE else -1.0
    return limit, page.scale(limit, parts.label(power, record), low)


def _has_mesh(record: Mapping[str, Any]) -> bool:
    return bool(record.get("vertices") or record.get("verification"))


def _deviations(patch: Object, r: core.Reconstruction, record: Mapping[str, Any]) -> tuple[Array, Array, str]:
    """Signed distances (n,) of the patch from mesh or contacts, their weights (n,), and words for them."""
    if _has_mesh(record):
        words = "Shares of the patch's area by its distance from the mesh."
        return values(patch.data, DEVIATION), parts.vertex_areas(patch.data), words
    x, y, z = r.contacts.T
    return r.height(x, y) - z, np.ones(len(x)), "Shares of the contacts by the patch's height above them."


def object_page(obj: Object) -> str:
    """The page of a whole object. Raises ValueError if it was edited."""
    patch_record.require_colored(obj)
    record, mesh = obj[patch_record.ATLAS_RECORD].to_dict(), obj.data
    was_touched = "touches" in record
    attribute, title, power = SHOWN[-1] if was_touched else SHOWN[-2]
    found = values(mesh, attribute)
    limit, scale = _scale(attribute, found, power, record)
    colors = shades(found, limit)[read_array(mesh.loops, "vertex_index", dtype=np.int32)]
    sections = [
        page.verdict(f"{object_summary(record)}. {record['message']}", record["status"] == "ok"),
        page.section("Pictures", *parts.three_sides(mesh, colors), page.figure(scale, title)),
    ]
    if was_touched:
        bands = [(f"± {times:g} × the tolerance", times * record["tolerance"]) for times in TOLERANCES]
        words = f"Shares of the area by its distance from the mesh. {OUTERMOST}"
        areas = parts.vertex_areas(mesh)
        sections += parts.deviations(found, areas, record["height_std"], record, bands, words)
    sections += parts.ending(object_table_rows(record), record)
    return page.page(f"{obj.name}: the surface of a whole object", sections)


def map_page(painted: Object) -> str:
    """The page of a map object."""
    record = painted[patch_record.MAP_RECORD].to_dict()
    colors = read_array(painted.data.attributes[MAP_COLOR].data, "color_srgb", 4)
    sections = [
        page.verdict(map_object.map_summary(record), record["patches"] > 0 and not record["in_doubt"]),
        page.section("Pictures", _legend(painted, record), *parts.three_sides(painted.data, colors)),
        *_errors(painted, record),
        *parts.ending(map_object.map_table_rows(record), record),
    ]
    return page.page(f"{painted.name}: a stability map of {record['source']}", sections)


def _legend(painted: Object, record: Mapping[str, Any]) -> str:
    """The legend of the colors."""
    shown = painted.tactile_map_colors
    swatches = "".join(page.swatch(color, words) for words, color in map_object.swatches(painted))
    if shown == REASON:
        return swatches
    title = next(words for key, words, *_ in map_object.MAP_QUANTITIES if key == shown)
    low = "1" if shown in map_object.LOGARITHMIC else "0"
    high = units.say_of(record, record["color_limit"], map_object.MAP_POWERS[shown])
    return page.words(f"{title}: pale green at {low}, dark red from {high} on.") + swatches


def _errors(painted: Object, record: Mapping[str, Any]) -> list[str]:
    """The sections on errors, in which each touch counts by the area that has its color."""
    found = painted[map_object.VALUES]
    errors, stds, weights = (np.array(found[name]) for name in ("error", HEIGHT_STD, map_object.AREA))
    counts = (weights > 0.0) & (errors != NOTHING)
    if not counts.any():
        return []
    std = float(np.median(stds[counts]))
    size = (record["extent"], "extent") if record["extent"] else (record["reach_median"], "median reach")
    words = f"Shares of the area by the error of the touch whose color it has. {OUTERMOST}"
    return parts.deviations(errors[counts], weights[counts], std, record, parts.shares_of(*size), words)


def write(path: str | Path, obj: Object) -> None:
    """Writes the page of a patch, map or whole object as the file `path`.

    Raises ValueError if the object was edited, and OSError if the file cannot be written.
    """
    if patch_record.MAP_RECORD in obj:
        make = partial(map_page, obj)
    elif patch_record.ATLAS_RECORD in obj:
        make = partial(object_page, obj)
    else:
        make = partial(patch_page, obj, patch_record.reconstruction_of(obj))
    with patch_record.reading(obj):
        text = make()
    whole_file.write_text(path, text)


class TACTILE_OT_export_report(ObjectExport, bpy.types.Operator):
    """Write one page for a browser: pictures, deviations, tolerance bands, numbers, settings and versions"""

    bl_idname = "tactile.export_report"
    bl_label = "Export Report"
    filename_ext = ".html"
    filter_glob: StringProperty(default="*.html", options={"HIDDEN"})

    hint = "Select a patch, its probe, a stability map or a touched object first"

    @staticmethod
    def written(context: bpy.types.Context) -> Any:
        obj: Object = context.view_layer.objects.active
        return probe.patch_near(obj) if patch_record.touched_record(obj) is None else obj

    def write(self, obj: Object) -> None:
        write(self.filepath, obj)
