# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The sample scene, examples/sample.blend: a vase, a probe where its neck begins, and a note.

`make sample` makes it. It should be made in Blender 4.5, so that all Blenders from 4.5 on open it.
"""

import argparse
import sys
from pathlib import Path

import numpy as np

from tools import blender

OUTPUT = Path(__file__).resolve().parents[1] / "examples" / "sample.blend"
LARGEST = 300_000  # The file has at most this many bytes.
AROUND, ALONG, SUBDIVISIONS = 32, 20, 3
HEIGHT, PLACE = 2.4, 1.45  # The height of the vase, and that of the probe on it.
NOTE = """A probe on a vase

Open the sidebar (N), tab Tactile.
Drag a disc on the rim:
the plane turns.
Drag the white disc:
the probe slides.
Red bulges, blue is a saddle."""


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--zip", required=True, type=Path, help="the built extension")
    parser.add_argument("--output", type=Path, default=OUTPUT)
    options = parser.parse_args()
    blender.start(options.zip)
    with blender.quiet():
        make()
        save(options.output)
    size = options.output.stat().st_size
    print(f"saved {options.output}: {size} bytes")
    if size > LARGEST:
        sys.exit(f"sample: expected at most {LARGEST} bytes")


def profile(z):
    """The radius of the vase at heights z; it has a belly, a neck and a lip."""
    return 0.62 + 0.30 * np.cos(2.4 * (z - 0.75)) + 0.08 * (z / HEIGHT) ** 4


def make():
    """Makes the scene: the vase, the note, and the probe, which is active."""
    import bpy

    bpy.ops.wm.read_homefile(use_factory_startup=True)
    for obj in list(bpy.data.objects):
        if obj.type != "LIGHT":
            bpy.data.objects.remove(obj)
    vase()
    note()
    steepness = (profile(PLACE + 1e-4) - profile(PLACE - 1e-4)) / 2e-4
    front = (0.0, -float(profile(PLACE)), PLACE)
    # The probe has four planes, because on a vase the error of three is larger than their deviation says.
    azimuths = [*np.radians([0.0, 45.0, 90.0, 135.0]), 0.0, 0.0]
    outward = (0.0, -1.0, -float(steepness))
    bpy.ops.tactile.pick(
        target="Vase", location=front, outward=outward, plane_count=4, azimuths=azimuths, new=True
    )
    frame_viewports()


def vase():
    import bpy

    angles = np.arange(AROUND) * 2.0 * np.pi / AROUND
    z, turn = np.meshgrid(np.linspace(0.0, HEIGHT, ALONG), angles, indexing="ij")
    points = np.stack([profile(z) * np.sin(turn), -profile(z) * np.cos(turn), z], axis=-1).reshape(-1, 3)
    a = np.arange(ALONG - 1)[:, None] * AROUND + np.arange(AROUND)
    b = np.arange(ALONG - 1)[:, None] * AROUND + (np.arange(AROUND) + 1) % AROUND
    faces = np.stack([a, b, b + AROUND, a + AROUND], axis=-1).reshape(-1, 4)
    mesh = bpy.data.meshes.new("Vase")
    mesh.from_pydata(points.tolist(), [], faces.tolist())
    mesh.shade_smooth()
    obj = bpy.data.objects.new("Vase", mesh)
    modifier = obj.modifiers.new("Subdivision", "SUBSURF")
    modifier.levels = modifier.render_levels = SUBDIVISIONS
    bpy.context.scene.collection.objects.link(obj)
    bpy.context.view_layer.objects.active = obj


def note():
    """Adds the note to the scene, and as a text of the file."""
    import bpy

    bpy.data.texts.new("Read Me").write(NOTE)
    curve = bpy.data.curves.new("Note", "FONT")
    curve.body, curve.size = NOTE, 0.13
    obj = bpy.data.objects.new("Note", curve)
    obj.location, obj.rotation_euler = (-2.75, -0.3, 1.9), (np.pi / 2.0, 0.0, 0.0)
    bpy.context.scene.collection.objects.link(obj)


def frame_viewports():
    """Makes every 3D viewport look at the probe from the front, with its sidebar open."""
    import bpy
    from mathutils import Vector

    for screen in bpy.data.screens:
        for area in screen.areas:
            if area.type == "VIEW_3D":
                space = area.spaces.active
                space.show_region_ui = True
                space.region_3d.view_perspective = "PERSP"
                space.region_3d.view_location = (-0.25, 0.0, 1.2)
                space.region_3d.view_rotation = Vector((0.15, -1.0, 0.25)).to_track_quat("Z", "Y")
                space.region_3d.view_distance = 5.5


def save(path):
    import bpy

    # Nobody needs palettes, brushes and the like of the startup file here.
    bpy.data.orphans_purge(do_recursive=True)
    bpy.ops.wm.save_as_mainfile(filepath=str(path), compress=True, check_existing=False)


if __name__ == "__main__":
    main()
