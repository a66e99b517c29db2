# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The numbers that the pages promise are those of the code and of the charts."""

import ast
import csv
import math
import re
import tomllib
from pathlib import Path

import pytest
from hypothesis import settings

from core import verdict
from core.atlas import curvature, object_atlas, samples, touching
from core.atlas import measured as atlas_measured
from core.bayes import bends, evidence, joint_fit, kernel, posterior, prior, process_fit
from core.contact_data import comments
from core.contours import common_point, curves, finger, local_geometry, thinning
from core.exploration import extent, taps
from core.paper import by_method, tagc
from core.patch import domain, monge
from core.reconstruction import explained, result, serialization, status

ROOT = Path(__file__).parents[1]
SMALL = 0.005  # The share of the radius below which the page on failures has the median error.


def degrees(cosine):
    return math.degrees(math.acos(cosine))


def of(module, name):
    """A number of a module that needs Blender or Dask, read from its text."""
    tree = ast.parse((ROOT / f"{module}.py").read_text(encoding="utf-8"))
    for node in tree.body:
        targets = node.targets if isinstance(node, ast.Assign) else []
        names = [each.id for target in targets for each in ast.walk(target) if isinstance(each, ast.Name)]
        if name in names:
            value = eval(compile(ast.Expression(node.value), module, "eval"), {"math": math})
            return value[names.index(name)] if isinstance(value, tuple) else value
    raise AttributeError(name)


def of_toml(file, *keys):
    """The number in the words at these keys of a file, such as 3.11 in ">=3.11"."""
    found = tomllib.loads((ROOT / file).read_text(encoding="utf-8"))
    for key in keys:
        found = found[key]
    return float(re.search(r"\d+\.\d+", found)[0])


# A page, the words around each number there, and the numbers of the code. WORDS has # for a number.
PROMISES = [
    ("methods", "a turn of more than #° between contacts", degrees(finger.MAX_TURN)),
    ("methods", "tilts by more than #° against the normal", degrees(finger.MAX_TILT)),
    ("methods", "fitted to the ten contacts nearest", curves.WINDOW / 10),
    ("methods", "degree d is 2 to #", monge.DEGREE),
    ("methods", "some # points over D", domain.GRID),
    ("methods", "goes to 0 in fourteen steps", len(tagc.ROUNDINGS) / 14),
    ("methods", r"$\lambda L^2 = #$", by_method.WEIGHTS["tagc"]),
    ("methods", "A weight of #e5 comes near", by_method.WEIGHTS["quadratic-variation"] / 1e5),
    ("methods", r"w^{\,i+j-1}}{#}", 1.0 / prior.PRIOR_SCALE),
    ("methods", "at the lengths # and", kernel.LENGTHS[0]),
    ("methods", "at the lengths 0.4 and #.", kernel.LENGTHS[1]),
    ("methods", "the prior N(log #,", prior.USUAL_WAVINESS),
    ("methods", "the prior N(log 0.6, #²)", evidence.WAVINESS_SPREAD),
    ("methods", "counts with the power #,", evidence.POWER),
    ("methods", "by more than # times their noise", process_fit.UNEXPLAINED_MISFIT),
    ("methods", "a surface with g has odds of a fifth or more", 5 * evidence.ODDS),
    ("methods", "median of those distances is more than # % of the radius", 100 * joint_fit.MISFIT),
    ("methods", "$(# / M)^3$ of the difference", bends.FEW_BENDS),
    ("methods", "and at least # of the fit's", result.NEAR_POINT),
    ("methods", "at # places all over the patch", 6 * domain.GAUSS_ALONG * (domain.GAUSS_ACROSS + 1)),
    ("methods", "if one tap is off by more than ten standard deviations", taps.TOO_FAR_OFF / 10),
    ("methods", "all are by more than two on average", status.CONTRADICTING / 2),
    ("methods", "if more than # % of its area has no surface", 100 * status.DOUBTFUL_GAP),
    ("methods", "each a sixth shorter", round(1 / (1 - 0.5 ** (1 / extent.RUNGS))) / 6),
    ("methods", "At most one in a hundred contacts is off it by more than five", 100 * explained.FEW),
    ("methods", "off it by more than five deviations", verdict.SIGNIFICANT / 5),
    ("methods", "at most # % of the radius in the mean", 100 * extent.TAPS_OFF),
    ("methods", "are within three deviations of those", verdict.NOTICED / 3),
    ("methods", "left after five rounds", touching.AGAIN / 5),
    ("methods", "within # of the radius, a linear map", posterior.QUARTIC_SHARE),
    ("viewport", "*Ctrl* snaps angles to #°", math.degrees(of("tactile_addon/viewport/drag", "SNAP"))),
    ("viewport", "about # contacts on the longest half curve", extent.CONTACTS),
    ("viewport", "or two or four times as many", extent.DENSER[1] / 2 * extent.DENSER[2] / 4),
    ("viewport", "expected to reduce the standard deviation by a tenth", 10 * extent.HELPS),
    ("viewport", "less than a twentieth of a second",
     20 * of("tactile_addon/probes/change_handlers", "CHEAP")),
    ("viewport", "six in all at most", of("tactile_addon/touch/settings", "MOST_PLANES") / 6),
    ("viewport", "at most half the object's size",
     2 * of("tactile_addon/touch/touch_object", "FARTHEST_SHARE")),
    ("maps", "is half of the extent", 2 * of("tactile_addon/stability_map/stability", "SPACING_SHARE")),
    ("maps", "an automatic one a sixteenth of the object's size",
     16 * of("tactile_addon/stability_map/stability", "SPACING_SHARE")
     * of("tactile_addon/stability_map/stability", "EXTENT_SHARE")),
    ("maps", "at # points of its domain", 6 * domain.GAUSS_ALONG * domain.GAUSS_ACROSS),
    ("maps", "more than two standard deviations from it", status.CONTRADICTING / 2),
    ("patch", "accurate to # % of the radius", 100 * status.DOUBTFUL_STD),
    ("patch", "may be off by #°", math.degrees(status.DOUBTFUL_TURN)),
    ("patch", "its value and a tenth of 1 / radius", 10 * of("tactile_addon/touch/wording", "UNCERTAIN")),
    ("patch", "is three standard deviations of the height",
     of("tactile_addon/scene/shown", "DEVIATIONS") / 3),
    ("patch", "off the surface by # of the standard deviation", result.MESH_SHARE),
    ("messages", "Planes less than #° apart", math.degrees(local_geometry.LEAST_ANGLE)),
    ("messages", "within five deviations of it", object_atlas.OFF_STDS / 5),
    ("messages", "is half the object's size", 2 * of("tactile_addon/touch/touch_object", "FARTHEST_SHARE")),
    ("messages", "by more than a tenth of its size", 10 * common_point.MAX_OFFSET),
    ("index", "into the window of Blender (# to", of_toml("blender_manifest.toml", "blender_version_min")),
    ("scripting", "for Python # or later", of_toml("pyproject.toml", "project", "requires-python")),
    ("../CONTRIBUTING", "tries # inputs each", settings.get_profile("long").max_examples),
    ("contacts", "Tactile Patch contacts, version #,", comments.FORMAT_VERSION),
    ("contacts", "each with three contacts besides the point", curves.LEAST_CONTACTS / 3),
    ("contacts", "by more than a tenth of their size an error", 10 * common_point.MAX_OFFSET),
    ("contacts", "beyond a hundred, neighbors", thinning.MOST_CONTACTS / 100),
    ("scripting", "| `version` | #; other versions", serialization.VERSION),
    ("scripting", "as long as one helps, up to six", of("tactile_addon/touch/settings", "MOST_PLANES") / 6),
    ("scripting", "A block that fails twice", of("cluster/worker/task", "TRIES") / 2),
    ("stability", "more than # % of the radius.", 100 * status.DOUBTFUL_FIT),
    ("stability", "from # % of the radius on it warns", 100 * status.DOUBTFUL_STD),
    ("stability", "be up to $#a/L$ off", bends.FOLD_BEND),
    ("stability", "One of less than #° counts", math.degrees(bends.LEAST_FOLD)),
    ("stability", "is more than three times the stated one", of("benchmarks/stability", "TOO_FAR") / 3),
    ("stability", "the frame is off by more than #°", of("benchmarks/stability", "TURNED")),
    ("stability", "accurate to # % of the radius", 100 * of("benchmarks/stability", "SMALL")),
    ("whole_objects", "at least half of the area has the curvature of facets",
     2 * of("tactile_addon/whole_object/object_report", "FACETED")),
    ("whole_objects", "# % of the surface is within the tolerance",
     100 * of("tactile_addon/whole_object/object_report", "WITHIN_SHARE")),
    ("whole_objects", "no place is more than three tolerances off",
     of("tactile_addon/whole_object/object_report", "OFF_TOLERANCES") / 3),
    ("whole_objects", "| `version` | #; it changes", object_atlas.GRAPH_VERSION),
    ("whole_objects", "gaps thinner than # % of the size", 300 * samples.FINEST),
    ("whole_objects", "until their uncertainty is # % of their radius", 100 * atlas_measured.GROWN),
    ("whole_objects", "At most # % of the contacts,", 100 * explained.FEW),
    ("whole_objects", "may be over five times the noise off", object_atlas.OFF_STDS / 5),
    ("whole_objects", "and six side by side,", len(monge.QUADRIC) / 6),
    ("whole_objects", "none by over a fiftieth of the size", 50 * atlas_measured.MOST_OFF),
    ("whole_objects", "An edge sharper than #° is a crease", round(degrees(curvature.SHARP))),
]  # fmt: skip


@pytest.mark.parametrize(("page", "words", "value"), PROMISES, ids=lambda part: str(part)[:40])
def test_a_page_has_the_number_of_the_code(page, words, value):
    text = " ".join((ROOT / "docs" / f"{page}.md").read_text(encoding="utf-8").split())
    found = re.findall(re.escape(words).replace(r"\#", r"(-?[\d.]*\d)"), text)
    assert found, words
    wanted = float(found[0]) if "#" in words else 1.0  # Words such as "ten" are divided out.
    assert value == pytest.approx(wanted)


# A sweep of benchmarks.stability, and the words around the value there up to which the default withstands it.
WITHSTOOD = [
    ("degrees between planes", "planes down to #° apart", 1.0),
    ("noise, of the extent", "noise up to # % of the extent", 0.01),
    ("outliers, of the contacts", "up to # % of the contacts outlying", 0.01),
    ("one curve cut to", "one curve cut to # % of its length", 0.01),
    ("facets, of the step", "facets up to # steps long", 1.0),
]


@pytest.mark.parametrize(("sweep", "words", "unit"), WITHSTOOD)
def test_what_the_default_withstands_is_in_the_numbers_of_the_chart(sweep, words, unit):
    text = " ".join((ROOT / "docs" / "stability.md").read_text(encoding="utf-8").split())
    (value,) = re.findall(re.escape(words).replace(r"\#", r"([\d.]*\d)"), text)
    with open(ROOT / "docs" / "charts" / "stability.csv", newline="", encoding="utf-8") as file:
        file.readline()  # This is the caption.
        rows = [row for row in csv.DictReader(file) if (row["sweep"], row["method"]) == (sweep, "bayes")]
    values = [float(row["value"]) for row in rows]
    last = values.index(pytest.approx(unit * float(value)))
    assert all(float(row["error"]) < SMALL for row in rows[: last + 1])
    beyond = rows[last + 1]  # A bolder sentence would be wrong.
    assert float(beyond["error"]) > SMALL or float(beyond["refused"]) > 0.5


def test_the_accuracies_of_the_dialog_are_those_of_the_page():
    shares = of("tactile_addon/whole_object/object_touches", "TOLERANCE_SHARES")
    quick, normal, fine = (f"1/{1.0 / share:g}" for share in shares.values())
    page = " ".join((ROOT / "docs" / "whole_objects.md").read_text(encoding="utf-8").split())
    assert f"a tolerance of {quick}, {normal} or {fine} of the object's size" in page
