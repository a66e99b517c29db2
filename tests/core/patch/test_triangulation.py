# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The mesh of a patch: as fine as requested, no slivers, symmetric, and of few triangles where it is flat."""

from functools import cache

import numpy as np
import pytest
import surfaces
from numpy.testing import assert_allclose
from scipy.spatial import cKDTree

from core import MongePatch, SamplingPlane, reconstruct, track
from core.patch.domain import Domain, closed_spline_domain
from core.patch.triangulation import MOST_RIM_EDGES, patch_mesh, triangulate

LEAST_ANGLE = 15.0  # degrees


def circle(degrees, radius=1.0):
    a = np.radians(degrees)
    return np.broadcast_to(radius, len(a))[:, None] * np.column_stack([np.cos(a), np.sin(a)])


SIXTH = np.arange(0, 360, 60)
DOMAINS = {
    "even": closed_spline_domain(circle(SIXTH + 17), 1.0),
    "uneven": closed_spline_domain(circle([0, 35, 80, 180, 215, 260]), 1.0),
    "stubby": closed_spline_domain(circle(SIXTH, [1, 1, 0.4, 1, 0.7, 1]), 1.0),
    "at an edge": closed_spline_domain(circle(SIXTH + 17, [1, 0.2, 0.1, 0.2, 1, 1]), 1.0),
    "notched": closed_spline_domain(circle(SIXTH, [1, 1, 0.1, 1, 0.9, 1]), 1.0),
    "narrow": closed_spline_domain(circle(SIXTH + 9) * [1.0, 0.35], 1.0),
    "cut": closed_spline_domain(circle(SIXTH + 17, [1, 0.8, 0.85, 0.7, 1, 1]), 1.0, [0, 1, 1, 1, 0, 0]),
    "cut once": closed_spline_domain(circle(SIXTH + 17, [1, 0.8, 1, 1, 1, 1]), 1.0, [0, 1, 0, 0, 0, 0]),
    "triangle": closed_spline_domain(circle([10, 130, 250]), 1.0),
}
QUARTIC = np.array([0.1, -0.2, 0.3, 0.1, 0.3, 0.0, -0.5, 0.1, 0.2])
RNG = np.random.default_rng(0)
PATCHES = {
    "plane": MongePatch(0.0, 0.0, np.zeros(9)),
    "dome": MongePatch(-0.7, -0.7, np.zeros(9)),
    "cylinder": MongePatch(-0.8, 0.0, np.zeros(9)),
    "saddle": MongePatch(-1.0, 0.8, np.zeros(9)),
    "quartic": MongePatch(-0.5, 0.3, QUARTIC),
    "sextic": MongePatch(-0.6, 0.2, RNG.normal(0.0, 0.1, 22)),
    "monkey saddle": MongePatch(0.0, 0.0, np.array([0.3, 0.0, -0.9, *np.zeros(6)])),
}


def deviations(patch, points, triangles, steps=9):
    """How far triangles are off the patch, in height, at a dense set of points of each."""
    shares = [(i, j, steps - i - j) for i in range(steps + 1) for j in range(steps + 1 - i)]
    x, y, z = np.einsum("wk,tkd->dtw", np.array(shares) / steps, points[triangles])
    return np.abs(patch.height(x, y) - z)


def angles(points, triangles):
    """The triangles' angles in the tangent plane, in degrees; negative where one goes round clockwise."""
    corners = points[triangles][:, :, :2]
    u, v = np.roll(corners, -1, axis=1) - corners, np.roll(corners, 1, axis=1) - corners
    return np.degrees(np.arctan2(u[..., 0] * v[..., 1] - u[..., 1] * v[..., 0], np.sum(u * v, axis=-1)))


@cache
def boundary_tree(domain):
    return cKDTree(domain.boundary(20000))


def faces(triangles):
    """Sorted numbers of triangles, which do not depend on the order of triangles and of corners."""
    return np.sort(np.sort(triangles, axis=1) @ [10**12, 10**6, 1])


def rim_of(points, triangles):
    """The rim's vertices in their order, from the edges that only one triangle has."""
    edges = np.vstack([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    _, first, uses = np.unique(np.sort(edges, axis=1), axis=0, return_index=True, return_counts=True)
    assert uses.max() == 2
    following = dict(edges[first[uses == 1]].tolist())
    rim = [next(iter(following))]
    while len(rim) < len(following):
        rim.append(following[rim[-1]])
    assert following[rim[-1]] == rim[0]
    return points[rim, :2]


@pytest.mark.parametrize("tolerance", [1e-3, 5e-3])
@pytest.mark.parametrize("domain", DOMAINS.values(), ids=DOMAINS)
@pytest.mark.parametrize("patch", PATCHES.values(), ids=PATCHES)
def test_a_mesh_is_as_near_as_requested_and_has_no_slivers(patch, domain, tolerance):
    points, triangles = patch_mesh(patch, domain, tolerance)
    assert_allclose(points[:, 2], patch.height(*points[:, :2].T), 1e-6, 1e-12)
    assert deviations(patch, points, triangles).max() <= tolerance
    assert angles(points, triangles).min() > LEAST_ANGLE
    assert np.array_equal(np.unique(triangles), np.arange(len(points)))
    # The rim has its vertices and its edges on the boundary and goes around the domain once.
    rim = rim_of(points, triangles)
    azimuths = np.arctan2(*rim.T[::-1])
    assert np.count_nonzero(np.diff(azimuths, append=azimuths[0]) < 0.0) == 1
    assert_allclose(np.hypot(*rim.T), domain._radius(azimuths), 1e-6, 1e-4)
    middle = 0.5 * (rim + np.roll(rim, -1, axis=0))
    off, _ = boundary_tree(domain).query(middle)
    assert off.max() <= 1.1e-3 or len(rim) == MOST_RIM_EDGES
    a, b, c = points[triangles][:, :, :2].transpose(1, 2, 0)
    area = 0.5 * np.sum((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]))
    assert area == pytest.approx(domain.area, rel=3e-3)


def test_a_plane_has_few_triangles_and_a_tight_saddle_many():
    counts = {
        name: len(patch_mesh(patch, DOMAINS["even"], 1e-3)[1])
        for name, patch in [("tight", MongePatch(-4.0, 4.0, np.zeros(9))), *PATCHES.items()]
    }
    assert counts["plane"] < 600
    assert counts["plane"] < 0.5 * counts["saddle"] < 0.2 * counts["tight"]
    # Where a patch is curved, a quarter of the tolerance takes four times as many triangles.
    fine = len(patch_mesh(PATCHES["quartic"], DOMAINS["even"], 2.5e-4)[1])
    assert fine == pytest.approx(4.0 * counts["quartic"], rel=0.3)


@pytest.mark.parametrize("name", ["cut", "cut once"])
def test_a_plane_that_an_edge_cuts_has_few_vertices_and_its_corners_are_among_them(name):
    points, _ = patch_mesh(PATCHES["plane"], DOMAINS[name], 1e-3)
    assert len(points) < 300
    gaps, _ = cKDTree(points[:, :2]).query(DOMAINS[name].corners)
    assert len(gaps) in (3, 5) and gaps.max() == 0.0


SYMMETRIC_DOMAINS = {
    "six": closed_spline_domain(circle(SIXTH), 1.0),
    "six turned": closed_spline_domain(circle(SIXTH + 30), 1.0),
    "four": closed_spline_domain(circle([0, 90, 180, 270]), 1.0),
    "square": closed_spline_domain(circle([45, 135, 225, 315]), 1.0, [True] * 4),
    "flat": closed_spline_domain(circle(np.arange(0, 360, 45) + 22.5) * [1.0, 0.6], 1.0),
}
EVEN = np.array([0.0, 0.0, 0.0, 0.0, 0.3, 0.0, -0.5, 0.0, 0.2])


@pytest.mark.parametrize("domain", SYMMETRIC_DOMAINS.values(), ids=SYMMETRIC_DOMAINS)
@pytest.mark.parametrize(
    "patch",
    [*(PATCHES[name] for name in ("plane", "dome", "cylinder", "saddle")), MongePatch(-0.5, 0.5, EVEN)],
    ids=["plane", "dome", "cylinder", "saddle", "quartic"],
)
def test_a_mesh_is_symmetric_where_the_patch_is(patch, domain):
    for tolerance in (3e-4, 1e-3, 5e-3):
        points, triangles = patch_mesh(patch, domain, tolerance)
        for mirror in ([-1, 1, 1], [1, -1, 1]):
            gaps, image = cKDTree(points).query(points * mirror)
            assert gaps.max() < 1e-4
            assert np.array_equal(faces(image[triangles]), faces(triangles))


@pytest.mark.parametrize("unit", [1e-6, 1e3])
@pytest.mark.parametrize("name", PATCHES)
def test_a_mesh_is_the_same_in_any_unit(name, unit):
    domain, patch = DOMAINS["stubby"], PATCHES[name]
    points, triangles = patch_mesh(patch, domain, 1e-3)
    again, same = patch_mesh(patch.scaled(unit), Domain(domain.ends * unit), 1e-3 * unit)
    assert np.array_equal(faces(same), faces(triangles))
    assert_allclose(again, points * unit, 1e-6, 1e-9 * unit)


def test_sizes_can_be_given():
    points, triangles = triangulate(DOMAINS["uneven"], lambda at: np.full(len(at), 0.05), 1e-3)
    assert len(points) == pytest.approx(DOMAINS["uneven"].area / (np.sqrt(0.75) * 0.05**2), rel=0.25)
    assert angles(points, triangles).min() > LEAST_ANGLE
    assert points[0].tolist() == [0.0, 0.0]


PLANES = [SamplingPlane(a) for a in np.radians([13, 73, 133])]


@pytest.mark.parametrize("noise", [0.0, 0.1])
@pytest.mark.parametrize(
    "surface",
    [surfaces.plane(), surfaces.sphere(25), surfaces.cylinder(20), surfaces.saddle(), surfaces.pear()],
    ids=["plane", "sphere", "cylinder", "saddle", "pear"],
)
@pytest.mark.parametrize("method", ["bayes", "tagc"])
def test_a_touch_has_a_mesh_as_fine_as_what_is_known_of_it(surface, noise, method):
    contours = track(
        surface, surface.point, surface.normal, PLANES, extent=12.0, step=1.0, noise=noise, rng=0
    )
    r = reconstruct(surface.point, contours, outward=surface.normal, method=method)
    points, triangles = r.mesh()
    assert deviations(r.geometry, points, triangles).max() <= 0.5 * r.mean_height_std
    assert angles(points, triangles).min() > LEAST_ANGLE
    assert points[0].tolist() == [0.0, 0.0, 0.0]  # the reference point
    assert len(points) < 2000
