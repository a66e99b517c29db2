# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The lattice, its cut, and triangles whose edges are split."""

import numpy as np
import pytest

from core.atlas.tetrahedra import march, sides_of, smoothed, split_sides, subdivided, tetrahedra_of
from core.steps import result_of
from tests import solids


def lattice(size):
    count = int(np.ceil(1.3 / size))
    cells = np.stack(np.meshgrid(*[np.arange(-count, count)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    corners, tetrahedra = result_of(tetrahedra_of(cells))
    return 0.5 * size * corners, tetrahedra


def ball(size=0.3):
    """Vertices and triangles of a ball, each vertex in the middle of an edge of the lattice."""
    points, tetrahedra = lattice(size)
    ends, triangles = march(tetrahedra, np.linalg.norm(points, axis=1) - 1.0)
    return points[ends].mean(axis=1), triangles


def volume(vertices, triangles):
    a, b, c = vertices[triangles].transpose(1, 0, 2)
    return np.einsum("ni,ni->", np.cross(a, b), c) / 6.0


def test_tetrahedra_fill_the_space_between_the_middles_of_cubes_without_a_gap():
    points, tetrahedra = lattice(0.5)
    a, b, c, d = points[tetrahedra].transpose(1, 0, 2)
    volumes = np.abs(np.einsum("ni,ni->n", np.cross(b - a, c - a), d - a)) / 6.0
    assert volumes == pytest.approx(0.5**3 / 12.0)
    faces = np.vstack([np.sort(np.delete(tetrahedra, i, axis=1), axis=1) for i in range(4)])
    assert np.unique(faces, axis=0, return_counts=True)[1].max() == 2


def test_a_ball_is_cut_closed_and_faces_outward():
    vertices, triangles = ball()
    assert solids.topology(triangles) == solids.Topology(0, 0, 2, 1)
    assert volume(vertices, triangles) == pytest.approx(4.0 / 3.0 * np.pi, rel=0.1)


def test_sides_are_the_edges_once():
    _, triangles = ball()
    sides = sides_of(triangles, triangles.max() + 1)
    assert (sides[:, 0] < sides[:, 1]).all()
    assert len(np.unique(sides, axis=0)) == len(sides) == 3 * len(triangles) // 2


@pytest.mark.parametrize("share", [0.0, 0.1, 0.5, 0.9, 1.0])
def test_split_sides_leave_the_same_surface_without_a_gap(share):
    """All cases of one, two and three split sides of a triangle occur, and each vertex is on its side."""
    vertices, triangles = ball()
    sides = sides_of(triangles, len(vertices))
    sides = sides[np.random.default_rng(0).random(len(sides)) < share]
    found = split_sides(triangles, sides, len(vertices))
    more = np.vstack([vertices, vertices[sides].mean(axis=1)])
    assert solids.topology(found) == solids.Topology(0, 0, 2, 1)
    assert len(found) == len(triangles) + 2 * len(sides)
    assert volume(more, found) == pytest.approx(volume(vertices, triangles))


def test_halved_triangles_are_four_times_as_many_on_the_same_planes():
    vertices, triangles = ball()
    more, found = subdivided(vertices, triangles)
    assert len(found) == 4 * len(triangles)
    assert volume(more, found) == pytest.approx(volume(vertices, triangles))
    assert np.median(np.linalg.norm(more[found[:, 0]] - more[found[:, 1]], axis=1)) == pytest.approx(
        0.5 * np.median(np.linalg.norm(vertices[triangles[:, 0]] - vertices[triangles[:, 1]], axis=1)),
        rel=0.1,
    )


def test_evened_vertices_stay_on_the_surface_and_a_border_stays():
    vertices, triangles = ball()
    vertices /= np.linalg.norm(vertices, axis=1, keepdims=True)
    upper = triangles[(vertices[triangles, 2] > 0.0).all(axis=1)]
    moved = smoothed(vertices, vertices, upper)
    ends, counts = np.unique(
        np.sort(upper[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1), axis=0, return_counts=True
    )
    border = np.unique(ends[counts == 1])
    assert (moved[border] == vertices[border]).all()
    assert np.abs(np.einsum("ni,ni->n", moved - vertices, vertices)).max() < 1e-12
    assert np.abs(moved - vertices).max() > 0.01
