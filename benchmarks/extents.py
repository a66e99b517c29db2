# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""How far a patch with an automatic extent reaches, compared with fixed extents.

`python -m benchmarks.extents ZIP [--touches N | --pictures]`, from the root of a checkout; ZIP is the built
extension. With --pictures it draws build/paper/extent.jpg instead.

Scans, some of them ribbed or sharp-edged, and a ball are touched without noise at random points (seeded, by
area). The touch chooses its extent, or a fixed one is given; it always chooses its step. The Markdown table
has medians over the patches without a warning: the radius, the area, and the mean distance of patch and mesh
along the normal over the domain; `all areas` is the sum of the areas. `contradicted` patches have no doubt of
their own, but carry a warning because the mesh is off them by more than twice their deviation, or because
the curvature is that of facets. `silent` patches have no warning and are off by more than five times it.
"""

import argparse
import sys
from itertools import islice
from pathlib import Path
from statistics import median

import numpy as np

from tools import blender, demo

from . import SCANS_FOLDER, machine, table
from .paper_pictures import Stage, sheet
from .refusals import SILENT
from .scans import random_places, sampling_planes

NECK = 0.19  # The bottle's shoulder, neck and cap are above this height.
SCANS = {  # The file, and the least height of a point that is touched.
    "shell": ("shell_gastropod.stl", None),
    "bottle neck": ("bottle_bleach.ply", NECK),
    "CAD block": ("cad_block.stl", None),
    "lemon": ("lemon.ply", None),
    "pear": ("pear.ply", None),
    "ball": (None, None),
}
# The file, a point between ribs, between pockets or on a smooth side, and the share of the size in view.
PICTURES = {
    "shell": ("shell_gastropod.stl", (-14.46461, -7.82709, 23.23658), 0.5),
    "CAD block": ("cad_block.stl", (-0.45, 0.3, 1.375), 0.7),
    "lemon": ("lemon.ply", (-0.03383, 0.02996, 0.03865), 1.0),
}
# Shares of the object's size; with 0 the touch chooses.
EXTENTS = {"auto": 0.0, "1/16": 1.0 / 16.0, "1/8": 1.0 / 8.0, "1/4": 1.0 / 4.0}


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("zip", type=Path, help="the built extension")
    parser.add_argument("--touches", type=int, default=100, help="of each object and extent (%(default)s)")
    parser.add_argument("--pictures", action="store_true", help="draw three patches instead")
    options = parser.parse_args()
    for path in (options.zip, *(SCANS_FOLDER / file for file, _ in SCANS.values() if file)):
        if not path.is_file():
            sys.exit(f"extents: there is no file {path}")
    with blender.quiet():
        extension = blender.start(options.zip)
        if options.pictures:
            return _draw(extension)
        rows = [row for name in SCANS for row in _rows(extension, name, options.touches)]
    head = "object, extent|patches|refused|sure|contradicted|silent|radius|area|all areas|off|off / std|ms"
    table(head.split("|"), rows)
    print(
        f"{options.touches} touches a row. Radius and `off` are in thousandths of the object's size, areas "
        f"in thousandths of its square; {machine('bpy', 'numpy', 'scipy')}."
    )


def _rows(extension, name, count):
    """A row of the table for each extent."""
    import bpy

    file, least = SCANS[name]
    if file:
        extension.tactile_addon.files.mesh_file.open_file(SCANS_FOLDER / file)
    else:
        bpy.ops.wm.read_homefile(use_empty=True)
        bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=6)
    obj, depsgraph = bpy.context.scene.objects[0], bpy.context.evaluated_depsgraph_get()
    size = extension.tactile_addon.touch.surface.MeshSurface(obj, depsgraph).size
    places = (place for _, place in random_places(obj, 10 * count) if least is None or place.z > least)
    places = list(islice(places, count))
    for title, share in EXTENTS.items():
        found = [_touched(extension, obj, depsgraph, place, share * size) for place in places]
        yield [f"{name}, {title}", *_cells([each for each in found if each], size, count)]


def _touched(extension, obj, depsgraph, place, extent):
    """(report of a touch, mean distance of patch and mesh or None), or None where there is no patch."""
    add_on, fit = extension.tactile_addon, {"seed": 0, "method": "bayes", "degree": "auto"}
    try:
        touched = add_on.touch.touch_object.touch(
            obj, depsgraph, place, sampling_planes(extension), extent=extent, step=0.0, noise=0.0, **fit
        )
    except ValueError:
        return None
    touched = add_on.touch.touch_object.completed(touched)
    off = extension.core.mesh_error(touched.result, touched.surface).height
    return touched.report | {"fit": touched.result.status}, off


def _cells(found, size, count):
    sure = [(report, off) for report, off in found if report["status"] == "ok"]
    contradicted = sum(r["fit"] == "ok" != r["status"] for r, _ in found)
    met = [(off, off / report["height_std"]) for report, off in sure if off is not None]
    numbers = len(found), count - len(found), len(sure), contradicted, sum(ratio > SILENT for _, ratio in met)
    areas = [1e3 * report["area"] / size**2 for report, _ in sure]
    return [
        *(f"{number}" for number in numbers),
        _median([1e3 * report["radius"] / size for report, _ in sure]),
        _median(areas),
        f"{sum(areas):.0f}",
        _median([1e3 * off / size for off, _ in met]),
        _median([ratio for _, ratio in met]),
        f"{1e3 * median(report['seconds']['touch'] for report, _ in found):.1f}",
    ]


def _draw(extension):
    """Draws a sheet of patches on their objects."""
    import bpy
    from mathutils import Vector

    for name, (file, place, share) in PICTURES.items():
        extension.tactile_addon.files.mesh_file.open_file(SCANS_FOLDER / file)
        (obj,) = bpy.context.scene.objects
        bpy.ops.tactile.reconstruct(target=obj.name, location=place)
        patch = bpy.context.view_layer.objects.active
        normal = patch.matrix_world.col[2].xyz.normalized()
        up = Vector((0, 0, 1)) if abs(normal.z) < 0.8 else Vector((0, 1, 0))
        view = (normal + 0.35 * up + 0.3 * up.cross(normal)).normalized()
        width = share * max(obj.dimensions)
        demo.look(bpy.context.scene, obj)
        stage = Stage(extension, bpy.context.scene)
        contours, ink = extension.reconstruction_of(patch).contours, stage.ink("brown")
        # The curves come nearer to the camera, so that the patch does not hide them.
        ahead = 0.05 * width * np.array(view)
        lines = [stage.line(curve.points + ahead, 0.004 * width, ink) for curve in contours]
        stage.photograph(name, patch.location, view, up, width, [patch, *lines])
    sheet("extent", [list(PICTURES)], list(PICTURES), [""], "")


def _median(values):
    return f"{round(median(values), 3):.3g}" if values else ""


if __name__ == "__main__":
    main()
