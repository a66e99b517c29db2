# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Patches of one object as tables, and joined: each becomes a spline through the contacts of all patches.

A single patch has only its own few curves.
"""

from collections.abc import Generator, Sequence

import numpy as np
from numpy.typing import NDArray

from ..arguments import SMALLEST, Array
from ..contours.contour import Contour
from ..reconstruction.result import Reconstruction
from ..steps import chunked
from ..triangles import normalized, row_dot
from .charts import AZIMUTHS, MARGIN, PLACES_AT_ONCE, Charts, Pairs
from .cubic_spline import SIDE
from .smoothing_spline import penalty, smoothing_spline

# python -m benchmarks.atlas chose these.
ALIGNED = 0.75  # A contact is on a patch if the cosine of the angle between their normals is at least this.
UNDOUBTED = 2.0  # A contact that is off a patch by fewer of its deviations weighs 1.
# This many times larger they count a radius beyond the rim. Without, the models rocker-arm and spot are off
LOOSER = 5.0  # by just over three tolerances.
FARTHEST = 3.0  # A contact that is off by more times UNDOUBTED is on another sheet.
LEAST_NOISE = 5e-4  # Contacts have at least this noise, as a share of the radius.
PATCHES_AT_ONCE = 2  # A step takes this many patches.
FARTHEST_RIM = 1.25  # A patch that is not flat counts up to this many radii of its domain.
KNOTS_WITHIN = 1.3  # Heights at knots are taken up to this many times the domain's radius.

Table = tuple[Array, float, Array, Array]  # Radii of the domain, half the side, coefficients, deviations.


def refit(
    contours: Sequence[list[Contour]],
    results: Sequence[Reconstruction],
    charts: Charts,
    noise: float,
    earlier: dict[int, tuple[int, Table]],
) -> Generator[float, None, Charts]:
    """The tables of patches fitted to all contacts on them. Yields the share that is done.

    charts : the tables of the same patches, fitted only to their own contacts
    earlier : for each patch that was joined before, the number of contacts near it and its table; changed in
        place. Contacts only come to others, so as many are the same ones
    """
    points, normals, owner = _contacts(contours)

    def pairs_of(some: Array, indices: NDArray[np.intp]) -> Pairs:
        """The pairs of some of the contacts, with the indices that these have among all."""
        pairs = charts.pairs(some)
        return pairs._replace(point_index=indices[pairs.point_index])

    every = np.arange(len(points))
    pairs = Pairs._make((yield from chunked(pairs_of, PLACES_AT_ONCE, 0.0, points, every)))
    penalty()  # Otherwise the first spline would take ten times as long as the others.
    yield 0.0
    by_patch = np.argsort(pairs.patch, kind="stable")
    yield 0.0
    bounds = np.searchsorted(pairs.patch[by_patch], np.arange(len(results) + 1))
    tables: list[Table] = []
    for i, r in enumerate(results):
        some = pairs.chosen(by_patch[bounds[i] : bounds[i + 1]])
        if i not in earlier or earlier[i][0] != len(some.point_index):
            table = _joined_table(r, charts.rims[i], some, points, normals, owner == i, noise)
            earlier[i] = len(some.point_index), table
        tables.append(earlier[i][1])
        if len(tables) % PATCHES_AT_ONCE == 0:
            yield len(tables) / len(results)
    return stacked(results, tables)


def _joined_table(
    r: Reconstruction,
    rim: Array,
    some: Pairs,
    points: Array,
    normals: Array,
    own: NDArray[np.bool_],
    noise: float,
) -> Table:
    """The table of a patch, fitted to those contacts among `some` that are likely to be on it."""
    half = _half(rim)
    least = max(noise / r.radius, LEAST_NOISE)
    likely = np.hypot(least, UNDOUBTED * r.mean_height_std / r.radius)
    likely = likely * (1.0 + LOOSER * np.maximum(some.rho - 1.0, 0.0))
    off = np.abs(some.distance) / (r.radius * likely)
    facing = row_dot(some.normal, normals[some.point_index]) > ALIGNED
    on = own[some.point_index] | ((off < FARTHEST) & facing)
    place = some.point_index[on]
    local = (points[place] - r.frame.origin) @ r.frame.axes / r.radius
    weights = 1.0 / np.maximum(off[on], 1.0) ** 2
    return rim, half, *smoothing_spline(local, normals[place] @ r.frame.axes, weights, half, least)


def _contacts(contours: Sequence[list[Contour]]) -> tuple[Array, Array, NDArray[np.intp]]:
    """All contacts and their unit normals, (n, 3) each, and the indices (n,) of the patches they are of."""
    flat = [(i, contour) for i, some in enumerate(contours) for contour in some]
    points = np.vstack([contour.points for _, contour in flat])
    normals = normalized(np.vstack([contour.normals for _, contour in flat]))  # type: ignore[misc]
    owner = np.repeat([i for i, _ in flat], [len(contour.points) for _, contour in flat])
    return points, normals, owner


def charts_of(results: Sequence[Reconstruction], deviations: bool = True) -> Charts:
    """The tables of patches, each fitted only to its own contacts; `deviations` may be left out, as 0."""
    return stacked(results, [tabulate(r, r.domain.radii(AZIMUTHS) / r.radius, deviations) for r in results])


def stacked(results: Sequence[Reconstruction], tables: Sequence[Table]) -> Charts:
    """The tables of patches put together."""
    rims, halves, heights, stds = (np.array(values) for values in zip(*tables, strict=True))
    return Charts(
        np.array([r.frame.origin for r in results]),
        np.array([r.frame.axes for r in results]),
        np.array([r.radius for r in results]),
        halves,
        heights,
        stds,
        rims,
    )


def tabulate(r: Reconstruction, rim: Array, deviations: bool) -> Table:
    """The table of a patch with this rim (AZIMUTHS,), in unit radius, fitted only to its own contacts.

    deviations : whether they are computed; otherwise they are 0
    """
    from scipy.ndimage import spline_filter

    half = _half(rim)
    x, y = (axis.ravel() for axis in np.meshgrid(*2 * [np.linspace(-half, half, SIDE)], indexing="ij"))
    at = np.arctan2(y, x) * (AZIMUTHS / (2.0 * np.pi))
    reach = np.interp(at, np.arange(AZIMUTHS), rim, period=AZIMUTHS)
    share = np.hypot(x, y) / np.maximum(reach, SMALLEST)  # A rim may end at the point.
    # Farther out a sextic runs away, and the spline would carry that inward.
    pull = r.radius * np.minimum(1.0, KNOTS_WITHIN / np.maximum(share, 1e-9))
    heights = r.height(pull * x, pull * y).reshape(SIDE, SIDE) / r.radius
    coarse = (pull * np.array([x, y])).reshape(2, SIDE, SIDE)[:, ::2, ::2]
    stds = r.height_std(*coarse) / r.radius if deviations else np.zeros(coarse[0].shape)
    return rim, half, spline_filter(heights, order=3, mode="mirror"), stds


def _half(rim: Array) -> float:
    """Half the side of the square of knots of a patch with this rim; the outermost are beyond it."""
    return float(MARGIN * rim.max()) * (SIDE - 1) / (SIDE - 3)
