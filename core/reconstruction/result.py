# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A patch with its frame, and all results that follow from it."""

import math
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property
from statistics import median

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..arguments import LARGEST, Array, finite_array, many, set_fields
from ..bayes.bends import Bends, bends_of
from ..bayes.joint_fit import MISFIT, posterior_of
from ..bayes.near_point import curvature_contradiction
from ..bayes.normals import contradiction, measured_normals, scatter
from ..bayes.other_curves import LEAST_CURVES, contradicting_curve
from ..bayes.posterior import SurfacePosterior, coefficients_of, terms_to
from ..bayes.prior import FREE, remainder
from ..bayes.roughness import EXPLAINED_TERMS
from ..bayes.sextic import offset_share
from ..contours.contour import SURFACE_ENDS, Contour, read_only, stops_at
from ..contours.curves import (
    Curves,
    curves_through,
    misses,
    stacked,
)
from ..contours.local_geometry import Frame
from ..paper import least_squares
from ..patch.domain import AT_POINT, Domain
from ..patch.geometry import Geometry, similarity, total_absolute_curvature
from ..patch.monge import TERMS, MongePatch, exponents, monomials
from ..patch.triangulation import patch_mesh
from ..verdict import SIGNIFICANT, Doubt, Judged, beyond
from . import status
from .status import Taps

# This share of what surfaces are off polynomials is left at the point (benchmarks.real, and curvatures: with
# 0.63 intervals of k1 hold in 84 % on exact surfaces).
NEAR_POINT = 0.65
# The mesh is off the patch by at most this share of mean_height_std (benchmarks.patch_mesh, e20b52a).
MESH_SHARE = 0.6


@dataclass(frozen=True, eq=False)
class Reconstruction(Judged):
    """A patch around a reference point, its contacts and all results, in the caller's unit.

    geometry : the surface that was found: the posterior's mean for "bayes", `patch` for other methods
    patch : equation (1) of the requested degree, in the frame
    contours : the fitted contours, in the world
    strokes : the other fitted contacts, in the world, (n, 3); means of neighbors if there are many
    noise : noise floor, the standard deviation that a contact has at least, in units of L
    method : the method of the fit
    point : (3,), the reference point as it was given
    point_std : its standard deviation along the normal, in units of L; 1 where only contacts show the surface
    converged : whether its solver converged
    taps : what taps between the curves have met; None without taps
    shape_curvatures : (n, 2), estimates of the principal curvatures, in order, of the shape that few facets
        stand for; none where the mesh is fine or unknown
    facet_width : the width of the facet at the point across its bends, a length; 0 without estimates
    known_curves : the contours as Curves of one touch, in the world, if they were computed before

    All else is computed from these when it is first used, so contours and strokes are copies that cannot be
    written to.
    """

    geometry: Geometry
    patch: MongePatch
    contours: tuple[Contour, ...]
    noise: float
    method: str
    point: Array
    point_std: float = 0.0
    converged: bool = True
    strokes: Array = field(default_factory=lambda: np.empty((0, 3)))
    taps: Taps | None = None
    shape_curvatures: Array = field(default_factory=lambda: np.empty((0, 2)))
    facet_width: float = 0.0
    known_curves: Curves | None = None

    def __post_init__(self) -> None:
        copies = tuple(contour.copied() for contour in self.contours)
        arrays = {name: read_only(getattr(self, name)) for name in ("strokes", "point", "shape_curvatures")}
        set_fields(self, contours=copies, **arrays)

    def __repr__(self) -> str:
        point = ", ".join(f"{x:.4g}" for x in self.frame.origin)
        normal = ", ".join(f"{x:.4f}" for x in self.normal)
        felt = many(len(self.contours), "contour", "contours") if self.contours else "strokes"
        return (
            f"Reconstruction, {self.status}: {self.message}\n"
            f"  point ({point}), normal ({normal}), L {self.radius:.4g}\n"
            f"  k1 {self.k1:.4g} +- {self.k1_std:.2g}, k2 {self.k2:.4g} +- {self.k2_std:.2g}\n"
            f"  height +- {self.mean_height_std:.2g} in the mean, {self.method}, degree {self.patch.degree}, "
            f"{many(len(self.contacts), 'contact', 'contacts')} of {felt}"
        )

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
        """The part of the tangent plane over which the patch is valid, bounded by a closed spline (8)."""
        return self.geometry.domain

    @cached_property
    def contacts(self) -> Array:
        """The fitted contacts without the reference point, (n, 3), in the frame."""
        origin, curves = self.frame.origin, self._curves
        points = curves.points[curves.present] + (self._meeting - origin)
        return np.concatenate([points, self.strokes - origin]) @ self.frame.axes

    @cached_property
    def _curves(self) -> Curves:
        """The contours as seen from where they meet, in the world."""
        return self.known_curves or curves_through(*stacked(self._meeting[None], [self.contours]))

    @property
    def _meeting(self) -> Array:
        """The place (3,) where curves meet: the reference point or, where contacts show it, the origin."""
        return self.point if self.point_std < 1.0 else self.frame.origin

    @cached_property
    def misses(self) -> Array:
        """Distance at which each of the c curves passes the reference point, and its deviation, (c, 2)."""
        return misses(self._curves)[0, : len(self.contours)]

    @cached_property
    def posterior(self) -> SurfacePosterior:
        """What the contacts show and leave open, in the frame and in units of L."""
        surface = self.geometry.surface
        return surface if isinstance(surface, SurfacePosterior) else self._posterior_of_contacts

    @cached_property
    def _posterior_of_contacts(self) -> SurfacePosterior:
        """What contacts show without measured normals or a process, in the frame and in units of L."""
        k1, k2 = self.patch.k1 * self.radius, self.patch.k2 * self.radius
        return posterior_of(k1, k2, self.contacts / self.radius, self.noise, self.point_std)

    def height(self, x: ArrayLike, y: ArrayLike) -> Array:
        """The height of the surface at local (x, y), in their shape.

        For "bayes" it is the posterior's mean, whatever the degree of the patch. For the paper's methods it
        is the height of the patch.
        """
        return self.geometry.height(x, y)

    def height_std(self, x: ArrayLike, y: ArrayLike) -> Array:
        """Standard deviation of the height at local (x, y), in their shape, with what contacts leave open."""
        points = np.stack(np.broadcast_arrays(x, y), axis=-1)
        flat = points.reshape(-1, 2)
        # Without a process nothing is widened, wherever in the domain a place is.
        places = self.domain.places(flat) if self.posterior.amplitude else flat
        widening = self.widening(np.linalg.norm(places, axis=1))
        return self._height_std(flat, widening).reshape(points.shape[:-1])

    def _height_std(self, points: Array, widening: Array) -> Array:
        """`height_std` (n,) at local points (n, 2), given `widening` (n,) there."""
        u, v = points.T / self.radius
        std = widening * self.posterior.height_std(u, v)
        if self.method != "bayes":  # A patch by another method departs from the posterior's mean, too.
            std = np.hypot(std, self.posterior.height(u, v) - self.geometry.surface.height(u, v))
        return self.radius * std

    def widening(self, rho: Array) -> Array:
        """The factor (n,) of a process's deviations at shares (n,) of the domain's radius; 1 without one.

        Near the point, where curves meet, real surfaces are smoother than the process's covariance has them,
        and near the rim they are rougher. The mean over the domain is 1.
        """
        near = NEAR_POINT if self.posterior.amplitude else 1.0
        return near + 1.5 * (1.0 - near) * rho

    @cached_property
    def mean_height_std(self) -> float:
        """The mean of height_std over the domain."""
        return float(self.domain.nodes[1] @ self.node_stds)

    @cached_property
    def node_stds(self) -> Array:
        """height_std at the domain's nodes, (n,)."""
        return self._height_std(self.domain.nodes[0], self.widening(self.domain.node_places))

    def surface_at(self, points: ArrayLike) -> tuple[Array, Array, Array]:
        """The surface above or below world points (n, 3), along the normal at the reference point.

        Places on it (n, 3) and its unit normals there (n, 3), in the world, and standard deviations (n,) of
        the heights. `domain.contains` has whether the patch is valid there. Raises ValueError for bad points.
        """
        x, y, _ = self.frame.to_local(finite_array("points", points, (None, 3), LARGEST)).T
        d, std = self.geometry.derivatives(x, y), self.height_std(x, y)
        return self.frame.to_world(np.column_stack([x, y, d.z])), d.normal @ self.frame.axes.T, std

    def mesh(self) -> tuple[Array, NDArray[np.intp]]:
        """The patch as points (n, 3), in the frame, and counterclockwise triangles (m, 3).

        It is as fine as the patch is certain: off the patch by at most 0.6 times mean_height_std.
        """
        return patch_mesh(self.geometry, self.domain, MESH_SHARE * self.mean_height_std)

    @property
    def k1(self) -> float:
        """The smaller principal curvature at the point, in 1/length."""
        return self.patch.k1

    @property
    def k2(self) -> float:
        """The larger principal curvature at the point, in 1/length."""
        return self.patch.k2

    @property
    def normal(self) -> Array:
        """The outward unit normal at the point, (3,)."""
        return self.frame.axes[:, 2]

    @cached_property
    def curvature_covariance(self) -> Array:
        """The covariance of the coefficients of x^2, xy and y^2, (3, 3), in unit radius."""
        # One deviation in each direction: that of the coefficient of xy is larger by the square root of 2.
        facets = (0.5 * self.radius * self.facet_std) ** 2 * np.diag([1.0, 2.0, 1.0])
        beyond = self._bent_beyond
        return self.bends.with_few(self._fitted_covariance + np.outer(beyond, beyond)) + facets

    @property
    def _noise_share(self) -> float:
        """The share of the fit's noise that counts for curvatures at the point, where there is no process.

        The noise has room for MISFIT, by which a surface is off its polynomial, mostly toward the rim. At the
        point NEAR_POINT of it is left, or as much as contacts are off, or as their own noise is.
        """
        if self.posterior.amplitude:
            return 1.0
        freedom = max(len(self.contacts) - EXPLAINED_TERMS, 1)
        shown = float(np.linalg.norm(self._residuals)) / (math.sqrt(freedom) * self.radius)
        return float(np.clip(max(shown, self.noise) / float(self.posterior.noise), NEAR_POINT, 1.0))

    @property
    def _fitted_covariance(self) -> Array:
        """That part of it which the fit shows.

        A fit without a process takes the errors of contacts for independent, which those that share a bend
        are not. A patch by another method also departs from the posterior's mean.
        """
        posterior, covariance = self.posterior, self.posterior.covariance[2:FREE, 2:FREE]
        if not (posterior.sextic or posterior).amplitude:
            # benchmarks.curvatures: scans, facets; exact surfaces
            covariance = (self.bends.contacts_per_bend * self._noise_share) ** 2 * covariance
        if self.method != "bayes":
            off = posterior.polynomial[2:FREE] - coefficients_of(self.patch.scaled(1.0 / self.radius))[2:FREE]
            covariance = covariance + np.outer(off, off)
        return covariance

    @property
    def _bent_beyond(self) -> Array:
        """The coefficients (3,) of x^2, xy and y^2 by which the heights beyond its sextic bend a patch.

        They are those of a surface that keeps its curvatures, as the prior's mean has them up to a sextic.
        The fit takes them as all heights (Rasmussen and Williams 2006, 2.8); a process follows them.
        """
        posterior = self.posterior.sextic or self.posterior
        if posterior.amplitude:
            return np.zeros(3)
        local, noise = self.contacts / self.radius, float(posterior.noise)
        heights = remainder(local[:, 0], local[:, 1], self.radius * self.k1, self.radius * self.k2)
        # The height at the origin takes a share of their mean.
        heights -= offset_share(np.ones((1, len(local))), np.array([self.point_std / noise])) * heights.mean()
        bent: Array = posterior.covariance[2:FREE] @ (heights @ monomials(local, TERMS)) / noise**2
        return bent

    @property
    def _off_shape(self) -> list[float]:
        """How far principal curvatures are off each estimate of those of the shape."""
        low, high = sorted((self.k1, self.k2))
        return [max(abs(low - k1), abs(high - k2)) for k1, k2 in self.shape_curvatures.tolist()]

    @property
    def facet_std(self) -> float:
        """How far curvatures may be off by facets: as the farthest estimate is, and as estimates are apart.

        Facets of width w show how far the shape turns from one to the next, but not where within w. So what
        is open of the curvature, s, is a turn by s w. Half curves of length L < w may have all of it: the
        parabola of least squares over a kink at its point has 15/16 of the kink's turn over L. So s is
        larger by w / L.
        """
        apart = np.ptp(self.shape_curvatures, axis=0).max() if self._off_shape else 0.0
        off = math.hypot(max(self._off_shape, default=0.0), apart)
        return off * max(self.facet_width / self.radius, 1.0)

    @cached_property
    def bends(self) -> Bends:
        """In how few places the surface turns along the curves, and what that leaves open of curvatures."""
        fitted = float(self.posterior.noise)
        noises = [fitted if c.noise is None else c.noise / self.radius for c in self.contours]
        contours, most = self.contours, SIGNIFICANT * max(fitted, MISFIT) * self.radius
        if np.abs(self._residuals).max() > most:
            contours = tuple(self._explained(c, most) if c.normals is None else c for c in contours)
        noise, quadratic = max(noises, default=0.0), self.posterior.polynomial[2:FREE]
        return bends_of(contours, self.frame, self.radius, noise, quadratic)

    def _explained(self, contour: Contour, most: float) -> Contour:
        """A contour, without those contacts that are off the surface by more than this length."""
        x, y, z = self.frame.to_local(contour.points).T
        return contour.part(np.abs(self.height(x, y) - z) <= most, contour.stops)

    @property
    def k1_std(self) -> float:
        """Standard deviation of the principal curvature k1, in 1/length."""
        return 2.0 * math.sqrt(self.curvature_covariance[0, 0]) / self.radius

    @property
    def k2_std(self) -> float:
        """Standard deviation of the principal curvature k2, in 1/length."""
        return 2.0 * math.sqrt(self.curvature_covariance[2, 2]) / self.radius

    @property
    def mean_curvature_std(self) -> float:
        """Standard deviation of H at the point, in 1/length."""
        c = self.curvature_covariance
        return math.sqrt(c[0, 0] + 2.0 * c[0, 2] + c[2, 2]) / self.radius

    @property
    def gaussian_curvature_std(self) -> float:
        """Standard deviation of K at the point, in 1/length^2, for normally distributed k1 and k2."""
        c = 4.0 * self.curvature_covariance[::2, ::2]
        k = self.radius * np.array([self.patch.k2, self.patch.k1])
        return math.sqrt(k @ c @ k + c[0, 0] * c[1, 1] + c[0, 1] ** 2) / self.radius**2

    @cached_property
    def null_space_dimension(self) -> int:
        """Number of directions among the coefficients of degree 1 to d that the contacts do not show."""
        return self.posterior.null_space_dimension(self.patch.degree)

    @property
    def null_space_share(self) -> float:
        """`null_space_dimension` as a share of the number of these coefficients."""
        return self.null_space_dimension / terms_to(self.patch.degree)

    @cached_property
    def _residuals(self) -> Array:
        """The heights of the surface above the contacts, (n,)."""
        x, y, z = self.contacts.T
        return self.height(x, y) - z

    @property
    def fit_error(self) -> float:
        """The mean of |dz| over the contacts (6), a length."""
        return float(np.abs(self._residuals).mean())

    @property
    def typical_miss(self) -> float:
        """The median of |dz| over the contacts, which outliers do not change."""
        return median(np.abs(self._residuals).tolist())

    @cached_property
    def waves(self) -> float:
        """What a quartic leaves of the surface at the contacts: a root mean square; 0 without a process.

        Outlying contacts do not count, because the surface itself leaves them out.
        """
        if not self.posterior.amplitude:
            return 0.0
        basis = monomials(self.contacts / self.radius, exponents(1, 4))
        height = self.contacts[:, 2] + self._residuals
        off = height - basis @ np.linalg.lstsq(basis, height, rcond=None)[0]
        return math.sqrt(float(np.mean(off**2)))

    @cached_property
    def total_absolute_curvature(self) -> float:
        """The integral of |K| over the patch (8)."""
        return total_absolute_curvature(self.patch, self.domain)

    @cached_property
    def condition_number(self) -> float:
        """Condition number of the least-squares system of the coefficients, in unit radius."""
        terms = exponents(3, self.patch.degree)
        return least_squares.condition_number(monomials(self.contacts / self.radius, terms))

    def moved(self, matrix: ArrayLike) -> "Reconstruction":
        """This reconstruction after a similarity (4, 4) of the world: rotation, scale above 0 and shift.

        Raises ValueError for any other matrix.
        """
        scale, turn, shift = similarity(matrix)
        start, end = self.point, scale * turn @ self.point + shift
        return replace(
            self,
            geometry=self.geometry.moved(matrix),
            patch=self.patch.scaled(scale),
            contours=tuple(contour.moved(scale, turn, start, end) for contour in self.contours),
            strokes=end + scale * (self.strokes - start) @ turn.T,
            point=end,
            shape_curvatures=self.shape_curvatures / scale,
            facet_width=scale * self.facet_width,
            known_curves=None,
        )

    def judged_with(self, **values: object) -> "Reconstruction":
        """This fit with other values that only its verdict depends on: `taps`, `shape_curvatures` and
        `facet_width`.

        What follows from the fit alone is kept; `mean_height_std` may be given if it is known.
        """
        other, of_these = object.__new__(Reconstruction), ("gravest", "doubts", "curvature_covariance")
        set_fields(other, **{key: value for key, value in vars(self).items() if key not in of_these} | values)
        return other

    def with_facets_of(self, other: "Reconstruction") -> "Reconstruction":
        """This fit with what the facets at another one show of the shape."""
        return self.judged_with(shape_curvatures=other.shape_curvatures, facet_width=other.facet_width)

    @property
    def message(self) -> str:
        """The gravest doubt in a sentence with advice, and what the contacts leave undetermined."""
        verdict = "The patch describes its contacts." if self.gravest is None else str(self.gravest)
        return f"{verdict}{self._notes}"

    def _doubting(self) -> Iterator[Doubt]:
        """Reasons to doubt it, the gravest first."""
        useless, radius = status.useless(self.method, self.contours, self.shape_curvatures), self.radius
        yield from status.about_facets(self._off_shape, self.shape_curvatures, radius)
        stops = stops_at(self.contours, self.frame.origin, AT_POINT * radius)
        yield from status.about_taps(self.taps, any(stop in SURFACE_ENDS for stop in stops), useless)
        if not self.converged:
            yield Doubt("steps")
        if self.method == "least-squares":
            yield from beyond("condition", self.condition_number, status.DOUBTFUL_CONDITION)
        yield from status.about_point(
            self.misses, self.noise, self.point_std, self.contours, self.point, radius
        )
        yield from status.about_normals(self.contradiction, self.normal_scatter)
        yield from beyond("contacts", self.typical_miss / radius, status.DOUBTFUL_FIT + self.noise, useless)
        yield from beyond("heights", self.mean_height_std / radius, status.DOUBTFUL_STD, useless)
        yield from status.about_frame(self.posterior, self.contours, useless)
        yield from self._doubting_shape(useless)

    def _doubting_shape(self, useless: tuple[str, ...]) -> Iterator[Doubt]:
        """Whether a curve contradicts the others, the surface waves, or its bends are of something else."""
        deviations, off = self.curve_contradiction
        if deviations > status.CONTRADICTING_CURVE:
            yield Doubt("curve", off, status.CONTRADICTING_CURVE * off / deviations)
        if not len(self.strokes):
            yield from beyond("waves", self.waves / self.radius, status.DOUBTFUL_FIT, useless)
        bent, std = self.radius * max(abs(self.k1), abs(self.k2)), self.posterior.curvature_std()
        if status.is_on_flat_face(bent, std, self.contours, self.frame.origin):
            yield Doubt("flat_face", bent, std, useless=useless)
        yield from beyond("folds", self.bends.folded, status.DOUBTFUL_FOLD, useless)
        yield from beyond("bend", self.curvature_contradiction, SIGNIFICANT, useless)

    @property
    def _notes(self) -> str:
        """Remarks that do not depend on the status: sentences, each after a space."""
        message = ""
        if self.taps is not None and self.taps.missed:
            missed, number = self.taps.missed, self.taps.number
            message += f" At {missed} of {number} taps between the curves there is no surface."
        if self.posterior.is_round:
            message += (
                " The two curvatures are equal within their error, so there are no principal directions."
            )
        if self.null_space_dimension:
            terms = terms_to(self.patch.degree)
            message += f" These planes cannot show {self.null_space_dimension} of the {terms} ways to bend."
        return message

    @cached_property
    def curve_contradiction(self) -> tuple[float, float]:
        """The number of deviations, and the share of L, by which a curve is off what the others show."""
        if self.method != "bayes" or len(self.contours) + (len(self.strokes) > 0) < LEAST_CURVES:
            return 0.0, 0.0
        sizes = self._curves.present[0].sum(axis=1)
        curve = np.repeat([*range(len(sizes)), -1], [*sizes, len(self.strokes)])
        return contradicting_curve(
            self.contacts / self.radius, curve, self.posterior, self.noise, self.point_std
        )

    @cached_property
    def curvature_contradiction(self) -> float:
        """The number of deviations by which curvatures are off those of the contacts near the point."""
        return curvature_contradiction(self.contacts / self.radius, self.posterior, self._fitted_covariance)

    @cached_property
    def _fitted_normals(self) -> tuple[Array, Array]:
        """Contacts with fitted normals and these normals, (n, 3) each, as `measured_normals` has them."""
        return measured_normals(self.contours if self.method == "bayes" else (), self.frame, self.radius)

    @cached_property
    def contradiction(self) -> tuple[float, float]:
        """The number of deviations, and the angle in radians, by which fitted normals contradict contacts."""
        contacts, normals = self._fitted_normals
        if not len(normals):
            return 0.0, 0.0
        return contradiction(contacts, normals, self._posterior_of_contacts)

    @cached_property
    def normal_scatter(self) -> tuple[float, float]:
        """The number of deviations, and the angle in radians, by which fitted normals are off the curves."""
        contacts, normals = self._fitted_normals
        if not len(normals):
            return 0.0, 0.0
        d = self.geometry.derivatives(*(self.radius * contacts[:, :2].T))
        return scatter(contacts, normals, np.column_stack([d.x, d.y]))
