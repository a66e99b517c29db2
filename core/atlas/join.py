# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Patches of one object, fitted again with what their neighbors felt inside them, and made tables.

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
from .charts import AZIMUTHS, MARGIN, SIDE, Charts

LAYER = 0.15  # of the radius, that a neighbor's contact is off the patch at most
FACING = 0.34  # cosine of the angle between its normal and the patch's, at least
SURE, DEVIATIONS = 0.8, 1.2816  # quantile of |dz|, and how many standard deviations that is
BETWEEN = 2.0  # times that between the contacts, for at them the fit has taken some of it; benchmarks.atlas
AT_ONCE, LOOK = 6, 1500  # patches, and contacts of all, in a step

Table = tuple[Array, float, Array, Array]  # radii of the domain, half the side, coefficients, deviations
Joining = Generator[float, None, tuple[list[Reconstruction], Charts]]


def joined(
    contours: Sequence[list[Contour]], results: Sequence[Reconstruction], charts: Charts, noise: float
) -> Joining:
    """The patches fitted again, and their charts; yields the share that is done."""
    strokes = yield from neighbors_contacts(contours, charts)
    found: list[Reconstruction] = []
    tables: list[Table] = []
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
            tables.append(table_of(found[-1], unexplained(found[-1], strokes[len(tables)], noise)))
        yield len(found) / len(results)
    return found, stacked(found, tables)


def unexplained(r: Reconstruction, strokes: Array, noise: float) -> float:
    """How far contacts are off a patch beyond their noise: texture that a fit takes for noise.

    Off all contacts, not their means; by the quantile of SURE, which outlying ones do not change.
    """
    x, y, z = np.vstack([r.contacts, r.frame.to_local(strokes)]).T
    off = float(np.quantile(np.abs(r.height(x, y) - z), SURE)) / DEVIATIONS
    return BETWEEN * float(np.sqrt(max(off**2 - noise**2, 0.0)))


def neighbors_contacts(
    contours: Sequence[list[Contour]], charts: Charts
) -> Generator[float, None, list[Array]]:
    """For each patch the contacts (m, 3) that others have inside its domain, on its wall; yields 0."""
    points, normals, owner = _contacts(contours)
    nodes, places = [], []
    for start in range(0, len(points), LOOK):
        pairs = charts.pairs(points[start : start + LOOK])
        place = start + pairs.place
        on = (pairs.share <= 1.0) & (pairs.node != owner[place])
        on &= np.abs(pairs.distance) < LAYER * charts.radii[pairs.node]
        on &= np.einsum("mi,mi->m", pairs.normal, normals[place]) > FACING
        nodes.append(pairs.node[on])
        places.append(place[on])
        yield 0.0
    node, place = np.concatenate(nodes), np.concatenate(places)
    order = np.argsort(node, kind="stable")
    bounds = np.searchsorted(node[order], np.arange(len(charts.radii) + 1))
    return [points[place[order[a:b]]] for a, b in pairwise(bounds)]


def _contacts(contours: Sequence[list[Contour]]) -> tuple[Array, Array, NDArray[np.intp]]:
    """All contacts, their normals, (n, 3), and whose they are, (n,)."""
    flat = [(i, contour) for i, some in enumerate(contours) for contour in some]
    points = np.vstack([contour.points for _, contour in flat])
    normals = np.vstack([contour.normals for _, contour in flat])  # type: ignore[misc]
    owner = np.repeat([i for i, _ in flat], [len(contour.points) for _, contour in flat])
    return points, normals, owner


def charts_of(results: Sequence[Reconstruction], deviations: bool = True) -> Charts:
    """Patches as tables; or without their deviations, which cost most."""
    return stacked(results, [table_of(r, 0.0 if deviations else None) for r in results])


def stacked(results: Sequence[Reconstruction], tables: Sequence[Table]) -> Charts:
    """Patches with their tables."""
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


def table_of(r: Reconstruction, beside: float | None) -> Table:
    """The table of a patch, with a deviation beside its own; with none at all for None."""
    from scipy.ndimage import spline_filter

    rim = _rim(r)
    half = float(1.05 * MARGIN * rim.max()) * (SIDE - 1) / (SIDE - 5)  # with knots beside for the spline
    knots = np.linspace(-half, half, SIDE)
    x, y = (axis.ravel() for axis in np.meshgrid(knots, knots, indexing="ij"))
    at = np.arctan2(y, x) * (AZIMUTHS / (2.0 * np.pi)) % AZIMUTHS
    share = np.hypot(x, y) / np.interp(at, np.arange(AZIMUTHS + 1), np.append(rim, rim[0]))
    # A sextic that is asked farther out runs away, and the spline would carry that inward.
    pull = r.radius * np.minimum(1.0, 1.3 / np.maximum(share, 1e-9))
    heights = r.height(pull * x, pull * y).reshape(SIDE, SIDE) / r.radius
    stds = np.zeros((SIDE, SIDE))
    if beside is not None:
        stds = np.hypot(_stds(r, pull * x, pull * y), beside / r.radius)
    return rim, half, spline_filter(heights, order=3, mode="mirror"), stds


def _rim(r: Reconstruction) -> Array:
    """The domain's radii (AZIMUTHS,), in unit radius, nowhere farther than curves beside went.

    Between ends at very different distances the spline swings out to where nothing was felt.
    """
    ends = r.domain.ends / r.radius
    turns = 2.0 * np.pi * np.arange(AZIMUTHS) / AZIMUTHS
    between = np.interp(turns, np.arctan2(ends[:, 1], ends[:, 0]), np.hypot(*ends.T), period=2.0 * np.pi)
    spline = np.linalg.norm(r.domain.boundary(AZIMUTHS), axis=1) / r.radius
    rim: Array = np.minimum(spline, between)
    return rim


def _stds(r: Reconstruction, x: Array, y: Array) -> Array:
    """Deviations (SIDE, SIDE) from every other knot: they are smooth, and cost the most."""
    coarse = slice(None, None, 2)
    x, y = x.reshape(SIDE, SIDE)[coarse, coarse], y.reshape(SIDE, SIDE)[coarse, coarse]
    some = r.height_std(x.ravel(), y.ravel()).reshape(x.shape) / r.radius
    full = np.empty((SIDE, SIDE))
    full[coarse, coarse] = some
    full[1::2, coarse] = 0.5 * (some[:-1] + some[1:])
    full[:, 1::2] = 0.5 * (full[:, :-2:2] + full[:, 2::2])
    return full
