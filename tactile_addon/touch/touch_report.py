# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What is said of a touch: a dict of plain values, its message included."""

import math
from collections import Counter

from ... import core

BEYOND = 3.0  # times its own deviation, that a patch may be off the mesh in the mean
CURVATURES = ("k1", "k2", "gaussian_curvature", "mean_curvature")
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
    return f" Of {2 * len(contours)} half curves {_counted(counts)}."


def early_ends(contours):
    """A sentence on what has ended curves before the extent that was asked for; empty where nothing has."""
    counts = Counter(stop for contour in contours for stop in contour.stops)
    del counts[core.EXTENT]
    if not counts:
        return ""
    return f" Of {2 * len(contours)} half curves {_counted(counts.most_common())}, before the extent."


def _counted(counts):
    (most, first), *others = [(count, ENDS[stop]) for stop, count in counts]
    return ", ".join([f"{most} end {first}", *(f"{count} {end}" for count, end in others)])


def judgment(result, mean, ended):
    """Status and message: the fit's own, unless it has no doubt and the mesh contradicts it.

    mean : distance of the mesh; ended : what is added to the fit's own message
    """
    std, percent = result.mean_height_std, 100.0 / result.radius
    if result.status != "ok" or mean <= BEYOND * std:
        return {"status": result.status, "message": result.message + ended}
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


def measures(result):
    """What else there is to say of a fit, which is dear, or of interest only once a gesture has ended."""
    return {
        "area": result.domain.area,
        "total_absolute_curvature": result.total_absolute_curvature,
        "condition_number": result.condition_number,
        "is_verified": True,
    }


def reconstruction_report(result, ended=""):
    """The report of a fit; `ended` is added to its message. Nothing of a mesh is known yet."""
    d1, d2, n = result.frame.axes.T.tolist()
    return {
        **judgment(result, 0.0, ended),
        "ended": ended,
        "is_verified": False,
        "frame": {"origin": result.frame.origin.tolist(), "d1": d1, "d2": d2, "normal": n},
        "k1": result.patch.k1,
        "k2": result.patch.k2,
        "gaussian_curvature": float(result.patch.gaussian_curvature(0.0, 0.0)),
        "mean_curvature": float(result.patch.mean_curvature(0.0, 0.0)),
        **{f"{name}_std": getattr(result, f"{name}_std") for name in CURVATURES},
        "residual": 0.0 if result.residual is None else result.radius * result.residual.size,
        "coefficients": result.patch.coefficients.tolist(),
        "radius": result.radius,
        "contacts": len(result.contacts),
        "fit_error": result.fit_error,
        "height_std": result.mean_height_std,
        "blind": result.blind,
    }
