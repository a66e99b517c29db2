# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Run in a window of Blender on the scene of make_scene.py, with the extension installed.

It checks File > Import, the menu of a dropped .ply, the dialog of a dropped .csv, and undo by keyboard. A
drop comes from the desktop, so here the operator that Blender runs for it stands for it. Three pictures are
to be looked at: drop.png, drop_menu.png and the window at the end.
"""

import math
import os
import sys
from pathlib import Path

import bpy
import gui

sys.path.insert(0, str(Path(__file__).parent))
from common import check, data_blocks, last_report, look, until

FOLDER = Path(os.environ["GUI_SHOT"]).parent


def drop(name):
    """Does what Blender does once a file is let go over the viewport."""
    window, area, region = gui.find()
    with bpy.context.temp_override(window=window, area=area, region=region):
        bpy.ops.wm.drop_import_file("INVOKE_DEFAULT", directory=str(FOLDER), files=[{"name": name}])


def patch():
    return next((obj for obj in bpy.data.objects if "tactile" in obj), None)


def write_contacts():
    """Writes the contacts of a touch as .csv and as .ply."""
    bpy.ops.tactile.reconstruct(target="Suzanne", extent=0.3)
    csv = FOLDER / "contacts.csv"
    bpy.ops.tactile.export_contacts("EXEC_DEFAULT", filepath=str(csv))
    rows = [line.split(",") for line in csv.read_text().splitlines()[2:]]
    properties = ["int curve", *(f"float {name}" for name in ("x", "y", "z", "nx", "ny", "nz"))]
    head = ["ply", "format ascii 1.0", f"element vertex {len(rows)}", *(f"property {p}" for p in properties)]
    lines = [*head, "end_header", *(" ".join(row) for row in rows)]
    (FOLDER / "contacts.ply").write_text("\n".join(lines) + "\n")


def write_rasters():
    """Writes the rows of a bump, without normals, as two files; returns the arguments that name them."""
    for name, rows in (("even.csv", range(0, 17, 2)), ("odd.csv", range(1, 17, 2))):
        lines = ["curve,x,y,z"]
        for row in rows:
            y = row / 8.0 - 1.0
            for x in (i / 30.0 - 1.0 for i in range(61)):
                lines.append(f"stroke {row},{x},{y},{0.3 * math.exp(-(x * x + y * y) / 0.3)}")
        (FOLDER / name).write_text("\n".join(lines) + "\n")
    return {"directory": str(FOLDER), "files": [{"name": "even.csv"}, {"name": "odd.csv"}], "whole": True}


def joining():
    windows = bpy.context.window_manager.windows
    return any(op.bl_idname == "TACTILE_OT_import_contacts" for w in windows for op in w.modal_operators)


def made():
    return any("tactile_object" in obj for obj in bpy.data.objects)


def joined_by_dialog(given):
    """Once the dialog is confirmed, files are joined in slices, which Esc ends."""
    before = data_blocks()
    for stop in (True, False):
        window, area, region = gui.find()
        with bpy.context.temp_override(window=window, area=area, region=region):
            path = str(FOLDER / "even.csv")
            bpy.ops.tactile.import_contacts("INVOKE_DEFAULT", True, filepath=path, outward=(0, 0, 1), **given)
        yield 1
        gui.xdo("key", "Return")
        while not joining() and not made():  # it is a matter of a second
            yield 0.1
        check("the window goes on while files are joined", joining() and data_blocks() == before)
        if stop:
            gui.xdo("key", "Escape")
        yield from until(lambda: not joining(), 60)
        words = "... Esc ends that" if stop else "... and ends with a surface"
        check(words, made() is not stop, data_blocks())
        if stop:
            said = last_report()
            check("... and says so", said.endswith("Stopped: nothing was imported"), said)
        else:
            gui.xdo("mousemove", 600, 400, "sleep", 0.2, "key", "ctrl+z")
            yield 1
        check("... and nothing is left", data_blocks() == before, data_blocks())


def several_files():
    """Contacts of one object in two files: the dialog, what it says without the outer side, the surface."""
    given, before = write_rasters(), data_blocks()
    window, area, region = gui.find()
    with bpy.context.temp_override(window=window, area=area, region=region):
        bpy.ops.tactile.import_contacts("INVOKE_DEFAULT", True, filepath=str(FOLDER / "even.csv"), **given)
    yield 1
    gui.shot(FOLDER / "join_dialog.png")
    gui.xdo("key", "Return")
    yield 2
    said = "Outward: expected a direction where contacts have no normals and do not close around an object"
    check("two files without normals ask for the outer side", said in last_report(), last_report())
    check("... and leave nothing", data_blocks() == before, data_blocks())
    gui.xdo("key", "Escape", "mousemove", 600, 400)
    yield 0.5
    yield from joined_by_dialog(given)
    bpy.ops.tactile.import_contacts("EXEC_DEFAULT", True, outward=(0, 0, 1), **given)
    yield 1
    surface = next((obj for obj in bpy.data.objects if "tactile_object" in obj), None)
    if check("... with it they are one surface", surface is not None, last_report()):
        look(surface.location, (0.4, -1, 0.8), 4.0)
    gui.sidebar()
    yield 1
    gui.sidebar("Tactile")
    yield 2
    gui.shot(FOLDER / "join_surface.png")
    gui.xdo("mousemove", 600, 400, "sleep", 0.2, "key", "ctrl+z")
    yield 1
    check("... which one Ctrl Z takes away", data_blocks() == before, data_blocks())


def steps():
    yield 1
    write_contacts()
    for obj in list(bpy.data.objects):
        bpy.data.objects.remove(obj)
    bpy.data.collections.remove(bpy.data.collections["Tactile Patches"])
    gui.xdo("mousemove", 600, 400)
    bpy.ops.ed.undo_push(message="Empty")
    data = data_blocks()
    yield 0.5
    bpy.ops.tactile.import_contacts("EXEC_DEFAULT", True, filepath=str(FOLDER / "contacts.csv"))
    yield 0.5
    good = patch() is not None and patch()["tactile"]["source"] == "contacts.csv"
    check("File, Import, Contact Data makes a patch", good, data_blocks())
    gui.xdo("key", "ctrl+z")
    yield 0.5
    check("Ctrl Z takes the patch and all its data away", data_blocks() == data, (data, data_blocks()))

    drop("contacts.csv")
    yield 1
    gui.shot(FOLDER / "drop.png")
    check("a dropped .csv asks first", patch() is None, data_blocks())
    gui.xdo("key", "Return")
    yield 1
    check("... and Return makes the patch", patch() is not None, last_report())
    if patch() is not None:
        axes = patch().matrix_world
        look(axes.translation, axes.col[2].xyz + 0.5 * axes.col[0].xyz, 4.0 * patch()["tactile"]["radius"])
    yield 1
    count = len(bpy.data.objects)
    drop("contacts.ply")
    yield 1
    gui.shot(FOLDER / "drop_menu.png")
    check("a dropped .ply leaves the choice", len(bpy.data.objects) == count, data_blocks())
    gui.xdo("key", "Escape")
    yield 0.5
    check("... and Escape leaves the scene", len(bpy.data.objects) == count, data_blocks())
    gui.xdo("mousemove", 600, 400)
    yield 0.5
    yield from several_files()


gui.play(steps())
