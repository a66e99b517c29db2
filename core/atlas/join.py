# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Patches of one object as tables, and joined: each a spline through all contacts on it, of all patches.

A patch alone knows its own few curves, and the blend of such patches is farther off than a surface through
all contacts. Where patches overlap they are made to agree.
"""

from collections.abc import Generator, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..arguments import Array
from ..contours.contour import Contour
from ..patch.smoothing_spline import SIDE, between, smoothing_spline
from ..reconstruction.result import Reconstruction
from .charts import AZIMUTHS, MARGIN, Charts, Pairs
from .field import FACING, Blend, blended

# python -m benchmarks.atlas chose these.
ALIGNED = 0.75  # cosine of the angle between a contact's normal and the patch's there, at least
UNDOUBTED = 2.0  # deviations of a patch: a contact that is off by fewer weighs 1
LOOSER = 5.0  # how much larger they are a radius beyond the rim, where a patch alone is less certain
FARTHEST = 3.0  # times that: a contact farther off is of another wall
LEAST_NOISE = 5e-4  # share of the radius
PATCHES_AT_ONCE, PLACES_AT_ONCE = 4, 1500  # patches, and contacts or other places of all, in a step
KNOTS_WITHIN = 1.3  # times a domain's radius: how far out heights are asked at knots
MOVED = 0.03  # share of the radius: a place of a patch is moved by less
ASKEW = 0.3  # share of the way to a contact: how far the field may be off the contact's tangent plane
AROUND = 2.0  # times the room: how near a contact tells alone,
SURE = 0.5  # if the place is off its plane by this share of the way to it
NEARER = 0.5  # share of how far the field is off that plane, that a patch of the contact's wall is at most

Table = tuple[Array, float, Array, Array]  # radii of the domain, half the side, coefficients, deviations
Joining = Generator[float, None, Charts]


class Felt(NamedTuple):
    """Contacts and normals of their patches there, (n, 3), indices of these patches (n,), and a tree."""

    points: Array
    normals: Array
    node: NDArray[np.intp]
    tree: Any


def felt_by(results: Sequence[Reconstruction], charts: Charts) -> Felt:
    """The contacts of patches."""
    from scipy.spatial import cKDTree

    parts = [np.vstack([r.strokes, *(contour.points for contour in r.contours)]) for r in results]
    points, node = np.vstack(parts), np.repeat(np.arange(len(parts)), [len(part) for part in parts])
    x, y, _ = charts.local(points, np.arange(len(points)), node).T
    return Felt(points, charts.world(node, x, y)[1], node, cKDTree(points))


def told(charts: Charts, felt: Felt, points: Array, room: float = 0.0) -> Blend:
    """The field at places (k, 3), as `blended` has it where no contact contradicts that.

    Near an edge, patches alone do not tell whether the inside is in both walls or in either. Contacts are on
    the surface: if the nearest one contradicts the field, and is inside the wall that the field took, the
    inside is in both that wall and the contact's; if it is outside of it, in either. Beyond a corner that no
    patch reaches, the nearest contact's plane tells the side of a place within a few times `room`, a length.
    """
    field = blended(charts, points, room)
    away, nearest = felt.tree.query(points)
    plane = np.einsum("ki,ki->k", points - felt.points[nearest], felt.normals[nearest])
    off = np.abs(field.distance - plane)
    some = np.flatnonzero((off > ASKEW * away) & (field.node >= 0))
    pairs = charts.pairs(points[some], room)
    pairs = pairs.chosen(pairs.share < MARGIN)
    miss = np.abs(pairs.distance - plane[some[pairs.place]])
    order = np.lexsort((miss, pairs.place))
    pair = order[np.flatnonzero(np.diff(pairs.place[order], prepend=-1))]
    other = pairs.chosen(pair[miss[pair] < NEARER * off[some[pairs.place[pair]]]])
    at = some[other.place]
    inside = _inside(charts, field.node[at], felt.points[nearest[at]])
    takes = inside == (other.distance > field.distance[at])
    for values, better in zip(field, (other.distance, other.std, other.normal, other.node), strict=True):
        values[at[takes]] = better[takes]
    alone = (field.node < 0) & (away < AROUND * room) & (np.abs(plane) > SURE * away)
    field.distance[alone], field.node[alone] = plane[alone], felt.node[nearest[alone]]
    return field


def _inside(charts: Charts, node: NDArray[np.intp], points: Array) -> NDArray[np.bool_]:
    """Whether points (k, 3) are below one patch each."""
    x, y, _ = charts.local(points, np.arange(len(points)), node).T
    feet, normals = charts.world(node, x, y)
    below: NDArray[np.bool_] = np.einsum("ki,ki->k", points - feet, normals) < 0.0
    return below


def joined(
    contours: Sequence[list[Contour]],
    results: Sequence[Reconstruction],
    charts: Charts,
    noise: float,
    known: dict[int, tuple[int, Table]],
) -> Joining:
    """The charts of patches by all contacts on them; `charts` know but their own. Yields the share done.

    known : for patches that were joined before, the number of contacts and the table; changed in place
    """
    points, normals, owner = _contacts(contours)
    parts = []
    for start in range(0, len(points), PLACES_AT_ONCE):
        part = charts.pairs(points[start : start + PLACES_AT_ONCE])
        parts.append(part._replace(place=start + part.place))
        yield 0.0
    pairs = Pairs(*(np.concatenate(values) for values in zip(*parts, strict=True)))
    each = np.argsort(pairs.node, kind="stable")
    bounds = np.searchsorted(pairs.node[each], np.arange(len(results) + 1))
    tables: list[Table] = []
    for i, r in enumerate(results):
        some = pairs.chosen(each[bounds[i] : bounds[i + 1]])
        if i not in known or known[i][0] != len(some.place):
            table = _joined_table(r, some, points, normals, owner == i, noise)
            known[i] = len(some.place), table
        tables.append(known[i][1])
        if len(tables) % PATCHES_AT_ONCE == 0:
            yield len(tables) / len(results)
    return (yield from _agreed(stacked(results, tables)))


def _joined_table(
    r: Reconstruction, some: Pairs, points: Array, normals: Array, own: NDArray[np.bool_], noise: float
) -> Table:
    """The table of a patch with those contacts of `some` that are likely to be on it."""
    rim, half = _square(r)
    least = max(noise / r.radius, LEAST_NOISE)
    likely = np.hypot(least, UNDOUBTED * r.mean_height_std / r.radius)
    likely = likely * (1.0 + LOOSER * np.maximum(some.share - 1.0, 0.0))
    off = np.abs(some.distance) / (r.radius * likely)
    facing = np.einsum("mi,mi->m", some.normal, normals[some.place]) > ALIGNED
    on = own[some.place] | ((off < FARTHEST) & facing)
    place = some.place[on]
    local = (points[place] - r.frame.origin) @ r.frame.axes / r.radius
    weights = 1.0 / np.maximum(off[on], 1.0) ** 2
    found = smoothing_spline(local, normals[place] @ r.frame.axes, weights, half, least)
    return rim, half, *found


def _agreed(charts: Charts) -> Joining:
    """Patches moved onto the surface that all of them make; yields 1."""
    from scipy.ndimage import spline_filter

    x, y = charts.knots().reshape(2, -1)
    node = np.repeat(np.arange(len(charts.radii)), SIDE**2)
    asked = np.flatnonzero(charts.shares(x, y, node) < KNOTS_WITHIN)
    moves = np.zeros(charts.heights.size)
    for start in range(0, len(asked), PLACES_AT_ONCE):
        some = asked[start : start + PLACES_AT_ONCE]
        moves[some] = _move(charts, node[some], x[some], y[some])
        yield 1.0
    each = moves.reshape(charts.heights.shape)
    change = np.array([spline_filter(move, order=3, mode="mirror") for move in each])
    return replace(charts, heights=charts.heights + change)


def _move(charts: Charts, node: NDArray[np.intp], x: Array, y: Array) -> Array:
    """How far patches are from the surface of all above local (x, y), along their axes and in unit radius."""
    points, _ = charts.world(node, x, y)
    field = blended(charts, points)
    up = np.einsum("ki,ki->k", field.normal, charts.axes[node, :, 2])
    move = -field.distance / np.maximum(up, FACING) / charts.radii[node]
    on = (field.node >= 0) & (up > FACING) & (np.abs(move) < MOVED)
    return np.where(on, move, 0.0)


def _contacts(contours: Sequence[list[Contour]]) -> tuple[Array, Array, NDArray[np.intp]]:
    """All contacts, their unit normals, (n, 3), and whose they are, (n,)."""
    flat = [(i, contour) for i, some in enumerate(contours) for contour in some]
    points = np.vstack([contour.points for _, contour in flat])
    normals = np.vstack([contour.normals for _, contour in flat])  # type: ignore[misc]
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300)
    owner = np.repeat([i for i, _ in flat], [len(contour.points) for _, contour in flat])
    return points, normals, owner


def charts_of(results: Sequence[Reconstruction], deviations: bool = True) -> Charts:
    """Patches alone as tables; without their deviations where these, which cost most, are not asked for."""
    return stacked(results, [table_of(r, deviations) for r in results])


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


def table_of(r: Reconstruction, deviations: bool) -> Table:
    """The table of a patch alone."""
    from scipy.ndimage import spline_filter

    rim, half = _square(r)
    knots = np.linspace(-half, half, SIDE)
    x, y = (axis.ravel() for axis in np.meshgrid(knots, knots, indexing="ij"))
    at = np.arctan2(y, x) * (AZIMUTHS / (2.0 * np.pi)) % AZIMUTHS
    share = np.hypot(x, y) / np.interp(at, np.arange(AZIMUTHS + 1), np.append(rim, rim[0]))
    # A sextic that is asked farther out runs away, and the spline would carry that inward.
    pull = r.radius * np.minimum(1.0, KNOTS_WITHIN / np.maximum(share, 1e-9))
    heights = r.height(pull * x, pull * y).reshape(SIDE, SIDE) / r.radius
    stds = _stds(r, pull * x, pull * y) if deviations else np.zeros((SIDE, SIDE))
    return rim, half, spline_filter(heights, order=3, mode="mirror"), stds


def _square(r: Reconstruction) -> tuple[Array, float]:
    """The domain's radii, and half the side of the square of knots, which leaves a margin for the spline."""
    rim = _rim(r)
    return rim, float(1.05 * MARGIN * rim.max()) * (SIDE - 1) / (SIDE - 5)


def _rim(r: Reconstruction) -> Array:
    """The domain's radii (AZIMUTHS,), in unit radius, nowhere larger than the curves on either side are long.

    Between ends at very different distances the spline swings out to where nothing was felt.
    """
    ends = r.domain.ends / r.radius
    turns = 2.0 * np.pi * np.arange(AZIMUTHS) / AZIMUTHS
    between = np.interp(turns, np.arctan2(ends[:, 1], ends[:, 0]), np.hypot(*ends.T), period=2.0 * np.pi)
    spline = np.linalg.norm(r.domain.boundary(AZIMUTHS), axis=1) / r.radius
    rim: Array = np.minimum(spline, between)
    return rim


def _stds(r: Reconstruction, x: Array, y: Array) -> Array:
    """Deviations (SIDE, SIDE), found at every other knot: they are smooth, and cost the most."""
    coarse = slice(None, None, 2)
    x, y = x.reshape(SIDE, SIDE)[coarse, coarse], y.reshape(SIDE, SIDE)[coarse, coarse]
    return between(r.height_std(x.ravel(), y.ravel()).reshape(x.shape) / r.radius)
