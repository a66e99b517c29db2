# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The probe: an Empty at a reference point that says how to touch there, and keeps a patch up to date.

The patch is a child of its probe, so a copy of a probe has none and makes its own, and where a probe is
deleted its patch stays as an ordinary object. Each probe keeps the digest of the inputs it was last
touched with, and so do the datablocks made from them: undo takes back every datablock by itself, and
where they differ afterwards the handler of live.py touches again.
"""

import hashlib

import bpy
import numpy as np
from bpy.props import (
    BoolProperty,
    EnumProperty,
    FloatVectorProperty,
    IntProperty,
    PointerProperty,
    StringProperty,
)
from mathutils import Matrix, Vector

from ..scene import patch_object
from ..scene.family import children_of
from ..touch.evaluated_mesh import checksum_of, is_disabled
from ..touch.settings import OVERRIDABLE, TouchSettings, changed, touch_arguments
from ..touch.touch_object import touch, verify
from ..touch.wording import sentence
from . import anchor

DIGEST = "tactile_digest"
NO_SHAPE = " 00000000"  # the checksum of a mesh that cannot be touched, as settings.shape ends
VERTICES = 2000  # of the mesh around, compared with the patch at most; a quarter or more lies over it


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
        description="Touch again whenever the probe, its target or a number changes",
        default=True,
        update=changed,
        override=OVERRIDABLE,
    )
    active_plane: IntProperty(
        name="Active Plane",
        description="The one with a handle to tilt it",
        min=0,
        options={"HIDDEN"},
        override=OVERRIDABLE,
    )
    message: StringProperty(description="Why there is no patch; empty where there is one", options={"HIDDEN"})
    digest: StringProperty(options={"HIDDEN"})
    shape: StringProperty(options={"HIDDEN"})
    seat: FloatVectorProperty(size=anchor.SEAT, options={"HIDDEN"})
    lost: StringProperty(
        description="What there was to know of a target that was deleted", options={"HIDDEN"}
    )


_targets = None  # session_uids of what there are probes on, 0 for none; None where it is to be looked up


def targets():
    """Identifiers of what there are probes on in this file: 0 for a probe without target."""
    global _targets
    if _targets is None:
        of = (obj.tactile_probe.target for obj in bpy.data.objects if is_probe(obj))
        _targets = {0 if target is None else target.session_uid for target in of}
    return _targets


def forget_targets():
    """To be called where probes may have come or gone, or changed their targets."""
    global _targets
    _targets = None


def _appointed(settings, context):
    forget_targets()
    changed(settings, context)


def _chosen(settings, context):
    """A probe that was a child of its target is one of the new target."""
    settings.lost, probe, record = "", settings.id_data, record_of(settings.id_data)
    before = None if record is None else bpy.data.objects.get(record["source"])
    if settings.target not in (None, before) and before is not None and probe.parent == before:
        anchor.attach(probe, settings.target)
    _appointed(settings, context)


def is_probe(obj):
    return obj is not None and obj.type == "EMPTY" and obj.tactile_probe.is_probe


def is_result(obj):
    """Whether it is a patch, the contours of one, or a map."""
    return any(key in obj for key in (patch_object.RECORD, patch_object.CONTOURS, patch_object.MAP_RECORD))


def patch_of(probe):
    return next((child for child in children_of(probe) if _is_patch(child)), None)


def _is_patch(obj):
    """Whether it is a patch that nobody has converted to something else than a mesh."""
    return patch_object.RECORD in obj and obj.type == "MESH"


def patch_near(obj):
    """The patch that `obj` is, or has as a probe, or is the contours of, or None."""
    if is_probe(obj):
        return patch_of(obj)
    if obj is not None and patch_object.CONTOURS in obj:
        obj = obj.parent
    return obj if obj is not None and _is_patch(obj) else None


def reconstruction_of(obj):
    """The core.Reconstruction of the patch near `obj`, where it is now. Raises ValueError for none."""
    patch = patch_near(obj)
    if patch is None:
        raise ValueError("Wanted a patch, its probe or its contours, got another object or none")
    return patch_object.reconstruction_of(patch)


def probe_of(obj):
    """The probe that `obj` is, or is the patch or the contours of, or None."""
    if is_probe(obj):
        return obj
    patch = patch_near(obj)
    return patch.parent if patch is not None and is_probe(patch.parent) else None


def record_of(obj):
    """The report, an ID property, of the patch near `obj`, or None."""
    patch = patch_near(obj)
    return None if patch is None else patch_object.report_of(patch)


def require_unlocked(obj):
    """Raises ValueError where what belongs to the probe or patch near `obj` cannot be changed."""
    patch = patch_near(obj)
    lines = None if patch is None else patch_object.contours_of(patch)
    for each in (probe_of(obj), patch, lines):
        if each is not None and not each.is_editable:
            raise ValueError(
                f'"{each.name}" comes from a library: make it local, or override it, to change it'
            )
        if each is not None and each.type == "MESH" and each.data.is_editmode:
            raise ValueError(f'"{each.name}" is being edited: leave its Edit Mode first')


def lock_of(obj):
    """Why that cannot be changed, a sentence; None where it can."""
    try:
        require_unlocked(obj)
    except ValueError as error:
        return str(error)
    return None


def is_free(probe):
    """Whether it can be kept up to date: nothing of it is a library's, and nobody edits its patch."""
    return lock_of(probe) is None


def make(context, target):
    """A new probe; it touches nothing before `is_probe` is set."""
    probe = bpy.data.objects.new(f"{target.name} Probe", None)
    probe.empty_display_type = "SINGLE_ARROW"
    patch_object.collection(context.scene).objects.link(probe)
    probe.tactile_probe.target = target
    return probe


def _put(probe, touched):
    """Puts the probe on the reference point, z outward, x to azimuth 0.

    One that is there already stays as it is, and so does one that constraints would take back.
    """
    if probe.constraints:
        return
    location, (e1, n, across) = touched.result.frame.origin, np.transpose(touched.report["axes"])
    turn = Matrix(np.column_stack([e1, -across, n]).tolist())
    wanted = Matrix.LocRotScale(Vector(location), turn.to_quaternion(), None)
    old, new = np.array(probe.matrix_world.normalized()), np.array(wanted)
    # Put there again and again, it would creep by rounding.
    near = 1e-5 * touched.report["extent"]
    is_there = np.allclose(old[:3, :3], new[:3, :3], atol=1e-4) and np.abs(old - new)[:3, 3].max() <= near
    if not is_there or anchor.is_carried(probe):
        scale = (probe.matrix_basis if anchor.is_attached(probe) else probe.matrix_world).to_scale()
        anchor.put(probe, wanted @ Matrix.Diagonal((*scale, 1.0)))


def update(probe, depsgraph, complete):
    """Touches again and rewrites the probe's patch; the probe's message says why where that fails.

    complete : with what is dear, an extent that suits the surface and the distances to the mesh, and with
        the probe put onto the surface
    """
    settings, patch = probe.tactile_probe, patch_of(probe)
    try:
        touched = touch_at(probe, depsgraph, complete)
    except ValueError as error:
        settings.message = sentence(error)
        if patch is not None:
            anchor.carry(probe, patch)
            patch_object.hold(patch)
            patch_object.mark_failed(patch, settings.message)
        _sign(probe, depsgraph)
    else:
        adopt(probe, touched, depsgraph, complete)


def adopt(probe, touched, depsgraph, complete):
    """Makes the probe's patch that of `touched`; `complete` as in update."""
    probe.tactile_probe.message = ""
    if complete:
        touched = verify(touched, most=VERTICES)
        _put(probe, touched)
    probe.empty_display_size = 0.6 * touched.report["extent"]
    patch = patch_of(probe)
    if patch is None:
        patch = patch_object.insert(depsgraph.scene, touched, parent=probe, lines=_left_contours(probe))
    else:
        patch_object.rewrite(patch, touched)
    anchor.keep(probe, patch)
    _sign(probe, depsgraph)


def stand_by(probe, outdated, complete):
    """Where there is no touch now: has the patch stay where it was, and say whether it is outdated."""
    settings, patch = probe.tactile_probe, patch_of(probe)
    if complete:
        anchor.settle(probe, _extent_of(probe))
    if patch is None:
        if settings.digest and not settings.message:
            settings.message = "The probe has no patch: touch again for one, or delete the probe too"
        return
    anchor.carry(probe, patch)
    patch_object.hold(patch)
    record = record_of(patch)
    if settings.message and record is not None and patch_object.VERDICT not in patch:
        settings.message = ""  # there was no patch, and undo has brought it back
    if outdated:
        patch_object.mark_stale(patch)
    elif not settings.message:
        patch_object.mark_current(patch)


def _left_contours(probe):
    """Those of a patch that was deleted, where they are still there."""
    lines = (obj for obj in bpy.data.objects if patch_object.CONTOURS in obj and obj.parent is None)
    own = (obj for obj in lines if obj.is_editable and obj.data is not None)
    return next((obj for obj in own if obj.data.get(DIGEST) == probe.tactile_probe.digest), None)


def touch_at(probe, depsgraph, complete, **more):
    """A touch with the probe's inputs. Raises ValueError, with a sentence, where there can be none."""
    settings, matrix, record = probe.tactile_probe, probe.matrix_world, record_of(probe)
    if settings.target is None:
        raise ValueError("the probe has no target: choose the mesh to touch")
    if not _is_there(settings.target, depsgraph):
        raise ValueError(
            f'"{settings.target.name}" is not in this view layer: bring it back, or choose another target'
        )
    if not anchor.can_have_children(probe):
        raise ValueError("the probe is scaled to nothing, or beyond all numbers: give it a scale of 1")
    arguments = touch_arguments(settings)
    if not complete and record is not None:  # Finding out how far a patch can be trusted is dear.
        kept = {"extent": 0.0, "step": 0.0, "degree": "auto"}
        arguments |= {name: record.get(name, own) for name, own in kept.items() if arguments[name] == own}
        arguments["sound"] = not settings.shape.endswith(NO_SHAPE)
    return touch(
        settings.target,
        depsgraph,
        list(matrix.translation),
        toward=list(matrix.col[2].xyz),
        tangent=list(matrix.col[0].xyz),
        **arguments,
        **more,
    )


def _is_there(target, depsgraph):
    return depsgraph.view_layer.objects.get(target.name) == target


def may_be_outdated(probe, there):
    """Whether something it belongs to has been taken away or back; `there`: what is in the view layer."""
    settings, made = probe.tactile_probe, _made(probe)
    return (
        bool(settings.message)
        or not made
        or settings.target not in there
        or is_disabled(settings.target)
        or any(block.get(DIGEST) != settings.digest for block in made)
    )


def is_outdated(probe, depsgraph):
    """Whether its patch is another than its inputs ask for, by the probe or by what it is made of."""
    digest = _digest(probe, depsgraph)
    stored = [probe.tactile_probe.digest, *(block.get(DIGEST) for block in _made(probe))]
    return any(other != digest for other in stored)


def _made(probe):
    """The datablocks that a touch writes to."""
    patch = patch_of(probe)
    return [] if patch is None else [patch, *patch_object.meshes(patch)]


def _sign(probe, depsgraph):
    measure_shape(probe.tactile_probe, depsgraph)
    probe.tactile_probe.seat = anchor.seat(probe, _extent_of(probe))
    digest = _digest(probe, depsgraph)
    probe.tactile_probe.digest = digest
    for block in _made(probe):
        block[DIGEST] = digest


def _digest(probe, depsgraph):
    """The digest of all inputs of a touch, and of the probe's name, which a copy does not share.

    The checksum of the target's vertices is dear, so it is kept, and taken anew where they may have changed.
    """
    settings, target = probe.tactile_probe, probe.tactile_probe.target
    inputs = [probe.name, *anchor.seat(probe, _extent_of(probe)), touch_arguments(settings)]
    if target is not None:
        inputs += [_is_there(target, depsgraph), is_disabled(target), settings.shape]
    return hashlib.sha1(repr(inputs).encode()).hexdigest()


def _extent_of(probe):
    record = record_of(probe)
    return 0.0 if record is None else record.get("extent", 0.0)


def measure_shape(settings, depsgraph, reshaped=None):
    """Keeps the checksum of the target, taken anew where it is one of the `reshaped` objects.

    reshaped : a dict, which gets the checksum of each that is asked for, so that it is taken once
    """
    target, reshaped = settings.target, {} if reshaped is None else reshaped
    if target is None or (settings.shape.startswith(f"{target.name} ") and target not in reshaped):
        return
    checksum = reshaped.get(target)
    if checksum is None:
        try:
            checksum = checksum_of(target, depsgraph)
        except ValueError:  # the touch will say what is wrong
            checksum = 0
        if target in reshaped:
            reshaped[target] = checksum
    settings.shape = f"{target.name} {checksum:08x}"


def refresh(probe, context):
    """Touches again at the end of a gesture, with all there is to know."""
    update(probe, context.evaluated_depsgraph_get(), complete=True)


def _recolor(obj):
    if patch_object.RECORD not in obj or not obj.is_editable:
        return
    try:
        patch_object.require_whole(obj)
    except ValueError:  # Verifying and exporting it say so.
        return
    patch_object.recolor(obj)


def register():
    bpy.utils.register_class(TactileProbe)
    bpy.types.Object.tactile_probe = PointerProperty(type=TactileProbe, override=OVERRIDABLE)
    bpy.types.Object.tactile_colors = EnumProperty(
        name="Colors",
        description="What the colors of the patch show",
        items=[item[:3] for item in patch_object.QUANTITIES],
        override=OVERRIDABLE,
        update=lambda obj, _: _recolor(obj),
    )
    bpy.types.Object.tactile_target = StringProperty(  # a pointer would keep a mesh that is deleted
        name="Target",
        description="Name of the mesh object to put the patch onto, or to compare it with",
        override=OVERRIDABLE,
    )


def unregister():
    del bpy.types.Object.tactile_target, bpy.types.Object.tactile_colors, bpy.types.Object.tactile_probe
    bpy.utils.unregister_class(TactileProbe)
