# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""One surface of many patches: a partition of unity of their signed distances, and its deviation.

Only patches that face one way at a place are blended there. Others are its other walls: of two that face away
from each other the inside is in both (a crease, a thin wall), of two that face each other it is in either (a
valley, a gap). Beside the paper; weights are those of Ohtake et al. 2003, over the variance of each patch.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..arguments import Array
from .charts import MARGIN, Charts, Pairs

OUTERMOST = 0.999  # of MARGIN, at which a weight stays: no more than that is one beyond it
FLOOR = 1e-3  # share of the radius: no smaller deviation counts in a weight
AGREE, FACING = 0.64, 0.34  # cosines of 50 and 70 degrees: a patch fades out of a blend, faces another way
LAYER = 0.15  # share of the radius by which places of one wall differ in height at most
SLANT = 0.5  # share of their distance from it, which is added
INSIDE = 1.0  # of a domain's radius: farther out a place is not covered
WALLS = 3  # that meet at a place
WELL_INSIDE = 0.8  # share of a domain's radius


class Blend(NamedTuple):
    """For k places: signed distance and std (k,), gradient (k, 3), the patch of most weight (k,).

    Where no patch reaches, the distance is 0, the deviation inf and the patch -1.
    """

    distance: Array
    std: Array
    normal: Array
    node: NDArray[np.intp]


def blended(charts: Charts, points: Array, room: float = 0.0) -> Blend:
    """The field at places (k, 3); `room` is a length that patches reach at least.

    Beyond its rim a patch tells on which side of it a place is, where no other does.
    """
    pairs = charts.pairs(points, room)
    if room:
        sure = (pairs.share <= 1.0) & (np.abs(pairs.distance) < room)
        known = np.bincount(pairs.place[sure], minlength=len(points)) > 0
        pairs = pairs.chosen((pairs.share < MARGIN) | ~known[pairs.place])
    return blend_of(charts, pairs, points)


def covered(charts: Charts, points: Array, normals: Array) -> NDArray[np.bool_]:
    """Which of the places (k, 3) lie inside a patch that faces their way."""
    pairs = charts.pairs(points)
    on = pairs.share < INSIDE
    on &= np.abs(pairs.distance) < LAYER * charts.radii[pairs.node]
    on &= np.einsum("mi,mi->m", pairs.normal, normals[pairs.place]) > FACING
    found: NDArray[np.bool_] = np.bincount(pairs.place[on], minlength=len(points)) > 0
    return found


def blend_of(charts: Charts, pairs: Pairs, points: Array) -> Blend:
    """The field at places (k, 3), from what patches say there."""
    weights = node_weights(charts, pairs)
    first, taken = _wall(charts, pairs, weights, points, np.ones(len(weights), dtype=bool))
    found, left = first, ~taken
    for _ in range(WALLS - 1):
        if not left.any():
            break
        other, taken = _wall(charts, pairs, weights, points, left)
        found, left = _combined(found, first, other), left & ~taken
    return found[0]


_Wall = tuple[Blend, Array]  # the field of a wall, and the nearest point well inside its patch (k, 3)


def node_weights(charts: Charts, pairs: Pairs) -> Array:
    """w = (1 - u)^2 (1 + 2 u) / (std^2 + floor^2), (m,), u the share of MARGIN times the domain's radius."""
    u = np.minimum(pairs.share / MARGIN, OUTERMOST)
    floor = FLOOR * charts.radii[pairs.node]
    weights: Array = (1.0 - u) ** 2 * (1.0 + 2.0 * u) / (pairs.std**2 + floor**2)
    return weights


def _wall(
    charts: Charts, pairs: Pairs, weights: Array, points: Array, active: NDArray[np.bool_]
) -> tuple[_Wall, NDArray[np.bool_]]:
    """The blend of the active pairs that face the way of the nearest at each place, and which they are."""
    which = np.flatnonzero(active)
    place, node, out, distance, normal, std = pairs.chosen(which)
    radius = charts.radii[node]
    nearest = _first(place, np.abs(distance) + 0.5 * LAYER * radius * out**2, len(points))
    r = nearest[place]
    cosine = np.einsum("mi,mi->m", normal, normal[r])
    agree = np.clip((cosine - FACING) / (AGREE - FACING), 0.0, 1.0)
    agree *= agree * (3.0 - 2.0 * agree)
    room = LAYER * np.maximum(radius, radius[r]) + SLANT * np.abs(distance[r])
    agree *= np.clip(1.0 - ((distance - distance[r]) / room) ** 2, 0.0, 1.0) ** 2
    w = weights[which] * agree
    blend = _mean(place, node, distance, normal, std, w, len(points))
    feet = points.copy()
    if len(node):
        origins, pull = (
            charts.origins[node[nearest]],
            np.minimum(1.0, WELL_INSIDE / np.maximum(out[nearest], 1e-9)),
        )
        feet -= distance[nearest, None] * normal[nearest]
        feet += (1.0 - pull)[:, None] * (origins - feet)
    taken = active.copy()
    taken[which] = agree > 0.0
    return (blend, feet), taken


def _first(place: NDArray[np.intp], key: NDArray[Any], count: int) -> NDArray[np.intp]:
    """For each of `count` places the pair of the least key; -1 where there is none."""
    order = np.lexsort((key, place))
    found = np.full(count, -1)
    starts = np.flatnonzero(np.diff(place[order], prepend=-1))
    found[place[order[starts]]] = order[starts]
    return found


def _mean(
    place: NDArray[np.intp],
    node: NDArray[np.intp],
    distance: Array,
    normal: Array,
    std: Array,
    w: Array,
    count: int,
) -> Blend:
    """Weighted means; patches that share contacts err alike, so that their deviations do not average out."""

    def total(values: Array) -> Array:
        """Weighted sums (count,) of what the pairs at each place say."""
        return np.bincount(place, w * values, count).astype(np.float64)  # of none: integers

    some = total(np.ones(len(w)))
    there = some > 0.0
    scale = 1.0 / np.where(there, some, 1.0)
    mean = scale * total(distance)
    variance = scale * total(std**2 + (distance - mean[place]) ** 2)
    up = np.stack([total(normal[:, i]) for i in range(3)], axis=1)
    up /= np.maximum(np.linalg.norm(up, axis=1, keepdims=True), 1e-300)
    best = _first(place, -w, count)
    return Blend(
        mean,
        np.where(there, np.sqrt(variance), np.inf),
        up,
        np.where(there, np.append(node, -1)[best], -1),
    )


def _combined(found: _Wall, first: _Wall, other: _Wall) -> _Wall:
    """What is inside both walls where they face away from each other, inside either elsewhere."""
    (a, feet), (b, others) = found, other
    across = others - first[1]
    away = np.einsum("ki,ki->k", first[0].normal - b.normal, across) < 0.0
    takes = (b.node >= 0) & np.where(away, b.distance > a.distance, b.distance < a.distance)
    wide = takes[:, None]
    blend = Blend(
        np.where(takes, b.distance, a.distance),
        np.where(takes, b.std, a.std),
        np.where(wide, b.normal, a.normal),
        np.where(takes, b.node, a.node),
    )
    return blend, np.where(wide, others, feet)
