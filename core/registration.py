# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Where on a scanned mesh tracked contours belong (paper, V): tangent planes aligned, contours turned, refined.

The paper turns the contours in fine steps at every vertex. Here the mesh is a polynomial (1) around each of
its places that are some way apart, on which all turns cost a product of matrices; the best of them then
move as rigid bodies to where the contacts are nearest to the triangles.
"""

import math
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .arguments import LARGEST, Array, finite_array, shown
from .monge import exponents, monomials
from .result import Reconstruction
from .sampling import spaced

# Lengths in units of the patch's radius.
LONGEST_EDGE = 0.25  # longer ones are halved: a patch covers a hundred triangles
SPACING = 0.1  # of the points a polynomial is fitted to
APART, TURN = 0.05, math.radians(2.0)  # poses that differ by less are one
PLACES = 0.2  # between the places that are tried
TURNS = 36
FACING = 0.1  # what opposite normals count, as a distance: the other side of a thin wall is farther
LARGEST_AREA = 5000.0
CONTACTS = 60  # of the coarse search, at most
COARSE, FINE = 400, 24  # poses that are refined, to the nearest planes and to the nearest triangles,
COARSE_STEPS, FINE_STEPS = 8, 20
NEAREST = 16  # triangles that are measured
TERMS = exponents(0, 4)
AMBIGUOUS = 1.5  # times the residual is about as good
LEAST_RESIDUAL = 1e-3  # below it residuals do not differ
SIGNIFICANT = 3.0  # standard deviations of a pose


@dataclass(frozen=True)
class Pose:
    """Contacts placed on a mesh: a contact p is at rotation @ p + translation.

    rotation : (3, 3), never a mirror; translation : (3,)
    residual : RMS distance of the contacts to the mesh
    vertex : index of the vertex nearest to the reference point
    is_ambiguous : whether a pose that differs by more than a 20th of the radius or 2 degrees has a residual
        less than 1.5 times this one's, as on a sphere or a cylinder
    """

    rotation: Array
    translation: Array
    residual: float
    vertex: int
    is_ambiguous: bool


class _Mesh(NamedTuple):
    """Triangles (m, 3, 3) of like size, their unit normals (m, 3), centres (m, 3), smooth normals (m, 3) there,
    and a tree of both."""

    triangles: Array
    normals: Array
    centres: Array
    smooth: Array
    tree: Any


class _Touch(NamedTuple):
    """Contacts (n, 3) and the patch's unit normals there, in the frame."""

    points: Array
    normals: Array


class _Places(NamedTuple):
    """Local frames on the mesh in which the contacts are put: axes (m, 3, 3) as columns and origins (m, 3)."""

    axes: Array
    origins: Array

    def at(self, index: NDArray[Any]) -> "_Places":
        return _Places(self.axes[index], self.origins[index])


def register(r: Reconstruction, vertices: ArrayLike, faces: ArrayLike, *, best: int = 5) -> list[Pose]:
    """The poses that bring a touch's contacts nearest to a mesh, the best first; `best` of them at most.

    vertices : (n, 3), in the contacts' unit; faces : (m, 3), indices, counterclockwise from outside

    Raises ValueError for bad arguments, and for a mesh that is smaller or very much larger than the patch.
    """
    if not isinstance(r, Reconstruction):
        raise ValueError(f"r: wanted a Reconstruction, got {shown(r)}")
    if not isinstance(best, int | np.integer) or best < 1:
        raise ValueError(f"best: wanted a whole number of 1 or more, got {shown(best)}")
    co = finite_array("vertices", vertices, (None, 3), LARGEST)
    corners = _corners(faces, len(co))
    if not len(corners):
        raise ValueError("faces: wanted triangles, got none: a cloud of points has to be meshed first")
    centre = 0.5 * (co[corners].min(axis=(0, 1)) + co[corners].max(axis=(0, 1)))
    mesh = _mesh((co - centre) / r.radius, corners, np.ptp(r.contacts, axis=0).max() / r.radius)
    contacts = r.contacts / r.radius
    touch = _Touch(contacts, r.patch.normal(*r.contacts[:, :2].T))
    few = slice(None, None, math.ceil(len(contacts) / CONTACTS))
    places = _coarse(_Touch(contacts[few], touch.normals[few]), mesh)
    places, residuals, slides = _descend(places, touch, mesh, NEAREST, FINE_STEPS)
    poses = []
    distinct = _distinct(places, residuals)
    limits = AMBIGUOUS * np.maximum(residuals, LEAST_RESIDUAL)
    for i in distinct[:best]:
        rotation = places.axes[i] @ r.frame.axes.T
        place = centre + r.radius * places.origins[i]
        others = residuals[[j for j in distinct if j != i]]
        poses.append(
            Pose(
                rotation,
                place - rotation @ r.frame.origin,
                float(r.radius * residuals[i]),
                int(np.argmin(np.einsum("ij,ij->i", co - place, co - place))),
                bool(slides[i] or (others < limits[i]).any()),
            )
        )
    return poses


def _corners(faces: ArrayLike, count: int) -> NDArray[np.intp]:
    indices = finite_array("faces", faces if np.size(faces) else np.zeros((0, 3)), (None, 3))
    corners = indices.astype(np.intp)
    if (corners != indices).any() or (corners < 0).any() or (corners >= count).any():
        raise ValueError(f"faces: wanted indices of the {count} vertices, got others among them")
    return corners


def _mesh(co: Array, corners: NDArray[np.intp], patch: float) -> _Mesh:
    """The mesh as it is searched, of vertices in units of the radius. Raises ValueError for another size."""
    from scipy.spatial import cKDTree

    across = np.cross(co[corners[:, 1]] - co[corners[:, 0]], co[corners[:, 2]] - co[corners[:, 0]])
    area = 0.5 * np.linalg.norm(across, axis=1).sum()
    size = np.linalg.norm(np.ptp(co[corners].reshape(-1, 3), axis=0))
    if size < patch or area == 0.0:
        raise ValueError(
            f"vertices: wanted a mesh larger than the patch, got one of {size / patch:.2g} of its size: bring "
            "both to one unit"
        )
    if area > LARGEST_AREA:
        raise ValueError(
            f"vertices: wanted a mesh up to {LARGEST_AREA:g} times the square of the patch's radius, got one "
            f"of {area:.2g}: bring both to one unit, or cut out the part that may have been touched"
        )
    normals = np.zeros_like(co)
    for i in range(3):
        np.add.at(normals, corners[:, i], across)
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300)
    # Positions and normals are halved alike.
    pieces = _halved(np.concatenate([co, normals], axis=1)[corners])
    triangles = pieces[..., :3]
    flat = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    length, mean = np.linalg.norm(flat, axis=1), pieces.mean(axis=1)
    bend = np.linalg.norm(mean[:, 3:], axis=1)
    good = (length > 1e-12) & (bend > 1e-6)
    centres, smooth = mean[good, :3], mean[good, 3:] / bend[good, None]
    tree = cKDTree(np.concatenate([centres, FACING * smooth], axis=1))
    return _Mesh(triangles[good], flat[good] / length[good, None], centres, smooth, tree)


def _halved(pieces: Array) -> Array:
    """Triangles (m, 3, 6) cut at their longest edges until none is longer than LONGEST_EDGE."""
    done = []
    while len(pieces):
        edges = np.linalg.norm(np.roll(pieces, -1, axis=1)[..., :3] - pieces[..., :3], axis=2)
        long = edges.max(axis=1) > LONGEST_EDGE
        done.append(pieces[~long])
        turn = (edges[long].argmax(axis=1)[:, None] + np.arange(3)) % 3
        a, b, c = np.moveaxis(np.take_along_axis(pieces[long], turn[..., None], axis=1), 1, 0)
        middle = 0.5 * (a + b)
        pieces = np.concatenate([np.stack([a, middle, c], axis=1), np.stack([middle, b, c], axis=1)])
    return np.concatenate(done)


def _coarse(touch: _Touch, mesh: _Mesh) -> _Places:
    """The most promising places, refined with regard to the planes of the nearest triangles."""
    places, scores = _turned(touch, mesh)
    before, after = np.roll(scores, 1, axis=1), np.roll(scores, -1, axis=1)
    scores = np.where((scores <= before) & (scores <= after), scores, np.inf).ravel()
    order = np.argsort(scores)[:COARSE]
    order = order[np.isfinite(scores[order])]
    axes, origins = places.at(order // TURNS)
    places = _Places(axes @ _about_normal()[order % TURNS], origins)
    places, residuals, _ = _descend(places, touch, mesh, 1, COARSE_STEPS)
    return places.at(np.array(_distinct(places, residuals)[:FINE]))


def _about_normal() -> Array:
    """Rotations about the third axis by all the turns, (TURNS, 3, 3)."""
    turn = 2.0 * np.pi / TURNS * np.arange(TURNS)
    c, s, o, i = np.cos(turn), np.sin(turn), np.zeros(TURNS), np.ones(TURNS)
    return np.array([[c, -s, o], [s, c, o], [o, o, i]]).transpose(2, 0, 1)


def _turned(touch: _Touch, mesh: _Mesh) -> tuple[_Places, Array]:
    """Places all over the mesh (m,), and the sum of squared distances (m, TURNS) of the contacts to the mesh.

    Whatever a small tilt and a shift along the normal make good is not counted, so neither is, on a
    quadric, a small shift along the surface.
    """
    from scipy.spatial import cKDTree

    rng = np.random.default_rng(0)
    points = [i for i in spaced(mesh.centres, SPACING, rng) if i is not None]
    chosen = [points[i] for i in spaced(mesh.centres[points], PLACES, rng) if i is not None]
    places = _Places(_axes(mesh.smooth[chosen]), mesh.centres[chosen])
    # The last one is what a query finds where it finds nothing.
    near = np.append(mesh.centres[points], np.zeros((1, 3)), axis=0)
    up = np.append(mesh.smooth[points], np.zeros((1, 3)), axis=0)
    tree, reach = cKDTree(mesh.centres[points]), np.linalg.norm(touch.points, axis=1).max()
    product, square, cross = _products(touch)
    scores = []
    for start in range(0, len(chosen), 500):
        axes, origins = places.at(np.arange(start, min(start + 500, len(chosen))))
        found = tree.query(origins, k=min(500, len(points)), distance_upper_bound=1.05 * reach)[1]
        local = (near[found.reshape(len(axes), -1)] - origins[:, None]) @ axes
        weight = np.maximum(up[found.reshape(len(axes), -1)] @ axes[:, :, 2:], 0.0)
        basis = weight * monomials(local[..., 0].ravel(), local[..., 1].ravel(), TERMS).reshape(
            *local.shape[:2], -1
        )
        turned = basis.swapaxes(1, 2)
        ridge = 1e-3 * np.eye(len(TERMS))
        a = np.linalg.solve(turned @ basis + ridge, turned @ (weight * local[..., 2:]))[..., 0]
        outer = (a[:, :, None] * a[:, None, :]).reshape(len(a), -1)
        scores.append(square - 2.0 * a @ cross + outer @ product)
    return places, np.concatenate(scores)


def _products(touch: _Touch) -> tuple[Array, float, Array]:
    """Of the basis at the contacts with itself (k^2, TURNS), of their heights (), of both (k, TURNS)."""
    x, y, z = touch.points.T
    weight = touch.normals[:, 2:]
    free = np.linalg.qr(weight * monomials(x, y, exponents(0, 1)))[0]
    z = weight[:, 0] * z
    z -= free @ (free.T @ z)
    turned = np.einsum("tij,nj->tni", _about_normal(), touch.points)
    basis = weight * monomials(turned[..., 0].ravel(), turned[..., 1].ravel(), TERMS).reshape(
        TURNS, len(x), -1
    )
    basis -= free @ (free.T @ basis)
    product = (basis.swapaxes(1, 2) @ basis).reshape(TURNS, -1).T
    return product, float(z @ z), (z @ basis).T


def _axes(normals: Array) -> Array:
    """Right-handed frames (m, 3, 3), any with these normals as third columns."""
    aside = np.eye(3)[np.abs(normals).argmin(axis=1)]
    first = np.cross(aside, normals)
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    return np.stack([first, np.cross(normals, first), normals], axis=2)


def _descend(
    places: _Places, touch: _Touch, mesh: _Mesh, neighbours: int, steps: int
) -> tuple[_Places, Array, NDArray[np.bool_]]:
    """Places moved to where the contacts are nearest to the mesh (Levenberg-Marquardt), the residuals there,
    and whether a place may as well be another one within the accuracy of the contacts."""
    from scipy.spatial.transform import Rotation

    scale = np.array([TURN, TURN, TURN, APART, APART, APART])
    errors, slopes = _errors(places, touch, mesh, neighbours)
    damping = np.full(len(errors), 1e-3)
    for _ in range(steps):
        gradient = np.einsum("mni,mn->mi", slopes, errors)
        hessian = np.einsum("mni,mnj->mij", slopes, slopes)
        spread = np.einsum("mii->m", hessian) * damping + 1e-12
        step = -np.linalg.solve(hessian + spread[:, None, None] * np.eye(6), gradient[..., None])[..., 0]
        turned = Rotation.from_rotvec(step[:, :3]).as_matrix() @ places.axes
        moved = _Places(turned, places.origins + step[:, 3:])
        new_errors, new_slopes = _errors(moved, touch, mesh, neighbours)
        better = np.sum(new_errors**2, axis=1) < np.sum(errors**2, axis=1)
        places = _Places(
            *(
                np.where(better.reshape(-1, *[1] * (a.ndim - 1)), b, a)
                for a, b in zip(places, moved, strict=True)
            )
        )
        errors, slopes = (
            np.where(better[:, None], new_errors, errors),
            np.where(better[:, None, None], new_slopes, slopes),
        )
        damping *= np.where(better, 0.2, 5.0)
    slopes = slopes * scale
    growth = np.linalg.eigvalsh(np.einsum("mni,mnj->mij", slopes, slopes))[:, 0]
    residuals = np.sqrt(np.mean(errors**2, axis=1))
    return places, residuals, growth < (SIGNIFICANT * np.maximum(residuals, LEAST_RESIDUAL)) ** 2


def _errors(places: _Places, touch: _Touch, mesh: _Mesh, neighbours: int) -> tuple[Array, Array]:
    """Distances (m, n) of the contacts to the mesh, and derivatives (m, n, 6) by rotation and translation."""
    arms = touch.points @ places.axes.swapaxes(1, 2)
    points = (arms + places.origins[:, None]).reshape(-1, 3)
    normals = (touch.normals @ places.axes.swapaxes(1, 2)).reshape(-1, 3)
    near = mesh.tree.query(np.concatenate([points, FACING * normals], axis=1), k=neighbours)[1]
    if neighbours == 1:
        up = mesh.normals[near]
        distance = np.einsum("ij,ij->i", points - mesh.centres[near], up)
    else:
        offsets = points[:, None] - _closest(points[:, None], mesh.triangles[near])
        lengths = np.linalg.norm(offsets, axis=2)
        # The other side of a thin wall, however near.
        away = np.einsum("nki,ni->nk", mesh.smooth[near], normals) < 0.0
        row, nearest = np.arange(len(points)), (lengths + away).argmin(axis=1)
        distance = lengths[row, nearest]
        # On the surface there is no direction to it but the normal.
        on = (distance < 1e-9)[:, None]
        up = np.where(
            on, mesh.normals[near[row, nearest]], offsets[row, nearest] / np.maximum(distance, 1e-9)[:, None]
        )
    up = up.reshape(arms.shape)
    return distance.reshape(arms.shape[:2]), np.concatenate([np.cross(arms, up), up], axis=2)


def _closest(points: Array, triangles: Array) -> Array:
    """The point of each triangle (..., 3, 3) nearest to a point (..., 3)."""
    corners = np.moveaxis(triangles, -2, 0)
    across = np.cross(corners[1] - corners[0], corners[2] - corners[0])
    height = np.sum((points - corners[0]) * across, axis=-1, keepdims=True)
    best = points - height / np.sum(across**2, axis=-1, keepdims=True) * across
    inside, least = np.True_, np.inf
    on_edge = best
    for start, end in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        edge, arm = end - start, points - start
        inside = inside & (np.sum(np.cross(edge, arm) * across, axis=-1) >= 0.0)
        share = np.sum(arm * edge, axis=-1) / np.sum(edge**2, axis=-1)
        foot = start + np.clip(share, 0.0, 1.0)[..., None] * edge
        length = np.sum((points - foot) ** 2, axis=-1)
        on_edge = np.where((length < least)[..., None], foot, on_edge)
        least = np.minimum(length, least)
    return np.where(inside[..., None], best, on_edge)


def _distinct(places: _Places, residuals: Array) -> list[int]:
    """Indices of places that differ, by residual."""
    found: list[int] = []
    for i in np.argsort(residuals).tolist():
        far = np.linalg.norm(places.origins[found] - places.origins[i], axis=1) > APART
        cosine = (np.einsum("mij,ij->m", places.axes[found], places.axes[i]) - 1.0) / 2.0
        if (far | (cosine < math.cos(TURN))).all():
            found.append(i)
    return found
