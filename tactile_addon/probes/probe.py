# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The probe: an Empty at a reference point that says how to touch there, and keeps a patch up to date.

The patch is a child of its probe. So a copy of a probe has none and makes its own, and if a probe is
deleted, its patch stays as an ordinary object. Each probe keeps the digest of the inputs it was last
touched with, and so do the datablocks made from them. Undo restores each datablock by itself, so digests
may differ afterward.

    probe, target or frame changes           undo, redo: undo.take_out before, undo.put_back after
                  |                                 |
                  |                                 v
                  |                   on_other_data: any probe may be outdated
                  v                                 |
    change_handlers._look_at  <---------------------+
                  |
    touch_again.is_outdated: do the inputs have the digest that the probe, its patch and their meshes keep?
                  |
                  +-- they do ----------> stand_by: the patch goes where its target goes
                  |
                  +-- not, not live ----> stand_by: the patch is marked "outdated", until Touch Again
                  |
                  +-- not, live --------> update: touch, rewrite the patch, give all of them the digest
                                            |
                                            v
                     without a window it is complete; in a window `_settle` completes it after the gesture,
                     and touches then if there was no time before
"""

from functools import cache
from typing import Any

import bpy
from bpy.props import (
    BoolProperty,
    EnumProperty,
    FloatVectorProperty,
    IntProperty,
    PointerProperty,
    StringProperty,
)

from ..scene import patch_object, patch_record, shown
from ..scene.family import children_of
from ..touch.settings import KEPT, OVERRIDABLE, FitSettings, TouchSettings, changed, silent
from ..touch.touch_report import TouchReport
from ..touch.types import Object
from . import anchor

DIGEST = "tactile_digest"


def _used(name: str) -> Any:
    """A property that is the setting `name` or, if that is left to the surface, what the last touch chose."""
    like = (TouchSettings.__annotations__ | FitSettings.__annotations__)[name]
    # The override of a library's probe would keep a number that was chosen as one that was given.
    return like.function(
        **{key: value for key, value in like.keywords.items() if key not in KEPT},
        options=set(),
        get=lambda settings: getattr(settings, name) or (record_of(settings.id_data) or {}).get(name, 0),
        set=lambda settings, value: setattr(settings, name, value),
    )


class TactileProbe(TouchSettings, bpy.types.PropertyGroup):
    """`Object.tactile_probe`; scripts set its properties as the panel does."""

    is_probe: BoolProperty(
        name="Is a Probe",
        description="Whether this Empty touches its target",
        options={"HIDDEN"},
        update=lambda settings, context: _appointed(settings, context),
        override=OVERRIDABLE,
    )
    target: PointerProperty(
        name="Target",
        description="The mesh object to touch",
        type=bpy.types.Object,
        poll=lambda _, obj: obj.type == "MESH" and not is_result(obj),
        update=lambda settings, context: _chosen(settings, context),
        override=OVERRIDABLE,
    )
    live: BoolProperty(
        name="Live",
        description="Touch again whenever the probe, its target or a number changes. When off, the "
        "patch stays as it is until you press Touch Again beside this",
        default=True,
        update=changed,
        override=OVERRIDABLE,
    )
    show_handles: BoolProperty(
        name="Handles",
        description="Show the handles of the point, the sampling planes and the extent",
        default=True,
        override=OVERRIDABLE,
    )
    used_extent: _used("extent")
    used_step: _used("step")
    used_degree: _used("degree")
    active_plane: IntProperty(
        name="Active Plane",
        description="The plane that has a handle to tilt it",
        min=0,
        options={"HIDDEN"},
        override=OVERRIDABLE,
    )
    message: StringProperty(description="Why there is no patch; empty where there is one", options={"HIDDEN"})
    digest: StringProperty(options={"HIDDEN"})
    shape: StringProperty(options={"HIDDEN"})
    seat: FloatVectorProperty(size=anchor.SEAT, options={"HIDDEN"})
    lost: StringProperty(description="Data of a target that was deleted", options={"HIDDEN"})


@cache
def targets() -> set[int]:
    """The session_uids of the targets of all probes in this file; 0 for a probe without target.

    Its cache is cleared when probes may have come or gone or changed their targets.
    """
    probes: list[Object] = [obj for obj in bpy.data.objects if is_probe(obj)]
    of = (probe.tactile_probe.target for probe in probes)
    return {0 if target is None else target.session_uid for target in of}


def _appointed(settings: TactileProbe, context: bpy.types.Context) -> None:
    targets.cache_clear()
    changed(settings, context)


def _chosen(settings: TactileProbe, context: bpy.types.Context) -> None:
    """Makes a probe that was a child of its target a child of the new target."""
    if silent.is_on:  # It is the same target, which has come back or is an override now.
        targets.cache_clear()
        return
    settings.lost, probe, record = "", settings.id_data, record_of(settings.id_data)
    before = None if record is None else bpy.data.objects.get(record["source"])
    if settings.target not in (None, before) and before is not None and probe.parent == before:
        anchor.attach(probe, settings.target)
    settings.digest = ""  # Nothing was felt of the new target yet.
    patch = patch_of(probe)
    if patch is not None and patch.is_editable and settings.target != before:
        patch.pop(anchor.BASE, None)  # The new target does not carry it.
    _appointed(settings, context)


def is_probe(obj: Object) -> bool:
    """Whether an object (or None) is an Empty that keeps a patch up to date."""
    return obj is not None and obj.type == "EMPTY" and obj.tactile_probe.is_probe


def is_result(obj: Object) -> bool:
    """Whether an object is a patch, a stability map or a whole object."""
    return patch_record.RECORD in obj or patch_record.touched_record(obj) is not None


def patch_of(probe: Object) -> Object | None:
    """The patch of a probe, or None."""
    return next((child for child in children_of(probe) if _is_patch(child)), None)


def _is_patch(obj: Object) -> bool:
    """Whether an object is a patch that nobody has converted to something else than a mesh."""
    return patch_record.RECORD in obj and obj.type == "MESH"


def patch_near(obj: Object) -> Object | None:
    """The patch that `obj` is, or keeps as a probe; or None."""
    if is_probe(obj):
        return patch_of(obj)
    return obj if obj is not None and _is_patch(obj) else None


def probe_of(obj: Object) -> Object | None:
    """The probe that `obj` is, or is the patch of; or None."""
    if is_probe(obj):
        return obj
    patch = patch_near(obj)
    return patch.parent if patch is not None and is_probe(patch.parent) else None


def record_of(obj: Object) -> TouchReport | None:
    """The report, an ID property, of the patch near `obj`, or None."""
    patch = patch_near(obj)
    return None if patch is None else patch_record.report_of(patch)


def lock_of(obj: Object) -> str | None:
    """A sentence on why the probe or patch near `obj` cannot be changed, or None if it can."""
    for each in filter(None, (probe_of(obj), patch_near(obj))):
        if not each.is_editable:
            return f'"{each.name}" comes from a library: make it local, or override it, to change it'
        if each.type == "MESH" and each.data.is_editmode:
            return f'"{each.name}" is being edited: leave its Edit Mode first'
    return None


def require_unlocked(obj: Object) -> None:
    """Raises ValueError if the probe or patch near `obj` cannot be changed."""
    if lock := lock_of(obj):
        raise ValueError(lock)


def make(context: bpy.types.Context, target: Object) -> Object:
    """A new probe, which touches nothing until `is_probe` is set."""
    probe: Object = bpy.data.objects.new(f"{target.name} Probe", None)
    probe.empty_display_type = "SINGLE_ARROW"
    patch_object.collection(context.scene).objects.link(probe)
    probe.tactile_probe.target = target
    return probe


# Properties of objects, by name.
PROPERTIES = {
    "tactile_probe": PointerProperty(type=TactileProbe, override=OVERRIDABLE),
    "tactile_colors": EnumProperty(
        name="Colors",
        description="What the colors of the patch show",
        items=[item[:3] for item in patch_record.QUANTITIES],
        override=OVERRIDABLE,
        update=lambda obj, _: shown.set_range(obj, 0.0),  # That of the quantity before says nothing of this.
    ),
    "tactile_contours": BoolProperty(
        name="Contours",
        description="Show the curves that the finger followed, in the colors of their planes",
        default=True,
        override=OVERRIDABLE,
    ),
    "tactile_directions": BoolProperty(
        name="Directions",
        description="Show the principal directions, along which the surface bends by κ1 and κ2; where these "
        "are equal, there are none",
        override=OVERRIDABLE,
    ),
    "tactile_target": StringProperty(  # A pointer would keep a deleted mesh.
        name="Target",
        description="Name of the mesh object to put the patch onto, or to compare it with",
        override=OVERRIDABLE,
    ),
}
