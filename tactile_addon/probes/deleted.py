# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What was deleted beneath a probe, and what undo brings back."""

import bpy

from ..scene import patch_object, patch_record
from ..scene.viewports import has_gesture
from ..touch.settings import silent
from . import anchor
from .probe import DIGEST, is_result

LATER = 0.25  # seconds until another look at whether a gesture has ended
_deleted = set()  # session_uids of targets
_owners = {}  # those of contours, and of the patches they were seen with last: undo may bring them back


def forget_target(probe):
    """A target that was deleted lives on as long as the probe points to it: lets go, so that it is gone.

    The step of undo was stored before, and undo takes back only what differs between two steps: so which one
    it was is kept, for `relink`.
    """
    settings = probe.tactile_probe
    target = settings.target
    if target is None or target.users_scene:
        return
    if not target.is_editable or target.override_library is not None:
        _follow(probe, target)
        return
    # One that has never been touched is a script's, which may be about to put it into the scene.
    if not settings.digest:
        return
    settings.lost = f"{target.session_uid} {int(anchor.is_attached(probe))} {target.name}"
    if anchor.is_attached(probe):  # to an object that is in no scene any more
        anchor.detach(probe)
    settings.property_unset("target")
    if not target.users:
        _deleted.add(target.session_uid)
        _remove_soon()


def _follow(probe, target):
    """A library's object is not deleted by being in no scene of this file: its override may be, or its own.

    The override takes the place of the object it is of, unless it was made for the probe's sake alone.
    """
    if target.override_library is not None:
        there = [target.override_library.reference]
    else:
        overrides = (obj for obj in bpy.data.objects if obj.override_library is not None)
        there = [obj for obj in overrides if obj.override_library.reference == target]
    found = next((obj for obj in there if obj.users_scene), None)
    if found is None:
        return
    was_attached = anchor.is_attached(probe)
    with silent():
        probe.tactile_probe.target = found
    if was_attached:
        anchor.attach(probe, found)


def _remove_soon():
    """Has `remove` called later: a handler may not delete what is being evaluated."""
    # Without a window no timer runs, and one that is left keeps Blender's module from ending.
    if not bpy.app.background and not bpy.app.timers.is_registered(remove):
        bpy.app.timers.register(remove)


def relink(probe):
    """Has the probe point again to the target that it lost, where undo has brought that back."""
    settings = probe.tactile_probe
    if settings.target is not None or not settings.lost:
        return
    number, was_attached, name = settings.lost.split(" ", 2)
    target = bpy.data.objects.get(name)
    if target is not None and str(target.session_uid) == number and target.users_scene:
        with silent():
            settings.target = target
        if int(was_attached) and probe.parent is None:
            anchor.attach(probe, target)


def has_contours():
    """Whether contours were seen that may lose their patch."""
    return bool(_owners)


def look_for_contours():
    """Has the contours go whose patch was deleted: without its coordinates they mean nothing."""
    there = {obj.session_uid: obj for obj in bpy.data.objects}
    for number, obj in there.items():
        if patch_record.CONTOURS in obj and obj.parent is not None:
            _owners[number] = obj.parent.session_uid
    if any(_is_left(obj, there) for obj in there.values()) or _unused_meshes():
        _remove_soon()


def _is_left(obj, there):
    """Whether it is contours whose patch is no longer there, but was."""
    owner = _owners.get(obj.session_uid)
    return owner is not None and owner not in there and obj.parent is None and obj.is_editable


def _is_data(datablock):
    """Whether it is an object or the like; scenes and windows see by themselves that one is gone."""
    kinds = bpy.types.Scene | bpy.types.Screen | bpy.types.WindowManager | bpy.types.WorkSpace
    return not isinstance(datablock, kinds)


def _unused_meshes():
    return [mesh for mesh in bpy.data.meshes if DIGEST in mesh and not mesh.users]


def remove():
    """Takes away what was deleted, and what nothing is left of but a datablock that nobody uses; a timer."""
    if has_gesture():
        return LATER
    there = {obj.session_uid: obj for obj in bpy.data.objects}
    gone = [there[number] for number in _deleted if number in there and not there[number].users]
    # Children and modifiers point to an object without being its users, and undo may leave them as they are:
    # it would bring back the object, and not these links.
    pointing = bpy.data.user_map(subset=gone) if gone else {}
    gone = [obj for obj in gone if not any(map(_is_data, pointing.get(obj, ())))]
    left = [obj for obj in there.values() if _is_left(obj, there) and is_result(obj)]
    _deleted.clear()
    patch_object.remove_objects(left)
    for obj in gone:
        bpy.data.objects.remove(obj)
    patch_object.remove_meshes(_unused_meshes())
    return None
