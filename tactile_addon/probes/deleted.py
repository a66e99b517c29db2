# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What was deleted beneath a probe or with patches, and what undo brings back."""

from typing import Any

import bpy
from bpy.app.handlers import persistent

from ..scene import patch_object
from ..touch.settings import silent
from ..touch.types import Object
from . import anchor

# Datablocks that drop a deleted object by themselves.
WINDOW_DATA = bpy.types.Scene | bpy.types.Screen | bpy.types.WindowManager | bpy.types.WorkSpace
targets: set[int] = set()  # The session_uids of deleted targets, until `remove`.


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
    targets.add(target.session_uid)


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


@persistent
def remove(*_: Any) -> None:
    """Removes deleted targets and empty collections if nobody uses them.

    A timer calls it, because a handler may not delete what is being evaluated, and so does a file that is
    saved, as there are no timers without a window.
    """
    gone: list[Any] = [o for o in bpy.data.objects if o.session_uid in targets and not o.users]
    gone += patch_object.empty_collections()
    # Children, modifiers and collections point to an object or a collection. Undo may leave them as they are,
    # and would then bring that back, but not these links. A scene it brings back, because its objects differ.
    pointing = bpy.data.user_map(subset=gone) if gone else {}
    gone = [block for block in gone if all(isinstance(user, WINDOW_DATA) for user in pointing.get(block, ()))]
    targets.clear()
    bpy.data.batch_remove(gone)
