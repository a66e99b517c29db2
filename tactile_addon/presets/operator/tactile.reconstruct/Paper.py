# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The preset of Pick Reference Point; Blender keeps those of each operator apart."""

from pathlib import Path

from bpy.utils import execfile

execfile(str(Path(__file__).parents[1] / "tactile.pick" / Path(__file__).name))
