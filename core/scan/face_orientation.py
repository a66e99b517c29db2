# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Whether the faces of a mesh point outward and lie on no others, and where the mesh is open."""

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..arguments import Array
from ..triangles import row_dot, triangle_cross

Indices = NDArray[np.integer[Any]]

DOUBLED, INWARD = "doubled", "inward"
# A mesh is doubled if more of its faces are than this share: where vertices of the pear of docs/scans.md
# coincide, it has two such faces.
DOUBLED_SHARE = 0.01
MOST_SHELLS = 8  # At most this number of shells, those of the largest negative volumes, is tested.
INSIDE_OUT = -0.75  # The winding number before a face: 0 of a solid, -1/2 of a sheet, -1 if inside out.
SIDES_AT_ONCE = 500_000  # Ten million faces take 2 GB of memory, and took 12 with all sides at once.


class _Sides(NamedTuple):
    """The sides (k,) of all faces: the vertices where they start and end, and their faces.

    rims : (r,), the sides on whose edge no other side is
    pairs : (p, 2), the two sides on each edge that has two
    """

    start: Indices
    end: Indices
    face: Indices
    rims: Indices
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
    sides = _sides_of(points, corners, starts)
    start, end = points[sides.start[sides.rims]], points[sides.end[sides.rims]]
    along, away = end - start, np.asarray(place, dtype=float) - start
    shares = np.clip(row_dot(away, along) / row_dot(along, along), 0.0, 1.0)
    return float(np.linalg.norm(away - shares[:, None] * along, axis=1).min(initial=np.inf))


def _sides_of(points: Array, corners: Indices, starts: Indices) -> _Sides:
    _, first, same = np.unique(points, axis=0, return_index=True, return_inverse=True)
    start = first.astype(np.int32)[same.ravel()[corners]]
    lengths, end = np.diff(starts, append=len(corners)), np.roll(start, -1)
    end[starts + lengths - 1] = start[starts]
    face, proper = np.repeat(np.arange(len(starts), dtype=np.int32), lengths), start != end
    start, end, face = start[proper], end[proper], face[proper]
    edge = np.minimum(start, end).astype(np.int64) * len(points) + np.maximum(start, end)
    order = np.argsort(edge, kind="stable").astype(np.int32)
    edge = edge[order]
    begin = np.flatnonzero(np.append(True, edge[1:] != edge[:-1]))
    count = np.diff(begin, append=len(order))
    two = begin[count == 2]
    return _Sides(start, end, face, order[begin[count == 1]], np.column_stack([order[two], order[two + 1]]))


def _parts(rows: Array | Indices) -> Iterator[slice]:
    """The rows in parts, so that what is computed of each takes little memory."""
    return (slice(start, start + SIDES_AT_ONCE) for start in range(0, len(rows), SIDES_AT_ONCE))


def _doubled(sides: _Sides, count: int) -> int:
    """How many of the faces have the sides of another one, but go along them in the opposite direction."""
    if not len(sides.start):
        return 0
    # Sums of products of random numbers are equal for equal sides, and by chance for no others.
    most = int(sides.start.max()) + 1
    one, other = np.random.default_rng(0).integers(2**63, size=(2, most), dtype=np.uint64)
    along, against = np.zeros((2, count), dtype=np.uint64)
    for part in _parts(sides.face):
        start, end, face = sides.start[part], sides.end[part], sides.face[part]
        np.add.at(along, face, one[start] * other[end])
        np.add.at(against, face, one[end] * other[start])
    has_area = np.bincount(sides.face, minlength=count) > 2
    return int(np.isin(along[has_area], against[has_area]).sum())


def _is_inside_out(points: Array, sides: _Sides, hubs: Indices) -> bool:
    """Whether a shell is inside out; `hubs` (m,) are the vertices around which faces are fans."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    i, j = sides.face[sides.pairs.T]
    shells, shell = connected_components(coo_matrix((np.ones(len(i)), (i, j)), (len(hubs),) * 2), False)
    shell, at = shell[sides.face], points - points.mean(axis=0, dtype=float)
    fans = np.column_stack([hubs[sides.face], sides.start, sides.end])
    volumes, areas, squares = np.zeros(shells), np.zeros((shells, 3)), np.empty(len(fans))
    for part in _parts(fans):
        triangles = at[fans[part]]
        across = triangle_cross(triangles)
        squares[part] = row_dot(across, across)
        np.add.at(volumes, shell[part], row_dot(triangles[:, 0], across))
        np.add.at(areas, shell[part], across)
    # A fan around the middle of its rims closes an open shell.
    rims, middles = shell[sides.rims], np.zeros((shells, 3))
    np.add.at(middles, rims, at[sides.start[sides.rims]])
    middles /= np.maximum(np.bincount(rims, minlength=shells), 1)[:, None]
    volumes -= row_dot(middles, areas)
    for number in np.argsort(volumes)[:MOST_SHELLS]:
        if volumes[number] >= 0.0:
            break
        own = np.flatnonzero(shell == number)
        if _winding_in_front(at, fans, own[np.argmax(squares[own])]) < INSIDE_OUT:
            return True
    return False


def _winding_in_front(points: Array, triangles: Indices, number: int) -> float:
    """The winding number of triangles (m, 3) of points just in front of the middle of one of them.

    It is the sum of their signed solid angles over 4 pi, of which arctangents are the halves (Van Oosterom &
    Strackee 1983). That one's own is -2 pi.

    number : of that triangle
    """
    middle, total = points[triangles[number]].mean(axis=0), 0.0
    others = np.delete(triangles, number, axis=0)
    for part in _parts(others):
        a, b, c = np.moveaxis(points[others[part]] - middle, 1, 0)
        u, v, w = (np.linalg.norm(corner, axis=1) for corner in (a, b, c))
        denominator = u * v * w + row_dot(a, b) * w + row_dot(b, c) * u + row_dot(c, a) * v
        total += float(np.arctan2(row_dot(a, np.cross(b, c)), denominator).sum())
    return total / (2.0 * np.pi) - 0.5
