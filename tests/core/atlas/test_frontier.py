# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Where touches go on: beyond rims, elsewhere after one in vain, never inward; and what is left uncovered."""

from types import SimpleNamespace

import numpy as np
import pytest

import core
from core.atlas import touching
from core.atlas.charts import AZIMUTHS
from core.atlas.finger import Finger
from core.atlas.frontier import Frontier, _between, border_places
from core.atlas.meshing import Mesh
from core.atlas.reference_mesh import ReferenceMesh
from core.steps import result_of
from tests import solids

BALL, NEAR = solids.ball(), 0.03


@pytest.fixture
def first():
    """A patch on the ball."""
    return core.explore(BALL, BALL.start, BALL.outward, farthest=0.5, rng=0).result


@pytest.fixture
def frontier(first):
    found = Frontier(Finger(BALL, 1.0), NEAR)
    assert found.add(first)
    return found


def test_places_at_once_have_the_touches_of_single_places(frontier):
    places = [place for _, _, place in frontier.queue]
    together = frontier.beyond(places)
    singles = [frontier.beyond([place])[0] for place in places]
    assert len(places) == 24
    for a, b in zip(together, singles, strict=True):
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


def test_nothing_goes_on_from_a_narrow_patch_and_one_that_is_not_felt_is_left_out(first):
    found, radius = Frontier(Finger(BALL, 1.0), NEAR), first.radius
    assert found.add(first, goes_on=2.0 * radius)
    assert not found.queue
    assert len(found.charts.radii) == len(found.taps) == 1
    found.finger = Finger(SimpleNamespace(ray_cast=lambda *_: None), 1.0)
    assert not found.add(first)
    assert len(found.charts.radii) == len(found.taps) == 1


class Slab:
    """The top of a plate, which ends at x = EDGE and has a notch where y > .2 + |x - .1|."""

    def ray_cast(self, origin, direction, distance):
        if direction[2] >= 0.0:
            return None
        way = -origin[2] / direction[2]
        x, y = (o + way * d for o, d in zip(origin[:2], direction[:2], strict=True))
        ends = x > EDGE or y > 0.2 + abs(x - 0.1)
        return None if ends or not 0.0 < way <= distance else ((x, y, 0.0), (0.0, 0.0, 1.0))


EDGE = 0.3


def test_a_patch_ends_where_the_finger_feels_that_the_surface_does():
    """Curves end a step before a crease, and the domain between their ends bulges beyond it."""
    touch = core.explore(Slab(), (0.0, 0.0, 0.0), (0.0, 0.0, 1.0), extent=0.5, step=0.02, rng=0)
    found = Frontier(Finger(Slab(), 1.0), NEAR)
    assert found.add(touch.result)
    charts = found.charts
    x, y = charts.rim_at(np.arange(AZIMUTHS))
    points, _ = charts.world(np.zeros(AZIMUTHS, dtype=int), x, y)
    ends, notch = points[:, 0] - EDGE, (points[:, 1] - 0.2 - np.abs(points[:, 0] - 0.1)) / np.sqrt(2.0)
    assert max(ends.max(), notch.max()) < 0.02
    near = np.abs(np.degrees(np.arctan2(points[:, 1], points[:, 0])) + 10.0) < 30.0
    assert near.sum() > 10
    # A domain that ends far before the border stays as it is.
    assert np.median(np.abs(ends[near])) < 0.003


def test_contacts_between_curves_are_on_the_surface_and_have_the_noise(first):
    found = Frontier(Finger(BALL, 1.0), NEAR, noise=2e-3, rng=np.random.default_rng(0))
    found.add(first)
    (taps,) = found.taps
    off = np.linalg.norm(taps.points, axis=1) - 1.0
    assert len(off) == 36
    assert np.std(off) == pytest.approx(2e-3, rel=0.3)
    assert np.abs(np.linalg.norm(taps.normals, axis=1) - 1.0).max() < 1e-9


def test_what_is_less_than_a_touch_has_to_bring_is_left(frontier):
    place = frontier.queue[0][2]
    (touch,) = frontier.beyond([place])
    frontier.least = 1.01 * np.pi * place.radius**2
    assert touch.gain < frontier.least
    assert frontier.beyond([place]) == [None]


class Nothing:
    """No surface at all."""

    def ray_cast(self, origin, direction, distance):
        return None


def cap(height):
    """The part of the unit ball above a height, as an open mesh."""
    turns, levels = (
        np.linspace(0.0, 2.0 * np.pi, 48, endpoint=False),
        np.linspace(0.0, np.arccos(height), 13)[1:],
    )
    rings = [
        np.stack([np.sin(t) * np.cos(turns), np.sin(t) * np.sin(turns), np.cos(t) + 0 * turns], 1)
        for t in levels
    ]
    points = np.vstack([[[0.0, 0.0, 1.0]], *rings])
    a = np.arange(48)
    b = np.roll(a, -1)
    fans = [np.column_stack([np.zeros_like(a), 1 + a, 1 + b])]
    for k in range(len(levels) - 1):
        inner, outer = 1 + 48 * k, 1 + 48 * (k + 1)
        fans += [
            np.column_stack([inner + a, outer + a, outer + b]),
            np.column_stack([inner + a, outer + b, inner + b]),
        ]
    count = len(points)
    return Mesh(points, np.vstack(fans), np.zeros(count), np.zeros(count, dtype=int))


def test_beyond_a_border_the_object_goes_on_unless_it_ends_there(frontier):
    reference = ReferenceMesh(cap(0.2), None)
    found = result_of(frontier.uncovered(reference))
    assert len(found) > 4
    for place, (point, normal) in found:
        assert abs(place.point[2] - 0.2) < 0.02
        assert point[2] < place.point[2]
        assert point == pytest.approx(normal, abs=1e-6)
    frontier.finger = Finger(Nothing(), 1.0)
    assert result_of(frontier.uncovered(reference)) == []


def test_a_patch_that_faces_inward_is_no_touch(monkeypatch):
    """A fit at an edge may turn over to the other side; here each one but the first does."""

    def turned(surface, points, outward, options):
        sign = 1.0 if np.array_equal(points, [BALL.start]) else -1.0
        found = yield from exploring_many(surface, points, sign * np.asarray(outward), options)
        return found

    exploring_many = touching.exploring_many
    monkeypatch.setattr(touching, "exploring_many", turned)
    atlas = core.explore_object(BALL, BALL.start, BALL.outward, tolerance=1e-2, most=9, rng=0)
    assert len(atlas.patches) == 1
    assert atlas.status == "uncertain"


def test_no_place_on_a_border_is_at_triangles_without_an_area():
    corners = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], *3 * [[5.0, 5.0, 0.0]]])
    triangles = np.array([[0, 1, 2], [3, 4, 5]])
    mesh = Mesh(corners, triangles, np.zeros(6), np.zeros(6, dtype=np.intp))
    places = list(border_places(mesh))
    assert places
    for place in places:
        assert np.linalg.norm(place.normal) == pytest.approx(1.0)
        assert np.linalg.norm(place.ahead) == pytest.approx(1.0)
