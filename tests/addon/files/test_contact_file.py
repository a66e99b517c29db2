# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Contact data in files, as people's machines write them."""

import struct
import tracemalloc
from dataclasses import replace

import numpy as np
import pytest
import surfaces
from fuzzing import in_time
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

import core
from core import Contour

WANTED = np.array([[[0.0, 0, 0], [1, 2, 3], [2, 4, 6.5]], [[0, 0, 0], [-1, 0.5, 1e-3], [0, 1, 0]]])
TITLE = "# Tactile Patch contacts, version {}, lengths in no unit\n"
PLAIN = "curve,x,y,z\n1,0,0,0\n1,1,2,3\n1,2,4,6.5\n2,0,0,0\n2,-1,0.5,1e-3\n2,0,1,0\n"


@pytest.fixture(scope="module")
def contact_file(extension):
    return extension.tactile_addon.files.contact_file


@pytest.fixture
def read(contact_file, tmp_path):
    def read(data, name="contacts.csv"):
        (tmp_path / name).write_bytes(data if isinstance(data, bytes) else data.encode())
        return contact_file.read(tmp_path / name)[:2]

    return read


def points(contours):
    return [c.points.tolist() for c in contours]


@pytest.mark.parametrize(
    "text",
    [
        PLAIN,
        PLAIN.rstrip("\n"),
        PLAIN.replace("\n", "\r\n"),
        PLAIN.replace("\n", "\r"),
        "\ufeff" + PLAIN,
        PLAIN.encode("utf-16"),
        b"# \xb5m, in an old encoding\n" + PLAIN.encode(),
        PLAIN.replace(",", ";"),
        PLAIN.replace(",", "\t"),
        PLAIN.replace(",", ";").replace(".", ","),
        PLAIN.replace(",", "\t").replace(".", ","),
        PLAIN.replace("6.5", '"6,5"'),
        PLAIN.replace(",", ", "),
        "# made by a robot\n\n" + PLAIN.replace("\n2,0,0", "\n  # the second\n\n,,,\n2,0,0"),
        PLAIN.replace("curve", "Curve").replace("x", " X "),
        "\n".join(",".join(reversed(line.split(","))) for line in PLAIN.split()),
        PLAIN.replace("z\n", "z,force,x_offset\n").replace("6.5\n", "6.5,0.3,hard\n"),
        PLAIN.replace("1,1,2,3\n", "1,1,2,3\n1,1,2,3\n1,1,2,3\n"),
        "curve,x,y,z\n1,0,0,0\n2,0,0,0\n1,1,2,3\n2,-1,0.5,1e-3\n2,0,1,0\n1,2,4,6.5\n",
    ],
    ids=str,
)  # fmt: skip
def test_one_set_of_contacts_in_many_spellings(read, text):
    contours, unit = read(text)
    assert unit == ""
    assert points(contours) == WANTED.tolist()
    assert all(c.normals is None and c.noise is None for c in contours)


@pytest.mark.parametrize(
    ("header", "unit"),
    [
        ("curve,x [mm],y [mm],z [mm]", "mm"),
        ("curve,x_mm,y_mm,z_mm", "mm"),
        ("curve,X (in),Y(in),Z ( in )", "in"),
        ("curve,x [µm],y [μm],z_um", "µm"),
        ("curve,x_m,y_m,z_m", "m"),
        ("curve,x[],y,z", ""),
    ],
)
def test_the_unit_is_in_the_columns(read, header, unit):
    contours, found = read(PLAIN.replace("curve,x,y,z", header))
    assert found == unit
    assert points(contours) == WANTED.tolist()


def test_curves_named_strokes_do_not_pass_through_the_point(contact_file, read, tmp_path):
    text = PLAIN.replace("\n2,", "\nStroke 7,")
    assert points(read(text)[0]) == [WANTED[0].tolist()]
    found = contact_file.read(tmp_path / "contacts.csv")
    assert points(found.strokes) == [WANTED[1].tolist()]
    read(PLAIN.replace("\n1,", "\nstroke,"))
    found = contact_file.read(tmp_path / "contacts.csv")
    assert (points(found.contours), points(found.strokes)) == ([WANTED[1].tolist()], [WANTED[0].tolist()])


@pytest.mark.parametrize("curves", [0, 1, 2])
def test_strokes_are_written_as_they_are_read(contact_file, tmp_path, curves):
    every = [Contour(curve, noise=0.1 * (i + 1)) for i, curve in enumerate(WANTED)]
    given = core.Contacts(every[:curves], "mm", [0.0, 1.0, 2.0], None, tuple(every[curves:]))
    contact_file.write(tmp_path / "all.csv", given)
    found = contact_file.read(tmp_path / "all.csv")
    assert found.point == given.point
    for kind in ("contours", "strokes"):
        ours, theirs = getattr(found, kind), getattr(given, kind)
        assert points(ours) == points(theirs)
        assert [c.noise for c in ours] == [c.noise for c in theirs]


def test_a_ply_of_bare_points_is_a_stroke(contact_file, read, tmp_path):
    rows = struct.pack("<18d", *WANTED.ravel())
    properties = "property double x\nproperty double y\nproperty double z\n"
    assert read(ply("binary_little_endian", 6, properties) + rows, "scan.ply")[0] == []
    (stroke,) = contact_file.read(tmp_path / "scan.ply").strokes
    assert len(stroke.points) == 5  # one of the six is there twice


def test_times_put_contacts_in_order(read):
    contours, _ = read("curve,time [s],x,y,z\na,3,2,4,6.5\na,1,0,0,0\nb,9,0,0,0\na,2.5,1,2,3\n")
    assert points(contours) == [WANTED[0].tolist(), [[0, 0, 0]]]


def test_normals_go_with_their_contacts(read):
    text = "curve,x,y,z,nx,ny,nz\n1,0,0,0,0,0,1\n1,1,0,0,0,1,0\n2,0,0,0,,,\n2,0,1,0,,,\n"
    one, other = read(text)[0]
    assert one.normals.tolist() == [[0, 0, 1], [0, 1, 0]]
    assert one.normal_std is None
    assert other.normals is None


def test_without_a_curve_column_a_file_is_one_curve(read):
    (contour,), _ = read("x,y,z\n0,0,0\n1,2,3\n2,4,6.5\n")
    assert contour.points.tolist() == WANTED[0].tolist()


@pytest.mark.parametrize(
    ("data", "words"),
    [
        ("", '"contacts.csv": expected a header with the columns curve, x, y, z, got an empty file'),
        ("# nothing\n\n", "got an empty file"),
        ("curve,x,y,z\n", '"contacts.csv": expected contacts below the header, got none'),
        ("1,2,3,4\n1,2,3,4\n", '"contacts.csv", line 1: expected the column "x", got "1, 2, 3, 4"'),
        ("#\ncurve,x,y\n", '"contacts.csv", line 2: expected the column "z"'),
        ("curve,x,y,z,nx\n", 'line 1: expected the column "ny"'),
        ("curve,x,y,x,z\n", 'line 1: expected one column "x", got two'),
        ("curve,x_mm,y_cm,z_mm\n", "line 1: expected x, y and z in one unit, got cm and mm"),
        ("curve,x [furlong],y,z\n", 'line 1: expected a unit out of km, m, cm, mm.* got "furlong"'),
        (PLAIN.replace("3", "three"), '"contacts.csv", line 3, column "z": expected a number, got "three"'),
        (TITLE.format(4) + PLAIN, "line 1: expected version 3 or less, got 4: this was written by a later"),
        (TITLE.format("x") + PLAIN, "line 1: expected version 3 or less, got x"),
        (TITLE.format(2) + "# point 1 2\n" + PLAIN, "line 2: expected 3 numbers for point, got 2"),
        (TITLE.format(2) + "# noise few\n" + PLAIN, 'line 2, "noise": expected a number, got "few"'),
        (TITLE.format(2) + "# noise -1\n" + PLAIN, 'line 2, "noise": expected a number of 0 or more, got -1'),
        (TITLE.format(2) + "# noise 1 2 3\n" + PLAIN, "expected one noise or 2, one a curve, got 3"),
        (PLAIN.replace("6.5", "nan"), 'line 4, column "z": expected a number, got "nan"'),
        (PLAIN.replace("6.5", "1e999"), 'line 4, column "z": expected a number'),
        (PLAIN.replace("6.5", "1_0"), 'line 4, column "z": expected a number, got "1_0"'),
        (PLAIN.replace("6.5", "1.000,5"), "line 4: expected 4 fields, got 5"),
        (PLAIN.replace("2,3\n", "2\n"), 'line 3, column "z": expected a number, got ""'),
        (PLAIN.replace("1,1,2,3", "1,1,5,2,5,3,5"), "line 3: expected 4 fields, got 7: decimal commas need"),
        (PLAIN.replace("1,1,2,3", ",1,2,3"), "line 3: expected a number or a name in the column"),
        (
            "curve,x,y,z,nx,ny,nz\n1,0,0,0,0,0,1\n1,0,0,1,,,\n",
            "line 3: expected normals at all contacts of a curve",
        ),
        ("curve,x,y,z,nx,ny,nz\n1,0,0,0,0,,1\n", 'line 2, column "ny": expected a number, got ""'),
        ("curve,time,x,y,z\n1,,0,0,0\n", 'column "time": expected a number, got ""'),
        (b"PK\x03\x04\x00\x00", '"contacts.csv": expected a text file, got binary data'),
        (PLAIN.replace("3", "3" * 200_000), "line 3: expected short fields, got a very long one"),
    ],
)
def test_what_cannot_be_read_is_refused_with_its_place(read, data, words):
    with pytest.raises(ValueError, match=words):
        read(data)


def test_files_that_are_none(contact_file, read, tmp_path):
    with pytest.raises(OSError, match="there is no file"):
        contact_file.read(tmp_path / "missing.csv")
    with pytest.raises(OSError, match=r"expected a \.csv or \.ply file of contacts"):
        read(PLAIN, "contacts.xlsx")


def test_what_the_tracker_made_comes_back_as_it_was(contact_file, tmp_path):
    s = surfaces.pear()
    contours = s.track(surfaces.planes((0, 60, 120)), noise=0.05, rng=1)
    given = core.Contacts(contours, "mm", [0.1, 1 / 3, 2e-17], [0.6, 0.0, -0.8])
    contact_file.write(tmp_path / "out.csv", given)
    found = contact_file.read(tmp_path / "out.csv")
    assert found[1:] == given[1:]
    for one, other in zip(contours, found.contours, strict=True):
        assert np.array_equal(one.points, other.points)
        assert np.array_equal(one.normals, other.normals)
        assert (other.noise, other.normal_std) == (0.05, None)
    head = (tmp_path / "out.csv").read_text(encoding="utf-8").splitlines()
    assert head[:5] == [
        "# Tactile Patch contacts, version 3, lengths in mm",
        "# point 0.1 0.3333333333333333 2e-17",
        "# outward 0.6 0.0 -0.8",
        "# noise 0.05",
        "curve,x [mm],y [mm],z [mm],nx,ny,nz",
    ]


@pytest.mark.parametrize("normal_stds", [(None,) * 3, (0.02,) * 3, (0.01, 0.3, 0.3), (0.01, 0.01, None)])
@pytest.mark.parametrize("noise", [None, 0.02])
@pytest.mark.parametrize("shape", ["alike", "one dense", "one with normals"])
def test_what_was_exported_and_is_read_gives_the_same_patch(
    extension, contact_file, tmp_path, normal_stds, noise, shape
):
    s = surfaces.pear()
    contours = s.track(surfaces.planes((0, 60, 120)), noise=0.05, rng=1)
    if shape == "one dense":
        contours[0] = s.track(surfaces.planes((0,)), step=0.05, noise=0.05, rng=1)[0]
    contours = [replace(c, normal_std=std) for c, std in zip(contours, normal_stds, strict=True)]
    if shape == "one with normals":
        contours[1:] = [replace(c, normals=None, normal_std=None) for c in contours[1:]]
    r = core.reconstruct(s.point, contours, outward=s.normal, noise=noise)
    contact_file.write(tmp_path / "out.csv", contact_file.contacts_of(r))
    found, _, point, outward, _ = contact_file.read(tmp_path / "out.csv")
    again = extension.core.reconstruct(point, found, outward=outward)
    near = {"rel": 1e-9, "abs": 1e-12}
    assert again.patch.coefficients == pytest.approx(r.patch.coefficients, **near)
    assert (again.patch.k1, again.patch.k2) == pytest.approx((r.patch.k1, r.patch.k2), **near)
    assert again.frame.axes == pytest.approx(r.frame.axes, **near)
    assert again.mean_height_std == pytest.approx(r.mean_height_std, **near)


@given(
    arrays(float, (6, 3), elements=st.floats(-1e50, 1e50), unique=True),
    st.sampled_from(["", "mm", "µm", "in"]),
)
def test_any_numbers_come_back_as_they_were(contact_file, tmp_path_factory, coordinates, unit):
    path = tmp_path_factory.getbasetemp() / "any.csv"
    contours = [Contour(coordinates[:2]), Contour(coordinates[2:])]
    contact_file.write(path, core.Contacts(contours, unit))
    contours, found = contact_file.read(path)[:2]
    assert found == unit
    assert np.array_equal(np.vstack([c.points for c in contours]), coordinates)


PROPERTIES = "property {0} x\nproperty {0} y\nproperty {0} z\nproperty {1} curve\n"


DOUBLES = PROPERTIES.format("double", "int")


def ply(kind, count=6, properties=DOUBLES, before="", after=""):
    vertices = f"{before}element vertex {count}\n{properties}{after}"
    return f"ply\nformat {kind} 1.0\ncomment by hand\n{vertices}end_header\n".encode()


ROWS = [(*p, number) for number, curve in enumerate(WANTED, 1) for p in curve.tolist()]


def packed(order, kinds, rows=ROWS):
    return b"".join(struct.pack(order + kinds, *row) for row in rows)


@pytest.mark.parametrize(
    "data",
    [
        ply("ascii") + "\n".join(" ".join(map(str, row)) for row in ROWS).encode(),
        (ply("ascii") + "\n".join(" ".join(map(str, row)) for row in ROWS).encode()).replace(b"\n", b"\r\n"),
        ply("binary_little_endian") + packed("<", "dddi"),
        ply("binary_big_endian") + packed(">", "dddi"),
        ply("binary_big_endian", properties=PROPERTIES.format("float64", "uchar")) + packed(">", "dddB"),
        ply("binary_little_endian", before="element camera 2\nproperty float fov\nproperty uchar id\n")
        + b"\1" * 10 + packed("<", "dddi"),
        ply("ascii", before="element camera 2\nproperty float fov\n") + b"1\n2\n"
        + "\n".join(" ".join(map(str, row)) for row in ROWS).encode(),
        ply("binary_little_endian", after="element face 1\nproperty list uchar int vertex_indices\n")
        + packed("<", "dddi") + b"\3" + b"\0" * 12,
    ],
    ids=range(8),
)  # fmt: skip
def test_ply_of_all_kinds(read, data):
    contours, unit = read(data, "contacts.ply")
    assert unit == ""
    assert points(contours) == WANTED.tolist()


def test_ply_with_normals_and_times_in_single_precision(read):
    properties = "".join(f"property float {name}\n" for name in ("time", "x", "y", "z", "nx", "ny", "nz"))
    rows = [(2, 1, 0, 0, 0, 1, 0), (1, 0, 0, 0, 0, 0, 1)]
    (contour,), _ = read(ply("binary_little_endian", 2, properties) + packed("<", "7f", rows), "contacts.ply")
    assert contour.points.tolist() == [[0, 0, 0], [1, 0, 0]]
    assert contour.normals.tolist() == [[0, 0, 1], [0, 1, 0]]


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (b"", '"contacts.ply": expected the complete header of a .ply file'),
        (b"ply\nformat ascii 1.0\n", "expected the complete header"),
        (b"ply\nformat morse 1.0\nend_header\n", "expected the complete header"),
        (b"ply\nend_header\n", "expected the complete header"),
        (PLAIN.encode(), "expected the complete header"),
        (ply("ascii", properties="property float x\n"), "expected vertices with the properties x, y and z"),
        (ply("ascii", properties="property list uchar int x\n"), "expected vertices with the properties"),
        (ply("ascii", 0), "expected vertices with the properties"),
        (ply("ascii", "many"), 'expected an element or a property, got "element vertex many"'),
        (ply("ascii", properties="property half x\n"), 'got "property half x"'),
        (ply("ascii", properties="property x\n"), "expected an element or a property"),
        (ply("ascii") + b"1 2 3 4\n1 2 3\n" * 3, '"contacts.ply", line 11: expected a number or a name in'),
        (ply("ascii") + b"1 2 3 4\n", "expected 6 contacts, got a file that ends earlier: is it complete?"),
        (ply("ascii", 10**15) + b"1 2 3 4\n", "got a file that ends earlier"),
        (
            ply("ascii", before="element camera 99999999999\nproperty float x\n"),
            "got a file that ends earlier",
        ),
        (ply("ascii") + b"1 2 three 4\n" * 6, 'line 10, column "z": expected a number, got "three"'),
        (ply("binary_little_endian") + b"1234", "expected 6 contacts, got a file that ends earlier"),
        (ply("binary_little_endian") + packed("<", "dddi", [(np.nan,) * 3 + (1,)] * 6), "expected finite"),
    ],
)
def test_a_damaged_ply_is_refused_with_a_sentence(read, data, words):
    with pytest.raises(ValueError, match=words):
        read(data, "contacts.ply")


WHOLE = [PLAIN.encode(), ply("ascii") + b"1 2 3 4\n" * 6, ply("binary_little_endian") + packed("<", "dddi")]


@given(st.sampled_from(WHOLE), st.integers(0, 300), st.integers(0, 30), st.binary(max_size=12))
def test_whatever_happens_to_a_file_it_is_read_or_refused_with_a_sentence(
    contact_file, tmp_path_factory, data, at, lost, put
):
    path = tmp_path_factory.getbasetemp() / ("any.csv" if data is WHOLE[0] else "any.ply")
    path.write_bytes(data[:at] + put + data[at + lost :])
    try:
        contours = contact_file.read(path).contours
    except ValueError as error:
        assert ": expected " in str(error)
    else:
        assert all(np.isfinite(c.points).all() and len(c.points) for c in contours)


@in_time
@pytest.mark.parametrize("mark", ["[", "(", "_", "[" * 300, ""])
@pytest.mark.parametrize("end", ["", "]", "mm", "mm ]"])
def test_a_long_header_is_read_in_one_pass(read, mark, end):
    title = f"x {mark}{' ' * 100_000}{end}"
    try:
        read(f"{title},y,z\n1,2,3\n")
    except ValueError as error:
        assert '"contacts.csv", line 1: expected ' in str(error)


def rows_of(count, digits=17):
    points = np.random.default_rng(0).random((count, 3))
    return points, "".join("c,{:.{d}},{:.{d}},{:.{d}}\n".format(*p, d=digits) for p in points.tolist())


@pytest.mark.parametrize("change", [("c,", "c,"), ("c,", '"c",'), ("c,", " c , "), (".", ",")])
def test_rows_are_read_many_at_a_time_and_take_little_memory(read, extension, monkeypatch, change):
    """A row is looked at by itself only where an error has to name it."""
    count = 50_000
    points, text = rows_of(count)
    text = text.replace(",", ";").replace(".", ",") if change[0] == "." else text.replace(*change)
    looked = []
    monkeypatch.setattr(extension.core.contact_data.rows.RowReader, "_parse_row", lambda *_: looked.append(1))
    header = "curve;x;y;z\n" if change[0] == "." else "curve,x,y,z\n"
    tracemalloc.start()
    try:
        (contour,), _ = read(header + text)
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert np.array_equal(contour.points, points)
    assert not looked
    assert peak < 300 * count


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (PLAIN + 2_000_000 * ",", "line 8: expected 1,048,576 letters or fewer, got 2,000,000: write each"),
        (2_000_000 * "x," + "\n" + PLAIN, "line 1: expected 1,048,576 letters or fewer, got 4,000,001"),
        (TITLE.format(1) + "# noise" + 2_000_000 * " 1" + "\n" + PLAIN, "line 2: expected 1,048,576 letters"),
        (ply("ascii", 1) + 2_000_000 * b" 1", "line 10: expected 1,048,576 letters or fewer, got 4,0"),
    ],
)
def test_a_line_of_millions_of_words_is_refused_before_it_takes_memory(read, data, words):
    name = "contacts.ply" if isinstance(data, bytes) else "contacts.csv"
    tracemalloc.start()
    try:
        with pytest.raises(ValueError, match=words):
            read(data, name)
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert peak < 10 * len(data)


def test_one_bad_row_costs_no_more_than_its_neighbors(read, extension, monkeypatch):
    count, looked = 50_000, []
    row = extension.core.contact_data.rows.RowReader._parse_row
    monkeypatch.setattr(
        extension.core.contact_data.rows.RowReader,
        "_parse_row",
        lambda *given: looked.append(1) or row(*given),
    )
    _, text = rows_of(count)
    with pytest.raises(ValueError, match=f'line {count + 2}, column "y": expected a number, got "three"'):
        read("curve,x,y,z\n" + text + "c,2,three,4\n")
    assert len(looked) < 3000


def test_empty_lines_are_not_looked_at_one_by_one(read, extension, monkeypatch):
    rows, seen = extension.core.contact_data.rows, []
    says = rows.is_row
    monkeypatch.setattr(rows, "is_row", lambda line: seen.append(1) or says(line))
    for blank in ("\n", " \n", "\r\n"):
        (contour,), _ = read(f"{blank * 300_000}x,y,z\n{blank * 300_000}0,0,0\n#\n{blank * 300_000}1,2,3\n")
        assert contour.points.tolist() == [[0, 0, 0], [1, 2, 3]]
    assert len(seen) < 600_000
    with pytest.raises(ValueError, match=r'line 700001, column "z": expected a number, got "c"'):
        read("\n" * 200_000 + "x,y,z\n" + "\n" * 499_999 + "a,b,c\n".replace("a", "1").replace("b", "2"))


@pytest.mark.parametrize(
    ("data", "name", "words"),
    [
        (
            "x,y,z\n0,0,0\n1e60,0,1\n",
            "contacts.csv",
            '"contacts.csv", line 3, column "x": expected numbers up to',
        ),
        (
            ply("binary_little_endian") + packed("<", "dddi", [*ROWS[:-1], (1e60, 0, 0, 1)]),
            "contacts.ply",
            r'"contacts.ply", contact 6: expected finite coordinates up to 1e\+50',
        ),
        (
            ply("binary_little_endian", 2, "".join(f"property float {v}\n" for v in ("x", "y", "z")))
            + packed("<", "3f", [(1e7, 0, 0), (1e7 + 2, 0, 0)]),
            "contacts.ply",
            r'"contacts.ply", curve "1.0": points: numbers of single precision are',
        ),
    ],
)
def test_numbers_that_no_curve_can_have_are_refused_with_their_place(read, data, name, words):
    with pytest.raises(ValueError, match=words):
        read(data, name)


def test_a_ball_in_a_file_has_the_unit_of_the_scene(extension, empty, tmp_path):
    files = extension.tactile_addon.files
    (tmp_path / "ball.csv").write_text(
        "# Tactile Patch contacts, version 3,\n# ball 3.15\nx [mm],y [mm],z [mm]\n1,2,3\n"
    )
    (contour,) = files.measured.read([tmp_path / "ball.csv"], "FILE", 1.0).contours
    assert contour.ball == pytest.approx(3.15e-3)
    assert contour.points == pytest.approx(np.array([[1e-3, 2e-3, 3e-3]]))
