# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Which contacts a surface does not explain, and whether they are few."""

import numpy as np
import pytest

from core.reconstruction.explained import are_few, too_far


def test_contacts_are_too_far_beyond_five_deviations_of_each():
    assert too_far(np.array([0.4, -0.6, -0.6]), np.array([0.1, 0.1, 0.2])).tolist() == [False, True, False]
    assert too_far(np.array([4.9, -5.1]), 1.0).tolist() == [False, True]


@pytest.mark.parametrize(
    ("places", "few"), [((), True), ((3, 9), True), ((3, 4), False), ((3, 9, 50), False)]
)
def test_one_of_a_hundred_may_be_off_but_none_side_by_side(places, few):
    far = np.zeros(200, dtype=bool)
    far[list(places)] = True
    assert are_few(far, np.append(far[1:], False)) is few
