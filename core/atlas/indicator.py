# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The indicator of an object: 1 inside, 0 outside, from the oriented area of its surface.

Kazhdan 2005: the gradient of the indicator is minus the area times the outward normal, so its Laplacian is
minus the divergence of these. The area is spread by cubic B-splines, and Poisson's equation is solved by sine
transforms on a grid, at the faces of which the indicator is 0.
"""

from collections.abc import Callable, Generator, Iterator
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..arguments import Array
from ..triangles import normalized
from .charts import PLACES_AT_ONCE

# python -m benchmarks.atlas judges these.
LAYERS = 3.0  # This many cells across a wall resolve it.
BORDER = 0.1  # The grid is wider than the samples by this share of the size, on each side.
MOST_CELLS = 16_000_000  # More cells, of four bytes each, and a copy of them would take too much memory.
CELLS_AT_ONCE = 500_000  # A step takes about this many cells.
NEAR = np.array(list(np.ndindex(4, 4, 4)))  # The grid points that a cubic B-spline reaches.


class Indicator(NamedTuple):
    """The indicator on a grid.

    values : (nx, ny, nz), less the level, so that the surface is at 0 and the inside above it
    low : (3,), the first grid point
    cell : the length between grid points
    size : the largest extent of what was felt
    thinnest : the thickness of the thinnest walls and gaps that were felt, inf if there are none
    """

    values: NDArray[np.float32]
    low: Array
    cell: float
    size: float
    thinnest: float

    @property
    def resolved(self) -> float:
        """The thickness of the thinnest walls and gaps that were felt and that the cells resolve."""
        return max(self.thinnest, LAYERS * self.cell)

    def at(self, points: Array) -> Array:
        """The indicator less its level at points (n, 3); outside of the grid it is that at its faces."""
        from scipy.ndimage import map_coordinates

        return map_coordinates(
            self.values, (points - self.low).T / self.cell, order=1, mode="nearest", output=np.float64
        )

    def outward(self, points: Array) -> Array:
        """Unit vectors (n, 3) along which the indicator falls at points (n, 3)."""
        steps = self.cell * np.eye(3)
        return normalized(
            np.stack([self.at(points - step) - self.at(points + step) for step in steps], axis=1)
        )


def solve_poisson(
    points: Array, areas: Array, cell: float, thinnest: float
) -> Generator[float, None, Indicator]:
    """The indicator of a surface; yields 0 between its steps. Raises ValueError for fewer than two points.

    points : (n, 3), samples of the surface
    areas : (n, 3), the area of each times its outward unit normal
    cell : the length of a cell; it is larger if the grid would otherwise have more than MOST_CELLS
    thinnest : the thickness of the thinnest walls
    """
    from scipy.fft import dst, idst, next_fast_len

    low, high = points.min(axis=0), points.max(axis=0)
    size = float((high - low).max())
    border = BORDER * size
    cell = max(cell, float(np.prod(high - low + 2.0 * border) / MOST_CELLS) ** (1.0 / 3.0))
    # A sine transform is fast if its length and 1 have small factors only.
    shape = [next_fast_len(int(np.ceil((w + 2.0 * border) / cell)) + 1) - 1 for w in high - low]
    low = 0.5 * (low + high) - 0.5 * cell * (np.array(shape) - 1.0)
    values = np.zeros(shape, dtype=np.float32)
    for start in range(0, len(points), PLACES_AT_ONCE):
        some = slice(start, start + PLACES_AT_ONCE)
        _add_divergence(values, (points[some] - low) / cell, areas[some] / cell**2)
        yield 0.0
    waves = [(np.pi / (n + 1.0) * np.arange(1, n + 1)) ** 2 for n in shape]
    yield from _transform(values, dst)
    for slab in _slabs(values, 1):
        values[slab] /= waves[0][slab[0], None, None] + waves[1][:, None] + waves[2]
        yield 0.0
    yield from _transform(values, idst)
    indicator = Indicator(values, low, cell, size, thinnest)
    values -= np.average(indicator.at(points), weights=np.linalg.norm(areas, axis=1))
    yield 0.0
    return indicator


def _transform(values: NDArray[np.float32], sine: Callable[..., Any]) -> Generator[float, None, None]:
    """Sine transforms of the first type, or their inverse, of a grid in place; yields 0 between its steps."""
    for axis in range(3):
        for slab in _slabs(values, axis):
            values[slab] = sine(values[slab], type=1, axis=axis)
            yield 0.0


def _slabs(values: NDArray[np.float32], axis: int) -> Iterator[tuple[slice, ...]]:
    """Parts of a grid, about CELLS_AT_ONCE each, that are whole along an axis."""
    other = 1 if axis == 0 else 0
    rows = max(1, CELLS_AT_ONCE * values.shape[other] // values.size)
    for start in range(0, values.shape[other], rows):
        yield (slice(None),) * other + (slice(start, start + rows),)


def _add_divergence(values: NDArray[np.float32], at: Array, flow: Array) -> None:
    """Adds the divergence of `flow` (n, 3) at places (n, 3), in cells, spread by cubic B-splines."""
    first = np.floor(at).astype(np.intp)
    f = at - first
    g = 1.0 - f
    weights = np.stack([g**3, 4.0 - 6.0 * f**2 + 3.0 * f**3, 4.0 - 6.0 * g**2 + 3.0 * g**3, f**3]) / 6.0
    slopes = np.stack([0.5 * g**2, 2.0 * f - 1.5 * f**2, 1.5 * g**2 - 2.0 * g, -0.5 * f**2])
    x, y, z = NEAR.T
    (wx, wy, wz), (sx, sy, sz) = np.moveaxis(weights, 2, 0), np.moveaxis(slopes, 2, 0)
    divergence = (
        flow[:, 0] * sx[x] * wy[y] * wz[z]
        + flow[:, 1] * wx[x] * sy[y] * wz[z]
        + flow[:, 2] * wx[x] * wy[y] * sz[z]
    )
    where = np.ravel_multi_index(tuple((first - 1 + NEAR[:, None]).T), values.shape)
    np.add.at(values.reshape(-1), where.ravel(), divergence.T.ravel().astype(np.float32))
