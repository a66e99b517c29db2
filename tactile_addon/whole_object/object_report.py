# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What is said of a whole object that was touched, in the panel and in the shell."""

import bpy

from ..touch import units
from ..touch.wording import table


def unit_of(record):
    """The unit for what there is to say: lengths from below the tolerance to far above."""
    return units.unit_of(bpy.context.scene, 10.0 * record["tolerance"])


def object_readable(record):
    """Lines of label and value; lengths in the unit of the scene or file."""
    return table(object_table_rows(record))


def object_table_rows(record):
    """(label, value) of all that a whole object has to say."""
    unit = unit_of(record)
    return [
        ("touched", f"{record['source']}, {record['touches']} times"),
        ("surface", _surface(record)),
        ("patches", f"{record['patches']}, {record['in_doubt']} of them in doubt"),
        ("edges of their graph", str(record["edges"])),
        ("tolerance", units.say(record["tolerance"], 1, unit)),
        ("height std", units.say(record["height_std"], 1, unit)),
        ("off the mesh", f"mean {_off(record, 'mean', unit)}; max {_off(record, 'max', unit)}"),
        ("mesh", f"{record['vertices']} vertices, {record['triangles']} triangles"),
    ]


def object_summary(record):
    """What touches all over an object have found, in a sentence."""
    unit = unit_of(record)
    return f"{record['touches']} touches; {_surface(record)}; {_off(record, 'mean', unit)} off on average"


def object_rows(record):
    """(label, value) for the panel."""
    unit = unit_of(record)
    return [
        ("Touches", str(record["touches"])),
        ("Surface", "Closed" if record["is_closed"] else "Open"),
        ("Rims Left", str(record["uncovered"])),
        ("Tolerance", units.say(record["tolerance"], 1, unit)),
        ("Height", f"± {units.say(record['height_std'], 1, unit)}"),
        ("Off Mesh", _off(record, "mean", unit)),
        ("Farthest", _off(record, "max", unit)),
        ("Patches", str(record["patches"])),
        ("… in Doubt", str(record["in_doubt"])),
        ("Vertices", str(record["vertices"])),
    ]


def _surface(record):
    if record["is_closed"]:
        return "closed all round"
    if record["uncovered"]:
        return f"open, with {record['uncovered']} places from which it could go on"
    return "open where no patch could be felt"


def _off(record, what, unit):
    return units.say(record[f"deviation_{what}"], 1, unit)
