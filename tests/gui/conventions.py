# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Run in a window of Blender on the scene of make_scene.py: what users expect of any extension.

It checks search, menus, Adjust Last Operation, presets, grayed-out buttons, the tab and large letters. Every
step asserts on Blender's data and leaves a picture, to be looked at, next to the scene.
"""

import math
import sys
from pathlib import Path

import bpy
import gui
from mathutils import Vector

sys.path.insert(0, str(Path(__file__).parent))
from common import (
    ASIDE,
    PICK_BUTTON,
    check,
    consistent,
    data_blocks,
    drag,
    handle,
    is_complete,
    look,
    picture,
    probe,
    same,
    state,
    undo_redo,
    until,
)

# Places in a window of 1280 by 800 with the sidebar open.
MENU, HUD, HUD_EXTENT = (330, 40), (148, 703), (255, 450)
MOVE_BUTTON, AZIMUTH, ADD_BUTTON, REMOVE_BUTTON = (837, 128), (828, 226), (1001, 205), (1001, 226)
EXTENSION = "bl_ext.user_default.tactile_patch"


def picking():
    return any(operator.bl_idname == "TACTILE_OT_pick" for operator in bpy.context.window.modal_operators)


def search_and_menus():
    gui.xdo("mousemove", *ASIDE)
    yield 0.5
    window, area, region = gui.find()
    with bpy.context.temp_override(window=window, area=area, region=region):
        bpy.ops.wm.search_menu("INVOKE_DEFAULT")  # this is what F3 does, a key that Xvfb lacks
    yield 1
    gui.xdo("type", "--delay", 100, "pick reference")
    yield 1
    picture("search")
    gui.xdo("key", "Return", "sleep", 1, "mousemove", *ASIDE)
    yield from until(picking, 5)
    check("Menu Search finds Pick Reference Point", picking())
    gui.xdo("key", "Escape")
    yield 0.5
    gui.click(*MENU)
    yield 0.7
    gui.xdo("key", "Up", "sleep", 0.3, "key", "Right")
    yield 0.7
    picture("menu")
    gui.xdo("key", "Escape", "sleep", 0.3, "key", "Escape", "sleep", 0.3, "mousemove", *ASIDE)
    yield 0.5


def click_on(place):
    at = [round(v) for v in gui.view_point(place)]
    gui.xdo("mousemove", at[0] - 10, at[1], "sleep", 0.2, "mousemove", *at, "sleep", 0.5, "click", 1)
    yield 1


def adjust(place):
    """A pick whose extent is adjusted and saved as a preset is one step of undo."""
    before = data_blocks()
    gui.click(*PICK_BUTTON)
    yield 0.5
    yield from click_on(place)
    yield from until(is_complete)
    full, first = data_blocks(), state()
    gui.click(*HUD)
    yield 1.5
    gui.xdo("mousemove", *HUD_EXTENT, "sleep", 0.3, "click", "--repeat", 2, "--delay", 60, 1, "sleep", 0.4)
    gui.xdo("key", "ctrl+a", "sleep", 0.2, "type", "0.25")
    gui.xdo("key", "Return")
    yield from until(lambda: probe() is not None and abs(probe().tactile_probe.extent - 0.25) < 1e-5, 5)
    check("Adjust Last Operation touches again", not same(state(), first), state())
    check("... with what is typed", abs(probe().tactile_probe.extent - 0.25) < 1e-5)
    check("... and leaves no second probe", data_blocks() == full, data_blocks())
    consistent("adjusted")
    picture("adjust")
    operator = bpy.context.window_manager.operators[-1]
    window, area, region = gui.find()
    with bpy.context.temp_override(window=window, area=area, region=region, active_operator=operator):
        bpy.ops.wm.operator_preset_add(name="Short", operator="TACTILE_OT_pick")
    folders = bpy.utils.preset_paths("operator/tactile.pick")  # the extension's too
    (path,) = filter(Path.is_file, (Path(folder, "Short.py") for folder in folders))
    text = path.read_text()
    good = "op.extent = 0.25" in text and not any(f"op.{name}" in text for name in ("location", "target"))
    check("a preset has the numbers, and no place", good, text)
    gui.click(*HUD[:1], 285)
    yield 0.5
    yield from undo_redo("adjusted", None)
    check("... with all its data", data_blocks() == full and data_blocks() != before, data_blocks())


def gestures(place):
    """Each is one step of undo: another place, a number dragged, the whole probe turned, a plane more."""
    before = state()
    gui.click(*MOVE_BUTTON)
    yield 0.5
    yield from click_on(place)
    check("Move puts the probe elsewhere", (probe().location - place).length < 0.02, probe().location)
    check("... and makes no other", sum(obj.type == "EMPTY" for obj in bpy.data.objects) == 1)
    yield from undo_redo("moved by a pick", before)
    before = state()
    yield from drag(AZIMUTH, (AZIMUTH[0] + 40, AZIMUTH[1]))
    yield from until(is_complete)
    check("a number is dragged", probe().tactile_probe.azimuths[0] > 0.05, state())
    consistent("a number dragged")
    yield from undo_redo("a number dragged", before)
    before = state()
    at = [round(v) for v in gui.view_point(probe().location)]
    gui.xdo("mousemove", at[0] + 80, at[1], "sleep", 0.3, "key", "r", "sleep", 0.3)
    gui.xdo(
        "mousemove", at[0] + 70, at[1] + 40, "sleep", 0.5, "mousemove", at[0] + 60, at[1] + 60, "click", 1
    )
    yield 1
    yield from until(is_complete)
    check("R turns the whole probe", not same(state(), before), state())
    consistent("the probe turned")
    yield from undo_redo("the probe turned", before)
    before = state()
    gui.click(*ADD_BUTTON)
    yield 1
    yield from until(is_complete)
    check("a button adds the suggested plane", probe().tactile_probe.plane_count == 4)
    consistent("a plane more")
    picture("four")
    yield from undo_redo("a plane more", before)
    gui.click(*REMOVE_BUTTON)
    yield 1
    check("... and one takes a plane away", probe().tactile_probe.plane_count == 3)
    gui.xdo("mousemove", REMOVE_BUTTON[0] - 2, REMOVE_BUTTON[1], "sleep", 0.2, "mousemove", *REMOVE_BUTTON)
    yield 2
    picture("grayed")


def tab():
    preferences = bpy.context.preferences.addons[EXTENSION].preferences
    preferences.tab = "Feel"
    yield 0.5
    gui.sidebar("Feel")
    yield 1
    shown = gui.find("VIEW_3D", "UI")[2].active_panel_category
    check("the tab is named as the preferences say", shown == "Feel", shown)
    picture("tab")
    preferences.tab = "Tactile"
    yield 0.5
    gui.sidebar("Tactile")
    yield 1


def look_next_to_the_panel(point, direction, distance):
    """Does what look() does, with the point in the left third."""
    look(point, direction, distance)
    view = gui.find()[1].spaces.active.region_3d
    view.view_location = point + view.view_rotation @ Vector((0.3 * distance, 0.0, 0.0))


def large(place):
    """At twice the resolution scale, with the viewport filling the window, picks and handles still work."""
    window, area, region = gui.find()
    with bpy.context.temp_override(window=window, area=area, region=region):
        bpy.ops.screen.screen_full_area()
    bpy.context.preferences.view.ui_scale = 2.0
    yield 2
    look_next_to_the_panel(place, (0.3, -1, 0.3), 5)
    yield 0.5
    window, area, region = gui.find()
    with bpy.context.temp_override(window=window, area=area, region=region):
        bpy.ops.tactile.pick("INVOKE_DEFAULT", new=True)
    at = [round(v) for v in gui.view_point(place)]
    gui.xdo("mousemove", at[0] - 30, at[1], "sleep", 0.3, "mousemove", *at)
    yield 1
    picture("large_pick")
    gui.xdo("key", "Escape")
    yield 0.5
    axes = probe().matrix_world
    look_next_to_the_panel(axes.translation, axes.col[2].xyz + 0.3 * axes.col[1].xyz, 2.5)
    yield 0.5
    before, azimuth = state(), probe().tactile_probe.azimuths[2]
    start, end = (map(round, handle(azimuth + turn)) for turn in (0.0, 0.2))
    gui.xdo("mousemove", *start, "sleep", 0.3, "mousedown", 1, "sleep", 0.3, "mousemove", *end, "sleep", 0.4)
    yield from until(lambda: not same(state(), before), 10)
    check("large handles are dragged too", not same(state(), before), math.degrees(azimuth))
    picture("large_drag")
    gui.xdo("mouseup", 1)
    yield 1
    gui.xdo("mousemove", 1000, 500, *("click", 5, "sleep", 0.1) * 8)
    yield 1.5
    picture("large_result")
    gui.xdo("mousemove", 1000, 500, *("click", 5, "sleep", 0.1) * 8)
    yield 1.5


def steps():
    gui.sidebar()
    yield 1
    gui.sidebar("Tactile")
    yield 1
    place = bpy.context.scene.cursor.location.copy()
    look(place, (0.3, -1, 0.3), 5)
    yield 0.5
    yield from search_and_menus()
    yield from adjust(place)
    suzanne = bpy.data.objects["Suzanne"]
    eye = suzanne.evaluated_get(bpy.context.evaluated_depsgraph_get())
    _, aside, _, _ = eye.ray_cast((0.35, -5.0, 0.75), (0.0, 1.0, 0.0))
    yield from gestures(suzanne.matrix_world @ aside)
    yield from tab()
    yield from large(place)


gui.play(steps())
