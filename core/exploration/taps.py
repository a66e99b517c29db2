# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Taps of the finger between its curves: whether the surface is where a fit has it."""

import numpy as np

from ..arguments import Array
from ..contours.contour import vector_of
from ..contours.finger import Surface, contact_of
from ..patch.domain import GAUSS_ALONG, Domain
from ..reconstruction.result import Reconstruction
from ..reconstruction.status import CONTRADICTING, Taps
from .mesh_error import heights_at, mean_error, side_of

# benchmarks.real --only taps of e20b52a chose these. Between the ends of two curves there are four taps at
# NEAR_RIM of the way to the boundary, and two at WITHIN.
NEAR_RIM, WITHIN = 0.98, 0.6
TOO_FAR_OFF = 10.0  # A tap that is off by more deviations contradicts the fit by itself.


def places(domain: Domain) -> Array:
    """Local places (n, 2) to tap: near the rim and farther inside, toward the Gauss nodes of the domain."""
    rim = domain.nodes[0][-GAUSS_ALONG * len(domain.ends) :] / domain.node_places[-1]
    inner = rim.reshape(-1, GAUSS_ALONG, 2)[:, 1:-1].reshape(-1, 2)
    return np.concatenate([NEAR_RIM * rim, WITHIN * inner])


def tapped(surface: Surface, r: Reconstruction, felt: Array) -> tuple[Taps, Array]:
    """Taps along the fit's normal, from as high above it as its deviation and the noise explain.

    felt : (n, 3), contacts of taps of longer curves, which contradict this fit, too, if they are off it

    Also returns the contacts of these taps, (m, 3). They have no noise: it would not change the verdict.
    """
    where = places(r.domain)
    noise = max((contour.noise or 0.0 for contour in r.contours), default=0.0)
    stds, up, side = np.hypot(r.height_std(*where.T), noise), r.frame.axes[:, 2], side_of(r, surface)
    feet, down = r.frame.to_world(np.column_stack([where, r.height(*where.T)])), vector_of(-up)
    starts = feet + TOO_FAR_OFF * stds[:, None] * up
    rays = zip(starts.tolist(), (2.0 * TOO_FAR_OFF * stds).tolist(), strict=True)
    hits = [surface.ray_cast((x, y, z), down, length) for (x, y, z), length in rays]
    met = np.array([hit is not None for hit in hits])
    heights = np.empty(len(where))
    contacts = np.array([contact_of(hit, 1.0)[0] for hit in hits if hit is not None]).reshape(-1, 3)
    heights[met] = (contacts - feet[met]) @ up
    heights[~met] = heights_at(r, surface, where[~met], side)
    missed, offs = np.isnan(heights), np.abs(np.nan_to_num(heights))
    nodes, at_nodes = r.domain.nodes[0], heights_at(r, surface, r.domain.nodes[0], side)
    within, missing = mean_error(r, at_nodes)
    local = r.frame.to_local(felt)
    x, y, z = local[r.domain.contains(*local[:, :2].T)].T
    before = np.abs(z - r.height(x, y))
    contradicts = (
        (offs > TOO_FAR_OFF * stds).any()
        or (before > TOO_FAR_OFF * np.hypot(r.height_std(x, y), noise)).any()
        or offs.mean() > CONTRADICTING * stds.mean()
        or (within or 0.0) > CONTRADICTING * r.mean_height_std
    )
    off = max(float(offs.max()), float(before.max(initial=0.0)), within or 0.0) / r.radius
    x, y = np.concatenate([where, nodes]).T
    above = np.concatenate([heights, at_nodes])
    known = ~np.isnan(above)
    contacts = r.frame.to_world(np.column_stack([x, y, r.height(x, y) + above])[known])
    return Taps(len(offs), int(missed.sum()), off if contradicts else 0.0, missing, within), contacts
