# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The reconstruction as objects of the scene: the patch, and the tracked contours."""

import json

import bpy
import numpy as np
from mathutils import Matrix

from ... import core
from . import colors
from .contour_mesh import fill_contours
from .family import add, children_of
from .mesh_data import emission, fill, own_mesh, values, write

COLLECTION = "Tactile Patches"
RECORD = "tactile"  # the patch object's custom property that holds the report,
RECONSTRUCTION = "tactile_reconstruction"  # and the one with core.to_dict as JSON, once a gesture has ended
VERDICT = "tactile_verdict"  # and the one with its status and message while these say that it is outdated
COLOR = "curvature_color"
MAP_RECORD = "tactile_map"  # The custom property of a painted copy that holds the report of a stability map.
CONTOURS = "tactile_contours"  # the custom property that tells them from other children of a patch
CONTOUR_COLOR = (0.02, 0.02, 0.02, 1.0)
# What the colors can show: attribute, name, description, and the power of length it is measured in.
QUANTITIES = [
    ("gaussian_curvature", "Gaussian Curvature", "K: red on domes and bowls, blue on saddles", -2),
    ("mean_curvature", "Mean Curvature", "H: blue where the surface bulges outward, red where inward", -1),
    (
        "shape_index",
        "Shape Index",
        "1 on caps, 0.5 on ridges, 0 on saddles, -0.5 in ruts, -1 in cups",
        0,
    ),
    ("curvedness", "Curvedness", "How strongly it bends, whatever the shape", -1),
    ("deviation", "Deviation", "How far the patch is outside the mesh (red) or inside (blue)", 1),
    ("height_std", "Standard Deviation", "How well the contacts determine the height", 1),
]
POWERS = {name: power for name, _, _, power in QUANTITIES}
# These need no mesh.
QUANTITIES_OF_A_FIT = ("gaussian_curvature", "mean_curvature", "shape_index", "curvedness", "height_std")
NORMAL, PLACE = "custom_normal", "domain_place"  # attributes: as shaded; on the unit disk, see core.Domain
POSITIVE = ("curvedness", "height_std")  # never below zero: half a scale says it all
FLOOR = 1e-3  # Least range of the colors, in unit radius, so that a plane is white.


def insert(scene, touched, parent=None, lines=None):
    """Adds the patch and its contours to `scene`, in a collection of their own; returns the patch object.

    lines : contours that have lost their patch, to be those of this one
    """
    name = touched.report["source"]
    patch = _new(scene, f"{name} Patch", emission("Tactile Curvature", attribute=COLOR))
    lines = lines or _new(scene, f"{name} Contours", emission("Tactile Contour", color=CONTOUR_COLOR))
    patch.parent, lines.parent, lines[CONTOURS] = parent, patch, True
    for obj in (patch, lines):
        add(obj)
    rewrite(patch, touched)
    return patch


def _new(scene, name, material):
    obj = bpy.data.objects.new(name, bpy.data.meshes.new(name))
    obj.show_in_front = True  # it lies in the surface it describes
    collection(scene).objects.link(obj)
    obj.data.materials.append(material)
    return obj


def remove_objects(objects):
    """Deletes objects, with what nobody else uses of them."""
    meshes = [obj.data for obj in objects if obj.data is not None]
    for obj in objects:
        bpy.data.objects.remove(obj)
    remove_meshes(meshes)


def remove_meshes(meshes):
    """Deletes those that nobody uses, and their materials where nobody uses these."""
    meshes = [mesh for mesh in meshes if not mesh.users]
    materials = {material for mesh in meshes for material in mesh.materials if material is not None}
    bpy.data.batch_remove(meshes)
    bpy.data.batch_remove([material for material in materials if not material.users])


def rewrite(patch, touched):
    """Makes the patch, and its contours where they are still there, those of another touch, in place."""
    lines = contours_of(patch)
    for obj in filter(None, (patch, lines)):
        own_mesh(obj)
    if touched.report["is_verified"] or PLACE not in patch.data.attributes:
        _fill_patch(patch, touched)
    else:
        _follow(patch, touched)
    names = {"patch": patch.name}
    if lines is not None:
        fill_contours(lines.data, touched)
        _place_contours(lines)
        names["contours"] = lines.name
    place(patch, Matrix(matrix_of(touched.result.frame.axes, touched.result.frame.origin).tolist()))
    patch[RECORD] = touched.report | names
    patch.pop(RECONSTRUCTION, None)
    patch.pop(VERDICT, None)
    if touched.report["is_verified"]:
        patch[RECONSTRUCTION] = json.dumps(core.to_dict(touched.result), allow_nan=False)
    recolor(patch)


def report_of(patch):
    """The report of a patch object; None where somebody has made something else of it."""
    report = patch.get(RECORD)
    try:
        frame = np.array([report["frame"][name] for name in ("origin", "d1", "d2", "normal")], dtype=float)
        numbers = [float(report[name]) for name in ("radius", "height_std", "k1", "k2")]
        words = [report[name] for name in ("source", "status", "message", "ended")]
        report["is_verified"]
    except (KeyError, TypeError, ValueError, AttributeError):
        return None
    good = frame.shape == (4, 3) and np.isfinite(frame).all() and np.isfinite(numbers).all()
    return report if good and numbers[0] > 0.0 and all(isinstance(word, str) for word in words) else None


def require_whole(patch):
    """Raises ValueError where the patch object has been edited into what is none."""
    if report_of(patch) is None or not (patch.type == "MESH" and _is_whole(patch.data)):
        raise ValueError(f'"{patch.name}" was edited, and is no whole patch any more: touch again')


def _is_whole(mesh):
    kinds = {name: "FLOAT" for name in POWERS} | {COLOR: "FLOAT_COLOR"}
    found = {name: mesh.attributes.get(name) for name in kinds}
    return len(mesh.vertices) > 0 and all(
        attribute is not None and (attribute.data_type, attribute.domain) == (kinds[name], "POINT")
        for name, attribute in found.items()
    )


def mark_failed(patch, why):
    """The patch is that of an earlier touch, for the last one failed."""
    _outdate(patch, {"message": f"This is the patch of an earlier touch, for the last one failed. {why}"})


def mark_stale(patch):
    """The patch is that of an earlier touch, and nothing has been felt since."""
    _outdate(
        patch,
        {
            "message": "This is the patch of an earlier touch, for the probe or its target has changed "
            "since: touch again."
        },
    )


def _outdate(patch, verdict):
    report = report_of(patch)
    if report is None:
        return
    if VERDICT not in patch:
        patch[VERDICT] = {key: report[key] for key in ("status", "message")}
    report.update({"status": "outdated", **verdict})


def mark_current(patch):
    """The patch is again what its probe asks for."""
    verdict = patch.pop(VERDICT, None)
    if verdict is not None and report_of(patch) is not None:
        patch[RECORD].update(verdict)


def reconstruction_of(patch):
    """The core.Reconstruction of a patch object, in the world, where the object is now.

    Unmoved it is what was fitted, to the last bit. Raises ValueError while a gesture goes on, where what the
    object keeps was edited, and where it is no longer of its shape.
    """
    require_whole(patch)
    if RECONSTRUCTION not in patch:
        raise ValueError(f'"{patch.name}" is not complete: end the gesture, or touch again')
    try:
        r = core.from_dict(json.loads(patch[RECONSTRUCTION]))
    except (TypeError, ValueError, RecursionError) as error:
        raise ValueError(f'"{patch.name}" cannot be read any more: touch again ({error})') from error
    if is_at(patch, r.frame.axes, r.frame.origin):  # where it is, that is in double precision
        return r
    placed = np.array(patch.matrix_world, dtype=float)
    try:
        return r.moved(placed @ np.linalg.inv(matrix_of(r.frame.axes, r.frame.origin)))
    except ValueError as error:
        raise ValueError(
            f'"{patch.name}" is stretched, mirrored or scaled to nothing: give it one scale above 0'
        ) from error


def place(obj, matrix):
    """Puts an object there in the world, so that it stays there where its parent is deleted."""
    if obj.parent is not None:
        obj.matrix_parent_inverse = obj.parent.matrix_world.inverted_safe()
    obj.matrix_world = matrix  # known before the next evaluation
    obj.matrix_basis = matrix


def hold(patch):
    """Keeps the patch where it was touched, while its probe moves on without it or by whom it is moved.

    One that constraints or an animation would take back stays as it is.
    """
    if report_of(patch) is None or patch.constraints or patch.animation_data:
        return
    axes, origin = touched_frame(patch)
    if not is_at(patch, axes, origin):
        place(patch, Matrix(matrix_of(axes, origin).tolist()))
    _place_contours(contours_of(patch))


def _place_contours(lines):
    """Puts contours where their patch is, in whose coordinates they are."""
    if lines is None or lines.constraints or lines.animation_data:
        return
    if lines.matrix_basis != Matrix() or lines.matrix_parent_inverse != Matrix():
        lines.matrix_parent_inverse = lines.matrix_basis = Matrix()


def touched_frame(patch):
    """Where it was touched: axes as columns, and origin."""
    frame = patch[RECORD]["frame"]
    return np.transpose([frame[name] for name in ("d1", "d2", "normal")]), np.array(frame["origin"])


def move_record(patch, axes, origin):
    """Has the record say that the patch was touched at another place, where it is no longer at that one."""
    report, (before, at) = patch[RECORD], touched_frame(patch)
    if np.array_equal(axes, before) and np.array_equal(origin, at):
        return
    turn = axes @ before.T
    if np.shape(report.get("axes")) == (3, 3):
        report["axes"] = (turn @ np.array(report["axes"])).tolist()
    plane = report.get("suggested_plane")
    if plane is not None and np.shape(plane.get("tangent")) == (3,):
        plane["tangent"] = (turn @ np.array(plane["tangent"])).tolist()
    d1, d2, normal = axes.T.tolist()
    report["frame"].update({"origin": origin.tolist(), "d1": d1, "d2": d2, "normal": normal})


def is_at(patch, axes, origin):
    near = {"rtol": 1e-6, "atol": 1e-6 * patch[RECORD]["radius"]}
    return np.allclose(patch.matrix_world, matrix_of(axes, origin), **near)


def meshes(patch):
    """Meshes of a patch object and of its contours; none for no patch."""
    objects = [] if patch is None else [patch, contours_of(patch)]
    return [obj.data for obj in objects if obj is not None]


def contours_of(patch):
    """The contours of a patch object, or None."""
    return next((child for child in children_of(patch) if CONTOURS in child), None)


def recolor(patch):
    """Colors the patch by what it is set to show, and keeps their range in its record."""
    own_mesh(patch)
    shown, mesh = patch.tactile_colors, patch.data
    shades, record = values(mesh, shown), patch[RECORD]
    limit = colors.symmetric_range(shades, floor=FLOOR * record["radius"] ** POWERS[shown])
    mesh.attributes[COLOR].data.foreach_set("color", colors.diverging(shades, limit).ravel())
    mesh.color_attributes.active_color_name = mesh.color_attributes.default_color_name = COLOR
    mesh.update()
    record["color_limit"] = limit


def matrix_of(axes, origin):
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = axes, origin
    return matrix


def collection(scene):
    # In a second scene of the file it is "Tactile Patches.001".
    # To a library's, or its override, nothing can be added.
    named = (
        c
        for c in scene.collection.children_recursive
        if c.name.partition(".")[0] == COLLECTION and c.is_editable and c.override_library is None
    )
    found = next(named, None)
    if found is None:
        found = bpy.data.collections.new(COLLECTION)
        scene.collection.children.link(found)
    return found


def _fill_patch(obj, touched):
    """The patch in the Darboux frame, with its attributes; deviations are 0 until the touch is verified."""
    result, frame, mesh = touched.result, touched.result.frame, obj.data
    points, triangles = result.mesh()
    d = result.geometry.derivatives(*points[:, :2].T)
    deviation = np.zeros(len(points))
    if touched.report["is_verified"] and touched.surface is not None:
        world = frame.to_world(points), d.normal @ frame.axes.T
        deviation = touched.surface.deviations(*world, result.radius)
    places = np.column_stack([result.domain.places(points[:, :2]), np.zeros(len(points))])
    attributes = [
        *((name, "FLOAT", _shown(name, result, points)) for name in QUANTITIES_OF_A_FIT),
        ("deviation", "FLOAT", deviation),
        (NORMAL, "FLOAT_VECTOR", d.normal),
        (PLACE, "FLOAT_VECTOR", places),
        (COLOR, "FLOAT_COLOR", np.ones((len(points), 4))),
    ]
    fill(mesh, points, triangles, attributes)


def _follow(obj, touched):
    """Moves the vertices that are there, each at its place in the domain, to the patch of another touch.

    What is shown is up to date, what is not is left as it was: in a gesture that is all that is seen.
    """
    result, mesh = touched.result, obj.data
    plane = result.domain.points_at(values(mesh, PLACE)[:, :2])
    d = result.geometry.derivatives(*plane.T)
    points = np.column_stack([plane, d.z])
    write(mesh, "position", "FLOAT_VECTOR", points)
    write(mesh, NORMAL, "FLOAT_VECTOR", d.normal)
    if obj.tactile_colors in QUANTITIES_OF_A_FIT:
        write(mesh, obj.tactile_colors, "FLOAT", _shown(obj.tactile_colors, result, points))


def _shown(name, result, points):
    """What the colors can show at points (n, 3) of a surface, (n,); curvatures are those of (1)."""
    return getattr(result if name == "height_std" else result.patch, name)(*points[:, :2].T)
