# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""How many vertices the mesh of a patch takes, and how near to the polynomial that is.

`python -m benchmarks.patch_mesh`, from the root of a checkout.

Exact surfaces are touched along three curves, and each patch is meshed as Blender shows it. Deviations of the
mesh from the polynomial are in height, at 45 points of each triangle. They are in thousandths of the radius,
like the standard deviation and the tolerance, which is a share of it. The last column is the number of
vertices of a uniform grid of squares, each cut in two, whose largest deviation inside the domain is the same;
that grid follows the boundary only in steps of its squares.
"""

import numpy as np

from core import Reconstruction, SamplingPlane, reconstruct, track
from core.reconstruction.result import MESH_SHARE
from tests import surfaces

from . import machine

PLANES = [SamplingPlane(azimuth) for azimuth in np.radians([13.0, 73.0, 133.0])]
TOUCHES = [  # Name, surface, extent and noise.
    ("plane", surfaces.plane(), 12.0, 0.0),
    ("plane, noise 0.1", surfaces.plane(), 12.0, 0.1),
    ("sphere of 25", surfaces.sphere(25.0), 12.0, 0.0),
    ("sphere of 25, noise 0.1", surfaces.sphere(25.0), 12.0, 0.1),
    ("cylinder of 20", surfaces.cylinder(20.0), 12.0, 0.0),
    ("saddle", surfaces.saddle(), 12.0, 0.0),
    ("tight saddle", surfaces.graph({(2, 0): -0.1, (0, 2): 0.08}), 12.0, 0.0),
    ("bottle neck", surfaces.bottle_neck(), 20.0, 0.0),
    ("pear, noise 0.1", surfaces.pear(), 20.0, 0.1),
    ("quartic", surfaces.quartic(), 20.0, 0.0),
    ("sine", surfaces.sine(), 12.0, 0.02),
]
STEPS = 8  # The number of steps along each side of a triangle where it is sampled.
HALVINGS = 12  # The number of times that the interval of the grid's spacing is halved.


def between(r: Reconstruction, points, triangles):
    """x, y of k points in each of m triangles, and the deviation in height there, each (k, m)."""
    shares = [(i, j, STEPS - i - j) for i in range(STEPS + 1) for j in range(STEPS + 1 - i)]
    x, y, z = np.einsum("wk,tkd->dwt", np.array(shares) / STEPS, points[triangles])
    return x, y, np.abs(r.height(x, y) - z)


def grid(r, spacing):
    """The greatest deviation of a uniform grid over the domain, and the number of its vertices."""
    reach = np.ceil(np.abs(r.domain.boundary(360)).max() / spacing) + 1
    axis = spacing * np.arange(-reach, reach + 1)
    x, y = (values.ravel() for values in np.meshgrid(axis, axis))
    at = np.arange(len(x)).reshape(len(axis), -1)
    a, b, c, d = (part.ravel() for part in (at[:-1, :-1], at[:-1, 1:], at[1:, 1:], at[1:, :-1]))
    triangles = np.vstack([np.column_stack([a, b, c]), np.column_stack([a, c, d])])
    triangles = triangles[r.domain.contains(x, y)[triangles].any(axis=1)]
    u, v, off = between(r, np.column_stack([x, y, r.height(x, y)]), triangles)
    return off[r.domain.contains(u, v)].max(), len(np.unique(triangles))


def grid_vertices(r, deviation):
    """The number of vertices of the widest uniform grid, up to the radius, that deviates by no more."""
    low, high = r.radius / 200.0, r.radius
    if grid(r, high)[0] <= deviation:
        return grid(r, high)[1]
    for _ in range(HALVINGS):
        middle = np.sqrt(low * high)
        low, high = (middle, high) if grid(r, middle)[0] <= deviation else (low, middle)
    return grid(r, low)[1]


def row(name, surface, extent, noise):
    contours = track(
        surface, surface.point, surface.normal, PLANES, extent=extent, step=extent / 12.0, noise=noise, rng=0
    )
    r = reconstruct(surface.point, contours, outward=surface.normal, noise=noise)
    points, triangles = r.mesh()
    _, _, off = between(r, points, triangles)
    lengths = (r.mean_height_std, MESH_SHARE * r.mean_height_std, off.max(), off.mean())
    cells = [name, *(f"{1e3 * length / r.radius:.3f}" for length in lengths)]
    return [*cells, str(len(points)), str(len(triangles)), str(grid_vertices(r, off.max()))]


def main():
    columns = ("surface", "std", "tolerance", "most", "mean", "vertices", "faces", "grid vertices")
    print(f"| {' | '.join(columns)} |\n|---|{'--:|' * (len(columns) - 1)}")
    for touch in TOUCHES:
        print(f"| {' | '.join(row(*touch))} |")
    print(f"\n{machine('numpy', 'scipy')}.")


if __name__ == "__main__":
    main()
