# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Taps of the finger beside its curves: whether the surface is where a fit has it, at places between them."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..arguments import Array
from ..contours.contour import Vector, dot, vector_of
from ..contours.finger import Surface, section
from ..patch.domain import GAUSS_ALONG, SAME_END, Domain
from ..reconstruction.result import Reconstruction
from ..reconstruction.status import CONTRADICTING, Taps

# benchmarks.real says what they notice.
NEAR_RIM, WITHIN = 0.98, 0.6  # of the way to the boundary: four taps between the ends of two curves, and two
TOO_FAR_OFF = 10.0  # deviations that no tap may be off
BESIDE = 0.01  # of the radius: where the side is felt, at the point


class Tapped(NamedTuple):
    """What taps between the curves have found, and where those are that contradict the fit, (k, 2)."""

    taps: Taps
    contradicting: Array


def places(domain: Domain) -> Array:
    """Where to tap, (n, 2): near the rim and farther within, at the Gauss nodes of each piece of it."""
    rim = domain.nodes[0][-GAUSS_ALONG * len(domain.ends) :] / domain.node_places[-1]
    inner = rim.reshape(-1, GAUSS_ALONG, 2)[:, 1:-1].reshape(-1, 2)
    return np.concatenate([NEAR_RIM * rim, WITHIN * inner])


def tapped(surface: Surface, r: Reconstruction) -> Tapped:
    """Taps along the fit's normal, from as high above it as its deviation and the noise explain.

    No noise is added: it would not change what they say.
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
    offs[met] = np.abs(
        (np.array([hit[0] for hit in hits if hit is not None]).reshape(-1, 3) - feet[met]) @ up
    )
    offs[~met] = [_off(surface, r, vector_of(foot)) for foot in feet[~met]]
    missed, offs = np.isnan(offs), np.nan_to_num(offs)
    contradicts = (offs > TOO_FAR_OFF * stds).any() or offs.mean() > CONTRADICTING * stds.mean()
    taps = Taps(len(offs), int(missed.sum()), float(offs.max()) / r.radius if contradicts else 0.0)
    return Tapped(taps, where[(offs > CONTRADICTING * stds) & contradicts])


def _off(surface: Surface, r: Reconstruction, foot: Vector) -> float:
    """How far below or above a place a surface is whose outside is up; NaN where there is none within L."""
    d1, _, up = (vector_of(axis) for axis in r.frame.axes.T)
    at_point = section(surface, vector_of(r.frame.origin), d1, up, 1.0)
    point = at_point(complex(0.0, BESIDE * r.radius), -1j, 2.0 * BESIDE * r.radius)
    side = math.copysign(1.0, dot(point[3], up)) if point else 1.0
    cast = section(surface, foot, d1, up, side)
    for direction in (-1j, 1j):
        hit = cast(0j, direction, r.radius)
        if hit is not None and dot(hit[3], up) > 0.0:
            return abs(hit[0].imag)
    return math.nan


def beside(r: Reconstruction, where: Array) -> NDArray[np.intp]:
    """The longer of the two half curves beside each of the places (k, 2): indices into raveled Counts."""
    x, y, _ = r.frame.to_local(np.vstack([contour.points[[0, -1]] for contour in r.contours])).T
    turns = np.arctan2(where[:, 1], where[:, 0])[:, None] - np.arctan2(y, x)
    turns[:, np.hypot(x, y) <= SAME_END * r.radius] = np.nan  # a curve to one side only
    both = np.array([np.nanargmin(sign * turns % math.tau, axis=1) for sign in (1.0, -1.0)])
    return np.unique(np.choose(np.argmax(np.hypot(x, y)[both], axis=0), both))
