# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Where touches go on: beyond rims, elsewhere after one in vain, never inward; and what is left uncovered."""

from dataclasses import replace

import numpy as np
import pytest

import core
from core.atlas import touching
from core.atlas.frontier import TRIES, Frontier, _between
from core.contours.finger import Finger
from core.exploration.side_by_side import result_of
from tests import solids

BALL = solids.ball()


@pytest.fixture
def first():
    """A patch on the ball."""
    return core.explore(BALL, BALL.start, BALL.outward, farthest=0.5, rng=0).result


@pytest.fixture
def frontier(first):
    found = Frontier(Finger(BALL, 1.0))
    found.add(first)
    return found


def test_places_at_once_have_the_touches_of_each_alone(frontier):
    places = [place for _, _, place in frontier.queue]
    together = frontier.beyond(places)
    alone = [frontier.beyond([place])[0] for place in places]
    assert len(places) == 24
    for a, b in zip(together, alone, strict=True):
        assert a.gain == b.gain > 0.0
        assert (a.point == b.point).all()
        assert abs(BALL.distances(a.point[None])[0]) < 1e-9
        assert a.outward == pytest.approx(a.point, abs=1e-6)


def test_after_a_touch_in_vain_the_next_is_elsewhere(frontier):
    place = frontier.queue[0][2]
    (touch,) = frontier.beyond([place])
    frontier.tried(touch)
    again = frontier.queue[np.argmax([len(p.tried) for _, _, p in frontier.queue])][2]
    assert again.tried == (tuple(touch.point),)
    (other,) = frontier.beyond([again])
    assert other.gain == touch.gain
    assert np.linalg.norm(other.point - touch.point) > 0.2 * place.radius


@pytest.mark.parametrize("unit", [1e-6, 1.0, 1e6])
@pytest.mark.parametrize("rounding", [1e-12, -1e-12])
def test_of_contacts_that_are_equally_far_but_for_rounding_the_first_is_next(unit, rounding):
    """Here these are two with any mean, and two on either side of a touch in vain."""
    two = unit * np.array([[-1.0, 0.0, 0.0], [1.0 + rounding, 0.0, 0.0]])
    nearer = unit * np.array([[0.0, 0.5, 0.0]])
    assert _between(two, ()) == 0
    assert _between(np.vstack([nearer, two]), [(0.0, 0.0, 0.0)]) == 1
    assert _between(np.vstack([two, nearer]), ()) == 2


@pytest.mark.parametrize("unit", [1e-6, 1.0, 1e6])
def test_of_places_that_bring_as_much_but_for_rounding_the_first_is_next(frontier, unit):
    places = [place for _, _, place in frontier.queue[:3]]
    frontier.queue = []
    for place, times in zip(places, (1.0, 1.0 + 1e-12, 1.0 + 1e-6), strict=True):
        frontier.push(place, unit * times * np.pi / 3.0)
    assert [place for _, _, place in sorted(frontier.queue)] == [places[2], *places[:2]]


def test_nothing_goes_on_from_a_narrow_patch(first):
    found = Frontier(Finger(BALL, 1.0))
    found.add(first, goes_on=False)
    assert not found.queue
    assert len(found.charts.radii) == 1


def test_what_is_less_than_a_touch_has_to_bring_is_left(frontier):
    place = frontier.queue[0][2]
    (touch,) = frontier.beyond([place])
    frontier.least = 1.01 * np.pi * place.radius**2
    assert touch.gain < frontier.least
    assert frontier.beyond([place]) == [None]


def test_places_of_touches_in_vain_are_uncovered_where_the_object_goes_on(frontier, first):
    place = frontier.queue[0][2]
    frontier.queue = [(-1.0, 0, replace(place, tried=(place.point,) * TRIES))]
    assert result_of(frontier.taking(4)) == []
    assert len(result_of(frontier.uncovered(frontier.charts))) == 1
    frontier.finger = Finger(Nothing(), 1.0)
    assert result_of(frontier.uncovered(frontier.charts)) == []


class Nothing:
    """No surface at all."""

    def ray_cast(self, origin, direction, distance):
        return None


def test_a_patch_that_faces_inward_is_no_touch(monkeypatch):
    """A fit at an edge may turn over to the other side; here each one but the first does."""

    def turned(surface, points, outward, **options):
        found = yield from exploring(surface, points, -np.asarray(outward), **options)
        return found

    exploring = touching.exploring
    monkeypatch.setattr(touching, "exploring", turned)
    atlas = core.explore_object(BALL, BALL.start, BALL.outward, tolerance=1e-2, most=9, rng=0)
    assert len(atlas.patches) == 1
    assert atlas.status == "uncertain"
