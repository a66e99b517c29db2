# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Times the core of any checkout, so that two can be compared in one run; benchmarks.ratios starts it.

`python benchmarks/speed_worker.py ROOT CASES`, where CASES is a pickled file. Each line of the input names a
task and a case, as in `touch 3`, and is answered by seconds of processor time, which other programs change
least. The script uses what all checkouts have in common; what a newer core does by itself, it does step by
step with an older one.
"""

import math
import pickle
import sys
from time import process_time

import numpy as np

sys.path.insert(0, sys.argv[1])  # This comes before the folder of this file, which has no core.

import core

FARTHEST, HEIGHTS = 0.5, 300  # A share of the scan's size, and a number of heights.
HELPS, MOST_PLANES = 0.1, 6  # The least share that one more plane takes off the deviation, and a number.
EVEN = [core.SamplingPlane(math.pi * i / 3) for i in range(3)]


class Mesh:
    """A mesh that casts rays by Blender's tree of its faces."""

    def __init__(self, points, faces):
        import bpy  # noqa: F401  # It brings mathutils.
        from mathutils.bvhtree import BVHTree

        self.tree = BVHTree.FromPolygons(points.tolist(), faces.tolist(), all_triangles=True)

    def ray_cast(self, origin, direction, distance):
        hit, normal, _, _ = self.tree.ray_cast(origin, direction, distance)
        return None if hit is None else (tuple(hit), tuple(normal))


def fit(point, outward, contours):
    """A fit and its heights at HEIGHTS places."""
    r = core.reconstruct(point, contours, outward=outward)
    return getattr(r, "height", r.patch.height)(*(r.radius * places().T))


def places():
    """Points over the unit disk, (HEIGHTS, 2)."""
    azimuths = math.pi * (3.0 - math.sqrt(5.0)) * np.arange(HEIGHTS)
    radii = 0.9 * np.sqrt((np.arange(HEIGHTS) + 0.5) / HEIGHTS)
    return np.column_stack([radii * np.cos(azimuths), radii * np.sin(azimuths)])


def spline(contacts):
    """The heights of scipy's thin plate on contacts (n, 3) in unit radius."""
    from scipy.interpolate import RBFInterpolator

    of = RBFInterpolator(contacts[:, :2], contacts[:, 2], kernel="thin_plate_spline", smoothing=1e-3)
    return of(places())


def touch(scan, point, outward, planes=EVEN, farthest=FARTHEST, **more):
    return core.explore(scan, point, outward, planes, farthest=farthest, degree="auto", **more)


def touch_with_planes(scan, point, outward):
    """An automatic touch to which planes are added while they help."""
    if hasattr(core, "explore_many"):
        return touch(scan, point, outward, tolerance=0.0)
    found, planes = touch(scan, point, outward), EVEN
    farthest, (e1, n, _) = found.extent, EVEN[0].axes(outward).T
    while len(planes) < MOST_PLANES:
        plane, expected = core.suggest_plane(found.result)
        if expected > (1.0 - HELPS) * found.result.mean_height_std:
            break
        d1, _, up = found.result.frame.axes.T
        along = plane.axes(up, d1)[:, 0]
        planes = [*planes, core.SamplingPlane(core.azimuth_of(along, n, e1))]
        found = touch(scan, point, outward, planes, farthest)
    return found


def many(scan, points, outward):
    if hasattr(core, "explore_many"):
        return core.explore_many(scan, points, outward, EVEN, farthest=FARTHEST, degree="auto")
    return [refusing(touch, scan, *each) for each in zip(points, outward, strict=True)]


def refusing(run, *arguments):
    try:
        return run(*arguments)
    except ValueError as error:
        return error


def contour(points, plane_normal):
    return core.Contour(points, plane_normal=plane_normal)


def main():
    with open(sys.argv[2], "rb") as file:
        cases = pickle.load(file)
    scans = [Mesh(*mesh) for mesh in cases["scans"]]
    fits = [(p, n, [contour(*c) for c in contours]) for p, n, contours in cases["fits"]]
    touches = [(scans[i], *place) for i, *place in cases["touches"]]
    batches = [(scans[i], *places) for i, *places in cases["batches"]]
    tasks = {
        "fit": lambda i: fit(*fits[i]),
        "spline": lambda i: spline(cases["contacts"][i]),
        "touch": lambda i: touch(*touches[i]),
        "planes": lambda i: touch_with_planes(*touches[i]),
        "batch": lambda i: many(*batches[i]),
    }
    for line in sys.stdin:
        name, case = line.split()
        start = process_time()
        refusing(tasks[name], int(case))
        print(process_time() - start, flush=True)


if __name__ == "__main__":
    main()
