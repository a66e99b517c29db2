# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Run in a window of Blender on the scene of make_scene.py: the pictures of docs/viewport.md, taken anew.

They are next to the scene: pick.jpg, probe.jpg and deviation.jpg. verify.py and stability.py take
verify.jpg and stability.jpg.
"""

import math
import sys
from pathlib import Path

import bpy
import gui
from mathutils import Vector

sys.path.insert(0, str(Path(__file__).parent))
from common import PICK_BUTTON, handle, is_complete, look, open_tab, patch, picture_of_docs, probe, until


def steps():
    yield from open_tab()
    place = bpy.context.scene.cursor.location
    bpy.data.objects["Suzanne"].data.shade_smooth()
    gui.find()[1].spaces.active.overlay.show_cursor = False
    look(place + Vector((0.2, 0.0, -0.1)), (0.3, -1.0, 0.5), 1.7)
    yield 0.5
    at = [round(v) for v in gui.view_point(place)]
    gui.click(*PICK_BUTTON)
    yield 0.5
    gui.xdo("mousemove", at[0] - 10, at[1], "sleep", 0.2, "mousemove", *at)
    yield 1
    picture_of_docs("pick")
    gui.xdo("click", 1)
    yield from until(is_complete)
    start, end = (map(round, handle(math.radians(azimuth))) for azimuth in (60.0, 40.0))
    gui.xdo("mousemove", *start, "sleep", 0.3, "mousedown", 1, "sleep", 0.3, "mousemove", *end)
    yield from until(lambda: probe().tactile_probe.azimuths[1] < math.radians(45.0), 10)
    yield 1
    picture_of_docs("probe")
    gui.xdo("mouseup", 1)
    yield from until(is_complete)
    patch().tactile_colors = "height_std"
    gui.xdo("mousemove", 300, 640)
    yield 3
    picture_of_docs("deviation")


gui.play(steps())
