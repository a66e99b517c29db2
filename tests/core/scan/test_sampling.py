# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""How many points of an even spacing there are."""

import numpy as np
import pytest

import core
from core.scan import sampling


@pytest.mark.parametrize("spacing", [0.1, 0.2, 0.4])
def test_the_count_of_spaced_points_is_known_before_they_are_chosen(spacing):
    """Points all over the unit sphere; a disk of the spacing bends away from it by little."""
    rng = np.random.default_rng(0)
    points = rng.normal(size=(60_000, 3))
    points /= np.linalg.norm(points, axis=1, keepdims=True)
    count = sum(index is not None for index in core.spaced(points, spacing, rng))
    assert core.spaced_count(4.0 * np.pi, spacing) == pytest.approx(count, rel=0.1)


def test_there_is_one_point_at_least():
    assert core.spaced_count(0.01, 1.0) == 1


def test_of_the_points_in_a_cell_one_is_left():
    points = np.random.default_rng(1).uniform(-3.0, 2.0, (4000, 3)) * [1.0, 2.0, 0.5]
    cells = np.floor(points / 0.4)
    first = np.unique(cells, axis=0, return_index=True)[1]
    assert np.array_equal(np.sort(sampling._one_a_cell(points, 0.4)), np.sort(first))
