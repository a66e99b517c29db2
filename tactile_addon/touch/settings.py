# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The settings of a touch, which operators and probes have in common."""

import math
from typing import Any

import bpy
from bpy.props import EnumProperty, FloatProperty, FloatVectorProperty, IntProperty, StringProperty

from ... import core
from .within import Within

METHODS = [
    (
        "bayes",
        "Bayesian",
        "Fit all coefficients and the frame together, and say what the contacts leave open; the "
        "most accurate",
    ),
    ("tagc", "Total Curvature", "The paper's fit: stay close to the contacts and fold as little as possible"),
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
AUTO = {  # These are literals, so that they can be translated.
    "extent": "Extent (Auto)",
    "step": "Step (Auto)",
    "degree": "Degree (Auto)",
    "spacing": "Spacing (Auto)",
    "tolerance": "Tolerance (Auto)",
    "edge": "Edge Length (Auto)",
}
MOST_PLANES = 6
STEEPEST = math.radians(60)  # The mouse tilts planes by no more.
OVERRIDABLE: set[Any] = {"LIBRARY_OVERRIDABLE"}  # The override of a library's probe keeps these as its own.
silent = Within()  # Within this context, no handler looks at what changes: the caller touches again.


def changed(settings: Any, context: bpy.types.Context) -> None:
    """Makes the depsgraph handler look at a probe at once, so that the patch is in the same undo step.

    Blender calls this when a property with it as `update` changes; operators' settings are passed over.
    """
    if not silent.is_on and isinstance(settings.id_data, bpy.types.Object) and settings.is_probe:
        settings.id_data.update_tag()
        context.view_layer.update()


KEPT = {"update": changed, "override": OVERRIDABLE}  # A probe's properties need these, an operator's do not.
UNSAVED: set[Any] = {"SKIP_SAVE", "SKIP_PRESET"}
TARGET = StringProperty(
    name="Target",
    description="Name of the mesh object to touch; empty for the active object",
    options=UNSAVED,
)


def length_property(name: str, description: str, **more: Any) -> Any:
    """A property for a length of 0 or more, shown in the unit of the scene."""
    return FloatProperty(name=name, description=description, subtype="DISTANCE", soft_min=0.0, **more)


NOISE = length_property("Noise", "Standard deviation of the simulated sensor", precision=4, **KEPT)


class FitSettings:
    """The settings of a fit, for operators and property groups to inherit."""

    method: EnumProperty(name="Method", description="How to fit the patch", items=METHODS, **KEPT)
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
    solver: EnumProperty(name="Solver", description="How to minimize the curvature", items=SOLVERS, **KEPT)


class TouchSettings(FitSettings):
    """The settings of a touch: those of the fit, planes, lengths in units of the world, angles in radians."""

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
        "Distance to feel on either side of the point; 0 goes as far as a patch can be trusted",
        **KEPT,
    )
    step: length_property(
        "Step", "Distance between contacts; 0 chooses it so that more contacts would add little", **KEPT
    )
    noise: NOISE
    seed: IntProperty(
        name="Seed", description="Seed of the noise: the same seed gives the same contacts", min=0, **KEPT
    )


class PlacedTouch(TouchSettings):
    """The settings of one touch at a place, for operators to inherit."""

    target: TARGET
    location: FloatVectorProperty(
        name="Location",
        subtype="TRANSLATION",
        description="Where to touch; if not set, the 3D cursor",
        options=UNSAVED,
    )
    outward: FloatVectorProperty(
        name="Outward",
        subtype="XYZ",
        description="The direction to touch from; if not set, the surface's own normal",
        options=UNSAVED,
    )


NAMES = (*TouchSettings.__annotations__, *FitSettings.__annotations__)


def given(operator: Any, name: str) -> list[float] | None:
    """The components of an operator's vector, or None if it is not set."""
    return list(getattr(operator, name)) if operator.properties.is_property_set(name) else None


def touch_arguments(settings: Any) -> dict[str, Any]:
    """The arguments for touch() from the settings of an operator or a probe."""
    count = settings.plane_count
    pairs = zip(settings.azimuths[:count], settings.tilts[:count], strict=True)
    return {
        "planes": [core.SamplingPlane(*pair) for pair in pairs],
        "degree": settings.degree or "auto",
        **{name: getattr(settings, name) for name in ("extent", "step", "noise", "seed")},
        "weight": settings.weight or None,
        **{name: getattr(settings, name) for name in ("method", "solver")},
    }


def draw_chosen(layout: bpy.types.UILayout, settings: Any, name: str) -> None:
    """Draws a setting; of a number that may be left to the surface, the one in use.

    So its row goes on being dragged once it is given. In the override of a library's probe that row is gray,
    so the setting itself has one.
    """
    is_auto, is_used = name in AUTO and not getattr(settings, name), hasattr(settings, f"used_{name}")
    is_gray = is_used and settings.id_data.override_library is not None
    if is_auto or (is_used and not is_gray):
        words: dict[str, Any] = {"text": AUTO[name]} if is_auto else {}
        layout.prop(settings, f"used_{name}" if is_used else name, **words)
    if is_gray or not (is_auto or is_used):
        layout.prop(settings, name)


def draw_noise(layout: bpy.types.UILayout, settings: Any) -> None:
    """Draws the rows of the noise of the simulated sensor."""
    layout.prop(settings, "noise")
    if settings.noise:
        layout.prop(settings, "seed")


def draw_fit(layout: bpy.types.UILayout, settings: Any) -> None:
    """Draws the rows of the method and of its options."""
    layout.prop(settings, "method")
    draw_chosen(layout, settings, "degree")
    if settings.method in ("tagc", "quadratic-variation"):
        layout.prop(settings, "weight")


def draw_all(layout: bpy.types.UILayout, settings: Any) -> None:
    """Draws all settings, as Adjust Last Operation has them."""
    draw_chosen(layout, settings, "extent")
    layout.prop(settings, "plane_count")
    for i in range(settings.plane_count):
        column = layout.column(align=True)
        column.prop(settings, "azimuths", index=i, text=f"Azimuth {i + 1}")
        column.prop(settings, "tilts", index=i, text="Tilt")
    draw_chosen(layout, settings, "step")
    draw_noise(layout, settings)
    draw_fit(layout, settings)
