# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The sidebar's tab, the menu entries and the preferences."""

import textwrap
from pathlib import Path

import bpy
from bpy.props import StringProperty

from . import map_object, patch_object, probe, units
from .map_operator import TACTILE_OT_stability_map
from .operators import TACTILE_OT_reconstruct
from .pick import TACTILE_OT_pick
from .probe_operators import (
    TACTILE_OT_add_plane,
    TACTILE_OT_delete,
    TACTILE_OT_remove_plane,
    TACTILE_OT_show_colours,
    TACTILE_OT_update,
    shows_colours,
)
from .registration import TACTILE_OT_register
from .settings import draw_sensor, draw_solver
from .stability import REASONS
from .verification import TACTILE_OT_verify, rows_of, table_of

TAB = "Tactile"
ICONS = {"ok": "CHECKMARK", "uncertain": "ERROR", "not_converged": "ERROR"}


class _Sidebar:
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = TAB


class TACTILE_PT_probe(_Sidebar, bpy.types.Panel):
    bl_idname = "TACTILE_PT_probe"
    bl_label = "Tactile Probe"

    def draw(self, context):
        layout = self.layout
        layout.use_property_split, layout.use_property_decorate = True, False
        found = probe.probe_of(context.view_layer.objects.active)
        if found is None:
            layout.operator(TACTILE_OT_pick.bl_idname, icon="EYEDROPPER")
            return
        row = layout.row(align=True)
        row.operator(TACTILE_OT_pick.bl_idname, text="Move", icon="EYEDROPPER")
        row.operator(TACTILE_OT_pick.bl_idname, text="New", icon="ADD").new = True
        row.operator(TACTILE_OT_delete.bl_idname, text="", icon="TRASH")
        settings = found.tactile_probe
        layout.prop(settings, "target")
        layout.prop(settings, "extent")
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

    def draw(self, context):
        layout = self.layout
        layout.use_property_split, layout.use_property_decorate = True, False
        obj = context.view_layer.objects.active
        found, patch = probe.probe_of(obj), probe.patch_near(obj)
        if found is not None and found.tactile_probe.message:
            _draw_sentence(context, layout, found.tactile_probe.message, "ERROR")
        if patch is None:
            return
        record = patch[patch_object.RECORD]
        layout.prop(patch, "tactile_colours")
        if not shows_colours(context.space_data):
            layout.operator(TACTILE_OT_show_colours.bl_idname, icon="SHADING_SOLID")
        box = layout.box()
        unit = units.unit_of(context.scene, record["radius"])
        _draw_rows(box, _rows(record, unit))
        _draw_sentence(context, box, record["message"], ICONS[record["status"]])
        box.operator(TACTILE_OT_verify.bl_idname, icon="VIEWZOOM")
        if found is None:
            box.operator(TACTILE_OT_register.bl_idname, icon="SNAP_ON")
        if "verification" in record:
            _draw_verification(box, record["verification"], unit)
        if found is not None:
            layout.operator(TACTILE_OT_add_plane.bl_idname, icon="ADD")


class TACTILE_PT_map(_Sidebar, bpy.types.Panel):
    bl_idname = "TACTILE_PT_map"
    bl_label = "Stability Map"

    def draw(self, context):
        layout = self.layout
        layout.use_property_split, layout.use_property_decorate = True, False
        layout.operator(TACTILE_OT_stability_map.bl_idname, icon="SHADERFX")
        obj = context.view_layer.objects.active
        if obj is None or map_object.RECORD not in obj:
            return
        layout.prop(obj, "tactile_map_colours")
        if not shows_colours(context.space_data):
            layout.operator(TACTILE_OT_show_colours.bl_idname, icon="SHADING_SOLID")
        record = obj[map_object.RECORD]
        box, unit = layout.box(), units.unit_of(context.scene, record["spacing"])
        _draw_rows(box, _map_rows(record, unit))
        medians = _median_rows(record, unit)
        if medians:
            box.label(text="Medians of the Patches")
            _draw_rows(box, medians)


def _map_rows(record, unit):
    """(label, value) of how many patches there are, and why not more."""
    names = {key: f"No Patch: {name}" for key, name, _ in REASONS}
    return [
        ("Points", str(record["touched"])),
        ("Spacing", units.say(record["spacing"], 1, unit)),
        ("Patches", str(record["patches"])),
        ("… in Doubt", str(record["in_doubt"])),
        *((names[key], str(count)) for key, count in record["refused"].items() if count),
    ]


def _median_rows(record, unit):
    quantities = [(title, f"{name}_median", power) for name, title, _, power in map_object.SHOWN]
    return [(title, units.say(record[key], power, unit)) for title, key, power in quantities if key in record]


def _draw_rows(layout, rows):
    """Labels and values side by side."""
    column = layout.column(align=True)
    for label, value in rows:
        row = column.row(align=True).split(factor=0.55, align=True)
        row.label(text=label)
        row.label(text=value)


def _rows(record, unit):
    """(label, value) of what matters."""
    rows = [
        ("Curvature κ1", units.say(record["k1"], -1, unit)),
        ("Curvature κ2", units.say(record["k2"], -1, unit)),
        ("Gaussian K", units.say(record["gaussian_curvature"], -2, unit)),
        ("Mean H", units.say(record["mean_curvature"], -1, unit)),
        ("Fit Error", units.say(record["fit_error"], 1, unit)),
        ("Standard Deviation", "± " + units.say(record["height_std"], 1, unit)),
    ]
    if "vertices" not in record:
        return [*rows, ("Mesh to Patch", "…")]
    if record["vertices"] and "verification" not in record:
        rows += [
            ("Mesh to Patch", units.say(record["vertex_distance_mean"], 1, unit)),
            ("… at Most", units.say(record["vertex_distance_max"], 1, unit)),
        ]
    plane = record["suggested_plane"]
    return [
        *rows,
        ("Suggested Plane", f"{plane['azimuth']:.0f}°"),
        ("… Would Bring", f"± {units.say(plane['expected_height_std'], 1, unit)}"),
    ]


def _draw_verification(layout, found, unit):
    layout.label(text=found["target"], icon="MESH_DATA", translate=False)
    column = layout.column(align=True)
    for label, *values in table_of(found, unit):
        row = column.row(align=True).split(factor=0.31, align=True)
        row.label(text=label)
        row = row.row(align=True)
        for value in values:
            row.label(text=value)
    _draw_rows(layout, rows_of(found, unit))


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
        for operator in (TACTILE_OT_add_plane, TACTILE_OT_update, TACTILE_OT_delete):
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
        "bpy.types.object.tactile_map_colours": "#stability-map",
        "bpy.ops.tactile*": "#probe",
        "bpy.types.tactileprobe*": "#probe",
        "bpy.types.object.tactile_colours": "#result",
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
