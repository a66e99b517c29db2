# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""How far half curves can be followed from the reference point, as long as fits explain their contacts.

What fits is asked by `yield`: of contours, answered by their Reconstruction or the error why there is none.
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

# benchmarks.amount judges the numbers of contacts, benchmarks.extents how far curves grow.
# Numbers of contacts of the longest half curve: the first that is enough is taken.
CONTACT_COUNTS = (12, 24, 48)
SHORTEST = 4  # contacts of the shortest half curve
FELT = 96  # steps of a half curve as long as may be
SEEDS = (24, 12, 6, 3)  # Steps that a half curve may begin with.
GROWN_STD = 0.6 * DOUBTFUL_STD  # Growth ends here: the longest patches underestimate their deviation.
STRETCH = 1.5  # A half curve grows by this factor at once, by its square where it is in next to no doubt,
EASY = 0.1  # of what ends growth.
NEARLY_ENDED = 0.75  # of what ends growth: where twice as long is in doubt, nothing between is tried
HOPELESS = 3.0  # times it: with half as many contacts it is too large still
TOO_ROUGH = 0.0085  # Roughness of contacts whose fit ends growth, in all but one of a hundred
EXPLAINED = 3.0  # times its noise, that a contact is off: root mean square of a half curve

Counts = NDArray[np.intp]  # Numbers of contacts of the c contours on either side of the point, (c, 2).
Fits = Generator[list[Contour], Reconstruction | DegenerateCurvesError, "Grown"]
Feel = Callable[[float], "Felt"]  # half curves to a length, which becomes longer each time


@dataclass(frozen=True, eq=False)
class Felt:
    """Contours as they were tracked with a step between contacts; `partial`: not as far as may be.

    largest_std : a length, that the mean deviation of the height may be at most; None for a share of L
    """

    contours: list[Contour]
    point: Array
    step: float
    largest_std: float | None
    partial: bool = False

    @cached_property
    def places(self) -> list[int]:
        """The place of the point in each contour."""
        return [int(np.argmax((contour.points == self.point).all(axis=1))) for contour in self.contours]

    @cached_property
    def whole(self) -> Counts:
        """The contacts there are."""
        each = zip(self.contours, self.places, strict=True)
        return np.array([(at, len(contour.points) - 1 - at) for contour, at in each])

    @cached_property
    def open(self) -> NDArray[np.bool_]:
        """Whether a half curve goes on beyond what was tracked, (c, 2)."""
        return np.array([[self.partial and s == EXTENT for s in c.stops or ()] for c in self.contours])

    def shortened(self, counts: Counts, stride: int = 1) -> list[Contour]:
        """Every so many of these contacts, and the point."""
        found = []
        ends = (counts < self.whole) | self.open
        for contour, at, n, end in zip(self.contours, self.places, counts.tolist(), ends, strict=True):
            assert contour.stops is not None
            which = slice(at - n[0] // stride * stride, at + n[1] // stride * stride + 1, stride)
            first, last = (UNEXPLAINED if e else s for e, s in zip(end, contour.stops, strict=True))
            found.append(contour.part(which, (first, last)))
        return found

    def roughness(self, counts: Counts) -> float:
        """How far so many contacts are off any sextic: above 1 their fit would be in doubt."""
        contours = self.shortened(counts, stride_of(counts))
        points = np.vstack([contour.points for contour in contours])
        noise = max(contour.noise or 0.0 for contour in contours)
        return roughness(points - self.point, noise) / TOO_ROUGH

    def misfits(self, counts: Counts, r: Reconstruction) -> Array:
        """How far so many contacts are off a fit, the root mean square of each half curve, (c, 2).

        Above 1 is too much for their noise.
        """
        each = list(zip(self.contours, self.places, counts.tolist(), strict=True))
        points = np.vstack([contour.points[at - n[0] : at + n[1] + 1] for contour, at, n in each])
        x, y, z = r.frame.to_local(points).T
        # The point itself, which stands between the sides of each, is none of either.
        sizes = np.array([(a, 1, b) for _, _, (a, b) in each])
        starts = np.cumsum(sizes) - sizes.ravel()
        squares = np.append((z - r.height(x, y)) ** 2, 0.0)
        sums = np.add.reduceat(squares, starts).reshape(-1, 3)[:, ::2]
        limit = max(EXPLAINED * max(r.noise, MISFIT) * r.radius, self.largest_std or 0.0)
        return np.where(counts > 0, np.sqrt(sums / np.maximum(counts, 1)), 0.0) / limit


class Grown(NamedTuple):
    """Half curves of so many contacts, felt and, every `stride` of them, fitted; and what is in doubt of it.

    misfits, spread : of the contacts, (c, 2), and of the mean deviation: above 1 is too much
    """

    felt: Felt
    counts: Counts
    stride: int
    misfits: Array
    spread: float
    result: Reconstruction

    @property
    def doubt(self) -> float:
        """The largest doubt; there is none up to 1."""
        return max(float(self.misfits.max()), self.spread)

    @property
    def length(self) -> float:
        """That of the longest half curve."""
        return float(self.counts.max()) * self.felt.step

    @property
    def sure(self) -> bool:
        """Whether its status is "ok"."""
        return self.result.status == "ok"


def grown(feel: Feel, farthest: float, step: float) -> Fits:
    """The longest half curves that fits explain; raises DegenerateCurvesError where none carries a fit."""
    known: list[Grown] = []
    found = yield from _seed(feel, step, known)
    # Where a shorter one is in more doubt for its noise: that is the smaller the longer the curves are.
    if found.result.noise > MISFIT and found is not known[-1]:
        return (yield from _longer(feel, farthest, found, np.inf, np.inf))
    if found.doubt > 1.0:
        return found
    longest = (found.counts == np.minimum(SEEDS[0], found.felt.whole)).all()
    doubtful = min((trial.length for trial in known if trial.spread > 1.0), default=np.inf)
    return (yield from _longer(feel, farthest, found, 1.0 if longest else NEARLY_ENDED, doubtful))


def _longer(feel: Feel, farthest: float, found: Grown, most: float, doubtful: float) -> Fits:
    """Half curves that grow from those found, to a mean deviation of `most` and a length below `doubtful`."""
    accepted, felt, growing, quick = [found], found.felt, np.full(found.counts.shape, True), True
    while (growing := growing & ((found.counts < felt.whole) | felt.open)).any() and found.spread <= most:
        quick = quick and found.doubt <= EASY
        stretched = np.ceil((STRETCH**2 if quick else STRETCH) * found.counts)
        longer = np.where(growing, stretched, found.counts).astype(np.intp)
        length = float(longer.max()) * felt.step
        if length >= doubtful:
            break
        if (felt.open & (longer > felt.whole)).any():
            further = min(length + felt.step, farthest)  # by one more, so that where they end shows
            felt = feel(further)
        try:
            trial = yield from tried(felt, np.minimum(longer, felt.whole))
        except DegenerateCurvesError:
            break
        if quick and trial.doubt > 1.0:
            quick = False
        elif trial.misfits.max() > 1.0:  # the half curve that is explained worst ends here
            growing.flat[np.argmax(np.where(growing, trial.misfits, -1.0))] = False
        elif trial.spread > max(1.0, found.spread):
            break
        else:
            accepted.append(found := trial)
    # What is known for sure is not given away for more.
    return next((trial for trial in reversed(accepted) if trial.sure), found)


def _seed(feel: Feel, step: float, known: list[Grown]) -> Fits:
    """The longest of SEEDS that is in no doubt, or the one in the least; what is tried becomes `known`."""
    error, seeds, rough = None, list(SEEDS), []
    felt = feel(SEEDS[0] * step)
    while seeds:
        counts = np.minimum(seeds.pop(0), felt.whole)
        doubt = felt.roughness(counts) if seeds else 0.0  # the shortest are fitted however rough they are
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
    if not known and rough:  # where a shorter one carries no fit
        known.append((yield from tried(felt, rough[-1])))
    if not known and error is not None:
        raise error
    best = min(known, key=lambda trial: (trial.doubt, trial.length))
    if best.doubt <= 1.0 or felt.largest_std is not None:
        return best
    # Growth does not go on from any: the longest that is sure is as good as a short one in less doubt.
    enough = [trial for trial in known if trial.sure and trial.misfits.max() <= 1.0]
    return max((best, *enough), key=lambda trial: trial.length)


def tried(felt: Felt, counts: Counts) -> Fits:
    """The fit of so many contacts, of which as few are fitted as most often are enough."""
    stride = stride_of(counts)
    r = yield felt.shortened(counts, stride)
    if isinstance(r, DegenerateCurvesError):
        raise r
    spread = r.mean_height_std / (felt.largest_std or GROWN_STD * r.radius)
    return Grown(felt, counts, stride, felt.misfits(counts, r), spread, r)


def stride_of(counts: Counts) -> int:
    """One contact of so many is fitted."""
    return max(1, int(spacing(counts, CONTACT_COUNTS[0])))


def spacing(reaches: Array | Counts, count: int) -> float:
    """A step that gives the longest of half curves (c, 2) some `count` contacts, the shortest SHORTEST."""
    longest = float(reaches.max())
    shortest = float(np.where(reaches > 0, reaches, longest).min())
    return min(longest / count, max(shortest / SHORTEST, longest / CONTACT_COUNTS[-1]))
