# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Roughness is what a sextic leaves of contacts and normals, as a share of L; noise does not count."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from core.bayes.roughness import EXPLAINED_TERMS, roughness

AZIMUTHS = np.pi * np.arange(3) / 3.0
ALONG = np.linspace(-1.0, 1.0, 25)
X, Y = (np.outer(turn(AZIMUTHS), ALONG).ravel() for turn in (np.cos, np.sin))
UNKNOWN = np.zeros((len(X), 3))


def contacts(height):
    return np.column_stack([X, Y, height])


def waves(size, seed=0):
    """Offsets of random sign at each contact, which no polynomial follows."""
    return size * np.random.default_rng(seed).choice([-1.0, 1.0], len(X))


def test_a_cap_is_smooth():
    cap = contacts(np.sqrt(4.0 - X**2 - Y**2) - 2.0)
    normals = 0.5 * (cap - np.array([0.0, 0.0, -2.0]))
    for sign in (0.0, 1.0, -1.0):
        assert roughness(cap, sign * normals, 0.0) < 1e-3


@pytest.mark.parametrize("size", [0.02, 0.1])
def test_of_normals_it_is_a_share_of_the_angle_by_which_they_are_off(size):
    angles = waves(size)
    normals = np.column_stack([np.sin(angles), np.zeros(len(X)), np.cos(angles)])
    share = np.sqrt(len(X) / (len(X) - EXPLAINED_TERMS))
    assert roughness(contacts(0.0 * X), normals, 0.0) == pytest.approx(share * 0.05 * size, rel=0.02)


@pytest.mark.parametrize("size", [0.003, 0.01, 0.03])
def test_of_waves_it_is_their_size(size):
    """The tolerance allows for the chance in 75 offsets."""
    assert roughness(contacts(0.1 * X**2 + waves(size)), UNKNOWN, 0.0) == pytest.approx(size, rel=0.1)


def test_it_is_alike_wherever_and_in_whatever_unit_they_are_felt():
    rough = contacts(0.2 * X * Y + waves(0.01))
    turn = Rotation.from_euler("xyz", (0.4, -1.1, 2.0)).as_matrix()
    normals = np.tile([0.1, 0.2, np.sqrt(0.95)], (len(X), 1))
    turned = roughness(1e4 * rough @ turn.T, normals @ turn.T, 0.0)
    assert turned == pytest.approx(roughness(rough, normals, 0.0), rel=1e-9)


def test_noise_that_is_known_is_no_roughness():
    noisy = contacts(0.1 * X**2 + waves(0.01))
    assert roughness(noisy, UNKNOWN, 0.01) == 0.0
    assert roughness(noisy, UNKNOWN, 0.001) == pytest.approx(roughness(noisy, UNKNOWN, 0.0), rel=0.02)


def test_contacts_at_nothing_but_the_point_are_not_rough():
    assert roughness(np.zeros((3, 3)), np.zeros((3, 3)), 0.0) == 0.0
