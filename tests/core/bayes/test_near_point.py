# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Contacts near the point that show other curvatures than the patch has, as beside the tip of a cone."""

from dataclasses import replace

import numpy as np
import pytest
import surfaces

import core
from core import Contour
from core.bayes.near_point import curvature_contradiction


def cone(slope, away):
    """A cone whose tip is the origin, with a point at this distance from its axis."""
    return surfaces.Exact(
        lambda x, y, z: z + slope * np.hypot(x, y),
        lambda p: np.array([*(slope * p[:2] / np.hypot(*p[:2])), 1.0]),
        *(np.array([away, 0.0, -slope * away]), 0.0, 0.0),
    )


@pytest.mark.parametrize(("slope", "away"), [(0.26, 0.5), (0.2, 0.42), (0.35, 0.6), (0.3, 0.7)])
def test_a_touch_across_the_tip_of_a_cone_is_in_doubt_and_a_shorter_one_is_right(slope, away):
    """The tip is between two planes, so no curve bends there."""
    surface, planes = cone(slope, away), surfaces.planes((30, 90, 150))
    wide = core.explore(surface, surface.point, surface.normal, planes, extent=2.0, step=0.125).result
    true = np.array([-slope / away / np.sqrt(1.0 + slope**2), 0.0])
    assert np.abs(np.subtract((wide.k1, wide.k2), true)).max() > 0.1 / wide.radius
    assert wide.status == "uncertain"
    assert replace(wide, taps=None).message.startswith(
        "The contacts near the point bend otherwise than the patch, as beside a tip or a fold within it: "
        "use a shorter extent or move the point away from it."
    )
    short = core.explore(surface, surface.point, surface.normal, planes, extent=0.3 * away).result
    assert short.status == "ok"
    assert np.abs(np.subtract((short.k1, short.k2), true)).max() < 0.1 / short.radius


@pytest.mark.parametrize(("slope", "away", "turn"), [(0.19, 0.32, 40), (0.14, 0.31, 25), (0.12, 0.26, 25)])
def test_the_deviations_of_an_automatic_touch_beside_a_tip_contain_its_curvature(slope, away, turn):
    surface, planes = cone(slope, away), surfaces.planes((turn, turn + 60, turn + 120))
    r = core.explore(surface, surface.point, surface.normal, planes, farthest=2.0).result
    off = np.subtract((r.k1, r.k2), (-slope / away / np.sqrt(1.0 + slope**2), 0.0))
    assert r.status == "ok"
    assert (np.abs(off) <= 5.0 * np.array([r.k1_std, r.k2_std])).all()


def test_contacts_of_a_sphere_or_a_quartic_agree_with_the_patch():
    quartic = surfaces.graph({(2, 0): -0.02, (0, 2): 0.01, (3, 0): 2e-4, (2, 2): 3e-6})
    for surface, extent in ((surfaces.sphere(25.0), 12.0), (quartic, 10.0)):
        for noise in (0.0, 0.02):
            lengths = {"extent": extent, "noise": noise, "rng": 1}
            r = core.explore(surface, surface.point, surface.normal, **lengths).result
            assert r.status == "ok"
            assert r.curvature_contradiction < 3.0


def test_few_contacts_cannot_contradict():
    surface = surfaces.sphere(25.0)
    contours = surface.track(surfaces.planes((0, 60, 120)), noise=0.0)
    r = surface.fit([Contour(contour.points[::6]) for contour in contours])
    near = r.contacts[:3] / r.radius
    assert curvature_contradiction(near, r.posterior, r.curvature_covariance) == 0.0
    assert curvature_contradiction(near[:0], r.posterior, r.curvature_covariance) == 0.0


def test_contacts_are_enough_from_one_and_a_half_times_what_a_quartic_shows_of_them():
    """These show all 14 terms of a quartic, because the normal is not in the planes of their curves."""
    surface, planes = cone(0.26, 0.5), surfaces.planes((30, 90, 150))
    r = core.explore(surface, surface.point, surface.normal, planes, extent=2.0, step=0.125).result
    contacts = r.contacts / r.radius
    near = contacts[np.hypot(contacts[:, 0], contacts[:, 1]) < 0.59]
    for count, is_enough in ((20, False), (21, True)):
        some = near[np.linspace(0, len(near) - 1, count).round().astype(int)]
        assert (curvature_contradiction(some, r.posterior, r.curvature_covariance) > 0.0) is is_enough
