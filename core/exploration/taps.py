# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Taps of the finger between its curves: whether the surface is where a fit has it."""

import numpy as np

from ..arguments import Array
from ..contours.finger import Surface
from ..patch.domain import GAUSS_ALONG, Domain
from ..reconstruction.explained import too_far
from ..reconstruction.result import Reconstruction
from ..reconstruction.status import CONTRADICTING, Taps
from .mesh_error import heights_at, mean_error

# Four taps between two ends of curves are at this share of the way to the boundary: without them two of 540
# touches of scans miss a pocket (benchmarks.real --only automatic).
NEAR_RIM = 0.98


def places(domain: Domain) -> Array:
    """Local places (n, 2) to tap: the Gauss points of the domain, and then those near its boundary."""
    nodes = domain.nodes[0]
    outermost = nodes[-GAUSS_ALONG * len(domain.ends) :]
    return np.concatenate([nodes, NEAR_RIM / domain.node_places[-1] * outermost])


def tapped(surface: Surface, r: Reconstruction, felt: Array) -> tuple[Taps, Array]:
    """Taps along the fit's normal between the curves.

    felt : (n, 3), contacts of taps of longer curves, which contradict this fit, too, if they are off it

    Also returns the contacts of these taps, (m, 3). They have no noise: it would not change the verdict.
    """
    where, weighted = places(r.domain), len(r.domain.nodes[1])
    heights, (x, y) = heights_at(r, surface, where), where.T
    met = ~np.isnan(heights)
    contacts = r.frame.to_world(np.column_stack([x, y, r.height(x, y) + heights])[met])
    local = r.frame.to_local(np.concatenate([contacts, felt]))
    x, y, z = local[r.domain.contains(*local[:, :2].T)].T
    off = np.abs(z - r.height(x, y))
    noise = max((contour.noise or 0.0 for contour in r.contours), default=0.0)
    error = mean_error(r, heights[:weighted])
    contradicts = too_far(off, np.hypot(r.height_std(x, y), noise)).any() or (
        (error.height or 0.0) > CONTRADICTING * r.mean_height_std
    )
    most = float(off.max(initial=0.0)) / r.radius if contradicts else 0.0
    return Taps(len(heights), int((~met).sum()), most, error.missing, error.height), contacts
