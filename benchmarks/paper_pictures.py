# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The pictures of benchmarks.paper: scans and patches as the paper shows them, and sheets of them."""

import numpy as np

from core.patch.triangulation import triangulate
from core.scan.verification import is_hidden
from tools import demo

from . import ROOT

OUTPUT = ROOT / "build" / "paper"
CUT = 1.65  # Radii around the reference point within which a mesh is shown.
TALL = 8.19  # The neck's patches are shown this many mm above and below the point.
FINE = 0.01  # The distance of vertices in a cut patch, as a share of the radius.
SIZE = 480  # The width and height of a picture in a sheet, in pixels.
INKS = {
    "red": (0.85, 0.01, 0.01, 1.0),
    "blue": (0.01, 0.08, 0.6, 1.0),
    "brown": (0.42, 0.18, 0.05, 1.0),
}


class Stage:
    """A scene to fill and to photograph."""

    def __init__(self, extension, scene):
        self.mesh_data, self.scene = extension.tactile_addon.scene.mesh_data, scene

    def ink(self, name):
        return demo.plain_material(name, INKS[name])

    def add(self, name, data, material=None):
        import bpy

        obj = bpy.data.objects.new(name, data)
        if material is not None:
            data.materials.append(material)
        self.scene.collection.objects.link(obj)
        return obj

    def mesh(self, name, points, triangles, material=None, attributes=()):
        import bpy

        data = bpy.data.meshes.new(name)
        self.mesh_data.fill(data, points, triangles, list(attributes))
        data.shade_smooth()
        return self.add(name, data, material)

    def line(self, points, thickness, material):
        import bpy

        data = bpy.data.curves.new("Line", "CURVE")
        data.dimensions, data.bevel_depth, data.use_fill_caps = "3D", thickness, True
        spline = data.splines.new("POLY")
        spline.points.add(len(points) - 1)
        spline.points.foreach_set("co", np.column_stack([points, np.ones(len(points))]).ravel())
        return self.add("Line", data, material)

    def dots(self, points, radius, material):
        """A ball at each of points (n, 3)."""
        import bmesh
        import bpy

        ball = bpy.data.meshes.new("Ball")
        form = bmesh.new()
        bmesh.ops.create_icosphere(form, subdivisions=2, radius=radius)
        form.to_mesh(ball)
        form.free()
        corners, faces = (
            np.array([v.co for v in ball.vertices]),
            np.array([f.vertices for f in ball.polygons]),
        )
        balls = (points[:, None] + corners).reshape(-1, 3)
        faces = (len(corners) * np.arange(len(points))[:, None, None] + faces).reshape(-1, 3)
        return self.mesh("Dots", balls, faces, material)

    def arrow(self, start, way, thickness, material):
        import bpy
        from mathutils import Vector

        line = self.line(np.array([start, start + 0.8 * way]), thickness, material)
        bpy.ops.mesh.primitive_cone_add(
            radius1=3.0 * thickness,
            depth=0.25 * np.linalg.norm(way),
            location=start + 0.875 * way,
            rotation=Vector(way).to_track_quat("Z", "Y").to_euler(),
        )
        bpy.context.object.data.materials.append(material)
        return [line, bpy.context.object]

    def photograph(self, name, center, view, up, width, overlays=()):
        """Renders to build/paper/NAME.png what is seen from `view`, with `up` upward.

        Overlays are moved toward the camera, which an orthographic picture does not show.
        """
        import bpy
        from mathutils import Matrix, Vector

        view = Vector(view).normalized()
        right = Vector(up).cross(view).normalized()
        axes = Matrix((right, view.cross(right), view)).transposed()
        place = Matrix.LocRotScale(Vector(center) + 10.0 * width * view, axes, None)
        camera = self.add("Camera", bpy.data.cameras.new("Camera"))
        sun = self.add("Sun", bpy.data.lights.new("Sun", "SUN"))
        self.scene.world.node_tree.nodes["Background"].inputs["Strength"].default_value = 0.35
        camera.data.type, camera.data.ortho_scale, camera.data.clip_end = "ORTHO", width, 20.0 * width
        camera.matrix_world, self.scene.camera = place, camera
        sun.data.energy, sun.data.angle = 3.5, 0.3
        sun.matrix_world = place @ Matrix.Rotation(-0.7, 4, "X") @ Matrix.Rotation(-0.6, 4, "Y")
        for obj in overlays:
            obj.delta_location = 2.0 * width * view
        self.scene.render.film_transparent, self.scene.render.image_settings.color_mode = True, "RGBA"
        demo.photograph(self.scene, OUTPUT / f"{name}.png", SIZE, SIZE)
        bpy.data.objects.remove(sun)


def draw_row(extension, place, r, contours):
    """Draws a row of Table I: the scan, with nothing else in the scene, and both sides of its patch."""
    import bpy

    scene = bpy.context.scene
    (obj,) = scene.objects
    stage, n = Stage(extension, scene), r.frame.axes[:, 2]
    demo.look(scene, obj)
    box = np.array(obj.bound_box)
    up = np.array([0.0, 0.0, 1.0]) if abs(n[2]) < 0.8 else np.array([0.0, 1.0, 0.0])
    size = float(np.linalg.norm(np.ptp(box, axis=0)))
    spot = stage.dots(place.point[None], 0.022 * size, stage.ink("red"))
    stage.photograph(f"{place.name}_1", box.mean(axis=0), n + 0.35 * up, up, 0.8 * size, [spot])
    for gone in (obj, spot):
        gone.hide_render = True
    _cut(stage, obj, place, r)
    points, triangles = r.mesh()
    stage.mesh("Patch", r.frame.to_world(points), triangles, stage.ink("blue"))
    red, brown, size = stage.ink("red"), stage.ink("brown"), r.radius
    overlays = [stage.line(curve.points, 0.02 * size, red) for curve in contours]
    for axis in r.frame.axes.T:
        overlays += stage.arrow(place.point, 0.75 * size * axis, 0.035 * size, brown)
    stage.photograph(f"{place.name}_2", place.point, n - 0.6 * up, up, 3.6 * size, overlays)
    stage.photograph(f"{place.name}_3", place.point, -n + 0.6 * up, up, 3.6 * size, overlays)


def _cut(stage, obj, place, r):
    """Adds the mesh around the patch, in clay."""
    mesh = obj.data
    mesh.calc_loop_triangles()
    points = np.empty((len(mesh.vertices), 3), dtype=np.float32)
    triangles = np.empty((len(mesh.loop_triangles), 3), dtype=np.int32)
    mesh.vertices.foreach_get("co", points.ravel())
    mesh.loop_triangles.foreach_get("vertices", triangles.ravel())
    up, (x, y, z) = r.frame.axes[:, 2].tolist(), r.frame.to_local(points).T
    near = (np.hypot(x, y) < CUT * r.radius) & (np.abs(z) < CUT * r.radius)
    for i in np.flatnonzero(near):  # What lies below another layer would hide the view from inside.
        near[i] = not is_hidden(place.surface, points[i].tolist(), up, 2.0 * CUT * r.radius)
    demo.look(stage.scene, stage.mesh("Mesh", points, triangles[near[triangles].all(axis=1)]))


def draw_neck(extension, name, r, contacts, verifying):
    """Draws a patch, with red contacts and blue verifying points, both in its frame."""
    import bpy

    bpy.ops.wm.read_homefile(use_empty=True)
    stage = Stage(extension, bpy.context.scene)
    size = FINE * r.radius
    plane, triangles = triangulate(r.domain, lambda at: np.full(len(at), size), FINE * size)
    patch = stage.mesh("Patch", np.column_stack([plane, r.patch.height(*plane.T)]), triangles)
    _cut_off(patch.data, TALL)
    demo.look(bpy.context.scene, patch)
    stage.dots(contacts, 0.04 * r.radius, stage.ink("red"))
    stage.dots(verifying, 0.022 * r.radius, stage.ink("blue"))
    stage.photograph(name, (0, 0, -0.1 * r.radius), (-0.55, -0.7, 0.6), (0, 0, 1), 2.45 * r.radius)


def _cut_off(mesh, height):
    """Removes the part of the mesh that is farther than `height` from z = 0."""
    import bmesh

    form = bmesh.new()
    form.from_mesh(mesh)
    for sign in (1.0, -1.0):
        geometry = [*form.verts, *form.edges, *form.faces]
        plane = {"plane_co": (0.0, 0.0, sign * height), "plane_no": (0.0, 0.0, sign)}
        bmesh.ops.bisect_plane(form, geom=geometry, clear_outer=True, **plane)
    form.to_mesh(mesh)
    form.free()


def sheet(name, pictures, column_titles, row_titles, caption):
    """Writes build/paper/NAME.jpg from pictures of that folder, row by row, under their titles."""
    from .plot import plt

    rows, columns = len(pictures), len(pictures[0])
    foot = 0.55 if caption else 0.05  # inches
    size = (10, 10 * rows / columns + 0.35 + foot)
    figure, axes = plt.subplots(rows, columns, figsize=size, squeeze=False)
    for i, j in np.ndindex(rows, columns):
        axes[i, j].imshow(plt.imread(OUTPUT / f"{pictures[i][j]}.png"), interpolation="lanczos")
        axes[i, j].set(xticks=[], yticks=[], frame_on=False)
        if i == 0:
            axes[i, j].set_title(column_titles[j], fontsize=14)
    for axis, title in zip(axes[:, 0], row_titles, strict=False):
        axis.set_ylabel(title, fontsize=14)
    inch = 1.0 / figure.get_figheight()
    figure.subplots_adjust(0.03, foot * inch, 1.0, 1.0 - 0.4 * inch, wspace=0.02, hspace=0.02)
    figure.text(0.5, 0.08 * inch, caption, ha="center", va="bottom", fontsize=12)
    figure.savefig(OUTPUT / f"{name}.jpg", dpi=100, facecolor="white", pil_kwargs={"quality": 88})
