# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""How long fits and automatic touches take, compared with an older checkout and scipy's thin plate.

`python -m benchmarks.speed --base ROOT` prints it; ROOT is any worktree of this repository. Each checkout
runs in a process of its own on the same cases. The two take turns, so that other programs slow down both.
"""

import os
import pickle
import subprocess
import sys
import tempfile
from contextlib import ExitStack
from pathlib import Path
from statistics import median

import numpy as np

from core import SamplingPlane, reconstruct, track

from . import ROOT, SCANS_FOLDER, accuracy, table
from .real import Scan

BATCH = 20  # The number of touches of each scan that are made at once.
# Points of each scan, numbers of planes, the extent as a share of its size, and steps of a half curve.
POINTS, PLANES, EXTENT, STEPS = 6, (3, 5), 1.0 / 16.0, 12
# What is timed: the cases it is timed on, and the number of rounds, of which the fastest counts.
TASKS = {"batch": ("batches", 1), "planes": ("touches", 1), "touch": ("touches", 2), "fit": ("fits", 5)}


def compare(base, cases, tasks):
    """Prints a Markdown table of the medians of `tasks`, some of TASKS, here and in the checkout `base`."""
    cases, smooth = cases
    with tempfile.TemporaryDirectory() as folder, ExitStack() as stack:
        path = Path(folder, "cases")
        path.write_bytes(pickle.dumps(cases))
        ours, theirs = (stack.enter_context(worker("speed_worker.py", root, path)) for root in (ROOT, base))
        rows = []
        for task, (kind, rounds) in TASKS.items():
            if task not in tasks:
                continue
            timed = [(ours, task), (theirs, task), *([(ours, "spline")] if task == "fit" else [])]
            seconds = np.array([_least_seconds(timed, i, rounds) for i in range(len(cases[kind]))])
            groups = {task: np.full(len(seconds), True)}
            if task == "fit":
                groups = {"fit, no process": smooth, "fit, process": ~smooth}
            rows += [_row(title, seconds[which], cases, task) for title, which in groups.items()]
    table(["medians, ms", "this", "base", "this / base", "thin plate", "this / thin plate", "cases"], rows)


def _least_seconds(timed, case, rounds):
    """The least seconds of each (worker, task) of `timed` over this many rounds, in which they take turns."""
    return np.min([[answer(each, f"{task} {case}") for each, task in timed] for _ in range(rounds)], axis=0)


def _row(title, seconds, cases, task):
    ms = [1e3 * median(column) for column in seconds.T]
    size = len(cases["batches"][0][1]) if task == "batch" else 1
    ratios = [f"{median(seconds[:, 0] / other):.2f}" for other in seconds.T[1:]]
    return [
        title,
        *(f"{each / size:.2f}" for each in ms[:2]),
        ratios[0],
        *([f"{ms[2]:.2f}", ratios[1]] if len(ms) > 2 else ["", ""]),
        f"{len(seconds)}",
    ]


def worker(script, root, *arguments):
    """A process in which a script of this folder times the checkout `root`."""
    command = [sys.executable, str(ROOT / "benchmarks" / script), str(root), *map(str, arguments)]
    # Blender adds to the environment that processes inherit, and says on their standard output what it found.
    env = dict(os.environ)
    return subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, env=env)


def answer(worker, task):
    """The seconds that a task takes in the process `worker`."""
    worker.stdin.write(f"{task}\n")
    worker.stdin.flush()
    return float(worker.stdout.readline())


def cases():
    """The cases that speed_worker.py reads, and which of its fits have no process, booleans (n,)."""
    scans = [Scan(path) for path in sorted(SCANS_FOLDER.glob("*.*"))]
    places = [list(scan.places(POINTS, 1)) for scan in scans]
    together = [[np.array(part) for part in zip(*scan.places(BATCH, 2), strict=True)] for scan in scans]
    touched = [*_exact(), *(each for s, p in zip(scans, places, strict=True) for each in _fixed(s, p))]
    results = [reconstruct(point, contours, outward=outward) for point, outward, contours in touched]
    contacts = [np.vstack([np.zeros(3), r.contacts]) / r.radius for r in results]
    found = {
        "fits": [(p, n, [(c.points, c.plane_normal) for c in contours]) for p, n, contours in touched],
        "contacts": contacts,
        "scans": [(scan.points, scan.faces) for scan in scans],
        "touches": [(i, *place) for i, of in enumerate(places) for place in of],
        "batches": [(i, *of) for i, of in enumerate(together)],
    }
    return found, np.array([not r.posterior.amplitude for r in results])


def _exact():
    """The touches of benchmarks.accuracy, as (point, outward, contours)."""
    cases = [
        accuracy.exact_case(name, planes, noise, 0)
        for name in accuracy.SURFACES
        for planes in accuracy.EXACT_PLANES
        for noise in accuracy.NOISES
    ]
    return [(case.point, case.axes[:, 2], case.contours) for case in cases]


def _fixed(scan, places):
    """Yields touches of a scan with a given extent, as (point, outward, contours)."""
    for point, outward in places:
        for count in PLANES:
            planes = [SamplingPlane(np.pi * i / count) for i in range(count)]
            try:
                contours = track(scan, point, outward, planes, extent=EXTENT, step=EXTENT / STEPS)
                reconstruct(point, contours, outward=outward)
            except ValueError:  # There is an edge or a hole.
                continue
            yield point, outward, contours
