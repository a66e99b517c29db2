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


NOISE, RADIUS, KAPPA = 0.02, 25.0, -0.04
RESTS = {  # places as shares of the half curve, contacts at each, and the curves that have them
    "near the point": ((0.1,), 1000, (0, 1, 2)),
    "in the middle": ((0.5,), 1000, (0, 1, 2)),
    "at the end": ((-0.98,), 1000, (0, 1, 2)),
    "at the point": ((0.0,), 500, (0, 1, 2)),
    "of few": ((0.5,), 50, (0, 1, 2)),
    "of one curve": ((0.5,), 1000, (0,)),
    "two": ((-0.3, 0.7), 1000, (0, 1, 2)),
}


def rested(seed, places, many, curves, jitter=NOISE / 10, arrange=lambda points: points):
    """Contours of a ball, 41 contacts each, without and with rests, whose contacts share an error."""
    rng, others = np.random.default_rng(seed), np.random.default_rng(1000 + seed)
    without, found, half = [], [], EXTENT / 2 / RADIUS
    for i, a in enumerate(np.radians((0.0, 60.0, 120.0))):

        def on_ball(t, a=a):
            return RADIUS * np.column_stack([np.sin(t) * np.cos(a), np.sin(t) * np.sin(a), np.cos(t) - 1.0])

        t = half * np.linspace(-1.0, 1.0, 41)
        points = on_ball(t) + rng.normal(0.0, NOISE, (41, 3))
        without.append(points)
        for share in places if i in curves else ():
            place = on_ball(np.array([half * share])) + others.normal(0.0, NOISE, 3)
            rest = place + others.normal(0.0, jitter, (many, 3))
            at = np.searchsorted(t, half * share) + len(points) - 41
            points = np.insert(points, at, rest, axis=0)
        found.append(arrange(points))
    return without, found


def fits(touches, noise):
    """Errors and standard deviations of k1 and k2, (n, 2) each, of touches on the ball."""
    found = []
    for curves in touches:
        contours = [Contour(points, noise=noise) for points in curves]
        r = reconstruct(np.zeros(3), contours, outward=(0, 0, 1))
        assert r.status == "ok"
        found.append(([r.patch.k1 - KAPPA, r.patch.k2 - KAPPA], [r.k1_std, r.k2_std]))
    return np.array(found).swapaxes(0, 1)


@pytest.mark.parametrize("noise", [NOISE, None])
@pytest.mark.parametrize("rests", RESTS.values(), ids=RESTS)
def test_a_rest_is_one_more_contact(rests, noise):
    without, found = zip(*(rested(seed, *rests) for seed in range(10)), strict=True)
    (few, few_stds), (errors, stds) = fits(without, noise), fits(found, noise)
    assert np.abs(errors).mean() <= 1.1 * np.abs(few).mean()
    assert (np.abs(errors) / stds).max() < 4.0
    surely = (np.abs(few) < 1.645 * few_stds).mean()
    assert (np.abs(errors) < 1.645 * stds).mean() >= surely - 0.1
    assert stds.mean() == pytest.approx(few_stds.mean(), rel=0.1)


def test_the_order_of_contacts_with_a_rest_makes_no_difference():
    shuffled, backward = np.random.default_rng(5).permutation, np.flipud
    given = [rested(3, (0.3,), 1000, (0, 2), arrange=way)[1] for way in (np.array, shuffled, backward)]
    errors, stds = fits(given, NOISE)
    assert np.ptp(errors, axis=0).max() < 1e-9
    assert np.ptp(stds, axis=0).max() < 1e-9


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e4])
def test_rests_move_with_the_world(scale):
    turn = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0]
    for points in rested(2, (0.0, 0.4), 1000, (0, 1, 2))[1]:
        fewer, size = thinned(Contour(points), np.zeros(3))
        start = scale * np.array([3.0, -7.0, 2.0])
        moved, moved_size = thinned(Contour(start + scale * points @ turn.T), start)
        assert moved_size == size == 1
        assert moved.points == pytest.approx(start + scale * fewer.points @ turn.T, abs=1e-8 * scale)


def test_means_lie_along_the_curve_where_most_contacts_do_not():
    """Nine of ten contacts are in a tenth of the length; by number 10 means would be left for the rest."""
    t = np.concatenate([np.linspace(-1.0, 0.8, 2000), np.linspace(0.8, 1.0, 18_001)[1:]])
    fewer, _ = thinned(Contour(np.column_stack([t, 0.0 * t, -0.2 * t**2])), np.zeros(3))
    assert 80 <= len(fewer.points) <= MOST_CONTACTS
    assert np.diff(fewer.points[:, 0]).max() < 0.03


@pytest.mark.parametrize("count", [101, 150, 801, 2001, 20_001])
def test_contacts_without_rests_are_thinned_by_number(count):
    """Where their density varies at random, equal numbers have equal noise."""
    t = np.sort(np.random.default_rng(count).uniform(0.1, 1.0, count))
    fewer, size = thinned(Contour(np.column_stack([t, 0.0 * t, 0.0 * t])), np.zeros(3))
    assert size == pytest.approx(count / MOST_CONTACTS, rel=0.1, abs=1.0)
    bounds = np.linspace(0, count, len(fewer.points) + 1).round().astype(int)
    means = np.add.reduceat(t, bounds[:-1]) / np.diff(bounds)
    assert fewer.points[:, 0] == pytest.approx(means, abs=0.03)


def test_a_rest_weighs_as_one_contact_in_means_of_points_and_normals():
    t = np.linspace(-1.0, 1.0, 401)
    points = np.column_stack([t, 0.0 * t, 0.0 * t])
    rest = points[300] + np.random.default_rng(0).normal(0.0, 1e-5, (1000, 3)) + (0.0, 0.1, 0.0)
    normals = np.tile([0.0, 0.0, 1.0], (1401, 1))
    normals[401:] = 0.0, 1.0, 0.0
    contour = Contour(np.vstack([points, rest]), normals=normals, noise=0.1, normal_std=0.1)
    fewer, size = thinned(contour, np.zeros(3))
    assert size in (4, 5)
    off = fewer.points[:, 1].max()
    assert 0.1 / 7.0 < off < 0.1 / 2.0
    assert fewer.normals[np.argmax(fewer.points[:, 1]), 1] == pytest.approx(off / 0.1, rel=0.01)


def test_stray_contacts_far_out_do_not_make_the_others_rests():
    t = np.linspace(-1.0, 1.0, 401)
    points = np.column_stack([t, 0.0 * t, -0.2 * t**2])
    stray = np.array([[40.0, 0.0, 1.0], [90.0, 0.0, 1.0]])
    fewer, size = thinned(Contour(np.vstack([points, stray])), np.zeros(3))
    assert size == 5
    assert np.count_nonzero(np.abs(fewer.points[:, 0]) <= 1.0) >= 75


def test_random_contacts_rarely_seem_to_rest():
    rng, changed = np.random.default_rng(0), 0
    for _ in range(1000):
        t = rng.uniform(-1.0, 1.0, MOST_CONTACTS)
        contour = Contour(np.column_stack([t, 0.0 * t, 0.0 * t]))
        changed += thinned(contour, np.zeros(3))[0] is not contour
    assert changed <= 3
