# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The panels of the sidebar's tab."""

from collections.abc import Callable
from typing import Any

import bpy
from bpy.app.translations import pgettext_iface as iface

from ..comparison import operators as comparison
from ..probes import probe
from ..probes.in_slices import draw_running
from ..probes.operators import no_mesh
from ..scene import patch_record
from ..scene.shown import unit_of_range
from ..scene.viewports import shows_colors
from ..stability_map.map_object import map_facets, map_rows, median_rows
from ..touch import units
from ..touch.settings import draw_chosen, draw_fit, draw_noise
from ..touch.touch_report import TouchReport
from ..touch.types import Object, PanelMixin
from ..touch.wording import (
    curvatures,
    main_rows,
    other_rows,
    plane_rows,
    reasons,
    registration_summary,
    verdict,
    wants_facets_finer,
)
from ..whole_object.object_report import (
    deviation,
    facets,
    is_all_within,
    object_reasons,
    object_rows,
    object_verdict,
)
from .rows import dot, draw_rows, draw_sentence, is_wide

TAB = "Tactile"
HELP = "Click on a mesh: a probe feels its surface there and keeps a patch of it with its curvatures"
OTHER_MODE = "Objects are touched in Object Mode, so the buttons are gray"
ICONS = {"ok": "CHECKMARK"}


class _Sidebar(PanelMixin):
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = TAB
    draw_active: Callable[[bpy.types.Context, bpy.types.UILayout, Object], None]

    def draw(self, context: bpy.types.Context) -> None:
        self.layout.use_property_split, self.layout.use_property_decorate = True, False
        self.draw_active(context, self.layout, context.view_layer.objects.active)


class TACTILE_PT_probe(_Sidebar, bpy.types.Panel):
    bl_label = "Tactile Probe"

    def draw_active(self, context: bpy.types.Context, layout: bpy.types.UILayout, obj: Object) -> None:
        if context.mode != "OBJECT":
            draw_sentence(context, layout, OTHER_MODE, "INFO")
            layout.operator(
                "object.mode_set", text="Go to Object Mode", icon="OBJECT_DATAMODE"
            ).mode = "OBJECT"
        found = probe.probe_of(obj)
        if found is None:
            _draw_pick(context, layout, obj)
            return
        row = layout.row(align=True)
        move = row.row(align=True)
        move.enabled = probe.lock_of(found) is None
        move.operator("tactile.pick", text="Move" if is_wide(context) else "", icon="EYEDROPPER")
        row.operator("tactile.pick", text="New", icon="ADD").new = True
        row.operator("tactile.delete", text="", icon="TRASH")
        settings = found.tactile_probe
        layout.prop(settings, "target")
        draw_chosen(layout, settings, "extent")
        _draw_planes(context, layout, settings)
        row = layout.row()
        row.prop(settings, "live", text="Live" if settings.live else "Live (Frozen)")
        row.operator("tactile.update", text="", icon="FILE_REFRESH")
        if body := _folded(layout, "fit", "Sensor and Fit"):
            draw_chosen(body, settings, "step")
            draw_noise(body, settings)
            draw_fit(body, settings)


def _folded(layout: bpy.types.UILayout, identifier: str, title: str) -> bpy.types.UILayout | None:
    """Draws the header of a part that is folded away at first; returns its layout, or None while it is."""
    header, body = layout.panel(f"TACTILE_PT_{identifier}", default_closed=True)
    header.label(text=title)
    return body


def _draw_pick(context: bpy.types.Context, layout: bpy.types.UILayout, obj: Object) -> None:
    """Draws the button that makes a probe, and what it does or needs."""
    layout.operator("tactile.pick", icon="EYEDROPPER")
    if not any(each.type == "MESH" for each in context.view_layer.objects):
        draw_sentence(context, layout, no_mesh(context), "INFO")
    elif obj is None or not probe.is_result(obj):
        draw_sentence(context, layout, HELP, "INFO")


def _draw_planes(context: bpy.types.Context, layout: bpy.types.UILayout, settings: Any) -> None:
    """Draws the angles of the planes; a narrow sidebar has room for one of the two."""
    has_tilts = is_wide(context)
    column = layout.column(align=True)
    heading = column.row(align=True)
    heading.label(text="", icon="BLANK1")
    for text in ("Azimuth", "Tilt") if has_tilts else ("Azimuth",):
        heading.label(text=text)
    heading.operator("tactile.add_plane", text="", icon="ADD")
    for i in range(settings.plane_count):
        row = column.row(align=True)
        row.use_property_split = False
        row.label(text="", icon_value=dot(i))
        row.prop(settings, "azimuths", index=i, text="")
        if has_tilts:
            row.prop(settings, "tilts", index=i, text="")
        row.operator("tactile.remove_plane", text="", icon="REMOVE").plane = i


class TACTILE_PT_result(_Sidebar, bpy.types.Panel):
    bl_label = "Patch"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        obj = context.view_layer.objects.active
        return probe.probe_of(obj) is not None or probe.patch_near(obj) is not None

    def draw_active(self, context: bpy.types.Context, layout: bpy.types.UILayout, obj: Object) -> None:
        found, patch = probe.probe_of(obj), probe.patch_near(obj)
        failed = "" if found is None else found.tactile_probe.message
        if failed:
            draw_sentence(context, layout, failed, "ERROR")
        if patch is None:
            return
        record = probe.record_of(patch)
        if record is None:
            layout.label(text="This patch was edited: touch again", icon="ERROR")
            return
        is_outdated = record["status"] == "outdated"
        if not (is_outdated and failed):  # The failure stands above already.
            draw_sentence(context, layout, verdict(record), ICONS.get(record["status"], "ERROR"), in_two=True)
        draw_rows(context, layout, main_rows(record), active=not is_outdated)
        _draw_colors(context, layout, patch, "tactile_colors")
        _draw_shown(context, layout, found, patch)
        if found is not None:
            row = layout.row()  # It is gray where it does not help, so that what is below does not jump.
            row.enabled = is_outdated or wants_facets_finer(record)
            helps: Any = ("update", "FILE_REFRESH") if is_outdated else ("add_subdivision", "MOD_SUBSURF")
            row.operator(f"tactile.{helps[0]}", icon=helps[1])
        _draw_comparison(context, layout, record)
        if body := _folded(layout, "more", "More"):
            _draw_more(context, body, patch, record)
        if found is None:
            layout.prop_search(patch, "tactile_target", context.scene, "objects")
            layout.operator("tactile.register", icon="SNAP_ON")
            layout.operator("tactile.verify", icon="VIEWZOOM")


class TACTILE_PT_object(_Sidebar, bpy.types.Panel):
    bl_label = "Whole Object"

    def draw_active(self, context: bpy.types.Context, layout: bpy.types.UILayout, obj: Object) -> None:
        layout.operator("tactile.touch_all_over", icon="MESH_UVSPHERE")
        draw_running(layout, "object")
        if obj is None or patch_record.ATLAS_RECORD not in obj:
            return
        record = obj[patch_record.ATLAS_RECORD]
        icon = "CHECKMARK" if is_all_within(record) else "INFO" if record["status"] == "ok" else "ERROR"
        draw_sentence(context, layout, object_verdict(record), icon, in_two=True)
        if words := facets(record):
            draw_sentence(context, layout, words, "INFO")
            layout.operator("tactile.add_subdivision", icon="MOD_SUBSURF")
        if record.get("uncovered") and record["status"] != "outdated":
            layout.operator("tactile.continue_touching", icon="PLAY")
        _draw_colors(context, layout, obj, "tactile_colors")
        if "touches" in record:  # Measured contacts have no mesh to touch.
            text = f"Largest {'Gap' if record['uncovered'] else 'Deviation'}: {deviation(record, 'max')}"
            layout.operator("tactile.look_farthest", text=text, icon="ZOOM_SELECTED", translate=False)
            layout.operator("tactile.pick", text="Probe on the Surface", icon="EYEDROPPER").new = True
        if body := _folded(layout, "object_more", "More"):
            if patch_record.is_colored(obj):
                _draw_range(context, body, obj)
            for words in object_reasons(record):
                draw_sentence(context, body, words, "BLANK1")
            draw_rows(context, body, object_rows(record))
            body.operator("tactile.mesh_again", icon="MOD_REMESH")


class TACTILE_PT_map(_Sidebar, bpy.types.Panel):
    bl_label = "Stability Map"

    def draw_active(self, context: bpy.types.Context, layout: bpy.types.UILayout, obj: Object) -> None:
        layout.operator("tactile.stability_map", icon="SHADERFX")
        draw_running(layout, "map")
        if obj is None or patch_record.MAP_RECORD not in obj:
            return
        layout.operator("tactile.pick", text="Probe on the Map", icon="EYEDROPPER").new = True
        record = obj[patch_record.MAP_RECORD]
        if words := map_facets(record):
            draw_sentence(context, layout, words, "ERROR")
            layout.operator("tactile.add_subdivision", icon="MOD_SUBSURF")
        draw_rows(context, layout, map_rows(record))
        _draw_colors(context, layout, obj, "tactile_map_colors")
        if record["patches"] and (body := _folded(layout, "map_more", "Medians of the Patches")):
            draw_rows(context, body, list(median_rows(record)))


class TACTILE_PT_probes(_Sidebar, bpy.types.Panel):
    bl_label = "Probes"
    bl_options = {"DEFAULT_CLOSED"}

    def draw_active(self, context: bpy.types.Context, layout: bpy.types.UILayout, obj: Object) -> None:
        """Draws a row for each probe, to click: its verdict as an icon, its name and its curvatures."""
        row = layout.row(align=True)
        row.operator("tactile.export_table", text="Table", icon="EXPORT")
        row.operator("tactile.export_report", text="Report", icon="FILE_TEXT")
        column = layout.column(align=True)
        probes: list[Object] = [each for each in context.view_layer.objects if probe.is_probe(each)]
        for found in sorted(probes, key=lambda each: each.name):
            record = probe.record_of(found)
            icon: Any = "ERROR" if record is None else ICONS.get(record["status"], "ERROR")
            words = found.tactile_probe.message if record is None else curvatures(record)
            text, is_active = f"{found.name}   {words}", found == probe.probe_of(obj)
            column.operator(
                "tactile.activate", text=text, icon=icon, depress=is_active, translate=False
            ).name = found.name


def _draw_more(
    context: bpy.types.Context, layout: bpy.types.UILayout, patch: Object, record: TouchReport
) -> None:
    """Draws what the fit says of itself, the range of the colors, and all other numbers."""
    is_current = record["status"] != "outdated"
    _draw_range(context, layout, patch)
    for i, words in enumerate(reasons(record)):
        draw_sentence(context, layout, words, "BLANK1" if i else ICONS.get(record["status"], "ERROR"))
    for rows in (other_rows(record), plane_rows(record)):  # The labels of planes are long.
        draw_rows(context, layout, rows, active=is_current)
    if probe.probe_of(patch) is not None:
        layout.operator("tactile.verify", icon="VIEWZOOM")
    if "verification" in record:
        for rows in (comparison.verification_table(record), comparison.other_rows(record)):
            draw_rows(context, layout, rows, active=is_current)


def _draw_colors(context: bpy.types.Context, layout: bpy.types.UILayout, obj: Object, name: str) -> None:
    """Draws what the colors show, and a button if the viewport does not show them."""
    layout.prop(obj, name)
    space: Any = context.space_data
    if not shows_colors(space):
        shown = ("type", "SOLID") if space.shading.type == "WIREFRAME" else ("color_type", "VERTEX")
        row = layout.row()
        row.use_property_split = False
        row.prop_enum(space.shading, *shown, text="Show Patch Colors", icon="SHADING_SOLID")


def _draw_range(context: bpy.types.Context, layout: bpy.types.UILayout, patch: Object) -> None:
    """Draws where the colors end."""
    row = layout.row()
    row.use_property_split = False
    name = iface("Range" if patch_record.RANGE in patch else "Range (Auto)")
    words = f"{name} {units.symbol(*unit_of_range(patch))}"
    row.prop(patch, "tactile_range", text=words.rstrip(), translate=False)


def _draw_shown(
    context: bpy.types.Context, layout: bpy.types.UILayout, found: Object | None, patch: Object
) -> None:
    """Draws the switches of what is shown with a patch and may hide it; a narrow sidebar has their icons."""
    words: dict[str, Any] = {} if is_wide(context) else {"text": ""}
    row = layout.row(align=True)
    row.use_property_split = False
    row.prop(patch, "tactile_contours", icon="CURVE_DATA", toggle=1, **words)
    directions = row.row(align=True)
    directions.active = "directions" in patch.get(patch_record.CURVES, ())
    directions.prop(patch, "tactile_directions", icon="EMPTY_AXIS", toggle=1, **words)
    if found is not None:
        row.prop(found.tactile_probe, "show_handles", icon="GIZMO", toggle=1, **words)


def _draw_comparison(context: bpy.types.Context, layout: bpy.types.UILayout, record: TouchReport) -> None:
    """Draws where the patch was put on a mesh, and how far it is off one, if these are known."""
    if "registration" in record:
        draw_sentence(context, layout, registration_summary(record), "SNAP_ON")
    if "verification" in record:
        layout.label(text=record["verification"]["target"], icon="MESH_DATA", translate=False)
        draw_rows(context, layout, comparison.main_rows(record), active=record["status"] != "outdated")


PANELS = (TACTILE_PT_probe, TACTILE_PT_result, TACTILE_PT_object, TACTILE_PT_map, TACTILE_PT_probes)
