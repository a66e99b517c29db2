# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Run in a window of Blender on the scene of make_scene.py: a patch verified against meshes, by mouse.

The button of the panel, undo and redo by keyboard, another mesh by selection, the Object menu; and
pictures of the table, at 100 and at 200 % resolution scale.
"""

import sys
from pathlib import Path

import bpy
import gui
from mathutils import Matrix

sys.path.insert(0, str(Path(__file__).parent))
from common import FOLDER, check, last_report, look, open_tab, picture, picture_of_docs

# Where they are in a window of 1280 by 800 with the sidebar open.
BUTTON, OBJECT_MENU, ASIDE = (893, 449), (330, 40), (300, 180)
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
    yield 1
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
    # Its menu, where the space bar searches.
    gui.xdo("mousemove", *OBJECT_MENU, "sleep", 0.3, "click", 1, "sleep", 0.5, "key", "space", "sleep", 0.5)
    gui.xdo("type", "--delay", 100, "verify against")
    yield 1
    picture("verify_search")
    gui.xdo("key", "Return", "sleep", 1, "mousemove", *ASIDE)
    yield 1
    check(
        "the Object menu has it, and the other selected mesh is the one",
        found().get("target") == "Scan",
        found(),
    )
    off = found().get("vertex_distance_median", 0.0)
    check("... which is as far off as it was moved", abs(off - 0.05) < 0.01, off)
    check("... and in doubt, in the status bar too", "off the patch" in last_report(), last_report())
    picture("verify_doubt")
    bpy.data.objects.remove(other)


def scan():
    """A scan in millimeters of the scene; the last picture, at 200 %, is run.sh's."""
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
    gui.xdo("mousemove", *BUTTON, "sleep", 0.2, "click", 5)  # the whole table
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
    yield from scan()


gui.play(steps())
