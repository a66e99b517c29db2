# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A touch that chooses its own size: curves as long as a patch can be trusted, contacts as many as tell.

Beside the paper. Half curves grow outward from the reference point like the regions of a segmentation
by surface fitting: fit, go on where the fit explains the contacts, fit again (growth.py).
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..arguments import LARGEST, finite_array, number, unit_vector
from ..contours.contour import SamplingPlane
from ..contours.finger import Surface
from ..reconstruction.from_contours import options_of
from .one_touch import Exploration
from .side_by_side import Found, given, planes_of, result_of, touching


def explore(
    surface: Surface,
    point: ArrayLike,
    outward: ArrayLike,
    planes: int | Sequence[SamplingPlane] = 3,
    *,
    farthest: float | None = None,
    largest_std: float | None = None,
    tolerance: float | None = None,
    most_planes: int = 6,
    extent: float | str = "auto",
    step: float | str = "auto",
    noise: float = 0.0,
    rng: np.random.Generator | int | None = None,
    tangent: ArrayLike | None = None,
    method: str = "bayes",
    degree: int | str = "auto",
    weight: float | None = None,
    solver: str = "fast",
) -> Exploration:
    """Tracks `surface` from `point` and reconstructs the patch, as large and as densely felt as it needs.

    planes : as in `track`, or how many, k: then their azimuths are pi i / k
    farthest : greatest length of a half curve; None for no limit, if curves end by themselves
    largest_std : mean deviation of the height up to which half curves grow, and up to which they count as
      explained; they also end where the surface bends by 40 degrees. None for shares of the radius.
      Then, if the extent is "auto", the finger also taps between the curves (taps.py): where the surface is
      not that of the fit, they become shorter, or it says so
    tolerance : mean deviation of the height to reach: until then the plane that tells most is added, up to
        `most_planes`, as long as one takes a tenth off. None adds no planes
    extent : length of each half curve, as in `track`; with "auto" each grows until the default fit no
        longer explains its contacts by their noise, or the patch could no longer be trusted
    step : as in `track`; "auto" chooses the number of contacts such that twice as many would not lower the
        deviation of the height noticeably
    noise, rng, tangent : as in `track`; the contours tell the fit of the noise
    method, degree, weight, solver : as in `reconstruct`

    If a contour was not followed any farther, its `stops` are UNEXPLAINED. Raises what `track` and
    `reconstruct` raise, and ValueError where curves do not end and `farthest` is None.

    >>> import math
    >>> class Ball:
    ...     def ray_cast(self, origin, direction, distance):
    ...         o, d = np.array(origin), np.array(direction)
    ...         root = math.sqrt(max((o @ d) ** 2 - o @ o + 1.0, 0.0))
    ...         t = next((t for t in (-o @ d - root, -o @ d + root) if root and 0.0 < t <= distance), None)
    ...         return None if t is None else (tuple(o + t * d), tuple(o + t * d))
    >>> found = explore(Ball(), (0.0, 0.0, 1.0), (0.0, 0.0, 1.0))
    >>> found.result.status, round(found.result.patch.k1, 1), 0.5 < found.extent < 1.5
    ('ok', -1.0, True)
    """
    p, up = finite_array("point", point, (3,), LARGEST), unit_vector("outward", outward)
    (found,) = explore_many(
        surface,
        p[None],
        up[None],
        planes,
        farthest=farthest,
        largest_std=largest_std,
        tolerance=tolerance,
        most_planes=most_planes,
        extent=extent,
        step=step,
        noise=noise,
        rng=rng,
        tangent=tangent,
        method=method,
        degree=degree,
        weight=weight,
        solver=solver,
    )
    if isinstance(found, ValueError):
        raise found
    return found


def explore_many(
    surface: Surface,
    points: ArrayLike,
    outward: ArrayLike,
    planes: int | Sequence[SamplingPlane] = 3,
    *,
    farthest: float | None = None,
    largest_std: float | None = None,
    tolerance: float | None = None,
    most_planes: int = 6,
    extent: float | str = "auto",
    step: float | str = "auto",
    noise: float = 0.0,
    rng: np.random.Generator | int | None = None,
    tangent: ArrayLike | None = None,
    method: str = "bayes",
    degree: int | str = "auto",
    weight: float | None = None,
    solver: str = "fast",
) -> list[Exploration | ValueError]:
    """What `explore` gives at each of m points; side by side, with their fits in stacks, which is faster.

    points, outward : (m, 3); all else as in `explore`, of all of them

    A touch that is not possible is returned as its error. Raises ValueError for bad arguments.
    """
    found: list[Exploration | ValueError] = result_of(
        exploring_many(
            surface,
            points,
            outward,
            planes,
            farthest=farthest,
            largest_std=largest_std,
            tolerance=tolerance,
            most_planes=most_planes,
            extent=extent,
            step=step,
            noise=noise,
            rng=rng,
            tangent=tangent,
            method=method,
            degree=degree,
            weight=weight,
            solver=solver,
        )
    )
    return found


def exploring_many(
    surface: Surface,
    points: ArrayLike,
    outward: ArrayLike,
    planes: int | Sequence[SamplingPlane] = 3,
    *,
    farthest: float | None = None,
    largest_std: float | None = None,
    tolerance: float | None = None,
    most_planes: int = 6,
    extent: float | str = "auto",
    step: float | str = "auto",
    noise: float = 0.0,
    rng: np.random.Generator | int | None = None,
    tangent: ArrayLike | None = None,
    method: str = "bayes",
    degree: int | str = "auto",
    weight: float | None = None,
    solver: str = "fast",
) -> Found:
    """What `explore_many` gives, in steps: yields after each contour and each stack of fits."""
    length = given("extent", extent)
    wanted: dict[str, Any] = {
        "planes": planes_of(planes),
        "extent": length,
        "step": given("step", step),
        "farthest": length or (None if farthest is None else number("farthest", farthest, above=0.0)),
        "largest_std": None if largest_std is None else number("largest_std", largest_std, above=0.0),
        "tolerance": None if tolerance is None else number("tolerance", tolerance, least=0.0),
        "most_planes": number("most_planes", most_planes, least=3.0),
        "is_grown": method == "bayes",
    }
    fit = options_of(method, degree, None, weight, solver)
    return (yield from touching(surface, points, outward, wanted, noise, rng, tangent, fit))
