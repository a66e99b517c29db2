# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""From contours to a patch: the paper's sections III and IV, or the Bayesian fit, in one call."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

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
from ..contours.curves import (
    Curves,
    curves_through,
    has_measured_normals,
    misses,
    stacked,
)
from ..contours.local_geometry import (
    DegenerateCurvesError,
    Frame,
    darboux_frames,
    degeneracy,
    surface_normals,
)
from ..contours.thinning import thinned
from ..paper.by_method import PAPER_METHODS, SOLVERS, coefficients
from ..patch.domain import Domain, closed_spline_domain
from ..patch.geometry import Geometry
from ..patch.monge import DEGREE, MongePatch
from ..patch.residual import Residual
from .result import Reconstruction

METHODS = ("bayes", *PAPER_METHODS)
# lambda L^2: of TAGC the paper's 9.99/mm^2 at L = 10 mm; quadratic variation in the paper is subject to
# f = 0, which 1e5 comes near.
WEIGHTS = {"tagc": 1e3, "quadratic-variation": 1e5}
COARSE = 1e-3  # Share of a touch that rounding may take, far from the origin; MISFIT has room for it.
STACK = 4000  # contacts that are fitted at once; more do not fit into a processor's cache


def reconstruct(
    point: ArrayLike,
    contours: Sequence[Contour],
    *,
    outward: ArrayLike,
    method: str = "bayes",
    degree: int | str = 4,
    noise: float | None = None,
    weight: float | None = None,
    solver: str = "fast",
) -> Reconstruction:
    """The surface patch around `point` from three or more contours through it.

    point : (3,), exact; outward : (3,), on the outer side of the surface
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
    options = _options(method, degree, noise, weight, solver)
    (result,) = _stack(p[None], [list_of("contours", contours, Contour)], up[None], options)
    if isinstance(result, DegenerateCurvesError):
        raise result
    return result


def reconstruct_many(
    points: ArrayLike,
    contours_list: Sequence[Sequence[Contour]],
    *,
    outward: ArrayLike,
    method: str = "bayes",
    degree: int | str = 4,
    noise: float | None = None,
    weight: float | None = None,
    solver: str = "fast",
) -> list[Reconstruction | DegenerateCurvesError]:
    """What `reconstruct` gives for each of n touches; in stacks, which makes "bayes" some times as fast.

    points : (n, 3); contours_list : n lists of contours; outward : (n, 3)

    In the place of a touch that cannot carry the method stands its DegenerateCurvesError. Raises
    ValueError for bad arguments.
    """
    p = finite_array("points", points, (None, 3), LARGEST)
    touches = [
        list_of("contours", c, Contour)
        for c in list_of("contours_list", contours_list, Sequence)  # type: ignore[type-abstract]
    ]
    if len(touches) != len(p):
        raise ValueError(f"contours_list: wanted {len(p)} lists of contours, got {len(touches)}")
    up = finite_array("outward", outward, (len(p), 3))
    up = np.array([unit_vector("outward", direction) for direction in up]).reshape(-1, 3)
    options = _options(method, degree, noise, weight, solver)
    # Touches of like size together: a stack has room for its longest contour in all places.
    sizes = [len(c) * max((len(contour.points) for contour in c), default=0) for c in touches]
    results: dict[int, Reconstruction | DegenerateCurvesError] = {}
    for measured in (False, True):  # slopes of some would cost time in the fits of all
        order = [i for i, contours in enumerate(touches) if has_measured_normals(contours) is measured]
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


class _Touch(NamedTuple):
    """What a patch follows from: the curves of one touch, in the frame; all but the radius in its unit."""

    frame: Frame
    radius: float
    curves: Curves
    misses: Array  # Distances of the curves from the point, and their deviations, (c, 2).
    k1: float
    k2: float
    accuracy: float
    degree: int
    posterior: Posterior | None  # What the joint fit has found, where that makes the patch.
    residual: Residual | None  # beside it, where the contacts ask for one


def _options(
    method: str, degree: int | str, noise: float | None, weight: float | None, solver: str
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
    )


def _stack(
    points: Array, touches: Sequence[Sequence[Contour]], outward: Array, options: _Options
) -> list[Reconstruction | DegenerateCurvesError]:
    """Results of touches, whose arguments are in order."""
    thin = [[thinned(contour, point) for contour in c] for point, c in zip(points, touches, strict=True)]
    touches = [[contour for contour, _ in c] for c in thin]
    sizes = np.array([min((size for _, size in c), default=1) for c in thin])
    curves = curves_through(*stacked(points, touches))
    normals = surface_normals(curves.tangents, outward)
    each = zip(touches, curves.present, curves.tangents, normals, strict=True)
    apart, reach = np.spacing(np.abs(points)).max(axis=1), np.abs(curves.points).max(axis=(1, 2, 3))
    errors = [
        degeneracy(*touch) or (_coarse(gap, size) if gap > COARSE * size else None)
        for touch, gap, size in zip(each, apart, reach, strict=True)
    ]
    good = [i for i, error in enumerate(errors) if error is None]
    std = options.noise
    stds = [
        max(c.noise or 0.0 for c in touches[i]) if std is None else std / math.sqrt(sizes[i]) for i in good
    ]
    found = iter(
        _framed(points[good], curves.at(good), normals[good], np.array(stds), options) if good else ()
    )
    return [
        error or _result(next(found), contours, options)
        for error, contours in zip(errors, touches, strict=True)
    ]


def _coarse(gap: float, size: float) -> DegenerateCurvesError:
    return DegenerateCurvesError(
        f"the coordinates at the point are {gap:.2g} apart in double precision, too coarse for curves of "
        f"{size:.2g}: move the origin nearer to the point"
    )


def _framed(points: Array, curves: Curves, normals: Array, stds: Array, options: _Options) -> list[_Touch]:
    """Touches in the Darboux frames that the method finds."""
    axes, k1, k2, radii = darboux_frames(curves, normals)
    local, tangents = curves.points @ axes[:, None] / radii[:, None, None, None], curves.tangents @ axes
    count, posteriors = len(points), None
    beside: list[Residual | None] = [None] * count
    degrees = [options.degree or 0] * count
    if options.method == "bayes" or options.degree is None:
        turns, fitted, weights = _joint(curves, local, axes, k1, k2, tangents[:, 0], stds / radii)
        if options.degree is None:
            turned = local @ turns[:, None]
            degrees = [fitted.at(i).degree_shown(turned[i][curves.present[i]]) for i in range(count)]
        if options.method == "bayes":
            axes, local, tangents = axes @ turns, local @ turns[:, None], tangents @ turns
            farthest = np.hypot(local[..., 0], local[..., 1]).max(axis=(1, 2))
            radii, local = radii * farthest, local / farthest[:, None, None, None]
            contacts = local.reshape(count, -1, 3)
            turns, farthest, posteriors, beside = rough_fit(
                contacts,
                weights,
                fitted.scaled(1.0 / farthest),
                stds / radii,
                tangents[:, 0],
                _normals(curves, axes, contacts),
            )
            if any(residual is not None for residual in beside):
                axes, local, tangents = axes @ turns, local @ turns[:, None], tangents @ turns
                radii, local = radii * farthest, local / farthest[:, None, None, None]
    along = curves.along / radii[:, None, None]
    curvatures = radii[:, None, None] * (curves.curvatures @ axes)
    curves = Curves(local, curves.present, along, tangents, curvatures)
    missed = misses(curves)
    return [
        _Touch(
            Frame(points[i], axes[i]),
            float(radii[i]),
            curves.at(i),
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


def _joint(
    curves: Curves, local: Array, axes: Array, k1: Array, k2: Array, tangent: Array, accuracy: Array
) -> tuple[Array, Posterior, Array]:
    """The joint fit of all the contacts of each touch."""
    contacts, present = local.reshape(len(local), -1, 3), curves.present.reshape(len(local), -1)
    normals = _normals(curves, axes, contacts)
    most = present.sum(axis=1).max()
    if most == present.shape[1]:
        return joint_fit(contacts, present.astype(float), k1, k2, tangent, accuracy, normals)
    # Short curves beside a long one are filled up with what costs time.
    kept = np.argsort(~present, axis=1, kind="stable")[:, :most]
    rows = np.arange(len(kept))[:, None]
    few, some = contacts[rows, kept], present[rows, kept].astype(float)
    normals = None if normals is None else normals[rows, kept]
    turns, posteriors, found = joint_fit(few, some, k1, k2, tangent, accuracy, normals)
    weights = np.zeros(present.shape)
    weights[rows, kept] = found
    return turns, posteriors, weights


def _normals(curves: Curves, axes: Array, contacts: Array) -> Array | None:
    """The measured normals in these axes, in the shape of the contacts."""
    return None if curves.normals is None else (curves.normals @ axes[:, None]).reshape(contacts.shape)


def _result(
    touch: _Touch, contours: Sequence[Contour], options: _Options
) -> Reconstruction | DegenerateCurvesError:
    try:
        domain = _domain(touch.curves)
    except ValueError:
        return DegenerateCurvesError(
            "the curves end in fewer than three places apart from each other, so they bound no patch: "
            "turn the sampling planes, or move the point away from the edge"
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
        joint_posterior=touch.posterior,
    )


def _domain(curves: Curves) -> Domain:
    """Through the curves' ends on either side of the point. Raises ValueError where they bound nothing."""
    last = np.maximum(np.count_nonzero(curves.present, axis=1) - 1, 0)
    rows = np.arange(len(last))
    before, after = curves.present[:, 0] & (curves.along[:, 0] < 0.0), curves.along[rows, last] > 0.0
    ends = np.vstack([curves.points[before, 0], curves.points[rows, last][after & curves.present[:, 0]]])
    return closed_spline_domain(ends[:, :2], 1.0)
