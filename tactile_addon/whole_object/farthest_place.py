# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Why a surface is far off the mesh that was touched, by a look at the place where it is farthest."""

import math

import numpy as np

from ... import core
from ..touch.detached_mesh import DetachedMesh
from ..touch.types import Array
from ..touch.units import Unit, length
from .both_ways import DIRECTIONS, LIFT

# The indicator of a surface has at most 200 cells along the object, of which a wall needs three.
THIN_SHARE = 3.0 / 200.0
HIDDEN_SHARE = 0.1  # A place is nearly hidden if at most this share of the rays around it meets nothing.


def why_far(
    surface: DetachedMesh, place: Array, off: float, patch: core.Reconstruction | None, unit: Unit
) -> tuple[str, str] | None:
    """The status and a sentence on a place (3,) where mesh and surface are `off` apart; None without a cause.

    patch : what was felt nearest to the place, if anything was
    """
    foot, normal, _ = surface.project(place.tolist())
    far = length(off, unit)
    if surface.open_edge_distance(place) <= off:
        return "uncertain", (
            f"The surface is up to {far} off the object beside an open edge of its mesh, as around a hole: "
            "close it, or use a smaller tolerance."
        )
    narrow = min(_room(surface, foot, sign * np.array(normal)) for sign in (-1.0, 1.0))
    if narrow <= THIN_SHARE * surface.size:
        return "uncertain", (
            f"The surface is up to {far} off the object where a wall or gap is {length(narrow, unit)} wide: "
            "touch such parts as objects of their own, or fill the gap."
        )
    if _free_share(surface, foot, normal) <= HIDDEN_SHARE:
        return "uncertain", (
            f"The surface is up to {far} off the object where its own parts nearly hide it: delete what is "
            "inside, or touch it as an object of its own."
        )
    if patch is not None and core.has_few_facets(patch, surface.face_near, surface.corners_of):
        return "uncertain", (
            f"The surface is up to {far} off the object where touches follow single facets: add a "
            "Subdivision modifier, or use a smaller tolerance."
        )
    return None


def _room(surface: DetachedMesh, foot: Array, way: Array) -> float:
    """How far the next wall is from a place of the mesh along a direction; inf if there is none."""
    hit = surface.ray_cast((foot + LIFT * surface.size * way).tolist(), way.tolist(), surface.size)
    return math.inf if hit is None else math.dist(hit[0], foot)


def _free_share(surface: DetachedMesh, foot: Array, normal: Array) -> float:
    """The share of rays on the outer side of a place of the mesh that meet nothing."""
    ways = DIRECTIONS[DIRECTIONS @ normal > 0.0]
    return sum(math.isinf(_room(surface, foot, way)) for way in ways) / len(ways)
