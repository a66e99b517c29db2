# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Judges the fits of any checkout, so that two can be compared in one run; benchmarks.model starts it.

`python benchmarks/model_worker.py ROOT`. Each line of the input is a JSON list: the name of a task and its
arguments. The answer is a JSON list of rows; the first cell of each is the group it belongs to. Touches are
those of the checkout's own benchmarks, drawn by seeds, so two checkouts answer for the same ones.
"""

import json
import sys
from dataclasses import replace
from itertools import islice
from pathlib import Path

sys.path.insert(0, sys.argv[1])  # This comes before the folder of this file, which has no core.

import numpy as np

from benchmarks import accuracy, real, robot, stability
from core import explore, reconstruct
from tools import blender

EVEN = {f"{n} planes": (tuple(180.0 * i / n for i in range(n)), (0,) * n) for n in (4, 5, 6)}
accuracy.PLANES |= EVEN
RADIUS = 8.0  # mm, of a patch of the robot's strokes


def judged(group, off, std):
    """The row of a fit: mean error, score of the 90 % interval, and share within it."""
    half = 1.645 * std
    beyond = np.maximum(off - half, 0.0)
    return [group, np.mean(off), np.mean(2.0 * half + 20.0 * beyond), np.mean(off <= half)]


def of_case(group, case):
    fit = accuracy.ours(case)
    x, y, z = (case.hold_out @ fit.axes).T
    return judged(group, 1e3 * np.abs(fit.height(x, y) - z), 1e3 * fit.height_std(x, y))


def exact(name, seeds):
    return [
        of_case(f"exact, {planes}", case)
        for planes in (*accuracy.EXACT_PLANES, *EVEN)
        for noise in accuracy.NOISES
        for seed in range(seeds if noise else 1)
        if (case := accuracy.exact_case(name, planes, noise, seed)) is not None
    ]


def random(seed):
    """Random shapes with the plane sets of benchmarks.accuracy."""
    return [of_case(f"random, {planes}", case) for planes, case in accuracy.random_cases(seed).items()
            if planes not in EVEN]  # fmt: skip


def scan_of(path):
    with blender.quiet():
        return real.Scan(Path(path))


def fixed(path, points, normal_std=None):
    """Touches of a scan; with a deviation in radians, the contacts have measured normals that scatter so."""
    rows, rng = [], np.random.default_rng(0)
    for (planes, _), touch, radius in real.touches(scan_of(path), points):
        group = f"real, {planes} planes"
        if normal_std is not None:
            contours = [with_normals(contour, normal_std, rng) for contour in touch.contours]
            group, touch = f"normals, {planes} planes", touch._replace(contours=contours)
        found = real.score(real.ours(touch), touch, radius)
        rows.append([group, found.error, found.interval, found.covered])
    return rows


def with_normals(contour, std, rng):
    normals = contour.normals + rng.normal(0.0, std, contour.normals.shape)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return replace(contour, normals=normals, normal_std=std)


def palpated(folder, points):
    """The robot's strokes, and three curves cut out of them."""
    rows = []
    for _, contacts, directions in robot.explorations(folder):
        for place in robot.places(contacts, directions, points, RADIUS):
            try:
                options = {"outward": place.outward, "radius": RADIUS}
                judge = reconstruct(place.place, [], strokes=[place.given], **options)
            except ValueError:
                continue
            if len(robot.inside(judge, place.held_out)) < robot.FEWEST // robot.SHARE:
                continue
            rows.append(["robot, strokes", *_of_robot(judge, judge, place)])
            try:
                curves = list(robot.curves(judge, place.given))
                crossed = reconstruct(judge.frame.origin, curves, outward=place.outward)
                rows.append(["robot, curves", *_of_robot(crossed, judge, place)])
            except ValueError:  # The rows are too far apart for curves to be cut out.
                continue
    return rows


def _of_robot(r, judge, place):
    given, held_out = (r.frame.to_local(robot.inside(judge, p)) for p in (place.given, place.held_out))
    scatter = np.sqrt(np.mean((given[:, 2] - r.height(*given[:, :2].T)) ** 2))
    off = np.abs(held_out[:, 2] - r.height(*held_out[:, :2].T))
    return judged("", off, np.hypot(r.height_std(*held_out[:, :2].T), scatter))[1:]


def sweep(number, seeds):
    """Verdicts: harmless cases, those warned of, those where a warning is due, and where it is not given."""
    of = stability.ALL[number]
    rows = []
    for value in of.values:
        setting = of.setting(value)
        for name, (surface, extent) in of.surfaces(value).items():
            for seed in range(seeds):
                try:
                    touched = stability.touch(surface, extent, setting, [seed, *map(ord, name)])
                    found = stability.outcome(surface, setting, *touched, "bayes")
                except ValueError:
                    found = stability.Outcome("refused")
                due = found.is_due or found.status == "refused"
                harmless = value in of.benign and not due
                kind = "stability" if number < len(stability.SWEEPS) else "untold"
                silent = stability.is_quiet(found)
                rows.append([kind, harmless, harmless and found.status != "ok", due, silent])
    return rows


def automatic(path, points):
    """Automatic touches: sure, in doubt, refused, silently off, contradicted by taps, area, error."""
    scan, rows = scan_of(path), []
    planes = [real.SamplingPlane(np.pi * i / 3) for i in range(3)]
    for point, normal in islice(scan.places(points, 1), points):
        try:
            r = explore(scan, point, normal, planes, farthest=0.5, degree="auto").result
        except ValueError:
            rows.append([scan.name, 0, 0, 1, 0, 0, 0.0, 0.0])
            continue
        off, sure = real._off(scan, r), r.status == "ok"
        silent = sure and off > real.SILENT * r.mean_height_std
        tapped = r.taps is not None and r.taps.off > 0.0
        area = 1e3 * r.domain.area if sure else 0.0
        rows.append([scan.name, sure, not sure, 0, silent, tapped, area, 1e3 * off / r.radius])
    return rows


TASKS = {each.__name__: each for each in (exact, random, fixed, palpated, sweep, automatic)}


def main():
    for line in sys.stdin:
        name, *arguments = json.loads(line)
        rows = TASKS[name](*arguments)
        print(json.dumps([[group, *map(float, values)] for group, *values in rows]), flush=True)


if __name__ == "__main__":
    main()
