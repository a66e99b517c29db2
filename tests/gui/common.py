# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What the scripts for a window share: lines for run.sh, pictures, what is in the file, and the view."""

import math
import os
import subprocess
from pathlib import Path

import bpy
import gui
from mathutils import Vector

FOLDER = Path(os.environ["GUI_SHOT"]).parent
# Places in a window of 1280 by 800 with the sidebar open.
PICK_BUTTON, ASIDE = (893, 128), (300, 640)
VIEWPORT = "1052x692+0+28"  # the viewport in that window
MOST_BYTES = 300_000  # the size of a picture of the docs at most


def check(what, good, detail=""):
    print(f"ok: {what}" if good else f"FAILED: {what}: {detail}", flush=True)
    return good


def data_blocks():
    kinds = ("objects", "meshes", "materials", "collections", "node_groups", "images")
    return {kind: sorted(getattr(bpy.data, kind).keys()) for kind in kinds}


def look(point, direction, distance, perspective="PERSP"):
    """Turns the viewport to `point`, seen from `direction`; colors are those of the vertices."""
    _, area, _ = gui.find()
    view = area.spaces.active.region_3d
    view.view_perspective = perspective
    view.view_location = point
    view.view_rotation = Vector(direction).to_track_quat("Z", "Y")
    view.view_distance = distance
    # The material preview does not draw "in front": there the source hides half of the patch.
    area.spaces.active.shading.type = "SOLID"
    area.spaces.active.shading.color_type = "VERTEX"


def open_tab():
    """Opens the sidebar, and in it the extension's tab."""
    gui.sidebar()
    yield 1
    gui.sidebar("Tactile")
    yield 1


def until(reached, seconds=40):
    """Waits until `reached()` is true, as a window without a graphics card may take its time."""
    for _ in range(10 * seconds):
        yield 0.1
        if reached():
            break
    yield 0.5


def last_report():
    """The last line of Blender's log of reports, which only its own editor and the clipboard give out."""
    area = next(area for area in bpy.context.window.screen.areas if area.type != "VIEW_3D")
    kind, area.type = area.type, "INFO"
    region = next(region for region in area.regions if region.type == "WINDOW")
    with bpy.context.temp_override(area=area, region=region):
        bpy.ops.info.select_all(action="SELECT")
        bpy.ops.info.report_copy()
    area.type = kind
    lines = bpy.context.window_manager.clipboard.splitlines()
    return lines[-1] if lines else ""


def picture(name):
    gui.shot(str(FOLDER / f"{name}.png"))


def picture_of_docs(name):
    """Takes a picture of the viewport, to be looked at and copied to docs."""
    file = FOLDER / f"{name}.jpg"
    subprocess.run(["import", "-window", "root", "-crop", VIEWPORT, "-quality", "88", file], check=True)
    check(f"{file.name} is small", file.stat().st_size < MOST_BYTES, file.stat().st_size)


def drag(start, end, steps=4):
    """Drags with the mouse, and waits after each step until Blender has heard of it.

    Blender takes a button to be where the mouse is by then, so a drag during a busy second is a click.
    """
    for args in (("mousemove", *start), ("mousedown", 1)):
        gui.xdo(*args)
        yield 0.3
    for i in range(1, steps + 1):
        gui.xdo("mousemove", *(round(a + (b - a) * i / steps) for a, b in zip(start, end, strict=True)))
        yield 0.3
    gui.xdo("mouseup", 1)
    yield 1


def probe():
    return next((o for o in bpy.data.objects if o.type == "EMPTY" and o.tactile_probe.is_probe), None)


def patch(owner=None):
    return next((o for o in bpy.data.objects if "tactile" in o and o.parent == (owner or probe())), None)


def state(owner=None):
    """What must come back with undo: inputs, report and mesh of a probe."""
    owner = owner or probe()
    if owner is None:
        return None
    settings, shown = owner.tactile_probe, patch(owner)
    record = shown["tactile"].to_dict()
    corner = tuple(shown.data.vertices[-1].co)
    numbers = [
        settings.plane_count,
        *settings.azimuths,
        *settings.tilts,
        settings.extent,
        *corner,
        record["k1"],
        record["k2"],
    ]
    numbers += [*shown.matrix_world.translation]
    return numbers


def same(a, b):
    """Whether two states are the same; None is the state without a probe."""
    if a is None or b is None:
        return a is b
    return all(abs(v - w) < 1e-5 for v, w in zip(a, b, strict=True))


def is_complete():
    """Whether no gesture goes on, and the patch has what the end of a gesture fills in."""
    return not any(window.modal_operators for window in bpy.context.window_manager.windows) and (
        patch() is not None and patch()["tactile"]["is_verified"]
    )


def extent(owner):
    """The extent of a probe: the one given, or the one that was found."""
    return owner.tactile_probe.extent or patch(owner)["tactile"]["extent"]


def handle(azimuth, reach=1.0):
    """Where in the window the handle of a plane at that azimuth is, or else a place so many extents away."""
    obj = probe()
    for path, other in zip(patch()["tactile_curves"]["contours"], obj.tactile_probe.azimuths, strict=False):
        if reach == 1.0 and abs(other - azimuth) < 1e-5:
            return gui.view_point(patch().matrix_world @ Vector(path[-3:]))
    e1, e2 = obj.matrix_world.col[0].xyz, obj.matrix_world.col[1].xyz
    at = math.cos(azimuth) * e1 + math.sin(azimuth) * e2
    return gui.view_point(obj.matrix_world.translation + reach * extent(obj) * at)


def on_ring(azimuth, share=1.0):
    """Where in the window the ring of the extent, the rim, is at that azimuth, or nearer to its middle."""
    shown, e1, e2 = patch(), probe().matrix_world.col[0].xyz, probe().matrix_world.col[1].xyz
    numbers, origin, normal = shown["tactile_curves"]["rim"][0], shown.matrix_world.translation, e1.cross(e2)
    rim = [shown.matrix_world @ Vector(numbers[i : i + 3]) - origin for i in range(0, len(numbers), 3)]
    way = math.cos(azimuth) * e1 + math.sin(azimuth) * e2
    at = max(rim, key=lambda place: way.dot(place) / place.length)
    high = at.dot(normal) / normal.length_squared * normal
    return gui.view_point(origin + high + share * (at - high))


def consistent(when, owner=None):
    """Checks that the report's planes are the probe's, and that the patch lies where the probe is."""
    owner = owner or probe()
    record = patch(owner)["tactile"].to_dict()
    count = owner.tactile_probe.plane_count
    planes = [math.degrees(a) for a in owner.tactile_probe.azimuths[:count]]
    good = all(abs(a - b[0]) < 1e-3 for a, b in zip(planes, record["planes"], strict=True))
    good = good and abs(record["extent"] - extent(owner)) < 1e-6
    check(f"{when}: the patch is that of the probe's numbers", good, (planes, record["planes"]))
    off = (patch(owner).matrix_world.translation - owner.matrix_world.translation).length
    check(f"{when}: and lies at the probe", off < 1e-4 * record["radius"], off)


def undo_redo(what, before):
    """Checks one step back and one forth, by keyboard, once the gesture that was made has settled."""
    yield from until(is_complete)
    after = state()
    gui.xdo("mousemove", *ASIDE, "sleep", 0.2, "key", "ctrl+z")
    yield 1
    yield from until(lambda: before is None or is_complete())
    check(f"{what}: one Ctrl Z takes it back", same(state(), before), (state(), before))
    gui.xdo("key", "ctrl+shift+z")
    yield 1
    yield from until(is_complete)
    check(f"{what}: Ctrl Shift Z brings it again", same(state(), after), (state(), after))


def activate(name):
    for obj in bpy.context.view_layer.objects:
        obj.select_set(obj.name == name)
    bpy.context.view_layer.objects.active = bpy.data.objects[name]


def delete_target():
    bpy.data.objects.remove(bpy.data.objects["Egg"])


def enter_edit_mode():
    activate("Egg")
    bpy.ops.object.mode_set(mode="EDIT")


def move_target():
    bpy.data.objects["Egg"].location.x += 1


def change_mesh():
    bpy.data.objects["Egg"].data.vertices[0].co.x += 0.1


def undo():
    gui.xdo("mousemove", *ASIDE, "sleep", 0.2, "key", "ctrl+z")


SAID = {
    undo: "",
    delete_target: '"Egg" is gone, so touching was stopped',
    enter_edit_mode: "Touching was stopped because Object Mode was left",
    move_target: "was moved while it was touched: start again",
    change_mesh: "was changed while it was touched: start again",
}


def disturbed(what, start, is_clean, made, **inputs):
    """Checks that anything a user may do to a target stops the touches all over it, and leaves nothing.

    start, is_clean, made : start it with inputs; tell whether it is over without a trace, and what it made
    """
    # Undo comes first: the others leave a message below the mouse, which takes keys.
    for disturb, words in SAID.items():
        name = f"{what}, {disturb.__name__}"
        bpy.ops.ed.undo_push(message="Before")
        bpy.ops.mesh.primitive_uv_sphere_add(segments=96, ring_count=48, location=(0, 4, 0))
        bpy.context.object.name = "Egg"
        bpy.ops.ed.undo_push(message="Egg")
        yield 0.5
        yield from start(target="Egg", **inputs)
        yield 0.5
        check(f"{name}: it is under way", not is_clean())
        disturb()
        yield 1
        picture(f"{what}_{disturb.__name__}")
        yield from until(is_clean, 60)
        check(f"{name}: it stops", is_clean())
        if words:
            check(f"{name}: ... with a sentence", words in last_report(), last_report())
        check(f"{name}: and leaves nothing", not made(), made())
        if bpy.context.mode != "OBJECT":
            bpy.ops.object.mode_set(mode="OBJECT")
        if "Egg" in bpy.data.objects:
            delete_target()
