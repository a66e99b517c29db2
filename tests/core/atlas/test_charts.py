# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What tables of patches say of places near them, against their patches and all pairs of both."""

from dataclasses import fields, replace

import numpy as np
import pytest

import core
from core.atlas.charts import AZIMUTHS, MARGIN, Charts
from core.atlas.join import charts_of, tabulate
from tests import solids

BALL = solids.ball()


@pytest.fixture(scope="module")
def results():
    ways = np.random.default_rng(0).normal(size=(12, 3))
    ways /= np.linalg.norm(ways, axis=1, keepdims=True)
    return core.explore_many(BALL, ways, ways, farthest=0.5, rng=0)


@pytest.fixture(scope="module")
def charts(results):
    return charts_of([e.result for e in results])


def places(count, seed):
    """Places around the unit ball, from half its radius inside to half outside."""
    rng = np.random.default_rng(seed)
    ways = rng.normal(size=(count, 3))
    return ways / np.linalg.norm(ways, axis=1, keepdims=True) * rng.uniform(0.5, 1.5, (count, 1))


@pytest.mark.filterwarnings("error")
def test_a_rim_that_ends_at_the_point_has_a_finite_table(results):
    rim = np.where(np.arange(AZIMUTHS) % 8, 0.9, 0.0)
    table = tabulate(results[0].result, rim, deviations=True)
    assert all(np.isfinite(values).all() for values in table)


@pytest.mark.parametrize("near", [np.inf, 0.1])
def test_pairs_are_those_of_each_place_and_each_patch_alone(charts, near):
    points = places(4000, 1)  # They are more than one chunk.
    found = charts.pairs(points, near)
    one_by_one = []
    for patch in range(len(charts.radii)):
        alone = Charts(*(getattr(charts, f.name)[[patch]] for f in fields(Charts)))
        for start in range(0, len(points), 500):
            pairs = alone.pairs(points[start : start + 500], near)
            one_by_one += [
                (start + at, patch, d) for at, d in zip(pairs.point_index, pairs.distance, strict=True)
            ]
    together = list(zip(found.point_index.tolist(), found.patch.tolist(), strict=True))
    assert sorted(together) == sorted((at, patch) for at, patch, _ in one_by_one)
    assert (np.diff(found.point_index) >= 0).all()
    distances = {(at, patch): d for at, patch, d in one_by_one}
    assert found.distance == pytest.approx([distances[pair] for pair in together], abs=1e-12)


@pytest.mark.parametrize(("unit", "shift"), [(1e-6, 0.0), (1e6, 0.0), (1.0, 1e6)])
def test_pairs_are_the_same_in_other_units_and_far_away(charts, unit, shift):
    points = places(500, 2)
    moved = replace(charts, origins=unit * charts.origins + shift, radii=unit * charts.radii)
    here, there = charts.pairs(points), moved.pairs(unit * points + shift)
    assert (here.point_index == there.point_index).all() and (here.patch == there.patch).all()
    assert there.distance == pytest.approx(unit * here.distance, abs=1e-8 * unit * max(1.0, shift))


def test_no_places_have_no_pairs(charts):
    assert len(charts.pairs(np.zeros((0, 3))).point_index) == 0


def test_a_place_far_beside_the_normal_at_its_foot_has_no_foot():
    """On a steep patch one step toward the foot may end far from it, where patches are wrong."""
    result = core.explore(BALL, BALL.start, BALL.outward, farthest=1.2, rng=0).result
    points = result.frame.origin + np.random.default_rng(3).uniform(-1.2, 1.2, (20_000, 3))
    pairs = charts_of([result]).pairs(points)
    assert len(pairs.point_index) > 4000
    assert np.abs(pairs.distance - BALL.distances(points[pairs.point_index])).max() < 0.1 * result.radius
    assert (pairs.rho < MARGIN).all()


def test_deviations_are_linear_between_knots(charts):
    """Where one knot is certain and the next is not, the deviation grows between them."""
    from scipy.interpolate import RegularGridInterpolator

    rng, halves = np.random.default_rng(4), charts.halves[3]
    stds = rng.uniform(0.1, 1.0, charts.stds.shape)
    x, y = rng.uniform(-halves, halves, (2, 50))
    found = replace(charts, stds=stds).stds_at(x, y, np.full(50, 3))
    line = np.linspace(-halves, halves, len(stds[3]))
    expected = RegularGridInterpolator((line, line), stds[3])(np.stack([x, y], axis=1))
    assert found == pytest.approx(expected)
