# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Touches near one that chose its extent, in little more time than one whose extent is given.

While a handle is dragged, each touch is near the one before. Its half curves are as long as those were. They
become shorter at once if the fit is in doubt, and longer in the next touch if the doubt is small.
"""

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ..arguments import LARGEST, Array, finite_array, number, unit_vector
from ..contours.contour import EXTENT, UNEXPLAINED, Contour, SamplingPlane
from ..contours.finger import Surface
from ..contours.local_geometry import DegenerateCurvesError
from ..contours.tracking import following
from ..reconstruction.from_contours import fitted, options_of
from ..reconstruction.result import Reconstruction
from ..reconstruction.stacks import Options
from ..reconstruction.start import Given
from ..reconstruction.strokes import gathered
from .enough import CONTACT_COUNTS, spacing
from .growth import FELT, GROWN_STD, SEEDS, STRETCH, Felt, Grown
from .one_touch import Exploration
from .side_by_side import given, planes_of
from .touches import explore

# benchmarks.nearby judges these.
LONGER = 1.08  # A half curve becomes longer by this factor at once, and shorter by at least it.
NO_LONGER = 0.6  # A half curve that is in more doubt does not become longer; growth would end at 1.
MOST_FITS = 4  # A touch takes at most so many fits; if it is still in doubt, the next one goes on.


class Nearby(NamedTuple):
    """A touch near another, and how long the half curves of the next one should be, (p, 2)."""

    found: Exploration
    reaches: Array


def explore_nearby(
    surface: Surface,
    point: ArrayLike,
    outward: ArrayLike,
    planes: Sequence[SamplingPlane],
    reaches: ArrayLike,
    *,
    farthest: float,
    step: float | str = "auto",
    noise: float = 0.0,
    rng: np.random.Generator | int | None = None,
    tangent: ArrayLike | None = None,
    method: str = "bayes",
    degree: int | str = "auto",
    weight: float | None = None,
    solver: str = "fast",
) -> Nearby:
    """Touches near a touch that chose its extent, as far as that or less far, with one fit as a rule.

    reaches : (p, 2), lengths of the half curves, from `reaches_of` or the Nearby before
    farthest : greatest length of a half curve
    step : as in `track`; "auto" takes few contacts, and adds none even if they would tell more

    All else is as in `explore`, which also knows what is beyond, and taps between the curves. So the patches
    of the two differ, except where curves of these lengths cannot be fitted: there `explore` begins anew.
    Raises what `track` and `reconstruct` raise.
    """
    p, up = finite_array("point", point, (3,), LARGEST), unit_vector("outward", outward)
    tracking: dict[str, Any] = {"noise": noise, "rng": rng, "tangent": tangent}
    fitting: dict[str, Any] = {"method": method, "degree": degree, "weight": weight, "solver": solver}
    options, far = options_of(noise=None, **fitting), number("farthest", farthest, above=0.0)
    least = SEEDS[-1] * far / FELT
    planes = planes_of(planes)
    lengths = np.clip(finite_array("reaches", reaches, (len(planes), 2)), least, far)
    # With noise, few contacts would not be enough for curves of this length.
    between = given("step", step) or spacing(lengths, CONTACT_COUNTS[1 if noise else 0])
    longest = max(float(lengths.max()), between)
    follow = following(surface, p, up, planes, step=between, **tracking)
    felt = Felt(follow(longest), p, between, None, partial=longest < far)

    def tried(lengths: Array) -> Grown:
        """The touch whose half curves have these lengths. Raises DegenerateCurvesError."""
        counts = np.minimum(np.rint(lengths / between).astype(np.intp), felt.whole)
        r = _fitted(p, up, felt.shortened(counts), options._replace(method="bayes"))
        spread = r.mean_height_std / (GROWN_STD * r.radius)
        return Grown(felt, counts, 1, felt.misfits(counts, r), spread, r)

    try:
        first = tried(lengths)
    except DegenerateCurvesError:
        # Beside a crease some half curves have too few contacts at this length; a shorter one has more.
        anew = explore(surface, p, up, planes, farthest=far, step=step, **tracking, **fitting)
        return Nearby(anew, reaches_of(anew))
    grown = _shortened(first, tried, least)
    contours, r = felt.shortened(grown.counts), grown.result
    if method != "bayes":
        r = _fitted(p, up, contours, options)
    found = Exploration(contours, r, grown.length, between, tuple(planes), (r.mean_height_std,))
    return Nearby(found, _next(grown, contours))


def _fitted(point: Array, outward: Array, contours: list[Contour], options: Options) -> Reconstruction:
    """The fit of contours. Raises DegenerateCurvesError."""
    (r,) = fitted(point[None], [Given(contours, *gathered(()))], outward[None], options)
    if isinstance(r, DegenerateCurvesError):
        raise r
    return r


def _shortened(first: Grown, tried: Callable[[Array], Grown], least: float) -> Grown:
    """A touch, or one with shorter half curves, at least `least` long, if length is what puts it in doubt."""
    grown = first
    for _ in range(MOST_FITS - 1 if first.doubt > 1.0 else 1):
        shorter = first.felt.step * _shorter(grown)
        if grown.sure or shorter.max() < least:
            break
        try:
            grown = tried(shorter)
        except DegenerateCurvesError:
            break
    return first if not grown.sure and first.doubt <= 1.0 else grown


def reaches_of(found: Exploration) -> Array:
    """How long the half curves of a touch near this one should be, (p, 2); see `explore_nearby`."""
    felt = Felt(found.contours, found.result.frame.origin, found.step, None)
    return _freed(found.step * felt.whole.astype(np.float64), found.contours)


def _shorter(grown: Grown) -> Array:
    """Numbers of contacts (c, 2) with fewer of the half curve that is explained worst, or of all."""
    counts = grown.counts.astype(np.float64)
    factor = min(max(grown.doubt, LONGER), STRETCH) if grown.doubt > 1.0 else STRETCH
    if grown.misfits.max() <= 1.0:
        return counts / factor
    counts.flat[np.argmax(grown.misfits)] /= factor
    return counts


def _next(grown: Grown, contours: list[Contour]) -> Array:
    """The lengths (c, 2) that the next touch should reach: a little more or less than this one, or as far."""
    doubt = np.maximum(grown.misfits, grown.spread)
    factors = np.where(doubt > 1.0, 1.0 / LONGER, np.where(doubt <= NO_LONGER, LONGER, 1.0))
    if not grown.sure:
        factors = np.minimum(factors, 1.0)
    return _freed(factors * grown.felt.step * grown.counts, contours)


def _freed(lengths: Array, contours: list[Contour]) -> Array:
    """The lengths (c, 2), with the longest of them for half curves that the surface has ended."""
    ended = [[stop not in (EXTENT, UNEXPLAINED) for stop in contour.stops or ()] for contour in contours]
    return np.where(ended, lengths.max(), lengths)
