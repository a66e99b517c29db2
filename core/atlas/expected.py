# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""How far touches all over an object are: about how many they will be, and which places they have covered."""

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..arguments import LARGEST, Array, finite_array, number, unit_vector
from ..contours.contour import vector_of
from ..contours.finger import Surface
from ..contours.tracking import generator_of
from ..exploration.extent import Exploration
from ..exploration.options import ExplorationOptions
from ..exploration.touches import exploring_many
from ..reconstruction.result import Reconstruction
from ..steps import result_of
from .finger import FACING, finger_at
from .object_atlas import NEAR
from .rims import radial_extent
from .samples import OPPOSITE, THIN_SHARE
from .touching import FIRST_EXTENT

# python -m benchmarks.add_menu --expected judges these.
ROUNDS, AT_ONCE = 3, 4  # The rounds, and the touches of each, at places that none before covers.
LATER = 8  # The last patches, this number of them, are as large as those to come,
OVERLAP = 3.0  # which overlap, so that they have this many times the area that is left.
INSIDE = 1e-5  # Rays across walls begin this share of the size below the surface.


def expected_touches(
    surface: Surface,
    points: ArrayLike,
    outward: ArrayLike,
    area: float,
    *,
    tolerance: float,
    noise: float = 0.0,
    rng: np.random.Generator | int | None = None,
) -> tuple[float, int, list[Reconstruction]]:
    """About how many touches `explore_object` makes of an object; how many show that; the patches of these.

    points, outward : (n, 3), hundreds of places spread evenly over the object, in random order, and the
        outward directions there
    area : of the object, in the square of the caller's unit
    tolerance, noise, rng : as in `explore_object`

    Raises ValueError for bad arguments, and if a patch is felt at none of the places that are touched.
    """
    p, up = _places(points, outward)
    number("area", area, above=0.0)
    options = ExplorationOptions(
        farthest=FIRST_EXTENT * tolerance, largest_std=tolerance, noise=noise, rng=generator_of(rng)
    )
    left, tried = np.arange(len(p)), 0
    areas: list[float] = []  # Of the patches at places that none before covers,
    patches: list[Reconstruction] = []  # and these.
    for _ in range(ROUNDS):
        places, left = left[:AT_ONCE], left[AT_ONCE:]
        tried += len(places)
        covered = np.zeros(len(p), dtype=bool)
        results = result_of(exploring_many(surface, p[places], up[places], options))
        for place, e in zip(places, results, strict=True):
            if isinstance(e, ValueError) or covered[place]:
                continue
            rim = _rim(surface, e, up[place], tolerance)
            if rim.any():
                areas.append(float(np.pi * np.mean(rim**2)))
                patches.append(e.result)
                faces_it = up @ e.result.frame.axes[:, 2] > FACING
                covered[faces_it] |= covered_by(e.result, rim, p[faces_it], tolerance)
        left = left[~covered[left]]
    if not areas:
        raise ValueError("points: expected some where a patch can be felt, got none")
    more = OVERLAP * area * len(left) / len(p) * float(np.mean(1.0 / np.array(areas[-LATER:])))
    return len(areas) + more, tried, patches


def thinnest_wall(surface: Surface, points: ArrayLike, outward: ArrayLike, size: float) -> float:
    """The thickness that all but the share THIN_SHARE of the walls of an object exceed; inf if it has none.

    points, outward : (n, 3), places spread evenly over the object, and the outward directions there
    size : of the object; walls are thinner

    Raises ValueError for bad arguments. A wall's sides face opposite ways, as for `Samples.thickness`.
    """
    p, up = _places(points, outward)
    size, inward = number("size", size, above=0.0), -up
    starts = p + INSIDE * size * inward  # It is off the surface, which the ray would meet.
    hits = [surface.ray_cast(vector_of(a), vector_of(b), size) for a, b in zip(starts, inward, strict=True)]
    thickness = [
        math.dist(hit[0], point) if hit is not None and np.dot(hit[1], way) > -OPPOSITE else math.inf
        for hit, point, way in zip(hits, p, inward, strict=True)
    ]
    return sorted(thickness)[int(THIN_SHARE * len(p))]


def _places(points: ArrayLike, outward: ArrayLike) -> tuple[Array, Array]:
    """Points and unit outward directions, (n, 3) each. Raises ValueError for bad ones and for none."""
    p = finite_array("points", points, (None, 3), LARGEST)
    up = finite_array("outward", outward, p.shape, LARGEST)
    if not len(p):
        raise ValueError("points: expected one or more, got none")
    return p, np.array([unit_vector("outward", direction) for direction in up])


def _rim(surface: Surface, e: Exploration, outward: Array, tolerance: float) -> Array:
    """How far a patch reaches from its point all round, (AZIMUTHS,), lengths."""
    r = e.result
    finger = finger_at(surface, vector_of(r.frame.origin), vector_of(outward), e.step)
    return r.radius * radial_extent(r, finger, NEAR * tolerance)


def covered_by(r: Reconstruction, rim: Array, points: Array, tolerance: float) -> NDArray[np.bool_]:
    """Which points (n, 3) of the world are inside the rim of a patch, and as near to it as a finger feels it.

    rim : how far the patch reaches from its point all round, (k,), lengths, from azimuth 0 on
    """
    x, y, z = r.frame.to_local(points).T
    azimuths = np.linspace(0.0, 2.0 * np.pi, len(rim), endpoint=False)
    is_covered: NDArray[np.bool_] = np.hypot(x, y) < np.interp(
        np.arctan2(y, x), azimuths, rim, period=2.0 * np.pi
    )
    is_covered[is_covered] = np.abs(z[is_covered] - r.height(x[is_covered], y[is_covered])) < NEAR * tolerance
    return is_covered
