# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The reconstruction as objects of the scene: the patch, and the tracked contours."""

import bpy
import numpy as np
from mathutils import Matrix

from . import colours

COLLECTION = "Tactile Patches"
RECORD = "tactile"  # the patch object's custom property that holds the report
COLOUR = "curvature_colour"
RINGS = 25  # of the patch mesh: 1951 vertices
CONTOUR_COLOUR = (0.02, 0.02, 0.02, 1.0)


def insert(scene, reconstruction, contours, report, deviation):
    """Adds the patch and its contours to `scene`, in a collection of their own; returns the patch object.

    report : what the patch object keeps, completed here by what the objects are called and coloured
    deviation(points (n, 3), normals (n, 3)) : signed world distances (n,) to the touched mesh
    """
    name = report["source"]
    mesh, limit = _patch_mesh(f"{name} Patch", reconstruction, deviation)
    patch = bpy.data.objects.new(f"{name} Patch", mesh)
    patch.matrix_world = _matrix(reconstruction.frame)
    lines = bpy.data.objects.new(
        f"{name} Contours", _contour_mesh(f"{name} Contours", reconstruction, contours)
    )
    lines.parent = patch
    for obj in (patch, lines):
        obj.show_in_front = True  # it lies in the surface it describes
        _collection(scene).objects.link(obj)
    patch[RECORD] = report | {"patch": patch.name, "contours": lines.name, "colour_limit": limit}
    return patch


def _matrix(frame):
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = frame.axes, frame.origin
    return Matrix(matrix.tolist())


def _collection(scene):
    # In a second scene of the file it is "Tactile Patches.001".
    named = (c for c in scene.collection.children_recursive if c.name.partition(".")[0] == COLLECTION)
    found = next(named, None)
    if found is None:
        found = bpy.data.collections.new(COLLECTION)
        scene.collection.children.link(found)
    return found


def _patch_mesh(name, reconstruction, deviation):
    """The patch in the Darboux frame, with curvatures as attributes and colours; and the colours' range."""
    patch, radius = reconstruction.patch, reconstruction.radius
    plane, triangles = reconstruction.domain.triangulation(RINGS)
    x, y = plane.T
    points, normals = np.column_stack([plane, patch.height(x, y)]), patch.normal(x, y)
    gaussian = patch.gaussian_curvature(x, y)
    limit = colours.symmetric_range(gaussian, floor=1e-3 / radius**2)
    frame = reconstruction.frame
    attributes = [
        ("gaussian_curvature", "FLOAT", gaussian),
        ("mean_curvature", "FLOAT", patch.mean_curvature(x, y)),
        ("height_std", "FLOAT", reconstruction.height_std(x, y)),
        ("deviation", "FLOAT", deviation(frame.to_world(points), normals @ frame.axes.T)),
        ("custom_normal", "FLOAT_VECTOR", normals),
        (COLOUR, "FLOAT_COLOR", colours.diverging(gaussian, limit)),
    ]
    mesh = triangle_mesh(name, points, triangles, attributes)
    mesh.color_attributes.active_color_name = mesh.color_attributes.default_color_name = COLOUR
    mesh.materials.append(emission("Tactile Curvature", attribute=COLOUR))
    return mesh, limit


def _contour_mesh(name, reconstruction, contours):
    """Tubes along the contours and an octahedron at each contact, in the Darboux frame.

    Point attributes tell them apart: `contour` counts the contours, `contact` the contacts along
    one, and is -1 on the tubes.
    """
    thickness = 0.009 * reconstruction.radius
    points, triangles, contour_index, contact_index = [], [], [], []
    count = 0
    for number, contour in enumerate(contours):
        path = reconstruction.frame.to_local(contour.points)
        across = reconstruction.frame.axes.T @ contour.plane_normal
        for mesh_points, mesh_triangles, contact in (
            (*_tube(path, across, thickness), np.full(4 * len(path), -1)),
            (*_octahedra(path, 3.6 * thickness), np.repeat(np.arange(len(path)), 6)),
        ):
            points.append(mesh_points)
            triangles.append(mesh_triangles + count)
            contour_index.append(np.full(len(mesh_points), number))
            contact_index.append(contact)
            count += len(mesh_points)
    attributes = [
        ("contour", "INT", np.concatenate(contour_index)),
        ("contact", "INT", np.concatenate(contact_index)),
    ]
    mesh = triangle_mesh(name, np.vstack(points), np.vstack(triangles), attributes)
    mesh.materials.append(emission("Tactile Contour", colour=CONTOUR_COLOUR))
    return mesh


def _tube(path, across, thickness):
    """A square tube along a path (n, 3) in the plane normal to `across`: points (4n, 3) and triangles."""
    ahead = np.gradient(path, axis=0)
    up = np.cross(across, ahead)
    up /= np.linalg.norm(up, axis=1, keepdims=True)
    corners = [path + thickness * (a * up + b * across) for a, b in ((1, 1), (1, -1), (-1, -1), (-1, 1))]
    ring = np.arange(4)
    a = (4 * np.arange(len(path) - 1)[:, None] + ring).ravel()
    b = (4 * np.arange(len(path) - 1)[:, None] + (ring + 1) % 4).ravel()
    triangles = np.vstack([np.column_stack([a, b, b + 4]), np.column_stack([a, b + 4, a + 4])])
    return np.stack(corners, axis=1).reshape(-1, 3), triangles


def _octahedra(centres, radius):
    """An octahedron at each of centres (n, 3): points (6n, 3) and triangles (8n, 3)."""
    tips = radius * np.vstack([np.eye(3), -np.eye(3)])
    faces = np.array([(0, 1, 2), (1, 3, 2), (3, 4, 2), (4, 0, 2), (1, 0, 5), (3, 1, 5), (4, 3, 5), (0, 4, 5)])
    offsets = 6 * np.arange(len(centres))
    return (centres[:, None] + tips).reshape(-1, 3), (offsets[:, None, None] + faces).reshape(-1, 3)


def triangle_mesh(name, points, triangles, attributes):
    """A mesh of points (n, 3) and triangles (m, 3) with point attributes (name, Blender's type, values)."""
    mesh = bpy.data.meshes.new(name)
    mesh.vertices.add(len(points))
    mesh.vertices.foreach_set("co", points.astype(np.float32).ravel())
    mesh.loops.add(triangles.size)
    mesh.loops.foreach_set("vertex_index", triangles.astype(np.int32).ravel())
    mesh.polygons.add(len(triangles))
    mesh.polygons.foreach_set("loop_start", np.arange(0, triangles.size, 3, dtype=np.int32))
    keys = {"FLOAT": "value", "INT": "value", "FLOAT_VECTOR": "vector", "FLOAT_COLOR": "color"}
    for attribute, kind, values in attributes:
        # No reference to an attribute may outlive the next `new`, which moves them all.
        mesh.attributes.new(attribute, kind, "POINT").data.foreach_set(keys[kind], values.ravel())
    mesh.update(calc_edges=True)
    return mesh


def emission(name, attribute=None, colour=(1.0, 1.0, 1.0, 1.0)):
    """The material of that name, made where missing: a colour attribute or one colour, shown as it is."""
    material = bpy.data.materials.get(name)
    if material is None:
        material = bpy.data.materials.new(name)
        if material.node_tree is None:  # in Blender 4.5; later ones have it, and deprecate the switch
            material.use_nodes = True
        material.diffuse_color = colour
        nodes, links = material.node_tree.nodes, material.node_tree.links
        nodes.clear()
        emission = nodes.new("ShaderNodeEmission")
        output = nodes.new("ShaderNodeOutputMaterial")
        links.new(emission.outputs["Emission"], output.inputs["Surface"])
        if attribute is None:
            emission.inputs["Color"].default_value = colour
        else:
            source = nodes.new("ShaderNodeVertexColor")
            source.layer_name = attribute
            links.new(source.outputs["Color"], emission.inputs["Color"])
        output.location, emission.location = (200, 0), (0, 0)
    return material
