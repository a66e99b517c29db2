# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What becomes of touches all over scans that are creased, holed, nested, thin or far from the origin.

`python -m benchmarks.refusals ZIP [--touches N]`, from the root of a checkout; ZIP is the built extension.
Each scan is touched at random points (seeded, by area), with fixed extents and degree 4. The Markdown tables
count patches, those of them with a warning, refusals, and the reasons given. `silent` patches have no warning
although their mean distance from the mesh is more than five times their own deviation.
"""

import argparse
import math
import re
import sys
from collections import Counter
from pathlib import Path
from time import perf_counter

from tools import blender

from . import SCANS_FOLDER, machine, table
from .scans import random_places, sampling_planes

SILENT = 5.0  # A patch without a warning is silent if it is off by more deviations.
EXTENTS = (1.0 / 8.0, 1.0 / 32.0)  # Shares of the object's size; the shorter one is for details.


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("zip", type=Path, help="the built extension")
    parser.add_argument("--touches", type=int, default=200, help="of each scan and extent (%(default)s)")
    options = parser.parse_args()
    scans = sorted(SCANS_FOLDER.glob("*.*"))
    if not scans:
        sys.exit(f"refusals: there are no scans in {SCANS_FOLDER}")
    rows, reasons = [], Counter()
    with blender.quiet():
        extension = blender.start(options.zip)
        for path in scans:
            for share in EXTENTS:
                row, why = _touches(extension, path, share, options.touches)
                rows.append(row)
                reasons += why
    head = ["scan, extent of the size", "patches", "with a warning", "refused", "silent", "slowest touch, ms"]
    table(head, rows)
    table(
        ["warned or refused because", "touches"], [[why, f"{count}"] for why, count in reasons.most_common()]
    )
    print(f"{options.touches} touches a row; {machine('bpy', 'numpy', 'scipy')}.")


def _touches(extension, path, share, count):
    """A row of the table, and a Counter of the reasons for warnings and refusals."""
    import bpy

    extension.tactile_addon.files.mesh_file.open_file(path)
    obj, depsgraph = bpy.context.scene.objects[0], bpy.context.evaluated_depsgraph_get()
    size = extension.tactile_addon.touch.surface.MeshSurface(obj, depsgraph).size
    planes = sampling_planes(extension)
    fit = {"extent": share * size, "step": 0.0, "noise": 0.0, "seed": 0, "method": "bayes", "degree": 4}
    reports, reasons, slowest = [], Counter(), 0.0
    for _, location in random_places(obj, count):
        start = perf_counter()
        try:
            touched = extension.tactile_addon.touch.touch_object.touch(
                obj, depsgraph, location, planes, **fit
            )
        except ValueError as error:
            reasons[_kind(f"refused: {error}")] += 1
            continue
        finally:
            slowest = max(slowest, perf_counter() - start)
        report = extension.tactile_addon.touch.touch_object.completed(touched).report
        reports.append(report)
        _check_finite(report)
        if report["status"] != "ok":
            reasons[_kind(f"{report['status']}: {report['message']}")] += 1
    sure = [report for report in reports if report["status"] == "ok"]
    silent = sum(report.get("vertex_distance_mean", 0.0) > SILENT * report["height_std"] for report in sure)
    name = f"{path.stem}, 1/{1 / share:.0f}"
    numbers = len(reports), len(reports) - len(sure), count - len(reports), silent
    return [name, *(f"{number}" for number in numbers), f"{1e3 * slowest:.0f}"], reasons


def _kind(message):
    """A message without its advice, with # for each number, so that equal reasons are counted together."""
    message = re.split(r"\. \d of ", message)[0]
    return re.sub(r"-?\d[\d.]*(e[+-]\d+)?", "#", message.rsplit(": ", 1)[0])


def _check_finite(value):
    if isinstance(value, dict):
        value = list(value.values())
    if isinstance(value, list):
        for part in value:
            _check_finite(part)
    elif isinstance(value, float) and not math.isfinite(value):
        raise ArithmeticError(f"a report holds {value}")


if __name__ == "__main__":
    main()
