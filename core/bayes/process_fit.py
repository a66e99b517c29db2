# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The fit with a process, where evidence favors it: a Gaussian process with explicit basis functions.

A real surface has different curvatures at each scale, and those at the point itself belong to its texture.
So its frame and curvatures are those of the quartic that is nearest to z over a disk (SurfacePosterior's
`polynomial`). Compared with dense fits of the scans, their errors are at most half those of the sextic fitted
without a process, and their intervals are true. If contacts are off that sextic by less than MISFIT, as on a
smooth surface whose mesh has facets, its frame and curvatures are kept, because it averages the facets.
"""

from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..arguments import Array
from ..lapack import cholesky, inverse_lower, solved, solved_definite
from ..patch.monge import PARTIALS, TERMS, derived_monomials, monomials
from .evidence import Hyperparameters, process_hyperparameters
from .joint_fit import MISFIT, Observations, frame_update
from .kernel import derived_kernel, kernels, places_factor
from .normals import slope_equations
from .posterior import SurfacePosterior, nearest_quartic

# Chosen with benchmarks.real.
PROCESS_MISFIT = 5e-4  # With a process the noise is at least this share of the radius: facets and rounding.
UNEXPLAINED_MISFIT = 1.3  # A sextic does not explain contacts that are off it by more times their noise.
MOST_PLACES = 150  # At most about this many contacts carry a process and show how large it is.


class ProcessData(NamedTuple):
    """The equations of a touch with a process, in unit radius and in a frame near to its Darboux frame.

    contacts : (n, 3); roots : (n,), of their weights; normals : (n, 3), or (0, 3) without
    places : (m,), indices of the contacts that carry the process
    basis : (n, 27), terms at the contacts
    kernels : (n, m) each, kernels of unit variance between contacts and places
    """

    contacts: Array
    roots: Array
    normals: Array
    places: NDArray[np.intp]
    basis: Array
    kernels: list[Array]

    def at_places(self) -> tuple[Array, list[Array]]:
        """Terms and heights (28, m), and kernels (m, m), of the places, times the roots of their weights."""
        at, root = self.places, self.roots[self.places]
        within = self.kernels if len(at) == len(self.roots) else [k[at] for k in self.kernels]
        if root.min() < 1.0:  # In most cases there is none, and this saves a copy.
            within = [root[:, None] * k * root for k in within]
        return np.vstack([self.basis[at].T, self.contacts[at, 2]]) * root, within

    def moved(self, turn: Array, scale: float) -> "ProcessData":
        """These equations in the axes `turn` (3, 3), with lengths divided by `scale`."""
        return process_data(self.contacts @ turn / scale, self.roots, self.normals @ turn, self.places)


def process_data(contacts: Array, roots: Array, normals: Array, places: NDArray[np.intp]) -> ProcessData:
    """The equations of a touch with these contacts, roots of weights, normals and places."""
    flat = contacts[:, :2]
    return ProcessData(contacts, roots, normals, places, monomials(flat, TERMS), kernels(flat, flat[places]))


def process_fit(
    given: Observations,
    weights: Array,
    posterior: SurfacePosterior,
    residuals: Array,
    ranks: Callable[[int], NDArray[np.intp]],
    offsets: Array,
) -> tuple[Array, Array, list[SurfacePosterior]]:
    """The fits of b touches, with a process where the evidence favors one, and unchanged elsewhere.

    given : in the Darboux frames of the sextics, whose posteriors are a stack
    weights : (b, n), 0 where there is no contact; residuals : (b, n), those of the sextics
    ranks : gives those (n,) of a touch's contacts on each half of a curve, from the rim, and of strokes
    offsets : (b,), the height of the reference point above the origin

    Returns the columns d1, d2, n (b, 3, 3) in the frame given, the new radii (b,) in its unit, and the
    posteriors in the new frames and units.
    """
    b, least = len(weights), np.maximum(given.noise, PROCESS_MISFIT)
    turns, scales, fits = np.eye(3)[None].repeat(b, axis=0), np.ones(b), [posterior.at(i) for i in range(b)]
    off, most = np.abs(residuals), np.maximum(posterior.noise, least)
    rms = np.sqrt((weights * off**2).sum(axis=1) / np.maximum(weights.sum(axis=1), 1.0))
    for i in np.flatnonzero(rms > UNEXPLAINED_MISFIT * least):
        present = np.flatnonzero(weights[i])
        data = _with_point(given, weights[i], ranks(int(i)), float(offsets[i]), int(i))
        carried = data.at_places()
        hyper, use_gp = process_hyperparameters(*carried, float(least[i]), float(most[i]))
        if not (use_gp or (given.noise_is_known[i] and _is_texture(off[i, present], float(given.noise[i])))):
            continue
        if rms[i] <= MISFIT:  # The polynomial averages facets, so its frame is kept.
            fits[i] = replace(process_posterior(data, hyper, posterior.visibility[i]), sextic=fits[i])
            continue
        quartic = nearest_quartic(
            *_mean_given(data, hyper, *carried), data.contacts[data.places, :2], hyper.process
        )
        turns[i] = frame_update(np.eye(3), quartic, given.tangent[i])[0]
        scales[i] = np.hypot(*(data.contacts @ turns[i])[:, :2].T).max()
        hyper = hyper._replace(noise=hyper.noise / scales[i], process=hyper.process / scales[i] ** 2)
        fits[i] = process_posterior(data.moved(turns[i], scales[i]), hyper, posterior.visibility[i])
    return turns, scales, fits


def _with_point(
    given: Observations, weights: Array, ranks: NDArray[np.intp], offset: float, i: int
) -> ProcessData:
    """Touch i of a stack with the reference point, which is a contact like the others.

    On facets its residual may be as large. weights, ranks : (n,), those of `process_fit`
    """
    present, point = np.flatnonzero(weights), np.array([[0.0, 0.0, offset]])
    normals = (
        given.normals[i] if not given.normals.size else np.vstack([given.normals[i][present], 0.0 * point])
    )
    least = max(given.noise[i], PROCESS_MISFIT)
    roots = np.sqrt(np.append(weights[present], (least / max(least, given.point_std[i])) ** 2))
    rank, n = np.append(ranks[present], 0), len(roots)
    # Places are spread on each half of a curve, whichever way it runs and whichever curve is the first.
    places = np.flatnonzero(rank * min(n, MOST_PLACES) % n < MOST_PLACES)
    return process_data(np.vstack([given.contacts[i, present], point]), roots, normals, places)


def _is_texture(off: Array, noise: float) -> bool:
    """Whether most contacts of a touch, |dz| (n,) off their sextic, are off by more than noise and MISFIT.

    Neither white noise nor outliers would explain that, and the sextic's deviation would not cover it.
    Without this, patches of rough meshes end after one face (test_enough).
    """
    return 1.4826 * float(np.median(off)) > max(UNEXPLAINED_MISFIT * noise, MISFIT)


def _mean_given(
    data: ProcessData, hyper: Hyperparameters, rows: Array, kernels: list[Array]
) -> tuple[Array, Array]:
    """The mean (27,) of the coefficients, and alpha (m,), of a SurfacePosterior.

    One Cholesky factor (Rasmussen and Williams 2006, 2.7) is enough if each contact is a place and no normal
    is measured.

    rows, kernels : of `at_places`
    """
    if len(data.normals) or len(data.places) < len(data.roots):
        of_process = process_posterior(data, hyper, np.empty(0))
        return of_process.mean, of_process.alpha
    matrix = (rows[:-1].T * hyper.prior) @ rows[:-1]
    matrix += hyper.process[0] * kernels[0] + hyper.process[1] * kernels[1]
    matrix.flat[:: len(matrix) + 1] += hyper.noise**2
    solution = solved_definite(matrix, rows[-1])
    return hyper.prior * (rows[:-1] @ solution), data.roots * solution


def process_posterior(data: ProcessData, hyper: Hyperparameters, visibility: Array) -> SurfacePosterior:
    """The posterior of a touch.

    The unknowns are the coefficients of the terms and of L^-1 k(u, p), because the latter have the prior
    precision 1, which makes the system well-conditioned.
    """
    index, terms = data.places, len(TERMS)
    to_points = hyper.process[0] * data.kernels[0] + hyper.process[1] * data.kernels[1]
    factor = places_factor(to_points[index])
    # If each contact is a place, the features are the factor itself.
    carried = factor if len(index) == len(to_points) else solved(factor, to_points.T).T
    features = np.hstack([data.basis, carried]) * (data.roots / hyper.noise)[:, None]
    heights, at = data.contacts[:, 2] * data.roots / hyper.noise, data.contacts[index, :2]
    if len(data.normals):
        slopes, steepness = _slopes(data, factor, at, hyper.process)
        features, heights = np.vstack([features, slopes]), np.append(heights, steepness)
    precision = features.T @ features
    precision.flat[:: len(precision) + 1] += np.append(1.0 / hyper.prior, np.ones(len(index)))
    inverse = inverse_lower(cholesky(precision))
    mean = inverse.T @ (inverse @ (features.T @ heights))
    root = np.insert(inverse, terms, 0.0, axis=1)  # The feature 1 has no part: the point is a contact.
    alpha = solved(factor, mean[terms:], transposed=True)
    posterior = SurfacePosterior(
        mean[:terms], root, np.array(hyper.noise), visibility, at, alpha, hyper.process
    )
    vars(posterior)["_places_factor"] = factor  # This saves finding it again.
    return posterior


def _slopes(data: ProcessData, factor: Array, places: Array, variances: Array) -> tuple[Array, Array]:
    """What measured normals show of the features, as `slope_equations` has it, (2n, 27 + m) and (2n,).

    They are derivative observations (Rasmussen and Williams 2006, 9.4) of the surface that the places carry.
    """
    of_process = derived_kernel(data.contacts[:, :2], places, variances)[1:3]
    carried = solved(factor, of_process.reshape(-1, len(places)).T).T.reshape(of_process.shape)
    of_terms = derived_monomials(data.contacts, TERMS, PARTIALS[1:3])
    partials = np.concatenate([of_terms, carried], axis=2)[:, None]
    (slopes,), (steepness,) = slope_equations(
        data.normals[None], data.contacts[None], data.roots[None] ** 2, partials
    )
    return slopes, steepness
