# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Measured normals: derivative observations of the surface, and whether they contradict the contacts.

The measured unit normal m is off the surface's normal (-z_x, -z_y, 1) by no more than its error. Let a and b
be unit vectors across m and each other: a . (-z_x, -z_y, 1) and b . (-z_x, -z_y, 1) are 0, except for an
error of |(z_x, z_y, 1)| times the deviation of m. Both are linear in the coefficients.

Contacts without normals show the surface's slopes and second derivatives at the point, and so do normals. The
difference is judged by the deviations of both. The normals of a texture scatter about the patch by more than
their deviation, which is no contradiction; so their scatter counts as deviation too. Along the curves,
though, contacts show a texture as normals do: normals that scatter widely along them are wrong.
"""

import math
from collections.abc import Sequence

import numpy as np

from ..arguments import Array
from ..contours.contour import Contour
from ..contours.curves import distances_from_point, has_measured_normals, stacked
from ..contours.local_geometry import Frame
from ..lapack import cholesky, solved
from ..patch.monge import PARTIALS, TERMS, derived_monomials
from .posterior import SurfacePosterior
from .prior import FREE

# Slopes have at least this error, an angle, because no surface is a polynomial (benchmarks.stability).
SLOPE_MISFIT = 1e-2


def slope_equations(
    normals: Array, contacts: Array, weights: Array, partials: Array | None = None
) -> tuple[Array, Array]:
    """slopes (b, 2n, k) @ coefficients ~ steepness (b, 2n), in units of their deviation.

    normals : (b, n, 3), over their standard deviations; 0 where there are none
    contacts : (b, n, 3), in unit radius and the same frame
    weights : (b, n), those of the contacts: the normal of an outlying contact weighs as little as it does
    partials : (2, b, n, k), derivatives of k features by x and y at the contacts; of the terms by default

    A patch has one height at each place, so no normal of it points down: one that does was measured inward.
    """
    m = np.where(normals[..., 2:] < 0.0, -normals, normals)
    certainty = np.sqrt(np.einsum("bni,bni->bn", m, m))
    mx, my, mz = np.moveaxis(m / np.maximum(certainty, 1e-300)[..., None], -1, 0)
    # mz is 1 / |(z_x, z_y, 1)|.
    scale = np.sqrt(weights) * mz * np.minimum(certainty, 1.0 / SLOPE_MISFIT)
    dx, dy = derived_monomials(contacts, TERMS, PARTIALS[1:3]) if partials is None else partials
    # a and b are e_x and e_y turned by the least turn that takes e_z to m.
    axx, axy, ayy = 1.0 - mx**2 / (1.0 + mz), -mx * my / (1.0 + mz), 1.0 - my**2 / (1.0 + mz)
    rows = (axx[..., None] * dx + axy[..., None] * dy, axy[..., None] * dx + ayy[..., None] * dy)
    slopes = np.concatenate([scale[..., None] * row for row in rows], axis=1)
    return slopes, np.concatenate([-scale * mx, -scale * my], axis=1)


def measured_normals(contours: Sequence[Contour], frame: Frame, radius: float) -> tuple[Array, Array]:
    """Contacts with measured normals, except the reference point, in the frame and in unit radius, (n, 3).

    Also these normals, divided by their standard deviations, (n, 3).
    """
    if not has_measured_normals(contours):
        return np.empty((0, 3)), np.empty((0, 3))
    points, present, normals = stacked(frame.origin[None], [contours])
    assert normals is not None
    chosen = present & distances_from_point(points)[1] & normals.any(axis=-1)
    return points[chosen] @ frame.axes / radius, normals[chosen] @ frame.axes


def contradiction(contacts: Array, normals: Array, posterior: SurfacePosterior) -> tuple[float, float]:
    """The number of deviations, and the angle in the root mean square, by which normals contradict contacts.

    contacts, normals : (n, 3), of `measured_normals`
    posterior : of the contacts without their normals, in the same frame and unit; without a process

    The angle is in radians. Both are 0 if there are too few normals to judge.
    """
    if 2 * len(normals) <= FREE:
        return 0.0, 0.0
    weights = np.ones((1, len(normals)))
    (slopes,), (steepness,) = slope_equations(normals[None], contacts[None], weights)
    covariance = slopes @ posterior.covariance @ slopes.T + np.eye(len(slopes))
    whitened = solved(
        cholesky(covariance),
        np.column_stack([steepness - slopes @ posterior.mean, slopes[:, :FREE]]),
    )
    off, free = whitened[:, 0], whitened[:, 1:]
    # The free terms of the normals less those of the contacts.
    apart = np.linalg.lstsq(free, off, rcond=None)[0]
    explained = free @ apart
    spread = max(1.0, float(np.sum((off - explained) ** 2)) / (len(off) - FREE))
    certainty = np.minimum(np.linalg.norm(normals, axis=1), 1.0 / SLOPE_MISFIT)
    angles = slopes[:, :FREE] @ apart / np.tile(certainty, 2)
    return math.sqrt(float(explained @ explained) / spread), math.sqrt(2.0 * float(np.mean(angles**2)))


def scatter(contacts: Array, normals: Array, slopes: Array) -> tuple[float, float]:
    """The number of deviations, and the angle, by which normals are off a surface along the curves.

    contacts, normals : (n, 3), of `measured_normals`
    slopes : (n, 2), of the surface at the contacts

    The curves run from the point outward. Both are root mean squares, and the angle is in radians.
    """
    # The azimuth of a contact above or below the point is 0, which serves as well as any.
    azimuth = np.arctan2(contacts[:, 1], contacts[:, 0])
    ahead = np.column_stack([np.cos(azimuth), np.sin(azimuth)])
    tangents = np.column_stack([ahead, np.einsum("ni,ni->n", slopes, ahead)])
    tangents /= np.linalg.norm(tangents, axis=1, keepdims=True)
    certainty = np.linalg.norm(normals, axis=1)
    angles = np.arcsin(np.clip(np.einsum("ni,ni->n", normals, tangents) / certainty, -1.0, 1.0))
    deviations = angles * np.minimum(certainty, 1.0 / SLOPE_MISFIT)
    return math.sqrt(float(np.mean(deviations**2))), math.sqrt(float(np.mean(angles**2)))
