# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Each room imports only from itself and from the rooms before it, and no imports form a circle."""

import ast
import re
from functools import cache
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
# The rooms of each package, in order. A module that is listed counts as a room; one that is in no room and
# not listed may import from all of them.
ROOMS = {
    "core": (
        "arguments",
        "lapack",
        "steps",
        "triangles",
        "verdict",
        "contours",
        "contact_data",
        "patch",
        "paper",
        "bayes",
        "reconstruction",
        "exploration",
        "atlas",
        "scan",
    ),
    "tactile_addon": (
        *("touch", "scene", "probes", "stability_map", "whole_object", "files", "comparison"),
        *("report", "viewport", "sidebar"),
    ),
    "cluster": ("extension", "data_set", "worker"),
}


def modules(package):
    """The dotted name, from the package on, and the path of each module; presets are scripts of Blender."""
    for path in sorted((ROOT / package).rglob("*.py")):
        if "presets" not in path.parts:
            yield ".".join(path.relative_to(ROOT).with_suffix("").parts), path


@cache
def imports(name, path):
    """Dotted names of all that a module imports relatively, anywhere in it."""
    inside, found = name.split("."), []
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and node.level:
            base = inside[: len(inside) - node.level] + (node.module.split(".") if node.module else [])
            for alias in node.names:
                full = [*base, alias.name]
                is_module = (ROOT.joinpath(*full).with_suffix(".py")).exists()
                found.append(".".join(full if is_module else base))
    return found


def floor(name):
    package, *rest = name.split(".")
    rooms = ROOMS[package]
    return rooms.index(rest[0]) if rest and rest[0] in rooms else len(rooms)


@pytest.mark.parametrize("package", ROOMS)
def test_no_import_goes_upward(package):
    upward = [
        (name, imported)
        for name, path in modules(package)
        for imported in imports(name, path)
        if imported.startswith(f"{package}.") and floor(imported) > floor(name)
    ]
    assert not upward


@pytest.mark.parametrize("package", ROOMS)
def test_no_import_goes_in_a_circle(package):
    graph = {name: set(imports(name, path)) for name, path in modules(package)}
    TopologicalSorter(graph).prepare()  # raises CycleError, with the circle


def test_core_knows_no_blender_and_the_add_on_none_of_its_rooms():
    for name, path in modules("core"):
        assert all(imported.startswith("core") for imported in imports(name, path)), name
        assert "bpy" not in path.read_text(encoding="utf-8").replace("without bpy", ""), name
    for name, path in modules("tactile_addon"):
        assert {found for found in imports(name, path) if "core" in found} <= {
            "core",
            "core.arguments",
            "core.contact_data",
            "core.contact_data.rows",
            "core.steps",
            "core.triangles",
        }, name


def test_what_is_shipped_knows_no_cluster():
    for package in ("core", "tactile_addon"):
        for name, path in modules(package):
            assert not any(imported.startswith("cluster") for imported in imports(name, path)), name
            assert not re.search(
                r"(import|from) (dask|distributed|pyarrow)", path.read_text(encoding="utf-8")
            ), name


def test_the_tree_for_contributors_is_that_of_the_files():
    tree = (ROOT / "docs" / "rooms.md").read_text(encoding="utf-8").split("```")[1]
    named = re.findall(r"^ +(\w+)/? ", tree, re.MULTILINE)
    there = [p.stem for package in ROOMS for _, p in modules(package) if p.name != "__init__.py"]
    rooms = [room for package, rooms in ROOMS.items() for room in rooms if (ROOT / package / room).is_dir()]
    assert sorted(named) == sorted([*there, *rooms, "presets"])
