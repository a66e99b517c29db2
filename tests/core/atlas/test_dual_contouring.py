# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The lattice and its topology, and vertices where planes meet."""

import numpy as np
import pytest
from scipy.ndimage import label
from scipy.sparse import csr_array

import core
from core.atlas.dual_contouring import _on_sheet, _sides, _vertices, dual_contour
from core.atlas.field import Blend
from core.atlas.indicator import Indicator
from core.atlas.join import charts_of
from core.atlas.lattice import CORNERS, Lattice, _cases, composed, lattice_at_level, turned
from core.steps import result_of
from tests import solids, surfaces

BLOCK = solids.block()


def indicator_of(values, cell=0.1):
    return Indicator(np.array(values, dtype=np.float32), np.zeros(3), cell, 1.0, np.inf)


def ball_indicator(count=24):
    """The values fall from inside to outside of a ball around the middle of the grid."""
    index = np.moveaxis(np.indices((count,) * 3), 0, -1) - 0.5 * (count - 1)
    return indicator_of(0.35 * count - np.linalg.norm(index, axis=-1))


@pytest.fixture(scope="module")
def far():
    """The table of a patch that is far from all lattices here."""
    point = np.array([1e3, 0.0, 0.0])
    solid = solids.ball().placed(1.0, point)
    return charts_of([core.explore(solid, solid.start, solid.outward, rng=0).result])


def surface(charts, indicator, pitch):
    return result_of(dual_contour(charts, indicator, pitch))


@pytest.mark.parametrize("pitch", [0.013, 0.1, 0.17, 0.3])
def test_without_patches_the_level_of_the_indicator_is_closed_at_any_pitch(far, pitch):
    indicator = ball_indicator()
    found = surface(far, indicator, pitch)
    assert solids.topology(found.triangles) == solids.Topology(0, 0, 2, 1)
    assert (found.patch == -1).all() and np.isinf(found.rho).all()
    out = np.linalg.norm(found.vertices - 0.05 * 23, axis=1)
    assert np.abs(out - 0.1 * 0.35 * 24).max() < 0.7 * pitch + 0.02


def test_a_patch_alone_has_no_sides_beyond_its_rim():
    """Beyond an edge its wall goes on inside of nothing: points there would stand out of the edge."""
    s = surfaces.plane()
    r = core.explore(s, s.point, s.normal, extent=1.0).result
    charts = charts_of([r])
    (x, y), _ = charts.rim_at(np.array([0, 1])).T
    out = np.array([0.9, 1.01, 1.05, 1.11])
    places = r.frame.to_world(r.radius * np.outer(out, (x, y, 0.0)) - [0.0, 0.0, 0.01])
    assert _sides(charts, 0.15, places)[-1].tolist() == [-1.0, 0.0, 0.0, 0.0]


@pytest.mark.parametrize(("degrees", "is_moved"), [(10.0, True), (30.0, False)])
def test_a_vertex_is_moved_onto_a_wall_only_where_its_planes_face_as_the_wall_does(degrees, is_moved):
    s = surfaces.plane()
    r = core.explore(s, s.point, s.normal, extent=1.0).result
    up = np.array([[np.sin(np.radians(degrees)), 0.0, np.cos(np.radians(degrees))]]) @ r.frame.axes.T
    own = Blend(np.zeros(1), np.zeros(1), up, np.array([7]), np.zeros(1))
    vertex = r.frame.to_world(np.array([[0.1, 0.0, 0.05]]))
    moved, _, _, _, patch, _ = _on_sheet(charts_of([r]), 0.1, vertex, up, *own)
    height = r.frame.to_local(moved)[0, 2]
    assert height == pytest.approx(0.0 if is_moved else 0.05, abs=1e-6)
    assert patch[0] == (0 if is_moved else 7)


@pytest.mark.parametrize(("turn", "x"), [(0.1, 0.25), (0.9, 0.5 + 0.2 / np.tan(0.9))])
def test_a_vertex_is_where_walls_meet_but_stays_where_they_hardly_turn(turn, x):
    """Where planes turn by 6 degrees, they meet two pitches away."""
    places = np.array([[0.0, 0.0, 0.0], [0.5, 0.0, 0.2]])
    normals = np.array([[0.0, 0.0, 1.0], [np.sin(turn), 0.0, np.cos(turn)]])
    planes = Blend(np.zeros(2), np.zeros(2), normals, np.zeros(2, dtype=np.intp), np.zeros(2))
    vertices, _ = _vertices(csr_array(np.ones((1, 2))), places, planes, np.zeros((1, 3)), 1.0)
    assert vertices[0, 0] == pytest.approx(x, abs=0.05)


def test_the_vertices_around_a_point_that_is_nearly_on_a_wall_are_apart():
    """All four cross the wall next to that point only: from there their triangles would be needles."""
    height = np.array([[0.0, 0.0, 1e-6]])
    plane = Blend(
        np.zeros(1), np.zeros(1), np.array([[0.0, 0.0, 1.0]]), np.zeros(1, dtype=np.intp), np.zeros(1)
    )
    centers = 0.5 * np.array([[x, y, 1.0] for x, y in ((1, 1), (-1, 1), (-1, -1), (1, -1))])
    vertices, _ = _vertices(csr_array(np.ones((4, 1))), height, plane, centers, 1.0)
    assert vertices[:, 2] == pytest.approx(1e-6, abs=1e-4)
    assert np.linalg.norm(vertices - np.roll(vertices, 1, axis=0), axis=1).min() > 0.1


@pytest.mark.parametrize("seed", range(3))
def test_any_signs_make_a_closed_manifold(far, seed):
    values = np.full((14, 14, 14), -1.0)
    values[2:-2, 2:-2, 2:-2] = np.random.default_rng(seed).choice([-1.0, 1.0], (10, 10, 10))
    shape = solids.topology(surface(far, indicator_of(values), 0.1).triangles)
    assert (shape.open, shape.tangled) == (0, 0)


def test_two_opposite_corners_are_not_composed_and_one_turned_corner_is_enough_where_it_can_be():
    good, corner = _cases()
    for code in range(256):
        inside = (code >> np.arange(8) & 1).astype(bool)
        for one in np.flatnonzero(inside):
            for other in np.flatnonzero(inside):
                apart = np.abs(CORNERS[one] - CORNERS[other])
                if apart.sum() == 2:  # They are opposite on a face, whose other corners decide.
                    beside = [
                        c
                        for c in range(8)
                        if (np.abs(CORNERS[c] - CORNERS[[one, other]]).sum(axis=1) == 1).all()
                    ]
                    assert not good[code] or inside[beside].any()
    assert good[[0, 1, 3, 255]].all() and not good[[0b1001, 0b10000001]].any()
    assert not (np.flatnonzero(~good) >> corner[~good] & 1).any()


def test_turned_points_leave_the_topology():
    lattice, edges = result_of(lattice_at_level(ball_indicator(), 0.1))
    points = np.unique(lattice.ends(edges))
    inside = points[lattice.inside(points)]
    asked = np.random.default_rng(0).permutation(inside)[: len(inside) // 2]
    found, done = turned(lattice, asked)
    assert 0.3 * len(asked) < len(done) <= len(asked)
    assert not found.inside(done).any()
    assert _cases()[0][found.codes(found.cells_around(points))].all()
    is_inside = found.inside(np.arange(np.prod(lattice.shape))).reshape(lattice.shape)
    assert label(is_inside)[1] == label(~is_inside)[1] == 1


def test_a_single_point_and_a_bridge_are_not_turned():
    values = np.full((9, 9, 9), -1.0)
    values[2:7, 4, 4] = 1.0
    lattice, _ = result_of(lattice_at_level(indicator_of(values), 0.1))
    middle = np.ravel_multi_index((5, 5, 5), lattice.shape)  # The lattice has a layer more on each side.
    assert lattice.inside(np.array([middle])).all()
    assert len(turned(lattice, np.array([middle]))[1]) == 0
    end = np.ravel_multi_index((3, 5, 5), lattice.shape)
    assert turned(lattice, np.array([end]))[1].tolist() == [end]


def test_points_that_are_simple_only_after_others_are_turned_are_turned_too():
    values = np.full((9, 9, 9), -1.0)
    values[2:7, 4, 4] = 1.0
    lattice, _ = result_of(lattice_at_level(indicator_of(values), 0.1))
    row = np.array([np.ravel_multi_index((i, 5, 5), lattice.shape) for i in range(3, 8)])
    assert turned(lattice, row)[1].tolist() == row[[0, 1, 3, 4]].tolist()  # One point stays.


def test_a_lattice_that_is_composed_stays():
    lattice, edges = result_of(lattice_at_level(ball_indicator(), 0.1))
    assert isinstance(lattice, Lattice)
    again = composed(lattice, lattice.cells_around(np.unique(lattice.ends(edges))))
    assert np.array_equal(again.turned, lattice.turned)


@pytest.fixture(scope="module")
def block():
    options = {"tolerance": 8e-3, "noise": 1e-3, "rng": 0}
    return core.explore_object(BLOCK, BLOCK.start, BLOCK.outward, **options)


@pytest.mark.parametrize("edge", [0.1, 0.05, 0.02])
def test_no_edge_is_a_needle_and_creases_are_as_near_as_walls(block, edge):
    mesh = block.mesh(edge)
    ends = mesh.vertices[mesh.triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)]
    lengths = np.linalg.norm(ends[:, 0] - ends[:, 1], axis=1)
    assert lengths.max() < 3.0 * np.median(lengths)
    assert np.abs(BLOCK.distances(mesh.vertices)).max() < 8e-3
    off = np.linalg.norm(BLOCK.edges(50)[:, None] - mesh.vertices, axis=2).min(axis=1)
    assert np.quantile(off, 0.95) < 0.6 * edge


@pytest.fixture(scope="module")
def cube():
    solid = solids.block(1.0, 1.0, 1.0)
    return solid, core.explore_object(solid, (0.3, 0.1, 1.0), solid.outward, tolerance=4e-3, rng=0)


@pytest.mark.parametrize("share", [0.012, 0.0097, 0.008])
def test_no_triangle_cuts_a_corner_of_a_cube(cube, share):
    """Where no plane of a patch crosses an edge of the lattice, the rounded level cuts the corner."""
    solid, atlas = cube
    mesh = atlas.mesh(share * atlas.reference.indicator.size)
    a, b, c = mesh.vertices[mesh.triangles].transpose(1, 0, 2)
    places = np.concatenate([a, 0.5 * (a + b), 0.5 * (b + c), 0.5 * (c + a), (a + b + c) / 3.0])
    assert np.abs(solid.distances(places)).max() < 4e-3


def test_points_beside_a_crease_are_inside_though_the_indicator_has_them_outside(block):
    """The indicator is negative along the creases of a block, which are on the mesh all the same."""
    points = BLOCK.edges(50)
    assert (block.reference.indicator.at(points) < 0.0).mean() > 0.9
    distance, std = block.distance(points)
    assert np.quantile(np.abs(distance), 0.95) < 0.25 * 8e-3
    assert np.isfinite(std).all()
