# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Live probes: handlers that check after every change whether a patch is still that of its probe's inputs.

This takes a depsgraph handler, because Blender has no callback for an object that moves. In a window it does
the quick part at once, and a timer does the slow part once the gesture has ended. Without a window all is
done at once.
"""

import math
from contextlib import suppress
from time import perf_counter
from typing import Any

import bpy
from bpy.app.handlers import persistent

from ..scene import patch_object, undo
from ..scene.family import remembered
from ..scene.viewports import has_gesture
from ..touch.settings import silent
from ..touch.types import Object
from . import anchor, deleted
from .probe import is_probe, lock_of, probe_of, record_of, targets
from .touch_again import is_outdated, may_be_outdated, measure_shape, stand_by, update

SETTLE = 0.25  # A gesture counts as ended after this many seconds without a change.
EVENT_SLICE = 0.2  # In a window, work between two events takes this many seconds.
CHEAP = 0.05  # A touch that takes at most this many seconds is made in every frame of an animation.

changes = 0  # How often Blender has evaluated something anew, which may free the meshes that it had.
_unsure = True  # Whether any patch may be that of other inputs than it has, as after undo.
_seen = None  # The scene and view layer that were looked at last.


@persistent
def on_depsgraph_update(scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
    """Brings the patches of outdated live probes up to date, and has empty collections of patches removed."""
    if depsgraph.id_type_updated("COLLECTION") and patch_object.empty_collections():
        _settle_soon()
    _bring_up_to_date(depsgraph, math.inf)


@persistent
def on_frame_change(scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
    """Brings patches up to date in another frame, unless that takes longer than playback has time for."""
    _bring_up_to_date(depsgraph, CHEAP)


def _bring_up_to_date(depsgraph: bpy.types.Depsgraph, dearest: float) -> None:
    """Touches again if the last touch took at most `dearest` seconds; other patches say "outdated"."""
    global changes
    changes += 1
    if silent.is_on or not targets() or depsgraph.mode == "RENDER" or bpy.app.is_job_running("RENDER"):
        return
    with remembered(), undo.after_step():
        concerned, unsure = _concerned(depsgraph)
        if not concerned:
            return
        reshaped: dict[Any, int | None] = {
            u.id.original: None for u in depsgraph.updates if u.is_updated_geometry
        }
        if unsure:  # It may have been edited when no handler ran, as while the extension was off.
            reshaped |= {probe.tactile_probe.target: None for probe in concerned}
        end = perf_counter() + EVENT_SLICE
        for probe in (probe for probe in concerned if lock_of(probe) is None):
            in_time = bpy.app.background or (perf_counter() < end and _seconds(probe) <= dearest)
            _look_at(probe, depsgraph, reshaped, in_time, bpy.app.background)


def _seconds(probe: Object) -> float:
    """How long the probe's last touch took, without what is filled in once a gesture has ended."""
    record = record_of(probe)
    return 0.0 if record is None else sum(record["seconds"].get(key, 0.0) for key in ("prepare", "touch"))


def _look_at(
    probe: Object,
    depsgraph: bpy.types.Depsgraph,
    reshaped: dict[Any, int | None],
    in_time: bool,
    complete: bool,
) -> bool:
    """Brings a probe up to date, or notes it for the end of the gesture; returns whether it was touched.

    in_time : whether there is time for a touch now
    complete : whether to do the slow part, too
    """
    settings = probe.tactile_probe
    deleted.relink(probe)
    deleted.forget_target(probe)
    measure_shape(settings, depsgraph, reshaped)
    outdated = is_outdated(probe, depsgraph)
    is_due = (outdated and settings.live) or (complete and is_pending(probe))
    if is_due and in_time:
        update(probe, depsgraph, complete)
    else:
        stand_by(probe, outdated, complete)
    if not complete and (is_due or is_pending(probe) or anchor.is_carried(probe) or deleted.targets):
        _settle_soon()
    return is_due and in_time


@persistent
def on_blend_import(imported: Any) -> None:
    """Makes a probe that was appended without its patch touch again; a linked one belongs to its own file."""
    on_other_data()
    for item in imported.import_items:
        if item.id.id_type == "OBJECT" and is_probe(item.id) and item.id.library is None:
            item.id.tactile_probe.digest = ""


@persistent
def on_other_data(*_: Any) -> None:
    """Notes that after undo, or when a file was opened, any probe may be there and any patch may differ."""
    global _unsure
    targets.cache_clear()
    _unsure = True
    _settle_soon()  # There may be no update otherwise.


def _concerned(depsgraph: bpy.types.Depsgraph) -> tuple[list[Object], bool]:
    """The probes to which something has happened: to them, to their patch or target, or to what is there.

    Also returns whether anything may have happened to any of them, as after undo or in a new scene.
    """
    global _unsure, _seen
    layer = depsgraph.scene.session_uid, depsgraph.view_layer.name
    updates, known, unsure = depsgraph.updates, targets(), _unsure or layer != _seen
    updated = {u.id.original for u in updates if u.is_updated_geometry or u.is_updated_transform}
    objects = [datablock for datablock in updated if isinstance(datablock, bpy.types.Object)]
    owners = {probe_of(obj) for obj in objects} - {None}
    # When an object comes or goes, all others are among the updates, too, but with neither of these two
    # flags. So is an object that is renamed.
    named = {u.id.name for u in updates if isinstance(u.id, bpy.types.Object)}
    # Scene and collections are updated when an object may have come or gone.
    scene = unsure or any(isinstance(u.id, bpy.types.Scene | bpy.types.Collection) for u in updates)
    if not (scene or owners or len(named) > len(objects) or any(o.session_uid in known for o in objects)):
        return [], False
    _unsure, _seen = False, layer
    there: set[Object] = set(depsgraph.view_layer.objects)
    found = [obj for obj in there if is_probe(obj)]
    if scene and not found:
        targets.cache_clear()  # The last one may have been deleted.
    concerned = [
        obj
        for obj in sorted(found, key=lambda probe: probe.name)
        if unsure
        or obj in owners
        or obj.tactile_probe.target in updated
        or (
            (scene or getattr(obj.tactile_probe.target, "name", None) in named)
            and may_be_outdated(obj, there)
        )
    ]
    return concerned, unsure


def is_pending(probe: Object) -> bool:
    """Whether the slow part of a probe's patch is still to be filled in."""
    record = record_of(probe)
    return record is not None and not probe.tactile_probe.message and not record["is_verified"]


def _settle_soon() -> None:
    if bpy.app.timers.is_registered(_settle):
        bpy.app.timers.unregister(_settle)
    if not bpy.app.background:  # No timer runs there, and one would keep Blender's module from ending.
        bpy.app.timers.register(_settle, first_interval=SETTLE)


def _settle() -> float | None:
    """Completes the patches of a gesture once it has ended, some at a time; Blender calls it as a timer."""
    if bpy.app.is_job_running("RENDER") or has_gesture():
        return SETTLE
    deleted.remove()
    if not targets():
        return None
    end = perf_counter() + EVENT_SLICE
    for window in bpy.context.window_manager.windows:
        with bpy.context.temp_override(window=window), remembered(), undo.after_step():
            depsgraph = bpy.context.evaluated_depsgraph_get()
            if _unsure:
                on_depsgraph_update(window.scene, depsgraph)
            objects: list[Object] = list(window.view_layer.objects)
            for probe in (obj for obj in objects if is_probe(obj) and lock_of(obj) is None):
                if _look_at(probe, depsgraph, {}, in_time=True, complete=True) and perf_counter() > end:
                    return 0.01
    return None


@persistent
def after_undo(*_: Any) -> None:
    """Puts back what is still there, and makes the handlers look at all probes."""
    undo.put_back()
    on_other_data()


HANDLERS = {
    "depsgraph_update_post": on_depsgraph_update,
    "frame_change_post": on_frame_change,
    "blend_import_post": on_blend_import,
    "load_post": on_other_data,
    "save_pre": deleted.remove,
    "undo_pre": undo.take_out,
    "redo_pre": undo.take_out,
    "undo_post": after_undo,
    "redo_post": after_undo,
}


def register() -> None:
    on_other_data()
    for name, handler in HANDLERS.items():
        getattr(bpy.app.handlers, name).append(handler)


def unregister() -> None:
    if bpy.app.timers.is_registered(_settle):
        bpy.app.timers.unregister(_settle)
    for name, handler in HANDLERS.items():
        with suppress(ValueError):  # Another script may have removed it.
            getattr(bpy.app.handlers, name).remove(handler)
