# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Run in a window of Blender on the scene of make_scene.py: an automatic extent while a point is dragged.

It uses the scan of a pear where there is one, else Suzanne. Its pictures are next to the scene.
"""

import math
import sys
import time
from pathlib import Path

import bpy
import gui
from mathutils import Vector

sys.path.insert(0, str(Path(__file__).parent))
from common import ASIDE, FOLDER, check, extent, is_complete, look, open_tab, patch, picture, probe, until

SIDE, ACROSS = Vector((0.3, -1.0, 0.25)), 26  # where the view is from, and pixels of two moves
SLIDES = 12
BUSY = 1.5  # seconds


def target():
    """The name of the object to touch, the only one in the view."""
    file = FOLDER / "pear.ply"
    if not file.is_file():
        return "Suzanne"
    for obj in bpy.data.objects:
        obj.hide_set(True)
    bpy.ops.wm.ply_import(filepath=str(file))
    bpy.context.object.data.shade_smooth()
    return bpy.context.object.name


def below(obj, direction):
    """The center of an object, and where a ray against `direction` from outside first meets it."""
    corners = [obj.matrix_world @ Vector(corner) for corner in obj.bound_box]
    center, size = sum(corners, Vector()) / 8, max(obj.dimensions)
    hit, place, *_ = obj.ray_cast(
        obj.matrix_world.inverted() @ (center + 2.0 * size * direction.normalized()), -direction.normalized()
    )
    return center, obj.matrix_world @ place if hit else center


def reports():
    record = patch()["tactile"]
    return record["extent"], record["status"], bool(record["is_verified"])


def busy_click(place, how, start, *given, **options):
    """A click while Blender is busy makes a probe where the mouse was then, not where it is later."""
    window, area, region = gui.find()
    with bpy.context.temp_override(window=window, area=area, region=region):
        start(*given, **options)
    yield 1
    at = [round(v) for v in gui.view_point(place)]
    moves = (*("mousemove", at[0] - 40, at[1], "sleep", 0.2, "mousemove", *at, "sleep", 0.2), *("click", 1))
    gui.xdo(*moves, "sleep", 0.1, "mousemove", at[0] - 60, at[1] + 40)
    time.sleep(BUSY)
    yield 1
    yield from until(is_complete)
    off = math.dist(gui.view_point(probe().matrix_world.translation), at)
    check(f"a click with the {how} in a busy second is where the mouse was", off < 5, off)
    bpy.data.objects.remove(patch())
    bpy.data.objects.remove(probe())
    yield 1


def preview_click(place):
    """A click takes the touch that the preview has made, unless something has changed since."""
    operator, touches = bpy.types.TACTILE_OT_pick, []
    inner = operator._hover
    operator._hover = lambda self, *given: touches.append(given) or inner(self, *given)
    window, area, region = gui.find()
    x, y = (round(v) for v in gui.view_point(place))
    for changes, number in ((False, 0), (True, 1)):
        with bpy.context.temp_override(window=window, area=area, region=region):
            bpy.ops.tactile.pick("INVOKE_DEFAULT", True, new=True)
        gui.xdo("mousemove", x - 5, y, "sleep", 0.3, "mousemove", x, y)
        yield 2
        if changes:
            bpy.context.scene.frame_set(bpy.context.scene.frame_current + 1)
        touches.clear()
        gui.xdo("click", 1)
        yield 1
        yield from until(is_complete)
        words = "a click touches again if the scene has changed" if changes else "a click takes the preview"
        check(words, len(touches) == number and reports()[1] == "ok", (touches, reports()))
        bpy.data.objects.remove(patch())
        bpy.data.objects.remove(probe())
        yield 1
    operator._hover = inner


def steps():
    yield from open_tab()
    name = target()
    obj = bpy.data.objects[name]
    center, place = below(obj, SIDE)
    look(center, SIDE, 1.6 * max(obj.dimensions))
    yield 1
    yield from preview_click(place)
    yield from busy_click(place, "panel's button", bpy.ops.tactile.pick, "INVOKE_DEFAULT", new=True)
    yield from busy_click(place, "tool", bpy.ops.wm.tool_set_by_id, name="tactile.tool")
    window, area, region = gui.find()
    with bpy.context.temp_override(window=window, area=area, region=region):
        bpy.ops.wm.tool_set_by_id(name="builtin.select_box")
        bpy.ops.tactile.pick(target=name, location=place, new=True)
    yield 1
    yield from until(is_complete)
    first = reports()
    check("a pick chooses its extent", probe().tactile_probe.extent == 0.0 and first[1] == "ok", first)
    at = [round(v) for v in gui.view_point(probe().matrix_world.translation)]
    gui.xdo("mousemove", *at, "sleep", 0.3, "mousedown", 1, "sleep", 0.2)
    yield 0.5
    found = []
    for i in range(1, SLIDES + 1):
        gui.xdo("mousemove", at[0], at[1] - ACROSS * i // 2, "sleep", 0.25)
        yield 0.4
        found.append(reports())
        if i == SLIDES // 2:
            picture("sliding")
    picture("slid")
    print([f"{reach:.4g} {status}" for reach, status, _ in found], flush=True)
    extents = [reach for reach, *_ in found]
    check(
        "while the point is dragged no patch is in doubt", {status for _, status, _ in found} == {"ok"}, found
    )
    check("... what takes long waits for its end", not any(complete for *_, complete in found), found)
    size = probe().empty_display_size / extent(probe())
    check("... and the handles are as large as the patch", abs(size - 0.6) < 1e-3, size)
    gui.xdo("mouseup", 1)
    yield 1
    yield from until(is_complete)
    ended = reports()
    check("the end of the gesture completes it", ended[1:] == ("ok", True), ended)
    check(
        "... with the extent it had before", abs(ended[0] - extents[-1]) < 1e-6 * ended[0], (ended, extents)
    )
    picture("slid_ended")
    depsgraph = bpy.context.evaluated_depsgraph_get()
    before = ended[0]
    probe().tactile_probe.live = False
    gui.xdo("mousemove", *ASIDE)
    yield 0.5
    with bpy.context.temp_override(window=window, area=area, region=region):
        bpy.ops.tactile.update()  # a touch anew
    check(
        "... with the extent of a touch anew",
        abs(reports()[0] - before) < 1e-6 * before,
        (reports(), depsgraph),
    )


gui.play(steps())
