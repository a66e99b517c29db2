# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Touches that grow over a whole object by themselves (paper, VI), and the surface of all of them."""

from collections.abc import Callable, Generator
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ..arguments import LARGEST, finite_array, number, unit_vector
from ..contours.tracking import Surface, generator_of
from ..exploration.one_touch import Exploration
from ..exploration.touches import explore, explore_many
from .frontier import Frontier, Next, side_of
from .join import joined
from .object_atlas import Atlas

MOST = 1000
FIRST = 300.0  # times the tolerance, that half curves of the first touch may become
SIZE = 1.5  # times the tolerance, that a patch may be uncertain in the mean before its neighbors are known
LEAST = 5.0  # times it, that a patch is wide at least
SIDE_BY_SIDE = 4  # touches at once: some times as fast, and still done in a tenth of a second
LARGER = 2.0  # times the patch where it begins, that a touch may become


class Progress(NamedTuple):
    """How far it is: touches done, places known to be uncovered, and the touches that came since the last.

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

    Sent False, it touches no more and joins what there is. Arguments and errors are those of
    `explore_object`; the errors come with the first step.
    """
    p, up = finite_array("point", point, (3,), LARGEST), unit_vector("outward", outward)
    tolerance, noise = number("tolerance", tolerance, above=0.0), number("noise", noise, least=0.0)
    most, generator = int(number("most", most, least=1.0)), generator_of(rng)
    if tolerance < noise:
        raise ValueError(f"tolerance: wanted the noise {noise:g} or more, got {tolerance:g}")
    wanted = {"noise": noise, "rng": generator, "largest_std": SIZE * tolerance}
    found = [explore(surface, p, up, farthest=FIRST * tolerance, **wanted)]  # type: ignore[arg-type]
    frontier = Frontier(surface, side_of(surface, p, up, found[0].step))
    frontier.add(found[0].result)
    more = yield Progress(1, len(frontier.queue), tuple(found))
    done = 1
    while more is not False and done < most:
        chosen = frontier.take(min(SIDE_BY_SIDE, most - done))
        if not chosen:
            break
        done += len(chosen)
        new = _touched(surface, frontier, chosen, LEAST * tolerance, wanted)
        found += new
        more = yield Progress(done, len(frontier.queue), tuple(new))
    return (yield from _joined(found, done, frontier, tolerance, noise))


def _touched(
    surface: Surface, frontier: Frontier, chosen: list[Next], least: float, wanted: dict[str, object]
) -> list[Exploration]:
    """Touches at the places chosen, where there can be one; their rims are the frontier's."""
    points, outward = np.array([n.point for n in chosen]), np.array([n.outward for n in chosen])
    farthest = LARGER * max(n.place.radius for n in chosen)
    results = explore_many(surface, points, outward, farthest=farthest, **wanted)  # type: ignore[arg-type]
    found = []
    for touch, result in zip(chosen, results, strict=True):
        if isinstance(result, Exploration) and result.result.radius >= least:
            frontier.add(result.result)
            found.append(result)
        frontier.tried(touch)
    return found


def _joined(found: list[Exploration], done: int, frontier: Frontier, tolerance: float, noise: float) -> Steps:
    assert frontier.charts is not None
    steps = joined([e.contours for e in found], [e.result for e in found], frontier.charts, noise)
    uncovered = tuple(frontier.uncovered())
    while True:
        try:
            yield Progress(done, len(uncovered), joining=next(steps))
        except StopIteration as end:
            return Atlas(tuple(e.result for e in found), end.value, tolerance, uncovered)


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

    point, outward : (3,), where to begin, and the side of the finger
    tolerance : a length, that the mean deviation of each patch's height is to be below
    noise, rng : as in `explore`
    most : touches
    progress : is called with the touches done and the places known to be uncovered; False ends it there

    Only rays are asked of the surface. Raises ValueError for bad arguments, for a tolerance below the noise
    and where the first touch is none; whatever comes later is left uncovered, and the Atlas says so.
    """
    steps = touch_all_over(surface, point, outward, tolerance=tolerance, noise=noise, most=most, rng=rng)
    try:
        state = next(steps)
        while True:
            more = progress(state.done, state.uncovered) if progress and state.joining is None else None
            state = steps.send(False if more is False else None)
    except StopIteration as end:
        atlas: Atlas = end.value
        return atlas
