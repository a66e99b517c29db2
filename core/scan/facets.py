# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Whether the curvature of a touch is that of the facets it has felt, not of the shape they stand for."""

import math
from collections.abc import Callable
from functools import cache
from itertools import islice
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ..arguments import Array
from ..patch.differential_geometry import Derivatives
from ..patch.monge import exponents, monomials
from ..reconstruction.result import Reconstruction

# benchmarks.facets chose these.
FEW = 8  # On fewer facets a curvature is off by about as much as the larger one is;
SEVERAL = 20  # on fewer than this number too, if a paraboloid has other curvatures,
OTHER = 0.28  # by this share of the largest one.
MANY = 40  # If contacts lie on this number of faces, the mesh is fine, even where it is flat.
# Edges between these angles stand for a smooth bend,
DISTINCT_COSINE, SMOOTH_COSINE = math.cos(math.radians(1.0)), math.cos(math.radians(40.0))
# if both facets have this share of the wider one's width, and of the radius; else one is a fillet.
MIN_WIDTH_RATIO = 0.25
NEIGHBOR_STEP = 0.05  # The facet behind an edge is looked for this share of the width beyond it.


class Facet(NamedTuple):
    """A face: its corners (k, 3), its unit normal, and its area over its longest edge."""

    corners: Array
    normal: Array
    width: float


def has_few_facets(
    r: Reconstruction, face_near: Callable[[Array], int], corners_of: Callable[[int], ArrayLike]
) -> bool:
    """Whether contacts lie on so few facets, which stand for a smooth shape, that the curvature is theirs.

    Facets of different directions count. Fewer than FEW are too few. Fewer than SEVERAL are, if the
    paraboloid nearest to the same contacts, which cannot follow facets, has other curvatures.

    face_near : the number of the face nearest to a point (3,) of the world
    corners_of : the corners (k, 3) of a face in the world, in order

    Facets whose edges are all sharp, as those of a cube, are the shape itself.
    """
    shape = cache(lambda face: _facet(corners_of(face)))
    touched: dict[int, Facet] = {}
    distinct: list[Array] = []
    points = np.vstack([contour.points for contour in r.contours])
    for point in points[np.argsort(np.linalg.norm(points - r.frame.origin, axis=1), kind="stable")]:
        face = face_near(point)
        if face in touched or not (facet := shape(face)).width:
            continue
        touched[face] = facet
        if all(facet.normal @ normal < DISTINCT_COSINE for normal in distinct):
            distinct.append(facet.normal)
        if len(distinct) == SEVERAL or len(touched) == MANY:
            return False
    if len(distinct) >= FEW and not _follows_facets(r, points):
        return False
    nearest = islice(touched.values(), FEW)
    return any(_is_smooth(facet, r.radius, lambda at: shape(face_near(at))) for facet in nearest)


def is_beside_bend(
    point: Array, face_near: Callable[[Array], int], corners_of: Callable[[int], ArrayLike]
) -> bool:
    """Whether the facet nearest to a point (3,) has an edge that stands for a smooth bend, as on a ball.

    The arguments are those of `has_few_facets`.
    """
    facet = _facet(corners_of(face_near(point)))
    return _is_smooth(facet, 0.0, lambda at: _facet(corners_of(face_near(at))))


def _follows_facets(r: Reconstruction, points: Array) -> bool:
    """Whether the paraboloid nearest to points (n, 3) of the world has other curvatures than the fit."""
    local = r.frame.to_local(points) / r.radius
    b = np.linalg.lstsq(monomials(local, exponents(1, 2)), local[:, 2], rcond=None)[0]
    even = Derivatives(np.zeros(()), b[0], b[1], 2.0 * b[2], b[3], 2.0 * b[4]).principal_curvatures
    both = np.array([even, (r.radius * r.k1, r.radius * r.k2)])
    return bool(np.abs(np.ptp(both, axis=0)).max() > OTHER * np.abs(both).max())


def _is_smooth(facet: Facet, radius: float, facet_near: Callable[[Array], Facet]) -> bool:
    """Whether an edge of the facet stands for a smooth bend."""
    starts, along = facet.corners, np.roll(facet.corners, -1, axis=0) - facet.corners
    outward = np.cross(along, facet.normal)
    for start, edge, out in zip(starts, along, outward, strict=True):
        if not np.any(out):
            continue
        beyond = facet_near(start + 0.5 * edge + NEIGHBOR_STEP * facet.width * out / np.linalg.norm(out))
        is_bend = SMOOTH_COSINE < float(facet.normal @ beyond.normal) < DISTINCT_COSINE
        narrow, wide = sorted((facet.width, beyond.width))
        if is_bend and narrow >= MIN_WIDTH_RATIO * max(wide, radius):
            return True
    return False


def _facet(corners: ArrayLike) -> Facet:
    """The face with these corners; its normal and width are 0 if it has no area."""
    points = np.asarray(corners, dtype=float)
    sides = points - points[0]
    across = np.cross(sides[1:-1], sides[2:]).sum(axis=0)
    twice = float(np.linalg.norm(across))
    if not twice:
        return Facet(points, across, 0.0)
    longest = np.linalg.norm(points - np.roll(points, -1, axis=0), axis=1).max()
    return Facet(points, across / twice, 0.5 * twice / float(longest))
