# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Strokes: curves that do not pass through the reference point, and the frame of strokes without contours.

A robot that wipes over an object has thousands of them, with noise in all directions, but the fit takes their
places in the tangent plane for exact. So it gets means of neighbors, in which this noise averages out. Their
heights are averaged relative to a quartic, so that the shape itself does not change the mean.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..arguments import DECIMALS, LARGEST, SMALLEST, Array, finite_array, list_of, many
from ..bayes.joint_fit import frame_update
from ..contours.contour import Contour, cross, equal_points
from ..contours.local_geometry import DegenerateCurvesError
from ..patch.monge import QUADRIC, QUARTIC, monomials

# benchmarks.robot chose these. There are STRIPS strips of STRIPS means each: with more, the offsets of rows
# count as texture.
STRIPS, LEAST_STRIPS = 10, 6
ROWS = 4  # A mean consists of contacts of at least this many rows, on average.
STROKE_CELL = 0.02  # Contacts in a square with sides of this share of the radius count as one place.
FIRST_REACH = 0.5  # The first quadric is fitted within this share of the largest distance, if that suffices.
DETERMINED = 0.02  # It suffices if the least singular value of its terms, averaged over contacts, is larger.
UNDETERMINED = 1e-3  # Terms of a quartic below this share of the largest singular value are left out.
# Contacts that are farther away than all others by this factor do not belong to the surface, if they are at
# most this share of all.
STRAY_FACTOR, STRAY_SHARE = 2.0, 0.02


class FirstFrame(NamedTuple):
    """The frame at a place that contacts around it show, without contours.

    axes : (3, 3), columns d1, d2, n near to the Darboux frame at the foot of the place
    k1, k2 : curvatures in unit radius
    radius : the largest distance of a contact from the place in the tangent plane
    contacts : (n, 3), relative to the place, in these axes and in unit radius
    used : (m,), whether each of the m given contacts is among these
    """

    axes: Array
    k1: float
    k2: float
    radius: float
    contacts: Array
    used: NDArray[np.bool_]


def gathered(
    strokes: Sequence[ArrayLike | Contour], contours: Sequence[Contour] = ()
) -> tuple[Array, NDArray[np.intp], float]:
    """All different contacts of strokes, (n, 3), when each was felt, and the largest noise that one states.

    Contacts are in the order of their coordinates, so that no other order makes a difference. Those that
    follow each other in a stroke have consecutive numbers in the second array, (n,). Repeated contacts, as
    those of `contours`, would add no information and are left out. Raises ValueError for strokes of another
    shape or with numbers that are not finite.
    """
    given: list[object] = list_of("strokes", strokes, object)
    if not given:  # In most cases there are only contours, which should not take longer.
        return np.empty((0, 3)), np.empty(0, dtype=np.intp), 0.0
    arrays = [
        stroke.points
        if isinstance(stroke, Contour)
        else finite_array(f"strokes[{i}]", stroke, (None, 3), LARGEST)  # type: ignore[arg-type]
        for i, stroke in enumerate(given)
    ]
    noise = max((stroke.noise or 0.0 for stroke in given if isinstance(stroke, Contour)), default=0.0)
    points = np.vstack([*(contour.points for contour in contours), *arrays])
    order, starts = equal_points(points)
    first = order[starts]
    first = first[first >= len(points) - sum(map(len, arrays))]
    stroke = np.repeat(
        np.arange(len(contours) + len(arrays)), [*(len(c.points) for c in contours), *map(len, arrays)]
    )
    # Repeated contacts leave no gaps: without them the same contacts follow each other.
    when = np.searchsorted(np.sort(first), first) + stroke[first]
    return points[first], when, noise


def means(contacts: Array, along: Array, when: NDArray[np.intp]) -> tuple[Array, int]:
    """Contacts (n, 3) in unit radius, or STRIPS^2 means of neighbors; the least number of contacts in a mean.

    Strips run across the direction `along` (2,). Each mean has an equal share of the area that was felt,
    because a sensor that dwells in a place adds nothing about the shape. Contacts with consecutive numbers in
    `when` (n,) share the error of their row, so there are fewer strips if rows are far apart.
    """
    if len(contacts) <= STRIPS**2:
        return contacts, 1
    for strips in range(STRIPS, LEAST_STRIPS - 1, -2):
        groups = _groups(contacts[:, :2], along, strips)
        order = np.lexsort((when, groups))
        starts = np.flatnonzero(np.diff(groups[order], prepend=-1))
        rows = np.count_nonzero((np.diff(when[order]) != 1) | (np.diff(groups[order]) != 0)) + 1
        if rows >= ROWS * len(starts):
            break
    order = np.argsort(groups, kind="stable")  # Sums are the same whenever each contact was felt.
    counts = np.diff(starts, append=len(contacts))[:, None]
    # What they leave open of the quartic is as small as it can be in axes that they choose.
    over, turn = contacts[order], np.array([[along[0], -along[1]], [along[1], along[0]]])
    basis = monomials(over[:, :2] @ turn, QUARTIC)
    # Singular values of the contacts are roots of those of their normal equations.
    quartic = np.linalg.pinv(basis.T @ basis, rcond=UNDETERMINED**2, hermitian=True) @ (basis.T @ over[:, 2])
    over[:, 2] -= basis @ quartic
    averages: Array = np.add.reduceat(over, starts, axis=0) / counts
    averages[:, 2] += monomials(averages[:, :2] @ turn, QUARTIC) @ quartic
    return averages, int(counts.min())


def _groups(flat: Array, along: Array, strips: int) -> NDArray[np.intp]:
    """The number, 0 to strips^2 - 1, of the group of each contact (n, 2) of the tangent plane.

    Strips run along the unit vector `along` (2,), and each is cut into as many groups. All groups cover equal
    areas, which are counted in the squares of the side STROKE_CELL that hold a contact.
    """
    flat = flat.round(DECIMALS)  # Rows of a raster are equally far along, whatever rounding makes of them.
    run, across = flat @ along, flat[:, 1] * along[0] - flat[:, 0] * along[1]
    # They are the same for either side of the normal, and for either way of d1.
    run, across = (part * np.copysign(1.0, np.sum(part**3)) for part in (run, across))
    places = np.clip(np.column_stack([run, across]), -1.0, 1.0) / STROKE_CELL
    cells = places.round().astype(np.intp) @ [1, round(4.0 / STROKE_CELL)]
    cells -= cells.min()
    shares = 1.0 / np.bincount(cells)[cells]
    first = _equal_parts(shares, np.lexsort((across, run)), np.zeros(len(flat), dtype=np.intp), strips)
    return strips * first + _equal_parts(shares, np.lexsort((across, first)), first, strips)


def _equal_parts(
    shares: Array, order: NDArray[np.intp], within: NDArray[np.intp], parts: int
) -> NDArray[np.intp]:
    """The part (n,) of each contact if each group of `within`, in this order, is cut into equal shares."""
    passed = np.cumsum(shares[order]) - 0.5 * shares[order]
    totals = np.bincount(within, shares)
    passed -= (np.cumsum(totals) - totals)[within[order]]
    part_of = np.empty(len(order), dtype=np.intp)
    part_of[order] = np.clip(parts * passed / totals[within[order]], 0, parts - 1)
    return part_of


def first_frame(r: Array, outward: Array, radius: float | None) -> FirstFrame | DegenerateCurvesError:
    """The frame from contacts (n, 3) around a place, by a plane and a quadric; or why they carry no fit.

    radius : only contacts within it take part; None for all

    Contacts that are farther from the plane than the farthest foot in it belong to another side of the
    object.
    """
    distances = np.sqrt(np.einsum("ni,ni->n", r, r))
    used = distances <= (radius or _farthest(distances))
    r, distances = r[used], distances[used]
    reach = float(distances.max(initial=0.0))
    if len(r) < len(QUADRIC) or reach < SMALLEST:
        return _too_few(len(r))
    tangent = toward_farthest(r)
    for share in (FIRST_REACH, 1.0):
        near = r[distances <= share * reach] / (share * reach)
        plane = _plane(near, outward)
        quadric = _quadric(near @ plane)
        if quadric is not None:
            break
    else:
        return DegenerateCurvesError(
            "the strokes run along a line, two lines or a ring, which leaves the surface beside "
            "them open: add strokes across and between them"
        )
    axes, k1, k2, _ = frame_update(plane, quadric[1:], tangent)
    local = r @ axes
    flat = np.hypot(local[:, 0], local[:, 1])
    on_this_side = np.abs(local[:, 2] - quadric[0] * share * reach) <= flat.max()
    local = local[on_this_side]
    used[used] = on_this_side
    if len(local) < len(QUADRIC):
        return _too_few(len(local))
    radius = float(np.hypot(local[:, 0], local[:, 1]).max())
    scale = radius / (share * reach)
    return FirstFrame(axes, k1 * scale, k2 * scale, radius, local / radius, used)


def toward_farthest(points: Array) -> Array:
    """The unit vector (k,) to the farthest of points (n, k), the first of those that are equally far."""
    distances = np.sqrt(np.einsum("ni,ni->n", points, points))
    reach = max(float(distances.max()), 1e-300)
    return points[np.argmax((distances / reach).round(DECIMALS))] / reach


def _farthest(distances: Array) -> float:
    """The largest of the distances (n,), without the few that are beyond a gap by STRAY_FACTOR."""
    last = np.sort(distances)[-1 - int(STRAY_SHARE * len(distances)) :]
    gaps = np.flatnonzero(last[1:] > STRAY_FACTOR * last[:-1])
    return float(last[gaps[0] if len(gaps) else -1]) if len(last) else 0.0


def _too_few(count: int) -> DegenerateCurvesError:
    """The error for strokes with only this many contacts."""
    return DegenerateCurvesError(
        f"the strokes have {many(count, 'contact', 'contacts')} around the point, and {len(QUADRIC)} are "
        "needed: measure more, or use a larger radius"
    )


def _plane(near: Array, outward: Array) -> Array:
    """The plane nearest to contacts (n, 3), as axes (3, 3) whose last is on the side of `outward`."""
    off = near - near.mean(axis=0) if len(near) else near
    _, axes = np.linalg.eigh(off.T @ off)
    normal = axes[:, 0] if axes[:, 0] @ outward >= 0.0 else -axes[:, 0]
    return np.column_stack([axes[:, 2], cross(normal, axes[:, 2]), normal])


def _quadric(local: Array) -> Array | None:
    """Coefficients (6,) of the quadric nearest to contacts (n, 3) in unit radius; None if they carry none."""
    basis = monomials(local, QUADRIC)
    if len(basis) < len(QUADRIC):
        return None
    coefficients, _, _, singular = np.linalg.lstsq(basis, local[:, 2], rcond=None)
    return None if singular[-1] < DETERMINED * math.sqrt(len(basis)) else coefficients
