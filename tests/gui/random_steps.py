# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Run in a window of Blender: the random steps of steps_at_random.py, and drags by mouse.

After each step a patch agrees with a fresh touch, or says that it is outdated. TACTILE_STEPS=1000
TACTILE_SEED=... take more steps than the 50 of each run, with other dice.
"""

import faulthandler
import os
import random
import sys
from pathlib import Path

import bpy
import gui
from bpy.app.handlers import persistent

sys.path.insert(0, str(Path(__file__).parents[1]))
sys.path.insert(0, str(Path(__file__).parent))
import steps_at_random as steps
from common import ASIDE, FOLDER, check, look, open_tab

STEPS, SEED = int(os.environ.get("TACTILE_STEPS", "50")), int(os.environ.get("TACTILE_SEED", "0"))
ADDON = "bl_ext.user_default.tactile_patch.tactile_addon"
faulthandler.enable()  # a crash says where
dice = random.Random(SEED)
taken = []


def is_quiet():
    """Whether no gesture goes on, and no timer of the extension is left."""
    settle = sys.modules[f"{ADDON}.probes.change_handlers"]._settle
    windows = bpy.context.window_manager.windows
    is_free = not any(window.modal_operators for window in windows)
    return is_free and not bpy.app.timers.is_registered(settle)


def settled():
    """Waits until all that a step has left to do is done, a minute at most."""
    for _ in range(600):
        yield 0.1
        if is_quiet():
            break


def drag():
    """Drags the center of a probe by mouse, seen nearly head on."""
    seen = [probe for probe in steps.probes() if steps.patch_of(probe) is not None and probe.visible_get()]
    if not seen:
        return
    chosen = dice.choice(seen)
    steps._select(dice.choice([chosen, steps.patch_of(chosen)]))
    bpy.ops.ed.undo_push(message="Select")
    axes = chosen.matrix_world
    look(
        axes.translation,
        axes.col[2].xyz + 0.2 * axes.col[1].xyz,
        6.0 * steps.patch_of(chosen)["tactile"]["extent"],
    )
    yield 0.5
    at = gui.view_point(axes.translation)
    gui.drag(at, (at[0] + dice.randrange(-60, 60), at[1] + dice.randrange(-60, 60)), steps=4)
    yield 0.5
    gui.xdo("mousemove", *ASIDE)


def reload():
    """Saves and opens the file; this ends all timers, this script's too, so it goes on in a new one."""
    file = str(FOLDER / "random.blend")
    bpy.ops.wm.save_as_mainfile(filepath=file)

    @persistent
    def go_on(*_):
        bpy.app.handlers.load_post.remove(go_on)
        gui.play(walk())

    bpy.app.handlers.load_post.append(go_on)
    bpy.ops.wm.open_mainfile(filepath=file)
    yield 60


def is_well():
    faults = steps.faults()
    if faults:
        check(f"after {len(taken)} steps with the seed {SEED}", False, (faults, taken[-5:]))
    return not faults


def walk():
    """Takes the steps that are left."""
    yield from settled()
    while is_well() and len(taken) < STEPS:
        taken.append(dice.choice(["drag", *9 * [None]]) or steps.choose(dice))
        print(len(taken), taken[-1], flush=True)  # after a crash the last line names the step
        if taken[-1] == steps.RELOAD:
            yield from reload()
        elif taken[-1] == "drag":
            yield from drag()
        else:
            window, area, region = gui.find()
            with bpy.context.temp_override(window=window, area=area, region=region):
                steps.take(taken[-1], dice)
        yield from settled()
    if len(taken) == STEPS:
        check(f"after each of {STEPS} random steps all agrees, or says that it does not", True)


def start():
    yield from open_tab()
    for obj in list(bpy.data.objects):
        bpy.data.objects.remove(obj)
    window, area, region = gui.find()
    with bpy.context.temp_override(window=window, area=area, region=region):
        steps.begin()
    yield from walk()


gui.play(start())
