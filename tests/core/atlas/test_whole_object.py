# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Exact objects touched all over: what is found of them, whether it is closed, and how far it is off."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest

import core
from core.atlas.boundaries import gaussian_curvature_of
from core.atlas.finger import Finger
from core.atlas.object_atlas import Check
from core.atlas.touching import SIDE_BY_SIDE, _Run
from core.exploration.options import ExplorationOptions
from tests import solids

RING = solids.ring(small=0.5)


def explored(solid, **options):
    options = {"tolerance": 4e-3, "rng": 0} | options
    return core.explore_object(solid, solid.start, solid.outward, **options)


@pytest.fixture(scope="module")
def ball():
    return explored(solids.ball(), noise=1e-3)


@pytest.fixture(scope="module")
def ring():
    return explored(RING, noise=1e-3, tolerance=8e-3)


@pytest.fixture(scope="module")
def block():
    return explored(solids.block(), tolerance=2e-2, most=60)


def test_a_ball_is_closed_and_as_near_as_asked(ball):
    mesh = ball.mesh(0.08)
    assert solids.topology(mesh.triangles) == solids.Topology(0, 0, 2, 1)
    assert np.abs(solids.ball().distances(mesh.vertices)).mean() < 1e-3
    assert ball.status == "ok"
    assert ball.message == "The object was felt everywhere a finger could reach."
    assert ball.next_touch() is None
    assert len(ball.patches) < 30


@pytest.mark.parametrize("tolerance", [1e-2, 2e-2])
def test_a_touch_in_a_narrow_hole_begins_on_its_wall_and_not_inside_the_object(tolerance):
    """Places near the point for a larger first patch are farther away than the hole is wide."""

    def distance(x, y, z):
        return max(abs(x) - 1.0, abs(y) - 1.0, abs(z) - 0.5, 0.04 - math.hypot(x, y))

    hole = solids.Solid(distance, (-0.04, 0.0, 0.0), (1.0, 0.0, 0.0))
    frame = explored(hole, tolerance=tolerance, noise=1e-4, most=1).patches[0].frame
    assert frame.origin == pytest.approx(hole.start, abs=1e-3)
    assert distance(*(frame.origin + 1e-3 * frame.axes[:, 2])) > 0.0


def test_an_atlas_is_printed_in_a_few_lines(ball):
    lines = repr(ball).splitlines()
    assert lines[0] == f"Atlas, {ball.status}: {ball.message}"
    assert len(lines) == 3
    assert ", closed, " in lines[2]
    mesh = ball.reference.mesh
    part = replace(ball.reference, mesh=mesh.chosen(mesh.vertices[mesh.triangles[:, 0], 2] > 0.0))
    assert ", open at " in repr(replace(ball, reference=part))


def test_edges_longer_than_the_object_are_refused(ball):
    with pytest.raises(ValueError, match="edge: expected at most the size of what was felt, 2, got 1e"):
        ball.mesh(1e30)


def test_edges_that_take_gigabytes_are_refused_at_once(ball):
    with pytest.raises(ValueError, match=r"edge: expected triangles that take 2 GB .* got 0\.001, which"):
        ball.mesh(1e-3)
    with pytest.raises(ValueError, match="GB: use a longer one"):
        ball.mesh(1e-49)


def test_triangles_face_outward_and_are_as_large_as_requested(ball):
    mesh = ball.mesh(0.08)
    a, b, c = (mesh.vertices[mesh.triangles[:, i]] for i in range(3))
    assert (np.einsum("ni,ni->n", np.cross(b - a, c - a), a) > 0.0).all()
    assert np.median(np.linalg.norm(b - a, axis=1)) == pytest.approx(0.08, rel=0.2)


def test_distances_are_signed_and_their_deviations_true(ball):
    rng = np.random.default_rng(1)
    radii = rng.uniform(0.8, 1.2, 500)
    p = rng.normal(size=(500, 3))
    p *= (radii / np.linalg.norm(p, axis=1))[:, None]
    distance, std = ball.distance(p)
    assert np.isfinite(distance).all()
    assert (std > 0.0).all()
    near = np.abs(radii - 1.0) < 0.02
    assert np.abs(distance - (radii - 1.0))[near].max() < 6e-3
    assert (np.sign(distance) == np.sign(radii - 1.0))[np.abs(radii - 1.0) > 6e-3].all()


@pytest.mark.long
@pytest.mark.parametrize(
    ("name", "solid", "known"),
    # Around the block, most places are nearest to an edge; a third of them is enough to judge by.
    [("ball", solids.ball(), 0.99), ("ring", RING, 0.99), ("block", solids.block(), 1.0 / 3.0)],
    ids=["ball", "ring", "block"],
)
def test_far_from_the_surface_distances_are_those_of_the_nearest_place(name, solid, known, request):
    """Near the block's edges patches end, and the normal of one wall does not tell the side."""
    atlas = request.getfixturevalue(name)
    p = np.random.default_rng(5).uniform(-2.0, 2.0, (1500, 3))
    (distance, std), true = atlas.distance(p), solid.distances(p)
    finite = np.isfinite(std)
    off = np.abs(distance - true)[finite]
    assert finite.mean() > known
    assert (np.sign(distance) == np.sign(true))[finite & (np.abs(true) > 0.03)].all()
    assert off.mean() < 5e-3
    assert np.mean(off <= 5.0 * std[finite] + 1e-3) > 0.98


def test_edges_join_neighbors_along_curves_on_the_surface(ball):
    ends = np.array([edge.nodes for edge in ball.edges])
    assert len(np.unique(ends)) == len(ball.patches)
    assert (ends[:, 0] < ends[:, 1]).all()
    curves = np.vstack([edge.curve for edge in ball.edges])
    assert np.abs(np.linalg.norm(curves, axis=1) - 1.0).mean() < 1e-3
    assert np.degrees(np.mean(np.concatenate([edge.angle for edge in ball.edges]))) < 1.0


def test_neighbors_agree_on_normals_and_bends_where_they_meet(ring):
    assert np.degrees(np.mean(np.concatenate([edge.angle for edge in ring.edges]))) < 0.5
    bends = np.hstack([ring.bends(edge)[0] for edge in ring.edges])
    assert np.abs(bends[0] - bends[1]).mean() < 0.2 * np.ptp(bends[0])


@pytest.mark.long
def test_deviations_of_bends_are_true_where_patches_meet(ball, ring):
    """A torus of radii R and r has K = cos t / (r (R + r cos t))."""
    held = []
    for atlas in (ball, *(explored(solids.ball(), noise=1e-3, rng=seed) for seed in (1, 2)), ring):
        curves = np.vstack([edge.curve for edge in atlas.edges])
        bends, stds = (np.hstack(parts) for parts in zip(*map(atlas.bends, atlas.edges), strict=True))
        out = np.hypot(curves[:, 0], curves[:, 1]) - 1.0
        cosine = out / np.hypot(out, curves[:, 2])
        true = cosine / (0.5 * (1.0 + 0.5 * cosine)) if atlas is ring else np.ones(len(curves))
        held += np.ravel(np.abs(bends - true) <= 1.645 * stds).tolist()
        assert np.mean(np.abs(bends[0] - bends[1]) <= 1.645 * np.hypot(*stds)) > 0.75
    assert 0.83 < np.mean(held) < 0.98


def test_at_the_point_the_deviation_of_the_bend_is_that_of_the_reconstruction(ring):
    r = ring.patches[0]
    bend, std = gaussian_curvature_of(r, r.frame.origin[None])
    assert bend[0] == pytest.approx(r.patch.k1 * r.patch.k2)
    assert 0.9 * r.gaussian_curvature_std < std[0] < 1.02 * r.gaussian_curvature_std


def test_patches_are_as_certain_as_requested(ball, ring):
    for atlas in (ball, ring):
        assert atlas.charts.mean_stds.max() <= atlas.tolerance
        assert [
            node["mean_height_std"] for node in atlas.to_dict()["nodes"]
        ] == atlas.charts.mean_stds.tolist()


def test_a_torus_has_one_handle(ring):
    mesh = ring.mesh(0.06)
    assert solids.topology(mesh.triangles) == solids.Topology(0, 0, 0, 1)
    assert np.abs(RING.distances(mesh.vertices)).mean() < 1e-3


def test_touches_bend_around_the_edges_of_a_block(block):
    normals = np.array([r.frame.axes[:, 2] for r in block.patches])
    sides = np.vstack([np.eye(3), -np.eye(3)])
    assert ((normals @ sides.T).max(axis=0) > 0.99).all()
    rng = np.random.default_rng(0)
    half = np.array([1.0, 0.7, 0.5])
    p, axis = rng.uniform(-1.0, 1.0, (1000, 3)) * half, rng.integers(0, 3, 1000)
    p[np.arange(1000), axis] = np.copysign(half[axis], p[np.arange(1000), axis])
    distance, std = block.distance(p)
    felt = np.isfinite(std)
    assert felt.mean() > 0.98
    assert np.abs(distance[felt]).mean() < 1e-3


def test_edges_that_were_felt_on_both_sides_are_closed(block):
    """Patches end short of these edges, so the vertices there are beyond the rims of all patches."""
    assert solids.topology(block.mesh(0.1).triangles).open == 0


@pytest.mark.long
def test_progress_can_end_it_with_what_is_there():
    calls = []

    def progress(done, uncovered):
        calls.append((done, uncovered))
        return done < 3

    solid = solids.ball()
    atlas = explored(solid, progress=progress)
    assert 3 <= len(atlas.patches) <= 6
    assert calls[-1][0] == len(atlas.patches)
    assert "allow more touches" in atlas.message
    assert solids.topology(atlas.mesh(0.1).triangles).open > 0


@pytest.mark.parametrize("answer", [False, np.False_, 0])
def test_whatever_is_false_except_none_stops_it(answer):
    calls = []
    explored(solids.ball(), progress=lambda done, _: (calls.append(done), answer)[1])
    assert calls == [1]


def test_a_small_budget_leaves_places_uncovered_and_says_where_to_go_on():
    solid = solids.ball()
    atlas = explored(solid, most=4)
    assert len(atlas.patches) <= 4
    assert atlas.status == "uncertain"
    assert "places where the object goes on: allow more touches" in atlas.message
    assert "touches found no patch there: use a smaller" in replace(atlas, is_cut_short=False).message
    touch = atlas.next_touch()
    assert abs(solid.distance(*touch.point)) < 0.05
    assert touch.outward @ touch.point > 0.9
    assert touch.gain > 0.0
    far = np.array([np.add(place.point, 0.5 * np.array(place.ahead)) for place in atlas.uncovered])
    distance, std = atlas.distance(far)
    assert np.isfinite(distance).all()
    assert np.isinf(std).any()


def test_a_surface_less_certain_than_the_tolerance_is_doubted_and_touched_next_where_it_is_least(ball):
    strict = replace(ball, tolerance=1e-9)
    assert strict.status == "uncertain"
    words = "The standard deviation is above the tolerance on 100 % of the surface: touch"
    assert strict.message.startswith(words)
    mesh, touch = ball.reference.mesh, strict.next_touch()
    assert abs(np.linalg.norm(touch.point) - 1.0) < 5e-3
    assert (touch.point == mesh.vertices[mesh.std.argmax()]).all()
    assert touch.outward == pytest.approx(touch.point, abs=0.1)


@pytest.mark.long
def test_a_prism_of_six_sides_has_its_walls_and_creases():
    """Its sides turn by 60 degrees only, less than those of a block; blended walls would take 50 touches."""
    prism = solids.prism(6)
    atlas = explored(prism, tolerance=8e-3)
    assert atlas.status == "ok" and len(atlas.patches) < 35
    mesh = atlas.mesh(0.05)
    assert solids.topology(mesh.triangles) == solids.Topology(0, 0, 2, 1)
    assert np.abs(prism.distances(mesh.vertices)).max() < 3.0 * 8e-3
    points = prism_points(prism, 500)
    distance, std = atlas.distance(points)
    assert np.isfinite(std).all() and np.abs(distance).max() < 2.0 * 8e-3


def prism_points(solid, count):
    """Places (count, 3) where rays from all around meet a solid."""
    ways = np.random.default_rng(2).normal(size=(count, 3))
    ways /= np.linalg.norm(ways, axis=1, keepdims=True)
    return np.array([solid.ray_cast(tuple(5.0 * way), tuple(-way), 10.0)[0] for way in ways])


def test_contacts_off_the_surface_put_it_in_doubt(ball):
    """The tolerance is 4e-3, and the deviation less than 1e-3."""
    ways = np.random.default_rng(3).normal(size=(50, 3))
    ways /= np.linalg.norm(ways, axis=1, keepdims=True)
    right = replace(ball, check=Check(ways, ways, np.zeros((0, 3)), len(ways)))
    assert right.status == "ok"
    off = ways * np.where(np.arange(50) < 2, 1.02, 1.0)[:, None]
    wrong = replace(ball, check=Check(off, ways, np.zeros((0, 3)), len(off)))
    assert wrong.contradicting.tolist() == [True, True] + 48 * [False]
    assert wrong.message.startswith("2 of 50 rays from outside met something else than the surface")
    missed = replace(ball, check=Check(ways[:49], ways[:49], ways[49:], 49))
    assert missed.message.startswith("1 of 50 rays from outside met something else")
    shifted = ways * np.where(np.arange(50) < 20, 1.004, 1.0)[:, None]
    loose = replace(ball, check=Check(shifted, ways, np.zeros((0, 3)), len(shifted)))
    assert not loose.contradicting.any()
    wide = loose.widened()
    distance, std = wide.distance(shifted)
    assert np.mean(np.abs(distance) <= 1.645 * std * 1.001) >= 0.9
    factor, grown = wide.charts.stds / loose.charts.stds, std / loose.distance(shifted)[1]
    assert factor == pytest.approx(factor.mean(), rel=1e-9)
    # Where no patch is, only the deviation of the closed surface grows.
    low, high = np.quantile(grown, [0.04, 0.96])
    assert 0.95 * factor.mean() < low <= high < 1.5 * factor.mean()
    assert np.median(grown) == pytest.approx(factor.mean(), rel=0.02)
    assert right.widened().distance(ways)[1] == pytest.approx(right.distance(ways)[1], rel=0.5)
    assert wrong.widened().distance(ways)[1] == pytest.approx(right.widened().distance(ways)[1], rel=0.1)


def test_walls_that_the_cells_do_not_resolve_put_it_in_doubt(ball):
    indicator = ball.reference.indicator
    thin = indicator._replace(thinnest=1.5 * indicator.cell)
    doubtful = replace(ball, reference=replace(ball.reference, indicator=thin))
    assert doubtful.status == "uncertain"
    assert doubtful.message.startswith(
        f"Walls or gaps of {100 * thin.thinnest / thin.size:.2g} % of the size were felt"
    )


def test_far_away_the_nearest_place_counts(ball):
    directions = np.random.default_rng(2).normal(size=(50, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    distance, std = ball.distance(np.vstack([3.0 * directions, 0.1 * directions]))
    assert distance[:50] == pytest.approx(2.0, rel=0.03)
    assert distance[50:] == pytest.approx(-0.9, rel=0.05)
    assert np.isfinite(std).all()


def test_steps_tell_what_was_found_and_the_same_seed_makes_the_same_touches(ball):
    solid = solids.ball()
    steps = core.touch_all_over(solid, solid.start, solid.outward, tolerance=4e-3, noise=1e-3, rng=0)
    found, joining = [], []
    try:
        while True:
            progress = next(steps)
            found += progress.found
            joining.append(progress.joining)
    except StopIteration as end:
        atlas = end.value
    assert len(found) == len(atlas.patches) <= progress.done
    assert joining[0] is None
    assert joining[-1] == 1.0
    for again, first in zip(atlas.patches, ball.patches, strict=True):
        assert np.array_equal(again.frame.origin, first.frame.origin)


def ended(steps):
    """The touches that steps found, and the Atlas that they return."""
    found = []
    try:
        while True:
            found += next(steps).found
    except StopIteration as end:
        return found, end.value


@pytest.mark.parametrize("tolerance", [1.6e-2, 4e-3])
def test_touches_go_on_from_earlier_ones_also_to_a_smaller_tolerance(tolerance):
    def touched(**options):
        given = {"tolerance": tolerance, "noise": 1e-3, "rng": 0} | options
        return ended(core.touch_all_over(RING, RING.start, RING.outward, **given))

    few, cut_short = touched(tolerance=1.6e-2, most=5)
    assert cut_short.uncovered
    found, atlas = touched(earlier=few)
    assert (atlas.status, len(atlas.uncovered)) == ("ok", 0)
    assert np.abs(RING.distances(atlas.reference.mesh.vertices)).mean() < tolerance
    assert len(found) == len(atlas.patches) <= 1.3 * len(touched()[0])
    kept = [e for e in found if any(e is other for other in few)]
    assert len(kept) == (len(few) if tolerance == 1.6e-2 else 0)  # The others are less certain.


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"tolerance": 0.0}, "tolerance: expected a finite number above 0, got 0"),
        ({"tolerance": 1e-3, "noise": 2e-3}, "tolerance: expected the noise 0.002 or more, got 0.001"),
        ({"most": 0}, "most: expected a finite number of 1 or more, got 0"),
    ],
)
def test_bad_arguments_get_a_sentence(options, message):
    with pytest.raises(ValueError, match=message):
        explored(solids.ball(), **options)


def test_no_start_on_the_surface_gets_a_sentence():
    with pytest.raises(ValueError, match="expected one on the surface"):
        core.explore_object(solids.ball(), (0.0, 0.0, 2.0), (0.0, 0.0, 1.0), tolerance=1e-2)


@pytest.mark.long
@pytest.mark.parametrize("most", [4, 1000])
def test_the_graph_as_data_survives_json_and_is_that_of_the_atlas(ball, most):
    atlas = ball if most == 1000 else explored(solids.ball(), most=most)
    d = atlas.to_dict()
    assert json.loads(json.dumps(d, allow_nan=False)) == d
    assert [d[name] for name in ("version", "status", "message")] == [2, atlas.status, atlas.message]
    assert len(d["nodes"]) == len(atlas.patches)
    for node, r in zip(d["nodes"], atlas.patches, strict=True):
        patch, domain = core.MongePatch(**node["polynomial"]), core.Domain(np.array(node["domain"]))
        x, y = domain.points_at(np.array([[0.0, 0.5], [0.7, -0.2]])).T
        assert (patch.height(x, y) == r.patch.height(x, y)).all()
        frame = core.Frame(**{name: np.array(values) for name, values in node["frame"].items()})
        world = frame.to_world(np.column_stack([x, y, patch.height(x, y)]))
        assert np.abs(np.linalg.norm(world, axis=1) - 1.0).max() < 0.01
        assert node["mean_height_std"] < 4e-3
    for edge, known in zip(d["edges"], atlas.edges, strict=True):
        assert edge["nodes"] == list(known.nodes)
        assert len(edge["curve"]) == len(edge["angle"]) == len(known.curve)
    if most == 4:
        assert len(d["uncovered"]) == len(atlas.uncovered) > 0
        assert np.array_equal(d["next_touch"]["point"], atlas.next_touch().point)
    else:
        assert (d["uncovered"], d["next_touch"]) == ([], None)


@pytest.mark.long
@pytest.mark.parametrize("when", ["joining", "again"])
def test_false_while_patches_are_joined_ends_the_touching(when):
    """The budget leaves a border, from which touches would go on after the join."""
    solid, sent = solids.ball(), False
    steps = core.touch_all_over(solid, solid.start, solid.outward, tolerance=8e-3, noise=8e-3, rng=0)
    state, early = next(steps), None
    try:
        while True:
            sent = sent or state.done >= 4
            if state.joining is not None and early is None:
                early = state.done
            state = steps.send(False if sent and (when == "again" or state.joining is not None) else None)
    except StopIteration as end:
        assert state.done == early
        assert len(end.value.patches) <= state.done


@pytest.mark.long
def test_false_while_a_check_is_followed_up_ends_the_touching_soon():
    """The check finds many other balls at once."""

    def distance(*point):
        return math.hypot(*(v - 3.0 * max(min(round(v / 3.0), 1), -1) for v in point)) - 1.0

    solid = solids.Solid(distance, (1.0, 0.0, 0.0), (1.0, 0.0, 0.0))
    steps = core.touch_all_over(solid, solid.start, solid.outward, tolerance=0.05, rng=0)
    state, joined, done = next(steps), False, None
    try:
        while True:
            joined = joined or state.joining is not None
            if joined and state.joining is None and done is None:
                done = state.done
            state = steps.send(None if done is None else False)
    except StopIteration:
        assert done is not None
        assert state.done - done <= SIDE_BY_SIDE


def test_one_touch_improves_places_that_are_near_each_other():
    """Many rays of the check meet the corners of one facet, from which the patches are a little off."""
    ball, angles = solids.ball(), np.linspace(0.0, 0.3, 20)
    run = _Run(Finger(ball, 1.0), 8e-3, 100, ExplorationOptions(largest_std=8e-3))
    (first,) = run.first(np.array(ball.start), np.array(ball.outward)).found
    arc = np.stack([np.sin(angles), 0.0 * angles, np.cos(angles)], axis=1)
    list(run.going_on([(point, point) for point in np.concatenate([arc, -arc])], first.result.radius))
    origins = np.array([e.result.frame.origin for e in run.found if e is not first])
    for place in (arc[0], -arc[0]):
        assert 1 <= (np.linalg.norm(origins - place, axis=1) < 0.35).sum() <= 3


@pytest.mark.long
def test_a_second_body_takes_no_more_touches_than_the_first():
    def distance(x, y, z):
        return math.hypot(abs(x) - 1.2, y, z) - 1.0

    solid = solids.Solid(distance, (2.2, 0.0, 0.0), (1.0, 0.0, 0.0))
    atlas = core.explore_object(solid, solid.start, solid.outward, tolerance=0.01, noise=1e-3, rng=0)
    assert atlas.status == "ok"
    assert solids.topology(atlas.reference.mesh.triangles) == solids.Topology(0, 0, 4, 2)
    first = sum(r.frame.origin[0] > 0.0 for r in atlas.patches)
    assert len(atlas.patches) - first <= 1.5 * first


@pytest.mark.parametrize(
    ("solid", "most"), [(solids.ball(), (8, 12)), (solids.egg(), (8, 11)), (solids.ring(), (16, 30))]
)
def test_a_larger_tolerance_takes_fewer_touches_and_is_kept(solid, most):
    """What the closed surface spans within the tolerance is only tapped."""
    for tolerance, touches in zip((0.06, 0.02), most, strict=True):
        atlas = explored(solid, tolerance=tolerance)
        assert atlas.status == "ok"
        assert len(atlas.patches) <= touches
        for mesh in (atlas.reference.mesh, atlas.mesh(0.03)):
            assert mesh.is_closed
            assert np.abs(solid.distances(mesh.vertices)).max() < 3.0 * tolerance


def test_a_patch_covers_what_is_inside_its_rim_and_near_to_it():
    ball = solids.ball()
    r = core.explore(ball, ball.start, ball.outward, farthest=0.4).result
    radius, turns = r.radius, np.linspace(0.0, 2.0 * np.pi, 60, endpoint=False)
    rim = radius * (1.0 - 0.4 * (np.cos(turns) > 0.0))  # It reaches less far on the side of d1.
    across = np.array([0.5, 0.7, -0.7, 0.95, -0.95, -1.05]) * radius
    points = r.frame.to_world(np.column_stack([across, 0.0 * across, r.height(across, 0.0 * across)]))
    inside = [True, False, True, False, True, False]
    assert core.covered_by(r, rim, points, 1e-3).tolist() == inside
    normal = r.frame.axes[:, 2]
    assert core.covered_by(r, rim, points + 2.9e-3 * normal, 1e-3).tolist() == inside
    assert not core.covered_by(r, rim, points + 3.1e-3 * normal, 1e-3).any()
    assert not core.covered_by(r, rim, -points, 1e-3).any()  # The other side of the ball is over it, too.
