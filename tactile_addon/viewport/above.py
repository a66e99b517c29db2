# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Maps and incomplete surfaces in Solid shading: drawn above the mesh in which they lie.

Their far side would show through a hole if they were drawn in front, and in their place they would mix with
the mesh. Material Preview and Rendered move them by their material. So nothing is moved that an export has.
"""

from functools import lru_cache
from typing import Any

import bpy
import gpu
import numpy as np

from ..scene.mesh_data import ABOVE
from ..scene.patch_record import ATLAS_RECORD, MAP_RECORD
from ..touch.arrays import read_array
from ..touch.types import Array, Object

DARKEST, BRIGHTEST = (
    0.3,
    0.7,
)  # Shares of the color that faces have edge on and upright, as Solid shading has.
VERTEX = """
void main() {
  facing = abs(normalize(mat3(ModelViewMatrix) * normal).z);
  tint = color;
  gl_Position = ModelViewProjectionMatrix * vec4(pos, 1.0);
}
"""
FRAGMENT = f"void main() {{ shown = vec4(tint.rgb * mix({DARKEST}, {BRIGHTEST}, facing), 1.0); }}"
# The batches of objects: a key of what they show, and the batch.
_batches: dict[int, tuple[Any, gpu.types.GPUBatch]] = {}


def draw_above() -> None:
    """Draws what needs it above its mesh, as far as its material would move it."""
    context = bpy.context
    space: Any = context.space_data
    if space.shading.type != "SOLID" or space.shading.color_type != "VERTEX" or context.mode != "OBJECT":
        return
    shown = [obj for obj in context.visible_objects if _lies_in_mesh(obj)]
    for uid in set(_batches) - {obj.session_uid for obj in shown}:
        del _batches[uid]
    gpu.state.depth_test_set("LESS_EQUAL")
    gpu.state.depth_mask_set(True)
    for obj in shown:
        with gpu.matrix.push_pop():
            gpu.matrix.multiply_matrix(obj.matrix_world)
            shader = _shader()
            shader.uniform_float("ModelViewMatrix", gpu.matrix.get_model_view_matrix())
            _batch(obj).draw(shader)
    gpu.state.depth_mask_set(False)
    gpu.state.depth_test_set("NONE")


def _lies_in_mesh(obj: Object) -> bool:
    """Whether an object is a map or a surface that is not drawn in front."""
    return (ATLAS_RECORD in obj or MAP_RECORD in obj) and not obj.show_in_front and obj.type == "MESH"


def _batch(obj: Object) -> gpu.types.GPUBatch:
    """The triangles of an object, made anew if it shows something else."""
    mesh = obj.data
    color: Any = mesh.color_attributes.active_color
    colors, points = read_array(color.data, "color", 4), read_array(mesh.vertices, "co", 3)
    key = hash(points.tobytes()), hash(colors.tobytes()), obj[ABOVE]
    known = _batches.get(obj.session_uid)
    if known is None or known[0] != key:
        _batches[obj.session_uid] = key, _new_batch(mesh, colors, obj[ABOVE])
    return _batches[obj.session_uid][1]


def _new_batch(mesh: bpy.types.Mesh, colors: Array, height: float) -> gpu.types.GPUBatch:
    """The triangles of a mesh with colors (k, 4) of its corners, moved along its normals."""
    mesh.calc_loop_triangles()
    loops = read_array(mesh.loop_triangles, "loops", 3, dtype=np.int32).ravel()
    corners = read_array(mesh.loop_triangles, "vertices", 3, dtype=np.int32).ravel()
    normals = read_array(mesh.vertices, "normal", 3)
    points = read_array(mesh.vertices, "co", 3) + height * normals
    facing = read_array(mesh.corner_normals, "vector", 3)
    form = gpu.types.GPUVertFormat()
    columns = {"pos": points[corners], "normal": facing[loops], "color": colors[loops]}
    for name, values in columns.items():
        form.attr_add(id=name, comp_type="F32", len=values.shape[1], fetch_mode="FLOAT")
    buffer = gpu.types.GPUVertBuf(form, len(loops))
    for name, values in columns.items():
        buffer.attr_fill(id=name, data=np.ascontiguousarray(values, dtype=np.float32))
    return gpu.types.GPUBatch(type="TRIS", buf=buffer)


@lru_cache(maxsize=1)
def _shader() -> gpu.types.GPUShader:
    """A shader that lights colors from where they are seen."""
    info, passed = gpu.types.GPUShaderCreateInfo(), gpu.types.GPUStageInterfaceInfo("above")
    passed.smooth("FLOAT", "facing")
    passed.smooth("VEC4", "tint")
    info.push_constant("MAT4", "ModelViewProjectionMatrix")
    info.push_constant("MAT4", "ModelViewMatrix")
    for place, (kind, name) in enumerate((("VEC3", "pos"), ("VEC3", "normal"), ("VEC4", "color"))):
        info.vertex_in(place, kind, name)
    info.vertex_out(passed)
    info.fragment_out(0, "VEC4", "shown")
    info.vertex_source(VERTEX)
    info.fragment_source(FRAGMENT)
    return gpu.shader.create_from_info(info)
