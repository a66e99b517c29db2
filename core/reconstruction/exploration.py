# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A touch that chooses its own size: curves as long as a patch can be trusted, contacts as many as tell.

Beside the paper. Half curves grow outward from the reference point like the regions of a segmentation
by surface fitting: fit, go on where the fit explains the contacts, fit again (growth.py).
"""

from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ..arguments import LARGEST, Array, finite_array, number
from ..bayes.joint_fit import MISFIT
from ..bayes.residual_evidence import PLACES
from ..contours.contour import Contour, SamplingPlane
from ..contours.local_geometry import DegenerateCurvesError
from ..contours.tracking import Surface, track
from ..growth import CONTACTS, FELT, GROWTH, Counts, Felt, Grown, grown, spacing
from .deviations import with_height_stds
from .from_contours import reconstruct_many
from .result import Reconstruction

NOTICEABLE = 0.15  # Share of the mean deviation of the height that twice as many contacts must take off.


@dataclass(frozen=True, eq=False)
class Exploration:
    """What was felt and found, and the length of the longest half curve and the step that it took."""

    contours: list[Contour]
    result: Reconstruction
    extent: float
    step: float


class _Ask(NamedTuple):
    """Contours to be fitted: as it is asked for, or by the default method, by which curves grow."""

    contours: list[Contour]
    growing: bool = False


_Answer = Reconstruction | DegenerateCurvesError
_Steps = Generator[_Ask, _Answer, Exploration]


class _Sizes(NamedTuple):
    """What is given: None where it is to be chosen."""

    extent: float | None
    step: float | None
    farthest: float


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
    feel = partial(track, surface, p, outward, planes, noise=noise, rng=rng, tangent=tangent)
    sizes = _sizes(extent, step, farthest)
    (found,) = _side_by_side([_explored(feel, p, sizes, fit)], p[None], [outward], fit)
    if isinstance(found, ValueError):
        raise found
    return found


def explore_many(
    surface: Surface,
    points: ArrayLike,
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
) -> list[Exploration | ValueError]:
    """What `explore` gives at each of m points; side by side, with their fits in stacks, which is faster.

    points, outward : (m, 3). In the place of a touch that there cannot be stands its error. Raises
    ValueError for bad arguments.
    """
    p = finite_array("points", points, (None, 3), LARGEST)
    up = finite_array("outward", outward, (len(p), 3))
    sizes, generator = _sizes(extent, step, farthest), np.random.default_rng(rng)
    common = {"noise": noise, "rng": generator, "tangent": tangent}
    steps = [
        _explored(partial(track, surface, at, n, planes, **common), at, sizes, fit)
        for at, n in zip(p, up, strict=True)
    ]
    return _side_by_side(steps, p, up, fit)


def _sizes(extent: float | str, step: float | str, farthest: float) -> _Sizes:
    length, between = (_given(*each) for each in (("extent", extent), ("step", step)))
    return _Sizes(length, between, number("farthest", farthest, above=0.0) if length is None else length)


def _given(name: str, length: float | str) -> float | None:
    """None for "auto"."""
    automatic = isinstance(length, str) and length == "auto"
    return None if automatic else number(name, length, above=0.0)  # type: ignore[arg-type]


def _side_by_side(
    steps: Sequence[_Steps], points: Array, outward: ArrayLike, fit: dict[str, Any]
) -> list[Exploration | ValueError]:
    """What each of b touches comes to, (b, 3) and (b, 3); the fits that they ask for in stacks."""
    found: dict[int, Exploration | ValueError] = {}
    answers: dict[int, _Answer | None] = dict.fromkeys(range(len(steps)))
    while answers:
        asked: dict[int, _Ask] = {}
        for i, answer in answers.items():
            try:
                asked[i] = steps[i].send(answer)  # type: ignore[arg-type]
            except StopIteration as end:
                found[i] = end.value
            except ValueError as error:
                found[i] = error
        answers = {}
        for growing in (True, False):
            which = [i for i, ask in asked.items() if ask.growing is growing]
            if which:
                options = fit | ({"method": "bayes"} if growing else {})
                up = [outward[i] for i in which]  # type: ignore[index]
                results = reconstruct_many(
                    points[which], [asked[i].contours for i in which], outward=up, **options
                )
                answers.update(zip(which, _with_stds(results), strict=True))
    return [found[i] for i in range(len(steps))]


def _with_stds(results: list[_Answer]) -> list[_Answer]:
    """With the mean_height_std of many computed at once."""
    if len(results) == 1:
        return results
    known = iter(with_height_stds([r for r in results if isinstance(r, Reconstruction)]))
    return [next(known) if isinstance(r, Reconstruction) else r for r in results]


def _explored(feel: Callable[..., list[Contour]], p: Array, sizes: _Sizes, fit: dict[str, Any]) -> _Steps:
    """One touch: asks for fits, and comes to an Exploration."""
    if sizes.extent is not None:
        steps = [sizes.extent / count for count in CONTACTS] if sizes.step is None else [sizes.step]
        return (yield from _enough(partial(_felt_at, feel, sizes.extent), sizes.extent, steps))
    between = max(sizes.step or 0.0, sizes.farthest / FELT)
    largest = yield from _growing(feel, p, sizes.farthest, between)
    touched = partial(_touched, feel, p, sizes, largest, fit)
    found = yield from touched(largest.counts)
    if largest.sure and found.result.status != "ok" and found.result.method == "bayes":
        # These contacts are others than those felt.
        return (yield from touched(np.floor(largest.counts / GROWTH).astype(np.intp)))
    return found


def _growing(
    feel: Callable[..., list[Contour]], p: Array, farthest: float, between: float
) -> Generator[_Ask, _Answer, Grown]:
    """The largest that can be trusted, by fits of the default method."""
    fits = grown(lambda extent: feel(extent=extent, step=between), p, farthest, between)
    contours = next(fits)
    while True:
        answer = yield _Ask(contours, growing=True)
        try:
            contours = fits.send(answer)
        except StopIteration as end:
            largest: Grown = end.value
            return largest


def _touched(
    feel: Callable[..., list[Contour]],
    p: Array,
    sizes: _Sizes,
    largest: Grown,
    fit: dict[str, Any],
    counts: Counts,
) -> _Steps:
    """A touch with half curves of so many of the contacts that were felt; with these where they do."""
    felt, reaches = largest.felt, largest.felt.step * counts.astype(np.float64)
    length = float(reaches.max())

    def at(step: float) -> tuple[list[Contour], float, Reconstruction | None]:
        """Contours with contacts so far apart, or somewhat nearer; how far; and their fit, where known."""
        stride = int(step / felt.step * (1.0 + 1e-6))
        if stride:
            same = (
                counts is largest.counts
                and stride == largest.stride
                and fit.get("method", "bayes") == "bayes"
            )
            known = largest.result if same else None
            return felt.shortened(counts, stride), stride * felt.step, known
        # A step longer than that, so that where they end shows.
        again = Felt(feel(extent=min(length + step, sizes.farthest), step=step), p, step)
        fewer = np.minimum((reaches / step * (1.0 + 1e-6)).astype(np.intp), again.whole)
        return again.shortened(fewer), step, None

    steps = [spacing(reaches, count) for count in CONTACTS] if sizes.step is None else [sizes.step]
    return (yield from _enough(at, length, steps))


def _felt_at(
    feel: Callable[..., list[Contour]], extent: float, step: float
) -> tuple[list[Contour], float, None]:
    return feel(extent=extent, step=step), step, None


def _enough(
    at: Callable[[float], tuple[list[Contour], float, Reconstruction | None]],
    extent: float,
    steps: Sequence[float],
) -> _Steps:
    """The touch with the first of these steps that brings enough contacts, or with the last."""
    for wanted in dict.fromkeys(steps):
        contours, step, known = at(wanted)
        r = known or (yield _Ask(contours))
        if isinstance(r, DegenerateCurvesError):
            if wanted == steps[-1]:
                raise r
        elif wanted == steps[-1] or _is_enough(r):
            break
    return Exploration(contours, r, extent, step)


def _is_enough(r: Reconstruction) -> bool:
    """Whether twice as many contacts would take less than NOTICEABLE off the mean deviation of the height.

    They would tell nothing where that is less than a polynomial may be off.
    """
    now = r.mean_height_std / r.radius
    if now <= MISFIT:
        return True
    surface, (points, weights) = r.uncertainty, r.domain.nodes
    over, contacts = points / r.radius, r.contacts[:, :2] / r.radius
    some = contacts[np.linspace(0, len(contacts) - 1, min(len(contacts), PLACES)).astype(np.intp)]
    shared = surface.height_covariance(some, over)
    seen = surface.height_covariance(some, some)
    np.einsum("ii->i", seen)[:] += surface.noise**2 * len(some) / len(contacts)  # a view
    variance = surface.height_std(*over.T) ** 2
    lost = np.einsum("in,in->n", shared, np.linalg.solve(seen, shared))
    then = weights @ np.sqrt(np.maximum(variance - lost, 0.0))
    return bool(then >= (1.0 - NOTICEABLE) * (weights @ np.sqrt(variance)))
