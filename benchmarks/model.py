# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What a change of the surface's model makes of accuracy, intervals, verdicts and times: before and after.

`python -m benchmarks.model --base ROOT [--robot FOLDER] [--size N] [TASK ...]`, from the root of a checkout;
ROOT is a worktree of this repository before the change, FOLDER a copy of
github.com/vu-arma-dev/robot-palpation-data. Both checkouts make the same touches (model_worker.py), in two
processes at once. The command prints Markdown tables of means:

(a) errors, scores and shares of the 90 % intervals, on exact and random surfaces (um), on scans (permille of
    the radius, real.py), there with measured normals too, and of the robot's contacts (mm); `+-` is the
    deviation of a paired ratio;
(b) verdicts in the sweeps of benchmarks.stability, in numbers of cases;
(c) automatic touches of the scans, which tap between their curves;
(d) times, as `benchmarks.speed --base` prints them.
"""

import argparse
import json
from collections import defaultdict
from pathlib import Path

import numpy as np

from tools import blender

from . import ROOT, SCANS_FOLDER, accuracy, machine, ratios, stability, table

NORMAL_STD = 0.02  # radians
TASKS = ("exact", "random", "real", "normals", "robot", "stability", "automatic", "times")


def compared(base, jobs):
    """{group: (rows of this checkout, rows of the base)} of jobs, as arrays (2, n, k)."""
    workers = [ratios.worker("model_worker.py", root) for root in (ROOT, base)]
    found = defaultdict(lambda: ([], []))
    for job in jobs:
        for worker in workers:
            worker.stdin.write(json.dumps(job) + "\n")
            worker.stdin.flush()
        ours, theirs = (json.loads(worker.stdout.readline()) for worker in workers)
        for one, other in zip(ours, theirs, strict=True):
            found[one[0]][0].append(one[1:])
            found[one[0]][1].append(other[1:])
    for worker in workers:
        worker.stdin.close()
        worker.wait()
    return {group: np.array(rows) for group, rows in found.items()}


def accuracy_table(found):
    rows = []
    for group in (*found, *sorted({name.split(",")[0] for name in found})):
        here, base = np.concatenate([v for n, v in found.items() if group in (n, n.split(",")[0])], axis=1)
        cells = [group, str(len(here))]
        for i in range(2):
            mean = base[:, i].mean()
            std = (here[:, i] - base[:, i]).std() / np.sqrt(len(here)) / mean
            cells += [
                f"{here[:, i].mean():.4g}",
                f"{mean:.4g}",
                f"{here[:, i].mean() / mean:.3f}",
                f"{std:.3f}",
            ]
        rows.append([*cells, f"{here[:, 2].mean():.3f}", f"{base[:, 2].mean():.3f}"])
    head = ["", "cases"]
    for what in ("error", "interval score"):
        head += [what, "base", "ratio", "+-"]
    table([*head, "within 90 %", "base"], rows)


def count_table(head, found):
    rows = []
    for group, (here, base) in found.items():
        pairs = zip(here.sum(axis=0), base.sum(axis=0), strict=True)
        rows.append([group, str(len(here)), *(f"{one:.4g} / {other:.4g}" for one, other in pairs)])
    here, base = np.concatenate(list(found.values()), axis=1).sum(axis=1)
    rows.append(["all", "", *(f"{one:.4g} / {other:.4g}" for one, other in zip(here, base, strict=True))])
    table(["this / base", "cases", *head], rows)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--base", type=Path, required=True, metavar="ROOT", help="a checkout to compare with")
    parser.add_argument("--robot", metavar="FOLDER", help="the robot's data, which are left out without")
    parser.add_argument("--size", type=int, default=10, help="seeds, and points of a scan (%(default)s)")
    parser.add_argument("tasks", nargs="*", choices=[*TASKS, []], help="what to compare (all)")
    options = parser.parse_args()
    tasks, n = options.tasks or TASKS, options.size
    scans = [str(path) for path in sorted(SCANS_FOLDER.glob("*.*"))]
    jobs = []
    if "exact" in tasks:
        jobs += [("exact", name, max(1, n // 5)) for name in accuracy.SURFACES]
    if "random" in tasks:
        jobs += [("random", seed) for seed in range(5 * n)]
    if "real" in tasks:
        jobs += [("fixed", path, n) for path in scans]
    if "normals" in tasks:
        jobs += [("fixed", path, n, NORMAL_STD) for path in scans]
    if "robot" in tasks and options.robot:
        jobs.append(("palpated", options.robot, max(1, n // 5)))
    if jobs:
        accuracy_table(compared(options.base, jobs))
    if "stability" in tasks:
        jobs = [("sweep", number, max(1, n // 10)) for number in range(len(stability.ALL))]
        head = ["harmless", "warned of", "due", "due, not given"]
        count_table(head, compared(options.base, jobs))
    if "automatic" in tasks:
        jobs = [("automatic", path, 2 * n) for path in scans]
        head = ["sure", "in doubt", "refused", "silent", "taps contradict", "sure areas", "errors"]
        count_table(head, compared(options.base, jobs))
    if "times" in tasks:
        with blender.quiet():
            cases = ratios.cases()
        ratios.compare(options.base, cases, ratios.TASKS)
    print(f"Size {n}; {machine('bpy', 'numpy', 'scipy')}.")


if __name__ == "__main__":
    main()
