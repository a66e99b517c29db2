# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Touches that are fitted together, in stacks: the paper's sections III and IV, or the Bayesian fit."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..arguments import Array
from ..bayes.joint_fit import joint_fit
from ..bayes.posterior import Posterior
from ..bayes.rough_fit import rough_fit
from ..contours.contour import Contour
from ..contours.curves import Curves
from ..contours.local_geometry import DegenerateCurvesError, Frame
from ..paper.by_method import coefficients
from ..patch.domain import Domain, hull_domain
from ..patch.geometry import Geometry
from ..patch.monge import DEGREE, MongePatch
from ..patch.residual import Residual
from .result import Reconstruction
from .start import Given, Start, away_from, curves_start, domain_of, levels, strokes_start


class Options(NamedTuple):
    """The options of a fit, checked."""

    method: str
    degree: int | None  # None for "auto"
    noise: float | None  # None for the contours' own
    weight: float
    solver: str
    radius: float | None  # of strokes alone


class _Parts(NamedTuple):
    """What the patch of one touch follows from, in the frame; all but the radius in units of it."""

    frame: Frame
    radius: float
    curves: Curves
    strokes: Array  # (m, 3)
    known: Curves  # The same as a stack of one, in the world.
    k1: float
    k2: float
    noise: float
    degree: int
    posterior: Posterior | None  # What the joint fit has found, if that makes the patch.
    residual: Residual | None  # What the surface is beside it, if the contacts ask for that.


class _Fit(NamedTuple):
    """b touches in the frames that the method finds, with contacts in unit radius."""

    points: Array  # (b, 3), in the world
    axes: Array  # (b, 3, 3)
    radii: Array  # (b,)
    contacts: Array  # (b, n, 3)
    tangents: Array  # (b, c, 3), of the curves
    degrees: list[int]
    posteriors: Posterior | None
    beside: list[Residual | None]


def fitted_stack(
    points: Array, touches: Sequence[Given], outward: Array, options: Options
) -> list[Reconstruction | DegenerateCurvesError]:
    """The results of touches whose arguments are checked, and which are all of strokes alone or none is."""
    if touches[0].is_of_strokes:
        start, contours, errors = strokes_start(points, touches, outward, options.noise, options.radius)
    else:
        start, contours, errors = curves_start(points, touches, outward, options.noise)
    found = iter(() if start is None else _fitted(start, options))
    each = zip(errors, contours, outward, strict=True)
    return [error or _result(next(found), c, up, options) for error, c, up in each]


def _fitted(start: Start, options: Options) -> list[_Parts]:
    """The touches in the Darboux frames that the method finds."""
    fit, curves, places = _fit(start, options), start.curves, start.curves.present[0].size
    along = curves.along / fit.radii[:, None, None]
    curvatures = fit.radii[:, None, None] * (curves.curvatures @ fit.axes)
    local = fit.contacts[:, :places].reshape(curves.points.shape)
    curves = Curves(local, curves.present, along, fit.tangents, curvatures)
    return [
        _Parts(
            Frame(fit.points[i], fit.axes[i]),
            float(fit.radii[i]),
            curves.at(i),
            fit.contacts[i, places : places + len(start.strokes[i])],
            start.curves.at([i]),
            float(start.k1[i]),
            float(start.k2[i]),
            float(start.stds[i] / fit.radii[i]),
            fit.degrees[i],
            fit.posteriors and fit.posteriors.at(i),
            fit.beside[i],
        )
        for i in range(len(fit.points))
    ]


def _fit(start: Start, options: Options) -> _Fit:
    """The touches in the frames of the paper, or in those of the joint fit."""
    contacts, present = start.contacts()
    tangents, count = start.curves.tangents @ start.axes, len(start.points)
    degrees = [options.degree or 0] * count
    plain = _Fit(start.points, start.axes, start.radii, contacts, tangents, degrees, None, [None] * count)
    if options.method != "bayes" and options.degree is not None:
        return plain
    turns, posteriors, weights = _joint(start, contacts, present)
    turned = contacts @ turns
    if options.degree is None:
        degrees = [posteriors.at(i).degree_shown(turned[i][present[i]]) for i in range(count)]
    if options.method != "bayes":
        return plain._replace(degrees=degrees)
    joint = plain._replace(
        axes=start.axes @ turns, contacts=turned, tangents=tangents @ turns, degrees=degrees
    )
    return _with_residuals(start, joint, posteriors, weights)


def _with_residuals(start: Start, fit: _Fit, posteriors: Posterior, weights: Array) -> _Fit:
    """The joint fit in unit radius; where contacts ask for a residual, with it and in its frame."""
    points, axes, radii, contacts, tangents = fit[:5]
    if start.alone:
        level = levels(contacts, weights, posteriors)
        contacts[..., 2] -= level[:, None]
        points = points + (radii * level)[:, None] * axes[..., 2]
    places = 0 if start.alone else start.curves.present[0].size
    radii, contacts, farthest = _in_unit_radius(radii, contacts, places)
    turns, farthest, posteriors, beside = rough_fit(
        contacts,
        weights,
        posteriors.scaled(1.0 / farthest),
        start.stds / radii,
        start.told,
        (start.tangents[:, None] @ axes)[:, 0],
        start.ranks(),
        _normals(start.curves, axes, contacts),
        through=not start.alone,
    )
    if any(residual is not None for residual in beside):
        axes, contacts, tangents = axes @ turns, contacts @ turns, tangents @ turns
        radii, contacts = radii * farthest, contacts / farthest[:, None, None]
    return _Fit(points, axes, radii, contacts, tangents, fit.degrees, posteriors, beside)


def _in_unit_radius(radii: Array, contacts: Array, places: int) -> tuple[Array, Array, Array]:
    """Radii and contacts, such that the farthest of the first `places`, or of all, is at 1; the factors."""
    farthest = np.hypot(contacts[..., 0], contacts[..., 1])[:, : places or None].max(axis=1)
    return radii * farthest, contacts / farthest[:, None, None], farthest


def _joint(start: Start, contacts: Array, present: NDArray[np.bool_]) -> tuple[Array, Posterior, Array]:
    """The joint fit of all contacts of each touch: turns, posteriors, weights."""
    normals = _normals(start.curves, start.axes, contacts)
    tangent, noise = (start.tangents[:, None] @ start.axes)[:, 0], start.stds / start.radii
    first, through = (start.k1, start.k2, tangent, noise), not start.alone
    most = present.sum(axis=1).max()
    if most == present.shape[1]:
        return joint_fit(contacts, present.astype(float), *first, normals, through)
    # Short curves are filled up to the length of the longest, and fitting that too would take time.
    kept = np.argsort(~present, axis=1, kind="stable")[:, :most]
    rows = np.arange(len(kept))[:, None]
    few, some = contacts[rows, kept], present[rows, kept].astype(float)
    normals = None if normals is None else normals[rows, kept]
    turns, posteriors, found = joint_fit(few, some, *first, normals, through)
    weights = np.zeros(present.shape)
    weights[rows, kept] = found
    return turns, posteriors, weights


def _normals(curves: Curves, axes: Array, contacts: Array) -> Array | None:
    """The measured normals in these axes, in the shape of the contacts, 0 for strokes; or None."""
    if curves.normals is None:
        return None
    normals = np.zeros_like(contacts)
    normals[:, : curves.present[0].size] = (curves.normals @ axes[:, None]).reshape(len(contacts), -1, 3)
    return normals


def _result(
    touch: _Parts, contours: Sequence[Contour], outward: Array, options: Options
) -> Reconstruction | DegenerateCurvesError:
    if touch.frame.axes[:, 2] @ outward <= 0.0:
        return away_from(touch.frame.origin, contours) or DegenerateCurvesError(
            "the contacts show a surface that faces away from the outward direction: give the direction to "
            "its outer side at the point, or move the point away from the edge"
        )
    domain = _domain(touch, contours)
    if isinstance(domain, DegenerateCurvesError):
        return domain
    converged = True
    if touch.posterior is None:
        paper = options.method, options.weight, options.solver
        a, converged = coefficients(touch.curves, touch.k1, touch.k2, touch.degree, domain, *paper)
        patch = MongePatch(touch.k1, touch.k2, a)
    else:
        patch = touch.posterior.patch(touch.degree)
    scale = touch.radius
    surface = patch if touch.posterior is None else touch.posterior.patch(DEGREE)
    domain = domain.scaled(scale)
    return Reconstruction(
        Geometry(touch.frame, scale, surface.scaled(scale), domain, touch.residual),
        patch.scaled(scale),
        tuple(contours),
        noise=touch.noise,
        method=options.method,
        converged=converged,
        strokes=touch.frame.to_world(scale * touch.strokes),
        joint_posterior=touch.posterior,
        known_curves=touch.known,
    )


def _domain(touch: _Parts, contours: Sequence[Contour]) -> Domain | DegenerateCurvesError:
    """The domain of the contours, or of strokes alone, in unit radius; or why there is none."""
    try:
        return domain_of(touch.curves, contours) if contours else hull_domain(touch.strokes[:, :2], 1.0)
    except ValueError:
        return DegenerateCurvesError(
            "the curves end in fewer than three separate places, so they bound no patch: "
            "turn the sampling planes, or move the point away from the edge"
            if contours
            else "the point is outside the strokes or at their rim: give a point among them"
        )
