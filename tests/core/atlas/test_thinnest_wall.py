# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""How thin the walls of an object are, by rays across them."""

import numpy as np
import pytest

import core
from tests import solids

AROUND = np.random.default_rng(0).normal(size=(200, 3))
AROUND /= np.linalg.norm(AROUND, axis=1, keepdims=True)


def on_block(size, count):
    """Points (count, 3) all over a block that reaches so far (3,) from its middle, and the normals there."""
    rng, size = np.random.default_rng(0), np.array(size)
    axes = rng.choice(3, count, p=(1.0 / size) / (1.0 / size).sum())
    normals = np.eye(3)[axes] * rng.choice([-1.0, 1.0], count)[:, None]
    return size * np.where(normals != 0.0, normals, rng.uniform(-0.95, 0.95, (count, 3))), normals


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
