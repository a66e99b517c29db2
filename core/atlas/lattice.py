# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A lattice of points that are inside or outside of an object.

Not in the paper. The indicator has them on the right side but for next to creases, which it rounds. There
points are turned to their other side if the topology stays: the lattice is well-composed (Latecki 1997), so
that the cells whose corners differ are a manifold, and points are simple (Bertrand 1994).
"""

import math
from collections.abc import Generator
from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..arguments import Array
from .connectivity import Indices
from .indicator import CELLS_AT_ONCE, Indicator

CORNERS: Indices = np.array(list(np.ndindex(2, 2, 2)))  # Those of a cell, from its lowest.
AROUND: Indices = np.array(list(np.ndindex(3, 3, 3))) - 1  # A point and its neighbors.
CENTER = 13  # The point among these,
BESIDE = np.flatnonzero(np.abs(AROUND).sum(axis=1) == 1)  # and those next to it; opposite ones add up to 26.
# For each corner of a cell that the point may be, the corners of that cell among the neighbors, (8, 8).
CELLS = (CORNERS - CORNERS[:, None] + 1) @ (9, 3, 1)


class Lattice(NamedTuple):
    """Points of a lattice, as whole numbers, and their sides.

    indicator : the side of points that were not turned
    pitch : the length between points
    shape : the number of points along each axis
    turned : (n,), in order, the points that were turned to their other side
    """

    indicator: Indicator
    pitch: float
    shape: tuple[int, ...]
    turned: Indices

    @property
    def strides(self) -> Indices:
        """The differences of neighbors along each axis, (3,)."""
        return np.array([self.shape[1] * self.shape[2], self.shape[2], 1])

    def places(self, points: Indices) -> Array:
        """Where points (n,) are, (n, 3). Points beyond the first or the last are at that."""
        # The level of a flat sheet goes through the faces of the grid, and with it points that are turned.
        points = np.clip(points, 0, math.prod(self.shape) - 1)
        index = np.stack(np.unravel_index(points, self.shape), axis=1)
        return self.indicator.low + self.pitch * (index - 1.0)  # A layer is left for neighbors.

    def inside(self, points: Indices) -> NDArray[np.bool_]:
        """Whether points (...) are inside."""
        inside = (self.indicator.at(self.places(points.ravel())) > 0.0).reshape(points.shape)
        at = np.searchsorted(self.turned, points)
        return inside ^ (np.append(self.turned, -1)[at] == points)

    def turn(self, points: Indices) -> "Lattice":
        """The lattice with points (n,) on their other side."""
        return self._replace(turned=np.setxor1d(self.turned, points))

    def codes(self, cells: Indices) -> Indices:
        """The corners of cells (n,) that are inside, as bits, (n,). A cell is its lowest corner."""
        every: Indices = cells[:, None] + CORNERS @ self.strides
        corners, index = np.unique(every, return_inverse=True)
        return self.inside(corners)[index.reshape(-1, 8)] @ (1 << np.arange(8))

    def cells_around(self, points: Indices) -> Indices:
        """The cells with a corner among points (n,)."""
        return np.unique(points[:, None] - CORNERS @ self.strides)

    def edges_around(self, points: Indices) -> Indices:
        """The edges with an end among points (n,). An edge is three times its lower end plus its axis."""
        lower = np.stack([points[:, None] + 0 * self.strides, points[:, None] - self.strides])
        return np.unique(3 * lower + np.arange(3))

    def ends(self, edges: Indices) -> tuple[Indices, Indices]:
        """The lower and upper ends of edges (n,)."""
        lower, axis = np.divmod(edges, 3)
        return lower, lower + self.strides[axis]

    def crossed(self, edges: Indices) -> Indices:
        """Those of edges (n,) whose ends are on different sides."""
        one, other = self.ends(edges)
        return edges[self.inside(one) != self.inside(other)]


def lattice_at_level(indicator: Indicator, pitch: float) -> Generator[float, None, tuple[Lattice, Indices]]:
    """A well-composed lattice of a pitch, and its edges (n,) whose ends differ; yields 0 in between."""
    length, ratio = len(indicator.values), indicator.cell / pitch
    shape = tuple(int(np.ceil((count - 1) * ratio)) + 4 for count in indicator.values.shape)
    lattice, near_level = Lattice(indicator, pitch, shape, np.zeros(0, dtype=np.intp)), []
    rows = max(1, int(CELLS_AT_ONCE * length / (indicator.values.size * max(ratio, 1.0) ** 2)))
    for start in range(0, length - 1, rows):
        cells = _cells(indicator.values[start : start + rows + 1] > 0.0) + np.array([start, 0, 0])
        near_level.append(_edges_near(lattice, cells * ratio, (cells + 1) * ratio))
        yield 0.0
    edges = np.unique(np.concatenate(near_level))
    lattice = composed(lattice, lattice.cells_around(np.unique(lattice.ends(edges))))
    yield 0.0
    return lattice, lattice.crossed(np.union1d(edges, lattice.edges_around(lattice.turned)))


def _cells(inside: NDArray[np.bool_]) -> Indices:
    """The cells (n, 3) of a grid whose corners are on both sides."""
    every = some = inside
    for axis in range(3):
        before, after = ((slice(None),) * axis + (part,) for part in (slice(None, -1), slice(1, None)))
        every, some = every[before] & every[after], some[before] | some[after]
    return np.argwhere(some & ~every)


def _edges_near(lattice: Lattice, low: Array, high: Array) -> Indices:
    """The edges whose ends differ, of those that meet boxes from `low` to `high`, (n, 3) each, in pitches."""
    first, last = np.floor(low).astype(np.intp), np.floor(high).astype(np.intp) + 1
    steps = np.ndindex(tuple((last - first).max(axis=0, initial=0) + 1))
    near = [np.unique((np.minimum(first + step, last) + 1) @ lattice.strides) for step in steps]
    points = np.unique(np.concatenate(near))
    inside, ends = lattice.inside(points), points[:, None] + lattice.strides
    at = np.searchsorted(points, ends)
    crossed = (np.append(points, -1)[at] == ends) & (np.append(inside, False)[at] != inside[:, None])
    return (3 * points[:, None] + np.arange(3))[crossed]


def composed(lattice: Lattice, cells: Indices) -> Lattice:
    """The lattice with points turned inside until these cells (n,) and their neighbors are well-composed."""
    is_composed, corner = _cases()
    while len(cells):
        codes = lattice.codes(cells)
        bad = ~is_composed[codes]
        corners: Indices = cells[bad] + CORNERS[corner[codes[bad]]] @ lattice.strides
        points = np.unique(corners)
        lattice, cells = lattice.turn(points), lattice.cells_around(points)
    return lattice


def turned(lattice: Lattice, points: Indices) -> tuple[Lattice, Indices]:
    """The lattice with those of points (n,) turned that are simple, and these.

    A point is simple if the faces between it and its own side are one disk, and so are the others. Points
    are turned in eight classes, so that no two neighbors turn at once, and again until no other is simple.
    """
    before = lattice
    while len(points):
        count = len(points)
        for which in np.ndindex(2, 2, 2):
            parities = np.stack(np.unravel_index(points, lattice.shape), axis=1) % 2
            some = points[(parities == which).all(axis=1)]
            some = some[_are_simple(lattice, some)]
            lattice, points = lattice.turn(some), np.setdiff1d(points, some)
        if len(points) == count:
            break
    return lattice, np.setxor1d(lattice.turned, before.turned)


def _are_simple(lattice: Lattice, points: Indices) -> NDArray[np.bool_]:
    """Which of points (n,) are simple, and leave the lattice well-composed when they are turned."""
    around = lattice.inside(points[:, None] + AROUND @ lattice.strides)
    same = around[:, BESIDE] == around[:, CENTER, None]
    count, pairs = same.sum(axis=1), same[:, :3].astype(np.intp) + same[:, :2:-1]
    simple = (count > 0) & (count < 6)
    simple &= ~((count == 2) & (pairs == 2).any(axis=1)) & ~((count == 4) & (pairs == 0).any(axis=1))
    around[:, CENTER] ^= True
    return simple & _cases()[0][around[:, CELLS] @ (1 << np.arange(8))].all(axis=1)


@cache
def _cases() -> tuple[NDArray[np.bool_], Indices]:
    """For each set of corners inside, as bits, whether it is well-composed, and the corner to turn inside.

    It is not where the corners of one side on a face, or in the cell, are two opposite ones only.
    """

    def is_composed(code: int) -> bool:
        """Whether no side on a face or in the cell has two opposite corners only."""
        inside = [code >> corner & 1 for corner in range(8)]
        faces = [
            inside[c] == inside[c ^ a ^ b] and inside[c ^ a] == inside[c ^ b] and inside[c] != inside[c ^ a]
            for c in range(8)
            for a, b in ((1, 2), (1, 4), (2, 4))
        ]
        opposite = [1 << c | 1 << 7 - c for c in range(4)]
        return not any(faces) and code not in opposite and 255 - code not in opposite

    good, corner = np.array([is_composed(code) for code in range(256)]), np.zeros(256, dtype=np.intp)
    for code in np.flatnonzero(~good).tolist():
        outside = [c for c in range(8) if not code >> c & 1]
        corner[code] = next((c for c in outside if good[code | 1 << c]), outside[0])
    return good, corner
