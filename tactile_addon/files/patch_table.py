# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The results of several patches as one table with a row each, for spreadsheets and scripts."""

import csv
import io
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import bpy

from ..probes import probe
from ..scene import patch_record
from ..touch import units
from ..touch.types import Object
from ..touch.units import Unit
from ..touch.wording import cell
from . import whole_file

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


def patches_of(objects: Iterable[Object]) -> list[Object]:
    """The patches among objects, or that belong to probes among them, by name."""
    patches = {probe.patch_near(obj) for obj in objects} - {None}
    return sorted((patch for patch in patches if probe.record_of(patch) is not None), key=lambda p: p.name)


def write(path: str | Path, patches: Sequence[Object], scene: bpy.types.Scene) -> None:
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


def _row(patch: Object, record: Mapping[str, Any], unit: Unit) -> dict[str, str]:
    """The row of a patch as a dict of headings and values."""
    owner = probe.probe_of(patch)
    named = {"probe": cell(owner.name) if owner else "", "patch": cell(patch.name)}
    try:
        with patch_record.reading(patch):
            return named | _numbers(record, unit) | {key: cell(record[key]) for key in WORD_COLUMNS}
    except ValueError as error:
        return named | {"message": cell(str(error))}


def _numbers(record: Mapping[str, Any], unit: Unit) -> dict[str, str]:
    """The numbers of a report in words, by headings."""
    numbers = {_heading("xyz"[i], 1, unit): x / unit[1] for i, x in enumerate(record["frame"]["origin"])}
    numbers |= dict(zip(("nx", "ny", "nz"), record["frame"]["normal"], strict=True))
    for key, power in NUMBER_POWERS.items():
        numbers[_heading(key, power, unit)] = record[key] / unit[1] ** power if key in record else None
    return {key: "" if value is None else f"{value:.9g}" for key, value in numbers.items()}


def _heading(name: str, power: int, unit: Unit) -> str:
    symbol = units.symbol(power, unit)
    return f"{name} [{symbol}]" if symbol else name
