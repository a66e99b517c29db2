# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A patch whose place is unknown, put onto a mesh: the operator, and what it does."""

import bpy
import numpy as np
from bpy.props import IntProperty, StringProperty
from mathutils import Matrix

from ... import core
from ..probes import probe
from ..probes.operators import is_unlocked, report_error, target_object
from ..scene import patch_object
from ..touch.surface import MeshSurface
from ..touch.wording import registration_summary
from .verify_operator import selected_mesh

POSES = 5


def register_patch(patch, target, depsgraph, pose=1):
    """Moves the patch object to where its contacts are nearest to the mesh object `target`.

    pose : 1 for the best place, up to POSES for others

    Its record has what was found as `registration`, which is returned as a dict. Raises ValueError, with
    a sentence and nothing changed, where that cannot be done.
    """
    if probe.probe_of(patch) is not None:
        raise ValueError(f'The place of "{patch.name}" is that of its probe: it is known already')
    vertices, faces = MeshSurface(target, depsgraph).triangles()
    poses = core.register(patch_object.reconstruction_of(patch), vertices, faces, best=POSES)
    if pose > len(poses):
        raise ValueError(f'There are {len(poses)} poses on "{target.name}": take one of them')
    chosen, matrix = poses[pose - 1], np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = chosen.rotation, chosen.translation
    patch.matrix_world = Matrix(matrix.tolist()) @ patch.matrix_world
    patch[patch_object.RECORD]["registration"] = {
        "target": target.name,
        "pose": pose,
        "residuals": [found.residual for found in poses],
        "vertices": [found.vertex for found in poses],
        "is_ambiguous": poses[0].is_ambiguous,
    }
    return patch[patch_object.RECORD]["registration"].to_dict()


class TACTILE_OT_register(bpy.types.Operator):
    """Find where on a mesh the active patch belongs, by its contacts alone, and move it there"""

    bl_idname = "tactile.register"
    bl_label = "Register onto Mesh"
    bl_options = {"REGISTER", "UNDO"}

    target: StringProperty(
        name="Target", description="Name of the mesh object to put it onto; empty for the selected mesh"
    )
    pose: IntProperty(
        name="Pose",
        description="1 is the best place; others may be about as good",
        default=1,
        min=1,
        max=POSES,
    )

    @classmethod
    def poll(cls, context):
        if probe.patch_near(context.view_layer.objects.active) is None:
            cls.poll_message_set("Select a mesh and then the patch to put onto it")
            return False
        if context.mode != "OBJECT":
            cls.poll_message_set("Leave this mode: patches are registered in Object Mode")
            return False
        return is_unlocked(cls, context)

    def execute(self, context):
        patch = probe.patch_near(context.view_layer.objects.active)
        try:
            target = target_object(context, self.target or selected_mesh(context))
            found = register_patch(patch, target, context.evaluated_depsgraph_get(), self.pose)
        except ValueError as error:
            return report_error(self, error)
        self.report({"WARNING"} if found["is_ambiguous"] else {"INFO"}, registration_summary(found))
        return {"FINISHED"}

    def draw(self, context):
        layout = self.layout
        layout.use_property_split = True
        layout.prop_search(self, "target", context.scene, "objects")
        layout.prop(self, "pose")
