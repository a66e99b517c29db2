# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Strokes, curves off the reference point: with and without contours, dense, noisy and too few."""

import json
from functools import cache

import numpy as np
import pytest
import surfaces

from core import (
    Contour,
    DegenerateCurvesError,
    SamplingPlane,
    from_dict,
    reconstruct,
    reconstruct_many,
    suggest_plane,
    to_dict,
)
from core.reconstruction.strokes import LEAST_STRIPS, STRIPS, means

EXTENT = 10.0
SURFACES = surfaces.FIVE


@cache
def wiped(name, count, rows=0, extent=EXTENT):
    """About `count` contacts (n, 3) on a surface around its point, anywhere or in `rows` rows."""
    surface, rng = SURFACES[name], np.random.default_rng(count + rows)
    flat = rng.uniform(-1.0, 1.0, (count, 2))
    if rows:
        flat[:, 1] = rng.choice(np.linspace(-0.95, 0.95, rows), count)
    flat = extent * flat[np.hypot(*flat.T) <= 1.0]
    e1, n, e2 = SamplingPlane(0.3).axes(surface.normal).T
    starts = surface.point + flat @ np.array([e1, e2]) + EXTENT * n
    hits = surface.crossings(starts, -n, 2.0 * EXTENT)
    return hits[np.isfinite(hits[:, 0])]


def noisy(points, noise, seed):
    return points + np.random.default_rng(seed).normal(0.0, noise, points.shape)


def crossed(name, **options):
    return SURFACES[name].track(surfaces.planes((0, 60, 120)), **{"extent": EXTENT, "step": 0.8} | options)


def judged(surface, r):
    """The mean error over the domain, and the share of it where the 90 % interval holds."""
    points, heights = surfaces.heights_over(surface, r, 200)
    off = np.abs(r.height(*points.T) - heights)
    return off.mean(), (off < 1.645 * r.height_std(*points.T)).mean()


def fitted(name, points, shift=(0.0, 0.0, 0.0), **options):
    surface = SURFACES[name]
    return reconstruct(surface.point + shift, [], outward=surface.normal, strokes=[points], **options)


@pytest.mark.parametrize("name", SURFACES)
@pytest.mark.parametrize("rows", [0, 9])
def test_strokes_without_contours_show_an_exact_surface(name, rows):
    surface = SURFACES[name]
    r = fitted(name, wiped(name, 600, rows))
    assert r.status == "ok"
    assert judged(surface, r)[0] < 3e-4 * EXTENT
    scale = max(abs(surface.k1), abs(surface.k2))
    assert [r.patch.k1, r.patch.k2] == pytest.approx([surface.k1, surface.k2], abs=0.03 * scale)
    assert r.frame.axes[:, 2] @ surface.normal > np.cos(np.radians(0.3))
    assert r.contours == ()
    assert r.misses.shape == (0, 2)
    assert 0.9 * EXTENT < r.radius < 1.05 * EXTENT
    assert r.radius == pytest.approx(np.hypot(*r.contacts[:, :2].T).max())


@pytest.mark.parametrize("name", SURFACES)
def test_the_error_falls_as_the_square_of_the_extent_to_what_no_polynomial_tells(name):
    errors = [judged(SURFACES[name], fitted(name, wiped(name, 500, 0, extent)))[0] for extent in (16.0, 4.0)]
    assert errors[1] < max(errors[0] / 4.0**2, 1e-4 * 4.0)


@pytest.mark.long
@pytest.mark.parametrize("rows", [0, 9])
@pytest.mark.parametrize(("count", "share"), [(150, 0.002), (150, 0.02), (3000, 0.002), (3000, 0.02)])
def test_intervals_of_strokes_hold_and_rows_do_not_bias(count, rows, share):
    within, steepness = [], []
    for name, surface in SURFACES.items():
        for seed in range(4):
            r = fitted(name, noisy(wiped(name, count, rows), share * EXTENT, seed))
            within.append(judged(surface, r)[1])
            mean, true = 0.5 * (r.patch.k1 + r.patch.k2), 0.5 * (surface.k1 + surface.k2)
            steepness.append((mean - true) / r.mean_curvature_std)
    # Intervals are wide where contacts are few, or where means are better than a polynomial is trusted to be.
    assert 0.8 <= np.mean(within) <= (0.97 if (count, share) == (3000, 0.02) else 1.0)
    assert abs(np.mean(steepness)) < 4.0 / np.sqrt(len(steepness))


@pytest.mark.parametrize("share", [0.0, 0.002, 0.02])
def test_dense_strokes_are_better_than_some_of_them(share):
    dense, some = [], []
    for name, surface in SURFACES.items():
        for seed in range(2):
            points = noisy(wiped(name, 3000, 9), share * EXTENT, seed)
            dense.append(judged(surface, fitted(name, points))[0])
            some.append(judged(surface, fitted(name, points[::16]))[0])
    assert np.mean(dense) < (0.6 if share == 0.02 else 1.05) * np.mean(some)


@pytest.mark.parametrize("count", [300, 3000])
def test_with_contours_strokes_bring_the_patch_nearer(count):
    with_strokes, without, within = [], [], []
    for name, surface in SURFACES.items():
        for seed in range(3):
            noise = 0.01 * EXTENT
            contours = [Contour(noisy(c.points, noise, seed + 10 * i)) for i, c in enumerate(crossed(name))]
            points = noisy(wiped(name, count, 9, 15.0), noise, seed + 5)
            r = surface.fit(contours, strokes=[points], noise=noise)
            error, share = judged(surface, r)
            with_strokes.append(error)
            within.append(share)
            without.append(judged(surface, surface.fit(contours, noise=noise))[0])
            assert np.linalg.norm(r.frame.origin - surface.point) < 4.0 * r.height_std(0.0, 0.0)
    assert np.mean(with_strokes) < (0.9 if count == 300 else 0.6) * np.mean(without)
    assert np.mean(within) >= 0.8


def test_with_contours_the_point_l_and_domain_are_theirs_and_far_strokes_are_ignored():
    surface, contours = SURFACES["pear"], crossed("pear")
    far = wiped("pear", 400, 0, 30.0)
    far = far[np.linalg.norm(far - surface.point, axis=1) > 15.0]
    below = surface.point - 12.0 * surface.normal + 0.1 * (wiped("pear", 60) - surface.point)
    r, plain = surface.fit(contours, strokes=[far, below]), surface.fit(contours)
    assert len(r.strokes) == 0
    assert json.dumps(to_dict(r)) == json.dumps(to_dict(plain))
    r = surface.fit(contours, strokes=[wiped("pear", 200, 9), far])
    assert LEAST_STRIPS**2 <= len(r.strokes) <= STRIPS**2
    assert r.radius == pytest.approx(plain.radius, rel=1e-3)
    assert r.domain.boundary(40) == pytest.approx(plain.domain.boundary(40), abs=0.02 * EXTENT)
    assert len(r.contacts) == len(plain.contacts) + len(r.strokes)
    # Three planes leave directions open that strokes show.
    assert plain.null_space_dimension > 0 == r.null_space_dimension


def test_the_origin_is_the_foot_of_the_place():
    surface, points = SURFACES["torus"], wiped("torus", 600)
    r = fitted("torus", points)
    for shift in ((0.0, 0.0, 0.0), (0.7, -0.4, 0.9)):
        place = surface.point + shift
        r = reconstruct(place, [], outward=surface.normal, strokes=[points])
        off = place - r.frame.origin
        assert np.linalg.norm(np.cross(off, r.frame.axes[:, 2])) < 1e-2 * EXTENT * np.linalg.norm(off) + 1e-9
        level = surface.level(*r.frame.origin) / np.linalg.norm(surface.gradient(r.frame.origin))
        assert abs(level) < 1e-3 * EXTENT


def test_the_height_at_the_origin_is_as_uncertain_as_the_contacts_leave_it():
    surface, heights, stds = SURFACES["sphere"], [], []
    for seed in range(60):
        r = fitted("sphere", noisy(wiped("sphere", 100), 0.2, seed), noise=0.2)
        foot = r.frame.to_local([surface.point * 25.0 / np.linalg.norm(surface.point)])[0]
        heights.append(foot[2] - r.height(*foot[:2]))
        stds.append(r.height_std(0.0, 0.0))
    assert np.std(heights) == pytest.approx(np.mean(stds), rel=0.3)
    assert np.mean(stds) > 0.01


def test_all_that_tells_of_the_deviation_agrees():
    r = fitted("sphere", noisy(wiped("sphere", 100), 0.2, 0), noise=0.2)
    assert r.posterior.amplitude == 0.0
    flat = r.domain.grid(60)[0] / r.radius
    variances = np.diagonal(r.posterior.covariances_with(flat)(flat)[0])
    assert np.sqrt(variances) == pytest.approx(r.height_std(*(r.radius * flat).T) / r.radius)


def test_without_contours_the_radius_limits_the_contacts_of_strokes():
    points = np.vstack([wiped("saddle", 600, 9), SURFACES["saddle"].point + np.array([300.0, 0.0, 50.0])])
    r = fitted("saddle", points, radius=6.0)
    assert 5.0 < r.radius <= 6.0
    assert np.linalg.norm(r.strokes - SURFACES["saddle"].point, axis=1).max() <= 6.0
    with pytest.raises(ValueError, match="radius: expected a finite number above 0"):
        fitted("saddle", points, radius=0.0)
    with pytest.raises(
        ValueError, match="radius: expected none with contours, which say how far the patch reaches"
    ):
        SURFACES["pear"].fit(crossed("pear"), radius=5.0)


def similarities():
    rng = np.random.default_rng(3)
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    yield 1.0, turn, np.zeros(3)
    yield 1e-3, np.eye(3), np.zeros(3)
    yield 40.0, turn, np.array([300.0, -20.0, 7.0])


@pytest.mark.parametrize(("count", "with_contours"), [(200, False), (2000, False), (300, True)])
@pytest.mark.parametrize(("scale", "turn", "shift"), list(similarities()))
def test_the_patch_moves_with_its_contacts(count, with_contours, scale, turn, shift):
    surface, points = SURFACES["ellipsoid"], noisy(wiped("ellipsoid", count), 0.05, 0)

    def moved(p):
        return scale * p @ turn.T + shift

    contours = crossed("ellipsoid") if with_contours else []
    place = surface.point + (0.0 if with_contours else 0.3)
    one = reconstruct(place, contours, outward=surface.normal, strokes=[points])
    other = reconstruct(
        moved(place),
        [Contour(moved(c.points), noise=0.0) for c in contours],
        outward=turn @ surface.normal,
        strokes=[moved(points)],
    )
    assert other.radius == pytest.approx(scale * one.radius, rel=1e-6)
    assert other.frame.axes == pytest.approx(turn @ one.frame.axes, abs=1e-5)
    assert other.frame.origin == pytest.approx(moved(one.frame.origin), abs=1e-6 * scale)
    x, y = one.domain.grid(100)[0].T
    assert other.height(scale * x, scale * y) == pytest.approx(scale * one.height(x, y), abs=1e-5 * scale)
    assert other.height_std(scale * x, scale * y) == pytest.approx(scale * one.height_std(x, y), rel=1e-3)
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = scale * turn, shift
    again = one.moved(matrix)
    assert again.strokes == pytest.approx(moved(one.strokes), abs=1e-9 * scale)
    assert again.contacts == pytest.approx(scale * one.contacts, abs=1e-9 * scale)
    assert again.mean_height_std == pytest.approx(scale * one.mean_height_std)


ALONG = np.array([0.6, 0.8])


def test_means_of_neighbors_lie_on_a_quartic_and_take_all_contacts():
    def height(x, y):
        return 0.3 * x**2 - 0.2 * y**2 + 0.1 * x**3 * y

    contacts = np.random.default_rng(0).uniform(-1.0, 1.0, (5000, 3))
    contacts[:, 2] = height(*contacts[:, :2].T)
    found, size = means(contacts, ALONG, np.arange(len(contacts)))
    assert len(found) == STRIPS**2
    assert 0.6 * 5000 / STRIPS**2 < size <= 5000 / STRIPS**2
    assert found[:, 2] == pytest.approx(height(*found[:, :2].T), abs=1e-12)
    contacts[:, 2] = 1.0
    contacts[17, 2] += 500.0
    assert means(contacts, ALONG, np.arange(len(contacts)))[0][:, 2].max() > 5.0
    few, size = means(contacts[: STRIPS**2], ALONG, np.arange(STRIPS**2))
    assert size == 1
    assert np.array_equal(few, contacts[: STRIPS**2])
    # Contacts that are all in one place are no special case.
    assert np.isfinite(means(np.zeros((5000, 3)), ALONG, np.arange(5000))[0]).all()


def test_the_process_takes_what_a_sextic_leaves_of_strokes_too():
    rng = np.random.default_rng(5)
    flat = rng.uniform(-1.0, 1.0, (3000, 2))
    flat = flat[np.hypot(*flat.T) < 1.0]

    def rough(x, y):
        return -0.2 * (x**2 + y**2) + 0.015 * np.sin(7.0 * x + 1.0) * np.cos(6.0 * y)

    points = np.column_stack([flat, rough(*flat.T)]) + rng.normal(0.0, 1e-3, (len(flat), 3))
    r = reconstruct((0.0, 0.0, 0.0), [], outward=(0, 0, 1), strokes=[points])
    assert r.posterior.amplitude > 0.0
    at = 0.9 * flat[::10]
    local = r.frame.to_local(np.column_stack([at, rough(*at.T)]))
    off = np.abs(local[:, 2] - r.height(*local[:, :2].T))
    assert off.mean() < 1.5e-3
    assert (off < 1.645 * r.height_std(*local[:, :2].T)).mean() >= 0.8


def test_many_give_what_each_gives():
    names = ["pear", "torus", "pear", "saddle", "sphere"]
    contours = [crossed("pear"), [], crossed("pear"), [], []]
    strokes = [[wiped("pear", 60)], [wiped("torus", 900)], [], [wiped("saddle", 60, 9)], []]
    points = [SURFACES[name].point for name in names]
    outward = [SURFACES[name].normal for name in names]
    found = reconstruct_many(points, contours, outward=outward, strokes_list=strokes)
    assert str(found.pop()).startswith("three curves are needed, got 0")
    for i, r in enumerate(found):
        one = reconstruct(points[i], contours[i], outward=outward[i], strokes=strokes[i])
        assert r.strokes == pytest.approx(one.strokes, abs=1e-9)
        assert r.posterior.mean == pytest.approx(one.posterior.mean, abs=1e-7)
        assert r.mean_height_std == pytest.approx(one.mean_height_std, rel=1e-6)
    with pytest.raises(ValueError, match="strokes_list: expected 1 lists of strokes, got 2"):
        reconstruct_many(points[:1], contours[:1], outward=outward[:1], strokes_list=strokes[:2])


@pytest.mark.parametrize("with_contours", [False, True])
def test_through_json_and_back_it_is_the_same_to_the_last_bit(with_contours):
    surface = SURFACES["pear"]
    points = noisy(wiped("pear", 900), 0.2, 0)
    r = surface.fit(crossed("pear") if with_contours else [], strokes=[points])
    text = json.dumps(to_dict(r), allow_nan=False)
    again = from_dict(json.loads(text))
    assert json.dumps(to_dict(again), allow_nan=False) == text
    x, y = r.domain.grid(80)[0].T
    assert np.array_equal(again.height(x, y), r.height(x, y))
    assert np.array_equal(again.height_std(x, y), r.height_std(x, y))
    assert np.array_equal(again.contacts, r.contacts)
    assert np.array_equal(again.strokes, r.strokes)
    assert np.array_equal(again.domain.boundary(50), r.domain.boundary(50))
    assert suggest_plane(again) == suggest_plane(r)


def test_a_stroke_may_be_a_contour_and_brings_its_noise():
    points = noisy(wiped("pear", 120), 0.2, 0)
    one = fitted("pear", points, noise=0.2)
    r = reconstruct(
        SURFACES["pear"].point,
        [],
        outward=SURFACES["pear"].normal,
        strokes=[Contour(points[:40], noise=0.2), Contour(points[40:])],
    )
    assert r.noise == one.noise == pytest.approx(0.2 / r.radius)
    assert np.array_equal(r.height(1.0, 2.0), one.height(1.0, 2.0))


def test_a_mean_takes_in_several_rows():
    """All contacts of a row may share an offset, which the mean of a single row would keep."""
    rng = np.random.default_rng(0)
    for rows, most in ((12, LEAST_STRIPS), (100, STRIPS)):
        x, y = np.meshgrid(np.linspace(-1.0, 1.0, 100), np.linspace(-1.0, 1.0, rows))
        points = np.column_stack([x.ravel(), y.ravel(), np.repeat(rng.normal(0.0, 1.0, rows), 100)])
        assert len(means(points, np.array([0.0, 1.0]), np.arange(len(points)))[0]) == most**2
    assert len(means(rng.permutation(points), ALONG, np.arange(len(points)))[0]) == STRIPS**2


@pytest.mark.parametrize("name", SURFACES)
def test_where_a_sensor_dwells_it_tells_no_more_of_the_shape(name):
    points = wiped(name, 3000)
    dwelling = np.vstack(
        [points[:1234], noisy(np.repeat(points[1234:1235], 2000, axis=0), 1e-3, 0), points[1234:]]
    )
    plain, dwelled = fitted(name, points), fitted(name, dwelling)
    assert dwelled.radius == pytest.approx(plain.radius, rel=0.005)
    kappas = [dwelled.patch.k1, dwelled.patch.k2]
    assert kappas == pytest.approx([plain.patch.k1, plain.patch.k2], abs=1e-3 / plain.radius)


@pytest.mark.parametrize("name", SURFACES)
def test_a_stray_contact_far_off_changes_nothing(name):
    points = wiped(name, 500)
    plain, other = fitted(name, points), fitted(name, np.vstack([points, [[300.0, 200.0, 50.0]]]))
    assert other.radius == plain.radius
    assert np.array_equal(other.contacts, plain.contacts)


@pytest.mark.parametrize("name", SURFACES)
def test_strokes_that_repeat_the_contours_change_nothing(name):
    contours = crossed(name)
    one, other = (SURFACES[name].fit(contours, strokes=s) for s in ([], [c.points for c in contours]))
    assert np.array_equal(one.contacts, other.contacts)
    assert np.array_equal(one.height([1.0, 2.0], 3.0), other.height([1.0, 2.0], 3.0))


@pytest.mark.parametrize("name", SURFACES)
def test_from_inside_strokes_show_the_mirror_image(name):
    s, points = SURFACES[name], noisy(wiped(name, 3000), 0.05, 3)
    outside, inside = (reconstruct(s.point, [], outward=n, strokes=[points]) for n in (s.normal, -s.normal))
    assert inside.radius == pytest.approx(outside.radius, rel=1e-5)
    assert inside.patch.k1 == pytest.approx(-outside.patch.k2, abs=1e-5 / outside.radius)
    x, y = 0.5 * outside.radius * np.random.default_rng(0).uniform(-1.0, 1.0, (2, 200))
    over = outside.frame.to_world(np.column_stack([x, y, outside.height(x, y)]))
    u, v, w = inside.frame.to_local(over).T
    assert inside.height(u, v) == pytest.approx(w, abs=1e-5 * outside.radius)


ACROSS = np.array([0.0, 1.0, 0.0])
LINE = np.column_stack([np.linspace(-9, 9, 200), np.zeros(200), np.zeros(200)])
TURNS = np.linspace(0.0, 6.0, 200)
NEEDED = " around the point, and 6 are needed: measure more, or use a larger"
OPEN = "the strokes run along a line, two lines or a ring, which leaves the surface beside them open"


@pytest.mark.parametrize(
    ("strokes", "words"),
    [
        ([], "three curves are needed, got 0"),
        ([np.empty((0, 3))], "three curves are needed, got 0"),
        ([LINE[:5]], NEEDED),
        ([np.zeros((50, 3))], NEEDED),
        ([LINE], OPEN),
        ([noisy(LINE, 0.1, 0)], OPEN),
        ([LINE, LINE + 5.0 * ACROSS], OPEN),
        ([np.repeat(LINE[[0, -1]], 50, axis=0)], NEEDED),
        ([noisy(np.repeat(LINE[[0, -1]], 50, axis=0), 0.1, 0)], OPEN),
        ([9.0 * np.column_stack([np.cos(TURNS), np.sin(TURNS), 0.0 * TURNS])], OPEN),
        (
            [LINE + y * ACROSS for y in (1.0, 3.0, 5.0, 7.0, 9.0)],
            "the point is outside the strokes or at their rim",
        ),
    ],
)
def test_strokes_that_carry_no_fit_are_refused_with_a_sentence(strokes, words):
    with pytest.raises(DegenerateCurvesError, match=words):
        reconstruct((0.0, 0.0, 0.0), [], outward=(0, 0, 1), strokes=strokes)
    (error,) = reconstruct_many(np.zeros((1, 3)), [[]], outward=[(0, 0, 1)], strokes_list=[strokes])
    assert words in str(error)


def test_coarse_coordinates_and_bad_arguments_are_refused_with_a_sentence():
    surface, points = SURFACES["pear"], wiped("pear", 60)
    with pytest.raises(DegenerateCurvesError, match="apart in double precision, too coarse"):
        reconstruct(surface.point + 1e15, [], outward=surface.normal, strokes=[points + 1e15])
    for strokes, words in (
        (3.0, "strokes: expected a list, got 3.0"),
        (points, r"strokes: expected a list, got one array of shape \(\d+, 3\): put it into a list"),
        (points.tolist(), r"strokes\[0\]: expected shape \(n, 3\), got \(3,\)"),
        ([points, points[:, :2]], r"strokes\[1\]: expected shape \(n, 3\), got \(\d+, 2\)"),
        ([points * np.nan], r"strokes\[0\]: expected finite numbers"),
    ):
        with pytest.raises(ValueError, match=words):
            surface.fit([], strokes=strokes)
    with pytest.raises(ValueError, match='strokes: expected none with "tagc", which fits contours only'):
        surface.fit(crossed("pear"), strokes=[points], method="tagc")


def test_on_a_plane_d1_points_to_the_farthest_contact():
    flat = np.random.default_rng(2).uniform(-5.0, 5.0, (300, 2))
    stroke = np.column_stack([np.vstack([flat, [[6.0, 8.0]]]), np.zeros(301)])
    r = reconstruct((0, 0, 0), [], outward=(0, 0, 1), strokes=[Contour(stroke)])
    assert r.frame.axes == pytest.approx(
        np.array([[0.6, -0.8, 0.0], [0.8, 0.6, 0.0], [0.0, 0.0, 1.0]]), abs=1e-6
    )


def test_means_of_contacts_on_two_lines_stay_on_the_plane():
    """Two lines leave most terms of a quartic open, which must not carry the means between them away."""
    rng, x = np.random.default_rng(3), np.linspace(-0.6, 0.6, 450)
    lines = [np.column_stack([x, sign * x + rng.normal(0.0, 1e-6, 450), 0.0 * x]) for sign in (1.0, -1.0)]
    contacts = np.vstack(lines)
    contacts[:, 2] = rng.normal(0.0, 1e-3, 900)
    found, size = means(contacts, ALONG, np.arange(len(contacts)))
    assert size > 1
    assert np.abs(found[:, 2]).max() < 5e-3
