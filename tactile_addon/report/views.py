# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A mesh from three sides, shaded, in the colors of its face corners."""

from collections.abc import Iterator

import bpy
import numpy as np

from ..scene.attributes import POSITION
from ..scene.mesh_data import values
from ..touch.arrays import read_array
from ..touch.types import Array
from . import page, raster

DARKEST = 0.45  # Where the surface turns away, it is this bright.
# Words, the axes to the right and up, the axis of sight and its sign toward the viewer.
VIEWS = (
    ("from the front", (0, 2), 1, -1.0),
    ("from the right", (1, 2), 0, 1.0),
    ("from above", (0, 1), 2, 1.0),
)


def three_sides(mesh: bpy.types.Mesh, colors: Array) -> Iterator[str]:
    """Three figures of the mesh, in sRGB colors (n, 3 or 4) of its face corners."""
    at = read_array(mesh.loops, "vertex_index", dtype=np.int32)
    points, normals = values(mesh, POSITION)[at], read_array(mesh.vertices, "normal", 3)[at]
    mesh.calc_loop_triangles()
    corners = read_array(mesh.loop_triangles, "loops", 3, np.int32)
    for words, axes, sight, sign in VIEWS:
        # Shading shows the shape where colors are pale.
        light = DARKEST + (1.0 - DARKEST) * np.abs(normals[:, sight, None])
        found = points[:, axes], sign * points[:, sight], corners, light * colors[:, :3]
        yield page.figure(raster.picture(*found), words)
