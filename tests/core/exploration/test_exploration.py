# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Automatic extent and step: how far curves grow, what ends them, how many contacts they get."""

import math
from dataclasses import replace
from functools import partial

import numpy as np
import pytest
import solids
import surfaces
from scipy.spatial import ConvexHull

import core
from core.contours.contour import UNEXPLAINED
from core.exploration import extent, touches
from core.exploration.extent import suffices
from core.reconstruction.from_contours import fitted
from core.reconstruction.next_plane import azimuth_of
from core.reconstruction.status import DOUBTFUL_STD

PLANES = [core.SamplingPlane(a) for a in np.radians([0.0, 60.0, 120.0])]
UP = (0.0, 0.0, 1.0)


def bowl_with(height, gradient):
    """A paraboloid plus `height`, whose gradient is given; the level is how far a point is above both."""
    return surfaces.Exact(
        lambda x, y, z: z + (x * x + y * y) / 80.0 - height(x, y),
        lambda p: np.array([*(p[:2] / 40.0 - gradient(*p[:2])), 1.0]),
        np.zeros(3),
        -1.0 / 40.0,
        -1.0 / 40.0,
    )


def rib(at, high, wide):
    """The paraboloid with a ridge along y, where x is `at`."""
    return bowl_with(
        lambda x, y: high * np.exp(-(((x - at) / wide) ** 2)),
        lambda x, y: (-2.0 * (x - at) / wide**2 * high * np.exp(-(((x - at) / wide) ** 2)), 0.0),
    )


class Scaled:
    """A surface in another unit of length: each of its lengths has `factor` times the number."""

    def __init__(self, surface, factor):
        self.surface, self.factor = surface, factor

    def ray_cast(self, origin, direction, distance):
        f = self.factor
        hit = self.surface.ray_cast([v / f for v in origin], direction, distance / f)
        return hit and ([f * v for v in hit[0]], hit[1])


def explore(surface, point=(0.0, 0.0, 0.0), normal=UP, planes=PLANES, farthest=30.0, **more):
    return core.explore(surface, point, normal, planes, farthest=farthest, **more)


def reach(contour, point=(0.0, 0.0, 0.0)):
    """How far a contour goes before the point, and after it."""
    at = int(np.argmin(np.linalg.norm(contour.points - point, axis=1)))
    lengths = np.linalg.norm(np.diff(contour.points, axis=0), axis=1)
    return lengths[:at].sum(), lengths[at:].sum()


def true_error(surface, found):
    """The mean |dz| over the domain; the reference point is the origin."""
    points, weights = found.result.domain.nodes
    world = found.result.frame.to_world(np.column_stack([points, found.result.patch.height(*points.T)]))
    return float(weights @ np.abs(surface.level(*world.T)))


@pytest.mark.parametrize("noise", [0.0, 0.05])
@pytest.mark.parametrize("radius", [20.0, 35.0])
def test_on_a_sphere_the_patch_is_large_and_as_good_as_it_says(radius, noise):
    ball = surfaces.sphere(radius)
    found = explore(ball, ball.point, ball.normal, farthest=2.0 * radius, noise=noise, rng=1)
    r = found.result
    assert 0.6 * radius < r.radius < radius
    assert r.mean_height_std < DOUBTFUL_STD * r.radius
    points, weights = r.domain.nodes
    center = ball.point - radius * ball.normal
    world = r.frame.to_world(np.column_stack([points, r.patch.height(*points.T)]))
    off = weights @ np.abs(np.linalg.norm(world - center, axis=1) - radius)
    assert off < 3.0 * r.mean_height_std


@pytest.mark.parametrize("extent", [8.0, 3.0, None])
def test_reach_is_shorter_than_a_given_extent_where_the_surface_ends_all_curves(extent):
    class Disk:
        """The plane z = 0 up to a distance of 5 from the origin."""

        def ray_cast(self, origin, direction, distance):
            hit = surfaces.plane().ray_cast(origin, direction, distance)
            return hit if hit is not None and math.hypot(*hit[0][:2]) <= 5.0 else None

    found = explore(Disk(), extent="auto" if extent is None else extent)
    assert found.extent == (extent or pytest.approx(5.0, abs=found.step))
    assert found.reach == pytest.approx(min(found.extent, 5.0), abs=found.step)
    assert found.reach <= 5.0


@pytest.mark.parametrize(("high", "wide"), [(1.6, 2.4), (1.4, 2.3), (3.2, 2.8)])
def test_among_waves_curves_are_as_long_as_their_fit_is_right(high, wide):
    def waves(x, y):
        return high * np.sin(x / wide) * np.sin(y / wide)

    def slopes(x, y):
        a, b = x / wide, y / wide
        return high / wide * np.cos(a) * np.sin(b), high / wide * np.sin(a) * np.cos(b)

    surface = bowl_with(waves, slopes)
    found = explore(surface, noise=0.08, rng=0)
    assert found.extent > 9 * 30.0 / 96
    assert true_error(surface, found) < 1.5 * found.result.mean_height_std


def short_waves():
    return bowl_with(
        lambda x, y: 0.4 * np.sin(2.0 * x) * np.sin(2.0 * y),
        lambda x, y: (
            0.8 * np.cos(2.0 * x) * np.sin(2.0 * y),
            0.8 * np.sin(2.0 * x) * np.cos(2.0 * y),
        ),
    )


def test_over_a_wave_curves_are_as_long_as_the_curvatures_at_the_point_are_right():
    wave = surfaces.sine()
    planes = [core.SamplingPlane(math.radians(azimuth)) for azimuth in (20.0, 80.0, 140.0)]
    r = explore(wave, wave.point, wave.normal, planes, farthest=28.0).result
    off = np.abs(np.subtract((r.k1, r.k2), (wave.k1, wave.k2)))
    assert r.status == "ok"
    assert (off < 3.0 * np.array([r.k1_std, r.k2_std])).all()
    assert off.max() * r.radius < 0.03


def test_what_is_too_rough_for_any_fit_to_be_trusted_is_not_fitted(monkeypatch):
    fits = []
    monkeypatch.setattr(touches, "fitted", lambda *given: fits.append(1) or fitted(*given))
    found, few = explore(short_waves()), len(fits)
    monkeypatch.setattr(extent, "DOUBTFUL_FIT", np.inf)
    assert explore(short_waves()).extent == found.extent
    assert len(fits) - few > few


def fits_of(monkeypatch, surface, **more):
    """What is found, and the results of the fits that this took."""
    results = []
    monkeypatch.setattr(touches, "fitted", lambda *given: results.extend(r := fitted(*given)) or r)
    return explore(surface, **more), results


def test_the_first_length_is_fitted_once_where_it_is_sure(monkeypatch):
    _, results = fits_of(monkeypatch, surfaces.plane())
    assert len(results) == 1


def test_where_noise_leaves_half_curves_uncertain_shorter_ones_are_not_fitted(monkeypatch):
    surface = surfaces.torus(40, 20, 0.6)
    given = {"point": surface.point, "normal": surface.normal, "noise": 3.0, "rng": 0}
    found, results = fits_of(monkeypatch, surface, farthest=20.0, **given)
    assert found.result.status == "uncertain"
    assert len(results) <= 5 * len(extent.DENSER)


def test_curves_end_before_a_wall_that_is_around_the_point():
    def high(x, y):
        return 1.2 * np.exp(-(((np.hypot(x, y) - 7.0) / 0.5) ** 2))

    def gradient(x, y):
        r = max(np.hypot(x, y), 1e-9)
        return np.array([x, y]) / r * -2.0 * (r - 7.0) / 0.5**2 * high(x, y)

    assert 5.0 < explore(bowl_with(high, gradient)).extent < 7.0


class Strip:
    """The plane z = 0 between two lines along x."""

    def ray_cast(self, origin, direction, distance):
        gone = -origin[2] / direction[2] if direction[2] else -1.0
        x, y = (o + gone * d for o, d in zip(origin[:2], direction[:2], strict=True))
        return ((x, y, 0.0), UP) if 0.0 <= gone <= distance and abs(y) <= 3.0 else None


def test_a_touch_is_as_long_as_it_is_sure():
    """Curves that are a fifth longer tell too little of the surface across the strip."""
    found = explore(Strip())
    assert found.result.status == "ok"
    assert explore(Strip(), extent=found.extent).result.status == "ok"
    assert explore(Strip(), extent=1.2 * found.extent).result.status == "uncertain"


@pytest.mark.parametrize("beside", [0.007, 0.0035])
def test_beside_an_edge_a_touch_is_so_short_that_its_curves_have_contacts_on_all_sides(beside):
    """At the first length the next contact of a half curve would be beyond the edge of the narrow wall."""
    point = (-0.1, -0.7, beside - 0.04)
    found = explore(solids.block(1.0, 0.7, 0.04), point, (0.0, -1.0, 0.0), farthest=1.0)
    assert found.result.status == "ok"
    assert core.stops_at(found.contours, point) == []
    assert found.extent > 5.0 * beside


def test_next_to_an_edge_few_touches_are_tried(monkeypatch):
    wall, point = solids.block(1.0, 0.7, 0.04), (-0.1, -0.7, -0.038)
    found, results = fits_of(monkeypatch, wall, point=point, normal=(0.0, -1.0, 0.0), farthest=1.0)
    assert core.stops_at(found.contours, point) == []
    assert found.extent > 0.1
    assert len(results) < 10


def test_at_the_edge_of_a_small_disk_a_touch_is_in_doubt_and_not_refused():
    """Half curves of every length end at the point, and the longest ones have no contact at all."""

    class Disk:
        def ray_cast(self, *ray):
            hit = surfaces.plane().ray_cast(*ray)
            return hit if hit is not None and math.hypot(hit[0][0], hit[0][1] + 1.0) <= 1.0 else None

    planes = [core.SamplingPlane(a) for a in np.radians([30.0, 75.0, 120.0])]
    found = explore(Disk(), (0.0, -1e-4, 0.0), planes=planes)
    assert found.result.status == "uncertain"
    assert core.stops_at(found.contours, (0.0, -1e-4, 0.0))


def test_on_a_narrow_wall_a_touch_is_as_long_as_it_is_sure():
    """The wall is 1.4 long and .08 wide: curves that run along it do not show how it bends across."""
    wall, point = solids.block(1.0, 0.7, 0.04), (1.0, 0.1, 0.004)
    found = explore(wall, point, (1.0, 0.0, 0.0), farthest=1.0)
    assert found.result.status == "ok"
    assert 0.06 < found.extent < 0.25
    assert explore(wall, point, (1.0, 0.0, 0.0), extent=0.25).result.status == "uncertain"


def test_a_plane_is_felt_to_the_largest_extent_with_few_contacts():
    found = explore(surfaces.plane(), noise=0.01, rng=0)
    assert found.extent == pytest.approx(30.0)
    assert found.step == pytest.approx(30.0 / 16.0)
    assert {stop for contour in found.contours for stop in contour.stops} == {core.EXTENT}


@pytest.mark.parametrize("options", [{}, {"step": 0.25}], ids=["any step", "a fine step"])
def test_all_curves_end_before_a_rib(options):
    surface = rib(at=9.0, high=1.6, wide=1.0)
    found = explore(surface, **options)
    for contour in found.contours:
        assert contour.points[:, 0].max() < 8.5  # the rib rises from there
        assert UNEXPLAINED in contour.stops
        assert reach(contour) == pytest.approx((found.extent, found.extent), rel=0.02)
    assert true_error(surface, found) < 3.0 * found.result.mean_height_std


def test_what_ends_a_curve_otherwise_still_does():
    half = surfaces.plane()

    class Table:
        def ray_cast(self, origin, direction, distance):
            hit = half.ray_cast(origin, direction, distance)
            return None if hit is None or hit[0][0] > 5.0 else hit

    found = explore(Table())
    assert found.contours[0].stops == (core.EXTENT, core.NO_CONTACT)
    assert reach(found.contours[0])[0] == pytest.approx(30.0, rel=0.05)


@pytest.mark.parametrize("factor", [1e-6, 1e6])
def test_size_does_not_matter(factor):
    surface = rib(at=9.0, high=0.8, wide=1.0)
    one, other = explore(surface), explore(Scaled(surface, factor), farthest=30.0 * factor)
    assert (other.extent, other.step) == pytest.approx((factor * one.extent, factor * one.step), rel=1e-6)
    assert [c.stops for c in other.contours] == [c.stops for c in one.contours]
    assert other.result.patch.k1 * factor == pytest.approx(one.result.patch.k1, rel=1e-3)


def test_more_contacts_where_they_tell_something():
    quiet, noisy = (
        explore(rib(at=50.0, high=0.8, wide=1.0), extent=10.0, noise=noise, rng=3) for noise in (0.0, 0.2)
    )
    assert len(noisy.result.contacts) >= 2 * len(quiet.result.contacts)
    assert noisy.extent == quiet.extent == 10.0


def test_given_lengths_are_those_of_track_and_reconstruct():
    ball = surfaces.sphere(20.0)
    found = explore(ball, ball.point, ball.normal, extent=8.0, step=0.8, noise=0.02, rng=5, degree=3)
    contours = core.track(ball, ball.point, ball.normal, PLANES, extent=8.0, step=0.8, noise=0.02, rng=5)
    r = core.reconstruct(ball.point, contours, outward=ball.normal, degree=3)
    assert np.array_equal(found.result.patch.coefficients, r.patch.coefficients)
    assert (found.extent, found.step) == (8.0, 0.8)


def test_numbers_are_taken_as_track_takes_them():
    found = explore(surfaces.plane(), farthest="30", step="2")
    assert (found.extent, found.step) == (30.0, 2.0)


def test_a_given_step_is_kept_where_the_extent_is_free():
    ball = surfaces.sphere(20.0)
    found = explore(ball, ball.point, ball.normal, step=1.5)
    assert found.step == 1.5
    gaps = np.concatenate([np.linalg.norm(np.diff(c.points, axis=0), axis=1) for c in found.contours])
    assert gaps == pytest.approx(1.5, rel=2e-3)
    assert found.extent > 8.0


@pytest.mark.parametrize("step", [0.3, 4.0])
def test_lengths_that_are_tried_are_no_shorter_than_a_given_step(step):
    found = explore(short_waves(), step=step)
    assert found.step == step <= found.extent
    assert found.result.status == "uncertain"


def test_the_size_is_that_of_the_default_fit_whatever_the_method():
    surface = rib(at=9.0, high=0.8, wide=1.0)
    ends = [[c.points[[0, -1]] for c in explore(surface, method=m).contours] for m in ("bayes", "tagc")]
    assert np.allclose(*ends, atol=1e-9)


def test_a_patch_over_a_ripple_says_how_good_it_is():
    ripple = bowl_with(
        lambda x, y: 0.15 * np.sin(4.0 * x) * np.sin(3.0 * y),
        lambda x, y: (0.6 * np.cos(4.0 * x) * np.sin(3.0 * y), 0.45 * np.sin(4.0 * x) * np.cos(3.0 * y)),
    )
    found = explore(ripple, farthest=20.0)
    assert (
        found.result.status == "uncertain" or true_error(ripple, found) < 3.0 * found.result.mean_height_std
    )


def test_a_point_next_to_an_edge_is_refused_as_ever():
    class Sliver:
        def ray_cast(self, origin, direction, distance):
            hit = surfaces.plane().ray_cast(origin, direction, distance)
            return None if hit is None or abs(hit[0][0]) > 1e-6 else hit

    with pytest.raises(core.DegenerateCurvesError, match="contacts it needs"):
        explore(Sliver())


def touched_at(places, ball, **more):
    """Points and outward normals of a ball, and what explore and explore_many find there."""
    up = np.array(places) / np.linalg.norm(places, axis=1, keepdims=True)
    points = ball.point - 20.0 * ball.normal + 20.0 * up
    many = core.explore_many(ball, points, up, PLANES, farthest=30.0, **more)
    return points, many, [explore(ball, p, n, **more) for p, n in zip(points, up, strict=True)]


@pytest.mark.parametrize("more", [{}, {"extent": 8.0}, {"method": "tagc"}, {"tolerance": 0.0}])
def test_many_are_what_each_is(more):
    ball = surfaces.sphere(20.0)
    _, many, single = touched_at([(1.0, 0.2, 0.1), (0.1, 1.0, 0.3), (-0.3, 0.2, 1.0)], ball, **more)
    for one, other in zip(many, single, strict=True):
        assert (one.extent, one.step) == (other.extent, other.step)
        azimuths = ([plane.azimuth for plane in each.planes] for each in (one, other))
        assert next(azimuths) == pytest.approx(next(azimuths), abs=1e-6)
        assert [c.stops for c in one.contours] == [c.stops for c in other.contours]
        assert one.stds == pytest.approx(other.stds, rel=1e-6)
        assert one.result.patch.k1 == pytest.approx(other.result.patch.k1, rel=1e-6)


@pytest.mark.parametrize(
    ("farthest", "said"), [(30.0, "point: expected one on the surface"), (None, "All curves end at once")]
)
def test_of_many_one_may_be_no_touch(farthest, said):
    ball = surfaces.sphere(20.0)
    points = np.array([ball.point, ball.point + 5.0 * ball.normal])
    one, other = core.explore_many(ball, points, [ball.normal] * 2, PLANES, farthest=farthest)
    assert one.result.status == "ok"
    assert str(other).startswith(said)
    assert core.explore_many(ball, np.empty((0, 3)), np.empty((0, 3)), PLANES, farthest=30.0) == []


def wavy():
    """Waves that three planes do not show well."""
    return bowl_with(
        lambda x, y: 0.8 * np.sin(0.4 * x) * np.cos(0.3 * y),
        lambda x, y: (0.32 * np.cos(0.4 * x) * np.cos(0.3 * y), -0.24 * np.sin(0.4 * x) * np.sin(0.3 * y)),
    )


def test_planes_are_added_to_what_was_felt_while_they_help():
    three, more = explore(wavy()), explore(wavy(), tolerance=0.0)
    added = len(more.planes) - 3
    assert added > 0
    assert len(more.stds) == added + 1
    assert (more.extent, more.step) == (three.extent, three.step)
    assert more.stds[0] == three.result.mean_height_std
    assert more.stds[-1] == more.result.mean_height_std < 0.9 * three.result.mean_height_std
    for old, new in zip(three.contours, more.contours, strict=False):
        assert np.array_equal(old.points, new.points)
    azimuth = core.suggest_plane(three.result)[0].azimuth
    d1 = three.result.frame.axes[:, 0]
    along = np.cos(azimuth) * d1 + np.sin(azimuth) * three.result.frame.axes[:, 1]
    assert np.sin(azimuth_of(along, UP) - more.planes[3].azimuth) == pytest.approx(0.0, abs=0.02)
    assert true_error(wavy(), more) < true_error(wavy(), three)


@pytest.mark.parametrize("noise", [0.05, 0.2])
def test_a_plane_that_makes_the_patch_less_certain_is_not_added(noise, monkeypatch):
    monkeypatch.setattr(extent, "HELPS", -1.0)
    s = surfaces.torus(40, 20, 0.6)
    found = core.explore(s, s.point, s.normal, extent=12.0, step=1.0, tolerance=0.0, noise=noise, rng=0)
    assert (np.diff(found.stds) < 0.0).all()
    assert found.stds[-1] == found.result.mean_height_std
    assert len(found.contours) == len(found.planes) < 6


def test_half_curves_have_one_length_where_the_surface_goes_on():
    surface = surfaces.ellipsoid(60.0, 20.0, 20.0, 0.6, 0.5)
    found = core.explore(surface, surface.point, surface.normal, farthest=30.0)
    lengths = [length for c in found.contours for length in reach(c, surface.point)]
    assert found.result.status == "ok"
    assert lengths == pytest.approx([found.extent] * 6, rel=0.02)


def test_a_given_extent_has_the_verdict_of_an_automatic_one():
    for surface in (rib(9.0, 0.8, 1.0), wavy(), short_waves()):
        chosen = explore(surface)
        given = explore(surface, extent=chosen.extent, step=chosen.step)
        assert given.result.status == chosen.result.status
        assert given.result.patch.k1 == pytest.approx(chosen.result.patch.k1, abs=1e-9)


def test_planes_are_added_until_it_is_good_enough():
    stds = explore(wavy(), tolerance=0.0).stds
    assert explore(wavy(), tolerance=1.001 * stds[1]).stds == pytest.approx(stds[:2])
    assert len(explore(wavy(), tolerance=1.001 * stds[0]).planes) == 3
    assert len(explore(wavy(), tolerance=0.0, most_planes=4).planes) == 4


class Counted:
    """A surface that counts its rays."""

    def __init__(self, surface):
        self.surface, self.rays = surface, 0

    def ray_cast(self, *ray):
        self.rays += 1
        return self.surface.ray_cast(*ray)


def test_nothing_is_felt_twice():
    """A plane is felt a quarter of the way and then all of it, and the contacts felt then are fitted."""
    surface, whole = Counted(surfaces.plane()), Counted(surfaces.plane())
    found = explore(surface)
    core.track(whole, (0.0, 0.0, 0.0), UP, PLANES, extent=30.0, step=30.0 / 96.0)
    assert found.extent == pytest.approx(30.0)
    assert surface.rays < 1.3 * whole.rays


@pytest.mark.parametrize(
    ("more", "message"),
    [
        ({"tolerance": -1.0}, "tolerance: expected a finite number of 0 or more, got -1"),
        ({"most_planes": 2}, "most_planes: expected a finite number of 3 or more, got 2"),
        ({"extent": "far"}, "extent: expected a finite number above 0, got 'far'"),
        ({"step": -1.0}, "step: expected a finite number above 0, got -1"),
        ({"farthest": 0.0}, "farthest: expected a finite number above 0, got 0"),
        ({"step": 40.0}, "step: expected no more than the extent 30, got 40"),
        ({"extent": 1.0, "step": 2.0}, "step: expected no more than the extent 1, got 2"),
        ({"method": "magic", "extent": 8.0}, "method: expected one of .*, got 'magic'"),
    ],
)
def test_bad_arguments_are_named(more, message):
    with pytest.raises(ValueError, match=f"^{message}$"):
        explore(surfaces.plane(), **more)


@pytest.mark.parametrize("noise", [0.0, 0.05, 0.2])
def test_whether_contacts_are_enough_is_no_matter_of_the_unit(noise):
    surface, found = surfaces.pear(), []
    for step in (0.25, 0.5, 1.0, 3.0):
        r = surface.fit(surface.track(surfaces.planes((0, 60, 120)), step=step, noise=noise, rng=1))
        found.append(suffices(r))
        for scale in (1e-3, 1.0 / r.radius, 30.0):
            assert suffices(r.moved(np.diag([scale, scale, scale, 1.0]))) == found[-1]
    assert found[-1] == (noise == 0.0)


def test_contacts_are_enough_where_twice_as_many_take_a_sixth_off_at_most():
    """A fit with as many contacts more, between those there are, tells how far the deviation falls."""
    surface = surfaces.torus(40, 20, 0.6)
    for step, noise in ((0.5, 0.05), (2.0, 0.05), (3.0, 0.2), (1.0, 0.01)):
        planes = surfaces.planes((0, 60, 120))
        once = surface.fit(surface.track(planes, step=step, noise=noise, rng=1))
        twice = surface.fit(surface.track(planes, step=step / 2.0, noise=noise, rng=1))
        share = twice.mean_height_std / once.mean_height_std
        if abs(share - 0.85) > 0.1:
            assert suffices(once) == (share > 0.85)


def test_how_far_to_feel_is_found_where_curves_end_by_themselves():
    ball = surfaces.sphere(20.0)
    found = core.explore(ball, ball.point, ball.normal)
    assert 5.0 < found.extent < 30.0  # along the curve; a quarter circle is 31.4
    assert found.result.status == "ok"


class Hull:
    """The convex hull of 300 places on an egg, as a mesh."""

    def __init__(self):
        places = np.random.default_rng(3).normal(size=(300, 3))
        places *= (12.0, 12.0, 20.0) / np.linalg.norm(places, axis=1, keepdims=True)
        equations = ConvexHull(places + np.array([40.0, -7.0, 3.0])).equations
        self.normals, self.offsets = equations[:, :3], equations[:, 3]

    def ray_cast(self, origin, direction, distance):
        slopes = self.normals @ direction
        with np.errstate(divide="ignore"):
            gone = -(self.normals @ origin + self.offsets) / slopes
        first, last = gone[slopes < 0.0].max(), gone[slopes > 0.0].min()
        at = next((t for t in (first, last) if first <= last and 0.0 < t <= distance), None)
        return at and (np.add(origin, at * np.array(direction)), self.normals[np.argmax(gone == at)])


class Bowl:
    """The part of a surface within 12 of the z axis."""

    def __init__(self, surface):
        self.surface = surface

    def ray_cast(self, *ray):
        hit = self.surface.ray_cast(*ray)
        return hit if hit is not None and math.hypot(*hit[0][:2]) <= 12.0 else None


def dented(seed=0):
    """A closed surface around the origin with random dents, touched where the x axis leaves it."""
    rng = np.random.default_rng(seed)
    waves, phases = rng.normal(0.0, 0.1, (5, 3)), rng.uniform(0.0, 6.0, 5)

    def level(x, y, z):
        dents = sum(np.cos(a * x + b * y + c * z + p) for (a, b, c), p in zip(waves, phases, strict=True))
        return np.sqrt(x * x + y * y + z * z) - 20.0 - dents

    def gradient(p):
        slopes = [np.sin(wave @ p + phase) * wave for wave, phase in zip(waves, phases, strict=True)]
        return p / np.linalg.norm(p) + np.sum(slopes, axis=0)

    surface = surfaces.Exact(level, gradient, None, np.nan, np.nan)
    hit, _ = surface.ray_cast((30.0, 0.0, 0.0), (-1.0, 0.0, 0.0), 30.0)
    return replace(surface, point=hit)


def shifted(surface):
    """The surface with its point at the origin."""
    move = surface.point
    return replace(
        surface,
        level=lambda x, y, z: surface.level(x + move[0], y + move[1], z + move[2]),
        gradient=lambda p: surface.gradient(p + move),
        point=np.zeros(3),
    )


def placed(surface):
    return surface, surface.point, surface.normal


def on_hull():
    return Hull(), *Hull().ray_cast((80.0, 10.0, 10.0), (-0.9, -0.3, -0.1), 100.0)


WITHOUT_FARTHEST = {
    "ellipsoid": placed(surfaces.ellipsoid(35, 25, 20, 0.6, 0.5)),
    "ellipsoid at the origin": placed(shifted(surfaces.ellipsoid(35, 25, 20, 0.6, 0.5))),
    "torus": placed(surfaces.torus(40, 20, 0.6)),
    "neck": placed(surfaces.bottle_neck()),
    "dented": placed(dented()),
    "hull": on_hull(),
    "plate": (solids.block(1.0, 0.8, 0.01), (0.05, 0.03, 0.01), UP),
    "disk": (Bowl(surfaces.plane()), np.zeros(3), UP),
    "bowl": (Bowl(surfaces.quartic()), np.zeros(3), UP),
}


@pytest.mark.parametrize(
    ("name", "planes"),
    [*((name, surfaces.UPRIGHT) for name in WITHOUT_FARTHEST), ("torus", surfaces.TILTED)],
)
def test_the_unit_of_length_does_not_matter_where_curves_end_by_themselves(name, planes):
    surface, point, normal = WITHOUT_FARTHEST[name]

    def numbers(factor):
        found = core.explore(Scaled(surface, factor), factor * np.array(point), normal, planes)
        r = found.result
        lengths = np.array([found.extent, found.step, r.radius, r.mean_height_std]) / factor
        return r, [*lengths, r.radius * r.k1, r.radius * r.k2], [len(c.points) for c in found.contours]

    r, one, counts = numbers(1.0)
    assert 0.0 < r.radius < 60.0
    for factor in (3.7, 1e-9, 1e-3, 1e6, 1e12):
        other, scaled, same_counts = numbers(factor)
        assert scaled == pytest.approx(one, rel=1e-6, abs=1e-8)
        assert (other.status, other.message, same_counts) == (r.status, r.message, counts)


def test_a_surface_without_an_end_asks_how_far_to_feel():
    said = "The curves do not end by themselves: set farthest, the greatest length"
    for factor in (1e-9, 1.0, 1e12):
        with pytest.raises(ValueError, match=said):
            core.explore(Scaled(surfaces.plane(), factor), (0.3 * factor, 0.0, 0.0), UP)


@pytest.mark.parametrize("count", [3, 5])
def test_planes_may_be_a_number_of_evenly_laid_out_ones(count):
    ball = surfaces.sphere(20.0)
    planes = [core.SamplingPlane(np.pi * i / count) for i in range(count)]
    counted, given = (explore(ball, ball.point, ball.normal, planes=p) for p in (count, planes))
    assert counted.planes == tuple(planes)
    assert counted.result.patch.k1 == given.result.patch.k1


def test_an_azimuth_may_be_an_array_without_dimensions():
    planes = [core.SamplingPlane(np.array(plane.azimuth)) for plane in PLANES]
    assert explore(surfaces.plane(), planes=planes).result.status == "ok"


@pytest.mark.parametrize("planes", [2, 25, 0, []])
def test_too_few_or_too_many_planes_are_refused(planes):
    with pytest.raises(ValueError, match="planes: expected 3 to 24, or sampling planes, got"):
        explore(surfaces.plane(), planes=planes)


@pytest.mark.parametrize("rays", [3, 40])
def test_a_surface_that_stops_answering_is_reported_in_a_sentence(rays):
    class Tiring:
        left = rays

        def ray_cast(self, *ray):
            self.left -= 1
            return surfaces.sphere(20.0).ray_cast(*ray) if self.left >= 0 else None

    ball = surfaces.sphere(20.0)
    with pytest.raises(ValueError, match="All curves end at once, however short they are"):
        core.explore(Tiring(), ball.point, ball.normal)


def test_six_planes_are_the_most_unless_more_are_wanted(monkeypatch):
    s = surfaces.torus(40, 20, 0.6)
    monkeypatch.setattr(extent, "HELPS", -1.0)
    given = {"extent": 6.0, "step": 0.5, "tolerance": 0.0, "noise": 0.05, "rng": 0}
    assert len(core.explore(s, s.point, s.normal, **given).planes) == 6
    assert len(core.explore_many(s, [s.point], [s.normal], **given)[0].planes) == 6
    assert len(core.explore(s, s.point, s.normal, most_planes=4, **given).planes) == 4


def test_a_deviation_that_is_large_enough_ends_growth():
    """Half curves end sooner where the patch is to be known better."""
    place = surfaces.sphere(30.0)
    wide, narrow = (
        core.explore(place, place.point, place.normal, farthest=24.0, largest_std=std, noise=0.02, rng=0)
        for std in (0.2, 0.02)
    )
    assert narrow.extent < wide.extent
    assert narrow.result.mean_height_std < wide.result.mean_height_std
    with pytest.raises(ValueError, match="largest_std: expected a finite number above 0"):
        core.explore(place, place.point, place.normal, largest_std=0.0)


@pytest.mark.parametrize(("high", "long", "std", "extent"), [(0.15, 6.0, 0.1, 2.5), (0.15, 10.0, 0.03, 2.5)])
def test_where_a_deviation_is_requested_half_curves_that_begin_short_grow(high, long, std, extent):
    k = 2.0 * np.pi / long
    waves = surfaces.Exact(
        lambda x, y, z: z - high * np.sin(k * x) * np.cos(k * y),
        lambda p: np.array(
            [
                -high * k * np.cos(k * p[0]) * np.cos(k * p[1]),
                high * k * np.sin(k * p[0]) * np.sin(k * p[1]),
                1.0,
            ]
        ),
        np.zeros(3),
        0.0,
        0.0,
    )
    found = explore(waves, largest_std=std)
    assert found.extent > extent
    assert found.result.mean_height_std < std


@pytest.mark.parametrize("farthest", [None, 10.0])
def test_the_error_of_a_surface_itself_is_raised(farthest):
    class Broken:
        def ray_cast(self, origin, direction, distance):
            raise ValueError("the sensor is off")

    with pytest.raises(ValueError, match="the sensor is off"):
        core.explore(Broken(), (0.0, 0.0, 0.0), UP, farthest=farthest)


@pytest.mark.parametrize("lengths", [{"extent": 1.0, "step": 0.1}, {"extent": 1.0}, {}])
def test_what_has_no_rays_is_refused_in_a_sentence(lengths):
    touch = core.track if "step" in lengths else core.explore
    with pytest.raises(ValueError, match="surface: expected an object with the method ray_cast, got <object"):
        touch(object(), (0.0, 0.0, 0.0), UP, PLANES, **lengths)


def test_a_plane_is_added_if_it_takes_a_tenth_off_the_deviation():
    s = surfaces.torus(40, 20, 0.6)
    given = {"extent": 6.0, "step": 0.5, "tolerance": 0.0, "most_planes": 12, "noise": 0.05, "rng": 0}
    found = core.explore(s, s.point, s.normal, **given)
    assert 3 < len(found.planes) < 12
    outward, tangent = s.normal, core.SamplingPlane(0.0).axes(s.normal, None)[:, 0]
    before = core.reconstruct(s.point, found.contours[:-1], outward=outward)
    assert core.suggest_plane(before, outward, tangent)[1] <= 0.9 * found.stds[-2]
    assert core.suggest_plane(found.result, outward, tangent)[1] > 0.9 * found.stds[-1]


def test_the_length_at_which_curves_end_is_found_to_a_64th():
    ball = surfaces.sphere(20.0)
    given = ball, tuple(ball.point), tuple(ball.normal)
    found = touches._farthest(*given, PLANES, partial(core.track, *given))
    assert 1.0 <= found / (20.0 * math.radians(75.0)) * 1.002 < 1.0 + 1.0 / 64.0
