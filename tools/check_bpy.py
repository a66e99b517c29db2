# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Import Blender's module once, and say in one sentence which system library it lacks."""

import re
import sys

# What bpy 4.5 and 5.2 load from the system, as Debian and Ubuntu name it; a desktop has all of it.
PACKAGES = "libgl1 libsm6 libxfixes3 libxi6 libxkbcommon0 libxrender1"

try:
    import bpy  # noqa: F401
except ImportError as error:
    missing = re.match(r"(\S+\.so\S*): cannot open shared object file", str(error))
    if not missing:
        raise
    sys.exit(f"Blender needs the system library {missing[1]}: sudo apt install {PACKAGES}")
