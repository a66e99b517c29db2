# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A touch that chooses its own size: curves as long as a patch can be trusted, contacts as many as tell.

Beside the paper. Half curves grow outward from the reference point like the regions of a segmentation
by surface fitting: fit, go on where the fit explains the contacts, fit again.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..arguments import LARGEST, Array, finite_array, number
from ..bayes.joint_fit import MISFIT
from ..bayes.residual_evidence import PLACES
from ..contours.contour import UNEXPLAINED, Contour, SamplingPlane
from ..contours.local_geometry import DegenerateCurvesError
from ..contours.tracking import Surface, track
from .from_contours import reconstruct
from .result import DOUBTFUL_STD, Reconstruction

CONTACTS = (12, 24, 48)  # Numbers of contacts of the longest half curve: the first that is enough is taken.
NOTICEABLE = 0.15  # Share of the mean deviation of the height that twice as many contacts must take off.
LEAST = 4  # contacts of the shortest half curve
FELT = 128  # contacts of a half curve as long as may be
SEEDS = (32, 16, 8, 4)  # Numbers of these contacts that a half curve may begin with.
GROWN_STD = 0.6 * DOUBTFUL_STD  # Growth ends here: the longest patches underestimate their deviation.
GROWTH = 1.5  # A half curve grows by this factor at once.
EXPLAINED = 3.0  # times its accuracy, that a contact is off: root mean square of a half curve

Counts = NDArray[np.intp]  # Numbers of contacts of the c contours on either side of the point, (c, 2).


@dataclass(frozen=True, eq=False)
class Exploration:
    """What was felt and found, and the length of the longest half curve and the step that it took."""

    contours: list[Contour]
    result: Reconstruction
    extent: float
    step: float


def explore(
    surface: Surface,
    point: ArrayLike,
    outward: ArrayLike,
    planes: Sequence[SamplingPlane],
    *,
    farthest: float,
    extent: float | str = "auto",
    step: float | str = "auto",
    noise: float = 0.0,
    rng: np.random.Generator | int | None = None,
    tangent: ArrayLike | None = None,
    **fit: Any,
) -> Exploration:
    """Tracks `surface` from `point` and reconstructs the patch, as large and as densely felt as it needs.

    farthest : the longest that a half curve may become
    extent : of each half curve, as in `track`; "auto" has each grow until the default fit no longer
        explains its contacts by their accuracy, or the patch could be trusted no longer
    step : as in `track`; "auto" for so many contacts that twice as many would not lower the deviation of
        the height noticeably
    fit : what `reconstruct` takes; all else as in `track`

    Where a contour was not followed any farther, its `stops` say UNEXPLAINED. Raises what `track` and
    `reconstruct` raise.
    """
    p = finite_array("point", point, (3,), LARGEST)
    length, spacing = _given("extent", extent), _given("step", step)
    feel = partial(track, surface, p, outward, planes, noise=noise, rng=rng, tangent=tangent)
    touched = partial(_touched, feel, p, outward, fit, spacing)
    if length is not None:
        return touched(length)
    farthest = number("farthest", farthest, above=0.0)
    between = max(spacing or 0.0, farthest / FELT)
    counts, sure = _grown(feel(extent=farthest, step=between), p, outward, fit | {"method": "bayes"})
    reaches = between * counts.astype(np.float64)
    found = touched(farthest, reaches)
    if sure and found.result.status != "ok" and found.result.method == "bayes":
        return touched(farthest, reaches / GROWTH)  # these contacts are others than those felt
    return found


def _touched(
    feel: Callable[..., list[Contour]],
    p: Array,
    outward: ArrayLike,
    fit: dict[str, Any],
    spacing: float | None,
    extent: float,
    reaches: Array | None = None,
) -> Exploration:
    """A touch of this extent, or of one for each half curve (c, 2) up to it; with that spacing or its own."""
    length = extent if reaches is None else float(reaches.max())

    def at(step: float) -> Exploration:
        """The touch whose contacts are so far apart."""
        contours = feel(extent=length if reaches is None else min(length + step, extent), step=step)
        if reaches is not None:  # a step longer than that, so that where they end shows
            counts = (reaches / step * (1.0 + 1e-6)).astype(np.intp)
            contours = [_shortened(*each, p) for each in zip(contours, counts, strict=True)]
        return Exploration(contours, reconstruct(p, contours, outward=outward, **fit), length, step)

    if spacing is not None:
        return at(spacing)
    shortest = length if reaches is None else float(reaches[reaches > 0.0].min())
    coarsest = max(shortest / LEAST, length / CONTACTS[-1])
    return _enough(at, [min(length / count, coarsest) for count in CONTACTS])


def _given(name: str, length: float | str) -> float | None:
    """None for "auto"."""
    automatic = isinstance(length, str) and length == "auto"
    return None if automatic else number(name, length, above=0.0)  # type: ignore[arg-type]


def _enough(touched: Callable[[float], Exploration], steps: Sequence[float]) -> Exploration:
    """The touch with the first of these steps that brings enough contacts, or with the last."""
    for step in steps:
        try:
            found = touched(step)
        except DegenerateCurvesError:
            if step == steps[-1]:
                raise
        else:
            if _is_enough(found.result):
                break
    return found


def _is_enough(r: Reconstruction) -> bool:
    """Whether twice as many contacts would take less than NOTICEABLE off the mean deviation of the height.

    They would tell nothing where that is less than a polynomial may be off.
    """
    surface, (points, weights) = r.uncertainty, r.domain.nodes
    over, contacts = points / r.radius, r.contacts[:, :2] / r.radius
    some = contacts[np.linspace(0, len(contacts) - 1, min(len(contacts), PLACES)).astype(np.intp)]
    shared = surface.height_covariance(some, over)
    seen = surface.height_covariance(some, some)
    np.einsum("ii->i", seen)[:] += surface.noise**2 * len(some) / len(contacts)  # a view
    variance = surface.height_std(*over.T) ** 2
    lost = np.einsum("in,in->n", shared, np.linalg.solve(seen, shared))
    now, then = weights @ np.sqrt(variance), weights @ np.sqrt(np.maximum(variance - lost, 0.0))
    return bool(then >= (1.0 - NOTICEABLE) * now or now <= MISFIT)


def _grown(felt: Sequence[Contour], p: Array, outward: ArrayLike, fit: dict[str, Any]) -> tuple[Counts, bool]:
    """To how many contacts on either side of p the contours can be followed, and whether that is "ok"."""
    whole = np.array([_on_either_side(contour, p) for contour in felt])
    counts, doubt, sure = _seed(felt, whole, p, outward, fit)
    growing = (counts < whole) & (doubt <= 1.0)
    while growing.any():
        longer = np.minimum(np.ceil(GROWTH * counts).astype(np.intp), whole)
        trial = np.where(growing, longer, counts)
        try:
            misfits, spread, still = _doubts(felt, trial, p, outward, fit)
        except DegenerateCurvesError:
            break
        if misfits.max() > 1.0:  # the half curve that is explained worst ends here
            growing.flat[np.argmax(np.where(growing, misfits, -1.0))] = False
        elif spread > 1.0 or (sure and not still):  # what is known for sure is not given away for more
            break
        else:
            counts, sure = trial, still
            growing &= counts < whole
    return counts, sure


def _seed(
    felt: Sequence[Contour], whole: Counts, p: Array, outward: ArrayLike, fit: dict[str, Any]
) -> tuple[Counts, float, bool]:
    """The longest of SEEDS that is in no doubt, or the one in the least.

    And its doubt, at most 1 for none, and whether its status is "ok".

    Raises DegenerateCurvesError where none of them carries a fit.
    """
    found, error = [], None
    for seed in SEEDS:
        try:
            misfits, spread, sure = _doubts(felt, np.minimum(seed, whole), p, outward, fit)
        except DegenerateCurvesError as why:
            error = why
            continue
        found.append((max(float(misfits.max()), spread), seed, sure))
        if found[-1][0] <= 1.0:
            break
    if not found and error is not None:
        raise error
    doubt, seed, sure = min(found)
    return np.minimum(seed, whole), doubt, sure


def _doubts(
    felt: Sequence[Contour], counts: Counts, p: Array, outward: ArrayLike, fit: dict[str, Any]
) -> tuple[Array, float, bool]:
    """How far contacts are off the fit of so many, (c, 2), and its mean deviation: above 1 is too much.

    And whether its status is "ok".
    """
    few = [_shortened(*each, p, most=CONTACTS[0]) for each in zip(felt, counts, strict=True)]
    r = reconstruct(p, few, outward=outward, **fit)
    sides = [side for each in zip(felt, counts, strict=True) for side in _sides(*each, p)]
    x, y, z = r.frame.to_local(np.vstack(sides)).T
    ends = np.cumsum([len(side) for side in sides])
    squares = np.split((z - r.height(x, y)) ** 2, ends[:-1])
    misfits = np.array([np.sqrt(side.mean()) if len(side) else 0.0 for side in squares]).reshape(counts.shape)
    limit = EXPLAINED * max(r.accuracy, MISFIT) * r.radius
    return misfits / limit, r.mean_height_std / (GROWN_STD * r.radius), r.status == "ok"


def _sides(contour: Contour, counts: Counts, p: Array) -> tuple[Array, Array]:
    """The nearest contacts of a tracked contour before p and after it, `counts` (2,) of them: (n, 3) each."""
    at, (before, after) = _on_either_side(contour, p)[0], counts.tolist()
    return contour.points[at - before : at], contour.points[at + 1 : at + after + 1]


def _on_either_side(contour: Contour, p: Array) -> tuple[int, int]:
    """How many contacts a tracked contour has before p and after it."""
    at = int(np.argmax((contour.points == p).all(axis=1)))
    return at, len(contour.points) - 1 - at


def _shortened(contour: Contour, counts: Counts, p: Array, most: float = np.inf) -> Contour:
    """The contour with no more than `counts` (2,) contacts on either side of p, thinned to some `most`."""
    whole = _on_either_side(contour, p)
    before, after = (np.arange(n, 0, -max(1, round(n / most))) for n in np.minimum(counts, whole))
    which = whole[0] + np.concatenate([-before, [0], after[::-1]])
    assert contour.normals is not None and contour.stops is not None
    first, last = (
        stop if count >= there else UNEXPLAINED
        for stop, count, there in zip(contour.stops, counts, whole, strict=True)
    )
    points, normals = contour.points[which], contour.normals[which]
    return replace(contour, points=points, normals=normals, stops=(first, last))
