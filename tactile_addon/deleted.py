# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What was deleted beneath a probe, and what undo brings back."""

import bpy

from .probe.probe import record_of
from .touch.settings import silent

_deleted = set()  # session_uids


def forget_target(probe):
    """A target that was deleted lives on as long as the probe points to it: lets go, so that it is gone.

    The step of undo was stored before, and undo takes back only what differs between two steps: so which one
    it was is kept, for `relink`.
    """
    settings, record = probe.tactile_probe, record_of(probe)
    target = settings.target
    # One that has never been touched is a script's, which may be about to put it into the scene.
    # A library's is not deleted by being in no scene of this file.
    if target is None or target.users_scene or not target.is_editable:
        return
    if record is None or record["source"] != target.name:
        return
    settings.lost = f"{target.session_uid} {target.name}"
    settings.property_unset("target")
    if not target.users:  # A handler may not delete what is being evaluated.
        _deleted.add(target.session_uid)
        # Without a window no timer runs, and one that is left keeps Blender's module from ending.
        if not bpy.app.background and not bpy.app.timers.is_registered(remove):
            bpy.app.timers.register(remove)


def relink(probe):
    """Has the probe point again to the target that it lost, where undo has brought that back."""
    settings = probe.tactile_probe
    if settings.target is not None or not settings.lost:
        return
    number, _, name = settings.lost.partition(" ")
    target = bpy.data.objects.get(name)
    if target is not None and str(target.session_uid) == number and target.users_scene:
        with silent():
            settings.target = target


def remove():
    """Takes away the objects that were deleted and that no probe points to any more; a timer."""
    for obj in [obj for obj in bpy.data.objects if obj.session_uid in _deleted and not obj.users]:
        bpy.data.objects.remove(obj)
    _deleted.clear()
