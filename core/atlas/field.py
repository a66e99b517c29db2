# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""One surface of many patches: a partition of unity of their signed distances, and its deviation.

Beside the paper. At each place only patches that face one way are blended. Others belong to another wall: if
two walls face away from each other, the inside is where both say so (a crease, a thin wall); if they face
each other, where either does (a valley, a gap). Weights are those of Ohtake et al. 2003 over each patch's
variance.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..arguments import Array
from ..contours.finger import FACING
from .charts import MARGIN, Charts, Pairs

# python -m benchmarks.atlas judges these.
OUTERMOST = 0.999  # Weights beyond this share of MARGIN are those there, so that none is 0.
FLOOR = 1e-3  # No deviation below this share of the radius counts in a weight.
# The cosine of 50 degrees: from there to FACING a patch fades out of a blend.
AGREE = 0.64
# Patches of one wall differ in distance by at most this share of the radius, and this share of the distance
# more.
LAYER, SLANT = 0.15, 0.5
INSIDE = 1.0  # A patch covers what is within this share of its domain's radius.
WALLS = 3  # At most so many walls are told apart at a place.
WELL_INSIDE = 0.8  # What is within this share of a domain's radius is surely on the patch.
FOOT_STEPS = 6  # The nearest point of the surface is found in so many steps at most.
NEGLIGIBLE = 0.1  # No step is taken that would change the distance by less than this share of its deviation.
NEIGHBORS = 8  # Where no patch reaches, so many contacts tell of the surface.


class Felt(NamedTuple):
    """n contacts, the normals of their patches there, the indices of these patches, and a KD-tree of points.

    points, normals : (n, 3); node : (n,)
    """

    points: Array
    normals: Array
    node: NDArray[np.intp]
    tree: Any

    def told_alone(self, points: Array) -> tuple[Array, Array]:
        """Signed distances (k,) of places (k, 3) and gradients (k, 3), by the contacts nearest to them alone.

        It is that of the nearest one's tangent plane, and where the surface turns of others': the inside is
        in both where their normals part (a crease), in either where they meet (a valley).
        """
        nearest = self.tree.query(points, NEIGHBORS)[1]
        feet, normals = self.points[nearest], self.normals[nearest]
        planes = np.einsum("kci,kci->kc", points[:, None] - feet, normals)
        distance, normal = planes[:, 0].copy(), normals[:, 0].copy()
        turned = np.einsum("kci,ki->kc", normals, normal) < AGREE
        parts = np.einsum("kci,kci->kc", normals - normal[:, None], feet - feet[:, :1]) > 0.0
        for plane, up, turns, convex in zip(
            planes.T, normals.transpose(1, 0, 2), turned.T, parts.T, strict=True
        ):
            takes = turns & ((plane > distance) == convex)
            distance[takes], normal[takes] = plane[takes], up[takes]
        return distance, normal


class Blend(NamedTuple):
    """The field at k places.

    distance, std : (k,), signed, and its deviation; 0 and inf where no patch reaches
    normal : (k, 3), the gradient
    node : (k,), index of the patch of most weight; -1 where no patch reaches
    """

    distance: Array
    std: Array
    normal: Array
    node: NDArray[np.intp]


def blended(charts: Charts, points: Array, room: float = 0.0) -> Blend:
    """The field at places (k, 3); `room` is a length to which patches reach at least from their feet.

    Beyond its rim a patch tells on which side of it a place is, if no other patch does. The deviation is inf
    there.
    """
    pairs = charts.pairs(points, room)
    if not room:
        return blend_of(charts, pairs, points)
    sure = (pairs.share <= 1.0) & (np.abs(pairs.distance) < room)
    known = np.bincount(pairs.place[sure], minlength=len(points)) > 0
    found = blend_of(charts, pairs.chosen((pairs.share < MARGIN) | ~known[pairs.place]), points)
    return found._replace(std=np.where(known, found.std, np.inf))


def nearest_feet(charts: Charts, points: Array, feet: Array) -> tuple[Array, Blend]:
    """The feet (k, 3) of places (k, 3) on the surface, found from places near them, and the field there."""
    field, share, feet = blended(charts, feet), np.ones((len(points), 1)), feet.copy()
    for _ in range(FOOT_STEPS):
        off = points - feet
        across = off - np.einsum("ki,ki->k", off, field.normal)[:, None] * field.normal
        length = np.maximum(np.linalg.norm(across, axis=1), 1e-300)
        # The distance is about length^2 / (2 away) too large.
        some = np.flatnonzero(length**2 > 2.0 * NEGLIGIBLE * field.std * np.linalg.norm(off, axis=1))
        if not len(some):
            break
        room = LAYER * charts.radii[field.node[some]] / length[some]
        tried = feet[some] + np.minimum(share[some], room[:, None]) * across[some]
        for _ in range(2):  # The first one may be beside the surface.
            there = blended(charts, tried)
            tried = tried - there.distance[:, None] * there.normal
        nearer = np.isfinite(there.std)
        nearer &= ((points[some] - tried) ** 2).sum(axis=1) < (off[some] ** 2).sum(axis=1)
        for old, new in zip((feet, *field), (tried, *there), strict=True):
            old[some[nearer]] = new[nearer]
        share[some[~nearer]] *= 0.5
    return feet, field


def covered(charts: Charts, points: Array, normals: Array) -> NDArray[np.bool_]:
    """Which of the places (k, 3) lie on a patch that faces the way of their normals (k, 3)."""
    pairs = charts.pairs(points)
    on = pairs.share < INSIDE
    on &= np.abs(pairs.distance) < LAYER * charts.radii[pairs.node]
    on &= np.einsum("mi,mi->m", pairs.normal, normals[pairs.place]) > FACING
    found: NDArray[np.bool_] = np.bincount(pairs.place[on], minlength=len(points)) > 0
    return found


def blend_of(charts: Charts, pairs: Pairs, points: Array) -> Blend:
    """The field at places (k, 3), given what patches say there."""
    weights = node_weights(charts, pairs)
    first, taken = _wall(charts, pairs, weights, points, np.ones(len(weights), dtype=bool))
    found, left = first, ~taken
    for _ in range(WALLS - 1):
        if not left.any():
            break
        other, taken = _wall(charts, pairs, weights, points, left)
        found, left = _combined(found, first, other), left & ~taken
    return found[0]


# The field of a wall, and for each place a point (k, 3) that is surely on the wall.
_Wall = tuple[Blend, Array]


def node_weights(charts: Charts, pairs: Pairs) -> Array:
    """w = (1 - u)^2 (1 + 2 u) / (std^2 + floor^2), (m,), where u is how far out a foot is, 1 at MARGIN."""
    u = np.minimum(pairs.share / MARGIN, OUTERMOST)
    floor = FLOOR * charts.radii[pairs.node]
    weights: Array = (1.0 - u) ** 2 * (1.0 + 2.0 * u) / (pairs.std**2 + floor**2)
    return weights


def _wall(
    charts: Charts, pairs: Pairs, weights: Array, points: Array, active: NDArray[np.bool_]
) -> tuple[_Wall, NDArray[np.bool_]]:
    """The blend of those active pairs that face like the nearest one at each place, and a mask of them."""
    which = np.flatnonzero(active)
    place, node, out, distance, normal, std = pairs.chosen(which)
    radius = charts.radii[node]
    nearest = least_of(place, np.abs(distance) + 0.5 * LAYER * radius * out**2, len(points))
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


def least_of(place: NDArray[np.intp], key: NDArray[Any], count: int) -> NDArray[np.intp]:
    """The pair of the least key (m,) at each of `count` places, -1 where there is none.

    place : (m,), sorted
    """
    found = np.full(count, -1)
    if len(place):
        starts = np.flatnonzero(np.diff(place, prepend=-1))
        least = np.minimum.reduceat(key, starts)
        those = np.flatnonzero(key == np.repeat(least, np.diff(starts, append=len(place))))
        found[place[those[::-1]]] = those[::-1]  # The first of equal ones stays.
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
    """Weighted means. Deviations do not average out, because patches that share contacts err alike."""

    def total(values: Array) -> Array:
        """Weighted sums (count,) of what the pairs at each place say."""
        return np.bincount(place, w * values, count).astype(np.float64)  # It counts no pairs in integers.

    some = total(np.ones(len(w)))
    there = some > 0.0
    scale = 1.0 / np.where(there, some, 1.0)
    mean = scale * total(distance)
    variance = scale * total(std**2 + (distance - mean[place]) ** 2)
    up = np.stack([total(normal[:, i]) for i in range(3)], axis=1)
    up /= np.maximum(np.linalg.norm(up, axis=1, keepdims=True), 1e-300)
    best = least_of(place, -w, count)
    return Blend(
        mean,
        np.where(there, np.sqrt(variance), np.inf),
        up,
        np.where(there, np.append(node, -1)[best], -1),
    )


def _combined(found: _Wall, first: _Wall, other: _Wall) -> _Wall:
    """What is inside both walls where these face away from each other, and inside either elsewhere."""
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
