# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Run in a window of Blender on the scene of make_scene.py: stability maps, as a user makes and stops them.

Every step asserts on Blender's data and leaves a picture, to be looked at, next to the scene.
"""

import sys
from pathlib import Path
from time import perf_counter

import bpy
import gui
from bpy.app.handlers import persistent
from mathutils import Vector

sys.path.insert(0, str(Path(__file__).parent))
from common import (
    ASIDE,
    FOLDER,
    activate,
    check,
    data_blocks,
    disturbed,
    look,
    open_tab,
    picture,
    picture_of_docs,
    until,
)

# Places in a window of 1280 by 800 with the sidebar open.
MAP_BUTTON = (943, 311)
SLICES = []  # seconds of each call of the operator's modal


def running():
    windows = bpy.context.window_manager.windows
    return any(op.bl_idname == "TACTILE_OT_stability_map" for w in windows for op in w.modal_operators)


def maps():
    return [obj for obj in bpy.data.objects if "tactile_map" in obj]


def is_clean():
    """Whether no map is being made, and the status bar draws as Blender has it."""
    from bl_ui.space_statusbar import STATUSBAR_HT_header as bar

    return not running() and bar.draw.__module__.startswith("bl_ui")


def start(**inputs):
    """Starts a map by confirming the dialog."""
    window, area, region = gui.find()
    with bpy.context.temp_override(window=window, area=area, region=region):
        bpy.ops.tactile.stability_map("INVOKE_DEFAULT", True, **inputs)
    yield 1
    gui.xdo("mousemove", 600, 300, "sleep", 0.3, "key", "Return")  # Not over a field of the dialog.
    yield from until(running, 5)


def measure_slices():
    """Notes how long each call of modal takes, which is how long a redraw waits."""
    operator = bpy.types.TACTILE_OT_stability_map
    inner = operator.modal

    def modal(self, context, event):
        begin = perf_counter()
        try:
            return inner(self, context, event)
        finally:
            SLICES.append(perf_counter() - begin)

    operator.modal = modal


def by_button():
    look((0.3, -0.2, 0.1), (0.5, -1, 0.3), 5)
    activate("Suzanne")
    bpy.ops.ed.undo_push(message="Start")
    yield 1
    picture("map_panel")
    before = data_blocks()
    gui.click(*MAP_BUTTON)
    yield 1
    picture("map_dialog")
    gui.xdo("key", "Escape")
    yield 0.5
    check("Esc in the dialog starts nothing", is_clean() and data_blocks() == before, data_blocks())
    gui.click(*MAP_BUTTON)
    yield 1
    gui.xdo("key", "Return")
    yield from until(running, 5)
    check("the button and Return start a map", running())
    yield 1.2
    picture("map_progress")
    yield from until(lambda: not running(), 120)
    (painted,) = maps() or [None]
    if not check("it ends by itself with a painted copy", painted is not None, data_blocks()):
        return
    check("... and leaves nothing else", is_clean())
    record = painted["tactile_map"].to_dict()
    check("... of patches and refusals", record["patches"] > 100 and record["touched"] == record["points"])
    check("... active, and selected", bpy.context.object == painted and painted.select_get())
    slowest = max(range(len(SLICES)), key=SLICES.__getitem__)
    print(
        f"a redraw waits {1e3 * SLICES[slowest]:.0f} ms at most, at slice {slowest} of {len(SLICES)}",
        flush=True,
    )
    full = data_blocks()
    yield 1
    picture("map")
    gui.xdo("mousemove", *ASIDE, "sleep", 0.2, "key", "ctrl+z")
    yield 1
    check("one Ctrl Z takes it all away", data_blocks() == before, data_blocks())
    gui.xdo("key", "ctrl+shift+z")
    yield 1
    check("Ctrl Shift Z brings it again", data_blocks() == full, data_blocks())
    for name in ("height_std", "condition_number", "blind_share", "reason"):
        maps()[0].tactile_map_colors = name
        yield 1
        picture(f"map_{name}")
    picture_of_docs("stability")
    gui.xdo("key", "ctrl+z")
    yield 1


def by_escape():
    before = data_blocks()
    activate("Suzanne")
    yield from start(target="Suzanne", spacing=0.02)
    yield 3
    check("it is under way", running())
    gui.xdo("mousemove", *ASIDE, "sleep", 0.2, "key", "Escape")
    yield from until(lambda: not running(), 10)
    check("Esc ends it", is_clean())
    (painted,) = maps() or [None]
    if check("... and keeps what is done", painted is not None, data_blocks()):
        record = painted["tactile_map"].to_dict()
        check("... which is a part", 0 < record["touched"] < record["points"], record["touched"])
        picture("map_part")
        gui.xdo("mousemove", *ASIDE, "sleep", 0.2, "key", "ctrl+z")
        yield 1
        check("... in one step of undo", data_blocks() == before, data_blocks())


def load_file():
    """Opens a file meanwhile; this ends all timers, this script's too, so it goes on in `reopened`."""

    @persistent
    def go_on(*_):
        bpy.app.handlers.load_post.remove(go_on)
        gui.play(reopened())

    yield from start(target="Suzanne", spacing=0.02)
    check("another file: it is under way", running())
    bpy.app.handlers.load_post.append(go_on)
    bpy.ops.wm.open_mainfile(filepath=str(FOLDER / "scene.blend"))
    yield 60


def reopened():
    yield 1
    check("another file: it is over", is_clean() and not maps(), maps())
    yield from scan()


def scan():
    """A map of a scan, and the same at 200 % resolution scale, of which run.sh takes the picture."""
    file = FOLDER / "pear.ply"
    gui.sidebar()
    yield 0.5
    gui.sidebar("Tactile")
    name = "Suzanne"
    if file.is_file():
        for obj in bpy.data.objects:
            obj.hide_set(True)
        bpy.ops.wm.ply_import(filepath=str(file))
        bpy.context.object.data.shade_smooth()
        name = bpy.context.object.name
    obj = bpy.data.objects[name]
    center = obj.matrix_world @ (sum((Vector(corner) for corner in obj.bound_box), Vector()) / 8)
    yield from start(target=name)
    yield from until(lambda: not running(), 120)
    check("a scan has its map", bool(maps()), data_blocks())
    bpy.data.objects[name].hide_set(True)
    look(center, (0.4, -1, 0.25), 2.0 * max(obj.dimensions))
    yield 1
    picture("map_scan")
    maps()[0].tactile_map_colors = "reason"
    yield 1
    picture("map_scan_reason")
    maps()[0].tactile_map_colors = "error"
    bpy.context.preferences.view.ui_scale = 2.0
    yield 1.5


def steps():
    yield from open_tab()
    measure_slices()
    yield from by_button()
    yield from by_escape()
    yield from disturbed("map", start, is_clean, maps, spacing=0.03)
    activate("Suzanne")
    yield from load_file()


gui.play(steps())
