# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Samples of the surface of many patches, each with its share of the area, and the indicator of these."""

import math
from collections.abc import Generator
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..arguments import LARGEST, Array, finite_array, number, unit_vector
from ..contours.contour import vector_of
from ..contours.finger import Surface
from ..steps import chunked
from ..triangles import row_dot
from .charts import LEAST_COSINE, PLACES_AT_ONCE, Charts
from .field import facing_alike, patch_weights, weights_of
from .indicator import LAYERS, Indicator, solve_poisson
from .join import PATCHES_AT_ONCE

# python -m benchmarks.atlas judges these.
PITCH = 1.2  # Samples of a patch are this many cells apart.
ACROSS = 12  # The square around a patch has at least this many along each axis.
DENSER = 0.5  # If walls need cells finer than this share of those for samples, these are taken again.
FINEST, COARSEST = 1.0 / 400.0, 1.0 / 80.0  # Cells are between these shares of the size.
TOLERANCES = 5.0  # A cell is at most this many tolerances.
OPPOSITE = -0.9  # Two patches are the sides of a wall or gap if the cosine between their normals is less.
THIN_SHARE = 0.003  # Walls are at least that thick over all but this share of the area.
BELOW = 1e-5  # Rays across walls begin this share of the size below the surface.
CERTAIN = 5.0  # Two sides that are nearer than this many deviations are no wall or gap.


def indicated(charts: Charts, tolerance: float | None) -> Generator[float, None, Indicator]:
    """The indicator of the surface of patches; yields 0 between its steps.

    tolerance : mean standard deviation of the heights up to which patches grew; None without one
    """
    reach = (charts.radii * charts.widths)[:, None]
    size = float(((charts.origins + reach).max(axis=0) - (charts.origins - reach).min(axis=0)).max())
    cell = min(COARSEST * size, np.inf if tolerance is None else TOLERANCES * tolerance)
    pitch = PITCH * max(cell, FINEST * size)
    samples = yield from samples_of(charts, pitch)
    size, thinnest = float(np.ptp(samples.points, axis=0).max()), samples.thinnest
    cell = max(min(cell, COARSEST * size, thinnest / LAYERS), FINEST * size)
    if PITCH * cell < DENSER * pitch:  # Between samples that are too far apart the indicator has bubbles.
        samples = yield from samples_of(charts, PITCH * cell)
    return (
        yield from solve_poisson(samples.points, samples.areas[:, None] * samples.normals, cell, thinnest)
    )


class Samples(NamedTuple):
    """n points of patches, outward normals (n, 3) each, areas, and the thickness of walls or gaps, (n,) each.

    Where patches overlap, their areas add up to that of the surface. The thickness is inf where nothing on
    the other side was felt.
    """

    points: Array
    normals: Array
    areas: Array
    thickness: Array

    @property
    def thinnest(self) -> float:
        """The thickness which all but THIN_SHARE of the area exceeds."""
        order = np.argsort(self.thickness, kind="stable")
        thinner = np.cumsum(self.areas[order]) <= THIN_SHARE * self.areas.sum()
        return float(self.thickness[order[min(int(thinner.sum()), len(order) - 1)]])


def samples_of(charts: Charts, pitch: float) -> Generator[float, None, Samples]:
    """Points of all patches, at most `pitch` apart along their tangent planes, and their parts of the area.

    Yields 0 between its steps.
    """
    across = np.maximum(ACROSS, np.ceil(2.0 * charts.widths * charts.radii / pitch).astype(np.intp))
    patch, x, y = yield from _sample_grid(charts, across)
    cell_areas = ((2.0 * charts.widths * charts.radii / across) ** 2)[patch]
    steps = chunked(partial(_samples, charts), PLACES_AT_ONCE, 0.0, patch, x, y, cell_areas)
    return Samples._make((yield from steps))


def _sample_grid(
    charts: Charts, across: NDArray[np.intp]
) -> Generator[float, None, tuple[NDArray[np.intp], Array, Array]]:
    """The patches and local x and y of evenly spread samples, (n,) each; yields 0.

    across : the number of samples along a square around each patch
    """
    places = []
    for i, count in enumerate(across.tolist()):
        line = charts.widths[i] * ((2.0 * np.arange(count) + 1.0) / count - 1.0)
        x, y = (axis.ravel() for axis in np.meshgrid(line, line, indexing="ij"))
        patch = np.full(len(x), i)
        inside = charts.shares(x, y, patch) < 1.0
        places.append((patch[inside], x[inside], y[inside]))
        if i % PATCHES_AT_ONCE == 0:
            yield 0.0
    patch, x, y = (np.concatenate(values) for values in zip(*places, strict=True))
    return patch, x, y


def _overlap_weight_and_thickness(
    charts: Charts, patch: NDArray[np.intp], points: Array, normals: Array
) -> tuple[Array, Array]:
    """Sums (n,) of the weights of other patches on the same sheet, at points of patches with normals (n, 3).

    Also the thickness of the wall or gap between the sheet and what faces the other way, (n,).
    """
    pairs, count = charts.pairs(points), len(points)
    own, up = patch[pairs.point_index], normals[pairs.point_index]
    alike = facing_alike(charts, pairs, up, offset=np.zeros(len(up)), radius=charts.radii[own])
    weights = np.where(pairs.patch == own, 0.0, patch_weights(charts, pairs) * alike)
    opposite = (row_dot(pairs.normal, up) < OPPOSITE) & (pairs.rho < 1.0)
    opposite &= np.abs(pairs.distance) > CERTAIN * pairs.std
    thickness = np.full(count, np.inf)
    np.minimum.at(thickness, pairs.point_index[opposite], np.abs(pairs.distance[opposite]))
    # Without pairs bincount returns integers.
    return np.bincount(pairs.point_index, weights, count).astype(np.float64), thickness


def _samples(charts: Charts, patch: NDArray[np.intp], x: Array, y: Array, cell_areas: Array) -> Samples:
    """Samples of patches at local (x, y); `cell_areas` are in the tangent planes."""
    points, normals = charts.world(patch, x, y)
    others, thickness = _overlap_weight_and_thickness(charts, patch, points, normals)
    share, cosine = charts.shares(x, y, patch), row_dot(normals, charts.axes[patch, :, 2])
    inside = cosine > LEAST_COSINE
    own = weights_of(share, charts.radii[patch] * charts.stds_at(x, y, patch) * cosine, charts.radii[patch])
    areas = cell_areas * own / (own + others) / np.maximum(cosine, LEAST_COSINE)
    return Samples(*(values[inside] for values in (points, normals, areas, thickness)))


def thinnest_wall(surface: Surface, points: ArrayLike, outward: ArrayLike, size: float) -> float:
    """The thickness that all but the share THIN_SHARE of the walls of an object exceed; inf if it has none.

    points, outward : (n, 3), places spread evenly over the object, and the outward directions there
    size : of the object; walls are thinner

    Raises ValueError for bad arguments. A wall's sides face opposite ways, as for `Samples.thickness`.
    """
    p = finite_array("points", points, (None, 3), LARGEST)
    if not len(p):
        raise ValueError("points: expected one or more, got none")
    inward = [unit_vector("outward", -up) for up in finite_array("outward", outward, p.shape, LARGEST)]
    size = number("size", size, above=0.0)
    starts = p + BELOW * size * np.array(inward)  # It is off the surface, which the ray would meet.
    hits = [surface.ray_cast(vector_of(a), vector_of(b), size) for a, b in zip(starts, inward, strict=True)]
    thickness = [
        math.dist(hit[0], point) if hit is not None and np.dot(hit[1], way) > -OPPOSITE else math.inf
        for hit, point, way in zip(hits, p, inward, strict=True)
    ]
    return sorted(thickness)[int(THIN_SHARE * len(p))]
