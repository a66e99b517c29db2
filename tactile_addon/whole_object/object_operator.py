# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Touch All Over: touches that grow over an object by themselves; in slices if there is a window."""

from collections.abc import Iterator

import bpy
from bpy.props import EnumProperty, FloatVectorProperty, IntProperty

from ..probes import probe
from ..probes.in_slices import AllOver, InSlices, Progress
from ..probes.operators import make_active, report_done, target_object
from ..probes.probe_operators import TACTILE_OT_add_subdivision
from ..scene import patch_record
from ..touch.settings import NOISE, UNSAVED, given, length_property
from ..touch.types import Object, Outcome
from . import whole_mesh
from .expected import Expected
from .object_report import object_summary
from .object_touches import ObjectTouches

EDGE = length_property(
    "Edge Length",
    "Length of the edges of the surface's triangles, at most about a quarter of the thinnest wall; 0 "
    "chooses it by the curvature",
)
ACCURACIES = [
    ("quick", "Quick", "A tolerance of 1/200 of the object's size: few touches, details are lost"),
    ("normal", "Normal", "A tolerance of 1/500 of the object's size"),
    ("fine", "Fine", "A tolerance of 1/1250 of the object's size: many touches"),
]

# The ObjectTouches of the last surface by the session_uid of its object; one at most.
_kept: dict[int, ObjectTouches] = {}


def keep(obj: Object, touches: ObjectTouches) -> None:
    """Keeps the touches that made an object, so that its mesh can be made again without new touches."""
    forget()
    _kept[obj.session_uid] = touches


def touches_of(obj: Object | None) -> ObjectTouches | None:
    """The ObjectTouches that made an object, or None if they are no longer there."""
    return None if obj is None else _kept.get(obj.session_uid)


def forget() -> None:
    """Forgets the touches that are kept."""
    _kept.clear()


class Growing(InSlices):
    """For operators that touch an object all over, with `_touches`: patches appear, and Esc keeps them."""

    stop = "Stop Touching and Keep"
    stopped = "Stopped: no surface was kept"
    _touches: ObjectTouches
    _growing: whole_mesh.GrowingPatches | None = None
    _is_ending = False  # Esc was pressed once.

    def _go_on(self, context: bpy.types.Context) -> Outcome:
        self._growing = whole_mesh.GrowingPatches(context.scene, self._touches.surface)
        return super()._go_on(context)

    def _shown(self) -> Iterator[None]:
        """The steps of the touches. In a window, patches appear between them."""
        shown = 0
        for _ in self._touches.steps():
            if self._growing is not None:
                self._growing.add(self._touches.found[shown:], self._touches.rims[shown:])
            shown = len(self._touches.found)
            yield

    def _done(self) -> Progress:
        share = self._touches.share
        return f"{self._touches.words}: {share:.0%}", share

    def _check(self, context: bpy.types.Context) -> None:
        self._touches.surface.require_source(context)

    def _stopped(self, context: bpy.types.Context) -> Outcome:
        """Has the patches so far joined. If Esc is pressed again, nothing is kept."""
        if self._is_ending or not self._touches.found:
            return super()._stopped(context)
        self._is_ending, self.stop = True, "Discard the Surface"
        if not self._touches.is_stopped:  # It may be meshing already.
            self._touches.stop()
        return {"RUNNING_MODAL"}

    def _leave(self, context: bpy.types.Context) -> None:
        super()._leave(context)
        if self._growing is not None:
            self._growing.remove()
            self._growing = None


class TACTILE_OT_touch_all_over(Growing, AllOver, bpy.types.Operator):
    """Touch an object all over, from one point on, and join the patches to one surface"""

    bl_idname = "tactile.touch_all_over"
    bl_label = "Touch All Over"
    bl_options = {"UNDO", "PRESET"}

    location: FloatVectorProperty(
        name="Location",
        subtype="TRANSLATION",
        description="Where to begin; if not set, the probe's point or any place that works",
        options=UNSAVED,
    )
    tolerance: length_property(
        "Tolerance",
        "Standard deviation to reach for the height of each patch; 0 leaves it to the accuracy",
    )
    accuracy: EnumProperty(
        name="Accuracy",
        description="The tolerance as a share of the object's size, unless it is given",
        items=ACCURACIES,
        default="normal",
    )
    noise: NOISE
    seed: IntProperty(
        name="Seed", description="Seed of the noise and of the place to begin", default=0, min=0
    )
    most: IntProperty(
        name="Most Touches",
        description="Number of touches after which to stop",
        default=1000,
        min=1,
        soft_max=10_000,
    )
    edge: EDGE

    shown = ("target", "accuracy", "tolerance", "edge", "most", "noise", "seed")
    _expected = None

    def _begin(self, context: bpy.types.Context) -> None:
        target, found = target_object(context, self.target), probe.probe_of(context.view_layer.objects.active)
        location = given(self, "location")
        if location is None and found is not None and found.tactile_probe.target == target:
            location = list(found.matrix_world.translation)
        self._touches = ObjectTouches(
            target,
            context.evaluated_depsgraph_get(),
            location=location,
            **{
                name: getattr(self, name)
                for name in ("tolerance", "accuracy", "noise", "seed", "most", "edge")
            },
        )
        self._steps = self._shown()

    def _finish(self, context: bpy.types.Context) -> Outcome:
        target = self._touches.surface.require_same(context)
        made = whole_mesh.insert(context.scene, target.name, self._touches.whole, self._touches.report())
        keep(made, self._touches)
        make_active(context, made)
        record = made[patch_record.ATLAS_RECORD].to_dict()
        return report_done(self, object_summary(record), record["status"] == "ok")

    def _about(self, context: bpy.types.Context) -> str:
        """What it will take, in a sentence."""
        if self._expected is None:
            self._expected = Expected()
        target = target_object(context, self.target)
        return self._expected.words(target, context, self.tolerance, self.accuracy, self.noise)

    def draw(self, context: bpy.types.Context) -> None:
        super().draw(context)
        layout = self.layout
        for warning in self._expected.warnings if self._expected else ():
            layout.label(text=warning, icon="ERROR")
        if self._expected is not None and self._expected.is_faceted:
            button = layout.operator(TACTILE_OT_add_subdivision.bl_idname, icon="MOD_SUBSURF")
            button.target = self.target
