# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Contours of very many contacts, with noise in all directions: fits are no worse than with few contacts."""

from functools import cache

import numpy as np
import pytest
import surfaces
from scipy.interpolate import CubicSpline

from core import Contour, reconstruct
from core.contours.thinning import MOST_CONTACTS, thinned

EXTENT = 10.0
SURFACES = surfaces.FIVE


@cache
def curves_of(surface):
    """A spline by arc length through each contour of a surface, and its length."""
    found = []
    for contour in surface.track(surfaces.planes((0, 60, 120)), extent=EXTENT, step=EXTENT / 48):
        steps = np.linalg.norm(np.diff(contour.points, axis=0), axis=1)
        along = np.concatenate([[0.0], np.cumsum(steps)])
        found.append((CubicSpline(along, contour.points), along[-1]))
    return found


def scattered(surface, count, noise, seed):
    """`count` contacts a curve, anywhere on it, off by `noise` in all directions."""
    rng, found = np.random.default_rng(seed), []
    for curve, length in curves_of(surface):
        points = curve(np.sort(rng.uniform(0.0, length, count)))
        found.append(points + rng.normal(0.0, noise, (count, 3)))
    return found


def judged(surface, curves, noise):
    """The mean error, the share of the domain where the 90 % interval holds, and error over deviation."""
    contours = [Contour(points) for points in curves]
    r = reconstruct(surface.point, contours, outward=surface.normal, noise=noise)
    points, heights = surfaces.heights_over(surface, r, 300)
    off = np.abs(r.height(*points.T) - heights)
    return off.mean(), (off < 1.645 * r.height_std(*points.T)).mean(), off.mean() / r.mean_height_std


@pytest.mark.long
@pytest.mark.parametrize("count", [100, 1000, 20_000])
@pytest.mark.parametrize("share", [0.0, 0.002, 0.02])
def test_many_contacts_are_no_worse_than_few_and_no_surer_than_they_may_be(count, share):
    noise, found, few = share * EXTENT, [], []
    for surface in SURFACES.values():
        for seed in range(2):
            curves = scattered(surface, count, noise, seed)
            found.append(judged(surface, curves, noise))
            few.append(judged(surface, [points[:: max(1, count // 48)] for points in curves], noise)[0])
    errors, within, ratios = zip(*found, strict=True)
    assert np.mean(errors) <= 1.05 * np.mean(few)
    assert np.mean(within) >= 0.8
    assert max(ratios) < 3.0


@pytest.mark.parametrize("count", [2000, 20_000])
def test_what_the_planes_cannot_show_stays_unseen(count):
    surface = SURFACES["ellipsoid"]
    contours = [Contour(points) for points in scattered(surface, count, 0.02, 1)]
    r = reconstruct(surface.point, contours, outward=surface.normal, degree=4)
    assert r.null_space_dimension == 3
    assert max(len(contour.points) for contour in r.contours) <= MOST_CONTACTS


@pytest.mark.parametrize("seed", range(5))
def test_noise_larger_than_the_spacing_of_contacts_refuses_nothing(seed):
    surface = SURFACES["torus"]
    contours = [Contour(points) for points in scattered(surface, 5000, 0.1, seed)]
    r = reconstruct(surface.point, contours, outward=surface.normal)
    assert r.status == "ok"
    assert np.degrees(np.arccos(min(1.0, r.frame.axes[:, 2] @ surface.normal))) < 1.0


def test_means_run_as_the_contour_does_and_keep_to_their_side_of_the_point():
    t = np.linspace(-3.0, 1.0, 801)
    points = np.column_stack([t + 7.0, 0.1 * t - 3.0, 5.0 - 0.2 * t**2])
    normals = np.tile([0.0, 0.6, 0.8], (801, 1))
    contour = Contour(points, normals=normals, noise=0.05, normal_std=0.02)
    fewer, size = thinned(contour, np.array([7.0, -3.0, 5.0]))
    x = fewer.points[:, 0] - 7.0
    assert size == 8
    assert len(x) == MOST_CONTACTS
    assert (np.diff(x) > 0.0).all()
    assert (x[:75] < 0.0).all() and (x[75:] > 0.0).all()
    assert fewer.noise == pytest.approx(0.05 / np.sqrt(8))
    assert fewer.normal_std == pytest.approx(0.02 / np.sqrt(8))
    assert fewer.normals == pytest.approx(np.tile([0.0, 0.6, 0.8], (MOST_CONTACTS, 1)))
    backward, _ = thinned(Contour(points[::-1]), np.array([7.0, -3.0, 5.0]))
    assert backward.points == pytest.approx(fewer.points[::-1])


@pytest.mark.parametrize("count", [101, 150, 201])
def test_more_than_a_hundred_contacts_become_a_hundred_at_most(count):
    t = np.linspace(0.1, 1.0, count)
    fewer, size = thinned(Contour(np.column_stack([t, 0.0 * t, -0.2 * t**2])), np.zeros(3))
    assert size == -(-count // MOST_CONTACTS) > 1
    assert len(fewer.points) <= MOST_CONTACTS


@pytest.mark.parametrize("count", [1, 50, MOST_CONTACTS])
def test_few_contacts_stay_as_they_are(count):
    contour = Contour(np.random.default_rng(0).normal(size=(count, 3)))
    assert thinned(contour, np.zeros(3)) == (contour, 1)


@pytest.mark.parametrize("count", [151, 301, 2001])
@pytest.mark.parametrize("bend", [1.0, 1.5, 3.0])
def test_a_steep_curve_is_followed_by_its_tangent_at_the_point(count, bend):
    """The contours run farther down a paraboloid than across it, so their longest axis is the normal."""
    t, contours = np.linspace(-1.0, 1.0, count), []
    for a in np.radians((0.0, 60.0, 120.0)):
        contours.append(Contour(np.column_stack([t * np.cos(a), t * np.sin(a), -0.5 * bend * 2.0 * t**2])))
    r = reconstruct((0, 0, 0), contours, outward=(0, 0, 1))
    assert [r.patch.k1, r.patch.k2] == pytest.approx([-2.0 * bend] * 2, rel=0.01)


def test_means_of_means_are_none():
    """An export that is read again has the same contacts; here one is before the point, and 299 follow."""
    t = np.concatenate([[-0.01], np.linspace(0.003, 1.0, 299)])
    fewer, size = thinned(Contour(np.column_stack([t, 0.0 * t, -0.2 * t**2])), np.zeros(3))
    assert (size, len(fewer.points)) == (3, MOST_CONTACTS)
    assert thinned(fewer, np.zeros(3)) == (fewer, 1)


@pytest.mark.parametrize("length", [1.0, 1e-200, 1.7e308])
def test_normals_to_either_side_and_of_any_length_do_not_cancel(length):
    contours, t = [], np.linspace(-1.0, 1.0, 401)
    for a in np.radians((0.0, 60.0, 120.0)):
        points = np.column_stack([t * np.cos(a), t * np.sin(a), -0.2 * t**2])
        normals = np.column_stack([0.4 * points[:, 0], 0.4 * points[:, 1], np.ones(401)])
        normals *= np.where(np.arange(401) % 2, length, -length)[:, None] / np.abs(normals).max()
        contours.append(Contour(points, normals=normals, normal_std=0.02))
    r = reconstruct((0, 0, 0), contours, outward=(0, 0, 1))
    few = [Contour(c.points[::8], normals=c.normals[::8], normal_std=0.02) for c in contours]
    assert r.patch.k1 == pytest.approx(-0.4, abs=2e-3)
    assert r.mean_height_std < 1.2 * reconstruct((0, 0, 0), few, outward=(0, 0, 1)).mean_height_std
