# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Solid shading: maps and incomplete surfaces above their mesh, and patches above each other and surfaces.

Where two objects are in one place, either would show here and there. So they are drawn once more, moved along
normals or toward the viewer. Material Preview and Rendered move them by their material. Nothing is moved that
an export has.
"""

from collections.abc import Sequence
from functools import lru_cache
from typing import Any, cast

import bpy
import gpu
import numpy as np

from ..scene.mesh_data import ABOVE
from ..scene.patch_record import ATLAS_RECORD, MAP_RECORD, report_of
from ..touch.arrays import read_array
from ..touch.types import Array, Object

DARKEST, BRIGHTEST = 0.3, 0.7  # The share of its color that a face has edge on, and upright, as in Solid.
TOWARD = 0.015  # A patch is drawn nearer by this share of its distance than what is below it.
ALIKE = 0.1  # Patches overlap only if the cosine between their normals is more.
# The place on the screen stays, and only the depth is that of a nearer point.
VERTEX = """
void main() {
  vec4 seen = ModelViewMatrix * vec4(pos, 1.0);
  facing = abs(normalize(mat3(ModelViewMatrix) * normal).z);
  tint = color;
  gl_Position = ProjectionMatrix * seen;
  vec4 nearer = ProjectionMatrix * vec4(seen.xyz + (ProjectionMatrix[3][3] == 0.0 ? -seen.xyz * toward
                                                    : vec3(0.0, 0.0, toward * size)), 1.0);
  gl_Position.z = nearer.z / nearer.w * gl_Position.w;
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
    objects: Sequence[Object] = list(context.visible_objects)
    visible = {obj for obj in objects if obj.type == "MESH" and obj.data.color_attributes.active_color}
    in_mesh = [obj for obj in visible if _is_of_object(obj) and not obj.show_in_front]
    layers = _layers([obj for obj in visible if obj.show_in_front])
    for uid in set(_batches) - {obj.session_uid for obj in (*in_mesh, *layers)}:
        del _batches[uid]
    gpu.state.depth_test_set("LESS_EQUAL")
    gpu.state.depth_mask_set(True)
    for obj in in_mesh:
        _draw(obj, obj.get(ABOVE, 0.0), 0)
    if any(layers.values()):
        gpu.state.active_framebuffer_get().clear(depth=1.0)  # They are drawn in front of all others.
        for obj, layer in layers.items():
            _draw(obj, 0.0, layer)
    gpu.state.depth_mask_set(False)
    gpu.state.depth_test_set("NONE")


def _is_of_object(obj: Object) -> bool:
    """Whether an object is the surface or the map of a whole object."""
    return ATLAS_RECORD in obj or MAP_RECORD in obj


def _layers(objects: list[Object]) -> dict[Object, int]:
    """The layers of surfaces, which are 0, and of patches, which are above what they overlap."""
    layers = {obj: 0 for obj in objects if _is_of_object(obj)}
    first, placed = int(bool(layers)), np.zeros((0, 8))
    patches = {obj: report for obj in objects if (report := report_of(obj)) is not None}
    for obj in sorted(patches, key=lambda each: each.session_uid):
        matrix, radius = np.array(obj.matrix_world), patches[obj]["radius"]
        place, normal = matrix[:3, 3], matrix[:3, 2]
        near = np.linalg.norm(placed[:, :3] - place, axis=1) < placed[:, 6] + radius
        taken = placed[near & (placed[:, 3:6] @ normal > ALIKE), 7]
        layers[obj] = next(n for n in range(first, len(taken) + first + 1) if n not in taken)
        placed = np.vstack([placed, [*place, *normal, radius, layers[obj]]])
    return layers


def _draw(obj: Object, height: float, layer: int) -> None:
    """Draws an object this far along its normals, and by so many layers toward the viewer."""
    shader, pushed = _shader(), cast(Any, gpu.matrix.push_pop())  # which the stubs make no context
    with pushed:
        gpu.matrix.multiply_matrix(obj.matrix_world)
        shader.uniform_float("ModelViewMatrix", gpu.matrix.get_model_view_matrix())
        shader.uniform_float("ProjectionMatrix", gpu.matrix.get_projection_matrix())
        shader.uniform_float("toward", TOWARD * layer)
        shader.uniform_float("size", max(obj.dimensions))
        _batch(obj, height).draw(shader)


def _batch(obj: Object, height: float) -> gpu.types.GPUBatch:
    """The triangles of an object, made anew if it shows something else."""
    mesh, color = obj.data, obj.data.color_attributes.active_color
    colors = read_array(color.data, "color", 4)
    points = read_array(mesh.vertices, "co", 3)
    key = hash(points.tobytes()), hash(colors.tobytes()), height
    known = _batches.get(obj.session_uid)
    if known is None or known[0] != key:
        if color.domain == "POINT":
            colors = colors[read_array(mesh.loops, "vertex_index", dtype=np.int32)]
        _batches[obj.session_uid] = key, _new_batch(mesh, points, colors, height)
    return _batches[obj.session_uid][1]


def _new_batch(mesh: bpy.types.Mesh, points: Array, colors: Array, height: float) -> gpu.types.GPUBatch:
    """The triangles of a mesh with points (n, 3) and colors (k, 4) of corners, moved along its normals."""
    mesh.calc_loop_triangles()
    loops = read_array(mesh.loop_triangles, "loops", 3, dtype=np.int32).ravel()
    corners = read_array(mesh.loop_triangles, "vertices", 3, dtype=np.int32).ravel()
    normals = read_array(mesh.vertices, "normal", 3)
    points = points + height * normals
    facing = read_array(mesh.corner_normals, "vector", 3)
    form = gpu.types.GPUVertFormat()
    columns = {"pos": points[corners], "normal": facing[loops], "color": colors[loops]}
    for name, values in columns.items():
        form.attr_add(id=name, comp_type="F32", len=values.shape[1], fetch_mode="FLOAT")
    buffer: Any = gpu.types.GPUVertBuf(form, len(loops))  # which takes arrays, though the stubs have none
    for name, values in columns.items():
        buffer.attr_fill(id=name, data=np.ascontiguousarray(values, dtype=np.float32))
    return gpu.types.GPUBatch(type="TRIS", buf=buffer)


@lru_cache(maxsize=1)
def _shader() -> Any:
    """A shader that lights colors from where they are seen."""
    info: Any = gpu.types.GPUShaderCreateInfo()
    passed = gpu.types.GPUStageInterfaceInfo("above")
    passed.smooth("FLOAT", "facing")
    passed.smooth("VEC4", "tint")
    for kind, name in (
        ("MAT4", "ProjectionMatrix"),
        ("MAT4", "ModelViewMatrix"),
        ("FLOAT", "toward"),
        ("FLOAT", "size"),
    ):
        info.push_constant(kind, name)
    for place, (kind, name) in enumerate((("VEC3", "pos"), ("VEC3", "normal"), ("VEC4", "color"))):
        info.vertex_in(place, kind, name)
    info.vertex_out(passed)
    info.fragment_out(0, "VEC4", "shown")
    info.vertex_source(VERTEX)
    info.fragment_source(FRAGMENT)
    return gpu.shader.create_from_info(info)
