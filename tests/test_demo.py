# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The demo's picture is true, and the example runs as it says."""

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("bpy", reason="needs Blender as a Python module: run make test")
from mathutils import Vector

from tools import demo


@pytest.mark.long
def test_a_rendered_pixel_has_the_color_that_the_bar_has_for_its_curvature(extension, tmp_path):
    import bpy
    from bpy_extras.object_utils import world_to_camera_view

    patch = demo.touch(extension)
    demo.compose(extension, patch, "m")
    demo.render(patch, tmp_path / "demo.png", samples=2)
    image = bpy.data.images.load(str(tmp_path / "demo.png"))
    width, height = image.size
    assert (width, height) == (demo.WIDTH, demo.HEIGHT)
    pixels = np.array(image.pixels[:]).reshape(height, width, -1)

    def pixel(obj, local):
        """The rendered color at a point of an object."""
        scene = bpy.context.scene
        x, y, _ = world_to_camera_view(scene, scene.camera, obj.matrix_world @ Vector(local))
        return pixels[int(y * height), int(x * width), :3]

    limit = patch["tactile"]["color_limit"]
    bar = bpy.data.objects["Color Bar"]
    paths = [np.reshape(path, (-1, 3))[:, :2] for path in patch["tactile_curves"]["contours"]]
    shares = np.linspace(0.0, 1.0, 10)[:, None, None]  # A curve is drawn between its contacts, too.
    contours = np.vstack([((1.0 - shares) * p[:-1] + shares * p[1:]).reshape(-1, 2) for p in paths])
    compared = []
    curvature = np.array([value.value for value in patch.data.attributes["mean_curvature"].data])
    corners = np.array([vertex.co for vertex in patch.data.vertices])
    edges = np.array([edge.vertices for edge in patch.data.edges])
    # Colors are compared at vertices, and halfway between neighbors, where they are means.
    for ends in [*np.arange(len(corners))[:, None], *edges]:
        place, values = corners[ends].mean(axis=0), curvature[ends]
        clear = np.linalg.norm(contours - place[:2], axis=1).min() > 0.15 * patch["tactile"]["radius"]
        inside = np.hypot(*place[:2]) < 0.8 * patch["tactile"]["radius"]
        if clear and inside and np.abs(values).max() < 0.95 * limit:
            on_bar = [pixel(bar, (0.1, demo.BAR_REACH * value / limit, 0.0)) for value in values]
            drawn = np.add(place, (0.0, 0.0, patch["tactile_above"]))  # Renders draw it above the mesh.
            compared.append(np.abs(pixel(patch, drawn) - np.mean(on_bar, axis=0)).max())
    assert len(compared) > 200
    # Half a pixel of the bar is a 900th of its range; on the patch it is more where K changes fast.
    assert np.median(compared) <= 2 / 255
    assert np.max(compared) <= 10 / 255


def test_the_labels_and_the_bar_say_the_range(extension):
    import bpy

    patch = demo.touch(extension)
    demo.compose(extension, patch, "m")
    limit = patch["tactile"]["color_limit"]
    labels = [obj.data.body for obj in bpy.data.objects if obj.type == "FONT"]
    words = (f"{limit:+.3g}", f"{-limit:+.3g}", "0", "Mean curvature", "in 1/m", "bulges", "flat", "hollow")
    assert set(words) <= set(labels)


@pytest.mark.parametrize("name", ["pear.ply", "shell_gastropod.stl", "asteroid_eros.ply"])
def test_a_mesh_file_can_be_touched(extension, scans, name):
    patch = demo.touch(extension, str(scans / name))
    report = patch["tactile"].to_dict()
    assert report["vertices"] > 1  # few, as a patch is no larger than the features there
    assert report["vertex_distance_mean"] < 0.05 * report["radius"]


@pytest.mark.long
def test_the_example_makes_many_patches_under_blender_as_a_module(empty, tmp_path):
    empty.ops.mesh.primitive_torus_add(major_segments=96, minor_segments=48)
    empty.ops.wm.save_as_mainfile(filepath=str(tmp_path / "scene.blend"))
    example = Path(__file__).resolve().parents[1] / "examples" / "many_patches.py"
    output = tmp_path / "patches.blend"
    command = [
        sys.executable,
        str(example),
        str(tmp_path / "scene.blend"),
        "--count",
        "5",
        "--output",
        str(output),
    ]
    result = subprocess.run(command, env=os.environ, capture_output=True, text=True)
    assert result.returncode == 0, result.stderr
    lines = [json.loads(line) for line in result.stdout.splitlines() if line.startswith("{")]
    assert len(lines) == 5
    assert sum("patch" in line for line in lines) >= 4
    empty.ops.wm.open_mainfile(filepath=str(output))
    assert sum("tactile" in obj for obj in empty.data.objects) == sum("patch" in line for line in lines)
