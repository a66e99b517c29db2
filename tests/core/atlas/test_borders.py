# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Open sheets end where the surface does, and their corners are corners."""

import math

import numpy as np
import pytest

import core
from core.atlas.borders import Border, _unfolded, _welded, snapped_to_border
from core.atlas.meshing import Mesh
from core.triangles import triangle_cross
from tests import solids

TOLERANCE = 2e-3
ANGLE = np.array([(0, 0), (1, 0), (1, 0.4), (0.4, 0.4), (0.4, 1), (0, 1)])  # An L.
SQUARE = np.array([(0, 0), (1, 0), (1, 1), (0, 1)], dtype=float)
RADII, AROUND = np.tile([0.5, 0.2], 5), np.arange(10) * np.pi / 5.0
STAR = 0.5 + np.stack([RADII * np.cos(AROUND), RADII * np.sin(AROUND)], axis=1)  # Its tips have 36 degrees.


class Sheet:
    """A flat polygon, turned, or bent around a cylinder of radius 1 along y; both sides answer rays."""

    def __init__(self, polygon, turn=None, is_bent=False):
        self.polygon, self.is_bent = polygon, is_bent
        self.turn = np.eye(3) if turn is None else turn

    def is_in(self, x, y):
        """Whether flat (x, y) is inside the polygon."""
        a, b = self.polygon, np.roll(self.polygon, -1, axis=0)
        between = (a[:, 1] > y) != (b[:, 1] > y)
        height = np.where(between, b[:, 1] - a[:, 1], 1.0)
        crossed = a[:, 0] + (y - a[:, 1]) / height * (b[:, 0] - a[:, 0])
        return np.count_nonzero(between & (crossed > x)) % 2 == 1

    def points(self, flat):
        """Points (n, 3) of flat ones (n, 2)."""
        x, y = flat.T
        bent = np.stack([np.sin(x), y, np.cos(x)] if self.is_bent else [x, y, 0.0 * x], axis=1)
        return bent @ self.turn.T

    def ray_cast(self, origin, direction, distance):
        (x, y, z), (a, b, c) = np.array(origin) @ self.turn, np.array(direction) @ self.turn
        if self.is_bent:
            square, half, rest = a * a + c * c, a * x + c * z, x * x + z * z - 1.0
            root = half * half - square * rest
            ways = [(-half + s * math.sqrt(root)) / square for s in (-1, 1)] if square and root > 0.0 else []
        else:
            ways = [-z / c] if c else []
        for way in ways:
            p = np.array([x + way * a, y + way * b, z + way * c])
            flat = (math.atan2(p[0], p[2]), p[1]) if self.is_bent else p[:2]
            if 0.0 < way <= distance and self.is_in(*flat):
                normal = np.array([p[0], 0.0, p[2]]) if self.is_bent else np.array([0.0, 0.0, 1.0])
                return tuple(self.turn @ p), tuple(self.turn @ normal)
        return None


def turned(seed=3):
    axes, _ = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
    return axes * np.sign(np.linalg.det(axes))


def explored(sheet, start, outward):
    return core.explore_object(
        sheet, sheet.points(np.array([start]))[0], sheet.turn @ outward, tolerance=TOLERANCE, rng=0
    )


def outline(polygon, count=400):
    """Points all along a polygon, with its corners, (n, 2)."""
    share = np.arange(count)[:, None] / count
    ends = zip(polygon, np.roll(polygon, -1, axis=0), strict=True)
    return np.vstack([(1.0 - share) * a + share * b for a, b in ends])


def apart(points, ends):
    """The farthest distance of points (n, 3) from segments (k, 2, 3)."""
    a, along = ends[:, 0], ends[:, 1] - ends[:, 0]
    shares = np.einsum("nki,ki->nk", points[:, None] - a, along) / (along**2).sum(axis=1)
    feet = a + np.clip(shares, 0.0, 1.0)[..., None] * along
    return np.linalg.norm(points[:, None] - feet, axis=2).min(axis=1).max()


@pytest.mark.long
@pytest.mark.parametrize(("polygon", "is_bent"), [(SQUARE, False), (ANGLE, False), (ANGLE, True)])
def test_an_open_sheet_is_a_disc_that_ends_at_the_border_with_its_corners(polygon, is_bent):
    sheet = Sheet(polygon, turned(), is_bent)
    up = np.array([math.sin(0.2), 0.0, math.cos(0.2)]) if is_bent else np.array([0.0, 0.0, 1.0])
    atlas, border = explored(sheet, (0.2, 0.15), up), sheet.points(outline(polygon))
    assert atlas.status == "ok"
    for mesh in (atlas.reference.mesh, atlas.mesh(0.012), atlas.mesh(0.04)):
        shape = solids.topology(mesh.triangles)
        assert (shape.tangled, shape.euler, shape.pieces) == (0, 1, 1)
        if not is_bent:
            assert (triangle_cross(mesh.vertices[mesh.triangles]) @ sheet.turn[:, 2] > -1e-15).all()
        # A bent border is between the vertices off its chords.
        room = TOLERANCE + (mesh.edge**2 / 4.0 if is_bent else 0.0)
        assert apart(border, mesh.vertices[mesh.border]) < room
        assert (
            apart(
                mesh.vertices[np.unique(mesh.border)], np.stack([border, np.roll(border, -1, axis=0)], axis=1)
            )
            < room
        )


@pytest.mark.parametrize(
    ("polygon", "start", "edges"),
    [
        (SQUARE, (0.2, 0.15), (0.007, 0.03)),
        (ANGLE, (0.2, 0.15), (0.01, 0.05)),
        (STAR, (0.5, 0.5), (0.015, 0.04)),
    ],
)
def test_a_mesh_of_any_edge_has_all_corners_of_a_sheet_and_no_fold(polygon, start, edges):
    """The only patch of the first two ends .11 before a corner; tips of the star are an edge wide."""
    sheet = Sheet(polygon, turned(1))
    atlas, corners = explored(sheet, start, np.array([0.0, 0.0, 1.0])), sheet.points(polygon)
    assert atlas.status == "ok"
    for mesh in (atlas.reference.mesh, *map(atlas.mesh, edges)):
        assert np.linalg.norm(corners[:, None] - mesh.vertices, axis=2).min(axis=1).max() < TOLERANCE
        assert (triangle_cross(mesh.vertices[mesh.triangles]) @ sheet.turn[:, 2] > -1e-15).all()
        shape = solids.topology(mesh.triangles)
        assert (shape.tangled, shape.euler, shape.pieces) == (0, 1, 1)


@pytest.mark.long
def test_beyond_the_border_the_deviation_is_infinite_and_inside_it_is_not():
    sheet = Sheet(ANGLE)
    atlas = explored(sheet, (0.2, 0.15), (0.0, 0.0, 1.0))
    flat = np.random.default_rng(0).uniform(-0.3, 1.3, (2000, 2))
    inside = np.array([sheet.is_in(x, y) for x, y in flat])
    ends = outline(ANGLE)
    away = np.linalg.norm(flat[:, None] - ends, axis=2).min(axis=1)
    for height in (0.05, -0.05):
        distance, std = atlas.distance(np.column_stack([flat, np.full(len(flat), height)]))
        assert np.isfinite(std[inside & (away > 0.05)]).all()
        assert np.isinf(std[~inside & (away > 0.05)]).all()
        assert distance[inside & (away > 0.05)] == pytest.approx(height, abs=TOLERANCE)


def grid_mesh(count=8):
    x, y = (axis.ravel() for axis in np.meshgrid(*[np.linspace(0.0, 1.0, count)] * 2, indexing="ij"))
    at = np.arange(count**2).reshape(count, count)
    a, b, c, d = (part.ravel() for part in (at[:-1, :-1], at[1:, :-1], at[1:, 1:], at[:-1, 1:]))
    triangles = np.vstack([np.column_stack([a, b, c]), np.column_stack([a, c, d])])
    return Mesh(np.column_stack([x, y, 0.0 * x]), triangles, np.zeros(len(x)), np.zeros(len(x), dtype=int))


def test_a_mesh_that_is_too_wide_or_too_narrow_ends_at_the_border_and_does_not_fold():
    for size in (0.93, 1.05):
        square = size * SQUARE
        ends = np.stack([square, np.roll(square, -1, axis=0)], axis=1)
        ends = np.pad(ends, ((0, 0), (0, 0), (0, 1)))
        ways = np.array([(0, -1, 0), (1, 0, 0), (0, 1, 0), (-1, 0, 0)], dtype=float)
        mesh = snapped_to_border(grid_mesh(), Border(ends, ways, ends[:, 0], 0.0))
        a, b, c = mesh.vertices[mesh.triangles].transpose(1, 0, 2)
        areas = 0.5 * np.cross(b - a, c - a)[:, 2]
        assert areas.min() > -1e-12
        assert areas.sum() == pytest.approx(size**2)
        assert solids.topology(mesh.triangles).euler == 1


def test_triangles_that_a_moved_border_turns_over_are_mended():
    mesh, count = grid_mesh(), 8
    vertices = mesh.vertices.copy()
    vertices[count // 2, 0] = 1.2 / (count - 1)  # Past the inner vertex behind it.
    vertices[-2:, 1] = vertices[[-1, -2], 1]  # Two vertices of the border pass each other.
    folded = mesh._replace(vertices=vertices)
    assert (triangle_cross(folded.vertices[folded.triangles])[:, 2] < 0.0).any()
    found = _unfolded(folded, mesh, np.zeros(0, dtype=int))
    assert (triangle_cross(found.vertices[found.triangles])[:, 2] > -1e-15).all()


def test_a_corner_stays_where_a_triangle_next_to_it_turned_over():
    mesh = grid_mesh()
    vertices = mesh.vertices.copy()
    vertices[-2, 1] = 1.1  # Past the corner, which is the last vertex.
    found = _unfolded(mesh._replace(vertices=vertices), mesh, np.array([len(vertices) - 1]))
    assert (triangle_cross(found.vertices[found.triangles])[:, 2] > -1e-15).all()
    assert found.vertices[[-2, -1]] == pytest.approx(mesh.vertices[[-1, -1]])


def test_a_short_side_of_the_border_leaves_no_two_triangles_back_to_back():
    """The vertex 2 has the neighbors 0, 1 and 3 only."""
    vertices = np.array(
        [(0.0, 0.0, 0.0), (1e-3, 0.0, 0.0), (0.0, 0.4, 0.0), (0.0, 1.0, 0.0), (-1.0, 0.5, 0.0)]
    )
    vertices = np.vstack([vertices, [(1.0, 0.5, 0.0)]])
    triangles = np.array([(0, 1, 2), (1, 3, 2), (0, 2, 3), (0, 3, 4), (1, 5, 3)])
    welded = _welded(Mesh(vertices, triangles, np.zeros(6), np.zeros(6, dtype=int)))
    assert len(welded.vertices) == 4
    assert solids.topology(welded.triangles) == solids.Topology(4, 0, 1, 1)


def test_a_mesh_without_a_border_stays():
    mesh = grid_mesh()
    assert (
        snapped_to_border(mesh, Border(np.zeros((0, 2, 3)), np.zeros((0, 3)), np.zeros((0, 3)), 0.0)) is mesh
    )


class Unreliable(Sheet):
    """A sheet that does not answer one ray in ten."""

    rng = np.random.default_rng(0)

    def ray_cast(self, *ray):
        return super().ray_cast(*ray) if self.rng.random() > 0.1 else None


@pytest.mark.parametrize("seed", [*range(4), 14])  # With the last, the level leaves the lattice.
def test_edges_for_which_patches_have_no_room_are_refused_with_a_sentence(seed):
    sheet = Unreliable(SQUARE)
    sheet.rng = np.random.default_rng(seed)
    atlas = core.explore_object(sheet, (0.5, 0.5, 0.0), (0, 0, 1), tolerance=TOLERANCE, rng=0, most=3)
    refused = 0
    for share in (0.9, 0.5, 0.3, 0.1):
        try:
            assert len(atlas.mesh(share * atlas.reference.indicator.size).triangles)
        except ValueError as error:
            assert "edge: expected one for which there is room, got" in str(error)
            refused += 1
    assert refused
    assert len(atlas.mesh(atlas.suggested_edge()).triangles)
