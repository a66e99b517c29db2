# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Taps of a mesh all over a patch: how far it is off, and the verdict from that."""

import math

import numpy as np
import pytest
import solids
import surfaces

import core
from core.reconstruction.status import CONTRADICTING, DOUBTFUL_GAP, Taps


class Levels:
    """Planes z = level, each with the outward normal (0, 0, side); rays meet the nearest."""

    def __init__(self, *levels):
        self.levels = levels

    def ray_cast(self, origin, direction, distance):
        reached = [((z - origin[2]) / direction[2], side) for z, side in self.levels]
        ahead = [(t, side) for t, side in reached if 0.0 <= t <= distance]
        if not ahead:
            return None
        t, side = min(ahead)
        return tuple(o + t * d for o, d in zip(origin, direction, strict=True)), (0.0, 0.0, side)


@pytest.fixture(scope="module")
def flat():
    """The patch z = 0 of radius 1."""
    at = np.linspace(-1.0, 1.0, 21)[:, None]
    directions = [(math.cos(a), math.sin(a), 0.0) for a in np.radians([0, 60, 120])]
    contours = [core.Contour(at * np.array(direction)) for direction in directions]
    return core.reconstruct((0, 0, 0), contours, outward=(0, 0, 1))


@pytest.mark.parametrize("level", [0.3, -0.3, 0.0])
def test_a_plane_that_is_off_has_the_exact_distance(flat, level):
    assert core.tapped(flat, Levels((level, 1.0))).height == pytest.approx(abs(level), abs=1e-6)


@pytest.mark.parametrize(
    ("levels", "off"),
    [
        ([(0.1, -1.0), (0.3, 1.0)], 0.3),  # a wall seen from within, and the outside behind it
        ([(-0.1, -1.0), (-0.2, 1.0), (0.5, 1.0)], 0.2),
        ([(0.4, 1.0), (-0.25, 1.0)], 0.25),
        ([(0.1, -1.0)], None),
        ([(1.5, 1.0)], None),  # farther than a radius
        ([(-1.5, 1.0)], None),
    ],
)
def test_the_nearest_layer_whose_outside_is_up_counts(flat, levels, off):
    found = core.tapped(flat, Levels(*levels)).height
    assert found is None if off is None else found == pytest.approx(off, abs=1e-6)


class Facing:
    """A surface whose normals face the ray, as many ray casters answer."""

    def __init__(self, surface):
        self.surface = surface

    def ray_cast(self, origin, direction, distance):
        hit = self.surface.ray_cast(origin, direction, distance)
        return hit and (hit[0], -math.copysign(1.0, np.dot(hit[1], direction)) * np.array(hit[1]))


@pytest.mark.parametrize(
    ("levels", "off"),
    [
        ([(0.3, 1.0)], 0.3),
        ([(-0.3, 1.0)], 0.3),
        ([(0.003, 1.0), (-0.017, -1.0)], 0.003),  # a thin plate below its patch
        ([(0.3, 1.0), (0.25, -1.0), (0.02, 1.0), (-0.1, -1.0)], 0.02),  # a roof above it
        ([(0.3, 1.0), (0.25, -1.0), (-0.02, 1.0), (-0.1, -1.0)], 0.02),
        ([(-0.02, 1.0), (-0.04, -1.0), (-0.06, 1.0), (-0.5, -1.0)], 0.02),  # a slot in it
        ([(1.5, 1.0)], None),
    ],
)
def test_normals_that_face_the_ray_tell_the_same_distance(flat, levels, off):
    for surface in (Levels(*levels), Facing(Levels(*levels))):
        found = core.tapped(flat, surface).height
        assert found is None if off is None else found == pytest.approx(off, abs=1e-6)


def around(nearest, radius):
    """The surface at a distance from what `nearest` maps x, y, z to the nearest point of."""

    def off(x, y, z):
        return [p - q for p, q in zip((x, y, z), nearest(x, y, z), strict=True)]

    return surfaces.Exact(
        lambda x, y, z: np.sqrt(sum(d * d for d in off(x, y, z))) - radius,
        lambda p: np.array(off(*p)),
        None,
        math.nan,
        math.nan,
    )


def on_arc(x, y, z):
    """The nearest point of an arc around the z axis."""
    turn = np.clip(np.arctan2(y, x), -1.2, 1.2)
    return 40.0 * np.cos(turn), 40.0 * np.sin(turn), 0.0 * z


def in_block(x, y, z):
    """The nearest point of a block."""
    return np.clip(x, -17.0, 17.0), np.clip(y, -11.0, 11.0), np.clip(z, -7.0, 7.0)


@pytest.mark.parametrize(
    ("surface", "size"),
    [
        (surfaces.torus(40, 20, 0.6), 60.0),
        (surfaces.ellipsoid(35, 25, 20), 35.0),
        (around(on_arc, 6.0), 46.0),
        (around(in_block, 3.0), 20.0),
    ],
    ids=["torus", "egg", "banana", "rounded block"],
)
def test_touches_are_the_same_where_normals_face_the_ray(surface, size):
    rng, hits = np.random.default_rng(3), []
    while len(hits) < 25:
        start, aim = rng.normal(size=3), rng.uniform(-0.8, 0.8, 3) * size
        start *= 3.0 * size / np.linalg.norm(start)
        hits.append(surface.ray_cast(start, (aim - start) / np.linalg.norm(aim - start), 6.0 * size))
        hits = list(filter(None, hits))
    points, normals = np.array(hits).transpose(1, 0, 2)
    one, other = (
        core.explore_many(each, points, normals, farthest=size) for each in (surface, Facing(surface))
    )
    assert sum(e.result.status == "ok" for e in other) >= 24
    assert [(e.extent, e.result.status, e.result.taps) for e in other] == [
        (e.extent, e.result.status, e.result.taps) for e in one
    ]


def test_whole_objects_are_the_same_where_normals_face_the_ray():
    for solid in (solids.block(), solids.egg()):
        one, other = (
            core.explore_object(each, solid.start, solid.outward, tolerance=0.02, rng=0)
            for each in (solid, Facing(solid))
        )
        assert (other.status, len(other.patches)) == ("ok", len(one.patches))
        assert np.abs(solid.distances(other.mesh(0.15).vertices)).max() < 0.01


class HalfPlane(Levels):
    """The part of z = 0 where x is at least `start`."""

    def __init__(self, start, side=1.0):
        super().__init__((0.0, side))
        self.start = start

    def ray_cast(self, origin, direction, distance):
        hit = super().ray_cast(origin, direction, distance)
        return hit if hit is not None and hit[0][0] >= self.start else None


@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize(("start", "share"), [(-2.0, 0.0), (-0.5, 0.196), (-0.9, 0.019)])
def test_the_area_without_surface_is_missing(flat, start, share, side):
    found = core.tapped(flat, HalfPlane(start, side))
    assert found.height == pytest.approx(0.0, abs=1e-6)
    assert found.missing == pytest.approx(share, abs=0.03)


def test_a_patch_is_in_doubt_where_there_is_no_mesh(flat):
    assert flat.judged_with(taps=Taps(96, missing=DOUBTFUL_GAP)).doubts == ()
    taps = core.tapped(flat, HalfPlane(-0.5))
    (doubt,) = flat.judged_with(taps=taps).doubts
    assert str(doubt) == (
        f"At {100.0 * taps.missing:.0f} % of the patch there is no surface, which ends or has a hole "
        "between the curves: use a shorter extent or add sampling planes."
    )


def test_it_is_the_mean_over_the_domain_of_what_the_fit_misses():
    s = surfaces.pear()
    r = s.fit(s.track(surfaces.planes((0, 60, 120))))
    found = core.tapped(r, s).height
    assert 0.3 * r.mean_height_std < found < 2.0 * r.mean_height_std
    larger = r.moved(
        np.diag([1.0, 1.0, 1.0, 1.0]) + 0.1 * r.radius * np.outer([*r.frame.axes[:, 2], 0], [0, 0, 0, 1])
    )
    assert core.tapped(larger, s).height == pytest.approx(0.1 * r.radius, rel=0.1)


def test_a_mesh_contradicts_a_fit_without_doubt_where_it_is_beyond_its_deviation(flat):
    std = flat.mean_height_std
    assert core.tapped(flat, Levels((0.99 * CONTRADICTING * std, 1.0))).off == 0.0
    taps = core.tapped(flat, Levels((1.01 * CONTRADICTING * std, 1.0)))
    assert taps.off == pytest.approx(1.01 * CONTRADICTING * std)
    (doubt,) = flat.judged_with(taps=taps).doubts
    assert (flat.status, core.status_of(doubt)) == ("ok", "uncertain")
    assert str(doubt).startswith("Between the curves the surface is up to ")
    assert str(doubt).endswith("use a shorter extent or add sampling planes.")
