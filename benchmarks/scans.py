# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Patches on scans of real objects.

`python -m benchmarks.scans ZIP`, from the root of a checkout; ZIP is the built extension.

At one fixed point of each scan the extension tracks three curves 60 degrees apart, with a simulated
sensor's noise, and fits a patch by each method. The Markdown table says how far the patch is from the
contacts, (6), and from the mesh vertices in its domain, and how long tracking and fit take on one thread.
A second table does the same at random points (seeded) all over each scan, for "bayes" and TAGC.
"""

import argparse
import math
import sys
from itertools import islice
from pathlib import Path
from statistics import median
from typing import NamedTuple

from tools import blender

from . import SCANS_FOLDER, machine, table

METHODS = {  # The methods with their default weights, and their names in the table.
    "bayes": "bayes",
    "tagc": "tagc, weight 1e3",
    "quadratic-variation": "quadratic-variation, weight 1e5",
    "least-squares": "least-squares",
}
AZIMUTHS = (0.0, 60.0, 120.0)
RUNS = 7
LEAST_VERTICES = 20  # A mean distance counts if at least this many vertices are over the patch.


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

    @property
    def title(self):
        return f"{self.name}, {self.scale * self.extent:g} {self.unit}"

    @property
    def lengths(self):
        return {"extent": self.extent, "step": self.extent / self.steps, "noise": self.noise}


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


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("zip", type=Path, help="the built extension")
    parser.add_argument(
        "--data", type=Path, default=SCANS_FOLDER, metavar="FOLDER", help="that of the scans (%(default)s)"
    )
    parser.add_argument(
        "--share", type=float, default=1.0, help="the share of the extents to touch (%(default)s)"
    )
    parser.add_argument("--touches", type=int, default=40, help="at random points of each scan (%(default)s)")
    options = parser.parse_args()
    for path in (options.zip, *(options.data / scan.file for scan in SCANS)):
        if not path.is_file():
            sys.exit(f"scans: there is no file {path}")
    scans = [scan._replace(extent=options.share * scan.extent) for scan in SCANS]
    with blender.quiet():
        extension = blender.start(options.zip)
        rows = [row for scan in scans for row in _rows(extension, scan, options.data)]
        touches = [_random_row(extension, scan, options.data, options.touches) for scan in scans]
    head = "object, extent|method|contacts|fit error (6)|vertices|mean distance|max|ms"
    table(head.split("|"), rows, left=2)
    print(_caption(), end="\n\n")
    print(f"Medians over {options.touches} random touches. Calibration is distance over mean height std.\n")
    head = "object, extent|bayes|tagc|ratio|height std|calibration|uncertain|ms"
    table(head.split("|"), touches)


def _rows(extension, scan, data):
    """Yields a row of the table for each method."""
    import bpy

    extension.tactile_addon.files.mesh_file.open_file(data / scan.file)
    touched = (bpy.context.scene.objects[0], bpy.context.evaluated_depsgraph_get(), scan.location)
    planes = sampling_planes(extension)
    for method in METHODS:
        fit = {"seed": 0, "method": method, "degree": 4}
        reports = [_report(extension, *touched, planes, **scan.lengths, **fit) for _ in range(RUNS + 1)]
        seconds = [report["seconds"] for report in reports[1:]]
        report = reports[0]
        yield [
            scan.title,
            METHODS[method],
            f"{report['contacts']}",
            f"{scan.scale * report['fit_error']:.4f}",
            f"{report['vertices']}",
            f"{scan.scale * report['vertex_distance_mean']:.4f}",
            f"{scan.scale * report['vertex_distance_max']:.3f}",
            f"{1e3 * median(s['touch'] for s in seconds):.1f}",
        ]


def _random_pairs(extension, scan, data, count):
    """Yields the reports of "bayes" and TAGC at random points where both give a patch."""
    import bpy

    extension.tactile_addon.files.mesh_file.open_file(data / scan.file)
    obj, depsgraph = bpy.context.scene.objects[0], bpy.context.evaluated_depsgraph_get()
    planes = sampling_planes(extension)
    for index, location in random_places(obj, count):
        touched = (extension, obj, depsgraph, location, planes)
        fit = {"seed": index, "degree": 4, **scan.lengths}
        try:
            bayes, tagc = (_report(*touched, method=method, **fit) for method in ("bayes", "tagc"))
        except ValueError:  # There is an edge or a hole.
            continue
        if min(bayes["vertices"], tagc["vertices"]) >= LEAST_VERTICES:
            yield bayes, tagc


def _random_row(extension, scan, data, count):
    """A row of the second table: medians over `count` random points."""
    found = list(islice(_random_pairs(extension, scan, data, 4 * count), count))
    ours, papers = (
        median(scan.scale * reports[i]["vertex_distance_mean"] for reports in found) for i in (0, 1)
    )
    std = median(scan.scale * bayes["height_std"] for bayes, _ in found)
    calibration = median(bayes["vertex_distance_mean"] / bayes["height_std"] for bayes, _ in found)
    uncertain = sum(bayes["status"] != "ok" for bayes, _ in found)
    touch = median(bayes["seconds"]["touch"] for bayes, _ in found)
    return [
        scan.title,
        f"{ours:.4f}",
        f"{papers:.4f}",
        f"{ours / papers:.2f}",
        f"{std:.4f}",
        f"{calibration:.2f}",
        f"{uncertain} of {len(found)}",
        f"{1e3 * touch:.1f}",
    ]


def sampling_planes(extension):
    return [extension.core.SamplingPlane(math.radians(azimuth)) for azimuth in AZIMUTHS]


def random_places(obj, count):
    """Yields (index of a face, its center in the world); faces are random by area, but seeded."""
    import numpy as np

    areas = np.array([face.area for face in obj.data.polygons])
    for index in np.random.default_rng(0).choice(len(areas), count, p=areas / areas.sum()).tolist():
        yield index, obj.matrix_world @ obj.data.polygons[index].center


def _report(extension, *place, **inputs):
    touch = extension.tactile_addon.touch.touch_object
    return touch.completed(touch.touch(*place, **inputs)).report


def _caption():
    return (
        "Lengths are in mm, for Eros in km; sensor noise 0.05 mm, for Eros 0.0163 km; seed 0. Contacts are "
        "counted without the reference point. ms: tracking and fit, median of "
        f"{RUNS} runs, {machine('bpy', 'numpy', 'scipy')}."
    )


if __name__ == "__main__":
    main()
