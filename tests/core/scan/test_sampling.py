# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""How many points of an even spacing there are, and where random ones are."""

import numpy as np
import pytest

import core
from core.scan import sampling


@pytest.mark.parametrize("spacing", [0.1, 0.2, 0.4])
def test_the_count_of_spaced_points_is_known_before_they_are_chosen(spacing):
    """The points are all over the unit sphere, which is nearly flat over a disk as wide as the spacing."""
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


def test_scattered_points_are_even_by_area_and_on_their_faces():
    # A square of two triangles, nine times as large as the third, which stands upright next to it.
    points = np.array(
        [[0, 0, 0], [3, 0, 0], [3, 3, 0], [0, 3, 0], [5, 0, 0], [5, 2, 0], [5, 0, 1]], dtype=float
    )
    triangles = np.array([[0, 1, 2], [0, 2, 3], [4, 5, 6]])
    found, normals = core.scattered(points, triangles, 20_000, np.random.default_rng(0))
    upright = found[:, 0] == 5.0
    assert abs(upright.mean() - 0.1) < 4.0 * np.sqrt(0.09 / 20_000)
    np.testing.assert_array_equal(normals, np.where(upright[:, None], (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)))
    flat = found[~upright]
    assert not flat[:, 2].any()
    counts, *_ = np.histogram2d(*flat[:, :2].T, bins=3, range=[(0.0, 3.0), (0.0, 3.0)])
    expected = len(flat) / 9.0
    assert (
        (counts - expected) ** 2 / expected
    ).sum() < 26.1  # one in 1000 of chi squared with 8 degrees of freedom is larger
    y, z = found[upright, 1] / 2.0, found[upright, 2]
    assert min(y.min(), z.min()) >= 0.0 and (y + z).max() <= 1.0 + 1e-12
    assert abs(y.mean() - 1.0 / 3.0) < 0.03 and abs(z.mean() - 1.0 / 3.0) < 0.03


def test_nothing_is_scattered_on_what_has_no_area():
    points = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0]])
    with pytest.raises(ValueError, match="triangles: expected some with an area, got none"):
        core.scattered(points, np.array([[0, 1, 2]]), 5, np.random.default_rng(0))


def test_points_of_single_precision_are_sampled_in_double_precision():
    single = np.random.default_rng(0).uniform(-1.0, 1.0, (6000, 3)).astype(np.float32)
    triangles = np.arange(6000).reshape(-1, 3)
    found, expected = (
        (
            *sampling.scattered(points, triangles, 50, np.random.default_rng(2)),
            list(sampling.spaced(points, 1e-3, np.random.default_rng(3))),
        )
        for points in (single, single.astype(float))
    )
    for one, other in zip(found, expected, strict=True):
        assert np.array_equal(one, other)
