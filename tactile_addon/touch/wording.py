# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Reports of patches as tables and sentences for people, and errors as sentences."""

from collections.abc import Iterable, Iterator, Mapping
from typing import Any

import numpy as np

from ... import core
from ...core.arguments import many
from .settings import METHODS
from .touch_report import TouchReport
from .types import Point
from .units import known, rounded, say_of, unit_of_report

SPREAD = ("mean", "median", "max", "rms")
FORMULAS = ("=", "+", "-", "@", "\t", "\r", "\n")  # Spreadsheets run text that begins with one of these.
# A curvature is uncertain if its deviation is larger than itself and than this share of 1 / radius: those of
# flat faces and cylinders, whose 0 is well known, are below .02, those of bends that noise hides up to .6.
UNCERTAIN = 0.1
ROUNDING = 1e-6  # A component below this share of the largest is what single precision leaves of 0.
FLAT_DEVIATIONS = 2.0  # A curvature within this many deviations of 0 has no radius.
FLATTEST = 1e-3  # Nor has one whose radius is a thousand times the patch's.


def readable_rows(report: TouchReport) -> list[tuple[str, str]]:
    """(label, value) of everything there is to say of a patch, with lengths in the unit of scene or file."""
    contacts = _measured_contacts(report) if "curves" in report else _tracked(report)
    texture = _shared(report, "residual") if report["residual"] else "none"
    total = rounded(report["total_absolute_curvature"], 0, report["radius"])
    return [
        ("touched", report["source"]),
        ("verdict", f"{verdict(report)}. {report['message']}"),
        ("fit", fit(report)),
        ("contacts", contacts),
        *_lengths(report),
        *([("more planes", added_planes(report))] if report.get("added_planes") else []),
        ("point", place(report["frame"]["origin"], report)),
        ("normal", vector(report["frame"]["normal"])),
        ("first principal direction", vector(report["frame"]["d1"])),
        ("principal curvatures", ", ".join(measured(report, key, -1) for key in ("k1", "k2"))),
        ("Gaussian curvature", measured(report, "gaussian_curvature", -2)),
        ("mean curvature", measured(report, "mean_curvature", -1)),
        ("shape index", "none, it is flat" if is_flat(report) else f"{report['shape_index']:.3f}"),
        ("curvedness", said(report, "curvedness", -1)),
        ("texture beside the polynomial", texture),
        ("contacts off the patch, mean", _shared(report, "fit_error")),
        ("standard deviation of the height", _shared(report, "height_std")),
        ("mesh to patch", _verification(report)),
        *_verified_rows(report),
        ("suggested next plane", _suggestion(report)),
        ("total absolute curvature", f"{total:.4g}"),
        ("condition number", f"{report['condition_number']:.2g}"),
        ("milliseconds", ", ".join(f"{name} {1e3 * value:.1f}" for name, value in report["seconds"].items())),
    ]


def fit(report: Mapping[str, Any]) -> str:
    """How a touch or a map is fitted, as the panel names it, such as "Bayesian, degree 6"."""
    name = next(label for name, label, _ in METHODS if name == report["method"])
    return f"{name}, degree {report['degree']}"


def verdict(report: TouchReport) -> str:
    """A sentence on whether a patch is good, and what to do if it is not."""
    if report["status"] == "outdated":
        return "Outdated: touch again"
    if report["doubts"]:
        return f"Doubtful: {report['doubts'][0]['advice']}"
    height = say_of(report, report["height_std"])
    if wants_facets_finer(report):
        return "Good on facets: subdivide the mesh if the shape is smooth"
    if _uncertain_stds(report):
        return f"Good heights, to ± {height}; curvatures are uncertain"
    return f"Good: heights to ± {height}"


def wants_facets_finer(report: Mapping[str, Any]) -> bool:
    """Whether facets are too few for what the verdict is about, so that a Subdivision modifier may help."""
    is_advised = any(core.SUBDIVIDE in doubt["advice"] for doubt in report["doubts"])
    by_facets = (2.0 * report.get("facet_std", 0.0) ** 2 > std**2 for std in _uncertain_stds(report))
    return is_advised or any(by_facets)


def _uncertain_stds(report: Mapping[str, Any]) -> list[float]:
    """The deviations of those principal curvatures that these leave nothing of."""
    stds = ((abs(report[key]), report[f"{key}_std"]) for key in ("k1", "k2"))
    return [std for curvature, std in stds if std > max(curvature, UNCERTAIN / report["radius"])]


def reasons(report: Mapping[str, Any]) -> list[str]:
    """Sentences on what the verdict rests on: the message, and each doubt that is not in it."""
    others = (f"{doubt['sentence']}: {doubt['advice']}." for doubt in report["doubts"][1:])
    return [report["message"], *others]


def is_flat(report: Mapping[str, Any]) -> bool:
    """Whether both principal curvatures are 0 to the digits that are known of them."""
    radius = report["radius"]
    return not any(known(rounded(report[key], -1, radius), report[f"{key}_std"]) for key in ("k1", "k2"))


def added_planes(report: TouchReport) -> str:
    """A sentence on what added planes have brought."""
    added = report["added_planes"]
    if not added:
        return "One more plane would not help much"
    before, after = (say_of(report, std) for std in (added[0]["height_std_before"], added[-1]["height_std"]))
    azimuths = ", ".join(f"{plane['azimuth']:.0f}°" for plane in added)
    return f"Planes added at {azimuths}: ± {before} has become ± {after}"


def _measured_contacts(report: TouchReport) -> str:
    """How many measured contacts there are on how many curves and strokes, and how many were fitted."""
    numbers = [(report[kind], kind) for kind in ("curves", "strokes") if report[kind]]
    kinds = " and ".join(many(number, kind[:-1], kind) for number, kind in numbers)
    given, fitted = report.get("given_contacts", 0), report["contacts"]
    if given <= fitted:  # The point of the file is one more.
        return f"{fitted} on {kinds}"
    return f"{given} on {kinds}, fitted as {fitted}"


def _tracked(report: TouchReport) -> str:
    """How many contacts a touch has on how many curves, and where these end."""
    stops = sorted({stop for pair in report["stops"] for stop in pair})
    where = ", ".join(core.WHERE.get(stop, stop) for stop in stops)
    return f"{report['contacts']} on {len(report['planes'])} curves, which end {where}"


def _lengths(report: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Rows with the lengths of a touch; for measured curves, how far they miss their common point."""
    names = [name for name in ("step", "extent", "radius") if name in report]
    rows = [(", ".join(names), ", ".join(say_of(report, report[name]) for name in names))]
    if "misses" in report:
        rows.append(("curves miss it by", ", ".join(_length(miss, report) for miss in report["misses"])))
    return rows


def table(rows: Iterable[tuple[str, str]]) -> str:
    """Labels and values as aligned lines."""
    width = max(len(label) for label, _ in rows)
    return "\n".join(f"{label:<{width}}  {value}" for label, value in rows)


def sentence(error: Exception) -> str:
    """The message of an exception as a sentence in one line; names in it may have more lines."""
    words = " ".join(str(error).split())
    return words[:1].upper() + words[1:]


def curvatures(report: Mapping[str, Any]) -> str:
    """Both principal curvatures, such as "-2 and 0.5 1/m", or that they are not certain."""
    first, second = (say_of(report, known(report[key], report[f"{key}_std"]), -1) for key in ("k1", "k2"))
    return "not certain" if _uncertain_stds(report) else f"{first.partition(' ')[0]} and {second}"


def _verification(report: TouchReport) -> str:
    """The distances of the mesh's vertices from the patch in words, if there are any."""
    if "curves" in report:
        return "there is none"
    if not report["vertices"]:
        return "no vertex of the mesh lies over the patch"
    mean, farthest = (
        _shared(report, "vertex_distance_mean"),
        _length(report["vertex_distance_max"], report),
    )
    return f"mean {mean}; largest {farthest}; {many(report['vertices'], 'vertex', 'vertices')}"


def _verified_rows(report: TouchReport) -> list[tuple[str, str]]:
    """Rows on the registration onto a mesh and the verification against it, which only some reports have."""
    found, rows = report.get("verification"), []
    if "registration" in report:
        rows.append(("put onto", registration_summary(report)))
    if found is None:
        return rows
    names = [name for name in ("vertex", "contact") if f"{name}_distance_mean" in found]
    more = f"{_length(found['extra_fit_error'], report)}, " if "extra_fit_error" in found else ""
    points = many(found["extra_points"], "point", "points")
    curves = many(found["extra_contours"], "curve", "curves")
    return [
        *rows,
        *((f"{name} distances", _spread(report, f"{name}_distance")) for name in names),
        ("distance on more curves", f"{more}{points} on {curves}"),
        ("overlap", f"{100.0 * found['overlap']:.0f} % of the area"),
    ]


def registration_summary(report: TouchReport) -> str:
    """A sentence on where a patch was put by registration."""
    found = report["registration"]
    residual = say_of(report, found["residuals"][found["pose"] - 1])
    words = f'The contacts are {residual} off "{found["target"]}" (root mean square)'
    if not found["is_ambiguous"]:
        return words
    return f"{words}; others of its {len(found['residuals'])} poses are about as good"


def _spread(report: TouchReport, what: str) -> str:
    """Mean, median, largest and root mean square of distances of the verification in words."""
    found = report["verification"]
    return ", ".join(f"{key} {_length(found[f'{what}_{key}'], report)}" for key in SPREAD)


def _suggestion(report: TouchReport) -> str:
    plane = report["suggested_plane"]
    return (
        f"azimuth {plane['azimuth']:.0f} degrees, along {vector(plane['tangent'])}; "
        f"would take the standard deviation of the height to {say_of(report, plane['expected_height_std'])}"
    )


def vector(v: Iterable[float]) -> str:
    """Components in words; those that are mere rounding compared with the largest are 0."""
    components = list(v)
    rounding = ROUNDING * max(map(abs, components))
    return " ".join(f"{x if abs(x) > rounding else 0.0:.5g}" for x in components)


def place(point: Point, report: Mapping[str, Any]) -> str:
    """A place of the world in words."""
    name, size = unit_of_report(report)
    return f"{vector(np.divide(point, size))} {name}".rstrip()


def measured(report: Mapping[str, Any], key: str, power: int) -> str:
    """A value of the report, which is in length^power, in words with its standard deviation."""
    return say_of(report, rounded(report[key], power, report["radius"]), power, report[f"{key}_std"])


def said(report: Mapping[str, Any], key: str, power: int) -> str:
    """A value of the report, which is in length^power, in words."""
    return say_of(report, rounded(report[key], power, report["radius"]), power)


def _shared(report: Mapping[str, Any], key: str) -> str:
    """A length of the report in words, with its share of the radius."""
    return f"{said(report, key, 1)}, {100.0 * report[key] / report['radius']:.2f} % of the radius"


def _length(value: float, report: Mapping[str, Any]) -> str:
    """A length of the report in words, as `rounded` has it."""
    return say_of(report, rounded(value, 1, report["radius"]))


def main_rows(record: Mapping[str, Any]) -> list[tuple[str, str]]:
    """(label, value) of the numbers that the sidebar shows at first, the principal curvatures."""
    return [(label, measured(record, key, -1)) for label, key in (("κ1", "k1"), ("κ2", "k2"))]


def other_rows(record: Mapping[str, Any]) -> list[tuple[str, str]]:
    """(label, value) of all others that it shows."""
    rim = record.get("height_std_rim")
    rows = [
        ("Height", f"± {say_of(record, record['height_std'])}"),
        ("At the Rim", "…" if rim is None else f"± {say_of(record, rim)}"),
        ("Deviation", said(record, "height_error", 1) if "height_error" in record else "–"),
        *_radii(record),
        ("K Gaussian", measured(record, "gaussian_curvature", -2)),
        ("H Mean", measured(record, "mean_curvature", -1)),
        ("Shape Index", "–" if is_flat(record) else f"{record['shape_index']:.2f}"),
        ("Curvedness", said(record, "curvedness", -1)),
        ("Fit Error", said(record, "fit_error", 1)),
    ]
    if record["is_verified"] and record["vertices"]:
        rows.append(("Farthest", said(record, "vertex_distance_max", 1)))
    for key in ("extent", "step") if "step" in record else ("radius",):
        rows.append((key.title(), say_of(record, record[key])))
    return [*rows, ("Degree", str(record["degree"])), ("Contacts", str(record["contacts"]))]


def plane_rows(record: TouchReport) -> list[tuple[str, str]]:
    """(label, value) of the plane that would lower the deviation most, once it is known."""
    if not record["is_verified"]:
        return []
    plane = record["suggested_plane"]
    return [
        ("Suggested Plane", f"{plane['azimuth']:.0f}°"),
        ("Expected Accuracy with It", f"± {say_of(record, plane['expected_height_std'])}"),
    ]


def _radii(record: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    """Rows of the radii 1 / kappa, with their deviations, if the curvatures are known not to be 0."""
    for number in (1, 2):
        k, std = record[f"k{number}"], record[f"k{number}_std"]
        if abs(k) > FLAT_DEVIATIONS * std and abs(k) * record["radius"] > FLATTEST:
            yield f"1/κ{number}", say_of(record, 1.0 / k, std=std / k**2)


def cell(words: str) -> str:
    """Words as a cell of a table that no spreadsheet takes for a formula."""
    return f"'{words}" if words.startswith(FORMULAS) else words
