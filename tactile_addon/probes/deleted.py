# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What was deleted beneath a probe, and what undo brings back."""

import bpy

from ..scene.viewports import has_gesture
from ..touch.settings import silent
from ..touch.types import Object
from . import anchor

# Datablocks that drop a deleted object by themselves.
WINDOW_DATA = bpy.types.Scene | bpy.types.Screen | bpy.types.WindowManager | bpy.types.WorkSpace
LATER = 0.25  # The seconds after which it is checked again whether a gesture has ended.
_deleted: set[int] = set()  # The session_uids of deleted targets.


def forget_target(probe: Object) -> None:
    """Clears a probe's target if it was deleted, because it lives on as long as the probe points to it.

    The undo step was stored before, and undo takes back only what differs between two steps. So the probe
    keeps which target it was, for `relink`.
    """
    settings = probe.tactile_probe
    target = settings.target
    if target is None or target.users_scene:
        return
    if not target.is_editable or target.override_library is not None:
        _follow(probe, target)
        return
    # If it was never touched, a script may be about to put it into the scene.
    if not settings.digest:
        return
    settings.lost = f"{target.session_uid} {int(anchor.is_attached(probe))} {target.name}"
    if anchor.is_attached(probe):  # The object is in no scene any more.
        anchor.attach(probe, None)
    settings.property_unset("target")
    if not target.users:
        _deleted.add(target.session_uid)
        remove_soon()


def _follow(probe: Object, target: Object) -> None:
    """Follows a library's object, which is not deleted if it is in no scene of this file.

    Its override may be in a scene, or it may be in one of its own file. The override takes the place of the
    object, unless it was made only because the probe refers to the object.
    """
    source = _source(target)
    found = next((obj for obj in bpy.data.objects if obj.users_scene and _source(obj) == source), None)
    if found is None:
        return
    was_attached = anchor.is_attached(probe)
    with silent():
        probe.tactile_probe.target = found
    if was_attached:
        anchor.attach(probe, found)


def _source(obj: Object) -> Object:
    """The object of a library that another overrides, or the object itself."""
    return obj if obj.override_library is None else obj.override_library.reference


def remove_soon() -> None:
    """Calls `remove` later in a window, because a handler may not delete what is being evaluated."""
    # Without a window no timer runs, and a registered one keeps Blender's module from ending.
    if not bpy.app.background and not bpy.app.timers.is_registered(remove):
        bpy.app.timers.register(remove)


def relink(probe: Object) -> None:
    """Makes the probe point again to the target that it lost, if undo has brought that back."""
    settings = probe.tactile_probe
    if settings.target is not None or not settings.lost:
        return
    number, was_attached, name = settings.lost.split(" ", 2)
    target: Object = bpy.data.objects.get(name)
    if target is not None and str(target.session_uid) == number and target.users_scene:
        with silent():
            settings.target = target
        if int(was_attached) and probe.parent is None:
            anchor.attach(probe, target)


def remove() -> float | None:
    """Removes the targets that were deleted if nobody uses them; Blender calls it as a timer."""
    if has_gesture():
        return LATER
    there = {obj.session_uid: obj for obj in bpy.data.objects}
    gone = [there[number] for number in _deleted if number in there and not there[number].users]
    # Children and modifiers point to an object without being its users. Undo may leave them as they are, and
    # would then bring back the object, but not these links.
    pointing = bpy.data.user_map(subset=gone) if gone else {}
    gone = [obj for obj in gone if all(isinstance(user, WINDOW_DATA) for user in pointing.get(obj, ()))]
    _deleted.clear()
    for obj in gone:
        bpy.data.objects.remove(obj)
    return None
