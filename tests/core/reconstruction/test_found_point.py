# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Reference points that were found from noisy contacts, or touched with noise: intervals hold around them."""

import math
from pathlib import Path

import numpy as np
import pytest
import surfaces

import core

NOISE, RADIUS, EXTENT = 0.02, 25.0, 10.0


def contours_of(count, seed, noise=None):
    """Three contours of a ball with noise in all directions, without the point, and the outward direction."""
    s, rng = surfaces.sphere(RADIUS), np.random.default_rng(seed)
    azimuths = np.array((0, 60, 120)) + rng.uniform(0, 60)
    tracked = s.track(surfaces.planes(azimuths), extent=EXTENT, step=2.0 * EXTENT / (count - 1))
    away = (c.points[np.linalg.norm(c.points - s.point, axis=1) > 1e-9] for c in tracked)
    return [core.Contour(p + rng.normal(0.0, NOISE, p.shape), noise=noise) for p in away], s.normal


def judged(r):
    """The shares of curvatures and of heights that 90 % intervals hold, and whether the origin's does."""
    flat = np.vstack([r.domain.grid(100)[0], np.zeros((1, 2))])
    base, up = r.frame.to_world(np.column_stack([flat, np.zeros(len(flat))])), r.normal
    along = base @ up
    true = -along + np.sqrt(along**2 - np.sum(base**2, axis=1) + RADIUS**2)
    holds = np.abs(true - r.height(*flat.T)) <= 1.645 * r.height_std(*flat.T)
    curvatures = [abs(k + 1.0 / RADIUS) <= 1.645 * std for k, std in ((r.k1, r.k1_std), (r.k2, r.k2_std))]
    return np.mean(curvatures), holds[:-1].mean(), holds[-1]


@pytest.mark.parametrize("noise", [None, NOISE])
@pytest.mark.parametrize("count", [15, 41, 101, 400])
def test_intervals_hold_around_a_point_that_was_found(count, noise):
    found = []
    for seed in range(60):
        contours, normal = contours_of(count, seed, noise)
        point, _ = core.common_point(contours)
        found.append(judged(core.reconstruct(point, contours, outward=normal)))
    assert np.mean(found, axis=0) == pytest.approx([0.93, 0.93, 0.93], abs=0.08)


@pytest.mark.parametrize("off", [0.1, -0.3])
def test_a_point_that_was_given_beside_the_surface_changes_nothing(off):
    found, stds = [], []
    for seed in range(20):
        contours, normal = contours_of(41, seed)
        point = RADIUS * normal + off * normal
        r = core.reconstruct(point, contours, outward=normal)
        assert r.status == "ok"
        found.append(judged(r))
        stds.append(r.height_std(0.0, 0.0))
    assert np.mean(found, axis=0) == pytest.approx([0.93, 0.93, 0.93], abs=0.08)
    assert np.max(stds) < NOISE


def test_a_contact_that_is_the_point_is_one_contact():
    """A robot names the first contact of all its curves, which has the noise of the others."""
    found = []
    for seed in range(30):
        contours, normal = contours_of(41, seed, NOISE)
        start = RADIUS * normal + np.random.default_rng(seed + 100).normal(0.0, NOISE) * normal
        contours = [core.Contour(np.vstack([start, c.points]), noise=NOISE) for c in contours]
        r = core.reconstruct(start, contours, outward=normal)
        assert np.array_equal(r.point, start)
        found.append(judged(r))
    assert np.mean(found, axis=0) == pytest.approx([0.93, 0.93, 0.93], abs=0.08)


def test_a_deviation_of_the_point_is_taken():
    """From 0, where the fit passes through the point, to so much that only the contacts count."""
    contours, normal = contours_of(41, 1, NOISE)
    point = RADIUS * normal
    exact, known, free = (
        core.reconstruct(point, contours, outward=normal, point_std=std) for std in (0.0, 0.003, None)
    )
    assert np.array_equal(exact.frame.origin, point)
    assert exact.height_std(0.0, 0.0) == 0.0 < known.height_std(0.0, 0.0) < 0.003
    assert free.height_std(0.0, 0.0) > known.height_std(0.0, 0.0)
    assert free.k1_std > known.k1_std > exact.k1_std
    wide = core.reconstruct(point, contours, outward=normal, point_std=100.0)
    assert wide.k1_std == pytest.approx(free.k1_std, rel=1e-3)
    with pytest.raises(ValueError, match=r"point_std: expected a finite number of 0 or more"):
        core.reconstruct(point, contours, outward=normal, point_std=-1.0)


def test_a_touch_knows_its_point_to_its_noise():
    s = surfaces.ellipsoid(35, 32, 19, 0.4, 0.5)
    for noise in (0.0, 0.02):
        r = core.explore(s, s.point, s.normal, extent=12.0, noise=noise, rng=1).result
        assert noise / math.sqrt(50.0) <= r.height_std(0.0, 0.0) <= noise


def test_the_example_of_the_readme_is_not_surer_at_its_point_than_its_contacts():
    text = Path(__file__).parents[3] / "examples" / "contacts.csv"
    contacts = core.contacts_from_csv(text.read_text())
    point, _ = core.common_point(contacts.contours)
    r = core.reconstruct(point, contacts.contours, outward=(0, 0, 1), strokes=contacts.strokes)
    assert r.status == "ok"
    assert 0.0 < r.height_std(0.0, 0.0) < r.mean_height_std


def test_closed_curves_far_beside_their_point_bound_no_patch():
    s, turn = surfaces.sphere(RADIUS), np.linspace(-np.pi, np.pi, 21)
    circles = []
    for contour in s.track(surfaces.planes((0, 60, 120)), extent=EXTENT, step=2.0):
        tangent = (contour.points[-1] - contour.points[0]) / np.linalg.norm(np.ptp(contour.points, axis=0))
        circles.append(s.point + np.outer(np.sin(turn), tangent) - np.outer(1.0 - np.cos(turn), s.normal))
    with pytest.raises(core.DegenerateCurvesError, match="they bound no patch"):
        core.reconstruct(s.point + np.array([30.0, -100.0, 50.0]), circles, outward=s.normal)
