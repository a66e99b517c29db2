# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What handlers and timers have added to the scene after an undo step was stored, so that no step has it.

Undo keeps each datablock that two steps have in common, with its pointers, and frees what is not in the step
that it goes to. A collection that holds a patch made by a handler would then point to freed memory. So all
that was added is unlinked before undo, and linked again afterward if it is still there.
"""

from collections.abc import Iterable
from typing import Any

import bpy
from bpy.app.handlers import persistent

from ..touch.types import Object
from ..touch.within import Within

after_step = Within()  # Within this context, what is added may be in no undo step.
_added: set[int] = set()  # The session_uids of objects and collections that were added.
# The session_uids of meshes, by those of the copies that have taken their places.
_replaced: dict[int, int] = {}
# Links that were taken out: a function that puts one back, and the session_uids of its arguments.
_links: list[tuple[Any, ...]] = []


def note_added(datablock: Object | bpy.types.Collection) -> None:
    """Notes a new object or collection that is linked to something that was there before."""
    if after_step.is_on:
        _added.add(datablock.session_uid)


def note_copied(obj: Object, mesh: bpy.types.Mesh) -> None:
    """Notes an object that got a copy of `mesh` instead of it."""
    if after_step.is_on:
        _replaced[obj.data.session_uid] = mesh.session_uid


@persistent
def take_out(*_: Any) -> None:
    """Unlinks what was added. It must be called before undo and redo."""
    _links.clear()
    if not (_added or _replaced):
        return
    for obj in [obj for obj in bpy.data.objects if obj.session_uid in _added]:
        for child in obj.children:
            _links.append((_set_parent, child.session_uid, obj.session_uid))
            child.parent = None
    for number, above in _collections().items():
        kinds: Any = above.objects, above.children
        for links in kinds:
            for block in [block for block in links if block.session_uid in _added]:
                _links.append((_link, block.session_uid, number))
                links.unlink(block)
    _give_back_meshes()


def _give_back_meshes() -> None:
    there = {mesh.session_uid: mesh for mesh in bpy.data.meshes} if _replaced else {}
    for obj in bpy.data.objects if there else ():
        before = obj.type == "MESH" and there.get(_replaced.get(obj.data.session_uid))
        if before:
            _links.append((_set_mesh, obj.session_uid, obj.data.session_uid, before.session_uid))
            obj.data = before


def put_back() -> None:
    """Links again what is still there. It must be called after undo and redo, and in another file."""
    datablocks: Iterable[Any] = (*bpy.data.objects, *bpy.data.meshes) if _links else ()
    there = {block.session_uid: block for block in datablocks} | _collections()
    for function, *numbers in reversed(_links):
        if all(number in there for number in numbers):
            function(*(there[number] for number in numbers))
    _links.clear()
    _added.clear()
    _replaced.clear()


def _set_mesh(obj: Object, copy: bpy.types.Mesh, before: bpy.types.Mesh) -> None:
    if obj.data == before:
        obj.data = copy


def _set_parent(child: Object, parent: Object) -> None:
    if child.parent is None:
        child.parent = parent


def _link(block: Object | bpy.types.Collection, above: bpy.types.Collection) -> None:
    links: Any = above.objects if isinstance(block, bpy.types.Object) else above.children
    if links.get(block.name) != block:
        links.link(block)


def _collections() -> dict[int, bpy.types.Collection]:
    """All collections by their session_uids, and the scenes' own collections by those of the scenes."""
    return {
        **{collection.session_uid: collection for collection in bpy.data.collections},
        **{scene.session_uid: scene.collection for scene in bpy.data.scenes},
    }
