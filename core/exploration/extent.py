# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""How long the half curves of a touch are: as long as its patch is sure.

The generators here yield a Request and are sent the Reconstruction of its contours, or why there is none.
So touches of one surface can go side by side, and their fits be done in stacks.
"""

import math
from collections.abc import Callable, Generator, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from ..arguments import Array
from ..bayes.joint_fit import MISFIT
from ..bayes.roughness import EXPLAINED_TERMS, roughness
from ..contours.contour import EXTENT, UNEXPLAINED, Contour, SamplingPlane, stops_at
from ..contours.finger import Surface
from ..contours.local_geometry import DegenerateCurvesError
from ..reconstruction.explained import are_few, too_far
from ..reconstruction.facets import with_facets
from ..reconstruction.next_plane import suggest_plane
from ..reconstruction.result import Reconstruction
from ..reconstruction.status import DOUBTFUL_FIT, DOUBTFUL_STD
from ..verdict import NOTICED, OK
from .options import ExplorationOptions
from .taps import tapped

# benchmarks.real --only automatic chose these. Fewer of either give less area.
MOST_CONTACTS = 16  # The longest half curves that are tried have this number of contacts.
RUNGS = 4  # After this number of lengths with one ratio, which halve them, the step is halved.
HALVINGS = 8  # The step is halved this many times. With 6, 45 of 900 touches of scans more are in doubt.
# A sure patch is off its taps by at most this share of the radius in the mean, where a place without surface
# is off by the radius: with 0.02 sure patches are 6 % farther off, with 0.01 they have a seventh less area.
TAPS_OFF = 0.015
# A half curve of a given extent has this many contacts, and any the first of these multiples that suffices
# (benchmarks.amount of e20b52a).
CONTACTS, DENSER = 12, (1, 2, 4)
HELPS = 0.1  # Share of the mean deviation that one more plane must take off (benchmarks.speed, e20b52a).


@dataclass(frozen=True, eq=False)
class Exploration:
    """A touch: what was felt, and the reconstruction of it.

    extent : length up to which half curves go
    step : distance along a curve between contacts
    planes : the given planes and those that were added
    stds : the mean deviation of the height with the planes given, and after each that was added
    """

    contours: list[Contour]
    result: Reconstruction
    extent: float
    step: float
    planes: tuple[SamplingPlane, ...]
    stds: tuple[float, ...] = ()

    @property
    def reach(self) -> float:
        """The length of the longest half curve; the surface may end all before the extent."""
        return self.step * _most_in_half(self.contours, self.result.point)


Request = tuple[list[Contour], str]  # Contours to be fitted, and the method.
Answer = Reconstruction | DegenerateCurvesError
Follow = Callable[[float], list[Contour]]
Steps = Generator[Request, Answer, Exploration]


@dataclass(frozen=True, eq=False)
class Touch:
    """One touch: where it is, and what the finger follows there.

    surface : the finger taps it between the curves
    point, outward : (3,)
    follow : takes planes and a step, returns what follows their contours to a given extent
    followed : by step, what follows the contours of the options' planes, and goes on where it was
    farthest : a length that no half curve exceeds
    """

    surface: Surface
    point: Array
    outward: Array
    follow: Callable[[Sequence[SamplingPlane], float], Follow]
    followed: Callable[[float], Follow]
    farthest: float
    options: ExplorationOptions

    def steps(self) -> Steps:
        """The touch, with planes added while they help. They make a patch more certain, not larger."""
        options, method = self.options, self.options.method
        if options.extent is None:
            explored = yield from self._longest_sure()
            if method != "bayes":
                r = yield from _fitted(explored.contours, method)
                explored = replace(explored, result=r.with_facets_of(explored.result))
        else:
            explored = yield from self._felt(options.extent / CONTACTS, CONTACTS, method)
        explored = self._with_taps(explored)
        stds = [explored.result.mean_height_std]
        while (
            options.tolerance is not None
            and stds[-1] > options.tolerance
            and len(explored.planes) < options.most_planes
        ):
            plane, expected = suggest_plane(explored.result, self.outward, options.tangent)
            if expected > (1.0 - HELPS) * stds[-1]:
                break
            try:
                more = yield from self._with_plane(explored, plane)
            except ValueError:  # Nothing can be felt along that plane. What was felt so far stays.
                break
            if explored.result.status == OK != more.result.status or more.result.mean_height_std >= stds[-1]:
                break
            explored = more
            stds.append(explored.result.mean_height_std)
        return replace(explored, stds=tuple(stds))

    def _longest_sure(self) -> Steps:
        """The touch of the longest half curves whose patch is sure, or else the most certain of all.

        Half curves that end at the point, or are rough, rarely have a sure fit. If no other patch is sure,
        one of these is fitted, the one of the least roughness per squared length.
        """
        tried: list[Exploration] = []
        rough: dict[tuple[float, int], float] = {}
        for rung in self._rungs():
            if (roughness := self._roughness(next(self._denser(*rung))[0])) > DOUBTFUL_FIT:
                rough[rung] = roughness / math.prod(rung)
                continue
            try:
                explored = yield from self._felt(*rung)
            except DegenerateCurvesError:
                continue
            if _is_sure(explored.result, self.options) and _explains(explored, self.options):
                explored = self._with_taps(explored)
                if tried and explored.result.facet_width > explored.result.radius:
                    break  # Within a facet that stands for a bend nothing shows the shape.
                if _is_sure(explored.result, self.options):
                    return explored
            tried.append(explored)
            if _are_shorter_worse(explored.result):
                break
        if rough or not tried:
            longest = self.farthest / MOST_CONTACTS, MOST_CONTACTS
            try:
                tried.append((yield from self._felt(*min(rough, key=rough.__getitem__, default=longest))))
            except DegenerateCurvesError:
                if not tried:
                    raise
        return self._most_certain(tried)

    def _most_certain(self, tried: list[Exploration]) -> Exploration:
        """The touch whose curvatures are the most certain or, for a whole object, whose height is."""
        if self.options.largest_std is not None:
            return min(
                tried, key=lambda e: (e.result.status != OK, e.result.mean_height_std / e.result.radius)
            )
        # The shortest half curves lie in the fewest facets, which give curvatures that the shape may have.
        shortest = min(tried, key=lambda e: e.extent).result
        shape = with_facets(shortest, self.surface)
        judged = [replace(e, result=e.result.with_facets_of(shape)) for e in tried]
        return min(judged, key=lambda e: (e.result.status != OK, max(e.result.k1_std, e.result.k2_std)))

    def _roughness(self, contours: list[Contour]) -> float:
        """How rough the contacts of contours are; infinite if a half curve ends at the point."""
        if stops_at(contours, self.point):
            return math.inf
        points = np.vstack([contour.points for contour in contours])
        return roughness(points - self.point, max(self.options.noise, self.options.largest_std or 0.0))

    def _rungs(self) -> Iterator[tuple[float, int]]:
        """Steps and numbers of contacts of half curves, from long to short.

        Lengths at which the surface has ended every half curve already would repeat it, and are left out.
        """
        for halvings in range(HALVINGS + 1):
            extent = self.farthest / 2.0**halvings
            step = self.options.step or extent / MOST_CONTACTS
            if extent < step:
                break
            felt = _most_in_half(self._cut(step, extent), self.point)
            shares = 2.0 ** (-np.arange(RUNGS + 1) / RUNGS)
            counts = (shares * extent / step + 1e-6).astype(int).tolist()
            yield from ((step, count) for count, shorter in pairwise(counts) if min(felt, count) > shorter)

    def _felt(self, step: float, count: int, method: str = "bayes") -> Steps:
        """The touch with half curves of this length, and the first number of contacts that suffices."""
        for contours, between in self._denser(step, count):  # noqa: B007
            r = yield contours, method
            if isinstance(r, Reconstruction) and suffices(r):
                break
        if isinstance(r, DegenerateCurvesError):
            raise r
        return Exploration(
            contours, r, self.options.extent or step * count, between, tuple(self.options.planes)
        )

    def _denser(self, step: float, count: int) -> Iterator[tuple[list[Contour], float]]:
        """Contours of half curves of `count` contacts, and then of more in the same length; and their steps.

        They begin with the longest step that has contacts on all sides of the point.
        """
        given = self.options.step
        steps = [step / times for times in DENSER] if given is None else [given]
        for between in steps:
            contours = self._cut(between, self.options.extent or step * count)
            if between == steps[-1] or not stops_at(contours, self.point):
                yield contours, between

    def _with_taps(self, explored: Exploration) -> Exploration:
        """The touch together with its taps, and as uncertain as facets leave it."""
        r = explored.result
        # A largest deviation judges the fit in place of shares of the radius.
        if r.taps is not None or self.options.largest_std is not None:
            return explored
        judged = r.judged_with(taps=tapped(r, self.surface))
        return replace(explored, result=with_facets(judged, self.surface))

    def _cut(self, step: float, extent: float, follow: Follow | None = None) -> list[Contour]:
        """Contours of the options' planes to an extent, or those that are followed instead."""
        contours = (follow or self.followed(step))(extent)
        return contours if extent + step > self.farthest else list(map(_ended, contours))

    def _with_plane(self, explored: Exploration, plane: SamplingPlane) -> Steps:
        """The touch with one plane more. Raises ValueError if nothing can be felt along it."""
        step, extent = explored.step, explored.extent
        contours = [*explored.contours, *self._cut(step, extent, self.follow([plane], step))]
        r = yield from _fitted(contours, self.options.method)
        planes = (*explored.planes, plane)
        return self._with_taps(replace(explored, contours=contours, result=r, planes=planes))


def _fitted(contours: list[Contour], method: str) -> Generator[Request, Answer, Reconstruction]:
    """The reconstruction of contours. Raises DegenerateCurvesError if they carry none."""
    r = yield contours, method
    if isinstance(r, DegenerateCurvesError):
        raise r
    return r


def suffices(r: Reconstruction) -> bool:
    """Whether noise makes at most half of the mean variance of the height, which more contacts would lower.

    The other half comes from directions in which these curves have no contacts. More contacts do not help
    either if the deviation is less than any polynomial is off a surface.
    """
    by_noise = EXPLAINED_TERMS * float(r.posterior.noise * r.radius) ** 2 / len(r.contacts)
    return r.mean_height_std <= MISFIT * r.radius or by_noise <= 0.5 * r.mean_height_std**2


def _are_shorter_worse(r: Reconstruction) -> bool:
    """Whether a patch is in doubt for a reason that shorter half curves make worse: noise, or few facets."""
    is_noisy = r.mean_height_std > DOUBTFUL_STD * r.radius and not suffices(r)
    return is_noisy or (len(r.shape_curvatures) > 0 and [doubt.code for doubt in r.doubts] == ["facets"])


def _is_sure(r: Reconstruction, options: ExplorationOptions) -> bool:
    """Whether a patch is as certain as the options require, and taps and the contacts near it agree."""
    if options.largest_std is not None:
        return r.mean_height_std <= options.largest_std
    # Of all doubts, the deviation of the height is the one that is known already.
    if r.mean_height_std > DOUBTFUL_STD * r.radius or r.status != OK:
        return False
    off = 0.0 if r.taps is None else (r.taps.height or 0.0) / r.radius + r.taps.missing
    return off <= TAPS_OFF and r.curvature_contradiction <= NOTICED


def _explains(explored: Exploration, options: ExplorationOptions) -> bool:
    """Whether few contacts are off the patch by more than noise, its deviation and `largest_std`."""
    r = explored.result
    x, y, z = r.frame.to_local(np.concatenate([contour.points for contour in explored.contours])).T
    off, noise = z - r.height(x, y), max(options.noise, float(r.posterior.noise) * r.radius)
    far = too_far(off, noise) & (np.abs(off) > (options.largest_std or 0.0))
    if far.any():  # The deviation is slow, so it is found only where noise does not explain a contact.
        far[far] = too_far(off[far], np.hypot(r.height_std(x[far], y[far]), noise))
    curve = np.repeat(range(len(explored.contours)), [len(contour.points) for contour in explored.contours])
    return are_few(far, np.append(far[1:] & (curve[1:] == curve[:-1]), False))


def _most_in_half(contours: Sequence[Contour], point: Array) -> int:
    """The number of contacts of the longest half curve; the point is one contact of each contour."""
    at = [(contour.points.tolist().index(point.tolist()), len(contour.points)) for contour in contours]
    return max(max(before, number - 1 - before) for before, number in at)


def _ended(contour: Contour) -> Contour:
    """The contour of a touch that ends half curves itself, where the surface does not."""
    stops = (UNEXPLAINED if stop == EXTENT else stop for stop in contour.stops or ())
    return contour.with_valid(stops=tuple(stops))
