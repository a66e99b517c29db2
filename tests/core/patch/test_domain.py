# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The closed spline domain and its grid."""

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from core.patch.domain import closed_spline_domain, hull_domain


def circle(angles, radius=1.0):
    a = np.radians(angles)
    return radius * np.column_stack([np.cos(a), np.sin(a)])


SIXTH = np.arange(0, 360, 60)
UNEVEN = circle([0, 35, 80, 180, 215, 260])
STUBBY = circle(SIXTH) * np.array([1, 1, 0.4, 1, 0.7, 1])[:, None]


def test_six_even_ends_make_nearly_a_disk():
    domain = closed_spline_domain(circle(SIXTH, 12.0), 12.0)
    assert domain.area == pytest.approx(np.pi * 144, rel=0.02)
    assert np.linalg.norm(domain.boundary(500), axis=1) == pytest.approx(12.0, rel=0.01)


@pytest.mark.parametrize("ends", [circle([10, 130, 250]), circle(SIXTH), UNEVEN, STUBBY])
def test_the_boundary_is_the_closed_cubic_spline_over_the_chords(ends):
    domain = closed_spline_domain(ends, 1.0)
    closed = np.vstack([domain.ends, domain.ends[:1]])
    at = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(closed, axis=0), axis=1))])
    theirs = CubicSpline(at, closed, bc_type="periodic")(np.linspace(0.0, at[-1], 1001)).T
    azimuth = np.arctan2(theirs[1], theirs[0])
    assert domain.points_at(np.column_stack([np.cos(azimuth), np.sin(azimuth)])) == pytest.approx(
        theirs.T, abs=1e-4
    )
    points, weights = domain.nodes
    assert weights.sum() == pytest.approx(1.0, rel=1e-12)
    assert domain.contains(*points.T).all()


@pytest.mark.parametrize(
    ("radii", "is_open"),
    [
        ([1, 1, 1, 0.02, 0.02, 0.56], [0, 0, 0, 0, 0, 1]),
        ([1, 0.37, 0.04, 0.04, 0.1, 0.5], [1, 0, 0, 1, 0, 1]),
    ],
)
def test_means_over_the_nodes_are_those_over_the_grid_where_the_spline_turns_back(radii, is_open):
    domain = closed_spline_domain(circle(SIXTH - 120.0) * np.array(radii)[:, None], 1.0, is_open)
    (points, weights), (grid, _) = domain.nodes, domain.grid(20000)
    assert weights.sum() == pytest.approx(1.0, rel=1e-12)
    assert domain.contains(*points.T).all()
    assert weights @ points == pytest.approx(grid.mean(axis=0), abs=5e-3)
    assert (weights * points.T) @ points == pytest.approx(grid.T @ grid / len(grid), abs=5e-3)


@pytest.mark.parametrize("ends", [circle(SIXTH), UNEVEN, STUBBY], ids=["even", "uneven", "stubby"])
def test_the_boundary_passes_through_the_ends_in_any_order(ends):
    rng = np.random.default_rng(0)
    domain = closed_spline_domain(rng.permutation(ends), 1.0)
    azimuth = np.arctan2(ends[:, 1], ends[:, 0]) % (2 * np.pi)
    fine = domain.boundary(36000)
    nearest = fine[np.round(azimuth * 36000 / (2 * np.pi)).astype(int) % 36000]
    assert nearest == pytest.approx(ends, abs=2e-4)
    for inside, factor in ((True, 0.999), (False, 1.001)):
        assert np.all(domain.contains(*(factor * ends).T) == inside)
    assert bool(domain.contains(0.0, 0.0))


@pytest.mark.parametrize("ends", [circle(SIXTH), UNEVEN, STUBBY], ids=["even", "uneven", "stubby"])
def test_grid_cells_fill_the_area(ends):
    domain = closed_spline_domain(ends, 1.0)
    points, h = domain.grid(600)
    assert len(points) == pytest.approx(600, rel=0.05)
    assert len(points) * h**2 == pytest.approx(domain.area, rel=0.05)
    assert np.all(domain.contains(*points.T))
    assert np.unique(np.round(np.diff(np.unique(points[:, 0])) / h, 6)).tolist() == [1.0]


@pytest.mark.parametrize("ends", [circle(SIXTH), UNEVEN, STUBBY], ids=["even", "uneven", "stubby"])
def test_nodes_take_means_over_the_domain(ends):
    domain = closed_spline_domain(ends, 1.0)
    points, weights = domain.nodes
    assert np.all(domain.contains(*points.T))
    dense = domain.grid(40000)[0]
    for i, j in [(0, 0), (2, 0), (1, 1), (0, 3), (4, 0), (2, 2)]:
        moment = np.mean(dense[:, 0] ** i * dense[:, 1] ** j)
        assert weights @ (points[:, 0] ** i * points[:, 1] ** j) == pytest.approx(moment, abs=2e-3)


@pytest.mark.parametrize("short", [0.02, 0.1, 0.2])
def test_next_to_a_short_end_the_boundary_turns_back_nowhere(short):
    """The spline itself does turn back, so an azimuth does not determine how far out it is."""
    ends = circle(SIXTH) * np.array([1, 1, short, 1, 0.6, 1])[:, None]
    domain = closed_spline_domain(ends, 1.0)
    radii = np.linalg.norm(domain.boundary(3600), axis=1)
    assert radii[::600] == pytest.approx([1, 1, short, 1, 0.6, 1], abs=2e-3)
    assert np.abs(np.diff(radii)).max() < 0.02
    ring = domain.boundary(1000)
    x, y = ring.T
    shoelace = 0.5 * np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y)
    assert domain.area == pytest.approx(shoelace, rel=1e-3)


@pytest.mark.parametrize("ends", [circle(SIXTH), UNEVEN, STUBBY], ids=["even", "uneven", "stubby"])
def test_the_area_is_that_within_the_spline(ends):
    domain = closed_spline_domain(ends, 1.0)
    x, y = domain.boundary(200_000).T
    shoelace = 0.5 * np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y)
    assert domain.area == pytest.approx(shoelace, rel=2e-6)


def test_a_curve_that_ends_at_the_point_is_no_end():
    for reach, ends in ((1e-5, 6), (9e-4, 6), (1.1e-3, 7)):
        given = np.vstack([circle(SIXTH), circle([30], reach), circle([0])])
        assert len(closed_spline_domain(8.0 * given, 8.0).ends) == ends
    for degrees, ends in ((0.05, 6), (0.06, 7)):  # a thousandth of the radius is 0.0573 degrees
        assert len(closed_spline_domain(8.0 * circle([*SIXTH, degrees]), 8.0).ends) == ends


def test_fewer_than_three_ends_bound_nothing():
    for ends in (circle([0, 180]), circle([0, 0, 180, 180]), [[0, 0], [0, 0], [1, 0]]):
        with pytest.raises(ValueError, match="ends: expected three or more apart"):
            closed_spline_domain(ends, 1.0)


def test_lengths_scale():
    small, large = closed_spline_domain(STUBBY, 1.0), closed_spline_domain(STUBBY * 1e6, 1e6)
    assert large.area == pytest.approx(small.area * 1e12)
    assert large.boundary(50) == pytest.approx(small.boundary(50) * 1e6)


@pytest.mark.parametrize("others", [[(-1.0, 0.2), (-0.9, -0.3)], [(0.9, 0.1), (0.8, -0.1)]])
def test_two_ends_in_one_direction_bound_what_the_farther_does(others):
    """A curve comes back over itself; the spline through both ends would turn back."""
    domain = closed_spline_domain([(1.0, 0.5), (0.02, 0.01), (0.5, 0.25), *others], 1.0)
    azimuths, radii = domain._polar
    assert np.isfinite(radii).all()
    assert (np.diff(azimuths) > 0.0).all()
    assert np.isfinite(domain.area)
    assert domain.contains(0.5, 0.25)


def test_the_domain_of_scattered_contacts_is_their_hull():
    rng = np.random.default_rng(0)
    points = np.vstack([circle(np.arange(0, 360, 5), 2.0), rng.uniform(-1.0, 1.0, (50, 2))])
    domain = hull_domain(points, 2.0)
    assert domain.area == pytest.approx(4.0 * np.pi, rel=0.01)
    assert np.hypot(*domain.boundary(100).T) == pytest.approx(2.0, rel=0.01)
    with pytest.raises(ValueError, match="points: expected the origin among them"):
        hull_domain(points + np.array([1.95, 0.0]), 2.0)


def cut(angles, distance):
    """Ends of half curves of length 1 on a surface that ends at x = distance, and which of them end there."""
    ends = circle(angles)
    ahead = np.cos(np.radians(angles))
    is_cut = ahead > distance
    return ends * np.where(is_cut, distance / np.where(is_cut, ahead, 1.0), 1.0)[:, None], is_cut


@pytest.mark.parametrize("distance", [0.02, 0.1, 0.3, 0.45])
@pytest.mark.parametrize("turn", [0, 10, 30])
def test_the_domain_ends_where_the_surface_does(distance, turn):
    ends, open_ends = cut(SIXTH + turn, distance)
    domain = closed_spline_domain(ends, 1.0, open_ends)
    assert open_ends.any()
    assert domain.boundary(3600)[:, 0].max() <= distance + 2e-4
    points, weights = domain.nodes
    assert points[:, 0].max() < distance
    assert weights.sum() == pytest.approx(1.0, rel=1e-12)
    dense, h = domain.grid(40000)
    assert len(dense) * h**2 == pytest.approx(domain.area, rel=1e-2)
    for i, j in [(2, 0), (1, 1), (0, 2), (0, 4)]:
        moment = np.mean(dense[:, 0] ** i * dense[:, 1] ** j)
        assert weights @ (points[:, 0] ** i * points[:, 1] ** j) == pytest.approx(moment, abs=2e-3)
    assert domain.scaled(3.0).area == pytest.approx(9.0 * domain.area)


def test_next_to_no_open_end_the_boundary_is_round():
    ends, open_ends = cut(SIXTH, 0.3)
    domain, round_one = closed_spline_domain(ends, 1.0, open_ends), closed_spline_domain(ends, 1.0)
    turns = np.radians(np.arange(120, 241))  # where no end is open
    places = np.column_stack([np.cos(turns), np.sin(turns)])
    radii = np.linalg.norm(domain.points_at(places), axis=1)
    assert radii == pytest.approx(1.0, abs=0.01)
    assert radii[::60] == pytest.approx(1.0, abs=1e-5)
    everywhere = closed_spline_domain(ends, 1.0, np.zeros(6, dtype=bool))
    assert everywhere.open_ends is None
    assert (everywhere.boundary(99) == round_one.boundary(99)).all()


def test_radii_are_nowhere_beyond_what_lies_between_the_ends():
    turns = np.radians(np.arange(360))
    for ends in (circle(SIXTH), UNEVEN, STUBBY):
        domain = closed_spline_domain(ends, 1.0)
        out, radii = np.hypot(*ends.T), domain.radii(360)
        between = np.interp(turns, np.arctan2(ends[:, 1], ends[:, 0]), out, period=2.0 * np.pi)
        assert (radii <= between + 1e-9).all()
        assert (radii <= np.linalg.norm(domain.boundary(360), axis=1) + 1e-9).all()
        at = np.round(np.degrees(np.arctan2(ends[:, 1], ends[:, 0]))).astype(int)
        assert radii[at] == pytest.approx(out, rel=1e-3)


def test_between_ends_far_apart_in_azimuth_radii_end_at_the_line():
    radii = closed_spline_domain(circle([30, 150, 270]), 1.0).radii(360)
    assert radii[[90, 210, 330]] == pytest.approx(0.5)
    assert radii[[60, 120]] == pytest.approx(0.5 / np.cos(np.radians(30)))
