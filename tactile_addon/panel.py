# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The sidebar's tab, the menu entries and the preferences."""

import textwrap
from pathlib import Path

import bpy
from bpy.props import StringProperty

from .comparison.register_operator import TACTILE_OT_register
from .comparison.verification_wording import verification_rows, verification_table
from .comparison.verify_operator import TACTILE_OT_verify
from .probes import probe
from .probes.operators import TACTILE_OT_reconstruct
from .probes.probe_operators import (
    TACTILE_OT_add_plane,
    TACTILE_OT_add_planes,
    TACTILE_OT_delete,
    TACTILE_OT_remove_plane,
    TACTILE_OT_show_colors,
    TACTILE_OT_update,
    shows_colors,
)
from .scene import patch_record
from .stability_map.map_operator import TACTILE_OT_stability_map
from .stability_map.map_report import map_rows, median_rows
from .touch import units
from .touch.settings import draw_chosen, draw_sensor, draw_solver
from .touch.wording import patch_rows, registration_summary
from .viewport.pick import TACTILE_OT_pick

TAB = "Tactile"
ICONS = {"ok": "CHECKMARK", "uncertain": "ERROR", "not_converged": "ERROR"}


class _Sidebar:
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = TAB

    def draw(self, context):
        self.layout.use_property_split, self.layout.use_property_decorate = True, False
        self.draw_active(context, self.layout, context.view_layer.objects.active)


class TACTILE_PT_probe(_Sidebar, bpy.types.Panel):
    bl_idname = "TACTILE_PT_probe"
    bl_label = "Tactile Probe"

    def draw_active(self, context, layout, obj):
        found = probe.probe_of(obj)
        if found is None:
            layout.operator(TACTILE_OT_pick.bl_idname, icon="EYEDROPPER")
            return
        row = layout.row(align=True)
        move = row.row(align=True)
        move.enabled = probe.lock_of(found) is None
        move.operator(TACTILE_OT_pick.bl_idname, text="Move", icon="EYEDROPPER")
        row.operator(TACTILE_OT_pick.bl_idname, text="New", icon="ADD").new = True
        row.operator(TACTILE_OT_delete.bl_idname, text="", icon="TRASH")
        settings = found.tactile_probe
        layout.prop(settings, "target")
        draw_chosen(layout, settings, "extent")
        _draw_planes(layout, settings)
        row = layout.row()
        row.prop(settings, "live")
        row.operator(TACTILE_OT_update.bl_idname, text="", icon="FILE_REFRESH")
        for identifier, title, draw in (("sensor", "Sensor", draw_sensor), ("solver", "Fit", draw_solver)):
            header, body = layout.panel(f"TACTILE_PT_{identifier}", default_closed=True)
            header.label(text=title)
            if body:
                draw(body, settings)


def _draw_planes(layout, settings):
    column = layout.column(align=True)
    heading = column.row(align=True)
    for text in ("Azimuth", "Tilt"):
        heading.label(text=text)
    heading.operator(TACTILE_OT_add_plane.bl_idname, text="", icon="ADD")
    for i in range(settings.plane_count):
        row = column.row(align=True)
        row.use_property_split = False
        row.prop(settings, "azimuths", index=i, text="")
        row.prop(settings, "tilts", index=i, text="")
        row.operator(TACTILE_OT_remove_plane.bl_idname, text="", icon="REMOVE").plane = i


class TACTILE_PT_result(_Sidebar, bpy.types.Panel):
    bl_idname = "TACTILE_PT_result"
    bl_label = "Patch"

    @classmethod
    def poll(cls, context):
        obj = context.view_layer.objects.active
        return probe.probe_of(obj) is not None or probe.patch_near(obj) is not None

    def draw_active(self, context, layout, obj):
        found, patch = probe.probe_of(obj), probe.patch_near(obj)
        if found is not None and found.tactile_probe.message:
            _draw_sentence(context, layout, found.tactile_probe.message, "ERROR")
        if patch is None:
            return
        record = probe.record_of(patch)
        if record is None:
            layout.label(text="This patch was edited: touch again", icon="ERROR")
            return
        _draw_colors(context, layout, patch, "tactile_colors")
        box, unit = layout.box(), units.unit_of(context.scene, record["radius"])
        if record["status"] == "outdated":
            if found is None or not found.tactile_probe.message:  # which stands above
                _draw_sentence(context, box, record["message"], "ERROR")
            if found is not None:
                box.operator(TACTILE_OT_update.bl_idname, icon="FILE_REFRESH")
            box.label(text="Last Touch")
            _draw_rows(box, patch_rows(record, unit), active=False)
        else:
            _draw_rows(box, patch_rows(record, unit))
            _draw_sentence(context, box, record["message"], ICONS.get(record["status"], "ERROR"))
        box.operator(TACTILE_OT_verify.bl_idname, icon="VIEWZOOM")
        if found is None:
            box.prop_search(patch, "tactile_target", context.scene, "objects")
            box.operator(TACTILE_OT_register.bl_idname, icon="SNAP_ON")
        if "registration" in record:
            _draw_sentence(context, box, registration_summary(record["registration"]), "SNAP_ON")
        if "verification" in record:
            _draw_verification(box, record["verification"], unit)
        if found is not None:
            layout.operator(TACTILE_OT_add_plane.bl_idname, icon="ADD")
            layout.operator(TACTILE_OT_add_planes.bl_idname, icon="PLUS")


class TACTILE_PT_map(_Sidebar, bpy.types.Panel):
    bl_idname = "TACTILE_PT_map"
    bl_label = "Stability Map"

    def draw_active(self, context, layout, obj):
        layout.operator(TACTILE_OT_stability_map.bl_idname, icon="SHADERFX")
        if obj is None or patch_record.MAP_RECORD not in obj:
            return
        _draw_colors(context, layout, obj, "tactile_map_colors")
        record = obj[patch_record.MAP_RECORD]
        box, unit = layout.box(), units.unit_of(context.scene, record["spacing"])
        _draw_rows(box, map_rows(record, unit))
        medians = median_rows(record, unit)
        if medians:
            box.label(text="Medians of the Patches")
            _draw_rows(box, medians)


def _draw_colors(context, layout, obj, name):
    """What the colors show, and a button where the viewport does not show them."""
    layout.prop(obj, name)
    if not shows_colors(context.space_data):
        layout.operator(TACTILE_OT_show_colors.bl_idname, icon="SHADING_SOLID")


def _draw_rows(layout, rows, active=True):
    """Labels and values side by side, gray where they are not active."""
    column = layout.column(align=True)
    column.active = active
    for label, value in rows:
        row = column.row(align=True).split(factor=0.55, align=True)
        row.label(text=label)
        row.label(text=value)


def _draw_verification(layout, found, unit):
    layout.label(text=found["target"], icon="MESH_DATA", translate=False)
    column = layout.column(align=True)
    for label, *values in verification_table(found, unit):
        row = column.row(align=True).split(factor=0.31, align=True)
        row.label(text=label)
        row = row.row(align=True)
        for value in values:
            row.label(text=value)
    _draw_rows(layout, verification_rows(found, unit))


def _draw_sentence(context, layout, sentence, icon):
    """As many lines as the sidebar's width needs."""
    letters = context.region.width / (6.5 * context.preferences.system.ui_scale) - 8.0
    column = layout.column(align=True)
    column.scale_y = 0.8
    for i, line in enumerate(textwrap.wrap(sentence, max(16, int(letters)))):
        column.label(text=line, icon=icon if i == 0 else "BLANK1")


class VIEW3D_MT_tactile(bpy.types.Menu):
    bl_idname = "VIEW3D_MT_tactile"
    bl_label = "Tactile Patch"

    def draw(self, context):
        for operator in (TACTILE_OT_pick, TACTILE_OT_reconstruct, TACTILE_OT_stability_map):
            self.layout.operator(operator.bl_idname)
        self.layout.separator()
        for operator in (TACTILE_OT_verify, TACTILE_OT_register):
            self.layout.operator(operator.bl_idname)
        self.layout.separator()
        for operator in (TACTILE_OT_add_plane, TACTILE_OT_add_planes, TACTILE_OT_update, TACTILE_OT_delete):
            self.layout.operator(operator.bl_idname)


def _draw_in_object(self, context):
    self.layout.separator()
    self.layout.menu(VIEW3D_MT_tactile.bl_idname)


def _draw_in_add(self, context):
    self.layout.separator()
    self.layout.operator(TACTILE_OT_reconstruct.bl_idname, icon="SURFACE_DATA")


MENUS = (("VIEW3D_MT_object", _draw_in_object), ("VIEW3D_MT_mesh_add", _draw_in_add))


def manual_map():
    """For Online Manual in the context menus: the page that comes with the extension."""
    page = Path(__file__).resolve().parents[1] / "manual" / "viewport.html"
    pages = {
        "bpy.ops.tactile.pick": "#the-first-patch",
        "bpy.ops.tactile.verify": "#verify",
        "bpy.ops.tactile.register": "#register",
        "bpy.ops.tactile.stability_map": "#stability-map",
        "bpy.types.object.tactile_map_colors": "#stability-map",
        "bpy.ops.tactile*": "#probe",
        "bpy.types.tactileprobe*": "#probe",
        "bpy.types.object.tactile_colors": "#result",
    }
    return page.as_uri(), tuple(pages.items())


def _move_tab(preferences, context):
    """Panels learn their tab when they are registered."""
    for panel in PANELS:
        bpy.utils.unregister_class(panel)
        panel.bl_category = preferences.tab or TAB
        bpy.utils.register_class(panel)


def restore_tab():
    """Puts the panels where the preferences have them, if the extension has any."""
    addon = bpy.context.preferences.addons.get(TactilePreferences.bl_idname)
    if addon is not None and addon.preferences.tab != TAB:
        _move_tab(addon.preferences, bpy.context)


class TactilePreferences(bpy.types.AddonPreferences):
    bl_idname = __package__.rpartition(".")[0]

    tab: StringProperty(
        name="Sidebar Tab", description="Where the panels are in the sidebar", default=TAB, update=_move_tab
    )

    def draw(self, context):
        self.layout.use_property_split = True
        self.layout.prop(self, "tab")
        self.layout.operator("wm.url_open", text="Manual", icon="HELP").url = manual_map()[0]


PANELS = (TACTILE_PT_probe, TACTILE_PT_result, TACTILE_PT_map)
