# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What contacts say of a surface and what they leave open: a Gaussian over polynomials of degree 6."""

import math
from collections.abc import Callable
from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..arguments import Array
from ..patch.monge import DEGREE, TERMS, MongePatch, monomials

ORDERS = TERMS.sum(axis=1).astype(float)
WINDING = 1j * (TERMS[:, 0] - TERMS[:, 1])  # A turn multiplies the phase of z^i z'^j, z = x + iy, by i - j.
FREE = 5  # The terms x, y, x^2, xy and y^2 have no prior.
LEAST_DEGREE = 2  # No patch has a lower degree.
DISK = 0.95  # A patch of lower degree is fitted over a disk of this radius: not all curves end at L.
ALIKE = 0.05  # Curvatures that differ by less make no directions, as in the rule of benchmarks.stability.
CONFIDENCE = 0.95  # Directions are judged with this probability.
ROUND = 12.59  # The quantile at CONFIDENCE of chi squared with six degrees of freedom.
INVISIBLE = 0.9  # A direction of which this share of the prior's variance is left is invisible.


# Spheres and planes have no difference of curvatures, no mixed second derivative and no third derivatives.
_UNLIKE_SPHERE = np.zeros((6, len(TERMS)))
_UNLIKE_SPHERE[0, [2, 4]] = -1.0, 1.0
_UNLIKE_SPHERE[range(1, 6), [3, *range(FREE, FREE + 4)]] = 1.0


class Posterior(NamedTuple):
    """A Gaussian over the heights sum b_ij x^i y^j, degree 1 to 6, in unit radius; or a stack (...) of such.

    mean : (..., 27), b_10 b_01 b_20 b_11 b_02 b_30 ...
    covariance : (..., 27, 27)
    noise : (...), standard deviation of a contact
    visibility : (..., 22, 22), upper triangular: its singular values tell how well the contacts show each
        direction among the terms of degree 3 to 6, in units of noise, for a surface of waviness 1; the
        singular values of a leading block tell that of the terms up to a lower degree
    level : (..., 28), variance of the height at the origin, and its covariances with the terms; 0 if the
        height is exact there, as at a reference point that was touched
    """

    mean: Array
    covariance: Array
    noise: Array
    visibility: Array
    level: Array

    __eq__, __hash__ = object.__eq__, object.__hash__  # type: ignore[misc]  # Arrays have no single truth value.

    def at(self, index: int | slice | NDArray[np.bool_]) -> "Posterior":
        """One posterior of the stack, or several."""
        return Posterior(*(values[index] for values in self))

    def scaled(self, factor: ArrayLike) -> "Posterior":
        """The posterior of these surfaces with every length multiplied by `factor` (...)."""
        f = np.asarray(factor)
        factors = f[..., None] ** (1.0 - ORDERS)
        covariance = factors[..., :, None] * factors[..., None, :] * self.covariance
        level = f[..., None] * np.concatenate([f[..., None], factors], axis=-1) * self.level
        return self._replace(
            mean=factors * self.mean, covariance=covariance, noise=f * self.noise, level=level
        )

    def turned(self, angle: Array) -> "Posterior":
        """The posterior of these surfaces in axes that are turned by `angle` (...) about the normal."""
        turn = _turn(angle)
        mean, level = (turn @ self.mean[..., None])[..., 0], self.level.copy()
        level[..., 1:] = (turn @ level[..., 1:, None])[..., 0]
        return self._replace(
            mean=mean, covariance=turn @ self.covariance @ np.swapaxes(turn, -1, -2), level=level
        )

    # The methods below are for a single posterior, not for a stack.

    def height_std(self, x: Array, y: Array) -> Array:
        """Standard deviations of the height at n points, (n,)."""
        basis = monomials(x, y, TERMS)
        variance = np.einsum("ni,ni->n", basis @ self.covariance, basis) + self._levels(basis, basis)
        return np.sqrt(np.maximum(variance, 0.0))

    def height_covariance(self, p: Array, q: Array) -> Array:
        """Covariances of the heights at points (..., n, 2) and (..., m, 2), (..., n, m)."""
        flat = (v.reshape(-1, 2) for v in (p, q))
        at_p, at_q = (monomials(v[:, 0], v[:, 1], TERMS) for v in flat)
        at_p, at_q = at_p.reshape(*p.shape[:-1], -1), at_q.reshape(*q.shape[:-1], -1)
        covariance: Array = (at_p @ self.covariance) @ np.swapaxes(at_q, -1, -2)
        return covariance + self._levels(at_p[..., :, None, :], at_q[..., None, :, :])

    def _levels(self, at_p: Array, at_q: Array) -> Array:
        """What the height at the origin adds to covariances (...) of heights whose terms are (..., 27)."""
        added: Array = self.level[0] + (at_p + at_q) @ self.level[1:]
        return added

    def covariances_with(self, q: Array) -> Callable[[Array], tuple[Array, Array]]:
        """A function: covariances of heights at points (..., n, 2) with those at q (m, 2), and each other."""
        return lambda p: (self.height_covariance(p, q), self.height_covariance(p, p))

    def height(self, x: Array, y: Array) -> Array:
        """The mean height at n points, (n,)."""
        return monomials(x, y, TERMS) @ self.mean

    def patch(self, degree: int) -> MongePatch:
        """The patch (1) of this degree that has the mean's curvatures and is nearest to it over the disk."""
        a = _truncation(degree) @ self.mean[FREE:]
        return MongePatch(2.0 * float(self.mean[2]), 2.0 * float(self.mean[4]), a)

    def degree_shown(self, contacts: Array) -> int:
        """The least degree whose patch is off the mean by at most half its deviation at contacts (n, 3)."""
        x, y, _ = contacts.T
        basis = monomials(x, y, TERMS)
        variance = np.einsum("ni,ni->", basis @ self.covariance, basis)
        off = basis[:, FREE:] @ (_departures() @ self.mean[FREE:]).T
        enough = np.flatnonzero(np.einsum("nk,nk->k", off, off) <= 0.25 * variance)
        return LEAST_DEGREE + int(enough[0]) if len(enough) else DEGREE

    def turn(self, confidence: float = CONFIDENCE) -> float:
        """The angle in radians that the Darboux frame is off by at most, with a probability of `confidence`.

        It is 0 if the curvatures are ALIKE with that probability, because then there are no directions.
        """
        x, y, xx, xy, yy = self.mean[:FREE].tolist()
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

        Then there are no principal directions. It is False if curvatures are not known to ALIKE.
        """
        if self.curvature_std() > ALIKE:
            return False
        apart = _UNLIKE_SPHERE @ self.mean
        told = float(apart @ np.linalg.solve(_UNLIKE_SPHERE @ self.covariance @ _UNLIKE_SPHERE.T, apart))
        return told <= ROUND

    def curvature_std(self) -> float:
        """Standard deviation of the normal curvature at the origin, in the direction where it is largest."""
        bent = _bent()
        variances = np.einsum("ni,ni->n", bent @ self.covariance[2:FREE, 2:FREE], bent)
        return math.sqrt(max(float(variances.max()), 0.0))

    def blind(self, degree: int) -> int:
        """How many directions among the terms of degree 1 to `degree` keep 90 % of their prior variance."""
        last = terms_to(degree) - FREE
        singular = np.linalg.svd(self.visibility[:last, :last], compute_uv=False)
        return int(np.count_nonzero(INVISIBLE * (1.0 + singular**2) < 1.0))


def terms_to(degree: int) -> int:
    """The number of terms of degree 1 to `degree`."""
    return (degree + 1) * (degree + 2) // 2 - 1


def coefficients_of(patch: MongePatch) -> Array:
    """The coefficients of a patch as those of the 27 terms of a Posterior, (27,)."""
    b = np.zeros(len(TERMS))
    b[2], b[4] = patch.k1 / 2.0, patch.k2 / 2.0
    b[FREE : FREE + len(patch.coefficients)] = patch.coefficients
    return b


def _turn(angle: Array) -> Array:
    """The matrix (..., 27, 27) that takes coefficients to axes turned by `angle` about the normal.

    A turn only changes the phase of the terms z^i z'^j in z = x + iy and its conjugate z'.
    """
    (parts, from_complex), angles = _complex_terms(), np.asarray(angle)[..., None]
    turned = from_complex * np.exp(angles * WINDING)[..., None, :]
    # Only the real part of the product is needed, so real matrices suffice.
    turn: Array = np.concatenate([turned.real, turned.imag], axis=-1) @ parts
    return turn


@cache
def _complex_terms() -> tuple[Array, NDArray[np.complex128]]:
    """The matrices that take coefficients of x^i y^j to those of z^i z'^j, and back.

    The former is its real part above the negative of its imaginary part, (54, 27); the latter is (27, 27).
    """
    x, y, _ = nodes()
    z, (i, j) = (x + 1j * y)[:, None], TERMS.T
    complex_terms: NDArray[np.complex128] = z**i * z.conj() ** j
    to_complex = np.linalg.lstsq(complex_terms, monomials(x, y, TERMS).astype(complex), rcond=None)[0]
    return np.vstack([to_complex.real, -to_complex.imag]), np.linalg.inv(to_complex)


@cache
def _truncation(degree: int) -> Array:
    """The matrix (m, 22) that fits terms up to `degree` to the 22 terms of degree 3 to 6 over the disk."""
    x, y, weights = nodes()
    basis = np.sqrt(weights)[:, None] * monomials(x, y, TERMS[FREE:])
    return np.linalg.lstsq(basis[:, : terms_to(degree) - FREE], basis, rcond=None)[0]


@cache
def _departures() -> Array:
    """What truncations of degree 2 to 5 leave of the terms of degree 3 to 6, (4, 22, 22)."""
    size = terms_to(DEGREE) - FREE
    departures = np.tile(np.eye(size), (DEGREE - LEAST_DEGREE, 1, 1))
    for k, departure in enumerate(departures):
        truncation = _truncation(LEAST_DEGREE + k)
        departure[: len(truncation)] -= truncation
    return departures


@cache
def _bent() -> Array:
    """The second derivatives of x^2, xy and y^2 in 18 directions, (18, 3)."""
    azimuths = np.pi / 18.0 * np.arange(18)
    return 2.0 * monomials(np.cos(azimuths), np.sin(azimuths), TERMS[2:FREE])


@cache
def _normal_points() -> Array:
    """Points (2, 256) that are spread as a normal distribution: on the spiral of a sunflower."""
    rank = np.arange(256) + 0.5
    azimuths, radii = math.pi * (3.0 - math.sqrt(5.0)) * rank, np.sqrt(-2.0 * np.log(1.0 - rank / 256.0))
    return np.array([radii * np.cos(azimuths), radii * np.sin(azimuths)])


@cache
def nodes() -> tuple[Array, Array, Array]:
    """x, y and weights (56,) that integrate products of two terms over the disk: Gauss nodes on circles.

    Thirteen azimuths suffice. An even number is the same for either way of d1.
    """
    at, weights = np.polynomial.legendre.leggauss(4)  # type: ignore[no-untyped-call]  # The nodes are in r^2.
    azimuths = 2.0 * np.pi * np.arange(14) / 14
    radii = DISK * np.sqrt((at + 1.0) / 2.0)
    x, y = np.outer(radii, np.cos(azimuths)).ravel(), np.outer(radii, np.sin(azimuths)).ravel()
    return x, y, np.repeat(weights, 14)
