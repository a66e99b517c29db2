# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The surface of many patches near a place: sheets, and the creases where these meet.

Not in the paper. Which way the surface faces follows from the indicator of the whole object. Patches that
face much alike are one sheet: a partition of unity with the weights of Ohtake et al. 2003 over each patch's
variance. Where sheets meet, the inside is in both (a convex crease) or in either (a concave one), as the
indicator has it on both sides of the crease.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..arguments import Array
from ..triangles import normalized, row_dot
from .charts import MARGIN, Charts, Pairs
from .indicator import Indicator

# python -m benchmarks.atlas judges these.
OUTERMOST = 0.999  # Weights beyond this share of MARGIN are those there, so that none is 0.
FLOOR = 1e-3  # No deviation below this share of the radius counts in a weight.
# The cosines of 37 and of 53 degrees: patches that turn by less are one sheet, from there on they fade out of
# it, and those that turn by more are another sheet.
AGREE, APART = 0.8, 0.6
FLAT_AGREE, FLAT_APART = 0.87, 0.75  # Those of flat patches, of 30 and 41 degrees: these end where sheets do.
# Patches of one sheet differ in distance by at most this share of the radius, and this share of the distance
# more.
LAYER, SLANT = 0.15, 0.5
INSIDE = 1.0  # A patch covers what is within this share of its domain's radius.
SIDEWAYS = 0.15  # A patch faces as the indicator does if the cosine between their normals is more.
CONTINUED = 1.6  # Where no patch is, those count that can be continued by this factor of their radius.
FARTHEST = 10.0  # A crease is looked for within this many cells along the normals of its sheets.
LEAST_SINE = 0.1  # Sheets of a crease count as turned by this much at least.
SHEETS = 3  # At most this many sheets meet at a place.


class Blend(NamedTuple):
    """A sheet, or the surface, near k places.

    distance, std : (k,), signed, and its deviation; 0 and inf where no patch reaches
    normal : (k, 3), the gradient
    patch : (k,), index of the patch of most weight; -1 where no patch reaches
    """

    distance: Array
    std: Array
    normal: Array
    patch: NDArray[np.intp]

    def where(self, which: NDArray[np.bool_], other: "Blend") -> "Blend":
        """These at places (k,) where `which` holds, and those of another elsewhere."""
        return Blend(
            np.where(which, self.distance, other.distance),
            np.where(which, self.std, other.std),
            np.where(which[:, None], self.normal, other.normal),
            np.where(which, self.patch, other.patch),
        )


class SurfaceSample(NamedTuple):
    """The surface near k places.

    distance, std, normal, patch : as in a Blend
    rho : (k,), how far out the places are on the patch where they are least so; inf where no patch reaches
    creases : (k,), the number of other sheets there
    """

    distance: Array
    std: Array
    normal: Array
    patch: NDArray[np.intp]
    rho: Array
    creases: NDArray[np.intp]


def node_weights(charts: Charts, pairs: Pairs) -> Array:
    """The weights (m,) of patches in a blend."""
    return weights_of(pairs.rho, pairs.std, charts.radii[pairs.patch])


def weights_of(rho: Array, std: Array, radius: Array) -> Array:
    """w = (1 - u)^2 (1 + 2 u) / (std^2 + floor^2), (m,), where u is how far out a foot is, 1 at MARGIN."""
    u = np.minimum(rho / MARGIN, OUTERMOST)
    return (1.0 - u) ** 2 * (1.0 + 2.0 * u) / (std**2 + (FLOOR * radius) ** 2)


def facing_alike(charts: Charts, pairs: Pairs, up: Array, offset: Array, radius: Array) -> Array:
    """From 1 to 0, (m,), how much patches belong to the sheet with normals `up` (m, 3) at distances `offset`.

    radius : (m,), that of a patch of the sheet
    """
    band = LAYER * np.maximum(charts.radii[pairs.patch], radius) + SLANT * np.abs(offset)
    return _facing(charts, pairs, up) * _within(pairs.distance - offset, band)


def _facing(charts: Charts, pairs: Pairs, up: Array) -> Array:
    """From 1 to 0, (m,), how much patches face the way of normals (m, 3)."""
    cosine: Array = row_dot(pairs.normal, up)
    is_flat = charts.is_flat[pairs.patch]
    apart, most = np.where(is_flat, FLAT_APART, APART), np.where(is_flat, FLAT_AGREE, AGREE)
    agree: Array = np.clip((cosine - apart) / (most - apart), 0.0, 1.0)
    return agree * (agree * (3.0 - 2.0 * agree))


def _within(off: Array, band: Array) -> Array:
    """From 1 to 0, (m,), as lengths come near the band for them."""
    inside: Array = np.clip(1.0 - (off / band) ** 2, 0.0, 1.0)
    return inside * inside


def sheets_at(charts: Charts, pairs: Pairs, count: int) -> list[Blend]:
    """At most SHEETS sheets at each of `count` places, the nearest first, of pairs of places and patches."""
    weights, sheets = node_weights(charts, pairs), []
    for _ in range(SHEETS):
        key = np.abs(pairs.distance) + 0.5 * LAYER * charts.radii[pairs.patch] * pairs.rho**2
        nearest = argmin_per_point(pairs.point_index, key, count)[pairs.point_index]
        up, offset, radius = (
            pairs.normal[nearest],
            pairs.distance[nearest],
            charts.radii[pairs.patch[nearest]],
        )
        alike = facing_alike(charts, pairs, up, offset, radius)
        sheets.append(_weighted_mean(pairs, weights * alike, count))
        left = np.flatnonzero(alike <= 0.0)
        pairs, weights = pairs.chosen(left), weights[left]
    return sheets


def surface_at(charts: Charts, indicator: Indicator, points: Array, up: Array, band: float) -> SurfaceSample:
    """The surface within a length of places (k, 3) that faces about as `up` (k, 3)."""
    found = surface_within_margin(charts, indicator, points, up, band)
    lost = np.flatnonzero(found.patch < 0)
    if len(lost):
        farther = surface_within_margin(charts, indicator, points[lost], up[lost], band, CONTINUED)
        for old, new in zip(found, farther, strict=True):
            old[lost] = new
    return found


def surface_within_margin(
    charts: Charts, indicator: Indicator, points: Array, up: Array, band: float, margin: float = MARGIN
) -> SurfaceSample:
    """The surface of `surface_at`, but only of patches within a margin of their rims."""
    pairs, count = charts.pairs(points, band, margin), len(points)
    pairs = pairs.chosen(row_dot(pairs.normal, up[pairs.point_index]) > SIDEWAYS)
    rho = np.full(count, np.inf)
    np.minimum.at(rho, pairs.point_index, pairs.rho)
    sheets = sheets_at(charts, pairs, count)
    found, several = sheets[0], np.flatnonzero(sheets[1].patch >= 0)
    if len(several):
        some = [Blend._make(values[several] for values in sheet) for sheet in sheets]
        for old, new in zip(found, _combine_sheets(indicator, points[several], some), strict=True):
            old[several] = new
    return SurfaceSample(*found, rho, (sheets[1].patch >= 0).astype(np.intp) + (sheets[2].patch >= 0))


def _combine_sheets(indicator: Indicator, points: Array, sheets: list[Blend]) -> Blend:
    """The surface where two or three sheets (k places each) meet, (k,).

    The inside of a convex crease is the intersection of both half spaces, so the larger signed distance
    counts; that of a concave one is their union, so the smaller one does. At a corner the pair whose crease
    differs from the other two is combined first.
    """
    one, two, three = sheets
    convex = [_is_convex(indicator, points, a, b) for a, b in ((one, two), (one, three), (two, three))]
    third = three.patch >= 0
    # Of three creases at a corner two are alike: the sheets of the other one meet first.
    last = third & (convex[0] == convex[1]) & (convex[0] != convex[2])
    middle = third & (convex[0] == convex[2]) & (convex[0] != convex[1])
    a, b, c = two.where(last, one), three.where(last | middle, two), one.where(last, two.where(middle, three))
    first = np.where(last, convex[2], np.where(middle, convex[1], convex[0]))
    found = _min_or_max(a, b, first)
    return _min_or_max(found, c, np.where(last | middle, convex[0], convex[1])).where(third, found)


def _min_or_max(a: Blend, b: Blend, convex: NDArray[np.bool_]) -> Blend:
    """The surface of two sheets, inside both where their crease is convex, and inside either elsewhere."""
    return b.where((b.distance > a.distance) == convex, a)


def _is_convex(indicator: Indicator, points: Array, a: Blend, b: Blend) -> NDArray[np.bool_]:
    """Whether the crease of two sheets near places (k, 3) is convex: on both sides of it is the outside."""
    cosine = row_dot(a.normal, b.normal)
    sine = np.maximum(1.0 - cosine**2, LEAST_SINE**2)
    most = FARTHEST * indicator.cell
    p, q = (np.clip((u.distance - cosine * v.distance) / sine, -most, most) for u, v in ((a, b), (b, a)))
    crease = points - p[:, None] * a.normal - q[:, None] * b.normal
    across = a.normal - b.normal
    across *= indicator.cell / np.maximum(np.linalg.norm(across, axis=1, keepdims=True), LEAST_SINE)
    return indicator.at(crease + across) + indicator.at(crease - across) < 0.0


def sheet_facing(charts: Charts, points: Array, up: Array, near: Array | float) -> Blend:
    """The sheet with normals `up` (k, 3) near places (k, 3), of patches within a length (k,)."""
    pairs, near = charts.pairs(points, float(np.max(near, initial=0.0))), np.broadcast_to(near, len(points))
    alike = _facing(charts, pairs, up[pairs.point_index]) * _within(pairs.distance, near[pairs.point_index])
    return _weighted_mean(pairs, node_weights(charts, pairs) * alike, len(points))


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
    found, starts = np.full(count, -1), np.flatnonzero(np.diff(place, prepend=-1))
    least = np.minimum.reduceat(key, starts)
    those = np.flatnonzero(key == np.repeat(least, np.diff(starts, append=len(place))))[::-1]
    found[place[those]] = those  # The first of equal ones stays.
    return found


def _weighted_mean(pairs: Pairs, w: Array, count: int) -> Blend:
    """Weighted means at `count` places, with the deviation of the mean distance.

    Patches that share contacts err alike, so their deviations do not average out as independent ones do. But
    the squared error of a mean is the mean squared error minus the mean square by which patches differ from
    it (Krogh and Vedelsby 1995). It is at least the variance of the mean of patches that differ that much.
    """
    place = pairs.point_index

    def total(values: Array) -> Array:
        """Weighted sums (count,) over the pairs at each place."""
        return np.bincount(place, w * values, count).astype(np.float64)  # It counts no pairs in integers.

    some = total(np.ones(len(w)))
    there = some > 0.0
    scale = 1.0 / np.where(there, some, 1.0)
    mean = scale * total(pairs.distance)
    spread = scale * total(np.square(pairs.distance - mean[place]))
    shares = np.bincount(place, np.square(w * scale[place]), count)
    least = spread * shares / np.maximum(1.0 - shares, shares)
    variance = np.maximum(scale * total(np.square(pairs.std)) - spread, least)
    up = normalized(np.stack([total(pairs.normal[:, i]) for i in range(3)], axis=1))
    best = argmin_per_point(place, -w, count)
    return Blend(
        mean,
        np.where(there, np.sqrt(variance), np.inf),
        up,
        np.where(there, np.append(pairs.patch, -1)[best], -1),
    )
