# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""How far half curves can be followed from the reference point, as long as fits explain their contacts.

The generators here yield a Request and are sent the Reconstruction of its contours, or why there is none.
So touches of one surface can grow side by side, and their fits be done in stacks.
"""

from collections.abc import Callable, Generator
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..arguments import Array
from ..bayes.joint_fit import MISFIT
from ..bayes.roughness import roughness
from ..contours.contour import EXTENT, UNEXPLAINED, Contour
from ..contours.local_geometry import DegenerateCurvesError
from ..reconstruction.result import Reconstruction
from ..reconstruction.status import DOUBTFUL_STD
from .sampling_density import stride_of

# benchmarks.extents judges how far curves grow.
MOST_STEPS = 96  # A half curve as long as it may be has this number of steps.
SEEDS = (24, 12, 6, 3)  # A half curve begins with one of these numbers of steps.
MAX_STD = 0.6 * DOUBTFUL_STD  # Growth ends here: the longest patches underestimate their deviation.
# A misfit ratio is measured such that growth ends where it exceeds 1.
STRETCH = 1.5  # A half curve grows by this factor at once, and by its square up to the ratio EASY.
EASY = 0.1
MAX_SPREAD_SHORT_SEED = 0.75  # Where curves twice as long exceed 1, only those of at most this spread grow.
SKIP_RATIO = 3.0  # Beyond this ratio curves half as long are not tried: they are too long as well.
SEARCH_FACTOR = 1.15  # A sure touch may be shorter than one that is not by this factor (benchmarks.real).
ROUGHNESS_LIMIT = 0.0085  # Contacts of this roughness have a fit that ends growth, in 99 of 100 cases.
MAX_RESIDUAL_RATIO = 3.0  # The root mean square residual of a half curve may be this many times its noise.

Counts = NDArray[np.intp]  # Numbers of contacts of the c contours on either side of the point, (c, 2).
Answer = Reconstruction | DegenerateCurvesError
Fits = Generator["Request", Answer, "GrowthTrial"]
Track = Callable[[float], "TrackedContours"]  # It follows half curves to a length, longer at each call.


class Request(NamedTuple):
    """Contours to be fitted: with the caller's options or, while `growing`, by "bayes"."""

    contours: list[Contour]
    growing: bool = False


@dataclass(frozen=True, eq=False)
class TrackedContours:
    """Contours with this step between contacts.

    largest_std : a length, the largest mean deviation of the height; None for a share of L
    partial : whether half curves could be tracked farther
    """

    contours: list[Contour]
    point: Array
    step: float
    largest_std: float | None
    partial: bool = False

    @cached_property
    def places(self) -> list[int]:
        """The index of the reference point in each contour."""
        return [int(np.argmax((contour.points == self.point).all(axis=1))) for contour in self.contours]

    @cached_property
    def whole(self) -> Counts:
        """The numbers of all contacts that were tracked, (c, 2)."""
        each = zip(self.contours, self.places, strict=True)
        return np.array([(at, len(contour.points) - 1 - at) for contour, at in each])

    @cached_property
    def open(self) -> NDArray[np.bool_]:
        """Whether a half curve goes on beyond what was tracked, (c, 2)."""
        return np.array([[self.partial and s == EXTENT for s in c.stops or ()] for c in self.contours])

    def goes_on(self, counts: Counts) -> NDArray[np.bool_]:
        """Whether a half curve goes on beyond this number of contacts, (c, 2)."""
        return (counts < self.whole) | self.open

    def shortened(self, counts: Counts, stride: int = 1) -> list[Contour]:
        """The contours of these numbers of contacts and the point; only each `stride`-th is kept."""
        found = []
        ends = self.goes_on(counts)
        for contour, at, n, end in zip(self.contours, self.places, counts.tolist(), ends, strict=True):
            assert contour.stops is not None
            which = slice(at - n[0] // stride * stride, at + n[1] // stride * stride + 1, stride)
            first, last = (UNEXPLAINED if e else s for e, s in zip(end, contour.stops, strict=True))
            found.append(contour.part(which, (first, last)))
        return found

    def roughness(self, counts: Counts) -> float:
        """How far these numbers of contacts are off the nearest sextic: above 1 no fit explains them."""
        contours = self.shortened(counts, stride_of(counts))
        points = np.vstack([contour.points for contour in contours])
        noise = max(contour.noise or 0.0 for contour in contours)
        return roughness(points - self.point, noise) / ROUGHNESS_LIMIT

    def misfits(self, counts: Counts, r: Reconstruction) -> Array:
        """The root mean square residual of a fit on each half curve, over what noise explains, (c, 2)."""
        each = list(zip(self.contours, self.places, counts.tolist(), strict=True))
        points = np.vstack([contour.points[at - n[0] : at + n[1] + 1] for contour, at, n in each])
        x, y, z = r.frame.to_local(points).T
        # The reference point stands between the two sides of each contour and belongs to neither.
        sizes = np.array([(a, 1, b) for _, _, (a, b) in each])
        starts = np.cumsum(sizes) - sizes.ravel()
        squares = np.append((z - r.height(x, y)) ** 2, 0.0)
        sums = np.add.reduceat(squares, starts).reshape(-1, 3)[:, ::2]
        limit = max(MAX_RESIDUAL_RATIO * max(r.noise, MISFIT) * r.radius, self.largest_std or 0.0)
        return np.where(counts > 0, np.sqrt(sums / np.maximum(counts, 1)), 0.0) / limit


class GrowthTrial(NamedTuple):
    """A fit of half curves of these numbers of contacts, of which each `stride`-th is fitted.

    misfits : of each half curve, (c, 2), as `TrackedContours.misfits` has them; above 1 is too much
    spread : the mean deviation of the height over the largest that is allowed; above 1 is too much
    """

    tracked: TrackedContours
    counts: Counts
    stride: int
    misfits: Array
    spread: float
    result: Reconstruction

    @property
    def misfit_ratio(self) -> float:
        """The largest of misfits and spread; the fit is accepted up to 1."""
        return max(float(self.misfits.max()), self.spread)

    @property
    def length(self) -> float:
        """The length of the longest half curve."""
        return float(self.counts.max()) * self.tracked.step

    @property
    def is_sure(self) -> bool:
        """Whether the status of the fit is "ok"."""
        return self.result.status == "ok"


def grown(track: Track, farthest: float, step: float) -> Fits:
    """The longest half curves whose fit is accepted, as a GrowthTrial: a seed first, then `_longer`.

    track : tracks all half curves to a length; farthest, step : lengths

    Raises DegenerateCurvesError if no seed carries a fit.
    """
    trials: list[GrowthTrial] = []
    found = yield from _seed(track, step, trials)
    # A shorter one was tried after it and has more misfit. Noise causes that: longer curves bear it better.
    if found.result.noise > MISFIT and found is not trials[-1]:
        return (yield from _longer(track, farthest, found, np.inf, np.inf))
    if found.misfit_ratio > 1.0:
        return found
    longest = (found.counts == np.minimum(SEEDS[0], found.tracked.whole)).all()
    too_long = min((trial.length for trial in trials if trial.spread > 1.0), default=np.inf)
    return (yield from _longer(track, farthest, found, 1.0 if longest else MAX_SPREAD_SHORT_SEED, too_long))


def _longer(track: Track, farthest: float, found: GrowthTrial, most: float, too_long: float) -> Fits:
    """Half curves lengthened by STRETCH, or by its square while misfits are below EASY, and fitted again.

    The half curve with the largest misfit above 1 stops; all stop if the spread exceeds 1, and its last
    length counts.

    most : the spread above which nothing grows
    too_long : a length that the longest half curve does not reach
    """
    accepted, tracked, growing, quick = [found], found.tracked, np.full(found.counts.shape, True), True
    while found.spread <= most and (growing := growing & tracked.goes_on(found.counts)).any():
        quick = quick and found.misfit_ratio <= EASY
        stretched = np.ceil((STRETCH**2 if quick else STRETCH) * found.counts)
        longer = np.where(growing, stretched, found.counts).astype(np.intp)
        length = float(longer.max()) * tracked.step
        if length >= too_long:
            if not quick:
                break
            quick = False
            continue
        if (tracked.open & (longer > tracked.whole)).any():
            further = min(length + tracked.step, farthest)  # One step more shows whether they end there.
            tracked = track(further)
        try:
            trial = yield from fit_trial(tracked, np.minimum(longer, tracked.whole))
        except DegenerateCurvesError:
            break
        if quick and trial.misfit_ratio > 1.0:
            quick = False
        elif trial.misfits.max() > 1.0:  # The half curve that is explained worst ends here.
            growing.flat[np.argmax(np.where(growing, trial.misfits, -1.0))] = False
        elif trial.spread > max(1.0, found.spread):
            break
        else:
            accepted.append(found := trial)
    # A sure touch is better than a larger one that is not.
    sure = next((trial for trial in reversed(accepted) if trial.is_sure), found)
    return sure if tracked.largest_std else (yield from _longest_sure(sure, found))


def _longest_sure(sure: GrowthTrial, longer: GrowthTrial) -> Fits:
    """The longest sure trial, by geometric bisection until lengths differ by less than SEARCH_FACTOR."""
    while longer.length > SEARCH_FACTOR * sure.length:
        counts = np.sqrt(sure.counts * longer.counts).astype(np.intp)
        if (counts == sure.counts).all():
            break
        trial = yield from fit_trial(longer.tracked, counts)
        sure, longer = (trial, longer) if trial.is_sure and trial.misfit_ratio <= 1.0 else (sure, trial)
    return sure


def _seed(track: Track, step: float, trials: list[GrowthTrial]) -> Fits:
    """The longest of SEEDS that is accepted, or else the one of least misfit; all trials go into `trials`."""
    error, seeds, rough = None, list(SEEDS), []
    tracked = track(SEEDS[0] * step)
    while seeds:
        counts = np.minimum(seeds.pop(0), tracked.whole)
        misfit = tracked.roughness(counts) if seeds else 0.0  # The shortest is fitted however rough it is.
        if misfit <= 1.0:
            try:
                trial = yield from fit_trial(tracked, counts)
            except DegenerateCurvesError as why:
                error = why
                continue
            trials.append(trial)
            if trial.misfit_ratio <= 1.0:
                break
            misfit = trial.spread
        else:
            rough.append(counts)
        if misfit > SKIP_RATIO and len(seeds) > 1:
            seeds.pop(0)
    if not trials and rough:  # The longer ones were too rough, and the shorter ones carry no fit.
        trials.append((yield from fit_trial(tracked, rough[-1])))
    if not trials and error is not None:
        raise error
    best = min(trials, key=lambda trial: (trial.misfit_ratio, trial.length))
    if best.misfit_ratio <= 1.0 or tracked.largest_std is not None:
        return best
    # Growth goes on from none of them, so the longest that is sure is better than a short one of less misfit.
    sure = [trial for trial in trials if trial.is_sure and trial.misfits.max() <= 1.0]
    return max((best, *sure), key=lambda trial: trial.length)


def fit_trial(tracked: TrackedContours, counts: Counts) -> Fits:
    """The fit of these numbers of contacts. It takes as few of them as suffice in most cases."""
    stride = stride_of(counts)
    r = yield Request(tracked.shortened(counts, stride), growing=True)
    if isinstance(r, DegenerateCurvesError):
        raise r
    spread = r.mean_height_std / (tracked.largest_std or MAX_STD * r.radius)
    return GrowthTrial(tracked, counts, stride, tracked.misfits(counts, r), spread, r)
