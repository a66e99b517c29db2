# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""One touch, from an object of the scene to a reconstruction and its report; nothing in the scene changes."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from time import perf_counter
from typing import Any

import bpy
import numpy as np

from ... import core
from ...core.arguments import unit_vector
from .detached_mesh import DetachedMesh
from .settings import MOST_PLANES, STEEPEST
from .surface import MeshSurface
from .touch_report import (
    TouchReport,
    ends,
    measures,
    reconstruction_report,
    suggestion_report,
)
from .types import Array, Object, Point, Triple
from .units import length

FARTHEST_SHARE = 1.0 / 2.0  # A half contour is at most this share of the object's size long.
AWAY = 1.0 / 8.0  # Without an extent, the location may be this share of the size off the surface.
FINEST_STEP = 1.0 / 128.0  # The step is this share of the size if neither step nor extent is given.
LEAST_STEPS = 12  # Without a step, a half contour has at least this many.
LARGE_FACET = 4.0  # The finger feels facets that are longer than this many steps, and creases between them.
STEP_ROUNDING = 1.0 / 20.0  # Contacts that are rounded by more of a step say nothing about curvature.
# The squares of lengths between these, and of their inverses, are numbers in single precision.
LARGEST_SINGLE, SMALLEST_SINGLE = 1e15, 1e-15
PLACE_ROUNDING = 0.1  # Far from the origin rounding may move a surface by this share of its radius.


@dataclass(frozen=True, eq=False)
class Touched:
    """The outcome of a touch: no surface if contours were measured elsewhere, a report of plain values."""

    surface: MeshSurface | None
    result: core.Reconstruction
    report: TouchReport


def touch(
    obj: Object,
    depsgraph: bpy.types.Depsgraph,
    location: Point,
    planes: Sequence[core.SamplingPlane],
    *,
    tolerance: float | None = None,
    outward: Point | None = None,
    toward: Point | None = None,
    tangent: Point | None = None,
    extent: float,
    step: float,
    noise: float,
    seed: int,
    sound: bool = False,
    **fit: Any,
) -> Touched:
    """Tracks the evaluated `obj` from `location` and reconstructs the patch there.

    location : world coordinates, which are projected onto the object
    tolerance : mean deviation of the height to reach by adding planes while they help, up to MOST_PLANES, see
        core.explore; None adds none
    outward : the outward direction; None for the surface's normal, on the side `toward` if that is given
    tangent : azimuth 0 of the planes, or None, see core.SamplingPlane.axes
    extent, step : 0 has the surface choose, see core.explore
    sound : see MeshSurface
    fit : arguments of core.reconstruct

    Raises ValueError with a sentence for the user.
    """
    clock = [perf_counter()]
    surface = MeshSurface(obj, depsgraph, sound)
    require_lengths(obj.name, surface.size, extent, step, noise)
    point, surface_normal = nearest_point(surface, location, extent or AWAY * surface.size)
    require_fine(surface.spacing(point), step or extent / LEAST_STEPS or FINEST_STEP * surface.size)
    outward = unit_vector("outward", surface_normal if outward is None else outward)
    if toward is not None and np.dot(outward, toward) < 0.0:
        outward = [-v for v in outward]
    axes = reference_axes(outward, tangent)
    clock.append(perf_counter())
    more = {"rng": seed, "tangent": axes[:, 0], "tolerance": tolerance, "noise": noise, **fit}
    found = _explored(surface, point, outward, planes, extent, step, **more)
    clock.append(perf_counter())
    require_single("patch", found.result.radius, found.result.frame.origin)
    report: TouchReport = {
        "source": obj.name,
        "object_size": surface.size,
        "method": fit["method"],
        "noise": noise,
        "seed": seed,
        **_exploration_report(
            found,
            len(planes),
            ends(found.result.contours, extent > 0.0),
        ),
        "axes": axes.tolist(),
        "seconds": dict(zip(("prepare", "touch"), np.diff(clock).tolist(), strict=True)),
    }
    return Touched(surface, found.result, report)


def _explored(
    surface: MeshSurface,
    point: Point,
    outward: Point,
    planes: Sequence[core.SamplingPlane],
    extent: float,
    step: float,
    **more: Any,
) -> core.Exploration:
    """What core.explore finds. Where long facets stand for a smooth bend, an error says so."""
    try:
        return core.explore(
            surface,
            point,
            outward,
            planes,
            extent=extent or "auto",
            step=step or "auto",
            farthest=FARTHEST_SHARE * surface.size,
            most_planes=MOST_PLANES,
            **more,
        )
    except core.DegenerateCurvesError as error:
        facet = surface.facet(point)
        is_large = facet >= LARGE_FACET * (step or FINEST_STEP * surface.size)
        if more["noise"] or not (is_large and core.is_beside_bend(point, surface)):
            raise
        raise ValueError(
            f"{error}. The facets there are {length(facet)} long: add a Subdivision modifier if the "
            "shape is smooth"
        ) from error


def _exploration_report(found: core.Exploration, given: int, ended: str) -> TouchReport:
    """The report of a touch whose first `given` planes were given; the rest as in `judgment`."""
    added = zip(found.planes[given:], found.stds, found.stds[1:], strict=False)
    # Where vertices are many they would count more, and if faces are large, there may be none in a pocket.
    height = found.result.taps.height
    return {
        **({} if height is None else {"height_error": height}),
        "degree": found.result.patch.degree,
        "extent": found.extent,
        "step": found.step,
        **reconstruction_report(found.result, ended),
        "planes": [[math.degrees(plane.azimuth), math.degrees(plane.tilt)] for plane in found.planes],
        "added_planes": [
            {"azimuth": math.degrees(plane.azimuth), "height_std_before": before, "height_std": after}
            for plane, before, after in added
        ],
        "stops": [list(contour.stops) for contour in found.result.contours],
    }


def completed(touched: Touched, most: int | None = None) -> Touched:
    """The touch with the slow parts of its report, too: where to touch next, and distances to the mesh.

    most : the largest number of vertices to compare; None for all
    """
    clock, result, report = [perf_counter()], touched.result, touched.report
    found = _verification_report(touched.surface, result, most)
    clock.append(perf_counter())
    plane = suggestion_report(result, np.array(report["axes"]))
    clock.append(perf_counter())
    seconds = report["seconds"] | dict(zip(("verify", "suggest"), np.diff(clock).tolist(), strict=True))
    found |= {"suggested_plane": plane, "seconds": seconds, **measures(result)}
    return replace(touched, report=report | found)


def require_lengths(name: str, size: float, extent: float, step: float, noise: float) -> None:
    """Raises ValueError for lengths that no touch of an object can have; 0 stands for one not given."""
    if not all(length >= 0.0 for length in (extent, step, noise)):  # NaN fails every comparison.
        raise ValueError(
            f"Extent, step and noise are lengths of 0 or more, got "
            f"{length(extent)}, {length(step)} and {length(noise)}"
        )
    if extent > size:
        raise ValueError(
            f'The extent {length(extent)} is longer than "{name}" ({length(size)}): use a shorter one'
        )
    longest = extent or FARTHEST_SHARE * size
    if step > longest:
        raise ValueError(
            f"The step {length(step)} is longer than the extent {length(longest)}: use a shorter one"
        )
    if noise > longest:
        raise ValueError(
            f"The noise {length(noise)} is larger than the extent {length(longest)}: use a smaller one"
        )


def nearest_point(
    surface: MeshSurface | DetachedMesh, location: Point, farthest: float
) -> tuple[Triple, Triple]:
    """The point of a surface nearest to a location, and the normal there.

    Raises ValueError, with a sentence, if it is farther than `farthest`.
    """
    if not np.isfinite(location).all():
        raise ValueError("The location has coordinates that are not finite: set it on the surface")
    point, normal, distance = surface.project(location)
    if distance > farthest:
        raise ValueError(
            f'The location is {length(distance)} away from "{surface.name}", farther than '
            f"{length(farthest)}: move it to the surface"
        )
    return point, normal


def require_fine(spacing: float, step: float) -> None:
    """Raises ValueError if coordinates that are `spacing` apart are too coarse for the step."""
    if spacing > STEP_ROUNDING * step:
        raise ValueError(
            f"Neighboring coordinates at the point are {length(spacing)} apart in single precision, "
            f"too coarse for a step of {length(step)}: use a longer extent or step, or move the object "
            "nearer to the origin of the world or of its own mesh"
        )


def require_single(what: str, radius: float, place: Array) -> None:
    """Raises ValueError for a surface too large, too small or too far away for Blender's numbers.

    what : a word for it; radius : a length; place : (3,), its middle in the world
    """
    far = float(np.abs(place).max())
    if not (radius >= SMALLEST_SINGLE and radius + far <= LARGEST_SINGLE):
        raise ValueError(
            f"The {what} has a radius of {radius:.3g} and reaches to {radius + far:.3g}, and "
            f"Blender's numbers range from {SMALLEST_SINGLE:g} to {LARGEST_SINGLE:g}: use another "
            "unit of length"
        )
    gap = float(np.spacing(np.float32(far)))
    if gap > PLACE_ROUNDING * radius:
        raise ValueError(
            f"Neighboring coordinates at the {what} are {gap:.2g} apart in single precision, too coarse for "
            f"its radius of {radius:.3g}: move the origin of the contacts nearer to them"
        )


def reference_axes(outward: Point, tangent: Point | None = None) -> Array:
    """Columns e1, n and e1 x n of the planes; e1 follows `tangent`, unless that is along the normal."""
    plane = core.SamplingPlane(0.0)
    try:
        return plane.axes(outward, tangent)
    except ValueError:
        return plane.axes(outward)


def plane_axes(matrix: Any, settings: Any, number: int) -> Array:
    """Columns t, u and t x u of a sampling plane, for drawing; `matrix` is the probe's world matrix.

    See core.SamplingPlane.axes. A tilt that is too steep to touch with is drawn as the steepest.
    """
    tilt = min(max(settings.tilts[number], -STEEPEST), STEEPEST)
    return core.SamplingPlane(settings.azimuths[number], tilt).axes(matrix.col[2].xyz, matrix.col[0].xyz)


def _verification_report(
    surface: MeshSurface | None, result: core.Reconstruction, most: int | None
) -> TouchReport:
    """The report of distances from the patch to the vertices over it that a finger can reach, if any."""
    vertices = surface.vertices_near(result.frame.origin, 2.0 * result.radius, most)
    over = vertices[core.reachable(result.geometry, surface, vertices)]
    misses = core.distances(result.geometry, result.frame.to_local(over))
    if not len(misses):
        return {"vertices": 0}
    return {
        "vertices": len(misses),
        "vertex_distance_mean": float(misses.mean()),
        "vertex_distance_max": float(misses.max()),
    }
