# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes with attributes, filled and read as arrays, and the material that shows their colors."""

from collections.abc import Sequence
from typing import Any

import bpy
import numpy as np

from ..touch.evaluated_mesh import read_array
from ..touch.types import Array, Object
from .undo import note_copied

DOMAIN: Any = "POINT"  # Each vertex has a value.
CORNERS: Any = "CORNER"  # Each corner of a face has a color: on whole objects walls meet at creases.
POSITION = "position"  # Blender's own.
CURVATURES = ("gaussian_curvature", "mean_curvature", "shape_index", "curvedness")
# Those of a whole object have deviations, too, which are infinite where its curvatures are unknown.
GAUSSIAN_STD, CURVATURE_STD = "gaussian_curvature_std", "mean_curvature_std"
DEVIATION = "deviation"  # Signed distances from the mesh that was touched, positive outside it.
HEIGHT_STD = "height_std"
COLOR = "curvature_color"
NORMAL, PLACE = "custom_normal", "domain_place"  # Normals for shading; places on the unit disk.
NODE = "patch"  # The node of a whole object's graph whose patch counts most.
MEASURES = ("error", HEIGHT_STD, "reach", "condition_number", "blind_share")  # Of a stability map,
REASON, TOUCH, MAP_COLOR = "reason", "touch", "stability_color"  # and so are these.
TYPES: dict[str, Any] = {
    **dict.fromkeys((*CURVATURES, GAUSSIAN_STD, CURVATURE_STD, DEVIATION, HEIGHT_STD, *MEASURES), "FLOAT"),
    **dict.fromkeys((POSITION, NORMAL, PLACE), "FLOAT_VECTOR"),
    **dict.fromkeys((COLOR, MAP_COLOR), "FLOAT_COLOR"),
    **dict.fromkeys((NODE, REASON, TOUCH), "INT"),
}
# The property of an attribute's data that has its values, by the attribute's type.
KEYS = {
    "FLOAT": "value",
    "INT": "value",
    "FLOAT_VECTOR": "vector",
    "FLOAT_COLOR": "color_srgb",
}
ABOVE = "tactile_above"  # A custom property of objects: how far above its mesh it is drawn.


def fill(
    mesh: bpy.types.Mesh, points: Array, triangles: Array, attributes: Sequence[tuple[str, Array]]
) -> None:
    """Gives `mesh` points (n, 3), triangles (m, 3) and attributes, names and values each.

    If it has these triangles already, only coordinates and values are written.
    """
    is_alike = (len(mesh.vertices), len(mesh.loops)) == (len(points), triangles.size)
    if not (is_alike and np.array_equal(corners_of(mesh), triangles)):
        mesh.clear_geometry()
        mesh.vertices.add(len(points))
        mesh.loops.add(triangles.size)
        mesh.loops.foreach_set("vertex_index", triangles.astype(np.int32).ravel())
        mesh.polygons.add(len(triangles))
        mesh.polygons.foreach_set("loop_start", np.arange(0, triangles.size, 3, dtype=np.int32))
        mesh.update(calc_edges=True)
    for name, values in [(POSITION, points), *attributes]:
        write(mesh, name, values)
    mesh.update()


def write(mesh: bpy.types.Mesh, name: str, values: Array, domain: Any = DOMAIN) -> None:
    """Writes an attribute, and replaces one of this name and another type or domain."""
    # References to attributes must not outlive the next `new`, which moves all of them.
    attribute = attribute_of(mesh, name, domain)
    if attribute is None:
        if name in mesh.attributes:
            mesh.attributes.remove(mesh.attributes[name])
        attribute = mesh.attributes.new(name, TYPES[name], domain)
    attribute.data.foreach_set(KEYS[TYPES[name]], values.ravel())


def values(mesh: bpy.types.Mesh, name: str) -> Array:
    """The values of an attribute, (n,) or (n, 3)."""
    attribute: Any = mesh.attributes[name]
    key = KEYS[attribute.data_type]
    return read_array(attribute.data, key, 3 if key == "vector" else 1, float)


def attribute_of(mesh: bpy.types.Mesh, name: str, domain: Any = DOMAIN) -> Any:
    """The attribute of this name, or None if there is none with its type and this domain."""
    found: Any = mesh.attributes.get(name)
    is_one = found is not None and (found.data_type, found.domain) == (TYPES[name], domain)
    return found if is_one else None


def own_mesh(obj: Object) -> None:
    """Gives an object a mesh of its own, if it is a linked copy or the override of a library's object."""
    shared = obj.data
    if shared.users > 1 or not shared.is_editable:
        obj.data = shared.copy()
        note_copied(obj, shared)


def corners_of(mesh: bpy.types.Mesh) -> Array:
    """The indices (m, 3) of the corners of the triangles of a mesh that has no other faces."""
    return read_array(mesh.loops, "vertex_index", dtype=np.int32).reshape(-1, 3)


def emission(name: str, attribute: str) -> bpy.types.Material:
    """The material of this name, made if missing, which shows a color attribute as it is.

    Eevee and Cycles draw what has it above the mesh in which it lies, along its normals, by the object's
    length ABOVE. Solid shading draws it in front instead, or viewport/above does. None of these changes its
    geometry.
    """
    material: Any = bpy.data.materials.get(name)
    if material is not None:
        return material
    material = bpy.data.materials.new(name)
    if material.node_tree is None:  # Blender 4.5 needs this; later ones deprecate it.
        material.use_nodes = True
    nodes, links = material.node_tree.nodes, material.node_tree.links
    nodes.clear()
    output, emission = nodes.new("ShaderNodeOutputMaterial"), nodes.new("ShaderNodeEmission")
    source, height = nodes.new("ShaderNodeVertexColor"), nodes.new("ShaderNodeAttribute")
    move = nodes.new("ShaderNodeDisplacement")
    source.layer_name = attribute
    height.attribute_type, height.attribute_name = "OBJECT", ABOVE
    move.inputs["Midlevel"].default_value, move.inputs["Scale"].default_value = 0.0, 1.0
    links.new(source.outputs["Color"], emission.inputs["Color"])
    links.new(emission.outputs["Emission"], output.inputs["Surface"])
    links.new(height.outputs["Fac"], move.inputs["Height"])
    links.new(move.outputs["Displacement"], output.inputs["Displacement"])
    material.displacement_method = "DISPLACEMENT"
    output.location, move.location, height.location = (200, 0), (0, -200), (-200, -200)
    return material
