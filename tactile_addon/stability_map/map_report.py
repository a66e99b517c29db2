# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What the panel and the shell say of a stability map."""

from collections.abc import Iterator, Mapping
from typing import Any

import bpy

from ...core.arguments import many
from ..touch import units
from ..touch.wording import fit
from . import map_object
from .stability import REASONS

FACETED = 0.5  # The share of the patches from which on a map says that they follow facets.


def map_table_rows(record: Mapping[str, Any]) -> list[tuple[str, str]]:
    """(label, value) of everything there is to say of a map."""
    unit = units.unit_of_report(bpy.context.scene, record)
    names = ("spacing", "extent", "step")
    lengths = [units.say(record[name], 1, unit) if record[name] else "auto" for name in names]
    return [
        (
            "touched",
            f"{record['source']}, at {record['touched']} of {many(record['points'], 'point', 'points')}",
        ),
        ("patches", f"{record['patches']}, {record['in_doubt']} of them in doubt"),
        ("refused", ", ".join(_refused(record)) or "none"),
        ("fit", fit(record)),
        (", ".join(names), ", ".join(lengths)),
        *((f"median {title.lower()}", value) for title, value in median_rows(record, unit)),
    ]


def map_summary(record: Mapping[str, Any]) -> str:
    """A sentence on what a stability map has found."""
    patches = many(record["patches"], "patch", "patches")
    words = f"{patches} at {many(record['touched'], 'point', 'points')}, {record['in_doubt']} in doubt"
    refused = _refused(record)
    return f"{words}; refused: {', '.join(refused)}" if refused else words


def _refused(record: Mapping[str, Any]) -> list[str]:
    """How many points were refused, for each reason."""
    names = {key: name for key, name, _ in REASONS}
    return [f"{count} {names[key]}" for key, count in record["refused"].items() if count]


def map_rows(record: Mapping[str, Any], unit: units.Unit) -> list[tuple[str, str]]:
    """(label, value) of how many patches a stability map has, and of the reasons why there are not more."""
    names, refused = {key: name for key, name, _ in REASONS}, [*record["refused"].items()]
    return [
        ("Points", _points(record)),
        ("Spacing", units.say(record["spacing"], 1, unit)),
        ("Patches", str(record["patches"])),
        ("… in Doubt", str(record["in_doubt"])),
        *([("… on Facets", str(record["few_facets"]))] if record.get("few_facets") else []),
        *([("No Patch", str(sum(count for _, count in refused)))] if refused else []),
        *((names[key], str(count)) for key, count in refused if count),
    ]


def _points(record: Mapping[str, Any]) -> str:
    touched, points = record["touched"], record["points"]
    return str(points) if touched == points else f"{touched} of {points}"


def facets(record: Mapping[str, Any]) -> str | None:
    """A sentence if half of the patches or more follow facets, as the verdict on a patch has it; or None."""
    count = record.get("few_facets", 0)
    if count < max(FACETED * record["patches"], 1):
        return None
    return f"Curvature of the facets, not of the shape, at {many(count, 'point', 'points')}"


def median_rows(record: Mapping[str, Any], unit: units.Unit) -> Iterator[tuple[str, str]]:
    """(label, value) of the medians over the patches of a stability map that are known."""
    for name, title, _, power in map_object.MAP_QUANTITIES:
        if f"{name}_median" in record:
            found = record[f"{name}_median"]
            # In single precision a little is left of 0.
            yield title, units.say(units.rounded(found, power, record["spacing"]), power, unit)
