# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""How far a patch is from contacts and from a mesh (paper, equation (6) and section V)."""

import numpy as np
from numpy.typing import ArrayLike

from .arguments import Array, finite_array
from .domain import Domain
from .local_geometry import Frame
from .monge import MongePatch


def fit_error(patch: MongePatch, points: ArrayLike) -> float:
    """Equation (6): the mean of |z(x_k, y_k) - z_k| over local points (n, 3), in their length."""
    x, y, z = np.asarray(points, dtype=float).T
    return float(np.mean(np.abs(patch.height(x, y) - z)))


def distances(patch: MongePatch, points: ArrayLike) -> Array:
    """Euclidean distances (n,) of local points (n, 3) to the patch."""
    local = finite_array("points", points, (None, 3))
    return np.linalg.norm(patch.closest_point(local) - local, axis=1)


def overlapped(frame: Frame, domain: Domain, radius: float, vertices: ArrayLike, normals: ArrayLike) -> Array:
    """The mesh vertices that lie over the domain, in the local frame, (m, 3) of world (n, 3).

    A closed object has another side above the same domain: a vertex counts only where its normal
    faces the patch's and it is within the radius of the tangent plane. Whether another layer of the
    object hides it from a finger, the caller must tell.
    """
    local = frame.to_local(vertices)
    near = np.flatnonzero((np.abs(local) <= 2.0 * radius).all(axis=1) & (np.abs(local[:, 2]) <= radius))
    facing = near[np.asarray(normals, dtype=float)[near] @ frame.axes[:, 2] > 0.0]
    return local[facing[domain.contains(local[facing, 0], local[facing, 1])]]
