# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What a patch keeps of its touch: a dict of plain values, its message included."""

import math
from collections import Counter

from .. import core

BEYOND = 3.0  # times its own deviation, that a patch may be off the mesh in the mean
ENDS = {
    core.UNEXPLAINED: "where the patch could not be trusted any more",
    core.EXTENT: "at the greatest extent allowed",
    core.NO_CONTACT: "at an edge",
    core.CREASE: "at a crease",
    core.NOT_MONGE: "where the surface turns away",
}


def ends(contours):
    """A sentence on what has ended curves that were free to grow."""
    counts = Counter(stop for contour in contours for stop in contour.stops).most_common()
    if len(counts) == 1:
        return f" All half curves end {ENDS[counts[0][0]]}."
    (most, first), *others = [(count, ENDS[stop]) for stop, count in counts]
    words = [f"{most} end {first}", *(f"{count} {end}" for count, end in others)]
    return f" Of {2 * len(contours)} half curves {', '.join(words)}."


def judgement(report, mean, scale=1.0):
    """Status and message: the fit's own, unless it has no doubt and the mesh contradicts it.

    mean : distance of the mesh; scale : of a patch that was scaled since its report
    """
    std, percent = scale * report["height_std"], 100.0 / (scale * report["radius"])
    if report["fit"]["status"] != "ok" or mean <= BEYOND * std:
        return report["fit"]
    return {
        "status": "uncertain",
        "message": f"The mesh is {percent * mean:.3g} % of the radius off the patch in the mean, which "
        f"expects {percent * std:.3g} %, for between the curves there is what they do not show: take a "
        "shorter extent, or add sampling planes.",
    }


def suggestion_report(result, reference):
    """The plane that would tell most, as an azimuth like those of `planes`, and what it would bring."""
    plane, expected = core.suggest_plane(result)
    d1, _, n = result.frame.axes.T
    tangent = plane.axes(n, d1)[:, 0]
    return {
        "azimuth": math.degrees(core.azimuth_of(tangent, reference[:, 1], reference[:, 0])),
        "tangent": tangent.tolist(),
        "expected_height_std": expected,
    }


def reconstruction_report(result, ended=""):
    """Of a fit; `ended` is added to its message."""
    message = result.message + ended
    d1, d2, n = result.frame.axes.T.tolist()
    return {
        "status": result.status,
        "message": message,
        "fit": {"status": result.status, "message": message},  # a mesh may say otherwise
        "frame": {"origin": result.frame.origin.tolist(), "d1": d1, "d2": d2, "normal": n},
        "k1": result.patch.k1,
        "k2": result.patch.k2,
        "gaussian_curvature": float(result.patch.gaussian_curvature(0.0, 0.0)),
        "mean_curvature": float(result.patch.mean_curvature(0.0, 0.0)),
        "coefficients": result.patch.coefficients.tolist(),
        "radius": result.radius,
        "ends": result.domain.ends.tolist(),
        "points": result.contacts.tolist(),
        "area": result.domain.area,
        "contacts": len(result.contacts),
        "fit_error": result.fit_error,
        "height_std": result.mean_height_std,
        "blind": result.blind,
        "total_absolute_curvature": result.total_absolute_curvature,
        "condition_number": result.condition_number,
    }
