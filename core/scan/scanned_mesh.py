# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A scanned mesh as triangles of similar size, and how far contacts are from it.

Lengths are in units of the patch's radius; places and oriented points are those of pose_search.py.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..arguments import Array, finite_array
from ..triangles import closest_point, cut_to_edges, normalized, triangle_cross

LARGEST_MESH = 40.0
LONGEST_EDGE = 0.25  # Longer edges are halved, so that a patch covers a hundred triangles.
FACING_WEIGHT = 0.05  # A right angle between normals counts about as much as this distance to a triangle.
TOUCHING = 1e-9


class ScanMesh(NamedTuple):
    """Triangles (m, 3, 3) of similar size; their normals, centers and smooth normals (m, 3); a KD-tree."""

    triangles: Array
    normals: Array
    centers: Array
    smooth: Array
    tree: Any


def corners_of(faces: ArrayLike, count: int) -> NDArray[np.intp]:
    """The faces as indices (m, 3) of `count` vertices. Raises ValueError for anything else."""
    indices = finite_array("faces", faces if np.size(faces) else np.zeros((0, 3)), (None, 3))
    if not len(indices):
        raise ValueError("faces: expected triangles, got none: make a mesh of a cloud of points first")
    if (indices % 1.0).any() or indices.min() < 0 or indices.max() >= count:
        raise ValueError(f"faces: expected whole numbers from 0 to {count - 1}, got others among them")
    return indices.astype(np.intp)


def mesh_of(co: Array, corners: NDArray[np.intp], patch: float) -> ScanMesh:
    """The mesh as it is searched. Raises ValueError if its size does not suit the patch."""
    from scipy.spatial import cKDTree

    size = np.linalg.norm(np.ptp(co[corners], axis=(0, 1)))
    if not patch <= size <= LARGEST_MESH:
        raise ValueError(
            f"vertices: expected a mesh from {patch:.2g} (the patch) to {LARGEST_MESH:g} times the radius, "
            f"got {size:.2g}: bring both to one unit, or take another extent"
        )
    normals = np.zeros_like(co)
    np.add.at(normals, corners, triangle_cross(co[corners])[:, None])
    oriented = np.concatenate([co, normalized(normals)], axis=1)
    oriented, cut, _ = cut_to_edges(oriented, corners, LONGEST_EDGE)
    pieces = oriented[cut]
    across, mean = triangle_cross(pieces[..., :3]), pieces.mean(axis=1)
    lengths, bends = np.linalg.norm(across, axis=1), np.linalg.norm(mean[:, 3:], axis=1)
    good = (lengths > 1e-12) & (bends > 1e-6)
    if not good.any():
        raise ValueError("faces: expected triangles, got none that has an area")
    centers, smooth = mean[good, :3], mean[good, 3:] / bends[good, None]
    tree = cKDTree(np.concatenate([centers, FACING_WEIGHT * smooth], axis=1))
    return ScanMesh(pieces[good, :, :3], across[good] / lengths[good, None], centers, smooth, tree)


def mesh_distances(places: Array, oriented: Array, mesh: ScanMesh, neighbors: int) -> tuple[Array, Array]:
    """Distances (m, n, 1) of the contacts to the mesh, and their derivatives (m, n, 6) by the motion.

    With one neighbor it is the distance to the plane of the nearest triangle; with more, to the nearest point
    of several triangles.
    """
    turned = places[..., :3].swapaxes(1, 2)
    arms, normals = oriented[0] @ turned, (oriented[1] @ turned).reshape(-1, 3)
    points = (arms + places[:, None, :, 3]).reshape(-1, 3)
    near = mesh.tree.query(np.hstack([points, FACING_WEIGHT * normals]), range(1, neighbors + 1))[1]
    nearest = near[:, 0]
    up, offsets = mesh.normals[nearest], points - mesh.centers[nearest]
    if neighbors > 1:
        near %= len(mesh.centers)  # There may be fewer.
        away = points[:, None] - closest_point(mesh.triangles[near], points[:, None])[0]
        # Triangles that face the other way belong to the other side of a thin wall, however near they are.
        back = np.einsum("nki,ni->nk", mesh.smooth[near], normals) < 0.0
        row, least = np.arange(len(points)), (np.linalg.norm(away, axis=2) + back).argmin(axis=1)
        offsets = away[row, least]
        # On the surface itself, only the normal gives a direction to it.
        up = normalized(offsets + TOUCHING * mesh.normals[near[row, least]])
    distances, up = np.sum(offsets * up, axis=1).reshape(*arms.shape[:2], 1), up.reshape(arms.shape)
    return distances, np.concatenate([np.cross(arms, up), up], axis=2)
