# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The point where measured curves meet, if it is not given. Not in the paper."""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from ..arguments import LARGEST, Array, finite_array, many
from ..triangles import far_apart
from .contour import Contour, contours_of
from .curves import (
    LEAST_CONTACTS,
    WINDOW,
    curves_through,
    local_curves,
    stacked,
)
from .local_geometry import LEAST_ANGLE, DegenerateCurvesError

MAX_OFFSET = 0.1  # A curve may miss the point by this share of its size.
MAX_GAP = 0.25  # Around the point, a curve may have no contacts within this share of its size.
NEWTON_STEPS = 50  # Gauss-Newton takes at most this many steps; five are the rule.
MOST_STARTS = 3  # This number of starts is tried: curves may come near each other in several places.
# Starts are chosen among this number of contacts of each curve, by this number of distances from curves.
MOST_SEARCHED, MAX_QUERIES = 1000, 10**6
CONTACTS_AROUND = 4 * WINDOW  # This number of contacts of a curve shows how it passes a point.


def common_point(contours: Sequence[ArrayLike | Contour]) -> tuple[Array, Array]:
    """The point (3,) with the least sum of squared distances to two or more curves, and the distances (c,).

    contours : Contours or arrays (n, 3)

    Curves that were measured one by one do not meet exactly: the distances are by how much each misses the
    point. If curves meet twice, as sections of a body do, it is the better of the two points.

    Raises ValueError for bad arguments, DegenerateCurvesError for curves with fewer than four contacts,
    that do not come near each other, or that run in the same direction where they do.
    """
    felt = contours_of("contours", contours)
    if len(felt) < 2:
        raise DegenerateCurvesError(
            f"the common point needs two or more curves, got {len(felt)}: name the curve of each contact in "
            'a column "curve", give more curves, or give the point'
        )
    for number, contour in enumerate(felt, 1):
        if (count := len(contour.points)) <= LEAST_CONTACTS:
            raise DegenerateCurvesError(
                f"curve {number} has {many(count, 'contact', 'contacts')}, and {LEAST_CONTACTS + 1} are "
                "needed to tell where it runs: measure more, or give the reference point"
            )
    origin = felt[0].points[0]  # Far from the world's origin only differences of points are exact.
    curves = [Contour(contour.points - origin) for contour in felt]
    refined = (_refined(start, curves) for start in _starts(curves))
    point, tangents, misses = min(refined, key=lambda fit: float(np.sum(fit[2] ** 2)))
    _require_near(point, misses, curves)
    _require_crossing(tangents)
    return origin + point, misses


def in_running_order(contour: Contour, point: ArrayLike) -> Contour:
    """The contour with its contacts sorted by their signed distance from `point` (3,).

    The distance is Euclidean, and its sign is that of the component along the curve's tangent at the point.
    """
    r = contour.points - finite_array("point", point, (3,), LARGEST)
    if not len(r):
        return contour
    tangent = curves_through(r[None, None], np.ones((1, 1, len(r)), dtype=bool)).tangents[0, 0]
    order = np.argsort(np.copysign(np.linalg.norm(r, axis=1), r @ tangent), kind="stable")
    return contour.part(order, contour.stops)


def _starts(contours: Sequence[Contour]) -> Array:
    """Starting points (k, 3) for Gauss-Newton, k <= MOST_STARTS, the best first.

    They are contacts with the least sum of squared distances from the nearest contacts of all curves, more
    than 2 MAX_OFFSET of the smallest curve's size from each other. Of very many contacts only some are
    searched, because Gauss-Newton refines the starts.
    """
    from scipy.spatial import cKDTree

    thinned = [contour.points[:: -(-len(contour.points) // MOST_SEARCHED)] for contour in contours]
    contacts = np.vstack(thinned)
    contacts = contacts[:: -(-len(contacts) * len(thinned) // MAX_QUERIES)]
    squares = np.sum([cKDTree(points).query(contacts)[0] ** 2 for points in thinned], axis=0)
    apart, order = MAX_OFFSET * min(contour.size for contour in contours), np.argsort(squares, kind="stable")
    near = contacts[order[squares[order] <= 4.0 * squares.min() + len(contours) * apart**2]]
    return near[far_apart(near, 2.0 * apart)[:MOST_STARTS]]


def _refined(point: Array, contours: Sequence[Contour]) -> tuple[Array, Array, Array]:
    """Runs Gauss-Newton: the point (3,), the curves' unit tangents there (c, 3) and their offsets (c,)."""
    reach = min(contour.size for contour in contours)
    for _ in range(NEWTON_STEPS):
        near = [Contour(_near(point, contour.points)) for contour in contours]
        local = local_curves(curves_through(*stacked(point[None], [near])))[0][0]
        speeds = np.linalg.norm(local[:, 1], axis=1, keepdims=True)
        feet, tangents = point + local[:, 0], local[:, 1] / np.maximum(speeds, 1e-300)
        projections = np.eye(3) - tangents[:, :, None] * tangents[:, None]
        # Parallel lines have a solution, too, which _require_crossing then refuses.
        rhs = np.einsum("cij,cj->i", projections, local[:, 0])
        step = np.linalg.lstsq(projections.sum(axis=0), rhs, rcond=1e-9)[0]
        length = float(np.linalg.norm(step))
        if length <= 1e-9 * reach:
            break
        point = point + step * min(1.0, 0.5 * reach / length)
    off = feet - point
    across = off - np.sum(off * tangents, axis=1, keepdims=True) * tangents
    return point, tangents, np.linalg.norm(across, axis=1)


def _near(point: Array, points: Array) -> Array:
    """The contacts of a curve that show how it passes the point, and some more, in their order."""
    if len(points) <= CONTACTS_AROUND:
        return points
    return points[
        np.sort(np.argpartition(np.sum((points - point) ** 2, axis=1), CONTACTS_AROUND)[:CONTACTS_AROUND])
    ]


def _require_near(point: Array, misses: Array, contours: Sequence[Contour]) -> None:
    """Raises DegenerateCurvesError if a curve misses the point (3,), by `misses` (c,), or has a gap there."""
    for number, (contour, offset) in enumerate(zip(contours, misses, strict=True), 1):
        size, gap = contour.size, contour.distance_to(point)
        if not (offset <= MAX_OFFSET * size and gap <= MAX_GAP * size):
            raise DegenerateCurvesError(
                f"the curves do not come near each other: curve {number}, {size:.3g} long, is "
                f"{max(offset, gap):.3g} away from the point nearest to all: give the reference point, or "
                "leave that curve out"
            )


def _require_crossing(tangents: Array) -> None:
    """Raises DegenerateCurvesError if all unit tangents (c, 3) are the same line."""
    sines = np.linalg.norm(np.cross(tangents[:, None], tangents[None]), axis=2)
    if sines.max() < math.sin(LEAST_ANGLE):
        raise DegenerateCurvesError(
            "the curves run in the same direction (within "
            f"{math.degrees(math.asin(sines.max())):.2g} degrees), "
            "which does not determine their common point: give the reference point"
        )
