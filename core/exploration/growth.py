# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""How far half curves can be followed from the reference point, as long as fits explain their contacts.

The generators here yield contours and are sent the Reconstruction of these, or the error why there is none.
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
from .enough import stride_of

# benchmarks.extents judges how far curves grow.
FELT = 96  # A half curve as long as it may be has so many steps.
SEEDS = (24, 12, 6, 3)  # A half curve begins with one of these numbers of steps.
GROWN_STD = 0.6 * DOUBTFUL_STD  # Growth ends here: the longest patches underestimate their deviation.
# Doubt is measured such that growth ends where it exceeds 1.
STRETCH = 1.5  # A half curve grows by this factor at once, and by its square while its doubt is at most EASY.
EASY = 0.1
NEARLY_ENDED = 0.75  # Where curves twice as long are in doubt, only those of at most this spread grow.
HOPELESS = 3.0  # Where doubt exceeds this, curves half as long are not tried: they are too long as well.
CLOSE = 1.15  # A sure touch may be shorter than one in doubt by this factor (benchmarks.real).
TOO_ROUGH = 0.0085  # Contacts of this roughness have a fit that ends growth, in 99 of 100 cases.
EXPLAINED = 3.0  # The root mean square of what is left of a half curve may be so many times its noise.

Counts = NDArray[np.intp]  # Numbers of contacts of the c contours on either side of the point, (c, 2).
Fits = Generator[list[Contour], Reconstruction | DegenerateCurvesError, "Grown"]
Feel = Callable[[float], "Felt"]  # It follows half curves to a length, which is longer at each call.


@dataclass(frozen=True, eq=False)
class Felt:
    """Contours as they were tracked with this step between contacts.

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
        """The numbers of all contacts that were felt, (c, 2)."""
        each = zip(self.contours, self.places, strict=True)
        return np.array([(at, len(contour.points) - 1 - at) for contour, at in each])

    @cached_property
    def open(self) -> NDArray[np.bool_]:
        """Whether a half curve goes on beyond what was tracked, (c, 2)."""
        return np.array([[self.partial and s == EXTENT for s in c.stops or ()] for c in self.contours])

    def shortened(self, counts: Counts, stride: int = 1) -> list[Contour]:
        """The contours of so many contacts to either side, and the point; only each `stride`-th is kept."""
        found = []
        ends = (counts < self.whole) | self.open
        for contour, at, n, end in zip(self.contours, self.places, counts.tolist(), ends, strict=True):
            assert contour.stops is not None
            which = slice(at - n[0] // stride * stride, at + n[1] // stride * stride + 1, stride)
            first, last = (UNEXPLAINED if e else s for e, s in zip(end, contour.stops, strict=True))
            found.append(contour.part(which, (first, last)))
        return found

    def roughness(self, counts: Counts) -> float:
        """How far so many contacts are off the nearest sextic: above 1 their fit would be in doubt."""
        contours = self.shortened(counts, stride_of(counts))
        points = np.vstack([contour.points for contour in contours])
        noise = max(contour.noise or 0.0 for contour in contours)
        return roughness(points - self.point, noise) / TOO_ROUGH

    def misfits(self, counts: Counts, r: Reconstruction) -> Array:
        """The root mean square of what a fit leaves of so many contacts of each half curve, (c, 2).

        It is in units of the largest that their noise explains.
        """
        each = list(zip(self.contours, self.places, counts.tolist(), strict=True))
        points = np.vstack([contour.points[at - n[0] : at + n[1] + 1] for contour, at, n in each])
        x, y, z = r.frame.to_local(points).T
        # The reference point stands between the two sides of each contour and belongs to neither.
        sizes = np.array([(a, 1, b) for _, _, (a, b) in each])
        starts = np.cumsum(sizes) - sizes.ravel()
        squares = np.append((z - r.height(x, y)) ** 2, 0.0)
        sums = np.add.reduceat(squares, starts).reshape(-1, 3)[:, ::2]
        limit = max(EXPLAINED * max(r.noise, MISFIT) * r.radius, self.largest_std or 0.0)
        return np.where(counts > 0, np.sqrt(sums / np.maximum(counts, 1)), 0.0) / limit


class Grown(NamedTuple):
    """Half curves of so many contacts, of which each `stride`-th is fitted, and how doubtful their fit is.

    misfits : of each half curve, (c, 2), as `Felt.misfits` has them; above 1 is too much
    spread : the mean deviation of the height as a share of the largest that is wanted; above 1 is too much
    """

    felt: Felt
    counts: Counts
    stride: int
    misfits: Array
    spread: float
    result: Reconstruction

    @property
    def doubt(self) -> float:
        """The largest of misfits and spread; the fit is in no doubt up to 1."""
        return max(float(self.misfits.max()), self.spread)

    @property
    def length(self) -> float:
        """The length of the longest half curve."""
        return float(self.counts.max()) * self.felt.step

    @property
    def sure(self) -> bool:
        """Whether the status of the fit is "ok"."""
        return self.result.status == "ok"


def grown(feel: Feel, farthest: float, step: float) -> Fits:
    """The longest half curves that fits explain. Raises DegenerateCurvesError if none carries a fit."""
    known: list[Grown] = []
    found = yield from _seed(feel, step, known)
    # A shorter one was tried after it and is in more doubt. Noise causes that: longer curves bear it better.
    if found.result.noise > MISFIT and found is not known[-1]:
        return (yield from _longer(feel, farthest, found, np.inf, np.inf))
    if found.doubt > 1.0:
        return found
    longest = (found.counts == np.minimum(SEEDS[0], found.felt.whole)).all()
    doubtful = min((trial.length for trial in known if trial.spread > 1.0), default=np.inf)
    return (yield from _longer(feel, farthest, found, 1.0 if longest else NEARLY_ENDED, doubtful))


def _longer(feel: Feel, farthest: float, found: Grown, most: float, doubtful: float) -> Fits:
    """The longest half curves that grow from `found`, while its spread is at most `most`.

    They stay shorter than `doubtful`, a length at which curves are known to be in doubt.
    """
    accepted, felt, growing, quick = [found], found.felt, np.full(found.counts.shape, True), True
    while (growing := growing & ((found.counts < felt.whole) | felt.open)).any() and found.spread <= most:
        quick = quick and found.doubt <= EASY
        stretched = np.ceil((STRETCH**2 if quick else STRETCH) * found.counts)
        longer = np.where(growing, stretched, found.counts).astype(np.intp)
        length = float(longer.max()) * felt.step
        if length >= doubtful:
            if not quick:
                break
            quick = False
            continue
        if (felt.open & (longer > felt.whole)).any():
            further = min(length + felt.step, farthest)  # One step more shows whether they end there.
            felt = feel(further)
        try:
            trial = yield from tried(felt, np.minimum(longer, felt.whole))
        except DegenerateCurvesError:
            break
        if quick and trial.doubt > 1.0:
            quick = False
        elif trial.misfits.max() > 1.0:  # The half curve that is explained worst ends here.
            growing.flat[np.argmax(np.where(growing, trial.misfits, -1.0))] = False
        elif trial.spread > max(1.0, found.spread):
            break
        else:
            accepted.append(found := trial)
    # A sure touch is better than a larger one in doubt.
    sure = next((trial for trial in reversed(accepted) if trial.sure), found)
    return sure if felt.largest_std else (yield from _longest_sure(sure, found))


def _longest_sure(sure: Grown, longer: Grown) -> Fits:
    """The longest sure trial, within CLOSE, between one that is sure and a longer one that is not."""
    while longer.length > CLOSE * sure.length:
        counts = np.sqrt(sure.counts * longer.counts).astype(np.intp)
        if (counts == sure.counts).all():
            break
        trial = yield from tried(longer.felt, counts)
        sure, longer = (trial, longer) if trial.sure and trial.doubt <= 1.0 else (sure, trial)
    return sure


def _seed(feel: Feel, step: float, known: list[Grown]) -> Fits:
    """The longest of SEEDS that is in no doubt, or else the one in the least; all trials go into `known`."""
    error, seeds, rough = None, list(SEEDS), []
    felt = feel(SEEDS[0] * step)
    while seeds:
        counts = np.minimum(seeds.pop(0), felt.whole)
        doubt = felt.roughness(counts) if seeds else 0.0  # The shortest is fitted however rough it is.
        if doubt <= 1.0:
            try:
                trial = yield from tried(felt, counts)
            except DegenerateCurvesError as why:
                error = why
                continue
            known.append(trial)
            if trial.doubt <= 1.0:
                break
            doubt = trial.spread
        else:
            rough.append(counts)
        if doubt > HOPELESS and len(seeds) > 1:
            seeds.pop(0)
    if not known and rough:  # The longer ones were too rough, and the shorter ones carry no fit.
        known.append((yield from tried(felt, rough[-1])))
    if not known and error is not None:
        raise error
    best = min(known, key=lambda trial: (trial.doubt, trial.length))
    if best.doubt <= 1.0 or felt.largest_std is not None:
        return best
    # Growth goes on from none of them, so the longest that is sure is better than a short one in less doubt.
    enough = [trial for trial in known if trial.sure and trial.misfits.max() <= 1.0]
    return max((best, *enough), key=lambda trial: trial.length)


def tried(felt: Felt, counts: Counts) -> Fits:
    """The fit of so many contacts. It takes as few of them as are enough in most cases."""
    stride = stride_of(counts)
    r = yield felt.shortened(counts, stride)
    if isinstance(r, DegenerateCurvesError):
        raise r
    spread = r.mean_height_std / (felt.largest_std or GROWN_STD * r.radius)
    return Grown(felt, counts, stride, felt.misfits(counts, r), spread, r)
