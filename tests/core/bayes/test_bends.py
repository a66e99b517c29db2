# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Folds and facets: curvatures have the error of few bends, and a touch between folds stays on its face."""

import math
from dataclasses import replace

import numpy as np
import pytest
import surfaces

import core
from core.bayes.bends import FEW, LEAST, bends_of

TOP = 0.2


def fold(angle, x=0.0):
    """A flat top that falls off by this angle, in degrees, beyond |x| = TOP; the point is at x."""
    slope = math.tan(math.radians(angle))
    return surfaces.Exact(
        lambda x, y, z: z + slope * np.maximum(np.abs(x) - TOP, 0.0),
        lambda p: np.array([slope * np.sign(p[0]) * (abs(p[0]) > TOP), 0.0, 1.0]),
        np.array([x, 0.0, 0.0]),
        0.0,
        0.0,
    )


def touches(angle, count, seed, **lengths):
    """Results at points of a flat top, with planes turned at random."""
    rng = np.random.default_rng(seed)
    for _ in range(count):
        s, turn = fold(angle, rng.uniform(-0.15, 0.15)), rng.uniform(0.0, 60.0)
        planes = surfaces.planes(turn + np.array([0.0, 60.0, 120.0]))
        yield core.explore(s, s.point, s.normal, planes, **lengths).result


def is_silent(r):
    """Whether a sure touch is off by over five deviations and 3 % of 1 / L, where both curvatures are 0."""
    each = ((abs(r.k1), r.k1_std), (abs(r.k2), r.k2_std))
    return r.status == "ok" and any(k > 5.0 * std and k * r.radius > 0.03 for k, std in each)


@pytest.mark.parametrize("extent", [0.3, 0.6, 1.0])
@pytest.mark.parametrize("angle", [5, 10, 15, 20])
def test_no_touch_across_folds_is_sure_of_their_curvature(angle, extent):
    assert not any(is_silent(r) for r in touches(angle, 4, 0, extent=extent))


@pytest.mark.parametrize("turn", [0, 10, 20, 30])
def test_an_automatic_touch_between_folds_stays_on_its_face(turn):
    s, planes = fold(20), surfaces.planes(turn + np.array([0.0, 60.0, 120.0]))
    r = core.explore(s, s.point, s.normal, planes, farthest=0.5).result
    assert r.status == "ok"
    assert max(abs(r.k1), abs(r.k2)) * r.radius < 1e-6


@pytest.mark.parametrize("angle", [5, 10, 20])
def test_without_normals_the_deviation_contains_the_curvature_of_folds(angle):
    """A fold between two contacts is a bend of two chords, which few contacts show from a smooth curve."""
    rng, sure = np.random.default_rng(angle), 0
    for r in touches(angle, 24, 1, extent=rng.uniform(0.4, 1.0)):
        bare = [replace(contour, normals=None) for contour in r.contours]
        found = core.reconstruct(r.point, bare, outward=(0.0, 0.0, 1.0))
        assert not is_silent(found)
        sure += found.status == "ok"
    assert sure > 0


def test_a_touch_across_folds_names_them():
    (r,) = touches(20, 1, 2, extent=1.0)
    assert r.message.startswith("The surface turns at three places or fewer along a curve")
    assert "use a shorter extent, move the point away from folds, or make the facets finer" in r.message


def contour(angles, steps):
    """A contour along x whose normals are at these angles (n,) in its plane, after steps (n - 1,)."""
    x = np.concatenate([[0.0], np.cumsum(steps)])
    normals = np.column_stack([np.sin(angles), np.zeros(len(x)), np.cos(angles)])
    return core.Contour(np.column_stack([x - x.mean(), np.zeros((len(x), 2))]), normals=normals)


def bends(given):
    frame = core.Frame(np.zeros(3), np.eye(3))
    across = [core.Contour(c.points[:, [1, 0, 2]], normals=c.normals[:, [1, 0, 2]]) for c in given]
    return bends_of([*given, *across], frame, 0.5 * np.ptp(given[0].points[:, 0]), 0.0, np.zeros(3))


@pytest.mark.parametrize("seed", range(3))
def test_a_smooth_curve_bends_at_each_contact_however_these_are_spread(seed):
    steps = np.random.default_rng(seed).uniform(0.1, 3.0, 24)
    found = bends([contour(0.03 * np.concatenate([[0.0], np.cumsum(steps)]), steps)])
    assert found.contacts == pytest.approx(1.0, abs=0.1)
    assert found.folded == 0.0


@pytest.mark.parametrize("scale", [1e-3, 1.0, -40.0])
def test_a_single_fold_is_one_bend_whatever_length_and_side_normals_have(scale):
    angles = np.where(np.arange(25) < 12, 0.0, 0.2)
    found = bends([contour(angles, np.full(24, 0.1))])
    turned = contour(angles, np.full(24, 0.1))
    turned = replace(turned, normals=scale * turned.normals)
    assert found.folded == pytest.approx(0.1)  # 0.2 radians over 2 L
    assert bends([turned]).covariance == pytest.approx(found.covariance)
    wanted = (FEW / LEAST) ** 3 * 0.1
    assert 2.0 * math.sqrt(found.covariance[0, 0]) == pytest.approx(wanted, rel=1e-6)


def test_one_normal_that_is_wrong_is_no_bend():
    angles = np.linspace(-0.3, 0.3, 25)
    wrong = angles.copy()
    wrong[7] += 0.5
    found = bends([contour(wrong, np.full(24, 0.1))])
    assert found.folded == 0.0
    assert found.contacts < 1.2


@pytest.mark.parametrize("sections", [24, 32, 64])
def test_facets_around_a_cylinder_are_bends_enough(sections):
    angle = np.arange(sections) * 2.0 * math.pi / sections
    normals = np.column_stack([np.cos(angle), np.sin(angle), np.zeros(sections)])

    class Prism:
        def ray_cast(self, origin, direction, distance):
            o, d = np.array(origin), np.array(direction)
            speed, height = normals @ d, normals @ o - math.cos(math.pi / sections)
            with np.errstate(divide="ignore"):
                at = -height / speed
            entering, leaving = speed < 0.0, speed > 0.0
            first, last = at[entering].max(initial=-np.inf), at[leaving].min(initial=np.inf)
            which = np.flatnonzero(entering)[at[entering].argmax()] if first >= 0.0 else None
            if which is None or first > min(last, distance):
                return None
            return tuple(o + first * d), tuple(normals[which])

    point = math.cos(math.pi / sections) * normals[0] + np.array([0.0, 0.01, 0.0])
    r = core.explore(Prism(), point, normals[0], farthest=1.5).result
    assert r.status == "ok"
    assert (r.k1, r.k2) == pytest.approx((-1.0, 0.0), abs=0.15)


def test_few_bends_also_widen_the_deviation_of_gaussian_curvature_along_the_patch():
    for r in touches(5, 4, 0, extent=0.6):
        (std,) = core.gaussian_curvature_stds(r, np.zeros(1), np.zeros(1))
        assert 0.9 < std / r.gaussian_curvature_std < 1.6  # That of z_xy counts as well.
