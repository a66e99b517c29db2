# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""How many points a second a stability map takes, and for what, on a small and on a large mesh.

`python -m benchmarks.stability_map ZIP`, from the root of a checkout; ZIP is the built extension.

The wavy sheet of benchmarks.live is mapped by the operator, as a script does it, with the faces, spacings and
extents of CASES and defaults for the rest. The Markdown table has the median of a few runs on one thread, in
one Blender without a window. `points/s` is of the whole operator, from the mesh to the painted copy. The next
columns are milliseconds a point: tracking with its ray casts; the fit with deviation, condition number and
status; the distances to the mesh; and thinning and painting. The last column is the seconds of what is done
once, such as the tree of the faces.
"""

import argparse
from pathlib import Path
from statistics import median_low
from time import perf_counter

from tools import blender

from . import machine, table
from .live import Clock, sheet

EXTENT = 0.25  # An eighth of the sheet.
CASES = [  # Faces, spacing and extent; 0 leaves a length to the operator.
    (10_000, 0.0, EXTENT),
    (100_000, 0.0, EXTENT),
    (100_000, 0.02, EXTENT),
    (1_000_000, 0.0, EXTENT),
    (100_000, 0.0, 0.0),
]
RUNS = 3


def measure(bpy, clock, faces, spacing, extent):
    """A row of the table, of the run with the median time."""
    sheet(bpy, faces)
    runs = []
    for _ in range(RUNS):
        clock.spent.clear()
        start = perf_counter()
        bpy.ops.tactile.stability_map(target="Grid", spacing=spacing, extent=extent)
        runs.append((perf_counter() - start, dict(clock.spent)))
        painted = bpy.context.object
        count = painted["tactile_map"]["touched"]
        bpy.data.objects.remove(painted)
    whole, spent = runs[[seconds for seconds, _ in runs].index(median_low([seconds for seconds, _ in runs]))]
    parts = [spent["tracking"], spent["fit"] + spent["noting"], spent["taps"]]
    parts.append(whole - sum(parts) - spent["detached"])
    cells = [f"{1e3 * seconds / count:.2f}" for seconds in parts]
    return [
        f"{faces}",
        f"{extent or 'auto'}",
        f"{count}",
        f"{count / whole:.0f}",
        *cells,
        f"{spent['detached']:.2f}",
    ]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("zip", type=Path, metavar="ZIP")
    extension = blender.start(parser.parse_args().zip)
    import bpy

    addon, clock = extension.tactile_addon, Clock()
    clock.wrap(addon.touch.detached_mesh.DetachedMesh, "__init__", "detached")
    side_by_side, tracking = extension.core.exploration.side_by_side, extension.core.contours.tracking
    for owner, name, stage in (
        (tracking, "first_contact", "tracking"),
        (tracking, "_extended", "tracking"),
        (side_by_side, "fitted", "fit"),
        (side_by_side, "_with_stds", "fit"),
    ):
        clock.wrap(owner, name, stage)
    clock.wrap(addon.stability_map.stability.StabilityMap, "_note", "noting")
    clock.wrap(side_by_side, "tapped", "taps")
    columns = (
        "faces",
        "extent",
        "points",
        "points/s",
        "tracking",
        "fit",
        "taps",
        "thinning, paint",
        "once, s",
    )
    with blender.quiet():
        rows = [measure(bpy, clock, *case) for case in CASES]
    table(columns, rows, left=0)
    print(f"Times are milliseconds a point, in the median of {RUNS} runs; {machine('bpy')}.")


if __name__ == "__main__":
    main()
