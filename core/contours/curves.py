# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Contours as seen from the reference point: sorted, with tangents and curvature vectors (paper, III-C)."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..arguments import SMALLEST, Array, unit_vectors
from .contour import Contour

# This many contacts are "very close to p" (benchmarks.accuracy). The number is even, because a cubic term
# does not bend a quadratic over equal sides.
WINDOW = 10
LEAST_CONTACTS = 3  # A contour has more than the quadratic's two unknowns, without the reference point.
RIDGE = 1e-12  # This is added to equations that may not determine all their unknowns.
MIN_NORMAL_STD = 1e-6  # Measured normals have at least this deviation, in radians.


class Curves(NamedTuple):
    """The contours of b touches as seen from their reference points, c curves a touch, n contacts a curve.

    Touches with fewer curves, and curves with fewer contacts, are filled up.

    points : (b, c, n, 3), contacts other than the reference point, relative to it, in running order
    present : (b, c, n), which of them are contacts
    along : (b, c, n), their signed distances from the point along the curve's direction, ascending; infinite
        where there is none
    tangents : (b, c, 3), unit, pointing the way the contour's points were given; 0 where there is no curve
    curvatures : (b, c, 3), the curvature vectors r''(s) at the point, in 1/length
    normals : (b, c, n, 3), measured normals over their standard deviation in radians, 0 where there are
        none; None if there are none at all
    """

    points: Array
    present: NDArray[np.bool_]
    along: Array
    tangents: Array
    curvatures: Array
    normals: Array | None = None

    def at(self, index: int | list[int]) -> "Curves":
        """The curves of one touch, without the leading dimension, or of several."""
        if index == [0] and len(self.points) == 1:  # This saves a twentieth of a fit.
            return self
        return Curves._make(part if part is None else part[index] for part in self)


def stacked(
    points: Array, touches: Sequence[Sequence[Contour]]
) -> tuple[Array, NDArray[np.bool_], Array | None]:
    """What `curves_through` takes: contacts, `present` and normals, as in Curves, but in the order given.

    points : (b, 3), the reference points; contacts at these are still there
    """
    # There is at least one place, which may be empty.
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
                normals = unit_vectors("normals", contour.normals)
                measured[i, j, :count] = normals / max(contour.normal_std, MIN_NORMAL_STD)
    return r, present, measured if any(map(has_measured_normals, touches)) else None


def has_measured_normals(contours: Sequence[Contour]) -> bool:
    """Whether any of the contours has normals with a deviation, so that a fit uses slopes."""
    return any(contour.normal_std is not None for contour in contours)


def curves_through(r: Array, present: NDArray[np.bool_], normals: Array | None = None) -> Curves:
    """Fits r(s) = t s + r'' s^2 / 2, through the point, to the nearest contacts of each curve (III-C).

    r : (b, c, n, 3), contacts relative to the point
    present : (b, c, n); normals : as in Curves

    s is the chord to the contact, which differs from the arc length only by its cube.
    """
    shape, rows = present.shape, np.arange(present[..., 0].size)
    r, present, curve = r.reshape(len(rows), -1, 3), present.reshape(len(rows), -1), rows[:, None]
    distance, off_point = distances_from_point(r)
    present = present & off_point
    far = np.where(present, distance, np.inf)
    near = far.argsort(axis=1, kind="stable")[:, :WINDOW]
    counts = present.sum(axis=1)
    farthest = near[rows, np.minimum(np.maximum(counts, 1), WINDOW) - 1]
    along = np.copysign(distance, (r @ r[rows, farthest, :, None])[..., 0]) * present
    given = present.cumsum(axis=1) - 0.5 * (counts + 1)[:, None]
    along[np.einsum("cn,cn->c", given, along) < 0.0] *= -1.0
    scale = np.where(counts > 0, far[rows, farthest], 1.0)[:, None]
    tangents, curvatures = _parabola(along[curve, near] / scale, r[curve, near] / scale[..., None])
    # The speed is 1 except for noise.
    speed = np.maximum(np.sqrt(np.einsum("ci,ci->c", tangents, tangents)), 1e-9)[:, None]
    along[~present] = np.inf
    order = along.argsort(axis=1, kind="stable")
    return Curves(
        r[curve, order].reshape(*shape, 3),
        present[curve, order].reshape(shape),
        along[curve, order].reshape(shape),
        (tangents / speed).reshape(*shape[:2], 3),
        (curvatures / (scale * speed**2)).reshape(*shape[:2], 3),
        None if normals is None else normals.reshape(len(curve), -1, 3)[curve, order].reshape(*shape, 3),
    )


def distances_from_point(r: Array) -> tuple[Array, NDArray[np.bool_]]:
    """Distances (..., n) of contacts (..., n, 3) from the point, and a mask of those that are above 0.

    A distance counts as 0 up to 1e-9 of the largest one, or up to SMALLEST.
    """
    distance = np.sqrt(np.einsum("...ni,...ni->...n", r, r))
    least = np.maximum(1e-9 * distance.max(axis=-1, initial=0.0, keepdims=True), SMALLEST)
    return distance, distance > least


def local_curves(curves: Curves) -> tuple[Array, Array]:
    """Parabolas r(s) = r0 + r1 s + r2 s^2, the least squares fits to the WINDOW nearest contacts of curves.

    s is the projection onto the tangent. Returns the rows r0, r1 and r2, (b, c, 3, 3), and the standard
    deviations of r0 by the residuals, (b, c), lengths. Both are 0 for curves of LEAST_CONTACTS contacts or
    fewer.
    """
    shape = curves.present.shape
    present = curves.present.reshape(-1, shape[-1])
    curve = np.arange(len(present))[:, None]
    order = np.abs(curves.along.reshape(present.shape)).argsort(axis=1, kind="stable")[:, :WINDOW]
    near = present[curve, order]
    r = curves.points.reshape(*present.shape, 3)[curve, order]
    r *= near[..., None]
    s = (r @ curves.tangents.reshape(-1, 3, 1))[..., 0]
    count, longest = near.sum(axis=1), np.abs(s).max(axis=1)
    determined = (count > LEAST_CONTACTS) & (longest > 0.0)
    scale = np.where(determined, longest, 1.0)[:, None]
    basis = (near & determined[:, None])[..., None] * (s / scale)[..., None] ** np.arange(3)
    transposed = basis.swapaxes(1, 2)
    # All s may be the same.
    values, vectors = np.linalg.eigh(transposed @ basis + RIDGE * np.eye(3))
    inverse = (vectors / values[:, None]) @ vectors.swapaxes(1, 2)
    solution = inverse @ (transposed @ r)
    off = r - basis @ solution
    variance = np.einsum("cni,cni->c", off, off) / np.maximum(count - 3, 1)
    stds = np.where(determined, np.sqrt(variance * inverse[:, 0, 0]), 0.0)
    solution /= (scale ** np.arange(3))[..., None]
    solution *= determined[:, None, None]
    return solution.reshape(*shape[:-1], 3, 3), stds.reshape(shape[:-1])


def misses(curves: Curves) -> Array:
    """The distances at which the curves of b touches pass the reference points, and their deviations.

    They are (b, c, 2), the length of r0 across the tangent first; 0 for curves with too few contacts.
    """
    local, stds = local_curves(curves)
    foot = local[..., 0, :]
    across = foot - np.einsum("...i,...i->...", foot, curves.tangents)[..., None] * curves.tangents
    return np.stack([np.linalg.norm(across, axis=-1), stds], axis=-1)


def _parabola(s: Array, r: Array) -> tuple[Array, Array]:
    """t and r'' of r = t s + r'' s^2 / 2 by least squares, (c, 3) each, from (c, k) and (c, k, 3).

    If all s are the same, the two cannot be separated, and it is the shortest solution.
    """
    powers = np.empty((len(s), 2, s.shape[1]))
    powers[:, 0] = s
    np.multiply(s, 0.5 * s, out=powers[:, 1])
    gram = powers @ powers.transpose(0, 2, 1)
    a, b, d = gram[:, 0, 0], gram[:, 0, 1], gram[:, 1, 1]
    det, square = a * d - b * b, np.maximum((a + d) ** 2, 1e-300)
    alike = det <= 1e-13 * square
    inverse = np.array([[d, -b], [-b, a]]).transpose(2, 0, 1)
    if alike.any():
        inverse, det = np.where(alike[:, None, None], gram, inverse), np.where(alike, square, det)
    inverse = inverse / det[:, None, None]
    solution = inverse @ (powers @ r)
    return solution[:, 0], solution[:, 1]
