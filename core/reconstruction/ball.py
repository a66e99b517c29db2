# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Contacts of a ball whose center was recorded: the surface of the centers, moved inward along its normals.

Not in the paper. Centers lie on the parallel surface at the distance r, the ball's radius, which has the same
normals and 1/kappa = 1/kappa_center + r. Contacts leave the plane of their curve. Along an edge that is
sharper than the ball, centers bend by 1/r, and over a hollow that is sharper they have a kink.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from ..arguments import SMALLEST, Array
from ..contours.common_point import common_point
from ..contours.contour import Contour
from ..contours.local_geometry import DegenerateCurvesError
from ..verdict import SIGNIFICANT
from .result import Reconstruction

# Slopes on either side of a place are those of parabolas through the first number of centers, or through all
# centers divided by the second number if these are more.
PARABOLA_CENTERS, PARABOLAS = 8, 6
KINK = 0.1  # Centers have a kink if slopes differ by more, and by SIGNIFICANT deviations.


def ball_of(contours: Sequence[Contour], strokes: Sequence[ArrayLike | Contour]) -> float:
    """The radius of the ball whose centers were recorded, or 0. Raises ValueError for two different ones."""
    balls = {(given.ball or 0.0) if isinstance(given, Contour) else 0.0 for given in (*contours, *strokes)}
    if len(balls) > 1:
        got = " and ".join(f"{ball:g}" if ball else "none" for ball in sorted(balls))
        raise ValueError(f"ball: expected one radius for all contours and strokes, got {got}")
    return balls.pop() if balls else 0.0


def center_at(point: Array, contours: Sequence[Contour], ball: float) -> Array:
    """The center (3,) where contours of centers meet: the reference point, or above it if that is a contact.

    It is a contact if no center is nearer than half the ball's radius. Raises DegenerateCurvesError if
    contours do not meet then.
    """
    away = min((contour.distance_to(point) for contour in contours), default=0.0)
    return point if away < 0.5 * ball else common_point(contours)[0]


def contacts_below(
    centers: Reconstruction, contours: Sequence[Contour], strokes: Sequence[Contour], ball: float
) -> tuple[Array, list[Contour], list[Contour]]:
    """The reference point (3,), contours and strokes of contacts, from the fit to the centers of a ball.

    Strokes beyond its domain are left out. Raises DegenerateCurvesError where the ball is too large for the
    surface.
    """
    for contour in contours:
        _require_reached(centers, contour)
    # The centers bend as about an edge.
    if centers.patch.k1 - centers.k1_std < -1.0 / ball:
        raise DegenerateCurvesError(
            f"the centers bend by {-centers.patch.k1:.3g} +- {centers.k1_std:.1g}, as those of a ball of "
            f"radius {ball:g} do on an edge, which may be sharper than the ball resolves: use a smaller ball "
            "or another point"
        )
    inside = (
        stroke.part(centers.domain.contains(*centers.frame.to_local(stroke.points).T[:2]), stroke.stops)
        for stroke in strokes
    )
    below = [[_below(centers, given, ball) for given in some] for some in (contours, inside)]
    return centers.frame.origin - ball * centers.normal, below[0], below[1]


def _below(centers: Reconstruction, given: Contour, ball: float) -> Contour:
    """Contacts below centers."""
    normals = centers.geometry.normal(*centers.frame.to_local(given.points).T[:2])
    points = given.points - ball * normals @ centers.frame.axes.T
    return replace(given, points=points, plane_normal=None, ball=None)


def _require_reached(centers: Reconstruction, contour: Contour) -> None:
    """Raises DegenerateCurvesError if a curve of centers has a kink, as over a hollow that is too sharp.

    The slopes at the ends of parabolas on both sides of each place differ there.
    """
    local = centers.frame.to_local(contour.points)
    away = np.linalg.norm(local[:, :2], axis=1)
    way = local[np.argmax(away), :2] / max(float(away.max()), SMALLEST)
    order = np.argsort(local[:, :2] @ way, kind="stable")
    s, z = (local[:, :2] @ way)[order], local[order, 2]
    count = max(PARABOLA_CENTERS, len(s) // PARABOLAS)
    bends = []
    for i in range(count, len(s) - count + 1):
        middle = 0.5 * (s[i - 1] + s[i])
        before, after = (_slope(s[j : j + count] - middle, z[j : j + count]) for j in (i - count, i))
        bends.append([i, after[0] - before[0], np.hypot(before[1], after[1]), before[2], after[2]])
    places, jumps, levers, *off = np.array(bends).reshape(-1, 5).T
    if len(jumps) == 0:
        return
    noise = max(float(np.median(off)), contour.noise or 0.0)
    worst = int(np.argmax(jumps - SIGNIFICANT * noise * levers))
    if jumps[worst] > max(KINK, SIGNIFICANT * noise * levers[worst]):
        x, y, z = contour.points[order[int(places[worst])]]
        raise DegenerateCurvesError(
            f"the centers have a kink at ({x:.3g}, {y:.3g}, {z:.3g}), so the ball does not reach the bottom "
            "of the hollow there: use a smaller ball or another point"
        )


def _slope(s: Array, z: Array) -> tuple[float, float, float]:
    """The slope at 0 of the parabola through z (n,) at s (n,), its deviation per noise, and the noise."""
    basis = np.vander(s, 3)
    inverse = np.linalg.pinv(basis)
    parabola = inverse @ z
    off = float(np.linalg.norm(z - basis @ parabola)) / np.sqrt(len(s) - 3.0)
    return float(parabola[1]), float(np.linalg.norm(inverse[1])), off
