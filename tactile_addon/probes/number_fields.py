# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Lengths as the panel has them: dragged, they move by the object's size, from what a touch has found.

By how much the mouse moves a number is a constant of Blender's property, so there is one more property for
each power of ten, which shows and sets the length itself; the panel takes the one that suits the object.
"""

import math

from bpy.props import FloatProperty

from ..touch.settings import TouchSettings

DECADES = range(-6, 6)  # of the object's size
STEPS = {"extent": 0.15, "step": 0.015, "noise": 0.0015}  # of the object's size; a pixel moves 1/100 of it


def annotations(found):
    """Those of a property group with TouchSettings: the properties besides its own, by name.

    found : gives for an object and the name of a length what was found in the place of 0
    """
    return {_name(name, decade): _field(name, decade, found) for name in STEPS for decade in DECADES}


def fields(size):
    """The names of the properties that the panel shows lengths by, for an object of that size, by length."""
    decade = math.floor(math.log10(size) + 0.5) if 0.0 < size < math.inf else 0
    return {name: _name(name, min(max(decade, DECADES[0]), DECADES[-1])) for name in STEPS}


def _name(name, decade):
    return f"{name}_by_{'m' if decade < 0 else ''}{abs(decade)}"


def _field(name, decade, found):
    given = TouchSettings.__annotations__[name].keywords
    shown = {key: given[key] for key in ("name", "description", "subtype", "soft_min")}
    return FloatProperty(
        **shown,
        precision=given.get("precision", 2),
        step=STEPS[name] * 10.0**decade,
        options={"HIDDEN"},
        get=lambda settings: getattr(settings, name) or found(settings.id_data, name),
        set=lambda settings, value: setattr(settings, name, value),
    )
