# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The report of a touch: a dict of plain values, including its message."""

import math
from collections import Counter

from ... import core

CURVATURES = ("k1", "k2", "gaussian_curvature", "mean_curvature")


def ends(contours):
    """A sentence on what has ended curves that were free to grow."""
    counts = Counter(stop for contour in contours for stop in contour.stops).most_common()
    if len(counts) == 1:
        return f" All half curves end {core.WHERE[counts[0][0]]}."
    return f" {_counted(counts, 2 * len(contours))}."


def early_ends(contours):
    """A sentence on what has ended curves before the extent that was asked for, or ""."""
    counts = Counter(stop for contour in contours for stop in contour.stops)
    del counts[core.EXTENT]
    if not counts:
        return ""
    return f" {_counted(counts.most_common(), 2 * len(contours))}, before the extent."


def _counted(counts, total):
    (most, first), *others = [(count, core.WHERE[stop]) for stop, count in counts]
    return ", ".join(
        [f"{most} of {total} half curves end {first}", *(f"{count} {end}" for count, end in others)]
    )


def judgment(result, mean, ended, few_facets=False):
    """Status and message, see core.judged_by_mesh; `ended` is added to the fit's own message.

    few_facets : see core.has_few_facets
    """
    status, message = core.judged_by_mesh(result, mean)
    found = {"status": status, "message": message + (ended if message == result.message else "")}
    if not few_facets:
        return found
    return {
        "status": "uncertain" if status == "ok" else status,
        "message": "The curves lie on so few facets that the curvature is that of the facets, not of the "
        f"shape: add a Subdivision modifier if the mesh stands for a smooth shape. {found['message']}",
    }


def suggestion_report(result, reference):
    """The plane that would tell most, with an azimuth like those of the planes, and what it would bring."""
    e1, outward = reference[:, 0], reference[:, 1]
    plane, expected = core.suggest_plane(result, outward, e1)
    return {
        "azimuth": math.degrees(plane.azimuth),
        "tangent": plane.axes(outward, e1)[:, 0].tolist(),
        "expected_height_std": expected,
    }


def measures(result):
    """The parts of a report that take long or matter only once a gesture has ended."""
    return {
        "area": result.domain.area,
        "total_absolute_curvature": result.total_absolute_curvature,
        "condition_number": result.condition_number,
        "is_verified": True,
    }


def reconstruction_report(result, ended="", few_facets=False):
    """The report of a fit before it is compared with a mesh; arguments as in `judgment`."""
    (d1, d2, n), at_point = result.frame.axes.T.tolist(), result.patch.derivatives(0.0, 0.0)
    return {
        **judgment(result, 0.0, ended, few_facets),
        "few_facets": few_facets,
        "ended": ended,
        "is_verified": False,
        "frame": {"origin": result.frame.origin.tolist(), "d1": d1, "d2": d2, "normal": n},
        "k1": result.patch.k1,
        "k2": result.patch.k2,
        "gaussian_curvature": float(at_point.gaussian_curvature),
        "mean_curvature": float(at_point.mean_curvature),
        **{f"{name}_std": getattr(result, f"{name}_std") for name in CURVATURES},
        "shape_index": float(at_point.shape_index),
        "curvedness": float(at_point.curvedness),
        "residual": result.radius * result.posterior.amplitude,
        "coefficients": result.patch.coefficients.tolist(),
        "radius": result.radius,
        "contacts": len(result.contacts),
        "fit_error": result.fit_error,
        "height_std": result.mean_height_std,
        "blind": result.blind,
    }
