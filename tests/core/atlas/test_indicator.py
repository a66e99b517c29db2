# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The indicator of exact samples: its sides, its level, and what its parts conserve."""

import numpy as np
import pytest

import core
from core.atlas import indicator
from core.atlas.join import charts_of
from core.atlas.samples import indicated, samples_of
from core.steps import result_of
from tests import solids

BALL = solids.ball()


def ball_samples(count=20_000, radius=1.0):
    """Points all over a ball, spread as in a sunflower, and their oriented areas."""
    z = 1.0 - (2.0 * np.arange(count) + 1.0) / count
    turn = np.pi * (3.0 - np.sqrt(5.0)) * np.arange(count)
    r = np.sqrt(1.0 - z**2)
    points = radius * np.stack([r * np.cos(turn), r * np.sin(turn), z], axis=1)
    return points, points / radius * (4.0 * np.pi * radius**2 / count)


def square_samples(corner, e1, e2, count=60):
    """Points of a parallelogram, and their oriented areas."""
    s, t = (np.stack(np.meshgrid(*[np.arange(count)] * 2), axis=-1).reshape(-1, 2).T + 0.5) / count
    normal = np.cross(e1, e2) / count**2
    points = np.add(corner, s[:, None] * np.array(e1) + t[:, None] * np.array(e2))
    return points, np.tile(normal, (len(points), 1))


def block_samples():
    """The six faces of the cube from 0 to 1."""
    x, y, z = np.eye(3)
    faces = [((0, 0, 0), b, a) for a, b in ((x, y), (y, z), (z, x))]
    faces += [(c, a, b) for a, b, c in ((x, y, z), (y, z, x), (z, x, y))]
    return (np.vstack(values) for values in zip(*(square_samples(*face) for face in faces), strict=True))


def test_a_ball_is_1_inside_and_0_outside():
    found = result_of(indicator.solve_poisson(*ball_samples(), 0.05, np.inf))
    ways = np.random.default_rng(0).normal(size=(500, 3))
    ways /= np.linalg.norm(ways, axis=1, keepdims=True)
    inside, surface, outside = (found.at(r * ways) for r in (0.8, 1.0, 1.15))
    assert (inside - outside).mean() == pytest.approx(1.0, abs=0.01)
    assert np.ptp(inside) < 0.02
    assert np.ptp(outside) < 0.02
    assert surface == pytest.approx(0.0, abs=0.05)
    assert inside.mean() == pytest.approx(0.5, abs=0.05)
    assert np.einsum("ni,ni->n", found.outward(ways), ways).min() > 0.98


def test_far_outside_of_the_grid_is_the_outside():
    found = result_of(indicator.solve_poisson(*ball_samples(), 0.05, np.inf))
    assert (found.at(np.array([[9.0, 0.0, 0.0], [-3.0, 4.0, 100.0]])) < -0.3).all()


@pytest.mark.parametrize("cell", [0.2, 0.1, 0.05])
def test_the_level_is_much_nearer_to_the_surface_than_a_cell(cell):
    found = result_of(indicator.solve_poisson(*ball_samples(), cell, np.inf))
    line, ways = np.linspace(0.8, 1.2, 4001), np.random.default_rng(1).normal(size=(60, 3))
    ways /= np.linalg.norm(ways, axis=1, keepdims=True)
    values = found.at((ways[:, None] * line[:, None]).reshape(-1, 3)).reshape(60, -1)
    assert np.abs(line[(values > 0.0).sum(axis=1)] - 1.0).max() < 0.1 * cell


def test_a_convex_edge_has_a_quarter_of_the_inside_around_it_and_a_corner_an_eighth():
    points, areas = block_samples()
    found = result_of(indicator.solve_poisson(points, areas, 0.02, np.inf))
    middle = found.at(np.array([[0.5, 0.5, 0.5]]))[0]
    edge, corner = found.at(np.array([[0.5, 0.0, 0.0], [0.0, 0.0, 0.0]])) - middle + 1.0
    assert edge == pytest.approx(0.25, abs=0.04)
    assert corner == pytest.approx(0.125, abs=0.04)


def test_spread_area_has_no_total_divergence_and_the_moment_of_its_flow():
    values, flow = np.zeros((12, 12, 12), dtype=np.float32), np.array([[0.3, -1.2, 2.0]])
    indicator._add_divergence(values, np.array([[5.3, 6.7, 4.9]]), flow)
    grid = np.stack(np.meshgrid(*[np.arange(12.0)] * 3, indexing="ij"), axis=-1)
    assert values.sum() == pytest.approx(0.0, abs=1e-5)
    # The integral of x div v is minus that of v; the indicator solves for minus the divergence.
    assert np.einsum("ijk,ijkc->c", values, grid) == pytest.approx(-flow[0], abs=1e-5)
    assert np.count_nonzero(values) == 64


def test_cells_are_as_large_as_memory_allows(monkeypatch):
    monkeypatch.setattr(indicator, "MOST_CELLS", 50_000)
    found = result_of(indicator.solve_poisson(*ball_samples(), 0.01, np.inf))
    assert found.values.size < 80_000
    assert found.cell > 0.05


@pytest.fixture(scope="module")
def charts():
    ways = ball_samples(60)[0]
    found = core.explore_many(BALL, ways, ways, farthest=0.5, rng=0)
    return charts_of([e.result for e in found])


@pytest.mark.long
def test_areas_of_overlapping_patches_add_up_to_that_of_the_surface(charts):
    samples = result_of(samples_of(charts, 0.03))
    assert samples.areas.sum() == pytest.approx(4.0 * np.pi, rel=0.03)
    assert np.abs(np.linalg.norm(samples.points, axis=1) - 1.0).max() < 0.01
    assert np.einsum("ni,ni->n", samples.points, samples.normals).min() > 0.99
    assert samples.thinnest == np.inf
    # Nothing is left out anywhere: each octant has an eighth of the area.
    octant = (samples.points > 0.0) @ np.array([1, 2, 4])
    assert np.bincount(octant, samples.areas) == pytest.approx(0.5 * np.pi, rel=0.1)


@pytest.mark.long
def test_a_cell_is_five_tolerances_but_neither_coarse_nor_finer_than_the_memory_allows(charts):
    cells = [result_of(indicated(charts, tolerance)).cell for tolerance in (4e-3, 1.0, None)]
    assert cells == pytest.approx([0.02, 2.0 / 80.0, 2.0 / 80.0], rel=0.02)
