# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Children of objects: Blender looks through all objects for those of one, here through all once for many."""

from contextlib import contextmanager

import bpy

_remembered = None  # within `remembered`, the children by their parents; empty before anybody has asked


def children_of(obj):
    """A list of the children of an object."""
    if _remembered is None:
        return list(obj.children)
    if not _remembered:
        for child in bpy.data.objects:
            if child.parent is not None:
                _remembered.setdefault(child.parent, []).append(child)
    return _remembered.get(obj, [])


def add(child):
    """Notes a new object that has got a parent, or may have."""
    if _remembered and child.parent is not None:
        _remembered.setdefault(child.parent, []).append(child)


@contextmanager
def remembered():
    """Who is whose child is looked up once; no object may be deleted meanwhile."""
    global _remembered
    outer = _remembered
    _remembered = {} if outer is None else outer
    try:
        yield
    finally:
        _remembered = outer
