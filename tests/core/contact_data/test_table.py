# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Contacts from text and back, without Blender; tests/addon/files has the many spellings of files."""

import numpy as np
import pytest
import surfaces

import core

CURVES = "curve,x [mm],y [mm],z [mm]\n1,0,0,0\n1,1,2,3\nstroke a,4,5,6\n"


def test_a_table_has_contours_strokes_and_a_unit():
    contacts = core.contacts_from_csv(CURVES)
    assert [c.points.tolist() for c in contacts.contours] == [[[0, 0, 0], [1, 2, 3]]]
    assert [c.points.tolist() for c in contacts.strokes] == [[[4, 5, 6]]]
    assert (contacts.unit, contacts.point, contacts.outward) == ("mm", None, None)
    assert core.UNIT_METERS[contacts.unit] == 1e-3


@pytest.mark.parametrize("name", ["", "scan.csv"])
def test_messages_have_the_name_of_the_text_and_the_place(name):
    wanted = f'^{name or "the table"}, line 3, column "y": expected a number, got "two"'
    with pytest.raises(ValueError, match=wanted):
        core.contacts_from_csv(CURVES.replace("1,1,2,3", "1,1,two,3"), *([name] if name else []))


@pytest.mark.parametrize("ends", ["\n", "\r\n", "\r"])
def test_a_text_may_begin_with_a_byte_order_mark_and_have_any_line_ends(ends):
    contacts = core.contacts_from_csv("\ufeff" + CURVES.replace("\n", ends))
    assert [len(c.points) for c in (*contacts.contours, *contacts.strokes)] == [2, 1]


def test_a_fit_of_contacts_that_went_through_text_is_the_same():
    s = surfaces.pear()
    tracked = s.track(surfaces.planes((0, 60, 120)), noise=0.05, rng=1)
    given = core.Contacts(tracked, "cm", s.point.tolist(), s.normal.tolist())
    found = core.contacts_from_csv(core.contacts_to_csv(given))
    assert (found.unit, found.point, found.outward) == ("cm", given.point, given.outward)
    r, again = (core.reconstruct(c.point, c.contours, outward=c.outward) for c in (given, found))
    assert np.array_equal(r.patch.coefficients, again.patch.coefficients)


def test_a_ball_makes_a_file_of_version_3_and_contacts_do_not():
    contours = [core.Contour(np.eye(3) + i, ball=ball) for i, ball in enumerate((3.15, 3.15))]
    text = core.contacts_to_csv(core.Contacts(contours, "mm"))
    assert text.startswith("# Tactile Patch contacts, version 3, lengths in mm\n# ball 3.15\n")
    assert [c.ball for c in core.contacts_from_csv(text).contours] == [3.15, 3.15]
    text = core.contacts_to_csv(core.Contacts([core.Contour(np.eye(3))], "mm"))
    assert text.startswith("# Tactile Patch contacts, version 2,")
    with pytest.raises(ValueError, match="line 2: expected no ball in a file of version 2: make it 3"):
        core.contacts_from_csv("# Tactile Patch contacts, version 2,\n# ball 3.15\n" + CURVES)
    with pytest.raises(ValueError, match="line 1: expected version 3 or less, got 4"):
        core.contacts_from_csv("# Tactile Patch contacts, version 4,\n" + CURVES)
    with pytest.raises(ValueError, match="ball: expected a finite number above 0"):
        core.contacts_from_csv("# Tactile Patch contacts, version 3,\n# ball 0\n" + CURVES)
