# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Points at random or of an even spacing: where to touch, for touches all over a surface."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from ..arguments import Array

SORTED_AT_ONCE = 100_000  # points that are sorted at once (benchmarks.stability_map)
JAMMED = 0.575  # points in a square of the spacing, once no more have room
SAMPLING_CELL = 0.5  # Share of the spacing: only one point in each cell is asked for its neighbors.


def spaced(points: Array, spacing: float, rng: np.random.Generator) -> Iterator[int | None]:
    """Yields indices of points (n, 3) none of which are nearer to each other than `spacing`.

    They come in random order, so that a part of them is an even cover too, until no more have room. It
    yields None now and then during longer work.
    """
    from scipy.spatial import cKDTree

    left = []
    for start in range(0, len(points), SORTED_AT_ONCE):
        left.append(start + _one_a_cell(points[start : start + SORTED_AT_ONCE], SAMPLING_CELL * spacing))
        yield None
    chosen = np.concatenate(left)
    chosen = rng.permutation(chosen[_one_a_cell(points[chosen], SAMPLING_CELL * spacing)])
    yield None
    tree = cKDTree(points[chosen])
    yield None
    free = np.ones(len(chosen), dtype=bool)
    for i, index in enumerate(chosen.tolist()):
        if free[i]:
            free[tree.query_ball_point(tree.data[i], spacing)] = False
            yield index


def spaced_count(area: float, spacing: float) -> int:
    """How many points `spaced` takes, about, of a surface of that area with points everywhere.

    Disks of half the spacing, put at random where there is room, come to cover 0.547 of a plane (Feder 1980,
    Random sequential adsorption), or 0.70 points in a square of the spacing; the grid leaves out a sixth.
    """
    return max(1, round(JAMMED * area / spacing**2))


def scattered(
    points: Array, triangles: NDArray[np.intp], count: int, rng: np.random.Generator
) -> tuple[Array, Array]:
    """`count` random points of a mesh, evenly by area, and its unit normals there, (count, 3) each.

    points : (n, 3); triangles : (m, 3), counterclockwise from outside

    Raises ValueError for a mesh without area.
    """
    corner, second, third = (points[triangles[:, i]] for i in range(3))
    sides = second - corner, third - corner
    normals = np.cross(*sides)
    areas = np.linalg.norm(normals, axis=1)
    if not areas.sum() > 0.0:
        raise ValueError("triangles: expected some with an area, got none")
    chosen = rng.choice(len(areas), count, p=areas / areas.sum())
    shares = rng.random((count, 2))
    shares = np.where(shares.sum(axis=1, keepdims=True) > 1.0, 1.0 - shares, shares)
    along = (share[:, None] * side[chosen] for share, side in zip(shares.T, sides, strict=True))
    return sum(along, corner[chosen]), normals[chosen] / areas[chosen, None]


def _one_a_cell(points: Array, size: float) -> NDArray[np.intp]:
    """The first of the points (n, 3) in each cell of a grid."""
    cells = np.floor(points / size)
    cells -= cells.min(axis=0)
    across = cells.max(axis=0) + 1.0
    return np.unique((cells[:, 0] * across[1] + cells[:, 1]) * across[2] + cells[:, 2], return_index=True)[1]
