# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Rows of triangles."""

import numpy as np
import pytest

from core.triangles import middles_of_parts


@pytest.mark.parametrize("n", [1, 2, 3, 7])
def test_equal_parts_of_a_triangle_have_its_integrals(n):
    """A rule of their middles is exact for x, and has an error of 1/n^2 for x^2."""
    middles = middles_of_parts(n)
    assert middles.shape == (n**2, 3)
    assert (middles > 0.0).all()
    assert middles.sum(axis=1) == pytest.approx(1.0)
    assert middles.mean(axis=0) == pytest.approx([1 / 3] * 3)
    assert np.mean(middles**2, axis=0) == pytest.approx([1 / 6 - 1 / (18 * n**2)] * 3)
    apart = np.linalg.norm(middles[:, None] - middles, axis=-1)
    assert n == 1 or apart[apart > 0.0].min() > 0.4 / n
