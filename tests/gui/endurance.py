# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Run in a window of Blender on the scene of make_scene.py: what hundreds of touches leave behind.

Touches that are taken back, brought again and loaded anew leave as many datablocks and as much memory as
before; disabling the extension takes away all that it has added.
"""

import os
import sys
from pathlib import Path

import addon_utils
import bpy
import gui
from bpy.app.handlers import persistent

sys.path.insert(0, str(Path(__file__).parent))
from common import check, data_blocks, open_tab

MODULE = "bl_ext.user_default.tactile_patch"
CYCLES, RELOAD, WARM_UP, TIMES = 200, 10, 100, 50
# Undo holds 32 steps at most and a reload empties it, so memory rises and falls alike from one reload to the
# next. A patch and its evaluated copy takes 1 MB: if one stayed at each cycle, they would
# take 100 MB after the warm-up, in which Blender and the driver fill their caches.
MOST_MEGABYTES = 20.0
SCENE = str(Path(os.environ["GUI_SHOT"]).with_suffix(".blend"))


def resident():
    """Memory in use, in megabytes."""
    with open("/proc/self/statm", encoding="ascii") as file:
        return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 1e6


def in_view():
    window, area, region = gui.find()
    return bpy.context.temp_override(window=window, area=area, region=region)


def counts():
    return {kind: len(names) for kind, names in data_blocks().items()}


def cycle(number, before):
    """Makes one touch, by operator or by probe, takes it back, brings it again and takes it back."""
    with in_view():
        place = bpy.context.scene.cursor.location
        if number % 2:
            bpy.ops.tactile.pick("EXEC_DEFAULT", True, target="Suzanne", location=place, new=True)
        else:
            bpy.ops.tactile.reconstruct("EXEC_DEFAULT", True, target="Suzanne", location=place)
    yield 0.02
    made = counts()
    if made["objects"] < before["objects"] + 1 + number % 2:  # A pick makes a probe, too.
        check(f"cycle {number}: there is a patch", False, made)
    for step, wanted in (("undo", before), ("redo", made), ("undo", before)):
        with in_view():
            getattr(bpy.ops.ed, step)()
        yield 0.02
        if counts() != wanted:
            check(f"cycle {number}: after {step}", False, (counts(), wanted))


def touches():
    before, used = counts(), []
    for number in range(CYCLES):
        yield from cycle(number, before)
        if number % RELOAD == RELOAD - 1:
            used.append(resident())
            bpy.ops.wm.open_mainfile(filepath=SCENE)
            yield 60  # `go_on` plays on before that
            if counts() != before:
                check(f"cycle {number}: after reload", False, (counts(), before))
    check(f"after {CYCLES} touches, taken back and brought again, the file is as it was", counts() == before)
    grown = used[-1] - used[WARM_UP // RELOAD - 1]
    what = f"in the last {CYCLES - WARM_UP} memory grows by less than {MOST_MEGABYTES:g} MB"
    check(f"{what}: by {grown:.1f}, to {used[-1]:.0f}", grown < MOST_MEGABYTES, used)


@persistent
def go_on(*_):
    """Plays on, because opening a file ends all timers, the one that plays the steps too."""
    gui.play(STEPS)


def registered():
    """All that Blender tells of what add-ons add to it, in words."""
    found = {f"preset path {path}" for path in bpy.utils.preset_paths("operator")}
    for name in dir(bpy.types):
        kind = getattr(bpy.types, name)
        found.add(f"type {name}")
        properties = kind.bl_rna.properties if hasattr(kind, "bl_rna") else ()
        found |= {f"property {name}.{p.identifier}" for p in properties}
        entries = getattr(getattr(kind, "draw", None), "_draw_funcs", ())
        found |= {f"entry of {name}: {entry.__module__}" for entry in entries}
    for name in dir(bpy.app.handlers):
        handlers = getattr(bpy.app.handlers, name)
        if isinstance(handlers, list):
            found |= {f"handler {name}: {handler.__module__}, {len(handlers)}" for handler in handlers}
    for group in dir(bpy.ops):
        found |= {f"operator {group}.{name}" for name in dir(getattr(bpy.ops, group))}
    for keyconfig in bpy.context.window_manager.keyconfigs:
        for keymap in keyconfig.keymaps:
            found |= {
                f"key of {keyconfig.name}, {keymap.name}: {item.idname}" for item in keymap.keymap_items
            }
    return found | {f"manual {entry.__module__}" for entry in bpy.utils._manual_map}


def own():
    """What only the extension can tell: how many drawings and commands it has, whether its timer runs."""
    addon, live = (sys.modules[f"{MODULE}.tactile_addon{name}"] for name in ("", ".probes.change_handlers"))
    return len(addon._drawings), len(addon._commands), bpy.app.timers.is_registered(live._settle)


def enabling():
    """The last round is like the first, and while disabled the extension is registered nowhere."""
    bpy.ops.tactile.pick("EXEC_DEFAULT", True, target="Suzanne", new=True)  # its timer may be waiting
    seen = []
    for _ in range(TIMES):
        addon_utils.disable(MODULE)
        yield 0.02
        off = registered(), own()
        addon_utils.enable(MODULE)
        yield 0.02
        seen.append((off, (registered(), own())))
    (off, on), (last_off, last_on) = seen[0], seen[-1]
    left = {words for words in last_off[0] if "tactile" in words.lower()}
    check("disabled, nothing of it is registered", not left, left)
    check("... it draws nothing, has no command and no timer", last_off[1] == (0, 0, False), last_off[1])
    check("enabled, it is registered", any("tactile.pick" in words for words in on[0]), on[1])
    for when, first, last in (("disabled", off, last_off), ("enabled", on, last_on)):
        same = first == last
        check(f"{when} {TIMES} times, all is as at first", same, (first[0] ^ last[0], first[1], last[1]))


def steps():
    yield from open_tab()
    bpy.data.objects["Suzanne"].modifiers["Subdivision"].levels = 1  # each undo evaluates it again
    bpy.ops.wm.save_as_mainfile(filepath=SCENE)
    bpy.ops.wm.open_mainfile(filepath=SCENE)  # this drops what nobody uses
    yield 60
    yield from touches()
    bpy.app.handlers.load_post.remove(go_on)
    yield from enabling()


STEPS = steps()
bpy.app.handlers.load_post.append(go_on)
gui.play(STEPS)
