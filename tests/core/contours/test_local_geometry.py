# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Frame and curvatures at the reference point, against exact surfaces and the paper's own formulas."""

import numpy as np
import pytest
import surfaces
from surfaces import TILTED, UPRIGHT

from core import Contour, DegenerateCurvesError, SamplingPlane, reconstruct
from core.contours.curves import curves_through, stacked
from core.contours.local_geometry import darboux_frames, degeneracy, principal_curvatures, surface_normals

EXACT = {
    "plane": surfaces.plane(),
    "sphere": surfaces.sphere(25),
    "cylinder": surfaces.cylinder(20),
    "torus outer": surfaces.torus(40, 20, 0.6),
    "torus inner": surfaces.torus(40, 20, 2.6),
    "ellipsoid": surfaces.ellipsoid(35, 25, 20, 0.6, 0.5),
    "monkey saddle": surfaces.monkey_saddle(),
    "bottle neck": surfaces.bottle_neck(),
    "quartic": surfaces.quartic(),
}


def frame_at(surface, planes, step, extent=None):
    contours = surface.track(planes, extent=extent or 6 * step, step=step)
    curves = through(contours, surface.point)
    axes, kappas, radius = darboux_frames(curves, surface_normals(curves.tangents, surface.normal))
    return axes[0], *(kappas[0] / radius[0])


def through(contours, point):
    return curves_through(*stacked(np.array([point]), [contours]))


@pytest.mark.parametrize("planes", [UPRIGHT, TILTED], ids=["upright", "tilted"])
@pytest.mark.parametrize("surface", EXACT.values(), ids=EXACT)
def test_curvatures_of_exact_surfaces(surface, planes):
    axes, k1, k2 = frame_at(surface, planes, 0.01)
    assert [k1, k2] == pytest.approx([surface.k1, surface.k2], abs=2e-6)
    assert axes[:, 2] == pytest.approx(surface.normal, abs=1e-5)
    assert np.linalg.det(axes) == pytest.approx(1.0)


@pytest.mark.parametrize("planes", [UPRIGHT, TILTED], ids=["upright", "tilted"])
@pytest.mark.parametrize("name", ["ellipsoid", "torus inner", "quartic"])
def test_the_curvature_error_falls_with_the_square_of_the_step(name, planes):
    surface = EXACT[name]
    steps = np.array([0.8, 0.4, 0.2, 0.1])
    errors = [
        np.abs(np.subtract(frame_at(surface, planes, h)[1:], (surface.k1, surface.k2))).max() for h in steps
    ]
    order = np.polyfit(np.log(steps), np.log(errors), 1)[0]
    assert 1.8 < order < 2.3


def test_d1_is_the_direction_of_least_curvature_within_90_degrees_of_the_first_tangent():
    s = surfaces.cylinder(20)
    axes, _, _ = frame_at(s, UPRIGHT, 0.05)
    around = np.cross([0.0, 0.0, 1.0], s.normal)
    assert abs(axes[:, 0] @ around) == pytest.approx(1.0, abs=1e-6)
    assert axes[:, 0] @ UPRIGHT[0].axes(s.normal)[:, 0] > 0.0


def test_at_an_umbilic_d1_is_the_first_tangent():
    k1, k2, theta = principal_curvatures(np.radians([13, 73, 133]), [0.3, 0.3, 0.3])
    assert (k1, k2, theta) == pytest.approx((0.3, 0.3, 0.0))
    axes, _, _ = frame_at(surfaces.plane(), UPRIGHT, 0.05)
    assert axes[:, 0] == pytest.approx(UPRIGHT[0].axes((0, 0, 1))[:, 0], abs=1e-9)


def papers_solution(angles, kappas):
    """Solves (2)-(4): theta, from d1 to the first tangent, by the tan formula; then kappas by two equations.

    The roots of 2 theta differ by 180 degrees: the other one swaps d1 and d2. alpha is the curvature that
    differs from both others.
    """
    alpha = max(range(3), key=lambda i: min(abs(kappas[i] - kappas[j]) for j in range(3) if j != i))
    beta, gamma = (i for i in range(3) if i != alpha)
    t1, t2 = angles[beta] - angles[alpha], angles[gamma] - angles[alpha]
    ratio = (kappas[alpha] - kappas[beta]) / (kappas[alpha] - kappas[gamma])
    # With atan2 the formula needs no care where its denominator vanishes.
    above, below = np.sin(t1 - t2) * np.sin(t1), ratio * np.sin(t2) - np.cos(t1 - t2) * np.sin(t1)
    theta = 0.5 * (np.arctan2(above, below) - t2)
    at = theta + np.array([0.0, t1])
    pair = kappas[alpha], kappas[beta]
    k1, k2 = np.linalg.solve(np.column_stack([np.cos(at) ** 2, np.sin(at) ** 2]), pair)
    direction = angles[alpha] - theta
    return (k1, k2, direction) if k1 <= k2 else (k2, k1, direction + np.pi / 2)


def test_the_papers_tan_formula_and_two_equations_agree():
    rng = np.random.default_rng(1)
    compared = 0
    while compared < 5000:
        angles = rng.uniform(0.0, np.pi, 3)
        apart = np.abs(np.sin(angles[[0, 1, 2]] - angles[[1, 2, 0]])).min()
        kappa = np.sort(rng.normal(size=2))
        if apart < 0.1 or kappa[1] - kappa[0] < 0.05:
            continue
        d1 = rng.uniform(0.0, np.pi)
        curvatures = kappa[0] * np.cos(angles - d1) ** 2 + kappa[1] * np.sin(angles - d1) ** 2
        ours = principal_curvatures(angles, curvatures)
        assert max(*abs(kappa - ours[:2]), abs(np.sin(ours[2] - d1))) < 1e-9
        alpha_beta = np.abs(np.subtract.outer(curvatures, curvatures))[~np.eye(3, dtype=bool)].min()
        if alpha_beta < 1e-3:
            continue  # the paper's two equations are then nearly one
        papers = papers_solution(angles, curvatures)
        assert max(*abs(kappa - papers[:2]), abs(np.sin(papers[2] - d1))) < 1e-6
        compared += 1


def test_more_than_three_curvatures_are_fitted_by_least_squares():
    rng = np.random.default_rng(2)
    angles = np.linspace(0.0, np.pi, 200, endpoint=False)
    exact = -0.04 * np.cos(angles - 0.3) ** 2 + 0.02 * np.sin(angles - 0.3) ** 2
    k1, k2, theta = principal_curvatures(angles, exact + rng.normal(0.0, 0.005, 200))
    assert (k1, k2, theta) == pytest.approx((-0.04, 0.02, 0.3), abs=0.03)


def test_meusnier_for_a_plane_at_any_tilt():
    """A plane tilted by b cuts a sphere of radius r in a circle of curvature 1 / (r cos b)."""
    ball = surfaces.sphere(20.0)
    for tilt in np.radians([0.0, 30.0, -60.0]):
        (contour,) = ball.track([SamplingPlane(0.3, tilt)], extent=0.2, step=0.02)
        curvature = through([contour], ball.point).curvatures[0, 0]
        assert np.linalg.norm(curvature) == pytest.approx(1.0 / (20.0 * np.cos(tilt)), rel=1e-4)
        assert curvature @ ball.normal == pytest.approx(-1.0 / 20.0, rel=1e-4)


def test_the_order_of_the_points_and_the_reference_point_among_them_do_not_matter():
    s = EXACT["ellipsoid"]
    rng = np.random.default_rng(3)
    contours = s.track(UPRIGHT, extent=6, step=0.5)
    for contour in contours:
        without = np.delete(contour.points, 12, axis=0)
        both = through([contour, Contour(rng.permutation(without))], s.point)
        (plain, shuffled), curvatures = both.tangents[0], both.curvatures[0]
        assert shuffled * np.sign(plain @ shuffled) == pytest.approx(plain, abs=1e-12)
        assert curvatures[1] == pytest.approx(curvatures[0], abs=1e-12)


def test_the_normal_minimizes_the_sum_of_squares():
    rng = np.random.default_rng(4)
    tangents = rng.normal(size=(5, 3)) * [1.0, 1.0, 0.1]
    n = surface_normals(tangents, np.array([0, 0, -1]))
    assert n[2] < 0.0
    others = rng.normal(size=(1000, 3))
    others /= np.linalg.norm(others, axis=1, keepdims=True)
    assert np.sum((tangents @ n) ** 2) <= np.sum((others @ tangents.T) ** 2, axis=1).min()


def line(angle, contacts=9):
    s = np.linspace(-1.0, 1.0, contacts)
    return Contour(np.outer(s, [np.cos(angle), np.sin(angle), 0.0]) - np.outer(0.1 * s**2, [0, 0, 1]))


@pytest.mark.parametrize(
    ("contours", "message"),
    [
        ([line(0), line(1)], "three curves are needed, got 2"),
        ([line(0), line(1), line(1.001)], "curves 2 and 3 run in the same direction"),
        ([line(0), line(0), line(np.pi)], "leaves 1 of the three directions needed"),
        (
            [line(0), line(1), line(2, 3)],
            "curve 3 has 2 of the 3 contacts it needs besides the reference point",
        ),
        (
            [line(0), line(1), Contour([[0, 0, 0]], stops=("crease", "no contact"))],
            "it ends at a crease and at an edge",
        ),
        ([line(0), line(1), Contour(np.empty((0, 3)))], "curve 3 has 0 of the 3 contacts"),
        (
            [line(0), line(1), Contour(np.outer(np.linspace(-1, 1, 9), [0, 0, 1]))],
            "do not lie in one plane",
        ),
    ],
)
def test_degenerate_curves_say_what_to_move(contours, message):
    with pytest.raises(DegenerateCurvesError, match=message):
        reconstruct((0, 0, 0), contours, outward=(0, 0, 1))


@pytest.mark.parametrize(("degrees", "distinct"), [(1.1, True), (0.9, False)])
def test_curves_a_degree_apart_are_distinct(degrees, distinct):
    surface = surfaces.plane()
    contours = surface.track(surfaces.planes((0.0, degrees, 90.0)))
    if distinct:
        assert surface.fit(contours).k1_std > 0.0
    else:
        with pytest.raises(DegenerateCurvesError, match=r"run in the same direction \(0.9 degrees apart\)"):
            surface.fit(contours)


def test_tangents_point_the_way_the_contour_was_given():
    for s in (np.linspace(-5.0, 1.0, 13), np.linspace(-1.0, 5.0, 13), np.linspace(1.0, 5.0, 9)):
        ahead = Contour(np.column_stack([s, 0.0 * s, -0.02 * s**2]))
        for way in (1, -1):
            curves = through([Contour(ahead.points[::way])], np.zeros(3))
            assert way * curves.tangents[0, 0] @ [1.0, 0.0, 0.0] > 0.99
            along = curves.along[curves.present]
            assert along == pytest.approx(
                way
                * np.copysign(1.0, s[s != 0.0][::way])
                * np.linalg.norm(curves.points[curves.present], axis=1)
            )


def test_at_an_umbilic_of_large_curvatures_rounding_makes_no_direction():
    angles, known = np.array([0.1, 1.0, 2.0, 0.0]), np.array([True, True, True, False])
    curvatures = 1e9 * (1.0 + 1e-12 * np.array([1.0, -1.0, 0.5, 0.0]))
    assert principal_curvatures(angles, curvatures, known)[2] == 0.0


def test_a_closed_curve_that_runs_through_the_point_twice_has_no_direction():
    contours = [Contour(np.outer(np.arange(1.0, 9.0), way)) for way in (*np.eye(3)[:2], (1.0, 1.0, 0.0))]
    tangents = np.array([(1.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.6, 0.8, 0.0)])
    error = degeneracy(contours, np.ones((3, 8), dtype=bool), tangents, np.array([0.0, 0.0, 1.0]))
    assert str(error).startswith(
        "curve 2 has no direction at the point: split it where it passes the point again"
    )
