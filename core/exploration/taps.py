# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Taps of the finger all over a patch: how far the surface is from it, and the patch's verdict from that."""

import math

import numpy as np

from ..arguments import Array
from ..contours.contour import Vector, along, dot, scaled, vector_of
from ..contours.finger import Surface, contact_of
from ..patch.domain import GAUSS_ALONG, Domain
from ..reconstruction.result import Reconstruction
from ..reconstruction.status import CONTRADICTING, DOUBTFUL_FIT, Taps

# benchmarks.refusals of e20b52a counted the patches that are off, but ok.
HAIR = 1e-4  # A ray continues this share of its reach behind each layer of the mesh.
# Four taps between two ends of curves are at this share of the way to the boundary: without them two of 540
# touches of scans miss a pocket (benchmarks.real --only automatic).
NEAR_RIM = 0.98
# A single tap that is off by more deviations contradicts the fit. With 5, which contacts have, patches of
# spheres of facets are in doubt, and seven more of 540 touches of scans.
TOO_FAR_OFF = 10.0


def places(domain: Domain) -> Array:
    """Local places (n, 2) to tap: the Gauss points of the domain, and then those near its boundary."""
    nodes = domain.nodes[0]
    outermost = nodes[-GAUSS_ALONG * len(domain.ends) :]
    return np.concatenate([nodes, NEAR_RIM / domain.node_places[-1] * outermost])


def tapped(r: Reconstruction, surface: Surface) -> Taps:
    """Taps along the fit's normal all over the patch; `Reconstruction.judged_with` makes the verdict of them.

    They have no noise: it would not change the verdict.
    """
    at, (_, weights) = places(r.domain), r.domain.nodes
    starts = r.frame.to_world(np.column_stack([at, r.height(*at.T)])).tolist()
    up, side = vector_of(r.frame.axes[:, 2]), _side_of(r, surface)
    layers = [layer_height(surface, vector_of(start), up, r.radius, side) for start in starts]
    heights = np.array([math.nan if height is None else height for height in layers])
    off, met = np.abs(heights), ~np.isnan(heights)
    felt = met[: len(weights)]
    height = float(np.average(off[: len(weights)][felt], weights=weights[felt])) if felt.any() else None
    noise = max((contour.noise or 0.0 for contour in r.contours), default=0.0)
    stds = np.hypot(r.height_std(*at[met].T), noise)
    contradicts = (off[met] > TOO_FAR_OFF * stds).any() or (height or 0.0) > CONTRADICTING * r.mean_height_std
    most = float(off[met].max(initial=0.0)) / r.radius if contradicts else 0.0
    return Taps(len(heights), int((~met).sum()), most, float(weights[~felt].sum()), height)


def _side_of(r: Reconstruction, surface: Surface) -> float:
    """1 if the outside of the surface is up at the point, or -1 if it is down: a sheet has either side."""
    # Above and below the point, the surface is as near as contacts are to a patch that is not in doubt.
    up, reach = vector_of(r.frame.axes[:, 2]), DOUBTFUL_FIT * r.radius
    start = along(vector_of(r.frame.origin), up, reach)
    hit = surface.ray_cast(start, scaled(up, -1.0), 2.0 * reach)
    return 1.0 if hit is None else math.copysign(1.0, dot(contact_of(hit, 1.0)[1], up))


def layer_height(
    surface: Surface, start: Vector, up: Vector, reach: float, side: float = 1.0
) -> float | None:
    """The height along `up`, or below 0, of the nearest layer with its outside up; None beyond `reach`.

    Layers that are seen from inside are another wall of the object, or its other side. With the `side` -1,
    layers with their outside down count instead. All rays come from above, where normals that face the ray
    are outward ones, except on the undersides of walls, which count as layers then.
    """
    down, hair, nearest = scaled(up, -1.0), HAIR * reach, None
    height, bottom = reach, -reach
    while height > bottom:
        hit = surface.ray_cast(along(start, up, height), down, height - bottom)
        if hit is None:
            break
        point, normal = contact_of(hit, side)
        height = dot(along(point, start, -1.0), up)
        if dot(normal, up) > 0.0:
            nearest, bottom = height, -abs(height)
        height -= hair
    return nearest
