# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The tool in the viewport's toolbar: each click touches."""

import bpy

from .pick import TACTILE_OT_pick


class TactileTool(bpy.types.WorkSpaceTool):
    bl_space_type, bl_context_mode = "VIEW_3D", "OBJECT"
    bl_idname = "tactile.tool"
    bl_label = "Tactile Probe"
    bl_description = "Click on a mesh to place a probe there or to move the active probe there"
    bl_icon = "ops.paint.eyedropper_add"
    bl_keymap = (
        (
            TACTILE_OT_pick.bl_idname,
            {"type": "LEFTMOUSE", "value": "PRESS"},
            {"properties": [("at_once", True)]},
        ),
    )


def register() -> None:
    bpy.utils.register_tool(TactileTool, after={"builtin.measure"})


def unregister() -> None:
    bpy.utils.unregister_tool(TactileTool)
    # Blender itself leaves the tool's keys among the user's keys.
    user = bpy.context.window_manager.keyconfigs.user
    for keymap in [keymap for keymap in user.keymaps if keymap.name.endswith(f", {TactileTool.bl_label}")]:
        user.keymaps.remove(keymap)
