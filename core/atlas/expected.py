# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""How far touches all over an object are: about how many they will be, and which places they have covered."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..arguments import LARGEST, Array, finite_array, number
from ..contours.contour import vector_of
from ..contours.finger import Surface
from ..contours.tracking import generator_of
from ..exploration.options import ExplorationOptions
from ..exploration.side_by_side import exploring_many
from ..reconstruction.result import Reconstruction
from ..steps import result_of
from .finger import finger_at
from .rims import radial_extent
from .touching import FIRST_EXTENT, NEAR, SIZE

# Patches overlap, so that all have this many times the area of the object: python -m benchmarks.add_menu.
OVERLAP = 2.0


def expected_touches(
    surface: Surface,
    points: ArrayLike,
    outward: ArrayLike,
    area: float,
    *,
    tolerance: float,
    noise: float = 0.0,
    rng: np.random.Generator | int | None = None,
) -> float:
    """About how many touches `explore_object` makes of an object; too many where walls are flat.

    points, outward : (n, 3), places spread evenly over the object, and the outward directions there
    area : of the object, in the square of the caller's unit
    tolerance, noise, rng : as in `explore_object`

    Raises ValueError for bad arguments, and if a patch is felt at none of the places.
    """
    p, up = (finite_array(*given, (None, 3), LARGEST) for given in (("points", points), ("outward", outward)))
    number("area", area, above=0.0)
    options = ExplorationOptions(
        farthest=FIRST_EXTENT * tolerance, largest_std=SIZE * tolerance, noise=noise, rng=generator_of(rng)
    )
    felt = []
    for point, n, e in zip(p, up, result_of(exploring_many(surface, p, up, options)), strict=True):
        if isinstance(e, ValueError):
            continue
        finger = finger_at(surface, vector_of(point), vector_of(n), e.step)
        radii = e.result.radius * radial_extent(e.result, finger, NEAR * tolerance)
        felt.append(float(np.pi * np.mean(radii**2)))
    if not any(felt):
        raise ValueError("points: expected some where a patch can be felt, got none")
    return max(1.0, OVERLAP * area * float(np.mean([1.0 / each for each in felt if each])))


def covered_by(r: Reconstruction, rim: Array, points: Array, tolerance: float) -> NDArray[np.bool_]:
    """Which points (n, 3) of the world are inside the rim of a patch, and as near to it as a finger feels it.

    rim : how far the patch reaches from its point all round, (k,), lengths, from azimuth 0 on
    """
    x, y, z = r.frame.to_local(points).T
    azimuths = np.linspace(0.0, 2.0 * np.pi, len(rim), endpoint=False)
    found: NDArray[np.bool_] = np.hypot(x, y) < np.interp(np.arctan2(y, x), azimuths, rim, period=2.0 * np.pi)
    found[found] = np.abs(z[found] - r.height(x[found], y[found])) < NEAR * tolerance
    return found
