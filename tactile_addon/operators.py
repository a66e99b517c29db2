# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The operator behind the menu entry, the scripts and the command line."""

import math

import bpy
from bpy.props import EnumProperty, FloatProperty, FloatVectorProperty, IntProperty, StringProperty

from .. import core
from . import patch_object
from .touch import touch

METHODS = [
    (
        "bayes",
        "Bayesian",
        "All coefficients and the frame at once, with what the contacts leave open: the most accurate",
    ),
    (
        "tagc",
        "Total Curvature",
        "The paper's fit: close to the contacts, with as little folding as possible",
    ),
    (
        "quadratic-variation",
        "Quadratic Variation",
        "Close to the contacts, with as little bending as possible",
    ),
    (
        "least-squares",
        "Least Squares",
        "Closest to the contacts, whatever the surface does between the curves",
    ),
]
SOLVERS = [
    ("fast", "Fast", "Quasi-Newton minimisation"),
    ("descent", "Steepest Descent", "The paper's minimisation, slower, to compare with"),
]


class TACTILE_OT_reconstruct(bpy.types.Operator):
    """Feel the surface along curves through a point and rebuild the patch around it"""

    bl_idname = "tactile.reconstruct"
    bl_label = "Fit Tactile Patch"
    bl_options = {"REGISTER", "UNDO"}

    target: StringProperty(
        name="Target", description="Name of the mesh object to touch; empty for the active object"
    )
    location: FloatVectorProperty(
        name="Location",
        subtype="TRANSLATION",
        description="Where to touch; the 3D cursor where it is not set",
    )
    normal: FloatVectorProperty(
        name="Normal",
        subtype="XYZ",
        description="The outward direction there; the surface's own where it is not set",
    )
    plane_count: IntProperty(
        name="Planes", description="How many sampling planes to feel along", default=3, min=3, max=6
    )
    azimuths: FloatVectorProperty(
        name="Azimuths",
        description="Directions of the planes about the normal",
        size=6,
        unit="ROTATION",
        default=[math.radians(a) for a in (0, 60, 120, 30, 90, 150)],
    )
    tilts: FloatVectorProperty(
        name="Tilts", description="How far the planes lean from upright", size=6, unit="ROTATION"
    )
    extent: FloatProperty(
        name="Extent",
        description="How far to feel to either side of the point; 0 for an eighth of the object's size",
        subtype="DISTANCE",
        soft_min=0.0,
    )
    step: FloatProperty(
        name="Step",
        description="Distance between contacts; 0 for a twelfth of the extent",
        subtype="DISTANCE",
        soft_min=0.0,
    )
    noise: FloatProperty(
        name="Noise",
        description="Standard deviation of the simulated sensor",
        subtype="DISTANCE",
        soft_min=0.0,
        precision=4,
    )
    seed: IntProperty(name="Seed", description="Of the noise: the same seed gives the same contacts", min=0)
    method: EnumProperty(name="Method", description="How to fit the patch", items=METHODS)
    degree: IntProperty(
        name="Degree",
        description="Of the polynomial that describes the patch, 2 to 6; 0 for the least that says what "
        "the contacts show",
        default=4,
        min=0,
        max=6,
    )
    weight: FloatProperty(
        name="Weight",
        description="Of the contacts against the smoothness, in the two fits by curvature",
        default=1000.0,
        soft_min=1.0,
        soft_max=1e5,
    )
    solver: EnumProperty(name="Solver", description="How to minimise the curvature", items=SOLVERS)

    @classmethod
    def poll(cls, context):
        return context.scene is not None

    def execute(self, context):
        try:
            obj = _target(context, self.target)
            surface, result, contours, report = self._touch(context, obj)
        except ValueError as error:
            sentence = str(error)
            self.report({"ERROR"}, sentence[0].upper() + sentence[1:])
            return {"CANCELLED"}

        def deviation(points, normals):
            return surface.deviations(points, normals, result.radius)

        patch = patch_object.insert(context.scene, result, contours, report, deviation)
        _make_active(context, patch)
        summary = (
            f"{report['message']} Curvatures {result.patch.k1:.4g} and {result.patch.k2:.4g}, "
            f"{report['contacts']} contacts missed by {result.fit_error:.3g} in the mean"
        )
        self.report({"INFO"} if result.status == "ok" else {"WARNING"}, summary)
        return {"FINISHED"}

    def draw(self, context):
        layout = self.layout
        layout.use_property_split = True
        layout.prop(self, "target")
        # Where they are not set, the cursor and the surface decide: zeros would say otherwise.
        for name in filter(self.properties.is_property_set, ("location", "normal")):
            layout.prop(self, name)
        for name in ("extent", "step", "plane_count"):
            layout.prop(self, name)
        for i in range(self.plane_count):
            column = layout.column(align=True)
            column.prop(self, "azimuths", index=i, text=f"Azimuth {i + 1}")
            column.prop(self, "tilts", index=i, text="Tilt")
        for name in ("noise", "seed", "method", "degree"):
            layout.prop(self, name)
        if self.method in ("tagc", "quadratic-variation"):
            layout.prop(self, "weight")
        if self.method == "tagc":
            layout.prop(self, "solver")

    def _touch(self, context, obj):
        given = self.properties.is_property_set
        count = self.plane_count
        return touch(
            obj,
            context.evaluated_depsgraph_get(),
            list(self.location) if given("location") else list(context.scene.cursor.location),
            list(self.normal) if given("normal") else None,
            [
                core.SamplingPlane(*pair)
                for pair in zip(self.azimuths[:count], self.tilts[:count], strict=True)
            ],
            extent=self.extent,
            step=self.step,
            noise=self.noise,
            seed=self.seed,
            method=self.method,
            degree=self.degree or "auto",
            weight=self.weight,
            solver=self.solver,
        )


def _target(context, name):
    """The object to touch: by name, or the active one, or what the active patch was touched on."""
    obj = context.view_layer.objects.active
    if not name and obj is not None and patch_object.RECORD in obj:
        name = obj[patch_object.RECORD]["source"]
    if name:
        obj = bpy.data.objects.get(name)
    if obj is None:
        raise ValueError(
            f'There is no object "{name}" in the scene: name one of its mesh objects'
            if name
            else "No object is active: select the mesh object to touch"
        )
    if obj.type != "MESH":
        raise ValueError(f'"{obj.name}" is no mesh: select a mesh object, or convert this one')
    return obj


def _make_active(context, obj):
    """Selects the new object alone; unless that would leave an edit mode, or its collection is excluded."""
    context.view_layer.update()  # after `blender -b FILE -c` it would not know the new object yet
    objects = context.view_layer.objects
    if context.mode != "OBJECT" or obj.name not in objects:
        return
    for selected in list(objects.selected):
        selected.select_set(False)
    obj.select_set(True)
    objects.active = obj


def draw_menu(self, context):
    self.layout.separator()
    self.layout.operator(TACTILE_OT_reconstruct.bl_idname)
