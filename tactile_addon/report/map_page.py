# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The page of a stability map: the painted object from three sides, and the errors of its touches."""

from collections.abc import Mapping
from typing import Any

import bpy
import numpy as np

from ..scene import patch_record
from ..scene.attributes import HEIGHT_STD, MAP_COLOR, REASON
from ..stability_map import map_object
from ..stability_map.map_report import map_summary, map_table_rows
from ..stability_map.stability import NOTHING
from ..touch import units
from ..touch.arrays import read_array
from ..touch.types import Object
from ..touch.units import Unit
from . import page, parts, views


def map_page(painted: Object) -> str:
    """The page of a map object."""
    record = painted[patch_record.MAP_RECORD].to_dict()
    unit = units.unit_of_report(bpy.context.scene, record)
    sections = [
        page.verdict(map_summary(record), record["patches"] > 0 and not record["in_doubt"]),
        page.section(
            "Pictures",
            _legend(painted, record, unit),
            *views.three_sides(
                painted.data, read_array(painted.data.attributes[MAP_COLOR].data, "color_srgb", 4)
            ),
        ),
        *_errors(painted, record, unit),
        *parts.ending(map_table_rows(record), record, unit),
    ]
    return page.page(f"{painted.name}: a stability map of {record['source']}", sections)


def _legend(painted: Object, record: Mapping[str, Any], unit: Unit) -> str:
    """The legend of the colors."""
    shown = painted.tactile_map_colors
    swatches = "".join(page.swatch(color, words) for words, color in map_object.swatches(painted))
    if shown == REASON:
        return swatches
    title = next(words for key, words, *_ in map_object.MAP_QUANTITIES if key == shown)
    low = "1" if shown in map_object.LOGARITHMIC else "0"
    high = units.say(record["color_limit"], map_object.MAP_POWERS[shown], unit)
    return page.words(f"{title}: pale green at {low}, dark red from {high} on.") + swatches


def _errors(painted: Object, record: Mapping[str, Any], unit: Unit) -> list[str]:
    """The sections on errors, in which each touch counts by the area that has its color."""
    found = painted[map_object.VALUES]
    errors, stds, weights = (np.array(found[name]) for name in ("error", HEIGHT_STD, map_object.AREA))
    counts = (weights > 0.0) & (errors != NOTHING)
    if not counts.any():
        return []
    errors, weights, std = errors[counts], weights[counts], float(np.median(stds[counts]))
    size = (record["extent"], "extent") if record["extent"] else (record["reach_median"], "median reach")
    words = (
        "Shares of the area by the error of the touch whose color it has. The last bar counts all larger "
        "errors."
    )
    return [
        page.section("Errors", parts.spread(errors, weights, unit, words)),
        page.section("Tolerance bands", parts.bands(errors, weights, std, unit, parts.shares_of(*size))),
    ]
