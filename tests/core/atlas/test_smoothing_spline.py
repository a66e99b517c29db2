# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Smoothing splines: what they reproduce, what outlying contacts and wrong normals do, their deviations."""

import numpy as np
import pytest
from scipy.linalg import eigh

from core.atlas import smoothing_spline as splines
from core.atlas.cubic_spline import SIDE, bases
from core.atlas.smoothing_spline import smoothing_spline

HALF = 1.3


def wavy(x, y):
    """Heights and slopes of a surface that is no quadric."""
    z = 0.2 * x**2 - 0.1 * x * y + 0.1 * np.sin(2.0 * x + y)
    slope = 0.2 * np.cos(2.0 * x + y)
    return z, 0.4 * x - 0.1 * y + slope, -0.1 * x + 0.5 * slope


def touched(height, rng, count=300, noise=0.0, turned=0.0):
    """Contacts and normals of a height field in the unit disk."""
    angle, out = rng.uniform(0.0, 2.0 * np.pi, count), np.sqrt(rng.uniform(0.0, 1.0, count))
    x, y = out * np.cos(angle), out * np.sin(angle)
    z, zx, zy = height(x, y)
    normals = np.column_stack([-zx, -zy, np.ones(count)])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    normals += rng.normal(0.0, 1.0, (count, 3)) * turned
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return np.column_stack([x, y, z + rng.normal(0.0, 1.0, count) * noise]), normals


def fitted(contacts, normals, noise=5e-4):
    return smoothing_spline(contacts, normals, np.ones(len(contacts)), HALF, noise)


def evaluated(coefficients, x, y):
    """The heights of a spline and its slopes along x and y, (3, n)."""
    knots, basis = bases(x, y, HALF)
    return (basis * coefficients.ravel()[knots]).sum(axis=2)


def misses(spline, height, rng):
    """How far the spline is off at random points, and the deviations at the knots nearest to these."""
    x, y, _ = touched(height, rng, 200)[0].T
    off = evaluated(spline.coefficients, x, y)[0] - height(x, y)[0]
    knots = np.rint((np.array([x, y]) / HALF + 1.0) * 0.5 * (len(spline.stds) - 1)).astype(int)
    return off, spline.stds[knots[0], knots[1]]


def test_a_quadric_is_reproduced():
    def height(x, y):
        return 0.3 * x**2 - 0.2 * x * y + 0.1 * y + 0.05, 0.6 * x - 0.2 * y, 0.1 - 0.2 * x

    rng = np.random.default_rng(0)
    off, _ = misses(fitted(*touched(height, rng)), height, rng)
    assert np.abs(off).max() < 1e-5


def test_slopes_are_those_of_the_heights():
    rng = np.random.default_rng(1)
    coefficients, step = rng.normal(size=SIDE**2), 1e-5
    x, y = rng.uniform(-1.0, 1.0, (2, 50))
    _, along_x, along_y = evaluated(coefficients, x, y)

    def height(x, y):
        return evaluated(coefficients, x, y)[0]

    expected = (height(x + step, y) - height(x - step, y)) / (2.0 * step)
    assert along_x == pytest.approx(expected, abs=1e-6)
    expected = (height(x, y + step) - height(x, y - step)) / (2.0 * step)
    assert along_y == pytest.approx(expected, abs=1e-6)


def test_a_tenth_of_outlying_contacts_is_ignored():
    rng = np.random.default_rng(2)
    contacts, normals = touched(wavy, rng, noise=1e-3)
    clean, _ = misses(fitted(contacts, normals, 1e-3), wavy, np.random.default_rng(3))
    contacts[::10, 2] += 0.2
    off, _ = misses(fitted(contacts, normals, 1e-3), wavy, np.random.default_rng(3))
    assert np.abs(off).mean() < 1.5 * np.abs(clean).mean()


def test_normals_help_as_much_as_they_are_true():
    def error(turned):
        found = []
        for seed in range(4, 10):
            rng = np.random.default_rng(seed)
            spline = fitted(*touched(wavy, rng, 100, 3e-3, turned), 3e-3)
            found.append(np.abs(misses(spline, wavy, rng)[0]).mean())
        return np.mean(found)

    exact, worse, none = error(0.0), error(0.05), error(3.0)
    assert exact < 0.6 * none
    assert exact < worse < none


def dense_neg2_log_evidence(contacts, roughness, noise):
    """-2 log marginal likelihood of heights, less a constant, by dense matrices; quadrics are nearly free.

    Sums over all knots go without numpy's BLAS: OpenBLAS 0.3.34 overflows its stack there where a kernel
    without AVX-512 is selected on a processor of AMD that has it (OpenMathLib/OpenBLAS#6021).
    """
    knots, basis = bases(contacts[:, 0], contacts[:, 1], HALF)
    rows = np.zeros((len(contacts), SIDE**2))
    np.add.at(rows, (np.arange(len(contacts))[:, None], knots), basis[0])
    band, pitch = splines.penalty().reshape(SIDE**2, -1), 2.0 * HALF / (SIDE - 1)
    penalty = np.zeros((SIDE**2, SIDE**2))
    for i, diagonal in enumerate(band.T):
        penalty += np.diag(diagonal[: SIDE**2 - i], -i)
    penalty += np.tril(penalty, -1).T
    values, vectors = eigh(penalty)
    free = splines.FREE
    scales = roughness * pitch ** (splines.ORDER - 1) / np.sqrt(values[free:])
    x, y = HALF * np.array(np.meshgrid(*2 * [np.linspace(-1.0, 1.0, SIDE)], indexing="ij")).reshape(2, -1)
    quadrics = 1e3 * np.array([np.ones(len(x)), x, y, x**2, x * y, y**2])
    modes = np.column_stack([scales * vectors[:, free:], quadrics.T])
    roots = np.einsum("ik,kj->ij", rows, modes)
    covariance = np.einsum("ik,jk->ij", roots, roots) + noise**2 * np.eye(len(contacts))
    return np.linalg.slogdet(covariance)[1] + contacts[:, 2] @ np.linalg.solve(covariance, contacts[:, 2])


def test_likelihoods_are_those_of_dense_matrices():
    rng = np.random.default_rng(5)
    contacts, _ = touched(lambda x, y: (0.02 * np.sin(5.0 * x) * y, 0.0 * x, 0.0 * x), rng, 60, 1e-3)
    knots, basis = bases(contacts[:, 0], contacts[:, 1], HALF)
    heights = splines._design(knots, basis[:1]), contacts[:, 2]
    data = splines._equations([heights, heights], [np.ones(60), np.zeros(60)])
    given = [(0.3, 1e-3), (1.0, 1e-3), (0.3, 2e-3), (3.0, 2e-3)]
    ours = [
        splines._solved(data, splines._Hyperparameters(*sizes, 0.1), HALF).neg2_log_evidence
        for sizes in given
    ]
    dense = [dense_neg2_log_evidence(contacts, *sizes) for sizes in given]
    assert np.subtract(ours, ours[0]) == pytest.approx(np.subtract(dense, dense[0]), abs=0.05)


@pytest.mark.parametrize("given", [3e-3, 1e-3])
def test_deviations_are_true_even_if_noise_is_said_to_be_less(given):
    scores = []
    for seed in range(8):
        rng = np.random.default_rng(seed)
        spline = fitted(*touched(wavy, rng, 150, 3e-3, 0.05), given)
        off, stds = misses(spline, wavy, rng)
        scores.append(np.mean(np.abs(off) <= 1.645 * stds))
    assert 0.8 <= np.mean(scores) <= 0.99


def test_without_contacts_the_spline_is_flat_and_uncertain():
    """As of a narrow steep patch, on which no contact has its foot."""
    spline = fitted(np.empty((0, 3)), np.empty((0, 3)))
    assert np.abs(spline.coefficients).max() == 0.0
    assert np.isfinite(spline.stds).all() and spline.stds.min() > 0.1
