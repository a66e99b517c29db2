# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Where a measured object may go on unfelt: the indicator closes it by faces that no patch covers."""

import numpy as np

from ..arguments import Array
from ..contours.contour import tangent_of, vector_of
from ..triangles import normalized, triangle_cross
from .charts import Charts
from .frontier import RimPlace
from .meshing import Mesh
from .reference_mesh import ReferenceMesh

APART = 0.8  # Places are at least this many radii of the adjacent patch from each other.
STEEP = 0.95  # The way from a patch to its rim is not along the normal there by a larger cosine.


def uncovered_places(reference: ReferenceMesh, charts: Charts) -> tuple[RimPlace, ...]:
    """Places on the border of a mesh beyond which nothing was felt; a closed surface has none.

    Their areas are those of the indicator's surface around them that no patch covers.
    """
    from scipy.spatial import cKDTree

    found: list[RimPlace] = []
    mesh, unfelt = reference.mesh, reference.unfelt
    if unfelt is None or not reference.is_open.any():
        return tuple(found)
    rim, patch = mesh.vertices[reference.is_open], mesh.patch[reference.is_open]
    known, missing = np.flatnonzero(mesh.patch >= 0), patch < 0
    nearest = cKDTree(mesh.vertices[known] if len(known) else charts.origins).query(rim[missing])[1]
    patch[missing] = mesh.patch[known[nearest]] if len(known) else nearest
    ups = mesh.normals[reference.is_open]
    radii, areas = charts.radii[patch], _areas(unfelt)
    around = cKDTree(unfelt.vertices).query_ball_point(rim, radii)
    gains = np.minimum([areas[some].sum() for some in around], np.pi * radii**2)
    left = np.arange(len(rim))
    while len(left):
        best = left[np.argmax(gains[left])]
        point, up = rim[best], ups[best]
        ahead = normalized(point - charts.origins[patch[best]])
        if not ahead.any() or abs(ahead @ up) > STEEP:
            ahead = np.array(tangent_of(vector_of(up), None))
        ahead = np.cross(up, np.cross(ahead, up))
        place = vector_of(point), vector_of(up), vector_of(ahead), float(radii[best])
        found.append(RimPlace(*place, area=float(gains[best])))
        left = left[np.linalg.norm(rim[left] - point, axis=1) > APART * radii[best]]
    return tuple(found)


def _areas(mesh: Mesh) -> Array:
    """The area (n,) of each vertex, a third of that of its triangles."""
    areas = np.repeat(np.linalg.norm(triangle_cross(mesh.vertices[mesh.triangles]), axis=1) / 6.0, 3)
    return np.bincount(mesh.triangles.ravel(), areas, len(mesh.vertices)).astype(np.float64)
