# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Run in a window of Blender on the scene of make_scene.py: an object touched all over, as a user does it.

Every step asserts on Blender's data and leaves a picture, to be looked at, next to the scene.
"""

import sys
from pathlib import Path
from time import thread_time

import bpy
import gui
from mathutils import Vector

sys.path.insert(0, str(Path(__file__).parent))
from common import (
    ASIDE,
    FOLDER,
    check,
    data_blocks,
    disturbed,
    last_report,
    look,
    open_tab,
    picture,
    picture_of_docs,
    probe,
    until,
)

SLICES = []  # seconds of work in each slice
WORDS = []  # what the status bar said after each call
MIDDLE = (520, 380)  # the middle of the viewport, where the object is


def running():
    windows = bpy.context.window_manager.windows
    names = {"TACTILE_OT_touch_all_over", "TACTILE_OT_continue_touching"}
    return any(op.bl_idname in names for w in windows for op in w.modal_operators)


def surfaces():
    return [obj for obj in bpy.data.objects if "tactile_object" in obj]


def start(**inputs):
    """Starts to touch all over by confirming the dialog."""
    window, area, region = gui.find()
    with bpy.context.temp_override(window=window, area=area, region=region):
        bpy.ops.tactile.touch_all_over("INVOKE_DEFAULT", True, **inputs)
    yield 1
    picture("whole_dialog")
    gui.xdo("key", "Return")
    yield from until(running, 5)


def measure_slices():
    """Notes how long each slice of work takes, which is how long a redraw waits.

    These are seconds of the thread's work, which other programs do not lengthen.
    """
    for operator in (bpy.types.TACTILE_OT_touch_all_over, bpy.types.TACTILE_OT_continue_touching):

        def advance(self, context, seconds, inner=operator._advance):
            begin = thread_time()
            try:
                return inner(self, context, seconds)
            finally:
                SLICES.append(thread_time() - begin)
                WORDS.append(self._done()[0])

        operator._advance = advance  # Blender itself calls `modal`, and ends where another is put there.


def make_target():
    """Makes the target, a scan if there is one, else an egg, and hides all other objects."""
    for obj in bpy.data.objects:
        obj.hide_set(True)
    if (FOLDER / "pear.ply").is_file():
        bpy.ops.wm.ply_import(filepath=str(FOLDER / "pear.ply"))
    else:
        bpy.ops.mesh.primitive_uv_sphere_add(segments=128, ring_count=64)
        bpy.context.object.scale = (0.04, 0.04, 0.05)
    obj = bpy.context.object
    obj.data.shade_smooth()
    obj.name = "Target"
    bpy.context.view_layer.update()
    make_view(obj)
    bpy.ops.ed.undo_push(message="Target")


def make_view(obj):
    corners = [obj.matrix_world @ corner for corner in map(Vector, obj.bound_box)]
    look(sum(corners, Vector((0, 0, 0))) / 8, (1.0, -0.3, 0.5), 2.2 * max(obj.dimensions))


def by_dialog():
    before = data_blocks()
    yield from start(target="Target", tolerance=0.0)  # 0 leaves the choice to the operator
    check("the dialog starts it", running())
    yield from until(lambda: any("Touches" in obj.name for obj in bpy.data.objects), 20)
    yield 1
    off = grown_off()
    check("while they grow, patches end where the object does", off < 0.02, off)
    picture("whole_growing")
    yield from until(lambda: not running(), 120)
    progress = [words for words in WORDS if words[0].isdigit()]
    check("... with the share that is done", all(words.endswith("%") for words in progress), progress[-3:])
    shares = [int(words.rpartition(" ")[2].removesuffix("%")) for words in progress]
    check("... which grows", shares == sorted(shares) and shares[-1] >= 40, shares[-3:])
    (surface,) = surfaces() or [None]
    if not check("it ends by itself with a surface", surface is not None, data_blocks()):
        return
    record = surface["tactile_object"].to_dict()
    check("... that covers the object", record["uncovered"] == 0, record)
    check("... and is near it", record["deviation_mean"] < 2e-3 * record["size"], record)
    left = [obj.name for obj in bpy.data.objects if obj.name.endswith("Touches")]
    check("... and the growing patches are gone", not left, left)
    slow = sorted((1e3 * seconds, i) for i, seconds in enumerate(SLICES))[-8:]
    print(
        f"a redraw waits, ms, at which of {len(SLICES)} slices:",
        *(f"{ms:.0f} at {i}" for ms, i in slow),
        flush=True,
    )
    full = data_blocks()
    yield 1
    picture("whole_surface")
    picture_of_docs("whole_object")
    surface.tactile_colors = "height_std"
    yield 1
    picture("whole_height_std")
    surface.tactile_colors = "gaussian_curvature"
    gui.xdo("mousemove", *ASIDE, "sleep", 0.2, "key", "ctrl+z")
    yield 1
    check("one Ctrl Z takes it all away", data_blocks() == before, data_blocks())
    gui.xdo("key", "ctrl+shift+z")
    yield 1
    check("Ctrl Shift Z brings it again", data_blocks() == full, data_blocks())


def grown_off():
    """How far the patches that grow are off the target at most, as a share of its size."""
    target = bpy.data.objects["Target"]
    grown = next(obj for obj in bpy.data.objects if obj.name.endswith("Touches"))
    to_target = target.matrix_world.inverted() @ grown.matrix_world
    points = [to_target @ vertex.co for vertex in grown.data.vertices]
    return max((target.closest_point_on_mesh(p)[1] - p).length for p in points) / max(target.dimensions)


def meshed_again():
    """Another edge length without touches, and a look at the largest deviation."""
    (surface,) = surfaces()
    before, window, area, region = surface["tactile_object"].to_dict(), *gui.find()
    edge = before["size"] / 20
    with bpy.context.temp_override(window=window, area=area, region=region):
        bpy.ops.tactile.mesh_again("INVOKE_DEFAULT", True, edge=edge)
    yield 1
    picture("whole_edge_dialog")
    gui.xdo("key", "Return")
    yield from until(lambda: surfaces()[0]["tactile_object"]["vertices"] != before["vertices"], 30)
    (surface,) = surfaces()
    record = surface["tactile_object"].to_dict()
    check("another edge length makes another mesh", record["vertices"] < before["vertices"], record)
    check("... of the same touches", record["touches"] == before["touches"], record)
    with bpy.context.temp_override(window=window, area=area, region=region):
        bpy.ops.tactile.look_farthest("INVOKE_DEFAULT", True)
    yield 1
    picture("whole_farthest")
    seen = area.spaces.active.region_3d.view_location
    off = (seen - Vector(record["deviation_place"])).length
    check("the largest deviation is looked at", off < 1e-4 * record["size"], off)
    for _ in range(2):
        gui.xdo("mousemove", *ASIDE, "sleep", 0.2, "key", "ctrl+z")
        yield 1
    count = surfaces()[0]["tactile_object"]["vertices"]
    check("Ctrl Z brings the first mesh back", count == before["vertices"], count)
    make_view(bpy.data.objects["Target"])
    yield 0.5


def by_click():
    """A click on the surface makes a probe on what was touched."""
    (surface,) = surfaces()
    bpy.context.view_layer.objects.active = surface
    window, area, region = gui.find()
    with bpy.context.temp_override(window=window, area=area, region=region):
        bpy.ops.tactile.pick("INVOKE_DEFAULT", True, new=True)
    yield 1
    gui.click(*MIDDLE)
    yield from until(lambda: probe() is not None, 10)
    made = probe()
    if check("a click on it makes a probe", made is not None):
        check("... on what was touched", made.tactile_probe.target == bpy.data.objects["Target"])
        seen = gui.view_point(made.matrix_world.translation)
        off = max(abs(a - b) for a, b in zip(seen, MIDDLE, strict=True))
        check("... at the click", off < 3.0, (seen, MIDDLE))
    yield 1
    picture("whole_probe")
    for _ in range(2):
        gui.xdo("mousemove", *ASIDE, "sleep", 0.2, "key", "ctrl+z")
        yield 1


def continued(before):
    """The surface goes on from where it ended, until the panel's button stops that."""
    window, area, region = gui.find()
    bpy.context.view_layer.objects.active = surfaces()[0]
    with bpy.context.temp_override(window=window, area=area, region=region):
        bpy.ops.tactile.continue_touching("INVOKE_DEFAULT", True)
    yield 1
    picture("whole_continue")
    gui.xdo("key", "Return")
    yield from until(running, 5)
    yield from until(lambda: WORDS[-1][0].isdigit() and int(WORDS[-1].split()[0]) > before["touches"], 60)
    check("Continue: it is under way", running(), WORDS[-1])
    picture("whole_progress")
    bpy.ops.tactile.stop()
    yield from until(lambda: not running(), 120)
    found = surfaces()
    check("Continue: there is one surface still", len(found) == 1, data_blocks())
    record = found[0]["tactile_object"].to_dict()
    check("... with more touches", record["touches"] > before["touches"], record)
    check("... and more of the object", record["felt"] >= before["felt"], (record["felt"], before["felt"]))


def by_escape():
    bpy.context.view_layer.objects.active = bpy.data.objects["Target"]
    before = data_blocks()
    for times, kept in ((1, 1), (2, 0)):
        yield from start(target="Target", tolerance=2e-5)
        yield 3
        check(f"{times} Esc: it is under way", running())
        gui.xdo("mousemove", *ASIDE, "sleep", 0.2, "key", "Escape")
        for _ in range(times - 1):
            gui.xdo("sleep", 0.3, "key", "Escape")
        yield from until(lambda: not running(), 120)
        check(f"{times} Esc: {kept} surface stays", len(surfaces()) == kept, data_blocks())
        if kept:
            picture("whole_part")
            record = surfaces()[0]["tactile_object"].to_dict()
            check("... which is open", not record["is_closed"], record)
            check("... and says why", record["message"].startswith("Touching ended when"), record["message"])
            yield from continued(record)
            for _ in range(2):
                gui.xdo("mousemove", *ASIDE, "sleep", 0.2, "key", "ctrl+z")
                yield 1
        check(f"{times} Esc: nothing else is left", data_blocks() == before, data_blocks())


def while_it_is_meshed():
    """While the surface is meshed, one Esc keeps it as while it is touched, and a second one drops it."""
    bpy.context.view_layer.objects.active = bpy.data.objects["Target"]
    before = data_blocks()
    yield from start(target="Target", tolerance=0.0)  # not the last tolerance
    for _ in range(1200):
        yield 0.05
        if WORDS[-1].startswith(("Meshing", "Comparing")):
            break
    check("while it is meshed: it is under way", running(), WORDS[-1])
    picture("whole_meshing")
    gui.xdo("mousemove", *ASIDE, "sleep", 0.1, "key", "Escape")
    yield 0.3
    check("while it is meshed, one Esc drops nothing", running() or len(surfaces()) == 1, WORDS[-1])
    gui.xdo("key", "Escape")
    yield from until(lambda: not running(), 20)
    check("... and a second one drops it", is_clean() and data_blocks() == before, data_blocks())
    check("... and says so", last_report() == "Stopped: no surface was kept", last_report())


def afterwards():
    """The surface is renamed, saved and read; then its target is deleted, and the surface itself."""
    bpy.context.view_layer.objects.active = bpy.data.objects["Target"]
    yield from start(target="Target", most=6)
    yield from until(lambda: not running(), 60)
    (surface,) = surfaces()
    record, name = surface["tactile_object"].to_dict(), surface.name
    surface.name = "Mine"
    surface.tactile_colors = "height_std"
    check("renamed: it shows its colors", surface["tactile_object"]["color_limit"] != record["color_limit"])
    bpy.context.view_layer.objects.active = surface
    yield 1
    picture("whole_renamed")
    bpy.ops.wm.save_as_mainfile(filepath=str(FOLDER / "whole.blend"), copy=True)
    with bpy.data.libraries.load(str(FOLDER / "whole.blend")) as (_, into):
        into.objects = ["Mine"]
    (again,) = into.objects
    check("saved and read: the record is whole", again["tactile_object"].to_dict()["source"] == "Target")
    check("... and the graph", again["tactile_graph"] == surface["tactile_graph"])
    bpy.data.objects.remove(again)
    bpy.data.objects.remove(bpy.data.objects["Target"])
    yield 1
    picture("whole_without_target")
    window, area, region = gui.find()
    with bpy.context.temp_override(window=window, area=area, region=region):
        bpy.ops.tactile.pick("INVOKE_DEFAULT", True, new=True)
    yield 1
    gui.click(*MIDDLE)
    yield 1
    check("without its target a click makes no probe", probe() is None)
    gui.xdo("key", "Escape")
    yield 1
    bpy.data.objects.remove(bpy.data.objects["Mine"])
    yield 1
    check("deleted: nothing of it is left", not surfaces() and is_clean(), name)


def is_clean():
    """Whether it is over, the growing patches are gone, and the status bar draws as Blender has it."""
    from bl_ui.space_statusbar import STATUSBAR_HT_header as bar

    growing = [obj for obj in bpy.data.objects if obj.name.endswith("Touches")]
    return not running() and not growing and bar.draw.__module__.startswith("bl_ui")


def steps():
    yield from open_tab()
    make_target()
    measure_slices()
    yield 1
    yield from by_dialog()
    yield from meshed_again()
    yield from by_click()
    yield from by_escape()
    yield from while_it_is_meshed()
    yield from disturbed("whole", start, is_clean, surfaces, tolerance=7e-4)
    yield from afterwards()


gui.play(steps())
