# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Parts with edges, and planes: what a touch promises there, and that rounding is said to be 0."""

import math
import re

import numpy as np
import pytest

pytest.importorskip("bpy", reason="needs Blender as a Python module: run make test")
from mathutils import Vector
from scenes import by_hand, is_of_facets, made, step

OFF = "The principal directions may be"


@pytest.fixture
def cube(empty):
    empty.ops.mesh.primitive_cube_add()
    return empty.context.object


def report_of(bpy, location, **arguments):
    arguments = {"target": "Cube", "new": True} | arguments
    assert bpy.ops.tactile.pick(location=location, **arguments) == {"FINISHED"}
    (patch,) = bpy.context.object.children
    return patch["tactile"].to_dict()


def test_a_patch_of_a_given_extent_says_where_its_curves_ended_before(empty, cube):
    message = report_of(empty, (0.9, 0.2, 1.0), extent=0.5)["message"]
    assert message.endswith(" 3 of 6 half curves ended at a crease, before the extent.")
    assert "half curves" not in report_of(empty, (0.1, 0.2, 1.0), extent=0.5)["message"]


@pytest.mark.parametrize("place", [(-0.89, 1.0, 0.013), (0.55, 1.0, -0.016), (0.18, -1.0, -0.023)])
def test_where_edges_end_curves_a_longer_extent_is_not_advised(empty, cube, place):
    """A probe on the rim of a plate: a shorter extent helps, as the automatic one is, and more planes do."""
    cube.scale.z = 0.05
    empty.context.view_layer.update()
    record = report_of(empty, place, extent=1.0)
    assert record["status"] == "uncertain"
    assert (
        ": use a shorter extent, move the point away from the edge, or add sampling planes."
        in record["message"]
    )
    assert report_of(empty, place)["status"] == "ok"
    assert report_of(empty, place, extent=0.05)["status"] == "ok"
    planes = {"plane_count": 6, "azimuths": [math.pi * i / 6 for i in range(6)]}
    assert report_of(empty, place, **planes)["status"] == "ok"


@pytest.fixture
def letter(empty):
    """An extruded B, whose face has two holes."""
    empty.ops.object.text_add()
    empty.context.object.data.body, empty.context.object.data.extrude = "B", 0.15
    empty.ops.object.convert(target="MESH")
    empty.context.object.name = "B"
    return empty.context.object


def touched(bpy, **arguments):
    """The record of a patch that was compared with the letter."""
    patch, _ = made(bpy.ops.tactile.reconstruct, target="B", **arguments)
    assert bpy.ops.tactile.verify() == {"FINISHED"}
    return patch["tactile"].to_dict()


@pytest.mark.parametrize(
    "location", [(0.1221, 0.6141, 0.15), (0.205, 0.0073, 0.15), (0.452, 0.4222, 0.15), (0.3055, 0.6769, 0.15)]
)
def test_a_good_patch_on_a_letter_spans_none_of_its_holes(empty, letter, location):
    record = touched(empty, location=location)
    assert record["status"] == "ok"
    assert record["verification"]["overlap"] > 0.97
    assert record["area"] > 0.005


def test_a_patch_that_spans_a_hole_at_a_given_extent_is_in_doubt(empty, letter):
    record = touched(empty, location=(0.1221, 0.6141, 0.15), extent=0.1364)
    assert record["status"] == "uncertain"
    share = float(re.match(r"At (\d+) % of the patch there is no surface, ", record["message"])[1])
    assert share == pytest.approx(100.0 * (1.0 - record["verification"]["overlap"]), abs=2.0)
    assert touched(empty, location=(0.1221, 0.6141, 0.15), extent=0.04)["status"] == "ok"


@pytest.mark.parametrize("extent", [0.0, 0.3, 0.8])
@pytest.mark.parametrize("location", [(0.9, 0.2, 1.0), (0.98, 0.1, 1.0), (0.9, 0.85, 1.0), (0.6, -0.7, 1.0)])
def test_the_patch_ends_at_the_edges_of_its_face(empty, cube, location, extent):
    report_of(empty, location, extent=extent)
    (patch,) = empty.context.object.children
    reach = max(
        abs(value) for v in patch.data.vertices for value in (patch.matrix_world @ v.co)[:2]
    )  # the faces of the cube reach to 1
    assert reach < 1.005
    assert empty.ops.tactile.verify() == {"FINISHED"}
    assert patch["tactile"]["verification"]["overlap"] > 0.99


@pytest.mark.parametrize("turn", [0.0, 0.4])
@pytest.mark.parametrize("extent", [0.0, 0.2, 0.5])
@pytest.mark.parametrize("location", [(0.1, 0.2, 1.0), (0.9, 0.2, 1.0), (0.9, 0.85, 1.0)])
def test_a_plane_gets_no_advice_about_directions_that_it_does_not_have(empty, cube, location, extent, turn):
    cube.rotation_euler = (turn, 0.3 * turn, turn)
    empty.context.view_layer.update()
    report = report_of(empty, cube.matrix_world @ Vector(location), extent=extent)
    assert report["status"] == "ok"
    assert OFF not in report["message"]


@pytest.mark.parametrize("place", [(0.606, -0.608, 0.505), (0.7039, -0.7032, 0.0505)])
def test_a_ball_of_facets_gets_no_advice_about_directions_that_it_does_not_have(empty, place):
    empty.ops.mesh.primitive_uv_sphere_add()
    report = report_of(empty, place, target="Sphere")
    assert report["status"] == "ok"
    assert "The two curvatures are equal within their error" in report["message"]


@pytest.fixture
def monkey(empty):
    """Blender's monkey without its Subdivision modifier: facets."""
    empty.ops.mesh.primitive_monkey_add()
    return empty.context.object


def test_a_patch_on_facets_names_them_and_the_modifier(empty, monkey):
    report = made(empty.ops.tactile.reconstruct, target="Suzanne", location=(0.25, -0.55, 0.75))[1]
    assert report["vertices"] < 6
    assert report["message"] == (
        "The point is at a crease, so half curves end there at once: move the point away from the edge or "
        "make the facets finer."
    )
    assert report["status"] == "uncertain"
    modifier = monkey.modifiers.new("Subdivision", "SUBSURF")
    modifier.levels = 4
    report = made(empty.ops.tactile.reconstruct, target="Suzanne", location=(0.25, -0.55, 0.75))[1]
    assert report["vertices"] > 20
    assert "facets" not in report["message"]


def test_a_touch_that_fails_on_facets_names_them_and_the_modifier(empty, monkey):
    corner = monkey.data.vertices[0].co
    words = r"The facets there are [\d.]+ \w*m long: add a Subdivision modifier if the shape is smooth"
    with pytest.raises(RuntimeError, match=words):
        empty.ops.tactile.reconstruct(target="Suzanne", location=corner)


@pytest.mark.parametrize("scale", [(1.0, 1.0, 1.0), (1.0, 0.7, 0.04)])
def test_no_subdivision_is_advised_where_nothing_is_round(empty, cube, scale):
    cube.scale = scale
    empty.context.view_layer.update()
    corner = Vector((0.99999, 0.99999, 0.99999)) * cube.scale
    with pytest.raises(RuntimeError, match="it needs besides the reference point") as caught:
        empty.ops.tactile.pick(target="Cube", location=corner)
    assert "Subdivision" not in str(caught.value)


def test_a_crease_of_a_fine_mesh_is_none_between_facets(empty, cube):
    modifier = cube.modifiers.new("Subdivision", "SUBSURF")
    modifier.levels, modifier.subdivision_type = 6, "SIMPLE"
    empty.context.view_layer.update()
    with pytest.raises(RuntimeError, match="it needs besides the reference point") as caught:
        empty.ops.tactile.reconstruct(target="Cube", location=(0.99999, 0.99999, 1.0))
    assert "facets" not in str(caught.value)


def test_what_rounding_leaves_of_nothing_is_said_to_be_none(extension, empty):
    settings, said = empty.context.scene.unit_settings, extension.tactile_addon.touch.wording
    settings.scale_length, settings.length_unit = 0.001, "MILLIMETERS"
    rows = dict(said.main_rows(RECORD) + said.other_rows(RECORD))
    assert rows["κ1"] == "0.00 ± 0.01 1/mm"
    assert rows["κ2"] == "0.02 ± 0.01 1/mm"
    assert rows["K Gaussian"] == "0.00 ± 0.01 1/mm²"
    assert rows["Fit Error"] == "0 mm"


RECORD = {
    "radius": 2.0,
    "k1": -6.7e-08,
    "k2": 0.02,
    "gaussian_curvature": -1.3e-09,
    "mean_curvature": 0.01,
    "fit_error": 1.1e-7,
    "height_std": 0.1,
    "is_verified": False,
    "shape_index": 0.5,
    "curvedness": 0.014,
    "degree": 4,
    "contacts": 60,
    **{f"{name}_std": 0.01 for name in ("k1", "k2", "gaussian_curvature", "mean_curvature")},
}


def test_the_preview_promises_no_more_than_was_felt(empty, extension, cube):
    addon, depsgraph = extension.tactile_addon, empty.context.evaluated_depsgraph_get()
    planes = [addon.touch.touch_object.core.SamplingPlane(math.radians(azimuth)) for azimuth in (0, 60, 120)]
    inputs = {"extent": 0.5, "step": 0.0, "noise": 0.0, "seed": 0, "method": "bayes", "degree": "auto"}
    touched = addon.touch.touch_object.touch(cube, depsgraph, (0.9, 0.2, 1.0), planes, **inputs)
    curves = {
        name: [touched.result.frame.to_world(np.reshape(path, (-1, 3))) for path in paths]
        for name, paths in addon.scene.patch_record.curves_of(touched.result).items()
    }
    (rim,), lines = curves["rim"], curves["contours"]
    assert len(lines) == 3
    assert np.array_equal(rim[0], rim[-1])
    ends = np.vstack([points[[0, -1]] for points in lines])
    assert np.abs(rim[:, 2] - 1.0).max() < 1e-3
    assert rim[:, 0].max() < 1.02  # the edge is at 1; a disk of that extent would reach to 1.4
    for end in ends:  # the rim runs through what was felt last
        assert np.linalg.norm(rim - end, axis=1).min() < 0.03


# Places close together on a torus whose smooth shape has kappa1 = -4 there.
PLACES = [(1.25 * math.cos(a), 1.25 * math.sin(a), z) for a in (0.02, 0.05, 0.09) for z in (0.01, 0.05)]


def test_the_verdict_on_few_facets_is_about_them_until_the_torus_is_subdivided(empty, extension):
    wording = extension.tactile_addon.touch.wording
    empty.ops.mesh.primitive_torus_add()
    torus = empty.data.objects["Torus"]
    for place in PLACES:
        assert empty.ops.tactile.pick(target=torus.name, location=place, new=True) == {"FINISHED"}
        record = empty.context.object.children[0]["tactile"].to_dict()
        said = wording.verdict(record)
        assert "make the facets finer" in said or "add a Subdivision modifier if the shape" in said
    empty.ops.ed.undo_push(message="Picked")
    by_hand(empty, empty.ops.tactile.add_subdivision)
    assert [modifier.levels for modifier in torus.modifiers] == [3]
    record = empty.context.object.children[0]["tactile"].to_dict()
    assert (record["status"], is_of_facets(record)) == ("ok", False)
    assert record["k1"] == pytest.approx(-4.0, rel=0.1)
    step(empty, "undo")
    assert not empty.data.objects["Torus"].modifiers
    (record,) = (o["tactile"].to_dict() for o in empty.context.object.children)
    assert record["status"] == "uncertain"
    step(empty, "redo")
    empty.ops.tactile.add_subdivision()
    assert [modifier.levels for modifier in empty.data.objects["Torus"].modifiers] == [4]


@pytest.mark.parametrize("shape", ["cube", "plane", "grid"])
def test_a_flat_face_is_no_facet(empty, shape):
    getattr(empty.ops.mesh, f"primitive_{shape}_add")()
    place = (0.1, 0.2, 1.0 if shape == "cube" else 0.0)
    record = made(empty.ops.tactile.reconstruct, location=place)[1]
    assert (record["status"], is_of_facets(record)) == ("ok", False)
    assert abs(record["k1"]) < 1e-3


@pytest.mark.parametrize("extent", [0.0, 0.6])
def test_the_wall_of_a_cylinder_has_one_verdict_from_its_middle_to_its_rim(empty, extent):
    empty.ops.mesh.primitive_cylinder_add()
    for z in (0.0, 0.2, 0.4, 0.45, 0.5, 0.55):
        record = made(empty.ops.tactile.reconstruct, location=(0.049, 0.995, z), extent=extent)[1]
        assert (record["k1"], record["k2"]) == pytest.approx((-1.0, 0.0), abs=0.15)
        assert not is_of_facets(record)
        empty.context.view_layer.objects.active = empty.data.objects["Cylinder"]


def test_a_flat_face_between_round_edges_is_no_facet(empty, cube):
    modifier = cube.modifiers.new("Bevel", "BEVEL")
    modifier.width, modifier.segments = 0.3, 3
    empty.context.view_layer.update()
    for extent in (0.0, 0.2, 0.6):
        record = made(empty.ops.tactile.reconstruct, location=(0.1, 0.2, 1.0), extent=extent)[1]
        assert not is_of_facets(record)
        empty.context.view_layer.objects.active = cube


def test_a_fine_scan_has_no_few_facets(empty, scans):
    empty.ops.wm.ply_import(filepath=str(scans / "pear.ply"))
    places = [vertex.co.copy() for vertex in empty.context.object.data.vertices]
    for place in places[::2000]:
        record = made(empty.ops.tactile.reconstruct, location=place)[1]
        assert not is_of_facets(record)
        empty.context.view_layer.objects.active = empty.data.objects["pear"]
