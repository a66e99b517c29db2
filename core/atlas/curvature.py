# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Curvatures of the joined surface, by quadrics that are as wide as its deviation requires.

Not in the paper. The gradient of a quadric is linear, so its normals are n0 - W x along the tangent plane
near a place, where W is the Weingarten map. It is fitted to the normals of the mesh there by weighted least
squares. For a ball that is exact at any width; heights would need terms beyond those of a quadric.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..arguments import Array
from ..triangles import LEAST_DIVISOR, normalized, row_dot, triangle_cross
from .connectivity import Indices, keyed_sides
from .meshing import Mesh

# python -m benchmarks.atlas --only ring and --only egg chose these.
SAGITTA = 80.0  # A quadric is so wide that its sagitta is this many deviations of the surface.
LEAST = 2.0  # The least radius, in edges of the mesh; the sagitta follows from a quadric twice as wide.
# It is fitted to every other vertex, in random order, to the nearest 128 at most and 6 at least.
EVERY, PLACES, FEWEST = 2, 128, 6
SHARP = 0.87  # Triangles on both sides of a crease are turned by 30 degrees, and a border at a corner.
TURNED = 0.966  # Normals on both sides of a crease are turned by 15 degrees, half of what its triangles are.
# Places are on one sheet if the cosine between their normals is more, and if the sum of both has at most the
# share ACROSS of the way between them, which is 0 on a ball.
LEAST_COSINE, ACROSS = 0.5, 0.5
BESIDE, CANDIDATES = 3.0, 16  # Beside a crease a wall is shown as at one of 16 vertices within 3 LEAST edges.
BY_STD, BY_MISFIT = 0.9, 0.4  # The shares of the surface's deviation and of the misfit in that of H.
LEAST_SQUARE = 1e-9  # So much, in unit radius, is added to the squares, because places may be in a row.


class NormalSamples(NamedTuple):
    """The mesh of a surface as places to which quadrics are fitted.

    tree : the KD-tree of n places
    normals, stds : (n, 3) and (n,), the normals there and the deviations of the surface
    ends : the KD-tree of the vertices on creases and rims
    edge : the length of the mesh's edges
    """

    tree: Any
    normals: Array
    stds: Array
    ends: Any
    edge: float


class Curvatures(NamedTuple):
    """Gaussian and mean curvature, and their standard deviations, (n,) each; 0 and inf where unknown."""

    gauss: Array
    mean: Array
    gauss_std: Array
    mean_std: Array


def sheets_of(mesh: Mesh, normals: Array) -> NormalSamples:
    """The places and the ends of a mesh; `normals` (n, 3) are those of the surface at its vertices."""
    from scipy.spatial import cKDTree

    # In the order of a mesh every other vertex may be on one of two walls.
    some = np.random.default_rng(0).permutation(len(normals))[::EVERY]
    ends = cKDTree(mesh.vertices[np.unique(_ends(mesh, mesh.normals))])
    return NormalSamples(cKDTree(mesh.vertices[some]), normals[some], mesh.std[some], ends, mesh.edge)


def _ends(mesh: Mesh, normals: Array) -> Indices:
    """The edges (k, 2) of a mesh on its rims, and those where its triangles and the normals (n, 3) turn.

    A folded triangle does not turn the normals at its corners, which are those of larger triangles, too.
    """
    sides, keys = keyed_sides(mesh.triangles, len(mesh.vertices))
    order = np.argsort(keys, kind="stable")  # It is the fastest here.
    first = np.flatnonzero(np.diff(keys[order]) == 0)
    pairs = np.stack([order[first], order[first + 1]])
    across = normalized(triangle_cross(mesh.vertices[mesh.triangles]))
    opposite = np.roll(mesh.triangles, -2, axis=1).ravel()[pairs]  # The corners that are not on the side.
    is_end = np.ones(len(sides), dtype=bool)
    is_end[pairs] = (row_dot(*across[pairs // 3]) < SHARP) & (row_dot(*normals[opposite]) < TURNED)
    return sides[is_end]


def curvatures_of(sheets: NormalSamples, points: Array, normals: Array) -> Curvatures:
    """The curvatures at points (n, 3) of the surface with unit normals (n, 3).

    They are unknown where a crease or a rim is nearer than the least radius, and where no surface is near.
    """
    distance, at = sheets.tree.query(points, min(PLACES, sheets.tree.n))
    least, ends = LEAST * sheets.edge, sheets.ends.query(points)[0]
    most = np.maximum(np.minimum(ends, distance[:, -1]), least)
    distance, local = _neighborhoods(sheets, points, normals, distance, at)
    std = sheets.stds[at[:, 0]]
    near = np.minimum(2.0 * least, most)
    gauss, mean, _ = _fit_weingarten(distance, local, near)
    largest = np.abs(mean) + np.sqrt(np.maximum(mean**2 - gauss, 0.0))
    largest = np.maximum(largest, LEAST_DIVISOR)
    radius = np.sqrt(np.minimum(2.0 * SAGITTA * std, largest * most**2) / largest).clip(least, most)
    determined = (ends >= least) & ((distance < near[:, None]).sum(axis=1) >= FEWEST) & np.isfinite(std)
    gauss, mean, misfit = (
        np.where(determined, values, 0.0) for values in _fit_weingarten(distance, local, radius)
    )
    mean_std = np.where(determined, np.hypot(BY_STD * std / radius, BY_MISFIT * misfit) / radius, np.inf)
    # For errors of heights that are alike in all directions, the variances of z_xx, z_yy and z_xy are as
    # 3 : 3 : 1 and the covariance of the first two as 1, so that of H is as 2.
    gauss_std = mean_std * np.sqrt(6.0 * mean**2 - 2.0 * gauss + 3.0 * mean_std**2)
    return Curvatures(gauss, mean, gauss_std, mean_std)


def _neighborhoods(
    sheets: NormalSamples, points: Array, normals: Array, distance: Array, at: Array
) -> tuple[Array, Array]:
    """Distances (n, k) of the places `at` (n, k), inf on other sheets, and these places in local terms.

    Those are (n, k, 4): two coordinates along the tangent plane, and two components of the normal.
    """
    off, ups = sheets.tree.data[at] - points[:, None], sheets.normals[at]
    alike = np.einsum("nki,ni->nk", ups, normals) > LEAST_COSINE
    across = np.abs(row_dot(off, ups + normals[:, None]))
    x = normalized(np.cross(normals, np.eye(3)[np.abs(normals).argmin(axis=1)]))
    plane = np.stack([x, np.cross(normals, x)], axis=2)
    distance = np.where(alike & (across <= ACROSS * distance), distance, np.inf)
    return distance, np.concatenate([off @ plane, ups @ plane], axis=2)


def vertices_shown(
    points: Array, normals: Array, known: NDArray[np.bool_], corners: Indices, facing: Array, edge: float
) -> Indices:
    """For each corner of a mesh's faces the vertex whose curvatures its wall has there, (k,); -1 for none.

    Where they are unknown, beside a crease, it is the nearest vertex whose normal is most like the corner's.

    points, normals, known : (n, 3), (n, 3) and (n,), the vertices, and whether their curvatures are known
    corners, facing : (k,) and (k, 3), the vertices at the corners, and the normals of their faces there
    edge : the length of the mesh's edges
    """
    from scipy.spatial import cKDTree

    vertex = np.where(known[corners], corners, -1)
    some, places = np.flatnonzero(vertex < 0), np.flatnonzero(known)
    if len(some) and len(places):
        tree, reach = cKDTree(points[places]), BESIDE * LEAST * edge
        away, at = tree.query(points[corners[some]], CANDIDATES, distance_upper_bound=reach)
        at = places[np.minimum(at, len(places) - 1)]
        cosine = np.where(np.isfinite(away), np.einsum("kbi,ki->kb", normals[at], facing[some]), -1.0)
        most = cosine.max(axis=1)
        nearest = np.argmax(cosine >= np.minimum(most, TURNED)[:, None], axis=1)
        vertex[some] = np.where(most > LEAST_COSINE, at[np.arange(len(some)), nearest], -1)
    return vertex


def _fit_weingarten(distance: Array, local: Array, radius: Array) -> tuple[Array, Array, Array]:
    """Gaussian and mean curvature, and the root mean square misfit of the normals, (n,) each.

    The Weingarten map W is the weighted least squares fit of n = n0 - W x, with weights (1 - (d /
    radius)^2)^2.

    distance : (n, k), distances d of the places, a length; inf on other sheets
    local : (n, k, 4), tangent coordinates x (2), and the same two components of the normal
    radius : (n,), a length
    """
    inside: Array = np.maximum(1.0 - (distance / radius[:, None]) ** 2, 0.0)
    weights = inside * inside
    weights /= np.maximum(weights.sum(axis=1, keepdims=True), LEAST_DIVISOR)
    terms = local - np.einsum("nk,nki->ni", weights, local)[:, None]
    terms[:, :, :2] /= radius[:, None, None]
    moments = np.swapaxes(weights[:, :, None] * terms, 1, 2) @ terms
    square, mixed = moments[:, :2, :2] + LEAST_SQUARE * np.eye(2), moments[:, :2, 2:]
    slopes = np.linalg.solve(square, mixed)
    left = np.einsum("nii->n", moments[:, 2:, 2:]) - np.einsum("nij,nij->n", slopes, mixed)
    (a, b), (c, d) = -np.moveaxis(slopes, 0, -1) / radius
    return a * d - 0.25 * (b + c) ** 2, 0.5 * (a + d), np.sqrt(np.maximum(left, 0.0))
