# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Stability maps by the installed extension in a real Blender, without a window.

Progress, Esc and what happens to the scene meanwhile are in tests/gui/stability.py.
"""

import math

import numpy as np
import pytest
from scipy.spatial import cKDTree

pytest.importorskip("bpy", reason="needs Blender as a Python module: run make test")
import bmesh
from mathutils import Matrix, Vector
from scenes import datablocks, made, positions, values

import core

PATCH, _, CREASE, EDGE, _, NOTHING = range(6)
QUANTITIES = ("error", "height_std", "reach", "condition_number", "blind_share")


def stability_map(bpy, **arguments):
    """Runs the operator and returns the painted copy and its record."""
    return made(bpy.ops.tactile.stability_map, "tactile_map", **arguments)


AZIMUTHS = tuple(math.radians(azimuth) for azimuth in (0.0, 60.0, 120.0))
LENGTHS = {"spacing": 0.0, "extent": 0.0, "step": 0.0, "noise": 0.0, "seed": 0}
FIT = {"method": "bayes", "degree": "auto", "weight": None, "solver": "fast"}


@pytest.fixture
def touched(empty, extension):
    """A function that makes the touches of a map of an object, and returns them once they are done."""

    def touch(obj, planes=AZIMUTHS, **given):
        depsgraph = empty.context.evaluated_depsgraph_get()
        planes = [extension.core.SamplingPlane(azimuth) for azimuth in planes]
        found = extension.tactile_addon.stability_map.stability.StabilityMap(
            obj, depsgraph, planes, **LENGTHS | FIT | given
        )
        found.yields = sum(1 for _ in found.steps())
        return found

    return touch


def grid(bpy, count, size=2.0):
    """A square sheet of count x count faces."""
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=count, y_subdivisions=count, size=size)
    return bpy.context.object


def edited(bpy, **cuts):
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.subdivide(**cuts)
    bpy.ops.object.mode_set(mode="OBJECT")


@pytest.mark.long
def test_a_ball_is_alike_all_over(empty):
    # Some touches would take facets twice as large for texture, and others would not.
    empty.ops.mesh.primitive_uv_sphere_add(segments=256, ring_count=128, radius=2.0)
    painted, record = stability_map(empty, spacing=0.4, extent=0.5, degree=4)
    assert record["points"] == record["touched"] == record["patches"]
    assert record["in_doubt"] == 0
    assert not any(record["refused"].values())
    mesh = painted.data
    assert not values(mesh, "reason").any()
    error, std = values(mesh, "error"), values(mesh, "height_std")
    assert error.min() > 0.0
    assert error.max() < 0.001  # facets are 0.00015 inside the ball
    assert std.max() < 2.0 * std.min()
    assert values(mesh, "blind_share") == pytest.approx(3 / 14)
    assert values(mesh, "condition_number").min() > 1.0
    assert record["error_median"] == pytest.approx(np.median(error), rel=0.2)


def test_a_map_shows_at_first_what_differs(empty, ball):
    painted, record = stability_map(empty, spacing=1.0, extent=0.5, degree=4)
    assert record["points"] == record["patches"] - record["in_doubt"]  # One color would show nothing.
    assert painted.tactile_map_colors == "error"
    grid(empty, 40)
    painted, record = stability_map(empty, spacing=0.1, extent=0.25, step=0.05)
    assert record["points"] > record["patches"] - record["in_doubt"] > 0
    assert painted.tactile_map_colors == "reason"


def test_what_a_map_says_is_what_a_touch_says(empty, touched):
    """The other operator touches some of the places with the same inputs."""
    empty.ops.mesh.primitive_uv_sphere_add(segments=48, ring_count=24, radius=2.0)
    ball, inputs = empty.context.object, {"extent": 0.8, "step": 0.08, "degree": 5}
    found = touched(ball, spacing=1.0, **inputs)
    for number in (3, 7):
        empty.ops.tactile.reconstruct(target=ball.name, location=found.places[number], **inputs)
        report = empty.context.object["tactile"].to_dict()
        assert found.measures["height_std"][number] == pytest.approx(report["height_std"], rel=1e-4)
        factors = found.measures["condition_number"][number], report["condition_number"]
        assert math.log(factors[0]) == pytest.approx(math.log(factors[1]), rel=1e-4)
        assert found.measures["blind_share"][number] == pytest.approx(report["blind"] / 20)


def add_head(bpy):
    bpy.ops.mesh.primitive_monkey_add()
    bpy.context.object.modifiers.new("Subdivision", "SUBSURF").levels = 2


@pytest.mark.long
@pytest.mark.parametrize(
    ("add", "least"),
    [
        (lambda bpy: bpy.ops.mesh.primitive_cube_add(), 1.0),
        (lambda bpy: bpy.ops.mesh.primitive_plane_add(), 1.0),
        (lambda bpy: bpy.ops.mesh.primitive_cylinder_add(), 1.0),
        (lambda bpy: bpy.ops.mesh.primitive_cone_add(), 0.9),
        (lambda bpy: bpy.ops.mesh.primitive_uv_sphere_add(), 0.8),
        (add_head, 0.5),
    ],
    ids=["cube", "plane", "cylinder", "cone", "ball", "head"],
)
def test_what_a_map_calls_a_patch_a_probe_on_it_finds(empty, touched, add, least):
    """A map has patches where most clicks have, though there are creases at each vertex of these."""
    add(empty)
    target = empty.context.object
    found = touched(target, spacing=0.25)
    is_patch = found.reason == PATCH
    assert np.mean(is_patch) >= least
    for place in np.array(found.places)[is_patch][:20]:
        empty.ops.tactile.pick(target=target.name, location=place, new=True)
        (patch,) = empty.context.object.children
        assert patch["tactile"]["status"] == "ok", patch["tactile"]["message"]


@pytest.fixture
def ridge(empty):
    """The active object: a sheet, 2 wide, with a ridge along y."""
    obj = grid(empty, 100)
    co = positions(obj.data)
    co[:, 2] = 0.05 * (co[:, 0] ** 2 + co[:, 1] ** 2) + 0.12 * np.exp(-((co[:, 0] / 0.15) ** 2))
    obj.data.vertices.foreach_set("co", co.astype(np.float32).ravel())
    obj.data.update()
    return obj


def test_touches_that_choose_their_extent_are_those_of_the_other_operator(empty, ridge, touched):
    found = touched(ridge, planes=(0.0, 1.0, 2.0), spacing=0.5)
    assert found.yields > 5 * len(found.places)  # a window can redraw in between
    within = np.abs(np.array(found.places)[:, :2]).max(axis=1) < 0.9
    numbers = np.flatnonzero((found.reason < CREASE) & within)
    assert len(numbers) > 5
    for number in numbers[:4]:
        azimuths = (0.0, 1.0, 2.0, 0.0, 0.0, 0.0)
        empty.ops.tactile.reconstruct(target=ridge.name, location=found.places[number], azimuths=azimuths)
        report = empty.context.object["tactile"].to_dict()
        assert found.measures["reach"][number] == pytest.approx(report["extent"], rel=1e-3)
        assert found.measures["height_std"][number] == pytest.approx(report["height_std"], rel=0.02)


@pytest.mark.long
def test_an_automatic_extent_fits_the_place(empty, ridge):
    """The extent is long off a ridge and short on it, so fewer patches are in doubt."""
    painted, record = stability_map(empty, target=ridge.name, spacing=0.2)
    fixed, given = stability_map(empty, target=ridge.name, spacing=0.2, extent=0.5)
    assert (record["extent"], record["step"]) == (0.0, 0.0)
    assert record["in_doubt"] < 0.5 * given["in_doubt"]
    x, y = np.abs(positions(painted.data)[:, :2]).T
    reach, inside = values(painted.data, "reach"), y < 0.5
    assert np.median(reach[inside & (x < 0.1)]) < 0.5 * np.median(reach[inside & (x > 0.5) & (x < 0.7)])
    assert record["reach_median"] == pytest.approx(np.median(reach[reach > 0.0]), rel=0.2)
    assert values(fixed.data, "reach").max() == pytest.approx(0.5)


def test_a_map_with_an_automatic_extent_says_so(empty, ridge, extension):
    painted, record = stability_map(empty, target=ridge.name, spacing=0.5)
    stability_map_room = extension.tactile_addon.stability_map
    rows = dict(stability_map_room.map_object.map_table_rows(record))
    assert rows["spacing, extent, step"] == "0.5 m, auto, auto"
    assert stability_map_room.map_object.inputs_of(painted)["extent"] == 0.0  # a probe on the map gets this


@pytest.mark.long
def test_a_cube_has_patches_on_its_faces_and_none_at_its_edges(empty, touched):
    empty.ops.mesh.primitive_cube_add(size=2.0)
    edited(empty, number_cuts=9)
    found = touched(empty.context.object, spacing=0.15, extent=0.8, step=0.1)
    to_edge = 1.0 - np.sort(np.abs(found.places), axis=1)[:, 1]
    assert np.all(found.reason[to_edge < 0.07] == CREASE)  # their first steps cross the edge
    assert np.any(to_edge < 0.07)
    assert np.all(found.reason[to_edge > 0.13] < CREASE)
    assert np.all(found.reason[to_edge > 0.3] == PATCH)
    assert found.measures["error"][to_edge > 0.13].max() < 1e-5
    assert found.report()["refused"]["crease"] == np.count_nonzero(found.reason == CREASE)


@pytest.mark.long
@pytest.mark.parametrize(("shape", "extent"), [("cube", 0.25), ("grid", 0.25), ("grid", 0.0)])
def test_a_probe_is_in_doubt_where_the_map_has_no_patch(empty, touched, shape, extent):
    if shape == "cube":
        empty.ops.mesh.primitive_cube_add(size=2.0)
        edited(empty, number_cuts=29)
    else:
        grid(empty, 60)
    target = empty.context.object
    found = touched(target, spacing=0.2, extent=extent)
    for refused, numbers in ((True, found.reason >= CREASE), (False, found.reason == PATCH)):
        for number in np.flatnonzero(numbers)[:8]:
            empty.context.view_layer.objects.active = target
            inputs = {"location": found.places[number], "extent": extent, "step": found.step, "new": True}
            try:
                _, record = made(empty.ops.tactile.pick, "tactile", target=target.name, **inputs)
            except RuntimeError:
                assert refused
                continue
            assert (record["status"] != "ok") == refused, record["message"]
            assert refused == record["message"].startswith("The point is at a")


@pytest.mark.long
def test_what_is_refused_has_no_value_and_a_color_of_its_own(empty):
    empty.ops.mesh.primitive_cube_add(size=2.0)
    edited(empty, number_cuts=9)
    painted, _ = stability_map(empty, spacing=0.1, extent=0.8, step=0.1)
    refused = values(painted.data, "reason") == CREASE
    touch = values(painted.data, "touch").astype(int)
    is_gray = np.array(painted["tactile_values"]["reason"])[touch] == CREASE
    for name in QUANTITIES:
        painted.tactile_map_colors = name
        assert np.all(values(painted.data, name)[refused] == -1.0)
        assert values(painted.data, name)[~refused].min() >= 0.0
        shades = values(painted.data, "stability_color", "color", 4)
        assert np.ptp(shades[is_gray], axis=0).max() == 0.0
        assert shades[is_gray].max(axis=0)[:3].max() < 0.1
        assert shades[~is_gray].min(axis=0)[0] > 0.4


@pytest.mark.long
def test_a_sheet_is_refused_at_its_border_and_around_a_hole(empty, touched):
    obj = grid(empty, 40)
    mesh = bmesh.new()
    mesh.from_mesh(obj.data)
    inside = [v for v in mesh.verts if v.co.length < 0.3]
    bmesh.ops.delete(mesh, geom=inside, context="VERTS")
    mesh.to_mesh(obj.data)
    mesh.free()
    found = touched(obj, spacing=0.05, extent=0.25, step=0.05)
    co = np.array(found.places)[:, :2]
    border, to_hole = 1.0 - np.abs(co).max(axis=1), np.linalg.norm(co, axis=1) - 0.3
    for at_edge in (border < 0.03, to_hole < 0.03):
        assert np.any(at_edge)
        assert np.all(found.reason[at_edge] == EDGE)
    assert np.all(found.reason[(border > 0.11) & (to_hole > 0.15)] == PATCH)
    assert found.report()["refused"]["edge"] == np.count_nonzero(found.reason == EDGE)


@pytest.mark.long
def test_each_of_nested_walls_is_compared_with_itself(empty, ball):
    """The wall of the inner ball is nearer to that of the outer one than the extent."""
    empty.ops.mesh.primitive_uv_sphere_add(segments=64, ring_count=32, radius=1.9)
    ball.select_set(True)
    empty.ops.object.join()
    painted, record = stability_map(empty, spacing=0.3, extent=0.5)
    assert record["patches"] == record["points"]
    radii = np.linalg.norm(positions(painted.data), axis=1)
    error = values(painted.data, "error")
    for wall in (radii > 1.95, radii < 1.95):
        assert error[wall].max() < 0.004


@pytest.mark.long
def test_a_bump_between_the_curves_shows_as_error(empty):
    """What no curve has felt is an error. Where curves feel its foot, they have a doubt."""
    obj = grid(empty, 120)
    co = positions(obj.data)
    away = np.hypot(co[:, 0] - 0.26, co[:, 1] - 0.15)
    co[:, 2] = 0.1 * np.exp(-((away / 0.05) ** 2))
    obj.data.vertices.foreach_set("co", co.astype(np.float32).ravel())
    obj.data.update()
    painted, _ = stability_map(empty, spacing=0.05, extent=0.4, step=0.05)
    error, ok = values(painted.data, "error"), values(painted.data, "reason") == PATCH
    around = (away > 0.15) & (away < 0.4)
    assert error[around].max() > 5e-3 > error[ok & around].max() > 1.5e-3
    assert error[ok & (away > 0.9)].max() < 1e-6


@pytest.mark.long
def test_the_copy_has_its_attributes_and_the_target_is_untouched(empty, ball):
    ball.data.attributes.new("error", "BOOLEAN", "FACE")  # the name is taken by another type
    ball.data.materials.append(empty.data.materials.new("Own"))
    before = (ball.data.attributes.keys(), ball.data.materials.keys(), positions(ball.data).tolist())
    faces = [tuple(face.vertices) for face in ball.data.polygons]
    ball.modifiers.new("Wave", "SUBSURF").levels = 1
    ball.location, ball.rotation_euler, ball.scale = (3.0, 1.0, -2.0), (0.3, 1.0, 2.0), (1.0, 2.0, -0.5)
    painted, record = stability_map(empty, spacing=1.0)
    assert before == (
        ball.data.attributes.keys(),
        ball.data.materials.keys(),
        positions(ball.data).tolist(),
    )
    assert faces == [tuple(face.vertices) for face in ball.data.polygons]
    assert [c.name for c in painted.users_collection] == ["Tactile Patches"]
    assert (painted.name, record["painted"], record["source"]) == ("Sphere Stability",) * 2 + ("Sphere",)
    assert np.array(painted.matrix_world)[:, 3] == pytest.approx(np.array(ball.matrix_world)[:, 3], abs=1e-5)
    assert empty.context.view_layer.objects.active == painted
    mesh = painted.data
    assert len(mesh.polygons) == 2 * (
        4 * len(ball.data.polygons) - 128 * 2
    )  # quads make four, triangles three
    for name in QUANTITIES:
        assert mesh.attributes[name].data_type == "FLOAT"
        assert np.isfinite(values(mesh, name)).all()
    assert mesh.attributes["reason"].data_type == "INT"
    assert set(values(mesh, "reason")) <= set(range(6))
    assert mesh.color_attributes.active_color.name == "stability_color"
    assert [material.name for material in mesh.materials] == ["Tactile Stability"]


@pytest.mark.long
def test_lengths_are_those_of_the_world(empty, ball):
    _, small = stability_map(empty, spacing=0.5, extent=0.5)
    ball.scale, ball.location, ball.rotation_euler = (10.0, 10.0, 10.0), (1e4, 0.0, 0.0), (1.0, 2.0, 3.0)
    _, large = stability_map(empty, target="Sphere", spacing=5.0, extent=5.0)
    assert large["points"] == pytest.approx(small["points"], rel=0.05)
    for name in ("error_median", "height_std_median"):
        assert large[name] == pytest.approx(10.0 * small[name], rel=0.05)


def test_the_copy_lies_in_its_target_even_where_that_is_sheared(empty, ball):
    parent = empty.data.objects.new("Parent", None)
    empty.context.collection.objects.link(parent)
    ball.parent, ball.rotation_euler = parent, (0.5, 0.6, 0.7)
    parent.scale = (1.0, 3.0, 0.5)
    empty.context.view_layer.update()
    painted, _ = stability_map(empty, spacing=1.0)
    matrices = [np.array(obj.matrix_world) for obj in (ball, painted)]
    places = [positions(obj.data) @ m[:3, :3].T for obj, m in zip((ball, painted), matrices, strict=True)]
    assert places[1] == pytest.approx(places[0], abs=1e-5)


def test_touched_points_are_a_spacing_apart_and_leave_no_gap():
    points = np.random.default_rng(3).normal(size=(4000, 3))
    points /= np.linalg.norm(points, axis=1, keepdims=True)
    chosen = [i for i in core.spaced(points, 0.1, np.random.default_rng(0)) if i is not None]
    tree = cKDTree(points[chosen])
    assert not tree.query_pairs(0.1)
    assert tree.query(points)[0].max() < 0.15
    # The first quarter of them covers the whole sphere as well.
    part = cKDTree(points[chosen[: len(chosen) // 4]])
    assert part.query(points)[0].max() < 0.6


@pytest.mark.long
def test_the_same_seed_gives_the_same_map(empty, ball):
    one, two, other = (
        stability_map(empty, target="Sphere", spacing=0.7, noise=0.01, seed=seed)[0] for seed in (1, 1, 2)
    )
    assert np.array_equal(values(one.data, "height_std"), values(two.data, "height_std"))
    assert not np.array_equal(values(one.data, "height_std"), values(other.data, "height_std"))


@pytest.mark.parametrize("method", ["tagc", "quadratic-variation", "least-squares"])
def test_the_papers_methods_have_their_maps(empty, ball, method):
    _, record = stability_map(empty, spacing=2.0, method=method)
    assert record["method"] == method
    assert record["patches"] == record["points"] > 5


def test_one_undo_step(empty, ball):
    empty.context.preferences.edit.use_global_undo = True
    empty.ops.ed.undo_push(message="Ball")
    before = datablocks(empty)
    # A button calls it so: with "EXEC_DEFAULT" and undo.
    empty.ops.tactile.stability_map("EXEC_DEFAULT", True, spacing=1.0)
    assert "Sphere Stability" in empty.data.objects
    empty.ops.ed.undo()
    assert datablocks(empty) == before


@pytest.mark.long
def test_a_vertex_without_a_face_is_not_touched(empty, ball):
    ball.data.vertices.add(1)
    ball.data.vertices[-1].co = (0.0, 0.0, 2.5)
    painted, record = stability_map(empty, spacing=0.5)
    assert record["refused"]["nothing"] == 0
    assert values(painted.data, "reason")[-1] == PATCH  # it has the reason of the nearest touch


def test_a_map_is_red_where_patches_are_about_in_doubt(empty):
    """All patches of a cylinder have about the same deviation: it is no reason to paint all of them red."""
    empty.ops.mesh.primitive_cylinder_add()
    painted, record = stability_map(empty, spacing=0.5)
    assert record["in_doubt"] == 0
    found = {name: np.array(painted["tactile_values"][name]) for name in ("error", "height_std", "reach")}
    wall = found["height_std"] > 0.5 * found["height_std"].max()
    assert 5 < np.count_nonzero(wall) < len(wall) - 5  # The others are on its lids.
    painted.tactile_map_colors = "error"
    assert painted["tactile_map"]["color_limit"] >= 2.0 * found["height_std"][wall].min()
    painted.tactile_map_colors = "height_std"
    assert painted["tactile_map"]["color_limit"] >= 0.02 * found["reach"][wall].min()


def test_faces_of_no_area_are_nothing_to_feel(empty):
    obj = grid(empty, 4)
    co = positions(obj.data)
    co[:, 1] = 0.0
    obj.data.vertices.foreach_set("co", co.astype(np.float32).ravel())
    obj.data.update()
    painted, record = stability_map(empty, spacing=0.1, extent=0.2)
    assert record["patches"] == 0
    assert np.all(values(painted.data, "reason") == NOTHING)
    assert "error_median" not in record
    for name in (*QUANTITIES, "reason"):
        painted.tactile_map_colors = name
        assert painted["tactile_map"]["color_limit"] > 0.0


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        ({"spacing": -0.1}, "The spacing is a length"),
        ({"spacing": np.nan}, "The spacing is a length"),
        ({"spacing": 0.005}, r'The spacing 5 mm takes over 1,000,000 touches of "Sphere": use a larger one'),
        ({"extent": 50.0}, "longer than"),
        ({"extent": 0.1, "step": 0.2}, "The step 0.2 m is longer"),
        ({"extent": 0.1, "step": 0.09}, "of the 3 contacts it needs"),
        ({"noise": -1.0}, "lengths of 0 or more"),
        ({"azimuths": (0.0, 0.0, 1.0, 0.0, 0.0, 0.0)}, "run in the same direction"),
        ({"tilts": (1.6, 0.0, 0.0, 0.0, 0.0, 0.0)}, "Tilt: expected less than 90 degrees"),
        ({"degree": 1}, "Degree: expected"),
        ({"weight": -1.0}, "Weight: expected"),
        ({"target": "Nobody"}, 'There is no object "Nobody"'),
    ],
)
def test_bad_arguments_are_refused_with_a_sentence(empty, ball, arguments, sentence):
    before = datablocks(empty)
    with pytest.raises(RuntimeError, match=f"^Error: .*{sentence}"):
        empty.ops.tactile.stability_map(**arguments)
    assert datablocks(empty) == before


def make_faceless(bpy, obj):
    obj.data.clear_geometry()
    obj.data.vertices.add(3)


def make_curve(bpy, obj):
    obj.name = "Ball"
    bpy.ops.curve.primitive_bezier_circle_add()
    bpy.context.object.name = "Sphere"


def make_infinite(bpy, obj):
    obj.data.vertices[5].co.x = np.nan


def make_nowhere(bpy, obj):
    obj.location.y = np.nan


def make_flat(bpy, obj):
    obj.scale.z = 0.0


def make_thin(bpy, obj):
    obj.scale.y = 1e-20  # Single precision makes 0 of it where a matrix becomes location, rotation and scale.
    obj.rotation_euler = (0.3, 1.0, 0.0)


def make_disabled(bpy, obj):
    obj.hide_viewport = True


def make_disabled_with_a_probe(bpy, obj):
    """The probe keeps the object in Blender's evaluation, but without a mesh."""
    bpy.ops.tactile.pick(target=obj.name, location=(0.0, 0.0, 2.0))
    obj.hide_viewport = True


def make_distant(bpy, obj):
    obj.data.transform(Matrix.Translation((1e7, 0.0, 0.0)))


@pytest.mark.parametrize(
    ("spoil", "sentence"),
    [
        (make_faceless, "no faces to touch"),
        (make_curve, '"Sphere" is not a mesh: select a mesh object, or convert this one'),
        (make_infinite, "not finite"),
        (make_nowhere, "that is not finite: set it again"),
        (make_flat, "a scale of 0"),
        (make_thin, "a scale of 0"),
        (make_disabled, "disabled in viewports"),
        (make_disabled_with_a_probe, "disabled in viewports"),
        (make_distant, "apart in single precision"),
    ],
)
def test_what_cannot_be_touched_is_refused_with_a_sentence(empty, ball, spoil, sentence):
    spoil(empty, ball)
    before = datablocks(empty)
    with pytest.raises(RuntimeError, match=sentence):
        empty.ops.tactile.stability_map(target="Sphere", extent=0.1)
    assert datablocks(empty) == before


def test_a_map_and_a_patch_lead_back_to_what_was_touched(empty, ball):
    _, record = stability_map(empty, spacing=1.0)
    again, _ = stability_map(empty, spacing=1.0)  # the map is active, but is not touched itself
    assert again["tactile_map"]["source"] == record["source"] == "Sphere"
    empty.ops.tactile.reconstruct(location=(0.0, 0.0, 2.0))
    assert empty.context.object["tactile"]["source"] == "Sphere"


def test_edit_mode_is_to_be_left_first(empty, ball):
    empty.ops.object.mode_set(mode="EDIT")
    assert not empty.ops.tactile.stability_map.poll()


@pytest.fixture
def vase(empty):
    """A vase of revolution, 1 high, of 5664 faces."""
    t, turns = np.linspace(0.0, 1.0, 60), np.linspace(0.0, 2.0 * np.pi, 96, endpoint=False)
    radii = 0.3 + 0.12 * np.sin(5.0 * t) * (1.0 - 0.5 * t)
    co = [(r * np.cos(a), r * np.sin(a), z) for r, z in zip(radii, t, strict=True) for a in turns]
    faces = [
        (96 * i + j, 96 * i + (j + 1) % 96, 96 * (i + 1) + (j + 1) % 96, 96 * (i + 1) + j)
        for i in range(59)
        for j in range(96)
    ]
    mesh = empty.data.meshes.new("Vase")
    mesh.from_pydata(co, [], faces)
    obj = empty.data.objects.new("Vase", mesh)
    empty.context.collection.objects.link(obj)
    empty.context.view_layer.objects.active = obj
    empty.context.view_layer.update()
    return obj


def test_a_probe_finds_the_place_that_a_map_touched(empty, vase, extension):
    vase.location, vase.rotation_euler = (3.0, 1.0, 0.0), (0.3, 0.2, 0.1)
    painted, record = stability_map(empty, target="Vase", spacing=0.25)
    touched_near = extension.tactile_addon.stability_map.map_object.touched_near
    places = np.reshape(painted["tactile_places"], (-1, 3))
    assert len(places) == record["touched"] > 15
    for place in [painted.matrix_world @ Vector(place) for place in places]:
        _, foot, *_ = vase.closest_point_on_mesh(vase.matrix_world.inverted() @ place)
        assert (vase.matrix_world @ foot - place).length < 1e-5
        assert np.allclose(touched_near(painted, place + Vector((0.02, 0.0, 0.0))), place)
    assert touched_near(painted, (50.0, 0.0, 0.0)) == (50.0, 0.0, 0.0)
    painted.hide_set(True)
    assert touched_near(painted, (3.0, 1.0, 0.0)) == (3.0, 1.0, 0.0)  # Its colors are not seen.


def test_a_probe_finds_the_place_whose_color_a_face_has(empty, extension):
    """On a default sphere some places of a face are nearer to the place of its neighbor."""
    empty.ops.mesh.primitive_uv_sphere_add()
    ball = empty.context.object
    painted, _ = stability_map(empty, spacing=0.5, extent=0.3)
    touched_near = extension.tactile_addon.stability_map.map_object.touched_near
    places = np.reshape(painted["tactile_places"], (-1, 3))
    touch = values(painted.data, "touch").astype(int)
    others = 0
    for face in painted.data.polygons:
        shown = places[touch[face.loop_start]]
        for corner in face.vertices:
            at = 0.1 * face.center + 0.9 * painted.data.vertices[corner].co
            assert np.allclose(touched_near(painted, at), shown, atol=1e-6)
            others += np.linalg.norm(places - at, axis=1).min() < np.linalg.norm(shown - at) - 1e-3
    assert others > 10
    top = (0.0, 0.0, 1.0)
    assert touched_near(ball, top) == top  # It is no map.
    painted["tactile_places"] = painted["tactile_places"][:0]
    assert touched_near(painted, top) == top


@pytest.mark.parametrize("add", ["plane", "cube", "cylinder"])
def test_large_faces_are_touched_as_densely_as_the_spacing_says(empty, touched, add):
    getattr(empty.ops.mesh, f"primitive_{add}_add")()
    found = touched(empty.context.object, spacing=0.5)
    places = np.array(found.places)
    assert not cKDTree(places).query_pairs(0.5)
    corners = found.points[found.triangles]
    assert np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max() <= 0.5
    middles = corners.mean(axis=1)
    assert cKDTree(places).query(middles)[0].max() < 0.6  # No large face is without one.
    area = 4.0 if add == "plane" else 24.0 if add == "cube" else 6.0 * np.pi
    assert found.areas.sum() == pytest.approx(area, rel=0.01)
    assert len(found.places) == pytest.approx(core.spaced_count(area, 0.5), rel=0.25)


def test_a_map_of_a_plane_is_without_error(empty, extension):
    empty.ops.mesh.primitive_plane_add()
    _, record = stability_map(empty, spacing=0.5)
    report = extension.tactile_addon.stability_map.map_object
    count = record["points"]
    assert report.map_summary(record) == f"{count} patches at {count} points, 0 in doubt"
    assert dict(report.map_table_rows(record))["median error"] == "0 m"


def test_a_map_of_few_facets_is_in_doubt_and_says_why(empty, extension):
    empty.ops.mesh.primitive_torus_add()
    _, record = stability_map(empty, spacing=0.5)
    assert record["in_doubt"] == record["few_facets"] == record["patches"] > 5
    words = extension.tactile_addon.stability_map.map_object.map_facets(record)
    assert words == f"Curvature of the facets, not of the shape, at {record['patches']} points"
    rows = dict(extension.tactile_addon.stability_map.map_object.map_rows(record))
    assert rows["… on Facets"] == str(record["few_facets"])
