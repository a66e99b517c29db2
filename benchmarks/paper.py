# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The experiments of Jia and Tian's sections IV and V again, with the paper's figures for comparison.

`python -m benchmarks.paper ZIP`, from the root of a checkout; ZIP is the built extension. Blender, with it
installed, reads the scans. The command prints Markdown:

(a) Figures 3 and 4: a bottle's neck under no constraint and by TAGC, verified on nine more curves;
(b) Table II: distances of contacts and of mesh vertices to the patches.

Without the scans, only exact surfaces are touched. Lengths are in mm.
"""

from collections.abc import Callable
from functools import partial
from typing import NamedTuple

import numpy as np

import core
from tests import surfaces
from tools import blender

from . import NO_SCANS, SCANS_FOLDER, accuracy, machine, parser_of, table, timed

AZIMUTHS = (0.0, 60.0, 120.0)
NOISE = 0.05  # The noise of a contact: the paper's fits are off their contacts by as much.
SEEDS = 9
TURN = 60.0 / SEEDS  # Planes turn by this many degrees from seed to seed, so that no direction is favored.
NINE = (15.0, 30.0, 45.0, 75.0, 90.0, 105.0, 135.0, 150.0, 165.0)  # The azimuths of the verifying curves.
LEAN = np.array([3.0, -2.0, 4.0])  # Angles in degrees by which the three planes lean from the normal,
LEANS = (0.0, 1.0, 2.0, 4.0)  # and the multiples of these angles that are tried.
NECK_EXTENT, NECK_STEPS = 11.7, 9
VERTICES = 1500  # The number of points on an exact surface that count as its vertices.
LEAST_SQUARES, TAGC, QV, BAYES = "least-squares", "tagc", "quadratic-variation", "bayes"
METHODS = (LEAST_SQUARES, TAGC, QV, BAYES)
TABLE_II = (TAGC, QV, BAYES)
NECK = "bottle neck"
EXACT, SCAN = "exact", "scan"
EXACT_NECK, SCANNED_NECK = "exact neck", "scanned neck"


class Scan(NamedTuple):
    """A touch, with lengths in the file's unit; they are printed in `unit`, of which that has `scale`."""

    name: str
    file: str
    location: tuple[float, float, float]
    extent: float
    steps: int  # The number of steps of a half curve, which makes about as many contacts as in the paper.
    noise: float
    unit: str
    scale: float


# Renders and mesh curvature led to these places: the pear's belly, the lemon's side, the hollow shoulder
# under the bottle's cap (a saddle, like the paper's), and the great saddle of Eros (an extent of 2 km was
# tried as well). The shell's base is its widest place without ribs: at six points tried before, curves of
# 8 mm were lost to ribs.
SCANS = (
    Scan("shell", "shell_gastropod.stl", (-19.0, 1.0, 17.0), 8.0, 16, 0.05, "mm", 1.0),
    Scan("pear", "pear.ply", (-0.033, 0.0, 0.0652), 0.012, 10, 5e-5, "mm", 1e3),
    Scan("lemon (pebble)", "lemon.ply", (-0.0105, 0.0217, 0.0527), 0.012, 13, 5e-5, "mm", 1e3),
    Scan("bottle neck", "bottle_bleach.ply", (-0.0341, 0.0128, 0.2233), 0.010, 9, 5e-5, "mm", 1e3),
    Scan("Eros", "asteroid_eros.ply", (2.87, 4.68, 0.09), 3.0, 10, 0.0163, "km", 1.0),
)


class Figures(NamedTuple):
    """The numbers of Figures 3 and 4: (6) on three and on nine curves, and the total absolute curvature."""

    three: float
    nine: float
    curvature: float


class Row(NamedTuple):
    """A row of Table II, with {method: mean distance}; `mesh` is the number of all vertices."""

    contacts: float
    to_contacts: dict
    vertices: float | None
    to_vertices: dict
    mesh: int | None


PAPER_FIGURES = {
    LEAST_SQUARES: Figures(0.0461, 13.0041, 16.6031),
    TAGC: Figures(0.0514, 0.0859, 0.0329),
}
PAPER_TABLE = {
    "shell": Row(97, {TAGC: 0.2782, QV: 0.2420}, 5248, {TAGC: 0.2283, QV: 0.2391}, 19181),
    "pear": Row(63, {TAGC: 0.0613, QV: 0.0664}, 1779, {TAGC: 0.0991, QV: 0.0946}, 84656),
    "pebble": Row(81, {TAGC: 0.0998, QV: 0.1065}, 4423, {TAGC: 0.1308, QV: 0.1327}, 16028),
    NECK: Row(57, {TAGC: 0.0514}, None, {TAGC: 0.130}, None),
}
PAPER_MINUTES = 10.0
PAPER_WEIGHT = 9.99  # The paper's lambda of (9) for the neck, in 1/mm^2; the paper does not tell the others.
QV_WEIGHT = 1e5  # This weight is nearly the paper's constraint f(a) = 0.


# What is touched ---------------------------------------------------------------------------------------


class Place(NamedTuple):
    """Where something is touched."""

    name: str
    surface: core.Surface
    point: np.ndarray
    outward: np.ndarray
    extent: float
    steps: int
    over: Callable  # A function: from a reconstruction to the vertices (n, 3) over its domain, in its frame.
    mesh: int | None = None  # The number of all vertices of a scan.

    @property
    def weight(self):
        """The paper's lambda, in unit radius."""
        return PAPER_WEIGHT * self.extent**2

    def contours(self, azimuths, seed, lean=0.0):
        tilts = np.resize(lean * LEAN, len(azimuths))
        planes = accuracy.sampling(azimuths, tilts, TURN * (seed % SEEDS))
        lengths = {"extent": self.extent, "step": self.extent / self.steps, "noise": NOISE}
        return core.track(self.surface, self.point, self.outward, planes, rng=seed, **lengths)


def exact(name, surface, extent, steps):
    """A place on an exact surface, whose vertices are a dense grid over the tangent plane."""

    def over(r):
        plane = r.domain.grid(VERTICES)[0]
        return accuracy.above(surface, r.frame.axes, (r.patch.k1, r.patch.k2), plane) @ r.frame.axes

    return Place(name, surface, surface.point, surface.normal, extent, steps, over)


def exact_places():
    """Yields surfaces as curved and large as the paper's objects may be; the paper gives the neck."""
    yield exact(NECK, surfaces.bottle_neck(), NECK_EXTENT, NECK_STEPS)
    like = (("torus outer", "shell", 16), ("pear", "pear", 10), ("ellipsoid", "pebble", 13))
    for name, stands_for, steps in like:
        yield exact(stands_for, *accuracy.SURFACES[name], steps)


def scan_places(extension):
    """Yields a Place on each scan of an object of the paper's kind, in mm; the scene has nothing else."""
    import bpy
    from mathutils import Matrix

    for scan in SCANS[:4]:
        extension.tactile_addon.files.mesh_file.open_file(SCANS_FOLDER / scan.file)
        (obj,) = bpy.context.scene.objects
        obj.data.transform(Matrix.Scale(scan.scale, 4))
        surface = extension.tactile_addon.touch.surface.MeshSurface(
            obj, bpy.context.evaluated_depsgraph_get()
        )
        point, outward, _ = surface.project(scan.scale * np.array(scan.location))
        name = "pebble" if "pebble" in scan.name else scan.name
        place = (name, surface, np.array(point), np.array(outward), scan.scale * scan.extent, scan.steps)
        yield Place(*place, partial(_within_reach, surface), len(obj.data.vertices))


def _within_reach(surface, r):
    """The mesh vertices (n, 3) over the domain that a finger can touch from outside, in the frame of r."""
    vertices = surface.vertices_near(r.frame.origin, 2.0 * r.radius)
    return r.frame.to_local(vertices[core.reachable(r.geometry, surface, vertices)])


# Experiments -------------------------------------------------------------------------------------------


class Tested(NamedTuple):
    """A place in Table II."""

    place: Place
    kind: str
    row: Row
    milliseconds: dict


class Fit(NamedTuple):
    result: core.Reconstruction
    points: np.ndarray  # The contacts of the three curves in the frame, each with the reference point.
    milliseconds: float


def fitted(place, method, seed, lean=0.0):
    curves = place.contours(AZIMUTHS, seed, lean)
    weight = {TAGC: place.weight, QV: QV_WEIGHT}.get(method)
    options = {"outward": place.outward, "method": method, "weight": weight, "degree": 4}
    seconds, r = timed(core.reconstruct, place.point, curves, **options)
    return Fit(r, _in_frame(r, curves), 1e3 * seconds)


def _in_frame(r, curves):
    return r.frame.to_local(np.vstack([curve.points for curve in curves]))


def figures(place, *methods, lean=0.0):
    """{method: (SEEDS, 4)}: the three numbers of Figures, and the milliseconds of a fit."""
    runs = {method: [] for method in methods}
    for seed in range(SEEDS):
        nine = place.contours(NINE, seed + 1000 * SEEDS)
        for method in methods:
            r, points, milliseconds = fitted(place, method, seed, lean)
            errors = (core.fit_error(r.patch, p) for p in (points, _in_frame(r, nine)))
            runs[method].append((*errors, r.total_absolute_curvature, milliseconds))
    return {method: np.array(rows) for method, rows in runs.items()}


def table_row(place, *methods):
    """Medians over the seeds: a Row, and {method: milliseconds}."""
    runs = {method: [] for method in methods}
    for seed in range(SEEDS):
        for method in methods:
            fit = fitted(place, method, seed)
            over = place.over(fit.result)
            distances = (core.distances(fit.result.patch, points).mean() for points in (fit.points, over))
            runs[method].append((len(fit.points), len(over), *distances, fit.milliseconds))
    medians = {method: np.median(rows, axis=0) for method, rows in runs.items()}
    contacts, vertices = medians[TAGC][:2]
    to_contacts, to_vertices, times = ({method: row[i] for method, row in medians.items()} for i in (2, 3, 4))
    return Row(contacts, to_contacts, vertices, to_vertices, place.mesh), times


def tested_at(place, kind):
    return Tested(place, kind, *table_row(place, *TABLE_II))


# Tables ------------------------------------------------------------------------------------------------


def print_figures(measured):
    """measured : {title: {method: (SEEDS, 4)}}, as `figures` returns them"""
    print("(a) Figures 3 and 4\n")
    rows = []
    for method, paper in PAPER_FIGURES.items():
        cells = (f"{paper.three:.4f}", f"{paper.nine:.4f}", "", f"{paper.curvature:.4f}")
        rows.append(["*the paper's bottle*", method, *cells, f"{PAPER_MINUTES:.0f} min"])
    for title, of in measured.items():
        for method, runs in of.items():
            three, nine, curvature, milliseconds = np.median(runs, axis=0)
            quartiles = "{:.4g} to {:.4g}".format(*np.quantile(runs[:, 1], [0.25, 0.75]))
            cells = (f"{three:.4f}", f"{nine:.4f}", quartiles, f"{curvature:.4f}")
            rows.append([title, method, *cells, f"{milliseconds:.1f} ms"])
    head = ["touched", "fit", "(6), three curves", "(6), nine curves", "its quartiles"]
    table([*head, "total absolute curvature", "time of a fit"], rows)


def _leaning(lean):
    return f"{EXACT_NECK}, planes leaning {'/'.join(f'{angle:g}' for angle in lean * LEAN)} degrees"


def print_table(tested):
    print("(b) Table II\n")
    rows = []
    for name, paper in PAPER_TABLE.items():
        rows.append([f"*{name}, the paper's*", *_distances(paper), f"{PAPER_MINUTES:.0f} min", ""])
        for of in (of for of in tested if of.place.name == name):
            title = f"{name}, {of.kind}, {of.place.extent:g} mm"
            times = [f"{of.milliseconds[method]:.1f} ms" for method in (TAGC, BAYES)]
            rows.append([title, *_distances(of.row), *times])
    columns = [f"{what}: {name}" for what in ("contacts", "vertices") for name in ("TAGC", "QV", "bayes")]
    head = ["object", "contacts", *columns[:3], "vertices", *columns[3:], "size ratio", "mesh vertices"]
    table([*head, "TAGC, fit", "bayes, fit"], rows)


def _distances(row):
    def cells(distances):
        return [f"{distances[m]:.4f}" if m in distances else "" for m in TABLE_II]

    counted = row.vertices is not None
    return [
        f"{row.contacts:.0f}",
        *cells(row.to_contacts),
        f"{row.vertices:.0f}" if counted else "",
        *cells(row.to_vertices),
        f"{row.contacts / row.vertices:.2%}" if counted else "",
        f"{row.mesh}" if row.mesh else "",
    ]


def main():
    parser = parser_of(__doc__, takes_zip=True)
    options = parser.parse_args()
    scanned = all((SCANS_FOLDER / scan.file).is_file() for scan in SCANS[:4])
    neck, *others = exact_places()
    measured = {EXACT_NECK: figures(neck, *METHODS)}
    measured |= {_leaning(lean): figures(neck, LEAST_SQUARES, lean=lean) for lean in LEANS[1:]}
    tested = [tested_at(place, EXACT) for place in (neck, *others)]
    with blender.quiet():
        for place in scan_places(blender.start(options.zip)) if scanned else ():
            tested.append(tested_at(place, SCAN))
            if place.name == NECK:
                measured[SCANNED_NECK] = figures(place, *METHODS)
    print(_caption(), end="\n\n")
    if not scanned:
        print(f"The rows of scans are left out: {NO_SCANS}.\n")
    print_figures(measured)
    print_table(tested)


def _caption():
    return (
        f"Lengths are in mm. Medians are over {SEEDS} seeds: each draws {NOISE:g} mm of noise across the"
        f" curves and turns the three planes, 60 degrees apart, {TURN:.2g} degrees farther. The reference"
        " point counts in each curve, as 57 = 3 x 19 and 171 = 9 x 19 suggest. TAGC has the paper's weight,"
        f" {PAPER_WEIGHT} per mm² in (9), and QV has {QV_WEIGHT:.0f} in unit radius. On"
        f" {machine('numpy', 'scipy')}."
    )


if __name__ == "__main__":
    main()
