# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The numbers that the sidebar shows of a patch: those that matter most, and all others."""

from collections.abc import Iterator, Mapping
from typing import Any

from ..touch.touch_report import TouchReport
from ..touch.units import say_of
from ..touch.wording import is_flat, measured, said

FLAT_DEVIATIONS = 2.0  # A curvature within this many deviations of 0 has no radius.
FLATTEST = 1e-3  # Nor has one whose radius is a thousand times the patch's.


def main_rows(record: Mapping[str, Any]) -> list[tuple[str, str]]:
    """(label, value) of the principal curvatures."""
    return [(label, measured(record, key, -1)) for label, key in (("κ1", "k1"), ("κ2", "k2"))]


def other_rows(record: Mapping[str, Any]) -> list[tuple[str, str]]:
    """(label, value) of everything else."""
    rim = record.get("height_std_rim")
    rows = [
        ("Height", f"± {say_of(record, record['height_std'])}"),
        ("At the Rim", "…" if rim is None else f"± {say_of(record, rim)}"),
        ("Deviation", said(record, "height_error", 1) if "height_error" in record else "–"),
        *_radii(record),
        ("K Gaussian", measured(record, "gaussian_curvature", -2)),
        ("H Mean", measured(record, "mean_curvature", -1)),
        ("Shape Index", "–" if is_flat(record) else f"{record['shape_index']:.2f}"),
        ("Curvedness", said(record, "curvedness", -1)),
        ("Fit Error", said(record, "fit_error", 1)),
    ]
    if record["is_verified"] and record["vertices"]:
        rows.append(("Farthest", said(record, "vertex_distance_max", 1)))
    for key in ("extent", "step") if "step" in record else ("radius",):
        rows.append((key.title(), say_of(record, record[key])))
    return [*rows, ("Degree", str(record["degree"])), ("Contacts", str(record["contacts"]))]


def plane_rows(record: TouchReport) -> list[tuple[str, str]]:
    """(label, value) of the plane that would lower the deviation most, once it is known."""
    if not record["is_verified"]:
        return []
    plane = record["suggested_plane"]
    return [
        ("Suggested Plane", f"{plane['azimuth']:.0f}°"),
        ("Expected Accuracy with It", f"± {say_of(record, plane['expected_height_std'])}"),
    ]


def found_values(record: Mapping[str, Any] | None) -> dict[str, str]:
    """The values that the last touch chose for numbers left to the surface, in words and by name."""
    if record is None or record["status"] == "outdated" or "step" not in record:
        return {}
    return {
        "extent": say_of(record, record["extent"]),
        "step": say_of(record, record["step"]),
        "degree": str(record["degree"]),
    }


def _radii(record: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    """Rows of the radii 1 / kappa, with their deviations, if the curvatures are known not to be 0."""
    for number in (1, 2):
        k, std = record[f"k{number}"], record[f"k{number}_std"]
        if abs(k) > FLAT_DEVIATIONS * std and abs(k) * record["radius"] > FLATTEST:
            yield f"1/κ{number}", say_of(record, 1.0 / k, std=std / k**2)
