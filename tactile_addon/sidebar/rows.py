# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""How the sidebar draws sentences, rows of numbers that have tooltips, and dots in the colors of planes."""

import re
import textwrap
from collections.abc import Sequence
from typing import Any

import blf
import bpy.utils.previews
import numpy as np
from bpy.props import StringProperty

from ..touch.types import Outcome
from ..viewport.curves import FONT, PLANE_COLORS
from ..viewport.overlay import TEXT

# About the width of a letter, and what is free around a text, in pixels at scale 1.
LETTER, PADDING = 6.5, 12.0
NARROW = 240  # A sidebar of fewer pixels at scale 1 has no room for two columns of numbers.
SIDE, RADIUS = 32, 10.0  # of the icon and of its dot, in pixels

TIPS = {
    "κ1": "The smaller principal curvature at the point; below 0 the surface bulges outward",
    "κ2": "The larger principal curvature at the point; below 0 the surface bulges outward",
    "Height": "Standard deviation of the height: how well the contacts determine it, on average",
    "At the Rim": "The largest on the rim, where deviations from the mesh are largest; … until you let go",
    "1/κ1": "Radius of the circle that bends like the surface along the first principal direction",
    "1/κ2": "Radius of the circle that bends like the surface along the second principal direction",
    "K Gaussian": "Gaussian curvature, κ1 times κ2: above 0 on domes and bowls, below 0 on saddles",
    "H Mean": "Mean curvature, the mean of κ1 and κ2",
    "Shape Index": "1 on caps, 0.5 on ridges, 0 on saddles, -0.5 in ruts, -1 in cups, – where it is flat",
    "Curvedness": "How strongly the surface bends, whatever its shape",
    "Farthest": "Largest distance from the patch to the mesh's vertices over it",
    "Extent": "How far the longest half curve reaches from the point",
    "Radius": "How far the contacts reach from the point",
    "Step": "Distance between contacts",
    "Degree": "Degree of the polynomial that describes the patch",
    "Contacts": "Number of contacts that the patch was fitted to",
    "Suggested Plane": "Azimuth of the sampling plane that would improve the patch most",
    "Expected Accuracy with It": "Standard deviation of the height expected with the suggested plane",
    "Fit Error": "Mean distance in height between contacts and patch, equation (6) of the paper",
    "Error on … More Curves": "The same for curves that are felt on the mesh between the sampling planes",
    "Total Curvature": "Absolute Gaussian curvature summed over the patch: 0 where it is flat or rolled",
    "Overlap": "Share of the patch's area that has mesh below it",
    "Largest Deviation": "Largest distance of a vertex of the patch from the mesh, as the colors show it",
    "Touches": "Number of touches that the object took",
    "Surface": "Closed: felt all round; Open: the object ends there; Incomplete: touches could go on",
    "Felt": "Share of the object's area that the surface is within the tolerance of",
    "Tolerance": "Standard deviation to reach for the height of each patch",
    "Deviation": "Mean distance from the mesh, that of a patch in height; – if no mesh is below",
    "Edge Length": "Typical length of the surface's edges, at most about a quarter of the thinnest wall",
    "Vertices": "Number of vertices of the surface",
    "Points": "Number of points of the mesh that were touched",
    "Spacing": "Distance between the points that were touched",
    "Patches": "Number of touches that gave a patch",
    "No Patch": "Number of touches that gave no patch, by reason",
    "… in Doubt": "Number of these patches that are in doubt",
    "… on Facets": "Number of these that have the curvature of facets, not of the shape",
    "Without Curvature": "Number of vertices whose curvatures are unknown, beside edges and rims",
}
_icons = None


def tip_of(label: str) -> str:
    """What a row's label means, or "" if that goes without saying."""
    return TIPS.get(re.sub(r"(?<= )\d+", "…", label), "")


class TACTILE_OT_copy_value(bpy.types.Operator):
    """Copy this number"""

    bl_idname = "tactile.copy_value"
    bl_label = "Copy Value"
    bl_options = {"INTERNAL"}

    label: StringProperty(name="Label", description="Label of the row", options={"SKIP_SAVE"})
    value: StringProperty(name="Value", description="Value to copy", options={"SKIP_SAVE"})

    @classmethod
    def description(cls, context: bpy.types.Context, properties: Any) -> str:
        """The tooltip that Blender shows for the number."""
        return ". ".join(filter(None, (tip_of(properties.label), "Click to copy it")))

    def execute(self, context: bpy.types.Context) -> Outcome:
        context.window_manager.clipboard = self.value
        return {"FINISHED"}


def draw_rows(
    context: bpy.types.Context,
    layout: bpy.types.UILayout,
    rows: Sequence[tuple[str, str]],
    active: bool = True,
) -> None:
    """Draws labels and values side by side, gray if they are not active.

    A value that has no room to the right of its label stands below it, and so do all in a narrow sidebar.
    """
    longest = max((len(label) for label, _ in rows), default=0)
    share = min(max((longest + 4) / _letters(context), 0.34), 0.66)
    room = (1.0 - share) * _letters(context) * LETTER - PADDING
    blf.size(FONT, TEXT)
    column = layout.column(align=True)
    column.active = active
    for label, value in rows:
        is_long = not is_wide(context) or blf.dimensions(FONT, value)[0] > room
        line = column if is_long else column.split(factor=share, align=True)
        left = line.row(align=True)
        left.alignment = "LEFT"
        copy = left.operator(TACTILE_OT_copy_value.bl_idname, text=label, emboss=False, translate=False)
        copy.label, copy.value = label, value
        if is_long:
            line = column.split(factor=0.08, align=True)
            line.label(text="")
        line.label(text=value, translate=False)


def draw_sentence(
    context: bpy.types.Context, layout: bpy.types.UILayout, sentence: str, icon: Any, in_two: bool = False
) -> None:
    """Draws a sentence in as many lines as the sidebar's width needs, or in just two.

    So nothing below a verdict jumps while a probe is dragged; a short one is broken at its colon.
    """
    column = layout.column(align=True)
    column.scale_y = 0.8
    found = textwrap.wrap(
        sentence, max(16, int(_letters(context))), max_lines=2 if in_two else None, placeholder=" …"
    )
    if in_two and len(found) < 2:
        found = [*sentence.partition(": ")[::2]]
    for i, line in enumerate(found):
        column.label(text=line, icon=icon if i == 0 else "BLANK1")


def is_wide(context: bpy.types.Context) -> bool:
    """Whether the sidebar has room for two columns of numbers."""
    return context.region.width > NARROW * context.preferences.system.ui_scale


def _letters(context: bpy.types.Context) -> float:
    """About how many letters fit into a line of the sidebar."""
    return context.region.width / (LETTER * context.preferences.system.ui_scale) - 8.0


def dot(plane: int) -> int:
    """The number of the icon of the plane with this index, a dot."""
    return _icons[str(plane)].icon_id


def register_dots() -> None:
    """Makes the dots for the rows of the sampling planes, in the colors of their handles and curves."""
    global _icons
    _icons = bpy.utils.previews.new()
    x = np.arange(SIDE) - 0.5 * (SIDE - 1)
    cover = np.clip(RADIUS + 0.5 - np.hypot(x, x[:, None]), 0.0, 1.0)
    for plane, color in enumerate(PLANE_COLORS):
        icon: Any = _icons.new(str(plane))
        icon.icon_size = icon.image_size = SIDE, SIDE
        pixels = np.dstack([*(c * cover for c in color), cover]).ravel()
        icon.icon_pixels_float = icon.image_pixels_float = pixels.tolist()


def unregister_dots() -> None:
    bpy.utils.previews.remove(_icons)
