# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The point where measured curves meet, when nobody says where that is."""

import importlib

import numpy as np
import pytest
import surfaces
from scipy.spatial.transform import Rotation

from core import (
    Contour,
    DegenerateCurvesError,
    SamplingPlane,
    common_point,
    in_running_order,
    reconstruct,
)

SURFACES = [surfaces.pear(), surfaces.torus(40, 20, 0.6), surfaces.ellipsoid(35, 25, 20, 0.6, 0.5)]
TILTED = [SamplingPlane(np.radians(a), t) for a, t in ((13, 0.1), (73, -0.2), (133, 0.3))]
ids = ["pear", "torus", "ellipsoid"]


def curves(surface, noise=0.0, seed=0, planes=TILTED):
    """Curves without the contact at the point; the second also lacks one at an end, the third two."""
    contours = surface.track(planes, noise=noise, rng=seed)
    return [np.delete(c.points, [12, 0, 1][: 1 + i], axis=0) for i, c in enumerate(contours)]


def meet(points):
    return common_point([Contour(p) for p in points])


@pytest.mark.parametrize("surface", SURFACES, ids=ids)
def test_exact_curves_through_a_point_that_is_no_contact(surface):
    point, misses = meet(curves(surface))
    assert point == pytest.approx(surface.point, abs=5e-3)
    assert misses.shape == (3,)
    assert misses.max() < 5e-3


def test_it_converges_with_the_step():
    s = surfaces.torus(40, 20, 0.6)
    off = []
    for step in (1.0, 0.5):
        contours = s.track(TILTED, extent=12 * step, step=step)
        point, _ = meet([np.delete(c.points, 12, axis=0) for c in contours])
        off.append(np.linalg.norm(point - s.point))
    assert off[0] / off[1] > 4.0


@pytest.mark.parametrize("surface", SURFACES, ids=ids)
def test_noise_averages_out(surface):
    off = [np.linalg.norm(meet(curves(surface, 0.05, seed))[0] - surface.point) for seed in range(20)]
    assert np.median(off) < 0.03
    assert max(off) < 0.06


@pytest.mark.parametrize("gap", [0.1, 0.3, 1.0])
def test_curves_that_pass_each_other_miss_it_by_as_much(gap):
    s = surfaces.pear()
    apart = [p + k * gap * s.normal for k, p in zip((-1, 0, 1), curves(s), strict=True)]
    point, misses = meet(apart)
    assert misses == pytest.approx([gap, 0.0, gap], abs=0.1 * gap + 5e-3)
    assert point == pytest.approx(s.point, abs=0.05 * gap + 5e-3)


def test_order_and_direction_make_no_difference():
    given = curves(surfaces.pear(), 0.05)
    point, misses = meet(given)
    rng = np.random.default_rng(0)
    for other in ([p[::-1] for p in given], [rng.permutation(p) for p in given]):
        assert meet(other)[0] == pytest.approx(point, abs=1e-7)
        assert meet(other)[1] == pytest.approx(misses, abs=1e-7)
    assert meet(given[::-1])[0] == pytest.approx(point, abs=1e-7)


@pytest.mark.parametrize("shift", [0.0, 1e6])
def test_it_turns_scales_and_moves_with_the_curves(shift):
    given = curves(surfaces.torus(40, 20, 0.6), 0.05)
    point, misses = meet(given)
    turn = Rotation.from_rotvec([0.3, 0.9, -0.4]).as_matrix()
    moved, moved_misses = meet([1e3 * p @ turn.T + shift for p in given])
    assert moved == pytest.approx(1e3 * turn @ point + shift, abs=1e-4)
    assert moved_misses == pytest.approx(1e3 * misses, abs=1e-4)


def test_closed_sections_of_a_body_that_meet_twice():
    turn = np.linspace(0.0, 2.0 * np.pi, 120, endpoint=False)
    rings = [
        20.0 * np.column_stack([np.sin(turn) * np.cos(a), np.sin(turn) * np.sin(a), np.cos(turn)])
        for a in (0.0, 1.0, 2.0)
    ]
    point, misses = meet(rings)
    assert abs(point[2]) == pytest.approx(20.0, abs=2e-3)  # a parabola is that far off a circle
    assert misses.max() < 1e-6


def test_a_patch_at_the_common_point_is_like_one_at_the_true_point():
    s = surfaces.pear()
    contours = [Contour(p) for p in curves(s, 0.02)]
    found = reconstruct(common_point(contours)[0], contours, outward=s.normal)
    true = s.fit(contours)
    assert found.status == "ok"
    assert [found.patch.k1, found.patch.k2] == pytest.approx([true.patch.k1, true.patch.k2], abs=1e-3)


S = np.linspace(-5.0, 5.0, 11)
RIGHT, AHEAD, UP = np.eye(3)
LINE = np.column_stack([S, 0.0 * S, 0.0 * S])
ACROSS = LINE[:, [1, 0, 2]]


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ([], "the common point needs two or more curves, got 0"),
        ([LINE], "the common point needs two or more curves, got 1"),
        ([LINE, ACROSS[:3]], "curve 2 has 3 contacts, and 4 are needed"),
        ([LINE, ACROSS + 4 * UP], "the curves do not come near each other: curve 1"),
        ([LINE, ACROSS + 30 * RIGHT], "the curves do not come near each other"),
        ([LINE, ACROSS + 30 * AHEAD], "the curves do not come near each other"),
        ([LINE, LINE + 0.1 * UP], "the curves run in the same direction"),
        ([LINE, LINE + 0.5 * RIGHT], "the curves run in the same direction"),
        ([LINE, np.ones((9, 3))], "curve 2 has 1 contact, and 4"),
    ],
)
def test_curves_without_a_common_point_are_refused_with_a_sentence(given, words):
    with pytest.raises(DegenerateCurvesError, match=words):
        meet(given)


def bent(angle, count):
    s = np.linspace(-1.0, 1.0, count)
    direction = np.array([np.cos(angle), np.sin(angle), 0.0])
    return Contour(np.outer(s, direction) - np.outer(0.25 * s**2, [0.0, 0.0, 1.0]))


def test_of_many_contacts_as_many_are_looked_at_as_tell_something(monkeypatch):
    module = importlib.import_module("core.contours.common_point")
    seen = []
    stacked = module.stacked
    monkeypatch.setattr(module, "stacked", lambda *given: seen.append(stacked(*given)) or seen[-1])
    point, misses = common_point([bent(angle, 30_001) for angle in (0.0, 1.0, 2.0)])
    assert point == pytest.approx(np.zeros(3), abs=1e-6)
    assert misses == pytest.approx(np.zeros(3), abs=1e-6)
    assert max(r.shape[2] for r, _, _ in seen) == module.CONTACTS_AROUND
    assert len(module._starts([bent(angle, 30_001) for angle in (0.0, 1.0, 2.0)])) <= module.MOST_STARTS


def test_a_long_curve_among_many_short_ones():
    contours = [bent(0.0, 40_000), *(bent(angle, 5) for angle in np.linspace(0.01, 3.13, 300))]
    point, misses = common_point(contours)
    assert point == pytest.approx(np.zeros(3), abs=1e-6)
    assert misses.max() < 1e-6


def test_contacts_come_into_running_order_with_their_normals():
    whole, shuffle = bent(0.3, 41), np.random.default_rng(0).permutation(41)
    normals = np.column_stack([whole.points[:, :2], np.full(41, 2.0)])
    found = in_running_order(Contour(whole.points[shuffle], normals=normals[shuffle]), (0.0, 0.0, 0.0))
    way = 1 if found.points[0, 0] < 0.0 else -1
    assert np.array_equal(found.points[::way], whole.points)
    assert np.array_equal(found.normals[::way], normals)
    nothing = Contour(np.empty((0, 3)))
    assert in_running_order(nothing, (0.0, 0.0, 0.0)) is nothing
