# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""How near the fits come to real surfaces, and whether their intervals are true there.

`python -m benchmarks.real [--points N] [--only fixed | automatic]`, from the root of a checkout. It needs bpy
to read the scans and to cast rays, and scikit-learn for the Gaussian process. It prints Markdown tables:

(a) Scans are touched without noise at random points (seeded, by area) with three to six planes, and half
    curves of 1/32, 1/16 and 1/8 of the object in twelve steps. The error is the mean |dz| over up to some 90
    points of the mesh above the domain, in ‰ of the radius. With it come the share of these points
    within the 90 % interval, and the interval's mean score: its width, and twenty times what is beyond it.
(b) The same error is set against the time of a fit and 300 heights.
(c) Touches with three planes choose their extent and step: the table counts those that are sure, in doubt and
    refused, the doubts that are right, and the sure touches that are off.

All methods are judged above the domain and along the normal of the paper's frame, from which the peers start.
"""

import math
from collections import defaultdict
from functools import partial
from statistics import median
from typing import NamedTuple
from unittest import mock

import numpy as np

from core import explore, reconstruct, track
from core.bayes import process_fit
from core.patch.monge import exponents, monomials
from core.triangles import normalized, triangle_cross
from tools import blender

from . import machine, parser_of, scan_files, table, timed
from .accuracy import sampling
from .peers import Fit, quadric_process, radial_basis
from .whole import Rays

PLANES, EXTENTS, STEPS = (3, 4, 5, 6), (32, 16, 8), 12
# At most this many points of the mesh above a domain are compared, and at least this many.
HOLD_OUT, LEAST = 90, 20
# Newton's method toward a surface: the number of steps, the longest step in radii, and the least slope.
NEWTON_STEPS, FARTHEST, LEAST_CHANGE = 8, 0.3, 0.2
OFF, TOO_FAR, SILENT, TURNED, ALIKE = 0.02, 3.0, 5.0, 10.0, 0.05
DENSE = 150  # The number of points of the mesh to which the true frame is fitted.


class Scan(Rays):
    """A scan, centered and scaled to size 1, that casts rays by Blender's tree of its faces."""

    @blender.quiet()
    def __init__(self, path):
        import bpy

        bpy.ops.wm.read_homefile(use_empty=True)
        (bpy.ops.wm.ply_import if path.suffix == ".ply" else bpy.ops.wm.stl_import)(filepath=str(path))
        mesh = next(obj for obj in bpy.data.objects if obj.type == "MESH").data
        mesh.calc_loop_triangles()
        points = np.empty((len(mesh.vertices), 3))
        faces = np.empty((len(mesh.loop_triangles), 3), dtype=np.int32)
        mesh.vertices.foreach_get("co", points.ravel())
        mesh.loop_triangles.foreach_get("vertices", faces.ravel())
        points = (points - points.mean(axis=0)) / np.ptp(points, axis=0).max()
        across, self.centers = triangle_cross(points[faces]), points[faces].mean(axis=1)
        self.areas, self.normals = np.linalg.norm(across, axis=1), normalized(across)
        self.name, self.points, self.faces = path.stem, points, faces
        super().__init__(points, faces)

    def places(self, count, seed):
        """Pairs of a random point (3,) and the normal (3,) there, random by area."""
        faces = np.random.default_rng(seed).choice(len(self.areas), count, p=self.areas / self.areas.sum())
        return zip(self.centers[faces], self.normals[faces], strict=True)


class Touch(NamedTuple):
    """The part of a case of benchmarks.accuracy that the peers need."""

    point: np.ndarray
    axes: np.ndarray  # The paper's frame.
    contours: list
    hold_out: np.ndarray  # (m, 3), relative to the point.


class Score(NamedTuple):
    error: float  # In ‰ of the radius.
    covered: float = np.nan
    interval: float = np.nan  # The score of the 90 % interval in ‰.


# Methods ---------------------------------------------------------------------------------------------


def ours(touch):
    r = reconstruct(touch.point, touch.contours, outward=touch.axes[:, 2])
    return Fit(r.frame.axes, r.height, (r.patch.k1, r.patch.k2), r.height_std)


def without_process(touch):
    with mock.patch.object(process_fit, "UNEXPLAINED_MISFIT", math.inf):
        return ours(touch)


OURS, SEXTIC, PROCESS = "bayes", "without process", "Matérn process on a quadric"
# These settings were the best ones on the scans.
METHODS = {
    OURS: ours,
    SEXTIC: without_process,
    "RBF thin plate": partial(radial_basis, kernel="thin_plate_spline", smoothing=1e-3),
    "RBF cubic": partial(radial_basis, kernel="cubic", degree=2, smoothing=1e-3),
    PROCESS: quadric_process,
}
PEERS = tuple(METHODS)[2:]


def touches(scan, count):
    """Yields ((planes, extent), Touch, radius) at `count` points; extent is the denominator of the share."""
    for point, normal in scan.places(count, 0):
        for extent in EXTENTS:
            for planes in PLANES:
                lengths = {"extent": 1.0 / extent, "step": 1.0 / extent / STEPS}
                try:
                    cuts = sampling(180.0 / planes * np.arange(planes))
                    contours = track(scan, point, normal, cuts, **lengths)
                    paper = {"outward": normal, "method": "least-squares", "degree": 2}
                    r = reconstruct(point, contours, **paper)
                except ValueError:  # There is an edge or a hole.
                    continue
                hold_out = scan.above(r, r.domain.grid(HOLD_OUT)[0]) - point
                if len(hold_out) >= LEAST:
                    yield (planes, extent), Touch(point, r.frame.axes, contours, hold_out), r.radius


def score(fit, touch, radius):
    at, off, change = met(fit, touch, radius)
    miss = np.abs(off) / radius
    if fit.height_std is None:
        return Score(1e3 * miss.mean())
    half = 1.645 * fit.height_std(*at[:, :2].T) / change / radius
    beyond = np.maximum(miss - half, 0.0)
    return Score(1e3 * miss.mean(), np.mean(miss <= half), 1e3 * np.mean(2.0 * half + 20.0 * beyond))


def met(fit, touch, radius):
    """Where the surface meets the paper's normals through held-out points.

    Returns these places (m, 3) in the frame of the fit, how far along the normals they are (m,), and by how
    much a unit along the normals changes the height over the surface (m,).
    """
    at, normal = touch.hold_out @ fit.axes, fit.axes.T @ touch.axes[:, 2]
    off, change, small = np.zeros(len(at)), np.ones(len(at)), 1e-4 * radius
    # If the normal is the direction of the heights, one step is exact, however long.
    steps, farthest = (NEWTON_STEPS, FARTHEST * radius) if normal[2] < 1.0 - 1e-12 else (1, np.inf)
    for _ in range(steps):
        above = fit.height(*at[:, :2].T) - at[:, 2]
        ahead = at + small * normal
        change = np.maximum((above - fit.height(*ahead[:, :2].T) + ahead[:, 2]) / small, LEAST_CHANGE)
        step = np.clip(above / change, -farthest, farthest)
        at, off = at + step[:, None] * normal, off + step
    return at, off, change


def fixed_scores(scan, count, methods):
    """{(planes, extent): {method: mean Score}} of a scan, and {(method, planes): [seconds]}."""
    scores, seconds = defaultdict(lambda: defaultdict(list)), defaultdict(list)
    for cell, touch, radius in touches(scan, count):
        for name, method in methods.items():
            spent, fit = timed(method, touch)
            flat = np.resize(touch.hold_out @ fit.axes, (300, 3))[:, :2]
            seconds[name, cell[0]].append(spent + timed(fit.height, *flat.T)[0])
            scores[cell][name].append(score(fit, touch, radius))
    means = {c: {m: Score(*np.mean(s, axis=0)) for m, s in of.items()} for c, of in scores.items()}
    return means, seconds


# Tables ----------------------------------------------------------------------------------------------


def fixed_row(title, of):
    """A row of the table of `of`, {method: Score}, beginning with the cells `title`."""
    best = min(of[peer].error for peer in PEERS)
    return [
        *title,
        *(f"{of[method].error:.2f}" for method in METHODS),
        f"{of[OURS].error / best:.2f}",
        *(f"{of[m].covered:.2f}" for m in (OURS, SEXTIC, PROCESS)),
        *(f"{of[m].interval:.1f}" for m in (OURS, SEXTIC, PROCESS)),
    ]


def fixed_tables(scores):
    """scores : {scan: {cell: {method: Score}}}"""
    intervals = [f"{what}, {m}" for what in ("within", "score") for m in ("bayes", "sextic", "process")]
    head = ["planes", "extent", *METHODS, "bayes / best peer", *intervals]
    cells = [(planes, extent) for extent in EXTENTS for planes in PLANES]
    rows = []
    for cell in cells:
        there = [of[cell] for of in scores.values() if cell in of]
        means = {m: Score(*np.mean([of[m] for of in there], axis=0)) for m in METHODS}
        rows.append(fixed_row([f"{cell[0]}", f"1/{cell[1]}"], means))
    print("(a) Means over the scans, by planes and extent.\n")
    table(head, rows, left=2)


def time_table(scores, seconds):
    print("(b) The mean error over all planes, extents and scans, and the median processor time in ms.\n")
    rows = []
    for method in METHODS:
        error = np.mean([cell[method].error for of in scores.values() for cell in of.values()])
        times = [time for (name, _), values in seconds.items() if name == method for time in values]
        rows.append([method, f"{error:.2f}", f"{1e3 * median(times):.2f}"])
    table(["method", "error", "ms"], rows)


def automatic_row(scan, count):
    """The numbers of a row of (c)."""
    sure, doubtful, refused, seconds = [], [], 0, []
    for point, normal in scan.places(count, 1):
        try:
            spent, found = timed(explore, scan, point, normal, sampling(), farthest=0.5, degree="auto")
        except ValueError:
            refused += 1
            continue
        r = found.result
        seconds.append(spent)
        (sure if r.status == "ok" else doubtful).append((r, _off(scan, r)))
    is_right = [
        off > OFF * r.radius or off > TOO_FAR * r.mean_height_std or _turned(scan, r) for r, off in doubtful
    ]
    return [
        *(len(sure), len(doubtful), refused, sum(is_right)),
        sum(off > OFF * r.radius for r, off in sure),
        sum(off > SILENT * r.mean_height_std for r, off in sure),
        sum(_turned(scan, r) for r, _ in sure),
        1e3 * sum(r.domain.area for r, _ in sure),
        1e3 * median([r.radius for r, _ in sure] or [0.0]),
        1e3 * median(seconds or [0.0]),
    ]


def _off(scan, r):
    """The mean |dz| over the domain, a length; 0 where the scan is nowhere above it."""
    local = r.frame.to_local(scan.above(r, r.domain.grid(HOLD_OUT)[0]))
    return float(np.abs(r.height(*local[:, :2].T) - local[:, 2]).mean()) if len(local) else 0.0


def _turned(scan, r):
    """Whether the frame is off that of a dense quartic fit by more than TURNED degrees.

    It never is where curvatures are ALIKE, or where the message says that there are no principal directions.
    """
    if r.posterior.is_round:
        return False
    azimuths, reach = math.pi * (3.0 - math.sqrt(5.0)) * np.arange(DENSE), 0.6 * r.radius
    shares = np.sqrt((np.arange(DENSE) + 0.5) / DENSE)
    flat = reach * np.column_stack([shares * np.cos(azimuths), shares * np.sin(azimuths)])
    over = r.frame.to_local(scan.above(r, flat)) / reach
    if len(over) < DENSE / 2:
        return False
    sx, sy, xx, xy, yy = np.linalg.lstsq(monomials(over, exponents(1, 4)), over[:, 2], rcond=None)[0][:5]
    if 2.0 * math.hypot(xx - yy, xy) * r.radius / reach <= ALIKE:
        return False
    return math.hypot(0.5 * math.atan2(-xy, yy - xx), sx, sy) > math.radians(TURNED)


def automatic_table(rows):
    print("(c) Automatic touches. A doubt is right where the heights are off by over 2 % of the radius or")
    print("three deviations, or the frame by 10 degrees where curvatures differ. Areas are in ‰ of the size")
    print("squared, the radius in ‰ of the size, times in ms of the processor.\n")
    head = "scan|sure|in doubt|refused|justified warnings|sure, off > 2 %|> 5 deviations|turned"
    head += "|all areas|radius|ms"
    total = [sum(row[i] for row in rows.values()) for i in range(8)]
    lines = [[name, *(f"{v:.0f}" for v in row[:9]), f"{row[9]:.1f}"] for name, row in rows.items()]
    table(head.split("|"), [*lines, ["all", *(f"{v:.0f}" for v in total), "", ""]])


def main():
    parser = parser_of(__doc__)
    parser.add_argument("--points", type=int, default=100, help="of each scan (%(default)s)")
    parser.add_argument("--only", choices=("fixed", "automatic"), help="only this part")
    parser.add_argument("--scan", default="", help="only scans with this in their names")
    options = parser.parse_args()
    scans = [Scan(path) for path in scan_files(options.scan)]
    if options.only != "automatic":
        scores, seconds = {}, defaultdict(list)
        for scan in scans:
            scores[scan.name], times = fixed_scores(scan, options.points, METHODS)
            for method, values in times.items():
                seconds[method] += values
        fixed_tables(scores)
        time_table(scores, seconds)
    if options.only != "fixed":
        rows = {scan.name: automatic_row(scan, options.points) for scan in scans}
        automatic_table(rows)
    print(f"{options.points} points of each scan; {machine('bpy', 'numpy', 'scipy')}.")


if __name__ == "__main__":
    main()
