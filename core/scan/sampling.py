# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Points on a surface, at random or evenly spaced, for touches all over it."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from ..arguments import Array

SORTED_AT_ONCE = 100_000  # This number of points is sorted at once (benchmarks.stability_map, e20b52a).
JAMMED = 0.575  # A square of the spacing has this many points when no more have room, see spaced_count.
# Only one point in each cell, this share of the spacing wide, is tested for its neighbors.
SAMPLING_CELL = 0.5


def spaced(points: Array, spacing: float, rng: np.random.Generator) -> Iterator[int | None]:
    """Yields indices of points (n, 3) that are no nearer to each other than `spacing`.

    They come in random order, until no more have room, so that a part of them covers the surface evenly, too.
    During longer work it yields None now and then.
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
    """About how many points `spaced` takes of a surface of this area with points everywhere.

    Disks with the spacing as diameter that are put at random until there is no room cover 0.547 of a plane
    (Feder 1980, Random sequential adsorption), which is 0.70 points in a square of the spacing. Taking one
    point of each cell, as `spaced` does, omits a sixth.
    """
    return max(1, round(JAMMED * area / spacing**2))


def scattered(
    points: Array, triangles: NDArray[np.intp], count: int, rng: np.random.Generator
) -> tuple[Array, Array]:
    """`count` random points of a mesh, uniform by area, and its unit normals there, (count, 3) each.

    points : (n, 3); triangles : (m, 3), counterclockwise from outside

    Raises ValueError for a mesh without area.
    """
    corner, second, third = (np.asarray(points[triangles[:, i]], dtype=float) for i in range(3))
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
    """The indices of the first of the points (n, 3) in each cell of a grid."""
    cells = np.floor(np.asarray(points, dtype=float) / size)
    cells -= cells.min(axis=0)
    across = cells.max(axis=0) + 1.0
    return np.unique((cells[:, 0] * across[1] + cells[:, 1]) * across[2] + cells[:, 2], return_index=True)[1]
