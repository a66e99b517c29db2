# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Run in a window of Blender with the extension installed: docs/scan.md as it is written.

Contacts are simulated, their pose is forgotten, and they are read, registered and verified by the buttons'
operators. The pictures for docs are lost.jpg and found.jpg.
"""

import re
import sys
from pathlib import Path

import bpy
import gui
from mathutils import Vector

sys.path.insert(0, str(Path(__file__).parent))
from common import FOLDER, check, look, open_tab, picture_of_docs, until

ROOT = Path(__file__).resolve().parents[2]
DOCS, PEBBLE = ROOT / "docs" / "scan.md", ROOT / "examples" / "pebble.ply"


def lose():
    """Writes contacts.csv as the page's first command does, and lost.csv by the page's own script."""
    bpy.ops.tactile.reconstruct(target="pebble", location=(0, 0, 0.017), extent=0.02, step=0.002, noise=1e-4)
    bpy.ops.tactile.export_contacts("EXEC_DEFAULT", filepath=str(FOLDER / "contacts.csv"))
    for obj in [obj for obj in bpy.data.objects if obj.name != "pebble"]:
        bpy.data.objects.remove(obj)
    script = re.search(r"```python\n(.*?)```", DOCS.read_text(encoding="utf-8"), re.DOTALL)[1]
    for name in ("contacts.csv", "lost.csv"):
        script = script.replace(f'"{name}"', repr(str(FOLDER / name)))
    exec(script, {})


def steps():
    yield from open_tab()
    for obj in list(bpy.data.objects):
        bpy.data.objects.remove(obj)
    bpy.context.scene.unit_settings.length_unit = "MILLIMETERS"
    bpy.ops.wm.ply_import(filepath=str(PEBBLE))
    pebble = bpy.context.object
    pebble.data.shade_smooth()
    lose()
    bpy.ops.tactile.import_contacts("EXEC_DEFAULT", filepath=str(FOLDER / "lost.csv"), noise=1e-4)
    patch = next(obj for obj in bpy.data.objects if "tactile" in obj)
    gui.find()[1].spaces.active.overlay.show_cursor = False
    lost = patch.matrix_world.translation.copy()
    look(0.75 * lost + Vector((0.06, 0.0, 0.0)), (0.1, -0.6, 0.8), 0.55)
    yield 2
    picture_of_docs("lost")
    pebble.select_set(True)
    bpy.ops.tactile.register("EXEC_DEFAULT")
    yield from until(lambda: (patch.matrix_world.translation - lost).length > 0.1)
    bpy.ops.tactile.verify()
    pebble.select_set(False)
    found = patch["tactile"].to_dict()
    check(
        "the lost contacts are put onto the pebble",
        found["verification"]["vertex_distance_mean"] < 1e-4,
        found,
    )
    axes = patch.matrix_world
    look(axes.translation, axes.col[2].xyz.normalized() + Vector((0.3, -0.6, 0.2)), 0.25)
    gui.xdo("mousemove", 1000, 600, *["click", 5, "sleep", 0.1] * 12)
    yield 2
    picture_of_docs("found")


gui.play(steps())
