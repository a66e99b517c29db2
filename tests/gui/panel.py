# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Run in a window of Blender on the scene of make_scene.py: what the panel shows of a first result.

These are colors at once, a verdict, and numbers with what they mean. It also checks what freezes or hides a
patch, a point of a map, the tool of the toolbar, and what is said when a large mesh is touched first.
"""

import sys
from pathlib import Path

import bpy
import gui
from mathutils import Vector

sys.path.insert(0, str(Path(__file__).parent))
from common import PICK_BUTTON, check, is_complete, last_report, look, open_tab, patch, picture, probe, until

# Places in a window of 1280 by 800 with the sidebar open.
NUMBER, SENSOR = (790, 420), (840, 321)
CONTOURS, HANDLES, MAP_PROBE = (813, 493), (972, 493), (893, 284)


def probes():
    return [obj for obj in bpy.data.objects if obj.type == "EMPTY"]


def activate(obj):
    for one in bpy.context.view_layer.objects:
        one.select_set(one == obj)
    bpy.context.view_layer.objects.active = obj


def look_at_cursor():
    look(bpy.context.scene.cursor.location + Vector((0.2, 0.0, -0.1)), (0.3, -1.0, 0.5), 1.7)


def first():
    space = gui.find()[1].spaces.active
    place = bpy.context.scene.cursor.location
    look_at_cursor()
    space.shading.color_type = "MATERIAL"
    yield 0.5
    picture("panel_empty")
    at = [round(v) for v in gui.view_point(place)]
    gui.click(*PICK_BUTTON)
    yield 0.5
    gui.xdo("mousemove", at[0] - 10, at[1], "sleep", 0.2, "mousemove", *at, "sleep", 0.5, "click", 1)
    yield from until(is_complete)
    picture("panel_first")
    said = last_report()
    check("a pick says the verdict, short", said.startswith("Good") and len(said) < 60, said)
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


def refused():
    """Where there can be no touch, words next to the mouse say why, and a click does not end the pick."""
    bpy.ops.object.metaball_add(type="BALL", radius=1.0, location=(0.0, 0.0, 0.5))
    ball = bpy.context.object
    ball.name = "Metaball Whose Name Takes Two Lines"
    others = [obj for obj in bpy.data.objects if obj != ball and obj.visible_get()]
    for obj in others:
        obj.hide_set(True)
    activate(ball)
    look(Vector((0.0, 0.0, 0.5)), (1.0, 0.1, 1.0), 4.0)
    yield 0.5
    before = set(bpy.data.objects)
    gui.click(*PICK_BUTTON)
    yield 0.5
    x, y = (round(v) for v in gui.view_point((0.0, 0.0, 0.5)))
    gui.xdo("mousemove", x - 20, y + 9, "sleep", 0.3, "mousemove", x, y)
    yield 1
    picture("panel_refused")
    gui.xdo("click", 1)
    yield 1
    picture("panel_refused_click")
    check("a click where no touch is possible makes nothing", set(bpy.data.objects) == before, before)
    picks = any(op.bl_idname == "TACTILE_OT_pick" for op in bpy.context.window.modal_operators)
    check("... and the pick goes on", picks)
    gui.xdo("key", "Escape")
    yield 0.5
    bpy.data.objects.remove(ball)
    for obj in others:
        obj.hide_set(False)
    activate(bpy.data.objects["Suzanne"])
    bpy.ops.object.mode_set(mode="SCULPT")
    yield 0.5
    picture("panel_sculpt")
    bpy.ops.object.mode_set(mode="OBJECT")
    look_at_cursor()


def numbers():
    """Numbers are not dragged here, as Blender then takes the pointer back, and xdotool moves it away."""
    settings = probe().tactile_probe
    settings.live = False
    gui.click(*SENSOR)
    yield 1
    picture("panel_frozen")
    settings.live = True
    gui.click(*SENSOR)
    yield from until(is_complete)


def toggled(place, reached):
    """Presses a button once the mouse is known to be over it."""
    gui.xdo("mousemove", place[0] - 5, place[1], "sleep", 0.3, "mousemove", *place)
    yield 0.7
    gui.click(*place)
    yield from until(reached, 10)


def hidden():
    settings = probe().tactile_probe
    yield from toggled(CONTOURS, lambda: not patch().tactile_contours)
    check("a button hides the contours", not patch().tactile_contours)
    yield from toggled(HANDLES, lambda: not settings.show_handles)
    check("... and one the handles", not settings.show_handles)
    picture("panel_hidden")
    settings.azimuths[0] += 0.01
    yield from until(is_complete)
    yield from toggled(CONTOURS, lambda: patch().tactile_contours)
    yield from toggled(HANDLES, lambda: settings.show_handles)
    check("... and they come back", patch().tactile_contours and settings.show_handles)


def on_map():
    source = bpy.data.objects["Suzanne"]
    place, before = bpy.context.scene.cursor.location, probes()
    bpy.ops.tactile.stability_map("EXEC_DEFAULT", target=source.name, extent=0.3)
    spacing = bpy.context.view_layer.objects.active["tactile_map"]["spacing"]
    source.hide_set(True)
    yield 1
    picture("panel_map")
    gui.click(*MAP_PROBE)
    yield 0.5
    at = [round(v) for v in gui.view_point(place)]
    gui.xdo("mousemove", at[0] - 10, at[1], "sleep", 0.2, "mousemove", *at, "sleep", 0.5, "click", 1)
    yield from until(lambda: len(probes()) > len(before))
    (made,) = set(probes()) - set(before)
    settings = made.tactile_probe
    check("a click on a map makes a probe on what it shows", settings.target == source, settings.target)
    check("... with the map's inputs", abs(settings.extent - 0.3) < 1e-6, settings.extent)
    # It is at the point of the map that is nearest to the click, so that it finds what the map shows.
    off = (made.matrix_world.translation - place).length
    check("... there", off < spacing + 0.03, (off, spacing))
    source.hide_set(False)


def with_tool():
    window, area, region = gui.find()
    place, count = bpy.context.scene.cursor.location, len(probes())
    activate(bpy.data.objects["Suzanne"])
    with bpy.context.temp_override(window=window, area=area, region=region):
        bpy.ops.wm.tool_set_by_id(name="tactile.tool")
    yield 1
    at = [round(v) for v in gui.view_point(place)]
    gui.click(at[0] + 60, at[1])
    yield from until(lambda: len(probes()) > count)
    check("a click with the tool touches there", len(probes()) == count + 1, probes())
    picture("panel_tool")
    with bpy.context.temp_override(window=window, area=area, region=region):
        bpy.ops.wm.tool_set_by_id(name="builtin.select_box")


def large():
    """The header names a large mesh before its first touch, which takes a while."""
    for obj in bpy.data.objects:
        obj.hide_set(True)
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=700, y_subdivisions=700, size=2.0)
    mesh, before = bpy.context.object, probes()
    look(Vector((0.0, 0.0, 0.0)), (0.0, -1.0, 1.0), 3.0)
    yield 3
    at = [round(v) for v in gui.view_point(Vector((0.0, 0.0, 0.0)))]
    gui.click(*PICK_BUTTON)
    yield 1
    picture("panel_large")
    gui.xdo("mousemove", at[0] - 10, at[1], "sleep", 1, "mousemove", *at, "sleep", 1, "click", 1)
    yield from until(lambda: len(probes()) > len(before))
    (made,) = set(probes()) - set(before)
    check("a click touches a large mesh", made.tactile_probe.target == mesh, made.tactile_probe.target)


def steps():
    yield from open_tab()
    yield from first()
    yield from refused()
    activate(probe())
    yield 1
    yield from numbers()
    yield from hidden()
    yield from on_map()
    yield from with_tool()
    yield from large()


gui.play(steps())
