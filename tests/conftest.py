# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Fixtures: a real Blender with the built zip installed, and an empty scene in it."""

import os
from pathlib import Path

import pytest

from tools import blender

DATA = Path(__file__).resolve().parents[2] / "shared" / "data" / "meshes"


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


@pytest.fixture(scope="session")
def scans():
    """The folder of real scans."""
    if not DATA.is_dir():
        pytest.skip("the real scans of ../shared/data are not here")
    return DATA
