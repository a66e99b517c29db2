# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""How far a patch is from its contacts and from a mesh (paper, V)."""

import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..arguments import Array, finite_array
from ..contours.contour import SamplingPlane, Vector, along, dot, scaled, vector_of
from ..contours.finger import Surface, contact_of
from ..contours.tracking import track
from ..exploration.taps import layer_height
from ..patch.domain import GRID, Domain
from ..patch.geometry import POINTS_AT_ONCE, Geometry, distances, fit_error, overlapped
from ..reconstruction.result import Reconstruction

EXTRA = 9  # The number of contours that are tracked in addition, as in the paper's Fig. 3.
# benchmarks.scans of e20b52a judged these.
STEPS_A_RADIUS = 12  # The number of steps of such a contour in a radius.
FOOT_REACH = (0.01, 0.1, 1.0)  # At the point, rays look for the mesh within these shares of the radius.
VERTICES_AT_ONCE = 5000  # Their distances take some hundredths of a second.
OWN_LAYER = 1e-3  # A layer within this share of the reach is the vertex's own.


def reachable(geometry: Geometry, surface: Surface, vertices: ArrayLike) -> NDArray[np.intp]:
    """The indices (m,) of the overlapped world vertices (n, 3) that a finger on the patch could meet.

    Nothing of `surface` hides them from above. Those off the patch have their outside up, and no other layer
    is nearer to it.
    """
    points = np.asarray(vertices)
    starts = range(0, len(points), POINTS_AT_ONCE)
    indices = [i + _reachable(geometry, surface, points[i : i + POINTS_AT_ONCE]) for i in starts]
    return np.concatenate([np.empty(0, dtype=np.intp), *indices])


def _reachable(geometry: Geometry, surface: Surface, points: Array) -> NDArray[np.intp]:
    """The `reachable` ones of some vertices (n, 3)."""
    over, reach = overlapped(geometry, points), 2.0 * geometry.radius
    up = vector_of(geometry.frame.axes[:, 2])
    is_seen = [not is_hidden(surface, point, up, reach) for point in points[over].tolist()]
    over = over[np.array(is_seen, dtype=bool)]
    x, y, z = geometry.frame.to_local(points[over]).T
    heights = geometry.height(x, y)
    feet = geometry.frame.to_world(np.column_stack([x, y, heights])).tolist()
    hair = OWN_LAYER * reach
    own = [
        off <= hair
        or (_faces_up(surface, point, up, hair) and layer_height(surface, foot, up, off - hair) is None)
        for point, foot, off in zip(points[over].tolist(), feet, np.abs(z - heights).tolist(), strict=True)
    ]
    return over[np.array(own, dtype=bool)]


def verify(
    r: Reconstruction, surface: Surface, vertices: ArrayLike, *, extra: int = EXTRA
) -> dict[str, float]:
    """Measures of how good a patch is (paper, V), as plain numbers, with lengths in the caller's unit.

    vertices : (n, 3), the `reachable` vertices of the mesh, in the world
    extra : number of contours to track on the surface between those that were fitted

    contacts, contact_distance_mean, .._median, .._max, .._rms : their number and Euclidean distances
    vertices, vertex_distance_mean, ... : the same for vertices, if there are any
    fit_error : (6) over the contacts
    extra_contours, extra_points, extra_fit_error : the numbers of contours and their contacts, without noise,
        and (6) over these, if there are any
    total_absolute_curvature : (8)
    overlap : the share of the patch's area over or under which there is surface that a finger could reach,
        within a radius, to about 0.01; the paper has no number for it

    Raises ValueError for bad numbers.
    """
    *_, measures = verifying(r, surface, vertices, extra=extra)
    return measures


def verifying(
    r: Reconstruction, surface: Surface, vertices: ArrayLike, *, extra: int = EXTRA
) -> Iterator[dict[str, float]]:
    """`verify` in short steps: each yields the measures so far, the same dict each time."""
    local = r.frame.to_local(finite_array("vertices", vertices, (None, 3)))
    measures: dict[str, float] = {"contacts": len(r.contacts), "vertices": len(local)}
    measures |= _spread("contact", distances(r.geometry, r.contacts))
    offsets = np.empty(len(local))
    for start in range(0, len(local), VERTICES_AT_ONCE):
        some = slice(start, start + VERTICES_AT_ONCE)
        offsets[some] = distances(r.geometry, local[some])
        yield measures
    contours = _extra_contours(r, surface, extra)
    points = np.concatenate([np.empty((0, 3)), *contours])
    measures |= {
        **_spread("vertex", offsets),
        "fit_error": r.fit_error,
        "extra_contours": sum(len(contour) > 0 for contour in contours),
        "extra_points": len(points),
        "total_absolute_curvature": r.total_absolute_curvature,
    }
    yield measures
    measures["overlap"] = _overlap(r, surface)
    if len(points):
        measures["extra_fit_error"] = fit_error(r.geometry, points)
    yield measures


def _spread(name: str, offsets: Array) -> dict[str, float]:
    """Mean, median, maximum and root mean square of distances by name; empty if there are none."""
    if not len(offsets):
        return {}
    values = {
        "mean": offsets.mean(),
        "median": np.median(offsets),
        "max": offsets.max(),
        "rms": np.sqrt(np.mean(offsets**2)),
    }
    return {f"{name}_distance_{key}": float(value) for key, value in values.items()}


def _extra_contours(r: Reconstruction, surface: Surface, count: int) -> list[Array]:
    """Local contacts (n, 3) over the domain, without the point, of contours between the fitted ones."""
    start = _start(r, surface)
    if start is None:
        return []
    planes = [SamplingPlane(azimuth) for azimuth in _azimuths_between(r.domain, count)]
    normal, tangent = r.frame.axes[:, 2], r.frame.axes[:, 0]
    extent, step = 2.0 * r.radius, r.radius / STEPS_A_RADIUS  # Steep patches are followed to the rim, too.
    contours = []
    for contour in track(surface, start, normal, planes, extent=extent, step=step, tangent=tangent):
        local = r.frame.to_local(contour.points[(contour.points != start).any(axis=1)])
        contours.append(local[r.domain.contains(local[:, 0], local[:, 1])])
    return contours


def _azimuths_between(domain: Domain, count: int) -> list[float]:
    """`count` azimuths between those of the curves' ends on the boundary, each in the widest gap."""
    x, y = domain.ends.T
    lines = np.sort(np.arctan2(y, x) % math.pi)
    widths = np.diff(lines, append=lines[0] + math.pi)
    inside = np.zeros(len(lines), dtype=np.intp)
    for _ in range(count):
        inside[np.argmax(widths / (inside + 1))] += 1
    shares = zip(lines.tolist(), widths.tolist(), inside.tolist(), strict=True)
    return [line + width * k / (n + 1) for line, width, n in shares for k in range(1, n + 1)]


def _start(r: Reconstruction, surface: Surface) -> Vector | None:
    """The place of the surface nearest to the reference point along the normal, or None."""
    feet = (_foot(r, surface, (0.0, 0.0, reach * r.radius), 2.0 * reach * r.radius) for reach in FOOT_REACH)
    return next(filter(None, feet), None)


def _overlap(r: Reconstruction, surface: Surface) -> float:
    """The overlap of `verify`, by rays from above onto a grid over the domain."""
    points, _ = r.domain.grid(GRID)
    d = r.geometry.derivatives(*points.T)
    area = np.sqrt(1.0 + d.x**2 + d.y**2)
    up = vector_of(r.frame.axes[:, 2])
    feet = (_foot(r, surface, (x, y, r.radius), 2.0 * r.radius) for x, y in points.tolist())
    below = [foot is not None and not is_hidden(surface, foot, up, 2.0 * r.radius) for foot in feet]
    return float(area[below].sum() / area.sum())


def _foot(r: Reconstruction, surface: Surface, local: Vector, distance: float) -> Vector | None:
    """The world point where a ray from a local point down along the normal meets the outside, or None."""
    up = vector_of(r.frame.axes[:, 2])
    hit = surface.ray_cast(vector_of(r.frame.to_world(local)), scaled(up, -1.0), distance)
    if hit is None:
        return None
    point, normal = contact_of(hit, 1.0)
    return point if dot(normal, up) > 0.0 else None


def _faces_up(surface: Surface, point: Vector, up: Vector, hair: float) -> bool:
    """Whether the outside of the surface is up at a point of it, as a ray from `hair` above it feels.

    A ray to a vertex of an edge of the surface may miss it, and it counts then.
    """
    hit = surface.ray_cast(along(point, up, hair), scaled(up, -1.0), 2.0 * hair)
    return hit is None or dot(vector_of(hit[1]), up) > 0.0


def is_hidden(surface: Surface, point: Vector, up: Vector, reach: float) -> bool:
    """Whether something of the surface is above the point, within `reach` along the unit `up`."""
    return surface.ray_cast(along(point, up, OWN_LAYER * reach), up, reach) is not None
