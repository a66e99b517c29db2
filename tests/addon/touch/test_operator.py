# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The operator of the installed extension in a real Blender, without a window.

What only a window shows (menus, the mouse, undo by keys) is in tests/gui.
"""

import json
import math
import os
import re
import subprocess
import sys
import tracemalloc

import numpy as np
import pytest

pytest.importorskip("bpy", reason="needs Blender as a Python module: run make test")
import bmesh
from mathutils import Euler, Matrix, Vector
from scenes import datablocks, made, positions, values

from tools import blender

RADIUS = 2.0
TOP = (0.3, -0.2, 1.9)
TOUCH = {"location": TOP, "extent": 0.6, "step": 0.06}


def reconstruct(bpy, **arguments):
    """Runs the operator and returns the new patch and its report."""
    return made(bpy.ops.tactile.reconstruct, **arguments)


def test_enabling_the_extension_imports_no_scipy():
    """A process of its own looks, because the tests import scipy themselves."""
    code = (
        "import sys, bpy, addon_utils; addon_utils.enable('bl_ext.user_default.tactile_patch');"
        "assert hasattr(bpy.types, 'TACTILE_OT_reconstruct'), 'not enabled';"
        "sys.exit(any(m.startswith('scipy') for m in sys.modules))"
    )
    result = subprocess.run([sys.executable, "-c", code], env=os.environ, capture_output=True, text=True)
    assert result.returncode == 0, result.stderr


def test_the_zip_brought_scipy_for_this_python(extension):
    version = "python{}.{}".format(*sys.version_info)
    site = blender.RESOURCES / "extensions/.local/lib" / version / "site-packages"
    assert (site / "scipy" / "__init__.py").is_file()
    assert not (site / "numpy").exists()


def test_the_patch_of_a_ball(empty, ball):
    source = positions(ball.data)
    _, report = reconstruct(empty, **TOUCH)
    assert report["status"] == "ok"
    assert [report["k1"], report["k2"]] == pytest.approx([-1 / RADIUS] * 2, rel=0.02)
    assert report["gaussian_curvature"] == pytest.approx(1 / RADIUS**2, rel=0.04)
    assert report["contacts"] == 60
    assert report["stops"] == [["extent", "extent"]] * 3
    assert report["vertices"] > 200
    assert report["vertex_distance_mean"] < 0.005
    point = np.array(report["frame"]["origin"])
    assert point / np.linalg.norm(point) == pytest.approx(np.array(TOP) / np.linalg.norm(TOP), abs=0.01)
    assert report["frame"]["normal"] == pytest.approx(point / RADIUS, abs=0.02)
    assert report["source"] == "Sphere"
    # The ball itself has not changed.
    assert np.array_equal(positions(ball.data), source)
    assert not ball.data.attributes.get("gaussian_curvature")
    assert not ball.data.materials


def test_the_patch_object_holds_what_it_says(extension, empty, ball):
    patch, report = reconstruct(empty, **TOUCH)
    mesh = patch.data
    assert (patch.name, mesh.name) == ("Sphere Patch", "Sphere Patch")
    assert [c.name for c in patch.users_collection] == ["Tactile Patches"]
    assert empty.context.view_layer.objects.active == patch
    assert [obj.name for obj in empty.context.selected_objects] == ["Sphere Patch"]
    frame = report["frame"]
    axes = np.column_stack([frame["d1"], frame["d2"], frame["normal"]])
    assert np.array(patch.matrix_world)[:3, :3] == pytest.approx(axes, abs=1e-6)
    assert list(patch.matrix_world.translation) == pytest.approx(frame["origin"], abs=1e-6)
    x, y, z = positions(mesh).T
    terms = [(i, d - i) for d in (3, 4) for i in range(d, -1, -1)]
    expected = 0.5 * (report["k1"] * x**2 + report["k2"] * y**2)
    expected += sum(c * x**i * y**j for c, (i, j) in zip(report["coefficients"], terms, strict=True))
    r = extension.core.from_dict(json.loads(patch["tactile_reconstruction"]))
    assert z == pytest.approx(r.height(x, y), abs=1e-6)
    assert r.patch.height(x, y) == pytest.approx(expected, rel=1e-12)
    assert values(mesh, "gaussian_curvature")[0] == pytest.approx(report["gaussian_curvature"], rel=1e-5)
    assert values(mesh, "mean_curvature")[0] == pytest.approx(report["mean_curvature"], rel=1e-5)
    # The deviation is how far the patch is outside the ball, except for the ball's facets.
    world = np.column_stack([x, y, z]) @ axes.T + frame["origin"]
    assert values(mesh, "deviation") == pytest.approx(np.linalg.norm(world, axis=1) - RADIUS, abs=1e-3)
    assert np.abs(values(mesh, "deviation")).max() > 1e-4
    std = values(mesh, "height_std")
    assert std[0] == pytest.approx(0.0, abs=1e-9)
    faces = np.array([face.vertices for face in mesh.polygons])
    mean_std = np.average(std[faces].mean(axis=1), weights=[face.area for face in mesh.polygons])
    assert report["height_std"] == pytest.approx(mean_std, rel=0.2)
    # The mesh is the one that the reconstruction makes.
    points, triangles = r.mesh()
    assert np.column_stack([x, y, z]) == pytest.approx(points, abs=1e-6)
    assert len(faces) == len(triangles)
    assert np.abs(values(mesh, "deviation")).mean() < 2.0 * std.mean()
    assert mesh.materials[0].name == "Tactile Curvature"
    areas = [face.area for face in mesh.polygons]
    assert sum(areas) == pytest.approx(report["area"], rel=0.1)
    assert all(face.normal.z > 0.0 for face in mesh.polygons)


def test_normals_are_the_analytic_ones(empty, ball):
    patch, _ = reconstruct(empty, **TOUCH)
    mesh = patch.data
    given = values(mesh, "custom_normal", "vector", 3)
    shown = np.array([tuple(n.vector) for n in mesh.corner_normals])
    corner_vertices = np.array([loop.vertex_index for loop in mesh.loops])
    assert shown == pytest.approx(given[corner_vertices], abs=1e-5)
    from_faces = np.array([tuple(n.vector) for n in mesh.vertex_normals])
    assert np.sum(given * from_faces, axis=1).min() > 0.999


def test_the_active_color_is_a_symmetric_map_of_gaussian_curvature(empty):
    empty.ops.mesh.primitive_torus_add(
        major_segments=192, minor_segments=96, major_radius=2.0, minor_radius=0.8
    )
    patch, report = reconstruct(empty, location=(2.0, 0.0, 0.8), extent=0.5, degree=4)
    patch.tactile_colors = "gaussian_curvature"
    report, mesh = patch["tactile"], patch.data
    assert mesh.color_attributes.active_color_name == mesh.color_attributes.default_color_name
    gaussian = values(mesh, "gaussian_curvature")
    colors = values(mesh, mesh.color_attributes.active_color_name, "color", 4)
    # On top of a torus K changes its sign: red where positive, blue where negative, pale green between.
    limit = report["color_limit"]
    assert gaussian.min() < -0.05 * limit < 0.05 * limit < gaussian.max()
    red_over_blue = colors[:, 0] - colors[:, 2]
    assert np.all(red_over_blue[gaussian > 0.04 * limit] > 0.0)
    assert np.all(red_over_blue[gaussian < -0.04 * limit] < 0.0)
    between = colors[np.abs(gaussian) < 0.01 * limit, :3]
    assert np.all(between > 0.7)
    assert np.all(between[:, 1] > 1.2 * between[:, [0, 2]].max(axis=1))
    assert np.all(colors[:, 3] == 1.0)


def test_a_patch_keeps_its_curves(empty, ball):
    patch, _ = reconstruct(empty, **TOUCH, noise=0.01, seed=3)
    curves = {
        name: [np.reshape(path, (-1, 3)) for path in paths] for name, paths in patch["tactile_curves"].items()
    }
    assert [len(path) for path in curves["contours"]] == [21] * 3
    center = curves["contours"][0][10]  # The reference point is the eleventh contact.
    assert center[:2] == pytest.approx(0.0, abs=1e-6)
    assert abs(center[2]) < 0.01  # the noise
    world = [patch.matrix_world @ Vector(point) for point in np.vstack(curves["contours"])]
    off = np.linalg.norm(world, axis=1) - RADIUS
    assert 0.005 < off.std() < 0.02
    (rim,) = curves["rim"]
    assert np.array_equal(rim[0], rim[-1])
    angles = np.sort(np.arctan2(rim[:, 1], rim[:, 0]))
    assert np.diff(angles).max() < math.radians(10.0)


def test_a_patch_keeps_its_principal_directions(empty):
    empty.ops.mesh.primitive_cylinder_add(vertices=256)
    patch, report = reconstruct(empty, location=(1.0, 0.0, 0.0), extent=0.5)
    frame = report["frame"]
    for path, key in zip(patch["tactile_curves"]["directions"], ("d1", "d2"), strict=True):
        points = np.reshape(path, (-1, 3))
        along = np.array(patch.matrix_world.to_3x3()) @ (points[-1] - points[0])
        along -= along @ frame["normal"] * np.array(frame["normal"])
        assert along / np.linalg.norm(along) == pytest.approx(frame[key], abs=1e-5)


def test_where_curvatures_are_equal_there_are_no_principal_directions(empty, ball):
    patch, report = reconstruct(empty, **TOUCH)
    assert "there are no principal directions" in report["message"]
    assert "directions" not in patch["tactile_curves"]


def test_vertices_under_another_layer_are_no_part_of_the_verification(empty, ball):
    """Balls within the ball, all facing outward: only the outer one can be felt."""
    _, single = reconstruct(empty, **TOUCH)
    shells = bmesh.new()
    for radius in (RADIUS, 0.9 * RADIUS, 0.8 * RADIUS):
        shells.from_mesh(ball.data)
        bmesh.ops.scale(shells, vec=[radius / RADIUS] * 3, verts=shells.verts[-len(ball.data.vertices) :])
    shells.to_mesh(ball.data)
    _, nested = reconstruct(empty, target="Sphere", **TOUCH)
    assert nested["vertices"] == single["vertices"]
    assert nested["vertex_distance_max"] == pytest.approx(single["vertex_distance_max"])


def test_a_mesh_without_vertices_over_the_patch_says_so(empty, extension):
    empty.ops.mesh.primitive_plane_add(size=10.0)
    _, report = reconstruct(empty, location=(0.0, 0.0, 0.0))
    assert report["vertices"] == 0
    assert "vertex_distance_mean" not in report
    rows = dict(extension.tactile_addon.touch.wording.readable_rows(report))
    assert rows["mesh to patch"] == "no vertex of the mesh lies over the patch"


def test_the_same_seed_gives_the_same_patch_and_another_does_not(empty, ball):
    made = [reconstruct(empty, target="Sphere", **TOUCH, noise=0.01, seed=seed) for seed in (1, 1, 2)]
    one, again, other = (json.loads(patch["tactile_reconstruction"])["contours"] for patch, _ in made)
    assert one == again != other
    assert made[0][1]["k1"] == made[1][1]["k1"]


def test_several_patches_share_collection_and_materials(empty, ball):
    for _ in range(3):
        reconstruct(empty, target="Sphere", **TOUCH)
    assert [c.name for c in empty.data.collections] == ["Tactile Patches"]
    assert sorted(m.name for m in empty.data.materials) == ["Tactile Curvature"]
    assert sum("tactile" in obj for obj in empty.data.objects) == 3


def test_every_scene_has_one_collection_of_patches(empty, ball):
    reconstruct(empty, **TOUCH)
    other = empty.data.scenes.new("Other")
    other.collection.objects.link(ball)
    with empty.context.temp_override(scene=other, view_layer=other.view_layers[0]):
        for _ in range(2):
            reconstruct(empty, target="Sphere", **TOUCH)
    assert [len(c.objects) for c in empty.data.collections] == [1, 2]


def test_an_active_patch_stands_for_its_source(empty, ball):
    reconstruct(empty, **TOUCH)
    _, report = reconstruct(empty, **TOUCH)
    assert report["source"] == "Sphere"


def test_without_a_location_the_cursor_is_projected(empty, ball):
    empty.context.scene.cursor.location = (0.0, 0.0, 2.3)
    _, report = reconstruct(empty, extent=0.6)
    assert report["frame"]["origin"] == pytest.approx([0.0, 0.0, 2.0], abs=1e-3)


def test_extent_and_step_suit_the_object_where_they_are_not_given(empty, ball):
    _, report = reconstruct(empty, location=TOP)
    assert 1.0 <= report["extent"] <= 2.0  # half of the size of the ball at most
    assert 8.5 < report["extent"] / report["step"] < 16.5
    assert report["vertex_distance_max"] < 0.02 * report["radius"]
    assert report["message"].endswith(("trusted any more.", "extent allowed."))


def test_the_chosen_extent_does_not_depend_on_how_the_object_is_turned(empty, ball):
    """The planes turn with the object here; otherwise the axes of the world would lay them out."""
    ball.scale = (1.0, 2.0, 0.5)
    extents, along = [], None
    for angle in (0.0, 0.7):
        ball.rotation_euler = (angle, 0.3 * angle, angle)
        empty.context.view_layer.update()
        turn = np.array(ball.rotation_euler.to_matrix())
        touch = {"target": "Sphere", "location": ball.matrix_world @ Vector(TOP)}
        axes = np.array(reconstruct(empty, **touch)[1]["axes"])
        along = axes[:, 0] if along is None else turn @ along
        first = math.atan2(-along @ axes[:, 2], along @ axes[:, 0])
        azimuths = [first + i * math.pi / 3.0 for i in range(3)] + [0.0] * 3
        _, report = reconstruct(empty, **touch, azimuths=azimuths)
        extents.append(report["extent"])
    assert extents[0] == pytest.approx(extents[1], rel=1e-3)


def test_all_inputs_reach_the_core(empty, ball):
    _, report = reconstruct(
        empty,
        **TOUCH,
        outward=(0.1, 0.0, 1.0),
        plane_count=4,
        azimuths=[math.radians(a) for a in (5, 50, 95, 140, 0, 0)],
        tilts=[math.radians(a) for a in (5, -5, 10, 0, 0, 0)],
        method="quadratic-variation",
        degree=5,
        weight=500.0,
    )
    assert np.array(report["planes"]) == pytest.approx(
        np.array([[5, 5], [50, -5], [95, 10], [140, 0]]), abs=1e-4
    )
    assert (report["method"], report["degree"], len(report["coefficients"])) == ("quadratic-variation", 5, 15)
    tagc = {"target": "Sphere", "method": "tagc", **TOUCH}
    descent, fast = (reconstruct(empty, **tagc, solver=solver)[1] for solver in ("descent", "fast"))
    assert descent["coefficients"] != fast["coefficients"]
    assert descent["fit_error"] == pytest.approx(fast["fit_error"], rel=0.2)


def test_the_default_is_the_accurate_fit(empty, ball):
    report, tagc = (reconstruct(empty, target="Sphere", **TOUCH, **m)[1] for m in ({}, {"method": "tagc"}))
    assert (report["method"], report["degree"]) == ("bayes", 4)
    assert report["vertex_distance_mean"] < 0.5 * tagc["vertex_distance_mean"]
    assert report["blind"] == 3
    assert "These planes cannot show 3 of the 14 ways to bend" in report["message"]


def test_degree_0_is_what_the_contacts_show(empty):
    empty.ops.mesh.primitive_plane_add(size=4.0)
    _, report = reconstruct(empty, location=(0.0, 0.0, 0.0), extent=1.0, noise=0.01, degree=0)
    assert (report["degree"], report["coefficients"]) == (2, [])
    with pytest.raises(RuntimeError, match="Degree: expected a whole number from 2 to 6"):
        empty.ops.tactile.reconstruct(location=(0.0, 0.0, 0.0), extent=1.0, degree=1)


def test_the_suggested_plane_can_be_added(empty):
    """A monkey saddle is zero along the three planes: the fourth shows it."""
    mesh = bmesh.new()
    bmesh.ops.create_grid(mesh, x_segments=160, y_segments=160, size=20.0)
    for vertex in mesh.verts:
        vertex.co.z = (3.0 * vertex.co.x**2 * vertex.co.y - vertex.co.y**3) / 900.0
    saddle = empty.data.meshes.new("Saddle")
    mesh.to_mesh(saddle)
    mesh.free()
    empty.context.scene.collection.objects.link(empty.data.objects.new("Saddle", saddle))
    place = {"target": "Saddle", "location": (0.0, 0.0, 0.0), "extent": 13.0, "outward": (0.0, 0.0, 1.0)}
    _, before = reconstruct(empty, **place)
    suggested = before["suggested_plane"]
    assert np.linalg.norm(suggested["tangent"]) == pytest.approx(1.0)
    azimuths = [math.radians(a) for a in (0, 60, 120, suggested["azimuth"], 0, 0)]
    _, after = reconstruct(empty, **place, plane_count=4, azimuths=azimuths)
    assert before["vertex_distance_mean"] > 0.1
    assert after["vertex_distance_mean"] < 0.02


SQUASH = Matrix.LocRotScale((5.0, -3.0, 1.0), Euler((0.3, 0.9, -0.5)), (1.5, 0.75, 0.5))


@pytest.mark.parametrize(
    "matrix",
    [SQUASH, SQUASH @ Matrix.Scale(-1.0, 4, (1.0, 0.0, 0.0)), Matrix.Scale(1e-3, 4), Matrix.Scale(1e5, 4)],
    ids=["non-uniform", "mirrored", "small", "large"],
)
def test_any_transform_is_touched_as_it_looks(empty, ball, matrix):
    """The patch is compared with that of a mesh that has the transform applied to its vertices."""
    applied = ball.copy()
    applied.data = ball.data.copy()
    applied.data.transform(matrix)
    if matrix.determinant() < 0.0:
        applied.data.flip_normals()
    applied.name = "Applied"
    empty.context.scene.collection.objects.link(applied)
    parent = empty.data.objects.new("Parent", None)
    empty.context.scene.collection.objects.link(parent)
    ball.parent, parent.matrix_world = parent, matrix
    size = abs(matrix.determinant()) ** (1 / 3)
    place = {"location": matrix @ Vector(TOP), "extent": 0.3 * size, "step": 0.03 * size}
    one, other = (reconstruct(empty, target=name, **place)[1] for name in ("Sphere", "Applied"))
    for key in ("k1", "k2"):
        assert one[key] * size == pytest.approx(other[key] * size, abs=0.02)
    assert one["frame"]["origin"] == pytest.approx(other["frame"]["origin"], abs=1e-3 * size)
    assert one["frame"]["normal"] == pytest.approx(other["frame"]["normal"], abs=1e-2)
    assert one["k2"] < 0.0
    assert one["fit_error"] < 0.01 * size
    assert one["vertices"] == pytest.approx(other["vertices"], abs=3)


def test_modifiers_and_shape_keys_are_felt(empty, ball):
    ball.shape_key_add(name="Basis")
    grown = ball.shape_key_add(name="Grown")
    for point in grown.data:
        point.co *= 1.5
    grown.value = 1.0
    ball.modifiers.new("Cast", "CAST").factor = 0.0
    _, report = reconstruct(empty, location=(0.3, -0.2, 2.9), extent=0.6)
    assert report["k1"] == pytest.approx(-1 / 3.0, rel=0.05)
    ball.modifiers["Cast"].factor, ball.modifiers["Cast"].radius = 1.0, 0.0
    displace = ball.modifiers.new("Displace", "DISPLACE")
    displace.strength, displace.mid_level = 1.0, 0.0
    _, report = reconstruct(empty, target="Sphere", location=(0.4, -0.3, 3.9), extent=1.2)
    assert report["k2"] == pytest.approx(-1 / 4.0, rel=0.05)


def test_an_eye_hidden_object_is_touched_as_it_evaluates(empty, ball):
    ball.hide_set(True)
    ball.modifiers.new("Displace", "DISPLACE").mid_level = 0.5
    ball.modifiers["Displace"].strength = 1.0
    _, report = reconstruct(empty, target="Sphere", location=(0.0, 0.0, 2.4), extent=0.6)
    assert report["frame"]["origin"][2] == pytest.approx(2.5, abs=1e-3)
    assert ball.hide_get()


@pytest.mark.long
@pytest.mark.parametrize("modifier", [None, "SUBSURF"])
def test_edit_mode_is_felt_with_its_unsaved_edits_and_stays(empty, ball, modifier):
    if modifier:
        ball.modifiers.new("Modifier", modifier).levels = 1
    empty.ops.object.mode_set(mode="EDIT")
    edit = bmesh.from_edit_mesh(ball.data)
    for vertex in edit.verts:
        vertex.co *= 1.5
    bmesh.update_edit_mesh(ball.data)
    patch, report = reconstruct(empty, location=(0.3, -0.2, 2.9), extent=0.6)
    assert report["k1"] == pytest.approx(-1 / 3.0, rel=0.05)
    assert report["vertex_distance_mean"] < 0.01
    assert ball.mode == "EDIT"
    assert empty.context.view_layer.objects.active == ball
    assert patch.name in empty.context.scene.objects
    empty.ops.object.mode_set(mode="OBJECT")


def test_a_linked_object_and_an_instances_original(empty, ball, tmp_path):
    library = str(tmp_path / "library.blend")
    empty.ops.wm.save_as_mainfile(filepath=library)
    empty.ops.wm.read_homefile(use_empty=True)
    with empty.data.libraries.load(library, link=True) as (_, into):
        into.objects = ["Sphere"]
    linked = empty.data.objects["Sphere"]
    empty.context.scene.collection.objects.link(linked)
    _, report = reconstruct(empty, target="Sphere", **TOUCH)
    assert report["k1"] == pytest.approx(-0.5, rel=0.05)
    empty.context.scene.collection.objects.unlink(linked)
    group = empty.data.collections.new("Group")
    group.objects.link(linked)
    instance = empty.data.objects.new("Instance", None)
    instance.instance_type, instance.instance_collection = "COLLECTION", group
    empty.context.scene.collection.objects.link(instance)
    _, report = reconstruct(empty, target="Sphere", **TOUCH)
    assert report["k1"] == pytest.approx(-0.5, rel=0.05)


@pytest.mark.parametrize("unit_scale", [0.001, 1000.0])
def test_the_unit_scale_changes_nothing(empty, ball, unit_scale):
    empty.context.scene.unit_settings.scale_length = unit_scale
    _, report = reconstruct(empty, **TOUCH)
    assert report["k1"] == pytest.approx(-0.5, rel=0.05)


def test_far_from_the_origin_the_mesh_is_felt_as_long_as_float32_carries_it(empty, ball):
    ball.location.x = 1000.0
    _, report = reconstruct(empty, location=(1000.3, -0.2, 1.9), extent=0.6)
    assert report["k1"] == pytest.approx(-0.5, rel=0.05)


def cube(bpy):
    bpy.ops.mesh.primitive_cube_add(size=2.0)


def bad_vertex(bpy):
    bpy.context.object.data.vertices[5].co.x = float("nan")


def zero_scale(bpy):
    bpy.context.object.scale.y = 0.0


def flattened(bpy):
    """Single precision does not hold the inverse of this transform: a probe would never be at rest."""
    bpy.context.object.scale = (1.0, 1.0, 1e-7)


def huge(bpy):
    bpy.context.object.scale = (3e38, 3e38, 3e38)


def one_vertex_far_away(bpy):
    bpy.context.object.data.vertices[5].co.x = 1e30


def disabled(bpy):
    bpy.context.object.hide_viewport = True


def excluded(bpy):
    hidden = bpy.data.collections.new("Hidden")
    bpy.context.scene.collection.children.link(hidden)
    obj = bpy.context.object
    hidden.objects.link(obj)
    for collection in obj.users_collection:
        if collection != hidden:
            collection.objects.unlink(obj)
    bpy.context.view_layer.layer_collection.children["Hidden"].exclude = True


def in_another_scene(bpy):
    obj = bpy.context.object
    bpy.data.scenes.new("Studio").collection.objects.link(obj)
    bpy.context.scene.collection.objects.unlink(obj)


def far_away(bpy):
    bpy.context.object.location.x = 2e6


def far_in_its_mesh(bpy):
    bpy.context.object.data.transform(Matrix.Translation((2e6, 0, 0)))
    bpy.context.object.location.x = -2e6


def no_faces(bpy):
    bpy.context.object.data.clear_geometry()


def camera(bpy):
    bpy.ops.object.camera_add()
    bpy.context.object.name = "Camera"


def nothing(bpy):
    pass


@pytest.mark.parametrize(
    ("spoil", "change", "sentence"),
    [
        (nothing, {"target": "Nobody"}, 'There is no object "Nobody"'),
        (camera, {"target": "Camera"}, '"Camera" is not a mesh'),
        (no_faces, {}, '"Sphere" has no faces to touch'),
        (bad_vertex, {}, "vertices whose coordinates are not finite, 1 of 8066: delete them"),
        (zero_scale, {}, "a scale of 0 in some direction"),
        (flattened, {}, "or 1e+06 times less than in another"),
        (huge, {}, "reaches farther than 1e+15 from the origin"),
        (one_vertex_far_away, {}, "reaches farther than 1e+15 from the origin"),
        (disabled, {}, "disabled in viewports or excluded from the view layer"),
        (excluded, {}, "disabled in viewports or excluded from the view layer"),
        (
            in_another_scene,
            {},
            '"Sphere" is in the scene "Studio": go there, or choose an object of this scene',
        ),
        (far_away, {"location": (2e6, 0.0, 2.0)}, "apart in single precision, too coarse"),
        (far_in_its_mesh, {}, "apart in single precision, too coarse"),
        (nothing, {"location": (0.0, 0.0, 9.0)}, "The location is 7 m away"),
        (nothing, {"location": (float("nan"), 0.0, 0.0)}, "coordinates that are not finite"),
        (nothing, {"location": (float("inf"), 0.0, 0.0)}, "too far away to be measured"),
        (nothing, {"outward": (0.0, 0.0, 0.0)}, "Outward: expected a vector with a direction"),
        (nothing, {"outward": (float("nan"), 0.0, 0.0)}, "Outward: expected finite numbers"),
        (nothing, {"extent": 50.0}, 'The extent 50 m is longer than "Sphere"'),
        (nothing, {"step": 1e-5}, "Step: expected at least a 10000th of the extent 0.6"),
        (nothing, {"step": 0.9}, "The step 0.9 m is longer than the extent 0.6 m"),
        (nothing, {"extent": -1.0}, "lengths of 0 or more"),
        (nothing, {"step": -0.1}, "lengths of 0 or more"),
        (nothing, {"noise": -0.1}, "lengths of 0 or more"),
        (nothing, {"extent": float("nan")}, "lengths of 0 or more, got nan m"),
        (nothing, {"noise": 1e30}, "The noise 1e+27 km is larger than the extent 0.6 m"),
        (nothing, {"weight": -1.0}, "Weight: expected a finite number above 0"),
        (nothing, {"step": 0.6}, "Curve 1 has 2 of the 3 contacts"),
        (nothing, {"azimuths": [0.0] * 6}, "run in the same direction"),
        (nothing, {"azimuths": [0.0, 1.0, 1.001, 0, 0, 0]}, "Curves 2 and 3 run in the same direction"),
        (nothing, {"tilts": [1.6, 0, 0, 0, 0, 0]}, "Tilt: expected less than 90 degrees"),
    ],
)
def test_bad_input_gets_a_sentence_and_leaves_nothing(empty, ball, spoil, change, sentence):
    spoil(empty)
    before = datablocks(empty)
    with pytest.raises(RuntimeError) as caught:
        empty.ops.tactile.reconstruct(**({"target": "Sphere"} | TOUCH | change))
    message = str(caught.value)
    assert message.startswith("Error: ")
    assert sentence in message
    assert "Traceback" not in message
    assert datablocks(empty) == before


def test_a_name_of_two_lines_is_reported_in_one(empty, ball):
    ball.name = "two\nlines"
    with pytest.raises(RuntimeError, match='away from "two lines", farther than'):
        empty.ops.tactile.reconstruct(target=ball.name, location=(0.0, 0.0, 9.0), extent=0.6)


def test_with_nothing_active_the_operator_asks_for_a_mesh(empty):
    with pytest.raises(RuntimeError, match="Error: No object is active: select the mesh object to touch"):
        empty.ops.tactile.reconstruct()


def test_all_curves_ending_at_once_leave_nothing(empty):
    """At the tip of a needle no curve gets anywhere."""
    empty.ops.mesh.primitive_cone_add(radius1=0.2, depth=4.0)
    before = datablocks(empty)
    with pytest.raises(
        RuntimeError, match=r"of the 3 contacts it needs besides the reference point \(it ends at"
    ):
        empty.ops.tactile.reconstruct(location=(0.0, 0.0, 2.0), extent=0.5, outward=(0.0, 0.0, 1.0))
    assert datablocks(empty) == before


def test_a_plane_that_misses(empty):
    """Curves across a thin strip end at its border at once."""
    empty.ops.mesh.primitive_plane_add(size=2.0)
    empty.context.object.scale.y = 0.01
    with pytest.raises(RuntimeError, match="it ends at an edge"):
        empty.ops.tactile.reconstruct(location=(0.0, 0.0, 0.0), extent=0.5)


def test_a_doubtful_patch_finishes_with_a_warning(empty, capfd):
    empty.ops.mesh.primitive_monkey_add(size=2.0)
    empty.context.object.modifiers.new("Subdivision", "SUBSURF").levels = 3
    _, report = reconstruct(empty, location=(0.42, -0.62, 0.78), extent=0.3)
    assert report["status"] == "uncertain"
    assert "use a shorter extent" in report["message"]
    assert "Warning: Doubtful: use a shorter extent or add sampling planes" in capfd.readouterr().out


def test_a_bump_between_the_curves_is_a_doubt(empty):
    empty.ops.mesh.primitive_grid_add(x_subdivisions=80, y_subdivisions=80, size=2.0)
    mesh = empty.context.object.data
    at = positions(mesh)
    touch = {"location": (0.0, 0.0, 0.0), "extent": 0.8}
    assert reconstruct(empty, **touch)[1]["status"] == "ok"
    azimuth = math.radians(30.0)
    away = np.hypot(at[:, 0] - 0.5 * math.cos(azimuth), at[:, 1] - 0.5 * math.sin(azimuth))
    at[:, 2] = 0.3 * np.clip(1.0 - away / 0.2, 0.0, 1.0)
    mesh.attributes["position"].data.foreach_set("vector", at.ravel())
    mesh.update()
    _, report = reconstruct(empty, target="Grid", **touch)
    assert report["status"] == "uncertain"
    off = re.match(r"Between the curves the surface is up to (\S+) % of the radius off", report["message"])
    assert 100.0 * report["vertex_distance_mean"] / report["radius"] < float(off[1]) < 100.0 * 0.3 / 0.8
    assert report["height_error"] == pytest.approx(report["vertex_distance_mean"], rel=0.2)


def test_half_a_contour_has_all_contacts_that_the_extent_has_room_for(empty):
    """1 / 0.1 is 9.99999985 in the float32 of operator properties."""
    empty.ops.mesh.primitive_plane_add(size=10.0)
    _, report = reconstruct(empty, location=(0.3, 0.2, 0.0), extent=1.0, step=0.1)
    assert report["contacts"] == 60


def test_undo_takes_the_patch_away_and_redo_brings_it_back(empty, ball):
    empty.ops.ed.undo_push(message="ball")
    empty.ops.tactile.reconstruct("EXEC_DEFAULT", True, **TOUCH)
    empty.ops.ed.undo_push(message="patch")
    empty.ops.ed.undo()
    while "Sphere Patch" in empty.data.objects:
        empty.ops.ed.undo()
    assert "Sphere" in empty.data.objects
    empty.ops.ed.redo()
    assert "Sphere Patch" in empty.data.objects


def test_reports_survive_saving_and_loading(empty, ball, tmp_path):
    _, report = reconstruct(empty, **TOUCH)
    path = str(tmp_path / "saved.blend")
    empty.ops.wm.save_as_mainfile(filepath=path)
    empty.ops.wm.open_mainfile(filepath=path)
    assert empty.data.objects["Sphere Patch"]["tactile"].to_dict() == report


def test_disabling_and_enabling_leaves_nothing_behind(extension):
    import addon_utils
    import bpy

    addon_utils.disable(extension.__name__)
    assert not hasattr(bpy.types, "TACTILE_OT_reconstruct")
    addon_utils.enable(extension.__name__)
    assert hasattr(bpy.types, "TACTILE_OT_reconstruct")


def test_the_menus_offer_what_core_offers(extension):
    settings = extension.tactile_addon.touch.settings
    assert tuple(name for name, _, _ in settings.METHODS) == extension.core.METHODS
    assert tuple(name for name, _, _ in settings.SOLVERS) == extension.core.SOLVERS


def test_vertices_near_a_point_take_little_more_memory_than_themselves(empty, extension):
    """Sums over all vertices, and their normals, took gigabytes where there are ten million."""
    empty.ops.mesh.primitive_grid_add(x_subdivisions=700, y_subdivisions=700, size=2.0)
    obj, depsgraph = empty.context.object, empty.context.evaluated_depsgraph_get()
    surface = extension.tactile_addon.touch.surface.MeshSurface(obj, depsgraph)
    tracemalloc.start()
    try:
        near = surface.vertices_near((0.2, 0.1, 0.0), 0.1003)
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    vertices = np.array([v.co for v in obj.data.vertices])
    gaps = np.linalg.norm(vertices - (0.2, 0.1, 0.0), axis=1)
    assert len(near) == np.count_nonzero(gaps <= 0.1003) > 1000
    assert peak < 8 * len(vertices)
