# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Why a surface is far off the mesh that was touched, by a look at the place where it is farthest."""

import math

import numpy as np

from ... import core
from ..touch.detached_mesh import DetachedMesh
from ..touch.types import Array
from ..touch.units import Unit, length
from .both_ways import DIRECTIONS, room

# The indicator of a surface has at most 200 cells along the object, of which a wall needs three.
THIN_SHARE = 3.0 / 200.0
HIDDEN_SHARE = 0.1  # A place is nearly hidden if at most this share of the rays around it meets nothing.


def why_far(
    surface: DetachedMesh, place: Array, off: float, patch: core.Reconstruction | None, unit: Unit
) -> core.Doubt | None:
    """The doubt about a place (3,) where mesh and surface are `off` apart; None without a cause.

    patch : what was felt nearest to the place, if anything was
    """
    foot, normal = (np.array(vector) for vector in surface.project(place.tolist())[:2])
    narrow = narrowest(surface, foot, normal)
    words = length(off, unit), length(narrow, unit)
    if surface.open_edge_distance(place) <= off:
        code = "open_edges"
    elif narrow <= THIN_SHARE * surface.size:
        code = "narrow"
    elif _free_share(surface, foot, normal) <= HIDDEN_SHARE:
        code = "hidden"
    elif patch is not None and surface.is_of_facets(patch):
        code = "single_facets"
    else:
        return None
    return core.Doubt(code, off, words=words)


def narrowest(surface: DetachedMesh, foot: Array, normal: Array) -> float:
    """How far the next wall is from a place of the mesh, above it or below it."""
    return min(room(surface, foot, sign * normal) for sign in (-1.0, 1.0))


def _free_share(surface: DetachedMesh, foot: Array, normal: Array) -> float:
    """The share of rays on the outer side of a place of the mesh that meet nothing."""
    ways = DIRECTIONS[DIRECTIONS @ normal > 0.0]
    return sum(math.isinf(room(surface, foot, way)) for way in ways) / len(ways)
