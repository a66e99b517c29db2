# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""How patches and whole objects are shown: their colors, and patches that are near or over each other."""

from collections.abc import Mapping
from typing import Any

import bpy
import numpy as np
from mathutils.bvhtree import BVHTree

from ... import core
from ..touch.arrays import read_array
from ..touch.touch_report import TouchReport
from ..touch.types import Array, Object
from . import colors
from .attributes import COLOR, CURVATURE_STD, CURVATURES, DEVIATION, GAUSSIAN_STD, POSITION
from .contour_mesh import HIGHEST
from .family import all_objects
from .mesh_data import ABOVE, OWN_ABOVE, corners_of, own_mesh, values
from .patch_record import (
    ATLAS_RECORD,
    COMMON_RANGE,
    POWERS,
    RANGE,
    RECORD,
    is_colored,
    parts_of,
)

# The range of colors is no smaller, so that a plane is pale green: in units of the radius,
LEAST_RANGE = 1e-3
LEAST_BEND = 1e-2  # for curvatures in units of the size of the object, as all patches of a mesh have it,
# and for deviations of a whole object the tolerance.
TINY = 0.1  # Patches with more than this share of the area of all set the range of all.
PALE = 0.05  # Values below this share of the range are pale.
LEAST_SHARE = 0.5  # That of K is no smaller than this share of the median curvedness, squared,
ERROR_SHARE = 8.0  # or than this one where K may be 0 all over the patch.
LAYER = "tactile_layer"  # A patch's number among those that overlap; 0 is the lowest.
ABOVE_OTHERS = "Above Other Patches"  # The modifier that draws it above those with lower numbers,
APART = 2.0  # by this multiple of the deviations of the heights of both,
LEAST_LAYER, MOST_LAYER = 3e-3, 3e-2  # and by no less and no more than these shares of its radius,
MOST_FURTHER = 0.12  # and further, by up to this share, where it would be below the other.
HIDDEN = 1.2 * HIGHEST  # A patch is so far above another, in radii of that, that its contours do not show.
# Patches overlap only if the cosine between their normals is more; that of two walls of a block is 0.
ALIKE = 0.1


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
    is_sure = record["status"] != "uncertain"
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
    """Gives a patch one range of colors with others of its mesh, and draws it above those it overlaps."""
    others = _others(patch)
    _share([patch, *(obj for obj in others if _group(obj) == _group(patch))])
    _draw_above(patch, others)


def share_ranges() -> None:
    """Gives all patches of a mesh that show the same one range, as one is gone or shows something else."""
    groups: dict[Any, list[Object]] = {}
    for obj in _others(None):
        groups.setdefault(_group(obj), []).append(obj)
    for patches in groups.values():
        _share(patches)


def overlapped(patch: Object) -> list[Object]:
    """All patches over or below a patch, the lowest first."""
    if not is_colored(patch):
        return []
    return sorted((obj for obj in _others(patch) if _overlap(patch[RECORD], obj[RECORD])), key=_layer)


def _group(patch: Object) -> tuple[str, str]:
    """What patches with one range have in common."""
    return patch[RECORD]["source"], patch.tactile_colors


def _share(patches: list[Object]) -> None:
    """Gives patches one range: the largest of those that are not in doubt, or of all if all are.

    If the patch that has it has a K that is as good as 0, it is the largest that makes such a K pale.
    """
    records = [obj[RECORD] for obj in patches]
    sure = [record for record in records if record["status"] != "uncertain"] or records
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


def _draw_above(patch: Object, others: list[Object]) -> None:
    """Draws a patch above those that it overlaps, by a modifier that rendering and most exports leave out."""
    patch[LAYER] = _lowest_layer(patch, others)
    higher = [obj for obj in others if _layer(obj) > patch[LAYER]]
    higher = [obj for obj in higher if _overlap(patch[RECORD], obj[RECORD])]
    for obj in (patch, *sorted(higher, key=lambda each: each[LAYER])):
        below = [each for each in (patch, *others) if _layer(each) < _layer(obj)]
        below = [each for each in below if _overlap(obj[RECORD], each[RECORD])]
        height = _height_above(obj, below) if below else _above_surfaces(obj)
        above = max([obj.get(OWN_ABOVE, 0.0), *(each.get(ABOVE, 0.0) for each in below)])
        for part in parts_of(obj):
            _lift(part, height)
            part[ABOVE] = above


def _layer(patch: Object) -> int:
    return int(patch.get(LAYER, 0))


def _lowest_layer(patch: Object, others: list[Object]) -> int:
    """The lowest number of a layer that no patch over or below has."""
    taken = {_layer(obj) for obj in others if _overlap(patch[RECORD], obj[RECORD])}
    return next(number for number in range(len(taken) + 1) if number not in taken)


def settle_on(surface: Object) -> None:
    """Draws all patches of its mesh above the surface of a whole object, which is in the same place."""
    source = surface[ATLAS_RECORD]["source"]
    for patch in [obj for obj in all_objects() if RECORD in obj and obj[RECORD]["source"] == source]:
        if patch.is_editable and is_colored(patch):
            settle(patch)


def _above_surfaces(patch: Object) -> float:
    """How far above the surfaces of whole objects a patch is drawn; 0 if its mesh has none."""
    report = patch[RECORD]
    surfaces = (obj[ATLAS_RECORD] for obj in all_objects() if ATLAS_RECORD in obj)
    here = (_apart(report, surface) for surface in surfaces if surface["source"] == report["source"])
    return max(here, default=0.0)


def _apart(upper: Mapping[str, Any], lower: Mapping[str, Any]) -> float:
    """By how much more than both of two reports may be off the upper one is drawn higher."""
    apart, radius = APART * (upper["height_std"] + lower["height_std"]), upper["radius"]
    return float(min(max(apart, LEAST_LAYER * radius), MOST_LAYER * radius))


def _height_above(upper: Object, below: list[Object]) -> float:
    """How high a patch is drawn above others: by more than both may be off, as two in one place flicker."""
    further, found = MOST_FURTHER * upper[RECORD]["radius"], 0.0
    modifiers = [(lower.modifiers.get(ABOVE_OTHERS), lower) for lower in below]
    heights = [(0.0 if modifier is None else modifier.strength, lower) for modifier, lower in modifiers]
    for height, lower in sorted(heights, key=lambda each: -each[0]):
        layer = max(_apart(upper[RECORD], lower[RECORD]), HIDDEN * lower[RECORD]["radius"])
        if height + further + layer > found:
            reach = min(_reach(lower, height, upper), height + further)
            found = max(found, max(height, reach) + layer)
    return found


def _reach(lower: Object, height: float, upper: Object) -> float:
    """How far a patch that is drawn at this height is above vertices of another, along the normal of that."""
    matrix = np.array(upper.matrix_world.inverted_safe() @ lower.matrix_world)
    corners = read_array(lower.data.vertices, "co", 3) + np.array([0.0, 0.0, height])
    corners = corners @ matrix[:3, :3].T + matrix[:3, 3]
    tree = BVHTree.FromPolygons(corners.tolist(), corners_of(lower.data).tolist(), all_triangles=True)
    top, reach = float(corners[:, 2].max()) + upper[RECORD]["radius"], 0.0
    for x, y, z in read_array(upper.data.vertices, "co", 3).tolist():
        place = tree.ray_cast((x, y, top), (0.0, 0.0, -1.0))[0]
        if place is not None:
            reach = max(reach, place.z - z)
    return reach


def _lift(obj: Object, height: float) -> None:
    """Draws a patch or its contours higher along the patch's normal."""
    modifier = obj.modifiers.get(ABOVE_OTHERS)
    if height == 0.0:
        if modifier is not None:
            obj.modifiers.remove(modifier)
        return
    if modifier is None:
        modifier = obj.modifiers.new(ABOVE_OTHERS, "DISPLACE")
    modifier.direction, modifier.mid_level, modifier.show_render = "Z", 0.0, False
    modifier.strength = height


def _overlap(a: TouchReport, b: TouchReport) -> bool:
    """Whether the patches of two reports may lie over each other."""
    apart = np.subtract(a["frame"]["origin"], b["frame"]["origin"])
    alike = np.dot(a["frame"]["normal"], b["frame"]["normal"])
    return bool(alike > ALIKE and np.linalg.norm(apart) < a["radius"] + b["radius"])


def _others(patch: Object | None) -> list[Object]:
    """All others, or all if `patch` is None, whose colors can be changed without a copy of their meshes."""
    return [
        obj
        for obj in all_objects()
        if RECORD in obj and obj != patch and obj.is_editable and is_colored(obj) and obj.data.users == 1
    ]
