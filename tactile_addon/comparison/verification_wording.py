# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A verification as tables and sentences for people, and as the columns of a file."""

from collections.abc import Iterator, Mapping
from typing import Any

import bpy

from ...core.arguments import many
from ..touch import units
from ..touch.touch_report import TouchReport
from ..touch.wording import SPREAD, cell

# The results of core.verify, and the largest distance of the patch from the mesh, in the order of a table.
VERIFIED = (
    *("vertices", *(f"vertex_distance_{key}" for key in SPREAD)),
    *("contacts", *(f"contact_distance_{key}" for key in SPREAD), "fit_error"),
    *("extra_contours", "extra_points", "extra_fit_error"),
    *("total_absolute_curvature", "overlap", "patch_distance_max"),
)


def verification_summary(record: TouchReport) -> tuple[bool, str]:
    """Whether a verification gives reason to doubt, and a sentence on what it has found."""
    found = record["verification"]
    name, vertices, percent = found["target"], found["vertices"], 100.0 * found["overlap"]
    if not (vertices or percent or found["extra_points"]):
        return True, f'Nothing of "{name}" is below the patch: move one to the other, or choose another mesh'
    if not vertices:
        return (
            True,
            f'"{name}" has no vertices over the patch to measure, only faces, over {percent:.0f} % of it',
        )
    if record["status"] != "ok":
        return True, record["message"]
    unit = units.unit_of_report(bpy.context.scene, record)
    mean = _length(record, "vertex_distance_mean", unit)
    most = _length(
        record, max("vertex_distance_max", "patch_distance_max", key=lambda key: found.get(key, 0.0)), unit
    )
    return False, (
        f'At {many(vertices, "vertex", "vertices")}, "{name}" is {mean} off the patch on average, and '
        f"either is {most} off the other at most; the mesh covers {percent:.0f} % of the patch"
    )


def verification_columns(report: Mapping[str, Any]) -> list[tuple[str, Any]]:
    """(heading, value) of the columns in a patch's row; a value that is not known is empty."""
    found = report["verification"]
    lengths = [key for key in VERIFIED if "distance" in key or "error" in key]
    return [
        *((key, cell(report[key])) for key in ("patch", "source", "status")),
        ("target", cell(found["target"])),
        *((f"{key} [unit of the file]" if key in lengths else key, found.get(key, "")) for key in VERIFIED),
    ]


def verification_table(record: Mapping[str, Any], unit: units.Unit) -> list[tuple[str, ...]]:
    """Rows of a label and the values for the mesh and for the contacts; lengths are without unit."""
    found = record["verification"]
    symbol, bare = units.symbol(1, unit), ("", unit[1])

    def lengths(key: str) -> Iterator[str]:
        return (_length(record, f"{what}_distance_{key}", bare) for what in ("vertex", "contact"))

    names = zip(("Mean", "Median", "Maximum", "RMS"), SPREAD, strict=True)
    return [
        (f"in {symbol}" if symbol else "Distance", "Mesh", "Contacts"),
        *((name, *lengths(key)) for name, key in names),
        ("Points", str(found["vertices"]), str(found["contacts"])),
    ]


def verification_rows(record: Mapping[str, Any], unit: units.Unit) -> list[tuple[str, str]]:
    """(label, value) of everything else that a verification has found."""
    found = record["verification"]
    return [
        ("Fit Error", _length(record, "fit_error", unit)),
        (f"Error on {found['extra_contours']} More Curves", _length(record, "extra_fit_error", unit)),
        ("Total Curvature", f"{found['total_absolute_curvature']:.3g}"),
        ("Overlap", f"{100.0 * found['overlap']:.0f} %"),
        ("Largest Deviation", _length(record, "patch_distance_max", unit)),
    ]


def _length(record: Mapping[str, Any], key: str, unit: units.Unit) -> str:
    """A length in words, or a dash if the verification has not found it."""
    found = record["verification"]
    return units.say(units.rounded(found[key], 1, record["radius"]), 1, unit) if key in found else "–"
