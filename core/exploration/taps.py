# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Taps of the finger between its curves: whether the surface is where a fit has it."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..arguments import Array
from ..contours.contour import vector_of
from ..contours.finger import Surface, contact_of
from ..patch.domain import GAUSS_ALONG, SAME_END, Domain
from ..reconstruction.result import Reconstruction
from ..reconstruction.status import CONTRADICTING, Taps
from .mesh_error import mean_error, offs_at, side_of

# benchmarks.real --only taps chooses these. Between the ends of two curves there are four taps at NEAR_RIM of
# the way to the boundary, and two at WITHIN.
NEAR_RIM, WITHIN = 0.98, 0.6
LARGE_GAP = 0.02  # Curves become shorter where more of the area than this share has no surface.
TOO_FAR_OFF = 10.0  # A tap that is off by more deviations contradicts the fit by itself.


class Tapped(NamedTuple):
    """What taps between the curves have found, and the places (k, 2) that curves should not reach."""

    taps: Taps
    contradicting: Array


def places(domain: Domain) -> Array:
    """Local places (n, 2) to tap: near the rim and farther inside, toward the Gauss nodes of the domain."""
    rim = domain.nodes[0][-GAUSS_ALONG * len(domain.ends) :] / domain.node_places[-1]
    inner = rim.reshape(-1, GAUSS_ALONG, 2)[:, 1:-1].reshape(-1, 2)
    return np.concatenate([NEAR_RIM * rim, WITHIN * inner])


def tapped(surface: Surface, r: Reconstruction) -> Tapped:
    """Taps along the fit's normal, from as high above it as its deviation and the noise explain.

    The taps have no noise: it would not change the verdict.
    """
    where = places(r.domain)
    noise = max((contour.noise or 0.0 for contour in r.contours), default=0.0)
    stds = np.hypot(r.height_std(*where.T), noise)
    feet, up = r.frame.to_world(np.column_stack([where, r.height(*where.T)])), r.frame.axes[:, 2]
    starts, down = feet + TOO_FAR_OFF * stds[:, None] * up, vector_of(-up)
    rays = zip(starts.tolist(), (2.0 * TOO_FAR_OFF * stds).tolist(), strict=True)
    hits = [surface.ray_cast((x, y, z), down, length) for (x, y, z), length in rays]
    met = np.array([hit is not None for hit in hits])
    offs = np.empty(len(where))
    felt = np.array([contact_of(hit, 1.0)[0] for hit in hits if hit is not None]).reshape(-1, 3)
    offs[met] = np.abs((felt - feet[met]) @ up)
    side = side_of(r, surface)
    offs[~met] = offs_at(r, surface, where[~met], side)
    missed, offs = np.isnan(offs), np.nan_to_num(offs)
    nodes = offs_at(r, surface, r.domain.nodes[0], side)
    within, missing = mean_error(r, nodes)
    contradicts = (
        (offs > TOO_FAR_OFF * stds).any()
        or offs.mean() > CONTRADICTING * stds.mean()
        or (within or 0.0) > CONTRADICTING * r.mean_height_std
    )
    off = max(float(offs.max()), within or 0.0) / r.radius if contradicts else 0.0
    gaps = r.domain.nodes[0][np.isnan(nodes) & (missing > LARGE_GAP)]
    contradicting = where[(offs > CONTRADICTING * stds) & contradicts]
    return Tapped(
        Taps(len(offs), int(missed.sum()), off, missing, within), np.concatenate([contradicting, gaps])
    )


def adjacent_half_curves(r: Reconstruction, where: Array) -> NDArray[np.intp]:
    """For each local place (k, 2) the longer of the two half curves next to it in azimuth.

    They are indices into raveled Counts (c, 2), and each is there once.
    """
    x, y, _ = r.frame.to_local(np.vstack([contour.points[[0, -1]] for contour in r.contours])).T
    turns = np.arctan2(where[:, 1], where[:, 0])[:, None] - np.arctan2(y, x)
    turns[:, np.hypot(x, y) <= SAME_END * r.radius] = np.nan  # The curve goes to one side only.
    both = np.array([np.nanargmin(sign * turns % math.tau, axis=1) for sign in (1.0, -1.0)])
    return np.unique(np.choose(np.argmax(np.hypot(x, y)[both], axis=0), both))
