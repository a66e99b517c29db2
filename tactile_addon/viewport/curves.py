# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The curves of patches and of a pick's preview: contours in the colors of their planes, rims, directions."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import lru_cache
from itertools import cycle
from typing import Any, cast

import blf
import bpy
import gpu
import numpy as np
from bpy_extras.view3d_utils import location_3d_to_region_2d
from gpu_extras.batch import batch_for_shader
from mathutils import Matrix, Vector

from ... import core
from ..scene.mesh_data import ABOVE
from ..scene.patch_record import CURVES, Curves, curves_of, matrix_of
from ..touch.types import Object

# Each sampling plane has one of Okabe and Ito's colors, which color-blind readers can tell apart.
PLANE_COLORS = [
    (0.90, 0.62, 0.0), (0.34, 0.71, 0.91), (0.0, 0.62, 0.45),
    (0.94, 0.89, 0.26), (0.80, 0.47, 0.65), (0.84, 0.37, 0.0),
]  # fmt: skip
WHITE, BLACK, DARK = (1.0, 1.0, 1.0, 1.0), (0.0, 0.0, 0.0, 1.0), (0.0, 0.0, 0.0, 0.6)
WIDTH, OUTLINE = 1.5, 0.75  # Of a curve, and of the dark line on either side of it, in pixels at scale 1.
SOLID = "SOLID", "WIREFRAME"  # Kinds of shading without materials.
LINES = "POLYLINE_SMOOTH_COLOR"  # Blender's own shader of them.
STROKE = 3.0  # The size of a contact of a stroke.
NEARER = 0.002  # Where curves may be hidden, they are drawn nearer by this share of their distance.
FONT, LETTER = 0, 12.0  # Blender's own font; the size of the letters of principal directions.
APART = 2.0  # Letters whose places are not farther apart than so many of their sizes would overlap.


def draw_curves() -> None:
    """Draws the curves of all visible patches on them; in Solid shading through what is in front of them."""
    context = bpy.context
    space: Any = context.space_data
    shown = _shown_patches(context)
    if not shown:
        return
    gpu.state.depth_test_set("NONE" if space.shading.type in SOLID else "LESS_EQUAL")
    gpu.state.depth_mask_set(False)  # A curve would hide parts of its own outline.
    for obj in shown:
        with coordinates(drawn_at(space, obj), NEARER):
            draw(obj[CURVES], DARK, obj.tactile_contours, obj.tactile_directions)
    gpu.state.depth_test_set("NONE")


def drawn_at(space: Any, patch: Object) -> Matrix:
    """Where a viewport draws a patch in the world: Material Preview and Rendered raise it by its material."""
    raised = 0.0 if space.shading.type in SOLID else patch.get(ABOVE, 0.0)
    return patch.matrix_world @ Matrix.Translation((0.0, 0.0, raised))


def _shown_patches(context: bpy.types.Context) -> list[Object]:
    """The visible patches whose curves or directions are shown."""
    space: Any = context.space_data
    objects: Sequence[Object] = context.visible_objects if space.overlay.show_overlays else ()
    return [o for o in objects if CURVES in o and (o.tactile_contours or o.tactile_directions)]


@contextmanager
def coordinates(matrix: Matrix, share: float = 0.0) -> Iterator[None]:
    """Within this context, all is drawn in the coordinates that a matrix takes to the world.

    share : it is nearer to the eye by this share of its distance, at the same place on the screen
    """
    view: Any = bpy.context.region_data
    nearer = Matrix.Translation((0.0, 0.0, share * view.view_distance))
    if view.is_perspective:
        nearer = Matrix.Scale(1.0 - share, 4)
    pushed = cast(Any, gpu.matrix.push_pop())  # which the stubs make no context
    with pushed:
        gpu.matrix.load_matrix(nearer @ gpu.matrix.get_model_view_matrix())
        gpu.matrix.multiply_matrix(matrix)
        yield


def draw(curves: Curves, rim: tuple[float, ...], has_contours: bool, has_directions: bool) -> None:
    """Draws Curves in the coordinates of their patch, with the rim in a color."""
    scale = bpy.context.preferences.system.ui_scale
    lines: list[tuple[Sequence[float], tuple[float, ...]]] = []
    if has_contours:
        lines = [(path, rim) for path in curves["rim"]]
        colors = ((*color, 1.0) for color in cycle(PLANE_COLORS))
        lines += zip(curves["contours"], colors, strict=False)
    if has_directions:
        lines += [(path, BLACK) for path in curves.get("directions", ())]
    draw_lines(lines)
    gpu.state.point_size_set(STROKE * scale)
    for path in curves.get("strokes", ()) if has_contours else ():
        draw_shape("POINTS", "POINT_UNIFORM_COLOR", {"pos": np.reshape(path, (-1, 3)).tolist()}, color=BLACK)


def draw_lines(lines: Sequence[tuple[Sequence[float], tuple[float, ...]]]) -> None:
    """Draws lines, each of which has numbers, three a point, and a color."""
    scale = bpy.context.preferences.system.ui_scale
    shader = gpu.shader.from_builtin(LINES)
    drawn = tuple((np.array(path, dtype=float).tobytes(), color) for path, color in lines)
    gpu.state.blend_set("ALPHA")
    for is_outline, width in ((True, WIDTH + 2.0 * OUTLINE), (False, WIDTH)):
        shader.uniform_float("viewportSize", gpu.state.viewport_get()[2:])
        shader.uniform_float("lineWidth", width * scale)
        _batch(drawn, is_outline).draw(shader)
    gpu.state.blend_set("NONE")


@lru_cache(maxsize=512)  # A redraw of hundreds of patches would take too long otherwise.
def _batch(lines: tuple[tuple[bytes, tuple[float, ...]], ...], is_outline: bool) -> gpu.types.GPUBatch:
    """The segments of lines, in their colors or dark."""
    pieces = [np.repeat(np.frombuffer(raw).reshape(-1, 3), 2, axis=0)[1:-1] for raw, _ in lines]
    shades = np.repeat([DARK if is_outline else color for _, color in lines], list(map(len, pieces)), axis=0)
    return batch_for_shader(
        gpu.shader.from_builtin(LINES),
        "LINES",
        {"pos": np.vstack(pieces).tolist(), "color": shades.tolist()},
    )


def draw_shape(kind: Any, shader_name: str, columns: dict[str, Any], **uniform: Any) -> None:
    """Draws points or triangles, as `kind` has it, with one of Blender's own shaders."""
    shader = gpu.shader.from_builtin(shader_name)
    gpu.state.blend_set("ALPHA")
    for key, value in uniform.items():
        shader.uniform_float(key, value)
    batch_for_shader(shader, kind, columns).draw(shader)
    gpu.state.blend_set("NONE")


def draw_letters() -> None:
    """Writes which principal curvature is that along a direction, at its end."""
    context = bpy.context
    scale = context.preferences.system.ui_scale
    shown = [o for o in _shown_patches(context) if o.tactile_directions and "directions" in o[CURVES]]
    for obj in shown:
        ends = [obj.matrix_world @ Vector(path[-3:]) for path in obj[CURVES]["directions"]]
        places = [location_3d_to_region_2d(context.region, context.region_data, end) for end in ends]
        is_clear = None not in places and (places[0] - places[1]).length > APART * LETTER * scale
        for at, text in zip(places, ("κ1", "κ2"), strict=True):
            if is_clear:
                blf.size(FONT, LETTER * scale)
                blf.color(FONT, *WHITE)
                blf.position(FONT, at.x + 4.0 * scale, at.y, 0.0)
                blf.draw(FONT, text)


def draw_preview(seen: dict[str, Any]) -> None:
    """Draws the curves and the normal of seen["touched"], a touch or None."""
    if seen["touched"] is None:
        return
    r: core.Reconstruction = seen["touched"].result
    with coordinates(Matrix(matrix_of(r.frame.axes, r.frame.origin).tolist())):
        draw(curves_of(r), WHITE, has_contours=True, has_directions=False)
        draw_lines([([0.0, 0.0, 0.0, 0.0, 0.0, 0.6 * r.radius], WHITE)])
