# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Run in a window of Blender on the scene of make_scene.py: a probe and its patch as Blender's objects.

It checks what undo, playback, moving, deleting and clicking do to them, with a picture after each.
TACTILE_SCAN names a mesh file to use in place of Suzanne, or is "million", for a sheet of a million faces.
"""

import math
import os
import sys
from pathlib import Path

import bpy
import gui
import numpy as np
from mathutils import Vector

sys.path.insert(0, str(Path(__file__).parent))
from common import (
    ASIDE,
    PICK_BUTTON,
    check,
    extent,
    handle,
    is_complete,
    look,
    open_tab,
    patch,
    picture,
    probe,
    until,
)

SCAN = os.environ.get("TACTILE_SCAN", "")
TARGET = Path(SCAN).stem or "Suzanne"
SIZE = 2.7  # the largest dimension of Suzanne
UPRIGHT = 0.75  # extents from the point to the handle of the tilt


def suzanne():
    return bpy.data.objects.get(TARGET)


def unit():
    """The length on the target that corresponds to 1 on Suzanne."""
    return max(suzanne().dimensions) / SIZE if SCAN else 1.0


def scan():
    """Puts another mesh in the place of Suzanne, and the 3D cursor on it."""
    for obj in list(bpy.data.objects):
        bpy.data.objects.remove(obj)
    if SCAN == "million":
        bpy.ops.mesh.primitive_grid_add(x_subdivisions=1000, y_subdivisions=1000, size=SIZE)
        co = np.empty((len(bpy.context.object.data.vertices), 3), dtype=np.float32)
        bpy.context.object.data.vertices.foreach_get("co", co.ravel())
        co[:, 2] = 0.3 * np.sin(2.0 * co[:, 0]) * np.cos(1.5 * co[:, 1])
        bpy.context.object.data.vertices.foreach_set("co", co.ravel())
    elif SCAN.endswith(".ply"):
        bpy.ops.wm.ply_import(filepath=SCAN)
    else:
        bpy.ops.wm.stl_import(filepath=SCAN)
    obj = bpy.context.object
    obj.name = TARGET
    bpy.context.view_layer.update()
    middle = sum((Vector(corner) for corner in obj.bound_box), Vector()) / 8.0
    ray = Vector((0.2, -0.3, 1.0)).normalized()
    hit, place, _, _ = obj.ray_cast(middle + 2.0 * unit() * SIZE * ray, -ray)
    check("there is a scan", hit)
    bpy.context.scene.cursor.location = obj.matrix_world @ place
    space = gui.find()[1].spaces.active
    space.clip_start, space.clip_end = 1e-3 * unit(), 1e3 * unit()
    bpy.ops.ed.undo_push(message="Scan")
    yield 1


def select(obj):
    for other in bpy.context.view_layer.objects.selected:
        other.select_set(False)
    obj.select_set(True)
    bpy.context.view_layer.objects.active = obj
    bpy.ops.ed.undo_push(message="Select")


def press(*keys):
    gui.xdo("mousemove", *ASIDE, "sleep", 0.3, *(word for key in keys for word in ("key", key, "sleep", 0.4)))


def is_outdated():
    return patch()["tactile"]["status"] == "outdated"


def fresh():
    """How far off the curvatures of the patch are from those of a touch made now, in 1 / radius."""
    module = type(probe().tactile_probe).__module__.rpartition(".")[0]
    touched = sys.modules[f"{module}.touch_again"].touch_at(
        probe(), bpy.context.evaluated_depsgraph_get(), complete=True
    )
    record = patch()["tactile"]
    return max(abs(record[k] - touched.report[k]) for k in ("k1", "k2")) * touched.result.radius


def gap():
    """How far the patch is off the probe, or the probe off the target's surface, in extents."""
    local = suzanne().matrix_world.inverted() @ probe().matrix_world.translation
    evaluated = suzanne().evaluated_get(bpy.context.evaluated_depsgraph_get())
    _, near, _, _ = evaluated.closest_point_on_mesh(local)
    off = (suzanne().matrix_world @ near - probe().matrix_world.translation).length
    apart = (patch().matrix_world.translation - probe().matrix_world.translation).length
    return max(off, apart) / patch()["tactile"]["extent"]


def drag_object(obj, keys, by=(90, 50)):
    """Moves or scales an object by a key and the mouse, and confirms by a click."""
    select(obj)
    x, y = ASIDE
    gui.xdo("mousemove", x, y, "sleep", 0.3, "key", keys, "sleep", 0.4)
    for i in range(1, 6):
        gui.xdo("mousemove", x + by[0] * i // 5, y + by[1] * i // 5, "sleep", 0.15)
    gui.xdo("click", 1)
    yield 1
    yield from until(is_complete)


def pick():
    place = bpy.context.scene.cursor.location.copy()
    look(place, (0.3, -1, 0.3 if not SCAN else 2), 5 * unit())
    bpy.ops.tactile.pick(target=TARGET, location=place)
    bpy.ops.ed.undo_push(message="Pick")
    yield from until(is_complete)
    check("a pick makes the probe a child of its target", probe().parent == suzanne(), probe().parent)


def move_target():
    digest, before = probe().tactile_probe.digest, probe().matrix_world.translation.copy()
    yield from drag_object(suzanne(), "g")
    moved = (probe().matrix_world.translation - before).length
    check(
        "G on the target takes probe and patch along", moved > 0.1 * unit() and gap() < 0.01, (moved, gap())
    )
    check("... and touches nothing again", probe().tactile_probe.digest == digest and not is_outdated())
    picture("target_moved")
    press("ctrl+z")
    yield 1
    yield from until(is_complete)
    moved = (probe().matrix_world.translation - before).length
    check("Ctrl Z brings all back", moved < 1e-5 * unit() and gap() < 0.01, (moved, gap()))
    select(suzanne())
    press("s", "shift+z", "1", "period", "5", "Return")
    yield 1
    yield from until(lambda: is_complete() and fresh() < 1e-3)
    check("a stretched target is touched again", fresh() < 1e-3 and gap() < 0.01, (fresh(), gap()))
    scale = patch().matrix_world.to_scale()
    check("... by a patch without shear", (scale - Vector((1, 1, 1))).length < 1e-4, scale)
    picture("target_stretched")
    press("ctrl+z")
    yield 1
    yield from until(lambda: is_complete() and fresh() < 1e-3)
    check("... and Ctrl Z touches it as it was", fresh() < 1e-3 and gap() < 0.01, (fresh(), gap()))


def delete_target():
    place = [probe().matrix_world.copy(), patch().matrix_world.copy()]
    reach = place[0].translation.length
    select(suzanne())
    press("x", "Return")
    yield from until(lambda: suzanne() is None)
    yield 1

    def stays():
        now = [probe().matrix_world, patch().matrix_world]
        return max(
            abs(a - b)
            for m, n in zip(place, now, strict=True)
            for r, s in zip(m, n, strict=True)
            for a, b in zip(r, s, strict=True)
        ) < 1e-5 * max(1.0, reach)

    check("X deletes the target", suzanne() is None, bpy.data.objects.keys())
    check("... and probe and patch stay where they are", stays() and probe().parent is None)
    bpy.context.view_layer.objects.active = probe()
    yield 1
    picture("target_deleted")
    press("ctrl+z")
    yield from until(lambda: suzanne() is not None and not probe().tactile_probe.message)
    check("Ctrl Z links the probe again", probe().tactile_probe.target == suzanne(), "no link")
    check("... as its child", probe().parent == suzanne(), probe().parent)
    check("... where it was, content", stays() and not probe().tactile_probe.message and not is_outdated())
    press("ctrl+shift+z", "ctrl+z")
    yield from until(lambda: suzanne() is not None and not probe().tactile_probe.message)
    check("... and once more", probe().tactile_probe.target == suzanne() and stays(), "no link")
    picture("target_undeleted")


def play():
    target, scene = suzanne(), bpy.context.scene
    scale = target.scale.copy()
    for frame, factor in ((1, 1.0), (40, 1.5)):
        target.scale = factor * scale
        target.keyframe_insert("scale", frame=frame)
    scene.frame_end = 200
    scene.frame_set(1)
    bpy.ops.ed.undo_push(message="Animate")
    yield from until(lambda: is_complete() and fresh() < 1e-3)
    before, seen = patch()["tactile"]["k1"], set()
    press("space")
    for _ in range(30):
        yield 0.1
        seen.add(is_outdated() or abs(patch()["tactile"]["k1"] - before) > 0.02 * abs(before))
    check("in playback the patch follows, or says that it is outdated", True in seen, seen)
    press("space")
    yield 1
    yield from until(lambda: is_complete() and not is_outdated())
    check("... and is touched when that stops", not is_outdated() and fresh() < 1e-3, fresh())
    picture("played")
    probe().tactile_probe.live = False
    scene.frame_set(1)
    yield 1
    bpy.context.view_layer.objects.active = probe()
    yield 1
    check("a probe that waits says at once that its patch is outdated", is_outdated())
    picture("outdated")
    probe().tactile_probe.live = True
    target = suzanne()
    target.animation_data_clear()
    target.scale = scale
    bpy.ops.ed.undo_push(message="Still")
    yield from until(lambda: is_complete() and not is_outdated())
    check("... and is touched again once it is live", not is_outdated() and fresh() < 1e-3, fresh())


def move_and_delete_patch():
    place, count = patch().matrix_world.copy(), len(bpy.data.objects)
    yield from drag_object(patch(), "g")
    off = (patch().matrix_world.translation - place.translation).length
    check(
        "G on the patch leaves it where it was touched", off < 1e-5 * max(1.0, place.translation.length), off
    )
    select(patch())
    press("x", "Return")
    yield from until(lambda: len(bpy.data.objects) == count - 1, 10)
    left = [o.name for o in bpy.data.objects if "Patch" in o.name]
    check("X on the patch takes it away", not left, left)
    bpy.context.view_layer.objects.active = probe()
    yield 1
    said = probe().tactile_probe.message
    check("... and the probe says that it has none", said.startswith("The probe has no patch"), said)
    picture("patch_deleted")
    press("ctrl+z")
    yield from until(lambda: patch() is not None and not probe().tactile_probe.message)
    good = patch() is not None and not probe().tactile_probe.message
    check("Ctrl Z brings the patch again", good, bpy.data.objects.keys())
    press("ctrl+shift+z")
    yield from until(lambda: patch() is None and len(bpy.data.objects) == count - 1, 10)
    probe().tactile_probe.azimuths[0] += 0.1
    bpy.ops.ed.undo_push(message="Turn")
    yield from until(is_complete)
    names = [o.name for o in bpy.data.objects if "Patch" in o.name]
    check("the next touch makes it anew", len(names) == 1, names)


def handles():
    axes = probe().matrix_world
    for obj in (patch(), probe()):
        select(obj)
        look(axes.translation, axes.col[2].xyz + 0.3 * axes.col[1].xyz, 6.0 * extent(probe()))
        yield 1
        azimuth = probe().tactile_probe.azimuths[0]
        gui.drag(handle(azimuth), handle(azimuth + 0.4))
        yield 1
        yield from until(is_complete)
        turned = probe().tactile_probe.azimuths[0] - azimuth
        check(f"{obj.name} active, the handles are there", abs(turned - 0.4) < 0.05, turned)
    picture("handles")
    yield from tilt_seen_steeply(axes)
    select(probe())
    look(axes.translation, axes.col[2].xyz, 6.0 * extent(probe()))
    yield 1
    tilts, before = probe().tactile_probe.tilts[:], probe().matrix_world.translation.copy()
    at = gui.view_point(before)
    gui.drag(at, (at[0] + 40, at[1] + 15))
    yield 1
    yield from until(is_complete)
    moved = probe().matrix_world.translation - before
    check("seen head on, a drag at the center tilts nothing", probe().tactile_probe.tilts[:] == tilts)
    off = math.dist(gui.view_point(probe().matrix_world.translation), (at[0] + 40, at[1] + 15))
    check(
        "... it slides the point to below the mouse", moved.length > 0.01 * unit() and off < 2.0, (moved, off)
    )
    check("... over the surface", gap() < 0.01 and fresh() < 1e-3, (gap(), fresh()))
    picture("slid")
    press("ctrl+z")
    yield 1
    yield from until(is_complete)
    moved = probe().matrix_world.translation - before
    check("... and one Ctrl Z takes it back", moved.length < 1e-5 * max(1.0, before.length), moved)
    yield from seen_from_behind(axes)


def seen_from_behind(axes):
    """Drags the point where the object hides it: it slides over what is in front, felt from outside."""
    before = probe().matrix_world.translation.copy()
    look(before, -axes.col[2].xyz, 6.0 * extent(probe()))
    yield 1
    at = gui.view_point(before)
    gui.drag(at, (at[0] + 20, at[1] + 10))
    yield 1
    yield from until(is_complete)
    target, there = bpy.data.objects[TARGET], probe().matrix_world
    local = target.matrix_world.inverted() @ there.translation
    outward = target.matrix_world.to_3x3() @ target.closest_point_on_mesh(local)[2]
    check(
        "seen from behind, the point comes to the front", (there.translation - before).length > 0.2 * unit()
    )
    check("... and is felt from outside", outward.dot(there.col[2].xyz) > 0.0)
    picture("slid_from_behind")
    press("ctrl+z")
    yield 1
    yield from until(is_complete)


def tilt_seen_steeply(axes):
    """Drags at the handle of the tilt, seen so that a pixel would tilt the active plane by much."""
    select(probe())
    settings, up = probe().tactile_probe, axes.col[2].xyz
    azimuth = settings.azimuths[settings.active_plane]
    along = math.cos(azimuth) * axes.col[0].xyz + math.sin(azimuth) * axes.col[1].xyz
    look(axes.translation, up + 0.5 * up.cross(along) + 0.1 * along, 6.0 * extent(probe()))
    yield 1
    tilts = settings.tilts[:]
    at = gui.view_point(axes.translation + UPRIGHT * extent(probe()) * up)
    picture("tilt_seen_steeply")
    gui.drag(at, (at[0] + 40, at[1] + 15))
    yield 1
    yield from until(is_complete)
    now = probe().tactile_probe.tilts[:]
    check("seen steeply, a drag above the point tilts nothing", now == tilts, (tilts, now))


def edges():
    """A point near a corner of a block: what the ring of a pick and the patch promise there."""
    bpy.data.objects[TARGET].hide_set(True)
    bpy.ops.mesh.primitive_cube_add(location=(0, 0, 8))
    block = bpy.context.object
    bpy.ops.ed.undo_push(message="Block")
    look((0.4, 0.2, 9.0), (0.4, -0.6, 1), 6)
    yield 1
    gui.click(*PICK_BUTTON)
    yield 1
    at = gui.view_point((0.85, 0.8, 9.0))
    gui.xdo("mousemove", *map(round, at))
    yield 2
    picture("edge_preview")
    gui.click(*at)

    def found():
        return next((o for o in bpy.data.objects if o.type == "EMPTY" and o.parent == block), None)

    yield from until(lambda: found() and patch(found()) and patch(found())["tactile"]["is_verified"], 20)
    if not check("a click near the edge of a block makes a probe on it", found() is not None):
        return
    seen = patch(found())
    reach = max(abs(v) for vertex in seen.data.vertices for v in (seen.matrix_world @ vertex.co)[:2])
    check("... whose patch ends at the edge, where its curves did", reach < 1.005, reach)
    record = seen["tactile"].to_dict()
    said = record["message"]
    check("... and says so", "at a crease" in said and "degrees" not in said, said)
    check("... and is flat", max(abs(record["k1"]), abs(record["k2"])) < 1e-4, (record["k1"], record["k2"]))
    picture("edge")


def steps():
    yield from open_tab()
    if SCAN:
        yield from scan()
    yield from pick()
    yield from move_target()
    yield from delete_target()
    yield from move_and_delete_patch()
    yield from handles()
    yield from play()
    if not SCAN:
        yield from edges()


gui.play(steps())
