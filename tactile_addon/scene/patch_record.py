# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What a patch object keeps: report, reconstruction in double precision, where it was touched, its curves."""

import json
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, TypeAlias

import numpy as np
from mathutils import Matrix

from ... import core
from ..touch.touch_report import TouchReport
from ..touch.types import Array, Object
from .mesh_data import COLOR, CORNERS, CURVATURES, DEVIATION, DOMAIN, HEIGHT_STD, attribute_of

# Custom properties of objects.
RECORD = "tactile"  # The report of a patch.
RECONSTRUCTION = "tactile_reconstruction"  # Its core.to_dict as JSON, once a gesture has ended.
VERDICT = "tactile_verdict"  # Its status and message, while the report says that it is outdated.
RANGE = "tactile_color_range"  # The range of its colors, if that is given.
COMMON_RANGE = "tactile_common_range"  # That of curvatures on all patches of its mesh, in 1/length.
CURVES = "tactile_curves"  # The Curves of a patch, which the viewport draws.
MAP_RECORD = "tactile_map"  # The report of a stability map.
ATLAS_RECORD = "tactile_object"  # The report of a whole object.
GRAPH = "tactile_graph"  # The graph of a whole object, core.Atlas.to_dict as JSON.
# What the colors can show: attribute, name, description, and the power of length in its unit. The first is
# shown at first: of all it alone differs between flat, rolled, round and hollow surfaces.
QUANTITIES = [
    ("mean_curvature", "Mean Curvature", "H: blue where the surface bulges outward, red where inward", -1),
    ("gaussian_curvature", "Gaussian Curvature", "K: red on domes and bowls, blue on saddles", -2),
    (
        "shape_index",
        "Shape Index",
        "1 on caps, 0.5 on ridges, 0 on saddles, -0.5 in ruts, -1 in cups",
        0,
    ),
    ("curvedness", "Curvedness", "How strongly the surface bends, whatever its shape", -1),
    (DEVIATION, "Deviation", "How far the patch is outside the mesh (red) or inside (blue)", 1),
    (HEIGHT_STD, "Standard Deviation", "How well the contacts determine the height", 1),
]
POWERS = {name: power for name, _, _, power in QUANTITIES}
QUANTITIES_OF_A_FIT = (*CURVATURES, HEIGHT_STD)  # These need no mesh to compare with.
POSITIVE = ("curvedness", HEIGHT_STD)  # These are never below zero, so they need half a scale.
# By name, lists of curves with three coordinates a point, in the Darboux frame: contours, strokes (the
# contacts beside these), rim, and directions (d1 and d2, where the curvatures differ).
Curves: TypeAlias = dict[str, list[list[float]]]
RIM_CORNERS = 96  # The number of points of the rim.
ALONG, POINTS = 0.4, 9  # How far a principal direction is drawn, as a share of the radius, and its points.


def report_of(patch: Object) -> TouchReport | None:
    """The report of a patch object, or None if somebody has made something else of it."""
    report = patch.get(RECORD)
    try:
        frame = np.array([report["frame"][name] for name in ("origin", "d1", "d2", "normal")], dtype=float)
        numbers = [float(report[name]) for name in ("radius", "height_std", "k1", "k2")]
        words = [report[name] for name in ("source", "status", "message", "ended")]
        words += [doubt[name] for doubt in report["doubts"] for name in ("code", "sentence", "advice")]
        report["is_verified"]
    except (KeyError, TypeError, ValueError, AttributeError):
        return None
    good = frame.shape == (4, 3) and np.isfinite(frame).all() and np.isfinite(numbers).all()
    return report if good and numbers[0] > 0.0 and all(isinstance(word, str) for word in words) else None


def extent_of(patch: Object | None) -> float:
    """The extent in the report of a patch; 0 if there is no patch or extent, or somebody has edited it."""
    report = None if patch is None else report_of(patch)
    return 0.0 if report is None else report.get("extent", 0.0)


def edited(obj: Object) -> ValueError:
    """The error to raise for a patch, a map or a whole object that was edited and is none any more."""
    if RECORD in obj:
        return ValueError(f'"{obj.name}" was edited and is no longer a complete patch: touch again')
    return ValueError(f'"{obj.name}" was edited and is no longer a complete surface: touch all over again')


@contextmanager
def reading(obj: Object) -> Iterator[None]:
    """Within this context, whatever is wrong with the record of an object is a ValueError with a sentence."""
    try:
        yield
    except (ArithmeticError, AttributeError, LookupError, TypeError, ValueError) as error:
        raise edited(obj) from error


def is_colored(obj: Object) -> bool:
    """Whether an object is a patch or a whole object that nobody has edited, so that it can show colors."""
    return (ATLAS_RECORD in obj or report_of(obj) is not None) and obj.type == "MESH" and _is_whole(obj)


def require_colored(obj: Object) -> None:
    """Raises ValueError if the patch or whole object was edited such that it is none any more."""
    if not is_colored(obj):
        raise edited(obj)


def touched_record(obj: Object | None) -> Any:
    """The report of a stability map or a whole object, or None for any other object."""
    return None if obj is None else obj.get(MAP_RECORD, obj.get(ATLAS_RECORD))


def _is_whole(obj: Object) -> bool:
    mesh, domain = obj.data, CORNERS if ATLAS_RECORD in obj else DOMAIN
    found = [attribute_of(mesh, COLOR, domain), *(attribute_of(mesh, name) for name in POWERS)]
    return len(mesh.vertices) > 0 and None not in found


def mark_outdated(patch: Object, message: str) -> None:
    """Gives the record the status "outdated" and a message on why; VERDICT keeps what it had."""
    report = report_of(patch)
    if report is None:
        return
    if VERDICT not in patch:
        patch[VERDICT] = {key: report[key] for key in ("status", "message", "doubts")}
    report.update({"status": "outdated", "message": message})


def mark_subdivided(surface: Object) -> None:
    """Gives the record of a whole object that was subdivided the status "outdated": its facets are gone."""
    message = "The object was subdivided since it was touched: touch it all over again."
    surface[ATLAS_RECORD].update({"status": "outdated", "message": message, "faceted": 0.0})


def mark_current(patch: Object) -> None:
    """Puts the verdict of the record back, because the patch is that of its probe's inputs again."""
    verdict = patch.pop(VERDICT, None)
    if verdict is not None and report_of(patch) is not None:
        patch[RECORD].update(verdict)


def reconstruction_of(patch: Object) -> core.Reconstruction:
    """The core.Reconstruction of a patch object, in the world, where the object is now.

    If the object was not moved, it is what was fitted, to the last bit. Raises ValueError during a gesture,
    if the object's properties were edited, and if it no longer has its shape.
    """
    require_colored(patch)
    if RECONSTRUCTION not in patch:
        raise ValueError(f'"{patch.name}" is not complete: end the gesture, or touch again')
    try:
        r = core.from_dict(json.loads(patch[RECONSTRUCTION]))
    except (TypeError, ValueError, RecursionError) as error:
        raise ValueError(f'"{patch.name}" can no longer be read: touch again ({error})') from error
    if is_at(patch, r.frame.axes, r.frame.origin):  # It was not moved, so double precision is kept.
        return r
    placed = np.array(patch.matrix_world, dtype=float)
    try:
        return r.moved(placed @ np.linalg.inv(matrix_of(r.frame.axes, r.frame.origin)))
    except ValueError as error:
        raise ValueError(
            f'"{patch.name}" is stretched, mirrored or has a scale of 0: give it one positive scale '
            "for all axes"
        ) from error


def place(obj: Object, matrix: Matrix) -> None:
    """Puts an object at a matrix of the world, such that it stays there if its parent is deleted."""
    if obj.parent is not None:
        obj.matrix_parent_inverse = obj.parent.matrix_world.inverted_safe()
    obj.matrix_world = matrix  # This makes it known before the next evaluation.
    obj.matrix_basis = matrix


def hold(patch: Object) -> None:
    """Puts the patch back where it was touched, if its probe or somebody has moved it.

    A patch that constraints or an animation would move again stays where it is.
    """
    if report_of(patch) is None or patch.constraints or patch.animation_data:
        return
    axes, origin = touched_frame(patch)
    if not is_at(patch, axes, origin):
        place(patch, Matrix(matrix_of(axes, origin).tolist()))


def touched_frame(patch: Object) -> tuple[Array, Array]:
    """The frame in which the patch was touched: axes as columns, and origin."""
    frame = patch[RECORD]["frame"]
    return np.transpose([frame[name] for name in ("d1", "d2", "normal")]), np.array(frame["origin"])


def move_record(patch: Object, axes: Array, origin: Array) -> None:
    """Lets the record say that the patch was touched at this frame, unless it says so already."""
    report, (before, at) = patch[RECORD], touched_frame(patch)
    if np.array_equal(axes, before) and np.array_equal(origin, at):
        return
    turn = axes @ before.T
    if np.shape(report.get("axes")) == (3, 3):
        report["axes"] = (turn @ np.array(report["axes"])).tolist()
    plane = report.get("suggested_plane")
    if plane is not None and np.shape(plane.get("tangent")) == (3,):
        plane["tangent"] = (turn @ np.array(plane["tangent"])).tolist()
    d1, d2, normal = axes.T.tolist()
    report["frame"].update({"origin": origin.tolist(), "d1": d1, "d2": d2, "normal": normal})


def is_at(patch: Object, axes: Array, origin: Array) -> bool:
    """Whether the patch object is at a frame of the world, except for rounding."""
    near = {"rtol": 1e-6, "atol": 1e-6 * patch[RECORD]["radius"]}
    return np.allclose(patch.matrix_world, matrix_of(axes, origin), **near)


def matrix_of(axes: Array, origin: Array) -> Array:
    """The matrix (4, 4) of a frame: axes as columns, and origin."""
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = axes, origin
    return matrix


def curves_of(result: core.Reconstruction) -> Curves:
    """The curves of a reconstruction."""
    to_local = result.frame.to_local
    edge = result.domain.boundary(RIM_CORNERS)
    along, across = np.linspace(-ALONG, ALONG, POINTS) * result.radius, np.zeros(POINTS)
    plane = {"rim": [np.vstack([edge, edge[:1]])]}
    if not result.posterior.is_round:
        plane["directions"] = [np.column_stack(pair) for pair in ((along, across), (across, along))]
    found: dict[str, list[Array]] = {
        name: [np.column_stack([at, result.height(*at.T)]) for at in paths] for name, paths in plane.items()
    }
    found["contours"] = [to_local(contour.points) for contour in result.contours]
    if len(result.strokes):
        found["strokes"] = [to_local(result.strokes)]
    return {name: [path.ravel().tolist() for path in paths] for name, paths in found.items()}
