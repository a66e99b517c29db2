# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The inputs of a touch, as the operators and the probes have them."""

import math
from contextlib import contextmanager

from bpy.app.translations import pgettext_iface as iface
from bpy.props import EnumProperty, FloatProperty, FloatVectorProperty, IntProperty, StringProperty
from bpy.types import Object

from ... import core

METHODS = [
    (
        "bayes",
        "Bayesian",
        "Fit all coefficients and the frame together, and say what the contacts leave open; the "
        "most accurate",
    ),
    (
        "tagc",
        "Total Curvature",
        "The paper's fit: stay close to the contacts and fold as little as possible",
    ),
    (
        "quadratic-variation",
        "Quadratic Variation",
        "Stay close to the contacts and bend as little as possible",
    ),
    (
        "least-squares",
        "Least Squares",
        "Stay closest to the contacts, whatever the surface does between the curves",
    ),
]
SOLVERS = [
    ("fast", "Fast", "Newton's method"),
    ("descent", "Steepest Descent", "The paper's minimization: slower, for comparison"),
]
AUTO = {  # literals, to be translated
    "extent": "Extent (Auto)",
    "step": "Step (Auto)",
    "degree": "Degree (Auto)",
    "spacing": "Spacing (Auto)",
    "tolerance": "Tolerance (Auto)",
    "edge": "Edge Length (Auto)",
}
MOST_PLANES = 6
STEEPEST = math.radians(60)  # Greatest tilt by mouse.
OVERRIDABLE = {"LIBRARY_OVERRIDABLE"}  # what the override of a library's probe keeps as its own


_is_silent = False


@contextmanager
def silent():
    """What is set within is looked at by nothing, as in a handler, which looks at it itself."""
    global _is_silent
    _is_silent = True
    try:
        yield
    finally:
        _is_silent = False


def is_silent():
    """Whether settings change within `silent`, where nothing answers."""
    return _is_silent


def changed(settings, context):
    """Has the handler look at a probe at once, so that the patch is part of the same undo step."""
    if not _is_silent and isinstance(settings.id_data, Object) and settings.is_probe:
        settings.id_data.update_tag()
        context.view_layer.update()


KEPT = {"update": changed, "override": OVERRIDABLE}  # what a probe's properties have beside an operator's
UNSAVED = {"SKIP_SAVE", "SKIP_PRESET"}
TARGET = StringProperty(
    name="Target",
    description="Name of the mesh object to touch; empty for the active object",
    options=UNSAVED,
)
LOCATION = FloatVectorProperty(
    name="Location",
    subtype="TRANSLATION",
    description="Where to touch; if not set, the 3D cursor",
    options=UNSAVED,
)


def length_property(name, description, **more):
    """A length of 0 or more, in units of the scene."""
    return FloatProperty(name=name, description=description, subtype="DISTANCE", soft_min=0.0, **more)


NOISE = length_property("Noise", "Standard deviation of the simulated sensor", precision=4, **KEPT)


class FitSettings:
    """Mixed into operators and property groups."""

    method: EnumProperty(
        name="Method",
        description="How to fit the patch",
        items=METHODS,
        **KEPT,
    )
    degree: IntProperty(
        name="Degree",
        description="Degree of the polynomial, 2 to 6; 0 chooses the lowest that describes what the "
        "contacts show",
        default=0,
        min=0,
        max=6,
        **KEPT,
    )
    weight: FloatProperty(
        name="Weight",
        description="Weight of the contacts against smoothness in the two fits by curvature; 0 "
        "chooses one for the method",
        default=0.0,
        soft_min=0.0,
        soft_max=1e5,
        **KEPT,
    )
    solver: EnumProperty(
        name="Solver",
        description="How to minimize the curvature",
        items=SOLVERS,
        **KEPT,
    )


class TouchSettings(FitSettings):
    """FitSettings with the planes, lengths and noise of a touch: in units of the world, and in radians."""

    plane_count: IntProperty(
        name="Planes",
        description="Number of sampling planes to feel along",
        default=3,
        min=3,
        max=MOST_PLANES,
        **KEPT,
    )
    azimuths: FloatVectorProperty(
        name="Azimuths",
        description="Directions of the sampling planes, as angles about the normal",
        size=MOST_PLANES,
        unit="ROTATION",
        default=[math.radians(a) for a in (0, 60, 120, 30, 90, 150)],
        **KEPT,
    )
    tilts: FloatVectorProperty(
        name="Tilts",
        description="Angles by which the sampling planes lean away from the normal",
        size=MOST_PLANES,
        unit="ROTATION",
        soft_min=-STEEPEST,
        soft_max=STEEPEST,
        **KEPT,
    )
    extent: length_property(
        "Extent",
        "Distance to feel on either side of the point; 0 goes as far as a patch can be trusted, in "
        "a map an eighth of the object's size",
        **KEPT,
    )
    step: length_property(
        "Step", "Distance between contacts; 0 chooses it so that more contacts would add little", **KEPT
    )
    noise: NOISE
    seed: IntProperty(
        name="Seed",
        description="Seed of the noise: the same seed gives the same contacts",
        min=0,
        **KEPT,
    )


NAMES = (*TouchSettings.__annotations__, *FitSettings.__annotations__)


def touch_arguments(settings):
    """What touch() takes of `settings`, an operator or a probe's."""
    count = settings.plane_count
    pairs = zip(settings.azimuths[:count], settings.tilts[:count], strict=True)
    return {
        "planes": [core.SamplingPlane(*pair) for pair in pairs],
        "degree": settings.degree or "auto",
        **{name: getattr(settings, name) for name in ("extent", "step", "noise", "seed")},
        "weight": settings.weight or None,
        **{name: getattr(settings, name) for name in ("method", "solver")},
    }


def draw_chosen(layout, settings, name, found=None, fields=None):
    """A number that the surface chooses where it is 0, which the label says, with what it has `found`.

    fields : other properties by which lengths are shown, by name, with what was found for their value
    """
    shown = (fields or {}).get(name, name)
    if getattr(settings, name):
        layout.prop(settings, shown)
    elif shown != name:  # its value is what was found
        layout.prop(settings, shown, text=AUTO[name])
    elif found and found.get(name):
        row = layout.row()
        row.use_property_split = False  # for the label, which takes the width it needs
        row.prop(settings, name, text=f"{iface(AUTO[name])} {found[name]}", translate=False)
    else:
        layout.prop(settings, name, text=AUTO[name])


def draw_sensor(layout, settings, found=None, fields=None):
    """The rows of the step and the noise; `found` and `fields` as in draw_chosen."""
    draw_chosen(layout, settings, "step", found, fields)
    layout.prop(settings, (fields or {}).get("noise", "noise"))
    if settings.noise:
        layout.prop(settings, "seed")


def draw_solver(layout, settings, found=None, fields=None):
    """The rows of the method, and of what it has; `found` and `fields` as in draw_chosen."""
    layout.prop(settings, "method")
    draw_chosen(layout, settings, "degree", found, fields)
    if settings.method in ("tagc", "quadratic-variation"):
        layout.prop(settings, "weight")


def draw_all(layout, settings, fields=None):
    """Everything, with nothing folded away, as Adjust Last Operation has it; `fields` as in draw_chosen."""
    draw_chosen(layout, settings, "extent", fields=fields)
    layout.prop(settings, "plane_count")
    for i in range(settings.plane_count):
        column = layout.column(align=True)
        column.prop(settings, "azimuths", index=i, text=f"Azimuth {i + 1}")
        column.prop(settings, "tilts", index=i, text="Tilt")
    draw_sensor(layout, settings, fields=fields)
    draw_solver(layout, settings)
