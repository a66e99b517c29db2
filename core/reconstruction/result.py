# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A patch with its frame, and everything one may ask of it."""

import math
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..arguments import Array
from ..bayes.joint_fit import posterior_of
from ..bayes.posterior import FREE, Posterior, terms_to
from ..contours.contour import Contour
from ..contours.curves import besides_point
from ..contours.local_geometry import Frame
from ..paper import least_squares
from ..patch.domain import Domain
from ..patch.geometry import Geometry, fit_error, similarity, total_absolute_curvature
from ..patch.monge import MongePatch, exponents, monomials
from ..patch.residual import Residual

DOUBTFUL_STD = 0.02  # Share of the radius that the height may deviate in the mean over the domain.
DOUBTFUL_CONDITION = 1e3  # Plain least squares makes noise this many times larger.
DOUBTFUL_TURN = math.radians(10.0)  # Angle that the frame may be off.
LIKELY = 0.5  # that it is off by less, of a rough surface: its directions are others at each scale
DOUBTFUL_CURVATURE = 0.1  # of 1 / radius; as well is it known along a curve that ends at a quarter of it
FLAT = 1e-4  # of 1 / radius, a curvature that is none
DOUBTFUL_MISS = 0.005  # Share of the radius by which a curve may miss the point,
SIGNIFICANT = 5.0  # standard deviations of it,
LEAST_SCATTER = 0.3  # Share of a contact's accuracy: few contacts may happen to scatter less.
MESH_SHARE = 0.6  # Share of mean_height_std that the mesh is off the patch at most.


@dataclass(frozen=True, eq=False)
class Reconstruction:
    """A patch around a reference point, what it was fitted to and what was found; in the caller's unit.

    geometry : the surface that was found: of "bayes" the posterior's mean, else `patch`
    patch : equation (1) of the degree asked for, in the frame
    contours : what was fitted, in the world
    misses : at which distance each of the c curves passes the reference point, and its deviation, (c, 2)
    accuracy : standard deviation of a contact, at least, in units of L
    method : of the fit
    converged : whether its solver did
    joint_posterior : what "bayes" has found
    known_height_std : mean_height_std, where it is known already

    All else follows from these, once it is asked for.
    """

    geometry: Geometry
    patch: MongePatch
    contours: tuple[Contour, ...]
    misses: Array
    accuracy: float
    method: str
    converged: bool = True
    joint_posterior: Posterior | None = None
    known_height_std: float | None = None

    @property
    def frame(self) -> Frame:
        """The Darboux frame."""
        return self.geometry.frame

    @property
    def radius(self) -> float:
        """L, the largest distance of a contact from the point in the tangent plane."""
        return self.geometry.radius

    @property
    def domain(self) -> Domain:
        """The part of the tangent plane that the patch is meant for."""
        return self.geometry.domain

    @property
    def residual(self) -> Residual | None:
        """What the surface is beside its polynomial, where the contacts ask for more."""
        return self.geometry.residual

    @cached_property
    def contacts(self) -> Array:
        """What was fitted besides the reference point, (n, 3), in the frame."""
        curves = [contour.points - self.frame.origin for contour in self.contours]
        return np.vstack([r[besides_point(r)[1]] for r in curves]) @ self.frame.axes

    @cached_property
    def posterior(self) -> Posterior:
        """What the contacts leave open, in the frame and in units of L."""
        if self.joint_posterior is not None:
            return self.joint_posterior
        k1, k2 = self.patch.k1 * self.radius, self.patch.k2 * self.radius
        return posterior_of(k1, k2, self.contacts / self.radius, self.accuracy)

    @property
    def uncertainty(self) -> Residual | Posterior:
        """What knows the covariances of the heights, in the frame and in units of L."""
        return self.posterior if self.residual is None else self.residual

    def height(self, x: ArrayLike, y: ArrayLike) -> Array:
        """The height of the surface at local (x, y), in their shape.

        Of "bayes" it is the posterior's mean, a sextic and the residual, whatever the patch's degree; of the
        paper's methods that of the patch.
        """
        return self.geometry.height(x, y)

    def height_std(self, x: ArrayLike, y: ArrayLike) -> Array:
        """Standard deviation of the height at local (x, y), in their shape; blind directions included."""
        u, v = self.geometry.in_unit_radius(x, y)
        std = self.uncertainty.height_std(u, v)
        if self.joint_posterior is None:  # a patch by another method departs from the posterior's mean too
            off = self.posterior.height(u, v) - np.ravel(self.height(x, y)) / self.radius
            std = np.hypot(std, off)
        return self.radius * std.reshape(np.broadcast_shapes(np.shape(x), np.shape(y)))

    @cached_property
    def mean_height_std(self) -> float:
        """The mean of height_std over the domain."""
        if self.known_height_std is not None:
            return self.known_height_std
        (x, y), weights = self.domain.nodes[0].T, self.domain.nodes[1]
        return float(weights @ self.height_std(x, y))

    def mesh(self) -> tuple[Array, NDArray[np.intp]]:
        """The patch as points (n, 3), in the frame, and counterclockwise triangles (m, 3).

        As fine as what is known of it: off it by 0.6 of mean_height_std at most.
        """
        return self.geometry.mesh(MESH_SHARE * self.mean_height_std)

    @property
    def k1_std(self) -> float:
        """Standard deviation of the principal curvature k1, in 1/length."""
        return 2.0 * math.sqrt(self.posterior.covariance[2, 2]) / self.radius

    @property
    def k2_std(self) -> float:
        """Standard deviation of the principal curvature k2, in 1/length."""
        return 2.0 * math.sqrt(self.posterior.covariance[4, 4]) / self.radius

    @property
    def mean_curvature_std(self) -> float:
        """Standard deviation of H at the point, in 1/length."""
        c = self.posterior.covariance
        return math.sqrt(c[2, 2] + 2.0 * c[2, 4] + c[4, 4]) / self.radius

    @property
    def gaussian_curvature_std(self) -> float:
        """Standard deviation of K at the point, in 1/length^2; of normally distributed k1 and k2."""
        c, k = (
            4.0 * self.posterior.covariance[2:FREE:2, 2:FREE:2],
            self.radius * np.array([self.patch.k2, self.patch.k1]),
        )
        variance = k @ c @ k + c[0, 0] * c[1, 1] + c[0, 1] ** 2
        return math.sqrt(variance) / self.radius**2

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
        return fit_error(self.geometry, self.contacts)

    @cached_property
    def total_absolute_curvature(self) -> float:
        """(8), the integral of |K| over the patch."""
        return total_absolute_curvature(self.patch, self.domain)

    @cached_property
    def condition_number(self) -> float:
        """Condition number of the least-squares system of the coefficients, in unit radius."""
        x, y, _ = self.contacts.T / self.radius
        return least_squares.condition_number(monomials(x, y, exponents(3, self.patch.degree)))

    def moved(self, matrix: ArrayLike) -> "Reconstruction":
        """This reconstruction after a similarity of the world, (4, 4): rotation, one scale above 0 and shift.

        Raises ValueError for any other matrix.
        """
        scale, turn, _ = similarity(matrix)
        geometry = self.geometry.moved(matrix)
        # From the reference point, which so stays a point of its curves whatever its coordinates.
        start, end = self.frame.origin, geometry.frame.origin

        def placed(contour: Contour) -> Contour:
            """The contour after the similarity, normals and noise included."""
            plane, normals, noise = contour.plane_normal, contour.normals, contour.noise
            return replace(
                contour,
                points=end + scale * (contour.points - start) @ turn.T,
                plane_normal=None if plane is None else turn @ plane,
                normals=None if normals is None else normals @ turn.T,
                noise=None if noise is None else scale * noise,
            )

        return replace(
            self,
            geometry=geometry,
            patch=self.patch.scaled(scale),
            contours=tuple(map(placed, self.contours)),
            misses=scale * self.misses,
            known_height_std=None,
        )

    @property
    def status(self) -> str:
        """ "ok", "uncertain" or "not_converged"."""
        return self._judgment[0]

    @property
    def message(self) -> str:
        """The status in a sentence, with advice; and the blind directions."""
        return self._judgment[1]

    @cached_property
    def _judgment(self) -> tuple[str, str]:
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
                "The minimization stopped at its step limit, the patch is its best so far: use the fast "
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
        distances, stds = self.misses.T / self.radius
        stds = np.maximum(stds, LEAST_SCATTER * self.accuracy)
        apart = np.flatnonzero(distances > np.maximum(DOUBTFUL_MISS, SIGNIFICANT * stds))
        if len(apart):
            return "uncertain", (
                f"Curve {apart[0] + 1} passes the reference point at {self.radius * distances[apart[0]]:.3g}"
                ", more than its scatter explains: set the point where the curves meet."
            )
        turn = self.posterior.turn() if self.residual is None else self.posterior.turn(LIKELY)
        # A plane has no directions to be off, and a longer extent would give it none.
        has_directions = self.radius * max(abs(self.patch.k1), abs(self.patch.k2)) > FLAT
        if turn > DOUBTFUL_TURN and has_directions:
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
