# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""How far a surface is off a patch all over it, and what that says of the fit."""

import math

import numpy as np
import pytest
import surfaces

import core
from core.reconstruction.status import CONTRADICTING, DOUBTFUL_GAP


class Levels:
    """Planes z = level, each with the outward normal (0, 0, side); rays meet the nearest."""

    def __init__(self, *levels):
        self.levels = levels

    def ray_cast(self, origin, direction, distance):
        reached = [((z - origin[2]) / direction[2], side) for z, side in self.levels]
        ahead = [(t, side) for t, side in reached if 0.0 <= t <= distance]
        if not ahead:
            return None
        t, side = min(ahead)
        return tuple(o + t * d for o, d in zip(origin, direction, strict=True)), (0.0, 0.0, side)


@pytest.fixture(scope="module")
def flat():
    """The patch z = 0 of radius 1."""
    at = np.linspace(-1.0, 1.0, 21)[:, None]
    directions = [(math.cos(a), math.sin(a), 0.0) for a in np.radians([0, 60, 120])]
    contours = [core.Contour(at * np.array(direction)) for direction in directions]
    return core.reconstruct((0, 0, 0), contours, outward=(0, 0, 1))


@pytest.mark.parametrize("level", [0.3, -0.3, 0.0])
def test_a_plane_that_is_off_has_the_exact_distance(flat, level):
    assert core.mesh_error(flat, Levels((level, 1.0))).height == pytest.approx(abs(level), abs=1e-6)


@pytest.mark.parametrize(
    ("levels", "off"),
    [
        ([(0.1, -1.0), (0.3, 1.0)], 0.3),  # a wall seen from within, and the outside behind it
        ([(-0.1, -1.0), (-0.2, 1.0), (0.5, 1.0)], 0.2),
        ([(0.4, 1.0), (-0.25, 1.0)], 0.25),
        ([(0.1, -1.0)], None),
        ([(1.5, 1.0)], None),  # farther than a radius
        ([(-1.5, 1.0)], None),
    ],
)
def test_the_nearest_layer_whose_outside_is_up_counts(flat, levels, off):
    found = core.mesh_error(flat, Levels(*levels)).height
    assert found is None if off is None else found == pytest.approx(off, abs=1e-6)


class HalfPlane(Levels):
    """The part of z = 0 where x is at least `start`."""

    def __init__(self, start, side=1.0):
        super().__init__((0.0, side))
        self.start = start

    def ray_cast(self, origin, direction, distance):
        hit = super().ray_cast(origin, direction, distance)
        return hit if hit is not None and hit[0][0] >= self.start else None


@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize(("start", "share"), [(-2.0, 0.0), (-0.5, 0.196), (-0.9, 0.019)])
def test_the_area_without_surface_is_missing(flat, start, share, side):
    found = core.mesh_error(flat, HalfPlane(start, side))
    assert found.height == pytest.approx(0.0, abs=1e-6)
    assert found.missing == pytest.approx(share, abs=0.03)


def test_a_patch_is_in_doubt_where_there_is_no_mesh(flat):
    assert core.judged_by_mesh(flat, core.MeshError(0.0, DOUBTFUL_GAP)) == (flat.status, flat.message)
    error = core.mesh_error(flat, HalfPlane(-0.5))
    assert core.judged_by_mesh(flat, error) == (
        "uncertain",
        f"At {100.0 * error.missing:.0f} % of the patch there is no surface, which ends or has a hole "
        "between the curves: use a shorter extent or add sampling planes.",
    )


def test_it_is_the_mean_over_the_domain_of_what_the_fit_misses():
    s = surfaces.pear()
    r = s.fit(s.track(surfaces.planes((0, 60, 120))))
    found = core.mesh_error(r, s).height
    assert 0.3 * r.mean_height_std < found < 2.0 * r.mean_height_std
    larger = r.moved(
        np.diag([1.0, 1.0, 1.0, 1.0]) + 0.1 * r.radius * np.outer([*r.frame.axes[:, 2], 0], [0, 0, 0, 1])
    )
    assert core.mesh_error(larger, s).height == pytest.approx(0.1 * r.radius, rel=0.1)


def test_a_mesh_contradicts_a_fit_without_doubt_where_it_is_beyond_its_deviation(flat):
    std = flat.mean_height_std
    assert core.judged_by_mesh(flat, core.MeshError(CONTRADICTING * std)) == (flat.status, flat.message)
    status, message = core.judged_by_mesh(flat, core.MeshError(1.01 * CONTRADICTING * std))
    assert (flat.status, status) == ("ok", "uncertain")
    assert message.startswith("The mesh is ") and message.endswith(
        "use a shorter extent or add sampling planes."
    )
