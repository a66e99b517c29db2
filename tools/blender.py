# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender as a Python module with the built extension installed in it, as its users install it.

Import this module before bpy, because bpy reads once, on import, where the folder of the user's files is:
this module replaces that by a folder of the project's.
"""

import atexit
import importlib
import os
import sys
from contextlib import contextmanager
from pathlib import Path

BUILD = Path(__file__).resolve().parents[1] / "build"
# Tests that run at the same time each have their own Blender.
RESOURCES = BUILD / ("blender-{}.{}".format(*sys.version_info) + os.environ.get("PYTEST_XDIST_WORKER", ""))
os.environ["BLENDER_USER_RESOURCES"] = str(RESOURCES)


@atexit.register
def _end_silently():
    """Drops what Blender's libraries print of their memory when a process is over, after all its results."""
    if "bpy" in sys.modules:
        sys.stderr.flush()
        with open(os.devnull, "w") as nowhere:
            os.dup2(nowhere.fileno(), 2)


@contextmanager
def quiet():
    """Within this context, what Blender itself prints does not reach standard output."""
    sys.stdout.flush()
    output = os.dup(1)
    with open(os.devnull, "w") as nowhere:
        os.dup2(nowhere.fileno(), 1)
    try:
        yield
    finally:
        os.dup2(output, 1)
        os.close(output)


@quiet()
def start(extension):
    """Installs and enables the zip `extension` in Blender and returns the extension's module."""
    import bpy

    bpy.ops.extensions.package_install_files(
        filepath=str(Path(extension).resolve()), repo="user_default", enable_on_install=True
    )
    return importlib.import_module("bl_ext.user_default.tactile_patch")
