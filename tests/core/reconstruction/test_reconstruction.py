# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The whole way from contours to a patch: exactness, equivariance, and what is refused."""

import importlib
import math
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import surfaces
from scipy.spatial.transform import Rotation
from surfaces import TILTED, UPRIGHT

from core import (
    METHODS,
    Contour,
    DegenerateCurvesError,
    SamplingPlane,
    common_point,
    distances,
    reachable,
    reconstruct,
    reconstruct_many,
    track,
)
from core.contours.curves import curves_through, stacked
from core.contours.local_geometry import surface_normals
from core.patch.geometry import overlapped


@pytest.mark.parametrize("planes", [UPRIGHT, TILTED], ids=["upright", "tilted"])
@pytest.mark.parametrize("method", ["tagc", "quadratic-variation"])
@pytest.mark.parametrize(
    "surface",
    [
        surfaces.plane(),
        surfaces.sphere(25),
        surfaces.cylinder(20),
        surfaces.torus(40, 20, 0.6),
        surfaces.torus(40, 20, 2.6),
        surfaces.ellipsoid(35, 25, 20, 0.6, 0.5),
        surfaces.bottle_neck(),
        surfaces.quartic(),
    ],
    ids=["plane", "sphere", "cylinder", "torus outer", "torus inner", "ellipsoid", "bottle neck", "quartic"],
)
def test_exact_surfaces_of_paper_size(surface, method, planes):
    """The bounds are these methods' errors on 12 mm patches: 2 % of the radius, 2.5 % on the sphere, whose
    rim the least |K| flattens, 4 % where the ellipsoid's radius is down to 18 mm. Curvatures are as good as
    0.0025 / mm."""
    contours = surface.track(planes)
    r = surface.fit(contours, method=method)
    flattened = method == "tagc" and surface.k2 - surface.k1 < 1e-6 and surface.k2 < 0.0
    bound = 0.04 if surface.k1 < -0.05 else 0.025 if flattened else 0.02
    assert surfaces.off_data(surface, r) < bound * r.radius
    assert [r.patch.k1, r.patch.k2] == pytest.approx([surface.k1, surface.k2], abs=2.5e-3)
    assert r.fit_error == pytest.approx(
        np.mean(np.abs(r.patch.height(*r.contacts[:, :2].T) - r.contacts[:, 2]))
    )
    assert len(r.contacts) == 72
    assert r.status in ("ok", "uncertain")


def test_a_quartic_along_its_own_curves_is_seen_by_least_squares_in_the_true_frame():
    """Three curves hide three of the nine directions even without noise, and the condition number tells."""
    s = surfaces.quartic()
    five = surfaces.planes((5, 41, 77, 113, 149))
    contours = s.track(five, extent=12, step=0.4)
    r = s.fit(contours, method="least-squares")
    assert r.condition_number < 100
    assert r.status == "ok"
    assert surfaces.off_data(s, r) < 0.05
    assert r.patch.coefficients[:4] == pytest.approx([2e-4, -3e-4, 1e-4, 2e-4], abs=2e-4)
    three = s.fit(contours[::2], method="least-squares")
    assert three.condition_number > 1e3
    assert three.status == "uncertain"


def test_degree_2_is_only_the_quadric():
    s = surfaces.ellipsoid(35, 25, 20, 0.6, 0.5)
    contours = s.track(UPRIGHT, extent=5, step=0.5)
    results = [s.fit(contours, method=m, degree=2) for m in METHODS]
    for r in results:
        assert r.patch.degree == 2
        assert r.patch.height(1.0, 2.0) == pytest.approx(r.patch.k1 / 2 + 2 * r.patch.k2)


def test_places_and_normals_of_the_surface_at_points_of_the_world():
    s = surfaces.ellipsoid(35, 25, 20, 0.6, 0.5)
    r = s.fit(s.track(UPRIGHT, extent=5, step=0.5))
    x, y, h = np.array([0.0, 1.0, -2.0]), np.array([0.0, 2.0, 0.5]), 1e-4
    above = r.frame.to_world(np.column_stack([x, y, np.full(3, 7.0)]))
    places, normals, stds = r.surface_at(above)
    assert r.frame.to_local(places) == pytest.approx(np.column_stack([x, y, r.height(x, y)]))
    assert stds == pytest.approx(r.height_std(x, y))
    for axis in r.frame.axes[:, :2].T:  # The normals are across the surface.
        ahead, back = (r.surface_at(above + way * h * axis)[0] for way in (1.0, -1.0))
        assert np.einsum("ni,ni->n", ahead - back, normals) == pytest.approx(0.0, abs=1e-8)
    assert np.linalg.norm(normals, axis=1) == pytest.approx(1.0)
    assert (normals @ r.normal > 0.9).all()
    with pytest.raises(ValueError, match="points: expected finite numbers"):
        r.surface_at([(0.0, np.nan, 0.0)])


def test_a_reconstruction_is_printed_in_a_few_lines():
    s = surfaces.ellipsoid(35, 25, 20, 0.6, 0.5)
    r = s.fit(s.track(UPRIGHT, extent=5, step=0.5))
    lines = repr(r).splitlines()
    assert 3 <= len(lines) <= 6
    assert lines[0] == f"Reconstruction, {r.status}: {r.message}"
    assert f"k1 {r.k1:.4g} +- {r.k1_std:.2g}" in lines[2]
    assert max(map(len, lines[1:])) < 120


@pytest.mark.parametrize("degree", [3, 5, 6])
def test_other_degrees(degree):
    s = surfaces.ellipsoid(35, 25, 20, 0.6, 0.5)
    contours = s.track(UPRIGHT)
    r = s.fit(contours, degree=degree)
    assert r.patch.degree == degree
    assert surfaces.off_data(s, r) < 0.04 * r.radius


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e6])
def test_rotating_scaling_and_moving_the_data_moves_the_result(method, scale):
    s = surfaces.ellipsoid(35, 25, 20, 0.6, 0.5)
    contours = s.track(TILTED, noise=0.02, rng=1)
    turn = Rotation.from_rotvec([0.5, -1.1, 0.8]).as_matrix()
    shift = scale * np.array([30.0, -20.0, 10.0])

    def moved(p):
        return scale * np.asarray(p) @ turn.T + shift

    one = s.fit(contours, method=method)
    other = reconstruct(
        moved(s.point),
        [Contour(moved(c.points), noise=scale * 0.02) for c in contours],
        outward=turn @ s.normal,
        method=method,
    )
    assert other.frame.axes == pytest.approx(turn @ one.frame.axes, abs=1e-9)
    assert other.frame.origin == pytest.approx(moved(one.frame.origin))
    assert other.radius == pytest.approx(scale * one.radius)
    assert [other.patch.k1, other.patch.k2] == pytest.approx(
        [one.patch.k1 / scale, one.patch.k2 / scale], rel=1e-7
    )
    assert other.domain.area == pytest.approx(scale**2 * one.domain.area)
    if method == "least-squares":
        # Blind directions multiply rounding by the condition number, 1e4: it is the same only on the data.
        x, y = one.contacts[:, :2].T
    else:
        x, y = one.domain.grid(100)[0].T
    # An optimizer stops within its tolerance, not within rounding.
    tolerance = {"bayes": 1e-9, "tagc": 1e-4, "quadratic-variation": 1e-9, "least-squares": 1e-6}[method]
    heights = other.patch.height(scale * x, scale * y) / scale
    assert heights == pytest.approx(one.patch.height(x, y), abs=tolerance * one.radius)
    assert other.status == one.status


@pytest.mark.parametrize("surface", [surfaces.sphere(25), surfaces.plane()], ids=["sphere", "plane"])
def test_umbilics_turn_with_the_data_too(surface):
    contours = surface.track(UPRIGHT, noise=0.02, rng=2)
    turn = Rotation.from_rotvec([0.3, 0.9, -0.4]).as_matrix()
    one = surface.fit(contours, method="quadratic-variation")
    turned = [Contour(c.points @ turn.T) for c in contours]
    other = reconstruct(
        turn @ surface.point, turned, outward=turn @ surface.normal, method="quadratic-variation"
    )
    assert other.frame.axes == pytest.approx(turn @ one.frame.axes, abs=1e-9)


def test_distances_of_mesh_vertices_over_the_domain():
    """A ball's far side and its inner wall lie over the domain too, but are no part of the patch."""
    ball = surfaces.sphere(25)
    contours = ball.track(UPRIGHT, extent=8, step=0.8)
    r = ball.fit(contours, weight=1e5)
    directions = np.random.default_rng(0).normal(size=(20000, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    vertices = np.vstack([25 * directions, 22 * directions])
    assert set(reachable(r.geometry, ball, vertices)) < set(overlapped(r.geometry, vertices))
    over = reachable(r.geometry, ball, vertices)
    expected = 20000 * (1 - np.cos(8 / 25)) / 2
    assert len(over) == pytest.approx(expected, rel=0.15)
    assert np.linalg.norm(vertices[over], axis=1) == pytest.approx(25.0)
    assert distances(r.patch, r.frame.to_local(vertices[over])).mean() < 0.05


def test_four_to_six_planes_and_curves_that_are_not_planar():
    s = surfaces.torus(40, 20, 0.6)
    for count in (4, 5, 6):
        planes = [SamplingPlane(a) for a in np.pi * np.arange(count) / count]
        contours = s.track(planes, extent=10, step=1)
        assert surfaces.off_data(s, s.fit(contours)) < 0.15
    # A finger that swerves: the contour of one plane, continued in another one's.
    one, other = s.track([SamplingPlane(0.1), SamplingPlane(0.35)], extent=10, step=1)
    swerving = Contour(np.vstack([one.points[:11], other.points[11:]]))
    rest = s.track([SamplingPlane(1.2), SamplingPlane(2.3)], extent=10, step=1)
    r = s.fit([swerving, *rest])
    assert surfaces.off_data(s, r) < 0.5


GOOD = track(
    surfaces.sphere(25), surfaces.sphere(25).point, surfaces.sphere(25).normal, UPRIGHT, extent=5, step=1
)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            {"method": "magic"},
            "method: expected one of bayes, tagc, quadratic-variation, least-squares, got 'magic'",
        ),
        ({"solver": "slow"}, "solver: expected one of fast, descent, got 'slow'"),
        ({"degree": 7}, 'degree: expected a whole number from 2 to 6 or "auto", got 7'),
        ({"degree": 3.5}, 'degree: expected a whole number from 2 to 6 or "auto", got 3.5'),
        ({"degree": "high"}, 'degree: expected a whole number from 2 to 6 or "auto", got .high'),
        ({"weight": 0}, "weight: expected a finite number above 0, got 0"),
        ({"noise": -1}, "noise: expected a finite number of 0 or more, got -1"),
        ({"outward": (0, 0, 0)}, "outward: expected a vector with a direction"),
        ({"point": (np.nan, 0, 0)}, "point: expected finite numbers"),
        ({"point": (0, 0, 1e60)}, r"point: expected numbers up to 1e\+50, got larger ones"),
        ({"point": (0, 0, 10**400)}, "point: expected numbers of shape"),
        ({"point": np.array([1j, 0, 0])}, "point: expected numbers of shape"),
        ({"method": np.array(["bayes", "tagc"])}, "method: expected one of"),
        ({"degree": np.array([4, 5])}, "degree: expected a whole number"),
        ({"weight": np.array([1.0])}, r"weight: expected a finite number above 0, got array\(\[1.\]\)"),
        ({"weight": np.ma.masked}, "weight: expected a finite number above 0, got masked"),
        (
            {"noise": np.ma.array(1.0, mask=True)},
            "noise: expected a finite number of 0 or more, got masked_array",
        ),
        ({"weight": 10**400}, "weight: expected a finite number above 0, got 1000"),
        ({"weight": 1e60}, r"weight: expected a number up to 1e\+50, got 1e\+60"),
        ({"contours": "ab"}, "contours: expected a list, got 'ab'"),
        ({"contours": None}, "contours: expected a list, got None"),
        ({"contours": [GOOD[0], 5]}, r"contours\[1\]: expected shape \(n, 3\), got \(\)"),
        ({"contours": [np.eye(2)]}, r"contours\[0\]: expected shape \(n, 3\), got \(2, 2\)"),
    ],
)
def test_bad_arguments_are_named(change, message):
    given = {"point": surfaces.sphere(25).point, "contours": GOOD, "outward": surfaces.sphere(25).normal}
    with pytest.raises(ValueError, match=message) as caught:
        reconstruct(**(given | change))
    assert "\n" not in str(caught.value)


def test_a_unit_vector_stays_as_it_is_to_the_last_bit():
    for vector in np.random.default_rng(0).normal(size=(50, 3)):
        unit = vector / math.hypot(*vector)
        assert Contour(np.eye(3), plane_normal=unit).plane_normal.tolist() == unit.tolist()


def test_a_touch_without_curves_and_whole_numbers_of_numpy():
    ball = surfaces.sphere(25)
    with pytest.raises(DegenerateCurvesError, match="three curves are needed, got 0"):
        ball.fit([])
    assert ball.fit(GOOD, degree=np.int64(5)).patch.degree == 5


def test_a_sensor_that_knows_nothing_leaves_a_patch_in_doubt():
    ball = surfaces.sphere(25)
    r = ball.fit(GOOD, noise=1e20)
    assert r.status == "uncertain"
    assert np.isfinite([r.mean_height_std, r.patch.k1, r.patch.k2]).all()


def test_with_a_weight_beyond_all_measure_only_the_contacts_count():
    ball = surfaces.sphere(25)
    errors = [
        ball.fit(GOOD, method="tagc", degree=6, weight=weight).fit_error for weight in (1e12, 1e20, 1e50)
    ]
    assert errors == pytest.approx(errors[:1] * 3, rel=1e-6)


def test_curves_that_rounding_far_from_the_origin_spoils_are_refused():
    ball = surfaces.sphere(25)
    far = ball.point + 1e17
    with pytest.raises(DegenerateCurvesError, match="16 apart in double precision, too coarse for curves of"):
        reconstruct(far, [Contour(2000.0 * (c.points - ball.point) + far) for c in GOOD], outward=ball.normal)


def test_lengths_too_small_to_be_raised_to_the_sixth_power_are_none():
    ball = surfaces.sphere(25)
    curves = [Contour(1e-60 * c.points) for c in GOOD]
    with pytest.raises(DegenerateCurvesError, match="curve 1 has 0 of the 3 contacts"):
        reconstruct(1e-60 * ball.point, curves, outward=ball.normal)


MANY = [
    (surface, planes, noise)
    for surface in (
        surfaces.sphere(25),
        surfaces.torus(40, 20, 0.6),
        surfaces.bottle_neck(),
        surfaces.plane(),
    )
    for planes in (UPRIGHT, TILTED, surfaces.planes((0, 45, 90, 135)))
    for noise in (0.0, 0.05)
]


@pytest.mark.parametrize("options", [{}, {"degree": "auto"}, {"method": "tagc"}, {"noise": 0.3}])
def test_many_at_once_are_what_they_are_one_by_one(options):
    """Touches that differ in curves, contacts and outliers, so that their stacks have gaps."""
    rng = np.random.default_rng(7)
    points, outward, touches = [], [], []
    for i, (s, planes, noise) in enumerate(MANY):
        contours = s.track(
            planes,
            extent=rng.uniform(6, 12),
            step=rng.uniform(0.7, 1.5),
            noise=noise,
            rng=i,
        )
        if i % 3 == 0:
            contours[1].points[2] += 1.0
        if i % 5 == 0:
            contours[2] = Contour(contours[2].points[:-3], noise=noise)
        points.append(s.point)
        outward.append(s.normal)
        touches.append(contours)
    many = reconstruct_many(points, touches, outward=outward, **options)
    for point, up, contours, one_of_many in zip(points, outward, touches, many, strict=True):
        one = reconstruct(point, contours, outward=up, **options)
        assert one_of_many.frame.axes == pytest.approx(one.frame.axes, abs=1e-9)
        assert one_of_many.radius == pytest.approx(one.radius, rel=1e-12)
        assert one_of_many.contacts == pytest.approx(one.contacts, abs=1e-9)
        assert one_of_many.patch.degree == one.patch.degree
        x, y = one.domain.grid(60)[0].T
        assert one_of_many.patch.height(x, y) == pytest.approx(one.patch.height(x, y), abs=1e-7)
        assert one_of_many.height_std(x, y) == pytest.approx(one.height_std(x, y), rel=1e-6)
        assert one_of_many.domain.area == pytest.approx(one.domain.area)
        assert one_of_many.status == one.status


def test_a_touch_that_carries_nothing_does_not_spoil_the_others():
    ball = surfaces.sphere(25)
    results = reconstruct_many([ball.point] * 4, [GOOD, GOOD[:2], [], GOOD], outward=[ball.normal] * 4)
    assert [isinstance(r, DegenerateCurvesError) for r in results] == [False, True, True, False]
    assert "three curves are needed, got 2" in str(results[1])
    assert results[0].patch.k1 == pytest.approx(-0.04, abs=1e-3)
    assert reconstruct_many(np.empty((0, 3)), [], outward=np.empty((0, 3))) == []


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"points": [(0, 0, 0)] * 2}, "contours_list: expected 2 lists of contours, got 1"),
        ({"points": (0, 0, 0)}, r"points: expected shape \(n, 3\), got \(3,\)"),
        ({"outward": (0, 0, 1)}, r"outward: expected shape \(1, 3\), got \(3,\)"),
        ({"outward": [(0, 0, 0)]}, "outward: expected a vector with a direction"),
        ({"contours_list": 5}, "contours_list: expected a list, got 5"),
        ({"contours_list": [[5]]}, r"contours\[0\]: expected shape \(n, 3\), got \(\)"),
        ({"degree": 9}, "degree: expected a whole number"),
    ],
)
def test_bad_arguments_of_many_are_named(change, message):
    given = {"points": [surfaces.sphere(25).point], "outward": [surfaces.sphere(25).normal]}
    with pytest.raises(ValueError, match=message):
        reconstruct_many(**(given | {"contours_list": [GOOD]} | change))


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_without_a_direction_the_outer_side_is_that_of_the_measured_normals(side):
    ball, lengths = surfaces.sphere(25), np.linspace(0.1, 9.0, len(GOOD[0].points))[:, None]
    felt = [replace(c, normals=side * lengths * c.points / 25.0) for c in GOOD]
    assert reconstruct(ball.point, felt).normal @ ball.normal == pytest.approx(side, abs=1e-3)
    (r,) = reconstruct_many([ball.point], [felt])
    assert r.normal @ ball.normal == pytest.approx(side, abs=1e-3)
    around = [Contour(c.points, normals=c.normals) for c in felt]
    r = reconstruct(ball.point, [], strokes=around)
    assert r.normal @ ball.normal == pytest.approx(side, abs=1e-2)


def test_plain_arrays_are_contours():
    ball, arrays = surfaces.sphere(25), [c.points for c in GOOD]
    r = reconstruct(ball.point, arrays, outward=ball.normal)
    (one,) = reconstruct_many([ball.point], [[a.tolist() for a in arrays]], outward=[ball.normal])
    wanted = reconstruct(ball.point, [Contour(a) for a in arrays], outward=ball.normal)
    for found in (r, one):
        assert np.array_equal(found.patch.coefficients, wanted.patch.coefficients)
    assert np.allclose(common_point(arrays)[0], ball.point, atol=1e-3)
    words = "outward: expected a direction, because no contact has a normal, got None"
    with pytest.raises(ValueError, match=words):
        reconstruct(ball.point, arrays)
    with pytest.raises(ValueError, match=words):
        reconstruct_many([ball.point], [arrays])
    with pytest.raises(ValueError, match=r"contours\[2\]: numbers of single precision are"):
        reconstruct(ball.point, [*arrays[:2], np.float32(arrays[2] + 1e7)], outward=ball.normal)


def test_curves_to_one_side_of_the_point_that_end_together_bound_no_patch():
    s = np.linspace(0.1, 1.0, 9)
    curves = [Contour(np.column_stack([s, bend * s * (1.0 - s), 0.0 * s])) for bend in (-0.1, 0.0, 0.1)]
    with pytest.raises(DegenerateCurvesError, match="fewer than three separate places"):
        reconstruct((0, 0, 0), curves, outward=(0, 0, 1))


def test_an_outward_direction_that_the_surface_turns_away_from_is_refused():
    surface = surfaces.ellipsoid(35, 25, 20, 0.6, 0.5)
    curves, p = surface.track(UPRIGHT), surface.point
    tangents = curves_through(*stacked(p[None], [curves])).tangents[0]
    begins, ends = surface_normals(tangents, surface.normal), surface.fit(curves).frame.axes[:, 2]
    assert 1e-6 < np.linalg.norm(begins - ends) < 1e-2
    # Either direction is on the side of one of the two normals and not on that of the other.
    for outward in (begins - ends, ends - begins):
        with pytest.raises(DegenerateCurvesError, match="faces away from the outward direction"):
            reconstruct(p, curves, outward=outward)
    r = reconstruct(p, curves, outward=begins - ends + 0.01 * begins)
    np.testing.assert_allclose(r.frame.axes[:, 2], ends)


@pytest.mark.long
def test_no_numbers_but_finite_ones_come_out_of_random_curves():
    rng = np.random.default_rng(6)
    for _ in range(200):
        curves = [
            Contour(rng.normal(size=(rng.integers(3, 12), 3)) * 10.0 ** rng.uniform(-8, 8)) for _ in range(3)
        ]
        try:
            r = reconstruct((0, 0, 0), curves, outward=rng.normal(size=3), method=METHODS[rng.integers(4)])
        except DegenerateCurvesError:
            continue
        numbers = [
            r.fit_error,
            r.mean_height_std,
            r.total_absolute_curvature,
            r.condition_number,
            r.patch.k1,
            r.patch.k2,
            r.radius,
        ]
        assert np.isfinite([*numbers, *r.patch.coefficients, r.domain.area]).all()


def test_importing_core_imports_neither_blender_nor_scipy():
    """scipy would make enabling the extension slow, and nothing in core may need Blender."""
    code = "import sys, core; sys.exit(bool({'bpy', 'mathutils', 'scipy'} & set(sys.modules)))"
    root = Path(__file__).resolve().parents[3]
    assert subprocess.run([sys.executable, "-c", code], cwd=root).returncode == 0


def test_short_curves_with_a_long_one_cost_the_fit_what_they_have(monkeypatch):
    module = importlib.import_module("core.reconstruction.stacks")
    seen, fit = [], module.joint_fit
    monkeypatch.setattr(module, "joint_fit", lambda c, *rest: seen.append(c.contacts.shape) or fit(c, *rest))
    s = surfaces.pear()
    contours = s.track(surfaces.planes((0, 60, 120)))
    short = [replace(c, points=c.points[len(c.points) // 2 - 4 :][:8], normals=None) for c in contours[1:]]
    reconstruct(s.point, [contours[0], *short, *short], outward=s.normal)
    assert seen == [(1, sum(len(c.points) - 1 for c in (contours[0], *short, *short)), 3)]


def test_masked_contacts_are_refused():
    points = np.ma.masked_array(np.arange(12.0).reshape(4, 3), mask=False)
    assert Contour(points).points.shape == (4, 3)
    points[1] = np.ma.masked
    with pytest.raises(ValueError, match="points: expected numbers, got masked ones among them: remove them"):
        Contour(points)


@pytest.mark.parametrize("method", ["bayes", "tagc", "quadratic-variation", "least-squares"])
def test_a_caller_who_has_numpy_raise_gets_the_same_fit(method):
    s = surfaces.monkey_saddle()
    contours = s.track(surfaces.planes((0, 60, 120)), noise=1e-3, rng=1)
    wanted = reconstruct(s.point, contours, outward=s.normal, method=method)
    with np.errstate(all="raise"):
        found = reconstruct(s.point, contours, outward=s.normal, method=method)
        assert (found.status, found.mean_height_std) == (wanted.status, wanted.mean_height_std)
    assert np.array_equal(found.patch.coefficients, wanted.patch.coefficients)


@pytest.mark.parametrize(("method", "weight"), [("tagc", 1e3), ("quadratic-variation", 1e5)])
def test_the_weight_that_is_not_given_is_that_of_the_method(method, weight):
    surface = surfaces.torus(40, 20, 0.6)
    contours = surface.track(surfaces.planes((0, 60, 120)), noise=0.02, rng=1)
    one, other, half = (surface.fit(contours, method=method, weight=w) for w in (None, weight, weight / 2.0))
    assert np.array_equal(one.patch.coefficients, other.patch.coefficients)
    assert not np.array_equal(one.patch.coefficients, half.patch.coefficients)


@pytest.mark.parametrize("measured", [False, True])
@pytest.mark.parametrize("seed", range(3))
def test_repeated_contacts_count_once(seed, measured):
    """They follow each other, as of a sensor at rest, or come back later, as of one that goes to and fro."""
    surface, rng, given, repeated = surfaces.pear(), np.random.default_rng(seed), [], []
    for contour in surface.track(UPRIGHT, noise=0.05, rng=seed):
        normals, std = (contour.normals, 0.02) if measured else (None, None)
        given.append(Contour(contour.points, normals=normals, normal_std=std))
        order = np.concatenate([np.arange(25), rng.integers(0, 25, 40)])
        points, normals = contour.points[order], None if normals is None else normals[order]
        repeated.append(Contour(points, normals=normals, normal_std=std))
    one, other = (surface.fit(contours) for contours in (given, repeated))
    assert [len(contour.points) for contour in other.contours] == [25, 25, 25]
    assert other.patch.degree == one.patch.degree
    assert (other.status, other.message) == (one.status, one.message)
    assert other.frame.axes == pytest.approx(one.frame.axes, abs=1e-9)
    assert other.patch.coefficients == pytest.approx(one.patch.coefficients, rel=1e-6, abs=1e-12)
    assert other.mean_height_std == pytest.approx(one.mean_height_std, rel=1e-9)


def test_normals_of_a_repeated_contact_count_by_their_mean():
    contour = Contour(
        [[1, 0, 0], [2, 0, 0], [1, 0, 0], [0, 0, 0]],
        normals=[[0, 0, 3], [0, 1, 0], [0, -0.6, -0.8], [1, 0, 0]],
    )
    assert contour.points.tolist() == [[1, 0, 0], [2, 0, 0], [0, 0, 0]]
    assert contour.normals[0] / np.linalg.norm(contour.normals[0]) == pytest.approx([0, 0.1**0.5, 0.9**0.5])
    assert contour.normals[1:].tolist() == [[0, 1, 0], [1, 0, 0]]


def test_a_result_keeps_the_contacts_that_it_was_made_of():
    surface = surfaces.pear()
    contours = [replace(c, normal_std=0.02) for c in surface.track(UPRIGHT, noise=0.05, rng=1)]
    before, after = surface.fit(contours), surface.fit(contours)
    names = "misses", "fit_error", "typical_miss", "contradiction", "status", "message"
    expected = [getattr(before, name) for name in names]
    for contour in contours:
        contour.points[1:] += 3.0
        contour.normals[:] = contour.normals[:, ::-1]
    for name, value in zip(names, expected, strict=True):
        assert np.array_equal(getattr(after, name), value), name
    with pytest.raises(ValueError, match="read-only"):
        after.contours[0].points[0] = 0.0
