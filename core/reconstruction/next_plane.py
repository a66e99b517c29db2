# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Where to touch next: the sampling plane whose contour would lower the variance most. Not in the paper."""

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..arguments import Array, unit_vector
from ..contours.contour import SamplingPlane, vector_of
from .result import Reconstruction

# Azimuths that are tried: a plane that is 1.5 degrees off ends a 38th of L aside.
TRIED = np.radians(np.arange(0.0, 180.0, 3.0))
# Every fifth of them is tried first, with contours of FEW_CONTACTS, and then those next to the best.
COARSE_STRIDE, FEW_CONTACTS = 5, 8
NEARBY = np.arange(-(COARSE_STRIDE // 2), COARSE_STRIDE // 2 + 1)
MOST_CONTACTS = 24  # More contacts show a contour's seven terms no better than this many with less noise.


def suggest_plane(
    r: Reconstruction, outward: ArrayLike | None = None, tangent: ArrayLike | None = None
) -> tuple[SamplingPlane, float]:
    """The sampling plane that would lower the mean variance of the height over the domain most.

    outward, tangent : as in `track`, from which the azimuth is measured; n and d1 of the frame by default,
        which `SamplingPlane.axes` has to be given then. The plane's `direction` is its tangent in the world

    Also returns the mean height_std that is expected after it, in the caller's unit.

    The contour is assumed to have the length, number of contacts and noise of those before. Its
    effect depends on where it runs, not on its heights.
    """
    points, weights = r.domain.nodes
    wanted = max(3, round(2 * len(r.contacts) / len(r.domain.ends)))
    covariances = r.posterior.covariances_with(points / r.radius)
    widening = r.widening(r.domain.node_places) ** 2

    def reduction(azimuths: NDArray[np.intp], most: int) -> Array:
        """By how much a contour at each of k azimuths would lower the height variance at n points, (k, n).

        It is in units of L^2. At most `most` contacts stand for those of a contour, with less noise then.
        """
        count = min(wanted, most)
        noise = float(r.posterior.noise) ** 2 * count / wanted
        return widening * _variance_reduction(covariances, TRIED[azimuths % len(TRIED)], count, noise)

    tried = np.arange(0, len(TRIED), COARSE_STRIDE)
    near = tried[[np.argmax(reduction(tried, FEW_CONTACTS) @ weights)]] + NEARBY
    best = near[[np.argmax(reduction(near, FEW_CONTACTS) @ weights)]] % len(TRIED)
    variance = np.maximum((r.node_stds / r.radius) ** 2 - reduction(best, MOST_CONTACTS)[0], 0.0)
    azimuth, (d1, _, n) = float(TRIED[best[0]]), r.frame.axes.T
    direction = SamplingPlane(azimuth).axes(n, d1)[:, 0]
    if outward is not None:
        azimuth = azimuth_of(direction, outward, tangent)
    expected = r.radius * float(weights @ np.sqrt(variance))
    return SamplingPlane(azimuth, direction=vector_of(direction)), expected


def _variance_reduction(
    covariances: Callable[[Array], tuple[Array, Array]], azimuths: Array, count: int, noise: float
) -> Array:
    """By how much a contour at each azimuth (k,) would lower the height variances at n points, (k, n).

    count, noise : the number of contacts of each contour, and their noise^2

    Contacts whose heights have the covariance C, and the covariances S with the heights at the points, lower
    the variances at these by the diagonal of S' C^-1 S (Rasmussen and Williams 2006, equation 2.26).
    """
    directions = np.column_stack([np.cos(azimuths), np.sin(azimuths)])
    shared, covariance = covariances(np.linspace(-1.0, 1.0, count)[:, None] * directions[:, None])
    covariance += noise * np.eye(count)
    return np.einsum("kin,kin->kn", shared, np.linalg.solve(covariance, shared))


def azimuth_of(direction: ArrayLike, normal: ArrayLike, tangent: ArrayLike | None = None) -> float:
    """The azimuth, from 0 up to pi, of the sampling plane that holds `direction`; see SamplingPlane.axes."""
    e1, _, across = SamplingPlane(0.0).axes(normal, tangent).T  # across is e1 x n, -e2
    d = unit_vector("direction", direction)
    return math.atan2(-(d @ across), d @ e1) % math.pi
