# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""How far a surface is from a patch all over it, even without vertices, and the patch's verdict from that."""

from collections.abc import Sequence

import numpy as np

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
    up = r.frame.axes[:, 2].tolist()
    starts = r.frame.to_world(np.column_stack([points, heights])).tolist()
    offs = [layer_off(surface, start, up, r.radius) for start in starts]
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


def layer_off(surface: Surface, start: list[float], up: list[float], reach: float) -> float | None:
    """How far along `up`, in either direction, the nearest layer with its outside up is; None beyond `reach`.

    Layers that are seen from inside are another wall of the object, or its other side.
    """
    nearest, hair = None, HAIR * reach
    for sign in (1.0, -1.0):
        gone = -hair  # Rays that begin on the mesh, but for rounding, may miss all of it.
        for _ in range(MESH_LAYERS):
            at = _along(start, up, sign * gone)
            hit = surface.ray_cast(at, _along([0.0, 0.0, 0.0], up, sign), reach - gone)
            if hit is None:
                break
            point, normal = contact_of(hit, 1.0)
            gone = abs(_dot([a - b for a, b in zip(point, start, strict=True)], up))
            if _dot(normal, up) > 0.0:
                nearest = reach = gone
                break
            gone += hair
            if gone >= reach:
                break
    return nearest


def _along(start: list[float], up: list[float], distance: float) -> tuple[float, float, float]:
    x, y, z = (a + distance * v for a, v in zip(start, up, strict=True))
    return x, y, z


def _dot(a: Sequence[float], b: Sequence[float]) -> float:
    return sum(v * w for v, w in zip(a, b, strict=True))
