# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""How many touches an object is expected to take, compared with how many it takes."""

import numpy as np
import pytest

import core
from tests import solids

AROUND = np.random.default_rng(0).normal(size=(200, 3))
AROUND /= np.linalg.norm(AROUND, axis=1, keepdims=True)


def expected(**options):
    options = {"tolerance": 4e-3, "rng": 0} | options
    return core.expected_touches(solids.ball(), AROUND, AROUND, 4.0 * np.pi, **options)


def on_block(size, count):
    """Points (count, 3) all over a block that reaches so far (3,) from its middle, and the normals there."""
    rng, size = np.random.default_rng(0), np.array(size)
    axes = rng.choice(3, count, p=(1.0 / size) / (1.0 / size).sum())
    normals = np.eye(3)[axes] * rng.choice([-1.0, 1.0], count)[:, None]
    return size * np.where(normals != 0.0, normals, rng.uniform(-0.95, 0.95, (count, 3))), normals


@pytest.mark.long
def test_it_is_about_as_many_as_there_are():
    ball = solids.ball()
    made = []
    core.explore_object(
        ball,
        ball.start,
        ball.outward,
        tolerance=4e-3,
        rng=0,
        progress=lambda done, _: (made.append(done), True)[1],
    )
    assert 0.5 < expected()[0] / made[-1] < 2.0


def test_finer_tolerances_take_more_touches():
    assert expected(tolerance=1e-3)[0] > 1.5 * expected()[0]


def test_a_flat_wall_counts_as_far_as_it_is_felt():
    block = solids.block(0.6, 0.5, 0.5)
    points, normals = on_block((0.6, 0.5, 0.5), 200)
    touches, tried, patches = core.expected_touches(block, points, normals, 6.8, tolerance=4e-3, rng=0)
    assert 6.0 <= touches < 10.0  # Most touches feel all of a face.
    assert len(patches) <= tried <= 12


def test_the_narrow_walls_of_a_plate_are_not_covered_by_its_wide_ones():
    """They are thinner than the length within which a place is felt."""
    plate = solids.block(0.5, 0.5, 0.005)
    points, normals = on_block((0.5, 0.5, 0.005), 1000)
    wide = np.abs(normals[:, 2]) > 0.5
    narrow = int((~wide).sum())
    touches, tried, _ = core.expected_touches(plate, points, normals, 2.04, tolerance=4e-3, rng=0)
    faces, _, _ = core.expected_touches(plate, points[wide], normals[wide], 2.0, tolerance=4e-3, rng=0)
    assert narrow > 8
    assert touches > faces + 4.0
    assert tried == 12


def test_walls_are_as_thick_as_from_side_to_side():
    ball, plate = solids.ball(), solids.block(0.5, 0.5, 0.005)
    assert core.thinnest_wall(ball, AROUND, AROUND, 2.5) == pytest.approx(2.0, rel=1e-6)
    assert core.thinnest_wall(ball, AROUND, AROUND, 1.5) == np.inf  # Nothing is met within this size.
    points, normals = on_block((0.5, 0.5, 0.005), 1000)
    assert core.thinnest_wall(plate, points, normals, 1.0) == pytest.approx(0.01, rel=1e-6)
    narrow = np.abs(normals[:, 2]) < 0.5
    assert core.thinnest_wall(plate, points[narrow], normals[narrow], 1.1) == pytest.approx(1.0, rel=1e-6)
    assert core.thinnest_wall(plate, points[narrow], normals[narrow], 0.9) == np.inf
    with pytest.raises(ValueError, match="size: expected a finite number above 0, got 0"):
        core.thinnest_wall(plate, points, normals, 0.0)
    with pytest.raises(ValueError, match=r"outward: expected shape \(1000, 3\), got \(999, 3\)"):
        core.thinnest_wall(plate, points, normals[1:], 1.0)
    with pytest.raises(ValueError, match="points: expected one or more, got none"):
        core.thinnest_wall(plate, points[:0], normals[:0], 1.0)


def test_very_few_places_do_not_make_a_wall_thin():
    """As beside an edge, where rays meet the next wall."""

    class Stairs:
        """Two sheets that are .1 apart where x is below a place, and 1 apart elsewhere."""

        def __init__(self, step):
            self.step = step

        def ray_cast(self, origin, direction, distance):
            gap = 0.1 if origin[0] < self.step else 1.0
            return np.add(origin, (0.0, 0.0, -gap - origin[2])), np.array([0.0, 0.0, -1.0])

    x = np.linspace(0.0, 1.0, 1000, endpoint=False)
    points, up = np.column_stack([x, 0.0 * x, 0.0 * x]), np.tile([0.0, 0.0, 1.0], (1000, 1))
    assert core.thinnest_wall(Stairs(0.002), points, up, 2.0) == pytest.approx(1.0)
    assert core.thinnest_wall(Stairs(0.01), points, up, 2.0) == pytest.approx(0.1)


def test_a_wedge_has_no_thickness():
    """Its sides do not face opposite ways."""

    class Wedge:
        """A ray inward meets a side that leans by 45 degrees."""

        def ray_cast(self, origin, direction, distance):
            return np.add(origin, 0.1 * np.array(direction)), np.array([np.sqrt(0.5), 0.0, np.sqrt(0.5)])

    assert core.thinnest_wall(Wedge(), [(0.0, 0.0, 0.0)], [(0.0, 0.0, -1.0)], 1.0) == np.inf


def test_it_is_refused_where_no_patch_can_be_felt():
    with pytest.raises(ValueError, match="points: expected some where a patch can be felt, got none"):
        core.expected_touches(solids.ball(), [(0, 0, 3.0)], [(0, 0, 1.0)], 1.0, tolerance=4e-3)
    with pytest.raises(ValueError, match="area: expected a finite number above 0, got 0"):
        core.expected_touches(solids.ball(), AROUND, AROUND, 0.0, tolerance=4e-3)
    with pytest.raises(ValueError, match="outward: expected"):
        core.expected_touches(solids.ball(), AROUND, 0.0 * AROUND, 1.0, tolerance=4e-3)


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
