# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Patches of one object as tables, and joined: each becomes a spline through the contacts of all patches.

A patch alone knows only its own few curves. Where patches overlap, they are moved until they agree.
"""

from collections.abc import Generator, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..arguments import Array
from ..contours.contour import Contour
from ..contours.finger import FACING
from ..patch.cubic_spline import SIDE, between
from ..patch.smoothing_spline import smoothing_spline
from ..reconstruction.result import Reconstruction
from .charts import AZIMUTHS, MARGIN, Charts, Pairs
from .field import LAYER, Blend, Felt, blended, least_of

# python -m benchmarks.atlas chose these.
ALIGNED = 0.75  # A contact is on a patch if the cosine of the angle between their normals is at least this.
UNDOUBTED = 2.0  # A contact that is off a patch by fewer of its deviations weighs 1.
LOOSER = 5.0  # So many times larger they count a radius beyond the rim, where a patch is less certain.
FARTHEST = 3.0  # A contact that is off by more times UNDOUBTED is on another wall.
LEAST_NOISE = 5e-4  # Contacts have at least this noise, as a share of the radius.
PATCHES_AT_ONCE, PLACES_AT_ONCE = 2, 1500  # A step takes so many patches, or so many places.
KNOTS_WITHIN = 1.3  # A patch is asked for heights at knots up to so many times its domain's radius.
ROUNDS = 2  # Patches are moved so often.
MOVED = 0.03  # A place of a patch is moved by less than this share of the radius.
ASKEW = 0.3  # The field contradicts a contact if it is off its tangent plane by this share of the way to it.
SURE = 0.7  # A place that is off a contact's plane by this share of the way to it is surely on that side.
UNEQUAL = 0.25  # Between ends whose distances differ by more, only contacts tell how far out a patch goes.
NEAR = 4  # Contacts tell so many azimuths to both sides of them.
NEARER = 0.5  # A patch of the contact's wall is off that plane by at most this share of what the field is.

Table = tuple[Array, float, Array, Array]  # Radii of the domain, half the side, coefficients, deviations.
Joining = Generator[float, None, Charts]


def felt_by(results: Sequence[Reconstruction], charts: Charts) -> Felt:
    """The contacts that patches were fitted to; `charts` are the tables of these patches."""
    from scipy.spatial import cKDTree

    parts = [np.vstack([r.strokes, *(contour.points for contour in r.contours)]) for r in results]
    points, node = np.vstack(parts), np.repeat(np.arange(len(parts)), [len(part) for part in parts])
    x, y, _ = charts.local(points, np.arange(len(points)), node)
    return Felt(points, charts.world(node, x, y)[1], node, cKDTree(points))


def told(charts: Charts, felt: Felt, points: Array, room: float = 0.0) -> Blend:
    """The field at places (k, 3): that of `blended`, where the nearest contact does not contradict it.

    Near an edge, patches alone do not tell whether the inside is in both walls or in either. Contacts are on
    the surface: if the nearest one contradicts the field, and is inside the wall that the field took, the
    inside is in both that wall and the contact's; if it is outside of it, in either.

    Beyond the rims of all patches contacts tell alone, where no patch reaches or the nearest contact is for
    certain on the other side. There the deviation is inf, unless a contact is as near as a patch would reach.
    """
    field = blended(charts, points, room)
    away, nearest = felt.tree.query(points)
    plane = np.einsum("ki,ki->k", points - felt.points[nearest], felt.normals[nearest])
    _take_walls(charts, felt, field, points, nearest, plane, away)
    against = ((plane < 0.0) != (field.distance < 0.0)) & (np.abs(plane) > SURE * away)
    alone = np.flatnonzero((field.node < 0) | (against & ~np.isfinite(field.std)))
    node, away = felt.node[nearest[alone]], away[alone]
    field.distance[alone], field.normal[alone] = felt.told_alone(points[alone])
    near = np.hypot(charts.mean_stds[node], away)
    field.std[alone] = np.where(away < LAYER * charts.radii[node], near, np.inf)
    field.node[alone] = node
    return field


def _take_walls(
    charts: Charts,
    felt: Felt,
    field: Blend,
    points: Array,
    nearest: NDArray[np.intp],
    plane: Array,
    away: Array,
) -> None:
    """Changes the field where the nearest contacts, which are `away` by so much, contradict it."""
    off = np.abs(field.distance - plane)
    some = np.flatnonzero((off > ASKEW * away) & (field.node >= 0))
    pairs = charts.pairs(points[some])
    miss = np.abs(pairs.distance - plane[some[pairs.place]])
    pair = least_of(pairs.place, miss, len(some))
    pair = pair[pair >= 0]
    other = pairs.chosen(pair[miss[pair] < NEARER * off[some[pairs.place[pair]]]])
    at = some[other.place]
    contacts, node = felt.points[nearest[at]], field.node[at]
    feet, normals = charts.world(node, *charts.local(contacts, np.arange(len(at)), node)[:2])
    inside = np.einsum("ki,ki->k", contacts - feet, normals) < 0.0
    takes = inside == (other.distance > field.distance[at])
    for values, better in zip(field, (other.distance, other.std, other.normal, other.node), strict=True):
        values[at[takes]] = better[takes]


def joined(
    contours: Sequence[list[Contour]],
    results: Sequence[Reconstruction],
    charts: Charts,
    noise: float,
    known: dict[int, tuple[int, Table]],
) -> Joining:
    """The tables of patches fitted to all contacts on them. Yields the share that is done.

    charts : the tables of the same patches, fitted to their own contacts alone
    known : number of contacts and table of each patch that was joined before; changed in place
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
    return stacked(results, tables)


def _joined_table(
    r: Reconstruction, some: Pairs, points: Array, normals: Array, own: NDArray[np.bool_], noise: float
) -> Table:
    """The table of a patch, fitted to those contacts among `some` that are likely to be on it."""
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
    sure = r.domain.radii(AZIMUTHS, UNEQUAL) / r.radius  # The domain may bulge beyond a crease.
    return np.maximum(sure, np.minimum(rim, _felt_to(local))), half, *found


def _felt_to(local: Array) -> Array:
    """How far out contacts (n, 3), in the frame of a patch and in unit radius, are near each azimuth."""
    at = np.rint(np.arctan2(local[:, 1], local[:, 0]) * (AZIMUTHS / (2.0 * np.pi))).astype(np.intp)
    out = np.zeros(AZIMUTHS)
    np.maximum.at(out, at % AZIMUTHS, np.hypot(local[:, 0], local[:, 1]))
    found: Array = np.maximum.reduce([np.roll(out, step) for step in range(-NEAR, NEAR + 1)])
    return found


def agreed(charts: Charts) -> Joining:
    """The patches moved onto the blend of all of them, as often as ROUNDS; yields 1 after each part."""
    from scipy.ndimage import spline_filter

    x, y = charts.knots().reshape(2, -1)
    node = np.repeat(np.arange(len(charts.radii)), SIDE**2)
    asked = np.flatnonzero(charts.shares(x, y, node) < KNOTS_WITHIN)
    for _ in range(ROUNDS):
        moves = np.zeros(charts.heights.shape)
        for start in range(0, len(asked), PLACES_AT_ONCE):
            some = asked[start : start + PLACES_AT_ONCE]
            moves.ravel()[some] = _move(charts, node[some], x[some], y[some])
            yield 1.0
        # The outermost knots are beyond the spline, without a height: they move like those beside them.
        every = (np.pad(move[1:-1, 1:-1], 1, mode="edge") for move in moves)
        change = np.array([spline_filter(move, order=3, mode="mirror") for move in every])
        charts = replace(charts, heights=charts.heights + change)
    return charts


def _move(charts: Charts, node: NDArray[np.intp], x: Array, y: Array) -> Array:
    """How far patches (k,) have to move above local (x, y), in unit radius, to lie on the blend."""
    points, _ = charts.world(node, x, y)
    field = blended(charts, points)
    up = np.einsum("ki,ki->k", field.normal, charts.axes[node, :, 2])
    move = -field.distance / np.maximum(up, FACING) / charts.radii[node]
    on = (field.node >= 0) & (up > FACING) & (np.abs(move) < MOVED)
    return np.where(on, move, 0.0)


def _contacts(contours: Sequence[list[Contour]]) -> tuple[Array, Array, NDArray[np.intp]]:
    """All contacts and their unit normals, (n, 3) each, and the indices (n,) of the patches they are of."""
    flat = [(i, contour) for i, some in enumerate(contours) for contour in some]
    points = np.vstack([contour.points for _, contour in flat])
    normals = np.vstack([contour.normals for _, contour in flat])  # type: ignore[misc]
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300)
    owner = np.repeat([i for i, _ in flat], [len(contour.points) for _, contour in flat])
    return points, normals, owner


def charts_of(results: Sequence[Reconstruction], deviations: bool = True) -> Charts:
    """The tables of patches, each fitted to its own contacts alone; `deviations` may be left out, as 0."""
    return stacked(results, [table_of(r, deviations) for r in results])


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


def table_of(r: Reconstruction, deviations: bool) -> Table:
    """The table of a patch fitted to its own contacts alone."""
    from scipy.ndimage import spline_filter

    rim, half = _square(r)
    x, y = (axis.ravel() for axis in np.meshgrid(*2 * [np.linspace(-half, half, SIDE)], indexing="ij"))
    at = np.arctan2(y, x) * (AZIMUTHS / (2.0 * np.pi)) % AZIMUTHS
    share = np.hypot(x, y) / np.interp(at, np.arange(AZIMUTHS + 1), np.append(rim, rim[0]))
    # Farther out a sextic runs away, and the spline would carry that inward.
    pull = r.radius * np.minimum(1.0, KNOTS_WITHIN / np.maximum(share, 1e-9))
    heights = r.height(pull * x, pull * y).reshape(SIDE, SIDE) / r.radius
    stds = _stds(r, pull * x, pull * y) if deviations else np.zeros((SIDE, SIDE))
    return rim, half, spline_filter(heights, order=3, mode="mirror"), stds


def _square(r: Reconstruction) -> tuple[Array, float]:
    """The domain's radii, and half the side of the square of knots, whose outermost are beyond the patch."""
    rim = r.domain.radii(AZIMUTHS) / r.radius
    return rim, float(MARGIN * rim.max()) * (SIDE - 1) / (SIDE - 3)


def _stds(r: Reconstruction, x: Array, y: Array) -> Array:
    """Deviations (SIDE, SIDE), computed at every other knot, because they are smooth and cost the most."""
    coarse = slice(None, None, 2)
    x, y = x.reshape(SIDE, SIDE)[coarse, coarse], y.reshape(SIDE, SIDE)[coarse, coarse]
    return between(r.height_std(x.ravel(), y.ravel()).reshape(x.shape) / r.radius)
