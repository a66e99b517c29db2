# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The children of objects.

Blender looks through all objects for the children of one; this looks once for many.
"""

from collections.abc import Iterator
from contextlib import contextmanager

import bpy

from ..touch.types import Object

# Within `remembered`, the children by their parents; empty until it is needed.
_remembered: dict[Object, list[Object]] | None = None


def children_of(obj: Object) -> list[Object]:
    """The list of an object's children."""
    if _remembered is None:
        return list(obj.children)
    if not _remembered:
        for child in bpy.data.objects:
            if child.parent is not None:
                _remembered.setdefault(child.parent, []).append(child)
    return _remembered.get(obj, [])


def add(child: Object) -> None:
    """Notes a new object that has a parent or may have one."""
    if _remembered and child.parent is not None:
        _remembered.setdefault(child.parent, []).append(child)


@contextmanager
def remembered() -> Iterator[None]:
    """Within this context, children are looked up once; no object may be deleted meanwhile."""
    global _remembered
    outer = _remembered
    _remembered = {} if outer is None else outer
    try:
        yield
    finally:
        _remembered = outer
