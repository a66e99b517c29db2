# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What the panel and the shell say of a whole object."""

import math
from collections.abc import Mapping
from typing import Any

from ...core.arguments import many
from ..touch import units
from ..touch.wording import place, reasons

# A surface is good if this share of it is within the tolerance of the mesh, and all within so many.
WITHIN_SHARE, OFF_TOLERANCES = 0.99, 3.0
FACETED = 0.5  # The panel says that curvatures are those of facets from this share of the area on.


def object_table_rows(record: Mapping[str, Any]) -> list[tuple[str, str]]:
    """(label, value) of everything there is to say of a whole object."""
    off, was_touched = deviation(record, "mean"), "touches" in record
    unknown = record.get("unknown_curvatures") or None
    how = many(record["touches"], "time", "times") if was_touched else _contacts(record)
    vertices = many(record["vertices"], "vertex", "vertices")
    triangles = many(record["triangles"], "triangle", "triangles")
    return _known(
        ("touched" if was_touched else "measured", f"{record['source']}, {how}"),
        ("verdict", verdict_of(record)),
        ("surface", _surface(record)),
        ("message", record["message"]),
        ("agreement", agreement(record)),
        ("facets", facets(record)),
        ("patches", f"{record['patches']}, of which {record['in_doubt']} alone would be in doubt"),
        ("edges of their graph", record["edges"]),
        ("tolerance", _length(record, "tolerance")),
        ("standard deviation of the height", units.say_of(record, record["height_std"])),
        ("distance from the mesh", off and f"mean {off}; largest {deviation(record, 'max')}"),
        ("largest distance at", place(record["deviation_place"], record) if off else None),
        ("surface's mesh", f"{vertices}, {triangles}, edges {_length(record, 'edge')}"),
        ("curvatures", unknown and f"unknown at {many(unknown, 'vertex', 'vertices')} beside edges and rims"),
    )


def verdict_of(record: Mapping[str, Any]) -> str:
    """The verdict on a whole object in a word: "Good", "Doubtful", "Incomplete" or "Outdated"."""
    if record["status"] in ("ok", "outdated"):
        return "Good" if record["status"] == "ok" else "Outdated"
    return "Incomplete" if record.get("uncovered") else "Doubtful"


def object_verdict(record: Mapping[str, Any]) -> str:
    """A sentence on whether a whole object is good, and what to do if it is not, as of a patch."""
    if record["status"] == "outdated":
        return "Outdated: touch it all over again"
    if record["doubts"]:
        return f"{verdict_of(record)}: {record['doubts'][0]['advice']}"
    if "within" not in record:
        return f"Good: heights to ± {units.say_of(record, record['height_std'])}"
    share = within(record["within"], record["deviation_max"] <= record["tolerance"])
    return f"Good: {share.lower()} of it is within {units.say_of(record, record['tolerance'])} of the mesh"


def object_reasons(record: Mapping[str, Any]) -> list[str]:
    """Sentences on what the verdict rests on."""
    return [*reasons(record), *filter(None, [agreement(record)])]


def is_all_within(record: Mapping[str, Any]) -> bool:
    """Whether the verdict is good, and no place is farther off the mesh than the tolerance."""
    return record["status"] == "ok" and record.get("deviation_max", 0.0) <= (record["tolerance"] or math.inf)


def agreement(record: Mapping[str, Any]) -> str | None:
    """How far surface and mesh agree, and how far they have to for a good verdict; None if that says nothing.

    So it is without a mesh, where touches could go on, and if the object has another shape now.
    """
    if "within" not in record or record["uncovered"] or record["status"] == "outdated":
        return None
    tolerance = record["tolerance"]
    share = within(record["within"], record["deviation_max"] <= tolerance)
    return (
        f"{share} of the surface is within the tolerance of {units.say_of(record, tolerance)}, and the "
        f"farthest place is {deviation(record, 'max')} off. "
        f"Good means at least {100.0 * WITHIN_SHARE:g} % within it, and none farther off than "
        f"{units.say_of(record, OFF_TOLERANCES * tolerance)}."
    )


def within(share: float, is_all: bool) -> str:
    """The share of the area within the tolerance in words; it is rounded down."""
    return "All" if is_all else f"{math.floor(1e3 * min(share, 0.999)) / 10.0:g} %"


def facets(record: Mapping[str, Any]) -> str | None:
    """A sentence if most curvatures are those of facets, as the verdict on a patch has it; or None."""
    share = record.get("faceted", 0.0)
    if share < FACETED:
        return None
    return f"Curvature of the facets, not of the shape, on {100.0 * share:.0f} % of the area"


def object_summary(record: Mapping[str, Any]) -> str:
    """A sentence on what was found of a whole object."""
    if "touches" in record:
        touches, off = many(record["touches"], "touch", "touches"), deviation(record, "mean")
        off = "" if record["uncovered"] else f"; {off} off the mesh on average"
        return f"{verdict_of(record)}: {touches}; {_surface(record)}{off}"
    patches = f"{many(record['patches'], 'patch', 'patches')} of {_contacts(record)}"
    height = units.say_of(record, record["height_std"])
    return f"{verdict_of(record)}: {patches}; {_surface(record)}; ± {height}"


def object_rows(record: Mapping[str, Any]) -> list[tuple[str, str]]:
    """(label, value) of each row in the panel."""
    return _known(
        ("Touches", record.get("touches")),
        ("Contacts", record.get("contacts")),
        # It is never "Closed" where touches could go on.
        ("Surface", "Closed" if record["is_closed"] else "Incomplete" if record.get("uncovered") else "Open"),
        ("Felt", within(record["felt"], False) if record.get("uncovered") else None),
        ("Tolerance", _length(record, "tolerance")),
        ("Height", f"± {units.say_of(record, record['height_std'])}"),
        # Where touches could go on, most of it would be the object that was not felt.
        ("Deviation", None if record.get("uncovered") else deviation(record, "mean")),
        ("Patches", record["patches"]),
        ("Edge Length", _length(record, "edge")),
        ("Vertices", record["vertices"]),
        ("Without Curvature", record.get("unknown_curvatures") or None),
    )


def _known(*rows: tuple[str, Any]) -> list[tuple[str, str]]:
    """The rows whose value is not None, in words."""
    return [(label, str(value)) for label, value in rows if value is not None]


def _contacts(record: Mapping[str, Any]) -> str:
    return many(record["contacts"], "contact", "contacts")


def _surface(record: Mapping[str, Any]) -> str:
    if record["is_closed"]:
        return "closed all round"
    if record.get("uncovered"):
        return f"{within(record['felt'], False)} of the object"
    return "open where the object ends" if record["status"] == "ok" else "open where nothing was felt"


def _length(record: Mapping[str, Any], key: str) -> str | None:
    """A length of the report in words, or None if it has none: measured contacts may choose the tolerance."""
    return units.say_of(record, record[key]) if record.get(key) else None


def deviation(record: Mapping[str, Any], what: str) -> str | None:
    """The mean or largest deviation from the mesh in words, or None if there was no mesh."""
    off = record.get(f"deviation_{what}")
    if off is None:
        return None
    return units.say_of(record, units.rounded(off, 1, record["size"]))
