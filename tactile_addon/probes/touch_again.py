# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""How a probe touches again: the inputs of its patch, whether these have changed, and the new patch."""

import hashlib
from collections.abc import Container
from typing import Any

import bpy
import numpy as np
from mathutils import Matrix

from ..scene import patch_object, patch_record
from ..touch.evaluated_mesh import checksum_of, is_disabled, require_in_scene, require_invertible
from ..touch.settings import touch_arguments
from ..touch.touch_object import Touched, completed, touch
from ..touch.types import Object
from ..touch.wording import sentence
from . import anchor
from .probe import DIGEST, patch_of, record_of

NO_SHAPE = " 00000000"  # The end of settings.shape for a mesh that cannot be touched.
VERTICES = 1000  # At most this many vertices around the patch are compared; a quarter or more lie over it.


def _put(probe: Object, touched: Touched) -> None:
    """Puts the probe on the reference point, with z outward and x toward azimuth 0.

    It stays as it is if it is there already, or if constraints would take it back.
    """
    if probe.constraints:
        return
    wanted = anchor.placed(touched.result.point, np.array(touched.report["axes"]))
    old, new = (np.array(m, dtype=float) for m in (probe.matrix_world.normalized(), wanted))
    # If it were put there again and again, it would creep by rounding.
    near = 1e-5 * touched.report["extent"]
    is_there = np.allclose(old[:3, :3], new[:3, :3], atol=1e-4) and np.abs(old - new)[:3, 3].max() <= near
    if not is_there or anchor.is_carried(probe):
        scale = (probe.matrix_basis if anchor.is_attached(probe) else probe.matrix_world).to_scale()
        anchor.put(probe, wanted @ Matrix.Diagonal((*scale, 1.0)))


def update(probe: Object, depsgraph: bpy.types.Depsgraph, complete: bool) -> None:
    """Touches again and rewrites the probe's patch; if that fails, the probe's message says why.

    complete : whether to include what takes long, as the distances to the mesh, and to put the probe onto the
        surface
    """
    settings, patch = probe.tactile_probe, patch_of(probe)
    try:
        touched = touch_at(probe, depsgraph, complete)
    except ValueError as error:
        settings.message = sentence(error)
        if patch is not None:
            anchor.carry(probe, patch)
            patch_record.hold(patch)
            patch_record.mark_outdated(
                patch, f"This patch is from an earlier touch, because the last one failed. {settings.message}"
            )
        _sign(probe, depsgraph)
    else:
        adopt(probe, touched, depsgraph, complete)


def adopt(probe: Object, touched: Touched, depsgraph: bpy.types.Depsgraph, complete: bool) -> None:
    """Makes `touched` the probe's patch; `complete` as in update."""
    probe.tactile_probe.message = ""
    if complete:
        touched = completed(touched, most=VERTICES)
        _put(probe, touched)
    probe.empty_display_size = 0.6 * touched.report["extent"]
    patch = patch_of(probe)
    if patch is None:
        patch = patch_object.insert(depsgraph.scene, touched, parent=probe)
    else:
        patch_object.rewrite(patch, touched)
    anchor.keep(probe, patch)
    _sign(probe, depsgraph)


def stand_by(probe: Object, outdated: bool, complete: bool) -> None:
    """Keeps the patch where it was, because there is no touch now, and lets it say whether it is outdated."""
    settings, patch = probe.tactile_probe, patch_of(probe)
    if complete:
        anchor.settle(probe, patch_record.extent_of(patch))
    if patch is None:
        if settings.digest and not settings.message:
            settings.message = "The probe has no patch: touch again for one, or delete the probe too"
        return
    anchor.carry(probe, patch)
    patch_record.hold(patch)
    if settings.message and record_of(patch) is not None and patch_record.VERDICT not in patch:
        settings.message = ""  # There was no patch, and undo has brought it back.
    if outdated:
        patch_record.mark_outdated(
            patch,
            "This patch is from an earlier touch, and the probe or its target has changed since: "
            "touch again.",
        )
    elif not settings.message:
        patch_record.mark_current(patch)


def touch_at(probe: Object, depsgraph: bpy.types.Depsgraph, complete: bool, **more: Any) -> Touched:
    """A touch with the probe's inputs. Raises ValueError, with a sentence, if there can be none."""
    settings, matrix = probe.tactile_probe, probe.matrix_world
    if settings.target is None:
        raise ValueError("the probe has no target: choose the mesh to touch")
    if not _is_there(settings.target, depsgraph):
        require_in_scene(settings.target)
        raise ValueError(
            f'"{settings.target.name}" is not in this view layer: bring it back, or choose another target'
        )
    if anchor.is_attached(probe):  # If the target is scaled to 0, so is the probe.
        require_invertible(settings.target.name, np.array(settings.target.matrix_world, dtype=float))
    if not anchor.can_have_children(probe):
        raise ValueError("the probe has a scale of 0 or beyond all numbers: give it a scale of 1")
    arguments = touch_arguments(settings)
    if not complete and record_of(probe) is not None:
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


def _is_there(target: Object, depsgraph: bpy.types.Depsgraph) -> bool:
    objects = depsgraph.view_layer.objects
    named: Object = objects.get(target.name)
    # A library's object and its override may both be there under one name.
    return named == target or (named is not None and any(obj == target for obj in objects))


def may_be_outdated(probe: Object, there: Container[Object]) -> bool:
    """Whether `is_outdated` has to look: something of the probe was removed, brought back, hidden or renamed,
    or its patch is not of its settings.

    there : the objects in the view layer
    """
    settings, made, record = probe.tactile_probe, _made(probe), record_of(probe)
    return (
        bool(settings.message)
        or not made
        or (record is not None and settings.target is not None and record["source"] != settings.target.name)
        or settings.target not in there
        or is_disabled(settings.target)
        or any(block.get(DIGEST) != _signed(settings)[0] for block in made)
    )


def is_outdated(probe: Object, depsgraph: bpy.types.Depsgraph) -> bool:
    """Whether the patch is that of other inputs than the probe has, by the digests of both."""
    (touched, name), made, patch = _signed(probe.tactile_probe), _made(probe), patch_of(probe)
    if name != probe.name and (patch is None or patch.data.users > 1):
        return True  # It is a copy, which has no patch of its own yet.
    digest = _digest(probe, depsgraph, anchor.seat(probe, patch_record.extent_of(patch)))
    return any(other != digest for other in (touched, *(block.get(DIGEST) for block in made)))


def _made(probe: Object) -> list[bpy.types.ID]:
    """The datablocks that a touch of the probe writes to."""
    patch = patch_of(probe)
    return [] if patch is None else [patch, patch.data]


def _sign(probe: Object, depsgraph: bpy.types.Depsgraph) -> None:
    measure_shape(probe.tactile_probe, depsgraph)
    probe.tactile_probe.seat = anchor.seat(probe, patch_record.extent_of(patch_of(probe)))
    digest = _digest(probe, depsgraph, list(probe.tactile_probe.seat))
    probe.tactile_probe.digest = f"{digest} {probe.name}"
    for block in _made(probe):
        block[DIGEST] = digest


def _signed(settings: Any) -> tuple[str, str]:
    """The digest of the last touch together with the name of the probe, which a copy does not share."""
    digest, _, name = settings.digest.partition(" ")
    return digest, name


def _digest(probe: Object, depsgraph: bpy.types.Depsgraph, seat: list[float]) -> str:
    """The digest of all inputs of a touch, which do not include names.

    seat : where the probe is on its target, see anchor.seat

    The checksum of the target's vertices takes long, so it is kept until they may have changed.
    """
    settings, target = probe.tactile_probe, probe.tactile_probe.target
    inputs = [*seat, touch_arguments(settings)]
    if target is not None:
        _, _, checksum = settings.shape.partition(" ")
        inputs += [_is_there(target, depsgraph), is_disabled(target), checksum]
    return hashlib.sha1(repr(inputs).encode()).hexdigest()


def measure_shape(
    settings: Any, depsgraph: bpy.types.Depsgraph, reshaped: dict[Any, int | None] | None = None
) -> None:
    """Keeps the checksum of the target, computed anew if the target is one of the `reshaped` objects.

    reshaped : a dict that gets the checksum of each object that is needed, so that it is computed once
    """
    target, reshaped = settings.target, {} if reshaped is None else reshaped
    if target is None or (settings.shape.startswith(f"{target.session_uid} ") and target not in reshaped):
        return
    checksum = reshaped.get(target)
    if checksum is None:
        try:
            checksum = checksum_of(target, depsgraph)
        except ValueError:  # The touch will say what is wrong.
            checksum = 0
        if target in reshaped:
            reshaped[target] = checksum
    settings.shape = f"{target.session_uid} {checksum:08x}"


def refresh(probe: Object, context: bpy.types.Context) -> None:
    """Touches again at the end of a gesture, completely."""
    update(probe, context.evaluated_depsgraph_get(), complete=True)
