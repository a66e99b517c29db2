# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""How far curvatures are off where few facets of a mesh were felt.

`python -m benchmarks.facets ZIP`, from the root of a checkout; ZIP is the built extension. It touches balls
a torus, a cylinder and a cone of Blender's Add menu, which are known exactly, at random points with an
automatic extent. The Markdown table has the median error of a principal curvature, as a share of the larger
one, by the number of facets of different directions that the contacts lie on: where the verdict is about the
shape, and where it is about the facets.
"""

import argparse
import math
from collections import defaultdict
from pathlib import Path
from statistics import median

import numpy as np

from tools import blender

from . import machine, table

POINTS = 60
TOP = 0.9999  # The lids of cylinders and cones, which are flat, are beyond this height; they are left out.
BINS = (1, 2, 4, 6, 8, 10, 12, 16, 24, 40, math.inf)  # Each goes up to the next.


def shapes(bpy):
    """(adds the shape, the principal curvatures at a point of it)."""
    ball = (-1.0, -1.0)
    for segments, rings in ((16, 8), (32, 16), (64, 32), (16, 64)):
        yield (
            lambda s=segments, r=rings: bpy.ops.mesh.primitive_uv_sphere_add(segments=s, ring_count=r),
            lambda _: ball,
        )
    for level in (2, 3, 4):
        yield lambda n=level: bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=n), lambda _: ball
    for major, minor in ((48, 12), (96, 24), (192, 48), (16, 48)):
        yield (
            lambda a=major, b=minor: bpy.ops.mesh.primitive_torus_add(major_segments=a, minor_segments=b),
            lambda p: sorted((-4.0, -4.0 * (1.0 - 1.0 / math.hypot(p[0], p[1])))),
        )
    for count in (16, 32, 64):
        yield (
            lambda n=count: bpy.ops.mesh.primitive_cylinder_add(vertices=n),
            lambda p: (-1.0 if abs(p[2]) < TOP else 0.0, 0.0),
        )
        yield (
            lambda n=count: bpy.ops.mesh.primitive_cone_add(vertices=n),
            lambda p: (-2.0 / math.sqrt(5.0) / math.hypot(p[0], p[1]) if p[2] > -TOP else 0.0, 0.0),
        )


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
    extension = blender.start(parser.parse_args().zip)
    import bpy

    touch, core = extension.tactile_addon.touch.touch_object.touch, extension.core
    fit = {"method": "bayes", "degree": "auto", "weight": None, "solver": "fast"}
    planes = [core.SamplingPlane(math.radians(azimuth)) for azimuth in (0, 60, 120)]
    errors = defaultdict(lambda: ([], []))
    for add, exact in shapes(bpy):
        bpy.ops.wm.read_homefile(use_empty=True)
        add()
        obj, rng = bpy.context.object, np.random.default_rng(0)
        depsgraph, faces = bpy.context.evaluated_depsgraph_get(), obj.data.polygons
        areas = np.array([face.area for face in faces])
        for number in rng.choice(len(faces), POINTS, p=areas / areas.sum()):
            corners = [np.array(obj.data.vertices[i].co) for i in faces[int(number)].vertices]
            place = rng.dirichlet(np.ones(len(corners))) @ corners
            try:
                found = touch(obj, depsgraph, place, planes, extent=0.0, step=0.0, noise=0.0, seed=0, **fit)
            except ValueError:
                continue
            k, (patch, count) = exact(place), (found.result.patch, felt(found))
            if not any(k):
                continue
            off = max(abs(patch.k1 - k[0]), abs(patch.k2 - k[1])) / max(abs(k[0]), abs(k[1]))
            few = found.report["few_facets"]
            errors[max(least for least in BINS if least <= count)][few].append(off)
    rows = [
        [
            f"{least} to {BINS[BINS.index(least) + 1] - 1}",
            *(cell for of in both for cell in (str(len(of)), f"{median(of):.2f}" if of else "")),
        ]
        for least, both in sorted(errors.items())
    ]
    table(["facets felt", "shape", "error", "facets", "error"], rows)
    print(f"Seed 0; {machine('bpy')}.")


if __name__ == "__main__":
    main()
