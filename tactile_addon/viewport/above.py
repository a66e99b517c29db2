# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Solid shading: maps and incomplete surfaces above their mesh, and patches above each other and surfaces.

Where two objects are in one place, either would show here and there. So they are drawn once more: nearer to
the eye, or one after the other, the nearest last. Along normals, which are means at vertices, edges would
stick out or stay in the mesh. Material Preview and Rendered move them so, by their material. Nothing is moved
that an export has.
"""

from functools import lru_cache
from typing import Any

import bpy
import gpu
import numpy as np
from gpu_extras.batch import batch_for_shader

from ..scene.mesh_data import ABOVE
from ..scene.patch_record import RECORD
from ..touch.evaluated_mesh import read_array
from ..touch.types import Object
from .curves import coordinates

DARKEST, BRIGHTEST = 0.3, 0.7  # The share of its color that a face has edge on, and upright, as in Solid.
VERTEX = """
void main() {
  facing = abs(normalize(mat3(ModelViewMatrix) * normal).z);
  tint = color;
  gl_Position = ProjectionMatrix * ModelViewMatrix * vec4(pos, 1.0);
}
"""
FRAGMENT = f"void main() {{ shown = vec4(tint.rgb * mix({DARKEST}, {BRIGHTEST}, facing), 1.0); }}"
# The batches of objects: a key of what they show, and the batch.
_batches: dict[int, tuple[Any, gpu.types.GPUBatch]] = {}


def draw_above() -> None:
    """Draws the objects of this extension that are in one place with something else."""
    context = bpy.context
    space: Any = context.space_data
    if space.shading.type != "SOLID" or space.shading.color_type != "VERTEX" or context.mode != "OBJECT":
        return
    objects: list[Object] = list(context.visible_objects)
    meshes = [obj for obj in objects if obj.type == "MESH" and ABOVE in obj]
    visible = [obj for obj in meshes if obj.data.color_attributes.active_color]
    for uid in set(_batches) - {obj.session_uid for obj in visible}:
        del _batches[uid]
    in_mesh, in_front = ([o for o in visible if o.show_in_front is shown] for shown in (False, True))
    gpu.state.depth_test_set("LESS_EQUAL")
    gpu.state.depth_mask_set(True)
    for obj in in_mesh:
        _draw(obj, obj[ABOVE])
    if in_front:
        view: Any = context.region_data.view_matrix
        in_front.sort(key=lambda obj: (RECORD in obj, (view @ obj.matrix_world.translation).z))
        for obj in in_front:
            gpu.state.active_framebuffer_get().clear(depth=1.0)  # It is drawn in front of all before it.
            _draw(obj, 0.0)
    gpu.state.depth_mask_set(False)
    gpu.state.depth_test_set("NONE")


def _draw(obj: Object, height: float) -> None:
    """Draws an object this far toward the eye, to the same place on the screen."""
    shader = _shader()
    view: Any = bpy.context.region_data
    depth = (
        -(view.view_matrix @ obj.matrix_world.translation).z if view.is_perspective else view.view_distance
    )
    share = height * obj.matrix_world.median_scale / max(depth, 1e-30)
    with coordinates(obj.matrix_world, min(share, 0.5)):
        shader.uniform_float("ModelViewMatrix", gpu.matrix.get_model_view_matrix())
        shader.uniform_float("ProjectionMatrix", gpu.matrix.get_projection_matrix())
        _batch(obj).draw(shader)


def _batch(obj: Object) -> gpu.types.GPUBatch:
    """The triangles of an object, made anew if it shows something else."""
    mesh, color = obj.data, obj.data.color_attributes.active_color
    colors = read_array(color.data, "color", 4)
    points = read_array(mesh.vertices, "co", 3)
    key = hash(points.tobytes()), hash(colors.tobytes())
    known = _batches.get(obj.session_uid)
    if known is None or known[0] != key:
        mesh.calc_loop_triangles()
        loops = read_array(mesh.loop_triangles, "loops", 3, dtype=np.int32).ravel()
        corners = read_array(mesh.loop_triangles, "vertices", 3, dtype=np.int32).ravel()
        facing = read_array(mesh.corner_normals, "vector", 3)[loops]
        tints = colors[corners if color.domain == "POINT" else loops]
        columns: dict[str, Any] = {"pos": points[corners], "normal": facing, "color": tints}
        _batches[obj.session_uid] = key, batch_for_shader(_shader(), "TRIS", columns)
    return _batches[obj.session_uid][1]


@lru_cache(maxsize=1)
def _shader() -> Any:
    """A shader that lights colors from where they are seen."""
    info: Any = gpu.types.GPUShaderCreateInfo()
    passed = gpu.types.GPUStageInterfaceInfo("above")
    passed.smooth("FLOAT", "facing")
    passed.smooth("VEC4", "tint")
    info.push_constant("MAT4", "ProjectionMatrix")
    info.push_constant("MAT4", "ModelViewMatrix")
    for place, (kind, name) in enumerate((("VEC3", "pos"), ("VEC3", "normal"), ("VEC4", "color"))):
        info.vertex_in(place, kind, name)
    info.vertex_out(passed)
    info.fragment_out(0, "VEC4", "shown")
    info.vertex_source(VERTEX)
    info.fragment_source(FRAGMENT)
    return gpu.shader.create_from_info(info)
