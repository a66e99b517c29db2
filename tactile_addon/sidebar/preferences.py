# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The menu entries, the manual's pages and the preferences."""

from pathlib import Path
from typing import Any

import bpy
from bpy.props import StringProperty

from .panel import PANELS, TAB

ENTRIES = (
    *("tactile.pick", "tactile.reconstruct", "tactile.stability_map", ""),
    *("tactile.verify", "tactile.register", ""),
    *("tactile.add_plane", "tactile.add_planes", "tactile.update", "tactile.delete"),
)


class VIEW3D_MT_tactile(bpy.types.Menu):
    bl_label = "Tactile Patch"

    def draw(self, context: bpy.types.Context) -> None:
        for operator in ENTRIES:
            if operator:
                self.layout.operator(operator)
            else:
                self.layout.separator()


def _draw_in_object(self: bpy.types.Menu, context: bpy.types.Context) -> None:
    self.layout.separator()
    self.layout.menu(VIEW3D_MT_tactile.__name__)


def _draw_in_add(self: bpy.types.Menu, context: bpy.types.Context) -> None:
    self.layout.separator()
    self.layout.operator("tactile.reconstruct", icon="SURFACE_DATA")


MENUS = (("VIEW3D_MT_object", _draw_in_object), ("VIEW3D_MT_mesh_add", _draw_in_add))


def manual_map() -> tuple[str, tuple[tuple[str, str], ...]]:
    """The extension's manual pages, one for each section, for Online Manual in context menus."""
    folder = Path(__file__).resolve().parents[2] / "manual"
    pages = {
        "bpy.ops.tactile.pick": "the-first-patch.html",
        "bpy.ops.tactile.verify": "verify.html",
        "bpy.ops.tactile.register": "register.html",
        "bpy.ops.tactile.export_report": "report.html",
        "bpy.ops.tactile.stability_map": "stability-map.html",
        "bpy.types.object.tactile_map_colors": "stability-map.html",
        "bpy.ops.tactile*": "probe.html",
        "bpy.types.tactileprobe*": "probe.html",
        "bpy.types.object.tactile_colors": "result.html",
    }
    return f"{folder.as_uri()}/", tuple(pages.items())


def _move_tab(preferences: Any, context: bpy.types.Context) -> None:
    """Registers the panels again, because they learn their tab only then."""
    for panel in PANELS:
        bpy.utils.unregister_class(panel)
        panel.bl_category = preferences.tab or TAB
        bpy.utils.register_class(panel)


def restore_tab() -> None:
    """Puts the panels into the tab of the preferences, if the extension has preferences."""
    addon: Any = bpy.context.preferences.addons.get(TactilePreferences.bl_idname)
    if addon is not None and addon.preferences.tab != TAB:
        _move_tab(addon.preferences, bpy.context)


class TactilePreferences(bpy.types.AddonPreferences):
    bl_idname = __package__.rsplit(".", 2)[0]

    tab: StringProperty(
        name="Sidebar Tab",
        description="Tab of the sidebar that has the panels",
        default=TAB,
        update=_move_tab,
    )

    def draw(self, context: bpy.types.Context) -> None:
        self.layout.use_property_split = True
        self.layout.prop(self, "tab")
        self.layout.operator(
            "wm.url_open", text="Manual", icon="HELP"
        ).url = f"{manual_map()[0]}viewport.html"
