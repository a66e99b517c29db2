# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The moving picture of the README: a finger slides along three curves, a patch appears, its planes turn.

`make film` draws it with Blender as a Python module in some minutes, and writes docs/film.webp.
"""

import argparse
import sys
from pathlib import Path

import numpy as np

from tools import blender, demo

OUTPUT = Path(__file__).resolve().parents[1] / "docs" / "film.webp"
WIDTH, HEIGHT, SAMPLES, QUALITY = 560, 420, 16, 88
LARGEST = 300_000  # The film has at most this many bytes, so that the README opens at once.
STROKES, TURNS = 7, 15  # The numbers of pictures of each curve, and of the turn of the planes.
SHORT, LONG = 90, 1500  # The milliseconds that a picture is shown.
CAPTIONS = (
    "A finger slides along three curves",
    "From these curves alone: the surface between them",
    "Turn the planes, and the patch follows",
)
FINGER = (0.9, 0.35, 0.02, 1.0)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--zip", required=True, type=Path, help="the built extension")
    parser.add_argument("--frames", type=Path, help="a folder to keep the single pictures in")
    options = parser.parse_args()
    try:
        from PIL import Image
    except ImportError:
        sys.exit("film: Pillow, which writes the moving picture, is missing: make film installs it")
    folder = options.frames or blender.BUILD / "film"
    folder.mkdir(parents=True, exist_ok=True)
    extension = blender.start(options.zip)
    with blender.quiet():
        shots = list(Film(extension, folder).shots())
    pictures = [Image.open(path).convert("RGB") for path, _ in shots]
    times = [milliseconds for _, milliseconds in shots]
    pictures[0].save(
        OUTPUT,
        save_all=True,
        append_images=pictures[1:],
        duration=times,
        loop=0,
        quality=QUALITY,
        method=6,
        minimize_size=True,
    )
    size = OUTPUT.stat().st_size
    print(f"saved {OUTPUT}: {len(pictures)} pictures, {size} bytes, {sum(times) / 1e3:.1f} s")
    if size > LARGEST:
        sys.exit(f"film: expected at most {LARGEST} bytes: lower QUALITY or the number of pictures")


class Film:
    """The scene of the demo, and what moves in it."""

    def __init__(self, extension, folder):
        import bpy

        self.extension, self.folder, self.count = extension, folder, 0
        self.patch = demo.touch(extension)
        self.report = self.patch["tactile"].to_dict()
        self.put = put = demo.stage(extension, self.report)
        self.limit = self.report["color_limit"]
        self.legend = demo.color_bar(extension, put, self.limit, "m")
        self.caption = put.text("", -3.3, -2.45, 0.24)
        self.toward = put.toward
        bpy.context.scene.render.use_persistent_data = True
        self.patch.hide_render = True

    def shots(self):
        """Yields (path, milliseconds) of each picture."""
        curves = self.put.curves(self.extension, self.contours())
        finger = self.finger()
        for obj in self.legend:
            obj.hide_render = True
        yield from self.slides(curves, finger)
        for obj in self.legend:
            obj.hide_render = False
        self.caption.data.body = CAPTIONS[1]
        self.show(self.patch)
        for turn in range(TURNS):
            yield self.shot(LONG if turn == 0 else SHORT)
            self.caption.data.body = CAPTIONS[2]
            self.touch_again(np.radians(60.0) * (turn + 1) / TURNS)
            for curve in curves:
                self.remove(curve)
            curves = self.put.curves(self.extension, self.contours())
            self.show(self.patch)
        yield self.shot(LONG)

    def slides(self, curves, finger):
        """Yields the shots in which one curve after the other grows, with the finger at its end."""
        self.caption.data.body = CAPTIONS[0]
        for curve in curves:
            curve.hide_render = True
        for curve, contour in zip(curves, (c.points for c in self.contours()), strict=True):
            curve.hide_render = False
            for share in np.linspace(0.0, 1.0, STROKES):
                curve.data.bevel_factor_end = max(share, 1e-3)
                at = share * (len(contour) - 1)
                low = min(int(at), len(contour) - 2)
                place = contour[low] + (at - low) * (contour[low + 1] - contour[low])
                finger.location = place + 1.5 * np.array(self.toward)
                yield self.shot(SHORT)
        self.remove(finger)

    def contours(self):
        """The contours of the patch."""
        return self.extension.reconstruction_of(self.patch).contours

    def finger(self):
        """Adds a ball to the scene and returns it."""
        import bpy

        bpy.ops.mesh.primitive_uv_sphere_add(radius=0.09 * self.report["radius"])
        ball = bpy.context.object
        material = demo.plain_material("Finger", FINGER)
        ball.data.materials.append(material)
        ball.visible_shadow = False  # It floats, like all that is drawn in front of the mesh.
        return ball

    def touch_again(self, angle):
        """Replaces the patch by one with all planes turned by an angle in radians."""
        import bpy

        report = self.report
        azimuths = [np.radians(azimuth) + angle for azimuth, _ in report["planes"]]
        old = self.patch
        bpy.ops.tactile.reconstruct(
            target=report["source"],
            location=demo.SPOT,
            extent=report["extent"],
            step=report["step"],
            noise=report["noise"],
            azimuths=[*azimuths, 0.0, 0.0, 0.0],
        )
        self.patch = bpy.context.view_layer.objects.active
        self.remove(old)
        self.extension.tactile_addon.scene.shown.set_range(self.patch, self.limit)
        self.patch.hide_render = True

    def show(self, patch):
        patch.hide_render, patch.visible_shadow, patch.delta_location = False, False, self.toward

    @staticmethod
    def remove(obj):
        import bpy

        bpy.data.objects.remove(obj, do_unlink=True)

    def shot(self, milliseconds):
        import bpy

        path = self.folder / f"{self.count:03}.png"
        self.count += 1
        bpy.context.view_layer.update()
        demo.photograph(bpy.context.scene, path, WIDTH, HEIGHT, SAMPLES)
        return path, milliseconds


if __name__ == "__main__":
    main()
