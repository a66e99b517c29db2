# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Many patches as tables, so that all of them can be asked about many places in one pass over arrays.

The height of a patch with a residual is a sum over its contacts. In a table it is a sum of 16 coefficients of
a cubic B-spline, which is C2 and off the patch by less than a tenth of its deviation.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass, fields
from functools import cached_property
from itertools import chain
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..arguments import Array
from ..contours.contour import Vector, cross, vector_of
from ..patch.cubic_spline import SIDE, weights_at

# python -m benchmarks.atlas judges these.
MARGIN = 1.12  # A patch counts to this share of its domain's radius: beside a crease it ends a step early.
AZIMUTHS = 96  # The radius of a domain is stored in so many directions.
REACH = 0.5  # A patch is asked about places up to this share of its radius above or below it.
DISK_PLACES = 36  # A disk around a contact is felt at so many places.
CHUNK = 200_000  # So many pairs of a place and a patch fit into memory at once.


class Pairs(NamedTuple):
    """What patches say of places near them: m pairs of a place and a patch, sorted by place.

    place, node : (m,), indices
    share : (m,), how far out the foot of the place is, as a share of the domain's radius there
    distance : (m,), signed distance of the place from the patch
    normal : (m, 3), unit normal of the patch at the foot
    std : (m,), standard deviation of the distance
    """

    place: NDArray[np.intp]
    node: NDArray[np.intp]
    share: Array
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
    heights, stds : (n, SIDE, SIDE), spline coefficients of the heights, and their deviations, in unit radius
    rims : (n, AZIMUTHS), the radii of the domains, in unit radius
    """

    origins: Array
    axes: Array
    radii: Array
    halves: Array
    heights: Array
    stds: Array
    rims: Array

    @cached_property
    def reaches(self) -> Array:
        """The largest distance (n,) from its origin at which each patch is asked."""
        flat: Array = MARGIN * self.rims.max(axis=1)
        return self.radii * np.hypot(flat, np.abs(self.heights).max(axis=(1, 2)).clip(max=1.5) + REACH)

    def pairs(self, points: Array, room: float = 0.0) -> Pairs:
        """What patches say of places (k, 3) that are within REACH, or within the length `room`, of them."""
        found = [self._pairs_at(points, room, *some) for some in self._near(points, room)]
        return Pairs(*(np.concatenate(parts) for parts in zip(*found, strict=True)))

    def _near(self, points: Array, room: float) -> Iterator[tuple[NDArray[np.intp], NDArray[np.intp]]]:
        """Pairs of places and patches that may be within reach, sorted by place, about CHUNK at once."""
        from scipy.spatial import cKDTree

        rows = max(1, CHUNK // 16)
        for start in range(0, max(len(points), 1), rows):
            some = points[start : start + rows]
            reaches = self.reaches + room
            lists = cKDTree(some).query_ball_point(self.origins, reaches) if len(some) else [[]]
            counts = [len(near) for near in lists]
            node = np.repeat(np.arange(len(lists)), counts)
            place = np.fromiter(chain.from_iterable(lists), dtype=np.intp, count=sum(counts))
            order = np.argsort(place, kind="stable")
            yield start + place[order], node[order]

    def local(self, points: Array, place: NDArray[np.intp], node: NDArray[np.intp]) -> Array:
        """Places in the frames of patches and in unit radius, (m, 3)."""
        off = points[place] - self.origins[node]
        found: Array = np.einsum("mi,mij->mj", off, self.axes[node]) / self.radii[node, None]
        return found

    def shares(self, x: Array, y: Array, node: NDArray[np.intp]) -> Array:
        """How far out local (x, y) are, as shares (m,) of the domain's radius; smooth in the azimuth."""
        at = np.arctan2(y, x) * (AZIMUTHS / (2.0 * np.pi)) % AZIMUTHS
        first = at.astype(np.intp)
        weights = _catmull_rom(at - first)
        steps = (first[:, None] + np.arange(-1, 3)) % AZIMUTHS
        radius = np.einsum("mk,mk->m", self.rims[node[:, None], steps], weights)
        return np.hypot(x, y) / np.maximum(radius, 1e-6)

    def _pairs_at(self, points: Array, room: float, place: NDArray[np.intp], node: NDArray[np.intp]) -> Pairs:
        """Those of these pairs that are within reach, measured from the tangent plane at each foot."""
        x, y, z = self.local(points, place, node).T
        reach = np.maximum(REACH, room / self.radii[node])
        near = np.flatnonzero(x**2 + y**2 < ((MARGIN + reach) * self.rims.max(axis=1)[node]) ** 2)
        near = near[np.abs(z[near]) < 1.5 + reach[near]]
        near = near[self.shares(x[near], y[near], node[near]) < MARGIN + reach[near]]
        place, node, x, y, z, reach = (values[near] for values in (place, node, x, y, z, reach))
        h, hx, hy, _ = self._heights(x, y, node)
        off = (z - h) / (1.0 + hx**2 + hy**2)
        foot_x, foot_y = x + off * hx, y + off * hy
        share = self.shares(foot_x, foot_y, node)
        inside = (share < np.maximum(MARGIN, 1.0 + room / self.radii[node])) & (np.abs(off) < reach)
        place, node, x, y, z, foot_x, foot_y, share = (
            values[inside] for values in (place, node, x, y, z, foot_x, foot_y, share)
        )
        h, hx, hy, std = self._heights(foot_x, foot_y, node)
        steep, radius = 1.0 / np.sqrt(1.0 + hx**2 + hy**2), self.radii[node]
        distance = (z - h - hx * (x - foot_x) - hy * (y - foot_y)) * steep
        normal = np.stack([-hx * steep, -hy * steep, steep], axis=1)
        return Pairs(
            place,
            node,
            share,
            distance * radius,
            np.einsum("mij,mj->mi", self.axes[node], normal),
            std * steep * radius,
        )

    def _heights(self, x: Array, y: Array, node: NDArray[np.intp]) -> tuple[Array, Array, Array, Array]:
        """Heights, slopes in x and y, and deviations (m,) at local (x, y)."""
        pitch = 2.0 * self.halves[node] / (SIDE - 1)
        (column, by_x, slopes_x), (row, by_y, slopes_y) = weights_at(x / pitch), weights_at(y / pitch)
        start, flat = (node * SIDE + column - 1) * SIDE + row - 1, self.heights.reshape(-1)
        h, hx, hy = np.zeros((3, len(x)))
        for i in range(4):
            taps = flat[start[:, None] + (i * SIDE + np.arange(4))]
            across = np.einsum("mk,mk->m", taps, by_y)
            h += by_x[:, i] * across
            hx += slopes_x[:, i] * across
            hy += by_x[:, i] * np.einsum("mk,mk->m", taps, slopes_y)
        nearest = np.clip(np.rint(np.array([x, y]) / pitch + 0.5 * (SIDE - 1)).astype(np.intp), 0, SIDE - 1)
        std = self.stds.reshape(-1)[(node * SIDE + nearest[0]) * SIDE + nearest[1]]
        return h, hx / pitch, hy / pitch, std

    @cached_property
    def mean_stds(self) -> Array:
        """The mean deviation of the heights over each domain, (n,), a length."""
        inside = self._inside()
        sums: Array = (self.stds * inside).sum(axis=(1, 2)) / np.maximum(inside.sum(axis=(1, 2)), 1)
        return self.radii * sums

    def less_certain_than(self, std: float) -> list[int]:
        """Indices of the patches whose mean deviation is above `std`, the worst first."""
        order = np.argsort(-self.mean_stds, kind="stable")
        found: list[int] = order[self.mean_stds[order] > std].tolist()
        return found

    def _inside(self) -> NDArray[np.bool_]:
        """Which knots are inside the domains, (n, SIDE, SIDE)."""
        count = len(self.radii)
        x, y = self.knots().reshape(2, -1)
        shares = self.shares(x, y, np.repeat(np.arange(count), SIDE**2))
        return (shares <= 1.0).reshape(count, SIDE, SIDE)

    def knots(self) -> Array:
        """Local x and y of all knots, (2, n, SIDE, SIDE)."""
        along = self.halves[:, None] * np.linspace(-1.0, 1.0, SIDE)
        return np.array(np.broadcast_arrays(along[:, :, None], along[:, None]))

    def least_certain(self, node: int) -> tuple[Array, Array]:
        """The point and the normal, (3,) each, where a patch is least certain inside its domain."""
        at = np.argmax(np.where(self._inside()[node], self.stds[node], -1.0))
        x, y = self.knots()[:, node].reshape(2, -1)[:, [at]]
        points, normals = self.world(np.array([node]), x, y)
        return points[0], normals[0]

    def chosen(self, which: NDArray[Any]) -> "Charts":
        """The tables of some of the patches."""
        return Charts(*(getattr(self, f.name)[which] for f in fields(Charts)))

    def joined(self, others: "Charts") -> "Charts":
        """The tables of these patches, followed by others."""
        return Charts(
            *(np.concatenate([getattr(self, f.name), getattr(others, f.name)]) for f in fields(Charts))
        )

    def rim(self, count: int, out: float) -> tuple[Array, Array, Array]:
        """Points around the first patch at the share `out` of its domain's radius, (count, 3).

        Also the normals there, and the tangents that point outward, (count, 3) each.
        """
        turns = 2.0 * np.pi * np.arange(count) / count
        xy = out * self.rims[0, :: AZIMUTHS // count, None] * np.stack([np.cos(turns), np.sin(turns)], axis=1)
        points, normals = self.world(np.zeros(count, dtype=np.intp), *xy.T)
        ahead = (xy / np.linalg.norm(xy, axis=1, keepdims=True)) @ self.axes[0, :, :2].T
        ahead -= np.einsum("ki,ki->k", ahead, normals)[:, None] * normals
        ahead /= np.maximum(np.linalg.norm(ahead, axis=1, keepdims=True), 1e-12)
        return points, normals, ahead

    def world(self, node: NDArray[np.intp], x: Array, y: Array) -> tuple[Array, Array]:
        """Points and normals (m, 3) of patches above local (x, y), which are in unit radius."""
        h, hx, hy, _ = self._heights(x, y, node)
        steep = 1.0 / np.sqrt(1.0 + hx**2 + hy**2)
        normal = np.stack([-hx * steep, -hy * steep, steep], axis=1)
        local = np.stack([x, y, h], axis=1) * self.radii[node, None]
        axes = self.axes[node]
        return self.origins[node] + np.einsum("mij,mj->mi", axes, local), np.einsum(
            "mij,mj->mi", axes, normal
        )


def _catmull_rom(t: Array) -> Array:
    """Weights (m, 4) of four neighbors at shares t (m,) of the way between the middle two."""
    return (
        np.stack(
            [
                ((2.0 - t) * t - 1.0) * t,
                (3.0 * t - 5.0) * t**2 + 2.0,
                ((4.0 - 3.0 * t) * t + 1.0) * t,
                (t - 1.0) * t**2,
            ],
            axis=1,
        )
        / 2.0
    )


def disk_around(normal: Vector, ahead: Vector) -> Array:
    """Places (DISK_PLACES, 3) spread evenly over the unit disk across a normal, as in a sunflower."""
    i = np.arange(DISK_PLACES) + 0.5
    turn, out = math.pi * (3.0 - math.sqrt(5.0)) * i, np.sqrt(i / DISK_PLACES)
    e1 = np.array(cross(normal, ahead))
    if not np.linalg.norm(e1) > 1e-3:
        e1 = np.array(cross(normal, vector_of(np.eye(3)[np.argmin(np.abs(normal))])))
    e1 /= np.linalg.norm(e1)
    across = np.array([out * np.cos(turn), out * np.sin(turn)])
    found: Array = across.T @ np.array([e1, cross(normal, vector_of(e1))])
    return found
