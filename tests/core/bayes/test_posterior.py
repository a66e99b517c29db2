# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The Bayesian fit: its algebra, its accuracy, and wide intervals where contacts show nothing."""

from dataclasses import replace

import numpy as np
import pytest
import surfaces
from scipy.spatial.transform import Rotation

from core import Contour, SamplingPlane, explore, reconstruct, reconstruct_many, suggest_plane, track
from core.bayes import evidence, joint_fit, posterior, prior, sextic
from core.patch.monge import TERMS, monomials
from core.reconstruction import next_plane

EXTENT = 12.0


THREE = surfaces.UPRIGHT
FIVE = surfaces.planes((5, 41, 77, 113, 149))


def touched(surface, planes=THREE, noise=0.0, seed=0, extent=EXTENT, **options):
    contours = surface.track(planes, extent=extent, step=extent / 12, noise=noise, rng=seed)
    return surface.fit(contours, **options)


def test_turning_coefficients_about_the_normal_turns_the_surface():
    b, points = np.random.default_rng(0).normal(size=27), np.random.default_rng(1).normal(size=(9, 2))
    c, s = np.cos(0.7), np.sin(0.7)
    turned = monomials(points @ [[c, -s], [s, c]], TERMS) @ posterior._turn(0.7) @ b
    assert turned == pytest.approx(monomials(points, TERMS) @ b, rel=1e-9)


@pytest.mark.parametrize(("count", "freedom"), [(65, 60.0), (9, 5.0)])
def test_intervals_count_in_that_waviness_and_noise_are_estimates(count, freedom):
    flat = np.random.default_rng(0).uniform(-0.7, 0.7, (2, count))
    contacts = np.array([*flat, 0.1 * flat[0] ** 2]).T[None]
    expected, weights = prior.prior_mean(np.array([0.2]), np.zeros(1)), np.ones((1, count))
    data = sextic.sextics(contacts, weights, expected, contacts[:, :0], np.zeros(len(weights)))
    hyper = data.hyperparameters(np.array([2e-3]))
    found = sextic.posterior_given(expected, data, hyper).at(0).covariance
    precision = data.heights[0, :-1, :-1] / hyper.noise**2 + np.diag(1.0 / hyper.prior[0])
    gaussian = np.linalg.inv(precision)
    assert found == pytest.approx(freedom / (freedom - 2.0) * gaussian, rel=1e-6)


def test_the_patch_of_a_lower_degree_is_the_nearest_over_the_disk():
    rng = np.random.default_rng(2)
    mean = np.concatenate([[0.0, 0.0, 0.2, 0.0, 0.3], rng.normal(size=22)])
    whole = posterior.SurfacePosterior(mean, np.eye(28), 0.0, np.zeros((22, 22)))
    x, y = rng.uniform(-1.0, 1.0, (2, 200_000))
    inside = np.hypot(x, y) < posterior.DISK
    x, y = x[inside], y[inside]
    for degree in (3, 4, 5):
        terms = monomials(np.column_stack([x, y]), TERMS[2 : posterior.terms_to(degree)])
        fixed, basis = terms[:, :3] @ mean[2:5], terms[:, 3:]
        wanted = np.linalg.lstsq(basis, whole.height(x, y) - fixed, rcond=None)[0]
        assert whole.patch(degree).coefficients == pytest.approx(wanted, abs=0.05)
        assert [whole.patch(degree).k1, whole.patch(degree).k2] == [0.4, 0.6]
    assert whole.patch(6).coefficients == pytest.approx(mean[5:])
    assert len(whole.patch(2).coefficients) == 0


@pytest.mark.parametrize(
    ("surface", "bound", "curvature"),
    [
        (surfaces.plane(), 1e-9, 1e-9),
        (surfaces.sphere(25), 0.005, 3e-4),
        (surfaces.cylinder(20), 0.01, 6e-4),
        (surfaces.bottle_neck(), 0.01, 4e-4),
        (surfaces.pear(), 0.01, 1e-4),
        (surfaces.torus(40, 20, 0.6), 0.03, 3e-4),
        (surfaces.quartic(), 0.06, 3e-4),
        (surfaces.sine(), 0.06, 1e-3),
        (surfaces.ellipsoid(35, 25, 20, 0.6, 0.5), 0.1, 1e-3),
    ],
    ids=["plane", "sphere", "cylinder", "bottle neck", "pear", "torus", "quartic", "sine", "ellipsoid"],
)
@pytest.mark.parametrize("planes", [THREE, surfaces.TILTED], ids=["upright", "tilted"])
def test_exact_surfaces(surface, bound, curvature, planes):
    r = touched(surface, planes)
    assert surfaces.off_data(surface, r) < bound
    assert [r.patch.k1, r.patch.k2] == pytest.approx([surface.k1, surface.k2], abs=curvature)
    assert r.frame.axes[:, 2] @ surface.normal > np.cos(np.radians(0.2))
    assert r.status == "ok"


@pytest.mark.parametrize("surface", [surfaces.quartic(), surfaces.sine()], ids=["quartic", "sine"])
def test_curvatures_and_normal_converge_with_the_square_of_the_extent(surface):
    results = [touched(surface, FIVE, extent=extent, degree=6) for extent in (1.0, 0.5, 0.25)]
    misses = np.array([[r.patch.k1 - surface.k1, r.patch.k2 - surface.k2] for r in results])
    tilts = np.array([np.linalg.norm(np.cross(r.frame.axes[:, 2], surface.normal)) for r in results])
    for errors in (np.abs(misses).max(axis=1), tilts):
        assert errors[:-1] / errors[1:] == pytest.approx([4.0, 4.0], rel=0.1)


def test_noise_averages_out_and_the_frame_is_better_than_the_papers():
    s = surfaces.cylinder(20)
    worst = {"bayes": [], "tagc": []}
    for seed in range(20):
        for method, errors in worst.items():
            r = touched(s, noise=0.1, seed=seed, method=method)
            errors.append(max(abs(r.patch.k1 - s.k1), abs(r.patch.k2 - s.k2)))
    assert np.median(worst["bayes"]) < 1.4e-3
    assert np.median(worst["bayes"]) < 0.4 * np.median(worst["tagc"])


@pytest.mark.long
@pytest.mark.parametrize("planes", [THREE, surfaces.planes((13, 48, 93))], ids=["even", "uneven"])
def test_intervals_cover_surfaces_drawn_from_the_prior(planes):
    """90 % intervals of height_std, over 60 surfaces with every term to degree 6."""
    rng = np.random.default_rng(3)
    length = 10.0
    covered = []
    for seed in range(60):
        waviness = 0.6 * np.exp(0.5 * rng.normal())
        sizes = prior.PRIOR_SCALE * waviness ** (prior.ORDERS - 1.0) * rng.normal(size=27)
        b = np.where(prior.ORDERS <= 2, [0.3], 1.0) * sizes * length ** (1.0 - prior.ORDERS)
        s = surfaces.graph(dict(zip(map(tuple, TERMS[2:].tolist()), b[2:], strict=True)))
        r = touched(s, planes, noise=0.03, seed=seed, extent=length, degree=6)
        points, heights = surfaces.heights_over(s, r, 60)
        miss = np.abs(r.patch.height(*points.T) - heights)
        covered.append(np.mean(miss <= 1.645 * r.height_std(*points.T)))
    assert 0.85 < np.mean(covered) < 0.97


def test_height_std_is_that_of_the_point_there_and_grows_with_noise_and_between_the_curves():
    s = surfaces.pear()
    fine, coarse = touched(s, noise=0.01), touched(s, noise=0.3)
    assert touched(s, noise=0.0).height_std(0.0, 0.0) == 0.0
    for r, noise in ((fine, 0.01), (coarse, 0.3)):
        assert 0.1 * noise < r.height_std(0.0, 0.0) < noise
    assert touched(s, noise=0.3, point_std=0.0).height_std(0.0, 0.0) == 0.0
    assert fine.height_std(np.zeros((2, 3)), 1.0).shape == (2, 3)
    assert coarse.mean_height_std > 5 * fine.mean_height_std
    assert coarse.posterior.noise * coarse.radius > 0.25
    x, y = fine.contacts[-1, :2]
    angle = np.arctan2(y, x) + np.radians(30)
    between = fine.height_std(*(np.hypot(x, y) * np.array([np.cos(angle), np.sin(angle)])))
    assert between > 1.5 * fine.height_std(x, y)


def test_height_and_its_deviation_are_those_of_the_surface_whatever_the_degree_of_the_patch():
    s = surfaces.ellipsoid(35, 25, 20, 0.6, 0.5)
    two, six = touched(s, degree=2), touched(s, degree=6)
    assert [two.patch.k1, two.patch.k2] == [six.patch.k1, six.patch.k2]
    assert surfaces.off_data(s, two) > 2 * surfaces.off_data(s, six)
    assert two.mean_height_std == six.mean_height_std
    x, y = two.domain.grid(50)[0].T
    assert two.height(x, y) == pytest.approx(six.patch.height(x, y), abs=1e-9)
    assert np.array_equal(two.height(x, y), six.height(x, y))


@pytest.mark.parametrize(
    ("planes", "degree", "blind", "terms"),
    [
        (THREE, 4, 3, 14),
        (THREE, 6, 10, 27),
        (THREE, 3, 1, 9),
        (THREE, 2, 0, 5),
        (surfaces.planes((0, 45, 90, 135)), 4, 1, 14),
        (FIVE, 4, 0, 14),
    ],
)
def test_blind_directions_are_counted_and_named(planes, degree, blind, terms):
    """m planes through the normal hide (d - m + 1)(d - m + 2) / 2 of the terms to degree d."""
    r = touched(surfaces.torus(40, 20, 0.6), planes, noise=0.02, degree=degree)
    assert r.posterior.null_space_dimension(degree) == blind
    named = f"These planes cannot show {blind} of the {terms} ways to bend"
    assert (named in r.message) == (blind > 0)


def test_the_noise_given_is_the_least_that_is_found():
    s = surfaces.pear()
    r = touched(s, noise=0.02)
    contours = s.track(THREE, extent=EXTENT, step=EXTENT / 12, noise=0.02, rng=0)
    rough = s.fit(contours, noise=0.2)
    assert r.posterior.noise * r.radius < 0.05
    assert rough.posterior.noise * rough.radius == pytest.approx(0.2, rel=0.05)


def test_a_patch_known_to_two_hundredths_of_its_radius_at_best_is_uncertain():
    s = surfaces.plane()
    r = touched(s, noise=1.0)
    assert r.status == "uncertain"
    assert r.mean_height_std > 0.02 * r.radius
    assert "% of the radius" in r.message and "add sampling planes" in r.message


@pytest.mark.parametrize("noise", [0.0, 0.02])
def test_following_the_suggested_plane_shows_a_monkey_saddle(noise):
    """(3 x^2 y - y^3) / 900 is zero in the planes at 0, 60 and 120 degrees."""
    s = surfaces.graph({(2, 1): 3.0 / 900.0, (0, 3): -1.0 / 900.0})
    lengths = {"extent": 13.0, "step": 13.0 / 12.0, "noise": noise}
    contours = s.track(surfaces.planes((0, 60, 120)), rng=0, **lengths)
    before = s.fit(contours)
    plane, _ = suggest_plane(before)
    axes = before.frame.axes
    contours += track(s, s.point, axes[:, 2], [plane], rng=1, tangent=axes[:, 0], **lengths)
    after = s.fit(contours)
    assert surfaces.off_data(s, before) > 0.2
    assert surfaces.off_data(s, after) < 0.02


def test_many_contacts_suggest_what_fewer_of_less_noise_do(monkeypatch):
    s = surfaces.pear()
    contours = track(s, s.point, s.normal, THREE, extent=12, step=0.1, noise=0.03, rng=0)
    r = reconstruct(s.point, contours, outward=s.normal)
    plane, expected = suggest_plane(r)
    monkeypatch.setattr("core.reconstruction.next_plane.MOST_CONTACTS", 1000)
    all_of_them = suggest_plane(r)
    assert plane == all_of_them[0]
    assert expected == pytest.approx(all_of_them[1], rel=0.01)


def test_thousands_of_contacts_suggest_a_plane():
    s = surfaces.pear()
    contours = track(s, s.point, s.normal, THREE, extent=12, step=0.02)
    r = reconstruct(s.point, contours, outward=s.normal)
    assert 200 < len(r.contacts) <= 300  # they are means of 3600 contacts
    assert 0.0 < suggest_plane(r)[1] < r.mean_height_std


@pytest.mark.parametrize("surface", [surfaces.pear(), surfaces.torus(40, 20, 0.6)], ids=["pear", "torus"])
def test_the_suggested_plane_brings_what_was_expected_and_no_other_much_more(surface):
    contours = surface.track(THREE, noise=0.03, rng=0)
    before = surface.fit(contours, degree=6)
    plane, expected = suggest_plane(before)
    axes = before.frame.axes

    def after(azimuth):
        lengths = {"extent": 12, "step": 1, "noise": 0.03, "tangent": axes[:, 0]}
        more = track(surface, surface.point, axes[:, 2], [SamplingPlane(azimuth)], rng=1, **lengths)
        r = surface.fit(contours + more, degree=6)
        return r.mean_height_std

    assert expected < 0.8 * before.mean_height_std
    assert after(plane.azimuth) == pytest.approx(expected, rel=0.3)
    others = [after(a) for a in np.radians(np.arange(0.0, 180.0, 15.0))]
    assert after(plane.azimuth) < 1.15 * min(others)


def test_the_degree_is_what_the_contacts_show():
    assert touched(surfaces.plane(), degree="auto").patch.degree == 2
    assert touched(surfaces.plane(), noise=0.05, degree="auto").patch.degree == 2
    assert touched(surfaces.sphere(25), degree="auto").patch.degree == 4
    wavy = surfaces.graph({(2, 0): -0.02, (0, 2): 0.01, (5, 0): 4e-6, (6, 0): -3e-7})
    assert touched(wavy, FIVE, degree="auto").patch.degree == 6
    assert touched(surfaces.sphere(25), method="quadratic-variation", degree="auto").patch.degree == 4


@pytest.mark.parametrize("surface", [surfaces.pear(), surfaces.bottle_neck(), surfaces.plane()])
def test_one_contact_in_twenty_off_by_a_millimeter_does_not_double_the_error(surface):
    rng = np.random.default_rng(5)
    clean, spoilt, unweighted = [], [], []
    for seed in range(10):
        contours = surface.track(THREE, noise=0.02, rng=seed)
        clean.append(surfaces.off_data(surface, surface.fit(contours)))
        for _ in range(4):
            c, k = rng.integers(3), rng.choice(np.delete(np.arange(25), 12))
            points = contours[c].points.copy()
            points[k] += rng.choice([-1.0, 1.0]) * contours[c].normals[k]
            contours[c] = Contour(points, noise=0.02, normals=contours[c].normals)
        spoilt.append(surfaces.off_data(surface, surface.fit(contours)))
        quadric = surface.fit(contours, method="quadratic-variation", weight=1e5)
        unweighted.append(surfaces.off_data(surface, quadric))
    assert np.median(spoilt) < 1.5 * np.median(clean)
    assert np.max(np.divide(spoilt, clean)) < 2.0
    assert np.median(unweighted) > 3 * np.median(spoilt)


@pytest.mark.parametrize("noise", [0.0, 0.02])
@pytest.mark.parametrize(
    "surface",
    [surfaces.sphere(25), surfaces.plane(), surfaces.monkey_saddle()],
    ids=["sphere", "plane", "monkey"],
)
def test_umbilics_turn_and_scale_with_the_data(surface, noise):
    contours = surface.track(THREE, extent=9, step=1, noise=noise, rng=2)
    turn, scale = Rotation.from_rotvec([0.3, 0.9, -0.4]).as_matrix(), 1e3
    one = surface.fit(contours, noise=noise)
    other = reconstruct(
        scale * turn @ surface.point,
        [Contour(scale * c.points @ turn.T) for c in contours],
        outward=turn @ surface.normal,
        noise=scale * noise,
    )
    assert other.frame.axes == pytest.approx(turn @ one.frame.axes, abs=1e-7)
    x, y = one.domain.grid(50)[0].T
    assert other.patch.height(scale * x, scale * y) / scale == pytest.approx(one.patch.height(x, y), abs=1e-7)
    assert other.height_std(scale * x, scale * y) / scale == pytest.approx(one.height_std(x, y), rel=1e-5)
    tangent = THREE[0].axes(surface.normal)[:, 0]
    assert one.frame.axes[:, 0] @ tangent > (0.0 if noise else np.cos(np.radians(0.1)))


def test_the_order_of_contacts_and_curves_makes_no_difference_but_for_the_axes_sign():
    s = surfaces.torus(40, 20, 0.6)
    contours = s.track(THREE, noise=0.02, rng=4)
    one = s.fit(contours)
    shuffled = [Contour(np.random.default_rng(0).permutation(c.points), noise=0.02) for c in contours[::-1]]
    other = s.fit(shuffled)
    assert [other.patch.k1, other.patch.k2] == pytest.approx([one.patch.k1, one.patch.k2])
    assert np.abs(np.sum(other.frame.axes * one.frame.axes, axis=0)) == pytest.approx(np.ones(3))


def test_few_contacts_are_enough_for_a_finite_answer():
    """Four curves have three contacts each, to one side of the point: 12 equations for 27 coefficients."""
    s = np.array([0.3, 0.6, 1.0])
    curves = [
        Contour(np.column_stack([s * np.cos(a), s * np.sin(a), -0.1 * s**2])) for a in (0.0, 1.0, 2.0, 4.0)
    ]
    r = reconstruct((0, 0, 0), curves, outward=(0, 0, 1))
    assert [r.patch.k1, r.patch.k2] == pytest.approx([-0.2, -0.2], abs=0.02)
    assert np.isfinite(r.height_std(*r.domain.grid(50)[0].T)).all()


def test_without_evidence_the_waviness_is_the_priors(monkeypatch):
    """The prior is log-normal about 0.6."""
    monkeypatch.setattr(evidence, "neg2_log_evidence", lambda *_: np.zeros((1, 6, 5)))
    heights = 1e-12 * np.eye(28)[None]
    found = evidence.hyperparameters(heights, np.array([9.0]), np.zeros_like(heights), np.array([0.01]))
    w = evidence.WAVINESS
    density = np.exp(-0.5 * (np.log(w / 0.6) / 0.5) ** 2)
    density /= density.sum()
    assert found.prior[0] == pytest.approx(density @ prior.prior_variances(w))
    assert found.noise == pytest.approx(np.sqrt(np.mean(0.01**2 * 4.0 ** np.linspace(0.0, 1.0, 5))), rel=1e-3)
    assert prior.prior_variances(np.array([0.6]))[0, [0, 5, -1]] == pytest.approx(
        [1e4, 0.036**2, 0.007776**2]
    )


@pytest.mark.parametrize(("ratio", "degree"), [(0.4, 3), (0.6, 5)])
def test_a_degree_will_do_whose_patch_departs_by_half_a_deviation(ratio, degree):
    """The mean has one term of degree 5, of which a cubic shows as much as a quartic."""
    rng = np.random.default_rng(7)
    contacts = np.column_stack([rng.uniform(-0.9, 0.9, (50, 2)), np.zeros(50)])
    mean = np.zeros(27)
    mean[14] = 0.1
    uncertain = posterior.SurfacePosterior(mean, np.eye(28), 0.0, np.zeros((22, 22)))
    basis = monomials(contacts, TERMS)
    off = basis @ (mean - posterior.coefficients_of(uncertain.patch(4)))
    variance = np.sum(off**2) / ratio**2 / np.sum(basis**2)
    assert replace(uncertain, root=np.sqrt(variance) * np.eye(28)).degree_shown(basis) == degree


def test_an_outlying_contact_weighs_as_under_students_distribution():
    """The weight at r deviations is (4 + 1) / (4 + r^2), so 1 at r = 1; where none is beyond 5 all are 1."""
    ratios = np.array([[0.0, 0.1, 1.0, 2.0, 0.5, 0.6, 0.2, 6.0], [0.0, 0.1, 1.0, 2.0, 0.5, 0.6, 0.2, 4.9]])
    weights = joint_fit._student_weights(2e-3 * ratios, np.ones((2, 8), dtype=bool), np.full(2, 2e-3))
    assert weights[0] == pytest.approx(5.0 / (4.0 + ratios[0] ** 2))
    assert np.array_equal(weights[1], np.ones(8))
    present = np.array([[True] * 7 + [False]])
    assert np.array_equal(joint_fit._student_weights(2e-3 * ratios[:1], present, np.full(1, 2e-3)), present)


def test_scatter_makes_contacts_outlying_beyond_five_of_its_deviations_by_the_median():
    even = np.array([[1.0, -1.0, 1.0, 1.0, 2.0, -2.0, 2.0, 12.0]]) * 0.01
    for floor in (1e-4, 2e-3):
        weights = joint_fit._student_weights(even, np.ones((1, 8), dtype=bool), np.full(1, floor))
        assert weights[0] == pytest.approx(5.0 / (4.0 + (even[0] / (1.4826 * 0.015)) ** 2))
    residuals = np.array([[1.0, -1.0, 1.0, -1.0, 1.0, -1.0, 8.0]]) * 0.01
    deviation = 1.4826 * 0.01
    weights = joint_fit._student_weights(residuals, np.ones((1, 7), dtype=bool), np.full(1, 2e-3))
    assert weights[0] == pytest.approx(5.0 / (4.0 + (residuals[0] / deviation) ** 2))
    residuals[0, -1] = 4.9 * deviation
    assert np.array_equal(
        joint_fit._student_weights(residuals, np.ones((1, 7), dtype=bool), np.full(1, 2e-3)), np.ones((1, 7))
    )


def test_the_suggested_plane_is_nearly_the_best_of_all_that_there_are():
    surface = surfaces.torus(40, 20, 0.6)
    for azimuths in ((0, 60, 120), (0, 35, 80), (10, 20, 60), (0, 45, 100), (5, 50, 140), (0, 70, 110)):
        r = touched(surface, surfaces.planes(azimuths), noise=0.03)
        points, weights = r.domain.nodes
        covariances = r.posterior.covariances_with(points / r.radius)
        count, noise = len(r.contacts) / 3, r.posterior.noise**2

        def lost_at_all(most, c=covariances, weights=weights, count=count, noise=noise):
            return next_plane._variance_reduction(c, next_plane.TRIED, most, noise * most / count) @ weights

        lost, few = lost_at_all(round(count)), lost_at_all(next_plane.FEW_CONTACTS)
        plane, _ = suggest_plane(r)
        chosen = np.argmin(np.abs(next_plane.TRIED - plane.azimuth))
        assert next_plane.TRIED[chosen] == pytest.approx(plane.azimuth)
        assert lost[chosen] > 0.97 * lost.max()
        assert few[chosen] >= (1.0 - 1e-12) * few[(chosen + np.arange(-1, 2)) % len(few)].max()


@pytest.mark.parametrize("planes", [THREE, surfaces.planes((0, 25, 70))], ids=["even", "uneven"])
def test_deviations_of_curvatures_are_those_of_surfaces_drawn_from_the_posterior(planes):
    """H = b_20 + b_02, k1 = 2 b_20, k2 = 2 b_02; K = k1 k2, with the variance of the product."""
    surface = surfaces.torus(40, 20, 0.6)
    contours = surface.track(planes, extent=EXTENT, step=EXTENT / 12, noise=0.3, rng=0)
    r = surface.fit([replace(contour, normals=None) for contour in contours])
    drawn = np.random.default_rng(8).multivariate_normal(r.posterior.mean, r.posterior.covariance, 200_000)
    k1, k2 = 2.0 * drawn[:, 2] / r.radius, 2.0 * drawn[:, 4] / r.radius
    for found, values in (
        (r.k1_std, k1),
        (r.k2_std, k2),
        (r.mean_curvature_std, (k1 + k2) / 2.0),
        (r.gaussian_curvature_std, k1 * k2),
    ):
        assert found == pytest.approx(np.std(values), rel=0.01)


@pytest.mark.parametrize(
    ("noise", "given", "share"), [(0.0, None, 0.65), (0.0156, None, 0.8), (0.0, 0.0156, 0.8), (0.1, 0.1, 1.0)]
)
def test_of_the_misfit_the_curvatures_feel_what_contacts_show_or_what_is_left_at_the_point(
    noise, given, share
):
    """In unit radius these noises are 0.0016 and 0.01, and that of a fit is 0.002 or more."""
    s, found = surfaces.sphere(25), []
    for seed in range(20):
        contours = s.track(THREE, extent=10.0, step=0.25, noise=noise, rng=seed)
        r = s.fit([replace(contour, normals=None, noise=given) for contour in contours])
        found.append(r.k1_std * r.radius / (2.0 * np.sqrt(r.posterior.covariance[2, 2])))
    assert np.mean(found) == pytest.approx(share, rel=0.04)


@pytest.mark.parametrize("k2", [-0.7, 0.0])
def test_beyond_its_sextic_a_sphere_and_a_cylinder_have_the_remainder(k2):
    x, y = np.random.default_rng(2).uniform(-0.7, 0.7, (2, 50))
    flat = 0.49 * (x**2 + (k2 / 0.7 * y) ** 2)
    exact = -flat / 0.7 / (1.0 + np.sqrt(1.0 - flat))
    of_sextic = (
        monomials(np.column_stack([x, y]), TERMS) @ prior_mean(-0.7, k2) - 0.35 * x**2 + 0.5 * k2 * y**2
    )
    assert prior.remainder(x, y, -0.7, k2) == pytest.approx(exact - of_sextic, abs=1e-14)


@pytest.mark.parametrize("noise", [0.0, 0.02])
def test_deviations_hold_where_curves_go_so_far_around_a_cylinder_that_no_sextic_follows(noise):
    s, off = surfaces.cylinder(20.0), []
    for farthest in (15.0, 20.0, 30.0):
        for seed in range(6):
            turn = np.random.default_rng(seed).uniform(0.0, 180.0)
            planes = surfaces.planes(turn + np.array([0.0, 60.0, 120.0]))
            r = explore(s, s.point, s.normal, planes, farthest=farthest, noise=noise, rng=seed).result
            assert r.status == "ok"
            off.append(abs(r.k1 - s.k1) / r.k1_std)
    assert np.mean(np.array(off) <= 1.645) >= 0.9
    assert max(off) <= 2.0


def prior_mean(k1, k2):
    """The prior means of the coefficients of one surface."""
    return prior.prior_mean(np.array([k1]), np.array([k2]))[0]


@pytest.mark.parametrize("k", [-0.7, 0.4])
def test_the_priors_mean_goes_on_as_spheres_and_cylinders_do(k):
    """z = (1 - sqrt(1 - k^2 r^2)) / k is k r^2 / 2 + k^3 r^4 / 8 + k^5 r^6 / 16 and more."""
    rng = np.random.default_rng(1)
    points = rng.uniform(-1.0, 1.0, (20, 2))
    (x, y), terms = points.T, monomials(points, TERMS)
    for pair, square in (((k, k), x**2 + y**2), ((k, 0.0), x**2), ((0.0, k), y**2)):
        wanted = k**3 * square**2 / 8.0 + k**5 * square**3 / 16.0
        assert terms @ prior_mean(*pair) == pytest.approx(wanted, rel=1e-9)
    assert np.array_equal(prior_mean(-3.0, 2.0), prior_mean(-1.0, 1.0))


@pytest.mark.parametrize(("k1", "k2"), [(-0.6, 0.3), (0.2, 0.5)])
def test_the_priors_mean_between_is_that_of_a_surface_that_goes_on_and_of_a_torus(k1, k2):
    """The quartic terms are those of Q |grad Q|^2 / 4, the sextic ones those of Q |grad Q|^4 / 8."""
    mean = prior_mean(k1, k2)
    assert mean[9:14] == pytest.approx([k1**3 / 8, 0.0, (k1 * k2**2 + k2 * k1**2) / 8, 0.0, k2**3 / 8])
    a, b = k1**2, k2**2
    x, y = 0.3, -0.7
    whole = (k1 * x**2 + k2 * y**2) / 2.0 * (a * x**2 + b * y**2) ** 2 / 8.0
    assert monomials(np.array([[x, y]]), TERMS[20:]) @ mean[20:] == pytest.approx([whole])


def test_the_suggested_plane_is_measured_as_the_contours_were_tracked():
    s = surfaces.pear()
    r = s.fit(s.track(surfaces.planes((0, 60, 120))))
    plane, expected = suggest_plane(r)
    d1, _, n = r.frame.axes.T
    along = plane.axes(n, d1)[:, 0]
    assert plane.direction == pytest.approx(along)
    for tangent in (None, (0.3, -1.0, 0.2)):
        other, same = suggest_plane(r, s.normal, tangent)
        assert same == expected
        assert other.direction == plane.direction
        t = other.axes(s.normal, tangent)[:, 0]
        assert abs(np.cross(t, along) @ s.normal) < 1e-3  # the fit's normal is not quite the true one


@pytest.mark.parametrize("step", [1.0, 4.0, 0.25])
def test_what_is_expected_of_a_plane_is_the_posterior_with_its_contacts_added(step):
    """The plane has as many contacts as each curve, or in place of more than 24, 24 means with less noise."""
    s = surfaces.torus(40, 20, 0.6)
    r = s.fit(s.track(THREE, step=step, noise=0.05, rng=1))
    plane, expected = suggest_plane(r)
    count = round(len(r.contacts) / 3)
    few = min(count, 24)
    t = np.linspace(-1.0, 1.0, few)[:, None] * [np.cos(plane.azimuth), np.sin(plane.azimuth)]
    basis = np.column_stack([monomials(t, TERMS), np.ones(few)])
    noise, root = r.posterior.noise**2 * few / count, r.posterior.root
    after = np.linalg.inv(np.linalg.inv(root.T @ root) + basis.T @ basis / noise)
    points, weights = r.domain.nodes
    over = np.column_stack([monomials(points / r.radius, TERMS), np.ones(len(points))])
    stds = np.sqrt(np.einsum("ni,ij,nj->n", over, after, over))
    assert expected == pytest.approx(r.radius * weights @ stds, rel=1e-5)


def test_a_height_at_the_origin_that_is_open_varies_with_the_terms():
    """The level and the 27 coefficients are one Gaussian of 28."""
    root = np.random.default_rng(4).normal(size=(28, 28))
    some = posterior.SurfacePosterior(np.zeros(27), root, np.array(0.1), np.zeros((22, 22)))
    points = np.random.default_rng(5).uniform(-1.0, 1.0, (9, 2))
    basis = np.column_stack([monomials(points, TERMS), np.ones(9)])
    wanted = basis @ root.T @ root @ basis.T
    assert some.height_std(*points.T) ** 2 == pytest.approx(wanted.diagonal())
    assert some.covariances_with(points)(points)[0] == pytest.approx(wanted)


def test_a_stack_whose_touches_settle_one_after_the_other_gives_what_single_fits_give():
    s = surfaces.torus(40, 20, 0.6)
    clean = s.track(THREE, noise=0.02, rng=0)
    points = clean[1].points.copy()
    points[[3, 20]] += [[1.0], [-0.7]] * clean[1].normals[[3, 20]]
    touches = [[clean[0], Contour(points, noise=0.02), clean[2]], clean]
    found = reconstruct_many([s.point] * 2, touches, outward=[s.normal] * 2)
    for one, contours in zip(found, touches, strict=True):
        other = s.fit(contours)
        assert [one.patch.k1, one.patch.k2] == pytest.approx([other.patch.k1, other.patch.k2], abs=1e-9)
        assert one.mean_height_std == pytest.approx(other.mean_height_std, rel=1e-6)
