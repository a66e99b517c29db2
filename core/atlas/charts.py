# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Many patches as tables, so that all of them are evaluated at many places in one pass over arrays.

The height of a patch with a residual is a sum over its contacts. In a table it is a sum of 16 coefficients of
a cubic B-spline, which is C2 and off the patch by less than a tenth of its deviation.
"""

from collections.abc import Iterator
from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..arguments import SMALLEST, Array
from ..triangles import normalized, row_dot
from .cubic_spline import CUBIC, SIDE, bspline_weights, cubics

# python -m benchmarks.atlas judges these.
MARGIN = 1.12  # A patch counts to this share of its domain's radius: at a crease it ends a step early.
AZIMUTHS = 96  # The radius of a domain is stored in this many directions.
REACH = 0.5  # A patch is evaluated at places up to this share of its radius above or below it.
# Weights of four neighbors (Catmull and Rom 1974), by the share of the way between the middle two.
CATMULL_ROM = np.array([[0, -1, 2, -1], [2, 0, -5, 3], [0, 1, 4, -3], [0, 0, -1, 1]]) / 2.0
FLAT = 0.15  # A patch is flat if its slope to its own plane is less.
LEAST_COSINE = 0.4  # Where the normal has a lesser cosine to that at the point, heights run away: no feet.
PLACES_AT_ONCE = 3000  # A step takes this many places.
CHUNK = 24_000  # This many pairs of a place and a patch fit into the processor's cache at once.


class Pairs(NamedTuple):
    """Patches near places: m pairs of a place and a patch, sorted by place.

    point_index, patch : (m,), indices
    rho : (m,), how far out the foot of the place is, as a share of the domain's radius there
    distance : (m,), signed distance of the place from the patch
    normal : (m, 3), unit normal of the patch at the foot
    std : (m,), standard deviation of the distance
    """

    point_index: NDArray[np.intp]
    patch: NDArray[np.intp]
    rho: Array
    distance: Array
    normal: Array
    std: Array

    def chosen(self, which: NDArray[Any]) -> "Pairs":
        """Some of the pairs."""
        return Pairs(*(values[which] for values in self))


@dataclass(frozen=True, eq=False)
class Charts:
    """n patches as tables whose knots are evenly spaced over [-half, half]^2, in unit radius.

    origins, axes, radii : (n, 3), (n, 3, 3) and (n,), of the patches, in the caller's unit
    halves : (n,), half the side of each table, in unit radius
    heights : (n, SIDE, SIDE), spline coefficients of the heights, in unit radius
    stds : (n, k, k), their deviations at every other knot, because these are smooth and take the longest
    rims : (n, AZIMUTHS), the radii of the domains, in unit radius
    """

    origins: Array
    axes: Array
    radii: Array
    halves: Array
    heights: Array
    stds: Array
    rims: Array

    def pairs(self, points: Array, near: float = np.inf) -> Pairs:
        """Pairs of places (k, 3) and the patches within the length `near`, and within REACH, of them."""
        reach = np.minimum(REACH, near / self.radii)
        some_pairs = [self._pairs_at(points, reach, *some) for some in self._candidates(points, reach)]
        return Pairs(*(np.concatenate(parts) for parts in zip(*some_pairs, strict=True)))

    def _candidates(self, points: Array, reach: Array) -> Iterator[tuple[NDArray[np.intp], NDArray[np.intp]]]:
        """Pairs of places and patches that may be within reach, sorted by place, about CHUNK at once."""
        from scipy.spatial.distance import cdist

        across, along = self._extents
        rows, reaches = CHUNK // 16, self.radii * np.hypot(MARGIN * across, along + reach)
        for start in range(0, max(len(points), 1), rows):
            some = points[start : start + rows]
            low, high = some.min(axis=0, initial=np.inf), some.max(axis=0, initial=-np.inf)
            outside = self.origins - np.minimum(np.maximum(self.origins, low), high)
            patch = np.flatnonzero(row_dot(outside, outside) < reaches**2)
            place, which = np.nonzero(cdist(some, self.origins[patch], "sqeuclidean") < reaches[patch] ** 2)
            yield start + place, patch[which]

    @cached_property
    def widths(self) -> Array:
        """The largest radius of each domain, (n,), in unit radius."""
        return self.rims.max(axis=1)

    @cached_property
    def _extents(self) -> Array:
        """How far patches go across and along their normals, (2, n), in unit radius."""
        return np.array([self.widths, np.abs(self.heights).max(axis=(1, 2)).clip(max=1.5)])

    def local(self, points: Array, place: NDArray[np.intp], patch: NDArray[np.intp]) -> Array:
        """Places in the frames of patches and in unit radius, (3, m)."""
        origins, axes = self._frames
        off = points.T.take(place, axis=1) - origins.take(patch, axis=1)
        return np.einsum("im,ijm->jm", off, axes.take(patch, axis=2))

    @cached_property
    def _frames(self) -> tuple[Array, Array]:
        """Origins (3, n), and axes over radii (3, 3, n): numpy is faster with patches along the last axis."""
        axes = np.moveaxis(self.axes / self.radii[:, None, None], 0, -1)
        return np.ascontiguousarray(self.origins.T), np.ascontiguousarray(axes)

    def shares(self, x: Array, y: Array, patch: NDArray[np.intp]) -> Array:
        """How far out local (x, y) are, as shares (m,) of the domain's radius; smooth in the azimuth."""
        at = np.arctan2(y, x) * (AZIMUTHS / (2.0 * np.pi)) + 0.5 * AZIMUTHS
        first = at.astype(np.intp)
        four = self._padded_rims.take(patch * (AZIMUTHS + 4) + first + np.arange(4)[:, None])
        radius = np.einsum("km,km->m", four, cubics(CATMULL_ROM, at - first))
        return np.sqrt(x * x + y * y) / np.maximum(radius, 1e-6)

    @cached_property
    def _padded_rims(self) -> Array:
        """The radii of domains from azimuth -pi to pi, and one before and two more after these."""
        around = np.arange(-1, AZIMUTHS + 3) - AZIMUTHS // 2
        return np.take(self.rims, around, axis=1, mode="wrap").ravel()

    def _pairs_at(
        self,
        points: Array,
        reach: Array,
        place: NDArray[np.intp],
        patch: NDArray[np.intp],
    ) -> Pairs:
        """Those of these pairs that are within reach (n,), measured from the tangent plane at each foot."""
        x, y, z = self.local(points, place, patch)
        across, along = self._extents
        across, along = MARGIN * across + reach, along + reach
        which = np.flatnonzero((x * x + y * y < across[patch] ** 2) & (np.abs(z) < along[patch]))
        which = which[self.shares(x[which], y[which], patch[which]) < (MARGIN + reach)[patch[which]]]
        place, patch, (x, y, z) = place[which], patch[which], np.array([x, y, z])[:, which]
        h, hx, hy = self._heights(x, y, patch)
        off = (z - h) / (1.0 + hx**2 + hy**2)
        foot_x, foot_y = x + off * hx, y + off * hy
        rho = self.shares(foot_x, foot_y, patch)
        # The foot of a place on a slope is nearer than the surface below it.
        near = np.abs(off) * np.sqrt(1.0 + hx**2 + hy**2) < reach[patch]
        which = np.flatnonzero((rho < MARGIN) & near)
        place, patch, rho = place[which], patch[which], rho[which]
        x, y, z, foot_x, foot_y = np.array([x, y, z, foot_x, foot_y])[:, which]
        h, hx, hy = self._heights(foot_x, foot_y, patch)
        cosine, radius = 1.0 / np.sqrt(1.0 + hx**2 + hy**2), self.radii[patch]
        distance = (z - h - hx * (x - foot_x) - hy * (y - foot_y)) * cosine
        std = self.stds_at(foot_x, foot_y, patch) * cosine
        normal = self._to_world_directions(patch, np.array([-hx * cosine, -hy * cosine, cosine]))
        pairs = Pairs(place, patch, rho, distance * radius, normal, std * radius)
        return pairs.chosen((np.abs(distance) < reach[patch]) & (cosine > LEAST_COSINE))

    def _to_world_directions(self, patch: NDArray[np.intp], local: Array) -> Array:
        """Directions (3, m) in the frames of patches, as the caller sees them, (m, 3)."""
        return np.einsum("mij,jm->mi", self.axes[patch], local)

    def _heights(self, x: Array, y: Array, patch: NDArray[np.intp]) -> Array:
        """Heights, and slopes in x and y, (3, m), at local (x, y)."""
        pitch = (2.0 * self.halves / (SIDE - 1))[patch]
        (column, row), weights, slopes = bspline_weights(np.array([x, y]) / pitch)
        start, steps = (patch * SIDE + column - 1) * SIDE + row - 1, np.arange(CUBIC + 1)
        taps = self.heights.ravel().take(start + (steps[:, None] * SIDE + steps)[:, :, None])
        across, across_slopes = (np.einsum("ijm,jm->im", taps, by[:, 1]) for by in (weights, slopes))
        return np.array(
            [
                np.einsum("im,im->m", across, weights[:, 0]),
                np.einsum("im,im->m", across, slopes[:, 0]) / pitch,
                np.einsum("im,im->m", across_slopes, weights[:, 0]) / pitch,
            ]
        )

    def stds_at(self, x: Array, y: Array, patch: NDArray[np.intp]) -> Array:
        """Deviations (m,) of the heights at local (x, y), linear between knots."""
        from scipy.ndimage import map_coordinates

        pitch = (2.0 * self.halves / (SIDE - 1))[patch]
        at = np.array([patch, *(0.5 * np.array([x, y]) / pitch + 0.25 * (SIDE - 1))])
        return map_coordinates(self.stds, at, order=1, mode="nearest")

    @property
    def is_flat(self) -> NDArray[np.bool_]:
        """Which patches are flat, (n,), by their heights: those of a paraboloid of this slope at its rim."""
        across, along = self._extents
        flat: NDArray[np.bool_] = along < 0.5 * FLAT * across
        return flat

    @property
    def mean_stds(self) -> Array:
        """The mean deviation of the heights over each domain, (n,), a length."""
        along = self.halves[:, None] * np.linspace(-1.0, 1.0, SIDE)[::2]
        x, y = (axis.ravel() for axis in np.broadcast_arrays(along[:, :, None], along[:, None]))
        patch = np.repeat(np.arange(len(self.radii)), self.stds[0].size)
        inside = self.shares(x, y, patch).reshape(self.stds.shape) <= 1.0
        return self.radii * np.average(self.stds, axis=(1, 2), weights=np.maximum(inside, SMALLEST))

    def widened(self, factor: float) -> "Charts":
        """Tables of these patches whose deviations are larger by a factor."""
        return replace(self, stds=factor * self.stds)

    def joined(self, others: "Charts") -> "Charts":
        """The tables of these patches, followed by others."""
        return Charts(
            *(np.concatenate([getattr(self, f.name), getattr(others, f.name)]) for f in fields(Charts))
        )

    def rim_at(self, azimuths: NDArray[np.intp]) -> Array:
        """Local x and y (2, k) of the first patch's rim, at some of its AZIMUTHS."""
        turns = 2.0 * np.pi * azimuths / AZIMUTHS
        return self.rims[0, azimuths] * np.stack([np.cos(turns), np.sin(turns)])

    def rim(self, count: int, out: float) -> tuple[Array, Array, Array]:
        """Points around the first patch at the share `out` of its domain's radius, (count, 3).

        Also the normals there, and the tangents that point outward, (count, 3) each.
        """
        xy = out * self.rim_at(np.arange(0, AZIMUTHS, AZIMUTHS // count)).T
        points, normals = self.world(np.zeros(count, dtype=np.intp), *xy.T)
        ahead = (xy / np.linalg.norm(xy, axis=1, keepdims=True)) @ self.axes[0, :, :2].T
        return points, normals, normalized(ahead - row_dot(ahead, normals)[:, None] * normals)

    def world(self, patch: NDArray[np.intp], x: Array, y: Array) -> tuple[Array, Array]:
        """Points and normals (m, 3) of patches above local (x, y), which are in unit radius."""
        h, hx, hy = self._heights(x, y, patch)
        cosine = 1.0 / np.sqrt(1.0 + hx**2 + hy**2)
        points = self.origins[patch] + self._to_world_directions(
            patch, np.array([x, y, h]) * self.radii[patch]
        )
        return points, self._to_world_directions(patch, np.array([-hx * cosine, -hy * cosine, cosine]))
