# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What is drawn over the viewport: the preview of a pick, the active sampling plane, and the legend."""

import blf
import bpy
import gpu
import numpy as np
from gpu_extras.batch import batch_for_shader

from . import colours, patch_object, probe, units
from .touch import plane_axes

# Okabe and Ito's colours, which colour-blind readers can tell apart, one a sampling plane.
PLANE_COLOURS = [
    (0.90, 0.62, 0.0), (0.34, 0.71, 0.91), (0.0, 0.62, 0.45),
    (0.94, 0.89, 0.26), (0.80, 0.47, 0.65), (0.84, 0.37, 0.0),
]  # fmt: skip
WHITE, DARK = (1.0, 1.0, 1.0, 1.0), (0.0, 0.0, 0.0, 0.6)
CIRCLE = np.linspace(0.0, 2.0 * np.pi, 97)
BAR = 14, 140  # width and height of the legend's bar, in pixels at the resolution scale 1


def draw_preview(seen):
    """A ring in the tangent plane, the normal and the section curves of the touch in `seen`, a dict."""
    touched = seen["touched"]
    if touched is None:
        return
    frame, size = touched.result.frame, touched.report["extent"]
    e1, n, across = np.transpose(touched.report["axes"])
    ring = frame.origin + size * (np.outer(np.cos(CIRCLE), e1) + np.outer(np.sin(CIRCLE), across))
    strips = [(ring, WHITE), (np.array([frame.origin, frame.origin + 0.6 * size * n]), WHITE)]
    pairs = zip(touched.contours, PLANE_COLOURS, strict=False)
    strips += [(contour.points, (*colour, 1.0)) for contour, colour in pairs]
    scale = bpy.context.preferences.system.ui_scale
    gpu.state.blend_set("ALPHA")
    for points, colour in strips:
        _line(points, DARK, 4.5 * scale)
        _line(points, colour, 2.0 * scale)
    gpu.state.blend_set("NONE")


def _line(points, colour, width):
    shader = gpu.shader.from_builtin("POLYLINE_UNIFORM_COLOR")
    shader.uniform_float("viewportSize", gpu.state.viewport_get()[2:])
    shader.uniform_float("lineWidth", width)
    shader.uniform_float("color", colour)
    batch_for_shader(shader, "LINE_STRIP", {"pos": points.tolist()}).draw(shader)


def _active(context):
    """The active object, where the viewport shows overlays."""
    space = context.space_data
    return context.view_layer.objects.active if space and space.overlay.show_overlays else None


def draw_plane():
    """The active sampling plane of the active probe, as far as its contour may reach."""
    context = bpy.context
    obj = _active(context)
    if not probe.is_probe(obj) or not obj.visible_get():
        return
    settings, record = obj.tactile_probe, probe.record_of(obj)
    if record is None:
        return
    number = min(settings.active_plane, settings.plane_count - 1)
    t, up, _ = plane_axes(obj.matrix_world, settings, number).T
    origin, size = np.array(obj.matrix_world.translation), record["extent"]
    corners = [origin + size * (a * t + b * up) for a, b in ((-1, -0.6), (1, -0.6), (1, 0.6), (-1, 0.6))]
    shader = gpu.shader.from_builtin("UNIFORM_COLOR")
    gpu.state.blend_set("ALPHA")
    shader.uniform_float("color", (*PLANE_COLOURS[number], 0.25))
    positions = {"pos": [corner.tolist() for corner in corners]}
    batch_for_shader(shader, "TRIS", positions, indices=[(0, 1, 2), (0, 2, 3)]).draw(shader)
    gpu.state.blend_set("NONE")


def draw_legend():
    """The colour bar of the active patch: quantity, unit and range, beside the sidebar."""
    context = bpy.context
    patch = probe.patch_near(_active(context))
    if patch is None or not patch.visible_get():
        return
    record, shown = patch[patch_object.RECORD], patch.tactile_colours
    power, limit = patch_object.POWERS[shown], record["colour_limit"]
    unit = units.unit_of(context.scene, record["radius"])
    title = patch.bl_rna.properties["tactile_colours"].enum_items[shown].name
    symbol = units.symbol(power, unit)
    low = 0.0 if shown in patch_object.POSITIVE else -1.0
    top = limit / unit[1] ** power
    labels = [(at, f"{at * top:.3g}") for at in (low, 0.5 * (low + 1.0), 1.0)]
    _draw_bar(context, f"{title} ({symbol})" if symbol else title, low, labels)


def _draw_bar(context, title, low, labels):
    theme, scale = (
        context.preferences.themes[0].user_interface.wcol_tooltip,
        context.preferences.system.ui_scale,
    )
    font = 0
    blf.size(font, 11.0 * scale)
    blf.color(font, *theme.text, 1.0)
    width, height = (round(v * scale) for v in BAR)
    gap = round(8 * scale)
    line = blf.dimensions(font, "0")[1]
    texts = [(at, text.replace("-", "\N{MINUS SIGN}")) for at, text in labels]
    wide = max(
        blf.dimensions(font, title)[0], width + gap + max(blf.dimensions(font, t)[0] for _, t in texts)
    )
    right, bottom = _free_corner(context)
    x, y = right - 2 * gap - wide, bottom + 3 * gap
    _box(x - gap, y - 1.5 * gap, wide + 2 * gap, height + 2 * line + 3.5 * gap, theme.inner)
    steps = np.linspace(low, 1.0, 33)
    edges = y + height * (np.linspace(0.0, 1.0, 33))
    points = [(a, b) for b in edges for a in (x, x + width)]
    shades = colours.shades(np.repeat(steps, 2), 1.0)
    corners = [(2 * i + a, 2 * i + b, 2 * i + c) for i in range(32) for a, b, c in ((0, 1, 2), (1, 3, 2))]
    shader = gpu.shader.from_builtin("SMOOTH_COLOR")
    batch_for_shader(shader, "TRIS", {"pos": points, "color": shades.tolist()}, indices=corners).draw(shader)
    for at, text in texts:
        share = (at - low) / (1.0 - low)
        blf.position(font, x + width + gap, y + share * height - 0.5 * line, 0.0)
        blf.draw(font, text)
    blf.position(font, x, y + height + line + 0.5 * gap, 0.0)
    blf.draw(font, title)


def _box(x, y, width, height, colour):
    shader = gpu.shader.from_builtin("UNIFORM_COLOR")
    gpu.state.blend_set("ALPHA")
    shader.uniform_float("color", (*colour[:3], 0.8))
    corners = [(x, y), (x + width, y), (x + width, y + height), (x, y + height)]
    batch_for_shader(shader, "TRIS", {"pos": corners}, indices=[(0, 1, 2), (0, 2, 3)]).draw(shader)
    gpu.state.blend_set("NONE")


def _free_corner(context):
    """The lower right corner of what no sidebar or shelf covers of the viewport's region."""
    region, right, bottom = context.region, context.region.width, 0
    for other in context.area.regions:
        if other.type == "UI" and other.alignment == "RIGHT" and other.width > 1:
            right = min(right, other.x - region.x)
        if other.alignment == "BOTTOM" and other.type not in ("WINDOW", "HUD") and other.height > 1:
            bottom = max(bottom, other.y + other.height - region.y)
    return right, bottom


def draw_handlers():
    """Adds those that are always there; returns what takes them away."""
    add = bpy.types.SpaceView3D.draw_handler_add
    kinds = ((draw_plane, "POST_VIEW"), (draw_legend, "POST_PIXEL"))
    return [add(draw, (), "WINDOW", kind) for draw, kind in kinds]
