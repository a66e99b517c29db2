# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What is drawn over the viewport: the preview of a pick, the active sampling plane, and the legend."""

import textwrap
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

import blf
import bpy
import gpu
import numpy as np
from mathutils import Vector

from ..probes import probe
from ..scene import colors, patch_record
from ..scene.mesh_data import DEVIATION, REASON
from ..scene.viewports import shows_colors
from ..stability_map import map_object
from ..touch import units
from ..touch.touch_object import plane_axes
from ..touch.types import Object
from .above import draw_above
from .curves import BLACK, FONT, PLANE_COLORS, WHITE, draw_curves, draw_letters, draw_preview, draw_shape
from .drag import DRAG_TILT, DRAG_TURN
from .free_view import free_strip
from .mouse import is_over

TEXT = 11.0  # The font's size in panels.
LEGEND_STEPS = 65  # The number of colors of the legend's bar.
LETTERS, OFFSET = 48, 16  # The letters in a line of words near the mouse, and the pixels between them.
DOT = 10.0  # The size of a dot, in pixels at scale 1.
BAR = (150, 12)  # Width and height of the legend's bar, in pixels at resolution scale 1,
BESIDE = 195  # and the width that it needs beside the last operator's panel.


def draw_key(seen: dict[str, Any]) -> None:
    """Draws what the lines of the preview are, or next to the mouse why there is none."""
    context = bpy.context
    if not is_over(context.region, *seen["mouse"]):
        return
    if seen["touched"] is not None:
        shown = PLANE_COLORS[: len(seen["touched"].result.contours)]
        planes = [(f"Curve in Plane {number}", (*color, 1.0)) for number, color in enumerate(shown, 1)]
        _draw_box(context, "Preview", 0.0, [], [("Rim and Normal of the Patch", WHITE), *planes])
    elif seen["refusal"] is not None:
        title, *lines = textwrap.wrap(seen["refusal"], LETTERS)
        _draw_box(context, title, 0.0, [], [(line, None) for line in lines], seen["mouse"])


def _begin_box(context: bpy.types.Context) -> tuple[float, float, float, Sequence[float]]:
    """Sets the font of a box of text as tooltips have it.

    Returns the resolution scale, the gap between lines and the height of a line in pixels, and the color of
    the ground, (red, green, blue).
    """
    theme: Any = context.preferences.themes[0].user_interface.wcol_tooltip
    scale = context.preferences.system.ui_scale
    blf.size(FONT, TEXT * scale)
    red, green, blue = theme.text
    blf.color(FONT, red, green, blue, 1.0)
    return scale, 6.0 * scale, blf.dimensions(FONT, "0")[1], theme.inner[:3]


def _active(context: bpy.types.Context) -> Object | None:
    """The active object if the viewport shows overlays, or None."""
    space: Any = context.space_data
    return context.view_layer.objects.active if space and space.overlay.show_overlays else None


def draw_plane() -> None:
    """Draws the part of a sampling plane that its contour may reach, while it is turned or tilted."""
    context = bpy.context
    drag: Any = _running(context, "TACTILE_OT_drag")
    if drag is None or drag.properties.what not in (DRAG_TURN, DRAG_TILT):
        return
    obj = probe.probe_of(_active(context))
    record = probe.record_of(obj)
    if record is None or not obj.visible_get():
        return
    settings = obj.tactile_probe
    number = min(settings.active_plane, settings.plane_count - 1)
    t, up, _ = plane_axes(obj.matrix_world, settings, number).T
    origin, size = np.array(obj.matrix_world.translation, dtype=float), record["extent"]
    corners = [origin + size * (a * t + b * up) for a, b in ((-1, -0.6), (1, -0.6), (-1, 0.6), (1, 0.6))]
    strip = {"pos": np.array(corners).tolist()}
    draw_shape("TRI_STRIP", "UNIFORM_COLOR", strip, color=(*PLANE_COLORS[number], 0.18))


def draw_farthest() -> None:
    """Draws a dot where the active whole object is farthest off its mesh, if its colors show deviations."""
    obj = _active(bpy.context)
    record = {} if obj is None else obj.get(patch_record.ATLAS_RECORD, {})
    if "deviation_place" in record and obj.tactile_colors == DEVIATION and obj.visible_get():
        place = obj.matrix_world @ Vector(np.subtract(record["deviation_place"], record["origin"]))
        for share, color in ((1.0, BLACK), (0.6, WHITE)):
            gpu.state.point_size_set(share * DOT * bpy.context.preferences.system.ui_scale)
            draw_shape("POINTS", "POINT_UNIFORM_COLOR", {"pos": [place]}, color=color)


def draw_legend() -> None:
    """Draws the legend of the active patch, whole object or map: quantity, unit and range."""
    context = bpy.context
    # A pick draws the key of its preview where the legend is.
    is_picking = _running(context, "TACTILE_OT_pick") is not None
    if is_picking or not shows_colors(context.space_data) or not _is_last_view(context):
        return
    obj = _active(context)
    patch, record = probe.patch_near(obj), probe.record_of(obj)
    if obj is not None and patch_record.ATLAS_RECORD in obj:
        patch, record = obj, obj[patch_record.ATLAS_RECORD]
    if record is not None and "color_limit" in record and patch.visible_get():
        shown = patch.tactile_colors
        low = 0.0 if shown in patch_record.POSITIVE else -1.0
        title = patch.bl_rna.properties["tactile_colors"].enum_items[shown].name
        bar = _scale(title, record, patch_record.POWERS[shown], low)
        _draw_box(context, *bar, [("Unknown", colors.UNKNOWN)] if record.get("is_gray") else ())
    elif obj is not None and patch_record.MAP_RECORD in obj and obj.visible_get():
        record, shown = obj[patch_record.MAP_RECORD], obj.tactile_map_colors
        title = obj.bl_rna.properties["tactile_map_colors"].enum_items[shown].name
        bar = _scale(title, record, map_object.MAP_POWERS[shown], 0.0)
        if shown == REASON:
            bar = title, 0.0, []
        elif shown in map_object.REVERSED:
            bar = bar[0], bar[1], [(1.0 - at, text) for at, text in reversed(bar[2])]
        elif shown in map_object.LOGARITHMIC:
            bar = title, 0.0, [(at, f"{record['color_limit'] ** at:.2g}") for at in (0.0, 0.5, 1.0)]
        _draw_box(context, *bar, map_object.swatches(obj))


def _running(context: bpy.types.Context, name: str) -> bpy.types.Operator | None:
    """The operator of this name that waits for events of the window, or None."""
    return next((each for each in context.window.modal_operators if each.bl_idname == name), None)


def _is_last_view(context: bpy.types.Context) -> bool:
    """Whether the region is the only view of its area, or the one at the bottom right in a quad view."""
    views = [region for region in context.area.regions if region.type == "WINDOW"]
    return context.region == max(views, key=lambda region: (region.x, -region.y))


def _scale(
    title: str, record: Mapping[str, Any], power: int, low: float
) -> tuple[str, float, list[tuple[float, str]]]:
    """The title with its unit, the share at which colors begin, and the (share, text) labels of a scale."""
    unit = units.unit_of_report(record)
    symbol = units.symbol(power, unit)
    top = record["color_limit"] / unit[1] ** power
    labels = [(at, f"{at * top:.3g}") for at in (low, 0.5 * (low + 1.0), 1.0)]
    return f"{title} ({symbol})" if symbol else title, low, labels


def _draw_box(
    context: bpy.types.Context,
    title: str,
    low: float,
    labels: Sequence[tuple[float, str]],
    swatches: Sequence[tuple[str, Sequence[float] | None]] = (),
    mouse: Sequence[float] | None = None,
) -> None:
    """Draws a title, a bar of colors from `low` to 1 if there are labels, and lines, if there is room.

    swatches : lines of text, each with the color of a swatch before it or None
    mouse : the box is next to this place of the window, or else in the lower right corner
    """
    region, (scale, gap, line, ground) = context.region, _begin_box(context)
    bar = BAR[1] * scale + line + 2.0 * gap if labels else 0.0
    high = line + 2.0 * gap + bar + len(swatches) * (line + gap)
    left, right, bottom = free_strip(context, high + gap, BESIDE * scale)
    lengths = [blf.dimensions(FONT, title)[0]]
    lengths += [blf.dimensions(FONT, text)[0] + 2.0 * line + gap for text, _ in swatches]
    wide = min(max(BAR[0] * scale, *lengths) + 4.0 * gap, right - left - gap)
    if wide < 0.5 * BAR[0] * scale or bottom + high > region.height:
        return
    x, y = right - gap - wide, bottom + gap
    if mouse is not None:
        x = max(min(mouse[0] - region.x + OFFSET * scale, x), left)
        y = min(max(mouse[1] - region.y - OFFSET * scale - high, y), region.height - high)
    _fill_box(x, y, wide, high, (*ground, 0.8))
    x, wide = x + 2.0 * gap, wide - 4.0 * gap
    for number, (text, color) in enumerate(reversed(swatches)):
        at = y + gap + number * (line + gap)
        if color is not None:
            _fill_box(x, at, 2.0 * line, line, color)
        _write(text, x if color is None else x + 2.0 * line + gap, at)
    y += high - gap - line
    if labels:
        _draw_bar(x, y - gap - BAR[1] * scale, wide, BAR[1] * scale, gap, low, labels)
    blf.size(FONT, TEXT * scale * min(1.0, wide / lengths[0]))
    _write(title, x, y)


def _draw_bar(
    x: float, y: float, wide: float, high: float, gap: float, low: float, labels: Sequence[tuple[float, str]]
) -> None:
    """Draws the colors from `low` to 1, and the (share, text) labels below them."""
    at = np.linspace(x, x + wide, LEGEND_STEPS)
    shades = colors.shades(np.repeat(np.linspace(low, 1.0, LEGEND_STEPS), 2), 1.0)
    points = [(a, b) for a in at for b in (y, y + high)]
    draw_shape("TRI_STRIP", "SMOOTH_COLOR", {"pos": points, "color": shades.tolist()})
    labels = [(share, text.replace("-", "\N{MINUS SIGN}")) for share, text in labels]
    first, middle, last = (blf.dimensions(FONT, text)[0] for _, text in labels)
    if 0.5 * (wide - middle) < max(first, last):
        del labels[1]  # It would run into another one.
    line = blf.dimensions(FONT, "0")[1]
    for share, text in labels:
        middle = x + (share - low) / (1.0 - low) * wide
        length = blf.dimensions(FONT, text)[0]
        _write(text, min(max(middle - 0.5 * length, x - gap), x + wide + gap - length), y - gap - line)


def _fill_box(x: float, y: float, wide: float, high: float, color: Sequence[float]) -> None:
    corners = {"pos": [(x, y), (x + wide, y), (x, y + high), (x + wide, y + high)]}
    draw_shape("TRI_STRIP", "UNIFORM_COLOR", corners, color=color)


def _write(text: str, x: float, y: float) -> None:
    blf.position(FONT, x, y, 0.0)
    blf.draw(FONT, text)


# Functions that draw and when they do so: those that are always there, and those of a pick. The latter get a
# dict with the keys touched, the touch whose preview is drawn, or None; refusal, a sentence on why there is
# none, or None; and mouse, where the mouse is in the window.
DRAWINGS = (
    (draw_above, "POST_VIEW"),
    (draw_curves, "POST_VIEW"),
    (draw_plane, "POST_VIEW"),
    (draw_farthest, "POST_VIEW"),
    (draw_letters, "POST_PIXEL"),
    (draw_legend, "POST_PIXEL"),
)
PICK_DRAWINGS = ((draw_preview, "POST_VIEW"), (draw_key, "POST_PIXEL"))


def add_drawings(drawings: Iterable[tuple[Callable[..., None], str]], *given: Any) -> list[Any]:
    """Adds drawings to all 3D viewports, and returns the handles by which to remove them."""
    return [bpy.types.SpaceView3D.draw_handler_add(draw, given, "WINDOW", kind) for draw, kind in drawings]
