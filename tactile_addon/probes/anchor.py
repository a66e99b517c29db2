# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Where a probe and its patch are on their target: a target that moves as a whole is not touched again.

A probe that is a child of its target has the world's coordinates for its own, which Blender's Parent does
not do. So it stays where it is when the target is deleted, and is not sheared with the target.
"""

import math
from functools import lru_cache
from typing import Any

import numpy as np
from mathutils import Matrix

from ..scene import patch_record
from ..touch.touch_object import reference_axes
from ..touch.types import Array, Object

BASE = "tactile_base"  # A patch's custom property: its target's matrix and its own when it was touched.
SEAT = 20  # The count of numbers for the place in the target, directions there, and its scale and shear.
CLOSE = 1e-5  # A smaller change of a number, or of a length as a share of the extent, is rounding of float32.


def attach(probe: Object, target: Object | None) -> None:
    """Makes the probe a child of its target, or of nothing, without moving it.

    A target that depends on the probe is left alone.
    """
    if target == probe or target in probe.children_recursive:
        return
    place = probe.matrix_world.copy()
    probe.parent, probe.parent_type = target, "OBJECT"
    patch_record.place(probe, place)


def is_attached(probe: Object) -> bool:
    """Whether the probe is a child of its target, so that it goes where the target goes."""
    target = probe.tactile_probe.target
    return target is not None and probe.parent == target and probe.parent_type == "OBJECT"


def can_have_children(obj: Object) -> bool:
    """Whether children of an object can be placed: not if its scale is 0 or not finite."""
    return all(0.0 < abs(scale) < math.inf for scale in obj.matrix_world.to_scale())


def placed(place: Array, axes: Array, scale: Any = None) -> Matrix:
    """The matrix of a probe at a place of the world (3,), with axes as of touch_object.reference_axes."""
    e1, n, across = axes.T
    return Matrix.LocRotScale(place.tolist(), Matrix(np.column_stack([e1, -across, n]).tolist()), scale)


def put(probe: Object, matrix: Matrix) -> None:
    """Puts the probe at a matrix of the world."""
    if is_attached(probe):
        patch_record.place(probe, matrix)
    else:
        probe.matrix_world = matrix


def is_carried(probe: Object) -> bool:
    """Whether the target has carried the probe away from its own coordinates, as during a gesture."""
    if not is_attached(probe) or probe.constraints or probe.animation_data:
        return False
    own, there = (np.array(m, dtype=float) for m in (probe.matrix_basis, probe.matrix_world))
    return not np.abs(own - there).max() <= 2e-6 * np.abs(there).max()


@np.errstate(all="ignore")  # Objects may be beyond all numbers.
def settle(probe: Object, extent: float) -> None:
    """Makes the world's coordinates the probe's own again, without the target's scale and shear."""
    if not is_carried(probe):
        return
    to_world = np.array(probe.tactile_probe.target.matrix_world, dtype=float)
    # The place follows from the seat. If it followed from the probe's own place, it would creep by rounding.
    at, x, z = (to_world[:3, :3] @ np.reshape(seat(probe, extent)[:9], (3, 3)).T).T
    if not np.isfinite([at, x, z]).all():
        return
    place = at + to_world[:3, 3]
    patch_record.place(probe, placed(place, reference_axes(z, x), probe.matrix_basis.to_scale()))


@np.errstate(all="ignore")  # Objects may be beyond all numbers.
def seat(probe: Object, extent: float) -> list[float]:
    """Where the probe is on its target, SEAT numbers that stay the same if both are moved or turned together.

    They are those that the probe keeps, as long as it is still there.
    """
    settings, target = probe.tactile_probe, probe.tactile_probe.target
    above = np.eye(4).ravel().tolist() if target is None else _numbers(target.matrix_world)
    own, kept = _numbers(probe.matrix_world), np.array(settings.seat)
    now = np.array(_seat(*above, *own)) if can_have_children(probe) else np.full(SEAT, np.nan)
    to_world, place = np.reshape([above, own], (2, 4, 4))
    rounding = np.finfo(np.float32).eps * np.abs([to_world[:3, 3], place[:3, 3]]).max()
    off = np.linalg.norm(to_world[:3, :3] @ (now[:3] - kept[:3]))
    is_turned = not np.abs(now[3:] - kept[3:]).max() <= CLOSE  # NaN counts as turned.
    is_there = off <= CLOSE * extent + 8.0 * rounding and not is_turned
    return kept.tolist() if is_there else now.tolist()


@lru_cache(maxsize=16)  # It is needed several times in a row whenever something has changed.
def _seat(*matrices: float) -> Array:
    """SEAT numbers from the world matrices of a target and a probe, 16 each; NaN if the target is flat."""
    to_world, place = np.reshape(matrices, (2, 4, 4))
    linear = to_world[:3, :3]
    shape, size, volume = linear.T @ linear, np.linalg.norm(linear), np.linalg.det(linear)
    if not abs(volume) > 1e-12 * size**3 > 0.0:
        return np.full(SEAT, np.nan)
    offsets = np.column_stack([place[:3, 0], place[:3, 2], place[:3, 3] - to_world[:3, 3]])
    x, z, at = np.linalg.solve(linear, offsets).T
    axes = [axis / max(np.linalg.norm(axis), 1e-30) for axis in (x, z)]
    return np.concatenate([at, *axes, [np.log(size), np.sign(volume)], shape.ravel() / size**2])


def keep(probe: Object, patch: Object) -> None:
    """Keeps where the probe's target is in a patch that was touched just now."""
    frame = patch_record.matrix_of(*patch_record.touched_frame(patch))
    patch[BASE] = [*_numbers(probe.tactile_probe.target.matrix_world), *_numbers(frame)]


@np.errstate(all="ignore")  # Objects may be beyond all numbers.
def carry(probe: Object, patch: Object) -> None:
    """Moves the patch in its record as its target was moved since.

    It does nothing if the probe was left behind because it is no child of the target.
    """
    target, report, base = probe.tactile_probe.target, patch_record.report_of(patch), patch.get(BASE)
    if target is None or report is None or base is None:
        return
    if report["source"] != target.name:  # It was renamed.
        report["source"] = target.name
    if not is_attached(probe) and seat(probe, report.get("extent", 0.0)) != list(probe.tactile_probe.seat):
        return
    before, frame = np.reshape(base, (2, 4, 4))
    now = np.array(target.matrix_world, dtype=float)
    try:
        motion = now @ np.linalg.inv(before)
    except np.linalg.LinAlgError:
        return
    if not np.isfinite(motion).all():  # They are beyond single precision.
        return
    turn = np.array(Matrix(motion.tolist()).to_quaternion().to_matrix(), dtype=float)
    patch_record.move_record(patch, turn @ frame[:3, :3], motion[:3, :3] @ frame[:3, 3] + motion[:3, 3])


def _numbers(matrix: Matrix | Array) -> list[float]:
    return np.array(matrix, dtype=float).ravel().tolist()
