# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""From contours to a patch: the paper's sections III and IV, or the Bayesian fit, in one call."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from . import fitting, tagc
from .arguments import Array, finite_array, number, unit_vector
from .bayes import joint_fit, posterior_of
from .domain import Domain, closed_spline_domain
from .local_geometry import Curve, DegenerateCurvesError, Frame, curve_through, darboux_frame
from .monge import MongePatch
from .posterior import Posterior, terms_to
from .tracking import Contour
from .verification import fit_error

METHODS = ("bayes", "tagc", "quadratic-variation", "least-squares")
SOLVERS = ("fast", "descent")
DEFAULT_WEIGHT = 1000.0  # lambda L^2: the paper's 9.99/mm^2 at L = 10 mm
DOUBTFUL_STD = 0.02  # of the radius, in the mean over the domain
DOUBTFUL_CONDITION = 1e3  # of plain least squares: noise comes out this many times larger
DOMAIN_POINTS = 150  # of a mean over the domain


@dataclass(frozen=True)
class Reconstruction:
    """A patch around a reference point, lengths in the caller's unit.

    frame : the Darboux frame
    radius : L, the largest distance of a contact from the point in the tangent plane
    patch, domain : the surface (1) and the part of the tangent plane it is meant for
    contacts : (n, 3), what was fitted, in the frame
    posterior : what the contacts leave open, in the frame and in units of L
    method : of the fit
    converged : whether its solver did

    All else follows from these, once it is asked for.
    """

    frame: Frame
    radius: float
    patch: MongePatch
    domain: Domain
    contacts: Array
    posterior: Posterior
    method: str
    converged: bool = True

    def height_std(self, x: ArrayLike, y: ArrayLike) -> Array:
        """Standard deviation of the height at local (x, y), in their shape; blind directions included."""
        x_array, y_array = np.broadcast_arrays(np.asarray(x, dtype=float), np.asarray(y, dtype=float))
        u, v = x_array.ravel() / self.radius, y_array.ravel() / self.radius
        # A patch of lower degree than the posterior departs from its mean as well.
        off = self.posterior.height(u, v) - self.patch.height(x_array, y_array).ravel() / self.radius
        return (self.radius * np.hypot(self.posterior.height_std(u, v), off)).reshape(x_array.shape)

    @cached_property
    def mean_height_std(self) -> float:
        """The mean of height_std over the domain."""
        points, _ = self.domain.grid(DOMAIN_POINTS)
        return float(np.mean(self.height_std(*points.T)))

    @cached_property
    def blind(self) -> int:
        """How many of the coefficients of degree 1 to d, as directions, the contacts say nothing of."""
        return self.posterior.blind(self.patch.degree)

    @cached_property
    def fit_error(self) -> float:
        """(6), the mean of |dz| over the contacts."""
        return fit_error(self.patch, self.contacts)

    @cached_property
    def total_absolute_curvature(self) -> float:
        """(8), the integral of |K| over the patch."""
        points, h = self.domain.grid(fitting.GRID)
        d = self.patch.derivatives(*points.T)
        w = 1.0 + d.x**2 + d.y**2
        return h**2 * float(np.sum(np.abs(d.xx * d.yy - d.xy**2) * w**-1.5))

    @cached_property
    def condition_number(self) -> float:
        """Of the least-squares system of the coefficients, in unit radius."""
        return self._problem.condition_number

    @cached_property
    def _problem(self) -> fitting.Problem:
        unit = self.patch.scaled(1.0 / self.radius)
        return fitting.problem(unit.k1, unit.k2, unit.degree, self.contacts / self.radius)

    @property
    def status(self) -> str:
        """ "ok", "uncertain" or "not_converged"."""
        return self._judgement[0]

    @property
    def message(self) -> str:
        """The status in a sentence, with advice; and the blind directions."""
        return self._judgement[1]

    @cached_property
    def _judgement(self) -> tuple[str, str]:
        status, message = self._doubt or ("ok", "The patch describes its contacts.")
        if self.blind:
            verb = "is" if self.blind == 1 else "are"
            terms = terms_to(self.patch.degree)
            message += f" {self.blind} of {terms} coefficients {verb} invisible to these planes."
        return status, message

    @property
    def _doubt(self) -> tuple[str, str] | None:
        if not self.converged:
            return "not_converged", (
                "The minimisation stopped at its step limit, the patch is its best so far: use the fast "
                "solver, or a smaller weight."
            )
        if self.method == "least-squares" and self.condition_number > DOUBTFUL_CONDITION:
            return "uncertain", (
                "The contacts alone do not determine the surface between the curves (condition number "
                f"{self.condition_number:.1e}): take another method, or add sampling planes."
            )
        share = self.mean_height_std / self.radius
        if share > DOUBTFUL_STD:
            return "uncertain", (
                f"Heights are good to {100.0 * share:.1f} % of the radius in the mean: take a shorter "
                "extent, or add sampling planes."
            )
        return None


def reconstruct(
    point: ArrayLike,
    contours: Sequence[Contour],
    *,
    outward: ArrayLike,
    method: str = "bayes",
    degree: int | str = 4,
    sensor_std: float | None = None,
    weight: float | None = None,
    solver: str = "fast",
) -> Reconstruction:
    """The surface patch around `point` from three or more contours through it.

    point : (3,), exact; outward : (3,), on the outer side of the surface
    method : "bayes" (bayes.py), or one of the paper's: "tagc" (9), "quadratic-variation",
        "least-squares" (5)
    degree : d of (1), 2 to 6, or "auto", the least that says what the contacts show
    sensor_std : accuracy of a contact; noise is taken for no less. None: the contours' own
    weight : lambda L^2 of "tagc" and "quadratic-variation", None for 1000
    solver : of "tagc", "fast" (Newton, from the quadric) or "descent" (the paper's, from its start)

    Raises ValueError for bad arguments, DegenerateCurvesError for contours that cannot carry the
    method. A fit in doubt comes back with a status.
    """
    p, up = finite_array("point", point, (3,)), unit_vector("outward", outward)
    _require_choice("method", method, METHODS)
    _require_choice("solver", solver, SOLVERS)
    _require_degree(degree)
    weight = DEFAULT_WEIGHT if weight is None else number("weight", weight, above=0.0)
    sensor_std = _sensor_std(contours) if sensor_std is None else number("sensor_std", sensor_std, least=0.0)

    curves = [curve_through(contour, p, f"curve {i}") for i, contour in enumerate(contours, 1)]
    frame, k1, k2, radius = darboux_frame(p, curves, up)
    contacts = np.vstack([curve.points for curve in curves]) @ frame.axes / radius
    accuracy, converged = sensor_std / radius, True
    if method == "bayes" or degree == "auto":
        tangent = curves[0].tangent @ frame.axes
        turn, posterior = joint_fit(contacts, k1 * radius, k2 * radius, tangent, accuracy)
        if degree == "auto":
            degree = posterior.degree_shown(contacts @ turn)
    d = int(degree)
    if method == "bayes":
        frame, contacts = Frame(p, frame.axes @ turn), contacts @ turn
        farthest = float(np.hypot(contacts[:, 0], contacts[:, 1]).max())
        radius, contacts, posterior = radius * farthest, contacts / farthest, posterior.scaled(1.0 / farthest)
    domain = _domain(curves, frame, radius)
    if method == "bayes":
        patch = posterior.patch(d)
    else:
        data = fitting.problem(k1 * radius, k2 * radius, d, contacts)
        half_curves = _half_curves(curves, frame, radius)
        a, converged = _coefficients(data, domain, half_curves, method, weight, solver)
        patch = MongePatch(k1 * radius, k2 * radius, a)
        posterior = posterior_of(patch, contacts, accuracy)
    return Reconstruction(
        frame=frame,
        radius=radius,
        patch=patch.scaled(radius),
        domain=Domain(domain.ends * radius),
        contacts=contacts * radius,
        posterior=posterior,
        method=method,
        converged=converged,
    )


def _require_choice(name: str, value: str, choices: tuple[str, ...]) -> None:
    if value not in choices:
        raise ValueError(f"{name}: wanted one of {', '.join(choices)}, got {value!r}")


def _require_degree(degree: int | str) -> None:
    if degree != "auto" and (not isinstance(degree, int) or degree not in range(2, 7)):
        raise ValueError(f'degree: wanted a whole number from 2 to 6 or "auto", got {degree!r}')


def _sensor_std(contours: Sequence[Contour]) -> float:
    return max((contour.noise or 0.0 for contour in contours), default=0.0)


def _half_curves(curves: Sequence[Curve], frame: Frame, radius: float) -> list[Array]:
    """The contacts (n_i, 3) on either side of the point, outward, local in unit radius, by azimuth."""
    halves = []
    for curve in curves:
        local, tangent = curve.points @ frame.axes / radius, curve.tangent @ frame.axes
        for half, sign in ((local[curve.along < 0.0][::-1], -1.0), (local[curve.along > 0.0], 1.0)):
            if len(half):
                halves.append((np.arctan2(sign * tangent[1], sign * tangent[0]), half))
    return [half for _, half in sorted(halves, key=lambda half: half[0])]


def _domain(curves: Sequence[Curve], frame: Frame, radius: float) -> Domain:
    """Through the curves' ends on either side of the point, in unit radius."""
    sides = ((0, -1.0), (-1, 1.0))
    ends = [curve.points[i] for curve in curves for i, sign in sides if sign * curve.along[i] > 0.0]
    try:
        return closed_spline_domain((np.array(ends) @ frame.axes)[:, :2] / radius, 1.0)
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
    objective = tagc.Objective(data, domain, weight)
    if solver == "descent":
        return tagc.descent_minimum(objective, fitting.tagc_start(data, half_curves))
    # On convex surfaces (9) has many minima: from the quadric they are lower than from the paper's start.
    return tagc.newton_minimum(objective, np.zeros(data.basis.shape[1]))
