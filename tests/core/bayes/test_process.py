# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The process of real surfaces: its algebra, its intervals, and that exact surfaces have none."""

import itertools
import json

import numpy as np
import pytest
import surfaces
from scipy.spatial.transform import Rotation

from core import (
    Contour,
    from_dict,
    reconstruct,
    reconstruct_many,
    suggest_plane,
    to_dict,
)
from core.bayes import evidence, kernel, process_fit
from core.bayes.kernel import weighted_kernel
from core.bayes.posterior import DISK, QUARTIC_SHARE, nodes
from core.bayes.prior import USUAL_WAVINESS, prior_variances
from core.bayes.process_fit import process_data, process_posterior
from core.patch.monge import TERMS, exponents, monomials
from core.reconstruction.next_plane import TRIED, _variance_reduction

EXTENT = 12.0
OUTWARD = np.array([0.0, 0.0, 1.0])
REACHES = np.linspace(-1.0, 1.0, 25)


def rough(seed, size=0.02):
    """Heights at points (n, 2) in units of the radius: a quadric plus a Matern process of order 3/2."""
    rng = np.random.default_rng(seed)
    waves = rng.normal(size=(400, 2)) * np.sqrt(3.0 / rng.chisquare(3.0, (400, 1))) / 0.5
    phases, k = rng.uniform(0.0, 2.0 * np.pi, 400), rng.uniform(-0.5, 0.5, 2)

    def height(p):
        texture = np.sqrt(2.0 / 400.0) * size * np.cos(p @ waves.T + phases).sum(axis=1)
        return p**2 @ k / 2.0 + texture

    at_origin = height(np.zeros((1, 2)))
    return lambda p: height(np.asarray(p)) - at_origin


def contours_of(height, azimuths=(0, 60, 120), noise=0.0, seed=0):
    rng, contours = np.random.default_rng(seed), []
    for azimuth in np.radians(azimuths):
        flat = REACHES[:, None] * [np.cos(azimuth), np.sin(azimuth)]
        z = height(flat) + noise * rng.normal(size=len(flat)) * (REACHES != 0.0)
        contours.append(Contour(EXTENT * np.column_stack([flat, z]), noise=EXTENT * noise))
    return contours


def touched(seed=0, **options):
    height = rough(seed)
    return height, reconstruct(np.zeros(3), contours_of(height, **options), outward=OUTWARD)


def over(r, count=60):
    return r.domain.grid(count)[0]


@pytest.mark.parametrize("lengths", [(0.4, 1.6), (0.4, 1.0), (0.5, 0.5)])
def test_kernels_are_materns_of_each_length(monkeypatch, lengths):
    monkeypatch.setattr(kernel, "LENGTHS", np.array(lengths))
    p, q = np.random.default_rng(0).uniform(-1.0, 1.0, (2, 7, 2))
    p[0] = q[0]
    for values, length in zip(kernel.kernels(p, q), lengths, strict=True):
        a = np.sqrt(3.0) / length * np.linalg.norm(p[:, None] - q, axis=2)
        assert values == pytest.approx((1.0 + a) * np.exp(-a), rel=1e-12)


@pytest.mark.parametrize("weight", [1.0, 0.3])
def test_the_mean_by_itself_is_that_of_the_posterior(weight):
    flat = np.vstack([np.outer(REACHES[::2], [np.cos(a), np.sin(a)]) for a in np.radians([0, 60, 120])])
    contacts = np.column_stack([flat, rough(3)(flat)])
    weights = np.where(np.arange(len(flat)) % 5, 1.0, weight)
    touch = process_data(contacts, np.sqrt(weights), contacts[:0], np.arange(len(weights)))
    hyper, _ = evidence.process_hyperparameters(*touch.at_places(), 1e-3, 4e-3)
    mean, alpha = process_fit._mean_given(touch, hyper, *touch.at_places())
    whole = process_posterior(touch, hyper, np.zeros((22, 22)))
    over = np.random.default_rng(1).uniform(-0.6, 0.6, (50, 2))
    heights = monomials(over, TERMS) @ mean
    heights += weighted_kernel(over, contacts[:, :2], hyper.process, alpha)
    assert whole.height(*over.T) == pytest.approx(heights, abs=1e-4)


def test_derivatives_are_those_of_the_height():
    surface, h = touched()[1].posterior, 2e-5
    rng = np.random.default_rng(0)
    # Places of the process, where its second derivatives are not smooth, other points and the origin.
    points = np.vstack([surface.places[5:8], rng.uniform(-0.7, 0.7, (9, 2)), np.zeros((1, 2))])
    x, y = points.T

    def at(dx, dy):
        return surface.height(x + dx * h, y + dy * h)

    d = surface.derivatives(x, y)
    near = {"abs": 5e-4 * np.abs(d.xx).max()}
    assert d.z == pytest.approx(at(0, 0), abs=1e-12)
    assert d.x == pytest.approx((at(1, 0) - at(-1, 0)) / (2 * h), abs=1e-6)
    assert d.y == pytest.approx((at(0, 1) - at(0, -1)) / (2 * h), abs=1e-6)
    assert d.xx == pytest.approx((at(1, 0) - 2 * at(0, 0) + at(-1, 0)) / h**2, **near)
    assert d.yy == pytest.approx((at(0, 1) - 2 * at(0, 0) + at(0, -1)) / h**2, **near)
    mixed = at(1, 1) - at(1, -1) - at(-1, 1) + at(-1, -1)
    assert d.xy == pytest.approx(mixed / (4 * h**2), **near)


@pytest.mark.parametrize("noise", [7e-4, 5e-3])
def test_mean_and_deviation_are_those_of_a_dense_gaussian_process(noise):
    _, r = touched(noise=noise)
    contacts = r.contacts / r.radius
    sizes = np.array([4e-4, 9e-4])
    touch = process_data(contacts, np.ones(len(contacts)), contacts[:0], np.arange(len(contacts)))
    variances = np.minimum(prior_variances(np.array(USUAL_WAVINESS)), evidence.MOST_VARIANCE)
    hyper = evidence.Hyperparameters(variances, noise, sizes)
    surface = process_posterior(touch, hyper, np.zeros((22, 22)))
    places, points = contacts[:, :2], over(r) / r.radius
    basis, wanted = monomials(contacts, TERMS), monomials(points, TERMS)

    def covariance(p, q, basis_p, basis_q):
        return (basis_p * variances) @ basis_q.T + kernel.kernel(p, q, sizes)

    seen = covariance(places, places, basis, basis) + noise**2 * np.eye(len(contacts))
    shared = covariance(points, places, wanted, basis)
    mean = shared @ np.linalg.solve(seen, contacts[:, 2])
    left = covariance(points, points, wanted, wanted) - shared @ np.linalg.solve(seen, shared.T)
    assert surface.height(*points.T) == pytest.approx(mean, abs=1e-5)
    assert surface.height_std(*points.T) ** 2 == pytest.approx(np.diag(left), rel=1e-2, abs=1e-8)
    assert surface.covariances_with(points)(points)[0] == pytest.approx(left, abs=1e-7)


def test_the_patch_is_that_of_the_surface_over_a_disk():
    """Its curvatures are those of a quartic fitted to the heights, and their deviations cover the truth."""
    covered = []
    for seed in range(25):
        height, r = touched(seed, azimuths=(0, 45, 90, 135))
        x, y = QUARTIC_SHARE * r.radius * nodes()[0].T / DISK
        terms, shares = exponents(0, 4), np.sqrt(nodes()[1])[:, None]
        at = shares * monomials(np.column_stack([x, y]), terms)
        b = np.linalg.lstsq(at, shares[:, 0] * r.height(x, y), rcond=None)[0][1:]
        assert [2.0 * b[2], 2.0 * b[4]] == pytest.approx([r.patch.k1, r.patch.k2], abs=0.02 / r.radius)
        assert np.hypot(b[0], b[1]) < 0.01 and abs(b[3]) < 0.02 / r.radius
        flat = r.frame.to_world(np.column_stack([x, y, r.height(x, y)]))[:, :2]
        true = r.frame.to_local(np.column_stack([flat, EXTENT * height(flat / EXTENT)]))
        at = shares * monomials(true, terms)
        b = np.linalg.lstsq(at, shares[:, 0] * true[:, 2], rcond=None)[0][1:]
        off = np.abs([2.0 * b[2] - r.patch.k1, 2.0 * b[4] - r.patch.k2])
        covered.append(off <= 1.645 * np.array([r.k1_std, r.k2_std]))
    assert 0.7 < np.mean(covered) <= 1.0


def test_a_weighted_kernel_is_the_kernel_times_weights():
    rng, sizes = np.random.default_rng(0), np.array([2e-4, 3e-4])
    p, q, weights = rng.uniform(-1.0, 1.0, (900, 2)), rng.uniform(-1.0, 1.0, (70, 2)), rng.normal(size=70)
    assert weighted_kernel(p, q, sizes, weights) == pytest.approx(
        kernel.kernel(p, q, sizes) @ weights, abs=1e-14
    )


def test_grid_points_that_are_not_tried_would_change_nothing(monkeypatch):
    few = touched(3)[1].posterior
    monkeypatch.setattr(evidence, "NEGLIGIBLE", np.inf)
    all_of_them = touched(3)[1].posterior
    assert few.variances == pytest.approx(all_of_them.variances, rel=0.01)
    assert few.noise == pytest.approx(all_of_them.noise, rel=0.01)


def test_the_point_is_a_contact_like_the_others():
    """On a rough surface, as at a vertex of a mesh, the point may be off what is around it as they are."""
    _, r = touched()
    noise = r.radius * r.posterior.noise
    assert abs(r.height(0.0, 0.0)) < 3.0 * noise
    assert 0.1 * noise < r.height_std(0.0, 0.0) <= noise


def test_a_point_above_its_surroundings_bends_no_curvature():
    """All contacts but the point are noticeably lower, as where a vertex of facets is touched."""
    for seed in range(4):
        _, r = touched(seed)
        lower = []
        for contour in r.contours:
            is_point = (contour.points == r.frame.origin).all(axis=1)
            lower.append(Contour(contour.points - np.where(is_point, 0.0, 1e-3 * EXTENT)[:, None] * OUTWARD))
        other = reconstruct(r.frame.origin, lower, outward=OUTWARD)
        off = np.abs([other.patch.k1 - r.patch.k1, other.patch.k2 - r.patch.k2])
        assert off.max() < 0.03 / r.radius
    assert r.height(np.zeros((2, 3)), 1.0).shape == (2, 3)


@pytest.mark.parametrize(
    "surface",
    [surfaces.plane(), surfaces.sphere(25), surfaces.bottle_neck(), surfaces.pear(), surfaces.sine()],
)
@pytest.mark.parametrize("noise", [0.0, 0.02, 0.1])
def test_exact_surfaces_ask_for_none(surface, noise):
    contours = surface.track(surfaces.UPRIGHT, extent=EXTENT, step=1.0, noise=noise, rng=3)
    r = surface.fit(contours)
    assert r.posterior.amplitude == 0.0
    x, y = over(r).T
    assert r.height(x, y) == pytest.approx(surface.fit(contours, degree=6).patch.height(x, y), abs=1e-9)


def test_white_noise_of_unknown_deviation_is_no_process():
    s, sizes = surfaces.sphere(25), []
    for seed in range(10):
        contours = s.track(surfaces.UPRIGHT, extent=EXTENT, step=1.0, noise=0.1, rng=seed)
        r = s.fit([Contour(c.points) for c in contours])
        sizes.append(r.posterior.amplitude)
    assert sizes.count(0.0) >= 8 and max(sizes) < 0.02


def test_white_noise_below_that_of_any_polynomial_is_no_process():
    """Means of four contacts with a noise of 2e-3 of the radius have half of that."""
    s, sizes = surfaces.sphere(25), []
    for seed in range(10):
        contours = s.track(surfaces.UPRIGHT, extent=EXTENT, step=0.2, noise=0.02, rng=seed)
        sizes.append(s.fit([Contour(c.points) for c in contours]).posterior.amplitude)
    assert sizes.count(0.0) >= 8


@pytest.mark.parametrize("azimuths", [(0, 60, 120), (0, 36, 72, 108, 144)], ids=["three", "five"])
def test_heights_are_nearer_and_intervals_true_on_rough_surfaces(azimuths):
    covered, errors = [], []
    for seed in range(25):
        height, r = touched(seed, azimuths=azimuths)
        flat = over(r)
        at = r.frame.to_world(np.column_stack([flat, r.height(*flat.T)]))
        off = np.abs(at[:, 2] - EXTENT * height(at[:, :2] / EXTENT)) * r.frame.axes[2, 2]
        covered.append(np.mean(off <= 1.645 * r.height_std(*flat.T)))
        sextic = r.radius * monomials(flat / r.radius, TERMS) @ r.posterior.polynomial
        at = r.frame.to_world(np.column_stack([flat, sextic]))
        errors.append([off.mean(), np.abs(at[:, 2] - EXTENT * height(at[:, :2] / EXTENT)).mean()])
        assert 0.002 < r.posterior.amplitude < 0.2
    ours, sextics = np.mean(errors, axis=0)
    assert 0.8 < np.mean(covered) < 0.97
    assert ours < 0.9 * sextics


@pytest.mark.parametrize("scale", [1e-3, 1e4])
def test_it_moves_with_its_contacts(scale):
    height = rough(1)
    contours = contours_of(height)
    one = reconstruct(np.zeros(3), contours, outward=OUTWARD)
    turn, shift = Rotation.from_rotvec([0.4, -0.9, 0.3]).as_matrix(), scale * np.array([30.0, -20.0, 10.0])
    moved = [Contour(scale * c.points @ turn.T + shift, noise=0.0) for c in contours]
    other = reconstruct(shift, moved, outward=turn @ OUTWARD)
    x, y = over(one).T
    assert other.posterior.amplitude == pytest.approx(one.posterior.amplitude, rel=1e-5)
    assert other.height(scale * x, scale * y) / scale == pytest.approx(one.height(x, y), abs=1e-7 * EXTENT)
    assert other.height_std(scale * x, scale * y) / scale == pytest.approx(
        one.height_std(x, y), rel=1e-4, abs=1e-9
    )


def test_a_stack_of_rough_and_smooth_touches_gives_what_single_fits_give():
    smooth = surfaces.graph({(2, 0): -0.01, (0, 2): 0.0075})
    exact = smooth.track(surfaces.UPRIGHT, extent=EXTENT, step=1.5)
    touches = [
        contours_of(rough(0)),
        exact,
        contours_of(rough(2), (0, 45, 90, 135)),
        exact,
        contours_of(rough(3)),
    ]
    points, outward = (
        [np.zeros(3), smooth.point, *3 * [np.zeros(3)]],
        [OUTWARD, smooth.normal, *3 * [OUTWARD]],
    )
    points[3], outward[3] = smooth.point, smooth.normal
    found = reconstruct_many(points, touches, outward=outward)
    singles = [reconstruct(*each, outward=n) for *each, n in zip(points, touches, outward, strict=True)]
    assert [r.posterior.amplitude > 0.0 for r in found] == [True, False, True, False, True]
    for one, other in zip(found, singles, strict=True):
        x, y = over(other).T
        assert one.height(x, y) == pytest.approx(other.height(x, y), abs=1e-6)
        assert one.height_std(x, y) == pytest.approx(other.height_std(x, y), rel=1e-5, abs=1e-9)
    assert [r.mean_height_std for r in found] == pytest.approx([r.mean_height_std for r in singles], rel=1e-5)


def test_more_contacts_than_places_say_as_much():
    height = rough(4)
    r = reconstruct(np.zeros(3), contours_of(height), outward=OUTWARD)
    azimuths = np.radians([0, 60, 120])
    along = np.linspace(-1.0, 1.0, 201)[:, None]
    dense = [along * [np.cos(a), np.sin(a)] for a in azimuths]
    contours = [Contour(EXTENT * np.column_stack([p, height(p)]), noise=0.0) for p in dense]
    many = reconstruct(np.zeros(3), contours, outward=OUTWARD)
    assert len(many.posterior.places) < len(many.contacts)
    flat = over(r)
    assert many.height(*flat.T) == pytest.approx(r.height(*flat.T), abs=0.03 * EXTENT)
    assert 0.5 < many.mean_height_std / r.mean_height_std < 2.0


def test_the_suggested_plane_keeps_what_it_promises():
    height, r = touched(5)
    plane, expected = suggest_plane(r)
    direction = r.frame.axes @ [np.cos(plane.azimuth), np.sin(plane.azimuth), 0.0]
    azimuth = np.degrees(np.arctan2(direction[1], direction[0]))
    after = reconstruct(np.zeros(3), contours_of(height, (0, 60, 120, azimuth)), outward=OUTWARD)
    assert expected < 0.95 * r.mean_height_std
    assert after.mean_height_std == pytest.approx(expected, rel=0.35)


@pytest.mark.parametrize("seed", range(4))
def test_the_suggested_plane_tells_as_much_as_any_of_all(seed):
    r = touched(seed, azimuths=(0, 50, 130))[1]
    points, weights = r.domain.nodes
    covariances = r.posterior.covariances_with(points / r.radius)
    widening = r.widening(r.domain.node_places)
    reductions = _variance_reduction(covariances, TRIED, 24, r.posterior.noise**2)
    lowered = widening**2 * reductions @ weights
    chosen = np.argmin(np.abs(TRIED - suggest_plane(r)[0].azimuth))
    assert lowered[chosen] >= 0.97 * lowered.max()


def test_deviations_are_less_near_the_point_and_more_at_the_rim_and_a_contour_takes_off_as_much():
    _, r = touched()
    x, y = np.vstack([np.zeros(2), r.domain.boundary(12)]).T
    process = r.radius * r.posterior.height_std(x / r.radius, y / r.radius)
    wanted = np.append(0.65, np.full(12, 1.175)) * process
    assert r.height_std(x, y) == pytest.approx(wanted, rel=1e-4)
    weights = r.domain.nodes[1]
    assert weights @ r.widening(r.domain.node_places) == pytest.approx(1.0, abs=0.01)
    # A contour takes the same share off these variances as off those of the process.
    assert 0.0 < suggest_plane(r)[1] < r.mean_height_std


def test_it_goes_into_json_and_back():
    _, r = touched()
    again = from_dict(json.loads(json.dumps(to_dict(r))))
    x, y = over(r).T
    assert again.height(x, y) == pytest.approx(r.height(x, y), abs=1e-9)
    assert again.height_std(x, y) == pytest.approx(r.height_std(x, y), rel=1e-9)


def test_the_derivatives_of_a_surface_with_a_process_are_those_of_its_height_in_its_unit():
    _, r = touched()
    assert r.posterior.amplitude and r.radius > 10.0
    (x, y), h = over(r, 20).T, 1e-3 * r.radius
    d = r.geometry.derivatives(x, y)
    assert d.z == pytest.approx(r.height(x, y), abs=1e-12)
    assert d.x == pytest.approx((r.height(x + h, y) - r.height(x - h, y)) / (2.0 * h), abs=2e-4)
    assert d.y == pytest.approx((r.height(x, y + h) - r.height(x, y - h)) / (2.0 * h), abs=2e-4)
    xx = (r.height(x + h, y) - 2.0 * r.height(x, y) + r.height(x - h, y)) / h**2
    assert d.xx == pytest.approx(xx, abs=0.02 * np.abs(d.xx).max() + 2e-3)


def test_the_likelihoods_are_those_of_the_heights_under_a_normal_distribution():
    """The likelihoods agree up to the constant of 2 pi, with a process of any amplitude and without one."""
    flat = np.vstack([np.outer(REACHES[::2], [np.cos(a), np.sin(a)]) for a in np.radians([0, 60, 120])])
    basis, heights = monomials(flat, TERMS), rough(3)(flat)
    noises = np.array([1e-3, 2e-3, 4e-3])

    def neg2_log(covariance):
        return np.linalg.slogdet(covariance)[1] + heights @ np.linalg.solve(covariance, heights)

    variances = np.minimum(prior_variances(np.array([0.3, USUAL_WAVINESS])), evidence.MOST_VARIANCE)
    rows = np.vstack([basis.T, heights])
    of_terms = [(basis * each) @ basis.T for each in variances]
    bordered = evidence._bordered(rows, kernel.kernels(flat, flat), variances[1])
    for length, amplitude, noise in itertools.product(range(2), (0.0, 0.01, 0.14), noises):
        found = evidence._neg2_log_at(*bordered, length, amplitude, noise)
        within = amplitude**2 * kernel.kernels(flat, flat)[length]
        white = noise**2 * np.eye(len(flat))
        assert found == pytest.approx(neg2_log(of_terms[1] + within + white), rel=1e-6)
    normal_equations = (rows @ rows.T)[None], np.array([len(flat)]), np.zeros((1, 28, 28))
    sextics = evidence.neg2_log_evidence(*normal_equations, variances, noises[None])[0]
    for (w, i), value in np.ndenumerate(sextics):
        wanted = neg2_log(of_terms[w] + noises[i] ** 2 * np.eye(len(flat)))
        assert value - 1.0 == pytest.approx(wanted, rel=1e-6)


def test_the_noise_may_be_all_that_a_sextic_leaves_over():
    rng = np.random.default_rng(6)
    contacts = np.column_stack([rng.uniform(-0.7, 0.7, (120, 2)), rng.normal(0.0, 0.008, 120)])
    touch = process_data(contacts, np.ones(120), contacts[:0], np.arange(120))
    found, _ = evidence.process_hyperparameters(*touch.at_places(), 1e-3, 8e-3)
    assert found.noise > 6e-3


def test_the_factor_of_places_is_that_of_their_covariance():
    places = np.random.default_rng(7).uniform(-1.0, 1.0, (60, 2))
    within = kernel.kernel(places, places, np.array([2e-4, 3e-4]))
    factor = kernel.places_factor(within.copy())
    assert factor @ factor.T == pytest.approx(within, abs=1e-11)
    assert np.array_equal(factor, np.tril(factor))


def test_contacts_with_a_process_are_known_to_five_ten_thousandths_of_the_radius_at_best():
    noises = [float(touched(seed)[1].posterior.noise) for seed in range(6)]
    assert 5e-4 <= min(noises) < 1e-3
