# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""How far a mesh is from a patch all over it, whether or not it has vertices there."""

import numpy as np

SAMPLES = 15  # So many samples of a patch are compared with the mesh.
LAYERS = 4  # A sample is compared with no more layers of the mesh.


def height_error(surface, result):
    """The mean distance in height of patch and mesh over the domain; None where there is no mesh."""
    points, weights = result.domain.nodes
    some = slice(None, None, len(points) // SAMPLES | 1)
    points, weights = points[some], weights[some]
    heights = result.height(*points.T)
    up = result.frame.axes[:, 2].tolist()
    starts = result.frame.to_world(np.column_stack([points, heights])).tolist()
    offs = [_height_off(surface, start, up, result.radius) for start in starts]
    met = [i for i, off in enumerate(offs) if off is not None]
    return float(np.average([offs[i] for i in met], weights=weights[met])) if met else None


def _height_off(surface, start, up, reach):
    """How far along `up`, either way, the nearest layer is whose outside is up; None beyond `reach`.

    Layers that are seen from within are another wall of the object, or its other side.
    """
    nearest = None
    for direction in (up, [-v for v in up]):
        at, gone = start, 0.0
        for _ in range(LAYERS):
            hit = surface.ray_cast(at, direction, reach - gone)
            if hit is None:
                break
            gone = abs(sum((a - b) * v for a, b, v in zip(hit[0], start, up, strict=True)))
            if sum(a * v for a, v in zip(hit[1], up, strict=True)) > 0.0:
                nearest = reach = gone
                break
            gone += 1e-4 * reach
            at = [a + gone * v for a, v in zip(start, direction, strict=True)]
            if gone >= reach:
                break
    return nearest
