# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Patches end where the surface does: at the edges of a face and of a block, and of nothing else."""

import json

import numpy as np
import pytest
import surfaces
from numpy.testing import assert_allclose

import core


class Face:
    """The plane z = 0 where x < 1, and a flank down from there, or nothing."""

    def __init__(self, flank):
        self.flank = flank

    def ray_cast(self, origin, direction, distance):
        (x, _, z), (dx, _, dz) = origin, direction
        hits = []
        if dz:
            hits.append((-z / dz, lambda p: p[0] <= 1.0, (0.0, 0.0, 1.0)))
        if self.flank and dx:
            hits.append(((1.0 - x) / dx, lambda p: p[2] <= 0.0, (1.0, 0.0, 0.0)))
        for gone, there, normal in sorted(hits, key=lambda hit: hit[0]):
            point = tuple(a + gone * b for a, b in zip(origin, direction, strict=True))
            if 0.0 <= gone <= distance and there(point):
                return point, normal
        return None


def beyond(r, count=10_000):
    """The share of the domain's area that is beyond the edge."""
    points, _ = r.domain.grid(count)
    return np.mean(r.frame.to_world(np.column_stack([points, np.zeros(len(points))]))[:, 0] > 1.0)


@pytest.mark.long
@pytest.mark.parametrize("flank", [True, False], ids=["crease", "border"])
@pytest.mark.parametrize("distance", [0.003, 0.03, 0.2, 0.5, 0.8])
@pytest.mark.parametrize("count", [3, 4, 6])
def test_near_an_edge_no_patch_reaches_beyond_it(flank, distance, count):
    """None does even where the point is less than a step from it and some half curves have no contact."""
    rng, point = np.random.default_rng(count), (1.0 - distance, 0.3, 0.0)
    for turn in rng.uniform(0.0, np.pi, 5):
        planes = [core.SamplingPlane(turn + np.pi * i / count) for i in range(count)]
        contours = core.track(Face(flank), point, (0.0, 0.0, 1.0), planes, extent=1.0, step=1.0 / 24.0)
        r = core.reconstruct(point, contours, outward=(0.0, 0.0, 1.0))
        if any(stop != core.EXTENT for contour in contours for stop in contour.stops):
            assert r.domain.open_ends.any()
            assert beyond(r) < 5e-3
        again = core.from_dict(json.loads(json.dumps(core.to_dict(r))))
        assert_allclose(again.domain.boundary(90), r.domain.boundary(90), 1e-6, 1e-12)
        larger = r.moved(np.diag([3.0, 3.0, 3.0, 1.0]))
        assert_allclose(larger.domain.boundary(90), 3.0 * r.domain.boundary(90), 1e-6, 1e-12)
        vertices, _ = r.mesh()
        assert (r.frame.to_world(vertices)[:, 0] < 1.0 + 0.02).all()


def test_strokes_beyond_an_edge_are_none_of_the_patch():
    point, planes = (0.7, 0.0, 0.0), surfaces.planes((10, 70, 130))
    contours = core.track(Face(True), point, (0.0, 0.0, 1.0), planes, extent=1.0, step=1.0 / 24.0)
    strokes = np.array([[x, y, 0.0] for x in np.linspace(-0.2, 1.3, 31) for y in (-0.3, 0.0, 0.3)])
    r = core.reconstruct(point, contours, outward=(0.0, 0.0, 1.0), strokes=[strokes])
    assert len(r.strokes) > 20
    assert r.strokes[:, 0].max() <= 1.0


@pytest.mark.parametrize("surface", [surfaces.sphere(25), surfaces.torus(40, 20, 0.6)], ids=["ball", "torus"])
def test_a_surface_that_goes_on_has_no_open_ends(surface):
    """Long curves end where the surface turns away, which is no end of it."""
    for extent in (8.0, 60.0):
        r = surface.fit(surface.track(surfaces.TILTED, extent=extent))
        assert r.domain.open_ends is None
        assert core.to_dict(r)["geometry"]["open_ends"] is None
