# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The curvatures of the shape that the facets of a mesh stand for, where a touch has felt few of them."""

import math
from collections.abc import Iterable, Iterator, Sequence
from functools import cache
from typing import NamedTuple, Protocol, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike

from ..arguments import SMALLEST, Array
from ..contours.contour import cross, read_only
from ..patch.differential_geometry import Derivatives
from .result import Reconstruction

# benchmarks.facets shows how far curvatures are off with these.
# The shape's are those by which facets turn within the first number of widths, and those of the corners of
# facets within the others, where the patch turns by SMOOTH or less.
TURNING, CORNERS = 2.0, (0.6, 1.3)
# Corners determine a quadric if the smallest singular value of their equations is above this share.
DETERMINED = 0.01
TURNS = np.radians([0.0, 20.0, 40.0])  # The curves, turned by these around the normal, show where facets are.
# Edges that turn by angles between these stand for a smooth bend,
DISTINCT, SMOOTH = math.radians(1.0), math.radians(40.0)
# if both facets have this share of the wider one's width across it; else one is a fillet. Facets are fine if
# the one at the point is narrower than this share of the radius.
MIN_WIDTH_RATIO = 0.15
NEIGHBOR_STEP = 0.05  # The neighbor across an edge is the facet at this share of the width beyond the edge.


@runtime_checkable
class FacetedSurface(Protocol):
    """A surface that consists of flat faces."""

    def face_near(self, point: Sequence[float] | Array) -> int:
        """The number of the face nearest to a point (3,) of the world."""

    def corners_of(self, number: int) -> ArrayLike:
        """The corners (k, 3) of a face in the world, in order."""


class Facet(NamedTuple):
    """A face: its corners (k, 3), and its unit normal."""

    corners: Array
    normal: Array

    def width(self, edge: Array) -> float:
        """The width of the face across the direction of an edge (3,), a length; 0 for an edge without one."""
        across, length = cross(edge, self.normal), math.hypot(*edge)
        return float(np.ptp(self.corners @ across)) / length if length else 0.0


def with_facets(r: Reconstruction, surface: object) -> Reconstruction:
    """The reconstruction, with curvatures as uncertain as facets leave those of the shape they stand for.

    It is the same on a surface without faces, and on a fine one, whose facets are narrow compared with the
    radius. A facet whose edges are all sharp or those of fillets, as that of a cube, is the shape itself.
    """
    if not isinstance(surface, FacetedSurface):
        return r
    width = _smooth_width(r.frame.origin, surface)
    if width < max(MIN_WIDTH_RATIO * r.radius, SMALLEST):
        return r
    shape = read_only(np.array(_shape_curvatures(r, surface, width)))
    return r.judged_with(shape_curvatures=shape, facet_width=width)


def _shape_curvatures(r: Reconstruction, mesh: FacetedSurface, width: float) -> list[Array]:
    """The principal curvatures (2,) of the shape, in order, by how facets turn and by their corners."""
    facet, (points, *corners) = cache(lambda face: _facet(mesh, face)), _around(r, mesh, width)
    by_turning = _turning(r, points, [facet(face) for face in map(mesh.face_near, points.tolist())])
    faces_within = [set(map(mesh.face_near, near.tolist())) for near in corners]
    by_corners = [_of_corners(r, map(facet, faces)) for faces in faces_within]
    return [by_turning, *(estimate for estimate in by_corners if estimate is not None)]


def is_beside_bend(point: Array, mesh: FacetedSurface) -> bool:
    """Whether the facet nearest to a point (3,) has an edge that stands for a smooth bend, as on a ball."""
    return _smooth_width(point, mesh) > 0.0


def _around(r: Reconstruction, mesh: FacetedSurface, width: float) -> list[Array]:
    """Points (n, 3) of the world along the curves and these turned around the normal.

    They go to TURNING and, in the others, to CORNERS widths of the facet at the point in each direction, all
    at most the given one. Where facets narrow, as near the tip of a cone, points end where the patch has
    turned by SMOOTH.
    """
    x, y, z = r.frame.to_local(np.vstack([contour.points for contour in r.contours])).T / r.radius
    turned = [(x * c - y * s, x * s + y * c, z) for c, s in zip(np.cos(TURNS), np.sin(TURNS), strict=True)]
    points, corners = np.concatenate(turned, axis=1).T, mesh.corners_of(mesh.face_near(r.frame.origin))
    spans = np.ptp(points[:, :2] @ r.frame.to_local(corners)[:, :2].T, axis=1)
    widths = np.minimum(spans / np.maximum(np.hypot(*points[:, :2].T), SMALLEST), width)
    steepness = max(abs(r.k1), abs(r.k2)) / SMOOTH
    limits = (np.maximum(share * widths, SMALLEST)[:, None] for share in (TURNING, *CORNERS))
    return [r.frame.to_world(points / np.maximum(steepness, 1.0 / limit)) for limit in limits]


def _turning(r: Reconstruction, points: Array, facets: list[Facet]) -> Array:
    """The principal curvatures (2,), in order, by which normals turn between the facets at points (n, 3).

    They are those of the Weingarten map W that fits normals as -W x by least squares, where x is along the
    tangent plane. Facets count the less the steeper they are, and not at all beyond a right angle.
    """
    corners, normals = np.array([(facet.corners[0], facet.normal) for facet in facets]).swapaxes(0, 1)
    feet = points - np.sum((points - corners) * normals, axis=1, keepdims=True) * normals
    (u, v, _), (a, b, c) = r.frame.to_local(feet).T, (normals @ r.frame.axes).T
    outward = np.sign(c[np.argmin(u**2 + v**2)])  # The corners of faces go either way around.
    weights, zero = np.maximum(outward * c, 0.0), np.zeros_like(u)
    rows = np.vstack([np.column_stack([u, v, zero]), np.column_stack([zero, u, v])])
    weights, turned = np.tile(weights, 2), -outward * np.concatenate([a, b])
    xx, xy, yy = np.linalg.lstsq(weights[:, None] * rows, weights * turned, rcond=None)[0]
    return np.linalg.eigvalsh([[xx, xy], [xy, yy]])


def _of_corners(r: Reconstruction, facets: Iterable[Facet]) -> Array | None:
    """The principal curvatures (2,), in order, of the height of degree 2 that fits the corners of facets.

    None if these do not determine it.
    """
    x, y, z = r.frame.to_local(np.vstack([facet.corners for facet in facets])).T / r.radius
    size = float(np.abs([x, y]).max()) or 1.0
    u, v = x / size, y / size
    taylor = np.column_stack([np.ones_like(u), u, v, 0.5 * u**2, u * v, 0.5 * v**2])
    coefficients, _, rank, _ = np.linalg.lstsq(taylor, z, rcond=DETERMINED)
    if rank < len(coefficients):
        return None
    fitted = Derivatives(*(coefficients / size ** np.array([0, 1, 1, 2, 2, 2])))
    return np.array(fitted.principal_curvatures) / r.radius


def _smooth_width(point: Array, mesh: FacetedSurface) -> float:
    """The largest width of the facet at a point across an edge that stands for a smooth bend, or 0 without.

    An edge to a facet that is much narrower, or wider, is one of a fillet.
    """
    bends = _bends(point, mesh)
    return max((min(widths) for widths in bends if min(widths) >= MIN_WIDTH_RATIO * max(widths)), default=0.0)


def _bends(point: Array, mesh: FacetedSurface) -> Iterator[tuple[float, float]]:
    """The widths of the facet at a point and of its neighbor across each edge that turns as a smooth bend."""
    facet = _facet(mesh, mesh.face_near(point))
    starts, along = facet.corners, np.roll(facet.corners, -1, axis=0) - facet.corners
    outward = np.array(cross(along.T, facet.normal)).T
    for start, edge, out in zip(starts, along, outward, strict=True):
        if not out.any():
            continue
        width = facet.width(edge)
        beyond = start + 0.5 * edge + NEIGHBOR_STEP * width * out / math.hypot(*out)
        neighbor = _facet(mesh, mesh.face_near(beyond))
        if math.cos(SMOOTH) < float(facet.normal @ neighbor.normal) < math.cos(DISTINCT):
            yield width, neighbor.width(edge)


def _facet(mesh: FacetedSurface, number: int) -> Facet:
    """The face of this number; its normal is 0 if it has no area."""
    points = np.asarray(mesh.corners_of(number), dtype=float)
    across = np.sum(cross((points[1:-1] - points[0]).T, (points[2:] - points[0]).T), axis=1)
    return Facet(points, across / (math.hypot(*across) or 1.0))
