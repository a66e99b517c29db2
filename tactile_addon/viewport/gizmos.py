# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The handles of the active probe: they move its point, turn and tilt sampling planes, and set the extent."""

import math
from collections.abc import Sequence
from functools import partial
from typing import Any

import bpy
import gpu
import numpy as np
from bpy_extras.view3d_utils import location_3d_to_region_2d
from mathutils import Matrix, Vector

from ..probes import probe
from ..scene.patch_record import CURVES
from ..touch.touch_object import plane_axes
from .curves import PLANE_COLORS, coordinates, draw_lines, drawn_at
from .drag import DRAG_EXTENT, DRAG_TILT, DRAG_TURN, POINT, STEEP, shown_probe
from .free_view import is_free
from .mouse import line_of_sight

# Handles that turn planes are on the ends of their curves, and those that tilt planes this many extents above
# the point, or at the first place where the view is free: at the curve's other end, or nearer.
UPRIGHT, UPRIGHT_PLACES = 0.75, 10
OFF = 0.05  # An object hides what is behind it by more than this share of the extent.
MARGIN = 10.0  # The radius of a handle in pixels at scale 1; handles do not overlap.
BALL, LEAST_BALL = 0.12, 0.05  # Sizes of balls, in units of Blender's gizmo size.
SHARE = 0.125  # A ball is no larger than this share of the patch in the view.
APART = 24.0  # Handles that are nearer to the point in the view than this many pixels at scale 1 are hidden.
NEAREST = 1e3  # What is closer to the eye than the point by less than this does not win over it.


class TACTILE_GT_rim(bpy.types.Gizmo):
    """The rim of a patch, as a circle would be in the air beside a saddle; or the stem of a ring above it"""

    bl_idname = "TACTILE_GT_rim"
    rim: Sequence[float] = ()  # Three coordinates a point.

    def draw(self, context: bpy.types.Context) -> None:
        color: Any = self.color_highlight if self.is_highlight else self.color
        with coordinates(self.matrix_world):
            draw_lines([(self.rim, (*color, 1.0))])

    def draw_select(self, context: bpy.types.Context, select_id: int) -> None:  # type: ignore[override]
        gpu.select.load_id(select_id)
        self.draw(context)


class TACTILE_GGT_handles(bpy.types.GizmoGroup):
    """Handles of the active probe"""

    bl_label = "Tactile Probe"
    bl_space_type = "VIEW_3D"
    bl_region_type = "WINDOW"
    bl_options = {"3D", "PERSISTENT", "SHOW_MODAL_ALL"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        found = shown_probe(context) if context.mode == "OBJECT" else None
        return found is not None and found.tactile_probe.show_handles

    def setup(self, context: bpy.types.Context) -> None:
        self.extent = self._handle(TACTILE_GT_rim.bl_idname, DRAG_EXTENT, 0, (1.0, 1.0, 1.0))
        self.extent.use_draw_scale = False
        self.point = self._ball(POINT, 0, (1.0, 1.0, 1.0))
        self.point.select_bias = NEAREST
        self.turns = [self._ball(DRAG_TURN, i, color) for i, color in enumerate(PLANE_COLORS)]
        self.tilts = [self._ball(DRAG_TILT, i, color) for i, color in enumerate(PLANE_COLORS)]
        self.stem = self._handle(TACTILE_GT_rim.bl_idname, DRAG_TILT, 0, (1.0, 1.0, 1.0))
        self.stem.use_draw_scale, self.stem.hide_select = False, True
        self.ends = dict.fromkeys((*self.turns, *self.tilts), 0)

    def _ball(self, what: str, plane: int, color: Sequence[float]) -> Any:
        ball = self._handle("GIZMO_GT_move_3d", what, plane, color)
        ball.draw_style = "RING_2D"
        ball.draw_options = (
            {"FILL", "ALIGN_VIEW"} if what in (DRAG_TURN, POINT) else {"FILL_SELECT", "ALIGN_VIEW"}
        )
        ball.scale_basis, ball.line_width = BALL, 3.0
        return ball

    def _handle(self, kind: str, what: str, plane: int, color: Sequence[float]) -> Any:
        handle = self.gizmos.new(kind)
        properties = handle.target_set_operator("tactile.drag")
        properties.what, properties.plane = what, plane
        handle.color, handle.alpha = color, 0.8
        handle.color_highlight, handle.alpha_highlight = [0.5 + 0.5 * c for c in color], 1.0
        handle.use_draw_modal = True
        return handle

    def draw_prepare(self, context: bpy.types.Context) -> None:
        obj = shown_probe(context)
        settings, matrix = obj.tactile_probe, obj.matrix_world
        reach = settings.extent or probe.record_of(obj)["extent"]
        center = matrix.translation
        seen = self._shrink(context, center, reach)
        active = min(settings.active_plane, settings.plane_count - 1)
        self.point.matrix_basis = Matrix.Translation(center)
        self._is_hidden = partial(_is_hidden, context, OFF * reach)
        self.point.hide = settings.target is None
        patch = probe.patch_of(obj)
        paths = (_from_ends(patch.matrix_world, path) for path in patch[CURVES]["contours"])
        handles = list(zip(self.turns[: settings.plane_count], paths, strict=False))
        t, up = (Vector(axis) for axis in plane_axes(matrix, settings, active).T.tolist()[:2])
        # If the tilt's plane is seen edge on, a little way of the mouse turns it by much.
        if abs(line_of_sight(context.region_data, center).dot(t)) >= STEEP:
            shares = np.linspace(UPRIGHT, 0.0, UPRIGHT_PLACES, endpoint=False).tolist()
            handles.append((self.tilts[active], [center + share * reach * up for share in shares]))
        taken: list[Any] = []
        for each, places in handles:
            place = self._put(context, each, places, taken)
            each.hide = self._is_hidden(place) or _apart(context, center, place) < APART
        self._draw_stem(center, self.tilts[active], PLANE_COLORS[active])
        self.extent.hide = self._is_hidden(center) or seen < APART
        self.extent.rim = list(patch[CURVES]["rim"][0])  # Another touch frees the patch's own.
        self.extent.matrix_basis = drawn_at(context.space_data, patch)

    def _draw_stem(self, center: Vector, ring: Any, color: Sequence[float]) -> None:
        """Has a line drawn from the point to a ring above it: what is behind the ring may be far away."""
        self.stem.hide, self.stem.color = ring.hide, color
        self.stem.rim = [*center.to_tuple(), *ring.matrix_basis.translation]

    def _put(self, context: bpy.types.Context, handle: Any, places: list[Any], taken: list[Any]) -> Any:
        """Puts a handle on the first of these places where the view is free, or else on the first one.

        taken : where the handles are that were put before, in the region; this one is added

        Returns the place.
        """
        margin = MARGIN * context.preferences.system.ui_scale

        def is_good(end: int) -> bool:
            at = _seen(context, places[end])
            return (
                is_free(context, at, 2.5 * margin)
                and all((at - other).length > 2.0 * margin for other in taken)
                and not self._is_hidden(places[end])
            )

        if not handle.is_modal:  # One that is dragged stays at its end.
            self.ends[handle] = next(filter(is_good, range(len(places))), 0)
        place = places[min(self.ends[handle], len(places) - 1)]
        handle.matrix_basis = Matrix.Translation(place)
        taken += filter(None, [_seen(context, place)])
        return place

    def _shrink(self, context: bpy.types.Context, center: Vector, reach: float) -> float:
        """Makes the balls smaller if the patch is small in the view, so that they do not hide it.

        They are hidden until they have a place. Returns the pixels at scale 1 that its radius spans, or inf.
        """
        to_world: Any = context.region_data.view_matrix.inverted_safe()
        seen = _apart(context, center, center + reach * to_world.col[0].xyz)
        size = min(max(SHARE * seen / context.preferences.view.gizmo_size, LEAST_BALL), BALL)
        for ball in (self.point, *self.turns, *self.tilts):
            ball.scale_basis, ball.hide = size, ball != self.point
        return seen


def _from_ends(to_world: Any, path: Any) -> list[Any]:
    """The places of a curve in the world, from its ends to its middle: its last, its first, and so on."""
    line = [to_world @ Vector(place) for place in np.reshape(path, (-1, 3))]
    return [place for pair in zip(reversed(line), line, strict=True) for place in pair][: len(line)]


def _seen(context: bpy.types.Context, place: Vector) -> Any:
    """Where a place of the world is in the region, or None if it is behind the eye."""
    return location_3d_to_region_2d(context.region, context.region_data, place)


def _is_hidden(context: Any, off: float, place: Vector) -> bool:
    """Whether a place of the world is behind an object in the view, by more than this length."""
    space, view = context.space_data, context.region_data
    if space.shading.type == "WIREFRAME" or space.shading.show_xray:
        return False
    sight, eye = line_of_sight(view, place), view.view_matrix.inverted_safe().translation
    far = (eye - place).length if view.is_perspective else space.clip_end
    depsgraph, start = context.evaluated_depsgraph_get(), place - off * sight
    hit, _, _, _, found, _ = context.scene.ray_cast(depsgraph, start, -sight, distance=max(far - off, 0.0))
    return hit and not probe.is_result(found.original) and found.original.visible_in_viewport_get(space)


def _apart(context: bpy.types.Context, place: Vector, other: Vector) -> float:
    """The pixels at scale 1 between two places of the world in the region, or inf if one is not there."""
    here, there = _seen(context, place), _seen(context, other)
    return math.inf if None in (here, there) else (there - here).length / context.preferences.system.ui_scale
