# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What is said of a stability map, in the panel and in the shell."""

from ..touch import units
from ..touch.wording import table
from . import map_object
from .stability import REASONS


def map_readable(record):
    """Lines of label and value; lengths in the unit of the scene or file."""
    return table(map_table_rows(record))


def map_table_rows(record):
    """(label, value) of all that a map has to say."""
    refused = ", ".join(f"{key} {count}" for key, count in record["refused"].items())
    names = [key for key in record if key.endswith("_median")]
    return [
        ("touched", f"{record['source']}, at {record['touched']} of {record['points']} points"),
        ("patches", f"{record['patches']}, {record['in_doubt']} of them in doubt"),
        ("refused", refused),
        ("fit", f"{record['method']}, degree {record['degree']}"),
        ("spacing, extent, step", ", ".join(f"{record[k]:.4g}" for k in ("spacing", "extent", "step"))),
        *((f"median {name.removesuffix('_median')}", f"{record[name]:.4g}") for name in names),
    ]


def map_summary(record):
    """What a stability map has found, in a sentence."""
    words = [f"{record['patches']} patches at {record['touched']} points, {record['in_doubt']} in doubt"]
    words += [f"{count} refused by {key}" for key, count in record["refused"].items() if count]
    return "; ".join(words)


def map_rows(record, unit):
    """(label, value) of how many patches a stability map has, and why not more."""
    names = {key: f"No Patch: {name}" for key, name, _ in REASONS}
    return [
        ("Points", str(record["touched"])),
        ("Spacing", units.say(record["spacing"], 1, unit)),
        ("Patches", str(record["patches"])),
        ("… in Doubt", str(record["in_doubt"])),
        *((names[key], str(count)) for key, count in record["refused"].items() if count),
    ]


def median_rows(record, unit):
    """(label, value) of the medians over the patches of a stability map."""
    quantities = [(title, f"{name}_median", power) for name, title, _, power in map_object.SHOWN]
    return [(title, units.say(record[key], power, unit)) for title, key, power in quantities if key in record]
