# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""How often verdicts on touches of meshes of few facets are wrong.

`python -m benchmarks.facets ZIP [--models FOLDER]`, from the root of a checkout; ZIP is the built extension.
It touches meshes at random points (seeded, by area). The error is that of a principal curvature, as a share
of the larger one.
The curvatures of balls, tori, cylinders and cones of Blender's Add menu are known exactly, and those of balls
that are scaled along their axis. Suzanne with one to three levels of subdivision is compared with five
levels. All are touched with an automatic extent.

A Markdown table counts, for all objects, patches that are good and those that are about the facets. Of the
good ones it counts those that are off by over 1/4, and those of these that are beyond two stated deviations:
they are wrong. So are those about the facets with an error below .15.

With --models it touches the .obj files of a folder, as those of github:alecjacobson/common-3d-test-models, at
twelve points each, and counts those that are sure. They are compared with their mesh under a Subdivision
modifier, where patches of the same radius and of half of it agree. Those of 10,000 faces or more are also
decimated (Decimate modifier, Collapse), and compared with the polynomials of benchmarks.curvatures that fit
their own mesh there, the nearer one, so nearly all places count.
One is off by 1/4 if it is by more than .1 / L as well, and wrong if also by more than two stated deviations.
A doubt about facets is needed if it is off by more than .1 / L and two deviations that the contacts have.
"""

import math
from collections import defaultdict
from functools import partial
from pathlib import Path
from statistics import median

import numpy as np

from tests.surfaces import ellipsoid
from tools import blender

from . import machine, parser_of, table
from .curvatures import TRUTHS, true_curvatures
from .paper import AZIMUTHS
from .whole import Rays

POINTS = 60
TOP = 0.9999  # The lids of cylinders and cones, which are flat, are beyond this height; they are left out.
WRONG, RIGHT = 0.25, 0.15  # Good patches with larger errors may be wrong, those of facets with smaller ones.
WITHIN, KNOWN = 2.0, 0.1  # Deviations, and a share of 1 / L, within which a curvature is right.
OF_MODELS, SEED, MOST_FACES = 12, 7, 600_000  # Points of a model, and faces of it when it is subdivided.
DENSE, SHARES = 10_000, (4, 16, 64)  # Models of this many faces are decimated to these parts of them.
FINEST, AGREE = 5, 0.15  # Suzanne's curvatures are those of these levels where two extents agree to this.


def shapes(add):
    """(kind, adds the shape, the principal curvatures at a point of it), with bpy.ops.mesh as `add`."""

    def on_ball(p):
        return -1.0, -1.0

    def on_torus(p):
        return -4.0, -4.0 * (1.0 - 1.0 / math.hypot(p[0], p[1]))

    def on_cylinder(p):
        return -1.0 if abs(p[2]) < TOP else 0.0, 0.0

    def on_cone(p):
        return -2.0 / math.sqrt(5.0) / math.hypot(p[0], p[1]) if p[2] > -TOP else 0.0, 0.0

    for segments, rings in ((16, 8), (32, 16), (64, 32), (16, 64)):
        yield "balls", partial(add.primitive_uv_sphere_add, segments=segments, ring_count=rings), on_ball
    for level in (2, 3, 4):
        yield "balls", partial(add.primitive_ico_sphere_add, subdivisions=level), on_ball
    for major, minor in ((48, 12), (96, 24), (192, 48), (16, 48)):
        yield "tori", partial(add.primitive_torus_add, major_segments=major, minor_segments=minor), on_torus
    for count in (16, 32, 64):
        yield "cylinders", partial(add.primitive_cylinder_add, vertices=count), on_cylinder
        yield "cones", partial(add.primitive_cone_add, vertices=count), on_cone


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
            yield "balls, scaled", partial(add, segments, height), partial(exact, height=height)


def suzanne(bpy, levels):
    bpy.ops.mesh.primitive_monkey_add()
    bpy.context.object.modifiers.new("Subdivision", "SUBSURF").levels = levels
    return bpy.context.object


def objects(bpy, touch):
    """(name, object, a function of a place and a touch there) of all objects.

    The function has the principal curvatures of the shape, or None where these are not known.
    """
    for name, add, exact in (*shapes(bpy.ops.mesh), *scaled_balls(bpy)):
        bpy.ops.wm.read_homefile(use_empty=True)
        add()
        yield name, bpy.context.object, lambda place, _, exact=exact: exact(place)
    for levels in (1, 2, 3):
        bpy.ops.wm.read_homefile(use_empty=True)
        fine, obj = suzanne(bpy, FINEST), suzanne(bpy, levels)

        def agreed(place, found, fine=fine):
            whole, half = (touch(fine, place, share * found.result.radius) for share in (1.0, 0.5))
            if whole and half and off_by(whole, curvatures(half)) < AGREE:
                return curvatures(half)

        yield f"Suzanne, levels {levels}", obj, agreed


def places(obj, depsgraph, count=POINTS, seed=0):
    """Random places in the world on the faces of an object as Blender evaluates it.

    The faces and their corners are sorted, because Blender adds some shapes in an order that varies.
    """
    from mathutils import Vector

    mesh, rng = obj.evaluated_get(depsgraph).data, np.random.default_rng(seed)
    faces = sorted(
        (sorted(tuple(mesh.vertices[i].co) for i in face.vertices), face.area) for face in mesh.polygons
    )
    areas = np.array([area for _, area in faces])
    for number in rng.choice(len(areas), count, p=areas / areas.sum()):
        corners = np.array([obj.matrix_world @ Vector(corner) for corner in faces[number][0]])
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


def main():
    parser = parser_of(__doc__, takes_zip=True)
    parser.add_argument("--models", type=Path, metavar="FOLDER")
    arguments = parser.parse_args()
    extension = blender.start(arguments.zip)
    import bpy

    planes = [extension.core.SamplingPlane(math.radians(azimuth)) for azimuth in AZIMUTHS]
    add_on = extension.tactile_addon
    fit = {"seed": 0, "method": "bayes", "degree": "auto", "weight": None, "solver": "fast"}

    def touch(obj, place, extent=0.0):
        lengths = {"extent": extent, "step": 0.0, "noise": 0.0}
        depsgraph = bpy.context.evaluated_depsgraph_get()
        try:
            return add_on.touch.touch_object.touch(obj, depsgraph, place, planes, **lengths, **fit)
        except ValueError:
            return None

    if arguments.models:
        paths = sorted(arguments.models.glob("*.obj"))
        print_models(bpy, paths, touch)
        print_decimated(bpy, paths, touch)
        print(f"Seed {SEED}; {machine('bpy')}.")
        return
    errors = defaultdict(list)  # By object: (verdict, error, whether it is wrong) of each patch.
    with blender.quiet():
        for name, obj, true_curvatures in objects(bpy, touch):
            for place in places(obj, bpy.context.evaluated_depsgraph_get()):
                found = touch(obj, place)
                true = found and true_curvatures(place, found)
                if true and any(true):
                    error = off_by(found, true)
                    is_wrong = error > WRONG and error * np.abs(true).max() > WITHIN * deviation(found.result)
                    errors[name].append((verdict(found), error, is_wrong))
    print_tables(errors)
    print(f"Seed 0; {machine('bpy')}.")


def opened(bpy, path):
    """The mesh of a file."""
    bpy.ops.wm.read_homefile(use_empty=True)
    bpy.ops.wm.obj_import(filepath=str(path))
    obj = bpy.context.view_layer.objects.active = bpy.context.selected_objects[0]
    if len(bpy.context.selected_objects) > 1:
        bpy.ops.object.join()
    return obj


def subdivided(bpy, obj):
    """A copy of an object that is subdivided."""
    fine = obj.copy()
    bpy.context.collection.objects.link(fine)
    levels = math.log(MOST_FACES / (3 * len(obj.data.polygons)), 4)
    fine.modifiers.new("Subdivision", "SUBSURF").levels = min(max(int(levels), 1), 4)
    return fine


def of_model(found, whole, half):
    """Whether the curvatures of a touch are known, wrong by their deviations, and beyond those of contacts.

    whole, half : touches of the subdivided mesh, or None
    """
    r = found.result
    if not (whole and half):
        return False, False, False
    true, other = np.sort(curvatures(half)), np.sort(curvatures(whole))
    largest, off = np.abs(true).max(), np.abs(np.sort(curvatures(found)) - true).max()
    is_known = np.abs(other - true).max() <= max(AGREE * largest, 0.5 * KNOWN / r.radius)
    least = KNOWN / r.radius
    return (
        is_known,
        off > max(least, WRONG * largest, WITHIN * deviation(r)),
        off > max(least, WITHIN * r.posterior.curvature_std() / r.radius),
    )


def print_models(bpy, paths, touch):
    rows, total = [], np.zeros(6, dtype=int)
    for path in paths:
        with blender.quiet():
            obj = opened(bpy, path)
            fine = subdivided(bpy, obj)
            counts = np.zeros(6, dtype=int)
            for place in places(obj, bpy.context.evaluated_depsgraph_get(), OF_MODELS, SEED):
                found = touch(obj, place)
                if found is None:
                    continue
                fitted = (touch(fine, place, share * found.result.radius) for share in (1.0, 0.5))
                is_known, is_wrong, is_off = of_model(found, *fitted)
                is_sure, is_of_facets = verdict(found) == "ok", verdict(found) == "facets"
                counts += [
                    *(1, is_sure, is_sure and is_known, is_sure and is_known and is_wrong),
                    *(is_of_facets and is_known, is_of_facets and is_known and not is_off),
                ]
        total += counts
        rows.append([path.stem, *map(str, counts)])
    rows.append(["all", *map(str, total)])
    head = ["model", "touches", "sure", "known", "wrong", "doubts about facets, known", "not needed"]
    table(head, rows)
    print(f"{total[1] / total[0]:.2f} of the touches are sure.")


def rays_of(obj):
    """The mesh of an object in the world, without its modifiers."""
    mesh = obj.data
    mesh.calc_loop_triangles()
    points, faces = np.empty((len(mesh.vertices), 3)), np.empty((len(mesh.loop_triangles), 3), dtype=np.int32)
    mesh.vertices.foreach_get("co", points.ravel())
    mesh.loop_triangles.foreach_get("vertices", faces.ravel())
    turn, shift = np.array(obj.matrix_world)[:3, :3], np.array(obj.matrix_world)[:3, 3]
    return Rays(points @ turn.T + shift, faces)


def decimated(bpy, path):
    """(share, object) of a model of DENSE faces or more, with each of SHARES of them, and the rays of all."""
    obj = opened(bpy, path)
    if len(obj.data.polygons) < DENSE:
        return
    dense, fewer = rays_of(obj), obj.modifiers.new("Decimate", "DECIMATE")
    for share in SHARES:
        fewer.ratio = 1.0 / share
        yield share, obj, dense


def compared_with_dense(found, dense):
    """Whether a touch is off its dense mesh, beyond two deviations as well, and within two of the contacts.

    None if no polynomial explains the mesh there.
    """
    r, k = found.result, np.sort(curvatures(found))
    fits = [np.sort(true) for of in TRUTHS if (true := true_curvatures(dense, r, *of)) is not None]
    if not fits:
        return None
    off, allowed = min(
        ((np.abs(k - true).max(), max(WRONG * np.abs(true).max(), KNOWN / r.radius)) for true in fits),
        key=lambda pair: pair[0] / pair[1],
    )
    most = max(KNOWN / r.radius, WITHIN * r.posterior.curvature_std() / r.radius)
    return off > allowed, off > max(allowed, WITHIN * deviation(r)), off <= most


def print_decimated(bpy, paths, touch):
    counts = {share: np.zeros(6, dtype=int) for share in SHARES}
    with blender.quiet():
        for share, obj, dense in (of for path in paths for of in decimated(bpy, path)):
            for place in places(obj, bpy.context.evaluated_depsgraph_get(), OF_MODELS, SEED):
                if (found := touch(obj, place)) is None:
                    continue
                is_sure, is_of_facets = verdict(found) == "ok", verdict(found) == "facets"
                counts[share][:1] += 1
                if (comparison := compared_with_dense(found, dense)) is not None:
                    is_off, is_wrong, is_right = comparison
                    counts[share][1:] += [
                        *(is_sure, is_sure and is_off, is_sure and is_wrong),
                        *(is_of_facets, is_of_facets and is_right),
                    ]
    head = ["faces", "touches", "sure", "off by 1/4", "wrong", "doubts about facets", "not needed"]
    table(head, [[f"1/{share}", *map(str, of)] for share, of in counts.items()])


def print_tables(errors):
    rows = []
    for name, found in errors.items():
        good, facets = ([off for what, off, _ in found if what == of] for of in ("ok", "facets"))
        off = sum(error > WRONG for error in good)
        wrong = sum(bad and what == "ok" for what, _, bad in found), sum(error < RIGHT for error in facets)
        counts = len(found), len(good), off, wrong[0], len(facets), wrong[1]
        rows.append([name, *map(str, counts), *(f"{median(of):.2f}" if of else "" for of in (good, facets))])
    head = ["object", "patches", "good", "off by 1/4", "wrong", "facets", "wrong"]
    table([*head, "error if good", "error if facets"], rows)


if __name__ == "__main__":
    main()
