# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What knows Blender: the surface to touch, the operator, the patch object and the command line."""

import bpy

from . import command_line, operators

_commands = []


def register():
    bpy.utils.register_class(operators.TACTILE_OT_reconstruct)
    bpy.types.VIEW3D_MT_object.append(operators.draw_menu)
    _commands.append(bpy.utils.register_cli_command("tactile", command_line.main))


def unregister():
    bpy.utils.unregister_cli_command(_commands.pop())
    bpy.types.VIEW3D_MT_object.remove(operators.draw_menu)
    bpy.utils.unregister_class(operators.TACTILE_OT_reconstruct)
