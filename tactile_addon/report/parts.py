# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What the pages of patches and maps have in common: deviations, tolerance bands, settings, versions."""

import platform
import tomllib
from pathlib import Path

import bpy
import numpy as np

from ..scene.colors import symmetric_range
from ..touch import units
from . import drawing, page

SHARES = (0.005, 0.01, 0.02, 0.05)  # of the radius, or of the extent of a map
NORMAL_SHARES = ((1.0, 0.68), (2.0, 0.95), (3.0, 0.997))  # and what a normal distribution has within them
LEAST_RANGE = 1e-12
MANIFEST = Path(__file__).resolve().parents[2] / "blender_manifest.toml"


def spread(values, weights, unit, caption):
    """The histogram of lengths (n,)."""
    limit = symmetric_range(values, LEAST_RANGE)
    return page.figure(drawing.histogram(values, weights, limit, label(1, unit)), caption)


def shares_of(length, what):
    """Names and lengths of bands that are shares of a length."""
    return [(f"± {100.0 * share:g} % of the {what}", share * length) for share in SHARES]


def bands(values, weights, std, unit, reaches):
    """How much of the weights (n,) is within named lengths, and within so many standard deviations."""

    def row(name, reach, due=""):
        within = weights[np.abs(values) <= reach].sum() / weights.sum()
        return name, units.say(reach, 1, unit), f"{100.0 * within:.1f} %", due

    rows = [row(*reach) for reach in reaches]
    for count, due in NORMAL_SHARES:
        rows.append(
            row(
                f"± {count:g} standard deviation{'s' if count > 1.0 else ''}",
                count * std,
                f"{100.0 * due:g} %",
            )
        )
    return page.table(rows, ("band", "", "within it", "expected, if normal"))


def ending(rows, record):
    """What was found, as rows, and how: the sections at the end of a page."""
    return [
        page.section("What was found", page.table(rows)),
        page.section("Settings", page.table(_settings(record))),
        page.section("Versions", page.table(_versions())),
    ]


def label(power, unit):
    """What says a value of length^power."""
    return lambda value: units.say(value, power, unit) if value else "0"


def _settings(record):
    names = ("method", "degree", "tolerance", "most", "spacing", "extent", "step", "noise", "seed")
    rows = [
        (name, f"{record[name]:.4g}" if isinstance(record[name], float) else record[name])
        for name in names
        if name in record
    ]
    planes = [f"{azimuth:.0f}° leaning {tilt:.0f}°" for azimuth, tilt in record.get("planes", ())]
    return [*rows, *([("planes", ", ".join(planes))] if planes else [])]


def _versions():
    import scipy

    return [
        ("Tactile Patch", tomllib.loads(MANIFEST.read_text(encoding="utf-8"))["version"]),
        ("Blender", bpy.app.version_string),
        ("Python", platform.python_version()),
        ("numpy", np.__version__),
        ("scipy", scipy.__version__),
    ]


def corners(mesh):
    """The triangles of a mesh that has no other faces, (m, 3)."""
    indices = np.empty(len(mesh.loops), dtype=np.int32)
    mesh.loops.foreach_get("vertex_index", indices)
    return indices.reshape(-1, 3)


def vertex_areas(points, triangles):
    """A third of the area of the triangles (m, 3) at each of points (n, 3), (n,)."""
    a, b, c = (points[triangles[:, i]] for i in range(3))
    thirds = np.linalg.norm(np.cross(b - a, c - a), axis=1) / 6.0
    return np.bincount(triangles.ravel(), np.repeat(thirds, 3), len(points))
