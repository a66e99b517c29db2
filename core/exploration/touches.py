# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A touch that chooses its own size: curves as long as a patch can be trusted, contacts as many as tell.

Beside the paper. Half curves grow outward from the reference point like the regions of a segmentation
by surface fitting: fit, go on where the fit explains the contacts, fit again (growth.py).
"""

from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..arguments import LARGEST, Array, finite_array, list_of, number, unit_vector
from ..contours.contour import SamplingPlane
from ..contours.tracking import Surface, generator_of, track
from ..reconstruction.deviations import with_height_stds
from ..reconstruction.from_contours import reconstruct_many
from ..reconstruction.result import Reconstruction
from .one_touch import Answer, Ask, Exploration, Steps, Touch


def explore(
    surface: Surface,
    point: ArrayLike,
    outward: ArrayLike,
    planes: Sequence[SamplingPlane],
    *,
    farthest: float,
    tolerance: float | None = None,
    most_planes: int = 6,
    extent: float | str = "auto",
    step: float | str = "auto",
    noise: float = 0.0,
    rng: np.random.Generator | int | None = None,
    tangent: ArrayLike | None = None,
    **fit: Any,
) -> Exploration:
    """Tracks `surface` from `point` and reconstructs the patch, as large and as densely felt as it needs.

    farthest : the longest that a half curve may become
    tolerance : mean deviation of the height that is good enough; until then the plane that tells most is
        added, up to `most_planes`, as long as one takes a tenth off. None for the given planes only
    extent : of each half curve, as in `track`; "auto" has each grow until the default fit no longer
        explains its contacts by their accuracy, or the patch could be trusted no longer
    step : as in `track`; "auto" for so many contacts that twice as many would not lower the deviation of
        the height noticeably
    fit : what `reconstruct` takes; all else as in `track`

    Where a contour was not followed any farther, its `stops` say UNEXPLAINED. Raises what `track` and
    `reconstruct` raise.
    """
    p = finite_array("point", point, (3,), LARGEST)
    up = unit_vector("outward", outward)
    wanted = _wanted(planes, farthest, tolerance, most_planes, extent, step, fit)
    sensor = {"noise": noise, "rng": generator_of(rng), "tangent": tangent}
    (found,) = _side_by_side([_touch(surface, p, up, wanted, sensor).steps()], p[None], up[None], fit)
    if isinstance(found, ValueError):
        raise found
    return found


def explore_many(
    surface: Surface,
    points: ArrayLike,
    outward: ArrayLike,
    planes: Sequence[SamplingPlane],
    *,
    farthest: float,
    tolerance: float | None = None,
    most_planes: int = 6,
    extent: float | str = "auto",
    step: float | str = "auto",
    noise: float = 0.0,
    rng: np.random.Generator | int | None = None,
    tangent: ArrayLike | None = None,
    **fit: Any,
) -> list[Exploration | ValueError]:
    """What `explore` gives at each of m points; side by side, with their fits in stacks, which is faster.

    points, outward : (m, 3); all else as in `explore`, of all of them

    In the place of a touch that there cannot be stands its error. Raises ValueError for bad arguments.
    """
    p = finite_array("points", points, (None, 3), LARGEST)
    up = finite_array("outward", outward, (len(p), 3))
    up = np.array([unit_vector("outward", direction) for direction in up]).reshape(-1, 3)
    wanted = _wanted(planes, farthest, tolerance, most_planes, extent, step, fit)
    sensor = {"noise": noise, "rng": generator_of(rng), "tangent": tangent}
    steps = [_touch(surface, *place, wanted, sensor).steps() for place in zip(p, up, strict=True)]
    return _side_by_side(steps, p, up, fit)


def _wanted(
    planes: Sequence[SamplingPlane],
    farthest: float,
    tolerance: float | None,
    most_planes: int,
    extent: float | str,
    step: float | str,
    fit: dict[str, Any],
) -> dict[str, Any]:
    """Of a Touch, checked."""
    length, between = _given("extent", extent), _given("step", step)
    return {
        "planes": tuple(list_of("planes", planes, SamplingPlane)),
        "extent": length,
        "step": between,
        "farthest": number("farthest", farthest, above=0.0) if length is None else length,
        "tolerance": None if tolerance is None else number("tolerance", tolerance, least=0.0),
        "most_planes": number("most_planes", most_planes, least=3.0),
        "is_grown": fit.get("method", "bayes") == "bayes",
    }


def _given(name: str, length: float | str) -> float | None:
    """None for "auto"."""
    automatic = isinstance(length, str) and length == "auto"
    return None if automatic else number(name, length, above=0.0)  # type: ignore[arg-type]


def _touch(
    surface: Surface, point: Array, outward: Array, wanted: dict[str, Any], sensor: dict[str, Any]
) -> Touch:
    reference = SamplingPlane(0.0).axes(outward, sensor["tangent"])
    return Touch(partial(track, surface, point, outward, **sensor), point, reference, **wanted)


def _side_by_side(
    steps: Sequence[Steps], points: Array, outward: Array, fit: dict[str, Any]
) -> list[Exploration | ValueError]:
    """What each of b touches comes to, at (b, 3) and (b, 3); the fits that they ask for in stacks."""
    found: dict[int, Exploration | ValueError] = {}
    answers: dict[int, Answer | None] = dict.fromkeys(range(len(steps)))
    while answers:
        asked: dict[int, Ask] = {}
        for i, answer in answers.items():
            try:
                asked[i] = steps[i].send(answer)  # type: ignore[arg-type]
            except StopIteration as end:
                found[i] = end.value
            except ValueError as error:
                found[i] = error
        answers = {}
        for growing in (True, False):
            which = [i for i, ask in asked.items() if ask.growing is growing]
            options = fit | ({"method": "bayes"} if growing else {})
            contours = [asked[i].contours for i in which]
            if which:
                results = reconstruct_many(points[which], contours, outward=outward[which], **options)
                answers.update(zip(which, _with_stds(results), strict=True))
    return [found[i] for i in range(len(steps))]


def _with_stds(results: list[Answer]) -> list[Answer]:
    """With the mean_height_std of many computed at once."""
    if len(results) == 1:
        return results
    known = iter(with_height_stds([r for r in results if isinstance(r, Reconstruction)]))
    return [next(known) if isinstance(r, Reconstruction) else r for r in results]
