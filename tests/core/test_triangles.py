# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Rows of triangles."""

import numpy as np
import pytest

from core.triangles import closest_point, cut_to_edges, far_apart, middles_of_parts


@pytest.mark.parametrize("n", [1, 2, 3, 7])
def test_equal_parts_of_a_triangle_have_its_integrals(n):
    """A rule of their middles is exact for x, and has an error of 1/n^2 for x^2."""
    middles = middles_of_parts(n)
    assert middles.shape == (n**2, 3)
    assert (middles > 0.0).all()
    assert middles.sum(axis=1) == pytest.approx(1.0)
    assert middles.mean(axis=0) == pytest.approx([1 / 3] * 3)
    assert np.mean(middles**2, axis=0) == pytest.approx([1 / 6 - 1 / (18 * n**2)] * 3)
    apart = np.linalg.norm(middles[:, None] - middles, axis=-1)
    assert n == 1 or apart[apart > 0.0].min() > 0.4 / n


def test_the_closest_point_of_a_triangle_is_the_nearest_of_many():
    rng = np.random.default_rng(0)
    corners, points = rng.normal(size=(200, 3, 3)), rng.normal(size=(200, 3))
    feet, weights = closest_point(corners, points)
    a, b = np.meshgrid(np.linspace(0.0, 1.0, 101), np.linspace(0.0, 1.0, 101))
    shares = np.stack([a, b, 1.0 - a - b])[:, a + b <= 1.0 + 1e-9].T
    nearest = np.linalg.norm(shares @ corners - points[:, None], axis=2).min(axis=1)
    ours = np.linalg.norm(feet - points, axis=1)
    assert np.all(ours <= nearest + 1e-9)
    assert ours == pytest.approx(nearest, abs=0.02)
    assert weights.min() > -1e-9 and weights.sum(axis=1) == pytest.approx(np.ones(200))
    assert np.einsum("nk,nki->ni", weights, corners) == pytest.approx(feet)


def test_triangles_are_cut_by_their_edges_and_not_by_other_columns():
    corners = np.column_stack([0.1 * np.eye(3), np.diag([1.0, -1.0, 1.0])])
    points, triangles, whole = cut_to_edges(corners, np.array([[0, 1, 2]]), 0.2)
    assert (points == corners).all() and triangles.tolist() == [[0, 1, 2]] and whole.tolist() == [0]
    points, triangles, whole = cut_to_edges(corners, np.array([[0, 1, 2]]), 0.1)
    cut = points[triangles]
    assert np.linalg.norm((cut - np.roll(cut, 1, axis=1))[..., :3], axis=2).max() <= 0.1
    assert points[3:] == pytest.approx(points[3:, :3] @ np.linalg.inv(corners[:, :3]) @ corners)
    assert (whole == 0).all()


def test_points_that_are_far_apart_leave_none_out_that_is_far_from_them():
    rng = np.random.default_rng(0)
    points, lengths = rng.uniform(size=(300, 3)), rng.uniform(0.1, 0.4, 300)
    chosen = far_apart(points, lengths)
    away = np.linalg.norm(points[:, None] - points[chosen], axis=2)
    for i in range(300):
        before = [k for k, j in enumerate(chosen) if j < i]
        assert (i in chosen) == (away[i, before] > lengths[chosen][before]).all()
    assert far_apart(points[:0], 1.0) == [] and far_apart(points, 9.0) == [0]
