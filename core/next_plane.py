# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Where to touch next: the sampling plane whose contour would tell most."""

import math

import numpy as np
from numpy.typing import ArrayLike

from .arguments import unit_vector
from .contour import SamplingPlane
from .monge import monomials
from .posterior import TERMS
from .result import Reconstruction

AZIMUTHS = np.radians(np.arange(0.0, 180.0, 3.0))
MOST = 50  # contacts of a contour: more tell of its seven terms no more than as many of less noise


def suggest_plane(r: Reconstruction) -> tuple[SamplingPlane, float]:
    """The plane that would lower the mean variance of the height over the domain most.

    Also the mean height_std that is expected after it, in the caller's unit. The plane holds the
    normal and is measured from d1 about n of `r.frame`: track it with normal=r.frame.axes[:, 2],
    tangent=r.frame.axes[:, 0].

    The contour is taken to reach as far and to have as many contacts as those before, with their
    noise. What it will show follows from where it runs, not from the heights found there.
    """
    (x, y), weights = r.domain.nodes[0].T, r.domain.nodes[1]
    over = monomials(x / r.radius, y / r.radius, TERMS)
    wanted = max(3, round(2 * len(r.contacts) / len(r.domain.ends)))
    count = min(wanted, MOST)
    along, noise_variance = np.linspace(-1.0, 1.0, count), r.posterior.noise**2 * count / wanted
    u, v = np.outer(np.cos(AZIMUTHS), along), np.outer(np.sin(AZIMUTHS), along)
    contours = monomials(u.ravel(), v.ravel(), TERMS).reshape(*u.shape, len(TERMS))
    # A contour's heights have the covariance `seen`, and `shared` with the coefficients; it takes
    # shared' seen^-1 shared off the coefficients' covariance.
    shared = contours @ r.posterior.covariance
    seen = shared @ np.swapaxes(contours, 1, 2) + noise_variance * np.eye(count)
    taken = np.swapaxes(shared, 1, 2) @ np.linalg.solve(seen, shared)
    best = int(np.argmax(np.einsum("kij,ij->k", taken, over.T @ (weights[:, None] * over))))
    lost = np.einsum("ni,ij,nj->n", over, taken[best], over)
    variance = np.maximum((r.height_std(x, y) / r.radius) ** 2 - lost, 0.0)
    return SamplingPlane(float(AZIMUTHS[best])), r.radius * float(weights @ np.sqrt(variance))


def azimuth_of(direction: ArrayLike, normal: ArrayLike, tangent: ArrayLike | None = None) -> float:
    """The azimuth, from 0 up to pi, of the sampling plane that holds `direction`; see SamplingPlane.axes."""
    e1, _, across = SamplingPlane(0.0).axes(normal, tangent).T  # across is e1 x n, -e2
    d = unit_vector("direction", direction)
    return math.atan2(-(d @ across), d @ e1) % math.pi
