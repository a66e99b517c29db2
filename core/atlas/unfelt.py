# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Where a measured object may go on unfelt: the indicator closes it by faces that no patch covers."""

import numpy as np

from ..arguments import Array
from ..contours.contour import tangent_of, vector_of
from ..triangles import far_apart, triangle_cross
from .charts import Charts
from .frontier import RimPlace
from .reference_mesh import ReferenceMesh

APART = 0.8  # Places are at least this many radii of the adjacent patch from each other.


def place_at(point: Array, normal: Array, radius: float, area: float | None = None) -> RimPlace:
    """A place for a touch of this radius, at a point (3,) with its normal (3,)."""
    return RimPlace(
        vector_of(point), vector_of(normal), tangent_of(vector_of(normal), None), radius, area=area
    )


def uncovered_places(reference: ReferenceMesh, charts: Charts) -> tuple[RimPlace, ...]:
    """Places on the border of a mesh beyond which nothing was felt; a closed surface has none.

    Their areas are those of the indicator's surface around them that no patch covers.
    """
    from scipy.spatial import cKDTree

    mesh, unfelt = reference.mesh, reference.unfelt
    if unfelt is None or not reference.is_open.any():
        return ()
    which = reference.is_open & mesh.normals.any(axis=1)  # Triangles without an area have no normal.
    rim, ups = mesh.vertices[which], mesh.normals[which]
    radii = charts.radii[cKDTree(charts.origins).query(rim)[1]]
    # A vertex has a third of the area of its triangles.
    areas = np.linalg.norm(triangle_cross(unfelt.vertices[unfelt.triangles]), axis=1).repeat(3) / 6.0
    areas = np.bincount(unfelt.triangles.ravel(), areas, len(unfelt.vertices))
    around = cKDTree(unfelt.vertices).query_ball_point(rim, radii)
    gains = np.minimum([areas[near].sum() for near in around], np.pi * radii**2)
    order = np.argsort(-gains, kind="stable")
    some = order[far_apart(rim[order], APART * radii[order])]
    return tuple(place_at(rim[i], ups[i], float(radii[i]), float(gains[i])) for i in some)
