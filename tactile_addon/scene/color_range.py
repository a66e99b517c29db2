# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The range of the colors of a patch or a whole object when it is given, by hand or as that of several."""

from collections.abc import Iterable
from typing import Any

import bpy
from bpy.props import FloatProperty

from ..touch import units
from ..touch.types import Object
from ..touch.units import Unit
from . import shown
from .patch_record import ATLAS_RECORD, POWERS, RANGE, RECORD, is_colored, report_of

LEAST_DRAWN, SMALL = 1e-3, 1e-6  # Ranges below the first are drawn in units of the second,
MOST_DRAWN, LARGE = 1e5, 1e6  # and those above this one in units of that.


def unit_of_range(patch: Object, scene: bpy.types.Scene) -> tuple[int, Unit]:
    """The power of length in the quantity that a patch or whole object shows, and the unit of its legend."""
    report, power = _record(patch), POWERS[patch.tactile_colors]
    return power, ("", 1.0) if report is None else units.unit_of_colors(scene, report, power)


def share(patch: Object, patches: Iterable[Object]) -> int:
    """Gives all `patches` that show what `patch` shows the largest of their ranges; returns how many."""
    same = [
        other
        for other in patches
        if RECORD in other
        and other.tactile_colors == patch.tactile_colors
        and is_colored(other)
        and other.is_editable
    ]
    for other in same:
        set_range(other, 0.0)
    limit = max((other[RECORD]["color_limit"] for other in same), default=0.0)
    for other in same:
        set_range(other, limit)
    return len(same)


def set_range(patch: Object, limit: float) -> None:
    """Gives the colors of a patch this range, in units of the world; with 0 the values choose it."""
    patch[RANGE] = limit
    if limit <= 0.0:
        del patch[RANGE]
    if is_colored(patch) and patch.is_editable:
        shown.recolor(patch)


def _record(obj: Object) -> Any:
    """The report of a patch or a whole object, or None."""
    return obj[ATLAS_RECORD] if ATLAS_RECORD in obj else report_of(obj)


def range_field(obj: Object) -> tuple[str, str]:
    """The property to draw for the range, and the factor in its label: a field has some seven digits."""
    if obj.tactile_range < LEAST_DRAWN:
        return "tactile_small_range", "1e-6"
    return ("tactile_large_range", "1e6") if obj.tactile_range > MOST_DRAWN else ("tactile_range", "")


def _get(obj: Object) -> float:
    power, unit = unit_of_range(obj, bpy.context.scene)
    limit = obj.get(RANGE) or (_record(obj) or {}).get("color_limit", 0.0)
    return limit / unit[1] ** power


def _set(obj: Object, value: float) -> None:
    power, unit = unit_of_range(obj, bpy.context.scene)
    set_range(obj, value * unit[1] ** power)


def _field(name: str, unit: float) -> Any:
    """A property of the range in this share of the legend's unit."""
    return FloatProperty(
        name=name,
        description="Value at which the colors end, in the unit of the legend; 0 chooses it by the values",
        min=0.0,
        precision=4,
        step=0.1,  # It is small compared with usual values in a unit that suits the patch.
        get=lambda obj: _get(obj) / unit,
        set=lambda obj, value: _set(obj, unit * value),
    )


# Properties of objects, by name.
PROPERTIES = {
    "tactile_range": _field("Range", 1.0),
    "tactile_small_range": _field("Range in Millionths", SMALL),
    "tactile_large_range": _field("Range in Millions", LARGE),
}
