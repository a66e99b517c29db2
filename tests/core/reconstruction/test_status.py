# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A patch in doubt says so, why, and what to do; a patch without doubt does not."""

import re
from dataclasses import replace

import numpy as np
import pytest
import surfaces

from core import METHODS, Contour, DegenerateCurvesError, reconstruct
from core.bayes.posterior import SurfacePosterior
from core.contours.contour import UNEXPLAINED
from core.contours.curves import curves_through, misses, stacked
from core.verdict import LONGER, PLANES, SHORTER, Doubt, Judged

EXTENT = 12.0


def contours_of(surface, degrees=(13, 73, 133), noise=0.05, seed=0, extent=EXTENT, count=12):
    lengths = {"extent": extent, "step": extent / count}
    return surface.track(surfaces.planes(degrees), noise=noise, rng=seed, **lengths)


def moved(contour, shift):
    return replace(contour, points=contour.points + shift)


@pytest.mark.parametrize(
    "surface", [surfaces.pear(), surfaces.sphere(30), surfaces.plane(), surfaces.saddle()]
)
@pytest.mark.parametrize("noise", [0.0, 0.05])
def test_where_all_is_well_no_warning(surface, noise):
    for seed in range(5):
        r = surface.fit(contours_of(surface, noise=noise, seed=seed), degree=4)
        assert r.status == "ok", r.message
        assert r.message.startswith("The patch describes its contacts.")
        assert "These planes cannot show 3 of the 14 ways to bend" in r.message


def test_heights_that_are_good_to_little():
    s = surfaces.pear()
    r = s.fit(contours_of(s, noise=1.5))
    assert r.status == "uncertain"
    assert f"Heights are accurate to {100 * r.mean_height_std / r.radius:.1f} % of the radius" in r.message
    assert "shorter extent or add sampling planes" in r.message


def test_a_touch_that_has_tried_shorter_extents_is_not_advised_one():
    s = surfaces.pear()
    contours = [replace(c, stops=(UNEXPLAINED, UNEXPLAINED)) for c in contours_of(s, noise=1.5)]
    assert "% of the radius on average: add sampling planes." in s.fit(contours).message
    assert "use a shorter extent" in s.fit(contours, method="tagc").message  # It has tried none.


def test_contacts_that_are_missed_by_more_than_their_noise_explains():
    s = surfaces.plane()
    for seed in range(3):
        noisy = contours_of(s, noise=0.025 * EXTENT, seed=seed, count=24)
        r = s.fit([replace(c, noise=None) for c in noisy], degree=2)
        x, y, z = r.contacts.T
        missed = 100.0 * np.median(np.abs(r.height(x, y) - z)) / r.radius
        assert 1.0 < missed < 2.5
        assert r.status == "uncertain"
        assert r.message.startswith(f"Half of the contacts are off the patch by more than {missed:.1f} %")
        assert "which their noise does not explain: use a shorter extent or give their noise" in r.message
        assert "Half of the contacts" not in s.fit(noisy, degree=2).message


def test_a_method_that_leaves_its_contacts_is_in_doubt():
    s = surfaces.monkey_saddle()
    r = s.fit(contours_of(s, noise=0.0), method="quadratic-variation", weight=1.0)
    assert "Half of the contacts are off the patch" in r.message
    assert s.fit(contours_of(s, noise=0.0), method="quadratic-variation", weight=1e5).status == "ok"


def test_outlying_contacts_are_left_out_of_the_contacts_that_are_to_be_met():
    s, rng = surfaces.pear(), np.random.default_rng(5)
    lifted = [
        moved(c, np.where(rng.random((len(c.points), 1)) < 0.2, 1.2, 0.0) * s.normal)
        for c in contours_of(s, noise=0.0)
    ]
    assert "Half of the contacts" not in s.fit(lifted).message


def test_least_squares_with_upright_planes():
    s = surfaces.pear()
    r = s.fit(contours_of(s), method="least-squares")
    assert (r.status, r.condition_number > 1e3) == ("uncertain", True)
    assert "do not determine the surface between the curves" in r.message


def test_a_descent_that_has_not_come_to_an_end():
    s = surfaces.pear()
    r = replace(s.fit(contours_of(s), method="tagc"), converged=False)
    assert r.status == "not_converged"
    assert "use the fast solver or a smaller weight" in r.message


def test_a_curve_that_misses_the_point_is_named_with_its_distance():
    s = surfaces.pear()
    contours = contours_of(s, noise=0.02)
    across = np.cross(contours[1].points[-1] - contours[1].points[0], s.normal)
    across *= 0.4 / np.linalg.norm(across)
    contours[1] = moved(contours[1], across)
    r = s.fit(contours)
    assert r.status == "uncertain"
    assert r.message.startswith("Curve 2 passes the reference point at 0.4")
    assert "set the point where the curves meet" in r.message


def test_curves_that_bend_at_a_point_of_their_own_get_no_advice_to_meet_elsewhere():
    """The point is one of their contacts, as that of a touch is: at the tip of a cone the fit is off it."""
    s = np.linspace(-1.0, 1.0, 25)
    curves = [np.outer(s, [np.cos(a), np.sin(a), 0.0]) - np.outer(np.abs(s), [0, 0, 0.2]) for a in (0, 1, 2)]
    message = reconstruct((0, 0, 0), [Contour(points) for points in curves], outward=(0, 0, 1)).message
    assert re.match(
        r"Curve \d bends so sharply at the point that its fit is \S+ % of the radius off", message
    )
    assert "move the point away from edges or make the facets finer" in message


@pytest.mark.parametrize("share", [0.01, 0.1, 0.3])
def test_a_point_above_the_curves_is_only_a_place(share):
    s = surfaces.pear()
    contours = contours_of(s, noise=0.02)
    off = share * np.ptp(contours[0].points, axis=0).max()
    r = reconstruct(s.point + off * s.normal, contours, outward=s.normal)
    assert r.status == "ok"
    assert abs((r.frame.origin - s.point) @ s.normal) < 5.0 * r.height_std(0.0, 0.0)
    assert max(abs(r.k1 - s.k1) / r.k1_std, abs(r.k2 - s.k2) / r.k2_std) < 3.0


@pytest.mark.parametrize(
    ("way", "share"), [("normal", 3.0), ("across", 0.1), ("across", 0.3), ("across", 3.0)]
)
def test_a_point_off_the_curves_is_reported_before_anything_that_follows_from_it(share, way):
    s = surfaces.pear()
    contours = contours_of(s, noise=0.02)
    off = share * np.ptp(contours[0].points, axis=0).max()
    direction = s.normal if way == "normal" else np.cross(s.normal, [0.3, 0.9, 0.1])
    direction = direction / np.linalg.norm(direction)
    try:
        message = reconstruct(s.point + off * direction, contours, outward=s.normal).message
    except DegenerateCurvesError as error:
        message = str(error)
    found = re.match(r"[Cc]urve \d passes the reference point at (\S+), more than", message)
    assert found, message
    assert "set the point where the curves meet" in message
    if share < 1.0:  # From far away the line that a curve goes on along is a guess.
        assert 0.3 * off < float(found[1]) < 2.0 * off


@pytest.mark.parametrize("seed", range(40))
def test_curves_that_carry_no_frame_from_a_point_off_them_are_not_blamed(seed):
    s, rng = surfaces.pear(), np.random.default_rng(seed)
    contours = contours_of(s, noise=0.02)
    size, off = np.ptp(contours[0].points, axis=0).max(), rng.normal(size=3)
    off *= size * rng.uniform(0.5, 3.0) / np.linalg.norm(off)
    try:
        message = reconstruct(s.point + off, contours, outward=s.normal).message
    except DegenerateCurvesError as error:
        message = str(error)
    assert re.match(r"[Cc]urve \d passes the reference point at \S+, more than", message), message


def test_misses_are_distances_across_the_curve_with_their_scatter():
    rng = np.random.default_rng(3)
    t = np.linspace(-1.0, 1.0, 11)
    curve = np.column_stack([t, np.zeros_like(t), -0.2 * t**2])
    found = []
    for _ in range(200):
        noisy = curve + rng.normal(0.0, 0.01, (len(curve), 1)) * [0.0, 0.0, 1.0] + [0.0, 0.0, 0.05]
        contours = [Contour(noisy), Contour(noisy[:, [1, 0, 2]]), Contour(noisy[:2])]
        curves = curves_through(*stacked(np.zeros((1, 3)), [contours])).at(0)
        found.append(misses(curves))
    distances, stds = np.mean(found, axis=0).T
    assert distances[0] == pytest.approx(0.05, abs=0.002)
    assert np.std(np.array(found)[:, 0, 0]) == pytest.approx(stds[0], rel=0.2)
    assert (distances[2], stds[2]) == (0.0, 0.0)  # two contacts are too few to tell


def test_principal_directions_that_may_be_far_off():
    s = surfaces.ellipsoid(30, 28, 27, 0.4, 0.5)  # curvatures that hardly differ
    turned = []
    for seed in range(20):
        r = s.fit(contours_of(s, degrees=(13, 33, 53), noise=0.1, seed=seed))
        if "principal directions may" in r.message:
            assert r.status == "uncertain"
            assert "use a longer extent or add sampling planes" in r.message
            turned.append(seed)
    assert len(turned) > 10


def test_the_frame_is_hardly_ever_off_by_more_than_the_stated_angle():
    s = surfaces.pear()
    exact = s.fit(contours_of(s, noise=0.0)).frame.axes
    angles, bounds = [], []
    for seed in range(60):
        r = s.fit(contours_of(s, noise=0.1, seed=seed))
        angles.append(np.arccos(min(1.0, abs(exact[:, 0] @ r.frame.axes[:, 0]))))
        bounds.append(r.posterior.turn())
    assert np.mean(np.array(angles) <= bounds) > 0.9
    assert np.mean(bounds) < 4.0 * np.sqrt(np.mean(np.square(angles)))


@pytest.mark.parametrize("surface", [surfaces.pear(), surfaces.ellipsoid(30, 28, 27, 0.4, 0.5)])
@pytest.mark.parametrize("degrees", [(13, 73, 133), (13, 33, 53)])
def test_the_stated_angle_is_a_quantile_of_the_posterior(surface, degrees):
    r = surface.fit(contours_of(surface, degrees=degrees, noise=0.15))
    mean, covariance = r.posterior.mean[:5], r.posterior.covariance[:5, :5]
    drawn = np.random.default_rng(0).multivariate_normal(mean, covariance, 40_000)
    x, y, xx, xy, yy = drawn.T
    angles = np.where(
        2.0 * np.hypot(yy - xx, xy) <= 0.05, 0.0, np.hypot(np.hypot(x, y), 0.5 * np.arctan2(abs(xy), yy - xx))
    )
    assert r.posterior.turn() == pytest.approx(np.quantile(angles, 0.95), rel=0.1)


def cut_short(contours, point):
    """The contours, of which the first now reaches only a fifth of the extent."""
    near = np.linalg.norm(contours[0].points - point, axis=1) < 0.2 * EXTENT + 0.1
    return [Contour(contours[0].points[near], noise=contours[0].noise), *contours[1:]]


def test_the_curvature_known_least_is_that_along_a_short_curve():
    s = surfaces.pear()
    contours = cut_short(contours_of(s), s.point)
    r = s.fit(contours)
    azimuth = np.arctan2(*(r.frame.axes[:, 1::-1].T @ (contours[0].points[-1] - s.point)))
    along, across = np.cos(azimuth), np.sin(azimuth)
    terms = 2.0 * np.array([along**2, along * across, across**2])
    std = np.sqrt(terms @ r.posterior.covariance[2:5, 2:5] @ terms)
    assert r.posterior.curvature_std() == pytest.approx(std, rel=0.05)
    assert s.fit(contours_of(s)).posterior.curvature_std() < 0.1 * std


def test_a_curve_shorter_than_a_quarter_of_the_radius_leaves_doubt():
    s = surfaces.torus(40, 20, 2.6)
    open_curvature = 0
    for seed in range(10):
        contours = contours_of(s, seed=seed)
        assert s.fit(contours).status == "ok"
        r = s.fit(cut_short(contours, s.point))
        assert r.status == "uncertain"  # whichever doubt comes first
        percent = 100.0 * r.posterior.curvature_std()
        if f"Curvatures are accurate to only {percent:.2g} % of 1 / radius in the least" in r.message:
            assert "known direction: use a longer extent or add sampling planes" in r.message
            open_curvature += 1
    assert open_curvature > 2


ALIKE = "The two curvatures are equal within their error, so there are no principal directions."


def test_an_umbilic_has_no_directions_to_be_wrong():
    s = surfaces.sphere(30)
    assert s.fit(contours_of(s, noise=0.01)).posterior.turn() == 0.0


@pytest.mark.parametrize("surface", [surfaces.sphere(30), surfaces.plane()])
def test_noise_gives_planes_and_spheres_no_directions_and_no_doubt_about_them(surface):
    found = [surface.fit(contours_of(surface, noise=0.15, seed=seed)) for seed in range(20)]
    assert np.mean([r.posterior.turn() > np.radians(10.0) for r in found]) > 0.7
    assert np.mean([r.status == "ok" and ALIKE in r.message for r in found]) > 0.8
    assert not any(ALIKE in r.message and "directions may be" in r.message for r in found)


def test_where_curvatures_are_alike_at_a_point_alone_directions_stay_in_doubt():
    s = surfaces.graph({(3, 0): 1.5e-3, (1, 2): -4.5e-3})
    for seed in range(5):
        r = s.fit(contours_of(s, noise=0.05, seed=seed))
        assert ALIKE not in r.message and not r.posterior.is_round


@pytest.mark.parametrize("method", METHODS[1:])
@pytest.mark.parametrize("surface", [surfaces.sphere(35), surfaces.pear(), surfaces.cylinder(20)])
def test_height_std_of_the_papers_methods_counts_what_they_are_off_the_likeliest_surface(method, surface):
    r = surface.fit(contours_of(surface, noise=0.02), method=method)
    points, heights = surfaces.heights_over(surface, r, 100)
    x, y = points.T
    off = r.radius * r.posterior.height(x / r.radius, y / r.radius) - r.patch.height(x, y)
    std = r.radius * r.posterior.height_std(x / r.radius, y / r.radius)
    assert r.height_std(x, y) == pytest.approx(np.hypot(off, std))
    assert np.mean(np.abs(r.patch.height(x, y) - heights)) < 3.0 * r.mean_height_std


def test_single_precision_far_from_the_origin_is_refused_and_near_it_taken():
    s = surfaces.pear()
    contours = contours_of(s)
    shift = np.array([0.6, -0.48, 0.64]) * EXTENT

    def at(extents):
        points = [(c.points + extents * shift).astype(np.float32) for c in contours]
        return reconstruct(s.point + extents * shift, [Contour(p) for p in points], outward=s.normal)

    near, far = at(0.0), at(1e4)
    assert far.patch.k1 == pytest.approx(near.patch.k1, rel=0.05)
    with pytest.raises(ValueError, match=r"points: numbers of single precision are 0\.5 apart here"):
        at(1e6)


def with_misses(r, misses, **more):
    """That reconstruction as if its curves passed the point at these (distance, deviation)."""
    found = replace(r, **more)
    vars(found)["misses"] = np.array(misses)
    return found


@pytest.mark.parametrize(
    ("share", "std", "doubt"),
    [(0.0049, 0.0, False), (0.0051, 0.0, True), (0.0099, 0.002, False), (0.0101, 0.002, True)],
)
def test_a_curve_may_miss_the_point_by_half_a_percent_of_the_radius_or_five_deviations(share, std, doubt):
    s = surfaces.pear()
    r = s.fit(contours_of(s, noise=0.0))
    misses = np.zeros((3, 2))
    misses[2] = share * r.radius, std * r.radius
    assert (with_misses(r, misses).status == "uncertain") == doubt
    # The deviation of a miss is at least 0.3 of a contact's noise.
    far = [[0.01 * r.radius, 0.0]] * 3
    assert with_misses(r, far, noise=0.01).status == "ok"
    assert with_misses(r, far, noise=0.006).status == "uncertain"


@pytest.mark.parametrize(("share", "doubt"), [(0.0199, False), (0.0201, True)])
def test_heights_may_be_good_to_two_percent_of_the_radius(share, doubt):
    s = surfaces.pear()
    r = s.fit(contours_of(s))
    assert (r.judged_with(mean_height_std=share * r.radius).status == "uncertain") == doubt


@pytest.mark.parametrize(
    ("degrees", "std", "doubt"), [(9.9, 0.099, ""), (10.1, 0.0, "principal"), (0.0, 0.101, "least known")]
)
def test_the_frame_may_be_ten_degrees_off_and_curvatures_a_tenth_of_one_over_the_radius(
    monkeypatch, degrees, std, doubt
):
    s = surfaces.pear()
    r = s.fit(contours_of(s))
    monkeypatch.setattr(SurfacePosterior, "turn", lambda *_: np.radians(degrees))
    monkeypatch.setattr(SurfacePosterior, "curvature_std", lambda _: std)
    assert (r.status == "uncertain") == bool(doubt)
    assert doubt in r.message


@pytest.mark.parametrize(
    ("deviations", "angle", "uncertain"), [(5.5, 0.011, True), (5.5, 0.009, False), (4.5, 0.011, False)]
)
def test_normals_contradict_by_five_deviations_and_a_hundredth(deviations, angle, uncertain):
    r = surfaces.pear().fit(contours_of(surfaces.pear()))
    vars(r)["contradiction"] = (deviations, angle)
    assert (r.status == "uncertain") is uncertain


def waves(length, height, azimuth, k2=-0.01):
    """A quadric with waves of this length and height along an azimuth in degrees."""
    p, q = 2.0 * np.pi / length * np.array([np.cos(np.radians(azimuth)), np.sin(np.radians(azimuth))])
    return surfaces.Exact(
        lambda x, y, z: z + 0.02 * x**2 - 0.5 * k2 * y**2 - height * (np.cos(p * x + q * y) - 1.0),
        lambda r: np.array(
            [
                0.04 * r[0] + p * height * np.sin(p * r[0] + q * r[1]),
                -k2 * r[1] + q * height * np.sin(p * r[0] + q * r[1]),
                1.0,
            ]
        ),
        np.zeros(3),
        -0.04,
        k2,
    )


@pytest.mark.parametrize("azimuth", [20, 75])
@pytest.mark.parametrize(("length", "height"), [(8, 0.6), (10, 0.6), (13, 1.2)])
def test_waves_as_long_as_curves_are_apart_are_a_doubt(length, height, azimuth):
    """They are up to a sixth of the radius off a fit that describes all contacts."""
    surface = waves(length, height, azimuth)
    contours = surface.track(surfaces.planes((0, 60, 120)), extent=13, step=13 / 24)
    r = surface.fit(contours)
    assert r.fit_error < 1e-4 * r.radius
    assert r.status == "uncertain"
    points, heights = surfaces.heights_over(surface, r)
    if "Waves of" in r.message:
        assert np.abs(heights - r.height(*points.T)).max() > 0.03 * r.radius
        assert f"Waves of {100.0 * r.waves / r.radius:.1f} %" in r.message


def test_low_waves_and_waves_that_strokes_show_are_none_to_doubt():
    rng = np.random.default_rng(0)
    for azimuth in (20, 75):
        low, high = waves(10, 0.1, azimuth), waves(13, 0.6, azimuth)
        for surface, strokes in ((low, 0), (high, 150)):
            contours = surface.track(surfaces.planes((0, 60, 120)), extent=13, step=13 / 24)
            x, y = rng.uniform(-9.0, 9.0, (2, strokes))
            flat = np.column_stack([x, y, np.full(strokes, 13.0)])
            scattered = [surface.crossings(flat, np.array([0.0, 0.0, -1.0]), 26.0)] if strokes else []
            assert "Waves" not in surface.fit(contours, strokes=scattered).message


def test_outlying_contacts_are_no_waves():
    for seed in range(5):
        rng, surface, found = np.random.default_rng(seed), surfaces.saddle(), []
        for contour in surface.track(surfaces.planes((0, 60, 120)), noise=0.05, rng=seed):
            points = contour.points.copy()
            points[:, 2] += np.where(rng.random(len(points)) < 0.2, rng.normal(0.0, 1.2, len(points)), 0.0)
            found.append(Contour(points, noise=0.05))
        assert "Waves" not in surface.fit(found).message


@pytest.mark.parametrize("useless", [(), (SHORTER,)], ids=["given", "automatic"])
def test_no_doubt_advises_the_opposite_of_a_graver_one(useless):
    class Doubtful(Judged):
        def _doubting(self):
            yield Doubt("heights", 0.05, 0.02, useless=useless)
            yield Doubt("curvatures", 0.3, 0.1, useless=(SHORTER,))

    heights, curvatures = Doubtful().doubts
    assert (SHORTER in heights.advice) is not (LONGER in curvatures.advice)
    assert PLANES in curvatures.advice
