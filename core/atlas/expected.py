# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""About how many touches a whole object takes, as a few touches of it show."""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..arguments import LARGEST, Array, finite_array, number
from ..contours.contour import tangent_of, vector_of
from ..contours.finger import Finger, Surface, first_contact
from ..contours.tracking import generator_of
from ..exploration.touches import explore
from .rims import felt_rim
from .touching import FIRST_EXTENT, NEAR, SIZE

# Patches overlap, so that all have so many times the area of the object: python -m benchmarks.add_menu.
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
    options: dict[str, Any] = {"noise": noise, "rng": generator_of(rng), "largest_std": SIZE * tolerance}
    felt = []
    for point, n in zip(p, up, strict=True):
        try:
            e = explore(surface, point, n, farthest=FIRST_EXTENT * tolerance, **options)
        except ValueError:
            continue
        normal = vector_of(n)
        side = first_contact(surface, vector_of(point), normal, tangent_of(normal, None), e.step)[2]
        felt.append(_area(e.result.radius * felt_rim(e.result, Finger(surface, side), NEAR * tolerance)))
    if not any(felt):
        raise ValueError("points: expected some where a patch can be felt, got none")
    return max(1.0, OVERLAP * area * float(np.mean([1.0 / each for each in felt if each])))


def _area(radii: Array) -> float:
    """The area inside radii (n,) all round."""
    return float(np.pi * np.mean(radii**2))
