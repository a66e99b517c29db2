# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The reconstruction as objects of the scene: the patch, and the tracked contours."""

import json

import bpy
import numpy as np
from mathutils import Matrix

from .. import core
from . import colours

COLLECTION = "Tactile Patches"
RECORD = "tactile"  # the patch object's custom property that holds the report,
RECONSTRUCTION = "tactile_reconstruction"  # and the one with core.to_dict as JSON, once a gesture has ended
COLOUR = "curvature_colour"
RINGS = 25  # of the patch mesh: 1951 vertices
CONTOURS = "tactile_contours"  # the custom property that tells them from other children of a patch
CONTOUR_COLOUR = (0.02, 0.02, 0.02, 1.0)
KEYS = {
    "FLOAT": "value",
    "INT": "value",
    "BOOLEAN": "value",
    "FLOAT_VECTOR": "vector",
    "FLOAT_COLOR": "color",
}
# What the colours can show: attribute, name, description, and the power of length it is measured in.
QUANTITIES = [
    ("gaussian_curvature", "Gaussian Curvature", "K: red on domes and bowls, blue on saddles", -2),
    ("mean_curvature", "Mean Curvature", "H: blue where the surface bulges outward, red where inward", -1),
    ("deviation", "Deviation", "How far the patch is outside the mesh (red) or inside (blue)", 1),
    ("height_std", "Standard Deviation", "How well the contacts determine the height", 1),
]
POWERS = {name: power for name, _, _, power in QUANTITIES}
POSITIVE = ("height_std",)  # never below zero: half a scale says it all
FLOOR = 1e-3  # of the colours' range, in unit radius: a plane is white


def insert(scene, touched, parent=None):
    """Adds the patch and its contours to `scene`, in a collection of their own; returns the patch object."""
    name = touched.report["source"]
    patch, lines = (
        bpy.data.objects.new(f"{name} {what}", bpy.data.meshes.new(f"{name} {what}"))
        for what in ("Patch", "Contours")
    )
    patch.parent, lines.parent, lines[CONTOURS] = parent, patch, True
    for obj in (patch, lines):
        obj.show_in_front = True  # it lies in the surface it describes
        collection(scene).objects.link(obj)
    patch.data.materials.append(emission("Tactile Curvature", attribute=COLOUR))
    lines.data.materials.append(emission("Tactile Contour", colour=CONTOUR_COLOUR))
    rewrite(patch, touched)
    return patch


def rewrite(patch, touched):
    """Makes the patch, and its contours where they are still there, those of another touch, in place."""
    lines = contours_of(patch)
    for obj in filter(None, (patch, lines)):
        own_mesh(obj)
    _fill_patch(patch.data, touched)
    names = {"patch": patch.name}
    if lines is not None:
        _fill_contours(lines.data, touched)
        names["contours"] = lines.name
    _place(patch, _matrix(touched.result.frame.axes, touched.result.frame.origin))
    patch[RECORD] = touched.report | names
    patch.pop(RECONSTRUCTION, None)
    if touched.is_complete:
        patch[RECONSTRUCTION] = json.dumps(core.to_dict(touched.result), allow_nan=False)
    recolour(patch)


def own_mesh(obj):
    """A linked copy shows something else than the others from now on."""
    if obj.data.users > 1:
        obj.data = obj.data.copy()


def reconstruction_of(patch):
    """core.to_dict of what the patch shows, as JSON. Raises ValueError while a gesture goes on."""
    if RECONSTRUCTION not in patch:
        raise ValueError(f'"{patch.name}" is not complete: end the gesture, or touch again')
    return patch[RECONSTRUCTION]


def contacts_of(patch):
    """The contacts of a patch object as contours in the world. Raises ValueError where there are none."""
    lines = contours_of(patch)
    if lines is None or not {"contour", "contact"} <= set(lines.data.attributes.keys()):
        raise ValueError(f'"{patch.name}" has no contours any more: touch again')
    frame = patch[RECORD]["frame"]
    axes = np.transpose([frame[name] for name in ("d1", "d2", "normal")])
    curve, contact, points = (_values(lines.data, name) for name in ("contour", "contact", "position"))
    normals = _values(lines.data, "contact_normal") if "contact_normal" in lines.data.attributes else None
    contours = []
    for number in range(int(curve.max()) + 1):
        # An octahedron each, whose six tips are one after the other.
        tips = np.flatnonzero((curve == number) & (contact >= 0))
        centres = points[tips].reshape(-1, 6, 3).mean(axis=1)
        up = None if normals is None else normals[tips[::6]] @ axes.T
        contours.append(core.Contour(frame["origin"] + centres @ axes.T, normals=up))
    return contours


def _values(mesh, name):
    """Of a point attribute, (n,) or (n, 3)."""
    attribute = mesh.attributes[name]
    key = KEYS[attribute.data_type]
    values = np.empty((len(attribute.data), 3) if key == "vector" else len(attribute.data))
    attribute.data.foreach_get(key, values.ravel())
    return values


def _place(patch, matrix):
    """Puts the patch there in the world, under its probe or not; it stays where the probe is deleted."""
    if patch.parent is not None:
        patch.matrix_parent_inverse = patch.parent.matrix_world.inverted_safe()
    patch.matrix_world = matrix  # known before the next evaluation
    patch.matrix_basis = matrix


def hold(patch):
    """Keeps the patch where it was touched while its probe moves on without it."""
    axes, origin = touched_frame(patch)
    if not is_at(patch, axes, origin):
        _place(patch, _matrix(axes, origin))


def touched_frame(patch):
    """Where it was touched: axes as columns, and origin."""
    frame = patch[RECORD]["frame"]
    return np.transpose([frame[name] for name in ("d1", "d2", "normal")]), np.array(frame["origin"])


def is_at(patch, axes, origin):
    near = {"rtol": 1e-6, "atol": 1e-6 * patch[RECORD]["radius"]}
    return np.allclose(patch.matrix_world, _matrix(axes, origin), **near)


def meshes(patch):
    """Those of a patch object and of its contours; none for no patch."""
    objects = [] if patch is None else [patch, contours_of(patch)]
    return [obj.data for obj in objects if obj is not None]


def contours_of(patch):
    """The contours of a patch object, or None."""
    return next((child for child in patch.children if CONTOURS in child), None)


def recolour(patch):
    """Colours the patch by what it is set to show, and keeps their range in its record."""
    shown, mesh = patch.tactile_colours, patch.data
    values = np.empty(len(mesh.vertices), dtype=np.float32)
    mesh.attributes[shown].data.foreach_get("value", values)
    record = patch[RECORD]
    limit = colours.symmetric_range(values, floor=FLOOR * record["radius"] ** POWERS[shown])
    mesh.attributes[COLOUR].data.foreach_set("color", colours.diverging(values, limit).ravel())
    mesh.color_attributes.active_color_name = mesh.color_attributes.default_color_name = COLOUR
    mesh.update()
    record["colour_limit"] = limit


def _matrix(axes, origin):
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = axes, origin
    return Matrix(matrix.tolist())


def collection(scene):
    # In a second scene of the file it is "Tactile Patches.001".
    named = (c for c in scene.collection.children_recursive if c.name.partition(".")[0] == COLLECTION)
    found = next(named, None)
    if found is None:
        found = bpy.data.collections.new(COLLECTION)
        scene.collection.children.link(found)
    return found


def _fill_patch(mesh, touched):
    """The patch in the Darboux frame, with its attributes; deviations are 0 until the touch is verified."""
    result = touched.result
    patch, frame = result.patch, result.frame
    plane, triangles = result.domain.triangulation(RINGS)
    x, y = plane.T
    points, normals = np.column_stack([plane, patch.height(x, y)]), patch.normal(x, y)
    deviation = np.zeros(len(points))
    if touched.is_verified:
        world = frame.to_world(points), normals @ frame.axes.T
        deviation = touched.surface.deviations(*world, result.radius)
    attributes = [
        ("gaussian_curvature", "FLOAT", patch.gaussian_curvature(x, y)),
        ("mean_curvature", "FLOAT", patch.mean_curvature(x, y)),
        ("height_std", "FLOAT", result.height_std(x, y)),
        ("deviation", "FLOAT", deviation),
        ("custom_normal", "FLOAT_VECTOR", normals),
        (COLOUR, "FLOAT_COLOR", np.ones((len(points), 4))),
    ]
    fill(mesh, points, triangles, attributes)


def _fill_contours(mesh, touched):
    """Tubes along the contours and an octahedron at each contact, in the Darboux frame.

    Point attributes tell them apart: `contour` counts the contours, `contact` the contacts along
    one, and is -1 on the tubes; `contact_normal` is there where all contours have normals.
    """
    frame, thickness = touched.result.frame, 0.009 * touched.result.radius
    points, triangles, contour_index, contact_index = [], [], [], []
    count = 0
    for number, contour in enumerate(touched.contours):
        path = frame.to_local(contour.points)
        across = frame.axes.T @ contour.plane_normal if contour.plane_normal is not None else _across(path)
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
    if all(contour.normals is not None for contour in touched.contours):
        each = [
            np.vstack([np.zeros((4 * len(c.points), 3)), np.repeat(c.normals @ frame.axes, 6, axis=0)])
            for c in touched.contours
        ]
        attributes.append(("contact_normal", "FLOAT_VECTOR", np.vstack(each)))
    fill(mesh, np.vstack(points), np.vstack(triangles), attributes)


def _tube(path, across, thickness):
    """A square tube along a path (n, 3) in the plane normal to `across`: points (4n, 3) and triangles."""
    ahead = np.gradient(path, axis=0)
    up = np.cross(across, ahead)
    up /= np.maximum(np.linalg.norm(up, axis=1, keepdims=True), 1e-30)
    corners = [path + thickness * (a * up + b * across) for a, b in ((1, 1), (1, -1), (-1, -1), (-1, 1))]
    ring = np.arange(4)
    a = (4 * np.arange(len(path) - 1)[:, None] + ring).ravel()
    b = (4 * np.arange(len(path) - 1)[:, None] + (ring + 1) % 4).ravel()
    triangles = np.vstack([np.column_stack([a, b, b + 4]), np.column_stack([a, b + 4, a + 4])])
    return np.stack(corners, axis=1).reshape(-1, 3), triangles


def _across(path):
    """A direction in the tangent plane across a path (n, 3) that is in no plane."""
    x, y, _ = path[-1] - path[0]
    return np.array([-y, x, 0.0]) / max(np.hypot(x, y), 1e-30)


def _octahedra(centres, radius):
    """An octahedron at each of centres (n, 3): points (6n, 3) and triangles (8n, 3)."""
    tips = radius * np.vstack([np.eye(3), -np.eye(3)])
    faces = np.array([(0, 1, 2), (1, 3, 2), (3, 4, 2), (4, 0, 2), (1, 0, 5), (3, 1, 5), (4, 3, 5), (0, 4, 5)])
    offsets = 6 * np.arange(len(centres))
    return (centres[:, None] + tips).reshape(-1, 3), (offsets[:, None, None] + faces).reshape(-1, 3)


def fill(mesh, points, triangles, attributes):
    """Gives `mesh` points (n, 3), triangles (m, 3) and point attributes (name, Blender's type, values).

    Where it has these triangles already, only coordinates and values are written.
    """
    if not _has_triangles(mesh, len(points), triangles):
        mesh.clear_geometry()
        mesh.vertices.add(len(points))
        mesh.loops.add(triangles.size)
        mesh.loops.foreach_set("vertex_index", triangles.astype(np.int32).ravel())
        mesh.polygons.add(len(triangles))
        mesh.polygons.foreach_set("loop_start", np.arange(0, triangles.size, 3, dtype=np.int32))
        mesh.update(calc_edges=True)
    for name, kind, values in [("position", "FLOAT_VECTOR", points), *attributes]:
        write(mesh, name, kind, values)
    mesh.update()


def write(mesh, name, kind, values):
    """Writes a point attribute; one of that name that is of another kind makes room."""
    # No reference to an attribute may outlive the next `new`, which moves them all.
    attribute = mesh.attributes.get(name)
    if attribute is not None and (attribute.data_type, attribute.domain) != (kind, "POINT"):
        mesh.attributes.remove(attribute)
        attribute = None
    attribute = attribute or mesh.attributes.new(name, kind, "POINT")
    attribute.data.foreach_set(KEYS[kind], values.ravel())


def _has_triangles(mesh, count, triangles):
    if (len(mesh.vertices), len(mesh.loops)) != (count, triangles.size):
        return False
    corners = np.empty(triangles.size, dtype=np.int32)
    mesh.loops.foreach_get("vertex_index", corners)
    return np.array_equal(corners, triangles.ravel())


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
