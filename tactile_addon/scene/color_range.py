# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The range of a patch's colors when it is given, by hand or as the common range of several patches."""

import bpy
from bpy.props import FloatProperty

from ..touch import units
from . import patch_object
from .patch_record import POWERS, RANGE, RECORD, report_of, require_whole


def unit_of_range(patch, scene):
    """The power of length in the quantity that a patch shows, and the unit of its legend."""
    report = report_of(patch)
    unit = ("", 1.0) if report is None else units.unit_of(scene, report["radius"])
    return POWERS[patch.tactile_colors], unit


def share(patch, patches):
    """Gives all `patches` that show what `patch` shows the largest of their ranges; returns how many."""
    same = [other for other in patches if other.tactile_colors == patch.tactile_colors and _is_whole(other)]
    for other in same:
        set_range(other, 0.0)
    limit = max((other[RECORD]["color_limit"] for other in same), default=0.0)
    for other in same:
        set_range(other, limit)
    return len(same)


def set_range(patch, limit):
    """Gives the colors of a patch this range, in units of the world; with 0 the values choose it."""
    patch[RANGE] = limit
    if limit <= 0.0:
        del patch[RANGE]
    if _is_whole(patch):
        patch_object.recolor(patch)


def _is_whole(obj):
    if RECORD not in obj or not obj.is_editable:
        return False
    try:
        require_whole(obj)
    except ValueError:
        return False
    return True


def _get(obj):
    power, unit = unit_of_range(obj, bpy.context.scene)
    limit = obj.get(RANGE) or (report_of(obj) or {}).get("color_limit", 0.0)
    return limit / unit[1] ** power


def _set(obj, value):
    power, unit = unit_of_range(obj, bpy.context.scene)
    set_range(obj, value * unit[1] ** power)


def register():
    bpy.types.Object.tactile_range = FloatProperty(
        name="Range",
        description="Value at which the colors of the patch end, in the unit of the legend; 0 "
        "chooses it by the values",
        min=0.0,
        precision=4,
        step=0.1,  # It is small beside usual values in a unit that suits the patch.
        get=_get,
        set=_set,
    )


def unregister():
    del bpy.types.Object.tactile_range
