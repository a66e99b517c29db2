# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The numbers that the pages promise are those of the code."""

import math
import re
from pathlib import Path

import pytest

from core.atlas import measured as atlas_measured
from core.atlas import object_atlas, samples, touching
from core.bayes import posterior
from core.contours import common_point, curves, finger, thinning
from core.exploration import extent, taps
from core.reconstruction import explained, result, status

ROOT = Path(__file__).parents[1]


def degrees(cosine):
    return math.degrees(math.acos(cosine))


def of_the_add_on(module, name):
    """A number of a module that needs Blender, read from its text."""
    text = (ROOT / "tactile_addon" / f"{module}.py").read_text(encoding="utf-8")
    number, share = re.search(rf"^{name}\b[^=\n]*= ([\d.]+)(?: / ([\d.]+))?", text, re.MULTILINE).groups()
    return float(number) / float(share or 1.0)


# A page, the words around each number there, and the numbers of the code. WORDS has # for a number.
PROMISES = [
    ("methods", "a turn of more than #° between contacts", degrees(finger.MAX_TURN)),
    ("methods", "tilts by more than #° against the normal", degrees(finger.MAX_TILT)),
    ("methods", "fitted to the ten contacts nearest", curves.WINDOW / 10),
    ("methods", "if one tap is off by more than ten standard deviations", taps.TOO_FAR_OFF / 10),
    ("methods", "all are by more than two on average", status.CONTRADICTING / 2),
    ("methods", "if more than # % of its area has no surface", 100 * status.DOUBTFUL_GAP),
    ("methods", "At most one in a hundred contacts is off it by more than five", 100 * explained.FEW),
    ("methods", "off it by more than five deviations", explained.TOO_FAR / 5),
    ("methods", "at most # % of the radius in the mean", 100 * extent.TAPS_OFF),
    ("methods", "left after three rounds", touching.AGAIN / 3),
    ("methods", "within # of the radius, a linear map", posterior.QUARTIC_SHARE),
    ("viewport", "about # contacts on the longest half curve", extent.CONTACTS),
    ("viewport", "expected to reduce the standard deviation by a tenth", 10 * extent.HELPS),
    ("viewport", "less than a twentieth of a second", 20 * of_the_add_on("probes/change_handlers", "CHEAP")),
    ("viewport", "six in all at most", of_the_add_on("touch/settings", "MOST_PLANES") / 6),
    ("viewport", "at most half the object's size", 2 * of_the_add_on("touch/touch_object", "FARTHEST_SHARE")),
    ("maps", "is half of the extent", 2 * of_the_add_on("stability_map/stability", "SPACING_SHARE")),
    ("patch", "accurate to # % of the radius", 100 * status.DOUBTFUL_STD),
    ("patch", "may be off by #°", math.degrees(status.DOUBTFUL_TURN)),
    ("patch", "off the surface by # of the standard deviation", result.MESH_SHARE),
    ("contacts", "by more than a tenth of their size an error", 10 * common_point.MAX_OFFSET),
    ("contacts", "beyond a hundred, neighbors", thinning.MOST_CONTACTS / 100),
    ("stability", "more than # % of the radius.", 100 * status.DOUBTFUL_WAVES),
    ("whole_objects", "# % of the surface is within the tolerance",
     100 * of_the_add_on("whole_object/object_report", "WITHIN_SHARE")),
    ("whole_objects", "gaps thinner than # % of the size", 300 * samples.FINEST),
    ("whole_objects", "no place is more than three tolerances off", object_atlas.OFF_TOLERANCES / 3),
    ("whole_objects", "until their uncertainty is # % of their radius", 100 * atlas_measured.GROWN),
    ("whole_objects", "If more than # % of the contacts are more than five times", 100 * explained.FEW),
]  # fmt: skip


@pytest.mark.parametrize(("page", "words", "value"), PROMISES, ids=lambda part: str(part)[:40])
def test_a_page_has_the_number_of_the_code(page, words, value):
    text = " ".join((ROOT / "docs" / f"{page}.md").read_text(encoding="utf-8").split())
    found = re.findall(re.escape(words).replace(r"\#", r"(-?[\d.]*\d)"), text)
    assert found, words
    wanted = float(found[0]) if "#" in words else 1.0  # Words such as "ten" are divided out.
    assert value == pytest.approx(wanted)


def test_the_accuracies_of_the_dialog_are_those_of_the_page():
    text = (ROOT / "tactile_addon" / "whole_object" / "object_touches.py").read_text(encoding="utf-8")
    (shares,) = re.findall(r"^TOLERANCE_SHARES = (.*)", text, re.MULTILINE)
    quick, normal, fine = re.findall(r"1\.0 / (\d+)\.0", shares)
    page = " ".join((ROOT / "docs" / "whole_objects.md").read_text(encoding="utf-8").split())
    assert f"a tolerance of 1/{quick}, 1/{normal} or 1/{fine} of the object's size" in page
