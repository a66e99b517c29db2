# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Whether measured normals contradict the contacts that they were measured at.

Beside the paper. Contacts alone show the surface's slopes and second derivatives at the point, and so do
normals. How far apart the two are is judged by the deviations of both. The normals of a texture scatter about
the patch by more than their deviation, which is no contradiction; so their scatter counts as deviation too.
Along the curves, though, contacts show a texture as normals do: normals that scatter widely there are wrong.
"""

import math
from collections.abc import Sequence

import numpy as np

from ..arguments import Array
from ..contours.contour import Contour
from ..contours.curves import besides_point, stacked
from ..contours.local_geometry import Frame
from .measured_slopes import SLOPE_MISFIT, slope_equations
from .posterior import FREE, Posterior


def measured_normals(contours: Sequence[Contour], frame: Frame, radius: float) -> tuple[Array, Array]:
    """Contacts with measured normals, except the reference point, in the frame and in unit radius, (n, 3).

    Also these normals, divided by their standard deviations, (n, 3).
    """
    points, present, normals = stacked(frame.origin[None], [contours])
    if normals is None:
        return np.empty((0, 3)), np.empty((0, 3))
    chosen = present & besides_point(points)[1] & normals.any(axis=-1)
    return points[chosen] @ frame.axes / radius, normals[chosen] @ frame.axes


def contradiction(contacts: Array, normals: Array, posterior: Posterior) -> tuple[float, float]:
    """The number of deviations, and the angle in the root mean square, by which normals contradict contacts.

    contacts, normals : (n, 3), of `measured_normals`
    posterior : what contacts alone tell, in the same frame and unit

    The angle is in radians. Both are 0 if there are too few normals to tell.
    """
    if 2 * len(normals) <= FREE:
        return 0.0, 0.0
    weights = np.ones((1, len(normals)))
    slopes, steepness = (part[0] for part in slope_equations(normals[None], contacts[None], weights))
    covariance = slopes @ posterior.covariance @ slopes.T + np.eye(len(slopes))
    whitened = np.linalg.solve(
        np.linalg.cholesky(covariance),
        np.column_stack([steepness - slopes @ posterior.mean, slopes[:, :FREE]]),
    )
    off, free = whitened[:, 0], whitened[:, 1:]
    # The free terms of the normals less those of the contacts.
    apart = np.linalg.lstsq(free, off, rcond=None)[0]
    told = free @ apart
    spread = max(1.0, float(np.sum((off - told) ** 2)) / (len(off) - FREE))
    certainty = np.minimum(np.linalg.norm(normals, axis=1), 1.0 / SLOPE_MISFIT)
    angles = slopes[:, :FREE] @ apart / np.tile(certainty, 2)
    return math.sqrt(float(told @ told) / spread), math.sqrt(2.0 * float(np.mean(angles**2)))


def scatter(contacts: Array, normals: Array, slopes: Array) -> tuple[float, float]:
    """The number of deviations, and the angle, by which normals are off a surface along the curves.

    contacts, normals : (n, 3), of `measured_normals`
    slopes : (n, 2), of the surface at the contacts

    The curves run from the point outward. Both are root mean squares, and the angle is in radians.
    """
    ahead = contacts[:, :2] / np.maximum(np.linalg.norm(contacts[:, :2], axis=1, keepdims=True), 1e-300)
    tangents = np.column_stack([ahead, np.einsum("ni,ni->n", slopes, ahead)])
    tangents /= np.linalg.norm(tangents, axis=1, keepdims=True)
    certainty = np.linalg.norm(normals, axis=1)
    angles = np.arcsin(np.clip(np.einsum("ni,ni->n", normals, tangents) / certainty, -1.0, 1.0))
    deviations = angles * np.minimum(certainty, 1.0 / SLOPE_MISFIT)
    return math.sqrt(float(np.mean(deviations**2))), math.sqrt(float(np.mean(angles**2)))
