# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Contour tracking on exact surfaces."""

import warnings

import numpy as np
import pytest
import surfaces

from core import (
    Contour,
    SamplingPlane,
    explore,
    tapped,
    track,
    verify,
)
from core.reconstruction.next_plane import azimuth_of

PLANES = surfaces.planes((10, 70, 130), (0, 20, -35))


@pytest.mark.parametrize(
    "surface",
    [surfaces.sphere(25), surfaces.torus(40, 15, 2.6), surfaces.bottle_neck(), surfaces.quartic()],
    ids=["sphere", "torus inner", "bottle neck", "quartic"],
)
def test_contacts_are_on_the_surface_in_the_plane_and_a_step_apart(surface):
    for contour, plane in zip(surface.track(PLANES, extent=10, step=0.5), PLANES, strict=True):
        assert contour.stops == ("extent", "extent")
        assert len(contour.points) == 41
        assert np.array_equal(contour.points[20], surface.point)
        assert np.abs(surface.level(*contour.points.T)).max() < 1e-9
        assert np.abs((contour.points - surface.point) @ contour.plane_normal).max() < 1e-9
        steps = np.linalg.norm(np.diff(contour.points, axis=0), axis=1)
        assert np.abs(steps / 0.5 - 1.0).max() < 2e-3
        away = contour.points[21] - contour.points[19]
        tangent = plane.axes(surface.normal)[:, 0]
        assert away @ tangent > 0.999 * np.linalg.norm(away)
        exact = np.array([surface.gradient(p) for p in contour.points])
        exact /= np.linalg.norm(exact, axis=1, keepdims=True)
        assert np.abs(contour.normals - exact).max() < 1e-9


class Roof:
    """The plane z = 0, which turns down by an angle beyond x = 1."""

    def __init__(self, degrees):
        turn = np.radians(degrees)
        self.walls = (
            (np.array([0.0, 0.0, 1.0]), 0.0),
            (np.array([np.sin(turn), 0.0, np.cos(turn)]), np.sin(turn)),
        )

    def ray_cast(self, origin, direction, distance):
        hits = []
        for wall, (normal, offset) in enumerate(self.walls):
            across = normal @ direction
            gone = (offset - normal @ origin) / across if across else -1.0
            point = np.add(origin, np.multiply(gone, direction))
            if 0.0 <= gone <= distance and (point[0] > 1.0) == bool(wall):
                hits.append((gone, point, normal))
        return min(hits, key=lambda hit: hit[0])[1:] if hits else None


@pytest.mark.parametrize(("degrees", "stop"), [(44.0, "extent"), (46.0, "crease")])
def test_a_turn_of_more_than_45_degrees_is_a_crease(degrees, stop):
    (contour,) = track(
        Roof(degrees), np.zeros(3), (0.0, 0.0, 1.0), [SamplingPlane(0.0)], extent=2.0, step=0.15
    )
    assert contour.stops == ("extent", stop)


def test_a_tilted_plane_cuts_a_smaller_circle_of_a_sphere():
    """A plane tilted by b through a point of a sphere of radius r is r sin b from its center."""
    ball, tilt = surfaces.sphere(20.0), np.radians(30)
    (contour,) = ball.track([SamplingPlane(0.4, tilt)], extent=10, step=1)
    center = 20.0 * np.sin(tilt) * np.sign(contour.plane_normal @ ball.point) * contour.plane_normal
    assert np.allclose(np.linalg.norm(contour.points - center, axis=1), 20.0 * np.cos(tilt), atol=1e-9)


def test_azimuths_follow_the_contract():
    n = np.array([0.0, 0.0, 2.0])
    t, u, across = SamplingPlane(np.pi / 2).axes(n).T
    assert np.allclose([t, u, across], [[0, 1, 0], [0, 0, 1], [1, 0, 0]])
    assert np.allclose(SamplingPlane(0.0).axes([1.0, 0.1, 0.0])[:, 0], np.array([-0.1, 1, 0]) / np.sqrt(1.01))
    t, u, _ = SamplingPlane(0.0, 0.3).axes(n, tangent=[1.0, 0.0, 5.0]).T
    assert np.allclose(t, [1, 0, 0])
    assert np.allclose(u, [0, np.sin(0.3), np.cos(0.3)])


def test_noise_is_seeded_in_the_plane_along_the_curve_normal_and_spares_the_point():
    s = surfaces.ellipsoid(35, 25, 20, 0.6, 0.5)
    arguments = (s, s.point, s.normal, PLANES)
    clean = track(*arguments, extent=10, step=0.05)
    noisy = track(*arguments, extent=10, step=0.05, noise=0.1, rng=5)
    again = track(*arguments, extent=10, step=0.05, noise=0.1, rng=5)
    for a, b, c in zip(clean, noisy, again, strict=True):
        assert np.array_equal(b.points, c.points)
        offset = b.points - a.points
        assert np.array_equal(offset[len(offset) // 2], np.zeros(3))
        assert np.abs(offset @ a.plane_normal).max() < 1e-12
        along = np.gradient(a.points, axis=0)
        assert np.abs(np.sum(offset * along, axis=1)[1:-1]).max() < 1e-4 * 0.1
        size = np.sqrt(np.mean(np.sum(offset**2, axis=1)))
        assert size == pytest.approx(0.1, rel=0.15)
        assert b.noise == 0.1


class Facets:
    """Triangles that answer rays, one by one: a mesh with edges, as small as a test wants."""

    def __init__(self, *triangles):
        self.triangles = np.array(triangles, dtype=float)

    def ray_cast(self, origin, direction, distance):
        best = None
        for a, b, c in self.triangles:
            n = np.cross(b - a, c - a)
            slope = n @ direction
            if abs(slope) < 1e-12:
                continue
            t = n @ (a - origin) / slope
            p = np.asarray(origin) + t * np.asarray(direction)
            inside = all(n @ np.cross(q - p, r - p) >= -1e-9 for q, r in ((a, b), (b, c), (c, a)))
            if 0 <= t <= distance and inside and (best is None or t < best[0]):
                best = t, p, n / np.linalg.norm(n)
        return best and best[1:]


def square(corner, side, other):
    a, u, v = (np.array(w, dtype=float) for w in (corner, side, other))
    return (a, a + u, a + u + v), (a, a + u + v, a + v)


FLOOR = square((-10, -10, 0), (20, 0, 0), (0, 20, 0))


@pytest.mark.parametrize(
    ("more", "stop", "reached"),
    [
        ((), "no contact", 10.0),  # the sheet's border
        (square((10, -10, 0), (0, 0, -20), (0, 20, 0)), "crease", 10.0),  # the edge of a box
        (square((6, -10, 0), (0, 20, 0), (0, 0, 20)), "crease", 6.0),  # a wall on the floor
        (square((10, -10, 0), (10, 0, -20), (0, 20, 0)), "crease", 10.0),  # a flank of 63 degrees
        (square((10, -10, 0), (20, 0, -8), (0, 20, 0)), "extent", 15.0),  # a bend of 22 degrees
    ],
    ids=["border", "box", "wall", "flank", "bend"],
)
def test_stops(more, stop, reached):
    (contour,) = track(Facets(*FLOOR, *more), (0, 0, 0), (0, 0, 1), [SamplingPlane(0.0)], extent=15, step=0.7)
    assert contour.stops == ("no contact", stop)
    traveled = np.linalg.norm(np.diff(contour.points, axis=0), axis=1).sum() - 9.8
    assert reached - 1.4 <= traveled <= reached + 1e-9


def test_a_sheet_is_touched_from_either_side():
    (below,) = track(Facets(*FLOOR), (0, 0, 0), (0, 0, -1), [SamplingPlane(0.0)], extent=5, step=1)
    assert below.stops == ("extent", "extent")
    assert np.allclose(below.normals, [0, 0, -1])


def test_a_ball_ends_where_one_height_no_longer_describes_it():
    ball = surfaces.sphere(10.0)
    (contour,) = ball.track([SamplingPlane(0.0)], extent=30, step=0.5)
    assert contour.stops == ("Monge assumption lost",) * 2
    assert (contour.normals @ ball.normal).min() > np.cos(np.radians(75.0))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"step": -1}, "step: expected a finite number above 0, got -1"),
        ({"step": 20}, "step: expected no more than the extent 10, got 20"),
        ({"extent": float("nan")}, "extent: expected a finite number above 0, got nan"),
        ({"noise": -0.1}, "noise: expected a finite number of 0 or more, got -0.1"),
        ({"point": (0, 0)}, r"point: expected shape \(3\), got \(2,\)"),
        ({"point": (0, 0, np.inf)}, "point: expected finite numbers"),
        ({"point": (0, 0, 3)}, "point: expected one on the surface"),
        ({"outward": (0, 0, 0)}, "outward: expected a vector with a direction"),
        ({"tangent": (0, 0, 1)}, "tangent: expected a direction across the normal"),
        ({"planes": [SamplingPlane(0.0, 1.6)]}, "tilt: expected less than 90 degrees"),
        ({"planes": [SamplingPlane(float("nan"))]}, "azimuth: expected a finite number, got nan"),
        ({"planes": None}, "planes: expected a list, got None"),
        ({"planes": [0.5]}, "planes: expected a list of SamplingPlane, got 0.5 in it"),
        ({"step": 1e-7}, "step: expected at least a 10000th of the extent 10, got 1e-07"),
        ({"step": 5e-324}, "step: expected a number of 1e-50 or more, got 4.94066e-324"),
        ({"extent": 1e-60}, "extent: expected a number of 1e-50 or more, got 1e-60"),
        ({"rng": "dice"}, "rng: expected a Generator or a whole number of 0 or more, got 'dice'"),
        ({"rng": -1}, "rng: expected a Generator or a whole number of 0 or more, got -1"),
    ],
)
def test_bad_arguments_are_named(change, message):
    arguments = {"point": (0, 0, 0), "outward": (0, 0, 1), "planes": PLANES, "extent": 10, "step": 1} | change
    with pytest.raises(ValueError, match=message):
        track(
            surfaces.plane(),
            arguments.pop("point"),
            arguments.pop("outward"),
            arguments.pop("planes"),
            **arguments,
        )


@pytest.mark.parametrize("kind", [str, np.float32, np.array])
def test_lengths_of_any_kind_count_as_numbers(kind):
    surface = surfaces.plane()
    given = {name: kind(value) for name, value in {"extent": 2.0, "step": 0.5, "noise": 0.25}.items()}
    found, expected = (
        track(surface, (0, 0, 0), (0, 0, 1), PLANES, rng=1, **lengths)
        for lengths in (given, {"extent": 2.0, "step": 0.5, "noise": 0.25})
    )
    for one, other in zip(found, expected, strict=True):
        assert np.array_equal(one.points, other.points)


def test_contours_take_lists_and_refuse_nonsense():
    contour = Contour([[0, 0, 0], [1, 2, 3]], plane_normal=[0, 0, 4])
    assert contour.points.dtype == np.float64
    assert np.array_equal(contour.plane_normal, [0, 0, 1])
    for points in ([[0, 0]], [1, 2, 3], [[0, 0, np.nan]], "abc"):
        with pytest.raises(ValueError, match="points: expected"):
            Contour(points)
    for stops in (5, ("extent",), (1, 2)):
        with pytest.raises(ValueError, match="stops: expected"):
            Contour([[0, 0, 0]], stops=stops)


@pytest.mark.parametrize(
    ("hit", "message"),
    [
        (((np.nan, 0, 0), (0, 0, 1)), "a point and its unit normal"),
        (((1e60, 0, 0), (0, 0, 1)), "a point and its unit normal"),
        (((0, 0, 0), (0, 0, 0)), "a point and its unit normal"),
        (((0, 0, 0), (0, 0, 3)), "a point and its unit normal"),
        ((None, None), "a point and its unit normal"),
        (((0, 0, 0), (0, 0, 1)), "got one 0 from the last"),
        (((9, 0, 0), (0, 0, 1)), "got one 9 from the last"),
    ],
)
def test_a_surface_that_answers_nonsense_is_named(hit, message):
    class Odd(Facets):
        """Gives this one answer to every ray down onto the surface but the first."""

        def ray_cast(self, origin, direction, distance):
            return (
                hit
                if direction[2] < -0.5 and origin[0] > 0.5
                else super().ray_cast(origin, direction, distance)
            )

    with pytest.raises(ValueError, match=f"surface: expected .*{message}"):
        track(Odd(*FLOOR), (0, 0, 0), (0, 0, 1), [SamplingPlane(0.0)], extent=5, step=1)


def test_noise_at_a_point_whose_normal_is_across_the_plane():
    class Leaning:
        def ray_cast(self, origin, direction, distance):
            return (0.0, 0.0, 0.0), (0.0, 1.0, 0.0)

    (contour,) = track(
        Leaning(), (0, 0, 0), (0, 0, 1), [SamplingPlane(0.0)], extent=5, step=1, noise=0.1, rng=1
    )
    assert np.array_equal(contour.points, [(0, 0, 0)])


def test_a_point_where_rays_slip_between_faces_is_still_on_the_surface():
    class Slit(Facets):
        """Lets rays through within 1e-9 of the y axis, as the edge between two faces of a mesh may."""

        def ray_cast(self, origin, direction, distance):
            return None if abs(origin[0]) < 1e-9 else super().ray_cast(origin, direction, distance)

    (contour,) = track(Slit(*FLOOR), (0, 0, 0), (0, 0, 1), [SamplingPlane(0.0)], extent=5, step=1)
    assert contour.stops == ("extent", "extent")
    assert np.array_equal(contour.points[5], (0, 0, 0))


def test_azimuth_of_a_direction_gives_the_plane_that_holds_it():
    normal, tangent = (0.3, -0.2, 0.9), (0.1, 1.0, 0.0)
    for degrees in (0.0, 17.0, 90.0, 163.0):
        t = SamplingPlane(np.radians(degrees)).axes(normal, tangent)[:, 0]
        assert np.degrees(azimuth_of(t, normal, tangent)) % 180.0 == pytest.approx(degrees, abs=1e-6)
        assert np.degrees(azimuth_of(-t, normal, tangent)) % 180.0 == pytest.approx(degrees, abs=1e-6)


@pytest.mark.parametrize("radius", [6.0, 10.0, 40.0])
def test_contacts_are_a_step_apart_to_a_thousandth_however_bent_the_surface_is(radius):
    """A step of 0.28 of the radius along the tangent of a circle ends 1 % too far."""
    ball = surfaces.sphere(radius)
    (contour,) = ball.track([SamplingPlane(0.4)], extent=8.0, step=2.0)
    steps = np.linalg.norm(np.diff(contour.points, axis=0), axis=1)
    assert len(steps) >= 6
    assert np.abs(steps / 2.0 - 1.0).max() < 1e-3


def test_a_plane_leans_by_less_than_a_right_angle():
    for degrees in (-89.0, 65.0, 89.0):
        t, u, across = SamplingPlane(0.3, np.radians(degrees)).axes((0, 0, 1)).T
        assert u[2] == pytest.approx(np.cos(np.radians(degrees)))
        assert np.cross(t, u) == pytest.approx(across)
    for degrees in (-90.0, 90.0, 100.0):
        with pytest.raises(ValueError, match="tilt: expected less than 90 degrees, got"):
            SamplingPlane(0.3, np.radians(degrees)).axes((0, 0, 1))


@pytest.mark.parametrize(("spacings", "good"), [(90.0, False), (110.0, True)])
def test_single_precision_may_round_by_a_hundredth_of_a_curves_size(spacings, good):
    spacing = float(np.spacing(np.float32(1e5)))
    points = np.linspace([1e5, 0.0, 0.0], [1e5 + spacings * spacing, 0.0, 0.0], 3)
    assert len(Contour(points).points) == 3
    if good:
        assert len(Contour(points.astype(np.float32)).points) == 3
    else:
        with pytest.raises(ValueError, match="numbers of single precision are"):
            Contour(points.astype(np.float32))


@pytest.mark.parametrize("step", [0.01, 100.0])
def test_a_ray_that_slips_between_two_faces_is_cast_again_a_thousandth_of_a_step_aside(step):
    """A plate reaches five steps to each side, and no ray meets it at the reference point itself."""

    class Plate:
        def ray_cast(self, origin, direction, distance):
            t = np.inf if direction[2] == 0.0 else -origin[2] / direction[2]
            x, y = (origin[i] + t * direction[i] if t < np.inf else np.inf for i in (0, 1))
            missed = not 0.0 <= t <= distance or max(abs(x), abs(y)) > 5.0 * step or x == y == 0.0
            return None if missed else ((x, y, 0.0), (0.0, 0.0, 1.0))

    (contour,) = track(Plate(), (0, 0, 0), (0, 0, 1), [SamplingPlane(0.0)], extent=4 * step, step=step)
    assert len(contour.points) == 9
    assert contour.points[5] == pytest.approx([step, 0.0, 0.0], abs=1.1e-3 * step)


class Single:
    """A surface that answers in single precision."""

    def __init__(self, surface):
        self.surface = surface

    def ray_cast(self, *ray):
        hit = self.surface.ray_cast(*ray)
        return hit and tuple(part.astype(np.float32) for part in hit)


def test_a_surface_of_single_precision_is_touched_in_double_precision():
    exact = surfaces.pear()
    single = Single(exact)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        contours = track(single, exact.point, exact.normal, PLANES, extent=10, step=0.5)
        touch = explore(single, exact.point, exact.normal)
        r = touch.result
        vertices = r.frame.to_world(r.mesh()[0]).astype(np.float32)
        off, report = tapped(r, single).height, verify(r, single, vertices)
    for contour, other in zip(contours, exact.track(PLANES, extent=10, step=0.5), strict=True):
        assert contour.points.dtype == contour.normals.dtype == np.float64
        assert contour.points == pytest.approx(other.points, abs=1e-5)
        # The ways between contacts are as long in spite of the rounding of each.
        steps = np.linalg.norm(np.diff(contour.points, axis=0), axis=1)
        assert np.abs(steps / 0.5 - 1.0).max() < 2e-3
    assert type(off) is float
    assert off < 3.0 * r.mean_height_std
    assert all(type(value) in (int, float) for value in report.values())
