# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The surface of many patches near a place: sheets of patches that face much alike.

Not in the paper. A sheet is a partition of unity with the weights of Ohtake et al. 2003 over each patch's
variance.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..arguments import Array
from ..triangles import normalized, row_dot
from .charts import MARGIN, Charts, Pairs
from .join import LEAST_NOISE

# python -m benchmarks.atlas judges these.
# The cosines of 37 and of 53 degrees: patches that turn by less are one sheet, from there on they fade out of
# it, and those that turn by more are another sheet.
AGREE, APART = 0.8, 0.6
# Those of flat patches, of 30 and 41 degrees: these end where sheets do. Without, a chamfered box takes an
FLAT_AGREE, FLAT_APART = 0.87, 0.75  # eighth more touches (test_sharp_objects).
# Patches of one sheet differ in distance by at most this share of the radius, and this share of the distance
# more, without which the default cone is off by 3.2 tolerances (benchmarks.add_menu).
LAYER, SLANT = 0.15, 0.5
INSIDE = 1.0  # A patch covers what is within this share of its domain's radius.


class Blend(NamedTuple):
    """A sheet near k places.

    distance, std : (k,), signed, and its deviation; 0 and inf where no patch reaches
    normal : (k, 3), the gradient
    patch : (k,), index of the patch of most weight; -1 where no patch reaches
    rho : (k,), the least of their shares of the radius of a patch's domain; inf where no patch reaches
    """

    distance: Array
    std: Array
    normal: Array
    patch: NDArray[np.intp]
    rho: Array

    def at(self, index: NDArray[np.intp]) -> "Blend":
        """The sheets at some of the places, by their indices (m,)."""
        return Blend._make(values[index] for values in self)

    def where(self, which: NDArray[np.bool_], other: "Blend") -> "Blend":
        """These at places (k,) where `which` holds, and those of another elsewhere."""
        columns = which[:, None]
        return Blend(
            *(
                np.where(columns if mine.ndim > 1 else which, mine, others)
                for mine, others in zip(self, other, strict=True)
            )
        )


def patch_weights(charts: Charts, pairs: Pairs) -> Array:
    """The weights (m,) of patches in a blend."""
    return weights_of(pairs.rho, pairs.std, charts.radii[pairs.patch])


def weights_of(rho: Array, std: Array, radius: Array) -> Array:
    """w = (1 - u)^2 (1 + 2 u) / (std^2 + floor^2), (m,), where u is how far out a foot is, 1 at MARGIN."""
    u = rho / MARGIN
    return (1.0 - u) ** 2 * (1.0 + 2.0 * u) / (std**2 + (LEAST_NOISE * radius) ** 2)


def facing_alike(charts: Charts, pairs: Pairs, up: Array, offset: Array, radius: Array) -> Array:
    """From 1 to 0, (m,), how much patches belong to the sheet with normals `up` (m, 3) at distances `offset`.

    radius : (m,), that of a patch of the sheet
    """
    band = LAYER * np.maximum(charts.radii[pairs.patch], radius) + SLANT * np.abs(offset)
    return _facing(charts, pairs, up) * _within(pairs.distance - offset, band)


def _facing(charts: Charts, pairs: Pairs, up: Array) -> Array:
    """From 1 to 0, (m,), how much patches face the way of normals (m, 3)."""
    is_flat = charts.is_flat[pairs.patch]
    apart, most = np.where(is_flat, FLAT_APART, APART), np.where(is_flat, FLAT_AGREE, AGREE)
    agree: Array = np.clip((row_dot(pairs.normal, up) - apart) / (most - apart), 0.0, 1.0)
    return agree * (agree * (3.0 - 2.0 * agree))


def _within(off: Array, band: Array) -> Array:
    """From 1 to 0, (m,), as lengths come near the band for them."""
    inside: Array = np.clip(1.0 - (off / band) ** 2, 0.0, 1.0)
    return inside * inside


def sheet_facing(charts: Charts, points: Array, up: Array, near: Array | float) -> Blend:
    """The sheet with normals `up` (k, 3) near places (k, 3), of patches within a length (k,)."""
    pairs, near = charts.pairs(points, float(np.max(near, initial=0.0))), np.broadcast_to(near, len(points))
    alike = _facing(charts, pairs, up[pairs.point_index]) * _within(pairs.distance, near[pairs.point_index])
    return _weighted_mean(pairs, patch_weights(charts, pairs) * alike, len(points))


def distances_within_rims(charts: Charts, pairs: Pairs) -> Array:
    """The distances (m,) of places from patches that end at their rims, or a little more."""
    beyond = np.maximum(pairs.rho - 1.0, 0.0) * charts.radii[pairs.patch] * charts.widths[pairs.patch]
    return np.hypot(pairs.distance, beyond)


def nearest_sheet(charts: Charts, pairs: Pairs, count: int) -> Blend:
    """The sheet of the nearest patch at each of `count` places, of pairs of places and patches."""
    nearest = argmin_per_point(pairs.point_index, distances_within_rims(charts, pairs), count)
    nearest = nearest[pairs.point_index]
    up, radius = pairs.normal[nearest], charts.radii[pairs.patch[nearest]]
    alike = facing_alike(charts, pairs, up, pairs.distance[nearest], radius)
    return _weighted_mean(pairs, patch_weights(charts, pairs) * alike, count)


def covered(
    charts: Charts, points: Array, normals: Array, share: float = INSIDE, first: int = 0
) -> NDArray[np.bool_]:
    """Which of the places (k, 3) lie on a patch that faces the way of their normals (k, 3).

    share : of the domain's radius, within which they lie
    first : the number of the first patch that counts
    """
    pairs = charts.pairs(points)
    near = np.abs(pairs.distance) < LAYER * charts.radii[pairs.patch]
    on = (pairs.rho < share) & near & (_facing(charts, pairs, normals[pairs.point_index]) > 0.0)
    on &= pairs.patch >= first
    return np.bincount(pairs.point_index[on], minlength=len(points)) > 0


def argmin_per_point(place: NDArray[np.intp], key: NDArray[Any], count: int) -> NDArray[np.intp]:
    """The pair of the least key (m,) at each of `count` places, -1 where there is none.

    place : (m,), sorted
    """
    least_pair, starts = np.full(count, -1), np.flatnonzero(np.diff(place, prepend=-1))
    least = np.minimum.reduceat(key, starts)
    those = np.flatnonzero(key == np.repeat(least, np.diff(starts, append=len(place))))[::-1]
    least_pair[place[those]] = those  # The first of equal ones stays.
    return least_pair


def _weighted_mean(pairs: Pairs, w: Array, count: int) -> Blend:
    """Weighted means at `count` places, with the deviation of the mean distance; the least rho.

    Patches that share contacts err alike, so their deviations do not average out as independent ones do.
    """
    place = pairs.point_index

    def total(values: Array) -> Array:
        """Weighted sums (count,) over the pairs at each place."""
        return np.bincount(place, w * values, count).astype(np.float64)  # Without pairs it is integers.

    weight = total(np.ones(len(w)))
    is_met = weight > 0.0
    scale = 1.0 / np.where(is_met, weight, 1.0)
    rho = np.full(count, np.inf)
    np.minimum.at(rho, place[w > 0.0], pairs.rho[w > 0.0])
    up = normalized(np.stack([total(pairs.normal[:, i]) for i in range(3)], axis=1))
    best = argmin_per_point(place, -w, count)
    return Blend(
        scale * total(pairs.distance),
        np.where(is_met, np.sqrt(scale * total(np.square(pairs.std))), np.inf),
        up,
        np.where(is_met, np.append(pairs.patch, -1)[best], -1),
        rho,
    )
