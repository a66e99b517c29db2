# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Touches near one with an automatic extent: how long half curves are, and how many fits they take."""

from itertools import pairwise

import numpy as np
import pytest
import surfaces

import core
from core.exploration import nearby
from core.reconstruction.from_contours import fitted

PLANES = [core.SamplingPlane(a) for a in np.radians([0.0, 60.0, 120.0])]
FARTHEST = 30.0


def ribbed(high=3.0, wide=3.0):
    """A paraboloid with a ridge along y, where x is 0."""

    def ridge(x):
        return high * np.exp(-((x / wide) ** 2))

    return surfaces.Exact(
        lambda x, y, z: z + (x * x + y * y) / 80.0 - ridge(x),
        lambda p: np.array([p[0] / 40.0 + 2.0 * p[0] / wide**2 * ridge(p[0]), p[1] / 40.0, 1.0]),
        np.zeros(3),
        0.0,
        0.0,
    )


def places(surface, xs):
    """(point, normal) at each x, where y is 0, of a surface that is a graph."""
    for x in xs:
        point, normal = surface.ray_cast((x, 0.0, 50.0), (0.0, 0.0, -1.0), 100.0)
        yield point, normal


def explore(surface, point, normal, **more):
    return core.explore(surface, point, normal, PLANES, farthest=FARTHEST, **more)


def dragged(surface, xs, reaches, **more):
    """Touches along x, each near the one before."""
    found = []
    for point, normal in places(surface, xs):
        touch, reaches = core.explore_nearby(
            surface, point, normal, PLANES, reaches, farthest=FARTHEST, **more
        )
        found.append(touch)
    return found


def counted(monkeypatch):
    """A list that grows by one with each fit."""
    fits = []
    monkeypatch.setattr(nearby, "fitted", lambda *given: fits.append(1) or fitted(*given))
    return fits


def of_extent(surface, place, found):
    """What is found there with the extent and step of another touch."""
    point, normal = place
    contours = core.track(surface, point, normal, PLANES, extent=found.extent, step=found.step)
    return core.reconstruct(point, contours, outward=normal)


def true_error(surface, r):
    """The mean |dz| over the domain, of a surface whose level is the height above it."""
    points, weights = r.domain.nodes
    world = r.frame.to_world(np.column_stack([points, r.height(*points.T)]))
    return float(weights @ np.abs(surface.level(*world.T)))


def test_over_a_ridge_the_patch_is_sure_all_the_way_with_few_fits(monkeypatch):
    surface, xs = ribbed(), np.linspace(-18.0, 0.0, 13)
    first = explore(surface, *next(places(surface, xs)))
    assert first.result.status == "ok"
    fits = counted(monkeypatch)
    found = dragged(surface, xs[1:], core.reaches_of(first))
    assert [each.result.status for each in found] == ["ok"] * 12
    assert len(fits) < 2 * len(found)
    kept = [of_extent(surface, place, first).status for place in places(surface, xs[1:])]
    assert kept.count("ok") < 9
    assert found[-1].extent < 0.7 * first.extent
    assert all(true_error(surface, each.result) < 3.0 * each.result.mean_height_std for each in found)


def test_beyond_the_ridge_the_patch_becomes_as_large_again():
    surface, xs = ribbed(), np.linspace(0.0, 18.0, 13)
    first = explore(surface, *next(places(surface, xs)))
    found = dragged(surface, xs[1:], core.reaches_of(first))
    assert found[-1].extent > 2.0 * first.extent
    assert max(b.extent / a.extent for a, b in pairwise(found)) < 1.1  # the extent does not flicker


def test_where_nothing_changes_the_patch_stays_and_takes_one_fit(monkeypatch):
    ball = surfaces.sphere(20.0)
    first = explore(ball, ball.point, ball.normal)
    fits, reaches, extents = counted(monkeypatch), core.reaches_of(first), []
    for _ in range(20):
        touch, reaches = core.explore_nearby(
            ball, ball.point, ball.normal, PLANES, reaches, farthest=FARTHEST
        )
        extents.append(touch.extent)
    assert len(fits) == 20
    assert np.ptp(extents[5:]) == 0.0
    assert first.extent <= extents[-1] < 1.5 * first.extent


def test_doubt_that_is_not_for_the_length_of_curves_does_not_make_them_shorter(monkeypatch):
    sheet = surfaces.Exact(
        lambda x, y, z: z - 0.3 * np.sin(2.0 * x) * np.cos(1.5 * y),
        lambda p: np.array(
            [
                -0.6 * np.cos(2.0 * p[0]) * np.cos(1.5 * p[1]),
                0.45 * np.sin(2.0 * p[0]) * np.sin(1.5 * p[1]),
                1.0,
            ]
        ),
        np.zeros(3),
        0.0,
        0.0,
    )
    point, normal = sheet.ray_cast((0.2, 0.1, 5.0), (0.0, 0.0, -1.0), 10.0)
    alike, fits = [core.SamplingPlane(a) for a in np.radians([45.0, 60.0, 120.0])], counted(monkeypatch)
    touch, reaches = core.explore_nearby(sheet, point, normal, alike, np.full((3, 2), 0.6), farthest=1.0)
    assert "principal directions" in touch.result.message
    assert touch.extent == pytest.approx(0.6)
    assert len(fits) == 2
    assert reaches == pytest.approx(np.full((3, 2), 0.6), rel=0.01)


class Step:
    """A plane that ends at a wall where x is 5."""

    def ray_cast(self, origin, direction, distance):
        (x, y, z), (u, v, w) = origin, direction
        hits = []
        if w and x - z / w * u < 5.0:
            hits.append((-z / w, (0.0, 0.0, 1.0)))
        if u and z + (5.0 - x) / u * w > 0.0:
            hits.append(((5.0 - x) / u, (-1.0, 0.0, 0.0)))
        gone, normal = min((hit for hit in hits if 0.0 < hit[0] <= distance), default=(None, None))
        return None if gone is None else ((x + gone * u, y + gone * v, z + gone * w), normal)


def test_a_half_curve_that_a_wall_has_ended_goes_on_where_there_is_none():
    first = explore(Step(), (0.0, 0.0, 0.0), (0.0, 0.0, 1.0))
    assert core.CREASE in {stop for contour in first.contours for stop in contour.stops}
    reaches = core.reaches_of(first)
    assert np.all(reaches == first.extent)
    touch, _ = core.explore_nearby(
        Step(), (-20.0, 0.0, 0.0), (0.0, 0.0, 1.0), PLANES, 0.5 * reaches, farthest=FARTHEST
    )
    ends = [np.linalg.norm(c.points[[0, -1]] - (-20.0, 0.0, 0.0), axis=1) for c in touch.contours]
    assert np.ptp(ends) < touch.step


@pytest.mark.parametrize("more", [{"method": "tagc", "degree": 4}, {"noise": 0.02, "rng": 1}, {"step": 0.5}])
def test_the_fit_is_the_one_that_is_asked_for(more):
    surface = ribbed()
    place = next(places(surface, [-20.0]))
    reaches = np.full((3, 2), 8.0)
    touch, _ = core.explore_nearby(surface, *place, PLANES, reaches, farthest=FARTHEST, **more)
    fit = {name: more[name] for name in ("method", "degree") if name in more}
    expected = core.reconstruct(place[0], touch.contours, outward=place[1], **fit)
    assert np.array_equal(touch.result.patch.coefficients, expected.patch.coefficients)
    assert touch.result.status == expected.status
    assert touch.step == more.get("step", touch.step)
    assert touch.extent == pytest.approx(8.0, rel=0.1)


def test_it_is_as_long_as_it_may_be_and_no_shorter_than_can_be_fitted():
    plane, up = surfaces.plane(), (0.0, 0.0, 1.0)
    for wanted, extent in ((1e9, FARTHEST), (0.0, FARTHEST / 32), (-1.0, FARTHEST / 32)):
        touch, _ = core.explore_nearby(
            plane, np.zeros(3), up, PLANES, np.full((3, 2), wanted), farthest=FARTHEST
        )
        assert touch.extent == pytest.approx(extent)
        assert touch.result.status == "ok"


@pytest.mark.parametrize("reaches", [np.ones((2, 2)), np.full((3, 2), np.nan), "far"])
def test_reaches_that_are_none_are_refused(reaches):
    with pytest.raises(ValueError, match="reaches"):
        core.explore_nearby(
            surfaces.plane(), np.zeros(3), (0.0, 0.0, 1.0), PLANES, reaches, farthest=FARTHEST
        )


def test_where_curves_of_these_lengths_cannot_be_fitted_the_touch_begins_anew():
    """Beside the apex of a cone all curves end at once, unless their steps are short."""
    cone = surfaces.Exact(
        lambda x, y, z: z + 1.5 * np.hypot(x, y),
        lambda p: np.array([*1.5 * p[:2] / np.hypot(*p[:2]), 1.0]),
        np.zeros(3),
        0.0,
        0.0,
    )
    ((point, normal),) = places(cone, [0.3])
    anew = explore(cone, point, normal)
    touch, reaches = core.explore_nearby(
        cone, point, normal, PLANES, np.full((3, 2), FARTHEST), farthest=FARTHEST
    )
    assert touch.extent == pytest.approx(anew.extent)
    assert reaches == pytest.approx(core.reaches_of(anew))


@pytest.mark.parametrize("planes", [[], None, 2])
def test_planes_that_are_none_are_refused(planes):
    ball = surfaces.sphere(20.0)
    with pytest.raises(ValueError, match="planes: expected "):
        core.explore_nearby(ball, ball.point, ball.normal, planes, np.ones((3, 2)), farthest=FARTHEST)
