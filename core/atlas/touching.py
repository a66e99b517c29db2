# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Touches that grow over a whole object by themselves (paper, VI), and the surface of all of them."""

from collections.abc import Callable, Generator, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ..arguments import LARGEST, Array, finite_array, number, unit_vector
from ..contours.contour import tangent_of, vector_of
from ..contours.finger import FACING, Finger, Surface, first_contact
from ..contours.tracking import generator_of
from ..exploration.one_touch import Exploration
from ..exploration.side_by_side import exploring
from ..exploration.touches import explore
from .charts import Charts
from .field import covered
from .frontier import Frontier, middle_of
from .join import Table, agreed, joined
from .object_atlas import Atlas

# python -m benchmarks.atlas judges these.
MOST = 1000  # There are at most so many touches, unless the caller says otherwise.
FIRST_EXTENT = 300.0  # A half curve of the first touch is at most so many tolerances long.
SIZE = 1.4  # A patch may have a mean deviation of so many tolerances before its neighbors are known.
SMALL = 5.0  # Touches do not go on from a patch whose radius is below so many tolerances.
NARROW = 1.0  # Where a touch was in vain before, a patch needs a radius of only so many tolerances.
SIDE_BY_SIDE = 8  # So many touches at once are faster, and still done in a tenth of a second.
AGAIN = 2  # Patches less certain than the tolerance are touched again at most so often.
LARGER = 2.0  # A touch reaches at most so many radii of the patch from which it goes on.

Contact = tuple[Array, Array]  # A point and its normal, (3,) each.


class Progress(NamedTuple):
    """How far the touches of an object are.

    done : number of touches
    uncovered : number of places that are known to be uncovered
    found : the touches since the last Progress
    joining : share of the patches that are joined; None while the object is touched
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
    """Does what `explore_object` does in steps: yields a Progress after each, and returns the Atlas.

    If it is sent False, it stops touching and joins the patches so far. Arguments and errors are those of
    `explore_object`; errors are raised in the first step.
    """
    p, up = finite_array("point", point, (3,), LARGEST), unit_vector("outward", outward)
    tolerance, noise = number("tolerance", tolerance, above=0.0), number("noise", noise, least=0.0)
    most, generator = int(number("most", most, least=1.0)), generator_of(rng)
    if tolerance < noise:
        raise ValueError(f"tolerance: expected the noise {noise:g} or more, got {tolerance:g}")
    run = _Run(surface, tolerance, most, {"noise": noise, "rng": generator, "largest_std": SIZE * tolerance})
    more = (yield run.first(p, up)) is not False
    more = yield from _all_over(run, more)
    return (yield from _joined(run, more))


def _all_over(run: "_Run", more: bool) -> Generator[Progress, bool | None, bool]:
    """Touches until nothing within reach is uncovered. Returns whether to go on: False once False is sent."""
    while more and run.done < run.most:
        chosen, more = yield from _told(run.frontier.taking(min(SIDE_BY_SIDE, run.most - run.done)), run.now)
        if not chosen or not more:
            break
        farthest = LARGER * max(touch.place.radius for touch in chosen)
        contacts = [(touch.point, touch.outward) for touch in chosen]
        least = [NARROW if touch.place.tried else SMALL for touch in chosen]
        new, more = yield from _told(run.touch(contacts, farthest, least), run.now)
        for touch in chosen:
            run.frontier.tried(touch)
        more = (yield run.now(new=new)) is not False and more
    return more


def _told(
    steps: Generator[Any, None, Any], progress_of: Callable[[Any], Progress]
) -> Generator[Progress, bool | None, tuple[Any, bool]]:
    """Runs steps and yields a Progress for each. Returns their result, and False once False is sent."""
    more = True
    while True:
        try:
            progress = progress_of(next(steps))
        except StopIteration as end:
            return end.value, more
        more = (yield progress) is not False and more


class _Run:
    """The touches so far, and what all of them have in common."""

    def __init__(self, surface: Surface, tolerance: float, most: int, wanted: dict[str, Any]) -> None:
        self.surface, self.tolerance, self.most, self.wanted = surface, tolerance, most, wanted
        self.found: list[Exploration] = []
        self.done = 0

    def first(self, point: Array, up: Array) -> Progress:
        """Makes the touch from which all others go on. Raises ValueError if it fails."""
        first = explore(self.surface, point, up, farthest=FIRST_EXTENT * self.tolerance, **self.wanted)
        p, n = vector_of(point), vector_of(up)
        side = first_contact(self.surface, p, n, tangent_of(n, None), first.step)[2]
        self.frontier = Frontier(Finger(self.surface, side), np.pi * (NARROW * self.tolerance) ** 2)
        self.frontier.add(first.result)
        self.found, self.done = [first], 1
        return self.now(new=[first])

    def now(self, joining: float | None = None, new: Sequence[Exploration] = ()) -> Progress:
        """The Progress so far, with the new touches."""
        return Progress(self.done, len(self.frontier.queue), tuple(new), joining)

    def touch(
        self, contacts: Sequence[Contact], farthest: float, least: Sequence[float]
    ) -> Generator[None, None, list[Exploration]]:
        """Touches at contacts; returns those that succeed, and adds their rims to the frontier.

        least : the least radius of each, in tolerances; along a crease narrow ones would go on without end
        """
        points, outward = (np.array(values) for values in zip(*contacts, strict=True))
        results = yield from exploring(self.surface, points, outward, farthest=farthest, **self.wanted)
        new = []
        for e, up, times in zip(results, outward, least, strict=True):
            if isinstance(e, ValueError) or e.result.frame.axes[:, 2] @ up < FACING:
                continue  # At an edge a fit may end up on the other side.
            if e.result.radius >= times * self.tolerance:
                self.frontier.add(e.result, goes_on=e.result.radius >= SMALL * self.tolerance)
                new.append(e)
                yield
        self.found += new
        self.done += len(contacts)
        return new

    def joining(self, known: dict[int, tuple[int, Table]]) -> Generator[float, None, Charts]:
        """The joined patches; yields the share that is done."""
        assert self.frontier.charts is not None
        contours, results = [e.contours for e in self.found], [e.result for e in self.found]
        yield 0.0
        return (yield from joined(contours, results, self.frontier.charts, self.wanted["noise"], known))

    def missing(self, charts: Charts, rough: list[int]) -> list[Contact | None]:
        """For each patch of `rough` the contact in the middle of those that no other covers, or None."""
        others = charts.chosen(np.setdiff1d(np.arange(len(self.found)), rough))
        found: list[Contact | None] = []
        for i in rough:
            points = np.vstack([contour.points for contour in self.found[i].contours])
            normals = np.vstack([contour.normals for contour in self.found[i].contours])  # type: ignore[misc]
            new = np.flatnonzero(~covered(others, points, normals))
            middle = new[middle_of(points[new])] if len(new) else None
            found.append(None if middle is None else (points[middle], normals[middle]))
        return found


def _joined(run: _Run, more: bool) -> Steps:
    """The atlas of what was found, after more touches where patches are less certain than the tolerance.

    Patches that stay less certain are left out if others cover all that they have felt.
    """
    known: dict[int, tuple[int, Table]] = {}
    for again in range(AGAIN, -1, -1):
        charts, goes_on = yield from _told(run.joining(known), run.now)
        more = goes_on and more
        rough = charts.less_certain_than(run.tolerance)
        missing = run.missing(charts, rough)
        chosen = [contact for contact in missing if contact is not None][: run.most - run.done]
        if not (again and chosen and more):
            break
        farthest, before = float(charts.radii[rough].max()), len(run.found)
        new, more = yield from _told(run.touch(chosen, farthest, [SMALL] * len(chosen)), run.now)
        more = (yield run.now(new=new)) is not False and more
        more = yield from _all_over(run, more)
        if len(run.found) == before:
            break
    gone = [i for i, contact in zip(rough, missing, strict=True) if contact is None]
    kept = np.setdiff1d(np.arange(len(run.found)), gone)
    patches, charts = tuple(run.found[i].result for i in kept), charts.chosen(kept)
    charts, _ = yield from _told(agreed(charts), run.now)
    uncovered, _ = yield from _told(run.frontier.uncovered(charts), lambda _: run.now(1.0))
    return Atlas(patches, charts, run.tolerance, tuple(uncovered))


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
    """Touches a whole object (paper, VI), from one reference point on, and joins the patches to one surface.

    point, outward : (3,), where to begin, and the outward direction there
    tolerance : a length; touches go on until the mean deviation of each patch's height is below it, if
        possible
    noise, rng : as in `explore`
    most : the largest number of touches
    progress : called with the numbers of touches and of places known to be uncovered; may return False to
        stop

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
