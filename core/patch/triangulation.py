# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A patch as triangles: the Delaunay triangles of its rim and of nested equilateral lattices inside.

A flat triangle is off a surface with second derivatives H by |e' H e| / 8 at the middle of an edge e, and by
a third more inside it on a bowl. So the distance of neighbors that is wanted falls with the curvature. The
boundary is followed by short edges, which need more points, but only near themselves. Rows of the
lattices are parallel to x and have a point at the origin, so they are symmetric about both axes, as patches
are.
"""

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from ..arguments import Array
from .domain import Domain
from .monge import HeightField

# benchmarks.patch_mesh of e20b52a judged all of these.
CHORD = 4.6  # side^2 = CHORD tolerance / curvature; for equilateral triangles it would be 8.
# Bounds of the distance of neighbors, in mean radii: they carry colors.
COARSEST_EDGE, FINEST_EDGE = 0.25, 0.02
VISIBLE = 1e-3  # A rim that is farther off the boundary, as a share of the mean radius, shows its corners.
RIM_SAMPLES, MOST_RIM_EDGES = 128, 256  # Numbers of samples of the boundary and, at most, of its edges.
# Points on the rim are this share of the inner distance apart: the lattice does not fit there.
RIM_SPACING = 0.65
EDGE_GROWTH = 0.5  # The distance of neighbors grows by this share of the distance from the rim.
CLEAR = 0.6  # The lattice keeps this share of a rim's edge away from the rim.
SMOOTHING_PASSES = 3  # Inner points are smoothed this often.
JITTER = 1e-6  # Points are moved by this share, so that no four lie on a circle, which has two diagonals.

Size = Callable[[Array], Array]


def patch_mesh(surface: HeightField, domain: Domain, tolerance: float) -> tuple[Array, NDArray[np.intp]]:
    """Points (n, 3) on the patch over its domain, and counterclockwise triangles (m, 3).

    They are off the patch by at most the tolerance, unless neighbors would have to be nearer than
    FINEST_EDGE. The rim is off the boundary by at most VISIBLE.
    """
    mean_radius = math.sqrt(domain.area / math.pi)

    def size(points: Array) -> Array:
        """The distance (n,) of neighbors at points (n, 2) with which triangles are within the tolerance.

        It is a length between FINEST_EDGE and COARSEST_EDGE mean radii.
        """
        flattest = CHORD * tolerance / (COARSEST_EDGE * mean_radius) ** 2
        wanted = np.sqrt(CHORD * tolerance / np.maximum(_chord_error_scale(surface, points), flattest))
        return np.maximum(wanted, FINEST_EDGE * mean_radius)

    plane, triangles = triangulate(domain, size, VISIBLE * mean_radius)
    return np.column_stack([plane, surface.height(*plane.T)]), triangles


def triangulate(domain: Domain, size: Size, off: float) -> tuple[Array, NDArray[np.intp]]:
    """Points (n, 2), from the origin outward and then along the rim, and counterclockwise triangles (m, 3).

    size : a function that gives the wanted distance (k,) of neighbors at points (k, 2)
    off : how far the rim may be off the boundary, a length
    """
    rim, finest = _rim(domain, size, off)
    inner = _lattice(domain, size, rim, finest)
    points = np.vstack([inner, rim])
    triangles = _delaunay(points, len(inner))
    return _smoothed(points, triangles, len(inner)), triangles


def _chord_error_scale(surface: HeightField, points: Array) -> Array:
    """8 / side^2 times the error (n,) of a flat equilateral triangle on the osculating paraboloid.

    With eigenvalues |a| >= |b| of the Hessian it is |a|, plus |b| / 3 if both have one sign.
    """
    d = surface.derivatives(*points.T)
    mean, half = 0.5 * np.abs(d.xx + d.yy), np.hypot(0.5 * (d.xx - d.yy), d.xy)
    return mean + half + np.maximum(mean - half, 0.0) / 3.0


def _rim(domain: Domain, size: Size, off: float) -> tuple[Array, float]:
    """Points (n, 2) on the boundary, even between its corners; and the least size at samples of the domain.

    Chords between them are about `off` from the boundary, if that takes at most MOST_RIM_EDGES of them.
    """
    places = 8 * RIM_SAMPLES
    closed = domain.boundary(places)[np.arange(places + 1) % places]
    lengths = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(closed, axis=0).T))])
    corners = domain.corners
    turns = np.arctan2(corners[:, 1], corners[:, 0]) / (2.0 * np.pi) % 1.0
    at_corners = np.interp(places * turns, np.arange(places + 1), lengths)

    def around(at: Array) -> Array:
        """The points of the boundary at these lengths along it."""
        return np.column_stack([np.interp(at % lengths[-1], lengths, values) for values in closed.T])

    between = lengths[-1] / RIM_SAMPLES
    along = between * np.arange(RIM_SAMPLES)
    samples = around(along)
    second = np.hypot(*(np.roll(samples, 1, 0) - 2.0 * samples + np.roll(samples, -1, 0)).T)
    to_corner = np.abs((along[:, None] - at_corners + 0.5 * lengths[-1]) % lengths[-1] - 0.5 * lengths[-1])
    sagitta = 0.5 * second[(to_corner > between).all(axis=1)].max(initial=0.0)
    inner_samples = np.arange(5)[:, None, None] / 4.0 * samples
    sizes = size(inner_samples.reshape(-1, 2)).reshape(5, RIM_SAMPLES)
    spaced = lengths[-1] / (RIM_SPACING * sizes[-1].min())
    needed = max(RIM_SAMPLES / 2.0 * math.sqrt(sagitta / off), spaced)
    count = 4 * math.ceil(min(needed, MOST_RIM_EDGES) / 4.0)
    if not len(corners):
        return around(lengths[-1] / count * np.arange(count)), float(sizes.min())
    order = np.argsort(at_corners)
    steps = _steps_between(at_corners[order], lengths[-1], count)
    pairs = zip(corners[order], steps, strict=True)
    return np.vstack([part for corner, at in pairs for part in (corner[None], around(at))]), float(
        sizes.min()
    )


def _steps_between(corner_lengths: Array, length: float, count: int) -> list[Array]:
    """Lengths along the boundary at which the rim has points from each corner to the next, without both.

    corner_lengths : (k,), the lengths at which corners are, ascending
    length, count : of the whole boundary, and its number of edges if it had no corners
    """
    steps = []
    for start, end in zip(corner_lengths, [*corner_lengths[1:], corner_lengths[0] + length], strict=True):
        share = count * (end - start) / length
        edges = 2 * math.ceil(0.5 * share - 1e-6) if share > 1.0 else 1  # If even, none is across an axis.
        steps.append(start + (end - start) / edges * np.arange(1, edges))
    return steps


def _lattice(domain: Domain, size: Size, rim: Array, finest: float) -> Array:
    """Points (n, 2) inside and clear of the rim, from the origin outward, as dense as size and rim need."""
    from scipy.spatial import cKDTree

    edge = float(np.mean(np.hypot(*(rim - np.roll(rim, 1, 0)).T)))
    side = finest / 2.0 ** max(0, round(math.log2(finest / edge)))
    row = math.sqrt(0.75) * side
    reach = np.ceil(np.abs(rim).max(axis=0) / (0.5 * side, row)).astype(int)
    i, j = (n.ravel() for n in np.meshgrid(*(np.arange(-most, most + 1) for most in reach)))
    points = np.column_stack([0.5 * side * i, row * j])
    is_inside = ((i + j) % 2 == 0) & domain.contains(*points.T)
    i, j, points = i[is_inside], j[is_inside], points[is_inside]
    # The coarsest lattice that has a point is wider by the power of two in the point's place.
    place = np.gcd((i - j) // 2, j)
    wide = np.where(place == 0, MOST_RIM_EDGES, place & -place) * side
    wide[i == 0] *= 2.0  # No trapezoid may lie across the axis, because its diagonal would lean.
    distance = cKDTree(rim).query(points)[0]
    wanted = np.minimum(size(points), edge + EDGE_GROWTH * distance)
    kept = (wanted < 1.999 * wide) & (distance > CLEAR * edge)
    outward = np.argsort((i**2 + 3 * j**2)[kept], kind="stable")  # Whole numbers are the same in any unit.
    return points[kept][outward]


def _delaunay(points: Array, inner: int) -> NDArray[np.intp]:
    """Counterclockwise triangles (m, 3) of points, of which those from `inner` on are the rim."""
    from scipy.spatial import Delaunay

    scaled = points / np.abs(points).max()
    scaled *= 1.0 + JITTER * (scaled**2 @ (1.0, 2.0))[:, None]
    triangles = Delaunay(scaled).simplices.astype(np.intp)  # counterclockwise in two dimensions
    # A triangle outside has its corners on the rim, and runs against the rim.
    ahead = triangles < np.roll(triangles, -1, axis=1)
    return triangles[(triangles.min(axis=1) < inner) | (np.count_nonzero(ahead, axis=1) == 2)]


def _smoothed(points: Array, triangles: NDArray[np.intp], inner: int) -> Array:
    """The points, of which all inside except the first are moved to the means of their neighbors."""
    start, end = triangles.ravel(), np.roll(triangles, -1, axis=1).ravel()  # Inner edges are there twice.
    smoothed, counts = points.copy(), np.maximum(np.bincount(start, minlength=len(points)), 1)
    for _ in range(SMOOTHING_PASSES):
        sums = [np.bincount(start, smoothed[end, axis], len(points)) for axis in (0, 1)]
        smoothed[1:inner] = np.column_stack(sums)[1:inner] / counts[1:inner, None]
    (ax, ay), (bx, by), (cx, cy) = smoothed[triangles].transpose(1, 2, 0)
    twice_areas = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
    return smoothed if twice_areas.min() > 0.0 else points
