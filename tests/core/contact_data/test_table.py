# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Contacts from text and back, without Blender; tests/addon/files has the many spellings of files."""

import re

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


TITLE = "# Tactile Patch contacts, version 3, lengths in mm\n"
NOTES = "# point 1 2 3.5\n# outward 0 0 1\n# noise 0.05\n# normal_std 0.02\n# ball 3.15\n"
BARE = "curve,x,y,z,nx,ny,nz\n1,0,0,0,0,0,1\n1,1,2,3,0,0,1\n"


@pytest.mark.parametrize(
    "text",
    [
        TITLE + NOTES + BARE,
        TITLE.replace("version 3", "version 2") + NOTES + BARE,
        "\n \n" + TITLE + NOTES + BARE,
        "# made by a robot\n" + TITLE + "\n" + NOTES + BARE,
        NOTES + TITLE + BARE,
        NOTES + BARE.replace("z,", "z_mm,").replace("x", "x_mm", 1).replace("y", "y_mm", 1),
        TITLE.replace(",", ";") + NOTES.replace("\n", ";;;\n") + BARE,
        TITLE.replace(",", "\t").replace("lengths", " lengths") + NOTES.replace("\n", "\t\t\n") + BARE,
        TITLE + NOTES.replace(" ", ";").replace(".", ",") + BARE.replace(",", ";"),
        TITLE + re.sub("# ([a-z_]+)", r"# \1:", NOTES) + BARE,
        TITLE + re.sub("# ([a-z_]+)", r"#\1 = ", NOTES) + BARE,
        TITLE + re.sub("# ([a-z_]+)", lambda m: m[0].upper(), NOTES) + BARE,
        TITLE + re.sub("# ([a-z_]+)", r"  ##  \1,", NOTES) + BARE,
        TITLE + NOTES.replace("1 2 3.5", "1, 2, 3.5") + BARE,
        TITLE + NOTES.replace("#", "//") + BARE,
        TITLE + BARE + NOTES,
        TITLE + NOTES.replace("#", "#!") + BARE,
        re.sub(r"[^,\n]+", r'"\g<0>"', TITLE + NOTES + BARE),
        re.sub(r".+", r'"\g<0>"', TITLE + NOTES) + BARE,
    ],
)
def test_what_comments_state_is_read_however_it_is_spelled(text):
    contacts = core.contacts_from_csv(text)
    (contour,) = contacts.contours
    assert (contacts.unit, contacts.point, contacts.outward) == ("mm", [1, 2, 3.5], [0, 0, 1])
    assert (contour.noise, contour.normal_std, contour.ball) == (0.05, 0.02, 3.15)


@pytest.mark.parametrize(
    ("comment", "words"),
    [
        ("# ball_diameter 6", 'line 3: expected "# ball" and its values, got "ball_diameter 6"'),
        ("# Ball radius: 3", 'line 3, "ball": expected a number, got "radius"'),
        ("# ball 3 mm", 'line 3, "ball": expected a number, got "mm"'),
        ("# noise-floor: 3", 'line 3: expected "# noise" and its values, got "noise-floor: 3"'),
        ("# normal std 0.02", 'line 3: expected "# normal_std" and its values, got "normal std 0.02"'),
        ("# normal_std", "line 3: expected numbers for normal_std, got none"),
        ("# point 1 2", "line 3: expected 3 numbers for point, got 2"),
        ("# point 1,2,3", "line 3: expected 3 numbers for point, got 1"),
        ("# noise 0.1\n# noise 0.2", "line 4: expected noise once, got it twice"),
    ],
)
@pytest.mark.parametrize("first", [TITLE, "# by a robot\n"])
def test_comments_that_look_like_ours_and_cannot_be_read_are_refused(first, comment, words):
    if first != TITLE and not any(map(str.isdigit, comment)):
        return  # A comment of others may begin with any word.
    with pytest.raises(ValueError, match=words):
        core.contacts_from_csv(f"{first}\n{comment}\n{CURVES}")


def test_other_comments_state_nothing():
    notes = "# points: 300\n# Point cloud of a vase\n# noisy, 3 times\n# a ball of 6\n# noise was low\n#\n"
    contacts = core.contacts_from_csv(notes + CURVES)
    assert (contacts.unit, contacts.point, contacts.outward) == ("mm", None, None)
    assert contacts.contours[0].noise is contacts.contours[0].ball is None


def test_the_unit_of_the_title_is_that_of_columns_which_name_none():
    plain = CURVES.replace(" [mm]", "")
    assert core.contacts_from_csv(TITLE + plain).unit == "mm"
    assert core.contacts_from_csv(TITLE.replace("mm", "no unit") + CURVES).unit == "mm"
    assert core.contacts_from_csv(TITLE.replace("mm", "no unit") + plain).unit == ""
    with pytest.raises(ValueError, match="line 2: expected lengths in cm, as a comment says, got mm"):
        core.contacts_from_csv(TITLE.replace("mm", "cm") + CURVES)
    with pytest.raises(ValueError, match=r'line 1: expected a unit out of km, m, .* got "furlongs"'):
        core.contacts_from_csv(TITLE.replace("mm", "furlongs") + plain)


@pytest.mark.parametrize(
    "words", ["unit mm", "units: mm", "Unit = mm", "length unit: mm;;;", "lengths in mm"]
)
def test_a_comment_that_is_a_unit_is_read_or_refused(words):
    plain = CURVES.replace(" [mm]", "")
    assert core.contacts_from_csv(f"# {words}\n{plain}").unit == "mm"
    assert core.contacts_from_csv(f"{plain}# {words}\n").unit == "mm"
    assert core.contacts_from_csv(f"# unit of the robot: mm\n{plain}").unit == ""
    with pytest.raises(ValueError, match=r'line 1: expected a unit out of km, m, .* got "furlongs"'):
        core.contacts_from_csv(f"# {words.replace('mm', 'furlongs')}\n{plain}")
    with pytest.raises(ValueError, match="line 2: expected lengths in cm, as a comment above says, got mm"):
        core.contacts_from_csv(f"{TITLE.strip().replace('mm', 'cm')}\n# {words}\n{plain}")


def test_a_ball_is_written_and_versions_that_are_not_known_are_refused():
    contours = [core.Contour(np.eye(3) + i, ball=ball) for i, ball in enumerate((3.15, 3.15))]
    text = core.contacts_to_csv(core.Contacts(contours, "mm"))
    assert text.startswith("# Tactile Patch contacts, version 3, lengths in mm\n# ball 3.15\n")
    assert [c.ball for c in core.contacts_from_csv(text).contours] == [3.15, 3.15]
    for separator in ",;\t":
        with pytest.raises(ValueError, match="line 2: expected version 3 or less, got 4"):
            core.contacts_from_csv(f"\n# Tactile Patch contacts{separator} version 4{separator}\n" + CURVES)
    with pytest.raises(ValueError, match="ball: expected a finite number above 0"):
        core.contacts_from_csv("# Tactile Patch contacts, version 3,\n# ball 0\n" + CURVES)


@pytest.mark.parametrize(
    "text",
    [
        CURVES,
        CURVES.replace(",", "|"),
        CURVES.replace(",", " | "),
        CURVES.replace("stroke a", "stroke_a").replace(",", " "),
        CURVES.replace("stroke a", "stroke_a").replace("\n", "  \n  ").replace(",", "   "),
        CURVES.replace("stroke a", '"stroke a"').replace(" [mm]", "_mm").replace(",", "\t ").expandtabs(7),
        "//" + CURVES.replace("x", "X").replace("y", "Y").replace("z", "Z"),
        "# by numpy.savetxt\n# " + CURVES,
        "// two lines\n" + TITLE + "// " + CURVES.replace(",", ";"),
        "# x,y,z are the contacts\n" + CURVES,
        "# x,y,z\n" + CURVES,
    ],
)
def test_fields_are_separated_by_what_the_header_has_and_the_header_may_be_a_comment(text):
    contacts = core.contacts_from_csv(text)
    assert [c.points.tolist() for c in contacts.contours] == [[[0, 0, 0], [1, 2, 3]]]
    assert [c.points.tolist() for c in contacts.strokes] == [[[4, 5, 6]]]
    assert contacts.unit == "mm"


def test_a_header_that_cannot_be_read_gets_a_list_of_what_can():
    wanted = (
        'line 1: expected the column "x", got "1/2/3": put commas, semicolons, tabs, "|" or spaces between'
    )
    with pytest.raises(ValueError, match=re.escape(wanted)):
        core.contacts_from_csv("1/2/3\n4/5/6\n")


THOUSANDS = "curve;x;y;z\n1;42,136;50,000;23,731\n1;43,670;50,000;24,185\n"


@pytest.mark.parametrize(
    "text",
    [
        THOUSANDS,
        THOUSANDS.replace("42,136", "42"),
        THOUSANDS.replace(";", "\t"),
        THOUSANDS.replace(";", " "),
        THOUSANDS.replace(";", "|"),
        re.sub(r"(\d+,\d+)", r'"\1"', THOUSANDS).replace(";", ","),
    ],
)
def test_commas_that_may_be_of_thousands_or_decimal_are_refused(text):
    with pytest.raises(ValueError, match=r"the table: expected decimal commas or those of thousands, got"):
        core.contacts_from_csv(text)


@pytest.mark.parametrize("other", ["0,136", "42,1", "42,1360", "4213,136", "-0,136", "4,2e1"])
def test_one_number_that_can_have_no_thousands_shows_decimal_commas(other):
    text = THOUSANDS.replace("42,136", other)
    (contour,) = core.contacts_from_csv(text).contours
    assert contour.points[1].tolist() == [43.67, 50, 24.185]
