# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Touch All Over by the installed extension in a real Blender, without a window.

Progress, Esc and what happens to the scene meanwhile are in tests/gui/whole_object.py.
"""

import math
import os
import subprocess
import sys

import numpy as np
import pytest

pytest.importorskip("bpy", reason="needs Blender as a Python module: run make test")
from mathutils import Matrix
from scenes import datablocks, made, positions, values


def touched(bpy, **arguments):
    """Runs the operator and returns the surface and its record."""
    return made(bpy.ops.tactile.touch_all_over, "tactile_object", **arguments)


@pytest.mark.long
def test_a_ball_is_closed_and_where_the_ball_is(empty, ball):
    ball.matrix_world = Matrix.Translation((5.0, 6.0, 7.0)) @ Matrix.Rotation(0.5, 4, "X")
    empty.context.view_layer.update()
    surface, record = touched(empty, tolerance=0.01)
    assert record["is_closed"]
    assert record["uncovered"] == 0
    assert record["source"] == ball.name
    place = np.array(surface.matrix_world)
    points = positions(surface.data) @ place[:3, :3].T + place[:3, 3] - (5.0, 6.0, 7.0)
    assert np.abs(np.linalg.norm(points, axis=1) - 2.0).max() < 0.02
    for name, true in (("gaussian_curvature", 0.25), ("mean_curvature", -0.5)):
        curvatures = values(surface.data, name)
        assert np.median(curvatures) == pytest.approx(true, abs=0.005)
        assert np.abs(curvatures - true).max() < 0.05
        stds = values(surface.data, f"{name}_std")
        # Eight patches cover the ball, and the errors of curvature are alike all over each.
        assert np.mean(np.abs(curvatures - true) <= 1.645 * stds) > 0.7
        assert np.median(stds) < 0.02
    assert record["unknown_curvatures"] == 0
    assert np.abs(values(surface.data, "deviation")).max() <= record["deviation_max"] * (1.0 + 1e-6)
    assert record["deviation_mean"] < record["deviation_max"] < 0.01
    assert math.dist(record["deviation_place"], (5.0, 6.0, 7.0)) == pytest.approx(2.0, abs=0.01)
    assert set(values(surface.data, "patch")) <= set(range(record["patches"]))


@pytest.mark.long
def test_colors_show_what_is_chosen(empty, ball):
    surface, record = touched(empty, tolerance=0.01)
    for shown in ("height_std", "deviation", "gaussian_curvature"):
        surface.tactile_colors = shown
        limit = surface["tactile_object"]["color_limit"]
        if shown == "gaussian_curvature":
            bend = np.median(values(surface.data, "curvedness")) ** 2
            assert 0.99 * bend < limit < 6.0 * bend
        else:
            assert limit == pytest.approx(record["tolerance"])


@pytest.mark.long
def test_near_the_edges_of_a_cube_curvatures_are_unknown_and_colors_those_of_the_wall(empty, extension):
    empty.ops.mesh.primitive_cube_add(size=2.0)
    surface, record = touched(empty)
    mesh = surface.data
    from_edge = np.sort(1.0 - np.abs(positions(mesh)), axis=1)[:, 1]
    unknown = np.isinf(values(mesh, "mean_curvature_std"))
    assert unknown[from_edge < 0.05].all()
    assert not unknown[from_edge > 0.15].any()
    assert (np.isinf(values(mesh, "gaussian_curvature_std")) == unknown).all()
    assert np.abs(values(mesh, "mean_curvature")).max() < 0.01
    assert record["unknown_curvatures"] == unknown.sum() > 0
    rows = dict(extension.tactile_addon.whole_object.object_report.object_rows(record))
    assert rows["Without Curvature"] == str(unknown.sum())
    for shown in ("mean_curvature", "curvedness", "height_std"):
        surface.tactile_colors = shown
        colors = mesh.attributes["curvature_color"]
        assert colors.domain == "CORNER"
        shades = np.empty((len(mesh.loops), 4))
        colors.data.foreach_get("color_srgb", shades.ravel())
        assert not np.isclose(shades, (0.5, 0.5, 0.5, 1.0), atol=1e-6).all(axis=1).any()
        assert not record["is_gray"]
    surface.tactile_colors = "curvedness"
    values_at = np.where(unknown, 1e3, values(mesh, "curvedness"))
    mesh.attributes["curvedness"].data.foreach_set("value", values_at)
    extension.tactile_addon.scene.shown.recolor(surface)
    assert surface["tactile_object"]["color_limit"] < 1.0  # What is unknown does not count.


@pytest.mark.parametrize(
    ("inputs", "message"),
    [
        ({"tolerance": -1.0}, "The tolerance is a length of 0 or more, got"),
        (
            {"tolerance": 0.01, "noise": 0.02},
            "The tolerance 1 cm is below the noise",
        ),
        ({"edge": float("nan")}, "The edge length is a length of 0 or more, got"),
        ({"tolerance": 1.0}, 'The tolerance 1 m is larger than 0.4 m, 0.1 of "Sphere": use a smaller one'),
        ({"noise": 1.0}, "The noise 1 m is larger than"),
        ({"edge": 5.0}, "The edge length 5 m is larger than 2 m"),
        (
            {"edge": 1e-3},
            'The edge length 1 mm is smaller than 5.71 mm, for which the surface of "Sphere" takes 2 GB',
        ),
        (
            {"tolerance": 1e-9},
            r"The tolerance .* is finer than the coordinates of .* apart in single precision",
        ),
        ({"location": (50.0, 0.0, 0.0)}, r'The location is 48 m away from "Sphere", farther than 0\.5 m'),
        ({"location": (float("nan"), 0.0, 0.0)}, "The location has coordinates that are not finite"),
    ],
)
def test_what_cannot_be_is_refused_and_nothing_is_left(empty, ball, inputs, message):
    before = datablocks(empty)
    with pytest.raises(RuntimeError, match=message):
        empty.ops.tactile.touch_all_over(**inputs)
    assert datablocks(empty) == before


@pytest.mark.long
def test_a_budget_ends_it_with_what_there_is(empty, ball, extension):
    surface, record = touched(empty, tolerance=0.01, most=3)
    assert record["touches"] == 3
    assert not record["is_closed"]
    assert record["uncovered"] > 0
    rows = dict(extension.tactile_addon.whole_object.object_report.object_rows(record))
    share = f"{np.floor(1e3 * record['felt']) / 10:g} %"
    assert (rows["Surface"], rows["Felt"]) == ("Incomplete", share)
    # Its far side does not show through where nothing was felt.
    assert not surface.show_in_front
    assert surface["tactile_above"] > 0.0
    # What was not felt is where the mesh is farthest from the surface.
    assert record["deviation_max"] > 1.0
    assert np.linalg.norm(record["deviation_place"]) == pytest.approx(2.0, abs=0.01)
    assert np.abs(values(surface.data, "deviation")).max() < 0.1
    report = extension.tactile_addon.whole_object.object_report
    assert report.object_verdict(record).startswith("Incomplete: continue with more touches")
    assert report.object_reasons(record)[0].startswith(f"Touching ended when {share} of the object was")
    assert "continue with more touches" in record["message"]
    assert report.object_summary(record) == f"Incomplete: 3 touches; {share} of the object"
    assert "Deviation" not in rows  # Most of it would be what was not felt.


def faces_of(bpy, vertices, faces):
    """Makes an object of these vertices and faces, active, and returns it."""
    mesh = bpy.data.meshes.new("Faces")
    mesh.from_pydata(vertices, [], faces)
    obj = bpy.data.objects.new("Faces", mesh)
    bpy.context.collection.objects.link(obj)
    bpy.context.view_layer.objects.active = obj
    bpy.context.view_layer.update()
    return obj


def test_nothing_begins_where_no_face_has_an_area(empty):
    faces_of(empty, [(0, 0, 0), (1, 0, 0), (2, 0, 0)], [(0, 1, 2)])
    before = datablocks(empty)
    message = r"Touching could not begin: choose another location or tolerance \(no face has an area\)"
    with pytest.raises(RuntimeError, match=message):
        empty.ops.tactile.touch_all_over(tolerance=1e-3)
    assert datablocks(empty) == before


@pytest.mark.long
@pytest.mark.parametrize(("shape", "least"), [("cube", 4), ("plane", 1)])
def test_faces_without_vertices_inside_are_begun_in_their_middle(empty, shape, least):
    """One touch feels a whole plane, or a side of the cube."""
    getattr(empty.ops.mesh, f"primitive_{shape}_add")(size=2.0)
    assert touched(empty, most=5)[1]["patches"] >= least


@pytest.fixture
def begun(empty, extension):
    """A function that begins to touch the active object at a place; returns the point of the first touch."""

    def begun(place):
        touches = extension.tactile_addon.whole_object.object_touches.ObjectTouches(
            empty.context.object,
            empty.context.evaluated_depsgraph_get(),
            location=place,
            accuracy="normal",
            tolerance=0.002,
            noise=0.0,
            seed=0,
            most=10,
            edge=0.0,
        )
        next(touches.steps())
        return touches.explored[0].result.point + touches.surface.origin

    return begun


def add_boxes(bpy, *boxes):
    """Adds an object of boxes, each with its middle and its widths."""
    for middle, widths in boxes:
        bpy.ops.mesh.primitive_cube_add(size=1.0, location=middle)
        bpy.context.object.scale = widths
    for obj in bpy.data.objects:
        obj.select_set(True)
    bpy.ops.object.join()
    bpy.context.view_layer.update()


def test_touches_begin_where_there_is_room(empty, begun):
    """Neither in a slit nor on a thin ridge, but where it is asked for if that is elsewhere."""
    ridge = (0.3, 0.0, 0.55), (0.01, 1.0, 0.1)
    add_boxes(empty, ((0.0, 0.0, 0.0), (1.0, 1.0, 1.0)), ((0.0, 0.0, -1.01), (1.0, 1.0, 1.0)), ridge)
    for place in ((0.1, 0.1, -0.5), (0.305, 0.1, 0.57)):
        point = begun(place)
        assert np.linalg.norm(point - place) > 0.1
        assert abs(point[2] + 0.505) > 0.02
    assert np.linalg.norm(begun((0.5, 0.2, 0.1)) - (0.5, 0.2, 0.1)) < 1e-3


def test_a_plate_that_is_hardly_thicker_than_the_tolerance_is_felt_from_its_narrow_side(empty):
    empty.ops.mesh.primitive_cube_add(size=1.0)
    empty.context.object.scale = 1.0, 0.7, 0.04
    empty.context.view_layer.update()
    _, record = touched(empty, location=(0.5, 0.0, 0.0), tolerance=0.03)
    assert (record["status"], record["within"]) == ("ok", 1.0)
    assert record["deviation_max"] < 0.03


@pytest.mark.long
def test_what_is_loose_is_no_part_of_the_object(empty, ball):
    ball.data.vertices.add(1)
    ball.data.vertices[-1].co = (1e3, 0.0, 0.0)
    ball.data.update()
    assert touched(empty, most=2)[1]["size"] == pytest.approx(4.0)


@pytest.mark.long
@pytest.mark.parametrize("scale", [(-1.0, 1.0, 1.0), (1.0, 2.0, 3.0), (1e-5, 1e-5, 1e-5), (1e5, 1e5, 1e5)])
def test_a_scaled_object_is_touched_as_it_is(empty, ball, scale):
    ball.scale = scale
    ball.rotation_euler = (0.4, 0.5, 0.6)
    empty.context.view_layer.update()
    surface, record = touched(empty, tolerance=5e-3 * max(np.abs(scale)))
    assert record["is_closed"]
    inverse = np.linalg.inv(np.array(ball.matrix_world))[:3, :3]
    assert np.linalg.norm(positions(surface.data) @ inverse.T, axis=1) == pytest.approx(2.0, abs=0.03)
    corners = positions(surface.data)[np.array([p.vertices for p in surface.data.polygons])]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert (np.einsum("ni,ni->n", normals, corners.mean(axis=1)) > 0.0).all()


@pytest.mark.long
def test_another_process_touches_the_same(files):
    """All bits are the same, in any order of sets. The ball is a file, as the faces of new spheres vary."""
    code = (
        "import sys, bpy, addon_utils; addon_utils.enable('bl_ext.user_default.tactile_patch');"
        "from bl_ext.user_default.tactile_patch.tactile_addon import command_line;"
        "sys.exit(command_line.main(sys.argv[1:]))"
    )
    found = []
    for order in "12":
        surface = files / f"surface{order}.ply"
        words = ["object", files / "ball.ply", "--tolerance", "0.02", "--noise", "0.002", "--most", "12"]
        command = [sys.executable, "-c", code, *map(str, words), "--output", str(surface)]
        environment = os.environ | {"PYTHONHASHSEED": order}
        result = subprocess.run(command, env=environment, capture_output=True, text=True)
        assert result.returncode == 0, result.stderr
        found.append(surface.read_bytes())
    assert found[0] == found[1]


@pytest.mark.long
def test_modifiers_and_the_active_of_several_count(empty, ball):
    empty.ops.mesh.primitive_uv_sphere_add(segments=64, ring_count=32, radius=1.0, location=(9, 0, 0))
    other = empty.context.object
    other.modifiers.new("Displace", "DISPLACE").strength = 0.5
    ball.select_set(True)
    surface, record = touched(empty, tolerance=0.01)
    assert record["source"] == other.name
    assert tuple(surface.location) == (9.0, 0.0, 0.0)
    assert np.linalg.norm(positions(surface.data), axis=1) == pytest.approx(1.25, abs=0.03)


@pytest.mark.long
def test_a_probe_or_a_place_says_where_to_begin(empty, ball):
    surface, _ = touched(empty, location=(0.0, 0.0, 2.0), tolerance=0.01, most=1)
    assert np.abs(positions(surface.data)[:, 2]).min() > 0.5
    empty.ops.tactile.pick(target=ball.name, location=(0.0, 2.0, 0.0))
    surface, _ = touched(empty, tolerance=0.01, most=1)
    assert np.abs(positions(surface.data)[:, 1]).min() > 0.5


@pytest.mark.long
def test_an_edited_surface_has_no_report(empty, ball, tmp_path):
    surface, _ = touched(empty, tolerance=0.02)
    surface.data.attributes.remove(surface.data.attributes["deviation"])
    page = tmp_path / "page.html"
    with pytest.raises(RuntimeError, match="was edited and is no longer a complete surface: touch all over"):
        empty.ops.tactile.export_report(filepath=str(page))
    assert not page.exists()
