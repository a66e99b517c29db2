# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Touches that grow over a whole object by themselves (paper, VI), and the surface of all of them."""

from collections.abc import Callable, Generator
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ..arguments import LARGEST, finite_array, number, unit_vector
from ..contours.finger import Surface
from ..contours.tracking import generator_of
from ..exploration.one_touch import Exploration
from ..exploration.side_by_side import exploring
from ..exploration.touches import explore
from .frontier import Frontier, Next, side_of
from .join import joined
from .object_atlas import Atlas

MOST = 1000
FIRST = 300.0  # times the tolerance, that half curves of the first touch may become
SIZE = 1.5  # times the tolerance, that a patch may be uncertain on average before its neighbors are known
LEAST = 5.0  # times it, that a patch is wide at least
SIDE_BY_SIDE = 4  # touches at once: some times as fast, and still done in a tenth of a second
LARGER = 2.0  # times the patch where it begins, that a touch may become


class Progress(NamedTuple):
    """Touches done, places known to be uncovered, and the touches since the last Progress.

    joining : the share of the patches that are joined; None while the object is touched
    """

    done: int
    uncovered: int
    found: tuple[Exploration, ...] = ()
    joining: float | None = None


Steps = Generator[Progress, bool | None, Atlas]


def touch_all_over(
    surface: Surface,
    point: ArrayLike,
    outward: ArrayLike,
    *,
    tolerance: float,
    noise: float = 0.0,
    most: int = MOST,
    rng: np.random.Generator | int | None = None,
) -> Steps:
    """What `explore_object` does, in steps: yields a Progress after each, and returns the Atlas.

    If it is sent False, it stops touching and joins the patches so far. Arguments and errors are those of
    `explore_object`; the errors come with the first step.
    """
    p, up = finite_array("point", point, (3,), LARGEST), unit_vector("outward", outward)
    tolerance, noise = number("tolerance", tolerance, above=0.0), number("noise", noise, least=0.0)
    most, generator = int(number("most", most, least=1.0)), generator_of(rng)
    if tolerance < noise:
        raise ValueError(f"tolerance: expected the noise {noise:g} or more, got {tolerance:g}")
    wanted: dict[str, Any] = {"noise": noise, "rng": generator, "largest_std": SIZE * tolerance}
    found = [explore(surface, p, up, farthest=FIRST * tolerance, **wanted)]
    frontier = Frontier(surface, side_of(surface, p, up, found[0].step))
    frontier.add(found[0].result)
    more = yield Progress(1, len(frontier.queue), tuple(found))
    done = 1
    while more is not False and done < most:
        now = Progress(done, len(frontier.queue))
        chosen, more = yield from _told(frontier.taking(min(SIDE_BY_SIDE, most - done)), now)
        if not chosen or not more:
            break
        done += len(chosen)
        new, more = yield from _told(_touched(surface, frontier, chosen, LEAST * tolerance, wanted), now)
        found += new
        more = (yield Progress(done, len(frontier.queue), tuple(new))) is not False and more
    return (yield from _joined(found, done, frontier, tolerance, noise))


def _told(
    steps: Generator[None, None, Any], progress: Progress
) -> Generator[Progress, bool | None, tuple[Any, bool]]:
    """What steps return, and whether nobody has sent False; tells the same progress after each of them."""
    more = True
    while True:
        try:
            next(steps)
        except StopIteration as end:
            return end.value, more
        more = (yield progress) is not False and more


def _touched(
    surface: Surface, frontier: Frontier, chosen: list[Next], least: float, wanted: dict[str, Any]
) -> Generator[None, None, list[Exploration]]:
    """Touches at the places chosen, where there can be one; their rims are the frontier's."""
    points, outward = np.array([n.point for n in chosen]), np.array([n.outward for n in chosen])
    farthest = LARGER * max(n.place.radius for n in chosen)
    results = yield from exploring(surface, points, outward, farthest=farthest, **wanted)
    found = []
    for touch, result in zip(chosen, results, strict=True):
        if isinstance(result, Exploration) and result.result.radius >= least:
            frontier.add(result.result)
            found.append(result)
        frontier.tried(touch)
        yield
    return found


def _joined(found: list[Exploration], done: int, frontier: Frontier, tolerance: float, noise: float) -> Steps:
    assert frontier.charts is not None
    steps = joined([e.contours for e in found], [e.result for e in found], frontier.charts, noise)
    uncovered = tuple(frontier.uncovered())
    yield Progress(done, len(uncovered), joining=0.0)
    while True:
        try:
            yield Progress(done, len(uncovered), joining=next(steps))
        except StopIteration as end:
            patches, charts = end.value
            return Atlas(tuple(patches), charts, tolerance, uncovered)


def explore_object(
    surface: Surface,
    point: ArrayLike,
    outward: ArrayLike,
    *,
    tolerance: float,
    noise: float = 0.0,
    most: int = MOST,
    rng: np.random.Generator | int | None = None,
    progress: Callable[[int, int], object] | None = None,
) -> Atlas:
    """Touches a whole object, from one reference point on, and joins the patches to one surface.

    point, outward : (3,), where to begin, and the outward direction
    tolerance : a length; the mean deviation of each patch's height should be below it
    noise, rng : as in `explore`
    most : touches
    progress : called with the touches done and the places known to be uncovered; it returns False to end

    The surface only has to answer rays. Raises ValueError for bad arguments, for a tolerance below the noise,
    and if the first touch fails. Where a later touch fails, the Atlas has an uncovered place.
    """
    steps = touch_all_over(surface, point, outward, tolerance=tolerance, noise=noise, most=most, rng=rng)
    try:
        state, told = next(steps), 0
        while True:
            more = None
            if progress and state.joining is None and state.done > told:
                more, told = progress(state.done, state.uncovered), state.done
            state = steps.send(False if more is False else None)
    except StopIteration as end:
        atlas: Atlas = end.value
        return atlas
