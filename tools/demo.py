# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The main job from start to end: Blender touches a mesh, and a patch is fitted, reported, drawn and saved.

`make demo` runs it on Suzanne, `make demo MESH=FILE` on a .ply, .stl, .obj or .blend file.
"""

import argparse
import sys
from pathlib import Path

import numpy as np

from tools import blender

SPOT = (0.32, -0.19, 0.84)  # This place is on Suzanne's forehead.
NOISE = 1.0 / 1200.0  # A share of the object's size, as 0.05 mm is of 60 mm.
WIDTH, HEIGHT = 1200, 900
BAR_STEPS = 128
BAR_REACH = 1.2  # Half the length of the color bar, in units of the picture.
# The picture is this many units wide; the mesh has so many of them, in a middle that is so far to the left.
PICTURE, MESH, ASIDE = 7.0, 4.6, 0.9
THICKNESS = 0.025  # That of a curve in units of the picture.
BACKGROUND = (0.8, 0.82, 0.85, 1.0)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--zip", required=True, type=Path, help="the built extension")
    parser.add_argument("--mesh", default="", help="a mesh file (Suzanne)")
    options = parser.parse_args()
    print("starting Blender with the extension ...", flush=True)
    extension = blender.start(options.zip)
    import bpy

    try:
        print(f"touching {options.mesh or 'Suzanne'} ...", flush=True)
        with blender.quiet():
            patch = touch(extension, options.mesh)
        print("saving the scene ...", flush=True)
        with blender.quiet():
            compose(extension, patch, "unit" if options.mesh else "m")
            bpy.ops.wm.save_as_mainfile(filepath=str(blender.BUILD / "demo.blend"))
        print(f"rendering a picture of {WIDTH} x {HEIGHT} pixels on the processor ...", flush=True)
        with blender.quiet():
            render(patch, blender.BUILD / "demo.png")
    except (RuntimeError, OSError) as error:
        sys.exit(f"demo: {str(error).strip()}")
    report = patch[extension.tactile_addon.scene.patch_record.RECORD].to_dict()
    wording = extension.tactile_addon.touch.wording
    print(wording.table(wording.readable_rows(report)))
    print(f"saved {blender.BUILD / 'demo.blend'} and {blender.BUILD / 'demo.png'}")


def touch(extension, mesh=""):
    """Fills the scene with the mesh, or Suzanne, and reconstructs a patch on it; returns the patch object."""
    import bpy

    if mesh:
        extension.tactile_addon.files.mesh_file.open_file(Path(mesh))
        target = next(o for o in bpy.context.scene.objects if o.type == "MESH" and len(o.data.polygons))
        corners = np.array([target.matrix_world @ type(target.location)(c) for c in target.bound_box])
        location, size = corners.mean(axis=0), np.ptp(corners, axis=0).max()
        # The ray comes from the front and somewhat above, from where people look at things.
        ray = np.array([0.0, 2.0, -1.0]) / np.sqrt(5.0)
        depsgraph = bpy.context.evaluated_depsgraph_get()
        hit, point, *_ = bpy.context.scene.ray_cast(depsgraph, location - 2.0 * size * ray, ray)
        location = tuple(point) if hit else tuple(location)
    else:
        bpy.ops.wm.read_homefile(use_empty=True)
        bpy.ops.mesh.primitive_monkey_add(size=2.0)
        target = bpy.context.object
        target.modifiers.new("Subdivision", "SUBSURF").levels = 3
        bpy.ops.object.shade_smooth()
        location = SPOT
    bpy.ops.tactile.reconstruct(target=target.name, location=location, noise=NOISE * max(target.dimensions))
    return bpy.context.view_layer.objects.active


def compose(extension, patch, unit):
    """Adds camera, light, curves, a color bar and labels for a picture of the patch in its true colors."""
    report = patch[extension.tactile_addon.scene.patch_record.RECORD].to_dict()
    put = stage(extension, report)
    put.curves(extension, extension.reconstruction_of(patch).contours)
    color_bar(extension, put, report["color_limit"], unit)
    put.text(f"{report['source']}: a patch felt along {len(report['planes'])} curves", -3.3, 2.25, 0.21)
    put.text(f"It is {2.0 * report['radius']:.2g} {unit} across, {bends(report, unit)}.", -3.3, -2.25, 0.14)
    if "height_error" in report:
        off = 100.0 * report["height_error"] / report["radius"]
        words = f"Between the curves, too, it is off the model by only {off:.1g} % of its radius on average."
        put.text(words, -3.3, -2.48, 0.14)


def bends(report, unit):
    """How much the patch bends at its middle, in words without curvature."""
    radii = [f"{1.0 / abs(report[name]):.2g} {unit}" for name in ("k1", "k2") if abs(report[name]) > 1e-9]
    if not radii:
        return "and flat"
    return f"and bends like circles with radii of {' and '.join(radii)}"


def stage(extension, report):
    """Sets up camera, light and materials around the mesh of a report; returns an _Overlay for labels."""
    import bpy
    from mathutils import Matrix, Vector

    scene, source = bpy.context.scene, bpy.data.objects[report["source"]]
    normal = Vector(report["frame"]["normal"])
    upright = Vector((0, 0, 1)) if abs(normal.z) < 0.9 else Vector((0, 1, 0))
    right = upright.cross(normal).normalized()
    view = (normal - 0.2 * right - 0.6 * normal.cross(right)).normalized()
    right = normal.cross(right).cross(view).normalized()
    axes = Matrix((right, view.cross(right), view)).transposed()
    corners = np.array([axes.transposed() @ (source.matrix_world @ Vector(c)) for c in source.bound_box])
    low, high = corners.min(axis=0), corners.max(axis=0)
    unit = float((high - low)[:2].max()) / MESH

    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.data.type, camera.data.ortho_scale = "ORTHO", PICTURE * unit
    away = 100.0 * unit
    camera.data.clip_end = 10.0 * away
    middle = axes @ Vector(0.5 * (low + high)) + ASIDE * unit * right
    camera.matrix_world = Matrix.LocRotScale(middle + away * view, axes, None)
    sun = bpy.data.objects.new("Sun", bpy.data.lights.new("Sun", "SUN"))
    sun.data.energy, sun.data.angle = 2.0, 0.3
    sun.matrix_world = camera.matrix_world @ Matrix.Rotation(-0.6, 4, "X") @ Matrix.Rotation(-0.6, 4, "Y")
    for obj in (camera, sun):
        scene.collection.objects.link(obj)
    scene.camera = camera
    look(scene, source)
    ink = plain_material("Ink", (0.01, 0.01, 0.01, 1.0))
    paper = plain_material("Paper", BACKGROUND)
    put = _Overlay(camera, unit, ink)
    put.card(paper, -2.1)
    return put


def plain_material(name, color):
    """The material of this name, made if missing, which shows one color as it is."""
    import bpy

    material = bpy.data.materials.get(name)
    if material is None:
        material = bpy.data.materials.new(name)
        if material.node_tree is None:  # Blender 4.5 needs this; later ones deprecate it.
            material.use_nodes = True
        material.diffuse_color, nodes = color, material.node_tree.nodes
        nodes.clear()
        output, emission = nodes.new("ShaderNodeOutputMaterial"), nodes.new("ShaderNodeEmission")
        emission.inputs["Color"].default_value = color
        material.node_tree.links.new(emission.outputs["Emission"], output.inputs["Surface"])
    return material


class _Overlay:
    """Places things in front of the camera, in units of the picture from its center."""

    def __init__(self, camera, unit, ink):
        self.camera, self.unit, self.ink = camera, unit, ink
        # What lies in the mesh is moved toward the camera, which is orthographic, so that this does not show.
        self.toward = camera.matrix_world.col[2].xyz * camera.data.ortho_scale * 0.05

    def curves(self, extension, contours):
        """Adds the contours as tubes in the colors of their planes, in front of the mesh; returns them."""
        from mathutils import Color

        module = extension.tactile_addon
        colors = [(*Color(c).from_srgb_to_scene_linear(), 1.0) for c in module.viewport.curves.PLANE_COLORS]
        return [self._curve(c.points, color) for c, color in zip(contours, colors, strict=False)]

    def _curve(self, points, color):
        import bpy

        data = bpy.data.curves.new("Curve", "CURVE")
        data.dimensions, data.bevel_depth = "3D", 0.5 * THICKNESS * self.unit
        spline = data.splines.new("POLY")
        spline.points.add(len(points) - 1)
        rows = np.column_stack([points + 1.5 * np.array(self.toward), np.ones(len(points))])
        spline.points.foreach_set("co", rows.ravel())
        name = "Curve {:.2f} {:.2f} {:.2f}".format(*color[:3])
        data.materials.append(plain_material(name, color))
        obj = bpy.data.objects.new("Curve", data)
        obj.visible_shadow = False
        bpy.context.scene.collection.objects.link(obj)
        return obj

    def add(self, name, data, x, y, behind=1.0):
        import bpy

        obj = bpy.data.objects.new(name, data)
        obj.parent = self.camera
        obj.location = (x * self.unit, y * self.unit, -behind * self.unit)
        obj.scale = (self.unit,) * 3
        bpy.context.scene.collection.objects.link(obj)
        return obj

    def card(self, material, top):
        """Adds a strip behind texts, as wide as the picture, from its lower edge to `top`."""
        import bpy

        strip = bpy.data.meshes.new("Card")
        corners = [(-4.0, -4.0, 0.0), (4.0, -4.0, 0.0), (4.0, top, 0.0), (-4.0, top, 0.0)]
        strip.from_pydata(corners, [], [(0, 1, 2, 3)])
        strip.materials.append(material)
        self.add("Card", strip, 0.0, 0.0, 1.1).visible_shadow = False

    def text(self, body, x, y, size):
        import bpy

        text = bpy.data.curves.new("Label", "FONT")
        text.body, text.size = body, size
        text.materials.append(self.ink)
        return self.add("Label", text, x, y)


def color_bar(extension, put, limit, unit):
    """Adds a strip with the patch's own material from -limit to limit, ticks and a title; returns them."""
    import bpy

    module = extension.tactile_addon
    at = np.linspace(-1.0, 1.0, BAR_STEPS + 1)
    points = np.array([(x, BAR_REACH * y, 0.0) for y in at for x in (0.0, 0.2)])
    corners = 2 * np.arange(BAR_STEPS)[:, None]
    triangles = np.vstack([corners + corner for corner in ((0, 1, 3), (0, 3, 2))])
    colors = module.scene.colors.shades(np.repeat(at, 2), 1.0)
    attributes = [(module.scene.mesh_data.COLOR, colors)]
    strip = bpy.data.meshes.new("Color Bar")
    module.scene.mesh_data.fill(strip, points, triangles, attributes)
    strip.materials.append(bpy.data.materials["Tactile Curvature"])
    bar = [put.add("Color Bar", strip, 2.35, 0.0)]
    bar.append(put.text("Mean curvature", 1.6, BAR_REACH + 0.45, 0.18))
    bar.append(put.text(f"in 1/{unit}", 1.6, BAR_REACH + 0.2, 0.18))
    meanings = {-1.0: "bulges", 0.0: "flat", 1.0: "hollow"}
    for share in (-1.0, -0.5, 0.0, 0.5, 1.0):
        words = f"{share * limit:+.3g}" if share else "0"
        bar.append(put.text(words, 2.62, BAR_REACH * share - 0.05, 0.15))
        if share in meanings:
            bar.append(put.text(meanings[share], 1.72, BAR_REACH * share - 0.05, 0.15))
    return bar


def look(scene, source):
    """Gives the mesh a clay material and a light background, and saves colors unchanged."""
    import bpy

    if not any(slot.material for slot in source.material_slots):
        clay = bpy.data.materials.new("Clay")
        if clay.node_tree is None:
            clay.use_nodes = True
        clay.node_tree.nodes["Principled BSDF"].inputs["Base Color"].default_value = (0.35, 0.35, 0.34, 1.0)
        clay.node_tree.nodes["Principled BSDF"].inputs["Roughness"].default_value = 0.8
        source.data.materials.append(clay)
    world = bpy.data.worlds.new("Light")
    if world.node_tree is None:
        world.use_nodes = True
    world.node_tree.nodes["Background"].inputs["Color"].default_value = BACKGROUND
    scene.world = world
    scene.view_settings.view_transform, scene.view_settings.look = "Standard", "None"
    scene.render.dither_intensity = 0.0


def render(patch, path, samples=32):
    """Draws the scene with Cycles to `path`, with the patch, which lies in the mesh, nearer to the camera."""
    import bpy

    scene = bpy.context.scene
    patch.delta_location = scene.camera.matrix_world.col[2].xyz * scene.camera.data.ortho_scale * 0.05
    photograph(scene, path, WIDTH, HEIGHT, samples)
    patch.delta_location = (0.0, 0.0, 0.0)


def photograph(scene, path, width, height, samples=32):
    """Draws the scene as it is with Cycles to the .png file `path`."""
    import bpy

    scene.render.engine, scene.cycles.device = "CYCLES", "CPU"
    scene.cycles.samples, scene.cycles.use_denoising = samples, False
    scene.render.resolution_x, scene.render.resolution_y = width, height
    scene.render.image_settings.file_format, scene.render.filepath = "PNG", str(path)
    bpy.ops.render.render(write_still=True)


if __name__ == "__main__":
    main()
