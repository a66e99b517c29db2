# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""From contacts to a patch: the paper's sections III and IV, or the Bayesian fit, in one call."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..arguments import (
    LARGEST,
    Array,
    finite_array,
    list_of,
    number,
    shown,
    unit_vector,
)
from ..bayes.joint_fit import joint_fit
from ..bayes.posterior import Posterior
from ..bayes.rough_fit import rough_fit
from ..contours.contour import Contour
from ..contours.curves import Curves, has_measured_normals, misses
from ..contours.local_geometry import DegenerateCurvesError, Frame
from ..paper.by_method import PAPER_METHODS, SOLVERS, coefficients
from ..patch.domain import Domain, hull_domain
from ..patch.geometry import Geometry
from ..patch.monge import DEGREE, MongePatch
from ..patch.residual import Residual
from .result import Reconstruction
from .start import Given, Start, curves_start, domain_of, levels, strokes_start
from .strokes import gathered

METHODS = ("bayes", *PAPER_METHODS)
# lambda L^2: of TAGC the paper's 9.99/mm^2 at L = 10 mm; quadratic variation in the paper is subject to
# f = 0, which 1e5 comes near.
WEIGHTS = {"tagc": 1e3, "quadratic-variation": 1e5}
STACK = 4000  # contacts that are fitted at once; more do not fit into a processor's cache


def reconstruct(
    point: ArrayLike,
    contours: Sequence[Contour],
    *,
    outward: ArrayLike,
    strokes: Sequence[ArrayLike | Contour] = (),
    radius: float | None = None,
    method: str = "bayes",
    degree: int | str = 4,
    noise: float | None = None,
    weight: float | None = None,
    solver: str = "fast",
) -> Reconstruction:
    """The surface patch around `point` from three or more contours through it, from strokes, or from both.

    point : (3,), exact; outward : (3,), on the outer side of the surface
    strokes : contacts beside the point, (n, 3) each or Contours, whose normals are not fitted; only "bayes"
        takes them. With contours those beyond the domain are ignored. From strokes alone (no contours) the
        point is only a place: the origin is its foot on the polynomial, L is that of the farthest contact and
        the domain is the hull of the contacts
    radius : from strokes alone, of the contacts around the point that are used; None for all
    method : "bayes" (bayes.py), or one of the paper's: "tagc" (9), "quadratic-variation",
        "least-squares" (5)
    degree : d of (1), 2 to 6, or "auto", the least that says what the contacts show
    noise : accuracy of a contact; noise is taken for no less. None: the contours' own
    weight : lambda L^2 of "tagc" and "quadratic-variation", None for 1000 and 1e5
    solver : of "tagc", "fast" (Newton, from the quadric) or "descent" (the paper's, from its start)

    Raises ValueError for bad arguments, DegenerateCurvesError for contours that cannot carry the
    method. A fit in doubt comes back with a status.
    """
    p, up = finite_array("point", point, (3,), LARGEST), unit_vector("outward", outward)
    options = _options(method, degree, noise, weight, solver, radius)
    touch = _given(list_of("contours", contours, Contour), strokes, options)
    (result,) = _stack(p[None], [touch], up[None], options)
    if isinstance(result, DegenerateCurvesError):
        raise result
    return result


def reconstruct_many(
    points: ArrayLike,
    contours_list: Sequence[Sequence[Contour]],
    *,
    outward: ArrayLike,
    strokes_list: Sequence[Sequence[ArrayLike | Contour]] | None = None,
    radius: float | None = None,
    method: str = "bayes",
    degree: int | str = 4,
    noise: float | None = None,
    weight: float | None = None,
    solver: str = "fast",
) -> list[Reconstruction | DegenerateCurvesError]:
    """What `reconstruct` gives for each of n touches; in stacks, which makes "bayes" some times as fast.

    points : (n, 3); contours_list : n lists of contours; outward : (n, 3); strokes_list : n lists of strokes

    In the place of a touch that cannot carry the method stands its DegenerateCurvesError. Raises
    ValueError for bad arguments.
    """
    p = finite_array("points", points, (None, 3), LARGEST)
    options = _options(method, degree, noise, weight, solver, radius)
    lists = list_of("contours_list", contours_list, Sequence)  # type: ignore[type-abstract]
    beside = [()] * len(lists) if strokes_list is None else list_of("strokes_list", strokes_list, Sequence)  # type: ignore[type-abstract]
    for name, given in (("contours_list", lists), ("strokes_list", beside)):
        if len(given) != len(p):
            raise ValueError(f"{name}: wanted {len(p)} lists of {name[:-5]}, got {len(given)}")
    up = finite_array("outward", outward, (len(p), 3))
    up = np.array([unit_vector("outward", direction) for direction in up]).reshape(-1, 3)
    touches = [
        _given(list_of("contours", c, Contour), s, options) for c, s in zip(lists, beside, strict=True)
    ]
    # Touches of like size together: a stack has room for its longest contour in all places.
    sizes = [touch.size for touch in touches]
    results: dict[int, Reconstruction | DegenerateCurvesError] = {}
    # Slopes of some would cost time in the fits of all, and touches of strokes alone start otherwise.
    kinds = [(has_measured_normals(touch.contours), touch.is_of_strokes) for touch in touches]
    for kind in dict.fromkeys(kinds):
        order = [i for i in range(len(touches)) if kinds[i] == kind]
        order.sort(key=sizes.__getitem__, reverse=True)
        while order:
            count = max(1, STACK // max(sizes[order[0]], 1))
            chosen, order = order[:count], order[count:]
            found = _stack(p[chosen], [touches[i] for i in chosen], up[chosen], options)
            results.update(zip(chosen, found, strict=True))
    return [results[i] for i in range(len(p))]


class _Options(NamedTuple):
    method: str
    degree: int | None  # None for "auto"
    noise: float | None  # None for the contours' own
    weight: float
    solver: str
    radius: float | None  # of strokes alone


class _Touch(NamedTuple):
    """What a patch follows from: the curves of one touch, in the frame; all but the radius in its unit."""

    frame: Frame
    radius: float
    curves: Curves
    strokes: Array  # (m, 3)
    misses: Array  # Distances of the curves from the point, and their deviations, (c, 2).
    k1: float
    k2: float
    accuracy: float
    degree: int
    posterior: Posterior | None  # What the joint fit has found, where that makes the patch.
    residual: Residual | None  # beside it, where the contacts ask for one


def _options(
    method: str,
    degree: int | str,
    noise: float | None,
    weight: float | None,
    solver: str,
    radius: float | None,
) -> _Options:
    for name, value, choices in (("method", method, METHODS), ("solver", solver, SOLVERS)):
        if not isinstance(value, str) or value not in choices:
            raise ValueError(f"{name}: wanted one of {', '.join(choices)}, got {shown(value)}")
    if not isinstance(degree, int | np.integer | str) or degree not in ("auto", 2, 3, 4, 5, 6):
        raise ValueError(f'degree: wanted a whole number from 2 to 6 or "auto", got {shown(degree)}')
    return _Options(
        method,
        None if isinstance(degree, str) else int(degree),
        None if noise is None else number("noise", noise, least=0.0),
        WEIGHTS.get(method, 1.0) if weight is None else number("weight", weight, above=0.0),
        solver,
        None if radius is None else number("radius", radius, above=0.0),
    )


def _given(contours: list[Contour], strokes: Sequence[ArrayLike | Contour], options: _Options) -> Given:
    found = Given(contours, *gathered(strokes))
    if len(found.strokes) and options.method != "bayes":
        raise ValueError(
            f'strokes: wanted none with "{options.method}", which is a method of contours: take "bayes"'
        )
    if contours and options.radius is not None:
        raise ValueError("radius: wanted none beside contours, which say how far the patch reaches")
    return found


def _stack(
    points: Array, touches: Sequence[Given], outward: Array, options: _Options
) -> list[Reconstruction | DegenerateCurvesError]:
    """Results of touches, all of strokes alone or none, whose arguments are in order."""
    if touches[0].is_of_strokes:
        start, contours, errors = strokes_start(points, touches, outward, options.noise, options.radius)
    else:
        start, contours, errors = curves_start(points, touches, outward, options.noise)
    found = iter(() if start is None else _fitted(start, options))
    return [error or _result(next(found), c, options) for error, c in zip(errors, contours, strict=True)]


def _fitted(start: Start, options: _Options) -> list[_Touch]:
    """Touches in the Darboux frames that the method finds."""
    points, axes, k1, k2, radii, _, curves, strokes, stds = start
    contacts, present = start.contacts()
    tangents, places = curves.tangents @ axes, curves.present[0].size
    count, posteriors = len(points), None
    beside: list[Residual | None] = [None] * count
    degrees = [options.degree or 0] * count
    if options.method == "bayes" or options.degree is None:
        turns, fitted, weights = _joint(start, contacts, present)
        turned = contacts @ turns
        if options.degree is None:
            degrees = [fitted.at(i).degree_shown(turned[i][present[i]]) for i in range(count)]
        if options.method == "bayes":
            axes, contacts, tangents = axes @ turns, turned, tangents @ turns
            if start.alone:
                level = levels(contacts, weights, fitted)
                contacts[..., 2] -= level[:, None]
                points = points + (radii * level)[:, None] * axes[..., 2]
            radii, contacts, farthest = _in_unit_radius(radii, contacts, 0 if start.alone else places)
            turns, farthest, posteriors, beside = rough_fit(
                contacts,
                weights,
                fitted.scaled(1.0 / farthest),
                stds / radii,
                (start.tangents[:, None] @ axes)[:, 0],
                _normals(curves, axes, contacts),
                through=not start.alone,
            )
            if any(residual is not None for residual in beside):
                axes, contacts, tangents = axes @ turns, contacts @ turns, tangents @ turns
                radii, contacts = radii * farthest, contacts / farthest[:, None, None]
    along = curves.along / radii[:, None, None]
    curvatures = radii[:, None, None] * (curves.curvatures @ axes)
    local = contacts[:, :places].reshape(curves.points.shape)
    curves = Curves(local, curves.present, along, tangents, curvatures)
    missed = misses(curves)
    return [
        _Touch(
            Frame(points[i], axes[i]),
            float(radii[i]),
            curves.at(i),
            contacts[i, places : places + len(strokes[i])],
            missed[i],
            float(k1[i]),
            float(k2[i]),
            float(stds[i] / radii[i]),
            degrees[i],
            posteriors and posteriors.at(i),
            beside[i],
        )
        for i in range(count)
    ]


def _in_unit_radius(radii: Array, contacts: Array, places: int) -> tuple[Array, Array, Array]:
    """The farthest of the first `places` contacts, or of all, put at 1; and where it was."""
    farthest = np.hypot(contacts[..., 0], contacts[..., 1])[:, : places or None].max(axis=1)
    return radii * farthest, contacts / farthest[:, None, None], farthest


def _joint(start: Start, contacts: Array, present: NDArray[np.bool_]) -> tuple[Array, Posterior, Array]:
    """The joint fit of all the contacts of each touch."""
    normals = _normals(start.curves, start.axes, contacts)
    tangent, accuracy = (start.tangents[:, None] @ start.axes)[:, 0], start.stds / start.radii
    first, through = (start.k1, start.k2, tangent, accuracy), not start.alone
    most = present.sum(axis=1).max()
    if most == present.shape[1]:
        return joint_fit(contacts, present.astype(float), *first, normals, through)
    # Short curves beside a long one are filled up with what costs time.
    kept = np.argsort(~present, axis=1, kind="stable")[:, :most]
    rows = np.arange(len(kept))[:, None]
    few, some = contacts[rows, kept], present[rows, kept].astype(float)
    normals = None if normals is None else normals[rows, kept]
    turns, posteriors, found = joint_fit(few, some, *first, normals, through)
    weights = np.zeros(present.shape)
    weights[rows, kept] = found
    return turns, posteriors, weights


def _normals(curves: Curves, axes: Array, contacts: Array) -> Array | None:
    """The measured normals in these axes, in the shape of the contacts; of strokes there are none."""
    if curves.normals is None:
        return None
    normals = np.zeros_like(contacts)
    normals[:, : curves.present[0].size] = (curves.normals @ axes[:, None]).reshape(len(contacts), -1, 3)
    return normals


def _result(
    touch: _Touch, contours: Sequence[Contour], options: _Options
) -> Reconstruction | DegenerateCurvesError:
    try:
        domain = domain_of(touch.curves) if contours else hull_domain(touch.strokes[:, :2], 1.0)
    except ValueError:
        return DegenerateCurvesError(
            "the curves end in fewer than three places apart from each other, so they bound no patch: "
            "turn the sampling planes, or move the point away from the edge"
            if contours
            else "the point is beside the strokes or at their rim: give a place among them"
        )
    converged = True
    if touch.posterior is None:
        paper = options.method, options.weight, options.solver
        a, converged = coefficients(touch.curves, touch.k1, touch.k2, touch.degree, domain, *paper)
        patch = MongePatch(touch.k1, touch.k2, a)
    else:
        patch = touch.posterior.patch(touch.degree)
    scale = touch.radius
    surface = patch if touch.posterior is None else touch.posterior.patch(DEGREE)
    domain = Domain(domain.ends * scale)
    return Reconstruction(
        Geometry(touch.frame, scale, surface.scaled(scale), domain, touch.residual),
        patch.scaled(scale),
        tuple(contours),
        scale * touch.misses[: len(contours)],
        accuracy=touch.accuracy,
        method=options.method,
        converged=converged,
        strokes=touch.frame.to_world(scale * touch.strokes),
        joint_posterior=touch.posterior,
    )
