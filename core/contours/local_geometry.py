# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Tangent plane, principal curvatures and Darboux frame at the reference point (paper, III-B and III-C)."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..arguments import Array
from .contour import WHERE, Contour, cross
from .curves import LEAST_CONTACTS, Curves

# benchmarks.stability leads planes and tilts to where these refuse them.
LEAST_ANGLE = math.radians(1.0)  # Tangents count as distinct from this angle on.
OFF_PLANE = math.sin(math.radians(25.0))  # Tangents are off the tangent plane by at most this angle.
UMBILIC = 1e-9  # Curvatures that differ by less, in unit radius, count as the same.


class DegenerateCurvesError(ValueError):
    """The contours cannot carry the method; the message names what to move."""


@dataclass(frozen=True, eq=False)
class Frame:
    """A local frame: world = origin + axes @ local.

    origin : (3,), the reference point
    axes : (3, 3), columns d1, d2 (the principal directions) and n (the outward normal)
    """

    origin: Array
    axes: Array

    def to_local(self, points: ArrayLike) -> Array:
        """World points (n, 3) as local points (n, 3)."""
        return (np.asarray(points, dtype=float) - self.origin) @ self.axes

    def to_world(self, points: ArrayLike) -> Array:
        """Local points (n, 3) as world points (n, 3)."""
        return self.origin + np.asarray(points, dtype=float) @ self.axes.T


def surface_normals(tangents: Array, outward: Array) -> Array:
    """The unit n (..., 3) that minimize sum (n . t)^2 over tangents (..., c, 3), on the side of `outward`."""
    n = np.linalg.eigh(np.swapaxes(tangents, -1, -2) @ tangents)[1][..., 0]
    return np.copysign(1.0, np.einsum("...i,...i->...", n, outward))[..., None] * n


def principal_curvatures(
    angles: ArrayLike, curvatures: ArrayLike, known: NDArray[np.bool_] | bool = True
) -> tuple[Array, Array, Array]:
    """kappa1 <= kappa2 and the angle of d1 in radians, above -pi/2 and up to pi/2, (...) each.

    They follow from those normal curvatures (..., c), at angles (..., c) in radians, that are `known`, by
    formula (2) in the form kappa_i = H + A cos 2 phi_i + B sin 2 phi_i. It is linear: exact for three curves,
    and solved by least squares for more. At an umbilic d1 is at angle 0: there A and B are within rounding of
    0, compared with 1 and the curvatures, so pass these in unit radius.
    """
    phi, kappa = np.asarray(angles, dtype=float), np.asarray(curvatures, dtype=float)
    rows = np.empty((*phi.shape, 3))
    rows[..., 0], rows[..., 1], rows[..., 2] = known, np.cos(2.0 * phi) * known, np.sin(2.0 * phi) * known
    turned = np.swapaxes(rows, -1, -2)
    values, vectors = np.linalg.eigh(turned @ rows)
    solution = vectors @ (np.swapaxes(vectors, -1, -2) @ (turned @ kappa[..., None]) / values[..., None])
    mean, a, b = solution[..., 0, 0], solution[..., 1, 0], solution[..., 2, 0]
    half = np.hypot(a, b)
    umbilic = half <= UMBILIC * np.maximum(1.0, np.abs(known * kappa).max(axis=-1))
    return mean - half, mean + half, np.where(umbilic, 0.0, 0.5 * np.arctan2(-b, -a))


def darboux_frames(curves: Curves, n: Array) -> tuple[Array, Array, Array]:
    """Darboux frames (b, 3, 3) about normals (b, 3); kappa1 and kappa2 (b, 2) in unit radius; radii L (b,).

    d1 is within 90 degrees of the first curve's tangent, and is this tangent at an umbilic. L is the largest
    distance of a contact from the point in the tangent plane.
    """
    tangents = curves.tangents
    e1 = tangents[:, 0] - np.einsum("bi,bi->b", tangents[:, 0], n)[:, None] * n
    e1 /= np.sqrt(np.einsum("bi,bi->b", e1, e1))[:, None]
    plane = np.array([e1.T, cross(n.T, e1.T)]).transpose(2, 1, 0)
    flat = curves.points @ plane[:, None]
    radius = np.sqrt((np.einsum("...i,...i->...", flat, flat) * curves.present).max(axis=(1, 2)))
    # By Meusnier the normal curvature is the normal part of the curvature vector, with its sign: the paper's
    # kappa' cos(theta).
    kappas = radius[:, None] * np.einsum("bci,bi->bc", curves.curvatures, n)
    flat = tangents @ plane
    angles = np.arctan2(flat[..., 1], flat[..., 0])
    k1, k2, theta = principal_curvatures(angles, kappas, curves.present.any(axis=2))
    c, s = np.cos(theta), np.sin(theta)
    directions = plane @ np.array([[c, -s], [s, c]]).transpose(2, 0, 1)
    return np.concatenate([directions, n[..., None]], axis=2), np.array([k1, k2]).T, radius


def degeneracy(
    contours: Sequence[Contour], present: NDArray[np.bool_], tangents: Array, normal: Array
) -> DegenerateCurvesError | None:
    """The error why one touch of Curves carries no frame, with what to move; or None."""
    for i, (contour, count) in enumerate(zip(contours, present.sum(axis=1), strict=False), 1):
        if count < LEAST_CONTACTS:
            ends = dict.fromkeys(WHERE.get(stop, stop) for stop in contour.stops or ())
            why = f" (it ends {' and '.join(ends)})" if ends else ""
            return DegenerateCurvesError(
                f"curve {i} has {count} of the {LEAST_CONTACTS} contacts it needs besides the reference "
                f"point{why}: move the point away from the crease or edge there, or use a shorter step"
            )
    if len(contours) < 3:
        return DegenerateCurvesError(
            f"three curves are needed, got {len(contours)}: add a sampling plane in another direction"
        )
    tangents = tangents[: len(contours)]
    heights = tangents @ normal
    off_plane = np.abs(heights)
    if not off_plane.max() < OFF_PLANE:
        return DegenerateCurvesError(
            "the tangents of the curves at the point do not lie in one plane, that of curve "
            f"{np.argmax(off_plane) + 1} least of all: move the point away from the edge or corner, "
            "or sort the contacts along each curve"
        )
    in_plane = tangents - heights[:, None] * normal
    lengths = np.sqrt(np.einsum("ci,ci->c", in_plane, in_plane))
    # Tangents have length 1, but that of a curve which goes round again is 0, but for rounding.
    if not lengths.min() > 0.5:
        return DegenerateCurvesError(
            f"curve {np.argmin(lengths) + 1} has no direction at the point: split it where it passes the "
            "point again, or sort its contacts"
        )
    return _too_few_directions(in_plane / lengths[:, None])


def _too_few_directions(tangents: Array) -> DegenerateCurvesError | None:
    """An error that names two curves, unless three of these unit tangents differ as lines by LEAST_ANGLE."""
    least = math.sin(LEAST_ANGLE)
    sines = np.sqrt(np.maximum(1.0 - (tangents @ tangents.T) ** 2, 0.0))
    rows, distinct = sines.tolist(), [0]
    for i in range(1, len(rows)):
        if all(rows[i][j] >= least for j in distinct):
            distinct.append(i)
    if len(distinct) >= 3:
        return None
    j, i = next((j, i) for i in range(len(rows)) for j in range(i) if rows[i][j] < least)
    angle = math.degrees(math.asin(min(1.0, rows[i][j])))
    return DegenerateCurvesError(
        f"curves {j + 1} and {i + 1} run in the same direction ({angle:.2g} degrees apart), "
        f"which leaves {len(distinct)} of the three directions needed: turn one of their planes"
    )
