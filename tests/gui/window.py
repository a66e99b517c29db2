# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Run in a window of Blender on the scene of make_scene.py, with the extension installed.

It checks what background runs cannot: the 3D cursor set by mouse, the entry of the Object menu, undo and
redo by keyboard, and what is seen. Two pictures are to be looked at: suzanne.png, and the window at the end,
which shows a scan where pear.ply is next to the scene.
"""

import os
import sys
from pathlib import Path

import bpy
import gui
from mathutils import Vector

sys.path.insert(0, str(Path(__file__).parent))
from common import check, data_blocks, look, until

FOLDER = Path(os.environ["GUI_SHOT"]).parent
OBJECT_MENU = 330, 40  # where its name is in a window 1280 wide


def source():
    """All of the touched object that a touch might change by mistake."""
    obj = bpy.data.objects["Suzanne"]
    return (
        [list(row) for row in obj.matrix_world],
        [tuple(vertex.co) for vertex in obj.data.vertices],
        [(modifier.type, modifier.levels) for modifier in obj.modifiers],
        obj.data.attributes.keys(),
        obj.data.materials.keys(),
    )


def choose_in_menu():
    """Opens the Object menu by mouse and finds the entry by typing, as the space bar allows."""
    gui.xdo("mousemove", *OBJECT_MENU, "sleep", 0.3, "click", 1, "sleep", 0.5, "key", "space", "sleep", 0.5)
    gui.xdo("type", "--delay", 100, "fit tactile")
    yield 1
    gui.xdo("key", "Return", "sleep", 1, "mousemove", 600, 400)
    yield from until(lambda: bpy.context.object is not None and "tactile" in bpy.context.object)


def check_patch(when, name):
    patch, cursor = bpy.context.object, bpy.context.scene.cursor.location
    good = patch is not None and patch.name == f"{name} Patch" and patch.select_get()
    if not check(f"{when}: the patch is the active object, selected", good, patch):
        return False
    found = bpy.data.collections.get("Tactile Patches")
    objects = found.objects.keys() if found else []
    check(f"{when}: the patch is in the collection", f"{name} Patch" in objects, objects)
    wanted = {"gaussian_curvature", "mean_curvature", "deviation", "curvature_color"}
    missing = wanted - set(patch.data.attributes.keys())
    check(f"{when}: the patch has its attributes", not missing, missing)
    color = patch.data.color_attributes.active_color
    check(f"{when}: its colors are active", color and color.name == "curvature_color", color)
    report = patch["tactile"].to_dict()
    check(f"{when}: it is one to trust", report["status"] == "ok", report["message"])
    distance = (patch.matrix_world.translation - cursor).length / report["radius"]
    check(f"{when}: it is at the 3D cursor", distance < 0.05, f"{distance:.3f} radii away")
    return True


def suzanne():
    cursor = bpy.context.scene.cursor
    place = cursor.location.copy()
    cursor.location = (0, 0, 0)
    bpy.ops.ed.undo_push(message="Start")
    look(place, (0.3, -1, 0.3), 5)
    yield 0.5
    at = [round(v) for v in gui.view_point(place)]
    gui.xdo("mousemove", *at, "sleep", 0.5, "keydown", "shift", "sleep", 0.5, "click", 3)
    yield from until(lambda: cursor.location.length > 0.0, 10)
    gui.xdo("keyup", "shift")
    yield 0.5
    distance = (cursor.location - place).length
    check("Shift and the right mouse button set the 3D cursor on the surface", distance < 0.02, distance)

    data, shape = data_blocks(), source()
    yield from choose_in_menu()
    if not check_patch("Object, Fit Tactile Patch", "Suzanne"):
        return
    check("... and the source is as it was", source() == shape, "it has changed")
    full = data_blocks()
    gui.xdo("key", "ctrl+z")
    yield 0.5
    check("Ctrl Z takes the patch and all its data away", data_blocks() == data, data_blocks())
    check("... and leaves the source as it was", source() == shape, "it has changed")
    check("... and active", bpy.context.object == bpy.data.objects["Suzanne"], bpy.context.object)
    gui.xdo("key", "ctrl+shift+z")
    yield 0.5
    check("Ctrl Shift Z brings it all back", data_blocks() == full, data_blocks())
    if not check_patch("Ctrl Shift Z", "Suzanne"):
        return
    axes = bpy.context.object.matrix_world
    look(axes.translation, axes.col[2].xyz + 0.5 * axes.col[0].xyz, 2)
    yield 2
    gui.shot(FOLDER / "suzanne.png")


def pear():
    """A scan some centimeters wide, in meters, the only object in the viewport."""
    for obj in bpy.data.objects:
        obj.hide_set(True)
    bpy.ops.wm.ply_import(filepath=str(FOLDER / "pear.ply"))
    scan = bpy.context.object
    scan.data.shade_smooth()
    center = sum((Vector(corner) for corner in scan.bound_box), Vector()) / 8
    _, bpy.context.scene.cursor.location, normal, _ = scan.ray_cast(center + Vector((0.1, 0, 0)), (-1, 0, 0))
    look(center, normal, 0.2)
    bpy.ops.ed.undo_push(message="Pear")
    yield 0.5
    yield from choose_in_menu()
    if check_patch("a scan, from the menu", "pear"):
        look(center, normal + Vector((0, -0.4, 0.5)), 0.12)
        yield 2


def steps():
    yield 1
    yield from suzanne()
    if (FOLDER / "pear.ply").exists():
        yield from pear()


gui.play(steps())
