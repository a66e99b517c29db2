# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Patches of one object are fitted again, each with what its neighbors felt inside it.

A patch alone knows its own few curves. Blended, such patches are farther off than a surface through all
contacts; with those of the neighbors they are nearer.
"""

from collections.abc import Generator, Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ..arguments import Array
from ..contours.contour import Contour
from ..reconstruction.from_contours import reconstruct_many
from ..reconstruction.result import Reconstruction
from .charts import Charts
from .tables import stacked, table_of

LAYER = 0.15  # of the radius, that a neighbor's contact is off the patch at most
FACING = 0.34  # cosine of the angle between its normal and the patch's, at least
AT_ONCE = 6  # patches in a step

Joining = Generator[float, None, tuple[list[Reconstruction], Charts]]


def joined(
    contours: Sequence[list[Contour]], results: Sequence[Reconstruction], charts: Charts, noise: float
) -> Joining:
    """The patches fitted again, and their charts; yields the share that is done."""
    strokes = neighbors_contacts(contours, charts)
    found: list[Reconstruction] = []
    tables = []
    for start in range(0, len(results), AT_ONCE):
        some = slice(start, start + AT_ONCE)
        fits = reconstruct_many(
            [r.frame.origin for r in results[some]],  # type: ignore[arg-type]
            contours[some],
            outward=[r.frame.axes[:, 2] for r in results[some]],  # type: ignore[arg-type]
            strokes_list=[[points] if len(points) else [] for points in strokes[some]],
            noise=noise,
        )
        for old, new in zip(results[some], fits, strict=True):
            found.append(new if isinstance(new, Reconstruction) else old)
            tables.append(table_of(found[-1]))
        yield len(found) / len(results)
    return found, stacked(found, tables)


def neighbors_contacts(contours: Sequence[list[Contour]], charts: Charts) -> list[Array]:
    """For each patch the contacts (m, 3) that others have inside its domain, on its wall."""
    points, normals, owner = _contacts(contours)
    pairs = charts.pairs(points)
    on = (pairs.share <= 1.0) & (pairs.node != owner[pairs.place])
    on &= np.abs(pairs.distance) < LAYER * charts.radii[pairs.node]
    on &= np.einsum("mi,mi->m", pairs.normal, normals[pairs.place]) > FACING
    order = np.argsort(pairs.node[on], kind="stable")
    bounds = np.searchsorted(pairs.node[on][order], np.arange(len(charts.radii) + 1))
    place = pairs.place[on][order]
    return [points[place[a:b]] for a, b in pairwise(bounds)]


def _contacts(contours: Sequence[list[Contour]]) -> tuple[Array, Array, NDArray[np.intp]]:
    """All contacts, their normals, (n, 3), and whose they are, (n,)."""
    flat = [(i, contour) for i, some in enumerate(contours) for contour in some]
    points = np.vstack([contour.points for _, contour in flat])
    normals = np.vstack([contour.normals for _, contour in flat])  # type: ignore[misc]
    owner = np.repeat([i for i, _ in flat], [len(contour.points) for _, contour in flat])
    return points, normals, owner
