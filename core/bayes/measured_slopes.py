# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Measured normals as equations for the coefficients of joint_fit.py.

The measured unit normal m is off the surface's normal (-z_x, -z_y, 1) by no more than its error. Let a and b
be unit vectors across m and each other: a . (-z_x, -z_y, 1) and b . (-z_x, -z_y, 1) are 0, except for an
error of |(z_x, z_y, 1)| times the deviation of m. Both are linear in the coefficients.
"""

import numpy as np

from ..arguments import Array
from ..patch.monge import TERMS, derived_monomials

# No slope is known better than this angle, because no surface is a polynomial (benchmarks.stability).
SLOPE_MISFIT = 1e-2


def slope_equations(normals: Array, contacts: Array, weights: Array) -> tuple[Array, Array]:
    """slopes (b, 2n, 27) @ coefficients ~ steepness (b, 2n), in units of their deviation.

    normals : (b, n, 3), over their standard deviations; 0 where there are none
    contacts : (b, n, 3), in unit radius and the same frame
    weights : (b, n), those of the contacts: the normal of an outlying contact weighs as little as it does

    A patch has one height at each place, so no normal of it points down: one that does was measured inward.
    """
    m = np.where(normals[..., 2:] < 0.0, -normals, normals)
    certainty = np.sqrt(np.einsum("bni,bni->bn", m, m))
    mx, my, mz = np.moveaxis(m / np.maximum(certainty, 1e-300)[..., None], -1, 0)
    # mz is 1 / |(z_x, z_y, 1)|.
    scale = np.sqrt(weights) * mz * np.minimum(certainty, 1.0 / SLOPE_MISFIT)
    x, y, _ = contacts.reshape(-1, 3).T
    dx, dy = derived_monomials(x, y, TERMS, [(1, 0), (0, 1)]).swapaxes(1, 2).reshape(2, *mx.shape, -1)
    # a and b are e_x and e_y turned by the least turn that takes e_z to m.
    axx, axy, ayy = 1.0 - mx**2 / (1.0 + mz), -mx * my / (1.0 + mz), 1.0 - my**2 / (1.0 + mz)
    rows = (axx[..., None] * dx + axy[..., None] * dy, axy[..., None] * dx + ayy[..., None] * dy)
    slopes = np.concatenate([scale[..., None] * row for row in rows], axis=1)
    return slopes, np.concatenate([-scale * mx, -scale * my], axis=1)
