# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The meshes of Blender's Add menu, touched all over with the dialog's defaults.

`python -m benchmarks.add_menu ZIP [--only NAME]`, from the root of a checkout; ZIP is the built extension.
It prints a Markdown table and draws build/charts/add_menu.jpg, objects above and what was felt of them below.
With --scans the objects are a cube and the scans of a bottle and of a pear, in build/charts/touched.jpg.

Deviations are those of the report, both ways between surface and object, in tolerances (1/500 of the size).
Open edges, Euler number and pieces are of the touched surface, and in brackets of the object where these
differ; vertices of the object in the same place, as those of a converted text, count as one.
"""

import math
import sys

import numpy as np
from PIL import Image

from tests.solids import topology
from tools import blender, demo

from . import ROOT, machine, parser_of, scan_files, table, timed

APART, SIZE = 1.1, 1.05  # The distance of objects in the picture, and the length of their diagonals.
COLUMNS, WIDTH, SAMPLES = 6, 1800, 48
TINTS = ((0.35, 0.35, 0.34, 1.0), (0.16, 0.3, 0.5, 1.0))  # Of objects, and of what was felt of them.


def shapes():
    """Functions that add an object to the scene, by name."""
    import bpy

    add = bpy.ops.mesh

    def plate():
        add.primitive_cube_add()
        bpy.context.object.scale = (1.0, 0.7, 0.04)

    def letter():
        bpy.ops.object.text_add()
        bpy.context.object.data.body, bpy.context.object.data.extrude = "B", 0.1
        bpy.ops.object.convert(target="MESH")

    def subdivided():
        add.primitive_monkey_add()
        bpy.context.object.modifiers.new("Subdivision", "SUBSURF").levels = 2

    return {
        "cube": add.primitive_cube_add,
        "plane": add.primitive_plane_add,
        "circle": lambda: add.primitive_circle_add(fill_type="NGON"),
        "UV sphere": add.primitive_uv_sphere_add,
        "ico sphere": add.primitive_ico_sphere_add,
        "cylinder": add.primitive_cylinder_add,
        "cone": add.primitive_cone_add,
        "torus": add.primitive_torus_add,
        "plate": plate,
        "letter": letter,
        "Suzanne": add.primitive_monkey_add,
        "Suzanne, subdivided": subdivided,
    }


def scans():
    """Functions that add a cube, and scans of a bottle and of a pear, by name."""
    import bpy

    standing = (math.radians(90.0), 0.0, 0.0)  # Of what lies along the second axis.

    def scan(name):
        bpy.ops.wm.ply_import(filepath=str(scan_files(name)[0]))
        bpy.ops.object.shade_smooth()
        made = bpy.context.object
        made.rotation_euler = standing if max(made.dimensions) > made.dimensions.z else (0.0, 0.0, 0.0)

    return {
        "cube": bpy.ops.mesh.primitive_cube_add,
        "bottle": lambda: scan("bottle_bleach"),
        "pear": lambda: scan("pear"),
    }


def touched(add):
    """(the object that a function adds, the touched surface, CPU seconds); others are hidden."""
    import bpy

    for obj in bpy.data.objects:
        obj.hide_set(True)
    add()
    source = bpy.context.object
    seconds, _ = timed(bpy.ops.tactile.touch_all_over, target=source.name)
    return source, bpy.context.view_layer.objects.active, seconds


def shape_of(obj, *, merged):
    """The topology of an evaluated object; vertices in the same place may count as one."""
    import bpy

    mesh = obj.evaluated_get(bpy.context.evaluated_depsgraph_get()).to_mesh()
    mesh.calc_loop_triangles()
    points = np.array([vertex.co for vertex in mesh.vertices])
    triangles = np.array([triangle.vertices for triangle in mesh.loop_triangles])
    if merged:
        triangles = np.unique(points.round(6), axis=0, return_inverse=True)[1].ravel()[triangles]
    return topology(triangles)


def row(name, source, made, seconds):
    record = made["tactile_object"].to_dict()
    found, true = shape_of(made, merged=False), shape_of(source, merged=True)
    shape = f"{found.open} / {found.euler} / {found.pieces}"
    if (found.open > 0, found.euler, found.pieces) != (true.open > 0, true.euler, true.pieces):
        shape += f" ({true.open} / {true.euler} / {true.pieces})"
    off = (record[f"deviation_{key}"] / record["tolerance"] for key in ("mean", "max"))
    return [
        name,
        str(record["touches"]),
        shape,
        *(f"{value:.2f}" for value in off),
        f"{seconds:.1f}",
        record["status"],
    ]


def placed(obj, column, line):
    """Moves an object to its place in the picture, turned so that three of its sides show."""
    import bpy
    from mathutils import Matrix, Vector

    bpy.context.view_layer.update()
    corners = np.array([obj.matrix_world @ Vector(corner) for corner in obj.bound_box])
    scale = SIZE / np.linalg.norm(np.ptp(corners, axis=0))
    middle = Vector((corners.min(axis=0) + corners.max(axis=0)) / 2.0)
    turn = Matrix.Rotation(math.radians(28.0), 4, "X") @ Matrix.Rotation(math.radians(-32.0), 4, "Z")
    wide, high = np.ptp(corners, axis=0)[[0, 2]]
    stand = Matrix.Rotation(math.radians(-90.0 if high > 0.5 * wide else -40.0), 4, "X")
    place = Matrix.Translation((column * APART, -line * APART, 0.0))
    obj.matrix_world = (
        place @ turn @ stand @ Matrix.Scale(scale, 4) @ Matrix.Translation(-middle) @ obj.matrix_world
    )


def draw(pairs, name):
    """Draws the objects above what was felt of them, to build/charts/NAME.jpg."""
    import bpy

    scene = bpy.context.scene
    for i, (source, made) in enumerate(pairs):
        source.hide_set(False)
        made.hide_set(False)
        made.data.materials.clear()
        source.data.materials.clear()
        for line, obj in enumerate((source, made)):
            demo.look(scene, obj)
            clay = obj.data.materials[0].node_tree.nodes["Principled BSDF"]
            clay.inputs["Base Color"].default_value = TINTS[line]
            placed(obj, i % COLUMNS, 2 * (i // COLUMNS) + line)
    columns, lines = min(len(pairs), COLUMNS), 2 * math.ceil(len(pairs) / COLUMNS)
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.data.type, camera.data.ortho_scale = "ORTHO", APART * max(columns, lines)
    camera.location = (0.5 * APART * (columns - 1), -0.5 * APART * (lines - 1), 10.0)
    sun = bpy.data.objects.new("Sun", bpy.data.lights.new("Sun", "SUN"))
    sun.data.energy, sun.data.use_shadow, sun.rotation_euler = 3.0, False, (-0.9, -0.6, 0.0)
    for obj in (camera, sun):
        scene.collection.objects.link(obj)
    scene.camera = camera
    path = ROOT / "build" / "charts" / name
    path.parent.mkdir(parents=True, exist_ok=True)
    demo.photograph(scene, path.with_suffix(".png"), WIDTH, round(WIDTH * lines / columns), SAMPLES)
    with Image.open(path.with_suffix(".png")) as picture:
        picture.convert("RGB").save(path.with_suffix(".jpg"), quality=88)


def print_touched(adds, picture):
    """Prints and draws the objects that functions add, by name, with reports that are not ok and refusals."""
    import bpy

    rows, pairs, messages = [], [], []
    with blender.quiet():
        bpy.ops.wm.read_homefile(use_empty=True)
        for name, add in adds.items():
            try:
                source, made, seconds = touched(add)
            except RuntimeError as error:
                messages.append(f"{name}: {str(error).strip()}")
                continue
            rows.append(row(name, source, made, seconds))
            message = made["tactile_object"]["message"]
            print(*rows[-1], message, file=sys.stderr, flush=True)
            messages += [f"{name}: {message}"] if rows[-1][-1] != "ok" else []
            pairs.append((source, made))
        draw(pairs, picture)
    table(["object", "touches", "open / Euler / pieces", "mean", "largest", "CPU s", "status"], rows)
    print("\n\n".join(messages), end="\n\n" if messages else "")


def main():
    parser = parser_of(__doc__, takes_zip=True)
    parser.add_argument("--only", default="", help="only objects with this in their names")
    parser.add_argument("--scans", action="store_true", help="a cube, a bottle and a pear instead")
    options = parser.parse_args()
    blender.start(options.zip)
    adds = scans() if options.scans else shapes()
    some = {name: add for name, add in adds.items() if options.only in name}
    print_touched(some, "touched" if options.scans else "add_menu")
    print(f"{machine('bpy', 'numpy', 'scipy')}.")


if __name__ == "__main__":
    main()
