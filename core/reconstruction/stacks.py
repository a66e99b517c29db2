# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Touches that are fitted together, in stacks: the paper's sections III and IV, or the Bayesian fit."""

from collections.abc import Sequence
from itertools import count
from typing import Any, NamedTuple

import numpy as np

from ..arguments import Array
from ..bayes.joint_fit import MISFIT, Observations, joint_fit
from ..bayes.posterior import SurfacePosterior
from ..bayes.process_fit import process_fit
from ..bayes.sextic import offset_share
from ..contours.contour import Contour
from ..contours.curves import Curves
from ..contours.local_geometry import DegenerateCurvesError, Frame
from ..paper.by_method import coefficients
from ..patch.domain import Domain, hull_domain
from ..patch.geometry import Geometry
from ..patch.monge import TERMS, HeightField, MongePatch, monomials
from .options import FitOptions
from .result import Reconstruction
from .start import Start, TouchContacts, away_from, curves_start, domain_of, strokes_start


class _Fit(NamedTuple):
    """b touches in the frames that the method finds, with contacts in unit radius."""

    points: Array  # (b, 3), in the world
    axes: Array  # (b, 3, 3)
    radii: Array  # (b,)
    contacts: Array  # (b, n, 3)
    degrees: list[int]
    posteriors: list[SurfacePosterior] | None  # None if the method is the paper's.


def fitted_stack(
    points: Array, touches: Sequence[TouchContacts], outward: Array, options: FitOptions
) -> list[Reconstruction | DegenerateCurvesError]:
    """The results of touches whose arguments are checked; either all of them have contours or none has."""
    if touches[0].strokes_only:
        start, contours, errors = strokes_start(points, touches, outward, options.noise, options.radius)
    else:
        start, contours, errors = curves_start(points, touches, outward, options)
    if start is None:
        return [error for error in errors if error is not None]
    fit, row = _fit(start, options), count()
    return [
        error or _result(start, fit, next(row), some, up, options)
        for error, some, up in zip(errors, contours, outward, strict=True)
    ]


def _fit(start: Start, options: FitOptions) -> _Fit:
    """The touches in the frames of the paper, or in those of the joint fit."""
    contacts, present = start.contacts()
    degrees = [0 if isinstance(options.degree, str) else options.degree] * len(start.points)
    plain = _Fit(start.points, start.axes, start.radii, contacts, degrees, None)
    if options.method != "bayes" and options.degree != "auto":
        return plain
    given = _observations(start, start.axes, start.radii, contacts)
    weights = present.astype(float)
    kept: tuple[Any, Any] = slice(None), slice(None)
    if not present.all():
        # Short curves are filled up to the length of the longest, and fitting that too would take time.
        first = np.argsort(~present, axis=1, kind="stable")[:, : present.sum(axis=1).max()]
        kept = np.arange(len(weights))[:, None], first
    normals = given.normals[kept] if given.normals.size else given.normals
    given = given._replace(contacts=contacts[kept], normals=normals)
    turns, posteriors, weights[kept] = joint_fit(given, weights[kept], *start.kappas.T)
    local = contacts @ turns
    basis = monomials(local, TERMS)
    if options.degree == "auto":
        degrees = [posteriors.at(i).degree_shown(basis[i, present[i]]) for i in range(len(degrees))]
    if options.method != "bayes":
        return plain._replace(degrees=degrees)
    joint = plain._replace(axes=start.axes @ turns, contacts=local, degrees=degrees)
    residuals = local[..., 2] - (basis @ posteriors.mean[..., None])[..., 0]
    return _with_processes(start, joint, posteriors, weights, residuals)


def _with_processes(
    start: Start, fit: _Fit, posteriors: SurfacePosterior, weights: Array, residuals: Array
) -> _Fit:
    """The joint fit in unit radius; where evidence favors a process, with it and in its frame.

    The contacts of `fit` are moved with its point.

    weights, residuals : (b, n), of the contacts
    """
    points, axes, radii, contacts = fit[:4]
    given = _observations(start, axes, radii, contacts)
    offset = (weights * residuals).sum(axis=1) / weights.sum(axis=1)
    offset *= offset_share(weights, given.point_std / np.maximum(given.noise, MISFIT))
    contacts[..., 2] -= offset[:, None]
    points = points + (radii * offset)[:, None] * axes[..., 2]
    # The radius is the distance of the farthest contact of curves, or of strokes where there are no curves.
    places = contacts.shape[1] if start.strokes_only else start.curves.present[0].size
    farthest = np.hypot(contacts[..., 0], contacts[..., 1])[:, :places].max(axis=1)
    contacts, offset = contacts / farthest[:, None, None], offset / farthest
    stds = {"noise": given.noise / farthest, "point_std": given.point_std / farthest}
    given = given._replace(contacts=contacts, **stds)
    residuals, posteriors = residuals / farthest[:, None] - offset[:, None], posteriors.scaled(1.0 / farthest)
    turns, scales, fitted = process_fit(given, weights, posteriors, residuals, start.ranks, -offset)
    contacts = contacts @ turns / scales[:, None, None]
    return _Fit(points, axes @ turns, radii * farthest * scales, contacts, fit.degrees, fitted)


def _observations(start: Start, axes: Array, radii: Array, contacts: Array) -> Observations:
    """What the touches have felt, in these axes and units, with their contacts (b, n, 3) there."""
    normals = contacts[:, :0]
    if start.curves.normals is not None:  # Strokes have none.
        normals = np.zeros_like(contacts)
        of_curves = (start.curves.normals @ axes[:, None]).reshape(len(contacts), -1, 3)
        normals[:, : of_curves.shape[1]] = of_curves
    tangent = (start.tangents[:, None] @ axes)[:, 0]
    stds, point_stds = start.stds / radii, np.minimum(start.point_stds / radii, 1.0)
    return Observations(contacts, normals, tangent, stds, start.stds_are_known, point_stds)


def _result(
    start: Start, fit: _Fit, i: int, contours: Sequence[Contour], outward: Array, options: FitOptions
) -> Reconstruction | DegenerateCurvesError:
    """What touch i of the stack has found."""
    if fit.axes[i, :, 2] @ outward <= 0.0:
        return away_from(fit.points[i], contours) or DegenerateCurvesError(
            "the contacts show a surface that faces away from the outward direction: give the direction to "
            "its outer side at the point, or move the point away from the edge"
        )
    curves, frame, scale = _curves(start, fit, i), Frame(fit.points[i], fit.axes[i]), float(fit.radii[i])
    places = curves.present.size
    strokes = fit.contacts[i, places : places + len(start.strokes[i])]
    domain = _domain(curves, strokes, contours)
    if isinstance(domain, DegenerateCurvesError):
        return domain
    surface, patch, converged = _surface(start, fit, i, curves, domain, options)
    point_std = min(float(start.point_stds[i] / fit.radii[i]), 1.0)
    return Reconstruction(
        Geometry(frame, scale, surface, domain.scaled(scale)),
        patch,
        tuple(contours),
        noise=float(start.stds[i] / fit.radii[i]),
        point_std=point_std,
        method=options.method,
        converged=converged,
        strokes=frame.to_world(scale * strokes),
        point=start.points[i],
        known_curves=start.curves.at([i]) if point_std < 1.0 else None,
    )


def _surface(
    start: Start, fit: _Fit, i: int, curves: Curves, domain: Domain, options: FitOptions
) -> tuple[HeightField, MongePatch, bool]:
    """The surface of touch i in unit radius, its patch in the caller's unit, and if the fit converged."""
    scale = float(fit.radii[i])
    if fit.posteriors is not None:
        return fit.posteriors[i], fit.posteriors[i].patch(fit.degrees[i]).scaled(scale), True
    k1, k2 = start.kappas[i].tolist()
    paper = options.method, options.weight, options.solver
    a, converged = coefficients(curves, k1, k2, fit.degrees[i], domain, *paper)
    patch = MongePatch(k1, k2, a).scaled(scale)
    return patch.scaled(1.0 / scale), patch, converged


def _curves(start: Start, fit: _Fit, i: int) -> Curves:
    """The curves of touch i without normals, in its frame and in unit radius."""
    curves, axes, radius = start.curves.at(i), fit.axes[i], fit.radii[i]
    return curves._replace(
        points=fit.contacts[i, : curves.present.size].reshape(curves.points.shape),
        along=curves.along / radius,
        tangents=curves.tangents @ axes,
        curvatures=radius * (curves.curvatures @ axes),
        normals=None,
    )


def _domain(curves: Curves, strokes: Array, contours: Sequence[Contour]) -> Domain | DegenerateCurvesError:
    """The domain of the contours, or of strokes where there are none, in unit radius; or why it fails."""
    try:
        return domain_of(curves, contours) if contours else hull_domain(strokes[:, :2], 1.0)
    except ValueError:
        return DegenerateCurvesError(
            "the curves end in fewer than three separate places, so they bound no patch: "
            "turn the sampling planes, or move the point away from the edge"
            if contours
            else "the point is outside the strokes or at their rim: give a point among them"
        )
