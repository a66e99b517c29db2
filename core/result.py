# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A patch with its frame, and everything one may ask of it."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import fitting
from .arguments import Array
from .bayes import posterior_of
from .curves import Curves, misses
from .domain import Domain
from .local_geometry import Frame
from .monge import MongePatch, exponents, monomials
from .posterior import TERMS, Posterior, coefficients_of, terms_to
from .triangulation import patch_mesh
from .verification import fit_error, total_absolute_curvature

DOUBTFUL_STD = 0.02  # of the radius, in the mean over the domain
DOUBTFUL_CONDITION = 1e3  # of plain least squares: noise comes out this many times larger
DOUBTFUL_TURN = math.radians(10.0)  # of the frame
DOUBTFUL_CURVATURE = 0.1  # of 1 / radius; as well is it known along a curve that ends at a quarter of it
DOUBTFUL_MISS = 0.005  # of the radius, by which a curve misses the point,
SIGNIFICANT = 5.0  # standard deviations of it,
LEAST_SCATTER = 0.3  # of a contact's accuracy: few contacts may happen to scatter less
MESH_SHARE = 0.5  # of mean_height_std, that the mesh is off the patch at most


@dataclass(frozen=True)
class Reconstruction:
    """A patch around a reference point, lengths in the caller's unit.

    frame : the Darboux frame
    radius : L, the largest distance of a contact from the point in the tangent plane
    patch, domain : the surface (1) and the part of the tangent plane it is meant for
    curves : what was fitted, in the frame and in units of L
    accuracy : standard deviation of a contact, at least, in units of L
    method : of the fit
    converged : whether its solver did
    joint_posterior : what "bayes" has found

    All else follows from these, once it is asked for.
    """

    frame: Frame
    radius: float
    patch: MongePatch
    domain: Domain
    curves: Curves
    accuracy: float
    method: str
    converged: bool = True
    joint_posterior: Posterior | None = None

    @cached_property
    def contacts(self) -> Array:
        """What was fitted, (n, 3), in the frame."""
        return self.radius * self.curves.points[self.curves.present]

    @cached_property
    def posterior(self) -> Posterior:
        """What the contacts leave open, in the frame and in units of L."""
        if self.joint_posterior is not None:
            return self.joint_posterior
        contacts = self.curves.points[self.curves.present]
        return posterior_of(self.patch.k1 * self.radius, self.patch.k2 * self.radius, contacts, self.accuracy)

    def height_std(self, x: ArrayLike, y: ArrayLike) -> Array:
        """Standard deviation of the height at local (x, y), in their shape; blind directions included."""
        x_array, y_array = np.broadcast_arrays(np.asarray(x, dtype=float), np.asarray(y, dtype=float))
        u, v = x_array.ravel() / self.radius, y_array.ravel() / self.radius
        # A patch of lower degree, or by another method, departs from the posterior's mean as well.
        off = self.posterior.height(u, v) - self.patch.height(x_array, y_array).ravel() / self.radius
        return (self.radius * np.hypot(self.posterior.height_std(u, v), off)).reshape(x_array.shape)

    @cached_property
    def mean_height_std(self) -> float:
        """The mean of height_std over the domain."""
        return mean_height_stds([self])[0]

    def mesh(self) -> tuple[Array, NDArray[np.intp]]:
        """The patch as points (n, 3), in the frame, and counterclockwise triangles (m, 3).

        As fine as what is known of it: off it by half of mean_height_std at most.
        """
        return patch_mesh(self.patch, self.domain, MESH_SHARE * self.mean_height_std)

    @cached_property
    def blind(self) -> int:
        """How many of the coefficients of degree 1 to d, as directions, the contacts say nothing of."""
        return self.posterior.blind(self.patch.degree)

    @property
    def blind_share(self) -> float:
        """`blind` as a share of all the coefficients."""
        return self.blind / terms_to(self.patch.degree)

    @cached_property
    def fit_error(self) -> float:
        """(6), the mean of |dz| over the contacts."""
        return fit_error(self.patch, self.contacts)

    @cached_property
    def total_absolute_curvature(self) -> float:
        """(8), the integral of |K| over the patch."""
        return total_absolute_curvature(self.patch, self.domain)

    @cached_property
    def condition_number(self) -> float:
        """Of the least-squares system of the coefficients, in unit radius."""
        x, y, _ = self.contacts.T / self.radius
        return fitting.condition_number(monomials(x, y, exponents(3, self.patch.degree)))

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
        return self._doubt_about_frame

    @property
    def _doubt_about_frame(self) -> tuple[str, str] | None:
        distances, stds = misses(self.curves)
        stds = np.maximum(stds, LEAST_SCATTER * self.accuracy)
        apart = np.flatnonzero(distances > np.maximum(DOUBTFUL_MISS, SIGNIFICANT * stds))
        if len(apart):
            return "uncertain", (
                f"Curve {apart[0] + 1} passes the reference point at {self.radius * distances[apart[0]]:.3g}"
                ", more than its scatter explains: set the point where the curves meet."
            )
        turn = self.posterior.turn()
        if turn > DOUBTFUL_TURN:
            return "uncertain", (
                f"The principal directions may be {math.degrees(turn):.0f} degrees off: take a longer "
                "extent, or add sampling planes."
            )
        std = self.posterior.curvature_std()
        if std > DOUBTFUL_CURVATURE:
            return "uncertain", (
                f"Curvatures are good to {std / self.radius:.2g} in the direction known least: take a longer "
                "extent, or add sampling planes."
            )
        return None


def mean_height_stds(results: Sequence[Reconstruction]) -> list[float]:
    """mean_height_std of each, which keeps it: of many at once it is some times as fast as one by one."""
    nodes = [r.domain.nodes for r in results]
    most = max((len(weights) for _, weights in nodes), default=0)
    points, weights = np.zeros((len(results), most, 2)), np.zeros((len(results), most))
    for i, (r, (at, weight)) in enumerate(zip(results, nodes, strict=True)):
        points[i, : len(at)], weights[i, : len(at)] = at / r.radius, weight
    covariance = np.array([r.posterior.covariance for r in results]).reshape(-1, len(TERMS), len(TERMS))
    # A patch of lower degree than the posterior departs from its mean as well.
    off = np.array([r.posterior.mean - coefficients_of(r.patch.scaled(1.0 / r.radius)) for r in results])
    off = off.reshape(-1, len(TERMS))
    x, y = points.reshape(-1, 2).T
    basis = monomials(x, y, TERMS).reshape(len(results), most, len(TERMS))
    variance = np.einsum("bni,bni->bn", basis @ covariance, basis) + (basis @ off[..., None])[..., 0] ** 2
    means = np.einsum("bn,bn->b", weights, np.sqrt(np.maximum(variance, 0.0)))
    stds = [r.radius * float(mean) for r, mean in zip(results, means, strict=True)]
    for r, std in zip(results, stds, strict=True):
        vars(r)["mean_height_std"] = std
    return stds
