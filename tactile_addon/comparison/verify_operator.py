# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A patch, where it is now, against any mesh: the operator, and what it does."""

import bpy
import numpy as np
from bpy.props import StringProperty

from ... import core
from ..probes import probe, touch_again
from ..probes.change_handlers import is_pending
from ..probes.operators import is_unlocked, report_error, target_object
from ..scene import mesh_data, patch_object, patch_record
from ..touch.surface import MeshSurface
from ..touch.touch_object import reachable
from ..touch.touch_report import judgment
from .verification_wording import verification_summary


def verify_patch(patch, target, depsgraph):
    """Compares the patch object with the mesh object `target`; its record has the result as `verification`.

    Raises ValueError, with a sentence and nothing changed, where that cannot be done.
    """
    probe.require_unlocked(patch)
    patch_record.require_whole(patch)
    r, surface = patch_record.reconstruction_of(patch), MeshSurface(target, depsgraph)
    _, vertices = reachable(surface, r)
    found = core.verify(r, surface, vertices)
    record = patch[patch_record.RECORD]
    points, normals = _vertices(patch.data, r, r.radius / record["radius"])
    deviations = surface.deviations(r.frame.to_world(points), normals @ r.frame.axes.T, r.radius)
    mesh_data.own_mesh(patch)
    mesh_data.write(patch.data, "deviation", "FLOAT", deviations)
    patch_object.recolor(patch)
    record["verification"] = {"target": target.name, **found}
    if record["status"] != "outdated":
        mean = found.get("vertex_distance_mean", 0.0)
        record.update(judgment(r, mean, record["ended"], found["vertices"]))


def _vertices(mesh, r, scale):
    """Points and unit normals of the patch's vertices, in its frame, and so many times the mesh's size."""
    points = np.empty((len(mesh.vertices), 3), dtype=np.float32)
    mesh.attributes["position"].data.foreach_get("vector", points.ravel())
    points = scale * points.astype(float)
    return points, r.geometry.normal(points[:, 0], points[:, 1])


class TACTILE_OT_verify(bpy.types.Operator):
    """Measure how far the active patch is from the mesh it was touched on, or from another selected mesh"""

    bl_idname = "tactile.verify"
    bl_label = "Verify Against Mesh"
    bl_options = {"REGISTER", "UNDO"}

    target: StringProperty(
        name="Target",
        description="Name of the mesh object to compare with; empty for the other selected mesh, or for the "
        "one that was touched",
    )

    @classmethod
    def poll(cls, context):
        if probe.patch_near(context.view_layer.objects.active) is None:
            cls.poll_message_set("Select a patch; after the mesh to compare with, if that is another one")
            return False
        if context.mode != "OBJECT":
            cls.poll_message_set("Leave this mode: patches are verified in Object Mode")
            return False
        return is_unlocked(cls, context)

    def execute(self, context):
        obj = context.view_layer.objects.active
        found, patch = probe.probe_of(obj), probe.patch_near(obj)
        if found is not None and is_pending(found):  # Completing it later would undo the verification.
            touch_again.refresh(found, context)
        try:
            target = target_object(context, self.target or chosen_mesh(context, patch))
            verify_patch(patch, target, context.evaluated_depsgraph_get())
        except ValueError as error:
            return report_error(self, error)
        record = patch[patch_record.RECORD].to_dict()
        doubt, summary = verification_summary(record)
        self.report({"WARNING"} if doubt else {"INFO"}, summary)
        return {"FINISHED"}

    def draw(self, context):
        layout = self.layout
        layout.use_property_split = True
        layout.prop_search(self, "target", context.scene, "objects")


def chosen_mesh(context, patch):
    """The name of the one selected mesh, or of the patch's own choice, or of what it was touched on, if any.

    Raises ValueError where there is none.
    """
    selected = context.view_layer.objects.selected
    names = [obj.name for obj in selected if obj.type == "MESH" and not probe.is_result(obj)]
    if len(names) > 1:
        raise ValueError(
            f"{len(names)} meshes are selected: select one besides the patch, or none for the one touched"
        )
    name = names[0] if names else patch.tactile_target
    source = probe.record_of(patch)
    if not name and source is not None and source["source"] not in bpy.data.objects:
        raise ValueError(
            f'"{patch.name}" was touched on no mesh of this file: select the mesh, then the patch'
        )
    return name
