# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Whether the faces of a mesh point outward and lie on no others, and where the mesh is open."""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..arguments import Array
from ..triangles import row_dot, triangle_cross

Indices = NDArray[np.intp]

DOUBLED, INWARD = "doubled", "inward"
# A mesh is doubled if more of its faces are than this share: where vertices of the pear of docs/scans.md
# coincide, it has two such faces.
DOUBLED_SHARE = 0.01
SHELLS = 8  # At most so many shells, those of the largest negative volumes, are looked at.
INSIDE_OUT = -0.75  # The winding number before a face: 0 of a solid, -1/2 of a sheet, -1 if inside out.


class _Sides(NamedTuple):
    """The sides (k,) of all faces: the vertices where they start and end, and their faces.

    shared : (k,), the number of sides along the same edge
    pairs : (p, 2), the two sides along each edge that has two
    """

    start: Indices
    end: Indices
    face: Indices
    shared: Indices
    pairs: Indices


def orientation_fault(points: Array, corners: Indices, starts: Indices) -> str:
    """DOUBLED or INWARD if the faces of a mesh are not as they should be, or else "".

    points : (n, 3), the vertices, of which those in one place count as one
    corners : (k,), the vertices of all faces, one face after another, counterclockwise from outside
    starts : (m,), where each face begins in `corners`

    Faces are DOUBLED if they share all corners and face opposite ways. They point INWARD if two of them go
    along their edge in the same direction, or if a shell is inside out: it has a negative volume, and it is
    no cavity, because no other shell is around it. A flat sheet has no inside.
    """
    points, corners, starts = np.asarray(points, float), np.asarray(corners, int), np.asarray(starts, int)
    sides = _sides_of(points, corners, starts)
    if _doubled(sides, len(starts)) > DOUBLED_SHARE * len(starts):
        return DOUBLED
    one, other = sides.pairs.T
    if (sides.start[one] == sides.start[other]).any():
        return INWARD
    return INWARD if _is_inside_out(points, sides, corners[starts]) else ""


def open_edge_distance(points: Array, corners: Indices, starts: Indices, place: ArrayLike) -> float:
    """How far a place (3,) is from the nearest edge that has one face, as around a hole; inf without any.

    points, corners, starts : as in `orientation_fault`
    """
    points, corners, starts = np.asarray(points, float), np.asarray(corners, int), np.asarray(starts, int)
    sides = _sides_of(points, corners, starts)
    start, end = points[sides.start[sides.shared == 1]], points[sides.end[sides.shared == 1]]
    along, away = end - start, np.asarray(place, dtype=float) - start
    shares = np.clip(row_dot(away, along) / row_dot(along, along), 0.0, 1.0)
    return float(np.linalg.norm(away - shares[:, None] * along, axis=1).min(initial=np.inf))


def _sides_of(points: Array, corners: Indices, starts: Indices) -> _Sides:
    places = np.ascontiguousarray(points + 0.0)  # -0 + 0 is 0.
    _, first, same = np.unique(places.view(f"V{places.strides[0]}"), return_index=True, return_inverse=True)
    following, lengths = np.arange(1, len(corners) + 1), np.diff(starts, append=len(corners))
    following[starts + lengths - 1] = starts
    start, face = first[same.ravel()][corners], np.repeat(np.arange(len(starts)), lengths)
    proper = start != start[following]
    start, end, face = start[proper], start[following][proper], face[proper]
    edge = np.minimum(start, end) * len(points) + np.maximum(start, end)
    order = np.argsort(edge, kind="stable")
    begin = np.flatnonzero(np.diff(edge[order], prepend=-1))
    count = np.diff(begin, append=len(order))
    shared = np.empty_like(order)
    shared[order] = np.repeat(count, count)
    two = begin[count == 2]
    return _Sides(start, end, face, shared, np.column_stack([order[two], order[two + 1]]))


def _doubled(sides: _Sides, count: int) -> int:
    """How many of the faces have the sides of another one, but go along them in the opposite direction."""
    if not len(sides.start):
        return 0
    # Sums of products of random numbers are equal for equal sides, and by chance for no others.
    most = int(sides.start.max()) + 1
    one, other = np.random.default_rng(0).integers(2**63, size=(2, most), dtype=np.uint64)
    along, against = np.zeros((2, count), dtype=np.uint64)
    np.add.at(along, sides.face, one[sides.start] * other[sides.end])
    np.add.at(against, sides.face, one[sides.end] * other[sides.start])
    has_area = np.bincount(sides.face, minlength=count) > 2
    return int(np.isin(along[has_area], against[has_area]).sum())


def _is_inside_out(points: Array, sides: _Sides, hubs: Indices) -> bool:
    """Whether a shell is inside out; `hubs` (m,) are the vertices around which faces are fans."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    i, j = sides.face[sides.pairs.T]
    shells, shell = connected_components(coo_matrix((np.ones(len(i)), (i, j)), (len(hubs),) * 2), False)
    shell = shell[sides.face]
    at = points - points.mean(axis=0)
    fans = at[np.column_stack([hubs[sides.face], sides.start, sides.end])]
    across = triangle_cross(fans)

    def sums(values: Array, of: Indices) -> Array:
        """The sums (shells, 3) of vectors (k, 3) by the shell that each is of, (k,)."""
        return np.column_stack([np.bincount(of, column, shells) for column in values.T])

    # A fan around the middle of its rims closes an open shell.
    is_rim = sides.shared == 1
    rims = np.maximum(np.bincount(shell[is_rim], minlength=shells), 1)[:, None]
    middles = sums(at[sides.start[is_rim]], shell[is_rim]) / rims
    volumes = np.bincount(shell, row_dot(fans[:, 0], across), shells) - row_dot(middles, sums(across, shell))
    for number in np.argsort(volumes)[:SHELLS]:
        if volumes[number] >= 0.0:
            break
        own = np.flatnonzero(shell == number)
        if _winding_before(fans, own[np.argmax(row_dot(across[own], across[own]))]) < INSIDE_OUT:
            return True
    return False


def _winding_before(triangles: Array, number: int) -> float:
    """The winding number of triangles (m, 3, 3) just before the middle of one of them.

    It is the sum of their solid angles (Van Oosterom & Strackee 1983), and that one's own is half of all.
    """
    others = np.delete(triangles, number, axis=0) - triangles[number].mean(axis=0)
    a, b, c = np.moveaxis(others, 1, 0)
    u, v, w = (np.linalg.norm(corner, axis=1) for corner in (a, b, c))
    below = u * v * w + row_dot(a, b) * w + row_dot(b, c) * u + row_dot(c, a) * v
    half_angles = np.arctan2(row_dot(a, np.cross(b, c)), below)
    return float(half_angles.sum() / (2.0 * np.pi)) - 0.5
