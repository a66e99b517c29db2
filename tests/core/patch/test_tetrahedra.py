# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The lattice, its cut, and walls that are thinner than its edges."""

import numpy as np
import pytest

from core.atlas import meshing
from core.atlas.field import Blend
from core.exploration.side_by_side import result_of
from core.patch.tetrahedra import crossed_twice, cut, split, tetrahedra_of
from tests import solids

APART = 0.8  # how far the centers of two unit balls are from the plane between them


def lens(points, sign=1.0):
    """The field of the lens that two balls share, whose rim is sharp; with -1, of a hollow like it."""
    off = points[:, None] + APART * np.array([[0.0, 0.0, 1.0], [0.0, 0.0, -1.0]])
    away = np.linalg.norm(off, axis=2)
    wall = (np.arange(len(points)), away.argmax(axis=1))
    normal = sign * off[wall] / away[wall][:, None]
    return Blend(sign * (away[wall] - 1.0), np.zeros(len(points)), normal, np.zeros(len(points), dtype=int))


def lattice(size):
    count = int(np.ceil(0.8 / size))
    cells = np.stack(np.meshgrid(*[np.arange(-count, count)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    corners, tetrahedra = result_of(tetrahedra_of(cells))
    return 0.5 * size * corners, tetrahedra


def volumes(points, tetrahedra):
    a, b, c, d = points[tetrahedra].transpose(1, 0, 2)
    return np.einsum("ni,ni->n", np.cross(b - a, c - a), d - a) / 6.0


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("edge", [0.03, 0.04, 0.1])
def test_a_sharp_rim_has_no_holes(edge, sign, monkeypatch):
    """Near a sharp rim the wall of the lens, or the gap of the hollow, is thinner than any edge."""
    size = meshing.CELL * edge
    points, tetrahedra = lattice(size)
    field = lens(points, sign)
    before = solids.topology(cut(tetrahedra, field.distance, size)[1])
    monkeypatch.setattr(meshing, "told", lambda charts, felt, places, room: lens(places, sign))
    for new in (0, *[len(points)] * (meshing.SPLITS - 1)):
        steps = meshing._thin_walls(None, None, tetrahedra, points, field, edge, new)
        tetrahedra, points, field = result_of(steps)
    after = solids.topology(cut(tetrahedra, field.distance, size)[1])
    assert before != solids.Topology(0, 0, 2, 1)
    assert after == solids.Topology(0, 0, 2, 1)


def test_split_tetrahedra_fill_the_same_space_without_a_gap():
    points, tetrahedra = lattice(0.2)
    field = lens(points)
    edges = crossed_twice(tetrahedra, points, field.distance, field.normal)
    assert len(edges) > 20
    halved = split(tetrahedra, edges, len(points))
    more = np.concatenate([points, points[edges].mean(axis=1)])
    assert len(halved) > len(tetrahedra) + 4 * len(edges) // 2
    assert np.abs(volumes(more, halved)).min() > 0.0
    assert np.abs(volumes(more, halved)).sum() == pytest.approx(np.abs(volumes(points, tetrahedra)).sum())
    faces, halves = (
        np.unique(
            np.vstack([np.sort(np.delete(t, i, axis=1), axis=1) for i in range(4)]),
            axis=0,
            return_counts=True,
        )[1]
        for t in (tetrahedra, halved)
    )
    assert halves.max() == 2
    assert (halves == 1).sum() == (faces == 1).sum()


def test_edges_may_be_crossed_twice_where_the_surface_turns_between_their_ends():
    points = np.array([[0.0, 0.0, 0.6], [0.0, 0.0, -0.6], [0.0, 0.0, 0.0], [0.3, 0.0, 0.7]])
    field = lens(points)
    found = crossed_twice(np.array([[0, 1, 2, 3]]), points, field.distance, field.normal)
    assert found.tolist() == [[0, 1], [1, 3]]  # no edge to the point inside, and none between neighbors


def test_a_wall_that_may_be_an_error_of_the_field_splits_nothing(monkeypatch):
    points, tetrahedra = lattice(meshing.CELL * 0.1)
    counts = []
    for std in (0.0, 0.2, np.inf):
        monkeypatch.setattr(
            meshing, "told", lambda *asked, std=std: lens(asked[2])._replace(std=np.full(len(asked[2]), std))
        )
        steps = meshing._thin_walls(None, None, tetrahedra, points, lens(points), 0.1, 0)
        counts.append(len(result_of(steps)[1]) - len(points))
    assert counts[0] > 0
    assert counts[1:] == [0, 0]
