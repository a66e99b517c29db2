# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Whole objects: the error, touches and seconds of the surface of all touches.

`python -m benchmarks.atlas [--only NAME] [--finest T] [--coarsest T]`, from the root of a checkout. It needs
bpy to read the scans and to cast rays. Each object has the size 1, and contacts have a noise of .0005. The
command prints Markdown tables:

(a) each object at five tolerances: the numbers of touches and contacts, and CPU seconds; the distances of
    points of the object from the mesh, and the share of these points that the field's 90 % interval holds;
    and the topology of the mesh;
(b) on the ring and the egg, whose curvatures are known, the mean |K| and |H| at the vertices of the mesh, by
    how much the atlas's are off on average, and the angle defects of the same mesh, which are K as Gauss and
    Bonnet have it; the share of vertices within the 90 % intervals, and of those where both are unknown.

`--shapes [--starts N] [--first START] [--places N]` prints one other table instead: objects with creases,
thin walls and several pieces, each from several starts (benchmarks.atlas_shapes).
"""

import numpy as np

from tests import solids

from . import machine, parser_of, scan_files, table, timed
from .atlas_shapes import print_shapes
from .real import Scan
from .whole import EDGE, away, contacts_of, touched_all_over, tree_of

SCANS = ("pear", "lemon", "bottle", "asteroid", "stone")
TOLERANCES = (0.016, 0.008, 0.004, 0.002, 0.001)
POINTS, MOST = 2500, 1500


class Scanned:
    """A scan, and random points all over it, by area."""

    def __init__(self, name):
        self.scan = Scan(scan_files(name)[0])
        self.name, self.ray_cast = self.scan.name, self.scan.ray_cast
        (self.start, self.outward), *_ = self.scan.places(1, 0)
        places = list(self.scan.places(POINTS, 1))
        self.points = np.array([point for point, _ in places])

    def normals(self, points):
        """Normals of the scan where it is nearest to points (n, 3)."""
        return np.array([self.scan.tree.find_nearest(tuple(p))[1] for p in points])


class Exact:
    """A ring or an ellipsoid of revolution, and points on it."""

    def __init__(self, name):
        sizes = {"ring": (0.35, 0.15), "egg": (0.3, 0.5)}[name]
        self.name, self.solid = name, getattr(solids, name)(*sizes)
        self.curvatures = lambda points: getattr(solids, f"{name}_curvatures")(points, *sizes)
        self.start, self.outward, self.ray_cast = self.solid.start, self.solid.outward, self.solid.ray_cast
        rng = np.random.default_rng(1)
        points = []
        while len(points) < POINTS:
            way = rng.normal(size=3)
            hit = self.solid.ray_cast(tuple(rng.uniform(-0.6, 0.6, 3)), tuple(way / np.linalg.norm(way)), 2.0)
            points += [hit[0]] if hit else []
        self.points = np.array(points)

    def normals(self, points):
        """Normals at points (n, 3) of the object."""
        return np.array([self.solid.normal(*p) for p in points])


def off_mesh(vertices, triangles, points):
    """Distances (n,) of points (n, 3) from a mesh, in ‰ of the size."""
    return 1e3 * away(tree_of(vertices, triangles), points)


def three(off):
    return f"{off.mean():.3f} / {np.median(off):.3f} / {np.percentile(off, 95):.2f}"


def angle_defects(mesh):
    """K at the vertices (n,) of a mesh: what their angles lack of a whole turn, over a third of the area."""
    turns, areas = np.full(len(mesh.vertices), 2.0 * np.pi), np.zeros(len(mesh.vertices))
    for i in range(3):
        a, b, c = mesh.vertices[np.roll(mesh.triangles, i, axis=1)].transpose(1, 0, 2)
        twice, along = np.linalg.norm(np.cross(b - a, c - a), axis=1), np.einsum("ni,ni->n", b - a, c - a)
        corner = np.roll(mesh.triangles, i, axis=1)[:, 0]
        turns -= np.bincount(corner, np.arctan2(twice, along), len(turns))
        areas += np.bincount(corner, twice / 6.0, len(turns))
    return turns / areas


def curved(thing, tolerance, atlas, mesh):
    """A row of the second table."""
    found, true = atlas.curvatures(mesh), thing.curvatures(mesh.vertices)
    known = np.isfinite(found["gaussian_curvature_std"])
    cells = [thing.name, f"{1e3 * tolerance:g}"]
    for name, values in zip(("gaussian_curvature", "mean_curvature"), true, strict=True):
        off = np.abs(found[name] - values)[known]
        cells += [f"{np.abs(values).mean():.2f}", f"{off.mean():.3f}"]
        cells.append(f"{np.mean(off <= 1.645 * found[f'{name}_std'][known]):.2f}")
    defects = np.abs(angle_defects(mesh) - true[0])[known].mean()
    return [*cells, f"{defects:.2f}", f"{100.0 * np.mean(~known):.1f}"]


def row(thing, tolerance):
    """A row of the first table, and the rows of the second table."""
    start = thing.start, thing.outward
    touching, (atlas, found, _) = timed(touched_all_over, thing, start, tolerance, most=MOST, rng=0)
    meshing, mesh = timed(atlas.mesh, EDGE)
    distance, std = atlas.distance(thing.points)
    felt = np.isfinite(std)
    off = off_mesh(mesh.vertices, mesh.triangles, thing.points)
    within = np.mean(np.abs(distance[felt]) <= 1.645 * std[felt])
    shape = solids.topology(mesh.triangles)
    contacts = len(contacts_of(found, atlas.taps)[0])
    cells = [thing.name, f"{1e3 * tolerance:g}", str(len(atlas.patches)), str(contacts)]
    cells += [f"{touching:.1f}", f"{meshing:.1f}", f"{100 * felt.mean():.1f}", three(off), f"{within:.2f}"]
    cells.append(f"{shape.open} / {shape.euler} / {shape.pieces}")
    return cells, [curved(thing, tolerance, atlas, mesh)] if isinstance(thing, Exact) else []


def main():
    parser = parser_of(__doc__)
    parser.add_argument("--only", default="", help="only objects with this in their names")
    parser.add_argument("--finest", type=float, default=min(TOLERANCES), help="tolerance (%(default)s)")
    parser.add_argument("--coarsest", type=float, default=max(TOLERANCES), help="tolerance (%(default)s)")
    parser.add_argument("--shapes", action="store_true", help="print only the table of made objects")
    parser.add_argument("--starts", type=int, default=8, help="number of starts of each (%(default)s)")
    parser.add_argument("--first", type=int, default=0, help="the first of these starts (%(default)s)")
    parser.add_argument("--places", type=int, default=20_000, help="places around each (%(default)s)")
    options = parser.parse_args()
    scan_files()  # Without scans it ends now, and not after hours.
    if options.shapes:
        starts = range(options.first, options.first + options.starts)
        print_shapes(options.only, (options.finest, options.coarsest), starts, options.places)
        return
    names = [name for name in (*SCANS, "ring", "egg") if options.only in name]
    rows, bends = [], []
    for name in names:
        thing = Scanned(name) if name in SCANS else Exact(name)
        for tolerance in (t for t in TOLERANCES if options.finest <= t <= options.coarsest):
            cells, curvatures = row(thing, tolerance)
            rows.append(cells)
            bends += curvatures
    head = "object|tolerance|touches|contacts|s touch, join|s mesh|% covered|mean / median / 95 %|within 90 %"
    table([*head.split("|"), "open edges / Euler / pieces"], rows)
    if bends:
        head = "object|tolerance|K|off|within 90 %|H|off|within 90 %|K of angle defects off|% unknown"
        table(head.split("|"), bends)
    print(f"Lengths are in ‰ of the size, times in CPU seconds; {machine('bpy', 'numpy', 'scipy')}.")


if __name__ == "__main__":
    main()
