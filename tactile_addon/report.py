# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The report of a reconstruction as a table for people, and errors as sentences."""


def readable(report):
    """Lines of label and value; lengths in the unit of the scene or file."""
    seconds = report["seconds"]
    contacts = (
        f"{report['contacts']} on {report['curves']} curves" if "curves" in report else _tracked(report)
    )
    rows = [
        ("touched", report["source"]),
        ("status", f"{report['status']}: {report['message']}"),
        ("fit", f"{report['method']}, degree {report['degree']}"),
        ("contacts", contacts),
        *_lengths(report),
        ("point", _vector(report["frame"]["origin"])),
        ("normal", _vector(report["frame"]["normal"])),
        ("direction d1", _vector(report["frame"]["d1"])),
        ("kappa1, kappa2", f"{report['k1']:.5g}, {report['k2']:.5g} per unit of length"),
        ("Gaussian curvature", f"{report['gaussian_curvature']:.5g} per unit of area"),
        ("mean curvature", f"{report['mean_curvature']:.5g} per unit of length"),
        ("fit error (6)", f"{report['fit_error']:.4g}, {_share(report, 'fit_error')} of the radius"),
        ("height std", f"{report['height_std']:.4g}, {_share(report, 'height_std')} of the radius"),
        ("mesh to patch", _verification(report)),
        ("suggested next plane", _suggestion(report["suggested_plane"])),
        ("total |K| (8)", f"{report['total_absolute_curvature']:.4g}"),
        ("condition number", f"{report['condition_number']:.2g}"),
        ("milliseconds", ", ".join(f"{name} {1e3 * value:.1f}" for name, value in seconds.items())),
    ]
    return _table(rows)


def _tracked(report):
    stops = sorted({stop for pair in report["stops"] for stop in pair})
    return f"{report['contacts']} on {len(report['planes'])} curves, ended by: {', '.join(stops)}"


def _lengths(report):
    """Those of a touch; of measured curves, how far they miss their common point."""
    if "step" in report:
        lengths = f"{report['step']:.4g}, {report['extent']:.4g}, {report['radius']:.4g}"
        return [("step, extent, radius", lengths)]
    rows = [("unit", report["unit"])] if report["unit"] else []
    rows.append(("radius", f"{report['radius']:.4g}"))
    if "misses" in report:
        rows.append(("curves miss it by", ", ".join(f"{miss:.3g}" for miss in report["misses"])))
    return rows


def map_readable(record):
    """The same of a stability map."""
    refused = ", ".join(f"{key} {count}" for key, count in record["refused"].items())
    names = [key for key in record if key.endswith("_median")]
    return _table(
        [
            ("touched", f"{record['source']}, at {record['touched']} of {record['points']} points"),
            ("patches", f"{record['patches']}, {record['in_doubt']} of them in doubt"),
            ("refused", refused),
            ("fit", f"{record['method']}, degree {record['degree']}"),
            ("spacing, extent, step", ", ".join(f"{record[k]:.4g}" for k in ("spacing", "extent", "step"))),
            *((f"median {name.removesuffix('_median')}", f"{record[name]:.4g}") for name in names),
        ]
    )


def _table(rows):
    width = max(len(label) for label, _ in rows)
    return "\n".join(f"{label:<{width}}  {value}" for label, value in rows)


def map_summary(record):
    """What a stability map has found, in a sentence."""
    words = [f"{record['patches']} patches at {record['touched']} points, {record['in_doubt']} in doubt"]
    words += [f"{count} refused by {key}" for key, count in record["refused"].items() if count]
    return "; ".join(words)


def sentence(error):
    """The words of an exception, as a sentence begins, in one line: names may hold more."""
    words = " ".join(str(error).split())
    return words[:1].upper() + words[1:]


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


def _suggestion(plane):
    return (
        f"azimuth {plane['azimuth']:.0f} degrees, along {_vector(plane['tangent'])}; "
        f"would take height std to {plane['expected_height_std']:.4g}"
    )


def _vector(v):
    return " ".join(f"{x:.5g}" for x in v)


def _share(report, key):
    return f"{100.0 * report[key] / report['radius']:.2f} %"
