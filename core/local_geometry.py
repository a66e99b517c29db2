# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Tangent plane, principal curvatures and Darboux frame at the reference point (paper, III-B and III-C)."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from .arguments import Array
from .tracking import Contour, cross

WINDOW = 10  # contacts "very close to p"; even, for on equal sides a cubic term does not bend the quadratic
LEAST_CONTACTS = 3  # on a contour, besides the reference point; the quadratic through it has two unknowns
LEAST_ANGLE = math.radians(1.0)  # between tangents that count as distinct
UMBILIC = 1e-9  # the difference of curvatures, in unit radius, that is none


class DegenerateCurvesError(ValueError):
    """The contours cannot carry the method; the message says what to move."""


@dataclass(frozen=True)
class Frame:
    """A local frame: world = origin + axes @ local.

    origin : (3,), the reference point
    axes : (3, 3), columns d1, d2 (the principal directions) and n (the outward normal)
    """

    origin: Array
    axes: Array

    def to_local(self, points: ArrayLike) -> Array:
        """World points (n, 3) in the frame, (n, 3)."""
        return (np.asarray(points, dtype=float) - self.origin) @ self.axes

    def to_world(self, points: ArrayLike) -> Array:
        """Local points (n, 3) in the world, (n, 3)."""
        return self.origin + np.asarray(points, dtype=float) @ self.axes.T


@dataclass(frozen=True)
class Curve:
    """A contour as seen from the reference point, which is its origin.

    points : (n, 3), the contacts other than the reference point, relative to it, in running order
    along : (n,), their signed distances from the point along the curve's direction, ascending
    tangent : (3,), unit, pointing the way the contour's points were given
    curvature : (3,), the curvature vector r''(s) at the point, in 1/length
    """

    points: Array
    along: Array
    tangent: Array
    curvature: Array


def curve_through(contour: Contour, point: Array, name: str = "the curve") -> Curve:
    """Fits r(s) = t s + r'' s^2 / 2, through the point, to the nearest contacts (III-C).

    s is the chord to the contact, the arc length up to its cube. Raises DegenerateCurvesError where
    the contour has too few contacts.
    """
    r = contour.points - point
    distance = np.sqrt(np.einsum("ij,ij->i", r, r))
    largest = distance.max(initial=0.0)
    kept = distance > 1e-9 * largest
    r, distance = r[kept], distance[kept]
    if len(r) < LEAST_CONTACTS:
        why = f" (it ended by: {', '.join(contour.stops)})" if contour.stops else ""
        raise DegenerateCurvesError(
            f"{name} has {len(r)} of the {LEAST_CONTACTS} contacts it needs besides the reference point"
            f"{why}: move the point away from the crease or edge there, or take a shorter step"
        )
    near = np.argsort(distance, kind="stable")[:WINDOW]
    along = np.copysign(distance, r @ r[near[-1]])
    given = np.arange(len(along)) - (len(along) - 1) / 2.0
    if given @ along < 0.0:
        along = -along
    scale = distance[near[-1]]
    s = along[near] / scale
    (t, c), *_ = np.linalg.lstsq(np.column_stack([s, 0.5 * s**2]), r[near] / scale, rcond=None)
    speed = np.linalg.norm(t)
    order = np.argsort(along, kind="stable")
    return Curve(r[order], along[order], t / speed, c / (scale * speed**2))


def surface_normal(tangents: ArrayLike, outward: ArrayLike) -> Array:
    """The unit n that minimises sum (n . t)^2 over tangents (m, 3), on the side of `outward` (III-C)."""
    n = np.linalg.svd(np.asarray(tangents, dtype=float), full_matrices=True)[2][2]
    return n if n @ np.asarray(outward) >= 0.0 else -n


def principal_curvatures(angles: ArrayLike, curvatures: ArrayLike) -> tuple[float, float, float]:
    """kappa1 <= kappa2 and the angle of d1, in (-90, 90] degrees, from normal curvatures (m,) at angles (m,).

    Euler's formula (2) as kappa_i = H + A cos 2 phi_i + B sin 2 phi_i: linear, exact for three
    curves and least squares for more. At an umbilic (A and B within rounding of 0, measured against
    1 and the curvatures: pass them in unit radius) d1 is at angle 0.
    """
    phi, kappa = np.asarray(angles, dtype=float), np.asarray(curvatures, dtype=float)
    system = np.column_stack([np.ones_like(phi), np.cos(2.0 * phi), np.sin(2.0 * phi)])
    (mean, a, b), *_ = np.linalg.lstsq(system, kappa, rcond=None)
    half = math.hypot(a, b)
    umbilic = half <= UMBILIC * max(1.0, float(np.abs(kappa).max()))
    theta = 0.0 if umbilic else 0.5 * math.atan2(-b, -a)
    return float(mean - half), float(mean + half), theta


def darboux_frame(
    point: Array, curves: Sequence[Curve], outward: ArrayLike
) -> tuple[Frame, float, float, float]:
    """The Darboux frame, kappa1, kappa2 and the radius L of curves through `point`.

    d1 is within 90 degrees of the first curve's tangent, and that tangent at an umbilic. L is the
    largest distance of a contact from the point in the tangent plane. Raises DegenerateCurvesError
    where there are fewer than three distinct tangent directions.
    """
    if len(curves) < 3:
        raise DegenerateCurvesError(
            f"three curves are needed, got {len(curves)}: add a sampling plane in another direction"
        )
    tangents = np.array([curve.tangent for curve in curves])
    _require_distinct(tangents)
    n = surface_normal(tangents, outward)
    e1 = tangents[0] - (tangents[0] @ n) * n
    e1 /= np.linalg.norm(e1)
    e2 = np.array(cross(n, e1))
    points = np.vstack([curve.points for curve in curves])
    radius = float(np.hypot(points @ e1, points @ e2).max())
    # Meusnier with its sign: the normal curvature is the normal part of the curvature vector,
    # kappa' cos(theta) in the paper's words.
    kappas = [radius * float(curve.curvature @ n) for curve in curves]
    k1, k2, theta = principal_curvatures(np.arctan2(tangents @ e2, tangents @ e1), kappas)
    d1 = math.cos(theta) * e1 + math.sin(theta) * e2
    return Frame(point, np.column_stack([d1, cross(n, d1), n])), k1 / radius, k2 / radius, radius


def _require_distinct(tangents: Array) -> None:
    """Three tangents that differ as lines by LEAST_ANGLE; or an error that names two that do not."""
    sines = np.sqrt(np.maximum(1.0 - (tangents @ tangents.T) ** 2, 0.0))
    distinct: list[int] = []
    for i in range(len(tangents)):
        if all(sines[i, j] >= math.sin(LEAST_ANGLE) for j in distinct):
            distinct.append(i)
    if len(distinct) < 3:
        alike = next(
            (i, j) for i in range(len(sines)) for j in range(i) if sines[i, j] < math.sin(LEAST_ANGLE)
        )
        angle = math.degrees(math.asin(min(1.0, sines[alike])))
        raise DegenerateCurvesError(
            f"curves {alike[1] + 1} and {alike[0] + 1} run in one direction ({angle:.2g} degrees apart), "
            f"which leaves {len(distinct)} distinct ones of the three needed: turn one of their planes"
        )
