# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Taps between the curves: what no curve crosses is noticed, and where all is well nothing changes."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest
import surfaces

import core
from core.contours.contour import UNEXPLAINED
from core.exploration import extent
from core.exploration.extent import TAPS_OFF
from core.exploration.taps import layer_height, places
from core.reconstruction.status import DOUBTFUL_GAP, Taps

FARTHEST = 30.0
UP = (0.0, 0.0, 1.0)


class Sector:
    """A plane that lacks a sector between two radii, which no curve crosses; there may be a floor instead."""

    def __init__(self, floor, nearest=3.0, farthest=math.inf, azimuths=(15.0, 45.0)):
        self.floor, self.radii, self.azimuths = floor, (nearest, farthest), np.radians(azimuths)

    def lacks(self, x, y):
        first, last = self.azimuths
        return (
            (self.radii[0] < np.hypot(x, y)) & (np.hypot(x, y) < self.radii[1])
            & (first < np.arctan2(y, x)) & (np.arctan2(y, x) < last)
        )  # fmt: skip

    def ray_cast(self, origin, direction, distance):
        for level in (0.0, self.floor):
            if level is None or abs(direction[2]) < 1e-9:
                continue
            gone = (level - origin[2]) / direction[2]
            x, y = (o + gone * d for o, d in zip(origin[:2], direction[:2], strict=True))
            if 0.0 <= gone <= distance and (level == 0.0) != self.lacks(x, y):
                return (x, y, level), UP
        return None


def explore(surface, point=(0.0, 0.0, 0.0), outward=UP, **more):
    return core.explore(surface, point, outward, farthest=FARTHEST, **more)


def mean_error(surface, r):
    """The mean |dz| over the domain, against the plane and, where it is missing, against the floor."""
    points, weights = r.domain.nodes
    x, y, z = r.frame.to_world(np.column_stack([points, r.height(*points.T)])).T
    return weights @ np.abs(z - np.where(surface.lacks(x, y), surface.floor, 0.0))


@pytest.mark.parametrize("noise", [0.0, 0.05])
@pytest.mark.parametrize("floor", [-4.0, 2.5])
def test_curves_become_shorter_near_an_edge_that_none_crosses(floor, noise):
    """The edge of the plane begins 3 from the point, and curves run along both sides of it."""
    surface = Sector(floor)
    r = explore(surface, noise=noise, rng=0).result
    assert (r.status, r.taps.off) == ("ok", 0.0)
    assert mean_error(surface, r) < 3.0 * r.mean_height_std
    assert not surface.lacks(
        *r.frame.to_world(np.column_stack([places(r.domain), 0.0 * places(r.domain)[:, 0]])).T[:2]
    ).any()
    assert r.radius > 3.0


def test_an_edge_next_to_the_point_leaves_the_touch_in_doubt():
    surface = Sector(-4.0, nearest=0.5)
    r = explore(surface, extent=FARTHEST).result
    assert r.status == "uncertain"
    assert r.message.startswith(
        "Between the curves the surface is up to 13 % of the radius off the patch, perhaps at an edge or a "
        "pocket that no curve crosses: use a shorter extent or add sampling planes."
    )
    assert pytest.approx(r.taps.off * r.radius, rel=1e-3) == 4.0
    assert mean_error(surface, r) > 3.0 * r.mean_height_std
    assert explore(surface).result.status == "ok"


@pytest.mark.parametrize("nearest", [3.0, 6.0, 10.0])
def test_curves_become_shorter_beside_a_hole_that_none_crosses(nearest):
    surface = Sector(None, nearest=nearest, azimuths=(2.0, 58.0))
    r = explore(surface).result
    assert (r.status, r.taps.off) == ("ok", 0.0)
    assert share_lacking(surface, r) < DOUBTFUL_GAP
    assert r.radius > nearest


class Washer(Sector):
    """A flat ring."""

    def __init__(self, inner, outer):
        self.floor, self.radii = None, (inner, outer)

    def lacks(self, x, y):
        away = np.hypot(x, y)
        return (away < self.radii[0]) | (away > self.radii[1])


@pytest.mark.parametrize(("away", "azimuth"), [(22.5, 15.0), (26.0, 15.0), (28.0, 30.0), (29.0, 30.0)])
def test_a_sure_patch_spans_no_hole_of_a_washer(away, azimuth):
    surface, turn = Washer(15.0, 30.0), math.radians(azimuth)
    r = explore(surface, (away, 0.0, 0.0), tangent=(math.cos(turn), math.sin(turn), 0.0)).result
    assert r.status == "ok"
    assert share_lacking(surface, r) < 0.02
    assert r.domain.area > 200.0


def share_lacking(surface, r):
    """The share of the domain's area where the surface is lacking."""
    points, _ = r.domain.grid(2000)
    x, y, _ = r.frame.to_world(np.column_stack([points, r.height(*points.T)])).T
    return surface.lacks(x, y).mean()


class Holes(Sector):
    """A plane that lacks a sector between any two curves."""

    def lacks(self, x, y):
        turns = np.degrees(np.arctan2(y, x)) % 60.0
        return (np.hypot(x, y) > self.radii[0]) & (turns > 2.0) & (turns < 58.0)


def test_holes_right_beside_the_point_leave_the_touch_in_doubt():
    r = explore(Holes(None, nearest=0.5), extent=FARTHEST).result
    assert r.status == "uncertain"
    assert r.message.startswith(
        "At 100 % of the patch there is no surface, which ends or has a hole between the curves: use a "
        "shorter extent or add sampling planes. "
    )
    assert f" At {r.taps.missed} of {r.taps.number} taps between the curves there is no surface." in r.message


def test_a_point_on_an_edge_gets_the_advice_to_move_away():
    half = Sector(None, nearest=0.0, azimuths=(0.0, 180.0))
    r = explore(half).result
    assert r.status == "uncertain"
    assert r.message.startswith(
        "The point is so near an edge that taps beside it feel no surface: move the point away from the "
        "edge. "
    )
    assert explore(half, (0.0, -1.0, 0.0)).result.status == "ok"


@pytest.mark.parametrize("away", [1.0, 0.1, 0.01])
def test_beside_an_edge_a_touch_is_so_short_that_its_curves_have_contacts_there(away):
    found = explore(Sector(None, nearest=0.0, azimuths=(0.0, 180.0)), (0.0, -away, 0.0))
    assert found.result.status == "ok"
    assert found.result.taps.missing <= TAPS_OFF
    assert found.extent > 20.0 * away
    assert core.stops_at(found.contours, (0.0, -away, 0.0)) == []
    stops = {stop for contour in found.contours for stop in contour.stops}
    assert stops == {core.EXTENT if found.extent == FARTHEST else UNEXPLAINED, core.NO_CONTACT}


def test_a_touch_is_in_doubt_where_the_surface_is_off_within_its_rim():
    """Only Gauss points are in this pit, and the patch is off by 3.8 times the deviation it expects."""
    pit = Sector(floor=-2.0, nearest=18.0, farthest=22.0)
    longest = core.explore(pit, (0.0, 0.0, 0.0), UP, extent=FARTHEST).result
    assert longest.status == "uncertain"
    assert longest.taps.height == core.tapped(longest, pit).height > 3.0 * longest.mean_height_std
    shorter = explore(pit)
    assert (shorter.result.status, shorter.result.taps.off) == ("ok", 0.0)
    assert 0.25 * FARTHEST < shorter.extent < FARTHEST
    assert core.tapped(shorter.result, pit).height < 1e-6


def test_a_small_hole_is_reported_and_is_no_doubt():
    r = explore(Sector(None, nearest=29.2, farthest=29.8, azimuths=(15.0, 25.0))).result
    assert r.status == "ok"
    assert r.message.startswith("The patch describes its contacts. ")
    assert r.taps.missed > 0
    assert r.taps.missing <= TAPS_OFF
    assert f" At {r.taps.missed} of {r.taps.number} taps between the curves there is no surface." in r.message


@pytest.mark.parametrize("turn", [0.0, 10.0, 20.0, 30.0])
def test_what_three_planes_cannot_show_is_noticed(turn):
    """A monkey saddle is flat in planes through its lines, and between them it is not."""
    s = surfaces.monkey_saddle()
    planes = surfaces.planes((turn, turn + 60.0, turn + 120.0))
    r = core.explore(s, s.point, s.normal, planes, farthest=40.0).result
    local, heights = surfaces.heights_over(s, r)
    off = np.abs(r.height(*local.T) - heights).mean()
    assert r.status != "ok" or off < 5.0 * r.mean_height_std


SMOOTH = [surfaces.pear(), surfaces.sphere(20.0), surfaces.plane(), surfaces.torus(30, 22, 1.1)]


def without_taps(monkeypatch):
    monkeypatch.setattr(extent, "tapped", lambda *_: Taps(96))


@pytest.mark.parametrize("surface", SMOOTH, ids=["pear", "sphere", "plane", "torus"])
@pytest.mark.parametrize("noise", [0.0, 0.05])
def test_where_taps_agree_nothing_changes(surface, noise, monkeypatch):
    given = {"noise": noise, "farthest": 20.0}
    generators = np.random.default_rng(5), np.random.default_rng(5)
    one = core.explore(surface, surface.point, surface.normal, rng=generators[0], **given)
    without_taps(monkeypatch)
    other = core.explore(surface, surface.point, surface.normal, rng=generators[1], **given)
    assert one.result.status == "ok"
    assert one.result.taps[:4] == (96, 0, 0.0, 0.0)
    assert one.result.taps.height == core.tapped(one.result, surface).height
    without = [json.dumps(core.to_dict(replace(r, taps=None))) for r in (one.result, other.result)]
    assert without[0] == without[1]
    assert generators[0].random() == generators[1].random()  # taps draw no noise


def test_a_sheet_is_tapped_from_either_side():
    for floor in (-4.0, None):
        sheet = Sector(floor, azimuths=(-58.0, -2.0))
        found = [explore(sheet, outward=up, tangent=(1.0, 0.0, 0.0)).result for up in (UP, (0.0, 0.0, -1.0))]
        assert [r.status for r in found] == ["ok"] * 2
        assert [r.taps.missing for r in found] == pytest.approx([found[0].taps.missing] * 2, abs=1e-12)
        assert [r.domain.area for r in found] == pytest.approx([found[0].domain.area] * 2)
        assert [(r.taps.missed, r.taps.off) for r in found] == [(found[0].taps.missed, found[0].taps.off)] * 2


@pytest.mark.parametrize(("floor", "nearest"), [(-4.0, 1.5), (None, 10.0)])
def test_many_are_judged_as_each_is(floor, nearest):
    surface = Sector(floor, nearest=nearest)
    points = np.array([[0.0, 0.0, 0.0], [-8.0, 5.0, 0.0], [0.9, 0.2, 0.0]])
    many = core.explore_many(surface, points, [UP] * 3, farthest=FARTHEST)
    for one, point in zip(many, points, strict=True):
        other = explore(surface, point)
        assert (one.result.status, one.result.message) == (other.result.status, other.result.message)
        assert one.result.taps[:2] == other.result.taps[:2]
        assert one.extent == other.extent
        assert one.result.taps.off == pytest.approx(other.result.taps.off, rel=1e-9)


def test_curves_of_a_given_extent_are_tapped_between_but_no_shorter():
    found = explore(Sector(-4.0), extent=20.0)
    assert found.extent == 20.0
    assert found.result.status == "uncertain"
    assert found.result.message.startswith("Between the curves the surface is up to 20 % of the radius off")
    assert replace(found.result, taps=None).status == "ok"


def test_curves_that_grow_up_to_a_length_of_deviation_are_not_tapped_between():
    assert explore(Sector(-4.0), largest_std=0.1).result.taps is None


def test_planes_that_are_added_are_tapped_between():
    r = explore(Sector(-4.0, nearest=0.5), tolerance=0.0).result
    assert r.taps.number > 96


def test_taps_go_with_the_result():
    r = explore(Sector(-4.0, nearest=0.5)).result
    again = core.from_dict(json.loads(json.dumps(core.to_dict(r))))
    assert (again.taps, again.message) == (r.taps, r.message)
    assert r.moved(np.diag([2.0, 2.0, 2.0, 1.0])).message == r.message
    old = core.to_dict(r)
    del old["taps"]["height"]
    assert core.from_dict(old).taps == r.taps._replace(height=None)
    del old["taps"]
    assert core.from_dict(old).taps is None
    assert replace(r, taps=None).status == "ok"


@pytest.mark.parametrize("apart", [0.005, 0.0005])
def test_a_layer_closely_below_another_is_met(apart):
    """A ray goes on a hair's breadth, a ten thousandth of its reach, below the layer that faces down."""

    class Layers:
        def ray_cast(self, origin, direction, distance):
            for height, up in ((apart, -1.0), (0.0, 1.0)):
                if 0.0 <= origin[2] - height <= distance:
                    return (origin[0], origin[1], height), (0.0, 0.0, up)
            return None

    assert layer_height(Layers(), (0.0, 0.0, 0.0), (0.0, 0.0, 1.0), 1.0) == pytest.approx(0.0, abs=1e-12)
