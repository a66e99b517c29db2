# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The report of a touch: a dict of plain values, including its message.

The values are such as JSON can hold, or ID properties of a patch object. Lengths are in units of the world,
curvatures in their inverse, angles in degrees; a `_std` is a standard deviation. A report has each key once
it is known. After every fit:

status, message, doubts : see core.Reconstruction and core.Doubt.to_dict, the gravest first; the status is
    "outdated" if the patch is from an earlier touch
ended : a sentence on what has ended the curves, which is part of the message
is_verified : whether the report has the keys that take long
frame : the Darboux frame in the world: origin, d1, d2 and normal, three numbers each
k1, k2, gaussian_curvature, mean_curvature : at the point, each with its `_std`
shape_index, curvedness : at the point
facet_std : the part of the deviations of curvatures that few facets make
residual : the amplitude of the process that is added to the polynomial
coefficients, radius : those of equation (1)
contacts, fit_error : their number, and equation (6)
height_std : the mean over the domain
blind : the number of ways to bend that the planes cannot show
source : the name of the object that was touched, or of the file of the contacts
method, degree, seconds : of the fit; the seconds of each step
axes : (3, 3), see core.SamplingPlane.axes

After a touch:

object_size : the longest edge of the bounding box
extent, step, noise, seed : those in use
planes : the azimuth and the tilt of each
added_planes : azimuth, height_std_before and height_std of each plane that the touch has added
stops : why each curve ended, at its start and at its end
height_error : the mean distance in height from the mesh, over the domain

After a fit to measured contacts:

unit, curves, strokes, given_contacts : the unit's name, and the numbers of what the files have
misses : how far the curves miss their common point

Once a gesture has ended:

height_std_rim : the largest one on the boundary of the domain
area, total_absolute_curvature, condition_number : of the domain, (7), and of plain least squares
vertices, vertex_distance_mean, vertex_distance_max : of the mesh, over the patch
suggested_plane : azimuth, tangent in the world, and expected_height_std with it
patch : the name of the patch object
color_limit : where the colors end

After registration and verification:

registration : target, pose from 1 on, residuals and nearest vertices of all poses, is_ambiguous
verification : the name of the mesh as `target`, and what core.verify has found
"""

import math
from collections import Counter
from collections.abc import Sequence
from typing import Any, TypeAlias

from ... import core
from .types import Array

RIM_POINTS = 48  # The deviation of the height is looked at in this many places of the boundary.
AT_POINT = 1e-6  # A half curve that is shorter than this share of the radius ends at the point.
TouchReport: TypeAlias = dict[str, Any]  # The module's docstring has its keys.


def ends(contours: Sequence[core.Contour], has_extent: bool) -> str:
    """A sentence on what ended half curves, or, if an extent was given, those that end before it; or ""."""
    counts = Counter(stop for contour in contours for stop in contour.stops)
    if has_extent:
        del counts[core.EXTENT]
    elif len(counts) == 1:
        return f" All half curves end {core.WHERE[next(iter(counts))]}."
    if not counts:
        return ""
    (first, most), *others = counts.most_common()
    words = [f"{most} of {2 * len(contours)} half curves ended {core.WHERE[first]}"]
    words += [f"{count} {core.WHERE[stop]}" for stop, count in others]
    return f" {', '.join(words)}{', before the extent' if has_extent else ''}."


def judgment(result: core.Reconstruction, ended: str) -> TouchReport:
    """The verdict of a fit; `ended` is added to the fit's own message.

    On a crease or an edge a patch may fit one side. A stability map has none there, so it is in doubt.
    """
    doubts, message = result.doubts, f"{result.message}{ended}"
    if stops := core.stops_at(result.contours, result.frame.origin, AT_POINT * result.radius):
        where = core.WHERE[Counter(stops).most_common(1)[0][0]]
        doubts = (core.Doubt("at_edge", len(stops), words=(where,)), *doubts)
        message = str(doubts[0])
    return verdict_report(doubts, message) | {"message": message}


def verdict_report(doubts: Sequence[core.Doubt], message: str) -> TouchReport:
    """The verdict with these doubts, the gravest first; the message is for where there is none."""
    return {
        "status": core.status_of(next(iter(doubts), None)),
        "message": str(doubts[0]) if doubts else message,
        "doubts": [doubt.to_dict() for doubt in doubts],
    }


def suggestion_report(result: core.Reconstruction, reference: Array) -> dict[str, Any]:
    """The plane that would lower the mean deviation most, its azimuth as of planes, and that deviation."""
    e1, outward = reference[:, 0], reference[:, 1]
    plane, expected = core.suggest_plane(result, outward, e1)
    return {
        "azimuth": math.degrees(plane.azimuth),
        "tangent": plane.axes(outward, e1)[:, 0].tolist(),
        "expected_height_std": expected,
    }


def measures(result: core.Reconstruction) -> TouchReport:
    """The parts of a report that take long or matter only once a gesture has ended."""
    rim = result.domain.boundary(RIM_POINTS)
    return {
        "height_std_rim": float(result.height_std(*rim.T).max()),
        "area": result.domain.area,
        "total_absolute_curvature": result.total_absolute_curvature,
        "condition_number": result.condition_number,
        "is_verified": True,
    }


def reconstruction_report(result: core.Reconstruction, ended: str = "") -> TouchReport:
    """The report of a fit before it is compared with a mesh; arguments as in `judgment`."""
    (d1, d2, n), at_point = result.frame.axes.T.tolist(), result.patch.derivatives(0.0, 0.0)
    return {
        **judgment(result, ended),
        "ended": ended,
        "is_verified": False,
        "frame": {"origin": result.frame.origin.tolist(), "d1": d1, "d2": d2, "normal": n},
        "k1": result.patch.k1,
        "k2": result.patch.k2,
        "gaussian_curvature": float(at_point.gaussian_curvature),
        "mean_curvature": float(at_point.mean_curvature),
        "k1_std": result.k1_std,
        "k2_std": result.k2_std,
        "gaussian_curvature_std": result.gaussian_curvature_std,
        "mean_curvature_std": result.mean_curvature_std,
        "shape_index": float(at_point.shape_index),
        "curvedness": float(at_point.curvedness),
        "facet_std": result.facet_std,
        "residual": result.radius * result.posterior.amplitude,
        "coefficients": result.patch.coefficients.tolist(),
        "radius": result.radius,
        "contacts": len(result.contacts),
        "fit_error": result.fit_error,
        "height_std": result.mean_height_std,
        "blind": result.null_space_dimension,
    }
