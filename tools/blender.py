# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender as a Python module with the built extension installed in it, as its users install it.

To be imported before bpy, which reads the folder of the user's files once, on import: the project's
own stands in for the user's.
"""

import importlib
import os
import sys
from pathlib import Path

BUILD = Path(__file__).resolve().parents[1] / "build"
RESOURCES = BUILD / "blender-{}.{}".format(*sys.version_info)
os.environ["BLENDER_USER_RESOURCES"] = str(RESOURCES)


def start(extension):
    """Installs and enables the zip `extension` in Blender and returns the extension's module."""
    import bpy

    bpy.ops.extensions.package_install_files(
        filepath=str(Path(extension).resolve()), repo="user_default", enable_on_install=True
    )
    return importlib.import_module("bl_ext.user_default.tactile_patch")
