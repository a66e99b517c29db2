# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What is said of a whole object is true of the mesh that is shown, and of the mesh that was touched."""

import re
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

pytest.importorskip("bpy", reason="needs Blender as a Python module: run make test")
from mathutils.bvhtree import BVHTree
from scenes import made, positions, values

from core import Mesh, scattered

OK = "The object was felt everywhere a finger could reach."
TETRAHEDRON = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)], dtype=float)
FACES = np.array([(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)])


def touched(bpy, **arguments):
    return made(bpy.ops.tactile.touch_all_over, "tactile_object", **arguments)


@pytest.fixture
def touches_of(empty, extension):
    """A function that prepares the ObjectTouches of an object."""

    def touches_of(obj, **given):
        values = {
            "location": None,
            "tolerance": 0.01,
            "accuracy": "normal",
            "noise": 0.0,
            "seed": 0,
            "most": 1000,
            "edge": 0.0,
        }
        touches = extension.tactile_addon.whole_object.object_touches.ObjectTouches
        return touches(obj, empty.context.evaluated_depsgraph_get(), **values | given)

    return touches_of


@pytest.mark.long
def test_a_cube_is_a_cube_with_sharp_edges(empty, extension):
    empty.ops.mesh.primitive_cube_add(size=2.0, location=(3.0, 0.0, 0.0))
    surface, record = touched(empty)
    assert (record["status"], record["message"], record["is_closed"]) == ("ok", OK, True)
    assert record["deviation_max"] < 1e-5
    report = extension.tactile_addon.whole_object.object_report
    agreement = "All of the surface is within the tolerance of 0.004 m, and the farthest place is 0 m off."
    rule = "Good means at least 99 % within it, and none farther off than 0.012 m."
    assert report.object_verdict(record) == "Good: all of it is within 0.004 m of the mesh"
    assert report.object_reasons(record) == [OK, f"{agreement} {rule}"]
    assert report.is_all_within(record)
    assert dict(report.object_rows(record))["Deviation"] == "0 m"
    # What is farther off than that is in the message already.
    far = {**record, "deviation_max": 0.05, "within": 0.9}
    words = "90 % of the surface is within the tolerance of 0.004 m, and the farthest place is 0.05 m off."
    assert report.agreement(far) == f"{words} {rule}"
    mesh = surface.data
    ends = np.array([edge.vertices for edge in mesh.edges])[values(mesh, "sharp_edge").astype(bool)]
    at_faces = np.isclose(np.abs(positions(mesh)), 1.0, atol=1e-5).sum(axis=1)
    assert (at_faces[ends] >= 2).all()
    assert (at_faces == 3).sum() == 8
    lengths = np.linalg.norm(np.diff(positions(mesh)[ends], axis=1), axis=2)
    assert lengths.sum() == pytest.approx(24.0, abs=1e-3)


@pytest.mark.long
@pytest.mark.parametrize(("turns", "most"), [((0.0, 0.0, 0.0), 6), ((0.3, 0.5, 0.7), 30)])
def test_a_planar_decimate_modifier_leaves_few_faces_of_a_cube_and_its_colors(empty, turns, most):
    def faces():
        return len(surface.evaluated_get(empty.context.evaluated_depsgraph_get()).data.polygons)

    empty.ops.mesh.primitive_cube_add(size=2.0, rotation=turns)
    surface, _ = touched(empty)
    decimate = surface.modifiers.new("Decimate", "DECIMATE")
    decimate.decimate_type, decimate.angle_limit = "DISSOLVE", np.radians(0.5)
    assert 6 <= faces() <= most
    for shown in ("deviation", "gaussian_curvature"):
        surface.tactile_colors = shown
        assert not surface["tactile_object"]["is_gray"]
    assert empty.ops.tactile.look_farthest() == {"FINISHED"}
    assert empty.ops.tactile.mesh_again(edge=0.25) == {"FINISHED"}
    assert 6 <= faces() <= most
    assert len(surface.data.vertices) > 100


def test_growing_patches_are_above_the_mesh_and_each_other(empty, extension, touches_of):
    """In the plane of a face, patches would be hidden by it, and by each other."""
    empty.ops.mesh.primitive_cube_add()
    touches = touches_of(empty.context.object, tolerance=2e-3)
    growing = extension.tactile_addon.whole_object.whole_mesh.GrowingPatches(
        empty.context.scene, touches.surface
    )
    shown = 0
    for _ in touches.steps():
        growing.add(touches.explored[shown:], touches.rims[shown:])
        shown = len(touches.explored)
    points = positions(empty.data.objects["Cube Touches"].data).reshape(shown, -1, 3)
    shades = np.zeros(4 * points.size // 3, dtype=np.float32)
    empty.data.objects["Cube Touches"].data.attributes["curvature_color"].data.foreach_get("color", shades)
    red, green, blue, _ = shades.reshape(shown, -1, 4)[:, 0].T  # in the middle of each patch
    assert (green > np.maximum(red, blue)).all()  # What is left of K on a flat face is pale.
    faces = [
        np.argmax(each.result.frame.axes[:, 2] @ np.vstack([np.eye(3), -np.eye(3)]).T)
        for each in touches.explored
    ]
    above = np.abs(points[:, 0]).max(axis=1) - 1.0
    growing.remove()
    assert 2e-4 < above.min() < above.max() < 5e-3  # The cube's size is 2; narrow patches are nearer to it.
    assert shown > len(set(faces))
    for face in set(faces):
        heights = np.sort(above[np.array(faces) == face])
        assert (np.diff(heights) > 2e-4).all()  # Small patches are in thinner layers.


def test_growing_patches_are_above_a_round_mesh_but_not_far_above_it(empty, ball, extension, touches_of):
    touches = touches_of(ball, tolerance=0.02)
    growing = extension.tactile_addon.whole_object.whole_mesh.GrowingPatches(
        empty.context.scene, touches.surface
    )
    steps = touches.steps()
    while len(touches.explored) < 8:
        next(steps)
    growing.add(touches.explored, touches.rims)
    drawn = empty.data.objects["Sphere Touches"].data
    corners = positions(drawn)[[list(face.vertices) for face in drawn.polygons]]
    places = np.vstack([positions(drawn), corners.mean(axis=1)])
    outward = places / np.linalg.norm(places, axis=1, keepdims=True)
    above = np.sum((places - touches.surface.feet(places)) * outward, axis=1)
    seen_above = empty.data.objects["Sphere Touches"]["tactile_above"]
    assert -seen_above < above.min() < above.max() < 0.01 * touches.surface.size


@pytest.mark.long
def test_what_the_mesh_hides_does_not_count(empty, ball):
    empty.ops.mesh.primitive_uv_sphere_add(segments=16, ring_count=8, radius=0.5)
    ball.select_set(True)
    empty.context.view_layer.objects.active = ball
    empty.ops.object.join()
    _, record = touched(empty, location=(0.0, 0.0, 2.0), tolerance=0.01)
    assert (record["status"], record["is_closed"]) == ("ok", True)
    assert record["deviation_max"] < 0.01


@pytest.mark.long
def test_what_touches_bridge_is_reported(empty, extension, ball, touches_of):
    """A dent next to the surface, which is made after the touches, because these would feel it."""
    touches = touches_of(ball, tolerance=0.02)
    for _ in touches.steps():
        pass
    assert (touches.report()["status"], touches.report()["message"]) == ("ok", OK)
    for vertex in ball.data.vertices:
        if vertex.co.z > 1.9:
            vertex.co.z = 1.5
    ball.data.update()
    empty.context.view_layer.update()
    other = touches_of(ball)
    both_ways = extension.tactile_addon.whole_object.both_ways.BothWays
    touches.compared = both_ways(other.surface, touches.whole.mesh, touches.tolerance)
    shares = list(touches.compared.steps())
    assert shares == sorted(shares)
    report = touches.report()
    assert report["deviation_max"] == pytest.approx(0.5, abs=0.1)
    assert report["deviation_place"][2] > 1.4
    assert report["status"] == "uncertain"
    advice = "off the object, which the tolerance does not explain: use"
    assert report["message"].endswith(f"{advice} a smaller tolerance.")
    atlas = touches.whole.atlas
    touches.whole.atlas = replace(atlas, tolerance=1e-5)
    report = touches.report()
    assert report["message"] == touches.whole.atlas.message
    assert [doubt["code"] for doubt in report["doubts"]] == ["rough", "off_mesh"]
    touches.whole.atlas = atlas
    corners = [tuple(polygon.vertices) for polygon in ball.data.polygons[1:]]
    points = [tuple(vertex.co) for vertex in ball.data.vertices]
    ball.data.clear_geometry()
    ball.data.from_pydata(points, [], corners)
    touches.surface = touches_of(ball).surface
    assert touches.report()["message"].endswith(f"{advice} a smaller tolerance.")  # The hole is elsewhere.
    touches.edge = 0.5
    assert touches.report()["message"].endswith(f"{advice} a shorter edge length.")


def test_the_verdict_says_how_much_is_within_the_tolerance(empty, extension, ball, touches_of):
    """A cap of 2 % of the ball is two tolerances off the surface: no place is too far off, but too many."""
    touches = touches_of(ball, tolerance=0.02)
    for _ in touches.steps():
        pass
    for vertex in ball.data.vertices:
        if vertex.co.z > 1.92:
            vertex.co *= 1.02
    ball.data.update()
    empty.context.view_layer.update()
    object_report = extension.tactile_addon.whole_object.object_report
    assert object_report.is_all_within(touches.report())
    touches.compared = extension.tactile_addon.whole_object.both_ways.BothWays(
        touches_of(ball).surface, touches.whole.mesh, touches.tolerance
    )
    list(touches.compared.steps())
    report = touches.report()
    assert 0.97 < report["within"] < 0.985
    assert 0.03 < report["deviation_max"] < 0.06
    only = r"Only 9[78][.\d]* % of surface and object agree to the tolerance: use a smaller tolerance."
    assert re.fullmatch(only, report["message"])
    assert object_report.object_verdict(report) == "Doubtful: use a smaller tolerance"
    _, words = object_report.object_reasons(report)
    assert re.match(r"9[78][.\d]* % of the surface is within the tolerance of 0\.02 m, and the", words)
    assert words.endswith("m off. Good means at least 99 % within it, and none farther off than 0.06 m.")
    assert not object_report.is_all_within(report | {"status": "ok"})  # So there is no tick.


def test_a_whole_object_of_facets_says_that_its_curvature_is_theirs(empty, extension):
    report = extension.tactile_addon.whole_object.object_report
    empty.ops.mesh.primitive_ico_sphere_add(subdivisions=2)
    source = empty.context.object
    _, record = touched(empty, most=4)
    assert report.object_verdict(record).startswith("Incomplete: ")
    assert report.object_reasons(record)[0] == record["message"]
    assert report.facets(record) == "Curvature of the facets, not of the shape, on 100 % of the area"
    assert dict(report.object_table_rows(record))["facets"] == report.facets(record)
    assert empty.ops.tactile.add_subdivision() == {
        "FINISHED"
    }  # and says that it is subdivided: touch it all over again
    assert [(m.type, m.levels) for m in source.modifiers] == [("SUBSURF", 3)]
    outdated = "Outdated: touch it all over again"
    record = empty.context.object["tactile_object"].to_dict()
    assert (report.object_verdict(record), report.facets(record)) == (outdated, None)
    empty.context.view_layer.objects.active = source
    assert report.facets(touched(empty, most=4)[1]) is None


@pytest.mark.long
def test_no_place_is_farther_off_than_is_said(empty, touches_of):
    """Neither of the surface, whose edges are long here, nor of the mesh. The share within is right, too."""
    empty.ops.mesh.primitive_cone_add()
    touches = touches_of(empty.context.object, tolerance=0.02, edge=0.25)
    for _ in touches.steps():
        pass
    compared, target, mesh = touches.compared, touches.surface, touches.whole.mesh
    places, _ = scattered(mesh.vertices, mesh.triangles, 50_000, np.random.default_rng(1))
    off = np.array([target.project(place)[2] for place in places.tolist()])
    tree = BVHTree.FromPolygons(mesh.vertices.tolist(), mesh.triangles.tolist(), all_triangles=True)
    others, _ = scattered(target.points, target.triangles, 50_000, np.random.default_rng(2))
    back = np.array([tree.find_nearest(place)[3] for place in others.tolist()])
    assert max(off.max(), back.max()) <= compared.largest < 1.05 * max(off.max(), back.max())
    ends = target.project(compared.place)[2], tree.find_nearest(compared.place)[3]
    assert max(ends) == pytest.approx(compared.largest, rel=1e-6)
    within = min((off <= 0.02).mean(), (back <= 0.02).mean())
    assert compared.within == pytest.approx(within, abs=0.01)
    assert compared.mean == pytest.approx(0.5 * (off.mean() + back.mean()), rel=0.02)


@pytest.mark.long
def test_without_an_edge_length_the_mesh_is_that_of_the_distances(ball, touches_of):
    touches = touches_of(ball, tolerance=0.02)
    for _ in touches.steps():
        pass
    assert touches.whole.mesh is touches.whole.atlas.reference.mesh


@pytest.mark.parametrize(
    ("left_out", "shown", "uncovered", "status", "is_closed"),
    [
        (0, 0, (), "ok", True),
        (0, 1, (), "uncertain", False),  # Only triangles of this length leave a hole.
        (1, 1, (), "ok", False),  # The object ends there.
        (1, 0, ("a place",), "ok", False),
    ],
)
def test_closed_is_the_mesh_that_is_shown(extension, left_out, shown, uncovered, status, is_closed):
    def mesh(left):
        return Mesh(TETRAHEDRON, FACES[left:], np.full(4, 0.1), np.zeros(4, dtype=int))

    atlas = SimpleNamespace(
        message=OK,
        doubts=(),
        uncovered=uncovered,
        reference=SimpleNamespace(mesh=mesh(left_out)),
        patches=[SimpleNamespace(radius=1.0)],
        edges=[],
    )
    whole = extension.tactile_addon.whole_object.whole_surface.WholeSurface(atlas, np.zeros(3))
    whole.mesh, whole.curvatures = mesh(shown), {"mean_curvature_std": np.array([0.1, np.inf, 0.1, 0.1])}
    report = whole.report()
    assert (report["status"], report["is_closed"]) == (status, is_closed)
    words = OK if status == "ok" else "Triangles of this edge length leave holes: use a shorter edge length."
    assert report["message"] == words
    rows = extension.tactile_addon.whole_object.object_report.object_rows
    shown_rows = dict(rows(report | {"tolerance": 0.1, "uncovered": len(uncovered), "felt": 0.5}))
    assert shown_rows["Without Curvature"] == "1"
    assert shown_rows["Surface"] == ("Closed" if is_closed else "Incomplete" if uncovered else "Open")


@pytest.fixture
def balls(empty):
    """Two balls in one mesh: only the check of the first finds the second, so that touches go on."""
    for x in (-1.3, 1.3):
        empty.ops.mesh.primitive_uv_sphere_add(segments=64, ring_count=32, location=(x, 0.0, 0.0))
    for obj in empty.data.objects:
        obj.select_set(obj.type == "MESH")
    empty.ops.object.join()
    return empty.context.object


def progress_of(touches, core):
    """The words and shares of all steps."""
    surface, rng = touches.surface, np.random.default_rng(0)
    left = core.scattered(surface.points, surface.triangles, 1000, rng)[0]
    steps, count = [], 0
    for _ in touches.steps():
        for each, rim in zip(touches.explored[count:], touches.rims[count:], strict=True):
            left = left[~core.covered_by(each.result, rim, left, touches.tolerance)]
        count = len(touches.explored)
        steps.append((touches.words.split()[0], touches.share, 1.0 - len(left) / 1000))
        assert ", 0 places left" not in touches.words
    words, shares, felt = zip(*steps, strict=True)
    touching = words.index("Meshing")
    assert (np.array(shares[:touching]) <= 0.8 * np.array(felt[:touching]) + 1e-9).all()
    assert list(shares) == sorted(shares)
    assert shares[-1] <= 1.0
    return words, shares


@pytest.mark.long
def test_touching_is_half_of_the_progress(empty, touches_of, extension):
    empty.ops.mesh.primitive_cylinder_add(vertices=8)
    words, shares = progress_of(touches_of(empty.context.object, tolerance=0.02), extension.core)
    assert 0.4 < shares[words.index("Joining") - 1] <= 0.5
    assert words[-1] == "Comparing"


@pytest.mark.long
def test_progress_never_runs_backward_and_goes_on_with_touches(balls, touches_of, extension):
    words, shares = progress_of(touches_of(balls, tolerance=0.02), extension.core)
    again = [i for i, word in enumerate(words) if i > words.index("Joining") and word[0].isdigit()]
    assert again and "Joining" in words[again[-1] :]
    assert len({shares[i] for i in again}) >= len({words[i] for i in again}) > 3
    assert words[-1] == "Comparing"


@pytest.mark.long
@pytest.mark.parametrize("word", ["Joining", "Checking"])
def test_once_stopped_it_touches_no_more(balls, touches_of, word):
    touches = touches_of(balls, tolerance=0.02)
    done = None
    for _ in touches.steps():
        if done is None and touches.words.startswith(word):
            touches.is_stopped = True
            done = touches.done
    assert done is not None
    assert touches.done == done
    assert len(touches.explored) == len(touches.whole.atlas.patches)


def test_once_stopped_it_says_that_it_joins(ball, touches_of):
    """Also while the touches end that were under way."""
    touches, words, waited = touches_of(ball, tolerance=0.02), [], 0
    for _ in touches.steps():
        if touches.is_stopped:
            words.append(touches.words)
        waited += touches.done == 1
        if waited == 3:  # The second touch is under way.
            touches.is_stopped = True
    assert words[0].startswith("Joining ")
    assert not any(each[0].isdigit() for each in words)


def test_who_stops_it_gets_no_advice_to_allow_more_touches(ball, touches_of):
    touches = touches_of(ball, tolerance=0.02)
    for _ in touches.steps():
        if touches.done >= 3:
            touches.is_stopped = True
    report = touches.report()
    assert re.fullmatch(
        r"Touching ended when [\d.]+ % of the object was felt, and the rest is up to [\d.]+ m away: continue "
        "with more touches.",
        report["message"],
    )
    assert report["felt"] == report["within"] < 0.7


@pytest.mark.long
def test_there_is_no_tick_where_heights_are_worse_than_the_tolerance(extension, ball, touches_of):
    touches = touches_of(ball, tolerance=0.02)
    for _ in touches.steps():
        pass
    assert touches.report()["status"] == "ok"
    mesh = touches.whole.mesh
    touches.whole.mesh = mesh._replace(std=mesh.std + touches.tolerance)
    report = touches.report()
    assert report["message"].startswith("Heights are accurate to ")
    assert report["message"].endswith("use a larger tolerance.")
    touches.tolerance *= 2.0
    assert "mean_height" not in {doubt["code"] for doubt in touches.report()["doubts"]}
    assert extension.tactile_addon.whole_object.object_report.verdict_of(report) == "Doubtful"


@pytest.mark.long
def test_the_largest_deviation_is_that_from_the_nearest_place(empty):
    """Along a slanted normal at a rounded edge the wall is farther away, though within the tolerance."""
    empty.ops.mesh.primitive_cube_add()
    half = np.array((1.0, 0.7, 0.04))
    empty.context.object.scale = half
    surface, record = touched(empty, noise=0.002, seed=4)
    faces = np.array([face.vertices for face in surface.data.polygons])
    places, _ = scattered(positions(surface.data), faces, 20_000, np.random.default_rng(0))
    # Few places at random are as near to a corner as the farthest one.
    beyond = np.abs(np.vstack([places, record["deviation_place"]])) - half
    outside = np.linalg.norm(np.maximum(beyond, 0.0), axis=1)
    off = np.maximum(
        outside, -beyond.max(axis=1)
    )  # The exact distance from a box; inside it is the least depth.
    assert 0.9 * off.max() < record["deviation_max"] < 1.5 * off.max()
