# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Fixtures: a real Blender with the built zip installed, an empty scene; and the fuzz tests' profiles."""

import gc
import os
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings

from tools import blender

SHARED = Path(__file__).resolve().parents[2] / "shared" / "data" / "meshes"
DATA = Path(os.environ.get("TACTILE_SCANS", SHARED))  # benchmarks/SCANS.md says where they are from.

# The quick and short ones draw the same examples every time, so that no test fails by chance.
COMMON = {"deadline": None, "suppress_health_check": list(HealthCheck)}
settings.register_profile("quick", max_examples=15, derandomize=True, database=None, **COMMON)
settings.register_profile("short", max_examples=60, derandomize=True, database=None, **COMMON)
settings.register_profile("long", max_examples=2500, print_blob=True, **COMMON)
settings.load_profile("short")


def pytest_collection_finish():
    """Spares the collected tests from each search for garbage, which took a twentieth of the time."""
    gc.freeze()


@pytest.fixture(scope="session")
def extension():
    """The installed extension's module. TACTILE_ZIP names the zip, as `make test` sets it."""
    if "TACTILE_ZIP" not in os.environ:
        pytest.skip("TACTILE_ZIP does not name a built extension: run make test")
    return blender.start(os.environ["TACTILE_ZIP"])


@pytest.fixture
def empty(extension):
    """bpy, with nothing in the scene."""
    import bpy

    bpy.ops.wm.read_homefile(use_empty=True)
    return bpy


@pytest.fixture
def ball(empty):
    """A finely faceted sphere of radius 2, the active object."""
    from scenes import add_sphere

    return add_sphere(empty)


@pytest.fixture
def command(extension, capfd):
    """A function that runs the command with words and returns exit code, standard output and error."""

    def run(*words):
        try:
            code = extension.tactile_addon.command_line.main([str(word) for word in words])
        except SystemExit as ended:
            code = ended.code
        return code, *capfd.readouterr()

    return run


@pytest.fixture
def files(empty, ball, tmp_path):
    """A folder with the ball as .ply, .stl, .obj and .blend."""
    empty.ops.wm.ply_export(filepath=str(tmp_path / "ball.ply"))
    empty.ops.wm.stl_export(filepath=str(tmp_path / "ball.stl"))
    empty.ops.wm.obj_export(filepath=str(tmp_path / "ball.obj"), forward_axis="Y", up_axis="Z")
    empty.ops.wm.save_as_mainfile(filepath=str(tmp_path / "ball.blend"))
    return tmp_path


@pytest.fixture(scope="session")
def scans():
    """The folder of real scans."""
    if not DATA.is_dir():
        pytest.skip("the scans are not here: benchmarks/SCANS.md")
    return DATA
