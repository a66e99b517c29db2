# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""How patches and whole objects are shown: their colors, with one range for all patches of a mesh."""

from collections.abc import Mapping
from typing import Any

import bpy
import numpy as np

from ... import core
from ..touch.arrays import read_array
from ..touch.types import Array, Object
from . import colors
from .attributes import COLOR, CURVATURE_STD, CURVATURES, DEVIATION, GAUSSIAN_STD, POSITION
from .family import all_objects
from .mesh_data import own_mesh, values
from .patch_record import (
    ATLAS_RECORD,
    COMMON_RANGE,
    POWERS,
    RANGE,
    RECORD,
    is_colored,
)

# The range of colors is no smaller, so that a plane is pale green: in units of the radius,
LEAST_RANGE = 1e-3
LEAST_BEND = 1e-2  # for curvatures in units of the size of the object, as all patches of a mesh have it,
# and for deviations of a whole object the tolerance.
TINY = 0.1  # Patches with more than this share of the area of all set the range of all.
PALE = 0.05  # Values below this share of the range are pale.
LEAST_SHARE = 0.5  # That of K is no smaller than this share of the median curvedness, squared,
ERROR_SHARE = 8.0  # or than this one where K may be 0 all over the patch.


def recolor(obj: Object) -> None:
    """Colors a patch or whole object by the quantity it is set to show, and keeps the range in its record.

    What is unknown of a whole object does not count in the range. Beside creases it is as on the same wall,
    or gray if the wall is narrow.
    """
    own_mesh(obj)
    shown, mesh = obj.tactile_colors, obj.data
    shades, record = values(mesh, shown), obj[RECORD if RECORD in obj else ATLAS_RECORD]
    unknown = _unknown(mesh) if shown in CURVATURES else []
    flat = floor = _least_range(record, shown)
    if shown == "gaussian_curvature":
        floor = least_gaussian_range(np.delete(values(mesh, "curvedness"), unknown), floor)
    record["own_limit"] = colors.symmetric_range(np.delete(shades, unknown), floor)
    record["error_limit"] = _error_range(mesh, shown, unknown, floor)
    limit = obj.get(RANGE) or _automatic_range(record, obj.get(COMMON_RANGE, 0.0), flat)
    rgba = colors.diverging(np.append(shades, 0.0), limit, [len(shades)])
    at = np.arange(len(shades)) if RECORD in obj else _corners_shown(mesh, unknown, record["edge"])
    mesh.attributes[COLOR].data.foreach_set("color", rgba[at].ravel())
    record["is_gray"] = bool((at < 0).any())
    if mesh.color_attributes.active_color_name != COLOR or mesh.color_attributes.default_color_name != COLOR:
        mesh.color_attributes.active_color_name = mesh.color_attributes.default_color_name = COLOR
    mesh.update()
    record["color_limit"] = limit


def _automatic_range(record: Mapping[str, Any], common: float, flat: float) -> float:
    """The range of a patch or whole object from its record, and from the common range of patches, or 0.

    A tiny patch whose K is as good as 0 stays pale, and beside patches with the range of flat ones all do.
    """
    if not common:
        return float(max(record["own_limit"], record["error_limit"]))
    is_sure = record["status"] != core.UNCERTAIN
    if not is_sure and common > flat:
        return float(common)
    # While the probe is dragged, the common range is that of where it was.
    is_own = is_sure and not record["is_verified"]
    return float(max(common, record["own_limit" if is_own else "error_limit"]))


def least_gaussian_range(curvedness: Array, floor: float) -> float:
    """The smallest range of colors of K on a surface of this curvedness (n,), in 1/length^2.

    |K| is at most the square of the curvedness. Far below that, as on a cylinder, it is as good as 0.
    """
    return max(floor, LEAST_SHARE * float(np.median(curvedness)) ** 2) if len(curvedness) else floor


def _least_range(record: Mapping[str, Any], shown: str) -> float:
    """The smallest range of colors of a quantity, in the unit of its values."""
    if shown in CURVATURES:
        return float(LEAST_BEND * record.get("object_size", record["radius"]) ** POWERS[shown])
    if shown == DEVIATION and record.get("tolerance"):
        return float(record["tolerance"])
    return float(LEAST_RANGE * record["radius"] ** POWERS[shown])


def _error_range(mesh: bpy.types.Mesh, shown: str, unknown: Any, floor: float) -> float:
    """The range that makes K pale where it is as good as 0, or 0 where it is not."""
    if shown != "gaussian_curvature" or GAUSSIAN_STD not in mesh.attributes:
        return 0.0
    k, std = (np.delete(values(mesh, name), unknown) for name in (shown, GAUSSIAN_STD))
    if colors.symmetric_range(k, 0.0) <= PALE * floor or not colors.are_as_good_as_0(k, std):
        return 0.0
    # What little is beyond its deviations, as near the tip of a cone, is no darker than half the range.
    return max(ERROR_SHARE / LEAST_SHARE * floor, 2.0 * float(np.abs(k).max()))


def _unknown(mesh: bpy.types.Mesh) -> Any:
    """The indices of the vertices whose curvatures are unknown; a patch has none."""
    return np.flatnonzero(np.isinf(values(mesh, CURVATURE_STD))) if CURVATURE_STD in mesh.attributes else []


def _corners_shown(mesh: bpy.types.Mesh, unknown: Any, edge: float) -> Array:
    """The vertex whose color each corner of the faces has, (k,), and -1 where it is gray."""
    known = np.ones(len(mesh.vertices), dtype=bool)
    known[unknown] = False
    normals, facing = read_array(mesh.vertices, "normal", 3), read_array(mesh.corner_normals, "vector", 3)
    corners = read_array(mesh.loops, "vertex_index", dtype=np.int32)
    return core.vertices_shown(values(mesh, POSITION), normals, known, corners, facing, edge)


def settle(patch: Object) -> None:
    """Gives a patch one range of colors with others of its mesh."""
    _share([patch, *(obj for obj in _others(patch) if _group(obj) == _group(patch))])


def share_ranges() -> None:
    """Gives all patches of a mesh that show the same one range, as one is gone or shows something else."""
    groups: dict[Any, list[Object]] = {}
    for obj in _others(None):
        groups.setdefault(_group(obj), []).append(obj)
    for patches in groups.values():
        _share(patches)


def _group(patch: Object) -> tuple[str, str]:
    """What patches with one range have in common."""
    return patch[RECORD]["source"], patch.tactile_colors


def _share(patches: list[Object]) -> None:
    """Gives patches one range: the largest of those that are not in doubt, or of all if all are.

    If the patch that has it has a K that is as good as 0, it is the largest that makes such a K pale.
    """
    records = [obj[RECORD] for obj in patches]
    sure = [record for record in records if record["status"] != core.UNCERTAIN] or records
    if all(record.get("error_limit") for record in sure):
        common = max(record["error_limit"] for record in sure)
    else:
        largest = _largest(sure, "own_limit")
        key = "error_limit" if largest.get("error_limit") else "own_limit"
        common = _largest(sure, key).get(key, 0.0)
    for obj in patches:
        if obj.get(COMMON_RANGE) != common:
            obj[COMMON_RANGE] = common
            recolor(obj)


def _largest(records: list[Any], key: str) -> Any:
    """The record with the largest range, if others have larger ones only on the share TINY of the area."""
    ordered = sorted(records, key=lambda record: record.get(key, 0.0))
    areas = np.cumsum([record["radius"] ** 2 for record in ordered])
    return ordered[np.searchsorted(areas, (1.0 - TINY) * areas[-1])]


def _others(patch: Object | None) -> list[Object]:
    """All others, or all if `patch` is None, whose colors can be changed without a copy of their meshes."""
    return [
        obj
        for obj in all_objects()
        if RECORD in obj and obj != patch and obj.is_editable and is_colored(obj) and obj.data.users == 1
    ]
