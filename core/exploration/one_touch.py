# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""One touch that chooses what is not given. Its generators yield contours to be fitted, as in growth.py."""

from collections.abc import Callable, Generator, Iterator
from dataclasses import dataclass, replace

import numpy as np

from ..arguments import Array
from ..contours.contour import EXTENT, SURFACE_STOPS, UNEXPLAINED, Contour, SamplingPlane, stops_at
from ..contours.local_geometry import DegenerateCurvesError
from ..reconstruction.next_plane import suggest_plane
from ..reconstruction.result import Reconstruction
from .growth import MOST_STEPS, STRETCH, Answer, Counts, GrowthTrial, Request, Track, TrackedContours, grown
from .options import ExplorationOptions
from .sampling_density import CONTACT_COUNTS, MIN_HALF_CONTACTS, spacing, suffices
from .taps import Tapped, adjacent_half_curves

HELPS = 0.1  # Share of the mean deviation that one more plane must take off (benchmarks.speed --base).
FINER = 8.0  # Steps are shorter by this factor if curves have too few contacts (benchmarks.atlas --shapes).
SHORTER = 1.15  # Half curves next to a contradiction become shorter by this (benchmarks.real --only taps).
# A touch in doubt becomes shorter by the same if taps contradict it, or else by this factor, at most to
NEXT_EXTENT, LEAST_SHARE = 1.07, 0.25  # this share of its extent (benchmarks.real --only automatic),
STRIP = 4.0  # unless this multiple of a strip's width is less.


@dataclass(frozen=True, eq=False)
class Exploration:
    """A touch: what was felt, and the reconstruction of it.

    extent : length up to which half curves go, or that of the longest if it is chosen
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
        """The length of the longest half curve; the surface may end all before a given extent."""
        if any(stop not in SURFACE_STOPS for contour in self.contours for stop in contour.stops or ()):
            return self.extent
        tracked = TrackedContours(self.contours, self.result.frame.origin, self.step, None)
        return self.step * int(tracked.whole.max())


Steps = Generator[Request, Answer, Exploration]
Sampled = tuple[list[Contour], float, Reconstruction | None]  # contours, their step, their fit if known


@dataclass(frozen=True, eq=False)
class Touch:
    """What a touch begins with, and how the finger feels there.

    follow : takes planes and a step, returns what follows their contours to a given extent
    point : (3,)
    reference : columns e1, n and e1 x n, from which azimuths are measured
    farthest : a length that no half curve exceeds
    tap : taps the surface between the curves of a fit, see taps.py
    """

    follow: Callable[..., Callable[[float], list[Contour]]]
    point: Array
    reference: Array
    farthest: float
    tap: Callable[[Reconstruction], Tapped]
    options: ExplorationOptions

    def steps(self) -> Steps:
        """The touch, with planes added while they help. They make a patch more certain, not larger."""
        extent, tolerance = self.options.extent, self.options.tolerance
        found = yield from (self._grown() if extent is None else self._of_extent(extent))
        stds = [found.result.mean_height_std]
        most = self.options.most_planes
        while tolerance is not None and stds[-1] > tolerance and len(found.planes) < most:
            plane, expected = suggest_plane(found.result, self.reference[:, 1], self.reference[:, 0])
            if expected > (1.0 - HELPS) * stds[-1]:
                break
            try:
                found = yield from self._with_plane(found, plane)
            except ValueError:  # Nothing can be felt along that plane. What was felt so far stays.
                break
            stds.append(found.result.mean_height_std)
        if self.options.is_tapped and found.result.taps is None:
            found, _ = self._tapped(found)
        return replace(found, stds=tuple(stds))

    def _of_extent(self, extent: float) -> Steps:
        def at(step: float) -> Sampled:
            """The contacts this step apart."""
            contours = self.follow(self.options.planes, step=step)(extent)
            return contours if self.options.extent else [_open(c) for c in contours], step, None

        return (yield from self._refined_step(at, extent, [extent / count for count in CONTACT_COUNTS]))

    def _grown(self) -> Steps:
        """The touch as large as it can be trusted."""
        between = max(self.options.step or 0.0, self.farthest / MOST_STEPS)
        try:
            largest = yield from grown(self._tracking(between), self.farthest, between)
        except DegenerateCurvesError:
            if self.options.step is not None:
                raise
            # The surface may be too narrow for this step: a strip along an edge, or a fillet.
            between /= FINER
            largest = yield from grown(self._tracking(between), self.farthest, between)
        counts = largest.counts
        found = yield from self._of_half_lengths(largest, counts)
        if largest.is_sure and found.result.status != "ok" and self.options.is_bayes:
            # The step was chosen anew, so these are other contacts than those that were explained.
            counts = np.floor(counts / STRETCH).astype(np.intp)
            found = yield from self._of_half_lengths(largest, counts)
        if not self.options.is_tapped:
            return found
        found = yield from self._shortened_by_taps(largest, counts, found)
        return (yield from self._shortened_until_sure(found)) if self.options.is_bayes else found

    def _shortened_by_taps(self, largest: GrowthTrial, counts: Counts, found: Exploration) -> Steps:
        """The touch with curves so short that no tap contradicts it, or `found` if there is none."""
        r, (found, where) = found.result, self._tapped(found)
        if not (len(where) and self.options.is_bayes and r.status == "ok"):
            return found
        shorter = found
        while len(where):
            worst, counts = adjacent_half_curves(shorter.result, where), counts.copy()
            counts.flat[worst] = (counts.flat[worst] / SHORTER).astype(np.intp)
            if counts.flat[worst].min() < MIN_HALF_CONTACTS:
                break
            try:
                shorter, where = self._tapped((yield from self._of_half_lengths(largest, counts)))
            except DegenerateCurvesError:
                break
        return shorter if shorter.result.status == "ok" else found

    def _shortened_until_sure(self, found: Exploration) -> Steps:
        """The touch if it is sure, or else felt again to the longest shorter extent where it is.

        It is sure if its status is "ok" and no half curve ends at the point, as it does if its next contact
        would be beyond an edge. If no shorter extent helps, it is the longest touch whose status is "ok".
        """
        if self._is_sure(found):
            return found
        extents = list(_shorter_extents(found))
        if found.result.status == "ok":
            # A point on the edge itself has no shorter curves, and a drag along it would wait for each.
            step = self.options.step or extents[-1] / CONTACT_COUNTS[0]
            if stops_at(self.follow(self.options.planes, step=step)(extents[-1]), self.point):
                return found
        for extent in extents:
            try:
                shorter, _ = self._tapped((yield from self._of_extent(extent)))
            except ValueError:  # So short curves carry no fit, or the given step is longer.
                break
            if self._is_sure(shorter):
                return shorter
            if found.result.status != "ok" == shorter.result.status:
                return (yield from self._shortened_until_sure(shorter))
        return found

    def _is_sure(self, found: Exploration) -> bool:
        return found.result.status == "ok" and not stops_at(found.contours, self.point)

    def _tapped(self, found: Exploration) -> tuple[Exploration, Array]:
        """The touch together with its taps, and the places (k, 2) where they contradict it."""
        r = found.result
        taps, where = self.tap(r)
        return replace(found, result=replace(r, taps=taps, known_height_std=r.mean_height_std)), where

    def _tracking(self, step: float) -> Track:
        """The function that follows half curves along the planes, each time from where they ended before."""
        feel = self.follow(self.options.planes, step=step)

        def tracked(length: float) -> TrackedContours:
            """The half curves to this length."""
            contours = feel(min(length, self.farthest))
            partial = length < self.farthest
            return TrackedContours(contours, self.point, step, self.options.largest_std, partial)

        return tracked

    def _of_half_lengths(self, largest: GrowthTrial, counts: Counts) -> Steps:
        """The touch with half curves of these numbers of contacts, made of tracked ones if possible."""
        tracked, half_lengths = largest.tracked, largest.tracked.step * counts.astype(np.float64)
        length = float(half_lengths.max())

        def at(step: float) -> Sampled:
            """The contacts this step apart, or somewhat nearer to each other."""
            stride = int(step / tracked.step * (1.0 + 1e-6))
            if stride:
                same = self.options.is_bayes and counts is largest.counts and stride == largest.stride
                known = largest.result if same else None
                return tracked.shortened(counts, stride), stride * tracked.step, known
            # One step more shows whether a half curve ends there.
            longer = self.follow(self.options.planes, step=step)(min(length + step, self.farthest))
            again = TrackedContours(longer, self.point, step, self.options.largest_std)
            fewer = np.minimum((half_lengths / step * (1.0 + 1e-6)).astype(np.intp), again.whole)
            return again.shortened(fewer), step, None

        automatic = [spacing(half_lengths, count) for count in CONTACT_COUNTS]
        return (yield from self._refined_step(at, length, automatic))

    def _refined_step(self, at: Callable[[float], Sampled], extent: float, automatic: list[float]) -> Steps:
        """The touch with the step of the options, or the first automatic one that suffices, or the last."""
        steps = automatic if self.options.step is None else [self.options.step]
        for longest in dict.fromkeys(steps):
            contours, step, known = at(longest)
            r = known or (yield Request(contours))
            if isinstance(r, DegenerateCurvesError):
                if longest == steps[-1]:
                    raise r
            elif longest == steps[-1] or suffices(r):
                break
        assert isinstance(r, Reconstruction)
        return Exploration(contours, r, extent, step, tuple(self.options.planes))

    def _with_plane(self, found: Exploration, plane: SamplingPlane) -> Steps:
        """The touch with one plane more, along which curves are as long as the fit explains their contacts.

        They are tracked twice as densely as fitted: the contacts between show whether the fit explains them.
        Raises ValueError if nothing can be felt along the plane.
        """
        half = 0.5 * found.step
        contours = self.follow((plane,), step=half)(found.extent)
        tracked = TrackedContours(contours, self.point, half, self.options.largest_std)
        counts = tracked.whole // 2 * 2
        while True:
            contours = [*found.contours, *tracked.shortened(counts, 2)]
            r = yield Request(contours)
            if isinstance(r, DegenerateCurvesError):
                raise r
            misfits = tracked.misfits(counts, r)
            worst = int(np.argmax(misfits))
            if (
                self.options.extent is not None
                or misfits.flat[worst] <= 1.0
                or counts.flat[worst] <= 2 * MIN_HALF_CONTACTS
            ):
                return replace(found, contours=contours, result=r, planes=(*found.planes, plane))
            counts.flat[worst] = max(2 * MIN_HALF_CONTACTS, int(counts.flat[worst] / STRETCH) // 2 * 2)


def _shorter_extents(found: Exploration) -> Iterator[float]:
    """Extents that shrink by a factor to LEAST_SHARE, and to the width of a strip that is narrower.

    Across a strip most half curves are short, and show no curvature in units of a long patch. If taps
    contradict a touch, few extents are tried: of many, one may have no tap where the contradiction is.
    """
    taps = found.result.taps
    factor = SHORTER if taps is not None and taps.off else NEXT_EXTENT
    origin, extent = found.result.frame.origin, found.extent
    while extent > factor * LEAST_SHARE * found.extent:
        extent /= factor
        yield extent
    ends = np.array([contour.points[[0, -1]] for contour in found.contours])
    width = float(np.median(np.linalg.norm(ends - origin, axis=2)))
    extent = min(extent, STRIP * width)
    while extent > factor * width:
        extent /= factor
        yield extent


def _open(contour: Contour) -> Contour:
    """The contour, which a given extent has ended, as one that could be followed no farther."""
    first, last = (UNEXPLAINED if stop == EXTENT else stop for stop in contour.stops or ())
    return contour.part(slice(None), (first, last))
