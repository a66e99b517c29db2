# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A small data set of touches, made by two workers in a minute: `python -m tools.dataset`.

It touches the scans in the folder that TACTILE_SCANS names, or Suzanne and simple shapes without these. Then
it tabulates what was found, and draws the contacts, colored by how far the patches are off the mesh.
"""

import argparse
import os
import shutil
import subprocess
import sys
from pathlib import Path

import matplotlib
import numpy as np
import pyarrow.parquet as pq
from matplotlib.colors import LogNorm

matplotlib.use("Agg")
from matplotlib import pyplot

ROOT = Path(__file__).resolve().parents[1]
SCANS = Path(os.environ.get("TACTILE_SCANS", ROOT.parent / "shared" / "data" / "meshes"))
BUILD = ROOT / "build"
WORDS = ("--touches", "200", "--block", "100", "--noise", "0.05%", "--workers", "2")
TICKS = (0.1, 0.3, 1.0, 3.0, 10.0)  # In ‰ of an object's size.


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--objects", type=Path, help="a folder of .ply, .stl, .obj and .blend files")
    parser.add_argument("--output", type=Path, default=BUILD / "dataset", help="folder to make (%(default)s)")
    options = parser.parse_args()
    objects = options.objects or (SCANS if SCANS.is_dir() else shapes(BUILD / "shapes"))
    shutil.rmtree(options.output, ignore_errors=True)
    words = ("touch", str(objects), *WORDS, "--output", str(options.output))
    code = subprocess.run([sys.executable, "-m", "cluster", *words], cwd=ROOT).returncode
    if code not in (0, 3):  # The code is 3 if some objects could not be touched.
        sys.exit(code)
    stored = pq.read_table(options.output / "objects.parquet").to_pylist()
    columns = ["hash", "mesh_error", "radius", "contacts", "normals"]
    touches = pq.read_table(options.output / "touches", columns=columns)
    found = [(each, of_object(touches, each)) for each in stored if each["ok"] + each["in_doubt"]]
    print_table(found)
    picture = options.output.with_suffix(".png")
    draw(found, picture)
    print(f"Picture: {picture}")


def shapes(folder):
    """Writes Suzanne and some primitives to `folder` as .ply; returns it."""
    import bpy

    folder.mkdir(parents=True, exist_ok=True)
    add = bpy.ops.mesh
    makers = {
        "suzanne": lambda: add.primitive_monkey_add(),
        "ball": lambda: add.primitive_uv_sphere_add(segments=64, ring_count=32),
        "torus": lambda: add.primitive_torus_add(major_segments=96, minor_segments=48),
        "cone": lambda: add.primitive_cone_add(vertices=64),
        "cube": lambda: add.primitive_cube_add(),
    }
    for name, make in makers.items():
        bpy.ops.wm.read_homefile(use_empty=True)
        make()
        if name in ("suzanne", "cube"):
            bpy.context.object.modifiers.new("Subdivision", "SUBSURF").levels = 3
        bpy.ops.wm.ply_export(filepath=str(folder / f"{name}.ply"))
    return folder


def of_object(touches, facts):
    """The patches of an object: errors and radii in shares of its size, contacts and normals of each."""
    rows = [
        row for row in touches.to_pylist() if row["hash"] == facts["hash"] and row["mesh_error"] is not None
    ]
    return {
        "errors": np.array([row["mesh_error"] for row in rows]) / facts["size"],
        "radii": np.array([row["radius"] for row in rows]) / facts["size"],
        "contacts": [np.reshape(row["contacts"], (-1, 3)) for row in rows],
        "normals": [np.reshape(row["normals"], (-1, 3)) for row in rows],
    }


def print_table(found):
    """Prints a row for each object."""
    head = f"{'':24}{'ok':>6}{'doubt':>7}{'refused':>9}{'error':>7}"
    print(f"\n{head}{'radius, %':>11}{'off, ‰':>15}{'ms':>6}")
    for facts, patches in found:
        counts = f"{facts['ok']:6}{facts['in_doubt']:7}{facts['refused']:9}{facts['error']:7}"
        radius, off = 100.0 * np.median(patches["radii"]), 1e3 * np.median(patches["errors"])
        each = 1e3 * facts["seconds"] / facts["touches"]
        print(f"{facts['object'][:23]:24}{counts}{radius:11.1f}{off:15.2f}{each:6.1f}")
    print("Radius and off: medians over patches, as shares of the size; ms: processor time of a touch.\n")


def draw(found, path):
    """Draws the contacts of each object that face the viewer, colored by the error of their patch."""
    across = min(len(found), 3)
    down = -(-len(found) // across)
    figure, axes = pyplot.subplots(
        down, across, figsize=(4.0 * across + 1.0, 3.6 * down), squeeze=False, layout="constrained"
    )
    for place in axes.flat[len(found) :]:
        place.set_axis_off()
    for place, (facts, patches) in zip(axes.flat, found, strict=False):
        points, normals = np.vstack(patches["contacts"]), np.vstack(patches["normals"])
        errors = np.repeat(1e3 * patches["errors"], [len(contacts) for contacts in patches["contacts"]])
        *plane, depth = np.argsort(np.ptp(points, axis=0))[::-1]
        near = normals[:, depth] > 0.0
        order = np.argsort(points[near, depth])
        x, y = points[near][order][:, plane].T
        shown = place.scatter(
            x, y, s=2.0, c=errors[near][order], cmap="viridis", norm=LogNorm(TICKS[0], TICKS[-1])
        )
        place.set_title(f"{facts['object']}, {len(patches['errors'])} patches", fontsize=10)
        place.set_aspect("equal")
        place.set_axis_off()
    bar = figure.colorbar(shown, ax=axes, shrink=0.6, ticks=TICKS, format="%g")
    bar.minorticks_off()
    bar.set_label("patch off the mesh, ‰ of the object's size")
    figure.savefig(path, dpi=110)


if __name__ == "__main__":
    main()
