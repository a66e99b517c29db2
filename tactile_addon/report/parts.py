# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What pages have in common: views of a mesh, deviations, tolerance bands, settings and versions."""

import math
import platform
import tomllib
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import bpy
import numpy as np

from ...core.triangles import triangle_cross
from ..scene.colors import symmetric_range
from ..scene.mesh_data import POSITION, corners_of, values
from ..touch import units
from ..touch.evaluated_mesh import read_array
from ..touch.types import Array
from . import page

SHARES = (0.005, 0.01, 0.02, 0.05)  # The bands, as shares of the radius of a patch or the extent of a map.
# Deviations, and a normal distribution's share within.
NORMAL_SHARES = ((1.0, 0.68), (2.0, 0.95), (3.0, 0.997))
LEAST_RANGE = 1e-12
WORDS = {"most": "most touches"}  # Settings whose names are no words.
CHOSEN = ("spacing", "extent", "step")  # Of these lengths, 0 has the surface choose.
LENGTHS = (*CHOSEN, "tolerance", "noise")
DARKEST = 0.45  # Where the surface turns away, it is this bright.
CELLS = 64  # Vertices in one of so many cells along the longest side are drawn as one: a picture is small.
MANIFEST = Path(__file__).resolve().parents[2] / "blender_manifest.toml"
# Words, the axes to the right and up, the axis of sight and its sign toward the viewer.
VIEWS = (
    ("from the front", (0, 2), 1, -1.0),
    ("from the right", (1, 2), 0, 1.0),
    ("from above", (0, 1), 2, 1.0),
)


def deviations(
    off: Array,
    weights: Array,
    std: float,
    record: Mapping[str, Any],
    reaches: Sequence[tuple[str, float]],
    caption: str,
) -> list[str]:
    """The sections with a histogram of lengths (n,), with weights (n,), and their shares within bands."""
    limit = symmetric_range(off, LEAST_RANGE)
    picture = page.figure(page.histogram(off, weights, limit, label(1, record)), caption)
    table = bands(off, weights, std, record, reaches)
    return [page.section("Deviations", picture), page.section("Tolerance bands", table)]


def shares_of(length: float, what: str) -> list[tuple[str, float]]:
    """The names and lengths of the bands that are shares of a length."""
    return [(f"± {100.0 * share:g} % of the {what}", share * length) for share in SHARES]


def bands(
    off: Array, weights: Array, std: float, record: Mapping[str, Any], reaches: Sequence[tuple[str, float]]
) -> str:
    """The shares of the weights (n,) within named lengths, and within one to three standard deviations."""

    def row(name: str, reach: float, due: str = "") -> tuple[str, ...]:
        is_within = np.abs(off) <= reach
        share = 1.0 if is_within.all() else weights[is_within].sum() / weights.sum()
        # It is rounded down: only all of it is 100 %.
        return name, units.say_of(record, reach), f"{math.floor(1e3 * share + 1e-9) / 10.0:.1f} %", due

    rows = [row(*reach) for reach in reaches]
    rows += [
        row(f"± {count:g} standard deviation{'s' if count > 1.0 else ''}", count * std, f"{100.0 * due:g} %")
        for count, due in NORMAL_SHARES
    ]
    return page.table(rows, ("band", "", "within it", "expected, if normal"))


def ending(rows: Iterable[tuple[str, str]], record: Mapping[str, Any]) -> list[str]:
    """The sections at the end of a page: what was found, as rows, and how."""
    return [
        page.section("What was found", page.table(rows)),
        page.section("Settings", page.table(_settings(record))),
        page.section("Versions", page.table(_versions())),
    ]


def label(power: int, record: Mapping[str, Any]) -> Callable[[float], str]:
    """A function that gives a value in length^power in words."""
    return lambda value: units.say_of(record, value, power) if value else "0"


def _settings(record: Mapping[str, Any]) -> list[tuple[str, str]]:
    """(label, value) of the settings that a record has."""
    names = ("method", "degree", "tolerance", "most", "spacing", "extent", "step", "noise", "seed")
    rows = [(WORDS.get(name, name), _setting(name, record)) for name in names if name in record]
    planes = [f"{azimuth:.0f}° leaning {tilt:.0f}°" for azimuth, tilt in record.get("planes", ())]
    return [*rows, *([("planes", ", ".join(planes))] if planes else [])]


def _setting(name: str, record: Mapping[str, Any]) -> str:
    value = record[name]
    if name in CHOSEN and not value:
        return "auto"
    return units.say_of(record, value) if name in LENGTHS else str(value)


def _versions() -> list[tuple[str, str]]:
    """(name, version) of the programs behind a page."""
    import scipy

    return [
        ("Tactile Patch", tomllib.loads(MANIFEST.read_text(encoding="utf-8"))["version"]),
        ("Blender", bpy.app.version_string),
        ("Python", platform.python_version()),
        ("numpy", np.__version__),
        ("scipy", scipy.__version__),
    ]


def vertex_areas(mesh: bpy.types.Mesh) -> Array:
    """A third of the area (n,) of the triangles at each vertex of a mesh that has no other faces."""
    triangles = corners_of(mesh)
    thirds = np.linalg.norm(triangle_cross(values(mesh, POSITION)[triangles]), axis=1) / 6.0
    return np.bincount(triangles.ravel(), np.repeat(thirds, 3), len(mesh.vertices))


def three_sides(mesh: bpy.types.Mesh, colors: Array) -> Iterator[str]:
    """Three figures of the mesh, in sRGB colors (n, 3 or 4) of its face corners."""
    points, corners, found = _coarse(mesh, colors[:, :3])
    normals = triangle_cross(points[corners])
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300)
    for words, axes, sight, sign in VIEWS:
        # Shading shows the shape where colors are pale. What is nearer is drawn later.
        light = DARKEST + (1.0 - DARKEST) * np.abs(normals[:, sight, None])
        order = np.argsort(sign * points[corners, sight].mean(axis=1))
        yield page.figure(page.triangles(points[:, axes], corners[order], (light * found)[order]), words)


def _coarse(mesh: bpy.types.Mesh, colors: Array) -> tuple[Array, Array, Array]:
    """Points (n, 3) of vertices that are one in a cell, triangles (m, 3) between these, and colors (m, 3)."""
    mesh.calc_loop_triangles()
    places = values(mesh, POSITION)
    size = np.ptp(places, axis=0).max() / CELLS or 1.0
    _, first, cell = np.unique(np.rint(places / size), axis=0, return_index=True, return_inverse=True)
    corners = cell.ravel()[read_array(mesh.loop_triangles, "vertices", 3, np.int32)]
    found = colors[read_array(mesh.loop_triangles, "loops", 3, np.int32)].mean(axis=1)
    kept = (corners != np.roll(corners, 1, axis=1)).all(axis=1)
    return places[first], corners[kept], found[kept]
