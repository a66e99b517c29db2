# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Live probes: what looks after every change whether a patch is still that of its probe's inputs.

A depsgraph handler, for Blender has no callback for an object that moves. In a window it does the quick
part at once, and a timer what is dear, once the gesture has ended; without a window all of it at once.
"""

import bpy
from bpy.app.handlers import persistent

from . import patch_object
from .probe import is_free, is_outdated, is_probe, measure_shape, patch_of, probe_of, record_of, update

SETTLE = 0.25  # seconds without a change after which a gesture counts as ended
GESTURES = ("TRANSFORM_OT_", "TACTILE_OT_")


@persistent
def on_depsgraph_update(scene, depsgraph):
    """Brings the patches of outdated live probes up to date; nothing happens where no input has changed."""
    if depsgraph.mode == "RENDER" or bpy.app.is_job_running("RENDER"):
        return
    reshaped = {u.id.original for u in depsgraph.updates if u.is_updated_geometry}
    moved = {u.id.original for u in depsgraph.updates if u.is_updated_transform}
    for probe in filter(is_free, _concerned(depsgraph)):
        settings = probe.tactile_probe
        _forget_deleted(probe)
        measure_shape(settings, depsgraph, reshaped)
        patch = patch_of(probe)
        outdated = is_outdated(probe, depsgraph)
        if outdated and settings.live:
            update(probe, depsgraph, complete=bpy.app.background)
        elif patch is not None and (outdated or probe in moved):  # on its way back, or scaled
            patch_object.hold(patch)
        if is_pending(probe) and not bpy.app.background:
            _settle_soon()


@persistent
def on_blend_import(imported):
    """Has a probe that was appended without its patch touch again; a linked one is its own file's."""
    for item in imported.import_items:
        if isinstance(item.id, bpy.types.Object) and is_probe(item.id) and item.id.library is None:
            item.id.tactile_probe.digest = ""


def _concerned(depsgraph):
    """The probes that something has happened to: to them, their patch or target, or to what is there."""
    updated = {u.id.original for u in depsgraph.updates}
    found = [obj for obj in depsgraph.view_layer.objects if is_probe(obj)]
    if any(isinstance(datablock, bpy.types.Scene | bpy.types.Collection) for datablock in updated):
        return found
    owners = {probe_of(datablock) for datablock in updated if isinstance(datablock, bpy.types.Object)}
    return [obj for obj in found if obj in owners or obj.tactile_probe.target in updated]


def _forget_deleted(probe):
    """A target that was deleted lives on as long as the probe points to it: lets go, so that it is gone."""
    settings, record = probe.tactile_probe, record_of(probe)
    target = settings.target
    # One that has never been touched is a script's, which may be about to put it into the scene.
    if target is None or target.users_scene or record is None or record["source"] != target.name:
        return
    settings.property_unset("target")
    if not target.users:
        bpy.data.objects.remove(target)


def is_pending(probe):
    """Whether what is dear is still to be filled in."""
    patch = patch_of(probe)
    return (
        patch is not None and not probe.tactile_probe.message and "vertices" not in patch[patch_object.RECORD]
    )


def _settle_soon():
    if bpy.app.timers.is_registered(_settle):
        bpy.app.timers.unregister(_settle)
    bpy.app.timers.register(_settle, first_interval=SETTLE)


def _settle():
    """Completes what the gesture has left, once it has ended; a timer."""
    windows = bpy.context.window_manager.windows
    running = [operator.bl_idname for window in windows for operator in window.modal_operators]
    if bpy.app.is_job_running("RENDER") or any(name.startswith(GESTURES) for name in running):
        return SETTLE
    for window in windows:
        with bpy.context.temp_override(window=window):
            depsgraph = bpy.context.evaluated_depsgraph_get()
            for probe in filter(is_probe, window.view_layer.objects):
                if is_pending(probe) and is_free(probe):
                    update(probe, depsgraph, complete=True)
    return None


def register():
    bpy.app.handlers.depsgraph_update_post.append(on_depsgraph_update)
    bpy.app.handlers.blend_import_post.append(on_blend_import)


def unregister():
    if bpy.app.timers.is_registered(_settle):
        bpy.app.timers.unregister(_settle)
    bpy.app.handlers.blend_import_post.remove(on_blend_import)
    bpy.app.handlers.depsgraph_update_post.remove(on_depsgraph_update)
