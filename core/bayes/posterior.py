# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What contacts show of a surface and what they leave open: a Gaussian process with explicit basis functions.

Not in the paper; after Rasmussen and Williams (2006), section 2.7. In unit radius and in the Darboux frame,

    z = phi' b + g,

where phi are the terms of degree 1 to 6, b has the prior of prior.py, and g has zero mean and the covariance
of kernel.py. With g, b has the mean 0 and variances of at most MOST_VARIANCE (evidence.py). Where the
evidence does not favor g, z is a polynomial.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cache, cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..arguments import Array
from ..lapack import solved, solved_square
from ..patch.differential_geometry import Derivatives
from ..patch.monge import (
    DEGREE,
    PARTIALS,
    QUARTIC,
    TERMS,
    HeightField,
    MongePatch,
    monomials,
    polynomial_derivatives,
)
from .kernel import derived_kernel, kernel, kernels, places_factor, weighted_kernel
from .prior import FREE, ORDERS

WINDING = 1j * (TERMS[:, 0] - TERMS[:, 1])  # A turn by t adds (i - j) t to the phase of z^i z'^j, z = x + iy.
LEAST_DEGREE = 2  # No patch has a lower degree.
DISK = 0.95  # A patch of lower degree is fitted over a disk of this radius: not all curves end at L.
QUARTIC_SHARE = 0.6  # Share of the radius (benchmarks.real); 0.8 takes in what has no bearing on the point.
ALIKE = 0.05  # Curvatures that differ by less make no directions, as in the rule of benchmarks.stability.
ALIKE_SHARE = 0.1  # Nor do those of what may be a sphere, if their deviation is less than this share of them.
CONFIDENCE = 0.95  # Directions are judged with this probability.
ROUND = 12.59  # The quantile at CONFIDENCE of chi squared with six degrees of freedom.
INVISIBLE = 0.9  # A direction of which this share of the prior's variance is left is invisible.


# Spheres and planes have no difference of curvatures, no mixed second derivative and no third derivatives.
_UNLIKE_SPHERE = np.zeros((6, len(TERMS)))
_UNLIKE_SPHERE[0, [2, 4]] = -1.0, 1.0
_UNLIKE_SPHERE[range(1, 6), [3, *range(FREE, FREE + 4)]] = 1.0


@dataclass(frozen=True, eq=False)
class SurfacePosterior(HeightField):
    """A Gaussian over surfaces z = phi' b + g in unit radius; without places, also a stack (...) of such.

    With places u of contacts, k(u, u) = L L' and the features f(p) = (phi(p), 1, L^-1 k(u, p)), the mean of z
    is phi' mean + k(p, u)' alpha, and its covariance

        k(p, q) - k(p, u) k(u, u)^-1 k(u, q) + f(p)' root' root f(q).

    mean : (..., 27), of b_10 b_01 b_20 b_11 b_02 b_30 ...
    root : (..., r, 28 + m), root' root is the covariance of what multiplies the features: b, the height at
        the origin and L^-1 g(u); the column of the height is 0 if that is exact, as at a reference point
        that was touched
    noise : (...), standard deviation of a contact
    visibility : (..., 22, 22), upper triangular: its singular values are how well the contacts show each
        direction among the terms of degree 3 to 6, in units of noise, for a surface of waviness 1; those of a
        leading block are how well they show those among the terms up to a lower degree
    places : (m, 2), the places u; none without a process
    alpha : (m,); variances : (2,), of g, for each of LENGTHS
    sextic : the posterior without g where frame and curvatures are its own, because it averages the facets of
        a smooth surface; None elsewhere
    """

    mean: Array
    root: Array
    noise: Array
    visibility: Array
    places: Array = field(default_factory=lambda: np.empty((0, 2)))
    alpha: Array = field(default_factory=lambda: np.empty(0))
    variances: Array = field(default_factory=lambda: np.zeros(2))
    sextic: "SurfacePosterior | None" = None

    def at(self, index: int | slice | NDArray[np.bool_]) -> "SurfacePosterior":
        """One posterior of the stack, or several."""
        return SurfacePosterior(self.mean[index], self.root[index], self.noise[index], self.visibility[index])

    def scaled(self, factor: ArrayLike) -> "SurfacePosterior":
        """The posterior of these polynomials with every length multiplied by `factor` (...)."""
        f = np.asarray(factor)
        factors = f[..., None] ** (1.0 - np.append(ORDERS, 0.0))
        return replace(
            self,
            mean=factors[..., :-1] * self.mean,
            root=self.root * factors[..., None, :],
            noise=f * self.noise,
        )

    def rotated(self, angle: Array) -> "SurfacePosterior":
        """The posterior of these polynomials in axes that are turned by `angle` (...) about the normal."""
        turn, root = _turn(angle), self.root.copy()
        root[..., :-1] = root[..., :-1] @ np.swapaxes(turn, -1, -2)
        return replace(self, mean=(turn @ self.mean[..., None])[..., 0], root=root)

    # What follows is for a single posterior, not for a stack.

    @property
    def amplitude(self) -> float:
        """The standard deviation of g far from the point, as a share of the radius; 0 for a polynomial."""
        return math.sqrt(float(self.variances.sum()))

    def height(self, x: ArrayLike, y: ArrayLike) -> Array:
        """The mean height at (x, y)."""
        at = _rows(x, y)
        z: Array = monomials(at, TERMS) @ self.mean
        if len(self.places):
            z += weighted_kernel(at, self.places, self.variances, self.alpha)
        return z.reshape(np.broadcast(x, y).shape)

    def derivatives(self, x: ArrayLike, y: ArrayLike) -> Derivatives:
        """Height, slopes and second derivatives of the mean at (x, y)."""
        d = polynomial_derivatives(self.mean, TERMS, x, y, PARTIALS)
        if len(self.places):
            d += (derived_kernel(_rows(x, y), self.places, self.variances) @ self.alpha).reshape(d.shape)
        return Derivatives(*d)

    def height_std(self, x: ArrayLike, y: ArrayLike) -> Array:
        """Standard deviations of the height at n points, (n,)."""
        at = _rows(x, y)
        if not len(self.places):
            left = monomials(at, TERMS) @ self.root[:, :-1].T + self.root[:, -1]
            return np.sqrt(np.einsum("ni,ni->n", left, left))
        known, left = self._whitened(at)
        variance = np.einsum("in,in->n", left, left) - np.einsum("in,in->n", known, known)
        return np.sqrt(np.maximum(self.variances.sum() + variance, 0.0))

    def covariances_with(self, q: Array) -> Callable[[Array], tuple[Array, Array]]:
        """A function: covariances of heights at points (..., n, 2) with those at q (m, 2), and each other."""
        at_q = self._signed(q)

        def covariances(p: Array) -> tuple[Array, Array]:
            """Covariances of heights at p with those at q, (..., n, m), and with each other, (..., n, n)."""
            at_p = self._signed(p)
            return self._covariance(p, at_p, q, at_q), self._covariance(p, at_p, p, at_p)

        return covariances

    def _covariance(self, p: Array, at_p: Array, q: Array, at_q: Array) -> Array:
        """The covariances of heights at p and q, given what `_signed` gives for both."""
        signs = np.repeat([-1.0, 1.0], [len(self.places), len(self.root)])
        of_terms: Array = (signs * at_p) @ np.swapaxes(at_q, -1, -2)
        return of_terms + kernel(p, q, self.variances) if len(self.places) else of_terms

    def _signed(self, p: Array) -> Array:
        """Both results of `_whitened` for points (..., n, 2), side by side, (..., n, m + r)."""
        return np.vstack(self._whitened(p.reshape(-1, 2))).T.reshape(*p.shape[:-1], -1)

    def _whitened(self, p: Array) -> tuple[Array, Array]:
        """L^-1 k(u, p), (m, n), and root @ f(p), (r, n), at points (n, 2).

        Products of the former are subtracted from k, and those of the latter added: that is the covariance.
        """
        within = kernel(self.places, p, self.variances) if len(self.places) else np.empty((0, len(p)))
        return self._whitened_sums(monomials(p, TERMS).T, np.ones(len(p)), within)

    def _whitened_sums(self, terms: Array, ones: Array, within: Array) -> tuple[Array, Array]:
        """What `_whitened` gives for terms (27, n), ones (n,) and k(u, p) (m, n), or for sums of such."""
        known = solved(self._places_factor, within) if len(within) else within
        return known, self.root @ np.vstack([terms, ones, known])

    @cached_property
    def _places_factor(self) -> Array:
        """The factor L of k(u, u), (m, m), lower triangular."""
        return places_factor(kernel(self.places, self.places, self.variances))

    @cached_property
    def _projected_within(self) -> Array:
        """Covariances (m, 27) of g at the places with the coefficients that the projection makes of it."""
        at, weights = _projection()
        return kernel(self.places, at, self.variances) @ weights.T

    @cached_property
    def polynomial(self) -> Array:
        """The coefficients (27,) of the polynomial that describes the mean of z in its Darboux frame.

        Those up to degree 2 are of the quartic nearest to z over QUARTIC_SHARE of the radius, the others are
        nearest to what these leave: a Matern process of order 3/2 has no second derivative at the point. If z
        is a polynomial, or if there is a `sextic`, they are its own.
        """
        if self.sextic is not None:
            return self.sextic.mean
        if not len(self.places):
            return self.mean
        quartic: Array = _projected_terms() @ self.mean + self.alpha @ self._projected_within
        mean, half = quartic[2] + quartic[4], math.hypot(quartic[2] - quartic[4], quartic[3])
        quartic[:FREE] = 0.0, 0.0, 0.5 * (mean - half), 0.0, 0.5 * (mean + half)
        return quartic

    @cached_property
    def covariance(self) -> Array:
        """The covariance of the coefficients of `polynomial`, (27, 27)."""
        if self.sextic is not None:
            return self.sextic.covariance
        if not len(self.places):
            root = self.root[:, :-1]
            return root.T @ root
        ones = _projection()[1].sum(axis=1)
        known, left = self._whitened_sums(_projected_terms().T, ones, self._projected_within)
        own = sum(map(np.multiply, self.variances, _projected_kernels()))
        return own + left.T @ left - known.T @ known

    def patch(self, degree: int) -> MongePatch:
        """The patch (1) of this degree that has the mean's curvatures and is nearest to it over the disk."""
        a = _truncation(degree) @ self.polynomial[FREE:]
        return MongePatch(2.0 * float(self.polynomial[2]), 2.0 * float(self.polynomial[4]), a)

    def degree_shown(self, basis: Array) -> int:
        """The least degree whose patch is off the mean by at most half its deviation at contacts.

        basis : (n, 27), the terms there
        """
        left = basis @ self.root[:, :-1].T
        variance = np.einsum("ni,ni->", left, left)
        off = basis[:, FREE:] @ (_departures() @ self.polynomial[FREE:]).T
        enough = np.flatnonzero(np.einsum("nk,nk->k", off, off) <= 0.25 * variance)
        return LEAST_DEGREE + int(enough[0]) if len(enough) else DEGREE

    def turn(self, confidence: float = CONFIDENCE) -> float:
        """The angle in radians that the Darboux frame is off by at most, with a probability of `confidence`.

        It is 0 if the curvatures are ALIKE with that probability, because then there are no directions.
        """
        x, y, xx, xy, yy = self.polynomial[:FREE].tolist()
        c = self.covariance
        # The ratio of yy - xx and xy turns the frame. This is a Cholesky factor of their covariance.
        std = math.sqrt(max(c[2, 2] + c[4, 4] - 2.0 * c[2, 4], 1e-300))
        shared = (c[3, 4] - c[2, 3]) / std
        own = math.sqrt(max(c[3, 3] - shared**2, 0.0))
        u, v = _normal_points()
        difference, mixed = yy - xx + std * u, xy + shared * u + own * v
        angles = 0.5 * np.abs(np.arctan2(mixed, difference))
        angles[2.0 * np.hypot(difference, mixed) <= ALIKE] = 0.0
        angle = float(np.sort(angles)[int(confidence * len(angles))])
        return math.hypot(angle, x, y, math.sqrt(c[0, 0] + c[1, 1])) if angle > 0.0 else 0.0

    @property
    def is_round(self) -> bool:
        """Whether the surface may be a sphere or a plane, judged by its terms to degree 3 with CONFIDENCE.

        Then there are no principal directions. It is False if curvatures are less certain than ALIKE, or than
        ALIKE_SHARE of their mean.
        """
        xx, _, yy = self.polynomial[2:FREE].tolist()
        if self.curvature_std() > max(ALIKE, ALIKE_SHARE * abs(xx + yy)):
            return False
        apart = _UNLIKE_SPHERE @ self.polynomial
        apart_covariance = _UNLIKE_SPHERE @ self.covariance @ _UNLIKE_SPHERE.T
        return float(apart @ solved_square(apart_covariance, apart)) <= ROUND

    def curvature_std(self) -> float:
        """Standard deviation of the normal curvature at the origin, in the direction where it is largest."""
        variances = normal_curvature_variances(self.covariance[2:FREE, 2:FREE])
        return math.sqrt(max(float(variances.max()), 0.0))

    def null_space_dimension(self, degree: int) -> int:
        """How many directions among the terms of degree 1 to `degree` keep 90 % of their prior variance."""
        last = terms_to(degree) - FREE
        singular = np.linalg.svd(self.visibility[:last, :last], compute_uv=False)
        return int(np.count_nonzero(INVISIBLE * (1.0 + singular**2) < 1.0))


def terms_to(degree: int) -> int:
    """The number of terms of degree 1 to `degree`."""
    return (degree + 1) * (degree + 2) // 2 - 1


def coefficients_of(patch: MongePatch) -> Array:
    """The coefficients of a patch as those of the 27 terms, (27,)."""
    b = np.zeros(len(TERMS))
    b[2], b[4] = patch.k1 / 2.0, patch.k2 / 2.0
    b[FREE : FREE + len(patch.coefficients)] = patch.coefficients
    return b


def _turn(angle: Array) -> Array:
    """The matrix (..., 27, 27) that takes coefficients to axes turned by `angle` about the normal.

    A turn only changes the phase of the terms z^i z'^j in z = x + iy and its conjugate z'.
    """
    (parts, from_complex), angles = _complex_terms(), np.asarray(angle)[..., None]
    rotated = from_complex * np.exp(angles * WINDING)[..., None, :]
    # Only the real part of the product is needed, so real matrices suffice.
    return np.concatenate([rotated.real, rotated.imag], axis=-1) @ parts


@cache
def _complex_terms() -> tuple[Array, NDArray[np.complex128]]:
    """The matrices that take coefficients of x^i y^j to those of z^i z'^j, and back.

    The former is its real part above the negative of its imaginary part, (54, 27); the latter is (27, 27).
    """
    at, (i, j) = nodes()[0], TERMS.T
    z = at[:, :1] + 1j * at[:, 1:]
    complex_terms: NDArray[np.complex128] = z**i * z.conj() ** j
    to_complex = np.linalg.lstsq(complex_terms, monomials(at, TERMS).astype(complex), rcond=None)[0]
    return np.vstack([to_complex.real, -to_complex.imag]), np.linalg.inv(to_complex)


@cache
def _truncation(degree: int) -> Array:
    """The matrix (m, 22) that fits terms up to `degree` to the 22 terms of degree 3 to 6 over the disk."""
    at, weights = nodes()
    basis = np.sqrt(weights)[:, None] * monomials(at, TERMS[FREE:])
    return np.linalg.lstsq(basis[:, : terms_to(degree) - FREE], basis, rcond=None)[0]


@cache
def _departures() -> Array:
    """What truncations of degree 2 to 5 leave of the terms of degree 3 to 6, (4, 22, 22)."""
    departures = np.tile(np.eye(len(TERMS) - FREE), (DEGREE - LEAST_DEGREE, 1, 1))
    for k, departure in enumerate(departures):
        truncation = _truncation(LEAST_DEGREE + k)
        departure[: len(truncation)] -= truncation
    return departures


@cache
def bent() -> Array:
    """The second derivatives of x^2, xy and y^2 in 18 directions, (18, 3)."""
    azimuths = np.pi / 18.0 * np.arange(18)
    return 2.0 * monomials(np.column_stack([np.cos(azimuths), np.sin(azimuths)]), TERMS[2:FREE])


def normal_curvature_variances(covariance: Array) -> Array:
    """Variances (18,) of the derivatives of `bent`, by the covariance (3, 3) of x^2, xy and y^2."""
    directions = bent()
    variances: Array = np.einsum("ni,ni->n", directions @ covariance, directions)
    return variances


@cache
def _normal_points() -> Array:
    """Points (2, 256) that are spread as a normal distribution: on the spiral of a sunflower."""
    rank = np.arange(256) + 0.5
    azimuths, radii = math.pi * (3.0 - math.sqrt(5.0)) * rank, np.sqrt(-2.0 * np.log(1.0 - rank / 256.0))
    return np.array([radii * np.cos(azimuths), radii * np.sin(azimuths)])


@cache
def nodes() -> tuple[Array, Array]:
    """Gauss points (56, 2) and weights (56,), on circles, that integrate products of two terms over the disk.

    Thirteen azimuths suffice. An even number is the same for either way of d1.
    """
    at, weights = np.polynomial.legendre.leggauss(4)  # type: ignore[no-untyped-call]  # The nodes are in r^2.
    azimuths = 2.0 * np.pi * np.arange(14) / 14
    radii = DISK * np.sqrt((at + 1.0) / 2.0)
    points = np.multiply.outer(radii, np.column_stack([np.cos(azimuths), np.sin(azimuths)]))
    return points.reshape(-1, 2), np.repeat(weights, 14)


def nearest_quartic(mean: Array, alpha: Array, places: Array, variances: Array) -> Array:
    """The terms of degree 1 and 2, (5,), of the quartic nearest to z over QUARTIC_SHARE of the radius."""
    (at, weights), half = _projection(), len(nodes()[1])
    of_sextic: Array = _projected_terms()[:FREE] @ mean
    return of_sextic + weights[:FREE, :half] @ weighted_kernel(at[:half], places, variances, alpha)


def _rows(x: ArrayLike, y: ArrayLike) -> Array:
    """Points (n, 2) of raveled x and y."""
    points = np.empty((*np.broadcast(x, y).shape, 2))
    points[..., 0], points[..., 1] = x, y
    return points.reshape(-1, 2)


@cache
def _projection() -> tuple[Array, Array]:
    """Points (n, 2) and weights (27, n) that take heights there to coefficients of a polynomial near these.

    Terms up to degree 2 are those of the quartic of least squares over the disk of QUARTIC_SHARE, without its
    constant. The other terms are those of least squares of what these leave over DISK.
    """
    whole, shares = nodes()
    root, count = np.sqrt(shares), len(shares)
    near = QUARTIC_SHARE / DISK * whole
    quartic = np.linalg.pinv(root[:, None] * monomials(near, QUARTIC))[1:] * root
    basis = monomials(whole, TERMS)
    rest = np.linalg.pinv(root[:, None] * basis[:, FREE:]) * root
    first = np.hstack([quartic[:FREE], np.zeros((FREE, count))])
    left = np.hstack([np.zeros((count, count)), np.eye(count)]) - basis[:, :FREE] @ first
    return np.vstack([near, whole]), np.vstack([first, rest @ left])


@cache
def _projected_terms() -> Array:
    """What the projection makes of each term, (27, 27)."""
    at, weights = _projection()
    return weights @ monomials(at, TERMS)


@cache
def _projected_kernels() -> Array:
    """Covariances (2, 27, 27) of the coefficients of a process of unit variance and each of LENGTHS."""
    at, weights = _projection()
    return np.array([weights @ values @ weights.T for values in kernels(at, at)])
