# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Run by Blender: a scene to touch, and its surface as mesh files, in the folder named after `--`."""

import sys
from pathlib import Path

import bpy

folder = Path(sys.argv[sys.argv.index("--") + 1]).absolute()
bpy.ops.wm.read_homefile(use_factory_startup=True)
bpy.data.objects.remove(bpy.data.objects["Cube"])
bpy.ops.mesh.primitive_monkey_add(rotation=(0.1, 0.2, 0.3), location=(0.3, -0.2, 0.1))
suzanne = bpy.context.object
suzanne.scale = (1.2, 0.8, 1.0)
modifier = suzanne.modifiers.new("Subdivision", "SUBSURF")
modifier.levels = modifier.render_levels = 3  # the exports of .ply and .stl take the level of rendering
bpy.context.view_layer.update()

evaluated = suzanne.evaluated_get(bpy.context.evaluated_depsgraph_get())
hit, forehead, _, _ = evaluated.ray_cast((-0.35, -5.0, 0.8), (0.0, 1.0, 0.0))
assert hit
bpy.context.scene.cursor.location = suzanne.matrix_world @ forehead

bpy.ops.wm.ply_export(filepath=str(folder / "scene.ply"))
bpy.ops.wm.stl_export(filepath=str(folder / "scene.stl"))
bpy.ops.wm.obj_export(
    filepath=str(folder / "scene.obj"), forward_axis="Y", up_axis="Z", export_materials=False
)
bpy.ops.wm.save_as_mainfile(filepath=str(folder / "scene.blend"))
