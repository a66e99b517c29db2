# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Whole objects of the YCB Object and Model Set: how near the touched surface is, compared with two peers.

`python -m benchmarks.field FOLDER [--only NAME] [--tolerance T]`, from the root of a checkout. FOLDER has
meshes of YCB as .ply files (google_16k/nontextured.ply of each object, renamed); one peer needs pymeshlab.
Objects are scaled to size 1, and contacts have a noise of .0005. The Markdown table has for each object

- the touches, the contacts of curves and taps, the length of all curves in sizes, and CPU seconds;
- IoU: the intersection over union of the volumes, by random places in the box of the object;
- Chamfer: the mean distance from object to surface and from surface to object, in permille of the size.

The peers take the same contacts with the same exact normals: screened Poisson reconstruction, and a Gaussian
process implicit surface with a Matern covariance of order 3/2. Each is at the setting with the best IoU,
which its user would not know. The process takes a thousand of them, and makes no mesh: its distance is
only that from the object to it.
"""

import sys
from itertools import product
from pathlib import Path

import numpy as np
from scipy.spatial.distance import cdist

import core
from tests import solids

from . import machine, parser_of, table, timed
from .atlas_shapes import Made
from .real import Scan
from .whole import EDGE, away, contacts_of, poisson, touched_all_over, tree_of

PLACES, POINTS, MARGIN = 10_000, 2500, 0.02
MOST_TOUCHES, MOST_CONTACTS = 1500, 1000  # A process takes this many contacts, evenly chosen.
OFFSET = 0.01  # The distance of the places inside and outside that an implicit surface is fitted to.
LENGTHS, DEPTHS, WEIGHTS = (0.1, 0.3, 1.0), (7, 8), (4.0, 10.0)


def implicit_process(points, normals, length):
    """f (n,) at places (n, 3): 0 at contacts, and +-OFFSET that far outside and inside of them."""
    some = np.linspace(0, len(points) - 1, min(MOST_CONTACTS, len(points))).astype(int)
    points, normals = points[some], normals[some]
    where = np.vstack([points, points + OFFSET * normals, points - OFFSET * normals])
    values = np.repeat([0.0, OFFSET, -OFFSET], len(points)) - 1.0  # Far from contacts f is 1: outside.

    def kernel(p, q):
        d = np.sqrt(3.0) / length * cdist(p, q)
        return (1.0 + d) * np.exp(-d)

    weights = np.linalg.solve(kernel(where, where) + 1e-6 * np.eye(len(where)), values)

    def f(at):
        return 1.0 + np.concatenate([kernel(part, where) @ weights for part in np.array_split(at, 40)])

    return f


def iou(one, other):
    """The intersection over union of two bodies, by whether places (n,) are inside of them."""
    return np.sum(one & other) / np.sum(one | other)


def chamfer(thing, vertices, triangles):
    """The mean of both mean distances, in permille, between an object and a mesh."""
    on_object = thing.points(POINTS, 1)[0]
    on_mesh = core.scattered(vertices, triangles, POINTS, np.random.default_rng(2))[0]
    there, back = away(tree_of(vertices, triangles), on_object), away(thing.tree, on_mesh)
    return 500.0 * (there.mean() + back.mean())


def meshed(thing, places, truth, vertices, triangles):
    """(IoU, Chamfer) of a mesh."""
    body = Made("", vertices, triangles)
    scale = np.ptp(vertices, axis=0).max()
    return iou(body.is_inside(places / scale), truth), chamfer(thing, vertices, triangles)


def best_of_the_peers(thing, places, truth, contacts):
    """(IoU, distance) of Poisson and of the process, each at its best setting."""
    on_object = thing.points(POINTS, 1)[0]
    surfaces = [
        meshed(thing, places, truth, *poisson(*contacts, depth, weight))
        for depth, weight in product(DEPTHS, WEIGHTS)
    ]
    processes = []
    for length in LENGTHS:
        f = implicit_process(*contacts, length)
        processes.append((iou(f(places) < 0.0, truth), 1e3 * np.abs(f(on_object)).mean()))
    return max(surfaces), max(processes)


def length_of(found):
    """The length of all curves of explorations."""
    return sum(np.linalg.norm(np.diff(c.points, axis=0), axis=1).sum() for e in found for c in e.contours)


def row(path, tolerance):
    """The cells of an object."""
    scan = Scan(path)
    thing = Made(path.stem, scan.points, scan.faces)
    low, high = thing.vertices.min(axis=0) - MARGIN, thing.vertices.max(axis=0) + MARGIN
    places = np.random.default_rng(0).uniform(low, high, (PLACES, 3))
    truth = thing.is_inside(places)
    start = thing.start(0)
    touching, (atlas, found, _) = timed(touched_all_over, thing, start, tolerance, most=MOST_TOUCHES, rng=0)
    meshing, mesh = timed(atlas.mesh, EDGE)
    contacts = contacts_of(found, atlas.taps)
    ours = meshed(thing, places, truth, mesh.vertices, mesh.triangles)
    counts = len(atlas.patches), len(contacts[0]), round(length_of(found)), round(touching + meshing)
    cells = [path.stem, atlas.status, *map(str, counts), str(solids.topology(mesh.triangles).open)]
    for share, distance in (ours, *best_of_the_peers(thing, places, truth, contacts)):
        cells += [f"{100.0 * share:.2f}", f"{distance:.2f}"]
    return cells


def main():
    parser = parser_of(__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--only", default="", help="only objects with this in their names")
    parser.add_argument("--tolerance", type=float, default=0.002, help="of the size (%(default)s)")
    options = parser.parse_args()
    rows = []
    for path in sorted(p for p in options.folder.glob("*.ply") if options.only in p.stem):
        rows.append(row(path, options.tolerance))
        print(*rows[-1], file=sys.stderr, flush=True)
    means = [f"{np.mean([float(cells[i]) for cells in rows]):.2f}" for i in range(7, 13)]
    rows.append(["mean", *6 * [""], *means])
    head = "object|status|touches|contacts|length|s|open edges|IoU, %|Chamfer"
    head += "|Poisson: IoU|Chamfer|process: IoU|off"
    table(head.split("|"), rows)
    print(f"Tolerance {options.tolerance:g} of the size; {machine('bpy', 'numpy', 'scipy', 'pymeshlab')}.")


if __name__ == "__main__":
    main()
