# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Whole objects where methods fail: far away, in other units, noisy, outlying, thin, in contact, endless."""

import math

import numpy as np
import pytest

import core
from tests import solids


def explored(solid, **options):
    return core.explore_object(solid, solid.start, solid.outward, rng=0, **{"tolerance": 8e-3} | options)


@pytest.mark.long
@pytest.mark.parametrize("rounding", [1e-13, -3e-13])
def test_rounding_chooses_no_touch(rounding):
    """Beyond an edge two contacts are equally far from their mean, and many places bring as much."""
    solid = solids.block(0.6, 0.5, 0.4)
    starts = [np.add(solid.start, (tiny, 0.7 * tiny, 0.0)) for tiny in (0.0, rounding)]
    found = [core.explore_object(solid, p, solid.outward, tolerance=0.02, most=20, rng=0) for p in starts]
    one, other = (np.array([r.frame.origin for r in atlas.patches]) for atlas in found)
    assert one == pytest.approx(other, abs=1e-9)


class Outlying:
    """A solid that every tenth ray meets off its surface."""

    def __init__(self, solid, off):
        self.solid, self.off, self.count = solid, off, 0

    def ray_cast(self, origin, direction, distance):
        hit = self.solid.ray_cast(origin, direction, distance)
        self.count += 1
        if hit is None or self.count % 10:
            return hit
        return tuple(np.add(hit[0], np.multiply(self.off, hit[1]))), hit[1]


@pytest.fixture(scope="module")
def plain():
    return explored(solids.ball())


@pytest.mark.long
@pytest.mark.parametrize(
    ("scale", "shift"), [(1e-6, (0, 0, 0)), (1e6, (0, 0, 0)), (1.0, (1e5, -2e5, 3e5)), (1e3, (1e6, 0, 1e6))]
)
def test_no_unit_and_no_origin_matters(plain, scale, shift):
    solid = solids.ball().placed(scale, shift)
    atlas = explored(solid, tolerance=8e-3 * scale)
    assert abs(len(atlas.patches) - len(plain.patches)) <= 4
    mesh = atlas.mesh(0.15 * scale)
    assert solids.topology(mesh.triangles) == solids.Topology(0, 0, 2, 1)
    off = np.linalg.norm(mesh.vertices - np.array(shift), axis=1) / scale - 1.0
    assert np.abs(off).mean() < 2e-3


@pytest.mark.long
def test_noise_of_a_hundredth_leaves_a_closed_ball():
    atlas = explored(solids.ball(), tolerance=0.02, noise=0.01)
    mesh = atlas.mesh(0.15)
    assert np.abs(np.linalg.norm(mesh.vertices, axis=1) - 1.0).mean() < 0.01
    assert solids.topology(mesh.triangles) == solids.Topology(0, 0, 2, 1)


@pytest.mark.long
def test_a_tenth_of_outlying_contacts_is_ignored():
    solid = solids.ball()
    atlas = core.explore_object(
        Outlying(solid, 0.02), solid.start, solid.outward, tolerance=8e-3, rng=0, most=60
    )
    mesh = atlas.mesh(0.15)
    assert np.isfinite(mesh.std).all()
    off = np.linalg.norm(mesh.vertices, axis=1) - 1.0
    assert np.median(np.abs(off)) < 4e-3


class BadNormals:
    """A solid whose normals are off by a fifth of a radian (root mean square)."""

    def __init__(self, solid):
        self.solid, self.rng = solid, np.random.default_rng(0)

    def ray_cast(self, origin, direction, distance):
        hit = self.solid.ray_cast(origin, direction, distance)
        if hit is None:
            return None
        normal = np.add(hit[1], self.rng.normal(0.0, 0.14, 3))
        return hit[0], tuple(normal / np.linalg.norm(normal))


@pytest.mark.long
def test_bad_normals_are_found_to_be_bad():
    solid = solids.ball()
    atlas = core.explore_object(
        BadNormals(solid), solid.start, solid.outward, tolerance=8e-3, noise=1e-3, rng=0
    )
    mesh = atlas.mesh(0.15)
    assert np.abs(np.linalg.norm(mesh.vertices, axis=1) - 1.0).mean() < 1e-3
    assert solids.topology(mesh.triangles) == solids.Topology(0, 0, 2, 1)


@pytest.mark.long
def test_of_two_shells_the_outer_one_is_felt_and_closed():
    def distance(x, y, z):
        out = math.hypot(x, y, z)
        return max(out - 1.0, 0.8 - out)

    solid = solids.Solid(distance, (0.0, 0.0, 1.0), (0.0, 0.0, 1.0))
    atlas = explored(solid)
    mesh = atlas.mesh(0.15)
    assert solids.topology(mesh.triangles) == solids.Topology(0, 0, 2, 1)
    assert np.abs(np.linalg.norm(mesh.vertices, axis=1) - 1.0).max() < 0.02


@pytest.mark.long
def test_both_sides_of_a_wall_stay_apart():
    solid = solids.block(1.0, 0.8, 0.05)
    atlas = explored(solid, tolerance=4e-3, most=40)
    x, y = np.random.default_rng(0).uniform(-0.6, 0.6, (2, 200))
    for z, side in ((0.05, 0.0), (-0.05, 0.0), (0.0, -0.05), (0.08, 0.03), (-0.08, 0.03)):
        distance, _ = atlas.distance(np.column_stack([x, y, np.full(200, z)]))
        assert distance == pytest.approx(np.full(200, side), abs=4e-3)


@pytest.mark.long
def test_two_balls_in_contact_do_not_end_the_touches_or_fill_what_is_between():
    def distance(x, y, z):
        return min(math.hypot(x + 1.0, y, z), math.hypot(x - 1.0, y, z)) - 1.0

    solid = solids.Solid(distance, (-2.0, 0.0, 0.0), (-1.0, 0.0, 0.0))
    atlas = explored(solid, tolerance=0.02, most=80)
    y = np.linspace(0.45, 0.9, 20)
    between, std = atlas.distance(np.column_stack([np.zeros(20), y, np.zeros(20)]))
    assert (between[np.isfinite(std)] > 0.0).all()
    felt = np.array([r.frame.origin[0] for r in atlas.patches])
    assert felt.min() < -1.0
    assert felt.max() > 1.0


@pytest.mark.long
def test_a_plane_without_end_takes_the_budget_and_no_more():
    solid = solids.Solid(lambda x, y, z: z, (0.0, 0.0, 0.0), (0.0, 0.0, 1.0))
    atlas = explored(solid, most=12)
    assert 1 < len(atlas.patches) <= 12
    assert atlas.status == "uncertain"


@pytest.mark.long
def test_a_surface_finer_than_the_tolerance_ends():
    def distance(x, y, z):
        waves = 0.02 * math.sin(60.0 * x) * math.sin(60.0 * y) * math.sin(60.0 * z)
        return 0.5 * (math.hypot(x, y, z) - 1.0 + waves)

    solid = solids.Solid(distance, (0.0, 0.0, 1.0), (0.0, 0.0, 1.0))
    atlas = explored(solid, tolerance=1e-3, most=10)
    assert len(atlas.patches) <= 10
    distance, std = atlas.distance(np.zeros((1, 3)))
    assert np.isfinite(distance).all()
    assert not np.isnan(std).any()


class Inward:
    """A solid whose normals point inward."""

    def __init__(self, solid):
        self.solid = solid

    def ray_cast(self, origin, direction, distance):
        hit = self.solid.ray_cast(origin, direction, distance)
        return hit and (hit[0], tuple(-n for n in hit[1]))


@pytest.mark.long
def test_inward_normals_tell_as_much_as_outward_ones():
    solid = solids.ball()
    found = [
        core.explore_object(each, solid.start, solid.outward, tolerance=8e-3, noise=1e-3, rng=0)
        for each in (solid, Inward(solid))
    ]
    one, other = (np.array([r.frame.origin for r in atlas.patches]) for atlas in found)
    assert (one == other).all()
    assert found[1].status == "ok"


@pytest.mark.long
@pytest.mark.parametrize("most", [8, 15])
def test_touches_again_of_uncertain_patches_count_toward_the_most(most):
    """A tolerance of little more than the noise leaves patches uncertain."""
    ring = solids.ring(small=0.5)
    options = {"tolerance": 3.2e-3, "noise": 3e-3, "most": most, "rng": 0}
    assert max(state.done for state in core.touch_all_over(ring, ring.start, ring.outward, **options)) == most


@pytest.mark.long
def test_vertices_lie_on_a_thin_wall():
    wall = solids.block(0.6, 0.5, 0.05)
    atlas = core.explore_object(wall, wall.start, wall.outward, tolerance=1e-2, noise=2e-4, rng=0, most=300)
    mesh = atlas.mesh(0.07)
    off = np.abs(wall.distances(mesh.vertices))
    # The wall is .1 thick: a two-hundredth of that, a twentieth of the tolerance, bends none of its sides.
    assert off.mean() < 5e-4
    assert np.percentile(off, 99) < 1e-3
    a, b, c = (mesh.vertices[mesh.triangles[:, i]] for i in range(3))
    areas = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)
    sides = sum(((p - q) ** 2).sum(axis=1) for p, q in ((a, b), (b, c), (c, a)))
    # An equilateral triangle has 1, half of one .75, and the mean before vertices even out is .78.
    assert np.mean(4.0 * np.sqrt(3.0) * areas / sides) > 0.8
