# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""How many touches an object is expected to take, compared with how many it takes."""

import numpy as np
import pytest

import core
from tests import solids

AROUND = np.array([(0, 0, 1), (0, 0, -1), (1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0)], dtype=float)


def expected(**options):
    options = {"tolerance": 4e-3, "rng": 0} | options
    return core.expected_touches(solids.ball(), AROUND, AROUND, 4.0 * np.pi, **options)


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
    assert 0.5 < expected() / made[-1] < 2.0


def test_finer_tolerances_take_more_touches():
    assert expected(tolerance=1e-3) > 1.5 * expected()


def test_a_flat_wall_counts_as_far_as_it_is_felt():
    block = solids.block(0.6, 0.5, 0.5)
    top = core.expected_touches(block, [block.start], [block.outward], 1.2, tolerance=4e-3, rng=0)
    assert 1.0 <= top < 3.0  # The touch feels all of the face.


def test_where_no_patch_can_be_felt_it_is_refused():
    with pytest.raises(ValueError, match="points: expected some where a patch can be felt, got none"):
        core.expected_touches(solids.ball(), [(0, 0, 3.0)], [(0, 0, 1.0)], 1.0, tolerance=4e-3)
    with pytest.raises(ValueError, match="area: expected a finite number above 0, got 0"):
        core.expected_touches(solids.ball(), AROUND, AROUND, 0.0, tolerance=4e-3)


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
