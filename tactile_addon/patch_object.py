# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The reconstruction as objects of the scene: the patch, and the tracked contours."""

import json

import bpy
import numpy as np
from mathutils import Matrix

from .. import core
from . import colours
from .contour_mesh import fill_contours
from .mesh_data import emission, fill, own_mesh, values

COLLECTION = "Tactile Patches"
RECORD = "tactile"  # the patch object's custom property that holds the report,
RECONSTRUCTION = "tactile_reconstruction"  # and the one with core.to_dict as JSON, once a gesture has ended
COLOUR = "curvature_colour"
CONTOURS = "tactile_contours"  # the custom property that tells them from other children of a patch
CONTOUR_COLOUR = (0.02, 0.02, 0.02, 1.0)
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
        fill_contours(lines.data, touched)
        names["contours"] = lines.name
    _place(patch, _matrix(touched.result.frame.axes, touched.result.frame.origin))
    patch[RECORD] = touched.report | names
    patch.pop(RECONSTRUCTION, None)
    if touched.is_complete:
        patch[RECONSTRUCTION] = json.dumps(core.to_dict(touched.result), allow_nan=False)
    recolour(patch)


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
    curve, contact, points = (values(lines.data, name) for name in ("contour", "contact", "position"))
    normals = values(lines.data, "contact_normal") if "contact_normal" in lines.data.attributes else None
    contours = []
    for number in range(int(curve.max()) + 1):
        # An octahedron each, whose six tips are one after the other.
        tips = np.flatnonzero((curve == number) & (contact >= 0))
        centres = points[tips].reshape(-1, 6, 3).mean(axis=1)
        up = None if normals is None else normals[tips[::6]] @ axes.T
        contours.append(core.Contour(frame["origin"] + centres @ axes.T, normals=up))
    return contours


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
    points, triangles = result.mesh()
    x, y, _ = points.T
    normals = patch.normal(x, y)
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
