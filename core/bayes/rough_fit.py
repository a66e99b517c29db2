# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The joint fit where contacts ask for a residual: the frame, curvatures and polynomial of the surface.

A real surface has different curvatures at each scale, and those at the point itself belong to its texture.
The patch has the curvatures of the quartic that is nearest to sextic and residual over a disk of
QUARTIC_SHARE. Compared with dense fits of the scans, they are off at most half as far as those of the sextic
fitted to the contacts alone, and their intervals are true. If contacts are off that sextic by less than
MISFIT, as on a smooth surface whose mesh has facets, its frame and curvatures are kept, because it averages
the facets.
"""

from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..arguments import Array
from ..patch import residual as beside
from ..patch.monge import TERMS, exponents, monomials
from ..patch.residual import Residual, kernel, kernels, weighted_kernel, whitened
from .joint_fit import MISFIT, turned
from .posterior import DISK, FREE, Posterior, nodes
from .residual_evidence import (
    ROUGH_MISFIT,
    Observations,
    Sizes,
    System,
    fitted,
    mean_given,
    sizes,
    system_of,
)

# benchmarks.real chose these.
UNEXPLAINED_MISFIT = 1.3  # A sextic does not explain contacts that are off it by more times their noise.
QUARTIC_SHARE = 0.6  # Share of the radius; 0.8 takes in what says nothing of the point.


class RoughFit(NamedTuple):
    """The fits of b touches.

    turns : (b, 3, 3), columns d1, d2, n in the frame given; scales : (b,), the new radii in its unit
    posterior, residuals : in the new frames and units
    """

    turns: Array
    scales: Array
    posterior: Posterior
    residuals: list[Residual | None]


def rough_fit(
    contacts: Array,
    weights: Array,
    posterior: Posterior,
    noise: Array,
    told: NDArray[np.bool_],
    tangent: Array,
    ranks: NDArray[np.intp],
    normals: Array | None = None,
    through: bool = True,
) -> RoughFit:
    """The fits of b touches, with a residual where their contacts ask for one, and unchanged elsewhere.

    contacts : (b, n, 3), in unit radius and in the Darboux frame of the sextic
    weights : (b, n), 0 where there is none
    posterior : the stack of the sextics that were fitted to them
    noise : (b,), standard deviation of a contact, at least
    told : (b,), whether this is known to be all of the noise
    tangent : (b, 3), which d1 is to follow
    ranks : (b, n), of the contacts on each half of a curve, and of those beside
    normals : (b, n, 3), measured normals over their standard deviation; they act on the terms alone
    through : whether the origin was touched
    """
    b = len(contacts)
    found = RoughFit(np.eye(3)[None].repeat(b, axis=0), np.ones(b), posterior, [None] * b)
    missed = _misfit(contacts, weights, posterior)
    candidates = np.flatnonzero(missed.rms > UNEXPLAINED_MISFIT * np.maximum(noise, ROUGH_MISFIT))
    if not len(candidates):
        return found
    found = found._replace(posterior=Posterior(*(values.copy() for values in posterior)))
    for i in candidates.tolist():
        there, least = weights[i] > 0.0, max(float(noise[i]), ROUGH_MISFIT)
        # The point is a contact like the others: on facets it may be off as far.
        point = np.zeros((int(through), 3))
        touch = Observations(
            np.vstack([contacts[i][there], point]),
            np.append(weights[i][there], np.ones(len(point))),
            least,
            max(float(posterior.noise[i]), least),
            None if normals is None else np.vstack([normals[i][there], point]),
            np.append(ranks[i][there], np.zeros(len(point), dtype=np.intp)),
        )
        system = system_of(touch)
        size = sizes(touch, system)
        if not (size.asked or (told[i] and _is_texture(missed.off[i][there], float(noise[i])))):
            continue
        if missed.rms[i] <= MISFIT:
            beside_sextic = fitted(touch, system, size.variances, size.noise)
            beside_sextic.mean[: len(TERMS)] -= found.posterior.mean[i]
            found.residuals[i] = beside_sextic
        else:
            _settle(found, i, touch, system, size, tangent[i])
    return found


class _Misfit(NamedTuple):
    """How far contacts are off their sextics: |dz| (..., n), and its root mean square (...)."""

    off: Array
    rms: Array


def _misfit(contacts: Array, weights: Array, posterior: Posterior) -> _Misfit:
    """The misfits of b touches of contacts (b, n, 3) with weights (b, n)."""
    flat = contacts.reshape(-1, 3)
    basis = monomials(flat[:, 0], flat[:, 1], TERMS).reshape(*weights.shape, -1)
    off = np.abs(contacts[..., 2] - (basis @ posterior.mean[..., None])[..., 0])
    return _Misfit(off, np.sqrt((weights * off**2).sum(axis=1) / np.maximum(weights.sum(axis=1), 1.0)))


def _is_texture(off: Array, noise: float) -> bool:
    """Whether most contacts of a touch, |dz| (n,) off their sextic, are off by more than noise and MISFIT.

    Neither white noise nor outliers would explain that, and the sextic's deviation would not know of it.
    """
    return 1.4826 * float(np.median(off)) > max(UNEXPLAINED_MISFIT * noise, MISFIT)


def _settle(
    found: RoughFit, place: int, touch: Observations, system: System, size: Sizes, tangent: Array
) -> None:
    """Fits a touch, then again in the frame that the first fit shows, and puts the latter into `found`."""
    (at, weights), half = _projection(), len(nodes()[2])
    first, places = mean_given(touch, system, size), touch.contacts[system.places, :2]
    mean = _terms()[:FREE] @ first[: len(TERMS)]
    mean += weights[:FREE, :half] @ weighted_kernel(at[:half], places, size.variances, first[len(TERMS) :])
    turn = turned(np.eye(3), mean, tangent)[0]
    scale = float(np.hypot(*(touch.contacts @ turn)[:, :2].T).max())
    touch = touch.moved(turn, scale)
    second = fitted(touch, system_of(touch), size.variances / scale**2, size.noise / scale)
    found.turns[place], found.scales[place] = turn, scale
    _put(found, place, second)


def _put(found: RoughFit, place: int, residual: Residual) -> None:
    """Puts a fit into `found`: the polynomial nearest to it, its covariance, and the residual beside it."""
    (at, weights), terms = _projection(), _terms()
    told = weights @ kernel(at, residual.places, residual.variances)
    mean = np.hstack([terms, told]) @ residual.mean
    _, k1, k2, _ = turned(np.eye(3), mean, np.eye(3)[0])
    mean[:FREE] = 0.0, 0.0, k1 / 2.0, 0.0, k2 / 2.0
    residual.mean[: len(TERMS)] -= mean
    told, left = whitened(residual.places_factor, residual.factor, terms.T, told.T)
    own = sum(map(np.multiply, residual.variances, _own(tuple(beside.LENGTHS))))
    found.posterior.mean[place], found.posterior.noise[place] = mean, residual.noise
    found.posterior.covariance[place] = own + left.T @ left - told.T @ told
    found.residuals[place] = residual


@cache
def _projection() -> tuple[Array, Array]:
    """Points (n, 2) and weights (27, n) that take heights there to coefficients of the nearest polynomial.

    Terms up to degree 2 are those of the nearest quartic over the disk of QUARTIC_SHARE. The other terms are
    nearest to what these leave over DISK.
    """
    x, y, shares = nodes()
    whole, root = np.column_stack([x, y]), np.sqrt(shares)
    near = QUARTIC_SHARE / DISK * whole
    quartic = np.linalg.pinv(root[:, None] * monomials(near[:, 0], near[:, 1], exponents(0, 4)))[1:] * root
    basis = monomials(x, y, TERMS)
    rest = np.linalg.pinv(root[:, None] * basis[:, FREE:]) * root
    first = np.hstack([quartic[:FREE], np.zeros((FREE, len(x)))])
    left = np.hstack([np.zeros((len(x), len(x))), np.eye(len(x))]) - basis[:, :FREE] @ first
    return np.vstack([near, whole]), np.vstack([first, rest @ left])


@cache
def _terms() -> Array:
    """What the projection makes of each term, (27, 27)."""
    (x, y), weights = _projection()[0].T, _projection()[1]
    return weights @ monomials(x, y, TERMS)


@cache
def _own(lengths: tuple[float, ...]) -> Array:
    """Covariances (2, 27, 27) of the coefficients of a residual of unit variance and each of the lengths."""
    assert lengths == tuple(beside.LENGTHS)
    at, weights = _projection()
    return np.array([weights @ values @ weights.T for values in kernels(at, at)])
