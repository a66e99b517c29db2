# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The operator that puts a patch whose place is unknown onto a mesh, and the search behind it."""

import threading
from collections.abc import Iterator
from time import perf_counter
from typing import Any

import bpy
from bpy.props import IntProperty, StringProperty
from mathutils import Matrix

from ... import core
from ...core.arguments import many
from ..probes import probe
from ..probes.in_slices import InSlices, Progress
from ..probes.operators import has_patch, is_in_object_mode, is_unlocked, report_done, target_object
from ..scene import patch_record
from ..touch.detached_mesh import DetachedMesh
from ..touch.types import Object, Outcome
from ..touch.wording import registration_summary
from .verify_operator import chosen_mesh

POSES = 5
HURRY = 0.02  # The seconds after which it is checked again whether the search is done.


class Search:
    """The search for the place of a patch on a mesh object, in another thread, which does not use Blender.

    poses : a list, once `wait` says that it is done; raises ValueError, with a sentence, if there are none
    """

    def __init__(self, patch: Object, target: Object, depsgraph: bpy.types.Depsgraph) -> None:
        if probe.probe_of(patch) is not None:
            raise ValueError(f'The place of "{patch.name}" is that of its probe, so it is known already')
        mesh = DetachedMesh(target, depsgraph)
        given = patch_record.reconstruction_of(patch), mesh.points + mesh.origin, mesh.triangles
        self.patch, self.target, self._matrix = patch.name, target.name, patch.matrix_world.copy()
        self._found: list[core.Pose] | None = None
        self._error: ValueError | None = None
        self._begun = perf_counter()
        self._thread = threading.Thread(target=self._run, args=given, daemon=True)
        self._thread.start()

    def _run(self, *given: Any) -> None:
        try:
            self._found = core.register(*given, best=POSES)
        except MemoryError:
            self._error = ValueError(
                f'"{self.target}" is too large to be searched: remove what is far from the patch'
            )
        except ValueError as error:
            self._error = error

    def wait(self, seconds: float | None = None) -> bool:
        """Waits for some seconds, or to the end, and returns whether the search is done."""
        self._thread.join(seconds)
        return not self._thread.is_alive()

    def steps(self) -> Iterator[None]:
        """Waits to the end, as a generator between whose steps a window may draw."""
        while not self.wait(HURRY):
            yield

    @property
    def seconds(self) -> float:
        """How long the search has taken so far."""
        return perf_counter() - self._begun

    @property
    def poses(self) -> list[core.Pose]:
        """The core.Poses that were found. Raises the error with which the search has ended."""
        if self._error is not None:
            raise self._error
        return self._found

    def put(self, pose: int) -> dict[str, Any]:
        """Moves the patch to one of the poses, and returns its `registration`, a dict."""
        if pose > len(self.poses):
            poses = many(len(self.poses), "pose", "poses")
            raise ValueError(f'The search has found {poses} on "{self.target}": choose a lower number')
        patch: Object = bpy.data.objects.get(self.patch)
        if patch is None:
            raise ValueError(f'"{self.patch}" was deleted while its place was searched for')
        motion = patch_record.matrix_of(self.poses[pose - 1].rotation, self.poses[pose - 1].translation)
        patch.matrix_world = Matrix(motion.tolist()) @ self._matrix
        patch[patch_record.RECORD]["registration"] = {
            "target": self.target,
            "pose": pose,
            "residuals": [found.residual for found in self.poses],
            "vertices": [found.vertex for found in self.poses],
            "is_ambiguous": self.poses[0].is_ambiguous,
        }
        return patch[patch_record.RECORD]["registration"].to_dict()


def register_patch(
    patch: Object, target: Object, depsgraph: bpy.types.Depsgraph, pose: int = 1
) -> dict[str, Any]:
    """Moves the patch object to where its contacts are nearest to the mesh object `target`.

    pose : 1 for the best place, up to POSES for others

    The patch's record gets what was found as `registration`, which is returned as a dict. Raises ValueError
    with a sentence, and changes nothing, if that cannot be done.
    """
    search = Search(patch, target, depsgraph)
    search.wait()
    return search.put(pose)


class TACTILE_OT_register(InSlices, bpy.types.Operator):
    """Find where on a mesh the active patch belongs, by its contacts alone, and move it there"""

    bl_idname = "tactile.register"
    bl_label = "Register onto Mesh"
    bl_options = {"REGISTER", "UNDO"}

    target: StringProperty(
        name="Target",
        description="Name of the mesh object to put the patch onto; empty for the selected mesh",
    )
    pose: IntProperty(
        name="Pose",
        description="Which of the places that were found: 1 is the best, others may be about as good",
        default=1,
        min=1,
        max=POSES,
    )

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return (
            has_patch(cls, context, "Select a mesh and then the patch to put onto it")
            and is_in_object_mode(cls, context, "Patches are registered")
            and is_unlocked(cls, context)
        )

    def _begin(self, context: bpy.types.Context) -> None:
        patch = probe.patch_near(context.view_layer.objects.active)
        target = target_object(context, self.target or chosen_mesh(context, patch))
        self._search = Search(patch, target, context.evaluated_depsgraph_get())
        self._steps = self._search.steps()

    def _done(self) -> Progress:
        return f'Looking for the patch on "{self._search.target}": {self._search.seconds:.0f} s', None

    def _finish(self, context: bpy.types.Context) -> Outcome:
        found = self._search.put(self.pose)
        return report_done(self, registration_summary(found), not found["is_ambiguous"])

    def draw(self, context: bpy.types.Context) -> None:
        layout = self.layout
        layout.use_property_split = True
        layout.prop_search(self, "target", context.scene, "objects")
        layout.prop(self, "pose")
