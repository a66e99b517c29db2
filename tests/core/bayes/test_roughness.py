# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Roughness is what a sextic leaves of contacts, as a share of their radius; noise does not count."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from core.bayes.roughness import roughness

AZIMUTHS = np.pi * np.arange(3) / 3.0
ALONG = np.linspace(-1.0, 1.0, 25)
X, Y = (np.outer(turn(AZIMUTHS), ALONG).ravel() for turn in (np.cos, np.sin))


def contacts(height):
    return np.column_stack([X, Y, height])


def waves(size, seed=0):
    """Offsets of random sign at each contact, which no polynomial follows."""
    return size * np.random.default_rng(seed).choice([-1.0, 1.0], len(X))


def test_a_cap_is_smooth():
    cap = contacts(np.sqrt(4.0 - X**2 - Y**2) - 2.0)
    assert roughness(cap, 0.0) < 1e-3


@pytest.mark.parametrize("size", [0.003, 0.01, 0.03])
def test_of_waves_it_is_their_size(size):
    """The tolerance allows for the chance in 75 offsets."""
    assert roughness(contacts(0.1 * X**2 + waves(size)), 0.0) == pytest.approx(size, rel=0.1)


def test_it_is_alike_wherever_and_in_whatever_unit_they_are_felt():
    rough = contacts(0.2 * X * Y + waves(0.01))
    turn = Rotation.from_euler("xyz", (0.4, -1.1, 2.0)).as_matrix()
    assert roughness(1e4 * rough @ turn.T, 0.0) == pytest.approx(roughness(rough, 0.0), rel=1e-9)


def test_noise_that_is_known_is_no_roughness():
    noisy = contacts(0.1 * X**2 + waves(0.01))
    assert roughness(noisy, 0.01) == 0.0
    assert roughness(noisy, 0.001) == pytest.approx(roughness(noisy, 0.0), rel=0.02)


def test_contacts_at_nothing_but_the_point_are_not_rough():
    assert roughness(np.zeros((3, 3)), 0.0) == 0.0
