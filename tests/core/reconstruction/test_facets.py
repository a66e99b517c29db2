# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Whether a touch of few facets says how far its curvature is off, on shapes that are known exactly."""

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial import ConvexHull

import core
from tests.surfaces import Exact, ellipsoid, plane

UP = (0.0, 0.0, 1.0)


class Prism:
    """Strips along y, 2 long, over a polygon (x, z) in the order of x; rays from above meet it."""

    def __init__(self, profile):
        self.profile = np.array(profile, dtype=float)

    def ray_cast(self, origin, direction, distance):
        found = None
        for face in range(len(self.profile) - 1):
            a, b, c = self.corners_of(face)[:3]
            normal = np.cross(b - a, c - a)
            normal /= np.linalg.norm(normal)
            speed = normal @ direction
            gone = normal @ (a - origin) / speed if abs(speed) > 1e-12 else -1.0
            point = np.add(origin, gone * np.array(direction))
            inside = a[0] - 1e-12 <= point[0] <= b[0] + 1e-12 and abs(point[1]) <= 1.0
            if inside and 0.0 <= gone <= distance and (found is None or gone < found[0]):
                found = gone, tuple(point), tuple(normal)
        return None if found is None else found[1:]

    def corners_of(self, face):
        (x, z), (u, w) = self.profile[face : face + 2]
        return np.array([(x, -1.0, z), (u, -1.0, w), (u, 1.0, w), (x, 1.0, z)])

    def face_near(self, point):
        at, ahead = self.profile[:-1], self.profile[1:]
        along, off = ahead - at, np.array(point)[[0, 2]] - at
        share = np.clip((off * along).sum(axis=1) / (along**2).sum(axis=1), 0.0, 1.0)
        return int(np.argmin(np.linalg.norm(off - share[:, None] * along, axis=1)))


def arc(facets, bend=60.0):
    """An arc of radius 1 that bends by `bend` degrees to either side, in facets."""
    angles = np.radians(np.linspace(-bend, bend, facets + 1))
    return Prism(np.column_stack([np.sin(angles), np.cos(angles)]))


def judged(r, mesh):
    """The reconstruction with what facets add to its deviations, and whether they are a doubt."""
    found = core.with_facets(r, mesh)
    return found, any(doubt.code == "facets" for doubt in found.doubts)


def is_beyond(off, r):
    """Whether a curvature is off by more than two of its deviations."""
    return off > 2.0 * max(r.k1_std, r.k2_std)


def touched(prism, extent, x):
    z = np.interp(x, *prism.profile.T)
    r = core.explore(prism, (x, 0.0, z), UP, extent=extent).result
    return judged(r, prism)


def has_few(prism, extent, x=0.01):
    return touched(prism, extent, x)[1]


@pytest.mark.parametrize(
    ("facets", "extent", "few"),
    [(5, 0.15, True), (9, 0.1, True), (16, 0.5, False), (41, 0.4, False)],
)
def test_few_facets_of_an_arc_are_not_its_shape(facets, extent, few):
    assert has_few(arc(facets), extent) is few


@pytest.mark.parametrize(
    ("facets", "extent", "x", "few"),
    [
        (9, 0.1, 0.1, True),
        (4, 0.6, 0.01, True),
        (6, 0.6, 0.01, True),
        (7, 0.6, 0.01, True),
        (10, 0.5, 0.1, True),
        (6, 0.6, 0.1, False),
        (7, 0.6, 0.1, False),
        (8, 0.5, 0.01, False),
        (8, 0.6, 0.1, False),
    ],
)
def test_the_curvature_of_an_arc_is_that_of_facets_where_it_is_off(facets, extent, x, few):
    r, said = touched(arc(facets), extent, x)
    assert said is few
    assert (max(abs(r.k1 + 1.0), abs(r.k2)) > 0.2) is few


def rounded(radius=0.3, strips=16):
    """A flat face from x = -.7 to .7, at z = 0, whose ends go down in quarters of a circle."""
    angles = np.radians(np.linspace(0.0, 80.0, strips + 1))
    end = np.column_stack([0.7 + radius * np.sin(angles), radius * (np.cos(angles) - 1.0)])
    return Prism(np.vstack([end[::-1] * (-1.0, 1.0), end]))


@pytest.mark.parametrize("strips", [4, 16, 64])
def test_the_curvature_of_a_flat_face_is_not_that_of_the_bend_beside_it(strips):
    prism = rounded(strips=strips)
    r = core.explore(prism, (0.65, 0.0, 0.0), UP, extent=0.3).result
    assert r.status == "uncertain"
    assert r.message.startswith(
        "The point is on a flat face, and the curvature is that of the bends next to it: use a shorter "
        "extent or move the point away from them."
    )
    assert abs(r.k1) * r.radius > 3.0 * r.posterior.curvature_std()  # which contacts alone would say
    for x in (0.45, 0.55, 0.6, 0.65):
        r = core.explore(prism, (x, 0.0, 0.0), UP, farthest=0.8).result
        assert r.status == "ok"
        assert abs(r.k1) < max(3.0 * r.k1_std, 0.02 / r.radius)
        assert abs(r.k2) < max(3.0 * r.k2_std, 0.02 / r.radius)


@pytest.mark.parametrize("normals", [None, 0.0, 2.0, -1.0, 1e-310, 1e300])
def test_a_face_is_flat_by_normals_of_any_length(normals):
    contours = core.explore(rounded(), (0.65, 0.0, 0.0), UP, extent=0.3).contours
    given = [None if normals is None else normals * contour.normals for contour in contours]
    again = [replace(contour, normals=each) for contour, each in zip(contours, given, strict=True)]
    message = core.reconstruct((0.65, 0.0, 0.0), again, outward=UP).message
    assert message.startswith("The point is on a flat face") is bool(normals)


def test_a_bend_is_no_flat_face():
    """The point is on the bend, whose radius is .3, between facets of .03."""
    r = core.explore(rounded(), (0.85, 0.0, 0.3 * (math.sqrt(0.75) - 1.0)), UP, extent=0.12).result
    assert r.status == "ok"
    assert max(abs(r.k1), abs(r.k2)) == pytest.approx(1.0 / 0.3, rel=0.1)


class Mesh:
    """Faces of a convex mesh around the origin, which a ray meets."""

    def __init__(self, corners):
        self.corners = np.array(corners)  # (n, 3 or 4, 3), counterclockwise from outside
        a, b, c = self.corners.swapaxes(0, 1)[[0, 1, -1]]
        self.normals = np.cross(self.corners[:, 2] - a, c - b)  # The diagonals, or sides of a triangle.
        self.normals /= np.linalg.norm(self.normals, axis=1, keepdims=True)
        self.offs = (self.normals * a).sum(axis=1)

    def ray_cast(self, origin, direction, distance):
        speeds, gaps = self.normals @ direction, self.offs - self.normals @ origin
        if (gaps[speeds == 0.0] < 0.0).any():  # The ray is parallel to a face, outside of it.
            return None
        with np.errstate(divide="ignore", invalid="ignore"):
            gone = gaps / speeds
        enters, leaves = gone[speeds < 0.0].max(initial=-np.inf), gone[speeds > 0.0].min(initial=np.inf)
        at = enters if enters >= 0.0 else leaves
        if enters > leaves or not 0.0 <= at <= distance:
            return None
        face = int(
            np.argmin(np.abs(np.where(np.sign(speeds) == (-1 if at == enters else 1), gone, np.inf) - at))
        )
        return tuple(np.add(origin, at * np.array(direction))), tuple(self.normals[face])

    def face_near(self, point):
        return int(np.argmax(self.normals @ point - self.offs))

    def corners_of(self, face):
        return self.corners[face]


def icosphere(level):
    """Blender's ball of triangles, whose corners lie on the unit sphere."""
    g = 0.5 * (1.0 + math.sqrt(5.0))
    points = np.array([p for a in (-1.0, 1.0) for b in (-g, g) for p in ((0, a, b), (a, b, 0), (b, 0, a))])
    faces = [
        t
        for t in itertools.combinations(points, 3)
        if all(abs(math.dist(p, q) - 2.0) < 1e-9 for p, q in itertools.combinations(t, 2))
    ]
    faces = [(a, b, c) if np.dot(np.cross(b - a, c - a), a) > 0.0 else (a, c, b) for a, b, c in faces]
    for _ in range(level - 1):
        faces = [part for a, b, c in faces for part in split(a, b, c)]
    return Mesh(np.array(faces) / np.linalg.norm(faces, axis=-1, keepdims=True))


def split(a, b, c):
    a, b, c = (np.divide(p, np.linalg.norm(p)) for p in (a, b, c))
    d, e, f = a + b, b + c, c + a
    d, e, f = (p / np.linalg.norm(p) for p in (d, e, f))
    return (a, d, f), (d, b, e), (f, e, c), (d, e, f)


@pytest.mark.long
def test_the_curvature_of_a_ball_of_few_facets_is_within_its_deviation():
    """A ball of 320 triangles: a touch within a few of them would be off by up to .9."""
    ball, rng = icosphere(3), np.random.default_rng(0)
    wrong, errors = 0, []
    for direction in rng.normal(size=(24, 3)):
        up = direction / np.linalg.norm(direction)
        point, normal = ball.ray_cast(tuple(2.0 * up), tuple(-up), 2.0)
        r = core.explore(ball, point, normal).result
        errors.append(max(abs(r.k1 + 1.0), abs(r.k2 + 1.0)))
        wrong += is_beyond(errors[-1], r)
    assert np.median(errors) < 0.2
    assert wrong <= 2


def uv_ball(segments, rings):
    """Blender's ball of `segments` around its axis and `rings` from pole to pole."""
    turns, tilts = 2.0 * math.pi / segments * np.arange(segments + 1), math.pi / rings * np.arange(rings + 1)
    at = [[(math.sin(b) * math.cos(a), math.sin(b) * math.sin(a), math.cos(b)) for a in turns] for b in tilts]
    rows = [np.array(list(itertools.pairwise(row))) for row in at]
    faces = [
        np.stack([upper[:, 0], lower[:, 0], lower[:, 1], upper[:, 1]], axis=1)
        for upper, lower in itertools.pairwise(rows)
    ]
    return Mesh(np.concatenate(faces))


def in_triangles(mesh):
    """The mesh with all its faces, of four corners, split in two; at the poles one of the two has no area."""
    return Mesh(outward(np.concatenate([mesh.corners[:, [0, 1, 2]], mesh.corners[:, [0, 2, 3]]])))


def hull(count):
    """The convex hull of random points of the unit sphere, whose triangles are of all shapes and sizes."""
    points = np.random.default_rng(0).normal(size=(count, 3))
    points /= np.linalg.norm(points, axis=1, keepdims=True)
    return Mesh(outward(points[ConvexHull(points).simplices]))


def outward(triangles):
    """Those of the triangles around the origin that have an area, counterclockwise from outside."""
    volumes = np.linalg.det(triangles)
    triangles[volumes < 0.0] = triangles[volumes < 0.0][:, ::-1]
    return triangles[np.abs(volumes) > 1e-9]


@pytest.mark.parametrize(
    "ball",
    [
        uv_ball(16, 64),
        uv_ball(64, 12),
        in_triangles(uv_ball(12, 64)),
        in_triangles(uv_ball(64, 12)),
        hull(300),
    ],
    ids=["16 x 64", "64 x 12", "12 x 64 in triangles", "64 x 12 in triangles", "hull"],
)
def test_facets_that_are_long_across_a_smooth_bend_are_felt(ball):
    """Within one the curvature would be off by 1. A touch goes over several, though it is in doubt then."""
    rng = np.random.default_rng(1)
    wrong, errors = 0, []
    for up in rng.normal(size=(8, 3)):
        up /= np.linalg.norm(up)
        point, normal = ball.ray_cast(tuple(2.0 * up), tuple(-up), 2.0)
        r = core.explore(ball, point, normal).result
        r, few = judged(r, ball)
        off = max(abs(r.k1 + 1.0), abs(r.k2 + 1.0))
        assert off > 0.15 or not few
        errors.append(off)
        wrong += r.status == "ok" and off > 0.25 and is_beyond(off, r)
        assert few or off < 3.5 * max(r.k1_std, r.k2_std)
    assert np.median(errors) < 0.35
    assert wrong <= 1


@pytest.mark.parametrize(("face", "share"), [(67, 0.46), (110, 0.59), (112, 0.56), (42, 0.32)])
def test_a_touch_in_doubt_beside_an_edge_is_not_one_within_a_facet(face, share):
    """Half curves within it would have a flat patch, or that of the edge, bent the more the shorter it is."""
    ball = hull(60)
    a, b, _ = ball.corners[face]
    at_edge = a + share * (b - a)
    point = at_edge + 0.02 * (ball.corners[face].mean(axis=0) - at_edge)
    r = core.explore(ball, tuple(point), tuple(ball.normals[face])).result
    assert r.status == "uncertain"
    assert r.radius > r.facet_width > 0.1


class Bump:
    """The height -x^2 - y^2 at the corners of a grid of squares, and that of its rim beyond a radius."""

    def __init__(self, width, radius):
        self.width, self.radius = width, radius

    def face_near(self, point):
        row, column = np.floor(np.divide(point[:2], self.width) + 0.5).astype(int).tolist()
        return 1000 * row + column + 500

    def corners_of(self, face):
        row, column = divmod(face, 1000)
        column -= 500
        x, y = self.width * np.array([(row - 0.5, column - 0.5)] * 4).T
        x, y = x + self.width * np.array([0, 1, 1, 0]), y + self.width * np.array([0, 0, 1, 1])
        return np.column_stack([x, y, -np.minimum(x**2 + y**2, self.radius**2)])


@pytest.mark.parametrize(("radius", "std"), [(10.0, 0.362), (0.34, 1.426)])
def test_the_deviation_has_how_far_estimates_of_the_shape_are_off_and_apart(radius, std):
    """A bump that is as wide as three facets does not show what the shape is, so there is no doubt of it."""
    bump = Bump(0.2, radius)
    bowl = Exact(
        lambda x, y, z: z + x**2 + y**2,
        lambda p: np.array([2.0 * p[0], 2.0 * p[1], 1.0]),
        np.zeros(3),
        -2.0,
        -2.0,
    )
    r = core.explore(bowl, bowl.point, UP, extent=0.3).result
    found, few = judged(r, bump)
    assert not few
    assert found.k1_std == pytest.approx(std, rel=0.01)
    off = np.abs(r.k1 - found.shape_curvatures).max()
    apart = np.ptp(found.shape_curvatures, axis=0).max()
    assert found.k1_std == pytest.approx(math.hypot(r.k1_std, off, apart), rel=0.01)


@pytest.mark.parametrize("share", [0.5, 0.99, 1.01, 2.0, 5.0])
def test_facets_wider_than_half_curves_leave_more_of_the_curvature_open(share):
    """They show how far the shape turns from one to the next, and half curves may have all of that turn."""
    exact = core.explore(plane(), (0.0, 0.0, 0.0), UP, extent=0.2).result
    r = replace(exact, shape_curvatures=np.array([[-1.0, 0.0]]))
    wide = replace(r, facet_width=share * r.radius)
    expected, turn = max(share, 1.0) * abs(exact.k1 + 1.0), np.diag([2.0, 2.0, 2.0, 1.0])
    assert wide.k1_std == pytest.approx(math.hypot(exact.k1_std, expected))
    assert wide.moved(turn).k1_std == pytest.approx(0.5 * wide.k1_std)
    assert wide.doubts == r.doubts


@pytest.mark.parametrize("radius", [0.03, 0.05, 0.1])
@pytest.mark.parametrize(("extent", "is_new"), [(0.05, True), (0.07, True), (0.19, False)])
def test_the_curvature_of_a_ridge_within_a_facet_is_within_its_deviation(radius, extent, is_new):
    """The shorter a parabola on the ridge is, the more of the curvature at its top it has."""
    x = 0.2 * (np.arange(-6, 6) + 0.5)
    prism = Prism(np.column_stack([x, -0.3 * np.hypot(x, radius)]))
    r, _ = touched(prism, extent, 0.0)
    over = np.linspace(-r.radius, r.radius, 1001)
    off = abs(r.k1 - 2.0 * np.polyfit(over, -0.3 * np.hypot(over, radius), 2)[0])
    assert off < 2.0 * r.k1_std
    assert (off > 2.0 * replace(r, facet_width=0.0).k1_std) == is_new


def test_curvatures_of_flattened_balls_are_seldom_wrongly_said_to_be_those_of_facets():
    """They change within a facet or two, which corners of facets show and their normals do not."""
    rng, errors, wrongly, wrong = np.random.default_rng(0), [], 0, 0
    for height in (0.2, 0.3):
        ball = Mesh(uv_ball(32, 16).corners * (1.0, 1.0, height))
        for share, turn in rng.random((40, 2)):
            across, turn = 0.97 * math.sqrt(share), 2.0 * math.pi * turn
            above = across * math.cos(turn), across * math.sin(turn), 2.0
            point, normal = ball.ray_cast(above, (0.0, 0.0, -1.0), 4.0)
            r = core.explore(ball, point, normal).result
            v = math.atan2(point[2] / height, math.hypot(*point[:2]))
            shape = ellipsoid(1.0, 1.0, height, v=v)
            exact = np.sort([shape.k1, shape.k2])
            apart = np.abs(np.sort([r.k1, r.k2]) - exact)
            off = apart.max() / -exact[0]
            r, few = judged(r, ball)
            errors.append(off)
            wrongly += few and off < 0.15
            wrong += r.status == "ok" and off > 0.25 and is_beyond(off, r)
            assert r.status != "ok" or few or (apart < 3.0 * np.array([r.k1_std, r.k2_std])).all()
    assert np.median(errors) < 0.155
    assert wrongly <= 2
    assert wrong <= 12  # Patches reach over the rim, where their deviation is as large.


@pytest.mark.parametrize(("bend", "few"), [(0.01, False), (0.05, True)])
def test_a_shape_that_bends_by_less_than_a_patch_may_is_no_doubt(bend, few):
    r = core.explore(plane(), (0.0, 0.0, 0.0), UP, extent=0.3).result
    r = replace(r, shape_curvatures=np.array([[-bend / r.radius, 0.0]]))
    assert any(doubt.code == "facets" for doubt in r.doubts) is few


@pytest.mark.parametrize("latitude", [3.4, 5.0, 5.6, 6.8])
def test_narrow_facets_of_the_rim_of_a_flat_ball_are_not_its_curvature(latitude):
    """They are a fifth as wide as long, and turn by 66 degrees at the rim."""
    ball, v = Mesh(uv_ball(32, 16).corners * (1.0, 1.0, 0.15)), math.radians(latitude)
    toward = np.array([math.cos(v), 0.05 * math.cos(v), 0.15 * math.sin(v)])
    point, normal = ball.ray_cast(tuple(2.0 * toward), tuple(-toward / np.linalg.norm(toward)), 3.0)
    r, _ = judged(core.explore(ball, point, normal).result, ball)
    k1 = ellipsoid(1.0, 1.0, 0.15, v=math.atan2(point[2] / 0.15, math.hypot(*point[:2]))).k1
    assert r.status != "ok" or not is_beyond(abs(min(r.k1, r.k2) - k1), r)


def cone(segments):
    """Blender's cone, of radius 1 and height 2, around the origin."""
    angles = 2.0 * math.pi / segments * np.arange(segments + 1)
    rim = np.column_stack([np.cos(angles), np.sin(angles), np.full(segments + 1, -1.0)])
    wall = [((0.0, 0.0, 1.0), a, b) for a, b in itertools.pairwise(rim)]
    return Mesh(wall + [((0.0, 0.0, -1.0), b, a) for a, b in itertools.pairwise(rim)])


@pytest.mark.parametrize("z", [0.85, 0.9, 0.95])
def test_facets_that_narrow_toward_the_tip_of_a_cone_are_fine_there(z):
    mesh = cone(32)
    along = np.array([math.cos(0.1), math.sin(0.1), 0.0])
    point, normal = mesh.ray_cast(tuple(2.0 * along + (0.0, 0.0, z)), tuple(-along), 3.0)
    r = core.explore(mesh, point, normal).result
    exact = np.array([-4.0 / math.sqrt(5.0) / (1.0 - z), 0.0])
    assert np.abs(np.sort([r.k1, r.k2]) - exact).max() < 0.15 * -exact[0]
    assert not judged(r, mesh)[1]


def test_few_long_facets_are_felt_at_the_base_of_a_cone():
    """A touch there is as long as six of them are wide, and may have the curvature of a few."""
    mesh, wrong, called = cone(32), 0, 0
    for number in range(24):
        z, turn = -1.0 + 0.08 * (number + 0.5) / 24, 2.4 * number
        out = np.array([math.cos(turn), math.sin(turn), 0.0])
        point, normal = mesh.ray_cast(tuple(2.0 * out + (0.0, 0.0, z)), tuple(-out), 3.0)
        r = core.explore(mesh, point, normal, farthest=0.5625).result
        exact = np.array([-4.0 / math.sqrt(5.0) / (1.0 - z), 0.0])
        r, few = judged(r, mesh)
        off = np.abs(np.sort([r.k1, r.k2]) - exact).max()
        assert off > -0.15 * exact[0] or not few
        called += few
        wrong += r.status == "ok" and off > -0.25 * exact[0] and is_beyond(off, r)
    assert called
    assert wrong == 0


def test_facets_at_the_rim_of_a_lens_are_fine_where_its_curvature_is_right():
    """It bends by much more at its rim than within a facet's length of that."""
    thin = (1.0, 1.0, 0.3)
    lens = Mesh(uv_ball(64, 32).corners * thin)
    for turn in (0.0, 0.03, 0.05):
        up = np.array([math.cos(turn), math.sin(turn), 0.0])
        point, normal = lens.ray_cast(tuple(2.0 * up), tuple(-up), 2.0)
        for extent in (0.2, 0.3, 0.4):
            r = core.explore(lens, point, normal, extent=extent).result
            assert np.abs(np.sort([r.k1, r.k2]) - (-1.0 / 0.09, -1.0)).max() < 0.05 / 0.09
            assert not judged(r, lens)[1]


def test_a_flat_face_between_sharp_edges_is_the_shape():
    assert not has_few(Prism([(-1.0, -1.0), (-0.99, 0.0), (0.99, 0.0), (1.0, -1.0)]), 0.5)
    assert not has_few(Prism([(-1.0, 0.0), (-0.3, 0.0), (0.2, 0.0), (1.0, 0.0)]), 0.5)


def test_a_flat_face_next_to_a_fillet_is_the_shape():
    round_ = [
        (1.0 + 0.05 * math.sin(a), -0.05 + 0.05 * math.cos(a)) for a in np.radians(np.arange(0, 100, 18))
    ]
    assert not has_few(Prism([(-1.0, 0.0), *round_]), 0.5, x=0.7)
