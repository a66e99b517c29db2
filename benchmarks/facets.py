# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""How far curvatures are off where few facets of a mesh were felt, and how often verdicts on them are wrong.

`python -m benchmarks.facets ZIP`, from the root of a checkout; ZIP is the built extension.
It touches meshes at random points (seeded, by area). The error is that of a principal curvature, as a share
of the larger one.
The curvatures of balls, tori, cylinders and cones of Blender's Add menu are known exactly, and those of balls
that are scaled along their axis. Suzanne with one to three levels of subdivision is compared with five
levels. These are touched with an automatic extent. Scans are touched with a 32nd of their size, and compared
with patches three times as long; without the folder of scans their rows are left out.

The first Markdown table has the median error of the shapes of the Add menu, by the number of facets of
different directions that the contacts lie on: where the verdict is about the shape, and where it is about the
facets. The second counts, for all objects, patches that are good and those that are about the facets. Of the
good ones it counts those that are off by over 1/4, and those of these that are beyond two stated deviations:
they are wrong. So are those about the facets with an error below .15.
"""

import argparse
import math
from collections import defaultdict
from itertools import pairwise
from pathlib import Path
from statistics import median

import numpy as np

from tests.surfaces import ellipsoid
from tools import blender

from . import SCANS_FOLDER, machine, table
from .scans import sampling_planes

POINTS = 60
TOP = 0.9999  # The lids of cylinders and cones, which are flat, are beyond this height; they are left out.
BINS = (1, 2, 4, 6, 8, 10, 12, 16, 24, 40, math.inf)  # Each goes up to the next.
WRONG, RIGHT = 0.25, 0.15  # Good patches with larger errors may be wrong, those of facets with smaller ones.
WITHIN = 2.0  # Deviations within which a curvature is right.
FINEST, AGREE = 5, 0.15  # Suzanne's curvatures are those of these levels where two extents agree to this.
SCANS = {
    "pear": "pear.ply",
    "lemon": "lemon.ply",
    "Eros": "asteroid_eros.ply",
    "femur": "bone_femur_proximal.stl",
}
EXTENT, LONGER = 1.0 / 32.0, 3.0  # Of scans, in sizes, and of the patches with which they are compared.


def shapes(add):
    """(kind, adds the shape, the principal curvatures at a point of it), with bpy.ops.mesh as `add`."""
    ball = (-1.0, -1.0)
    for segments, rings in ((16, 8), (32, 16), (64, 32), (16, 64)):
        yield (
            "balls",
            lambda s=segments, r=rings: add.primitive_uv_sphere_add(segments=s, ring_count=r),
            lambda _: ball,
        )
    for level in (2, 3, 4):
        yield "balls", lambda n=level: add.primitive_ico_sphere_add(subdivisions=n), lambda _: ball
    for major, minor in ((48, 12), (96, 24), (192, 48), (16, 48)):
        yield (
            "tori",
            lambda a=major, b=minor: add.primitive_torus_add(major_segments=a, minor_segments=b),
            lambda p: (-4.0, -4.0 * (1.0 - 1.0 / math.hypot(p[0], p[1]))),
        )
    for count in (16, 32, 64):
        yield (
            "cylinders",
            lambda n=count: add.primitive_cylinder_add(vertices=n),
            lambda p: (-1.0 if abs(p[2]) < TOP else 0.0, 0.0),
        )
        yield (
            "cones",
            lambda n=count: add.primitive_cone_add(vertices=n),
            lambda p: (-2.0 / math.sqrt(5.0) / math.hypot(p[0], p[1]) if p[2] > -TOP else 0.0, 0.0),
        )


def scaled_balls(bpy):
    """(kind, adds the shape, the principal curvatures at a point of it) for balls scaled along their axis."""

    def add(segments, height):
        bpy.ops.mesh.primitive_uv_sphere_add(segments=segments, ring_count=segments // 2)
        bpy.context.object.scale.z = height
        bpy.ops.object.transform_apply(scale=True)

    def exact(p, height):
        """The principal curvatures below or above a point of a facet."""
        ball = ellipsoid(1.0, 1.0, height, v=math.atan2(p[2] / height, math.hypot(p[0], p[1])))
        return ball.k1, ball.k2

    for segments in (32, 64):
        for height in (0.15, 0.3, 0.5, 2.0):
            yield (
                "balls, scaled",
                lambda s=segments, h=height: add(s, h),
                lambda p, h=height: exact(p, h),
            )


def suzanne(bpy, levels):
    bpy.ops.mesh.primitive_monkey_add()
    bpy.context.object.modifiers.new("Subdivision", "SUBSURF").levels = levels
    return bpy.context.object


def objects(bpy, add_on, touch):
    """(name, object, extent, a function of a place and a touch there) of all objects.

    The function has the principal curvatures of the shape, or None where these are not known.
    """
    for name, add, exact in (*shapes(bpy.ops.mesh), *scaled_balls(bpy)):
        bpy.ops.wm.read_homefile(use_empty=True)
        add()
        yield name, bpy.context.object, 0.0, lambda place, _, exact=exact: exact(place)
    for levels in (1, 2, 3):
        bpy.ops.wm.read_homefile(use_empty=True)
        fine, obj = suzanne(bpy, FINEST), suzanne(bpy, levels)

        def agreed(place, found, fine=fine):
            whole, half = (touch(fine, place, share * found.result.radius) for share in (1.0, 0.5))
            if whole and half and off_by(whole, curvatures(half)) < AGREE:
                return curvatures(half)

        yield f"Suzanne, levels {levels}", obj, 0.0, agreed
    for name, file in SCANS.items() if SCANS_FOLDER.is_dir() else ():
        add_on.files.mesh_file.open_file(SCANS_FOLDER / file)
        obj = bpy.context.scene.objects[0]
        extent = EXTENT * max(obj.dimensions)

        def of_longer(place, _, obj=obj, extent=extent):
            longer = touch(obj, place, LONGER * extent)
            return longer and curvatures(longer)

        yield name, obj, extent, of_longer


def places(obj, depsgraph):
    """Random places in the world on the faces of an object as Blender evaluates it."""
    mesh, rng = obj.evaluated_get(depsgraph).data, np.random.default_rng(0)
    areas = np.array([face.area for face in mesh.polygons])
    for number in rng.choice(len(areas), POINTS, p=areas / areas.sum()):
        corners = [
            np.array(obj.matrix_world @ mesh.vertices[i].co) for i in mesh.polygons[int(number)].vertices
        ]
        yield rng.dirichlet(np.ones(len(corners))) @ corners


def curvatures(found):
    return found.result.k1, found.result.k2


def off_by(found, true):
    """The larger error of the principal curvatures of a touch, as a share of the larger one."""
    true = np.sort(true)
    return float(np.abs(np.sort(curvatures(found)) - true).max() / np.abs(true).max())


def verdict(touched):
    codes = [doubt["code"] for doubt in touched.report["doubts"]]
    return codes[0] if "facets" in codes[:1] else touched.report["status"]


def deviation(r):
    """The larger deviation of the principal curvatures."""
    return max(r.k1_std, r.k2_std)


def felt(touched):
    """The number of facets of different directions that contacts lie on."""
    surface, normals = touched.surface, []
    for point in np.vstack([contour.points for contour in touched.result.contours]):
        corners = surface.corners_of(surface.face_near(point))
        normal = np.cross(corners[1] - corners[0], corners[2] - corners[0])
        normal /= np.linalg.norm(normal)
        if all(normal @ other < math.cos(math.radians(1.0)) for other in normals):
            normals.append(normal)
    return len(normals)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("zip", type=Path, metavar="ZIP")
    arguments = parser.parse_args()
    with blender.quiet():
        extension = blender.start(arguments.zip)
    import bpy

    planes, add_on = sampling_planes(extension), extension.tactile_addon
    fit = {"seed": 0, "method": "bayes", "degree": "auto", "weight": None, "solver": "fast"}

    def touch(obj, place, extent):
        lengths = {"extent": extent, "step": 0.0, "noise": 0.0}
        depsgraph = bpy.context.evaluated_depsgraph_get()
        try:
            return add_on.touch.touch_object.touch(obj, depsgraph, place, planes, **lengths, **fit)
        except ValueError:
            return None

    errors = defaultdict(list)  # By object: (facets felt, verdict, error, whether it is wrong) of each patch.
    with blender.quiet():
        for name, obj, extent, true_curvatures in objects(bpy, add_on, touch):
            for place in places(obj, bpy.context.evaluated_depsgraph_get()):
                found = touch(obj, place, extent)
                true = found and true_curvatures(place, found)
                if true and any(true):
                    error = off_by(found, true)
                    is_wrong = error > WRONG and error * np.abs(true).max() > WITHIN * deviation(found.result)
                    errors[name].append((felt(found), verdict(found), error, is_wrong))
    print_tables(errors)
    print(f"Seed 0; {machine('bpy')}.")


def print_tables(errors):
    every = [each for kind in ("balls", "tori", "cylinders", "cones") for each in errors[kind]]
    rows = []
    for least, end in pairwise(BINS):
        here = [each for each in every if least <= each[0] < end]
        shape, facets = ([row[2] for row in here if (row[1] == "facets") is of] for of in (False, True))
        cells = (cell for of in (shape, facets) for cell in (str(len(of)), f"{median(of):.2f}" if of else ""))
        rows.append([f"{least} to {end - 1}", *cells])
    table(["facets felt", "shape", "error", "facets", "error"], rows)
    rows = []
    for name, found in errors.items():
        good, facets = ([off for _, what, off, _ in found if what == of] for of in ("ok", "facets"))
        off = sum(error > WRONG for error in good)
        wrong = sum(bad and what == "ok" for _, what, _, bad in found), sum(error < RIGHT for error in facets)
        counts = len(found), len(good), off, wrong[0], len(facets), wrong[1]
        rows.append([name, *map(str, counts), *(f"{median(of):.2f}" if of else "" for of in (good, facets))])
    head = ["object", "patches", "good", "off by 1/4", "wrong", "facets", "wrong"]
    table([*head, "error if good", "error if facets"], rows)


if __name__ == "__main__":
    main()
