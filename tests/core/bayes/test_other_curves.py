# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A curve that is flipped, or turned about the normal, among curves or strokes that contradict it."""

import numpy as np
import pytest
import surfaces

from core import Contour

BENT = {
    "quadric": {(2, 0): -0.02, (0, 2): -0.005},
    "saddle": {(2, 0): -0.02, (0, 2): 0.01},
    "quartic": {(2, 0): -0.02, (0, 2): 0.01, (3, 0): 2e-4, (1, 2): 1e-4, (4, 0): -2e-6, (2, 2): 3e-6},
}
AZIMUTHS = {4: (20, 65, 110, 155), 5: (20, 56, 92, 128, 164), 6: (0, 30, 60, 90, 120, 150)}


def touched(name, count, noise, seed):
    """A surface whose normal at the point is z, and the contacts of curves on it."""
    surface = surfaces.graph(BENT[name])
    contours = surface.track(surfaces.planes(AZIMUTHS[count]), noise=noise, rng=seed)
    return surface, [c.points for c in contours]


def fitted(surface, curves, noise, **options):
    return surface.fit([Contour(points, noise=noise) for points in curves], **options)


def turned(points, degrees):
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return points @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])


def contradicts(r):
    return r.status == "uncertain" and "as if it were flipped or its plane were another" in r.message


@pytest.mark.parametrize("name", BENT)
@pytest.mark.parametrize("count", AZIMUTHS)
@pytest.mark.parametrize("noise", [0.0, 0.05, 0.1])
def test_a_curve_that_is_upside_down_among_four_or_more_is_a_doubt(name, count, noise):
    for seed in range(3):
        surface, curves = touched(name, count, noise, seed)
        r = fitted(surface, [curves[0] * [1.0, 1.0, -1.0], *curves[1:]], noise)
        assert r.status == "uncertain"
        assert r.curve_contradiction[0] > 7.0


@pytest.mark.parametrize("degrees", [45, 90])
def test_a_curve_that_is_turned_among_four_is_a_doubt(degrees):
    for name in BENT:
        surface, curves = touched(name, 4, 0.05, 1)
        assert contradicts(fitted(surface, curves, 0.05)) is False
        assert fitted(surface, [turned(curves[0], degrees), *curves[1:]], 0.05).status == "uncertain"


def test_the_message_says_how_far_the_curve_is_off():
    surface, curves = touched("quadric", 6, 0.05, 0)
    r = fitted(surface, [curves[0] * [1.0, 1.0, -1.0], *curves[1:]], 0.05)
    assert contradicts(r)
    deviations, off = r.curve_contradiction
    x, _, z = curves[0].T  # In this plane, y = 0, all heights are off by twice themselves.
    assert off == pytest.approx(
        np.median(2.0 * np.abs(z[np.abs(x) > 0.5 * np.abs(x).max()])) / r.radius, rel=0.1
    )
    assert f"A curve is {100.0 * off:.2g} % of the radius off" in r.message
    assert f"whose deviations explain {700.0 * off / deviations:.2g} %" in r.message


def test_strokes_tell_it_among_three_curves():
    surface = surfaces.graph(BENT["saddle"])
    curves = [c.points for c in surface.track(surfaces.planes((0, 60, 120)), noise=0.05, rng=0)]
    flat = np.random.default_rng(0).uniform(-8.0, 8.0, (60, 2))
    strokes = [np.column_stack([flat, -0.02 * flat[:, 0] ** 2 + 0.01 * flat[:, 1] ** 2])]
    right = fitted(surface, curves, 0.05, strokes=strokes)
    assert right.status == "ok"
    assert right.curve_contradiction[0] < 4.0
    curves[1] = curves[1] * [1.0, 1.0, -1.0]
    wrong = fitted(surface, curves, 0.05, strokes=strokes)
    assert wrong.status == "uncertain"
    assert wrong.curve_contradiction[0] > 7.0
    assert fitted(surface, curves, 0.05).curve_contradiction == (0.0, 0.0)


@pytest.mark.long
@pytest.mark.parametrize("count", AZIMUTHS)
@pytest.mark.parametrize("noise", [0.0, 0.05, 0.2])
def test_right_curves_are_not_doubted(count, noise):
    exact = [surfaces.graph(terms) for terms in BENT.values()]
    for number, surface in enumerate(
        [*exact, *surfaces.FIVE.values(), surfaces.sine(), surfaces.monkey_saddle()]
    ):
        for seed in range(2):
            contours = surface.track(surfaces.planes(AZIMUTHS[count]), noise=noise, rng=[number, seed])
            r = surface.fit(contours)
            assert r.curve_contradiction[0] < 5.0
            assert not contradicts(r)


def test_outliers_and_short_curves_are_not_taken_for_curves_in_the_wrong_place():
    for seed in range(10):
        surface, curves = touched("saddle", 4, 0.05, seed)
        rng = np.random.default_rng(seed)
        for points in curves:
            points[:, 2] += np.where(rng.random(len(points)) < 0.2, rng.normal(0.0, 1.2, len(points)), 0.0)
        curves[0] = curves[0][8:17]
        assert not contradicts(fitted(surface, curves, 0.05))
