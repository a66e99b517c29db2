# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What the window's scripts share: lines for run.sh, what there is in the file, and where the view looks."""

import bpy
import gui
from mathutils import Vector


def check(what, good, detail=""):
    print(f"ok: {what}" if good else f"FAILED: {what}: {detail}", flush=True)
    return good


def data_blocks():
    kinds = ("objects", "meshes", "materials", "collections", "node_groups", "images")
    return {kind: sorted(getattr(bpy.data, kind).keys()) for kind in kinds}


def look(point, direction, distance, perspective="PERSP"):
    """Turns the viewport to `point`, seen from `direction`; colours are those of the vertices."""
    _, area, _ = gui.find()
    view = area.spaces.active.region_3d
    view.view_perspective = perspective
    view.view_location = point
    view.view_rotation = Vector(direction).to_track_quat("Z", "Y")
    view.view_distance = distance
    # The material preview does not draw "in front": half of the patch is hidden in the source there.
    area.spaces.active.shading.type = "SOLID"
    area.spaces.active.shading.color_type = "VERTEX"


def open_tab():
    """The sidebar, and in it the extension's tab."""
    gui.sidebar()
    yield 1
    gui.sidebar("Tactile")
    yield 1


def until(reached, seconds=40):
    """Waits until something is so: a window without a graphics card may take its time."""
    for _ in range(10 * seconds):
        yield 0.1
        if reached():
            break
    yield 0.5


def last_report():
    """The last line of Blender's log of reports, which only its own editor and the clipboard give out."""
    area = next(area for area in bpy.context.window.screen.areas if area.type != "VIEW_3D")
    kind, area.type = area.type, "INFO"
    region = next(region for region in area.regions if region.type == "WINDOW")
    with bpy.context.temp_override(area=area, region=region):
        bpy.ops.info.select_all(action="SELECT")
        bpy.ops.info.report_copy()
    area.type = kind
    lines = bpy.context.window_manager.clipboard.splitlines()
    return lines[-1] if lines else ""
