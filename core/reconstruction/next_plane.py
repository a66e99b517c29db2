# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Where to touch next: the sampling plane whose contour would tell most."""

import math

import numpy as np
from numpy.typing import ArrayLike

from ..arguments import Array, unit_vector
from ..contours.contour import SamplingPlane
from .result import Reconstruction

AZIMUTHS = np.radians(np.arange(0.0, 180.0, 3.0))  # 1.5 degrees off, a plane ends a 38th of the radius aside.
COARSE_STRIDE = 4  # So many azimuths lie between those that are tried first.
MOST_CONTACTS = 24  # contacts of a contour: more tell of its seven terms no more than as many of less noise
FEW_CONTACTS = 12  # of those that are tried first


def suggest_plane(
    r: Reconstruction, outward: ArrayLike | None = None, tangent: ArrayLike | None = None
) -> tuple[SamplingPlane, float]:
    """The plane that would lower the mean variance of the height over the domain most.

    outward, tangent : what the contours were tracked with, and the plane is measured by, see `track`;
        d3 and d1 of the frame without

    Also the mean height_std that is expected after it, in the caller's unit.

    The contour is taken to reach as far and to have as many contacts as those before, with their
    noise. What it will show follows from where it runs, not from the heights found there.
    """
    points, weights = r.domain.nodes
    over = points / r.radius
    first = int(np.argmax(_lost(r, over, AZIMUTHS[::COARSE_STRIDE], FEW_CONTACTS) @ weights))
    # The best of them, and those beside it.
    near = (COARSE_STRIDE * first + np.arange(1 - COARSE_STRIDE, COARSE_STRIDE)) % len(AZIMUTHS)
    lost = _lost(r, over, AZIMUTHS[near], MOST_CONTACTS)
    best = int(np.argmax(lost @ weights))
    variance = np.maximum((r.node_stds / r.radius) ** 2 - lost[best], 0.0)
    plane = SamplingPlane(float(AZIMUTHS[near[best]]))
    if outward is not None:
        d1, _, n = r.frame.axes.T
        plane = SamplingPlane(azimuth_of(plane.axes(n, d1)[:, 0], outward, tangent))
    return plane, r.radius * float(weights @ np.sqrt(variance))


def _lost(r: Reconstruction, over: Array, azimuths: Array, most: int) -> Array:
    """What contours at azimuths (k,) of at most so many contacts take off the variances at points (n, 2).

    (k, n), in unit radius.
    A contour's heights have the covariance `seen`, and `shared` with those at the points, off whose variance
    it takes the diagonal of shared' seen^-1 shared.
    """
    wanted = max(3, round(2 * len(r.contacts) / len(r.domain.ends)))
    count, surface = min(wanted, most), r.uncertainty
    directions = np.column_stack([np.cos(azimuths), np.sin(azimuths)])
    contours = np.linspace(-1.0, 1.0, count)[:, None] * directions[:, None]
    shared, seen = surface.height_covariances(contours, over)
    seen += surface.noise**2 * count / wanted * np.eye(count)
    lost: Array = np.einsum("kin,kin->kn", shared, np.linalg.solve(seen, shared))
    return r.geometry.widening(*(r.radius * over).T) ** 2 * lost


def azimuth_of(direction: ArrayLike, normal: ArrayLike, tangent: ArrayLike | None = None) -> float:
    """The azimuth, from 0 up to pi, of the sampling plane that holds `direction`; see SamplingPlane.axes."""
    e1, _, across = SamplingPlane(0.0).axes(normal, tangent).T  # across is e1 x n, -e2
    d = unit_vector("direction", direction)
    return math.atan2(-(d @ across), d @ e1) % math.pi
