# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A mesh from three sides, shaded, in the colors of its face corners."""

from collections.abc import Iterator

import bpy
import numpy as np

from ...core.triangles import triangle_cross
from ..scene.attributes import POSITION
from ..scene.mesh_data import values
from ..touch.arrays import read_array
from ..touch.types import Array
from . import drawing, page

DARKEST = 0.45  # Where the surface turns away, it is this bright.
CELLS = 64  # Vertices in one of so many cells along the longest side are drawn as one: a picture is small.
# Words, the axes to the right and up, the axis of sight and its sign toward the viewer.
VIEWS = (
    ("from the front", (0, 2), 1, -1.0),
    ("from the right", (1, 2), 0, 1.0),
    ("from above", (0, 1), 2, 1.0),
)


def three_sides(mesh: bpy.types.Mesh, colors: Array) -> Iterator[str]:
    """Three figures of the mesh, in sRGB colors (n, 3 or 4) of its face corners."""
    points, corners, found = _coarse(mesh, colors[:, :3])
    normals = triangle_cross(points[corners])
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300)
    for words, axes, sight, sign in VIEWS:
        # Shading shows the shape where colors are pale. What is nearer is drawn later.
        light = DARKEST + (1.0 - DARKEST) * np.abs(normals[:, sight, None])
        order = np.argsort(sign * points[corners, sight].mean(axis=1))
        picture = drawing.triangles(points[:, axes], corners[order], (light * found)[order])
        yield page.figure(picture, words)


def _coarse(mesh: bpy.types.Mesh, colors: Array) -> tuple[Array, Array, Array]:
    """Points (n, 3) of vertices that are one in a cell, triangles (m, 3) between these, and colors (m, 3)."""
    mesh.calc_loop_triangles()
    places = values(mesh, POSITION)
    size = np.ptp(places, axis=0).max() / CELLS or 1.0
    _, first, cell = np.unique(np.rint(places / size), axis=0, return_index=True, return_inverse=True)
    corners = cell.ravel()[read_array(mesh.loop_triangles, "vertices", 3, np.int32)]
    found = colors[read_array(mesh.loop_triangles, "loops", 3, np.int32)].mean(axis=1)
    kept = (corners != np.roll(corners, 1, axis=1)).all(axis=1)
    return places[first], corners[kept], found[kept]
