# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The sidebar's tab, the menu entries, the buttons they have besides picking, and the preferences."""

import math
import textwrap
from pathlib import Path

import bpy
from bpy.props import IntProperty, StringProperty

from . import patch_object, probe, units
from .operators import TACTILE_OT_reconstruct
from .pick import TACTILE_OT_pick
from .settings import MOST_PLANES, draw_sensor, draw_solver

TAB = "Tactile"
ICONS = {"ok": "CHECKMARK", "uncertain": "ERROR", "not_converged": "ERROR"}


class _ProbeOperator:
    """Mixed into operators on the active probe, which may be active by its patch or contours."""

    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        if probe.probe_of(context.view_layer.objects.active) is None:
            cls.poll_message_set("Select a probe, or pick a reference point first")
            return False
        if context.mode != "OBJECT":
            cls.poll_message_set("Leave this mode: probes are changed in Object Mode")
            return False
        return True


class TACTILE_OT_add_plane(_ProbeOperator, bpy.types.Operator):
    """Feel along one more plane: the one that tells most of what is still open"""

    bl_idname = "tactile.add_plane"
    bl_label = "Add Suggested Plane"

    @classmethod
    def poll(cls, context):
        if not super().poll(context):
            return False
        if probe.probe_of(context.view_layer.objects.active).tactile_probe.plane_count == MOST_PLANES:
            cls.poll_message_set("Six planes are the most: remove one first")
            return False
        return True

    def execute(self, context):
        found = probe.probe_of(context.view_layer.objects.active)
        settings, record = found.tactile_probe, probe.record_of(found)
        number = settings.plane_count
        if record is not None and "suggested_plane" in record:
            settings.azimuths[number] = math.radians(record["suggested_plane"]["azimuth"])
            settings.tilts[number] = 0.0
        settings.plane_count = number + 1
        settings.active_plane = number
        probe.refresh(found, context)
        return {"FINISHED"}


class TACTILE_OT_remove_plane(_ProbeOperator, bpy.types.Operator):
    """Feel along one plane less"""

    bl_idname = "tactile.remove_plane"
    bl_label = "Remove Plane"

    plane: IntProperty(name="Plane", description="Which one, from 0", min=0, max=MOST_PLANES - 1)

    @classmethod
    def poll(cls, context):
        if not super().poll(context):
            return False
        if probe.probe_of(context.view_layer.objects.active).tactile_probe.plane_count == 3:
            cls.poll_message_set("A patch needs three planes")
            return False
        return True

    def execute(self, context):
        found = probe.probe_of(context.view_layer.objects.active)
        settings = found.tactile_probe
        for name in ("azimuths", "tilts"):
            values = list(getattr(settings, name))
            values.append(values.pop(self.plane))
            setattr(settings, name, values)
        settings.plane_count -= 1
        probe.refresh(found, context)
        return {"FINISHED"}


class TACTILE_OT_update(_ProbeOperator, bpy.types.Operator):
    """Touch again with the numbers and at the place of the probe"""

    bl_idname = "tactile.update"
    bl_label = "Touch Again"

    def execute(self, context):
        found = probe.probe_of(context.view_layer.objects.active)
        probe.refresh(found, context)
        if found.tactile_probe.message:
            self.report({"WARNING"}, found.tactile_probe.message)
        return {"FINISHED"}


class TACTILE_OT_delete(_ProbeOperator, bpy.types.Operator):
    """Delete the probe with its patch and contours; the mesh that was touched stays"""

    bl_idname = "tactile.delete"
    bl_label = "Delete Probe and Patch"

    def execute(self, context):
        found = probe.probe_of(context.view_layer.objects.active)
        patch = probe.patch_of(found)
        lines = None if patch is None else patch_object.contours_of(patch)
        for obj in filter(None, (lines, patch, found)):
            mesh = obj.data
            bpy.data.objects.remove(obj)
            if mesh is not None and not mesh.users:
                bpy.data.meshes.remove(mesh)
        return {"FINISHED"}


class TACTILE_OT_show_colours(bpy.types.Operator):
    """Have this viewport draw the colours of the vertices, in Solid shading"""

    bl_idname = "tactile.show_colours"
    bl_label = "Show Patch Colours"

    @classmethod
    def poll(cls, context):
        space = context.space_data
        if space is None or space.type != "VIEW_3D":
            cls.poll_message_set("Use it in a 3D viewport")
            return False
        if shows_colours(space):
            cls.poll_message_set("This viewport shows the colours of the patch already")
            return False
        return True

    def execute(self, context):
        context.space_data.shading.type = "SOLID"
        context.space_data.shading.color_type = "VERTEX"
        return {"FINISHED"}


def shows_colours(space):
    kind = space.shading.type
    return kind in ("MATERIAL", "RENDERED") or (kind == "SOLID" and space.shading.color_type == "VERTEX")


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
            layout.operator("tactile.show_colours", icon="SHADING_SOLID")
        box = layout.box()
        unit = units.unit_of(context.scene, record["radius"])
        column = box.column(align=True)
        for label, value in _rows(record, unit):
            row = column.row(align=True).split(factor=0.55, align=True)
            row.label(text=label)
            row.label(text=value)
        _draw_sentence(context, box, record["message"], ICONS[record["status"]])
        if found is not None:
            layout.operator(TACTILE_OT_add_plane.bl_idname, icon="ADD")


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
    if record["vertices"]:
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


def _draw_sentence(context, layout, sentence, icon):
    """As many lines as the sidebar's width needs."""
    letters = context.region.width / (6.5 * context.preferences.system.ui_scale) - 8.0
    column = layout.column(align=True)
    column.scale_y = 0.8
    for i, line in enumerate(textwrap.wrap(sentence, max(16, int(letters)))):
        column.label(text=line, icon=icon if i == 0 else "BLANK1")


def draw_menu(self, context):
    self.layout.separator()
    for operator in (TACTILE_OT_pick, TACTILE_OT_reconstruct, TACTILE_OT_add_plane, TACTILE_OT_delete):
        self.layout.operator(operator.bl_idname)


def manual_map():
    """For Online Manual in the context menus: the page that comes with the extension."""
    page = Path(__file__).resolve().parents[1] / "manual" / "viewport.html"
    pages = {
        "bpy.ops.tactile.pick": "#the-first-patch",
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


PANELS = (TACTILE_PT_probe, TACTILE_PT_result)
OPERATORS = (
    TACTILE_OT_add_plane,
    TACTILE_OT_remove_plane,
    TACTILE_OT_update,
    TACTILE_OT_delete,
    TACTILE_OT_show_colours,
)
