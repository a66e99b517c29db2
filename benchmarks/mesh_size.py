# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What a larger mesh costs: touches and sections of the whole mesh against the number of faces.

`python -m benchmarks.mesh_size ZIP [--quick]`, from the root of a checkout; ZIP is the built extension.
Prints Markdown tables, times in milliseconds, and draws build/charts/mesh_size.png.

The mesh is the wavy sheet of benchmarks.live, and a touch is three contours of 22 steps and the default fit.
`Blender's ray casts` are the rays of tracking, cast once more without the extension; `ray casts of the
surface` are the same rays by way of the extension. `read mesh` is what each touch does before it tracks, and
`first touch` is a whole touch during which Blender builds its tree of the faces. The peers cut the whole mesh
by three planes through the same point, without a fit; handing the mesh to them has columns of its own.
Without trimesh its columns are left out.
"""

import argparse
import math
import os
import sys
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from statistics import median
from time import perf_counter

import numpy as np
from matplotlib.ticker import NullLocator

from tools import blender

from . import live, machine, plot, table, timed
from .plot import plt

# These are square numbers, because the sheet is square.
FACES = (10_000, 40_000, 160_000, 490_000, 1_000_000, 4_000_000)
QUICK_FACES = (10_000, 160_000, 1_000_000)
LOCATION, EXTENT, STEPS = (0.2, 0.1, 0.05), 0.3, 11  # STEPS counts those of a half curve.
TOUCHES = 51
FIT, TRACKING, CASTS, OURS = "tracking and fit", "tracking", "Blender's ray casts", "ray casts of the surface"
READ, FIRST = "read mesh", "first touch"
BISECT, TO_BMESH = "bmesh.ops.bisect_plane", "to bmesh"
SECTION, SEGMENTS, TO_TRIMESH = "trimesh section", "trimesh mesh_plane", "to trimesh"
LOOKS = {  # Color, mark, style and label of each line.
    FIRST: (plot.BLACK, "v", ":", "first touch, once"),
    BISECT: (plot.VERMILION, "D", "--", BISECT),
    SECTION: (plot.PURPLE, "x", "--", "trimesh: section (x),\nmesh_plane (+)"),
    SEGMENTS: (plot.PURPLE, "+", "--", ""),
    READ: (plot.ORANGE, "P", "-", READ),
    FIT: (plot.BLUE, "o", "-", FIT),
    TRACKING: (plot.SKY, "s", "-", TRACKING),
    CASTS: (plot.GREEN, "^", "-", CASTS),
}
COLUMNS = (FIT, TRACKING, OURS, CASTS, READ, FIRST, TO_BMESH, BISECT, TO_TRIMESH, SECTION, SEGMENTS)
CAPTION = (
    "Solid: what each touch takes, three contours of 22 steps and the default fit, medians of {} azimuths; "
    "the ray casts are a part of tracking, cast once more on their own. Dotted: the first touch of a mesh, "
    "when Blender builds its tree of the faces. Dashed: three sections of the whole mesh through the same "
    "point, without a fit and without handing the mesh over; {}."
)


class Recorder:
    """A surface that keeps the rays that are cast on it."""

    def __init__(self, surface):
        self.surface, self.rays = surface, []

    def ray_cast(self, *ray):
        self.rays.append(ray)
        return self.surface.ray_cast(*ray)


def touch(core, surface, point, normal, azimuth=0.0):
    """Seconds of tracking three contours, and of tracking with the fit."""
    planes = [core.SamplingPlane(azimuth + math.pi * i / 3) for i in range(3)]
    lengths = {"extent": EXTENT, "step": EXTENT / STEPS}
    tracking, contours = timed(core.track, surface, point, normal, planes, **lengths)
    if any(len(contour.points) != 2 * STEPS + 1 for contour in contours):
        raise RuntimeError("a contour of the sheet ended early")
    return tracking, tracking + timed(core.reconstruct, point, contours, outward=normal)[0]


def first_touch(extension, obj, depsgraph):
    """Touches for the first time; returns the surface, the point (3,) and the normal (3,) there."""
    surface = extension.tactile_addon.touch.surface.MeshSurface(obj, depsgraph)
    point, normal, _ = surface.project(LOCATION)
    touch(extension.core, surface, point, normal)
    return surface, point, normal


def recorded(extension, surface, point, normal, azimuth):
    recorder = Recorder(surface)
    touch(extension.core, recorder, point, normal, azimuth)
    return recorder.rays


def touches(extension, obj, depsgraph, surface, point, normal):
    """({stage: median seconds}, the median number of rays); all stages take turns."""
    azimuths = [math.pi / 3 * i / TOUCHES for i in range(TOUCHES)]
    rays = [recorded(extension, surface, point, normal, azimuth) for azimuth in azimuths]
    bare = partial(obj.evaluated_get(depsgraph).ray_cast, depsgraph=depsgraph)
    runs = {name: [] for name in (TRACKING, FIT, OURS, CASTS, READ)}
    for i, azimuth in enumerate(azimuths):
        tracking, both = touch(extension.core, surface, point, normal, azimuth)
        runs[TRACKING].append(tracking)
        runs[FIT].append(both)
        # Rays at other azimuths are cast, because the faces that this touch has met are still in the
        # processor's cache.
        runs[OURS].append(timed(cast_all, surface.ray_cast, rays[i - TOUCHES // 3])[0])
        runs[CASTS].append(timed(cast_bare, bare, rays[i - 2 * TOUCHES // 3])[0])
        if i % 10 == 0:
            runs[READ].append(timed(extension.tactile_addon.touch.surface.MeshSurface, obj, depsgraph)[0])
    return {name: median(values) for name, values in runs.items()}, round(median(map(len, rays)))


def cast_all(cast, rays):
    for ray in rays:
        cast(*ray)


def cast_bare(cast, rays):
    for origin, direction, distance in rays:
        cast(origin, direction, distance=distance)


def bisect(mesh, planes):
    """{stage: seconds} to make a bmesh of the whole mesh, and to cut it by all planes."""
    import bmesh

    whole = bmesh.new()
    making, _ = timed(whole.from_mesh, mesh)
    start = perf_counter()
    for point, normal in planes:
        geometry = whole.verts[:] + whole.edges[:] + whole.faces[:]
        bmesh.ops.bisect_plane(whole, geom=geometry, dist=1e-7, plane_co=point, plane_no=normal)
    cutting = perf_counter() - start
    whole.free()
    return {TO_BMESH: making, BISECT: cutting}


def section(mesh, planes):
    """{stage: seconds} to make a Trimesh of the whole mesh, and for curves or bare segments in all planes."""
    from trimesh.intersections import mesh_plane

    making, whole = timed(triangles, mesh)
    curves = sum(timed(whole.section, normal, point)[0] for point, normal in planes)
    segments = sum(timed(mesh_plane, whole, normal, point)[0] for point, normal in planes)
    return {TO_TRIMESH: making, SECTION: curves, SEGMENTS: segments}


def triangles(mesh):
    import trimesh

    co = np.empty((len(mesh.vertices), 3), dtype=np.float32)
    mesh.attributes["position"].data.foreach_get("vector", co.ravel())
    corners = np.empty((len(mesh.loop_triangles), 3), dtype=np.int32)
    mesh.loop_triangles.foreach_get("vertices", corners.ravel())
    return trimesh.Trimesh(co, corners, process=False)


PEERS = (bisect, section) if find_spec("trimesh") else (bisect,)


def measure(bpy, extension, faces):
    """{stage: median seconds} on a sheet of about that many faces, with the numbers of "faces" and "rays"."""
    obj = live.sheet(bpy, faces)
    depsgraph = bpy.context.evaluated_depsgraph_get()
    first, (surface, point, normal) = timed(first_touch, extension, obj, depsgraph)
    stages, rays = touches(extension, obj, depsgraph, surface, point, normal)
    planes = [(point, extension.core.SamplingPlane(math.pi * i / 3).axes(normal)[:, 2]) for i in range(3)]
    for peer in PEERS:
        runs = [peer(obj.data, planes) for _ in range(max(1, min(5, 2_000_000 // faces)))]
        stages |= {name: median(run[name] for run in runs) for name in runs[0]}
    return stages | {FIRST: first, "faces": len(obj.data.polygons), "rays": rays}


def print_table(rows):
    columns = [name for name in COLUMNS if name in rows[0]]
    print("Times are in milliseconds.\n")
    cells = [
        [f"{row['faces']}", f"{row['rays']}", *(f"{1e3 * row[name]:.2f}" for name in columns)] for row in rows
    ]
    table(["faces", "rays", *columns], cells, left=0)
    (row,) = (row for row in rows if row["faces"] == 1_000_000)
    cast = row[CASTS]
    table(
        ["three contours of 22 steps on a mesh of 1M faces", "total, ms", "in Blender's ray casts", "share"],
        [
            [n, f"{1e3 * row[n]:.2f}", f"{1e3 * cast:.2f}", f"{100 * cast / row[n]:.0f} %"]
            for n in (FIT, TRACKING)
        ],
    )


def draw(rows):
    figure, axes = plt.subplots(figsize=(8.2, 4.8), layout="constrained")
    faces = [row["faces"] for row in rows]
    for name, (color, mark, style, label) in LOOKS.items():
        if name in rows[0]:
            times = [1e3 * row[name] for row in rows]
            axes.plot(faces, times, style, color=color, marker=mark, markersize=5)
            axes.text(1.12 * faces[-1], times[-1], label, color=color, va="center", fontsize=8)
    axes.set(xscale="log", yscale="log", xlabel="faces of the mesh", ylabel="time, ms")
    axes.set_xlim(0.85 * faces[0], faces[-1] * (faces[-1] / faces[0]) ** 0.3)
    axes.set_xticks(faces, [f"{n // 1_000_000}M" if n >= 1_000_000 else f"{n // 1000}k" for n in faces])
    axes.xaxis.set_minor_locator(NullLocator())
    axes.yaxis.set_major_formatter("{x:g}")
    axes.set_title("Three section curves through a point: tracked, and by cutting the whole mesh")
    return figure


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("zip", type=Path, metavar="ZIP")
    parser.add_argument("--quick", action="store_true", help="up to a million faces")
    options = parser.parse_args()
    with blender.quiet():
        extension = blender.start(options.zip)
        import bpy

        measure(bpy, extension, 1000)  # This imports everything.
        rows = [measure(bpy, extension, faces) for faces in (QUICK_FACES if options.quick else FACES)]
    if section not in PEERS:
        print("trimesh is not installed, so it is left out.\n")
    print_table(rows)
    header = ["faces", "rays", *(f"{name}, ms" for name in COLUMNS if name in rows[0])]
    cells = [
        [row["faces"], row["rays"], *(f"{1e3 * row[name]:.4g}" for name in COLUMNS if name in row)]
        for row in rows
    ]
    plot.save(draw(rows), "mesh_size", CAPTION.format(TOUCHES, machine("bpy")), header, cells)
    sys.stdout.flush()
    os._exit(0)  # Blender as a module may hang at exit.


if __name__ == "__main__":
    main()
