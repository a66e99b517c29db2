# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A patch as triangles: Delaunay's, of the rim and of equilateral lattices, one inside the other.

A flat triangle is off a surface of second derivatives H by |e' H e| / 8 at the middle of an edge e, and
by a third more inside where it is a bowl. So the distance of neighbors that is wanted falls with the
curvature; the boundary, followed by short edges, asks for more near itself, and only there. Rows of the
lattices are parallel to x with a point at the origin: symmetric about both axes, as patches may be.
"""

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from ..arguments import Array
from .domain import Domain
from .monge import HeightField

# benchmarks.patch_mesh judges all of these.
CHORD = 4.6  # side^2 = CHORD tolerance / curvature; 8 for equilateral triangles
COARSEST_EDGE, FINEST_EDGE = 0.25, 0.02  # of neighbors, in mean radii: colors are drawn by them too
VISIBLE = 1e-3  # Share of the mean radius: a rim that is farther off shows its corners.
RIM_SAMPLES, MOST_RIM_EDGES = 128, 256  # samples of the boundary; edges of the rim, at most
RIM_SPACING = 0.65  # Share of the distance wanted inside, along the rim, where the lattice does not fit.
EDGE_GROWTH = 0.5  # Growth of the distance of neighbors with the distance from the rim.
CLEAR = 0.6  # Distance of the lattice from the rim, in edges of the rim.
SMOOTHING_PASSES = 3  # Passes of smoothing.
UNEQUAL = 1e-6  # With this no four points lie on a circle, where any diagonal would do.

Size = Callable[[Array], Array]


def patch_mesh(surface: HeightField, domain: Domain, tolerance: float) -> tuple[Array, NDArray[np.intp]]:
    """Points (n, 3) on the patch over its domain, and counterclockwise triangles (m, 3).

    There are as many as it takes to be off the patch by the tolerance at most, as long as that asks for no
    less than FINEST_EDGE between neighbors; the rim is off the boundary by VISIBLE at most.
    """
    mean_radius = math.sqrt(domain.area / math.pi)

    def size(points: Array) -> Array:
        """The distance of neighbors that the second derivatives allow, (n,)."""
        flattest = CHORD * tolerance / (COARSEST_EDGE * mean_radius) ** 2
        wanted = np.sqrt(CHORD * tolerance / np.maximum(_bend(surface, points), flattest))
        return np.maximum(wanted, FINEST_EDGE * mean_radius)

    plane, triangles = triangulate(domain, size, VISIBLE * mean_radius)
    return np.column_stack([plane, surface.height(*plane.T)]), triangles


def triangulate(domain: Domain, size: Size, off: float) -> tuple[Array, NDArray[np.intp]]:
    """Points (n, 2), from the origin outward and then along the rim, and counterclockwise triangles (m, 3).

    size : the distance of neighbors that is wanted at points (k, 2), (k,)
    off : how far the rim may be from the boundary
    """
    rim, finest = _rim(domain, size, off)
    inner = _lattice(domain, size, rim, finest)
    points = np.vstack([inner, rim])
    triangles = _delaunay(points, len(inner))
    return _smoothed(points, triangles, len(inner)), triangles


def _bend(surface: HeightField, points: Array) -> Array:
    """8 times the chord error of an equilateral triangle of side 1 at most, (n,), by second derivatives."""
    d = surface.derivatives(*points.T)
    mean, half = 0.5 * np.abs(d.xx + d.yy), np.hypot(0.5 * (d.xx - d.yy), d.xy)
    return mean + half + np.maximum(mean - half, 0.0) / 3.0


def _rim(domain: Domain, size: Size, off: float) -> tuple[Array, float]:
    """Points on the boundary, as far apart along it from each other; and the least size in the domain."""
    closed = domain.boundary(8 * RIM_SAMPLES)[np.arange(8 * RIM_SAMPLES + 1) % (8 * RIM_SAMPLES)]
    lengths = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(closed, axis=0).T))])

    def around(count: int) -> Array:
        """`count` points of it in equal steps, (count, 2)."""
        at = lengths[-1] / count * np.arange(count)
        return np.column_stack([np.interp(at, lengths, values) for values in closed.T])

    samples = around(RIM_SAMPLES)
    bow = 0.5 * np.hypot(*(np.roll(samples, 1, 0) - 2.0 * samples + np.roll(samples, -1, 0)).T).max()
    rings = np.arange(5)[:, None, None] / 4.0 * samples
    sizes = size(rings.reshape(-1, 2)).reshape(5, RIM_SAMPLES)
    bound = max(RIM_SAMPLES / 2.0 * math.sqrt(bow / off), lengths[-1] / (RIM_SPACING * sizes[-1].min()))
    return around(4 * math.ceil(min(bound, MOST_RIM_EDGES) / 4.0)), float(sizes.min())


def _lattice(domain: Domain, size: Size, rim: Array, finest: float) -> Array:
    """Points inside and clear of the rim (n, 2), from the origin outward, as size and rim ask."""
    from scipy.spatial import cKDTree

    edge = float(np.mean(np.hypot(*(rim - np.roll(rim, 1, 0)).T)))
    side = finest / 2.0 ** max(0, round(math.log2(finest / edge)))
    row = math.sqrt(0.75) * side
    reach = np.ceil(np.abs(rim).max(axis=0) / (0.5 * side, row)).astype(int)
    i, j = (n.ravel() for n in np.meshgrid(*(np.arange(-most, most + 1) for most in reach)))
    points = np.column_stack([0.5 * side * i, row * j])
    there = ((i + j) % 2 == 0) & domain.contains(*points.T)
    i, j, points = i[there], j[there], points[there]
    # How many times wider the coarsest lattice is that has the point: the powers of two in its place.
    place = np.gcd((i - j) // 2, j)
    wide = np.where(place == 0, MOST_RIM_EDGES, place & -place) * side
    wide[i == 0] *= 2.0  # No trapezoid may lie across the axis, for its diagonal would lean.
    distance = cKDTree(rim).query(points)[0]
    wanted = np.minimum(size(points), edge + EDGE_GROWTH * distance)
    kept = np.flatnonzero((wanted < 1.999 * wide) & (distance > CLEAR * edge))
    outward = np.argsort((i**2 + 3 * j**2)[kept], kind="stable")  # whole numbers: the same in any unit
    return points[kept[outward]]


def _delaunay(points: Array, inner: int) -> NDArray[np.intp]:
    """Counterclockwise triangles (m, 3) of points, the last of which, from `inner` on, are the rim."""
    from scipy.spatial import Delaunay

    scaled = points / np.abs(points).max()
    scaled *= 1.0 + UNEQUAL * (scaled**2 @ (1.0, 2.0))[:, None]
    triangles = Delaunay(scaled).simplices.astype(np.intp)  # counterclockwise in two dimensions
    # One outside has its corners on the rim, and goes round the other way than the rim does.
    ahead = triangles < np.roll(triangles, -1, axis=1)
    return triangles[(triangles.min(axis=1) < inner) | (np.count_nonzero(ahead, axis=1) == 2)]


def _doubled_areas(points: Array, triangles: NDArray[np.intp]) -> Array:
    a, b, c = points[triangles].transpose(1, 2, 0)
    areas: Array = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
    return areas


def _smoothed(points: Array, triangles: NDArray[np.intp], inner: int) -> Array:
    """The points with those inside, but for the first, between their neighbors."""
    start, end = triangles.ravel(), np.roll(triangles, -1, axis=1).ravel()  # each edge inside twice
    smoothed, counts = points.copy(), np.maximum(np.bincount(start, minlength=len(points)), 1)
    for _ in range(SMOOTHING_PASSES):
        sums = [np.bincount(start, smoothed[end, axis], len(points)) for axis in (0, 1)]
        smoothed[1:inner] = np.column_stack(sums)[1:inner] / counts[1:inner, None]
    return smoothed if _doubled_areas(smoothed, triangles).min() > 0.0 else points
