# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A mesh from three sides, as dots in the colors of its vertices."""

import numpy as np

from ..scene.mesh_data import values
from . import drawing, page

MOST_DOTS = 4000  # A picture has at most so many dots.
DARKEST = 0.45  # Where the surface turns away, a dot is this bright.
# Words, the axes to the right and up, the axis of sight and its sign toward the viewer.
VIEWS = (
    ("from the front", (0, 2), 1, -1.0),
    ("from the right", (1, 2), 0, 1.0),
    ("from above", (0, 1), 2, 1.0),
)


def three_sides(mesh, colors):
    """Three figures of the vertices that face the viewer, nearest last, in sRGB colors (n, 3 or 4)."""
    points = values(mesh, "position")
    normals = np.empty_like(points, dtype=np.float32)
    mesh.vertices.foreach_get("normal", normals.ravel())
    mixed = np.random.default_rng(0).permutation(len(points))
    for words, axes, sight, sign in VIEWS:
        toward = sign * normals[:, sight]
        facing = mixed[toward[mixed] > 0.0][:MOST_DOTS]
        order = facing[np.argsort(sign * points[facing, sight])]
        if len(order):
            # Shading shows the shape where colors are pale.
            light = DARKEST + (1.0 - DARKEST) * toward[order, None]
            yield page.figure(drawing.dots(points[order][:, axes], light * colors[order]), words)
