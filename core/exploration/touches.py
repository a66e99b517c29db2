# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A touch that chooses its own size: curves as long as a patch can be trusted, contacts as many as tell.

Beside the paper. Half curves grow outward from the reference point like the regions of a segmentation
by surface fitting: fit, go on where the fit explains the contacts, fit again (growth.py).
"""

import math
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..arguments import LARGEST, Array, finite_array, list_of, number, unit_vector
from ..contours.contour import EXTENT, Contour, SamplingPlane
from ..contours.finger import Surface
from ..contours.tracking import following, generator_of, track
from ..reconstruction.deviations import with_height_stds
from ..reconstruction.from_contours import fitted, options_of
from ..reconstruction.result import Reconstruction
from ..reconstruction.stacks import Options
from ..reconstruction.start import Given
from ..reconstruction.strokes import gathered
from .one_touch import Answer, Ask, Exploration, Steps, Touch

MOST_EVEN = 24  # At most so many planes are laid out evenly.
COARSE_STEPS = 8  # Contacts of a half curve that only tell whether it ends.
LONGEST = 1e15  # Lengths beyond this, or below its inverse, are not tried.
BISECTIONS = 6  # They leave a factor of two no more than a 64th.


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
      explained; None for shares of the radius
    tolerance : mean deviation of the height to reach: until then the plane that tells most is added, up to
        `most_planes`, as long as one takes a tenth off. None adds no planes
    extent : length of each half curve, as in `track`; with "auto" each grows until the default fit no
        longer explains its contacts by their accuracy, or the patch could no longer be trusted
    step : as in `track`; "auto" chooses the number of contacts such that twice as many would not lower the
        deviation of the height noticeably
    noise, rng, tangent : as in `track`; the contours tell the fit of the noise
    method, degree, weight, solver : as in `reconstruct`

    If a contour was not followed any farther, its `stops` are UNEXPLAINED. Raises what `track` and
    `reconstruct` raise, and ValueError where curves do not end and `farthest` is None.

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
    p = finite_array("points", points, (None, 3), LARGEST)
    up = finite_array("outward", outward, (len(p), 3))
    up = np.array([unit_vector("outward", direction) for direction in up]).reshape(-1, 3)
    length, generator = _given("extent", extent), generator_of(rng)
    noise = number("noise", noise, least=0.0)
    wanted: dict[str, Any] = {
        "planes": _planes(planes),
        "extent": length,
        "step": _given("step", step),
        "farthest": length or (None if farthest is None else number("farthest", farthest, above=0.0)),
        "largest_std": None if largest_std is None else number("largest_std", largest_std, above=0.0),
        "tolerance": None if tolerance is None else number("tolerance", tolerance, least=0.0),
        "most_planes": number("most_planes", most_planes, least=3.0),
        "is_grown": method == "bayes",
    }

    def steps(point: Array, direction: Array) -> Steps:
        """The steps of one touch."""
        reference = SamplingPlane(0.0).axes(direction, tangent)
        place = surface, point, direction
        farthest = wanted["farthest"] or _farthest(partial(track, *place, wanted["planes"], tangent=tangent))
        follow = partial(following, *place, noise=noise, rng=generator, tangent=tangent)
        return (yield from Touch(follow, point, reference, **wanted | {"farthest": farthest}).steps())

    fit = options_of(method, degree, None, weight, solver)
    return _side_by_side([steps(*place) for place in zip(p, up, strict=True)], p, up, fit)


def _planes(planes: int | Sequence[SamplingPlane]) -> tuple[SamplingPlane, ...]:
    if not isinstance(planes, int | np.integer):
        return tuple(list_of("planes", planes, SamplingPlane))
    if not 3 <= planes <= MOST_EVEN:
        raise ValueError(f"planes: expected 3 to {MOST_EVEN}, or sampling planes, got {planes}")
    return tuple(SamplingPlane(math.pi * i / planes) for i in range(planes))


def _farthest(feel: Callable[..., list[Contour]]) -> float:
    """A length, within a hundredth, at which all half curves end before it.

    Raises what `feel` raises where nothing can be felt at any length.
    """
    felt: list[float] = []

    def ended(length: float) -> bool:
        """Whether all do, felt coarsely; where nothing can be felt the length is beyond all."""
        try:
            contours = feel(extent=length, step=length / COARSE_STEPS)
        except ValueError:
            if length <= 1.0 / LONGEST and not felt:
                raise
            return True
        felt.append(length)
        return not any(EXTENT in (contour.stops or ()) for contour in contours)

    least, most = (1.0, 2.0) if not ended(1.0) else (0.5, 1.0)
    while ended(least):
        least, most = 0.5 * least, least
    while not ended(most):
        least, most = most, 2.0 * most
        if most > LONGEST:
            raise ValueError("The curves do not end by themselves: set farthest, the greatest length to feel")
    for _ in range(BISECTIONS):
        middle = 0.5 * (least + most)
        least, most = (least, middle) if ended(middle) else (middle, most)
    return most


def _given(name: str, length: float | str) -> float | None:
    """None for "auto"."""
    automatic = isinstance(length, str) and length == "auto"
    return None if automatic else number(name, length, above=0.0)  # type: ignore[arg-type]


def _side_by_side(
    steps: Sequence[Steps], points: Array, outward: Array, fit: Options
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
            options = fit._replace(method="bayes") if growing else fit
            touches = [Given(asked[i].contours, *gathered(())) for i in which]
            if which:
                results = fitted(points[which], touches, outward[which], options)
                answers.update(zip(which, _with_stds(results), strict=True))
    return [found[i] for i in range(len(steps))]


def _with_stds(results: list[Answer]) -> list[Answer]:
    """The results with the mean_height_std of many computed at once."""
    if len(results) == 1:
        return results
    known = iter(with_height_stds([r for r in results if isinstance(r, Reconstruction)]))
    return [next(known) if isinstance(r, Reconstruction) else r for r in results]
