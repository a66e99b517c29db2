# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The fit with a process, where contacts ask for it: a Gaussian process with explicit basis functions.

A real surface has different curvatures at each scale, and those at the point itself belong to its texture.
So its frame and curvatures are those of the quartic that is nearest to z over a disk (SurfacePosterior's
`polynomial`). Compared with dense fits of the scans, they are off at most half as far as those of the sextic
fitted to the contacts alone, and their intervals are true. If contacts are off that sextic by less than
MISFIT, as on a smooth surface whose mesh has facets, its frame and curvatures are kept, because it averages
the facets.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..arguments import Array
from ..lapack import cholesky, inverse_lower, solved, solved_definite
from ..patch.monge import TERMS, monomials
from .evidence import ProcessHyperparameters, process_hyperparameters, process_prior
from .joint_fit import MISFIT, turned
from .kernel import kernel_slopes, kernels, places_factor
from .normals import slope_equations, term_slopes
from .posterior import SurfacePosterior, nearest_quartic

# Chosen with benchmarks.real.
PROCESS_MISFIT = 5e-4  # Beside a process the noise is at least this share of the radius: facets and rounding.
UNEXPLAINED_MISFIT = 1.3  # A sextic does not explain contacts that are off it by more times their noise.
MOST_PLACES = 150  # About so many contacts at most carry a process and tell how large it is.


class ProcessFit(NamedTuple):
    """The fits of b touches.

    turns : (b, 3, 3), columns d1, d2, n in the frame given; scales : (b,), the new radii in its unit
    posteriors : in the new frames and units
    """

    turns: Array
    scales: Array
    posteriors: list[SurfacePosterior]


class Observations(NamedTuple):
    """What a touch has felt, in unit radius and in a frame near to its Darboux frame.

    contacts : (n, 3)
    weights : (n,), above 0
    least, most : bounds of the contacts' noise
    normals : (n, 3), measured normals over their standard deviation; None if there are none
    ranks : (n,), of the contacts on each half of a curve, from the rim, and of those beside
    """

    contacts: Array
    weights: Array
    least: float
    most: float
    normals: Array | None
    ranks: NDArray[np.intp]

    def moved(self, turn: Array, scale: float) -> "Observations":
        """This touch in the axes `turn` (3, 3), with lengths divided by `scale`."""
        return self._replace(
            contacts=self.contacts @ turn / scale,
            least=self.least / scale,
            most=self.most / scale,
            normals=None if self.normals is None else self.normals @ turn,
        )


class Equations(NamedTuple):
    """What the fits of a touch with a process are made of.

    basis : (n, 27), terms at the contacts; heights : (n,); roots : (n,), of the weights
    places : (m,), indices of the contacts that carry the process
    kernels : (n, m) each, kernels of unit variance between contacts and places
    """

    basis: Array
    heights: Array
    roots: Array
    places: NDArray[np.intp]
    kernels: list[Array]

    def at_places(self) -> tuple[Array, list[Array]]:
        """Terms and heights (28, m), and kernels (m, m), of the places, each times the root of its weight."""
        root = self.roots[self.places]
        rows = np.vstack([self.basis[self.places].T, self.heights[self.places]])
        if len(root) == len(self.roots) and root.min() == 1.0:  # This saves a copy.
            return rows, self.kernels
        return rows * root, [root[:, None] * k[self.places] * root for k in self.kernels]


def equations_of(touch: Observations) -> Equations:
    """The equations of a touch."""
    flat = touch.contacts[:, :2]
    basis = monomials(flat[:, 0], flat[:, 1], TERMS)
    # They are evenly spread on each half of a curve, whichever way it runs and whichever curve is the first.
    places = np.flatnonzero(touch.ranks * min(len(flat), MOST_PLACES) % len(flat) < MOST_PLACES)
    return Equations(basis, touch.contacts[:, 2], np.sqrt(touch.weights), places, kernels(flat, flat[places]))


def process_fit(
    contacts: Array,
    weights: Array,
    posterior: SurfacePosterior,
    noise: Array,
    noise_is_known: NDArray[np.bool_],
    tangent: Array,
    ranks: NDArray[np.intp],
    normals: Array | None = None,
    through: bool = True,
) -> ProcessFit:
    """The fits of b touches, with a process where their contacts ask for one, and unchanged elsewhere.

    contacts : (b, n, 3), in unit radius and in the Darboux frame of the sextic
    weights : (b, n), 0 where there is none
    posterior : the stack of the sextics that were fitted to them
    noise : (b,), standard deviation of a contact, at least
    noise_is_known : (b,), whether this is known to be all of the noise
    tangent : (b, 3), which d1 is to follow
    ranks : (b, n), of the contacts on each half of a curve, and of those beside
    normals : (b, n, 3), measured normals over their standard deviation
    through : whether the origin was touched
    """
    b = len(contacts)
    found = ProcessFit(np.eye(3)[None].repeat(b, axis=0), np.ones(b), [posterior.at(i) for i in range(b)])
    off, rms = _misfit(contacts, weights, posterior)
    candidates = np.flatnonzero(rms > UNEXPLAINED_MISFIT * np.maximum(noise, PROCESS_MISFIT))
    for i in candidates.tolist():
        there, least = weights[i] > 0.0, max(float(noise[i]), PROCESS_MISFIT)
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
        equations = equations_of(touch)
        hyper = process_hyperparameters(*equations.at_places(), touch.least, touch.most)
        if not (hyper.use_gp or (noise_is_known[i] and _is_texture(off[i][there], float(noise[i])))):
            continue
        sextic = posterior.at(i) if rms[i] <= MISFIT else None
        if sextic is None:
            turn, scale = _frame(touch, equations, hyper, tangent[i])
            found.turns[i], found.scales[i], touch = turn, scale, touch.moved(turn, scale)
            equations = equations_of(touch)
            hyper = hyper._replace(variances=hyper.variances / scale**2, noise=hyper.noise / scale)
        found.posteriors[i] = process_posterior(touch, equations, hyper, posterior.visibility[i], sextic)
    return found


def _misfit(contacts: Array, weights: Array, posterior: SurfacePosterior) -> tuple[Array, Array]:
    """How far contacts (b, n, 3) are off their sextics: |dz| (b, n), and its root mean square (b,)."""
    flat = contacts.reshape(-1, 3)
    basis = monomials(flat[:, 0], flat[:, 1], TERMS).reshape(*weights.shape, -1)
    off = np.abs(contacts[..., 2] - (basis @ posterior.mean[..., None])[..., 0])
    return off, np.sqrt((weights * off**2).sum(axis=1) / np.maximum(weights.sum(axis=1), 1.0))


def _is_texture(off: Array, noise: float) -> bool:
    """Whether most contacts of a touch, |dz| (n,) off their sextic, are off by more than noise and MISFIT.

    Neither white noise nor outliers would explain that, and the sextic's deviation would not cover it.
    """
    return 1.4826 * float(np.median(off)) > max(UNEXPLAINED_MISFIT * noise, MISFIT)


def _frame(
    touch: Observations, equations: Equations, hyper: ProcessHyperparameters, tangent: Array
) -> tuple[Array, float]:
    """The Darboux frame (3, 3) of the surface that a touch shows, and the radius in it."""
    mean, alpha = _mean_given(touch, equations, hyper)
    places = touch.contacts[equations.places, :2]
    turn = turned(np.eye(3), nearest_quartic(mean, places, hyper.variances, alpha), tangent)[0]
    return turn, float(np.hypot(*(touch.contacts @ turn)[:, :2].T).max())


def _mean_given(
    touch: Observations, equations: Equations, hyper: ProcessHyperparameters
) -> tuple[Array, Array]:
    """The mean (27,) of the terms, and alpha (m,), of a SurfacePosterior, by one Cholesky factor."""
    if touch.normals is not None or len(equations.places) < len(touch.weights):
        found = process_posterior(touch, equations, hyper, np.empty(0))
        return found.mean, found.alpha
    (rows, (one, other)), prior = equations.at_places(), process_prior()
    matrix = (rows[:-1].T * prior) @ rows[:-1]
    matrix += hyper.variances[0] * one + hyper.variances[1] * other
    matrix.flat[:: len(matrix) + 1] += hyper.noise**2
    solution = solved_definite(matrix, rows[-1])
    return prior * (rows[:-1] @ solution), equations.roots * solution


def process_posterior(
    touch: Observations,
    equations: Equations,
    hyper: ProcessHyperparameters,
    visibility: Array,
    sextic: SurfacePosterior | None = None,
) -> SurfacePosterior:
    """The posterior given the variances of the process and the noise.

    visibility, sextic : as in SurfacePosterior

    The unknowns are the coefficients of the terms and of L^-1 k(u, p), because the latter have the prior
    precision 1, which makes the system well-conditioned.
    """
    index, terms = equations.places, len(TERMS)
    to_points = hyper.variances[0] * equations.kernels[0] + hyper.variances[1] * equations.kernels[1]
    places = places_factor(to_points[index])
    # If each contact is a place, the features are the factor itself.
    whole = len(index) == len(to_points)
    features = np.hstack([equations.basis, places if whole else solved(places, to_points.T).T])
    weighted = features * (equations.roots / hyper.noise)[:, None]
    precision = weighted.T @ weighted
    rhs = weighted.T @ (equations.heights * equations.roots / hyper.noise)
    precision.flat[:: len(precision) + 1] += np.append(1.0 / process_prior(), np.ones(len(index)))
    if touch.normals is not None:
        slopes, steepness = _slopes(touch, places, touch.contacts[index, :2], hyper.variances)
        precision += slopes.T @ slopes
        rhs += slopes.T @ steepness
    inverse = inverse_lower(cholesky(precision))
    mean = inverse.T @ (inverse @ rhs)
    alpha = solved(places, mean[terms:], transposed=True)
    root = np.zeros((len(inverse), len(inverse) + 1))  # The feature 1 has no part: the point is a contact.
    root[:, :terms], root[:, terms + 1 :] = inverse[:, :terms], inverse[:, terms:]
    noise, at = np.array(hyper.noise), touch.contacts[index, :2]
    found = SurfacePosterior(mean[:terms], root, noise, visibility, at, alpha, hyper.variances, sextic)
    vars(found)["_places_factor"] = places  # This saves finding it again.
    return found


def _slopes(touch: Observations, factor: Array, places: Array, variances: Array) -> tuple[Array, Array]:
    """What measured normals show of the features, as `slope_equations` has it, (2n, 27 + m) and (2n,).

    They are derivative observations (Rasmussen and Williams 2006, 9.4) of the surface that the places carry.
    """
    assert touch.normals is not None
    of_process = kernel_slopes(touch.contacts[:, :2], places, variances)
    carried = solved(factor, of_process.reshape(-1, len(places)).T).T.reshape(of_process.shape)
    partials = np.concatenate([term_slopes(touch.contacts), carried], axis=2)[:, None]
    given = touch.normals[None], touch.contacts[None], touch.weights[None]
    (slopes,), (steepness,) = slope_equations(*given, partials)
    return slopes, steepness
