# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The order of contacts, curves and strokes, and the way in which each runs, change nothing in the world."""

import numpy as np
import pytest
import surfaces

from core import Contour, reconstruct

TO_ROUNDING = 1e-6  # In deviations of the height. Rounding itself is a thousandth of this.
TO_TILT = 1e-4  # Where d1 may be anywhere: the last tilt of the axes turns d1 by the square of its angle.


def touched(count, curves, strokes, seed):
    """Curves of up to `count` contacts with noise in all directions, and 12 strokes of some contacts each."""
    rng, noise = np.random.default_rng(seed), (0.0, 0.002, 0.01)[seed % 3]
    height, felt = surfaces.wavy(rng, seed % 2), []
    for azimuth in np.pi / curves * np.arange(curves) + rng.uniform(0.0, 7.0):
        t = np.sort(rng.uniform(-rng.uniform(0.7, 1.0), 1.0, int(count * rng.uniform(0.7, 1.0))))
        felt.append(np.column_stack([t * np.cos(azimuth), t * np.sin(azimuth)]))
    x = np.linspace(-0.9, 0.9, strokes)
    rows = [np.column_stack([x, np.full(strokes, y)]) for y in np.linspace(-0.9, 0.9, 12)] if strokes else []
    return [
        [np.column_stack([p, height(*p.T)]) + rng.normal(0.0, noise, (len(p), 3)) for p in some]
        for some in (felt, rows)
    ]


def fitted(curves, strokes):
    return reconstruct((0, 0, 0), list(map(Contour, curves)), outward=(0, 0, 1), strokes=strokes)


def require_same(one, other, most=TO_ROUNDING):
    assert (other.status, other.patch.degree) == (one.status, one.patch.degree)
    assert other.mean_height_std == pytest.approx(one.mean_height_std, rel=1e-6)
    assert [other.patch.k1, other.patch.k2] == pytest.approx([one.patch.k1, one.patch.k2], abs=1e-7)
    x, y = one.domain.grid(100)[0].T
    there = other.frame.to_local(one.frame.to_world(np.column_stack([x, y, one.height(x, y)])))
    off = np.abs(there[:, 2] - other.height(*there[:, :2].T))
    assert (off / one.height_std(x, y)).max() < most


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize(("count", "curves"), [(20, 3), (60, 4), (101, 3), (150, 6), (1000, 3)])
@pytest.mark.parametrize("strokes", [0, 8, 40])
def test_a_fit_is_the_same_in_any_order(count, curves, strokes, seed):
    felt, rows = touched(count, curves, strokes, seed)
    rng, one = np.random.default_rng(seed), fitted(felt, rows)
    require_same(one, fitted([points[::-1] for points in felt], rows))
    require_same(one, fitted([felt[0][::-1], *felt[1:]], rows))
    require_same(one, fitted([*felt[1:], felt[0]], rows))
    require_same(one, fitted(map(rng.permutation, felt), rows))
    if strokes:
        require_same(one, fitted(felt, [points[::-1] for points in rows]))
        require_same(one, fitted(felt, [rows[i] for i in rng.permutation(12)]))


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("strokes", [8, 40])
def test_strokes_without_contours_are_the_same_in_any_order(strokes, seed):
    _, rows = touched(20, 3, strokes, seed)
    one = fitted([], rows)
    require_same(one, fitted([], [points[::-1] for points in rows]))
    require_same(one, fitted([], [rows[i] for i in np.random.default_rng(seed).permutation(12)]))


@pytest.mark.parametrize("count", [81, 301])
def test_measured_normals_and_ends_belong_to_their_contacts_in_any_order(count):
    surface = surfaces.torus(40, 20, 0.6)
    contours = surface.track(surfaces.planes((0, 50, 120)), extent=10, step=20 / count, noise=0.05, rng=1)
    given = [
        Contour(c.points, normals=c.normals, normal_std=0.02, stops=stops)
        for c, stops in zip(
            contours, [("extent", "crease"), ("extent", "extent"), ("no contact", "extent")], strict=True
        )
    ]
    back = [
        Contour(c.points[::-1], normals=c.normals[::-1], normal_std=0.02, stops=c.stops[::-1]) for c in given
    ]
    one = surface.fit(given)
    for other in (surface.fit(back), surface.fit(given[1:] + given[:1])):
        require_same(one, other)
        assert other.domain.area == pytest.approx(one.domain.area)
        assert other.contradiction == pytest.approx(one.contradiction, rel=1e-6)


def flat_at_the_point(kind, seed):
    """Curves of a surface that is flat at the point, so that contacts there determine no directions."""
    rng = np.random.default_rng(seed)
    crease, curves, t = rng.uniform(0.0, 7.0), rng.integers(3, 7), np.linspace(-1.0, 1.0, 30)

    def at(t, azimuth, off=0.0):
        x, y = t * np.cos(azimuth) - off * np.sin(azimuth), t * np.sin(azimuth) + off * np.cos(azimuth)
        fold = 0.3 * np.maximum(x * np.cos(crease) + y * np.sin(crease) - 0.3, 0.0)
        z = {"fold": fold, "monkey": 0.2 * (x**3 - 3.0 * x * y**2), "plane": 0.0 * x}[kind]
        return np.column_stack([x, y, z + rng.normal(0.0, 1e-4, len(x)) * (kind == "plane")])

    azimuths = np.pi / curves * np.arange(curves) + rng.uniform(0.0, 7.0)
    felt = [at(np.sort(rng.uniform(-1.0, rng.uniform(0.7, 1.0), rng.integers(60, 200))), a) for a in azimuths]
    return felt, [at(t, rng.uniform(0.0, 7.0), off) for off in np.linspace(-0.9, 0.9, 4)]


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("kind", ["fold", "monkey", "plane"])
def test_where_there_are_no_directions_any_curve_may_be_the_first(kind, seed):
    felt, rows = flat_at_the_point(kind, seed)
    for strokes in ([], rows):
        one = fitted(felt, strokes)
        require_same(one, fitted(felt[1:] + felt[:1], strokes), TO_TILT)
        require_same(one, fitted(felt[::-1], strokes), TO_TILT)


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("curves", [0, 4])
def test_where_a_sensor_rests_in_a_stroke_contacts_count_once(curves, seed):
    felt, rows = touched(60, 4, 40, seed)
    one, rng = fitted(felt[:curves], rows), np.random.default_rng(seed)
    require_same(one, fitted(felt[:curves], [np.repeat(points, 2, axis=0) for points in rows]))
    some = [np.repeat(points, rng.integers(1, 4, len(points)), axis=0) for points in rows]
    require_same(one, fitted(felt[:curves], some))
