# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The geometry of a patch under similarities, and results as members of dicts and sets."""

import tracemalloc

import numpy as np
import pytest
import surfaces
from scipy.spatial.transform import Rotation

from core import METHODS, MongePatch, SamplingPlane, distances, explore
from core.patch.domain import closed_spline_domain
from core.patch.geometry import total_absolute_curvature

SURFACE = surfaces.torus(40, 20, 0.6)
TURN, SHIFT = Rotation.from_rotvec([0.4, -0.9, 0.3]).as_matrix(), np.array([20.0, -7.0, 3.0])


def touched(method="bayes"):
    return SURFACE.fit(SURFACE.track(surfaces.planes((0, 60, 120)), noise=0.05, rng=1), method=method)


def matrix_of(linear, shift=SHIFT):
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = linear, shift
    return matrix


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("scale", [1e-3, 1.0, 2.5e3])
def test_a_moved_patch_is_the_patch_of_moved_contacts(scale, method):
    r = touched(method)
    moved = r.moved(matrix_of(scale * TURN))
    x, y = r.domain.grid(60)[0].T
    near = {"rel": 1e-9, "abs": 1e-12 * scale * r.radius}
    assert moved.geometry.height(scale * x, scale * y) == pytest.approx(scale * r.height(x, y), **near)
    assert moved.height_std(scale * x, scale * y) == pytest.approx(scale * r.height_std(x, y), **near)
    assert moved.contacts == pytest.approx(scale * r.contacts, **near)
    assert moved.mean_height_std == pytest.approx(scale * r.mean_height_std)
    assert (moved.status, moved.null_space_dimension) == (r.status, r.null_space_dimension)
    for k in ("k1", "k2"):
        assert getattr(moved.patch, k) == pytest.approx(getattr(r.patch, k) / scale)
    points = np.column_stack([x, y, r.height(x, y)])
    world = scale * r.frame.to_world(points) @ TURN.T + SHIFT
    assert moved.frame.to_world(scale * points) == pytest.approx(world, **near)
    assert (moved.domain.contains(scale * x, scale * y) == r.domain.contains(x, y)).all()
    for one, other in zip(moved.contours, r.contours, strict=True):
        assert one.points == pytest.approx(scale * other.points @ TURN.T + SHIFT, **near)
        assert one.plane_normal == pytest.approx(TURN @ other.plane_normal)
        assert one.normals == pytest.approx(other.normals @ TURN.T)
        assert (one.noise, one.stops) == (pytest.approx(scale * other.noise), other.stops)


def test_there_and_back_it_is_where_it_was():
    r = touched()
    matrix = matrix_of(3.0 * TURN)
    again = r.moved(matrix).moved(np.linalg.inv(matrix))
    assert again.frame.axes == pytest.approx(r.frame.axes, abs=1e-12)
    assert again.frame.origin == pytest.approx(r.frame.origin, abs=1e-12)
    assert again.contacts == pytest.approx(r.contacts, abs=1e-12)
    assert again.frame.axes.T @ again.frame.axes == pytest.approx(np.eye(3), abs=1e-14)


def test_the_reference_point_stays_on_its_curves_far_from_the_origin():
    r = touched()
    moved = r.moved(matrix_of(TURN, [1e7, -3e6, 2e6]))
    assert len(moved.contacts) == len(r.contacts)
    assert all((contour.points == moved.point).all(axis=1).any() for contour in moved.contours)


@pytest.mark.parametrize(
    "matrix",
    [
        matrix_of(np.diag([1.0, 1.0, 1.01])),
        matrix_of([[1.0, 0.01, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]),
        matrix_of(np.diag([1.0, 1.0, -1.0])),
        matrix_of(np.zeros((3, 3))),
        np.diag([1.0, 1.0, 1.0, 2.0]),
        np.eye(3),
        np.full((4, 4), np.nan),
        "matrix",
    ],
    ids=["stretched", "sheared", "mirrored", "nothing", "projective", "small", "nan", "word"],
)
def test_what_is_no_similarity_is_refused(matrix):
    r = touched()
    for moved in (r.moved, r.geometry.moved):
        with pytest.raises(ValueError, match="matrix: expected"):
            moved(matrix)


def test_results_are_compared_and_hashed_by_identity():
    r = touched()
    start = np.asarray(SURFACE.point, dtype=float)
    planes = [SamplingPlane(azimuth) for azimuth in np.radians((0, 60, 120))]
    found = explore(SURFACE, start, SURFACE.normal, planes, farthest=10.0)
    for value in (r, r.geometry, r.frame, r.patch, r.domain, r.contours[0], found, r.patch.derivatives(0, 0)):
        other = type(value)(**{name: getattr(value, name) for name in value.__dataclass_fields__})
        assert value == value and value != other
        assert len({value, other, value}) == 2
    assert r.posterior == r.posterior and len({r.posterior, touched().posterior}) == 2


@pytest.mark.parametrize("k", [-0.5, 1.5])
def test_the_total_curvature_of_a_steep_bowl_is_what_its_normals_cover(k):
    """By Gauss and Bonnet the total is 2 pi (1 - 1 / sqrt(1 + k^2)) up to radius 1, where the slope is k."""
    ends = [(np.cos(a), np.sin(a)) for a in np.radians(np.arange(0, 360, 30))]
    bowl, disk = MongePatch(k, k, np.empty(0)), closed_spline_domain(ends, 1.0)
    wanted = 2.0 * np.pi * (1.0 - 1.0 / np.sqrt(1.0 + k**2))
    assert total_absolute_curvature(bowl, disk) == pytest.approx(wanted, rel=0.02)


def test_distances_of_very_many_points_take_little_memory_and_are_the_same():
    patch = MongePatch(-0.03, -0.01, [])
    points = np.random.default_rng(0).uniform(-8.0, 8.0, (300_000, 3))
    tracemalloc.start()
    try:
        found = distances(patch, points)
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert peak < 40e6
    assert np.allclose(found[::1000], [distances(patch, p[None])[0] for p in points[::1000]], atol=1e-8)
