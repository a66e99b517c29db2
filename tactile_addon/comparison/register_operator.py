# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The operator that puts a patch whose place is unknown onto a mesh, and the search behind it."""

import threading
from collections.abc import Iterator
from concurrent import futures
from time import perf_counter
from typing import Any

import bpy
from bpy.props import IntProperty
from mathutils import Matrix

from ... import core
from ...core.arguments import many
from ..probes import probe
from ..probes.in_slices import Progress
from ..probes.operators import report_done
from ..scene import patch_record
from ..touch.detached_mesh import DetachedMesh
from ..touch.types import Object, Outcome
from ..touch.wording import registration_summary
from .verify_operator import WithMesh

POSES = 5
HURRY = 0.02  # The seconds after which it is checked again whether the search is done.


class Search:
    """The search for the place of a patch on a mesh object, in another thread, which does not use Blender.

    began : when it began, in seconds
    """

    def __init__(self, patch: Object, target: Object, depsgraph: bpy.types.Depsgraph) -> None:
        if probe.probe_of(patch) is not None:
            raise ValueError(f'The place of "{patch.name}" is that of its probe, so it is known already')
        mesh = DetachedMesh(target, depsgraph)
        given = patch_record.reconstruction_of(patch), mesh.points + mesh.origin, mesh.triangles
        self.patch, self.target, self._matrix = patch.name, target.name, patch.matrix_world.copy()
        self._found: futures.Future[list[core.Pose]] = futures.Future()
        self.began = perf_counter()
        threading.Thread(target=self._run, args=given, daemon=True).start()

    def _run(self, *given: Any) -> None:
        try:
            self._found.set_result(core.register(*given, best=POSES))
        except MemoryError:
            words = f'"{self.target}" is too large to be searched: remove what is far from the patch'
            self._found.set_exception(ValueError(words))
        except Exception as error:
            self._found.set_exception(error)

    def steps(self) -> Iterator[None]:
        """Waits to the end, as a generator between whose steps a window may draw."""
        while not futures.wait([self._found], HURRY).done:
            yield

    def put(self, pose: int = 1) -> dict[str, Any]:
        """Moves the patch to one of the poses, from 1 on, and returns its record with `registration`.

        It waits for the search. Raises ValueError, with a sentence, if that has not found the pose.
        """
        poses = self._found.result()
        if pose > len(poses):
            count = many(len(poses), "pose", "poses")
            raise ValueError(f'The search has found {count} on "{self.target}": choose a lower number')
        patch: Object = bpy.data.objects.get(self.patch)
        if patch is None:
            raise ValueError(f'"{self.patch}" was deleted while its place was searched for')
        motion = patch_record.matrix_of(poses[pose - 1].rotation, poses[pose - 1].translation)
        patch.matrix_world = Matrix(motion.tolist()) @ self._matrix
        patch[patch_record.RECORD]["registration"] = {
            "target": self.target,
            "pose": pose,
            "residuals": [found.residual for found in poses],
            "vertices": [found.vertex for found in poses],
            "is_ambiguous": poses[0].is_ambiguous,
        }
        return patch[patch_record.RECORD].to_dict()


class TACTILE_OT_register(WithMesh, bpy.types.Operator):
    """Find where on a mesh the active patch belongs, by its contacts alone, and move it there"""

    bl_idname = "tactile.register"
    bl_label = "Register onto Mesh"
    bl_options = {"REGISTER", "UNDO"}

    pose: IntProperty(
        name="Pose",
        description="Which of the places that were found: 1 is the best, others may be about as good",
        default=1,
        min=1,
        max=POSES,
    )

    shown = ("target", "pose")
    hint = "Select a mesh and then the patch to put onto it"

    def _begin(self, context: bpy.types.Context) -> None:
        patch = probe.patch_near(context.view_layer.objects.active)
        self._search = Search(patch, self._mesh(context, patch), context.evaluated_depsgraph_get())
        self._steps = self._search.steps()

    def _done(self) -> Progress:
        seconds = perf_counter() - self._search.began
        return f'Looking for the patch on "{self._search.target}": {seconds:.0f} s', None

    def _finish(self, context: bpy.types.Context) -> Outcome:
        record = self._search.put(self.pose)
        return report_done(self, registration_summary(record), not record["registration"]["is_ambiguous"])
