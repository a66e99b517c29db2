# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The numbers that the sidebar shows of a patch: those that matter most, and all others."""

from collections.abc import Iterator, Mapping
from typing import Any

import bpy

from ..touch import units
from ..touch.touch_report import TouchReport
from ..touch.units import Unit
from ..touch.wording import is_flat, measured, said

FLAT_DEVIATIONS = 2.0  # A curvature within this many deviations of 0 has no radius.
FLATTEST = 1e-3  # Nor has one whose radius is a thousand times the patch's.


def main_rows(record: Mapping[str, Any], unit: Unit) -> list[tuple[str, str]]:
    """(label, value) of the principal curvatures, with lengths in a unit of units.py."""
    return [(label, measured(record, key, -1, unit)) for label, key in (("κ1", "k1"), ("κ2", "k2"))]


def other_rows(record: Mapping[str, Any], unit: Unit) -> list[tuple[str, str]]:
    """(label, value) of everything else."""
    rim = record.get("height_std_rim")
    rows = [
        ("Height", f"± {units.say(record['height_std'], 1, unit)}"),
        ("At the Rim", "…" if rim is None else f"± {units.say(rim, 1, unit)}"),
        ("Deviation", said(record, "height_error", 1, unit) if "height_error" in record else "–"),
        *_radii(record, unit),
        ("K Gaussian", measured(record, "gaussian_curvature", -2, unit)),
        ("H Mean", measured(record, "mean_curvature", -1, unit)),
        ("Shape Index", "–" if is_flat(record) else f"{record['shape_index']:.2f}"),
        ("Curvedness", said(record, "curvedness", -1, unit)),
        ("Fit Error", said(record, "fit_error", 1, unit)),
    ]
    if record["is_verified"] and record["vertices"]:
        rows.append(("Farthest", said(record, "vertex_distance_max", 1, unit)))
    for key in ("extent", "step") if "step" in record else ("radius",):
        rows.append((key.title(), units.say(record[key], 1, unit)))
    return [*rows, ("Degree", str(record["degree"])), ("Contacts", str(record["contacts"]))]


def plane_rows(record: TouchReport, unit: Unit) -> list[tuple[str, str]]:
    """(label, value) of the plane that would lower the deviation most, once it is known."""
    if not record["is_verified"]:
        return []
    plane = record["suggested_plane"]
    return [
        ("Suggested Plane", f"{plane['azimuth']:.0f}°"),
        ("Expected Accuracy with It", f"± {units.say(plane['expected_height_std'], 1, unit)}"),
    ]


def found_values(record: Mapping[str, Any] | None, scene: bpy.types.Scene) -> dict[str, str]:
    """The values that the last touch chose for numbers left to the surface, in words and by name."""
    if record is None or record["status"] == "outdated" or "step" not in record:
        return {}
    unit = units.unit_of_report(scene, record)
    return {
        "extent": units.say(record["extent"], 1, unit),
        "step": units.say(record["step"], 1, unit),
        "degree": str(record["degree"]),
    }


def _radii(record: Mapping[str, Any], unit: Unit) -> Iterator[tuple[str, str]]:
    """Rows of the radii 1 / kappa, with their deviations, if the curvatures are known not to be 0."""
    for number in (1, 2):
        k, std = record[f"k{number}"], record[f"k{number}_std"]
        if abs(k) > FLAT_DEVIATIONS * std and abs(k) * record["radius"] > FLATTEST:
            yield f"1/κ{number}", units.say(1.0 / k, 1, unit, std / k**2)
