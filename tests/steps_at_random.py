# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Anything that people may do to probes, patches and their target, at random, and what must hold then.

Shared by tests/addon/probes/test_random_steps.py, without a window, and tests/gui/random_steps.py, in one.
"""

import random
import sys

import bpy

TARGET = "Ball"
# The sphere is so fine that it makes no difference which of two faces a touch on their edge meets.
SPHERE = {"segments": 192, "ring_count": 96, "radius": 2.0, "location": (0.0, 0.0, 0.0)}
TOP = (0.3, -0.2, 1.9)
CLOSE = 2e-3  # a fresh touch may differ by this share of 1 / radius, and of the radius


def begin():
    """Makes a ball whose size is animated by a modifier, and a probe on it."""
    bpy.ops.mesh.primitive_uv_sphere_add(**SPHERE)
    ball = bpy.context.object
    ball.name = TARGET
    bump = ball.modifiers.new("Displace", "DISPLACE")
    bump.mid_level = 0.0
    for frame, strength in ((1, 0.0), (10, 0.2)):
        bump.strength = strength
        bump.keyframe_insert("strength", frame=frame)
    bpy.context.scene.frame_set(1)
    bpy.ops.tactile.pick("EXEC_DEFAULT", True, target=TARGET, location=TOP, extent=0.6)


def probes():
    found = (obj for obj in bpy.context.scene.objects if obj.type == "EMPTY" and obj.tactile_probe.is_probe)
    return sorted(found, key=lambda obj: obj.name)


def patch_of(probe):
    return next((child for child in probe.children if "tactile" in child and child.type == "MESH"), None)


def belongings():
    """Probes and their patches."""
    return [*probes(), *filter(None, map(patch_of, probes()))]


def _target():
    """The object to touch, which may have been renamed; None if there is none."""
    meshes = (obj for obj in bpy.context.scene.objects if obj.type == "MESH" and obj.name.startswith(TARGET))
    return next((obj for obj in meshes if "tactile" not in obj), None)


def _select(obj):
    for other in bpy.context.view_layer.objects.selected:
        other.select_set(False)
    obj.select_set(True)
    bpy.context.view_layer.objects.active = obj


def _push(what):
    bpy.ops.ed.undo_push(message=what)  # before any handler runs, as when a number is set in a panel


def _set_number(dice):
    settings = dice.choice(probes()).tactile_probe
    name, value = dice.choice(
        [
            ("extent", dice.uniform(0.3, 0.8)),
            ("noise", dice.choice([0.0, 0.002])),
            ("seed", dice.randrange(9)),
            ("plane_count", dice.choice([3, 4, 5])),
            ("live", dice.random() < 0.8),
            ("method", dice.choice(["bayes", "tagc"])),
        ]
    )
    setattr(settings, name, value)
    _push(name)


def _turn(dice):
    settings = dice.choice(probes()).tactile_probe
    settings.azimuths[dice.randrange(3)] += dice.uniform(-0.2, 0.2)
    _push("turn")


def _move(dice):
    obj = dice.choice([*belongings(), *filter(None, [_target()])])
    obj.location.x += dice.uniform(-0.1, 0.1)
    obj.rotation_euler.z += dice.uniform(-0.1, 0.1)
    _push("move")


def _scale(dice):
    obj = dice.choice([*belongings(), *3 * list(filter(None, [_target()]))])
    obj.scale[dice.randrange(3)] *= dice.uniform(0.9, 1.1)
    _push("scale")


def _delete(dice):
    _select(dice.choice([*belongings(), *filter(None, [_target()])]))
    bpy.ops.object.delete("EXEC_DEFAULT", True)


def _bin(dice):
    _select(dice.choice(belongings()))
    if bpy.ops.tactile.delete.poll():
        bpy.ops.tactile.delete("EXEC_DEFAULT", True)


def _pick(dice):
    target = _target()
    if target is None:
        bpy.ops.mesh.primitive_uv_sphere_add("EXEC_DEFAULT", True, **SPHERE)
        bpy.context.object.name = TARGET
        return
    _select(target)
    # The place is within a face: at a vertex rounding decides which of its faces gives the normal.
    place = target.matrix_world @ dice.choice(target.data.polygons).center
    new, parent = len(probes()) < 3, dice.random() < 0.7
    bpy.ops.tactile.pick(
        "EXEC_DEFAULT", True, target=target.name, location=place, extent=0.5, new=new, parent=parent
    )


def _choose(dice):
    dice.choice(probes()).tactile_probe.target = _target()
    _push("choose")


def _update(dice):
    _select(dice.choice(belongings()))
    if bpy.ops.tactile.update.poll():
        bpy.ops.tactile.update("EXEC_DEFAULT", True)


def _copy(dice):
    """Duplicates a probe, with or without its patch."""
    if len(probes()) < 3:
        chosen, patch = dice.choice(probes()), None
        if dice.random() < 0.5:
            patch = patch_of(chosen)
        _select(chosen)
        if patch is not None:
            patch.select_set(True)
        bpy.ops.object.duplicate("EXEC_DEFAULT", True, linked=dice.random() < 0.3)


def _frame(dice):
    bpy.context.scene.frame_set(dice.randrange(1, 11))
    _push("frame")


def _edit(dice):
    obj = _target()
    if obj is None:
        return
    _select(obj)
    bpy.ops.object.mode_set("EXEC_DEFAULT", True, mode="EDIT")
    bpy.ops.mesh.select_all(action="SELECT")
    scale = dice.uniform(0.97, 1.03)
    bpy.ops.transform.resize("EXEC_DEFAULT", True, value=(scale, scale, scale))
    bpy.ops.object.mode_set("EXEC_DEFAULT", True, mode="OBJECT")


def _rename(dice):
    obj = dice.choice([*belongings(), *filter(None, [_target()])])
    obj.name = f"{obj.name.partition('.')[0]}.{dice.randrange(100):03}"
    _push("rename")


def _undo(dice):
    for _ in range(dice.choice([1, 1, 2])):
        if bpy.ops.ed.undo.poll():
            bpy.ops.ed.undo()


def _redo(dice):
    if bpy.ops.ed.redo.poll():
        bpy.ops.ed.redo()


ANY = {"pick": _pick, "frame": _frame, "edit": _edit, "undo": _undo, "undone": _undo, "redo": _redo}
OF_PROBES = {
    "number": _set_number,
    "turn": _turn,
    "move": _move,
    "scale": _scale,
    "delete": _delete,
    "bin": _bin,
    "choose": _choose,
    "update": _update,
    "copy": _copy,
    "rename": _rename,
}
RELOAD = "reload"  # the caller does this one, because in a window it ends all timers


def choose(dice: random.Random):
    """The name of the next step."""
    return dice.choice([*ANY, *(OF_PROBES if probes() else []), RELOAD])


def take(name, dice):
    """Takes one step, which an operator may refuse with a sentence."""
    try:
        if bpy.context.mode != "OBJECT" and name not in ("undo", "undone", "redo"):
            bpy.ops.object.mode_set("EXEC_DEFAULT", True, mode="OBJECT")
        (ANY | OF_PROBES)[name](dice)
    except RuntimeError as error:
        # An operator refuses by itself, or by its poll, as undo may leave another object in Edit Mode.
        refused = "Error: ", "Operator "
        if "Traceback" in str(error) or not str(error).startswith(refused):
            raise


def faults():
    """What is wrong now, a list of sentences."""
    found = [fault for probe in probes() for fault in _faults_of(probe)]
    found += [f"{obj.name} has no user" for obj in bpy.data.objects if not obj.users]
    return found


def _faults_of(probe):
    settings, patch = probe.tactile_probe, patch_of(probe)
    if patch is None:
        return (
            [] if settings.message or not settings.live else [f"{probe.name} has no patch and says nothing"]
        )
    record, radius = patch["tactile"], patch["tactile"]["radius"]
    faults = []
    addon = sys.modules[type(settings).__module__]
    try:
        there = addon.patch_record.reconstruction_of(patch).frame.origin
    except ValueError as error:
        if record["status"] == "outdated" and settings.message and not record["is_verified"]:
            return faults  # it was being dragged when nothing could be felt any more
        return [*faults, f"{patch.name}, {record['status']}: {error}"]
    if max(abs(a - b) for a, b in zip(there, record["frame"]["origin"], strict=True)) > CLOSE * radius:
        faults.append(f"{patch.name} is not where its record says")
    if record["status"] == "outdated":
        return faults
    if settings.message:
        return [*faults, f'{probe.name} says "{settings.message}", its patch {record["status"]}']
    touched = sys.modules[f"{addon.__package__}.touch_again"].touch_at(
        probe, bpy.context.evaluated_depsgraph_get(), complete=True
    )
    off = max(abs(touched.report[key] - record[key]) * radius for key in ("k1", "k2"))
    apart = max(abs(a - b) for a, b in zip(touched.result.frame.origin, there, strict=True)) / radius
    if off > CLOSE or apart > CLOSE:
        inputs = [record["method"], record["noise"], record["contacts"], touched.report["contacts"]]
        faults.append(f"{patch.name} is {off:.2g} and {apart:.2g} off a fresh touch {inputs}")
    return faults
