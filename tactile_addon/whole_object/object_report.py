# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What the panel and the shell say of a whole object."""

import bpy
import numpy as np

from ..touch import units
from ..touch.wording import many, table, vector


def unit_of(record):
    """The unit of a report, which has lengths from below the tolerance to far above it."""
    return units.unit_of(bpy.context.scene, 10.0 * (record["tolerance"] or record["height_std"]))


def object_readable(record):
    """Lines of label and value, with lengths in the unit of the scene or file."""
    return table(object_table_rows(record))


def object_table_rows(record):
    """(label, value) of everything there is to say of a whole object."""
    unit, off = unit_of(record), _off(record, "mean")
    how = (
        many(record["touches"], "time", "times") if "touches" in record else f"{record['contacts']} contacts"
    )
    return _known(
        ("touched" if "touches" in record else "measured", f"{record['source']}, {how}"),
        ("surface", _surface(record)),
        ("message", record["message"]),
        ("patches", f"{record['patches']}, {record['in_doubt']} of them in doubt"),
        ("edges of their graph", record["edges"]),
        ("tolerance", _tolerance(record)),
        ("height std", units.say(record["height_std"], 1, unit)),
        ("off the mesh", off and f"mean {off}; max {_off(record, 'max')}"),
        ("farthest at", _place(record)),
        ("mesh", f"{record['vertices']} vertices, {record['triangles']} triangles"),
        ("curvatures", _unknown(record)),
    )


def object_summary(record):
    """A sentence on what was found of a whole object."""
    std = units.say(record["height_std"], 1, unit_of(record))
    if "touches" in record:
        touches = many(record["touches"], "touch", "touches")
        return f"{touches}; {_surface(record)}; {_off(record, 'mean')} off on average"
    return f"{record['patches']} patches of {record['contacts']} contacts; {_surface(record)}; ± {std}"


def object_rows(record):
    """(label, value) of each row in the panel."""
    return _known(
        ("Touches", record.get("touches")),
        ("Contacts", record.get("contacts")),
        ("Surface", _ends(record)),
        ("Rims Left", record.get("uncovered")),
        ("Tolerance", _tolerance(record)),
        ("Height", f"± {units.say(record['height_std'], 1, unit_of(record))}"),
        ("Off Mesh", _off(record, "mean")),
        ("Farthest", _off(record, "max")),
        ("Patches", record["patches"]),
        ("… in Doubt", record["in_doubt"]),
        ("Vertices", record["vertices"]),
        ("… without K", record.get("unknown_curvatures") or None),
    )


def _known(*rows):
    """The rows whose value is not None, in words."""
    return [(label, str(value)) for label, value in rows if value is not None]


def _surface(record):
    if record["is_closed"]:
        return "closed all round"
    if record.get("uncovered"):
        return f"incomplete, with {many(record['uncovered'], 'place', 'places')} from which it could go on"
    return "open where nothing was felt"


def _ends(record):
    """In a word, whether the surface that is shown has no rim; never "Closed" where touches could go on."""
    return "Closed" if record["is_closed"] else "Incomplete" if record.get("uncovered") else "Open"


def _unknown(record):
    """Where the curvatures are unknown, in words, or None if they are known all over."""
    count = record.get("unknown_curvatures")
    return f"unknown at {many(count, 'vertex', 'vertices')} beside edges and rims" if count else None


def _tolerance(record):
    """The tolerance in words, or None if measured contacts have chosen it."""
    return units.say(record["tolerance"], 1, unit_of(record)) if record["tolerance"] else None


def _off(record, what):
    """The mean or largest deviation from the mesh in words, or None if there was no mesh."""
    off = record.get(f"deviation_{what}")
    return None if off is None else units.say(off, 1, unit_of(record))


def _place(record):
    """Where in the world the surface and the mesh are farthest apart, or None if that is unknown."""
    if "deviation_place" not in record:
        return None
    name, size = unit_of(record)
    return f"{vector(np.divide(record['deviation_place'], size))} {name}".rstrip()
