# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The reports of patches and maps as tables and sentences for people; and errors as sentences."""

import bpy

from .units import length, say, unit_of

SPREAD = ("mean", "median", "max", "rms")


def readable(report):
    """Lines of label and value; lengths in the unit of the scene or file."""
    return table(readable_rows(report))


def readable_rows(report):
    """(label, value) of all that a patch has to say."""
    seconds = report["seconds"]
    contacts = _measured_contacts(report) if "curves" in report else _tracked(report)
    return [
        ("touched", report["source"]),
        ("status", f"{report['status']}: {report['message']}"),
        ("fit", f"{report['method']}, degree {report['degree']}"),
        ("contacts", contacts),
        *_lengths(report),
        *([("more planes", added_planes(report, ("", 1.0)))] if report.get("added_planes") else []),
        ("point", _vector(report["frame"]["origin"])),
        ("normal", _vector(report["frame"]["normal"])),
        ("direction d1", _vector(report["frame"]["d1"])),
        ("kappa1, kappa2", f"{_measured(report, 'k1')}, {_measured(report, 'k2')} per unit of length"),
        ("Gaussian curvature", f"{_measured(report, 'gaussian_curvature')} per unit of area"),
        ("mean curvature", f"{_measured(report, 'mean_curvature')} per unit of length"),
        ("shape index", f"{report['shape_index']:.3f}"),
        ("curvedness", f"{report['curvedness']:.5g} per unit of length"),
        ("residual", f"{report['residual']:.4g}, {_share(report, 'residual')} of the radius"),
        ("fit error (6)", f"{report['fit_error']:.4g}, {_share(report, 'fit_error')} of the radius"),
        ("height std", f"{report['height_std']:.4g}, {_share(report, 'height_std')} of the radius"),
        ("mesh to patch", _verification(report)),
        *([("put onto", registration_summary(report["registration"]))] if "registration" in report else []),
        *_verified_rows(report.get("verification")),
        ("suggested next plane", _suggestion(report["suggested_plane"])),
        ("total |K| (8)", f"{report['total_absolute_curvature']:.4g}"),
        ("condition number", f"{report['condition_number']:.2g}"),
        ("milliseconds", ", ".join(f"{name} {1e3 * value:.1f}" for name, value in seconds.items())),
    ]


def added_planes(report, unit):
    """What more planes have brought, in the unit."""
    added = report["added_planes"]
    if not added:
        return "No further plane would help much"
    before, after = (say(added[i][key], 1, unit) for i, key in ((0, "height_std_before"), (-1, "height_std")))
    azimuths = ", ".join(f"{plane['azimuth']:.0f}°" for plane in added)
    return f"Planes added at {azimuths}: ± {before} has become ± {after}"


def _measured_contacts(report):
    kinds = [f"{report[kind]} {kind}" for kind in ("curves", "strokes") if report[kind] or kind == "curves"]
    return f"{report['contacts']} on {' and '.join(kinds)}"


def _tracked(report):
    stops = sorted({stop for pair in report["stops"] for stop in pair})
    return f"{report['contacts']} on {len(report['planes'])} curves, ended by: {', '.join(stops)}"


def _lengths(report):
    """Rows of a touch; for measured curves, how far they miss their common point."""
    if "step" in report:
        lengths = f"{report['step']:.4g}, {report['extent']:.4g}, {report['radius']:.4g}"
        return [("step, extent, radius", lengths)]
    rows = [("unit", report["unit"])] if report["unit"] else []
    rows.append(("radius", f"{report['radius']:.4g}"))
    if "misses" in report:
        rows.append(("curves miss it by", ", ".join(f"{miss:.3g}" for miss in report["misses"])))
    return rows


def table(rows):
    """Labels and values as aligned lines."""
    width = max(len(label) for label, _ in rows)
    return "\n".join(f"{label:<{width}}  {value}" for label, value in rows)


def sentence(error):
    """The words of an exception, as a sentence begins, in one line: names may hold more."""
    words = " ".join(str(error).split())
    return words[:1].upper() + words[1:]


def fit_summary(report):
    """The fit in a sentence: its status, the curvatures, and how far its contacts are missed."""
    unit = unit_of(bpy.context.scene, report["radius"])
    return (
        f"{report['message']} Curvatures {say(report['k1'], -1, unit)} and {say(report['k2'], -1, unit)}, "
        f"{report['contacts']} contacts missed by {length(report['fit_error'])} in the mean"
    )


def _verification(report):
    if "curves" in report:
        return "there is none"
    if not report["vertices"]:
        return "no vertex of the mesh lies over the patch"
    share = _share(report, "vertex_distance_mean")
    return (
        f"mean {report['vertex_distance_mean']:.4g}, {share} of the radius; "
        f"max {report['vertex_distance_max']:.4g}; {report['vertices']} vertices"
    )


def _verified_rows(found):
    """What is not in the report without it."""
    if found is None:
        return []
    names = [name for name in ("vertex", "contact") if f"{name}_distance_mean" in found]
    more = f"{found['extra_fit_error']:.4g}, " if "extra_fit_error" in found else ""
    return [
        *(
            (f"{name} distances", ", ".join(f"{key} {found[f'{name}_distance_{key}']:.4g}" for key in SPREAD))
            for name in names
        ),
        ("(6) on more curves", f"{more}{found['extra_points']} points on {found['extra_contours']} curves"),
        ("overlap", f"{100.0 * found['overlap']:.0f} % of the area"),
    ]


def registration_summary(found):
    """Where a patch was put, in a sentence."""
    residual = found["residuals"][found["pose"] - 1]
    words = f'The contacts are {length(residual)} off "{found["target"]}" (root mean square)'
    if not found["is_ambiguous"]:
        return words
    return f"{words}; others of its {len(found['residuals'])} poses are about as good"


def _suggestion(plane):
    return (
        f"azimuth {plane['azimuth']:.0f} degrees, along {_vector(plane['tangent'])}; "
        f"would take height std to {plane['expected_height_std']:.4g}"
    )


def _vector(v):
    return " ".join(f"{x:.5g}" for x in v)


def _measured(report, key):
    return f"{report[key]:.5g} ± {report[key + '_std']:.2g}"


def _share(report, key):
    return f"{100.0 * report[key] / report['radius']:.2f} %"
