# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Patches against surfaces and meshes that are known exactly: distances, further contours, overlap."""

from dataclasses import replace

import numpy as np
import pytest
import surfaces
from scipy.spatial.transform import Rotation

from core import (
    Contour,
    Domain,
    Frame,
    Geometry,
    MongePatch,
    reachable,
    verify,
)
from core.scan.verification import _azimuths_between

EXTENT = 10.0
SURFACES = {
    "plane": surfaces.plane(),
    "sphere": surfaces.sphere(30),
    "cylinder": surfaces.cylinder(25),
    "saddle": surfaces.saddle(),
}


def touched(surface, degrees=(0, 60, 120), noise=0.0, degree=6):
    contours = surface.track(surfaces.planes(degrees), extent=EXTENT, noise=noise, rng=0)
    return surface.fit(contours, degree=degree)


def similarity(scale=1.0, turn=((1, 0, 0), (0, 1, 0), (0, 0, 1)), shift=(0.0, 0.0, 0.0)):
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = scale * np.asarray(turn), shift
    return matrix


def shifted(r, length):
    """The patch, lifted off the surface by a length."""
    return r.moved(similarity(shift=length * r.frame.axes[:, 2]))


def vertices_of(surface, r, count=400):
    """Points of the surface over the domain, as a fine mesh has vertices there."""
    points, heights = surfaces.heights_over(surface, r, count)
    return r.frame.to_world(np.column_stack([points, heights]))


def seen(r, surface, vertices):
    return vertices[reachable(r.geometry, surface, vertices)]


class Cut:
    """The part of a surface on one side of a plane; with `roof`, all of it, and a layer over the rest."""

    def __init__(self, surface, origin, direction, roof=None):
        self.surface, self.origin, self.direction, self.roof = surface, origin, direction, roof

    def ray_cast(self, origin, direction, distance):
        up = self.surface.normal
        if self.roof is not None and (np.dot(direction, up) > 0.0) == (
            np.dot(np.subtract(origin, self.origin), up) < self.roof
        ):
            t = (self.roof - np.dot(np.subtract(origin, self.origin), up)) / np.dot(direction, up)
            point = np.add(origin, t * np.array(direction))
            if 0.0 < t < distance and (point - self.origin) @ self.direction < 0.0:
                return point, up
        hit = self.surface.ray_cast(origin, direction, distance)
        inside = hit is not None and (hit[0] - self.origin) @ self.direction >= 0.0
        return hit if inside or (hit is not None and self.roof is not None) else None


@pytest.mark.parametrize("name", SURFACES)
def test_a_patch_on_its_own_surface(name):
    surface = SURFACES[name]
    r = touched(surface)
    found = verify(r, surface, seen(r, surface, vertices_of(surface, r)))
    assert (found["contacts"], found["extra_contours"]) == (60, 9)
    assert found["vertices"] > 350
    assert 150 < found["extra_points"] <= 9 * 24
    assert found["overlap"] == 1.0
    assert found["fit_error"] == pytest.approx(r.fit_error)
    assert found["total_absolute_curvature"] == pytest.approx(r.total_absolute_curvature)
    for key in ("vertex_distance_max", "contact_distance_max", "extra_fit_error"):
        assert 0.0 <= found[key] < 1e-3 * r.radius
    assert all(isinstance(value, int | float) for value in found.values())


@pytest.mark.parametrize("length", [0.3, -0.3])
def test_a_patch_off_its_surface_by_a_known_length(length):
    """A plane's patch is off by the length everywhere, a ball's by the difference of two balls."""
    for name, vertex in (("plane", 1.0), ("sphere", None)):
        surface = SURFACES[name]
        r = shifted(touched(surface), length)
        found = verify(r, surface, seen(r, surface, vertices_of(surface, r)))
        assert found["overlap"] == 1.0
        assert found["extra_contours"] == 9
        assert found["contact_distance_max"] < 1e-3
        if vertex:
            for key in ("mean", "median", "max", "rms"):
                assert found[f"vertex_distance_{key}"] == pytest.approx(abs(length))
            assert found["extra_fit_error"] == pytest.approx(abs(length))
        else:  # the foot on a ball shifted by e n is |p - e n| - R from p
            points = seen(r, surface, vertices_of(surface, r))
            expected = np.abs(np.linalg.norm(points - length * surface.normal, axis=1) - 30.0)
            assert found["vertex_distance_mean"] == pytest.approx(expected.mean(), rel=2e-3)
            assert found["vertex_distance_median"] == pytest.approx(np.median(expected), rel=2e-3)
            assert found["vertex_distance_max"] == pytest.approx(expected.max(), rel=5e-3)
            assert found["vertex_distance_rms"] == pytest.approx(np.sqrt(np.mean(expected**2)), rel=2e-3)


def test_further_contours_see_what_the_contours_do_not():
    """3 x^2 y - y^3 is zero along 0, 60 and 120 degrees: all of it is between the curves."""
    flat = surfaces.plane()
    a = 1e-3
    in_unit_radius = a * EXTENT**2
    monkey = MongePatch(0.0, 0.0, in_unit_radius * np.array([0.0, 3.0, 0.0, -1.0, *[0.0] * 5]))
    ends = [(EXTENT * np.cos(t), EXTENT * np.sin(t)) for t in np.radians(np.arange(0, 360, 60))]
    geometry = Geometry(Frame(np.zeros(3), np.eye(3)), EXTENT, monkey, Domain(np.array(ends)))
    r = replace(touched(flat), geometry=geometry, contours=(Contour(_line_points()),))
    found = verify(r, flat, np.empty((0, 3)))
    assert found["fit_error"] == pytest.approx(0.0, abs=1e-12)
    # |z| is a r^3 |sin 3t|, here at 15, 30 and 45 degrees from a curve and at each twelfth of the radius.
    rim = np.array([r.domain._radius(np.radians([t]))[0] for t in (15, 30, 45)])
    steps = [
        EXTENT / 12.0 * np.arange(1, np.floor(12.0 * length / EXTENT * (1 + 1e-5)) + 1) for length in rim
    ]
    values = [a * s**3 * abs(np.sin(3.0 * np.radians(t))) for t, s in zip((15, 30, 45), steps, strict=True)]
    expected = np.concatenate(values)
    assert (found["extra_contours"], found["extra_points"]) == (9, 6 * len(expected))
    assert found["extra_fit_error"] == pytest.approx(expected.mean(), rel=1e-6)
    assert (found["vertices"], "vertex_distance_mean" in found) == (0, False)


def _line_points():
    s = np.linspace(-EXTENT, EXTENT, 21)
    return np.vstack([np.outer(s, (np.cos(t), np.sin(t), 0.0)) for t in np.radians((0, 60, 120))])


@pytest.mark.parametrize(
    ("degrees", "count", "expected"),
    [
        ((0, 60, 120), 9, (15, 30, 45, 75, 90, 105, 135, 150, 165)),
        ((0, 60, 120), 3, (30, 90, 150)),
        ((0, 20, 40), 4, (68, 96, 124, 152)),
        ((10, 55, 100, 145), 4, (32.5, 77.5, 122.5, 167.5)),
        ((0, 60, 120), 0, ()),
    ],
)
def test_further_azimuths_are_where_most_room_is(degrees, count, expected):
    turns = np.radians([*degrees, *(a + 180 for a in degrees)])
    domain = Domain(np.column_stack([np.cos(turns), np.sin(turns)])[np.argsort(turns)])
    found = np.degrees(_azimuths_between(domain, count))
    assert sorted(found % 180) == pytest.approx(expected, abs=1e-6)


def test_further_contours_can_be_more_or_none():
    surface = SURFACES["saddle"]
    r = touched(surface)
    assert verify(r, surface, np.empty((0, 3)), extra=4)["extra_contours"] == 4
    none = verify(r, surface, np.empty((0, 3)), extra=0)
    assert (none["extra_contours"], none["extra_points"], "extra_fit_error" in none) == (0, 0, False)


@pytest.mark.parametrize("name", SURFACES)
def test_half_of_the_mesh(name):
    surface = SURFACES[name]
    r = touched(surface)
    for direction in (r.frame.axes[:, 0], r.frame.axes[:, 1], r.frame.axes[:, 0] + r.frame.axes[:, 1]):
        half = Cut(surface, r.frame.origin + 1e-6 * direction, direction)
        found = verify(r, half, np.empty((0, 3)))
        assert found["overlap"] == pytest.approx(0.5, abs=0.03)
        assert (found["extra_contours"], found["extra_points"]) == (0, 0)  # the point is off the mesh
        found = verify(r, Cut(surface, r.frame.origin - 1e-6 * direction, direction), np.empty((0, 3)))
        assert found["overlap"] == pytest.approx(0.5, abs=0.03)
        assert found["extra_contours"] == 9
        assert 70 < found["extra_points"] < 130


def test_what_another_layer_hides_does_not_count():
    surface = SURFACES["plane"]
    r = touched(surface)
    vertices = vertices_of(surface, r)
    direction = r.frame.axes[:, 1]
    roofed = Cut(surface, r.frame.origin, direction, roof=1.5 * r.radius)
    over = seen(r, roofed, vertices)
    assert ((over - r.frame.origin) @ direction >= 0.0).all()
    assert len(over) == pytest.approx(len(vertices) / 2, rel=0.05)
    assert verify(r, roofed, over)["overlap"] == pytest.approx(0.5, abs=0.03)


def test_another_layer_than_the_nearest_does_not_count():
    """A roof over half of the patch is not what the patch was felt on, though a finger could meet it."""
    surface = SURFACES["plane"]
    r = touched(surface)
    up, direction = r.frame.axes[:, 2], r.frame.axes[:, 1]
    vertices = vertices_of(surface, r)
    roofed = Cut(surface, r.frame.origin, direction, roof=0.3 * r.radius)
    on_roof = (vertices - r.frame.origin) @ direction < 0.0
    assert len(seen(r, roofed, vertices[on_roof] + 0.3 * r.radius * up)) == 0
    lifted = shifted(r, 0.3 * r.radius)  # a patch on the roof; off it, the plane is the nearest layer
    assert len(seen(lifted, roofed, vertices[on_roof] + 0.3 * r.radius * up)) > 50
    assert len(seen(lifted, roofed, vertices[~on_roof])) > 50


def test_the_inside_seen_through_a_mouth_does_not_count():
    """A patch spans the mouth of a scan that is open: its bottom, seen from inside, has its outside down."""
    surface = SURFACES["plane"]
    r = touched(surface)
    up, depth = r.frame.axes[:, 2], 0.3 * r.radius
    rim = Cut(surface, r.frame.origin, r.frame.axes[:, 0])

    class Open:
        def ray_cast(self, origin, direction, distance):
            hit = rim.ray_cast(origin, direction, distance)
            if hit is None:
                below = surface.ray_cast(origin + depth * up, direction, distance)
                hit = below and (below[0] - depth * up, np.negative(below[1]))
            return hit

    vertices = vertices_of(surface, r)
    over_mouth = (vertices - r.frame.origin) @ r.frame.axes[:, 0] < 0.0
    assert len(seen(r, Open(), vertices[over_mouth] - depth * up)) == 0
    assert len(seen(r, Open(), vertices[~over_mouth])) > 150


def test_further_contours_begin_below_an_overhang():
    """A roof over the point hides it, but the patch is below it."""
    surface = SURFACES["sphere"]
    r = touched(surface)
    direction = np.array([0.0, 0.0, 1.0]) - r.frame.axes[2, 2] * r.frame.axes[:, 2]
    roofed = Cut(surface, r.frame.origin + 0.1 * r.radius * direction, direction, roof=0.5 * r.radius)
    found = verify(r, roofed, np.empty((0, 3)))
    assert found["extra_fit_error"] < 0.01 * r.radius


def test_no_mesh_below():
    surface = SURFACES["plane"]
    r = shifted(touched(surface), 3.0 * EXTENT)
    found = verify(r, surface, seen(r, surface, vertices_of(surface, touched(surface))))
    assert [found[key] for key in ("vertices", "extra_contours", "extra_points", "overlap")] == [0, 0, 0, 0.0]
    assert not {"vertex_distance_mean", "extra_fit_error"} & set(found)
    turned = touched(surface).moved(similarity(turn=np.diag([1.0, -1.0, -1.0])))
    assert verify(turned, surface, np.empty((0, 3)))["overlap"] == 0.0  # the mesh faces away


class Moved:
    """A surface turned, scaled and shifted."""

    def __init__(self, surface, turn, scale, shift):
        self.surface, self.turn, self.scale, self.shift = surface, turn, scale, shift

    def ray_cast(self, origin, direction, distance):
        hit = self.surface.ray_cast(
            self.turn.T @ np.subtract(origin, self.shift) / self.scale,
            self.turn.T @ np.array(direction),
            distance / self.scale,
        )
        return hit and (self.turn @ hit[0] * self.scale + self.shift, self.turn @ hit[1])


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e3])
def test_lengths_scale_and_ratios_stay(scale):
    surface = surfaces.pear()
    r = touched(surface, noise=0.05, degree=4)
    turn, shift = Rotation.from_rotvec([0.4, -0.9, 0.3]).as_matrix(), scale * np.array([20.0, -7.0, 3.0])
    vertices = seen(r, surface, vertices_of(surface, r))
    one = verify(r, surface, vertices)
    moved = r.moved(similarity(scale, turn, shift))
    other = verify(moved, Moved(surface, turn, scale, shift), scale * vertices @ turn.T + shift)
    assert set(one) == set(other)
    for key, value in one.items():
        length = "distance" in key or "error" in key
        assert other[key] == pytest.approx(value * (scale if length else 1.0), rel=1e-5), key


def test_bad_vertices_are_refused():
    surface = SURFACES["plane"]
    r = touched(surface)
    for vertices in (np.zeros((3, 2)), [[np.nan] * 3], "mesh"):
        with pytest.raises(ValueError, match="vertices: expected"):
            verify(r, surface, vertices)


def test_overlap_is_a_share_of_the_area_which_is_more_where_the_patch_is_steep():
    """The surface is the ring of a sphere's cap that is below a plane across its normal."""
    surface, extent = surfaces.sphere(30), 27.0
    contours = surface.track(surfaces.planes((0, 60, 120)), extent=extent, step=1.5)
    r = surface.fit(contours, degree=6)
    up, inner = surface.normal, 0.6 * r.radius
    edge = surface.point - (30.0 - np.sqrt(30.0**2 - inner**2)) * up
    found = verify(r, Cut(surface, edge, -up), np.empty((0, 3)), extra=0)
    (x, y) = r.domain.grid(4000)[0].T
    lean = 30.0 / np.sqrt(30.0**2 - x**2 - y**2)
    outside = np.hypot(x, y) > inner
    assert found["overlap"] == pytest.approx(lean[outside].sum() / lean.sum(), abs=0.01)
    assert found["overlap"] > outside.mean() + 0.02


@pytest.mark.parametrize(("height", "share"), [(0.95, 1.0), (1.05, 0.0), (2.5, 0.0)])
@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_what_is_farther_from_the_tangent_plane_than_the_radius_is_not_below_the_patch(height, share, side):
    surface = surfaces.plane()
    r = shifted(touched(surface), side * height * touched(surface).radius)
    assert verify(r, surface, np.empty((0, 3)), extra=0)["overlap"] == share
    vertices = vertices_of(surface, touched(surface))
    assert (len(reachable(r.geometry, surface, vertices)) > 0) == (share > 0.0)


@pytest.mark.parametrize(("height", "hides"), [(1.9, True), (2.1, False)])
def test_what_is_more_than_two_radii_above_hides_nothing(height, hides):
    r = touched(surfaces.plane())

    class Layers:
        def ray_cast(self, origin, direction, distance):
            for z in sorted((0.0, height * r.radius), key=lambda z: abs(z - origin[2])):
                if direction[2] and 0.0 <= (z - origin[2]) / direction[2] <= distance:
                    return (origin[0], origin[1], z), (0.0, 0.0, 1.0)
            return None

    assert verify(r, Layers(), np.empty((0, 3)), extra=0)["overlap"] == (0.0 if hides else 1.0)
