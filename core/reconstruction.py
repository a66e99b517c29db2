# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""From contours to a patch: the paper's sections III and IV in one call."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from . import fitting
from .arguments import Array, finite_array, number, unit_vector
from .domain import Domain, closed_spline_domain
from .local_geometry import Curve, DegenerateCurvesError, Frame, curve_through, darboux_frame
from .monge import MongePatch
from .tracking import Contour
from .verification import fit_error

METHODS = ("tagc", "quadratic-variation", "least-squares")
SOLVERS = ("fast", "descent")
DEFAULT_WEIGHT = 1000.0  # lambda L^2: the paper's 9.99/mm^2 at L = 10 mm
DOUBTFUL_MISS = 0.01  # of the radius: a patch that misses its own contacts by more is no description
DOUBTFUL_CONDITION = 1e3  # of plain least squares: noise comes out this many times larger


@dataclass(frozen=True)
class Reconstruction:
    """A patch around a reference point, lengths in the caller's unit.

    frame : the Darboux frame
    radius : L, the largest distance of a contact from the point in the tangent plane
    patch, domain : the surface (1) and the part of the tangent plane it is meant for
    contacts : (n, 3), what was fitted, in the frame
    fit_error : (6) on these contacts
    total_absolute_curvature : (8), the integral of |K| over the patch
    condition_number : of the least-squares system of the coefficients, in unit radius
    status, message : "ok", "uncertain" or "not_converged", and a sentence about it
    """

    frame: Frame
    radius: float
    patch: MongePatch
    domain: Domain
    contacts: Array
    fit_error: float
    total_absolute_curvature: float
    condition_number: float
    status: str
    message: str


def reconstruct(
    point: ArrayLike,
    contours: Sequence[Contour],
    *,
    outward: ArrayLike,
    method: str = "tagc",
    degree: int = 4,
    sensor_std: float | None = None,
    weight: float | None = None,
    solver: str = "fast",
) -> Reconstruction:
    """The surface patch around `point` from three or more contours through it.

    point : (3,), exact; outward : (3,), on the outer side of the surface
    method : "tagc" (9), "quadratic-variation" or "least-squares" (5)
    degree : d of (1), 2 to 6
    sensor_std : accuracy of a contact; misses of that size cast no doubt. None: the contours' noise
    weight : lambda L^2 of the first two methods, None for 1000
    solver : of "tagc", "fast" (L-BFGS) or "descent" (the paper's)

    Raises ValueError for bad arguments, DegenerateCurvesError for contours that cannot carry the
    method. A fit in doubt comes back with a status.
    """
    p, up = finite_array("point", point, (3,)), unit_vector("outward", outward)
    _require_choice("method", method, METHODS)
    _require_choice("solver", solver, SOLVERS)
    if not isinstance(degree, int) or degree not in range(2, 7):
        raise ValueError(f"degree: wanted a whole number from 2 to 6, got {degree!r}")
    weight = DEFAULT_WEIGHT if weight is None else number("weight", weight, above=0.0)
    if sensor_std is None:
        sensor_std = max((contour.noise or 0.0 for contour in contours), default=0.0)
    sensor_std = number("sensor_std", sensor_std, least=0.0)

    curves = [curve_through(contour, p, f"curve {i}") for i, contour in enumerate(contours, 1)]
    frame, k1, k2, radius = darboux_frame(p, curves, up)
    contacts = np.vstack([curve.points for curve in curves]) @ frame.axes / radius
    half_curves = _half_curves(curves, frame, radius)
    domain = _domain(half_curves)
    data = fitting.problem(k1 * radius, k2 * radius, degree, contacts)
    a, converged = _coefficients(data, domain, half_curves, method, weight, solver)
    patch = MongePatch(k1 * radius, k2 * radius, a)
    miss = fit_error(patch, contacts)
    status, message = _judge(method, miss, sensor_std / radius, data.condition_number, converged)
    return Reconstruction(
        frame=frame,
        radius=radius,
        patch=patch.scaled(radius),
        domain=Domain(domain.ends * radius),
        contacts=contacts * radius,
        fit_error=miss * radius,
        total_absolute_curvature=fitting.total_absolute_curvature(data, domain)(a)[0],
        condition_number=data.condition_number,
        status=status,
        message=message,
    )


def _require_choice(name: str, value: str, choices: tuple[str, ...]) -> None:
    if value not in choices:
        raise ValueError(f"{name}: wanted one of {', '.join(choices)}, got {value!r}")


def _half_curves(curves: Sequence[Curve], frame: Frame, radius: float) -> list[Array]:
    """The contacts (n_i, 3) on either side of the point, outward, local in unit radius, by azimuth."""
    halves = []
    for curve in curves:
        local, tangent = curve.points @ frame.axes / radius, curve.tangent @ frame.axes
        for half, sign in ((local[curve.along < 0.0][::-1], -1.0), (local[curve.along > 0.0], 1.0)):
            if len(half):
                halves.append((np.arctan2(sign * tangent[1], sign * tangent[0]), half))
    return [half for _, half in sorted(halves, key=lambda half: half[0])]


def _domain(half_curves: Sequence[Array]) -> Domain:
    try:
        return closed_spline_domain([half[-1, :2] for half in half_curves], 1.0)
    except ValueError:
        raise DegenerateCurvesError(
            "the curves end in fewer than three places apart from each other, so they bound no patch: "
            "turn the sampling planes, or move the point away from the edge"
        ) from None


def _coefficients(
    data: fitting.Problem,
    domain: Domain,
    half_curves: Sequence[Array],
    method: str,
    weight: float,
    solver: str,
) -> tuple[Array, bool]:
    """a of (1) by the method, and whether its solver converged."""
    if method == "least-squares":
        return fitting.least_squares(data), True
    if method == "quadratic-variation":
        return fitting.quadratic_variation(data, domain, weight), True
    start = fitting.tagc_start(data, half_curves)
    minimum = fitting.quick_minimum if solver == "fast" else fitting.descent_minimum
    return minimum(fitting.tagc_objective(data, domain, weight), start)


def _judge(method: str, miss: float, sensor_std: float, condition: float, converged: bool) -> tuple[str, str]:
    """Status and message of a fit whose numbers are in unit radius."""
    if not converged:
        return "not_converged", (
            "The minimisation stopped at its step limit, the patch is its best so far: use the fast solver, "
            "or a smaller weight."
        )
    if method == "least-squares" and condition > DOUBTFUL_CONDITION:
        return "uncertain", (
            "The contacts alone do not determine the surface between the curves "
            f"(condition number {condition:.1e}): take another method, or add sampling planes."
        )
    if miss > DOUBTFUL_MISS + sensor_std:
        return "uncertain", (
            f"The patch misses its own contacts by {100.0 * miss:.1f} % of its radius in the mean: "
            "take a shorter extent, or a higher degree."
        )
    return "ok", "The patch describes its contacts."
