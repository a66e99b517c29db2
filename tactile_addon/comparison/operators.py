# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators that compare a patch with a mesh where it is, or put it onto one, and the work behind them."""

import threading
from collections.abc import Iterator, Mapping, Sequence
from concurrent import futures
from time import perf_counter
from typing import Any

import bpy
import numpy as np
from bpy.props import IntProperty, StringProperty
from mathutils import Matrix

from ... import core
from ...core.arguments import many
from ..probes import probe, touch_again
from ..probes.change_handlers import is_pending
from ..probes.in_slices import InSlices, Progress
from ..probes.operators import is_in_object_mode, is_unlocked, polls, report_done, target_object
from ..scene import mesh_data, patch_record, shown
from ..touch import units
from ..touch.detached_mesh import DetachedMesh
from ..touch.surface import MeshSurface
from ..touch.touch_report import TouchReport, judgment
from ..touch.types import Object, Outcome
from ..touch.wording import SPREAD, cell, registration_summary, said

VERTICES_AT_ONCE = 2000  # A step looks at this many vertices,
VERIFYING = 0.8  # which takes this share of the time.
VERTICES = "vertices", "vertex_distance_mean", "vertex_distance_max"  # What the report has of them, too.

POSES = 5  # The most places that a search for a patch gives.
HURRY = 0.02  # The seconds after which it is checked again whether the search is done.
# The results of core.verify, and the largest distance of the patch from the mesh, in the order of a table.
VERIFIED = (
    *("vertices", *(f"vertex_distance_{key}" for key in SPREAD)),
    *("contacts", *(f"contact_distance_{key}" for key in SPREAD), "fit_error"),
    *("extra_contours", "extra_points", "extra_fit_error"),
    *("total_absolute_curvature", "overlap", "patch_distance_max"),
)


class Verification:
    """The comparison of a patch object with a mesh object, in steps; nothing is changed before `write`.

    Raises ValueError, with a sentence, if they cannot be compared.
    """

    def __init__(self, patch: Object, target: Object) -> None:
        probe.require_unlocked(patch)
        self._r = patch_record.reconstruction_of(patch)
        self._patch, self.patch, self.target = patch.session_uid, patch.name, target.name
        self._target, self._given = target.session_uid, _inputs(patch, target)
        self._surface: MeshSurface | None = None

    def look(self, depsgraph: bpy.types.Depsgraph) -> None:
        """Lets the steps go on in the scene as it is now. Raises ValueError if patch or mesh have changed."""
        patch, target = self._objects()
        # When Blender evaluates again, it frees what it has evaluated before.
        self._surface = MeshSurface(target, depsgraph, sound=self._surface is not None)
        if _inputs(patch, target) != self._given:
            raise ValueError(
                f'"{self.patch}" or "{self.target}" was changed while it was verified: start again'
            )

    def ray_cast(self, *ray: Any) -> tuple[Sequence[float], Sequence[float]] | None:
        """Casts a ray at the target, as MeshSurface does."""
        return self._surface.ray_cast(*ray)

    def steps(self) -> Iterator[float]:
        """Does everything, as a generator that yields the share that is done."""
        r, seen = self._r, [np.empty((0, 3))]
        vertices = self._surface.vertices_near(r.frame.origin, 2.0 * r.radius)
        yield 0.0
        for start in range(0, len(vertices), VERTICES_AT_ONCE):
            some = vertices[start : start + VERTICES_AT_ONCE]
            seen.append(some[core.reachable(r.geometry, self, some)])
            yield VERIFYING * start / len(vertices)
        for found in core.verifying(r, self, np.vstack(seen)):
            self._found = found
            yield VERIFYING
        self._taps = core.tapped(r, self)

    def write(self) -> TouchReport:
        """Writes what was found to the patch: its deviations, and `verification` in its record."""
        (patch, _), r, surface = self._objects(), self._r, self._surface
        record = patch[patch_record.RECORD]
        taps, is_own = self._taps, record["source"] == self.target
        # The object's mesh may have another scale than the patch.
        points = r.radius / record["radius"] * mesh_data.values(patch.data, mesh_data.POSITION)
        normals = r.geometry.normal(points[:, 0], points[:, 1]) @ r.frame.axes.T
        deviations = surface.deviations(r.frame.to_world(points), normals, r.radius)
        mesh_data.own_mesh(patch)
        mesh_data.write(patch.data, mesh_data.DEVIATION, deviations)
        shown.recolor(patch)
        farthest = float(np.abs(deviations).max())
        record["verification"] = {"target": self.target, **self._found, "patch_distance_max": farthest}
        if is_own:  # A touch compares with fewer of its vertices.
            record.update({key: value for key, value in self._found.items() if key in VERTICES})
        if taps.height is not None:
            record["height_error"] = taps.height
        if record["status"] != "outdated":
            # Another mesh, as a scan, may show only a part of the object.
            seen = taps if is_own else taps._replace(missed=0, missing=0.0)
            record.update(judgment(r.judged_with(taps=seen), record["ended"]))
        return record.to_dict()

    def _objects(self) -> tuple[Object, Object]:
        """The patch and the target. Raises ValueError if they are no longer there."""
        found = {obj.session_uid: obj for obj in bpy.data.objects}
        if self._patch not in found or self._target not in found:
            raise ValueError(f'"{self.patch}" or "{self.target}" was deleted while it was verified')
        return found[self._patch], found[self._target]


def verify_patch(patch: Object, target: Object, depsgraph: bpy.types.Depsgraph) -> None:
    """Compares the patch object with the mesh object `target`; its record gets the result as `verification`.

    Raises ValueError with a sentence, and changes nothing, if that cannot be done.
    """
    verification = Verification(patch, target)
    verification.look(depsgraph)
    for _ in verification.steps():
        pass
    verification.write()


def _inputs(patch: Object, target: Object) -> tuple[Any, ...]:
    """The properties of patch and target that must not change meanwhile."""
    return patch[patch_record.RECONSTRUCTION], *(
        tuple(map(tuple, obj.matrix_world)) for obj in (patch, target)
    )


def verification_summary(record: TouchReport) -> tuple[bool, str]:
    """Whether a verification gives reason to doubt, and a sentence on what it has found."""
    found = record["verification"]
    name, vertices, percent = found["target"], found["vertices"], 100.0 * found["overlap"]
    if not (vertices or percent or found["extra_points"]):
        return True, f'Nothing of "{name}" is below the patch: move one to the other, or choose another mesh'
    if record["status"] != "ok":
        return True, record["message"]
    where, mean = f"At {many(vertices, 'vertex', 'vertices')}, ", _length(record, "vertex_distance_mean")
    if not vertices:  # A coarse mesh may have only faces there.
        where, mean = "", dict(main_rows(record))["Deviation"]
    most = _length(
        record, max("vertex_distance_max", "patch_distance_max", key=lambda key: found.get(key, 0.0))
    )
    return False, (
        f'{where}"{name}" is {mean} off the patch on average, and '
        f"either is {most} off the other at most; the mesh covers {percent:.0f} % of the patch"
    )


def verification_columns(report: Mapping[str, Any]) -> list[tuple[str, Any]]:
    """(heading, value) of the columns in a patch's row; a value that is not known is empty."""
    found = report["verification"]
    lengths = [key for key in VERIFIED if "distance" in key or "error" in key]
    return [
        *((key, cell(report[key])) for key in ("patch", "source", "status")),
        ("target", cell(found["target"])),
        *((f"{key} [unit of the file]" if key in lengths else key, found.get(key, "")) for key in VERIFIED),
    ]


def verification_table(record: Mapping[str, Any]) -> list[tuple[str, str]]:
    """(label, values for the mesh and for the contacts) of each row; lengths are without unit."""
    found, symbol = record["verification"], units.symbol(1, units.unit_of_report(record))
    rows = [(f"in {symbol}" if symbol else "Distance", "Mesh | Contacts")]
    for name, key in zip(("Mean", "Median", "Maximum", "RMS"), SPREAD, strict=True):
        lengths = (_length(record, f"{what}_distance_{key}") for what in ("vertex", "contact"))
        rows.append((name, " | ".join(length.removesuffix(f" {symbol}") for length in lengths)))
    return [*rows, ("Points", f"{found['vertices']} | {found['contacts']}")]


def main_rows(record: Mapping[str, Any]) -> list[tuple[str, str]]:
    """(label, value) of what the sidebar shows of a verification at first."""
    return [
        ("Deviation", said(record, "height_error", 1) if "height_error" in record else "–"),
        ("Largest Deviation", _length(record, "patch_distance_max")),
        ("Overlap", f"{100.0 * record['verification']['overlap']:.0f} %"),
    ]


def other_rows(record: Mapping[str, Any]) -> list[tuple[str, str]]:
    """(label, value) of everything else that it has found."""
    found = record["verification"]
    return [
        ("Fit Error", _length(record, "fit_error")),
        (f"Error on {found['extra_contours']} More Curves", _length(record, "extra_fit_error")),
        ("Total Curvature", f"{found['total_absolute_curvature']:.3g}"),
    ]


def _length(record: Mapping[str, Any], key: str) -> str:
    """A length in words, or a dash if the verification has not found it."""
    found = record["verification"]
    return units.say_of(record, units.rounded(found[key], 1, record["radius"])) if key in found else "–"


class WithMesh(InSlices):
    """For operators to inherit that compare the active patch with a mesh, or put it onto one."""

    target: StringProperty(
        name="Target",
        description="Name of the mesh object; empty for the other selected mesh, or for the one that was "
        "touched",
    )
    shown: tuple[str, ...] = ("target",)
    hint: str  # What to select.

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return (
            polls(cls, probe.patch_near(context.view_layer.objects.active), cls.hint)
            and is_in_object_mode(cls, context, "Patches are compared")
            and is_unlocked(cls, context)
        )

    def _mesh(self, context: bpy.types.Context, patch: Object) -> Object:
        """The mesh object with the name, that is selected, that the patch is for, or that was touched.

        Raises ValueError if there is none, or if several meshes are selected.
        """
        if self.target:
            return target_object(context, self.target)
        names = [
            obj.name
            for obj in context.view_layer.objects.selected
            if obj.type == "MESH" and not probe.is_result(obj)
        ]
        if len(names) > 1:
            raise ValueError(
                f"{len(names)} meshes are selected: select one besides the patch, or none to compare "
                "with the one that was touched"
            )
        name = names[0] if names else patch.tactile_target
        source = probe.record_of(patch)
        if not name and source is not None and source["source"] not in bpy.data.objects:
            raise ValueError(
                f'"{patch.name}" was not touched on a mesh of this file: select the mesh, then the patch'
            )
        return target_object(context, name)


class TACTILE_OT_verify(WithMesh, bpy.types.Operator):
    """Measure how far the active patch is from the mesh it was touched on, or from another selected mesh"""

    bl_idname = "tactile.verify"
    bl_label = "Verify Against Mesh"
    bl_options = {"REGISTER", "UNDO"}

    hint = "Select a patch; to compare it with another mesh, select that first"

    def _begin(self, context: bpy.types.Context) -> None:
        obj = context.view_layer.objects.active
        found, patch = probe.probe_of(obj), probe.patch_near(obj)
        if found is not None and is_pending(found):  # Completing it later would undo the verification.
            touch_again.refresh(found, context)
        self._verification = Verification(patch, self._mesh(context, patch))
        self._steps = self._verification.steps()

    def _check(self, context: bpy.types.Context) -> None:
        self._verification.look(context.evaluated_depsgraph_get())

    def _done(self) -> Progress:
        return f'Comparing with "{self._verification.target}"', self._share

    def _finish(self, context: bpy.types.Context) -> Outcome:
        record = self._verification.write()
        probe.patch_near(context.view_layer.objects.active).tactile_colors = "deviation"
        doubt, summary = verification_summary(record)
        return report_done(self, summary, not doubt)


class Search:
    """The search for the place of a patch on a mesh object, in another thread, which does not use Blender."""

    def __init__(self, patch: Object, target: Object, depsgraph: bpy.types.Depsgraph) -> None:
        if probe.probe_of(patch) is not None:
            raise ValueError(f'The place of "{patch.name}" is that of its probe, so it is known already')
        mesh = DetachedMesh(target, depsgraph)
        given = patch_record.reconstruction_of(patch), mesh.points + mesh.origin, mesh.triangles
        self.patch, self.target, self._matrix = patch.name, target.name, patch.matrix_world.copy()
        self._found: futures.Future[list[core.Pose]] = futures.Future()
        threading.Thread(target=self._run, args=given, daemon=True).start()

    def _run(self, *given: Any) -> None:
        try:
            self._found.set_result(core.register(*given, best=POSES))
        except MemoryError:
            self._found.set_exception(
                ValueError(f'"{self.target}" is too large to be searched: remove what is far from the patch')
            )
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
            raise ValueError(
                f'The search has found {many(len(poses), "pose", "poses")} on "{self.target}": choose a '
                "lower number"
            )
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
        seconds = perf_counter() - self._begun
        return f'Looking for the patch on "{self._search.target}": {seconds:.0f} s', None

    def _finish(self, context: bpy.types.Context) -> Outcome:
        record = self._search.put(self.pose)
        return report_done(self, registration_summary(record), not record["registration"]["is_ambiguous"])
