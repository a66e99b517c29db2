# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""How far a surface is from a patch all over it, even without vertices, and the patch's verdict from that."""

import numpy as np

from ..contours.contour import Vector, along, dot, scaled, vector_of
from ..contours.finger import Surface, contact_of
from ..reconstruction.result import Reconstruction
from ..reconstruction.status import CONTRADICTING

# benchmarks.refusals counts the patches that are off, but ok.
MESH_LAYERS = 4  # A sample is compared with no more layers of the mesh above and below it,
HAIR = 1e-4  # and rays go on this share of their reach beyond each.


def height_error(r: Reconstruction, surface: Surface) -> float | None:
    """The mean distance in height of patch and surface over the domain, or None if there is no surface."""
    points, weights = r.domain.nodes
    heights = r.height(points[:, 0], points[:, 1])
    up = vector_of(r.frame.axes[:, 2])
    starts = r.frame.to_world(np.column_stack([points, heights])).tolist()
    offs = [layer_off(surface, vector_of(start), up, r.radius) for start in starts]
    met = [i for i, off in enumerate(offs) if off is not None]
    return float(np.average([offs[i] or 0.0 for i in met], weights=weights[met])) if met else None


def judged_by_mesh(r: Reconstruction, mean: float) -> tuple[str, str]:
    """Status and message: those of the fit, unless it has no doubt but the mesh contradicts it.

    mean : mean distance of the mesh from the patch, a length
    """
    std, percent = r.mean_height_std, 100.0 / r.radius
    if r.status != "ok" or mean <= CONTRADICTING * std:
        return r.status, r.message
    return "uncertain", (
        f"The mesh is {percent * mean:.3g} % of the radius off the patch on average, which expects "
        f"{percent * std:.3g} %, so the curves miss something between them: use a shorter extent or "
        "add sampling planes."
    )


def layer_off(surface: Surface, start: Vector, up: Vector, reach: float) -> float | None:
    """How far along `up`, in either direction, the nearest layer with its outside up is; None beyond `reach`.

    Layers that are seen from inside are another wall of the object, or its other side.
    """
    nearest, hair = None, HAIR * reach
    for sign in (1.0, -1.0):
        # Rays that begin on the mesh, but for rounding, may miss all of it.
        gone, direction = -hair, scaled(up, sign)
        for _ in range(MESH_LAYERS):
            hit = surface.ray_cast(along(start, direction, gone), direction, reach - gone)
            if hit is None:
                break
            point, normal = contact_of(hit, 1.0)
            gone = abs(dot(along(point, start, -1.0), up))
            if dot(normal, up) > 0.0:
                nearest = reach = gone
                break
            gone += hair
            if gone >= reach:
                break
    return nearest
