# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Touches that grow over a whole object by themselves (paper, VI), and the surface of all of them."""

from collections.abc import Callable, Generator, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ..arguments import LARGEST, Array, finite_array, number, unit_vector
from ..contours.finger import Surface
from ..contours.tracking import generator_of
from ..exploration.one_touch import Exploration
from ..exploration.side_by_side import exploring
from ..exploration.touches import explore
from .charts import Charts
from .frontier import Frontier, covered, side_of, still_open
from .join import Table, joined
from .object_atlas import Atlas

MOST = 1000
FIRST_EXTENT = 300.0  # times the tolerance, that half curves of the first touch may become
SIZE = 1.5  # times the tolerance, that a patch may be uncertain on average before its neighbors are known
SMALL = 5.0  # times it, that a patch is wide at least
SIDE_BY_SIDE = 4  # touches at once: some times as fast, and still done in a tenth of a second
AGAIN = 2  # times that patches less certain than the tolerance are touched again
LARGER = 2.0  # times the patch where it begins, that a touch may become

Contact = tuple[Array, Array]  # a point and its normal, (3,) each


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
    run = _Run(surface, tolerance, most, {"noise": noise, "rng": generator, "largest_std": SIZE * tolerance})
    more = (yield run.first(p, up)) is not False
    more = yield from _all_over(run, more)
    return (yield from _joined(run, more))


def _all_over(run: "_Run", more: bool) -> Generator[Progress, bool | None, bool]:
    """Touches until nothing within reach is uncovered; returns whether nobody has sent False."""
    while more and run.done < run.most:
        chosen, more = yield from _told(
            run.frontier.taking(min(SIDE_BY_SIDE, run.most - run.done)), run.now()
        )
        if not chosen or not more:
            break
        farthest = LARGER * max(touch.place.radius for touch in chosen)
        contacts = [(touch.point, touch.outward) for touch in chosen]
        new, more = yield from _told(run.touch(contacts, farthest), run.now())
        for touch in chosen:
            run.frontier.tried(touch)
        more = (yield run.now(new)) is not False and more
    return more


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


class _Run:
    """Touches so far, and what all of them have in common."""

    def __init__(self, surface: Surface, tolerance: float, most: int, wanted: dict[str, Any]) -> None:
        self.surface, self.tolerance, self.most, self.wanted = surface, tolerance, most, wanted
        self.found: list[Exploration] = []
        self.done = 0

    def first(self, point: Array, up: Array) -> Progress:
        """The touch from which all others go on; raises ValueError where there is none."""
        first = explore(self.surface, point, up, farthest=FIRST_EXTENT * self.tolerance, **self.wanted)
        self.frontier = Frontier(self.surface, side_of(self.surface, point, up, first.step))
        self.frontier.add(first.result)
        self.found, self.done = [first], 1
        return self.now([first])

    def now(self, new: Sequence[Exploration] = ()) -> Progress:
        """How far it is."""
        return Progress(self.done, len(self.frontier.queue), tuple(new))

    def touch(self, contacts: Sequence[Contact], farthest: float) -> Generator[None, None, list[Exploration]]:
        """Touches at places, where there can be one that is wide enough; their rims are the frontier's."""
        points, outward = (np.array(values) for values in zip(*contacts, strict=True))
        results = yield from exploring(self.surface, points, outward, farthest=farthest, **self.wanted)
        new = [e for e in results if isinstance(e, Exploration) and e.result.radius >= SMALL * self.tolerance]
        for exploration in new:
            self.frontier.add(exploration.result)
            yield
        self.found += new
        self.done += len(contacts)
        return new

    def missing(self, charts: Charts, rough: list[int]) -> list[Contact | None]:
        """For each of these patches the contact in the middle of those that no other covers, if there are."""
        others = charts.chosen(np.setdiff1d(np.arange(len(self.found)), rough))
        found: list[Contact | None] = []
        for i in rough:
            points = np.vstack([contour.points for contour in self.found[i].contours])
            normals = np.vstack([contour.normals for contour in self.found[i].contours])  # type: ignore[misc]
            new = np.flatnonzero(~covered(others, points, normals))
            off = ((points[new] - points[new].mean(axis=0)) ** 2).sum(axis=1) if len(new) else new
            found.append((points[new[np.argmin(off)]], normals[new[np.argmin(off)]]) if len(new) else None)
        return found


def _joined(run: _Run, more: bool) -> Steps:
    """The atlas of what was found, after more touches where patches are less certain than the tolerance.

    Patches that stay less certain are left out where others cover all that they felt.
    """
    known: dict[int, tuple[int, Table]] = {}
    for again in range(AGAIN, -1, -1):
        uncovered = tuple(run.frontier.uncovered())
        charts, goes_on = yield from _charts(run, len(uncovered), known)
        more = goes_on and more
        rough = charts.less_certain_than(run.tolerance)
        missing = run.missing(charts, rough)
        chosen = [contact for contact in missing if contact is not None][: run.most - run.done]
        if not (again and chosen and more):
            break
        new, more = yield from _told(run.touch(chosen, float(charts.radii[rough].max())), run.now())
        more = (yield run.now(new)) is not False and more
        more = yield from _all_over(run, more)
    gone = [i for i, contact in zip(rough, missing, strict=True) if contact is None]
    kept = np.setdiff1d(np.arange(len(run.found)), gone)
    patches, charts = tuple(run.found[i].result for i in kept), charts.chosen(kept)
    # Patches alone may be off at their rims by so much that others seem not to cover them.
    return Atlas(patches, charts, run.tolerance, tuple(still_open(uncovered, charts)))


def _charts(
    run: _Run, uncovered: int, known: dict[int, tuple[int, Table]]
) -> Generator[Progress, bool | None, tuple[Charts, bool]]:
    """Joined patches, and whether nobody has sent False; yields how far that is."""
    assert run.frontier.charts is not None
    more = (yield Progress(run.done, uncovered, joining=0.0)) is not False
    contours, results = [e.contours for e in run.found], [e.result for e in run.found]
    steps = joined(contours, results, run.frontier.charts, run.wanted["noise"], known)
    while True:
        try:
            progress = Progress(run.done, uncovered, joining=next(steps))
        except StopIteration as end:
            return end.value, more
        more = (yield progress) is not False and more


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
