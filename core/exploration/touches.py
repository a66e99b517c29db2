# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Touches that choose their own size: curves as long as the patch is sure, as many contacts as help.

Not in the paper. Lengths are tried from long to short, and the first whose patch is sure is taken. Touches go
side by side, in steps, and their fits come in stacks.
"""

import math
from collections.abc import Callable, Generator, Sequence
from dataclasses import replace
from functools import cache, partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..arguments import LARGEST, Array, finite_array, unit_vector
from ..contours.contour import EXTENT, Contour, SamplingPlane, Vector, along, scaled, vector_of
from ..contours.finger import SAME_SHEET_COSINE, NoContactError, Surface, checked, contact_of
from ..contours.tracking import generator_of, track, tracker
from ..reconstruction.from_contours import fitted
from ..reconstruction.options import FitOptions
from ..reconstruction.start import TouchContacts
from ..reconstruction.strokes import gathered
from ..steps import result_of
from .extent import MOST_CONTACTS, Answer, Exploration, Follow, Request, Steps, Touch
from .options import ExplorationOptions, planes_of
from .taps import HAIR

LONGEST = 1e15  # Lengths up to this multiple of the first one are tried, and down to its inverse.
BISECTIONS = 6  # They narrow a factor of two to a 64th of it,
SHEET_BISECTIONS = 26  # and these so far that what they began with changes results by less than 1e-6.
ODD = math.e  # Fractions of an object's size would end exactly on its edges, those of this multiple do not.

Results = Generator[None, None, list[Exploration | ValueError]]


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

    planes : as in `track`, or how many, k, 3 to 24: then their azimuths are pi i / k
    farthest : greatest length of a half curve; None for no limit, if curves end by themselves
    largest_std : mean deviation of the height that a sure patch has at most; half curves also end where the
      surface bends by 40 degrees. With None the finger also taps between the curves (taps.py): where the
      surface is not that of the fit, the patch is in doubt; with the extent "auto" shorter curves are tried
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


def exploring_many(
    surface: Surface, points: ArrayLike, outward: ArrayLike, options: ExplorationOptions
) -> Results:
    """What `explore_many` gives, in steps: yields after each contour and each stack of fits.

    points, outward : (m, 3)

    Raises ValueError for bad arguments, and where curves do not end and there is no farthest length.
    """
    p = finite_array("points", points, (None, 3), LARGEST)
    up = finite_array("outward", outward, (len(p), 3))
    up = np.array([unit_vector("outward", direction) for direction in up]).reshape(-1, 3)
    generator, tangent, surface = generator_of(options.rng), options.tangent, checked(surface)
    # For a whole object half curves end where another sheet begins, and all others at no angle.
    cosine = SAME_SHEET_COSINE if options.largest_std else -1.0

    def steps(point: Array, direction: Array) -> Steps:
        """The steps of one touch."""
        place = surface, vector_of(point), vector_of(direction)

        def follow(planes: Sequence[SamplingPlane], step: float) -> Follow:
            """What follows the contours of planes."""
            return tracker(
                *place,
                planes,
                step=step,
                noise=options.noise,
                rng=generator,
                tangent=tangent,
                least_cosine=cosine,
            )

        farthest = options.farthest or _farthest(
            *place, options.planes, partial(track, *place, tangent=tangent)
        )
        followed = cache(partial(follow, options.planes))
        return (yield from Touch(surface, point, direction, follow, followed, farthest, options).steps())

    return _side_by_side([steps(*place) for place in zip(p, up, strict=True)], p, up, options.fit)


def _farthest(
    surface: Surface,
    point: Vector,
    outward: Vector,
    planes: Sequence[SamplingPlane],
    track_along: Callable[..., list[Contour]],
) -> float:
    """The length at which all half curves have ended, to one part in 64: by doubling, then bisection.

    track_along : `track` as a function of planes, extent and step

    The lengths that are tried follow from the surface, so that another unit does not change the result.
    """

    def ended(length: float) -> bool:
        """Whether all half curves, tracked with few contacts, end before this, or no contact can be made."""
        lengths = {"extent": length, "step": length / (MOST_CONTACTS // 2)}
        try:
            contours = (contour for plane in planes for contour in track_along([plane], **lengths))
            return not any(EXTENT in (contour.stops or ()) for contour in contours)
        except NoContactError:
            return True

    # Lengths that are far shorter than the coordinates are lost to rounding.
    least, most = _bracket(ended, max(1.0, *map(abs, point)))
    depth = _depth(surface, point, outward, least)
    if depth is None:
        return _bisected(ended, least, most, SHEET_BISECTIONS)
    start = ODD * depth * 2.0 ** math.ceil(math.log2(least / (ODD * depth)))
    return _bisected(ended, *_bracket(ended, start), BISECTIONS)


def _bracket(ended: Callable[[float], bool], start: float) -> tuple[float, float]:
    """Two lengths, one twice the other, between which all half curves end: `start` doubled or halved."""
    most = start
    while not ended(most):
        most *= 2.0
        if most > start * LONGEST:
            raise ValueError("The curves do not end by themselves: set farthest, the greatest length to feel")
    while ended(0.5 * most):
        most *= 0.5
        if most * LONGEST < start:
            raise ValueError("All curves end at once, however short they are: take another point")
    return 0.5 * most, most


def _bisected(ended: Callable[[float], bool], least: float, most: float, count: int) -> float:
    """The length between two others at which all half curves have ended, after `count` bisections."""
    for _ in range(count):
        middle = 0.5 * (least + most)
        least, most = (least, middle) if ended(middle) else (middle, most)
    return most


def _depth(surface: Surface, point: Vector, outward: Vector, length: float) -> float | None:
    """The distance of the next wall below a point; None if there is none, as below a sheet.

    length : one to which curves can be felt there, so that a share of it is below the surface at the point
    """
    down, longest = scaled(outward, -1.0), length * LONGEST
    start = along(point, down, HAIR * length)
    while length < longest:
        hit = surface.ray_cast(start, down, length)
        if hit is not None:
            return math.dist(contact_of(hit, 1.0)[0], point)
        length *= 2.0
    return None


def _side_by_side(steps: Sequence[Steps], points: Array, outward: Array, fit: FitOptions) -> Results:
    """The results of b touches at points (b, 3) with outward directions (b, 3); fits are done in stacks.

    Yields after each contour and each stack.
    """
    explored: dict[int, Exploration | ValueError] = {}
    answers: dict[int, Answer | None] = dict.fromkeys(range(len(steps)))
    methods, no_strokes = {m: replace(fit, method=m) for m in ("bayes", fit.method)}, gathered(())
    while answers:
        requests: dict[int, Request] = {}
        for i, answer in answers.items():
            try:
                requests[i] = steps[i].send(answer)  # type: ignore[arg-type]
            except StopIteration as end:
                explored[i] = end.value
            except ValueError as error:
                explored[i] = error
            yield
        answers = {}
        for method, options in methods.items():
            contours = {i: some for i, (some, wanted) in requests.items() if wanted == method}
            which = list(contours)
            touches = [TouchContacts(some, *no_strokes) for some in contours.values()]
            if which:
                results = fitted(points[which], touches, outward[which], options)
                answers.update(zip(which, results, strict=True))
                yield
    return [explored[i] for i in range(len(steps))]
