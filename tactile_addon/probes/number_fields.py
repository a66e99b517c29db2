# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Lengths in panels and dialogs: dragged, they start from what was found and change by the object's size.

How fast the mouse changes a number is a constant of Blender's property. So there is one more property for
each power of ten, which shows and sets the length itself, and a panel takes the one that suits the object.
"""

import math
from collections.abc import Callable, Mapping
from inspect import get_annotations
from typing import Any

import bpy
from bpy.props import FloatProperty, IntProperty

from ..touch.types import Object

# What a pixel changes a length by, as a share of the object's size.
PACES = {
    "extent": 1.5e-3, "spacing": 5e-4, "step": 1.5e-4, "edge": 1.5e-4, "noise": 1.5e-5, "tolerance": 1.5e-5
}  # fmt: skip
DECADES = range(-6, 7)  # The powers of ten of the properties' steps.
MOST_DIGITS = 6  # Blender's properties have no more after the point.
HIDDEN_UNSAVED: set[Any] = {"HIDDEN", "SKIP_SAVE", "SKIP_PRESET"}
# Blender's units of length in meters, each with the least length that Blender shows in it.
LENGTH_UNITS = {
    "METRIC": ((1e3, 1e3), (1.0, 1.0), (1e-2, 1e-2), (1e-3, 1e-4), (1e-6, 1e-6)),
    "IMPERIAL": ((1609.344, 1609.344), (0.3048, 0.3048), (0.0254, 0.0254), (2.54e-5, 2.54e-5)),
}
WHOLE = {"METRIC": 1.0, "IMPERIAL": 0.3048}  # Lengths below all of these are shown in these units.


def annotations(cls: type, found: Callable[[Object, str], float] = lambda owner, name: 0.0) -> dict[str, Any]:
    """The additional properties for the lengths of a property group or operator, by name.

    found : function of an object and the name of a number; gives the value that was found for 0
    """
    given = {name: kind for base in reversed(cls.__mro__) for name, kind in get_annotations(base).items()}
    return {
        _name(name, decade): _field(name, given[name].keywords, decade, found)
        for name in PACES.keys() & given.keys()
        for decade in DECADES
    }


def dragged(cls: type[Any]) -> type[Any]:
    """Decorates an operator that shows its lengths through `fields`, and that Blender does not register.

    Blender's log of registered operators would list each of these properties.
    """
    cls.__annotations__.update(annotations(cls))
    return cls


def fields(size: float) -> dict[str, str]:
    """By the names of lengths, those of the properties that show them for an object of this size."""
    size = size if 0.0 < size < math.inf else 1.0

    def fitting(pace: float) -> int:
        return min(DECADES, key=lambda decade: abs(math.log(pace_of(decade) / (pace * size))))

    return {name: _name(name, fitting(pace)) for name, pace in PACES.items()}


def pace_of(decade: int) -> float:
    """What a pixel changes a property of this step by in the open scene, as Blender's ui_get_but_step_unit.

    Blender makes it one unit that suits ten pixels, unless this is the unit of the number 1.
    """
    settings, step = bpy.context.scene.unit_settings, 0.01 * 10.0**decade
    if settings.system == "NONE":
        return step
    scale = settings.scale_length
    unit, own = (_unit_of(settings.system, meters) for meters in (10.0 * step * scale, scale))
    return unit / scale * (step if unit == own else 1.0)


def _unit_of(system: str, meters: float) -> float:
    """The length in meters of the unit in which Blender shows a length in meters."""
    found = (unit for unit, least in LENGTH_UNITS[system] if meters >= least * (1.0 - 1e-4))
    return next(found, WHOLE[system])


def _name(name: str, decade: int) -> str:
    return f"{name}_by_{'m' if decade < 0 else ''}{abs(decade)}"


def degree_field(given: Mapping[str, Any], found: Callable[[Object, str], float]) -> Any:
    """The property that shows the degree that was found, and sets the property with the keywords `given`."""
    return IntProperty(
        **{key: given[key] for key in ("name", "description", "min", "max")},
        options=HIDDEN_UNSAVED,
        get=lambda settings: settings.degree or int(found(settings.id_data, "degree")),
        set=lambda settings, value: setattr(settings, "degree", value),
    )


def _field(name: str, given: Mapping[str, Any], decade: int, found: Callable[[Object, str], float]) -> Any:
    return FloatProperty(
        **{key: given[key] for key in ("name", "description", "subtype", "soft_min")},
        # Without units Blender writes no more digits, however small the number is.
        precision=max(given.get("precision", 2), min(1 - decade, MOST_DIGITS)),
        step=10.0**decade,
        options=HIDDEN_UNSAVED,
        get=lambda settings: getattr(settings, name) or found(settings.id_data, name),
        set=lambda settings, value: setattr(settings, name, value),
    )
