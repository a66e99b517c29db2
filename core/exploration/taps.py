# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Taps of the finger between its curves: whether the surface is where a fit has it."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..arguments import Array
from ..contours.contour import Vector, dot, vector_of
from ..contours.finger import Surface, contact_of, section
from ..patch.domain import GAUSS_ALONG, SAME_END, Domain
from ..reconstruction.result import Reconstruction
from ..reconstruction.status import CONTRADICTING, Taps
from .mesh_error import height_error

# benchmarks.real --only taps chooses these. Between the ends of two curves there are four taps at NEAR_RIM of
# the way to the boundary, and two at WITHIN.
NEAR_RIM, WITHIN = 0.98, 0.6
TOO_FAR_OFF = 10.0  # A tap that is off by more deviations contradicts the fit by itself.
SIDE_HEIGHT = 0.01  # The side of the surface is felt from so far above the point, as a share of the radius.


class Tapped(NamedTuple):
    """What taps between the curves have found, and the places (k, 2) of those that contradict the fit."""

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
    offs[~met] = [_height_offset(surface, r, vector_of(foot)) for foot in feet[~met]]
    missed, offs = np.isnan(offs), np.nan_to_num(offs)
    within = height_error(r, surface) or 0.0
    contradicts = (
        (offs > TOO_FAR_OFF * stds).any()
        or offs.mean() > CONTRADICTING * stds.mean()
        or within > CONTRADICTING * r.mean_height_std
    )
    off = max(float(offs.max()), within) / r.radius if contradicts else 0.0
    taps = Taps(len(offs), int(missed.sum()), off)
    return Tapped(taps, where[(offs > CONTRADICTING * stds) & contradicts])


def _height_offset(surface: Surface, r: Reconstruction, foot: Vector) -> float:
    """How far above or below a place the surface is whose outside is up; NaN if there is none within L."""
    d1, _, up = (vector_of(axis) for axis in r.frame.axes.T)
    at_point = section(surface, vector_of(r.frame.origin), d1, up, 1.0)
    point = at_point(complex(0.0, SIDE_HEIGHT * r.radius), -1j, 2.0 * SIDE_HEIGHT * r.radius)
    side = math.copysign(1.0, dot(point[3], up)) if point else 1.0
    cast = section(surface, foot, d1, up, side)
    for direction in (-1j, 1j):
        hit = cast(0j, direction, r.radius)
        if hit is not None and dot(hit[3], up) > 0.0:
            return abs(hit[0].imag)
    return math.nan


def adjacent_half_curves(r: Reconstruction, where: Array) -> NDArray[np.intp]:
    """For each local place (k, 2) the longer of the two half curves next to it in azimuth.

    They are indices into raveled Counts (c, 2), and each is there once.
    """
    x, y, _ = r.frame.to_local(np.vstack([contour.points[[0, -1]] for contour in r.contours])).T
    turns = np.arctan2(where[:, 1], where[:, 0])[:, None] - np.arctan2(y, x)
    turns[:, np.hypot(x, y) <= SAME_END * r.radius] = np.nan  # The curve goes to one side only.
    both = np.array([np.nanargmin(sign * turns % math.tau, axis=1) for sign in (1.0, -1.0)])
    return np.unique(np.choose(np.argmax(np.hypot(x, y)[both], axis=0), both))
