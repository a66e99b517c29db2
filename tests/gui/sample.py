# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Run in a window of Blender on examples/sample.blend: the probe's panel, its note, and the preset Paper.

Its pictures are to be looked at.
"""

import os
import sys
from pathlib import Path

import bpy
import gui

sys.path.insert(0, str(Path(__file__).parent))
from common import check, open_tab, picture

FOLDER = Path(os.environ["GUI_SHOT"]).parent


def patches():
    return [obj for obj in bpy.data.objects if "tactile" in obj]


def steps():
    yield from open_tab()
    yield 1
    picture("sample_opened")
    active = bpy.context.view_layer.objects.active
    check("the sample opens with a probe", active is not None and active.tactile_probe.is_probe, active)
    check("its note is there", "Note" in bpy.data.objects)
    vase = bpy.data.objects["Vase"]
    bpy.context.view_layer.objects.active = vase
    window, area, region = gui.find()
    with bpy.context.temp_override(window=window, area=area, region=region):
        bpy.ops.tactile.reconstruct("EXEC_DEFAULT", True, target="Vase", location=(0.0, 0.86, 0.75))
    folders = [Path(path) for path in bpy.utils.preset_paths("operator/tactile.reconstruct")]
    presets = [path / "Paper.py" for path in folders if (path / "Paper.py").is_file()]
    check("Blender lists the preset Paper", len(presets) == 1, folders)
    menu = "WM_MT_operator_presets"
    bpy.ops.script.execute_preset(filepath=str(presets[0]), menu_idname=menu)
    operator = bpy.context.active_operator
    found = (operator.bl_idname, operator.method, operator.solver, operator.degree, operator.plane_count)
    check("it sets the paper's method", found == ("TACTILE_OT_reconstruct", "tagc", "descent", 4, 3), found)
    yield 1


gui.play(steps())
