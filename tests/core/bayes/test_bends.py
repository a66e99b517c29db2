# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Folds and facets: curvatures have the error of few bends, and a touch between folds stays on its face."""

import math
from dataclasses import replace

import numpy as np
import pytest
import surfaces

import core
from core.bayes.bends import bends_of

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


def curved_fold(k1, k2, angle, at):
    """A paraboloid of these curvatures that falls off by this angle more, in degrees, beyond x = at."""
    slope = math.tan(math.radians(angle))
    return surfaces.Exact(
        lambda x, y, z: z - 0.5 * (k1 * x * x + k2 * y * y) + slope * np.maximum(x - at, 0.0),
        lambda p: np.array([-k1 * p[0] + slope * (p[0] > at), -k2 * p[1], 1.0]),
        np.zeros(3),
        k1,
        k2,
    )


def touches(angle, count, seed, **lengths):
    """Results at points of a flat top, with planes turned at random."""
    rng = np.random.default_rng(seed)
    for _ in range(count):
        s, turn = fold(angle, rng.uniform(-0.15, 0.15)), rng.uniform(0.0, 60.0)
        planes = surfaces.planes(turn + np.array([0.0, 60.0, 120.0]))
        yield core.explore(s, s.point, s.normal, planes, **lengths).result


def is_silent(r, k1=0.0, k2=0.0):
    """Whether a sure touch is off these curvatures by over five deviations and 3 % of 1 / L."""
    each = ((abs(r.k1 - k1), r.k1_std), (abs(r.k2 - k2), r.k2_std))
    return r.status == "ok" and any(off > 5.0 * std and off * r.radius > 0.03 for off, std in each)


@pytest.mark.parametrize("extent", [0.3, 0.6, 1.0])
@pytest.mark.parametrize("angle", [5, 10, 15, 20])
def test_no_touch_across_folds_is_sure_of_their_curvature(angle, extent):
    assert not any(is_silent(r) for r in touches(angle, 4, 0, extent=extent))


@pytest.mark.parametrize("lengths", [{"farthest": 1.0}, {"extent": 1.0}])
@pytest.mark.parametrize("angle", [5, 10, 20, 30])
@pytest.mark.parametrize(("k1", "k2"), [(-0.3, -0.3), (-1.0, -1.0), (-1.0, 1.0), (-1.0, 0.0)])
def test_no_touch_across_a_fold_of_a_curved_surface_is_sure_of_its_curvature(k1, k2, angle, lengths):
    """With normals and without: the surface itself turns between all contacts, and once more at the fold."""
    for at in (0.1, 0.2, 0.45):
        s, planes = curved_fold(k1, k2, angle, at), surfaces.planes((10, 70, 130))
        found = core.explore(s, s.point, s.normal, planes, **lengths)
        bare = [replace(contour, normals=None) for contour in found.contours]
        for r in (found.result, core.reconstruct(s.point, bare, outward=s.normal)):
            assert not is_silent(r, k1, k2)


@pytest.mark.parametrize("at", [-0.002, 0.0, 0.002])
def test_folds_on_both_sides_of_a_curved_top_do_not_make_the_curvature_along_them_unknown(at):
    slope = math.tan(math.radians(10.0))
    s = surfaces.Exact(
        lambda x, y, z: z + 0.5 * (x * x + y * y) + slope * np.maximum(np.abs(x) - TOP, 0.0),
        lambda p: np.array([slope * np.sign(p[0]) * (abs(p[0]) > TOP) + p[0], p[1], 1.0]),
        np.array([at, 0.0, -0.5 * at * at]),
        -1.0,
        -1.0,
    )
    r = core.explore(s, s.point, s.normal, surfaces.planes((30, 90, 150)), farthest=1.5).result
    assert r.posterior.sextic is not None  # It averages the folds.
    assert not is_silent(r, -1.0, -1.0)
    assert r.k2_std < 0.6


@pytest.mark.parametrize("turn", [0, 10, 20, 30])
def test_an_automatic_touch_between_folds_stays_on_its_face(turn):
    s, planes = fold(20), surfaces.planes(turn + np.array([0.0, 60.0, 120.0]))
    r = core.explore(s, s.point, s.normal, planes, farthest=0.5).result
    assert r.status == "ok"
    assert max(abs(r.k1), abs(r.k2)) * r.radius < 1e-6


@pytest.mark.parametrize("angle", [5, 10, 20])
def test_without_normals_the_deviation_contains_the_curvature_of_folds(angle):
    """A fold between two contacts turns two chords, and is one bend: folds are few, and a doubt if steep."""
    rng, sure = np.random.default_rng(angle), 0
    for r in touches(angle, 24, 1, extent=rng.uniform(0.4, 1.0)):
        bare = [replace(contour, normals=None) for contour in r.contours]
        found = core.reconstruct(r.point, bare, outward=(0.0, 0.0, 1.0))
        if found.status == "ok":
            assert abs(found.k1) < 2.5 * found.k1_std
            sure += 1
    assert (sure > 0) is (angle < 20)


@pytest.mark.parametrize("turn", [0, 15, 30, 45])
def test_two_folds_without_normals_next_to_the_point_are_no_even_curvature(turn):
    """Each fold is a bend of two chords, and the four are among the seven nearest to the point."""
    s, planes = fold(25), surfaces.planes(turn + np.array([0.0, 60.0, 120.0]))
    contours = core.explore(s, s.point, s.normal, planes, extent=10.0 / 6.0).result.contours
    bare = [replace(contour, normals=None) for contour in contours]
    assert not is_silent(core.reconstruct(s.point, bare, outward=s.normal))


def test_a_touch_across_folds_names_them():
    (r,) = touches(20, 1, 2, extent=1.0)
    assert r.message.startswith("The surface turns at three places or fewer along a curve")
    assert "use a shorter extent, move the point away from folds, or make the facets finer" in r.message


def contour(angles, steps):
    """A contour along x whose normals are at these angles (n,) in its plane, after steps (n - 1,)."""
    x = np.concatenate([[0.0], np.cumsum(steps)])
    normals = np.column_stack([np.sin(angles), np.zeros(len(x)), np.cos(angles)])
    return core.Contour(np.column_stack([x - x.mean(), np.zeros((len(x), 2))]), normals=normals)


def bends(given, noise=0.0, k=0.0):
    """The bends of contours along x and of the same along y, for a patch of this curvature in unit radius."""
    frame = core.Frame(np.zeros(3), np.eye(3))
    turned = [1, 0, 2]
    across = [
        replace(c, points=c.points[:, turned], normals=None if c.normals is None else c.normals[:, turned])
        for c in given
    ]
    return bends_of(
        [*given, *across],
        frame,
        0.5 * np.ptp(given[0].points[:, 0]),
        noise,
        np.array([0.5 * k, 0.0, 0.5 * k]),
    )


@pytest.mark.parametrize("seed", range(3))
def test_a_smooth_curve_bends_at_each_contact_however_these_are_spread(seed):
    steps = np.random.default_rng(seed).uniform(0.1, 3.0, 24)
    found = bends([contour(0.03 * np.concatenate([[0.0], np.cumsum(steps)]), steps)])
    assert found.contacts_per_bend == pytest.approx(1.0, abs=0.1)
    assert found.folded == 0.0


@pytest.mark.parametrize("count", [3, 4, 5, 6])
def test_a_circle_bends_evenly_however_few_its_contacts_are(count):
    angles = np.linspace(-0.2, 0.2, count)
    found = bends([contour(angles, np.full(count - 1, 0.1))], k=-0.1)
    assert found.folded == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("scale", [1e-3, 1.0, -40.0])
def test_a_single_fold_is_one_bend_whatever_length_and_side_normals_have(scale):
    angles = np.where(np.arange(25) < 12, 0.0, 0.2)
    found = bends([contour(angles, np.full(24, 0.1))])
    turned = contour(angles, np.full(24, 0.1))
    turned = replace(turned, normals=scale * turned.normals)
    assert found.folded == pytest.approx(0.1)  # 0.2 radians over 2 L
    covariance = found.with_few(np.zeros((3, 3)))
    assert bends([turned]).with_few(np.zeros((3, 3))) == pytest.approx(covariance)
    wanted = (3.5 / 3.0) ** 3 * 0.1
    assert 2.0 * math.sqrt(covariance[0, 0]) == pytest.approx(wanted, rel=1e-6)


def test_few_bends_add_only_what_the_fit_does_not_leave_open():
    angles = np.where(np.arange(25) < 12, 0.0, 0.2)
    found = bends([contour(angles, np.full(24, 0.1))])
    few = found.with_few(np.zeros((3, 3)))
    for share in (0.3, 0.9):
        assert found.with_few(share * few) == pytest.approx(few, rel=1e-6, abs=1e-12)
    for share in (1.0, 2.0):
        assert found.with_few(share * few) == pytest.approx(share * few, rel=1e-6, abs=1e-12)
    across = np.diag([0.0, 1.0, 0.0])  # The fit leaves nothing else open along both curves.
    assert found.with_few(across) == pytest.approx(few + across, rel=1e-6, abs=1e-12)


def test_what_the_deviation_of_normals_explains_is_no_fold():
    angles = np.random.default_rng(3).normal(0.0, 0.03, 25)
    noisy = contour(angles, np.full(24, 0.1))
    assert bends([noisy]).stds.min() > 0.004
    assert bends([replace(noisy, normal_std=0.05)]).stds == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("wide", [1, 2, 3])
def test_a_fold_of_a_curve_makes_uncertain_what_the_patch_bends_more_than_the_rest(wide):
    """The curve bends by -1 in unit radius, and the patch by -1.3. The fold is over up to three steps."""
    x = np.linspace(-1.2, 1.2, 25)
    angles = x / 1.2 + 0.2 * np.clip((np.arange(25) - 9) / wide, 0.0, 1.0)
    found = bends([contour(angles, np.diff(x))], k=-1.3)
    assert found.stds == pytest.approx([(3.5 / 3.0) ** 3 * 0.3] * 2, rel=1e-6)
    assert found.folded == pytest.approx(0.1)
    slight = bends([contour(x / 1.2 + 0.035 * (x > 0.35), np.diff(x))], k=-1.3)
    assert slight.stds == pytest.approx([(3.5 / 3.0) ** 3 * 0.105] * 2, rel=1e-6)  # 3 a / L
    even = bends([contour(x / 1.2 + 0.03 * (x > 0.35), np.diff(x))], k=-1.3)
    assert even.stds == pytest.approx([0.0] * 2, abs=1e-9)  # No surface bends as evenly as that.


@pytest.mark.parametrize("has_normals", [True, False])
def test_a_curvature_that_changes_evenly_is_no_fold(has_normals):
    """The curvature of a cubic, and that of a sextic, which has a maximum within the curve."""
    x = np.linspace(-1.0, 1.0, 25)
    for slope, height in ((x**2 + x, x**3 / 3.0 + x**2 / 2.0), (x + x**5, x**2 / 2.0 + x**6 / 6.0)):
        given = contour(-np.arctan(slope), np.diff(x))
        points = np.column_stack([x, np.zeros(25), height])
        given = replace(given, points=points, normals=given.normals if has_normals else None)
        assert bends([given], k=1.1).stds.max() < 0.05


def noisy_fold(angle, seed, noise=1e-3):
    """A curve of 97 contacts with noise and without normals that has a curvature of -1 and one fold."""
    x = np.linspace(-1.0, 1.0, 97)
    heights = -0.5 * x**2 - math.tan(math.radians(angle)) * np.maximum(x - 0.3, 0.0)
    heights += np.random.default_rng(seed).normal(0.0, noise, 97)
    return core.Contour(np.column_stack([x, np.zeros(97), heights]))


def test_noise_alone_bends_no_curve_and_a_fold_in_it_does():
    smooth = [bends([noisy_fold(0.0, seed)], 1e-3, -1.0).stds.max() for seed in range(40)]
    assert (np.array(smooth) > 0.01).sum() <= 1
    folded = [bends([noisy_fold(20.0, seed)], 1e-3, -1.2).stds.max() for seed in range(40)]
    assert (np.array(folded) > 0.1).sum() >= 38


def test_rounding_is_no_bend_and_contacts_in_one_place_are_no_fold():
    level = contour(np.where(np.arange(25) < 12, 0.0, 1e-9), np.full(24, 0.1))
    assert bends([level]).contacts_per_bend == 1.0
    steps = np.full(24, 0.1)
    steps[5] = 1e-12
    assert bends([contour(0.3 * np.linspace(-1.0, 1.0, 25), steps)]).contacts_per_bend < 1.6


def test_outlying_contacts_without_normals_are_no_folds():
    s, rng = surfaces.sphere(25.0), np.random.default_rng(1)
    contours = s.track(surfaces.planes((0, 60, 120)), noise=0.0)
    for contour in contours:
        contour.points[rng.integers(1, 8)] += 1.0 * s.normal
    r = core.reconstruct(s.point, [core.Contour(c.points) for c in contours], outward=s.normal)
    assert r.status == "ok"
    assert r.k1_std < 0.002


def test_one_normal_that_is_wrong_is_no_bend():
    angles = np.linspace(-0.3, 0.3, 25)
    wrong = angles.copy()
    wrong[7] += 0.5
    found = bends([contour(wrong, np.full(24, 0.1))])
    assert found.folded == pytest.approx(0.0, abs=1e-12)
    assert found.contacts_per_bend < 1.2


@pytest.mark.parametrize("off", [0.014, 0.02, 0.04])
def test_a_contact_that_noise_explains_in_part_is_no_fold(off):
    """It turns chords one way, twice as far back, and again; noise explains the lesser ones."""
    x = np.linspace(-1.0, 1.0, 25)
    heights = -0.5 * x**2 + off * (np.arange(25) == 15)
    found = bends([core.Contour(np.column_stack([x, np.zeros(25), heights]))], 0.002, -1.0)
    assert found.folded < 0.02
    assert found.stds.max() < 0.1


@pytest.mark.parametrize("turn", [0.2, -0.2])
@pytest.mark.parametrize(("first", "second"), [(1, 24), (24, 1)])
def test_turns_of_two_curves_are_no_outlier(first, second, turn):
    """One turns at its end, and the next back at its start."""
    one, other = (
        contour(angle * (np.arange(25) >= at), np.full(24, 0.1))
        for angle, at in ((turn, first), (-turn, second))
    )
    assert bends([one, other]).contacts_per_bend == pytest.approx(bends([one]).contacts_per_bend)


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
