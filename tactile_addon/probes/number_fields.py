# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Lengths that move by the object's size where they are dragged in the panel.

By how much the mouse moves a number is a constant of Blender's property, so there is one more property for
each power of ten, which sets the length itself; the panel takes the one that suits the object.
"""

import math

from bpy.props import FloatProperty

from ..touch.settings import OVERRIDABLE, TouchSettings

DECADES = range(-6, 6)  # of the object's size
STEPS = {"extent": 1e-2, "step": 1e-3, "noise": 1e-4}  # what two pixels change, of the object's size


def annotations():
    """Those of a property group with TouchSettings: the properties besides its own, by name."""
    return {_name(name, decade): _field(name, decade) for name in STEPS for decade in DECADES}


def fields(size):
    """The names of the properties that the panel shows lengths by, for an object of that size, by length."""
    decade = math.floor(math.log10(size) + 0.5) if 0.0 < size < math.inf else 0
    return {name: _name(name, min(max(decade, DECADES[0]), DECADES[-1])) for name in STEPS}


def _name(name, decade):
    return f"{name}_by_{'m' if decade < 0 else ''}{abs(decade)}"


def _field(name, decade):
    given = TouchSettings.__annotations__[name].keywords
    shown = {key: given[key] for key in ("name", "description", "subtype", "soft_min")}
    return FloatProperty(
        **shown,
        precision=given.get("precision", 2),
        step=STEPS[name] * 10.0**decade,
        options={"HIDDEN"},
        override=OVERRIDABLE,
        get=lambda settings: getattr(settings, name),
        set=lambda settings, value: setattr(settings, name, value),
    )
