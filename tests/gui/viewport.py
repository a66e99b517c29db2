# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Run in a window of Blender on the scene of make_scene.py: probes by mouse and keyboard, as a user has them.

Every step asserts on Blender's data and leaves a picture, to be looked at, next to the scene.
"""

import math
import sys
from pathlib import Path

import bpy
import gui
from bpy.app.handlers import persistent
from mathutils import Quaternion, Vector

sys.path.insert(0, str(Path(__file__).parent))
from common import (
    ASIDE,
    FOLDER,
    PICK_BUTTON,
    activate,
    check,
    consistent,
    data_blocks,
    extent,
    handle,
    is_complete,
    last_report,
    look,
    on_ring,
    open_tab,
    patch,
    picture,
    probe,
    same,
    state,
    undo_redo,
    until,
)

# Places in a window of 1280 by 800 with the sidebar open.
EXTENT_FIELD, MOVE_BUTTON, DELETE_BUTTON, COLORS_BUTTON = (943, 180), (837, 128), (1001, 128), (893, 493)
OBJECT_MENU = (330, 40)
VIEW = 6.0  # extents from the probe to the eye


def pick(target):
    place = bpy.context.scene.cursor.location.copy()
    look(place, (0.3, -1, 0.3), 5)
    yield 0.5
    at = [round(v) for v in gui.view_point(place)]
    before = data_blocks()
    other = next(area for area in bpy.context.window.screen.areas if area.type != "VIEW_3D")
    try:
        with bpy.context.temp_override(area=other):
            said = bpy.ops.tactile.pick("INVOKE_DEFAULT")
    except RuntimeError as error:
        said = str(error)
    check("points are picked in a 3D viewport only", "Points are picked in a 3D viewport" in said, said)
    gui.click(*PICK_BUTTON)
    yield 0.5
    gui.xdo("mousemove", at[0] - 30, at[1], "sleep", 0.3, "mousemove", *at)
    yield 0.7
    picture("pick")
    gui.xdo("key", "Escape")
    yield 0.5
    check("Esc in the middle of a pick leaves nothing", data_blocks() == before and probe() is None)
    gui.click(*PICK_BUTTON)
    yield 0.5
    gui.xdo("mousemove", *at, "sleep", 0.3, "click", 4, "sleep", 0.5, "click", 3)
    yield 0.7
    check("the right button leaves nothing either", data_blocks() == before and probe() is None)
    closer = gui.find()[1].spaces.active.region_3d.view_distance
    check("... and the wheel zoomed meanwhile", closer < 4.9, closer)
    gui.click(*PICK_BUTTON)
    yield 0.5
    at = [round(v) for v in gui.view_point(place)]
    gui.xdo("mousemove", at[0] - 10, at[1], "sleep", 0.2, "mousemove", *at, "sleep", 0.3, "click", 1)
    yield 1
    found = probe()
    if not check("a click places a probe", found is not None and patch() is not None, data_blocks()):
        return
    off = (found.location - place).length
    check("... at the place clicked", off < 0.02, off)
    check("... on the object clicked", found.tactile_probe.target == bpy.data.objects[target])
    check("... active and selected", bpy.context.object == found and found.select_get())
    normal = found.matrix_world.col[2].xyz
    outward = Vector(patch()["tactile"]["frame"]["normal"])
    check(
        "... with z along the normal, toward the eye", normal.dot(outward) > 0.99 and normal.y < 0.0, normal
    )
    check("... and nothing else", len(bpy.data.objects) == len(before["objects"]) + 2, data_blocks())
    consistent("picked")
    picture("picked")
    after = data_blocks()
    gui.xdo("mousemove", *ASIDE, "sleep", 0.2, "key", "ctrl+z")
    yield 1
    check("Ctrl Z takes probe and patch away", probe() is None and data_blocks() == before, data_blocks())
    gui.xdo("key", "ctrl+shift+z")
    yield 1
    check("Ctrl Shift Z brings them again", data_blocks() == after and probe() is not None, data_blocks())


def drag_handles():
    settings = probe().tactile_probe
    axes = probe().matrix_world
    look(axes.translation, axes.col[2].xyz + 0.3 * axes.col[1].xyz, VIEW * extent(probe()))
    yield 0.5
    before, blocks = state(), data_blocks()
    start, azimuth = handle(settings.azimuths[0]), settings.azimuths[0] + 0.5
    end = handle(azimuth)
    gui.drag(start, end)
    yield 1
    yield from until(is_complete)
    settings = probe().tactile_probe
    turned = settings.azimuths[0]
    check("dragging a handle turns its plane", abs(turned - azimuth) < 0.05, turned)
    check("... and the patch changes", not same(state()[14:], before[14:]), state())
    consistent("a plane turned")
    check("... in place", data_blocks() == blocks, data_blocks())
    check("... completed at the end", "vertices" in patch()["tactile"], "")
    picture("turned")
    yield from undo_redo("a plane turned", before)

    before = state()
    azimuth = probe().tactile_probe.azimuths[1]
    start, middle, end = (map(round, handle(azimuth + turn)) for turn in (0.0, 0.2, 0.4))
    gui.xdo("mousemove", *start, "sleep", 0.3, "mousedown", 1, "sleep", 0.2)
    gui.xdo("mousemove", *middle, "sleep", 0.3, "mousemove", *end, "sleep", 0.4)
    yield from until(lambda: not same(state(), before))
    check("... while the button is down the patch follows", not same(state(), before), state())
    picture("turning")
    gui.xdo("key", "Escape", "sleep", 0.2, "mouseup", 1)
    yield 1
    yield from until(is_complete)
    check("Esc in the middle of a turn takes it back", same(state(), before), (state(), before))

    direction = gui.find()[1].spaces.active.region_3d.view_rotation.copy()
    gui.find()[1].spaces.active.region_3d.view_rotation = probe().matrix_world.to_quaternion() @ Quaternion(
        (1.0, 0.0, 0.0), math.radians(90.0)
    )
    shading = gui.find()[1].spaces.active.shading
    shading.type = "WIREFRAME"  # The mesh hides the handle otherwise.
    yield 0.5
    gui.drag(handle(azimuth), [v + 20 for v in handle(azimuth)])
    yield 1
    yield from until(is_complete)
    shading.type = "SOLID"
    check("a handle in a plane seen edge on stays where it is", same(state(), before), (state(), before))
    gui.find()[1].spaces.active.region_3d.view_rotation = direction
    yield 0.5

    axes, reach = probe().matrix_world, extent(probe())
    number = probe().tactile_probe.active_plane
    t = axes.to_quaternion() @ Vector((math.cos(azimuth), math.sin(azimuth), 0.0))
    look(axes.translation, axes.col[2].xyz + t, VIEW * reach)
    yield 0.5
    top = axes.translation + 0.75 * reach * axes.col[2].xyz
    gui.drag(gui.view_point(top), [v + 35 for v in gui.view_point(top)])
    yield 1
    yield from until(is_complete)
    tilt = probe().tactile_probe.tilts[number]
    check("dragging the handle above tilts the active plane", abs(tilt) > 0.03, math.degrees(tilt))
    consistent("a plane tilted")
    picture("tilted")
    yield from undo_redo("a plane tilted", before)

    before, reach = state(), extent(probe())
    free = 0.5 * (probe().tactile_probe.azimuths[0] + probe().tactile_probe.azimuths[1]) + math.pi
    gui.drag(on_ring(free), on_ring(free, 0.7))
    yield 1
    yield from until(is_complete)
    ratio = probe().tactile_probe.extent / reach
    check("dragging the ring changes the extent", abs(ratio - 0.7) < 0.05, ratio)
    consistent("another extent")
    picture("extent")
    yield from undo_redo("another extent", before)


def move_probe():
    before, place = state(), probe().location.copy()
    at = [round(v) for v in gui.view_point(place)]
    gui.xdo("mousemove", *at, "sleep", 0.2, "key", "g", "sleep", 0.3)
    for i in range(1, 6):
        gui.xdo("mousemove", at[0] - 8 * i, at[1] + 4 * i, "sleep", 0.15)
    yield from until(lambda: not same(state(), before))
    check("while the probe is dragged the patch follows", not same(state(), before), state())
    picture("moving")
    gui.xdo("key", "Escape")
    yield 1
    yield from until(is_complete)
    check("Esc in the middle of a move takes it back", same(state(), before), (state(), before))
    gui.xdo("mousemove", *at, "sleep", 0.2, "key", "g", "sleep", 0.3)
    for i in range(1, 6):
        gui.xdo("mousemove", at[0] - 8 * i, at[1] + 4 * i, "sleep", 0.15)
    gui.xdo("click", 1)
    yield 1
    yield from until(is_complete)
    check("a dragged probe moves", (probe().location - place).length > 0.02, probe().location)
    consistent("the probe moved")
    check("... completed at the end", "vertices" in patch()["tactile"], "")
    yield from undo_redo("the probe moved", before)


def type_a_number():
    before = state()
    gui.xdo("mousemove", *EXTENT_FIELD, "sleep", 0.3, "click", "--repeat", 2, "--delay", 60, 1, "sleep", 0.4)
    gui.xdo("key", "ctrl+a", "sleep", 0.2, "type", "0.2")
    gui.xdo("key", "Return")
    yield 1.5
    yield from until(is_complete)
    check("a number typed in the panel counts", abs(probe().tactile_probe.extent - 0.2) < 1e-5, state())
    consistent("a number typed")
    yield from undo_redo("a number typed", before)


def add_planes():
    before, planes = state(), probe().tactile_probe.plane_count
    # The space bar lets the entry be found by typing.
    gui.xdo("mousemove", *OBJECT_MENU, "sleep", 0.3, "click", 1, "sleep", 0.5, "key", "space", "sleep", 0.5)
    gui.xdo("type", "--delay", 100, "planes while")
    yield 1
    gui.xdo("key", "Return", "sleep", 1, "mousemove", *ASIDE)
    yield from until(lambda: probe().tactile_probe.plane_count > planes, 10)
    more = len(patch()["tactile"]["added_planes"])
    there = probe().tactile_probe.plane_count
    check("an entry adds planes while they help", there == planes + more > planes, (planes, more, there))
    said = last_report()
    check("... and says what they have brought", "Planes added at" in said and "has become" in said, said)
    consistent("more planes")
    picture("planes_added")
    yield from undo_redo("more planes", before)


def save_and_reload():
    """Saves and opens the file; this ends all timers, this script's too, so it goes on in `reopened`."""
    before = state()
    file = str(FOLDER / "probes.blend")
    bpy.ops.wm.save_as_mainfile(filepath=file)
    yield 0.5

    @persistent
    def go_on(*_):
        bpy.app.handlers.load_post.remove(go_on)
        gui.play(reopened(before))

    bpy.app.handlers.load_post.append(go_on)
    bpy.ops.wm.open_mainfile(filepath=file)
    yield 60


def reopened(before):
    yield 1
    check("saved and opened again, all is as it was", same(state(), before), (state(), before))
    probe().tactile_probe.azimuths[2] += 0.2
    yield 1
    consistent("changed after opening")
    yield from until(is_complete)
    check("... completed", "vertices" in patch()["tactile"], "")
    bpy.ops.ed.undo_push(message="Changed")
    yield from two_probes()
    yield from hide_and_delete_target("Suzanne")
    yield from edit_mode("Suzanne")
    yield from delete_by_keys()
    yield from grab_from_near()
    yield from orthographic_and_tiny()
    yield from looks()


def delete_key():
    count = len(bpy.data.objects)
    gui.xdo("mousemove", *ASIDE, "sleep", 0.3, "key", "x")
    yield 1
    gui.xdo("key", "Return")
    yield from until(lambda: len(bpy.data.objects) < count)


def two_probes():
    first, blocks = probe(), data_blocks()
    at = [round(v) for v in gui.view_point(first.location)]
    was = state(first)
    gui.xdo("mousemove", *at, "sleep", 0.2, "key", "shift+d", "sleep", 0.4)
    gui.xdo("mousemove", at[0] - 50, at[1] + 30, "sleep", 0.4, "click", 1)
    yield 1.5
    first = bpy.data.objects[first.name]
    second = bpy.context.object
    check("Shift D makes a second probe", second != first and second.tactile_probe.is_probe, second)
    check("... with a patch of its own", patch(second) is not None and patch(second) != patch(first), "")
    check("... and the first keeps its own", same(state(first), was), state(first))
    yield from until(lambda: is_complete() and "vertices" in patch(second)["tactile"], 10)
    check("... and is completed", "vertices" in patch(second)["tactile"], "")
    consistent("the copy", second)
    picture("two")
    gui.xdo("mousemove", *ASIDE, "sleep", 0.2, "key", "ctrl+z")
    yield 1
    gui.xdo("key", "ctrl+z")
    yield 1
    left = len(bpy.data.objects)
    check("undone, only the first is left", left == len(blocks["objects"]), data_blocks())


def hide_and_delete_target(target):
    obj = bpy.data.objects[target]
    obj.hide_set(True)
    bpy.ops.ed.undo_push(message="Hide")
    before = state()
    probe().tactile_probe.azimuths[0] += 0.1
    yield 1
    check("a hidden target is still touched", not same(state(), before) and not probe().tactile_probe.message)
    picture("hidden")
    bpy.data.objects[target].hide_set(False)
    for selected in bpy.context.view_layer.objects.selected:
        selected.select_set(False)
    bpy.data.objects[target].select_set(True)
    bpy.context.view_layer.objects.active = bpy.data.objects[target]
    bpy.ops.ed.undo_push(message="Select")
    before = state()
    yield from delete_key()
    check("X deletes the target, probe or not", target not in bpy.data.objects, bpy.data.objects.keys())
    check(
        "... the probe says so", "no target" in probe().tactile_probe.message, probe().tactile_probe.message
    )
    check("... and keeps the last patch", same(state(), before), (state(), before))
    bpy.context.view_layer.objects.active = probe()
    yield 0.7
    picture("deleted")
    for _ in range(3):
        gui.xdo("key", "ctrl+z")
        yield 0.7
        if target in bpy.data.objects:
            break
    for key in ("ctrl+shift+z", "ctrl+z") * 5:
        gui.xdo("key", key)
        yield 0.4
    check("Ctrl Z brings it back", probe().tactile_probe.target == bpy.data.objects.get(target), "")
    yield 0.5
    check("... and the probe is content", not probe().tactile_probe.message, probe().tactile_probe.message)


def edit_mode(target):
    obj = bpy.data.objects[target]
    bpy.context.view_layer.objects.active = obj
    before = state()
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="SELECT")
    yield 0.5
    poll = bpy.ops.tactile.pick.poll()
    check("no pick in Edit Mode", not poll)
    picture("edit")
    bpy.ops.transform.resize(value=(1.05, 1.05, 1.05))
    yield 1.5
    check("the patch follows an edit of the mesh", not same(state(), before), state())
    bpy.ops.object.mode_set(mode="OBJECT")
    bpy.ops.ed.undo_push(message="Edited")
    yield from until(is_complete)
    check("... and is completed after it", "vertices" in patch()["tactile"], "")


def delete_by_keys():
    for selected in bpy.context.view_layer.objects.selected:
        selected.select_set(False)
    owner, shown = probe(), patch()
    owner.select_set(True)
    bpy.context.view_layer.objects.active = owner
    bpy.ops.ed.undo_push(message="Select")
    place, name, count = shown.matrix_world.copy(), shown.name, len(bpy.data.objects)
    yield from delete_key()
    left = bpy.data.objects.get(name)
    check("X on the probe leaves the patch", probe() is None and left is not None, bpy.data.objects.keys())
    off = max(
        abs(a - b) for r, s in zip(left.matrix_world, place, strict=True) for a, b in zip(r, s, strict=True)
    )
    check("... where it was, without a parent", left.parent is None and off < 1e-5, off)
    check("... and nothing without users", len(bpy.data.objects) == count - 1, bpy.data.objects.keys())
    unused = [o.name for o in bpy.data.objects if not o.users]
    check("... no object has no user", not unused, unused)
    gui.xdo("key", "ctrl+z")
    yield 1
    check("Ctrl Z brings the probe back", probe() is not None and patch() is not None)
    gui.click(*DELETE_BUTTON)
    yield 1
    names = {kind: [n for n in found if "Patch" in n] for kind, found in data_blocks().items()}
    check("the bin takes probe and patch", not names["objects"] and not names["meshes"], names)
    gui.xdo("mousemove", *ASIDE, "sleep", 0.2, "key", "ctrl+z")
    yield 2
    activate(probe().name)
    patch().select_set(True)
    bpy.ops.ed.undo_push(message="Select both")
    for when in ("X on both", "... and again after Ctrl Z"):
        yield from delete_key()
        kept = [c.name for c in bpy.data.collections if "Patches" in c.name]
        check(f"{when} leaves no collection", probe() is None and not kept, kept)
        gui.xdo("key", "ctrl+z")
        yield 2
        is_seen = probe() is not None and {probe(), patch()} <= {*bpy.context.view_layer.objects}
        check("... and Ctrl Z brings both back to where they are seen", is_seen)
    yield from delete_key()


def orthographic_and_tiny():
    """A scan about a millimeter large, scaled unevenly, with a modifier, seen without perspective."""
    file = FOLDER / "pear.ply"
    if not file.is_file():
        return
    for obj in bpy.data.objects:
        obj.hide_set(True)
    bpy.ops.wm.ply_import(filepath=str(file))
    pear = bpy.context.object
    pear.scale = (0.01, 0.013, 0.008)
    pear.modifiers.new("Smooth", "SMOOTH").iterations = 2
    bpy.ops.ed.undo_push(message="Pear")
    yield 0.5
    center = pear.matrix_world @ (sum((Vector(corner) for corner in pear.bound_box), Vector()) / 8)
    look(center, (0.2, -1, 0.3), 0.003, "ORTHO")
    gui.find()[1].spaces.active.clip_start = 1e-5
    yield 1
    gui.click(*PICK_BUTTON)
    yield 0.5
    at = [round(v) for v in gui.view_point(center)]
    gui.xdo("mousemove", at[0] - 10, at[1], "sleep", 0.3, "mousemove", *at, "sleep", 0.5)
    yield 0.5
    picture("tiny_pick")
    gui.xdo("click", 1)
    yield 1.5
    found = probe()
    if not check(
        "a click places a probe on a scan, tiny and stretched", found is not None and patch() is not None
    ):
        return
    check("... on the scan", found.tactile_probe.target == pear, found.tactile_probe.target)
    seen = gui.view_point(found.location)
    off = math.dist(seen, at)
    check("... below the mouse", off < 1.5, off)
    check(
        "... with a patch in its mesh",
        patch()["tactile"]["vertex_distance_mean"] < 0.03 * patch()["tactile"]["radius"],
    )
    picture("tiny")
    for perspective in ("ORTHO", "PERSP"):
        look(center, (0.2, -1, 0.3), 0.003, perspective)
        yield 0.5
        at = [round(v) for v in gui.view_point(found.location)]  # a contact is in front there
        digest, count = found.tactile_probe.digest, len(bpy.data.objects)
        gui.click(*MOVE_BUTTON)
        yield 0.5
        gui.xdo("mousemove", at[0] - 10, at[1], "sleep", 0.3, "mousemove", *at, "sleep", 0.5, "click", 1)
        yield 1
        moved = found.tactile_probe.digest != digest and len(bpy.data.objects) == count
        check(
            f"a click on its contacts is one on the mesh, {perspective}", moved, found.tactile_probe.message
        )


def rendering():
    """While a picture is rendered, in another thread, nothing is touched."""
    scene, settings = bpy.context.scene, probe().tactile_probe
    bpy.context.preferences.view.render_display_type = "NONE"
    scene.render.engine, scene.cycles.samples = "CYCLES", 4096
    window, area, region = gui.find()
    with bpy.context.temp_override(window=window, area=area, region=region):
        bpy.ops.render.render("INVOKE_DEFAULT")
    yield 1
    digest = settings.digest
    settings.azimuths[0] += 0.1
    yield 1
    busy = bpy.app.is_job_running("RENDER")
    check("no touch while a picture is rendered", busy and settings.digest == digest, busy)
    gui.xdo("mousemove", *ASIDE, "sleep", 0.2, "key", "Escape")
    yield from until(lambda: not bpy.app.is_job_running("RENDER"))
    probe().update_tag()
    yield 1
    check("... but after it", settings.digest != digest and not settings.message, settings.message)


def grab_from_near():
    """A cube so near that discs on the rim are out of view, below the sidebar or Blender's navigation."""
    for obj in bpy.data.objects:
        obj.hide_set(True)
    bpy.ops.mesh.primitive_cube_add(location=(0, 0, 0))
    bpy.ops.tactile.pick(target="Cube", location=(0, -1, 0), new=True)
    owner, groups = bpy.context.object, bpy.types.GizmoGroup.__subclasses__()
    group = next(group for group in groups if group.__name__ == "TACTILE_GGT_handles")
    places, hidden, prepare = [], [], group.draw_prepare

    def noted(self, context):
        prepare(self, context)
        places[:] = [turn.matrix_basis.translation.copy() for turn in self.turns]
        hidden[:] = [each.hide for each in (self.extent, *self.turns[:3], *self.tilts[:3])]

    group.draw_prepare = noted
    _, area, region = gui.find()
    for number, (aside, way) in enumerate((((0, 0, 0), (0.2, -1, 0.3)), ((-0.2, 0, 0.15), (0, -1, 0)))):
        look(owner.matrix_world.translation + Vector(aside), way, 0.9 * extent(owner))
        area.tag_redraw()
        yield 1
        picture(f"near_{number}")
        for plane in range(3):
            at = gui.view_point(places[plane])
            covered = [r.type for r in area.regions if r.type != "WINDOW" and is_over(r, at, 8)]
            good = is_over(region, at, -8) and not covered
            check(f"view {number}: disc {plane + 1} is in the free view", good, (at, covered))
            yield from turn_at(owner, plane, at)
    for shading in ("SOLID", "WIREFRAME"):
        look(owner.matrix_world.translation, (0.2, 1, 0.3), 4.0 * extent(owner))
        area.spaces.active.shading.type = shading
        area.tag_redraw()
        yield 1
        picture(f"behind_{shading.lower()}")
        hides = shading == "SOLID"
        check(f"from behind, {shading.lower()} {'hides' if hides else 'shows'} handles", all(hidden) is hides)
    area.spaces.active.shading.type = "SOLID"
    group.draw_prepare = prepare
    gui.click(*DELETE_BUTTON)
    yield 1


def turn_at(owner, plane, at):
    """Drags the handle of a plane that is at a place of the window."""
    azimuth = owner.tactile_probe.azimuths[plane]
    center = gui.view_point(owner.matrix_world.translation)
    arm = [a - b for a, b in zip(at, center, strict=True)]
    gui.drag(at, (at[0] - 0.2 * arm[1], at[1] + 0.2 * arm[0]))
    yield 1
    yield from until(is_complete)
    turned = abs(owner.tactile_probe.azimuths[plane] - azimuth)
    check("... and turns its plane", 0.05 < turned < 0.5, turned)


def is_over(region, at, margin):
    """Whether a place as in view_point is in a region, or nearer than a margin to it."""
    x, y = at[0] - region.x, bpy.context.window.height - at[1] - region.y
    return -margin <= x <= region.width + margin and -margin <= y <= region.height + margin


def looks():
    """Colors, their button, a light theme and large letters; run.sh takes the last picture."""
    if patch() is None:  # there was no scan
        bpy.ops.tactile.pick(target="Suzanne")
    shading = gui.find()[1].spaces.active.shading
    shading.color_type = "MATERIAL"
    yield 1
    gui.xdo("mousemove", *COLORS_BUTTON)
    yield 0.5
    gui.click(*COLORS_BUTTON)
    yield 1
    check("a button has the viewport show the colors", shading.color_type == "VERTEX", shading.color_type)
    shown = patch()
    for name in ("mean_curvature", "deviation", "height_std"):
        shown.tactile_colors = name
        yield 1
        check(f"the colors of {name} have a range", shown["tactile"]["color_limit"] > 0.0)
        picture(name)
    yield from rendering()
    folder = bpy.utils.preset_paths("interface_theme")[0]
    theme = next(Path(folder).glob("*ight*.xml"))
    bpy.ops.script.execute_preset(filepath=str(theme), menu_idname="USERPREF_MT_interface_theme_presets")
    yield 1
    picture("light")
    bpy.context.preferences.view.ui_scale = 2.0
    yield 1.5


def steps():
    yield from open_tab()
    yield from pick("Suzanne")
    yield from drag_handles()
    yield from move_probe()
    yield from type_a_number()
    yield from add_planes()
    yield from save_and_reload()


gui.play(steps())
