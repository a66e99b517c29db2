# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A stability map: a painted copy of the mesh that was touched, what is said of it, and its operator."""

from collections.abc import Iterator, Mapping
from typing import Any

import bpy
import numpy as np
from bpy.props import EnumProperty
from mathutils import Matrix, Vector

from ... import core
from ...core.arguments import many
from ..probes import probe
from ..probes.in_slices import AllOver, Progress
from ..probes.operators import make_active, report_done, target_object
from ..scene import colors, patch_object, patch_record
from ..scene.mesh_data import (
    ABOVE,
    CORNERS,
    HEIGHT_STD,
    MAP_COLOR,
    MEASURES,
    REASON,
    TOUCH,
    emission,
    fill,
    write,
)
from ..scene.shown import LEAST_LENGTH
from ..scene.viewports import show_colors, show_size
from ..touch import units
from ..touch.evaluated_mesh import read_array
from ..touch.settings import MOST_PLANES, NAMES, TouchSettings, length_property, touch_arguments
from ..touch.types import Array, Object, Outcome
from ..touch.wording import fit
from .stability import NOTHING, REASON_KEYS, REASONS, StabilityMap

PLACES = "tactile_places"  # The points that were touched, in the axes of the map: three numbers each,
VALUES = "tactile_values"  # and what was found there, by the names of the attributes, with
AREA = "area"  # the area in the world that has the color of each.
# The map is shown this share of the object's size above the mesh. With less it flickers if it is 20000 clip
# starts away, as a scan in mm is.
SHOWN_ABOVE = 5e-3
# What the colors can show: attribute, name, description, and the power of length in its unit. The first is
# shown at first: where a patch can be trusted, and why not.
MAP_QUANTITIES = [
    (REASON, "Reason", "Whether there is a patch, and why there is none", 0),
    ("error", "Error", "Mean distance in height between patch and mesh", 1),
    (HEIGHT_STD, "Standard Deviation", "How well the contacts determine the height", 1),
    (
        "reach",
        "Reach",
        "How far the longest half curve goes, the extent where that is automatic; red is short",
        1,
    ),
    (
        "condition_number",
        "Condition Number",
        "Factor by which plain least squares amplifies noise",
        0,
    ),
    ("blind_share", "Blind Share", "Share of the ways to bend that the planes cannot show", 0),
]
LOGARITHMIC = ("condition_number",)  # These have a logarithmic scale from 1.
# The range reaches at least to where the median patch would be in doubt: this multiple of that quantity.
DOUBTFUL = {"error": (core.CONTRADICTING, HEIGHT_STD), HEIGHT_STD: (core.DOUBTFUL_STD, "reach")}
REVERSED = ("reach",)  # Of these much is good, so that red is little: red is bad on every map.
MAP_POWERS = {name: power for name, _, _, power in MAP_QUANTITIES}
REFUSED = (0.27, 0.27, 0.27, 1.0)
# The colors of the reasons, in sRGB, are Okabe and Ito's, which color-blind readers can tell apart.
REASON_COLORS = np.array([
    (0.93, 0.93, 0.93, 1.0), (0.94, 0.89, 0.26, 1.0), (0.84, 0.37, 0.0, 1.0),
    (0.0, 0.45, 0.70, 1.0), (0.0, 0.62, 0.45, 1.0), REFUSED,
])  # fmt: skip

FACETED = 0.5  # The share of the patches from which on a map says that they follow facets.


def insert(context: bpy.types.Context, obj: Object, touched: StabilityMap) -> Object:
    """Adds a copy of `obj`, painted by the StabilityMap `touched`, to the scene, and returns it."""
    evaluated = obj.evaluated_get(context.evaluated_depsgraph_get())
    mesh = bpy.data.meshes.new(f"{obj.name} Stability")
    painted: Object = bpy.data.objects.new(mesh.name, mesh)
    painted.matrix_world = Matrix.Translation(touched.surface.origin.tolist())
    areas = _paint(mesh, touched)
    is_smooth = read_array(evaluated.data.polygons, "use_smooth", dtype=bool)[touched.owners]
    mesh.polygons.foreach_set("use_smooth", is_smooth)
    # It would lie in the mesh it describes, so it is shown a little above it. It is not shown in front,
    # because patches that lie in it are.
    painted[ABOVE] = SHOWN_ABOVE * float(np.linalg.norm(np.ptp(touched.points, axis=0)))
    painted[PLACES] = np.ravel(touched.places[: touched.done]).tolist()
    mesh.materials.append(emission("Tactile Stability", MAP_COLOR))
    painted[VALUES] = {name: touched.measures[name].tolist() for name in MEASURES}
    painted[VALUES].update({REASON: touched.reason.tolist(), AREA: areas.tolist()})
    painted[patch_record.MAP_RECORD] = touched.report() | {"source": obj.name, "painted": painted.name}
    patch_object.collection(context.scene).objects.link(painted)
    # Where one reason holds everywhere, its color shows nothing; setting what is shown colors the map.
    painted.tactile_map_colors = REASON if len(set(painted[VALUES][REASON])) > 1 else "error"
    show_colors()
    show_size(touched.surface.size)
    return painted


def _paint(mesh: bpy.types.Mesh, touched: StabilityMap) -> Array:
    """Fills the mesh; each vertex has the values of its touch, and each triangle the color of its own.

    It returns the area (n,) that has the color of each touch.
    """
    attributes = [(name, touched.measures[name][touched.touch_of]) for name in MEASURES]
    attributes.append((REASON, touched.reason[touched.touch_of]))
    fill(mesh, touched.points, touched.triangles, attributes)
    touch = np.repeat(touched.touch_in, 3)
    write(mesh, TOUCH, touch.astype(np.int32), CORNERS)
    write(mesh, MAP_COLOR, np.ones((len(touch), 4)), CORNERS)
    mesh.color_attributes.active_color_name = mesh.color_attributes.default_color_name = MAP_COLOR
    return np.bincount(touched.touch_in, touched.areas, len(touched.reason))


def recolor(painted: Object) -> None:
    """Colors the map by the quantity that it is set to show, and keeps the range in its record."""
    shown, mesh, record = painted.tactile_map_colors, painted.data, painted[patch_record.MAP_RECORD]
    found = np.array(painted[VALUES][shown])
    if shown == REASON:
        rgba, limit = REASON_COLORS[found.astype(np.intp)], len(REASON_KEYS) - 1.0
    else:
        limit = _limit(painted, shown, found[found != NOTHING])
        share = found / limit
        if shown in LOGARITHMIC:
            share = np.log(np.maximum(found, 1.0)) / np.log(limit)
        share = np.clip(share, 0.0, 1.0)
        rgba = colors.shades(1.0 - share if shown in REVERSED else share, 1.0)
        rgba[found == NOTHING] = REFUSED
    touch = read_array(mesh.attributes[TOUCH].data, "value", dtype=np.int32)
    mesh.attributes[MAP_COLOR].data.foreach_set("color_srgb", rgba[touch].ravel())
    mesh.update()
    record["color_limit"] = limit


def _limit(painted: Object, shown: str, values: Array) -> float:
    """The end of the colors' range for values (n,), such that red stands for what is bad."""
    if shown == "blind_share":
        return 1.0
    if shown in LOGARITHMIC:
        return colors.symmetric_range(values, 10.0)
    record, (times, other) = painted[patch_record.MAP_RECORD], DOUBTFUL.get(shown, (0.0, shown))
    least = max(LEAST_LENGTH * record["spacing"], times * record.get(f"{other}_median", 0.0))
    return colors.symmetric_range(values, least)


def swatches(painted: Object) -> list[tuple[str, tuple[float, ...]]]:
    """(name, sRGB color) of all that is not on the scale: reasons that occur, or that there is no patch."""
    record = painted[patch_record.MAP_RECORD]
    counts = {"patch": record["patches"] - record["in_doubt"], "doubt": record["in_doubt"]}
    counts |= record["refused"].to_dict()
    if painted.tactile_map_colors != REASON:
        refused = sum(counts[key] for key in REASON_KEYS[2:])
        return [(f"No Patch: {refused}", REFUSED)] if refused else []
    return [
        (f"{name}: {counts[key]}", tuple(color))
        for (key, name, _), color in zip(REASONS, REASON_COLORS, strict=True)
        if counts[key]
    ]


def touched_near(painted: Object, location: list[float]) -> list[float]:
    """The point at which a map was touched for its triangle that is nearest to a location.

    It is the location itself if the object is no map or is hidden, or if that point is farther away than the
    map is large: the source was moved.
    """
    if TOUCH not in painted.data.attributes or not painted.visible_get():
        return location
    evaluated = painted.evaluated_get(bpy.context.evaluated_depsgraph_get())
    to_map = painted.matrix_world.inverted_safe()
    is_found, _, _, face = evaluated.closest_point_on_mesh(to_map @ Vector(location))
    if not is_found:
        return location
    touch = painted.data.attributes[TOUCH].data[painted.data.polygons[face].loop_start].value
    found = painted.get(PLACES, ())[3 * touch : 3 * touch + 3]
    if len(found) < 3:  # It was joined with another object.
        return location
    place = painted.matrix_world @ Vector(found)
    return list(place) if (place - Vector(location)).length <= max(painted.dimensions) else location


def inputs_of(painted: Object) -> dict[str, Any]:
    """The settings that a map was touched with, by name: with them a probe finds what the map shows."""
    record = painted[patch_record.MAP_RECORD].to_dict()
    angles = np.radians(record["planes"] + [[0.0, 0.0]] * (MOST_PLANES - len(record["planes"])))
    names = ("extent", "step", "noise", "seed", "method", "solver")
    return {name: record[name] for name in names} | {
        "plane_count": len(record["planes"]),
        "azimuths": angles[:, 0].tolist(),
        "tilts": angles[:, 1].tolist(),
        "degree": 0 if record["degree"] == "auto" else record["degree"],
        "weight": record.get("weight") or 0.0,
    }


def map_table_rows(record: Mapping[str, Any]) -> list[tuple[str, str]]:
    """(label, value) of everything there is to say of a map."""
    names = ("spacing", "extent", "step")
    lengths = [units.say_of(record, record[name]) if record[name] else "auto" for name in names]
    return [
        (
            "touched",
            f"{record['source']}, at {record['touched']} of {many(record['points'], 'point', 'points')}",
        ),
        ("patches", f"{record['patches']}, {record['in_doubt']} of them in doubt"),
        ("refused", ", ".join(_refused(record)) or "none"),
        ("fit", fit(record)),
        (", ".join(names), ", ".join(lengths)),
        *((f"median {title.lower()}", value) for title, value in median_rows(record)),
    ]


def map_summary(record: Mapping[str, Any]) -> str:
    """A sentence on what a stability map has found."""
    patches = many(record["patches"], "patch", "patches")
    words = f"{patches} at {many(record['touched'], 'point', 'points')}, {record['in_doubt']} in doubt"
    refused = _refused(record)
    return f"{words}; refused: {', '.join(refused)}" if refused else words


def _refused(record: Mapping[str, Any]) -> list[str]:
    """How many points were refused, for each reason."""
    names = {key: name for key, name, _ in REASONS}
    return [f"{count} {names[key]}" for key, count in record["refused"].items() if count]


def map_rows(record: Mapping[str, Any]) -> list[tuple[str, str]]:
    """(label, value) of how many patches a stability map has, and of the reasons why there are not more."""
    names, refused = {key: name for key, name, _ in REASONS}, [*record["refused"].items()]
    touched, points = record["touched"], record["points"]
    return [
        ("Points", str(points) if touched == points else f"{touched} of {points}"),
        ("Spacing", units.say_of(record, record["spacing"])),
        ("Patches", str(record["patches"])),
        ("… in Doubt", str(record["in_doubt"])),
        *([("… on Facets", str(record["few_facets"]))] if record.get("few_facets") else []),
        *([("No Patch", str(sum(count for _, count in refused)))] if refused else []),
        *((names[key], str(count)) for key, count in refused if count),
    ]


def map_facets(record: Mapping[str, Any]) -> str | None:
    """A sentence if half of the patches or more follow facets, as the verdict on a patch has it; or None."""
    count = record.get("few_facets", 0)
    if count < max(FACETED * record["patches"], 1):
        return None
    return f"Curvature of the facets, not of the shape, at {many(count, 'point', 'points')}"


def median_rows(record: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    """(label, value) of the medians over the patches of a stability map that are known."""
    for name, title, _, power in MAP_QUANTITIES:
        if f"{name}_median" in record:
            found = record[f"{name}_median"]
            # In single precision a little is left of 0.
            yield title, units.say_of(record, units.rounded(found, power, record["spacing"]), power)


def _show(obj: Object, context: bpy.types.Context) -> None:
    if patch_record.MAP_RECORD in obj:
        recolor(obj)


class TACTILE_OT_stability_map(AllOver, TouchSettings, bpy.types.Operator):
    """Touch a mesh all over and paint a copy of it: where a patch can be trusted, and where there is none"""

    bl_idname = "tactile.stability_map"
    bl_label = "Stability Map"
    bl_options = {"UNDO", "PRESET"}

    spacing: length_property(
        "Spacing",
        "Distance between the points that are touched; 0 uses half of the extent, or a 16th of the "
        "object's size where the extent is automatic",
    )

    stop, section = "Stop and Keep", "map"
    shown = ("target", "spacing", "extent", "noise", "seed")  # All else is as the active probe has it.

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> Outcome:
        found = probe.probe_of(context.view_layer.objects.active)
        for name in NAMES if found is not None and not bpy.app.background else ():
            setattr(self, name, getattr(found.tactile_probe, name))
        return super().invoke(context, event)

    def _begin(self, context: bpy.types.Context) -> None:
        self._map = StabilityMap(
            target_object(context, self.target),
            context.evaluated_depsgraph_get(),
            spacing=self.spacing,
            **touch_arguments(self),
        )
        self._steps = self._map.steps()

    def _stopped(self, context: bpy.types.Context) -> Outcome:
        """Keeps the touches so far when Esc is pressed."""
        if not self._map.done:
            self._leave(context)
            return {"CANCELLED"}
        self._steps = self._map.spread()
        return {"RUNNING_MODAL"}

    def _done(self) -> Progress:
        done, count = self._map.done, len(self._map.places)
        return f"Stability Map: {done} of {many(count, 'point', 'points')}", done / max(count, 1)

    def _check(self, context: bpy.types.Context) -> None:
        self._map.surface.require_source(context)

    def _finish(self, context: bpy.types.Context) -> Outcome:
        painted = insert(context, self._map.surface.require_same(context), self._map)
        make_active(context, painted)
        record = painted[patch_record.MAP_RECORD].to_dict()
        return report_done(self, map_summary(record), record["patches"] > 0)

    def _estimate(self, context: bpy.types.Context, target: Object) -> str:
        """A sentence on what will be touched at how many points."""
        touches = StabilityMap(
            target, context.evaluated_depsgraph_get(), spacing=self.spacing, **touch_arguments(self)
        )
        count = touches.expected_count()
        seconds = count * touches.seconds_each()
        words = f"about {many(units.rough(count), 'touch', 'touches')}, {units.duration(seconds)}"
        return f"{target.name}: {words}"


# Properties of objects, by name.
PROPERTIES = {
    "tactile_map_colors": EnumProperty(
        name="Colors",
        description="What the colors of the map show",
        items=[item[:3] for item in MAP_QUANTITIES],
        update=_show,
    )
}
