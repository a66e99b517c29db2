# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Tangent plane, principal curvatures and Darboux frame at the reference point (paper, III-B and III-C)."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .arguments import SMALLEST, Array
from .contour import Contour, cross

WINDOW = 10  # contacts "very close to p"; even, for on equal sides a cubic term does not bend the quadratic
LEAST_CONTACTS = 3  # on a contour, besides the reference point; the quadratic through it has two unknowns
LEAST_ANGLE = math.radians(1.0)  # between tangents that count as distinct
OFF_PLANE = math.sin(math.radians(25.0))  # of a tangent, against the tangent plane
EXACT = 1e-6  # radians, of a measured normal: no less is told apart
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
class Curves:
    """The contours of b touches as seen from their reference points, c curves a touch, n contacts a curve.

    What a touch or a curve has less of is filled up.

    points : (b, c, n, 3), contacts other than the reference point, relative to it, in running order
    present : (b, c, n), which of them are contacts
    along : (b, c, n), their signed distances from the point along the curve's direction, ascending
    tangents : (b, c, 3), unit, pointing the way the contour's points were given; 0 where there is no curve
    curvatures : (b, c, 3), the curvature vectors r''(s) at the point, in 1/length
    normals : (b, c, n, 3), measured normals over their standard deviation (radians), 0 where there are
        none; None where none is measured at all
    """

    points: Array
    present: NDArray[np.bool_]
    along: Array
    tangents: Array
    curvatures: Array
    normals: Array | None = None

    def at(self, index: int | list[int]) -> "Curves":
        """Those of one touch, without the leading dimension, or of several."""
        parts: list[Any] = [part if part is None else part[index] for part in vars(self).values()]
        return Curves(*parts)


def stacked(
    points: Array, touches: Sequence[Sequence[Contour]]
) -> tuple[Array, NDArray[np.bool_], Array | None]:
    """Contacts relative to their reference points (b, 3), which of them there are, and measured normals.

    points, present and normals of Curves, as given.
    """
    # At least one place, empty where there is nothing at all.
    curves = max([1, *(len(contours) for contours in touches)])
    longest = max([1, *(len(contour.points) for contours in touches for contour in contours)])
    r = np.zeros((len(touches), curves, longest, 3))
    present, measured = np.zeros(r.shape[:3], dtype=bool), np.zeros_like(r)
    for i, contours in enumerate(touches):
        for j, contour in enumerate(contours):
            count = len(contour.points)
            r[i, j, :count] = contour.points - points[i]
            present[i, j, :count] = True
            if contour.normals is not None and contour.normal_std is not None:
                normals = contour.normals / np.abs(contour.normals).max(axis=1, keepdims=True)
                normals /= np.linalg.norm(normals, axis=1, keepdims=True)
                measured[i, j, :count] = normals / max(contour.normal_std, EXACT)
    return r, present, measured if any(map(has_measured_normals, touches)) else None


def has_measured_normals(contours: Sequence[Contour]) -> bool:
    """Whether a fit of these contours has slopes in it."""
    return any(contour.normal_std is not None for contour in contours)


def curves_through(r: Array, present: NDArray[np.bool_], normals: Array | None = None) -> Curves:
    """Fits r(s) = t s + r'' s^2 / 2, through the point, to the nearest contacts of each curve (III-C).

    r : (b, c, n, 3), contacts relative to the point; present : (b, c, n); normals as in Curves. s is
    the chord to the contact, the arc length up to its cube.
    """
    shape, curve = present.shape, np.arange(present[..., 0].size)[:, None]
    r, present = r.reshape(len(curve), -1, 3), present.reshape(len(curve), -1)
    distance = np.sqrt(np.einsum("cni,cni->cn", r, r))
    least = np.maximum(1e-9 * distance.max(axis=1, initial=0.0, keepdims=True), SMALLEST)
    present = present & (distance > least)
    distance = np.where(present, distance, np.inf)
    near = np.argsort(distance, axis=1, kind="stable")[:, :WINDOW]
    counts = present.sum(axis=1)[:, None]
    farthest = near[curve, np.clip(counts, 1, WINDOW) - 1]
    along = np.copysign(np.where(present, distance, 0.0), np.einsum("cni,cji->cn", r, r[curve, farthest]))
    given = np.cumsum(present, axis=1) - (counts + 1) / 2.0
    along[np.einsum("cn,cn->c", given, along) < 0.0] *= -1.0
    scale = np.where(counts > 0, distance[curve, farthest], 1.0)
    tangents, curvatures = _parabola(along[curve, near] / scale, r[curve, near] / scale[..., None])
    speed = np.maximum(np.sqrt(np.einsum("ci,ci->c", tangents, tangents)), 1e-9)[:, None]  # 1 but for noise
    along[~present] = np.inf
    order = np.argsort(along, axis=1, kind="stable")
    return Curves(
        r[curve, order].reshape(*shape, 3),
        present[curve, order].reshape(shape),
        along[curve, order].reshape(shape),
        (tangents / speed).reshape(*shape[:2], 3),
        (curvatures / (scale * speed**2)).reshape(*shape[:2], 3),
        None if normals is None else normals.reshape(len(curve), -1, 3)[curve, order].reshape(*shape, 3),
    )


def local_curves(curves: Curves) -> tuple[Array, Array]:
    """r = r0 + r1 s + r2 s^2 of the c curves of one touch, s along the tangent t; and the deviation of r0.

    (c, 3, 3), rows r0, r1 and r2, fitted to the nearest contacts, and (c,). 0 where there are too few
    of them to tell.
    """
    distance = np.where(curves.present, np.abs(curves.along), np.inf)
    order = np.argsort(distance, axis=1, kind="stable")[:, :WINDOW]
    near = np.take_along_axis(curves.present, order, axis=1)
    r = near[..., None] * np.take_along_axis(curves.points, order[..., None], axis=1)
    s = np.einsum("cni,ci->cn", r, curves.tangents)
    count, longest = np.count_nonzero(near, axis=1), np.abs(s).max(axis=1)
    told = (count > LEAST_CONTACTS) & (longest > 0.0)
    powers = np.where(told, longest, 1.0)[:, None] ** np.arange(3)
    basis = near[..., None] * (s / powers[:, 1:2])[..., None] ** np.arange(3)
    inverse = np.linalg.pinv(basis)
    solution = inverse @ r
    variance = np.sum((r - basis @ solution) ** 2, axis=(1, 2)) / np.maximum(count - 3, 1)
    stds = np.sqrt(variance * np.sum(inverse[:, 0] ** 2, axis=1))
    solution /= powers[..., None]
    return np.where(told[:, None, None], solution, 0.0), np.where(told, stds, 0.0)


def misses(curves: Curves) -> tuple[Array, Array]:
    """The distances at which the c curves of one touch pass its reference point, and their deviations.

    (c,) each: the part of r0 across the tangent. 0 where there are too few contacts to tell.
    """
    local, stds = local_curves(curves)
    return np.linalg.norm(cross(local[:, 0].T, curves.tangents.T), axis=0), stds


def _parabola(s: Array, r: Array) -> tuple[Array, Array]:
    """t and r'' of r = t s + r'' s^2 / 2 by least squares, (c, 3) each, from (c, k) and (c, k, 3).

    Where all s are one the two cannot be told apart: then the shortest solution.
    """
    powers = np.stack([s, 0.5 * s * s], axis=1)
    gram = powers @ np.swapaxes(powers, 1, 2)
    a, b, d = gram[:, 0, 0], gram[:, 0, 1], gram[:, 1, 1]
    det, square = a * d - b * b, np.maximum((a + d) ** 2, 1e-300)
    alike = det <= 1e-13 * square
    adjugate = np.array([[d, -b], [-b, a]]).transpose(2, 0, 1)
    inverse = np.where(alike[:, None, None], gram, adjugate) / np.where(alike, square, det)[:, None, None]
    solution = inverse @ (powers @ r)
    return solution[:, 0], solution[:, 1]


def surface_normals(tangents: Array, outward: Array) -> Array:
    """The unit n (..., 3) that minimise sum (n . t)^2 over tangents (..., c, 3), on the side of `outward`."""
    n = np.linalg.eigh(np.swapaxes(tangents, -1, -2) @ tangents)[1][..., 0]
    return np.where((n * outward).sum(axis=-1, keepdims=True) >= 0.0, n, -n)


def principal_curvatures(
    angles: ArrayLike, curvatures: ArrayLike, known: NDArray[np.bool_] | bool = True
) -> tuple[Array, Array, Array]:
    """kappa1 <= kappa2 and the angle of d1, in (-90, 90] degrees; (...) each.

    From normal curvatures (..., c) at angles (..., c), those that are `known`. Euler's formula (2) as
    kappa_i = H + A cos 2 phi_i + B sin 2 phi_i: linear, exact for three curves and least squares for
    more. At an umbilic (A and B within rounding of 0, measured against 1 and the curvatures: pass them
    in unit radius) d1 is at angle 0.
    """
    phi, kappa = np.asarray(angles, dtype=float), np.asarray(curvatures, dtype=float)
    rows = np.stack([known * f for f in (np.ones_like(phi), np.cos(2.0 * phi), np.sin(2.0 * phi))], axis=-2)
    solution = np.linalg.solve(rows @ np.swapaxes(rows, -1, -2), rows @ kappa[..., None])
    mean, a, b = solution[..., 0, 0], solution[..., 1, 0], solution[..., 2, 0]
    half = np.hypot(a, b)
    umbilic = half <= UMBILIC * np.maximum(1.0, np.abs(known * kappa).max(axis=-1))
    return mean - half, mean + half, np.where(umbilic, 0.0, 0.5 * np.arctan2(-b, -a))


def darboux_frames(curves: Curves, n: Array) -> tuple[Array, Array, Array, Array]:
    """Darboux frames about normals (b, 3), (b, 3, 3); kappa1 and kappa2 in unit radius and the radii L, (b,).

    d1 is within 90 degrees of the first curve's tangent, and that tangent at an umbilic. L is the
    largest distance of a contact from the point in the tangent plane.
    """
    tangents = curves.tangents
    e1 = tangents[:, 0] - (tangents[:, 0] * n).sum(axis=1, keepdims=True) * n
    e1 /= np.linalg.norm(e1, axis=1, keepdims=True)
    e2 = np.array(cross(n.T, e1.T)).T
    plane = np.array([e1.T, e2.T]).transpose(2, 1, 0)
    flat = curves.points @ plane[:, None]
    squares = np.einsum("...i,...i->...", flat, flat)
    radius = np.sqrt(np.max(squares, axis=(1, 2), where=curves.present, initial=0.0))
    # Meusnier with its sign: the normal curvature is the normal part of the curvature vector,
    # kappa' cos(theta) in the paper's words.
    kappas = radius[:, None] * np.einsum("bci,bi->bc", curves.curvatures, n)
    flat = tangents @ plane
    angles = np.arctan2(flat[..., 1], flat[..., 0])
    k1, k2, theta = principal_curvatures(angles, kappas, curves.present.any(axis=2))
    c, s = np.cos(theta), np.sin(theta)
    turn = np.array([[c, -s], [s, c]]).transpose(2, 0, 1)
    return np.concatenate([plane @ turn, n[:, :, None]], axis=2), k1, k2, radius


def degeneracy(
    contours: Sequence[Contour], present: NDArray[np.bool_], tangents: Array, normal: Array
) -> DegenerateCurvesError | None:
    """Why one touch of Curves carries no frame, and what to move; None where it carries one."""
    for i, (contour, count) in enumerate(zip(contours, present.sum(axis=1), strict=False), 1):
        if count < LEAST_CONTACTS:
            why = f" (it ended by: {', '.join(contour.stops)})" if contour.stops else ""
            return DegenerateCurvesError(
                f"curve {i} has {count} of the {LEAST_CONTACTS} contacts it needs besides the reference "
                f"point{why}: move the point away from the crease or edge there, or take a shorter step"
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
            "the tangents of the curves at the point lie in no plane, that of curve "
            f"{np.argmax(off_plane) + 1} least of all: move the point away from the edge or corner, or give "
            "each curve in its running order"
        )
    in_plane = tangents - heights[:, None] * normal
    return _indistinct(in_plane / np.sqrt(np.einsum("ci,ci->c", in_plane, in_plane))[:, None])


def _indistinct(tangents: Array) -> DegenerateCurvesError | None:
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
        f"curves {j + 1} and {i + 1} run in one direction ({angle:.2g} degrees apart), "
        f"which leaves {len(distinct)} distinct ones of the three needed: turn one of their planes"
    )
