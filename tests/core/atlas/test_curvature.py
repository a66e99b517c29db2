# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Curvatures of joined surfaces: exact meshes and touched objects whose curvatures are known."""

from dataclasses import replace

import numpy as np
import pytest

import core
from core.atlas.curvature import curvatures_of, sheets_of
from tests import solids

SIZES = {"ring": (0.35, 0.15), "egg": (0.3, 0.5)}


def true_curvatures(name, points):
    """Gaussian and mean curvature (n,) of a ring or an egg at points (n, 3)."""
    return np.array(getattr(solids, f"{name}_curvatures")(points, *SIZES[name]))


@pytest.fixture(scope="module", params=SIZES)
def touched(request):
    """The name of an object, and its atlas."""
    solid = getattr(solids, request.param)(*SIZES[request.param])
    options = {"tolerance": 2e-3, "noise": 5e-4, "rng": 0}
    return request.param, core.explore_object(solid, solid.start, solid.outward, **options)


@pytest.fixture(scope="module")
def block():
    solid = solids.block()
    return core.explore_object(solid, solid.start, solid.outward, tolerance=2e-2, most=60, rng=0)


def grid(height, count=41, std=1e-5):
    """A mesh of a height field over [-1, 1]^2."""
    x, y = (axis.ravel() for axis in np.meshgrid(*2 * [np.linspace(-1.0, 1.0, count)], indexing="ij"))
    corner = (np.arange(count - 1)[:, None] * count + np.arange(count - 1)).ravel()
    right, up = corner + count, corner + 1
    triangles = np.vstack([np.column_stack([corner, right, up]), np.column_stack([right, right + 1, up])])
    vertices = np.column_stack([x, y, height(x, y)])
    return core.Mesh(vertices, triangles, np.full(len(x), std), np.zeros(len(x), dtype=int))


def found_on(mesh):
    return curvatures_of(sheets_of(mesh, mesh.normals), mesh.vertices, mesh.normals)


def tip_of(height):
    """The curvatures of a height field at its middle, and those all over it."""
    found = found_on(grid(height))
    middle = len(found.gauss) // 2
    return found.gauss[middle], found.mean[middle], found


def test_a_plane_is_flat_and_a_cylinder_bends_one_way():
    gauss, mean, found = tip_of(lambda x, y: 0.3 * x - 0.2 * y)
    known = np.isfinite(found.mean_std)
    assert (gauss, mean) == pytest.approx((0.0, 0.0), abs=1e-12)
    assert np.abs([found.gauss, found.mean]).max() < 1e-12
    assert 0.7 < known.mean() < 1.0  # Near the rim they are unknown.
    gauss, mean, found = tip_of(lambda x, y: np.sqrt(9.0 - x**2))
    assert gauss == pytest.approx(0.0, abs=1e-3)
    assert mean == pytest.approx(-1.0 / 6.0, rel=0.01)


def test_a_plane_is_flat_in_any_unit():
    mesh = grid(lambda x, y: 0.0 * x)
    for scale in (1e-9, 1e9, 1e15):
        large = core.Mesh(scale * mesh.vertices, mesh.triangles, scale * mesh.std, mesh.patch)
        found = found_on(large)
        assert scale * np.abs(found.mean).max() < 1e-12
        assert np.isfinite(found.mean_std).any()


def test_a_saddle_and_a_bowl_have_their_signs():
    gauss, mean, _ = tip_of(lambda x, y: 0.3 * (x**2 - y**2))
    assert gauss == pytest.approx(-0.36, rel=0.05)
    assert mean == pytest.approx(0.0, abs=1e-3)
    gauss, mean, _ = tip_of(lambda x, y: 0.2 * (x**2 + y**2))
    assert (gauss, mean) == pytest.approx((0.16, 0.4), rel=0.05)


def test_a_quadric_is_wider_where_the_surface_is_less_certain():
    """Waves of the mesh count less there, and the deviation is larger than with a certain surface."""

    def waved(std):
        return grid(lambda x, y: 0.05 * x**2 + 2e-4 * np.cos(12.0 * x) * np.cos(12.0 * y), std=std)

    certain, uncertain = (found_on(waved(std)) for std in (1e-6, 1e-3))
    inner = (np.abs(waved(1.0).vertices[:, :2]) < 0.4).all(axis=1)
    off = [np.abs(found.mean - 0.05)[inner].mean() for found in (certain, uncertain)]
    assert off[1] < 0.5 * off[0]
    assert uncertain.mean_std[inner].mean() > 3e-3


def test_a_fold_is_a_crease_from_thirty_degrees_on():
    for degrees, gray in ((35.0, True), (20.0, False)):
        steep = np.tan(np.radians(0.5 * degrees))
        mesh = grid(lambda x, y, steep=steep: -steep * np.abs(x))
        found = found_on(mesh)
        near = (np.abs(mesh.vertices[:, 0]) < 0.08) & (np.abs(mesh.vertices[:, 1]) < 0.7)
        assert (np.isinf(found.mean_std[near]) == gray).all()
        away = (np.abs(np.abs(mesh.vertices[:, 0]) - 0.5) < 0.2) & (np.abs(mesh.vertices[:, 1]) < 0.7)
        assert np.isfinite(found.mean_std[away]).all()
        assert not gray or np.abs(found.mean[away]).max() < 1e-9


def test_another_sheet_nearby_does_not_count():
    """A bowl is below a plane that faces as it does, less than a quadric away, and its back is below it."""
    low = grid(lambda x, y: 0.2 * (x**2 + y**2), std=3e-4)
    high = grid(lambda x, y: 0.0 * x + 0.15)
    back = low._replace(vertices=low.vertices - [0.0, 0.0, 0.02], triangles=low.triangles[:, ::-1])
    count, single = len(low.vertices), found_on(low)
    every = core.Mesh(
        np.vstack([mesh.vertices for mesh in (low, high, back)]),
        np.vstack([mesh.triangles + i * count for i, mesh in enumerate((low, high, back))]),
        np.tile(low.std, 3),
        np.tile(low.patch, 3),
    )
    middle = (np.abs(low.vertices[:, :2]) < 0.3).all(axis=1)
    together = found_on(every)
    assert together.mean[:count][middle] == pytest.approx(single.mean[middle], rel=0.05)
    assert together.mean[2 * count :][middle] == pytest.approx(-single.mean[middle], rel=0.05)


@pytest.mark.long
def test_curvatures_are_near_and_their_deviations_hold(touched):
    """The polynomials of the touches are off by 2.1 and .44 of K on average, on the ring and on the egg."""
    name, atlas = touched
    mesh = atlas.reference.mesh
    found, true = atlas.curvatures(mesh), true_curvatures(name, mesh.vertices)
    known = np.isfinite(found["gaussian_curvature_std"])
    assert known.mean() > 0.99
    for key, values, most in zip(
        ("gaussian_curvature", "mean_curvature"),
        true,
        {"ring": (0.6, 0.08), "egg": (0.22, 0.05)}[name],
        strict=True,
    ):
        off = np.abs(found[key] - values)[known]
        assert off.mean() < most
        assert 0.8 < np.mean(off <= 1.645 * found[f"{key}_std"][known]) < 0.985
    sure = known & (np.abs(true[0]) > 5.0 * found["gaussian_curvature_std"])
    assert (np.sign(found["gaussian_curvature"]) == np.sign(true[0]))[sure].all()
    assert sure.mean() > 0.8


@pytest.mark.long
def test_faces_of_a_block_are_flat_and_beside_its_edges_nothing_is_known(block):
    mesh = block.reference.mesh
    found = block.curvatures(mesh)
    known, half = np.isfinite(found["gaussian_curvature_std"]), np.array([1.0, 0.7, 0.5])
    assert (known == np.isfinite(found["mean_curvature_std"])).all()
    for key in ("gaussian_curvature", "mean_curvature", "shape_index", "curvedness"):
        assert np.isfinite(found[key]).all()
        assert (found[key][~known] == 0.0).all()
    from_edge = np.sort(half - np.abs(mesh.vertices), axis=1)[:, 1]
    assert known[from_edge > 3.0 * mesh.edge].all()
    assert not known[from_edge < 1.5 * mesh.edge].any()
    assert np.abs(found["mean_curvature"]).max() < 0.03
    assert np.abs(found["gaussian_curvature"]).max() < 1e-3


@pytest.mark.long
def test_turned_scaled_and_moved_they_are_the_same(touched):
    mesh = touched[1].reference.mesh
    turn = np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))[0]
    turn *= np.linalg.det(turn)
    moved = mesh._replace(vertices=20.0 * mesh.vertices @ turn.T + [300.0, -50.0, 7.0], std=20.0 * mesh.std)
    some = np.arange(0, len(mesh.vertices), 7)
    one = curvatures_of(sheets_of(mesh, mesh.normals), mesh.vertices[some], mesh.normals[some])
    other = curvatures_of(sheets_of(moved, moved.normals), moved.vertices[some], moved.normals[some])
    for power, values, again in zip((2, 1, 2, 1), one, other, strict=True):
        assert 20.0**power * again == pytest.approx(values, rel=1e-6, abs=1e-8)


@pytest.mark.long
def test_where_there_is_no_surface_nothing_is_known(touched, block):
    far = np.array([[5.0, 0.0, 0.0], [0.0, 0.0, -9.0], [0.7, 0.7, 0.0]])
    normals = np.array([[0.0, 0.0, 1.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]])
    for atlas in (touched[1], block):
        found = atlas.curvatures_at(3.0 * far, normals)
        assert np.isinf(found["mean_curvature_std"]).all()
        assert not any(found[key].any() for key in ("gaussian_curvature", "mean_curvature", "curvedness"))
    flat = grid(lambda x, y: 0.0 * x)
    sheet = sheets_of(flat, flat.normals)
    beyond = np.column_stack([np.linspace(0.95, 20.0, 50), np.zeros((50, 2))])
    assert np.isinf(curvatures_of(sheet, beyond, np.tile([0.0, 0.0, 1.0], (50, 1))).gauss_std).all()


@pytest.mark.long
def test_none_and_many_points_at_once_are_as_each(touched):
    mesh, atlas = touched[1].reference.mesh, replace(touched[1])
    normals = mesh.normals
    every = atlas.curvatures_at(mesh.vertices[:2500], normals[:2500])
    for key, values in atlas.curvatures_at(mesh.vertices[1000:1010], normals[1000:1010]).items():
        assert values == pytest.approx(every[key][1000:1010], rel=1e-9, abs=1e-12)
        assert len(atlas.curvatures_at(np.zeros((0, 3)), np.zeros((0, 3)))[key]) == 0


def test_a_folded_triangle_is_no_crease():
    """A vertex that is moved across a side folds the triangles there."""
    mesh = grid(lambda x, y: -0.1 * (x**2 + y**2))
    middle = np.argmin(np.abs(mesh.vertices[:, :2]).sum(axis=1))
    mesh.vertices[middle] = 0.03, 0.026, -0.1 * (0.03**2 + 0.026**2)
    a, b, c = mesh.vertices[mesh.triangles].transpose(1, 0, 2)
    assert (np.cross(b - a, c - a)[:, 2] < 0.0).sum() == 1
    found = found_on(mesh)
    inner = (np.abs(mesh.vertices[:, :2]) < 0.7).all(axis=1)
    assert np.isfinite(found.mean_std[inner]).all()
    assert np.abs(found.mean[inner] + 0.2).mean() < 0.01


@pytest.mark.parametrize(("wide", "has_values"), [(10, True), (2, False)])
def test_beside_a_crease_a_wall_is_shown_as_where_its_curvatures_are_known(wide, has_values):
    """Two walls meet along the line x = z = 0; on one of them, all is unknown if it is narrow."""
    along = np.arange(10.0)
    floor = np.array([(x, y, 0.0) for x in range(11) for y in along])
    wall = np.array([(0.0, y, z) for z in range(1, wide + 1) for y in along])
    points = np.vstack([floor, wall])
    up, out = np.array([0.0, 0.0, 1.0]), np.array([1.0, 0.0, 0.0])
    normals = np.where(points[:, :1] > 0.0, up, out)
    known = np.maximum(points[:, 0], points[:, 2]) > 2.0
    crease = np.flatnonzero(points[:, 0] + points[:, 2] == 0.0)
    corners, facing = np.tile(crease, 2), np.repeat([up, out], len(crease), axis=0)
    found = core.vertices_shown(points, normals, known, corners, facing, 1.0)
    assert np.allclose(points[found[:10]], points[crease] + (3.0, 0.0, 0.0))
    if has_values:
        assert np.allclose(points[found[10:]], points[crease] + (0.0, 0.0, 3.0))
    else:
        assert (found[10:] == -1).all()
    assert (core.vertices_shown(points, normals, ~known, crease, facing[:10], 1.0) == crease).all()
    assert (core.vertices_shown(points, normals, known & False, crease, facing[:10], 1.0) == -1).all()
