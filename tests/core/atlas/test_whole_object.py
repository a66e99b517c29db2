# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Exact objects touched all over: what is found of them, whether it is closed, and how far it is off."""

import json
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial import cKDTree

import core
from core.atlas import join, meshing
from core.atlas.boundaries import gaussian_curvature_of
from core.atlas.charts import AZIMUTHS, Charts
from core.atlas.field import LAYER, Blend, Felt, blended
from core.exploration.side_by_side import result_of
from core.patch.domain import Domain
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


def test_edges_longer_than_the_object_are_refused(ball):
    with pytest.raises(ValueError, match="edge: expected at most the size of what was felt, 2, got 1e"):
        ball.mesh(1e30)


def test_triangles_face_outward_and_are_as_large_as_asked(ball):
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


def test_beside_a_short_end_only_contacts_tell_how_far_a_joined_patch_goes():
    """A curve may end at a crease near the point; between it and the next one the domain bulges beyond."""
    ball, degrees = solids.ball(), np.arange(-180, 180, 60)
    touch = core.explore(ball, ball.start, ball.outward, farthest=0.3, rng=0)
    origin, axes = touch.result.frame.origin, touch.result.frame.axes
    out = touch.result.radius * np.where(degrees == 0, 0.05, 1.0)[:, None]
    ends = out * np.column_stack([np.cos(np.radians(degrees)), np.sin(np.radians(degrees))])
    result = replace(touch.result, geometry=replace(touch.result.geometry, domain=Domain(ends)))
    x, y = 0.45 * touch.result.radius * np.array([np.cos(np.radians(30)), np.sin(np.radians(30))])
    felt = origin * np.sqrt(1.0 - x**2 - y**2) + axes[:, 0] * x + axes[:, 1] * y
    more = core.Contour(felt[None], normals=felt[None])
    charts, at, rims = join.charts_of([result]), AZIMUTHS * 30 // 360, []
    for contours in (touch.contours, [*touch.contours, more]):
        rims.append(result_of(join.joined([contours], [result], charts, 0.0, {})).rims[0])
    assert charts.rims[0, at] > 0.4
    assert rims[0][at] == pytest.approx(0.05 * np.sin(np.radians(60)) / (1.05 * 0.5))
    assert rims[1][at] == pytest.approx(0.45)
    assert (
        rims[0][AZIMUTHS // 4 :][: AZIMUTHS // 2] == charts.rims[0, AZIMUTHS // 4 :][: AZIMUTHS // 2]
    ).all()


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
    assert std[0] == pytest.approx(r.gaussian_curvature_std, rel=0.05)


def test_patches_are_as_certain_as_asked(ball, ring):
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


def test_contacts_mend_holes_at_sharp_edges(block, monkeypatch):
    """Patches alone do not tell whether the edge between them is convex."""
    mended = block.mesh(0.07)  # The lattice of a coarser one may step over the holes.
    monkeypatch.setattr(meshing, "told", lambda charts, _, points, room=0.0: blended(charts, points, room))
    alone = block.mesh(0.07)
    assert solids.topology(mended.triangles).open < solids.topology(alone.triangles).open
    off, before = (np.abs(solids.block().distances(mesh.vertices)) for mesh in (mended, alone))
    assert off.mean() < 0.5 * before.mean()


def test_edges_that_were_felt_on_both_sides_are_closed(block):
    """Patches end short of these edges, so the vertices there are beyond the rims of all patches."""
    assert solids.topology(block.mesh(0.1).triangles).open == 0


def felt_plane(charts):
    """Contacts on a square of z = 0 around the middle of a ball, where no patch reaches."""
    xy = np.stack(np.meshgrid(*[np.linspace(-0.05, 0.05, 11)] * 2), axis=-1).reshape(-1, 2)
    points = np.column_stack([xy, np.zeros(len(xy))])
    up = np.tile([0.0, 0.0, 1.0], (len(points), 1))
    return Felt(points, up, np.zeros(len(points), dtype=np.intp), cKDTree(points))


@pytest.mark.parametrize("std", [np.inf, 1e-3])
def test_beyond_all_rims_the_nearest_contacts_tell_the_side(ball, std, monkeypatch):
    """A patch that is continued beyond its rim does not know that the surface turns there."""
    places = np.array([[0.0, 0.0, 0.06], [0.0, 0.0, -0.06], [0.2, 0.0, 0.06]])  # the last is far to the side
    wrong = Blend(np.array([-0.5, 0.5, -0.5]), np.full(3, std), -np.eye(3), np.full(3, 1))
    monkeypatch.setattr(join, "blended", lambda *_: Blend(*(values.copy() for values in wrong)))
    found = join.told(ball.charts, felt_plane(ball.charts), places, room=0.5)
    if np.isfinite(std):
        assert found.distance == pytest.approx(wrong.distance)
    else:
        assert found.distance == pytest.approx([0.06, -0.06, -0.5])
        assert found.normal[:2] == pytest.approx(np.array([[0.0, 0.0, 1.0]] * 2))
        assert found.node.tolist() == [0, 0, 1]


def test_where_no_patch_is_the_deviation_is_inf_unless_a_contact_is_near(ball):
    reach = LAYER * ball.charts.radii[0]
    places = np.array([[0.0, 0.0, 0.9 * reach], [0.0, 0.0, 1.1 * reach]])
    found = join.told(ball.charts, felt_plane(ball.charts), places)
    assert found.distance == pytest.approx(places[:, 2])
    assert np.isfinite(found.std).tolist() == [True, False]


@pytest.mark.parametrize("way", [1.0, -1.0])
def test_contacts_alone_keep_creases_and_valleys_sharp(ball, way):
    """The inside of a roof is below both slopes, that of a valley below either."""
    x, y = (axis.ravel() for axis in np.meshgrid(np.linspace(-1.0, 1.0, 20), np.linspace(-1.0, 1.0, 21)))
    points = np.column_stack([x, y, -way * np.abs(x)])
    normals = np.column_stack([way * np.sign(x), 0.0 * x, np.ones(len(x))]) / np.sqrt(2.0)
    felt = Felt(points, normals, np.zeros(len(points), dtype=np.intp), cKDTree(points))
    heights = np.array([0.3, -0.3])
    distance, _ = felt.told_alone(np.column_stack([np.full(2, 1e-3), np.zeros(2), heights]))
    assert distance == pytest.approx((heights + way * 1e-3) / np.sqrt(2.0))


def test_progress_can_end_it_with_what_is_there():
    told = []

    def progress(done, uncovered):
        told.append((done, uncovered))
        return done < 5

    solid = solids.ball()
    atlas = explored(solid, progress=progress)
    assert 5 <= len(atlas.patches) <= 8
    assert told[-1][0] == len(atlas.patches)
    assert solids.topology(atlas.mesh(0.1).triangles).open > 0


def test_a_small_budget_leaves_places_uncovered_and_says_where_to_go_on():
    solid = solids.ball()
    atlas = explored(solid, most=4)
    assert len(atlas.patches) <= 4
    assert atlas.status == "uncertain"
    assert "places where the object goes on: allow more touches" in atlas.message
    touch = atlas.next_touch()
    assert abs(solid.distance(*touch.point)) < 0.05
    assert touch.outward @ touch.point > 0.9
    assert touch.gain > 0.0
    far = np.array([-3.0 * touch.outward, 3.0 * touch.outward])
    distance, std = atlas.distance(far)
    assert np.isfinite(distance).all()
    assert np.isinf(std).any()


def test_patches_that_are_less_certain_than_the_tolerance_are_said(ball):
    strict = replace(ball, tolerance=1e-9)
    assert strict.status == "uncertain"
    assert "patches are less certain than the tolerance" in strict.message
    assert abs(np.linalg.norm(strict.next_touch().point) - 1.0) < 5e-3


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


@pytest.mark.parametrize("most", [4, 1000])
def test_the_graph_as_data_survives_json_and_is_that_of_the_atlas(ball, most):
    atlas = ball if most == 1000 else explored(solids.ball(), most=most)
    d = atlas.to_dict()
    assert json.loads(json.dumps(d, allow_nan=False)) == d
    assert [d[name] for name in ("version", "status", "message")] == [1, atlas.status, atlas.message]
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


def test_edges_in_steps_are_the_edges(ring):
    again = replace(ring)
    shares = list(again.bounding())
    assert shares == sorted(shares)
    assert len(shares) >= len(ring.patches)
    assert shares[-1] == 1.0
    assert "edges" in vars(again)
    assert [e.nodes for e in again.edges] == [e.nodes for e in ring.edges]
    assert list(again.bounding()) == []


@pytest.mark.parametrize("answer", [None, False])
def test_false_while_patches_are_joined_ends_the_touching(answer, monkeypatch):
    """Any other answer has patches in doubt touched again, which are the first three here."""
    monkeypatch.setattr(Charts, "less_certain_than", lambda charts, tolerance: [0, 1, 2])
    solid, joins = solids.ball(), False
    steps = core.touch_all_over(solid, solid.start, solid.outward, tolerance=8e-3, noise=8e-3, rng=0)
    state = next(steps)
    try:
        while not joins or state.joining is not None:
            joins = joins or state.joining is not None
            state = steps.send(answer if joins else None)
    except StopIteration as end:
        assert len(end.value.patches) > 5
        assert answer is False
    else:
        assert answer is None
