# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Where patches end as a finger feels them: walls at edges and holes, curved surfaces where curves end."""

import math

import numpy as np
import pytest

import core
from core.atlas.charts import AZIMUTHS
from core.atlas.finger import Finger
from core.atlas.rims import radial_extent
from tests import solids

NEAR, TURNS = 0.02, 2.0 * np.pi * np.arange(AZIMUTHS) / AZIMUTHS
RAYS = np.stack([np.cos(TURNS), np.sin(TURNS)], axis=1)


class Pierced(solids.Convex):
    """A block with a hole of a radius of .15 along z, whose walls answer no ray."""

    def ray_cast(self, origin, direction, distance):
        hit = super().ray_cast(origin, direction, distance)
        return hit if hit is None or math.hypot(hit[0][0] - 0.5, hit[0][1]) > 0.15 else None


def rim_of(solid, extent=0.35, near=NEAR):
    """The patch at the start of a solid, and its rim there, (AZIMUTHS, 2), as long as it is."""
    r = core.explore(solid, solid.start, solid.outward, extent=extent, rng=0).result
    return r, r.radius * radial_extent(r, Finger(solid, 1.0), near)[:, None] * RAYS


def area(rim):
    x, y = rim.T
    return 0.5 * np.abs(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)))


def test_a_touch_of_a_flat_face_goes_on_to_its_edges_and_corners():
    block = solids.block(0.6, 0.5, 0.5)
    r, rim = rim_of(block)
    points = r.frame.to_world(np.column_stack([rim, np.zeros(AZIMUTHS)]))
    assert (np.abs(points[:, :2]) <= np.array([0.6, 0.5]) + 1e-3).all()
    assert area(rim) > 0.97 * 1.2
    assert r.domain.area < 0.5 * 1.2


def test_a_patch_beside_an_edge_does_not_reach_beyond_it():
    """The point is 3e-3 beside the edge, and the patch is .6 long."""
    block = solids.block(0.6, 0.5, 0.5)
    block = solids.Convex(block.distance, (0.597, 0.0, 0.5), (0.0, 0.0, 1.0), block.walls)
    r, rim = rim_of(block, extent=0.6)
    points = r.frame.to_world(np.column_stack([rim, np.zeros(AZIMUTHS)]))
    assert points[:, 0].max() < 0.6 + 1e-3
    assert points[:, 0].min() < 0.0


def test_where_there_is_a_hole_a_patch_ends_before_it():
    block = Pierced(solids.block().distance, (-0.1, 0.0, 0.5), (0.0, 0.0, 1.0), solids.block().walls)
    r, rim = rim_of(block, extent=0.42)
    points = r.frame.to_world(np.column_stack([rim, np.zeros(AZIMUTHS)]))
    toward = np.abs(points[:, 1]) < 0.1 * (points[:, 0] + 0.1)
    assert toward.sum() >= 3
    assert points[toward, 0] == pytest.approx(0.36, abs=0.02)
    assert np.hypot(points[:, 0], points[:, 1]).max() > 0.7


def test_on_a_ball_a_patch_ends_where_its_curves_do():
    r, rim = rim_of(solids.ball(), near=2e-3)
    assert np.linalg.norm(rim, axis=1) == pytest.approx(r.domain.radii(AZIMUTHS))


def test_off_the_surface_a_patch_has_no_rim():
    r = core.explore(solids.ball(), (0.0, 0.0, 1.0), (0.0, 0.0, 1.0), extent=0.35, rng=0).result
    assert (radial_extent(r, Finger(solids.ball(1.1), 1.0), NEAR) == 0.0).all()


def test_a_rim_turns_and_grows_with_the_object():
    block = solids.block(0.6, 0.5, 0.5)
    _, rim = rim_of(block)
    _, again = rim_of(block.placed(3.0), extent=1.05, near=3.0 * NEAR)
    assert area(again) == pytest.approx(9.0 * area(rim), rel=1e-6)
