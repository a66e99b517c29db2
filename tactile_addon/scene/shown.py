# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""How patches and whole objects are shown: their colors, with one range for each quantity and mesh.

The range follows from how much the mesh bends at the points that were touched, as far as that is certain;
if nothing is, from how uncertain it is. Rims, where patches are least certain, do not count. Lengths have the
range of what is promised of them.
"""

import math
from collections.abc import Iterable, Mapping
from typing import Any

import bpy
import numpy as np
from bpy.props import FloatProperty
from numpy.typing import ArrayLike

from ... import core
from ..touch import units
from ..touch.evaluated_mesh import read_array
from ..touch.types import Array, Object
from ..touch.wording import is_flat
from . import colors
from .mesh_data import COLOR, CURVATURE_STD, CURVATURES, POSITION, own_mesh, values
from .patch_record import ATLAS_RECORD, COMMON_RANGE, POWERS, RANGE, RECORD, is_colored, report_of

LEAST_BEND = 1e-2  # Curvatures have no smaller range than this, in units of the object's size,
LEAST_LENGTH = 1e-3  # nor lengths than this, in units of the radius. So a plane is pale green.
HEADROOM = 1.25  # Curvatures have a range of so many times the usual bend, so that a ball is not at its end.
DEVIATIONS = 3.0  # Lengths of a patch have a range of so many standard deviations of its height.
TICKS = (1.0, 1.2, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0)  # Ranges are these, so they seldom change.


def recolor(obj: Object) -> None:
    """Colors a patch or whole object by the quantity it is set to show, and keeps the range in its record.

    What is unknown of a whole object is as on the same wall, or gray if the wall is narrow. A patch that is
    flat has no shape index.
    """
    own_mesh(obj)
    shown, mesh, record = obj.tactile_colors, obj.data, _record(obj)
    limit = obj.get(RANGE) or _automatic_range(obj, record, shown)
    rgba = np.vstack([colors.shades(values(mesh, shown), limit), colors.UNKNOWN])
    if RECORD in obj:
        at = np.where(shown == "shape_index" and is_flat(record), -1, np.arange(len(mesh.vertices)))
    else:
        at = _corners_shown(mesh, shown, record["edge"])
    mesh.attributes[COLOR].data.foreach_set("color_srgb", rgba[at].ravel())
    record["is_gray"] = bool((at < 0).any())
    if mesh.color_attributes.active_color_name != COLOR or mesh.color_attributes.default_color_name != COLOR:
        mesh.color_attributes.active_color_name = mesh.color_attributes.default_color_name = COLOR
    mesh.update()
    record["color_limit"] = limit


def _automatic_range(obj: Object, record: Mapping[str, Any], shown: str) -> float:
    """The range of a quantity if none is given."""
    if shown == "shape_index":
        return 1.0
    if shown not in CURVATURES:
        length = record.get("tolerance") or DEVIATIONS * record["height_std"]
        return float(max(length, LEAST_LENGTH * record["radius"]))
    bend = _bend_of_surface(obj) if ATLAS_RECORD in obj else obj.get(COMMON_RANGE) or _bend([record])
    return float(bend ** -POWERS[shown])


def bend_range(bends: ArrayLike, areas: ArrayLike, size: float) -> float:
    """The range of the curvatures of an object of this size, by those (n,) of parts with areas (n,).

    It follows from their root mean square: neither a few narrow bends nor large flat faces decide alone.
    """
    areas = np.asarray(areas)
    mean = math.sqrt(float(np.sum(areas * np.square(bends)) / areas.sum())) if areas.size else 0.0
    mean = max(HEADROOM * mean, LEAST_BEND / size)
    power = 10.0 ** math.floor(math.log10(mean))
    return next(tick for tick in TICKS if tick * power >= mean * (1.0 - 1e-9)) * power


def _bend(records: Iterable[Mapping[str, Any]]) -> float:
    """The range of the curvatures of patches, by what is certain of those at their points.

    It is no smaller than the error of the patch that is known best, so that what may as well be 0 is pale.
    """
    records = list(records)
    bends = [max(abs(r[k]) - r[f"{k}_std"] for k in ("k1", "k2")) for r in records]
    least = min(max(r["k1_std"], r["k2_std"]) for r in records)
    areas = [r["radius"] ** 2 for r in records]
    return bend_range(np.maximum(bends, least), areas, records[0].get("object_size", records[0]["radius"]))


def _bend_of_surface(obj: Object) -> float:
    """The range of the curvatures of a whole object, by what is certain of them at its vertices."""
    bends = np.maximum(values(obj.data, "curvedness") - values(obj.data, CURVATURE_STD), 0.0)
    known = np.isfinite(values(obj.data, CURVATURE_STD))
    return bend_range(bends[known], np.ones(known.sum()), max(obj.dimensions))


def _corners_shown(mesh: bpy.types.Mesh, shown: str, edge: float) -> Array:
    """The vertex whose color each corner of the faces has, (k,), and -1 where it is gray."""
    corners = read_array(mesh.loops, "vertex_index", dtype=np.int32)
    if shown not in CURVATURES:
        return corners
    known = np.isfinite(values(mesh, CURVATURE_STD))
    normals, facing = read_array(mesh.vertices, "normal", 3), read_array(mesh.corner_normals, "vector", 3)
    return core.vertices_shown(values(mesh, POSITION), normals, known, corners, facing, edge)


def share(patch: Object) -> None:
    """Gives all patches of the mesh of a patch the range that suits all of them."""
    objects: list[Object] = list(bpy.data.objects)
    patches = [obj for obj in objects if RECORD in obj and obj.is_editable and is_colored(obj)]
    source = patch[RECORD]["source"]
    patches = [obj for obj in patches if obj[RECORD]["source"] == source and obj.data.users == 1]
    common = _bend(obj[RECORD] for obj in patches)
    for obj in patches:
        if obj.get(COMMON_RANGE) != common:
            obj[COMMON_RANGE] = common
            recolor(obj)


def _record(obj: Object) -> Any:
    """The report of a patch or a whole object, or None."""
    return obj[ATLAS_RECORD] if ATLAS_RECORD in obj else report_of(obj)


def unit_of_range(obj: Object) -> tuple[int, units.Unit]:
    """The power of length in the quantity that a patch or whole object shows, and the unit of its legend."""
    report, power = _record(obj), POWERS[obj.tactile_colors]
    return power, ("", 1.0) if report is None else units.unit_of_report(report)


def _get(obj: Object) -> float:
    power, unit = unit_of_range(obj)
    return (obj.get(RANGE) or (_record(obj) or {}).get("color_limit", 0.0)) / unit[1] ** power


def _set(obj: Object, value: float) -> None:
    power, unit = unit_of_range(obj)
    set_range(obj, value * unit[1] ** power)


def set_range(obj: Object, limit: float) -> None:
    """Gives the colors of a patch or whole object this range, in units of the world; 0 makes it automatic."""
    obj[RANGE] = limit
    if limit <= 0.0:
        del obj[RANGE]
    if obj.is_editable and is_colored(obj):  # If not, verifying and exporting say so.
        recolor(obj)


# Properties of objects, by name.
PROPERTIES = {
    "tactile_range": FloatProperty(
        name="Range",
        description="Value at which the colors end, in the unit of the legend; 0 chooses it by the values",
        min=0.0,
        precision=6,
        step=0.1,  # It is small compared with usual values in a unit that suits the patch.
        get=_get,
        set=_set,
    ),
}
