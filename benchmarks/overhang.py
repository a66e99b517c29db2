# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""How much of a patch has nothing below it, as next to edges, holes and corners that no curve crosses.

`python -m benchmarks.overhang ZIP [--touches N]`, from the root of a checkout; ZIP is the built extension.
A machined block and a plate with a hole are touched at random points (seeded, by area) with three planes.
It prints a Markdown table of the shares of the patches' areas that are farther from the mesh than a tenth of
the patch's radius.
"""

import argparse
import math
from pathlib import Path

import numpy as np

from tools import blender

from . import SCANS_FOLDER, machine, table
from .scans import random_places, sampling_planes

EXTENTS = (1.0 / 8.0, 1.0 / 16.0, 0.0)  # Shares of the object's size; 0 is automatic.
NEAR, GRID = 0.1, 400  # A share of the radius, and the number of points of a patch that are compared.
AROUND, HOLE = 96, 0.3  # The number of corners and the radius of the hole in a plate of side 2.


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("zip", type=Path, help="the built extension")
    parser.add_argument("--touches", type=int, default=100, help="of each object and extent (%(default)s)")
    options = parser.parse_args()
    rows = []
    with blender.quiet():
        extension = blender.start(options.zip)
        for name, make in (("machined block", _block), ("plate with a hole", _plate)):
            for share in EXTENTS:
                shares = _shares(extension, make(extension), share, options.touches)
                extent = f"1/{1.0 / share:.0f}" if share else "automatic"
                numbers = [shares.mean(), *np.quantile(shares, [0.5, 0.95]), shares.max()]
                rows.append([f"{name}, {extent}", str(len(shares)), *(f"{100.0 * v:.1f} %" for v in numbers)])
    table(["object, extent of the size", "patches", "nothing below, mean", "median", "95 %", "most"], rows)
    print(f"{options.touches} touches a row; {machine('bpy', 'numpy', 'scipy')}.")


def _shares(extension, obj, share, count):
    """The share of its area that has nothing below it, for each patch, (n,)."""
    import bpy

    modules = extension.tactile_addon.touch
    depsgraph = bpy.context.evaluated_depsgraph_get()
    size = modules.surface.MeshSurface(obj, depsgraph).size
    fit = {"extent": share * size, "step": 0.0, "noise": 0.0, "seed": 0, "method": "bayes", "degree": "auto"}
    found = []
    for _, location in random_places(obj, count):
        try:
            touched = modules.touch_object.touch(obj, depsgraph, location, sampling_planes(extension), **fit)
            found.append(_overhang(touched.result, touched.surface))
        except ValueError:
            continue
    return np.array(found)


def _overhang(r, surface):
    """The share of the patch's area that is farther than NEAR from the mesh."""
    plane, _ = r.domain.grid(GRID)
    height, normals = r.height(*plane.T), r.geometry.normal(*plane.T)
    world = r.frame.to_world(np.column_stack([plane, height])), normals @ r.frame.axes.T
    return np.mean(np.abs(surface.deviations(*world, NEAR * r.radius)) > NEAR * r.radius)


def _block(extension):
    import bpy

    extension.tactile_addon.files.mesh_file.open_file(SCANS_FOLDER / "cad_block.stl")
    return bpy.context.scene.objects[0]


def _plate(extension):
    """A plate of side 2 and height 0.3 with a round hole through its middle."""
    import bpy

    bpy.ops.wm.read_homefile(use_empty=True)
    turns = 2.0 * np.pi * np.arange(AROUND) / AROUND
    ring = np.column_stack([np.cos(turns), np.sin(turns)])
    square = ring / np.abs(ring).max(axis=1, keepdims=True)
    flat = np.vstack([HOLE * ring, square])
    points = np.vstack([np.column_stack([flat, np.full(len(flat), z)]) for z in (0.0, 0.3)])
    a, b, top = np.arange(AROUND), np.roll(np.arange(AROUND), -1), 2 * AROUND
    faces = [
        np.column_stack([top + a, top + AROUND + a, top + AROUND + b, top + b]),
        np.column_stack([b, AROUND + b, AROUND + a, a]),
        np.column_stack([a, top + a, top + b, b]),
        np.column_stack([AROUND + b, top + AROUND + b, top + AROUND + a, AROUND + a]),
    ]
    mesh = bpy.data.meshes.new("Plate")
    mesh.from_pydata(points.tolist(), [], np.vstack(faces).tolist())
    obj = bpy.data.objects.new("Plate", mesh)
    bpy.context.scene.collection.objects.link(obj)
    bpy.context.view_layer.update()
    assert math.isclose(max(obj.dimensions), 2.0, rel_tol=1e-6)
    return obj


if __name__ == "__main__":
    main()
