# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Touches that choose their size side by side, in steps: the fits that they ask for come in stacks."""

import math
from collections.abc import Callable, Generator, Sequence
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
from .taps import tapped

MOST_EVEN = 24  # At most so many planes are laid out evenly.
GLANCE_CONTACTS = 8  # Contacts of a half curve that only tell whether it ends.
LONGEST = 1e15  # Lengths beyond this, or below its inverse, are not tried.
BISECTIONS = 6  # They leave a factor of two no more than a 64th.

Found = Generator[None, None, list[Exploration | ValueError]]


def exploring(
    surface: Surface,
    points: ArrayLike,
    outward: ArrayLike,
    *,
    farthest: float,
    largest_std: float,
    noise: float,
    rng: np.random.Generator,
) -> Found:
    """What `explore_many` gives by its defaults, in steps: yields a few times for each touch."""
    wanted: dict[str, Any] = {
        "planes": planes_of(3),
        "extent": None,
        "step": None,
        "farthest": farthest,
        "largest_std": largest_std,
        "tolerance": None,
        "most_planes": 6,
        "is_grown": True,
    }
    return touching(
        surface, points, outward, wanted, noise, rng, None, options_of("bayes", "auto", None, None, "fast")
    )


def touching(
    surface: Surface,
    points: ArrayLike,
    outward: ArrayLike,
    wanted: dict[str, Any],
    noise: float,
    rng: np.random.Generator | int | None,
    tangent: ArrayLike | None,
    fit: Options,
) -> Found:
    """Touches at (m, 3), side by side; `wanted` is what Touch takes, but for where."""
    p = finite_array("points", points, (None, 3), LARGEST)
    up = finite_array("outward", outward, (len(p), 3))
    up = np.array([unit_vector("outward", direction) for direction in up]).reshape(-1, 3)
    noise, generator = number("noise", noise, least=0.0), generator_of(rng)

    def steps(point: Array, direction: Array) -> Steps:
        """The steps of one touch."""
        reference = SamplingPlane(0.0).axes(direction, tangent)
        place = surface, point, direction
        farthest = wanted["farthest"] or _farthest(partial(track, *place, wanted["planes"], tangent=tangent))
        follow = partial(following, *place, noise=noise, rng=generator, tangent=tangent)
        more = wanted | {"farthest": farthest, "tap": partial(tapped, surface)}
        return (yield from Touch(follow, point, reference, **more).steps())

    return _side_by_side([steps(*place) for place in zip(p, up, strict=True)], p, up, fit)


def result_of(steps: Generator[Any, Any, Any]) -> Any:
    """What steps return once they are done."""
    try:
        while True:
            next(steps)
    except StopIteration as end:
        return end.value


def planes_of(planes: int | Sequence[SamplingPlane]) -> tuple[SamplingPlane, ...]:
    """So many planes, evenly, or those that are given."""
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
            contours = feel(extent=length, step=length / GLANCE_CONTACTS)
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


def given(name: str, length: float | str) -> float | None:
    """None for "auto"."""
    automatic = isinstance(length, str) and length == "auto"
    return None if automatic else number(name, length, above=0.0)  # type: ignore[arg-type]


def _side_by_side(steps: Sequence[Steps], points: Array, outward: Array, fit: Options) -> Found:
    """What each of b touches comes to, at (b, 3) and (b, 3); the fits that they ask for in stacks.

    Yields after each contour and each stack.
    """
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
            yield
        answers = {}
        for growing in (True, False):
            which = [i for i, ask in asked.items() if ask.growing is growing]
            options = fit._replace(method="bayes") if growing else fit
            touches = [Given(asked[i].contours, *gathered(())) for i in which]
            if which:
                results = fitted(points[which], touches, outward[which], options)
                answers.update(zip(which, _with_stds(results), strict=True))
                yield
    return [found[i] for i in range(len(steps))]


def _with_stds(results: list[Answer]) -> list[Answer]:
    """The results with the mean_height_std of many computed at once."""
    if len(results) == 1:
        return results
    known = iter(with_height_stds([r for r in results if isinstance(r, Reconstruction)]))
    return [next(known) if isinstance(r, Reconstruction) else r for r in results]
