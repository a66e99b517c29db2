# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""All that uses Blender: surfaces to touch, probes, operators, panels, handles, patches, the command line."""

from pathlib import Path
from typing import Any

import bpy

from . import command_line
from .comparison import operators as comparison_operators
from .files import contact_operators, export_operators
from .probes import change_handlers, in_slices, operators, probe, probe_operators
from .report import pages
from .scene import shown
from .sidebar import panel, preferences, rows
from .stability_map import map_object
from .viewport import drag, gizmos, overlay, pick
from .whole_object import object_operators

CLASSES = (
    probe.TactileProbe,
    operators.TACTILE_OT_reconstruct,
    in_slices.TACTILE_OT_stop,
    comparison_operators.TACTILE_OT_verify,
    comparison_operators.TACTILE_OT_register,
    map_object.TACTILE_OT_stability_map,
    *object_operators.CLASSES,
    pick.TACTILE_OT_pick,
    drag.TACTILE_OT_drag,
    gizmos.TACTILE_GT_rim,
    gizmos.TACTILE_GGT_handles,
    *probe_operators.OPERATORS,
    *contact_operators.CLASSES,
    *export_operators.CLASSES,
    pages.TACTILE_OT_export_report,
    rows.TACTILE_OT_copy_value,
    *panel.PANELS,
    preferences.VIEW3D_MT_tactile,
    preferences.TactilePreferences,
)
_register_classes, _unregister_classes = bpy.utils.register_classes_factory(CLASSES)
MENUS = (
    *preferences.MENUS,
    *contact_operators.MENUS,
    *export_operators.MENUS,
)
PROPERTIES = probe.PROPERTIES | shown.PROPERTIES | map_object.PROPERTIES  # Of objects, by name.
_commands: list[Any] = []
_drawings: list[Any] = []
HERE = str(Path(__file__).resolve().parent)  # It holds presets/.


def register() -> None:
    rows.register_dots()
    _register_classes()
    for name, kind in PROPERTIES.items():
        setattr(bpy.types.Object, name, kind)
    pick.register_tool()
    preferences.restore_tab()
    for menu, draw in MENUS:
        getattr(bpy.types, menu).append(draw)
    bpy.utils.register_manual_map(preferences.manual_map)
    bpy.utils.register_preset_path(HERE)
    change_handlers.register()
    _commands.append(bpy.utils.register_cli_command("tactile", command_line.main))
    _drawings.extend(overlay.add_drawings(overlay.DRAWINGS))


def unregister() -> None:
    while _drawings:
        bpy.types.SpaceView3D.draw_handler_remove(_drawings.pop(), "WINDOW")
    change_handlers.unregister()
    bpy.utils.unregister_cli_command(_commands.pop())
    bpy.utils.unregister_preset_path(HERE)
    bpy.utils.unregister_manual_map(preferences.manual_map)
    for menu, draw in MENUS:
        getattr(bpy.types, menu).remove(draw)
    pick.unregister_tool()
    object_operators.kept.clear()
    for name in PROPERTIES:
        delattr(bpy.types.Object, name)
    _unregister_classes()
    rows.unregister_dots()
