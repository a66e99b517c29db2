# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The Monge patch against finite differences and brute force."""

import math

import numpy as np
import pytest

from core import MongePatch, distances, fit_error
from core.patch.monge import derived_monomials, exponents

RNG = np.random.default_rng(0)
PATCHES = {d: MongePatch(-0.8, 0.5, 0.3 * RNG.normal(size=sum(range(4, d + 2)))) for d in range(2, 7)}
X, Y = RNG.uniform(-0.8, 0.8, (2, 50))


def test_the_terms_stand_in_the_order_of_equation_1():
    assert not exponents(3, 4).flags.writeable
    names = ["".join(map(str, term)) for term in exponents(3, 4)]
    assert names == ["30", "21", "12", "03", "40", "31", "22", "13", "04"]
    patch = MongePatch(2.0, 6.0, np.array([0, 0, 0, 0, 0, 0, 0, 5.0, 0]))
    assert patch.height(2.0, 3.0) == pytest.approx(4 + 27 + 5 * 2 * 27)


@pytest.mark.parametrize(
    ("k1", "k2", "index"),
    [(-2, -2, 1), (-3, 0, 0.5), (-1, 1, 0), (0, 3, -0.5), (2, 2, -1), (0, 0, 0), (-(3**0.5), 1, 1 / 6)],
)
def test_shape_index_and_curvedness_at_the_point(k1, k2, index):
    patch = MongePatch(k1, k2, np.empty(0))
    assert patch.shape_index(0.0, 0.0) == pytest.approx(index, abs=1e-12)
    assert patch.curvedness(0.0, 0.0) == pytest.approx(math.hypot(k1, k2) / math.sqrt(2.0))
    assert np.isfinite(patch.shape_index(X, Y)).all()
    larger = patch.scaled(3.0)
    assert larger.shape_index(3.0 * X, 3.0 * Y) == pytest.approx(patch.shape_index(X, Y), abs=1e-7)
    assert 3.0 * larger.curvedness(3.0 * X, 3.0 * Y) == pytest.approx(patch.curvedness(X, Y))


@pytest.mark.parametrize("degree", range(2, 7))
def test_derivatives_by_finite_differences(degree):
    patch, h = PATCHES[degree], 1e-4
    assert patch.degree == degree
    d = patch.derivatives(X, Y)

    def central(f, dx, dy):
        return (f(X + h * dx, Y + h * dy) - f(X - h * dx, Y - h * dy)) / (2 * h)

    assert central(patch.height, 1, 0) == pytest.approx(d.x, abs=1e-6)
    assert central(patch.height, 0, 1) == pytest.approx(d.y, abs=1e-6)
    assert central(lambda x, y: patch.derivatives(x, y).x, 1, 0) == pytest.approx(d.xx, abs=1e-6)
    assert central(lambda x, y: patch.derivatives(x, y).x, 0, 1) == pytest.approx(d.xy, abs=1e-6)
    assert central(lambda x, y: patch.derivatives(x, y).y, 0, 1) == pytest.approx(d.yy, abs=1e-6)


def test_normal_forms_and_curvatures_from_the_parametrisation():
    """E F G, L M N and the shape operator from nothing but differences of sigma(x, y) and of the normal."""
    patch, h = PATCHES[5], 1e-5

    def sigma(x, y):
        return np.stack([x, y, patch.height(x, y)], axis=-1)

    def partials(f):
        return (f(X + h, Y) - f(X - h, Y)) / (2 * h), (f(X, Y + h) - f(X, Y - h)) / (2 * h)

    (sx, sy), (nx, ny), n = partials(sigma), partials(patch.normal), patch.normal(X, Y)
    cross = np.cross(sx, sy)
    assert n == pytest.approx(cross / np.linalg.norm(cross, axis=1, keepdims=True), abs=1e-8)
    dot = lambda a, b: np.sum(a * b, axis=1)  # noqa: E731
    first, second = [dot(sx, sx), dot(sx, sy), dot(sy, sy)], [-dot(sx, nx), -dot(sx, ny), -dot(sy, ny)]
    k1, k2 = patch.principal_curvatures(X, Y)
    for i in range(len(X)):
        one = np.array([[first[0][i], first[1][i]], [first[1][i], first[2][i]]])
        two = np.array([[second[0][i], second[1][i]], [second[1][i], second[2][i]]])
        expected = np.sort(np.linalg.eigvals(np.linalg.solve(one, two)).real)
        assert [k1[i], k2[i]] == pytest.approx(expected, abs=1e-6)
    assert patch.gaussian_curvature(X, Y) == pytest.approx(k1 * k2, abs=1e-9)
    assert patch.mean_curvature(X, Y) == pytest.approx((k1 + k2) / 2, abs=1e-9)


@pytest.mark.parametrize("patch", PATCHES.values())
def test_the_principal_curvatures_at_the_origin_are_k1_and_k2(patch):
    assert [float(k) for k in patch.principal_curvatures(0.0, 0.0)] == pytest.approx([-0.8, 0.5])
    assert patch.normal(0.0, 0.0) == pytest.approx([0, 0, 1])


def test_answers_have_the_shape_of_the_question():
    patch = PATCHES[4]
    assert patch.height(0.1, 0.2).shape == ()
    assert patch.height(np.zeros((2, 3)), 0.0).shape == (2, 3)
    assert patch.normal(np.zeros((2, 3)), np.zeros((2, 3))).shape == (2, 3, 3)
    assert patch.height([], []).shape == (0,)


def test_closest_points_beat_every_point_of_a_fine_net():
    patch = PATCHES[4]
    points = np.column_stack([X, Y, patch.height(X, Y) + RNG.uniform(-0.3, 0.3, len(X))])
    feet = patch.closest_point(points)
    assert feet[:, 2] == pytest.approx(patch.height(*feet[:, :2].T), abs=1e-12)
    u, v = (axis.ravel() for axis in np.meshgrid(*[np.linspace(-1.2, 1.2, 400)] * 2))
    net = np.column_stack([u, v, patch.height(u, v)])
    nearest = np.array([np.linalg.norm(net - p, axis=1).min() for p in points])
    ours = distances(patch, points)
    assert np.all(ours <= nearest + 1e-12)
    assert ours == pytest.approx(nearest, abs=1e-2)
    # The way to the foot is along the normal there.
    along = np.cross(points - feet, patch.normal(*feet[:, :2].T))
    assert np.abs(along).max() < 1e-9


def test_distances_to_a_cylinder_are_known():
    """Distances are 0 on the patch and the height above its straight line; no points have no distances."""
    patch = MongePatch(-0.05, 0.0, np.empty(0))
    assert distances(patch, np.column_stack([X, Y, patch.height(X, Y)])) == pytest.approx(0.0, abs=1e-15)
    assert distances(patch, [[0.0, 3.0, 2.0]]) == pytest.approx([2.0])
    assert distances(patch, np.empty((0, 3))).shape == (0,)


def test_a_patch_as_steep_as_a_wall_has_its_curvature_and_distances():
    """EG - F^2 there is the difference of numbers that agree to all digits."""
    patch, x, y = MongePatch(1.0, 2.0, np.empty(0)), 1e9, 1e9
    expected = ((1 + x**2) * 2 + (1 + 4 * y**2)) / (2 * (1 + x**2 + 4 * y**2) ** 1.5)
    assert patch.mean_curvature(x, y) == pytest.approx(expected, rel=1e-6)
    assert distances(patch, [[x, y, patch.height(x, y)]]) == pytest.approx(0.0, abs=1e-6)


def test_fit_error_is_equation_6():
    patch = MongePatch(0.0, 0.0, np.empty(0))
    assert fit_error(patch, [[1, 1, 0.5], [2, 0, -1.5]]) == pytest.approx(1.0)


def test_scaling_scales_lengths():
    patch = PATCHES[6]
    scaled = patch.scaled(50.0)
    assert scaled.height(50 * X, 50 * Y) == pytest.approx(50 * patch.height(X, Y))
    assert scaled.gaussian_curvature(50 * X, 50 * Y) == pytest.approx(patch.gaussian_curvature(X, Y) / 2500)


def test_monomials_differentiated_away_are_zero_even_at_the_origin():
    found = derived_monomials(np.zeros((1, 2)), np.array([(3, 0), (2, 1)]), [(2, 1)])
    assert np.array_equal(found, [[[0.0, 2.0]]])


@pytest.mark.parametrize("k", [-0.5, 0.8])
@pytest.mark.parametrize("share", [0.9, -3.0, 40.0])
def test_closest_points_are_found_from_far_above_and_from_nearly_the_center_of_curvature(k, share):
    patch, u = MongePatch(k, k, np.empty(0)), np.linspace(0.1, 2.0, 12)
    t = share / k if share < 1.0 else -share / k
    feet = np.column_stack([u, 0.7 * u, patch.height(u, 0.7 * u)])
    points = feet + t * patch.normal(*feet[:, :2].T)
    assert patch.closest_point(points) == pytest.approx(feet, abs=1e-8)


def test_closest_points_of_a_steep_trough():
    """Where the Hessian of the distance is not positive definite, the tangent plane gives the step."""
    patch = MongePatch(-8.0, 2.0, np.empty(0))
    points = np.random.default_rng(3).uniform(-2.0, 2.0, (100, 3))
    ours, theirs = distances(patch, points), []
    for p in points:
        u, v = (p[i] + np.linspace(-3.0, 3.0, 151) for i in (0, 1))
        u, v = np.meshgrid(u, v)
        theirs.append(np.sqrt((u - p[0]) ** 2 + (v - p[1]) ** 2 + (patch.height(u, v) - p[2]) ** 2).min())
    assert np.mean(ours <= np.array(theirs) + 1e-9) > 0.9
