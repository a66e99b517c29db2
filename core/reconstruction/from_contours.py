# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The way from contacts to a patch: the paper's sections III and IV, or the Bayesian fit, in one call."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..arguments import (
    LARGEST,
    Array,
    finite_array,
    list_of,
)
from ..contours.contour import Contour, contours_of, outward_of
from ..contours.curves import has_measured_normals
from ..contours.local_geometry import DegenerateCurvesError
from .ball import ball_of, center_at, contacts_below
from .options import FitOptions
from .result import Reconstruction
from .stacks import fitted_stack
from .start import TouchContacts
from .strokes import gathered

STACK = 4000  # The number of contacts that fit into a processor's cache at once (benchmarks.speed, e20b52a).


def reconstruct(
    point: ArrayLike,
    contours: Sequence[ArrayLike | Contour],
    *,
    outward: ArrayLike | None = None,
    strokes: Sequence[ArrayLike | Contour] = (),
    radius: float | None = None,
    method: str = "bayes",
    degree: int | str = "auto",
    noise: float | None = None,
    point_std: float | None = None,
    weight: float | None = None,
    solver: str = "fast",
) -> Reconstruction:
    """The surface patch around `point` from three or more contours through it, from strokes, or from both.

    point : (3,). If the contours are those of a ball's center, the patch is that of the contacts, and the
        point is a center or, if no center is nearer to it than half the ball's radius, a contact
    contours : Contours, or arrays (n, 3)
    outward : (3,), on the outer side of the surface; None for the side of the mean of the measured normals
    strokes : curves that do not pass through the point, (n, 3) each or Contours, in the order in which their
      contacts were felt, either way; their normals are not fitted. Only "bayes" fits them. With contours,
      contacts beyond the domain are ignored. Without contours the point is only a place: the origin is its
      projection onto the polynomial, L is the distance of the farthest contact, and the domain is the hull of
      the contacts
    radius : without contours, use contacts up to this distance from the point; None for all
    method : "bayes" (bayes/joint_fit.py), or one of the paper's: "tagc" (9), "quadratic-variation",
        "least-squares" (5)
    degree : d of (1), 2 to 6, or "auto", the lowest that describes what the contacts show
    noise : noise floor, the standard deviation that a contact has at least; None for the contours' own
    point_std : standard deviation of the point along the normal, a length: 0 if it is exact. If it is None,
        a point that is a contact of a curve has its noise, and any other is only a place: "bayes" has the
        origin where contacts show the surface, on the normal through it
    weight : lambda L^2 of "tagc" and "quadratic-variation", None for 1000 and 1e5
    solver : for "tagc", "fast" (Newton, from the quadric) or "descent" (the paper's, from its start)

    Raises ValueError for bad arguments, DegenerateCurvesError for contours that cannot carry the
    method. A fit in doubt has another status than "ok".

    >>> s, azimuths = np.linspace(-0.5, 0.5, 21), np.radians([0, 60, 120])  # meridians of the unit ball
    >>> meridian = lambda a: Contour(np.stack([np.sin(s) * np.cos(a), np.sin(s) * np.sin(a), np.cos(s)], 1))
    >>> r = reconstruct((0, 0, 1), [meridian(a) for a in azimuths], outward=(0, 0, 1))
    >>> round(r.patch.k1, 2), round(r.patch.k2, 2), r.status
    (-1.0, -1.0, 'ok')
    """
    p, felt = finite_array("point", point, (3,), LARGEST), contours_of("contours", contours)
    options = FitOptions(method, degree, noise, point_std, weight, solver, radius)
    others: list[Any] = list_of("strokes", strokes, object)  # type: ignore[arg-type]
    up = outward_of(outward, [*felt, *others])
    p, touch = _touch(p, felt, others, up, options)
    return _fitted_one(p, touch, up, options)


def reconstruct_many(
    points: ArrayLike,
    contours_list: Sequence[Sequence[ArrayLike | Contour]],
    *,
    outward: ArrayLike | None = None,
    strokes_list: Sequence[Sequence[ArrayLike | Contour]] | None = None,
    **options: Any,
) -> list[Reconstruction | DegenerateCurvesError]:
    """What `reconstruct` gives for each of n touches, in stacks, in which "bayes" is several times as fast.

    points : (n, 3); contours_list : n lists of contours; strokes_list : n lists of strokes
    outward : (n, 3), or None for the sides of the measured normals
    options : the other keywords of `reconstruct`

    A touch that cannot carry the method is returned as its DegenerateCurvesError. Raises
    ValueError for bad arguments.
    """
    p = finite_array("points", points, (None, 3), LARGEST)
    fit = FitOptions(**options)
    lists = list_of("contours_list", contours_list, Sequence)  # type: ignore[type-abstract]
    strokes = [()] * len(lists) if strokes_list is None else list_of("strokes_list", strokes_list, Sequence)  # type: ignore[type-abstract]
    for name, given in (("contours_list", lists), ("strokes_list", strokes)):
        if len(given) != len(p):
            raise ValueError(f"{name}: expected {len(p)} lists of {name[:-5]}, got {len(given)}")
    felt = [contours_of("contours", contours) for contours in lists]
    given_up = [None] * len(p) if outward is None else finite_array("outward", outward, (len(p), 3))
    up = np.array([outward_of(u, [*c, *s]) for u, c, s in zip(given_up, felt, strokes, strict=True)])
    up = up.reshape(-1, 3)
    results: dict[int, Reconstruction | DegenerateCurvesError] = {}
    touches, places = {}, p.copy()
    for i, (c, s) in enumerate(zip(felt, strokes, strict=True)):
        try:
            places[i], touches[i] = _touch(p[i], c, s, up[i], fit)
        except DegenerateCurvesError as error:
            results[i] = error
    which = list(touches)
    results.update(zip(which, fitted(places[which], list(touches.values()), up[which], fit), strict=True))
    return [results[i] for i in range(len(p))]


def fitted(
    points: Array, touches: Sequence[TouchContacts], outward: Array, options: FitOptions
) -> list[Reconstruction | DegenerateCurvesError]:
    """What `reconstruct_many` gives for checked points (n, 3), n touches and outward directions (n, 3)."""
    # A stack has room for its longest contour in all places, so touches of similar size go together.
    sizes = [touch.size for touch in touches]
    results: dict[int, Reconstruction | DegenerateCurvesError] = {}
    # Measured normals of some cost time in the fits of all, and touches without contours start differently.
    kinds = [(has_measured_normals(touch.contours), touch.strokes_only) for touch in touches]
    for kind in dict.fromkeys(kinds):
        of_kind = (i for i in range(len(touches)) if kinds[i] == kind)
        order = sorted(of_kind, key=sizes.__getitem__, reverse=True)
        while order:
            count = max(1, STACK // max(sizes[order[0]], 1))
            chosen, order = order[:count], order[count:]
            of_size = fitted_stack(points[chosen], [touches[i] for i in chosen], outward[chosen], options)
            results.update(zip(chosen, of_size, strict=True))
    return [results[i] for i in range(len(touches))]


def _touch(
    p: Array, contours: list[Contour], strokes: Sequence[ArrayLike | Contour], up: Array, options: FitOptions
) -> tuple[Array, TouchContacts]:
    """The reference point (3,) and the contacts of a touch, below the centers of a ball if these are given.

    Raises DegenerateCurvesError if such centers carry no surface, or the ball is too large for it.
    """
    touch, ball = _touch_contacts(contours, strokes, options), ball_of(contours, strokes)
    if not ball:
        return p, touch
    center = center_at(p, contours, ball)
    centers = _fitted_one(center, touch, up, replace(options, method="bayes", degree="auto"))
    balls = [stroke for stroke in strokes if isinstance(stroke, Contour)]
    below, contours, balls = contacts_below(centers, contours, balls, ball)
    return below if center is p else p, _touch_contacts(contours, balls, options)


def _fitted_one(p: Array, touch: TouchContacts, up: Array, options: FitOptions) -> Reconstruction:
    """The result of one touch. Raises DegenerateCurvesError if it cannot carry the method."""
    (result,) = fitted_stack(p[None], [touch], up[None], options)
    if isinstance(result, DegenerateCurvesError):
        raise result
    return result


def _touch_contacts(
    contours: list[Contour], strokes: Sequence[ArrayLike | Contour], options: FitOptions
) -> TouchContacts:
    """The contacts of a touch. Raises ValueError for strokes or a radius that do not go with the options."""
    touch = TouchContacts(contours, *gathered(strokes, contours))
    if len(touch.strokes) and options.method != "bayes":
        raise ValueError(
            f'strokes: expected none with "{options.method}", which fits contours only: use "bayes"'
        )
    if contours and options.radius is not None:
        raise ValueError("radius: expected none with contours, which say how far the patch reaches")
    return touch
