# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A first result in a window as it comes: colors at once, a verdict, numbers with what they mean."""

import sys
from pathlib import Path

import bpy
import gui
from mathutils import Vector

sys.path.insert(0, str(Path(__file__).parent))
from common import PICK_BUTTON, check, is_complete, look, open_tab, picture, until

NUMBER = (835, 500)


def steps():
    yield from open_tab()
    space = gui.find()[1].spaces.active
    place = bpy.context.scene.cursor.location
    look(place + Vector((0.2, 0.0, -0.1)), (0.3, -1.0, 0.5), 1.7)
    space.shading.color_type = "MATERIAL"
    yield 0.5
    at = [round(v) for v in gui.view_point(place)]
    gui.click(*PICK_BUTTON)
    yield 0.5
    gui.xdo("mousemove", at[0] - 10, at[1], "sleep", 0.2, "mousemove", *at, "sleep", 0.5, "click", 1)
    yield from until(is_complete)
    picture("panel_first")
    check(
        "a pick has the viewport show colors", space.shading.color_type == "VERTEX", space.shading.color_type
    )
    gui.xdo("mousemove", *NUMBER)
    yield 2
    picture("panel_tip")
    gui.click(*NUMBER)
    yield 0.5
    copied = bpy.context.window_manager.clipboard
    check("a click on the name of a number copies it", " ± " in copied and copied.endswith("1/m"), copied)


gui.play(steps())
