# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A touch that chooses its own size: curves as long as its patch is sure, as many contacts as help.

Not in the paper. Lengths are tried from long to short, and the first whose patch is sure is taken.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..arguments import LARGEST, finite_array, unit_vector
from ..contours.contour import SamplingPlane
from ..contours.finger import Surface
from ..steps import result_of
from .extent import Exploration
from .options import ExplorationOptions, planes_of
from .side_by_side import exploring_many


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
    largest_std : mean deviation of the height that a sure patch has at most; half curves also end where the
      surface bends by 40 degrees. With None the finger also taps between the curves (taps.py): where the
      surface is not that of the fit, it is in doubt, or with the extent "auto" shorter curves are tried
    tolerance : mean deviation of the height to reach: until then the plane that helps most is added, up to
        `most_planes`, as long as one takes a tenth off. None adds no planes
    extent : length of each half curve, as in `track`; with "auto" the longest whose default fit is sure
    step : as in `track`; "auto" chooses the number of contacts such that twice as many would not lower the
        deviation of the height noticeably
    noise, rng, tangent : as in `track`; the contours pass the noise on to the fit
    method, degree, weight, solver : as in `reconstruct`

    Half curves that the touch ends itself have the stop "fit no longer matched". Raises what `track` and
    `reconstruct` raise, and ValueError where curves do not end and `farthest` is None.

    >>> import math
    >>> class Ball:
    ...     def ray_cast(self, origin, direction, distance):
    ...         o, d = np.array(origin), np.array(direction)
    ...         root = math.sqrt(max((o @ d) ** 2 - o @ o + 1.0, 0.0))
    ...         t = next((t for t in (-o @ d - root, -o @ d + root) if root and 0.0 < t <= distance), None)
    ...         return None if t is None else (tuple(o + t * d), tuple(o + t * d))
    >>> touch = explore(Ball(), (0.0, 0.0, 1.0), (0.0, 0.0, 1.0))
    >>> touch.result.status, round(touch.result.patch.k1, 1), 0.5 < touch.extent < 1.5
    ('ok', -1.0, True)
    """
    p, up = finite_array("point", point, (3,), LARGEST), unit_vector("outward", outward)
    options = ExplorationOptions(
        planes_of(planes),
        farthest=farthest,
        largest_std=largest_std,
        tolerance=tolerance,
        most_planes=most_planes,
        extent=extent,  # type: ignore[arg-type]  # "auto" becomes None
        step=step,  # type: ignore[arg-type]
        noise=noise,
        rng=rng,
        tangent=tangent,
        method=method,
        degree=degree,
        weight=weight,
        solver=solver,
    )
    (explored,) = result_of(exploring_many(surface, p[None], up[None], options))
    if isinstance(explored, ValueError):
        raise explored
    return explored


def explore_many(
    surface: Surface,
    points: ArrayLike,
    outward: ArrayLike,
    planes: int | Sequence[SamplingPlane] = 3,
    **options: Any,
) -> list[Exploration | ValueError]:
    """What `explore` gives at each of m points; side by side, with their fits in stacks, which is faster.

    points, outward : (m, 3)
    planes, options : as in `explore`, of all of them

    A touch that is not possible is returned as its error. Raises ValueError for bad arguments.
    """
    return result_of(
        exploring_many(surface, points, outward, ExplorationOptions(planes_of(planes), **options))
    )
