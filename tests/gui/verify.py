# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Run in a window of Blender on the scene of make_scene.py: a patch verified against meshes, by mouse.

It checks the button of the panel, undo and redo by keyboard, another mesh by selection and the Object menu;
progress and Esc on a large mesh, of registration too. Pictures show the table at 100 and at 200 % resolution
scale.
"""

import sys
from pathlib import Path

import bpy
import gui
import numpy as np
from mathutils import Matrix

sys.path.insert(0, str(Path(__file__).parent))
from common import FOLDER, check, data_blocks, last_report, look, open_tab, picture, picture_of_docs, until

# Places in a window of 1280 by 800 with the sidebar open.
BUTTON, OBJECT_MENU, ASIDE = (893, 407), (330, 40), (300, 180)
TABLE = "verification"


def patch():
    return next((obj for obj in bpy.data.objects if "tactile" in obj), None)


def found():
    record = patch()["tactile"] if patch() else {}
    return record[TABLE].to_dict() if TABLE in record else {}


def activate(obj, *others):
    for one in bpy.context.view_layer.objects:
        one.select_set(one in (obj, *others))
    bpy.context.view_layer.objects.active = obj


def press(key):
    gui.xdo("mousemove", *ASIDE, "sleep", 0.2, "key", key)
    yield 1


def by_button():
    bpy.ops.tactile.reconstruct("EXEC_DEFAULT", True, target="Suzanne", extent=0.3, noise=0.002)
    axes = patch().matrix_world
    look(axes.translation, axes.col[2].xyz + 0.5 * axes.col[0].xyz, 2)
    yield 1
    picture("verify_before")
    gui.click(*BUTTON)
    yield from until(lambda: bool(found()), 10)
    check(
        "the button verifies against the mesh that was touched", found().get("target") == "Suzanne", found()
    )
    check("... with nine contours more", found().get("extra_contours") == 9, found())
    check("... all over it", found().get("overlap") == 1.0, found())
    yield 1  # the panel below moves down
    picture("verify_table")
    yield from press("ctrl+z")
    check("one Ctrl Z takes the table away", patch() is not None and not found(), found())
    yield from press("ctrl+shift+z")
    check("Ctrl Shift Z brings it again", found().get("target") == "Suzanne", found())


def another_mesh():
    other = bpy.data.objects["Suzanne"].copy()
    other.name = "Scan"
    bpy.context.scene.collection.objects.link(other)
    other.matrix_world = Matrix.Translation(0.05 * patch().matrix_world.col[2].xyz) @ other.matrix_world
    activate(patch(), other)
    bpy.ops.ed.undo_push(message="Scan")
    yield 1
    # The space bar searches in the Object menu.
    gui.xdo("mousemove", *OBJECT_MENU, "sleep", 0.3, "click", 1, "sleep", 0.5, "key", "space", "sleep", 0.5)
    gui.xdo("type", "--delay", 100, "verify against")
    yield 1
    picture("verify_search")
    gui.xdo("key", "Return", "sleep", 1, "mousemove", *ASIDE)
    yield from until(lambda: found().get("target") == "Scan", 10)
    check(
        "the Object menu has it, and the other selected mesh is the one",
        found().get("target") == "Scan",
        found(),
    )
    off = found().get("vertex_distance_median", 0.0)
    check("... which is off by as much as it was moved", abs(off - 0.05) < 0.01, off)
    check("... and in doubt, in the status bar too", "off the patch" in last_report(), last_report())
    picture("verify_doubt")
    bpy.data.objects.remove(other)


def running(name):
    windows = bpy.context.window_manager.windows
    return any(op.bl_idname == f"TACTILE_OT_{name}" for w in windows for op in w.modal_operators)


def is_said():
    """Whether the status bar says what is going on: Blender's own drawing of it is replaced."""
    from bl_ui.space_statusbar import STATUSBAR_HT_header as bar

    return not bar.draw.__module__.startswith("bl_ui")


def press_button(name, **inputs):
    window, area, region = gui.find()
    with bpy.context.temp_override(window=window, area=area, region=region):
        getattr(bpy.ops.tactile, name)("INVOKE_DEFAULT", True, **inputs)


def large():
    """A sheet of a million faces with a patch over a good part of it, verified and put onto it again."""
    bpy.data.objects.remove(patch())
    bpy.data.objects["Suzanne"].hide_set(True)
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=1000, y_subdivisions=1000, size=2.0, location=(0, 0, 0))
    sheet = bpy.context.object
    co = np.empty((len(sheet.data.vertices), 3), dtype=np.float32)
    sheet.data.vertices.foreach_get("co", co.ravel())
    co[:, 2] = 0.3 * np.sin(2.0 * co[:, 0]) * np.cos(1.5 * co[:, 1])
    sheet.data.vertices.foreach_set("co", co.ravel())
    sheet.data.update()
    bpy.ops.tactile.reconstruct("EXEC_DEFAULT", True, target="Grid", location=(0.1, 0.1, 0.0), extent=0.6)
    axes = patch().matrix_world.copy()
    look(axes.translation, axes.col[2].xyz + 0.5 * axes.col[0].xyz, 4)
    bpy.ops.ed.undo_push(message="Large")
    yield 1
    before, record = data_blocks(), patch()["tactile"].to_dict()
    press_button("verify")
    yield from until(is_said, 10)
    check("verifying on a million faces is under way, and says so", running("verify") and is_said())
    picture("verify_progress")
    gui.xdo("mousemove", *ASIDE, "sleep", 0.2, "key", "Escape")
    yield from until(lambda: not running("verify"), 20)
    check("... Esc stops it", not running("verify") and not is_said())
    after = patch()["tactile"].to_dict()
    other = {key for key in {**record, **after} if str(record.get(key)) != str(after.get(key))}
    check("... with nothing changed", data_blocks() == before and not other, (data_blocks(), before, other))
    check("... and a sentence", "Stopped: the patch stays as it was" in last_report(), last_report())
    press_button("verify")
    yield from until(lambda: bool(found()), 120)
    check("let go on it comes to its end", found().get("vertices", 0) > 100_000, found())
    check("... with the status bar as Blender has it", not is_said() and not running("verify"))
    yield from press("ctrl+z")
    yield from until(lambda: not found(), 20)
    check("... in one step of undo", patch() is not None and not found(), found())
    place = patch().matrix_world.copy()
    patch().matrix_world = Matrix.Translation((3, 0, 1)) @ place
    activate(patch())
    bpy.ops.ed.undo_push(message="Lost")
    yield 1
    press_button("register", target="Grid")
    yield from until(is_said, 10)
    check("registering onto it is under way, and says so", running("register") and is_said())
    yield 1
    picture("register_progress")
    gui.xdo("mousemove", *ASIDE, "sleep", 0.2, "key", "Escape")
    yield from until(lambda: not running("register"), 20)
    moved = (patch().matrix_world.translation - place.translation).length
    check("... Esc stops it, and the patch stays", not is_said() and moved > 3.0, moved)
    bpy.data.objects.remove(bpy.data.objects["Grid"])


def scan():
    """A scan, with the scene in millimeters; run.sh takes the last picture, at 200 %."""
    file = FOLDER / "pear.ply"
    if file.is_file():
        for obj in bpy.data.objects:
            obj.hide_set(True)
        bpy.data.objects.remove(patch())
        bpy.ops.wm.ply_import(filepath=str(file))
        bpy.context.object.data.shade_smooth()
        bpy.context.scene.unit_settings.length_unit = "MILLIMETERS"
        place = {"location": (-0.033, 0, 0.065), "extent": 0.012, "noise": 3.6e-5}
        bpy.ops.tactile.reconstruct("EXEC_DEFAULT", True, target=bpy.context.object.name, **place)
        axes = patch().matrix_world
        look(axes.translation, axes.col[2].xyz + 0.5 * axes.col[0].xyz, 0.08)
    activate(patch())
    patch().tactile_colors = "deviation"
    bpy.ops.tactile.verify("EXEC_DEFAULT", True)
    gui.xdo("mousemove", *BUTTON, "sleep", 0.2, "click", 5)  # scrolls to the whole table
    gui.xdo("mousemove", *ASIDE)
    yield 1
    picture_of_docs("verify")
    bpy.context.preferences.view.ui_scale = 2.0
    yield 1
    gui.xdo("mousemove", 1000, 600, *["click", 5, "sleep", 0.1] * 30, "click", 4, "sleep", 0.1, "click", 4)
    yield 2


def steps():
    yield from open_tab()
    yield from by_button()
    yield from another_mesh()
    yield from large()
    yield from scan()


gui.play(steps())
