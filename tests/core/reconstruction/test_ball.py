# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Contacts recorded as the centers of a ball, on exact parallel surfaces of both signs."""

from dataclasses import replace

import numpy as np
import pytest
import surfaces

import core
from core import Contour, DegenerateCurvesError
from core.reconstruction.ball import center_at

BALL, RING, TUBE = 3.0, 60.0, 20.0
PLANES = surfaces.planes((10, 70, 130))


def ring(side, place, tube=TUBE):
    """A torus from outside (side 1) or from within its tube (-1), at its outer (1) or inner equator (-1)."""
    reach = side * place

    def level(x, y, z):
        return side * ((np.hypot(x, y) - RING) ** 2 + z**2 - tube**2)

    def gradient(p):
        away = np.hypot(p[0], p[1])
        return 2.0 * side * np.array([*((away - RING) / away * p[:2]), p[2]])

    point = np.array([RING + place * tube, 0.0, 0.0])
    k1, k2 = sorted((-side / tube, -reach / (RING + place * tube)))
    return surfaces.Exact(level, gradient, point, k1, k2)


def felt(side, place, **options):
    """Contours of the centers of a ball, and the center at the reference point."""
    centers = ring(side, place, TUBE + side * BALL)
    contours = centers.track(PLANES, extent=6.0, step=0.5, **options)
    return centers, [Contour(c.points, noise=c.noise, ball=BALL) for c in contours]


@pytest.mark.parametrize("side", [1, -1])
@pytest.mark.parametrize("place", [1, -1])
@pytest.mark.parametrize("method", core.METHODS)
def test_the_patch_is_that_of_the_contacts(side, place, method):
    centers, contours = felt(side, place)
    truth = ring(side, place)
    r = core.reconstruct(centers.point, contours, outward=centers.normal, method=method)
    assert r.frame.origin == pytest.approx(truth.point, abs=1e-9)
    assert [r.patch.k1, r.patch.k2] == pytest.approx([truth.k1, truth.k2], rel=0.02, abs=2e-4)
    off = np.abs(np.hypot(np.hypot(*r.frame.to_world(r.contacts)[:, :2].T) - RING, 0.0))
    assert len(off)
    x, y, z = r.frame.to_world(r.contacts).T
    assert np.hypot(np.hypot(x, y) - RING, z) == pytest.approx(TUBE, abs=1e-3)
    assert all(contour.ball is None for contour in r.contours)


@pytest.mark.parametrize("side", [1, -1])
@pytest.mark.parametrize("noise", [0.0, 0.02])
def test_the_reference_point_may_be_a_contact(side, noise):
    centers, contours = felt(side, 1, noise=noise, rng=0)
    truth = ring(side, 1)
    by_contact, by_center = (
        core.reconstruct(point, contours, outward=centers.normal) for point in (truth.point, centers.point)
    )
    assert by_contact.frame.origin == pytest.approx(truth.point, abs=max(1e-12, noise))
    assert by_contact.patch.k1 == pytest.approx(by_center.patch.k1, rel=0.05)
    assert by_contact.patch.k2 == pytest.approx(by_center.patch.k2, rel=0.05, abs=1e-3)


@pytest.mark.parametrize(("share", "is_center"), [(0.45, True), (0.55, False)])
def test_a_point_within_half_the_ball_s_radius_of_a_center_is_one(share, is_center):
    centers, contours = felt(1, 1)
    point = centers.point - share * BALL * centers.normal
    center = point if is_center else centers.point
    assert center_at(point, contours, BALL) == pytest.approx(center, abs=1e-4)


@pytest.mark.parametrize("side", [1, -1])
def test_deviations_hold_for_noisy_centers(side):
    within, truth = [], ring(side, 1)
    for seed in range(30):
        centers, contours = felt(side, 1, noise=0.02, rng=seed)
        r = core.reconstruct(centers.point, contours, outward=centers.normal)
        within.append(abs(r.patch.k1 - truth.k1) <= 1.645 * r.k1_std)
    assert np.mean(within) >= 0.8


def test_strokes_of_centers_without_contours_and_many_at_once():
    centers, contours = felt(1, -1)
    rng, truth = np.random.default_rng(0), ring(1, -1)
    turn, around = rng.uniform(-0.2, 0.2, 400), np.pi + rng.uniform(-0.3, 0.3, 400)
    away, height = TUBE + BALL, np.sin(around)
    out = RING + away * np.cos(around)
    rows = np.column_stack([out * np.cos(turn), out * np.sin(turn), away * height])
    stroke = Contour(rows, ball=BALL)
    given = {"outward": [centers.normal] * 2, "strokes_list": [[stroke], []]}
    results = core.reconstruct_many([centers.point] * 2, [[], contours], **given)
    for r in results:
        assert [r.patch.k1, r.patch.k2] == pytest.approx([truth.k1, truth.k2], rel=0.03)
        assert np.linalg.norm(r.frame.origin - truth.point) < 0.01


def test_an_edge_sharper_than_the_ball_is_refused():
    s = np.linspace(-0.5, 0.5, 21) * BALL
    angles = np.radians([0, 60, 120])
    curves = []  # A ball rolls over a straight edge along y: centers are on a cylinder around it.
    for a in angles:
        x, y = s * np.cos(a), s * np.sin(a)
        curves.append(Contour(np.column_stack([x, y, np.sqrt(BALL**2 - x**2)]), ball=BALL))
    with pytest.raises(DegenerateCurvesError, match="which may be sharper than the ball resolves"):
        core.reconstruct((0, 0, BALL), curves, outward=(0, 0, 1))
    (found,) = core.reconstruct_many([(0, 0, BALL)], [curves], outward=[(0, 0, 1)])
    assert isinstance(found, DegenerateCurvesError)


@pytest.mark.parametrize("noise", [0.0, 0.02])
def test_a_hollow_sharper_than_the_ball_is_refused(noise):
    rng, s, curves = np.random.default_rng(0), np.linspace(-6, 6, 49), []
    for a in np.radians([0, 60, 120]):  # The centers over a groove along y, whose sides rise by 20 degrees.
        x, y = s * np.cos(a), s * np.sin(a)
        p = np.column_stack([x, y, np.tan(np.radians(20)) * np.abs(x)])
        curves.append(Contour(p + noise * rng.normal(size=p.shape), ball=BALL))
    with pytest.raises(DegenerateCurvesError, match="the ball does not reach the bottom of the hollow"):
        core.reconstruct((0, 0, 0), curves, outward=(0, 0, 1))


def test_one_ball_for_all_and_a_length_above_zero():
    _, contours = felt(1, 1)
    mixed = [replace(contours[0], ball=None), *contours[1:]]
    with pytest.raises(
        ValueError, match="ball: expected one radius for all contours and strokes, got none and 3"
    ):
        core.reconstruct((0, 0, 0), mixed, outward=(0, 0, 1))
    with pytest.raises(ValueError, match="ball: expected a finite number above 0"):
        Contour(np.zeros((3, 3)), ball=0.0)


def test_a_similarity_scales_the_ball():
    _, (contour, *_) = felt(1, 1)
    moved = contour.moved(2.0, np.eye(3), np.zeros(3), np.ones(3))
    assert moved.ball == 2.0 * BALL


@pytest.mark.long
def test_a_whole_object_of_centers_has_the_size_of_the_contacts():
    strokes = []
    for z in np.arange(-0.95, 1.0, 0.15):
        t, r = np.linspace(0, 2 * np.pi, 60, endpoint=False), np.sqrt(1 - z**2)
        row = 1.3 * np.column_stack([r * np.cos(t), r * np.sin(t), np.full(60, z)])
        strokes += [Contour(some, ball=0.3) for some in (row, row[:, [2, 0, 1]])]
    atlas = core.atlas_of(strokes)
    assert atlas.status == "ok"
    distance, std = atlas.distance([(0, 0, 1.1), (0.9, 0, 0)])
    assert distance == pytest.approx([0.1, -0.1], abs=0.01)
    assert np.isfinite(std).all()
