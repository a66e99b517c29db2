# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Measured normals as slopes in the Bayesian fit: they show what curves without normals cannot."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
import surfaces
from scipy.spatial.transform import Rotation

from core import Contour, reconstruct, reconstruct_many
from core.bayes import evidence, posterior, prior, sextic
from core.bayes.kernel import kernel, places_factor
from core.bayes.normals import contradiction, measured_normals, scatter, slope_equations
from core.bayes.process_fit import process_data, process_posterior
from core.contours.local_geometry import Frame
from core.patch.monge import TERMS, monomials

PLANES = surfaces.planes((0, 60, 120))
HIDDEN = surfaces.graph({(2, 1): 3.0 / 900.0, (0, 3): -1.0 / 900.0})  # zero in these planes
EXACT = [
    surfaces.pear(),
    surfaces.torus(40, 20, 0.6),
    surfaces.quartic(),
    surfaces.bottle_neck(),
    surfaces.sine(),
    surfaces.monkey_saddle(),
    HIDDEN,
]


@cache
def touched(surface, noise=0.0, seed=0):
    return surface.track(PLANES, noise=noise, rng=seed)


def measured(contours, std, seed=0):
    """Contours with measured normals, which have Gaussian noise in the two directions across them."""
    rng = np.random.default_rng(seed)
    found = []
    for c in contours:
        off = rng.normal(0.0, std, c.normals.shape)
        off -= np.sum(off * c.normals, axis=1, keepdims=True) * c.normals
        found.append(replace(c, normals=c.normals + off, normal_std=std))
    return found


def same(one, other, rel=1e-9):
    assert other.frame.axes == pytest.approx(one.frame.axes, abs=rel)
    assert other.patch.coefficients == pytest.approx(one.patch.coefficients, rel=rel, abs=1e-12)
    assert other.posterior.covariance == pytest.approx(one.posterior.covariance, rel=rel, abs=1e-12)


@pytest.mark.parametrize(("noise", "std"), [(0.0, 0.0), (0.02, 0.01), (0.05, 0.05)])
def test_a_monkey_saddle_hidden_from_its_planes_shows_in_normals(noise, std):
    contours = touched(HIDDEN, noise)
    fits = (HIDDEN.fit(c, degree=4) for c in (contours, measured(contours, std)))
    without, with_normals = fits
    assert (without.null_space_dimension, with_normals.null_space_dimension) == (3, 0)
    assert "cannot show" not in with_normals.message
    assert surfaces.off_data(HIDDEN, with_normals) < 0.1 * surfaces.off_data(HIDDEN, without)


@pytest.mark.parametrize("surface", EXACT[:5], ids=["pear", "torus", "quartic", "neck", "sine"])
def test_good_normals_make_no_surface_worse(surface):
    contours = touched(surface, 0.05)
    without, with_normals = surface.fit(contours), surface.fit(measured(contours, 0.01))
    assert surfaces.off_data(surface, with_normals) < 1.1 * surfaces.off_data(surface, without)
    assert with_normals.mean_height_std < without.mean_height_std


def test_noise_in_normals_is_counted():
    """90 % intervals over seven surfaces, three noises and four seeds."""
    covered = []
    for surface in EXACT:
        for noise, std in ((0.05, 0.01), (0.05, 0.05), (0.1, 0.05)):
            for seed in range(4):
                r = surface.fit(measured(touched(surface, noise, seed), std, seed))
                points, heights = surfaces.heights_over(surface, r, 60)
                miss = np.abs(r.patch.height(*points.T) - heights)
                covered.append(np.mean(miss <= 1.645 * r.height_std(*points.T)))
    assert 0.85 < np.mean(covered) < 0.97


def test_the_worse_the_normals_the_less_they_count():
    contours = touched(HIDDEN, 0.02)
    stds = [HIDDEN.fit(measured(contours, std)).mean_height_std for std in (0.01, 0.05, 0.2)]
    assert stds[0] < stds[1] < stds[2]
    useless = HIDDEN.fit([replace(c, normal_std=1e3) for c in contours])
    assert useless.patch.height(5.0, 5.0) == pytest.approx(
        HIDDEN.fit(contours).patch.height(5.0, 5.0), abs=1e-3
    )


def test_without_a_deviation_normals_change_nothing():
    surface = surfaces.pear()
    contours = touched(surface, 0.05)
    bare = [replace(c, normals=None) for c in contours]
    one, other = surface.fit(contours), surface.fit(bare)
    assert np.array_equal(one.posterior.covariance, other.posterior.covariance)
    assert np.array_equal(one.patch.coefficients, other.patch.coefficients)


@pytest.mark.parametrize("method", ["tagc", "quadratic-variation", "least-squares"])
def test_the_papers_methods_ignore_them(method):
    surface = surfaces.pear()
    contours = touched(surface, 0.05)
    one, other = (surface.fit(c, method=method) for c in (contours, measured(contours, 0.01)))
    assert np.array_equal(one.patch.coefficients, other.patch.coefficients)
    assert one.mean_height_std == other.mean_height_std


def test_touches_with_and_without_normals_in_one_call_are_as_single_ones():
    surface = surfaces.torus(40, 20, 0.6)
    contours = touched(surface, 0.05)
    some = [*measured(contours[:1], 0.02), *contours[1:]]
    touches = [contours, measured(contours, 0.02), some, contours]
    results = reconstruct_many([surface.point] * 4, touches, outward=[surface.normal] * 4)
    for r, c in zip(results, touches, strict=True):
        same(surface.fit(c), r)
    assert results[2].mean_height_std < results[0].mean_height_std


def test_they_turn_and_scale_with_the_contacts():
    surface = surfaces.torus(40, 20, 0.6)
    contours = measured(touched(surface, 0.05), 0.03)
    turn = Rotation.from_rotvec([0.3, 0.9, -0.4]).as_matrix()
    moved = [
        Contour(1e3 * c.points @ turn.T, normals=7.0 * c.normals @ turn.T, noise=50.0, normal_std=0.03)
        for c in contours
    ]
    one = surface.fit(contours)
    other = reconstruct(1e3 * turn @ surface.point, moved, outward=turn @ surface.normal)
    assert other.frame.axes == pytest.approx(turn @ one.frame.axes, abs=1e-7)
    x, y = one.domain.grid(50)[0].T
    assert other.patch.height(1e3 * x, 1e3 * y) / 1e3 == pytest.approx(one.patch.height(x, y), abs=1e-7)
    assert other.height_std(1e3 * x, 1e3 * y) / 1e3 == pytest.approx(one.height_std(x, y), rel=1e-5)


def test_the_order_and_the_side_of_normals_make_no_difference():
    surface = surfaces.pear()
    contours = measured(touched(surface, 0.05), 0.03)
    order = np.random.default_rng(1).permutation(25)
    side = np.random.default_rng(2).choice([-1.0, 1.0], (25, 1))
    shuffled = [replace(c, points=c.points[order], normals=(side * c.normals)[order]) for c in contours]
    one, other = surface.fit(contours), surface.fit(shuffled)
    assert np.abs(np.sum(other.frame.axes * one.frame.axes, axis=0)) == pytest.approx(np.ones(3))
    assert other.mean_height_std == pytest.approx(one.mean_height_std)


def test_slopes_are_the_derivatives_of_the_heights():
    """The coefficients of a surface satisfy the equations of its normals, here from finite differences."""
    rng = np.random.default_rng(3)
    local, b, h = rng.uniform(-0.8, 0.8, (1, 9, 3)), 0.2 * rng.normal(size=27), 1e-6
    x, y, _ = local[0].T

    def height(x, y):
        return monomials(np.stack([x, y], axis=-1), TERMS) @ b

    dx = (height(x + h, y) - height(x - h, y)) / (2.0 * h)
    dy = (height(x, y + h) - height(x, y - h)) / (2.0 * h)
    normals = np.column_stack([-dx, -dy, np.ones(9)])
    normals /= 0.05 * np.linalg.norm(normals, axis=1, keepdims=True)
    slopes, steepness = slope_equations(normals[None], local, np.ones((1, 9)))
    assert slopes[0] @ b == pytest.approx(steepness[0], abs=1e-6)
    up = np.column_stack([dx, dy, -np.ones(9)])
    # A change of slope counts by the angle by which it turns the normal, in units of 0.05 radians.
    for direction in rng.normal(size=(5, 27)):
        misses = slopes[0] @ (1e-5 * direction)
        change = np.column_stack([
            (monomials(local[0] + side, TERMS) - monomials(local[0] - side, TERMS)) @ direction
            for side in h * np.eye(3)[:2]
        ]) / (2.0 * h)  # fmt: skip
        turned = np.column_stack([up[:, :2] + 1e-5 * change, -np.ones(9)])
        cross = np.linalg.norm(np.cross(up, turned), axis=1)
        angles = cross / np.linalg.norm(up, axis=1) / np.linalg.norm(turned, axis=1)
        assert np.hypot(misses[:9], misses[9:]) == pytest.approx(angles / 0.05, rel=1e-3, abs=1e-9)


def test_the_evidence_is_that_of_heights_and_slopes_under_a_normal_distribution():
    """Differences of -2 log likelihood over the grid are those of the dense covariances."""
    rng = np.random.default_rng(4)
    local = np.column_stack([rng.uniform(-0.9, 0.9, (60, 2)), 0.02 * rng.normal(size=60)])[None]
    normals = np.array([0.0, 0.0, 50.0]) + rng.normal(size=(1, 60, 3))
    weights, noises = np.ones((1, 60)), np.array([[2e-3, 9e-3]])
    data = sextic.sextics(local, weights, np.zeros((1, 27)), normals, np.zeros(1))
    variances = np.minimum(prior.prior_variances(np.array([0.4, 0.9])), 100.0)
    slopes, steepness = (part[0] for part in slope_equations(normals, local, weights))
    heights, basis = local[0, :, 2], np.vstack([monomials(local[0], TERMS), slopes])
    for both in (True, False):
        count = 180 if both else 60
        some = data.heights, data.counts, both * data.slopes
        found = evidence.neg2_log_evidence(*some, variances, noises)[0]
        wanted = np.empty((2, 2))
        for (w, i), _ in np.ndenumerate(wanted):
            white = np.repeat([noises[0, i] ** 2, 1.0], [60, 120])
            covariance = ((basis * variances[w]) @ basis.T + np.diag(white))[:count, :count]
            felt = np.append(heights, steepness)[:count]
            wanted[w, i] = np.linalg.slogdet(covariance)[1] + felt @ np.linalg.solve(covariance, felt)
        assert found - found[0, 0] == pytest.approx(wanted - wanted[0, 0], rel=1e-6, abs=1e-4)


def tilted(surface, contours, degrees):
    """Contours with all normals turned about one axis, across the normal at the point."""
    axis = np.cross(surface.normal, [0.48, -0.6, 0.64])
    turn = Rotation.from_rotvec(np.radians(degrees) * axis / np.linalg.norm(axis)).as_matrix()
    return [replace(c, normals=c.normals @ turn.T) for c in contours]


def contradicts(r):
    return "measured normals contradict the contacts" in r.message


@pytest.mark.parametrize("std", [0.0, 0.02])
def test_normals_in_another_frame_than_the_contacts_are_reported(std):
    for number, surface in enumerate(EXACT):
        contours = measured(touched(surface, 0.02, number), std, number)
        for degrees in (-5.0, 5.0):
            r = surface.fit(tilted(surface, contours, degrees))
            assert (r.status, contradicts(r)) == ("uncertain", True)
            angle = float(r.message.split(" by ")[1].split(" degrees")[0])
            assert angle == pytest.approx(5.0, rel=0.25)
    assert "check the frame they were measured in or leave them out" in r.message


def test_mirrored_normals_are_reported_though_they_are_right_in_the_mean():
    surface = surfaces.sphere(35)
    contours = touched(surface, 0.02)
    axes = surface.fit(contours).frame.axes
    mirror = np.eye(3) - 2.0 * np.outer(axes[:, 0], axes[:, 0])
    assert contradicts(
        surface.fit([replace(c, normals=c.normals @ mirror, normal_std=0.02) for c in contours])
    )


@pytest.mark.parametrize("std", [0.0, 0.02, 0.05])
def test_right_normals_are_not_doubted(std):
    for surface in EXACT:
        for noise in (0.0, 0.1):
            for seed in range(5):
                assert not contradicts(surface.fit(measured(touched(surface, noise, seed), std, seed)))


def test_normals_that_only_scatter_more_than_was_said_contradict_nothing():
    """Normals of a texture are like that."""
    surface = surfaces.pear()
    for seed in range(20):
        contours = [replace(c, normal_std=0.02) for c in measured(touched(surface, 0.02), 0.1, seed)]
        assert not contradicts(surface.fit(contours))


def scattered(r):
    return "measured normals are off the curves" in r.message


@pytest.mark.parametrize("std", [0.005, 0.01, 0.02, 0.05, 0.1])
def test_random_normals_are_reported(std):
    for number, surface in enumerate(EXACT):
        for seed in range(3):
            rng = np.random.default_rng([number, seed])
            contours = [
                replace(c, normals=rng.normal(size=c.normals.shape), normal_std=std)
                for c in touched(surface, 0.05, seed)
            ]
            r = surface.fit(contours)
            assert r.status == "uncertain"
            assert scattered(r) or contradicts(r)
            assert r.normal_scatter[0] > 3.0


@pytest.mark.parametrize("std", [0.01, 0.05])
def test_normals_that_are_mirrored_at_every_second_contact_are_reported(std):
    for seed, surface in enumerate((surfaces.sphere(20), surfaces.torus(40, 15, 0.6), surfaces.cylinder(15))):
        up, contours = surface.normal, []
        for c in measured(touched(surface, 0.05, seed), std, seed):
            normals = c.normals.copy()
            normals[::2] = 2.0 * np.outer(normals[::2] @ up, up) - normals[::2]
            contours.append(replace(c, normals=normals))
        r = surface.fit(contours)
        assert (r.status, scattered(r) or contradicts(r)) == ("uncertain", True)


def test_right_normals_of_a_texture_are_not_doubted():
    """Waves that contacts follow tilt the normals by up to 0.35 radians, many times their deviation."""
    tilts = []
    for length in (4.0, 6.0, 9.0):
        for seed in range(4):
            p, phase = 2.0 * np.pi / length, 1.7 * seed
            surface = surfaces.Exact(
                lambda x, y, z, p=p, phase=phase: (
                    z + 0.015 * (x**2 + y**2) - 0.2 * (np.cos(p * x + phase) + np.cos(p * y))
                ),
                lambda q, p=p, phase=phase: np.array(
                    [
                        0.03 * q[0] + 0.2 * p * np.sin(p * q[0] + phase),
                        0.03 * q[1] + 0.2 * p * np.sin(p * q[1]),
                        1.0,
                    ]
                ),
                np.array([0.0, 0.0, 0.2 * (np.cos(phase) + 1.0)]),
                0.0,
                0.0,
            )
            contours = surface.track(PLANES, step=0.5, rng=seed)
            tilts.append(max(np.arccos(np.abs(c.normals[:, 2])).max() for c in contours))
            for std in (0.02, 0.05):
                assert not scattered(surface.fit(measured(contours, std, seed)))
    assert max(tilts) > 0.35


@pytest.mark.long
def test_normals_of_a_texture_that_noise_hides_make_fits_hardly_surer_than_they_are():
    """With noise of 1 % of the radius contacts ask for no process, and a sextic does not follow the waves."""
    off, step = [], 1e-5
    for seed in range(60, 160):
        rng = np.random.default_rng(seed)
        height, contours, curves = surfaces.wavy(rng, rough=True), [], 4 + seed % 2
        for azimuth in np.pi / curves * np.arange(curves) + rng.uniform(0.0, 7.0):
            t = np.sort(rng.uniform(-1.0, 1.0, 100))
            x, y = t * np.cos(azimuth), t * np.sin(azimuth)
            slopes = height(x + step, y) - height(x - step, y), height(x, y + step) - height(x, y - step)
            normals = np.column_stack([*(-slope / (2.0 * step) for slope in slopes), np.ones(100)])
            normals = normals / np.linalg.norm(normals, axis=1)[:, None] + rng.normal(0.0, 0.01, (100, 3))
            points = np.column_stack([x, y, height(x, y)]) + rng.normal(0.0, 0.01, (100, 3))
            contours.append(Contour(points, normals=normals, normal_std=0.01))
        r = reconstruct((0, 0, 0), contours, outward=(0, 0, 1))
        if r.status == "ok":
            x, y = r.domain.grid(200)[0].T
            there = r.frame.to_world(np.column_stack([x, y, r.height(x, y)]))
            off.append(np.mean(np.abs(there[:, 2] - height(*there[:, :2].T)) / r.height_std(x, y)))
    # Errors of neighboring normals are alike, which no deviation counts.
    assert len(off) > 7
    assert np.max(off) < 6.0


def test_scatter_is_counted_along_the_curves_in_radians_and_deviations():
    rng = np.random.default_rng(3)
    contacts = np.column_stack([rng.uniform(-0.8, 0.8, (40, 2)), np.zeros(40)])
    ahead = contacts[:, :2] / np.linalg.norm(contacts[:, :2], axis=1, keepdims=True)
    slopes, turn = 0.3 * ahead, np.arctan(0.3) + np.where(np.arange(40) % 2, 0.2, -0.2)
    along = np.column_stack([-np.sin(turn)[:, None] * ahead, np.cos(turn)])
    across = np.column_stack([-ahead[:, 1], ahead[:, 0], np.zeros(40)])
    normals = along + 0.5 * across  # A lean across the curve makes no difference in the plane of the curve.
    found = scatter(contacts, along / 0.05, slopes)
    assert found == pytest.approx((4.0, 0.2))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    assert scatter(contacts, normals / 0.05, slopes)[1] == pytest.approx(
        np.arcsin(np.sin(0.2) / np.hypot(1.0, 0.5))
    )
    assert scatter(contacts, along / 1e-6, slopes)[0] == pytest.approx(20.0)


def test_too_few_normals_contradict_nothing():
    surface = surfaces.pear()
    r = surface.fit(touched(surface, 0.02))
    contacts = r.contacts / r.radius
    for count, contradicts in ((0, False), (2, False), (30, True)):
        normals = np.tile([60.0, 0.0, 80.0], (count, 1))
        deviations, angle = contradiction(contacts[:count], normals, r.posterior)
        assert (deviations > 5.0, angle > 0.5) == (contradicts, contradicts)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"normal_std": 0.1}, "normal_std: expected the measured normals that it belongs to, got none"),
        (
            {"normal_std": -0.1, "normals": np.ones((3, 3))},
            "normal_std: expected a finite number of 0 or more",
        ),
        ({"normal_std": np.nan, "normals": np.ones((3, 3))}, "normal_std: expected a finite number"),
        ({"normal_std": 0.1, "normals": np.ones((2, 3))}, r"normals: expected shape \(3, 3\), got \(2, 3\)"),
        ({"normal_std": 0.1, "normals": np.full((3, 3), np.nan)}, "normals: expected finite numbers"),
        (
            {"normal_std": 0.1, "normals": [[0, 0, 1], [0, 0, 0], [0, 0, 1]]},
            r"expected directions .* got \(0, 0, 0\)",
        ),
    ],
)
def test_normals_that_are_none_are_refused_with_a_sentence(options, words):
    with pytest.raises(ValueError, match=words):
        Contour(np.eye(3), **options)


def test_normals_of_any_length_and_along_the_tangent_plane_leave_finite_numbers():
    surface = surfaces.pear()
    contours = touched(surface)
    for normals in (
        np.full_like(contours[0].normals, 1.7e308),
        1e300 * contours[0].normals,
        1e-300 * contours[0].normals,
        contours[0].points - surface.point + 1e-9,
    ):
        odd = [replace(contours[0], normals=normals, normal_std=0.01), *contours[1:]]
        r = surface.fit(odd)
        assert np.isfinite(r.patch.coefficients).all()
        assert np.isfinite(r.mean_height_std)


def test_no_normal_is_taken_for_better_than_a_hundredth_of_a_radian():
    rng = np.random.default_rng(5)
    local, weights = rng.uniform(-0.8, 0.8, (1, 9, 3)), np.ones((1, 9))
    normals = rng.normal([0.0, 0.0, 4.0], 1.0, (1, 9, 3))
    normals /= np.linalg.norm(normals, axis=2, keepdims=True)
    best, limit, worse = (slope_equations(c * normals, local, weights) for c in (1e5, 100.0, 50.0))
    for one, other, half in zip(best, limit, worse, strict=True):
        assert one == pytest.approx(other, rel=1e-12)
        assert half == pytest.approx(0.5 * other, rel=1e-12)


def test_a_contradiction_is_counted_in_deviations_of_the_mean_and_in_radians():
    """Contacts determine a plane; each normal is good to 0.02 radians, and all lean by 0.03."""
    rng = np.random.default_rng(9)
    contacts = np.column_stack([rng.uniform(-0.8, 0.8, (40, 2)), np.zeros(40)])
    known = posterior.SurfacePosterior(np.zeros(27), 1e-6 * np.eye(28), np.array(1e-3), np.zeros((22, 22)))
    lean = np.array([np.sin(0.03) * 0.6, np.sin(0.03) * 0.8, np.cos(0.03)])
    deviations, angle = contradiction(contacts, np.tile(lean / 0.02, (40, 1)), known)
    assert deviations == pytest.approx(0.03 / 0.02 * np.sqrt(40.0), rel=1e-3)
    assert angle == pytest.approx(0.03, rel=1e-3)
    scattered = np.tile(lean / 0.02, (40, 1)) + 3.0 * rng.normal(size=(40, 3))
    assert contradiction(contacts, scattered, known)[0] < 0.6 * deviations


def test_of_contours_without_normals_there_are_none():
    contacts, normals = measured_normals([Contour(np.eye(3))], Frame(np.zeros(3), np.eye(3)), 1.0)
    assert contacts.shape == normals.shape == (0, 3)


def test_normals_show_the_slopes_of_the_process_too():
    """The posterior is that of a dense Gaussian process whose slopes at the contacts are observed."""
    rng, step = np.random.default_rng(2), 1e-4
    flat, noise, variances = rng.uniform(-0.7, 0.7, (40, 2)), 2e-3, np.array([4e-4, 9e-4])
    contacts = np.column_stack([flat, 0.05 * np.sin(3.0 * flat[:, 0])])
    normals = np.column_stack([-0.15 * np.cos(3.0 * flat[:, 0]), np.zeros(40), np.ones(40)]) / 0.03
    touch = process_data(contacts, np.ones(40), normals, np.arange(40))
    of_terms = prior.prior_variances(np.array(prior.USUAL_WAVINESS))
    hyper = evidence.Hyperparameters(of_terms, noise, variances)
    found = process_posterior(touch, hyper, np.zeros((22, 22)))

    def features(p):
        """Terms and whitened covariances with the contacts: the places carry the process."""
        factor = places_factor(kernel(flat, flat, variances))
        return np.column_stack([monomials(p, TERMS), np.linalg.solve(factor, kernel(flat, p, variances)).T])

    def slopes(axis):
        return (features(flat + step * axis) - features(flat - step * axis)) / (2.0 * step)

    partials = np.array([slopes(np.array([1.0, 0.0])), slopes(np.array([0.0, 1.0]))])[:, None]
    rows, steepness = slope_equations(normals[None], contacts[None], np.ones((1, 40)), partials)
    basis = np.vstack([features(flat) / noise, rows[0]])
    felt = np.append(contacts[:, 2] / noise, steepness[0])
    covariance = np.linalg.inv(basis.T @ basis + np.diag(np.append(1.0 / of_terms, np.ones(40))))
    over = rng.uniform(-0.7, 0.7, (30, 2))
    assert found.height(*over.T) == pytest.approx(features(over) @ covariance @ basis.T @ felt, abs=1e-6)
    left = kernel(over, over, variances) - (f := features(over))[:, 27:] @ f[:, 27:].T + f @ covariance @ f.T
    assert found.covariances_with(over)(over)[0] == pytest.approx(left, abs=1e-7)
