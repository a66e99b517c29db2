# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Strokes: contacts that run beside the reference point, and the frame they show where there are no contours.

A robot that wipes over an object has thousands of them, with noise in all directions, and the fit takes where
one lies in the tangent plane for exact. So the fit gets means of neighbors, of their heights over a quartic:
what the shape adds to a mean is no noise.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ..arguments import LARGEST, SMALLEST, Array, finite_array, list_of
from ..bayes.joint_fit import turned
from ..contours.contour import Contour, cross
from ..contours.local_geometry import DegenerateCurvesError
from ..patch.monge import exponents, monomials

# Strips, and means in each: with more the offsets of rows count for texture (benchmarks.robot, for all).
STRIPS = 10
SOME = 2000  # contacts that the quartic is fitted to
NEAR = 0.5  # of the farthest contact: those that the first quadric is fitted to, if they can carry one
DETERMINED = 0.02  # the least singular value of a quadric's terms in the mean over contacts, in unit radius
QUADRIC, QUARTIC = exponents(0, 2), exponents(0, 4)
OPEN = 1e-3  # share of the largest singular value: contacts on a few lines leave such terms of a quartic open
FAR = 0.999  # of the greatest distance, that is as far: rounding must not choose


class FirstFrame(NamedTuple):
    """Axes d1, d2, n (3, 3) near to the Darboux frame at the foot of a place, and what is known in them.

    k1, k2 : curvatures in unit radius
    radius : the largest distance of a contact from the place in the tangent plane
    contacts : (n, 3), relative to the place, in these axes and in unit radius
    """

    axes: Array
    k1: float
    k2: float
    radius: float
    contacts: Array


def gathered(strokes: Sequence[ArrayLike | Contour]) -> tuple[Array, float]:
    """All contacts of strokes, (n, 3), each once, and the largest deviation they bring. Raises ValueError.

    A sensor at rest writes one contact many times: it is no more certain for that.
    """
    given: list[object] = list_of("strokes", strokes, object)
    if not given:  # as mostly: touches of contours alone are not to pay for them
        return np.empty((0, 3)), 0.0
    arrays = [
        stroke.points if isinstance(stroke, Contour) else finite_array("strokes", stroke, (None, 3), LARGEST)  # type: ignore[arg-type]
        for stroke in given
    ]
    noise = max((stroke.noise or 0.0 for stroke in given if isinstance(stroke, Contour)), default=0.0)
    points = np.vstack(arrays)
    first = np.unique(points, axis=0, return_index=True)[1]
    return points[np.sort(first)], noise


def means(contacts: Array) -> tuple[Array, int]:
    """Contacts (n, 3) in unit radius, or STRIPS^2 means of neighbors; and of how many these are, at least.

    By equal counts in strips along the first axis, and along the second in each strip.
    """
    n = len(contacts)
    if n <= STRIPS**2:
        return contacts, 1
    firsts = np.arange(STRIPS) * n // STRIPS
    lengths = np.diff(firsts, append=n)
    order = np.argsort(contacts[:, 0], kind="stable")
    order = order[np.lexsort((contacts[order, 1], np.repeat(np.arange(STRIPS), lengths)))]
    starts = (firsts[:, None] + np.arange(STRIPS) * lengths[:, None] // STRIPS).ravel()
    counts = np.diff(starts, append=n)[:, None]
    some = contacts[:: max(1, n // SOME)]
    quartic = np.linalg.lstsq(_basis(some), some[:, 2], rcond=OPEN)[0]
    over = contacts[order]
    over[:, 2] -= _basis(over) @ quartic
    found: Array = np.add.reduceat(over, starts, axis=0) / counts
    found[:, 2] += _basis(found) @ quartic
    return found, int(counts.min())


def _basis(contacts: Array) -> Array:
    return monomials(contacts[:, 0], contacts[:, 1], QUARTIC)


def first_frame(r: Array, outward: Array, radius: float | None) -> FirstFrame | DegenerateCurvesError:
    """What contacts (n, 3) relative to a place show alone; or why they carry no fit.

    radius : only contacts within it take part; None for all

    A plane and a quadric through the nearest ones. Contacts farther from the plane than the farthest in it
    are of another side of the object.
    """
    distances = np.sqrt(np.einsum("ni,ni->n", r, r))
    if radius is not None:
        r, distances = r[distances <= radius], distances[distances <= radius]
    reach = float(distances.max(initial=0.0))
    if len(r) < len(QUADRIC) or reach < SMALLEST:
        return _too_few(len(r))
    tangent = r[np.argmax(distances >= FAR * reach)] / reach
    for share in (NEAR, 1.0):
        near = r[distances <= share * reach] / (share * reach)
        plane = _plane(near, outward)
        quadric = _quadric(near @ plane)
        if quadric is not None:
            break
    else:
        return DegenerateCurvesError(
            "the strokes run along a line, two lines or a ring, which leaves open what is beside them: add "
            "strokes across and between"
        )
    axes, k1, k2, _ = turned(plane, quadric[1:], tangent)
    local = r @ axes
    flat = np.hypot(local[:, 0], local[:, 1])
    local = local[np.abs(local[:, 2] - quadric[0] * share * reach) <= flat.max()]
    if len(local) < len(QUADRIC):
        return _too_few(len(local))
    radius = float(np.hypot(local[:, 0], local[:, 1]).max())
    scale = radius / (share * reach)
    return FirstFrame(axes, k1 * scale, k2 * scale, radius, local / radius)


def _too_few(count: int) -> DegenerateCurvesError:
    return DegenerateCurvesError(
        f"the strokes have {count} contacts around the point, and {len(QUADRIC)} are needed: measure more, "
        "or take a larger radius"
    )


def _plane(near: Array, outward: Array) -> Array:
    """The plane nearest to contacts (n, 3), as axes (3, 3) whose last is on the side of `outward`."""
    off = near - near.mean(axis=0) if len(near) else near
    _, axes = np.linalg.eigh(off.T @ off)
    normal = axes[:, 0] if axes[:, 0] @ outward >= 0.0 else -axes[:, 0]
    return np.column_stack([axes[:, 2], cross(normal, axes[:, 2]), normal])


def _quadric(local: Array) -> Array | None:
    """Coefficients (6,) of the quadric nearest to contacts (n, 3) in unit radius; None if they carry none."""
    basis = monomials(local[:, 0], local[:, 1], QUADRIC)
    if len(basis) < len(QUADRIC):
        return None
    u, singular, v = np.linalg.svd(basis, full_matrices=False)
    if singular[-1] < DETERMINED * math.sqrt(len(basis)):
        return None
    found: Array = v.T @ ((u.T @ local[:, 2]) / singular)
    return found
