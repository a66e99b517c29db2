# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Where on a scanned mesh tracked contours belong (paper, V): tangent planes are aligned, contours turned.

The paper turns the contours in fine steps at every vertex. Here a polynomial (1) stands for the mesh around
places that are some way apart, and all turns on it are one product of matrices. The best of them then move as
rigid bodies to where the contacts are nearest to the triangles. A place is (3, 4): the frame's axes on the
mesh as columns, and its origin.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..arguments import LARGEST, Array, finite_array, shown
from ..patch.monge import QUARTIC, exponents, monomials
from ..reconstruction.result import Reconstruction
from .sampling import spaced
from .scanned_mesh import ScanMesh, corners_of, mesh_distances, mesh_of

# Oriented points are an array (2, n, 3): contacts, and the patch's unit normals there, in the frame. Lengths
# are in units of the patch's radius. benchmarks.registration of e20b52a judged these numbers and those of
# scanned_mesh.py.
SPACING = 0.1  # The distance between points to which a polynomial is fitted.
MOST_POINTS = 400
PLACE_SPACING = 0.2  # The distance between places that are tried.
TRIED_TURNS = 36
POLYNOMIAL_RIDGE = 1e-3  # It keeps a polynomial with few points flat.
COARSE_CONTACTS = 60  # The largest number of contacts in the coarse search.
COARSE_PLACES, COARSE_STEPS = 400, 8  # Numbers of places and of their steps to planes of nearest triangles,
FINE_PLACES, FINE_STEPS = 24, 20  # and of those that then move to the triangles themselves.
SETTLED_GAIN = 1e-5  # A place has settled when a step lowers the sum of squares by a smaller share.
NEAREST_TRIANGLES = 16  # The number of triangles to which distances are measured.
SAME_PLACE, SAME_TURN = 0.05, math.radians(2.0)  # Poses that differ by less count as one.
AMBIGUOUS = 1.5  # A residual that is larger by less than this factor is about as good.
SIGNIFICANT_SHIFT = 3.0  # A shift by fewer standard deviations is noise.
LEAST_RESIDUAL = 1e-3  # Residuals count as at least this, because of the mesh's own facets.


@dataclass(frozen=True, eq=False)
class Pose:
    """Contacts that are placed on a mesh: a contact p is at rotation @ p + translation.

    rotation : (3, 3), never a mirror; translation : (3,)
    residual : root mean square distance of the contacts to the mesh, a length
    vertex : index of the vertex nearest to the reference point
    is_ambiguous : whether a pose that differs by more than a 20th of the radius or 2 degrees is about as
        good, as on a sphere or a cylinder: its residual is less than 1.5 times this one, or the shift is
        noise
    """

    rotation: Array
    translation: Array
    residual: float
    vertex: int
    is_ambiguous: bool


def register(r: Reconstruction, vertices: ArrayLike, faces: ArrayLike, *, best: int = 5) -> list[Pose]:
    """The poses that bring a touch's contacts nearest to a mesh (paper, V), the best first, at most `best`.

    vertices : (n, 3), in the contacts' unit; faces : (m, 3), indices, counterclockwise from outside

    Raises ValueError for bad arguments, and for a mesh that is smaller or very much larger than the patch.

    >>> pose, *others = register(r, vertices, faces)  # doctest: +SKIP
    >>> placed = r.contours[0].points @ pose.rotation.T + pose.translation  # doctest: +SKIP
    """
    if not isinstance(best, int | np.integer) or best < 1:
        raise ValueError(f"best: expected a whole number of 1 or more, got {shown(best)}")
    co = finite_array("vertices", vertices, (None, 3), LARGEST)
    corners = corners_of(faces, len(co))
    oriented = np.array([r.contacts / r.radius, r.geometry.normal(*r.contacts[:, :2].T)])
    center = 0.5 * (co[corners].min(axis=(0, 1)) + co[corners].max(axis=(0, 1)))
    mesh = mesh_of((co - center) / r.radius, corners, float(np.linalg.norm(np.ptp(oriented[0], axis=0))))
    starts = _initial_poses(oriented, mesh)
    places, residuals, slides = _registered(starts, oriented, mesh, NEAREST_TRIANGLES, FINE_STEPS)
    distinct = _distinct(places, residuals)
    poses = []
    for i in distinct[:best]:
        rotation, origin = places[i, :, :3] @ r.frame.axes.T, center + r.radius * places[i, :, 3]
        good = residuals[distinct] < AMBIGUOUS * max(residuals[i], LEAST_RESIDUAL)
        pose = Pose(
            rotation,
            translation=origin - rotation @ r.frame.origin,
            residual=float(r.radius * residuals[i]),
            vertex=int(np.argmin(np.sum((co - origin) ** 2, axis=1))),
            is_ambiguous=bool(slides[i] or np.count_nonzero(good) > 1),  # One of them is this pose.
        )
        poses.append(pose)
    return poses


def _initial_poses(oriented: Array, mesh: ScanMesh) -> Array:
    """The most promising places (m, 3, 4), moved to where contacts are nearest to the planes of triangles."""
    from scipy.spatial.transform import Rotation

    oriented = oriented[:, :: math.ceil(oriented.shape[1] / COARSE_CONTACTS)]
    places, fields = _fields(mesh, 1.05 * np.linalg.norm(oriented[0], axis=1).max())
    turns = Rotation.from_rotvec(
        2.0 * np.pi / TRIED_TURNS * np.arange(TRIED_TURNS)[:, None] * [0.0, 0.0, 1.0]
    ).as_matrix()
    costs = np.column_stack([_costs(oriented @ turn.T, fields) for turn in turns])
    least = (costs <= np.roll(costs, 1, axis=1)) & (costs <= np.roll(costs, -1, axis=1))
    order = np.argsort(np.where(least, costs, np.inf), axis=None)[
        : min(COARSE_PLACES, np.count_nonzero(least))
    ]
    places = places[order // TRIED_TURNS]
    places[..., :3] = places[..., :3] @ turns[order % TRIED_TURNS]
    places, residuals, _ = _registered(places, oriented, mesh, 1, COARSE_STEPS)
    return places[_distinct(places, residuals)[:FINE_PLACES]]


def _fields(mesh: ScanMesh, reach: float) -> tuple[Array, Array]:
    """Places all over the mesh, (m, 3, 4), and coefficients (k, m) of the polynomials that stand for it."""
    from scipy.spatial import cKDTree

    rng = np.random.default_rng(0)
    points = [i for i in spaced(mesh.centers, SPACING, rng) if i is not None]
    chosen = [points[i] for i in spaced(mesh.centers[points], PLACE_SPACING, rng) if i is not None]
    places = np.concatenate([_axes(mesh.smooth[chosen]), mesh.centers[chosen, :, None]], axis=2)
    # A query that finds nothing gives the index of the last row.
    co, normals = (np.vstack([a[points], np.zeros(3)]) for a in (mesh.centers, mesh.smooth))
    tree, nearest, fields = cKDTree(co[:-1]), range(1, min(MOST_POINTS, len(points)) + 1), []
    for part in np.array_split(places, math.ceil(len(places) / 500)):
        axes, origins = part[..., :3], part[..., 3]
        neighbors = tree.query(origins, nearest, distance_upper_bound=reach)[1]
        local = (co[neighbors] - origins[:, None]) @ axes
        weights = np.maximum(normals[neighbors] @ axes[..., 2:], 0.0)
        basis = weights * monomials(local, QUARTIC)
        system = basis.swapaxes(1, 2) @ basis + POLYNOMIAL_RIDGE * np.eye(len(QUARTIC))
        fields.append(np.linalg.solve(system, basis.swapaxes(1, 2) @ (weights * local)[..., 2:])[..., 0])
    return places, np.concatenate(fields).T


def _costs(oriented: Array, polynomials: Array) -> Array:
    """The sums (m,) of squared normal residuals of the contacts to polynomials (k, m) of m places.

    Residuals are projected off the span of 1, x and y, so that a small tilt and a shift along the normal cost
    nothing. On a paraboloid, neither does a small shift along the surface.
    """
    contacts, weights = oriented[0], oriented[1, :, 2:]  # On a slope a height is more than the distance.
    off = weights * (contacts[:, 2:] - monomials(contacts, QUARTIC) @ polynomials)
    tilts = np.linalg.qr(weights * monomials(contacts, exponents(0, 1)))[0]
    return np.sum(off**2, axis=0) - np.sum((tilts.T @ off) ** 2, axis=0)


def _axes(normals: Array) -> Array:
    """Right-handed frames (m, 3, 3) whose third columns are these normals (m, 3)."""
    first = np.cross(np.eye(3)[np.abs(normals).argmin(axis=1)], normals)
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    return np.stack([first, np.cross(normals, first), normals], axis=2)


def _registered(
    places: Array, oriented: Array, mesh: ScanMesh, neighbors: int, steps: int
) -> tuple[Array, Array, NDArray[np.bool_]]:
    """Rigid motions (m, 3, 4) of least squared distances from the mesh, by Levenberg-Marquardt.

    Also the root mean square distances (m,) in units of the radius, and whether the smallest eigenvalue of
    J'J is so low that noise may shift the contacts by SAME_PLACE or SAME_TURN, (m,).
    """
    from scipy.spatial.transform import Rotation

    places, (distances, slopes) = places.copy(), mesh_distances(places, oriented, mesh, neighbors)
    damping, going = np.full((len(places), 1, 1), 1e-3), np.arange(len(places))
    for _ in range(steps):
        some, off = slopes[going], distances[going]
        square = some.swapaxes(1, 2) @ some
        shift = damping[going] * np.trace(square, axis1=1, axis2=2)[:, None, None] + 1e-12
        step = -np.linalg.solve(square + shift * np.eye(6), some.swapaxes(1, 2) @ off)[..., 0]
        moved = places[going]
        moved[..., :3] = Rotation.from_rotvec(step[:, :3]).as_matrix() @ moved[..., :3]
        moved[..., 3] += step[:, 3:]
        errors, slope = mesh_distances(moved, oriented, mesh, neighbors)
        before = np.sum(off**2, axis=(1, 2))
        gain = before - np.sum(errors**2, axis=(1, 2))
        better = gain > 0.0
        which = going[better]
        places[which], distances[which], slopes[which] = moved[better], errors[better], slope[better]
        damping[going] *= np.where(better, 0.2, 5.0)[:, None, None]
        going = going[~better | (gain > SETTLED_GAIN * before)]
        if not len(going):
            break
    slopes = slopes * np.repeat([SAME_TURN, SAME_PLACE], 3)
    growth = np.linalg.eigvalsh(slopes.swapaxes(1, 2) @ slopes)[:, 0]
    residuals = np.sqrt(np.mean(distances[..., 0] ** 2, axis=1))
    return places, residuals, growth < (SIGNIFICANT_SHIFT * np.maximum(residuals, LEAST_RESIDUAL)) ** 2


def _distinct(places: Array, residuals: Array) -> list[int]:
    """The indices of places that differ from each other, the best first."""
    distinct: list[int] = []
    for i in np.argsort(residuals).tolist():
        far = np.linalg.norm(places[distinct, :, 3] - places[i, :, 3], axis=1) > SAME_PLACE
        trace = np.einsum("mij,ij->m", places[distinct, :, :3], places[i, :, :3])
        if (far | (trace < 1.0 + 2.0 * math.cos(SAME_TURN))).all():
            distinct.append(i)
    return distinct
