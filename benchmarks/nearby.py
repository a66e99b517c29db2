# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""How an automatic extent follows while a point is dragged, beside new touches and an extent that stays.

`python -m benchmarks.nearby [--paths N]`, from the root of a checkout; it needs bpy to read the scans. From N
random points (seeded, by area) of each scan a point slides over it in a random direction, in up to 25 steps
of .4 % of its size. At each place the scan is touched in three ways: near the last touch
(`core.explore_nearby`), anew (`core.explore`), and with the extent and step of the first touch of the path.
The Markdown table has the shares of touches that are sure. For touches near the last one it has the mean
number of fits, the geometric mean of their extent over that of new touches, and the share of updates in which
their extent changes by more than a tenth. It ends with medians of processor time.
"""

import argparse
import math
from itertools import pairwise
from statistics import mean, median
from time import process_time

import numpy as np

from core import SamplingPlane, explore, explore_nearby, reaches_of, reconstruct, track
from core.exploration import nearby
from tools import blender

from . import SCANS_FOLDER, machine, table
from .real import Scan

PLANES = [SamplingPlane(math.pi * i / 3) for i in range(3)]
STEPS, STEP, LIFT = 25, 0.004, 0.02  # The number of steps of a path, and shares of the size.
FARTHEST = 0.5  # A share of the size, as in Blender.
JUMP = math.log(1.1)  # Changes of the extent by a larger factor are counted.


def path(scan, point, normal, rng):
    """Yields points (3,) and normals (3,) along a curve on a scan, which may end early."""
    ahead = np.cross(normal, rng.normal(size=3))
    for _ in range(STEPS):
        ahead -= (ahead @ normal) * normal
        start = point + STEP / np.linalg.norm(ahead) * ahead + LIFT * normal
        hit = scan.ray_cast(tuple(start), tuple(-normal), 2.0 * LIFT)
        if hit is None:
            return
        point, normal = map(np.array, hit)
        yield point, normal


def timed(touch):
    """(whether a touch is sure, what it found or None if it was refused, seconds)."""
    start = process_time()
    try:
        found = touch()
        result = getattr(found, "result", found)
        return result.status == "ok", found, process_time() - start
    except ValueError:
        return False, None, process_time() - start


def along(scan, point, normal, rng, fits):
    """Yields (near, number of its fits, new, kept) for each place of a path, with touches as from `timed`."""
    first = explore(scan, point, normal, PLANES, farthest=FARTHEST)
    reaches = reaches_of(first)

    def near():
        nonlocal reaches
        found, reaches = explore_nearby(scan, *place, PLANES, reaches, farthest=FARTHEST)
        return found

    def kept():
        contours = track(scan, *place, PLANES, extent=first.extent, step=first.step)
        return reconstruct(place[0], contours, outward=place[1])

    for place in path(scan, point, normal, rng):
        fits.clear()
        row = timed(near)
        yield (
            row,
            len(fits),
            timed(lambda place=place: explore(scan, *place, PLANES, farthest=FARTHEST)),
            timed(kept),
        )


def summary(name, paths):
    rows = [row for each in paths for row in each]
    lengths = [math.log(near[1].extent / new[1].extent) for near, _, new, _ in rows if near[1] and new[1]]
    extents = [[near[1].extent for near, *_ in each if near[1]] for each in paths]
    changes = [abs(math.log(b / a)) > JUMP for each in extents for a, b in pairwise(each)]
    columns = [[row[i] for row in rows] for i in (0, 2, 3)]
    return [
        name,
        str(len(rows)),
        *(f"{mean(sure for sure, *_ in column):.2f}" for column in columns),
        f"{mean(row[1] for row in rows):.2f}",
        f"{math.exp(mean(lengths)):.2f}",
        f"{mean(changes):.2f}",
        *(f"{1e3 * median(seconds for *_, seconds in column):.1f}" for column in columns),
    ]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--paths", type=int, default=6, help="on each scan (%(default)s)")
    options = parser.parse_args()
    fits, fitted = [], nearby.fitted

    def counted(*given):
        fits.append(1)
        return fitted(*given)

    nearby.fitted = counted
    rows, everything = [], []
    for file in sorted(SCANS_FOLDER.glob("*.*")):
        with blender.quiet():
            scan, rng = Scan(file), np.random.default_rng(3)
        paths = [list(along(scan, *place, rng, fits)) for place in scan.places(options.paths, 5)]
        rows.append(summary(scan.name, paths))
        everything += paths
    titles = ("near", "new", "kept")
    table(
        [
            *("scan", "touches"),
            *(f"sure, {title}" for title in titles),
            *("fits", "length / new", "changes"),
            *(f"ms, {title}" for title in titles),
        ],
        [*rows, summary("all", everything)],
    )
    print(f"Times are processor time; {machine('bpy')}.")


if __name__ == "__main__":
    main()
