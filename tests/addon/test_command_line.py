# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The command line, called as Blender calls it; a real `blender -c` is in tests/gui."""

import json
import re

import numpy as np
import pytest

pytest.importorskip("bpy", reason="needs Blender as a Python module: run make test")
from scenes import PLACE, add_sphere


def from_every_kind(command, files, *words):
    """The reports of a command on each kind of file."""
    reports = []
    for kind in ("ply", "stl", "obj", "blend"):
        code, out, _ = command(words[0], files / f"ball.{kind}", *words[1:], "--json", "-")
        assert code == 0
        (line,) = [line for line in out.splitlines() if line.startswith("{")]
        reports.append(json.loads(line))
    return reports


def test_a_patch_from_every_kind_of_file(command, files):
    reports = from_every_kind(command, files, "reconstruct", *PLACE)
    for report in reports:
        assert report["status"] == "ok"
        assert 0.0 < report["suggested_plane"]["expected_height_std"] < report["height_std"]
        assert report["k1"] == pytest.approx(-0.5, rel=0.05)
        assert report["frame"]["origin"] == pytest.approx(reports[0]["frame"]["origin"], abs=1e-5)


def test_every_option_arrives(command, files):
    options = ["--target", "Sphere", "--outward", "0.1", "-0.1", "1", "--step", "0.05", "--noise", "1e-3"]
    options += ["--seed", "4", "--azimuths", "-10", "40", "85", "130", "--tilts", "5", "0", "-5", "0"]
    options += ["--method", "quadratic-variation", "--degree", "5", "--weight", "500", "--solver", "fast"]
    path, output = files / "report.json", files / "out.blend"
    arguments = (*PLACE, *options, "--json", path, "--output", output)
    code, out, err = command("reconstruct", files / "ball.blend", *arguments)
    assert (code, err) == (0, "")
    assert "principal curvatures" in out
    report = json.loads(path.read_text())
    assert [report[key] for key in ("method", "degree", "seed")] == ["quadratic-variation", 5, 4]
    assert report["step"] == pytest.approx(0.05)
    assert report["noise"] == pytest.approx(1e-3)
    assert [angle for plane in report["planes"] for angle in plane] == pytest.approx(
        [-10, 5, 40, 0, 85, -5, 130, 0], abs=1e-4
    )
    import bpy

    bpy.ops.wm.open_mainfile(filepath=str(output))
    assert bpy.data.objects["Sphere Patch"]["tactile"]["degree"] == 5


@pytest.mark.long
def test_a_whole_object_from_a_file(command, files):
    output = files / "whole.ply"
    options = ("--tolerance", "0.01", "--edge", "0.2", "--seed", "1", "--json", "-", "--output", output)
    code, out, _ = command("object", files / "ball.ply", *options)
    assert code == 0
    (line,) = [line for line in out.splitlines() if line.startswith("{")]
    report = json.loads(line)
    assert report["is_closed"]
    assert report["deviation_mean"] < 0.01
    graph = report["graph"]
    assert len(graph["nodes"]) == report["patches"]
    assert len(graph["edges"]) == report["edges"]
    origins = np.array([node["frame"]["origin"] for node in graph["nodes"]])
    assert np.linalg.norm(origins, axis=1) == pytest.approx(2.0, abs=0.01)
    assert b"property float height_std" in output.read_bytes()[:2000]
    code, out, _ = command("object", files / "ball.ply", "--tolerance", "0.01")
    assert code == 0
    assert "closed all round" in out


def test_a_map_from_every_kind_of_file(command, files):
    reports = from_every_kind(command, files, "map", "--spacing", 1, "--extent", 0.5)
    for report in reports:
        assert report["patches"] == report["touched"] > 20
        assert report["in_doubt"] == 0
        assert set(report["refused"]) == {"crease", "edge", "steep", "nothing"}
        assert 0.0 < report["error_median"] < 0.002
        assert 0.0 < report["height_std_median"] < 0.002


def test_every_option_of_a_map_arrives_and_the_copy_is_saved(command, files):
    options = ["--target", "Sphere", "--extent", 0.6, "--step", 0.05, "--noise", "1e-3", "--seed", "4"]
    options += ["--azimuths", "-10", "40", "85", "130", "--tilts", "5", "0", "-5", "0", "--degree", "5"]
    path, blend, ply = files / "report.json", files / "out.blend", files / "out.ply"
    arguments = ("map", files / "ball.blend", "--spacing", 1.5, *options)
    code, out, err = command(*arguments, "--json", path, "--output", blend)
    assert (code, err) == (0, "")
    assert "median standard deviation" in out
    report = json.loads(path.read_text())
    assert [report[key] for key in ("method", "degree", "seed")] == ["bayes", 5, 4]
    assert [report[key] for key in ("spacing", "extent", "step")] == pytest.approx([1.5, 0.6, 0.05])
    assert [angle for plane in report["planes"] for angle in plane] == pytest.approx(
        [-10, 5, 40, 0, 85, -5, 130, 0], abs=1e-4
    )
    assert command(*arguments, "--output", ply)[0] == 0
    head = ply.read_bytes().partition(b"end_header")[0].decode()
    for name in ("error", "height_std", "condition_number", "blind_share", "reason"):
        assert f" {name}\n" in head
    import bpy

    bpy.ops.wm.open_mainfile(filepath=str(blend))
    painted = bpy.data.objects["Sphere Stability"]
    assert painted["tactile_map"]["degree"] == 5
    assert f"element vertex {len(painted.data.vertices)}\n" in head


@pytest.mark.long
def test_a_map_says_how_far_it_is(command, files):
    code, _, err = command("map", files / "ball.ply", "--spacing", 0.3)
    assert code == 0
    lines = err.splitlines()
    assert lines
    assert all(line.endswith("points") for line in lines)


def test_the_degree_may_be_left_to_the_contacts(command, files):
    code, out, _ = command("reconstruct", files / "ball.ply", *PLACE, "--degree", "auto")
    assert code == 0
    assert "Bayesian, degree 4" in out


def test_lengths_are_said_in_the_unit_of_the_scene(command, files):
    import bpy

    out = command("reconstruct", files / "ball.blend", *PLACE)[1]
    rows = dict(line.split("  ", 1) for line in out.splitlines() if "  " in line)
    rows = {label.strip(): value.strip() for label, value in rows.items()}
    assert re.fullmatch(r"-0\.5\S* ± \S+ 1/m, -0\.[45]\S* ± \S+ 1/m", rows["principal curvatures"])
    assert re.fullmatch(r"0\.2\d* ± \S+ 1/m²", rows["Gaussian curvature"])
    assert re.fullmatch(r"\S+ \w*m, \S+ % of the radius", rows["standard deviation of the height"])
    assert re.fullmatch(r"\S+ m, 0.6 m, \S+ m", rows["step, extent, radius"])
    assert rows["point"].endswith(" m")
    bpy.context.scene.unit_settings.system = "NONE"
    bpy.ops.wm.save_as_mainfile(filepath=str(files / "none.blend"))
    out = command("reconstruct", files / "none.blend", *PLACE)[1]
    assert re.search(r"principal curvatures +-0\.5\S* ± \S+, -0\.[45]\S* ± \S+\n", out)
    out = command("map", files / "ball.blend", "--spacing", 1)[1]
    assert re.search(r"median standard deviation +\S+ \S*m\n", out)
    assert re.search(r"median blind share +[\d.]+\n", out)


def test_strokes_are_fitted_around_a_place(command, empty, tmp_path):
    turns, reach = np.meshgrid(np.linspace(0.0, 6.0, 30), np.linspace(0.05, 0.9, 12))
    x, y = (reach * np.cos(turns)).ravel(), (reach * np.sin(turns)).ravel()
    rows = np.column_stack([x, y, np.sqrt(4.0 - x**2 - y**2)]).tolist()
    path = tmp_path / "strokes.csv"
    path.write_text("x,y,z\n" + "".join(f"{a},{b},{c}\n" for a, b, c in rows))
    place = ["--location", "0.1", "-5e-2", "2.1"]
    code, out, _ = command("fit", path, *place, "--radius", 0.7, "--json", "-")
    assert code == 0
    report = json.loads(next(line for line in out.splitlines() if line.startswith("{")))
    assert report["k1"] == pytest.approx(-0.5, rel=0.02)
    assert 0.5 < report["radius"] < 0.7
    code, out, _ = command("fit", path, *place)
    assert code == 0
    assert re.search(r"^contacts +360 on 1 stroke, fitted as \d{2,3}$", out, re.MULTILINE)
    code, _, err = command("fit", path, *place, "--point", "0", "0", "2")
    assert code == 2
    assert "--location: expected this or --point, got both" in err


def test_the_open_scene_is_touched_without_a_file(command, files):
    import bpy

    bpy.ops.wm.open_mainfile(filepath=str(files / "ball.blend"))
    bpy.context.view_layer.objects.active = None
    code, out, _ = command("reconstruct", *PLACE)
    assert code == 0
    assert "touched" in out
    assert "Bayesian, degree 4" in out
    assert "suggested next plane" in out


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["missing.ply", *PLACE], 'there is no file "missing.ply"'),
        (["{folder}/ball.txt", *PLACE], "expected a .blend, .ply, .stl or .obj file"),
        (["{folder}/cut.ply", *PLACE], ""),
        (["{folder}/head.ply", *PLACE], "no mesh could be read"),
        (["{folder}/cut.blend", *PLACE], ""),
        (["{folder}/text.obj", *PLACE], "no mesh could be read"),
        (["{folder}/ball.ply", "--location", "9", "9", "9"], "The location is"),
        (["{folder}/ball.ply", *PLACE, "--target", "Nobody"], 'There is no object "Nobody"'),
        (["{folder}/ball.ply", *PLACE, "--json", "{folder}/no/report.json"], 'to write "report.json" to'),
        (["{folder}/ball.ply", *PLACE, "--output", "{folder}/no/out.blend"], 'to write "out.blend" to'),
        (["map", "missing.ply"], 'there is no file "missing.ply"'),
        (["map", "{folder}/ball.ply", "--spacing", "-1"], "The spacing is a length"),
        (["map", "{folder}/ball.ply", "--extent", "99"], "longer than"),
    ],
)
def test_what_cannot_be_done_exits_with_1_and_a_sentence(command, files, words, sentence):
    (files / "ball.txt").write_text("a ball")
    (files / "text.obj").write_text("a ball")
    (files / "head.ply").write_bytes((files / "ball.ply").read_bytes()[:100])
    for kind in ("ply", "blend"):
        (files / f"cut.{kind}").write_bytes((files / f"ball.{kind}").read_bytes()[:2000])
    words = words if words[0] == "map" else ["reconstruct", *words]
    code, out, err = command(*(str(word).format(folder=files) for word in words))
    assert code == 1
    assert err.splitlines()[-1].startswith("tactile: ")
    assert sentence in err.splitlines()[-1]
    assert "Traceback" not in out + err


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        ([], "COMMAND"),
        (["reconstruct", "--degree", "9"], "--degree"),
        (["reconstruct", "--method", "magic"], "--method"),
        (["reconstruct", "--location", "1", "2"], "--location"),
        (["reconstruct", "--azimuths", "0", "60"], "--azimuths: expected three to six, got 2"),
        (["fit", "a.csv", "--radius", "-1"], "--radius: expected a finite number of 0 or more, got -1"),
        (["fit", "a.csv", "--noise", "inf"], "--noise: expected a finite number of 0 or more, got inf"),
        (
            ["fit", "a.csv", "--normal-std", "nan"],
            "--normal-std: expected a finite number of 0",
        ),
        (["reconstruct", "--seed", "-1"], "--seed: expected a finite number of 0 or more, got -1"),
        (["reconstruct", "--tilts", "0", "60"], "--tilts: expected as many as there are planes"),
        (["reconstruct", "--nonsense"], "--nonsense"),
        (["map", "--spacing", "wide"], "--spacing"),
        (["map", "--location", "1", "2", "3"], "--location"),
    ],
)
def test_bad_arguments_exit_with_2(command, empty, words, sentence):
    code, out, err = command(*words)
    assert code == 2
    assert sentence in err
    assert "{" not in out


def test_help(command):
    code, out, _ = command("reconstruct", "--help")
    assert code == 0
    assert "--azimuths" in out
    code, out, _ = command("--help")
    assert code == 0
    assert "Touch meshes, or read measured contacts, and rebuild the surface." in " ".join(out.split())
    assert "The words of" not in out


def test_normals_have_the_same_unit_in_the_shell_and_in_files(command, empty, tmp_path):
    rows = contacts_on_second(tmp_path / "second.csv").read_text().splitlines()[1:]
    normals = [
        ",".join(map(str, np.subtract([float(w) for w in row.split(",")[1:]], [6, 0, 0]))) for row in rows
    ]
    table = "\n".join(["curve,x,y,z,nx,ny,nz", *map(",".join, zip(rows, normals, strict=True))])
    (tmp_path / "bare.csv").write_text(table)
    (tmp_path / "noted.csv").write_text("# normal_std 0.02\n" + table)
    found = []
    for words in (["bare.csv", "--normal-std", "0.02"], ["noted.csv"]):
        code, out, _ = command("fit", tmp_path / words[0], *words[1:], "--json", "-")
        assert code == 0
        found.append(json.loads(next(line for line in out.splitlines() if line.startswith("{"))))
    assert found[0]["height_std"] == pytest.approx(found[1]["height_std"], rel=1e-6)


def test_a_mesh_has_the_unit_that_is_named(command, files):
    code, out, _ = command("reconstruct", files / "ball.ply", *PLACE, "--unit", "mm")
    assert code == 0
    assert re.search(r"^principal curvatures +-0\.\d+ .*1/mm", out, re.MULTILINE)
    code, _, err = command("reconstruct", files / "ball.blend", *PLACE, "--unit", "mm")
    assert code == 2
    assert "--unit: expected a .ply, .stl or .obj file, because a .blend names its own unit" in err


VERTICES = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0.5], [2, 0, 0.5]]
FACES = [[0, 1, 2], [1, 3, 2], [1, 4, 3]]


def mesh_data(kind, word):
    """A mesh file in which a coordinate of the last vertex is this word."""
    rows = [[*map(str, row)] for row in VERTICES[:-1]] + [["2", word, "0.5"]]
    if kind.endswith("obj"):
        lines = [f"v {' '.join(row)}" for row in rows]
        return "\n".join([*lines, *(f"f {a + 1} {b + 1} {c + 1}" for a, b, c in FACES)]).encode()
    if kind == "text.stl":
        corners = ("\n".join(f" vertex {' '.join(rows[i])}" for i in face) for face in FACES)
        facets = (f"facet normal 0 0 1\nouter loop\n{three}\nendloop\nendfacet\n" for three in corners)
        return f"solid mesh\n{''.join(facets)}endsolid mesh\n".encode()
    if kind == "binary.stl":
        numbers = np.array(rows, dtype=float).astype("<f4")
        return (
            bytes(80)
            + b"\3\0\0\0"
            + b"".join(bytes(12) + numbers[face].tobytes() + b"\0\0" for face in FACES)
        )
    form, number = ("ascii", "float") if kind == "text.ply" else ("binary_little_endian", "double")
    head = f"ply\nformat {form} 1.0\nelement vertex 5\n" + "".join(f"property {number} {x}\n" for x in "xyz")
    head += "element face 3\nproperty list uchar int vertex_indices\nend_header\n"
    if kind == "text.ply":
        lines = [*(" ".join(row) for row in rows), *(f"3 {a} {b} {c}" for a, b, c in FACES)]
        return (head + "\n".join(lines) + "\n").encode()
    faces = b"".join(b"\3" + np.array(face, dtype="<i4").tobytes() for face in FACES)
    return head.encode() + np.array(rows, dtype="<f8").tobytes() + faces


@pytest.mark.parametrize("kind", ["text.ply", "binary.ply", "text.stl", "binary.stl", "mesh.obj"])
@pytest.mark.parametrize("word", ["nan", "-inf", "1e39", "1e999"])
@pytest.mark.filterwarnings("ignore:overflow encountered in cast")
def test_a_mesh_file_with_numbers_that_blender_reads_as_0_is_refused(command, empty, tmp_path, kind, word):
    (tmp_path / kind).write_bytes(mesh_data(kind, "0.1"))
    code, _, err = command("map", tmp_path / kind)
    assert "not finite" not in err
    (tmp_path / kind).write_bytes(mesh_data(kind, word))
    code, _, err = command("map", tmp_path / kind)
    assert code == 1
    assert err.startswith(
        f'tactile: "{kind}" has vertices whose coordinates are not finite in single precision: '
    )


@pytest.mark.parametrize("word", ["0,5", "1_0"])
def test_a_word_in_place_of_a_number_is_refused_too(command, empty, tmp_path, word):
    (tmp_path / "mesh.obj").write_bytes(mesh_data("mesh.obj", word))
    code, _, err = command("map", tmp_path / "mesh.obj")
    assert code == 1
    assert "correct or delete these" in err


def test_numbers_that_blender_reads_as_0_are_found_wherever_vertices_are(command, empty, tmp_path):
    indented = mesh_data("mesh.obj", "nan").replace(b"v ", b"  v ")
    (tmp_path / "mesh.obj").write_bytes(indented)
    assert "correct or delete these" in command("map", tmp_path / "mesh.obj")[2]
    head, rows = mesh_data("text.ply", "nan").decode().split("end_header\n")
    vertices, faces = head.index("element vertex"), head.index("element face")
    lines = rows.splitlines()
    (tmp_path / "text.ply").write_text(
        head[:vertices]
        + head[faces:]
        + head[vertices:faces]
        + "\n".join(["end_header", *lines[-len(FACES) :], *lines[: -len(FACES)], ""])
    )
    assert "correct or delete these" in command("map", tmp_path / "text.ply")[2]


def rearranged(kind, change, word="nan"):
    """A .ply of `mesh_data` whose head and rows were changed by a function of both."""
    head, rows = mesh_data(kind, word).split(b"end_header\n")
    head, rows = change(head.decode(), rows)
    return head.encode() + b"end_header\n" + rows


def faces_first(head, rows):
    vertices, faces, size = head.index("element vertex"), head.index("element face"), len(FACES) * 13
    strips = "element strip 2\nproperty double width\nproperty list ushort short at\n"
    data = bytes(8) + b"\2\0" + bytes(4) + bytes(10)
    return head[:vertices] + strips + head[faces:] + head[vertices:faces], data + rows[-size:] + rows[:-size]


def comment_first(head, rows):
    return head.replace("ply\n", "ply\ncomment of a scanner\n", 1), rows


def listed_before(head, rows):
    words = [(b"1 7 " if i < len(VERTICES) else b"") + line for i, line in enumerate(rows.split(b"\n"))]
    return head.replace("5\n", "5\nproperty list uchar int group\n"), b"\n".join(words)


def twice(head, rows):
    words = [line + (b" 0.5" if i < len(VERTICES) else b"") for i, line in enumerate(rows.split(b"\n"))]
    return head.replace("element face", "property float x\nelement face"), b"\n".join(words)


def listed(head, rows):
    words = [line + (b" 2 7 7" if i < len(VERTICES) else b"") for i, line in enumerate(rows.split(b"\n"))]
    return head.replace("element face", "property list uchar int group\nelement face"), b"\n".join(words)


@pytest.mark.parametrize(
    ("kind", "change"),
    [
        ("binary.ply", faces_first),
        ("binary.ply", comment_first),
        ("text.ply", comment_first),
        ("text.ply", listed),
    ],
)
def test_numbers_that_blender_reads_as_0_are_found_below_any_header(command, empty, tmp_path, kind, change):
    path = tmp_path / kind
    path.write_bytes(rearranged(kind, change, "0.1"))
    assert "not finite" not in command("map", path)[2]
    path.write_bytes(rearranged(kind, change))
    assert "correct or delete these" in command("map", path)[2]


def long_line(head, rows):
    return head, rows.replace(b"3 0 1 2", b"3 0 1 2" + 70_000 * b" ")


def long_comment(head, rows):
    return head.replace("element face", f"comment {70_000 * 'a'}\nelement face"), rows


@pytest.mark.parametrize(
    ("kind", "change"),
    [
        ("text.ply", twice),
        ("text.ply", listed_before),
        ("text.ply", long_line),
        ("text.ply", long_comment),
        ("binary.ply", long_comment),
    ],
)
def test_a_ply_that_blender_reads_otherwise_or_ends_over_is_refused(command, empty, tmp_path, kind, change):
    (tmp_path / kind).write_bytes(rearranged(kind, change, "0.1"))
    assert f'no mesh could be read from "{kind}"' in command("map", tmp_path / kind)[2]


def test_where_curves_meet_is_reported_in_double_precision(command, empty, tmp_path):
    point, t = np.array([1000.00012, 700.0004, -300.0]), np.linspace(-0.01, 0.01, 41)
    rows = ["curve,x,y,z"]
    for azimuth in (0, 1, 2):
        x, y = t * np.cos(azimuth), t * np.sin(azimuth)
        for place in point + np.column_stack([x, y, -30.0 * x**2 - 10.0 * y**2]):
            rows.append(f"{azimuth},{','.join(map(repr, place.tolist()))}")
    path = tmp_path / "curves.csv"
    path.write_text("\n".join(rows))
    given = ["--point", *map(repr, point.tolist())]
    code, out, _ = command("fit", path, *given, "--outward", 0, 0, 1, "--json", "-")
    assert code == 0
    report = json.loads(next(line for line in out.splitlines() if line.startswith("{")))
    # The fit passes near the point, which is a contact like the others.
    assert report["frame"]["origin"][:2] == point[:2].tolist()
    assert report["frame"]["origin"][2] == pytest.approx(point[2], abs=1e-6)


@pytest.fixture
def two(empty, tmp_path):
    """A .obj file with lines, a ball of radius 1 at the origin and one of radius 2 at x = 6."""
    for name, radius, x in (("first", 1.0, 0.0), ("second", 2.0, 6.0)):
        add_sphere(empty, 64, 32, radius=radius, location=(x, 0.0, 0.0)).name = name
    text = export_obj(empty, tmp_path / "two.obj")
    (tmp_path / "two.obj").write_text("o lines\nv 0 0 3\nv 1 0 3\nl 1 2\n" + shifted(text, 2))
    return tmp_path / "two.obj"


def export_obj(bpy, path):
    bpy.ops.wm.obj_export(
        filepath=str(path), forward_axis="Y", up_axis="Z", export_uv=False, export_normals=False
    )
    return path.read_text()


def shifted(text, count):
    """The text of a .obj file whose faces begin this many vertices later."""
    lines = (line.split() for line in text.splitlines() if not line.startswith(("#", "mtllib", "usemtl")))
    return "\n".join(
        " ".join([w[0], *(str(int(n) + count) for n in w[1:])] if w[0] == "f" else w) for w in lines if w
    )


def contacts_on_second(path):
    """A file of three curves over the top of the second ball."""
    rows = ["curve,x,y,z"]
    for curve, azimuth in enumerate(np.radians([0, 60, 120])):
        for t in np.linspace(-0.6, 0.6, 11):
            x, y = 2 * np.sin(t) * np.cos(azimuth), 2 * np.sin(t) * np.sin(azimuth)
            rows.append(f"{curve},{6 + x:.7f},{y:.7f},{2 * np.cos(t):.7f}")
    path.write_text("\n".join(rows))
    return path


@pytest.mark.parametrize("name", ["object", "map", "reconstruct"])
def test_one_of_several_meshes_in_a_file_has_to_be_named(command, two, name):
    code, _, err = command(name, two)
    assert (code, err.strip()) == (
        1,
        'tactile: "two.obj" has 2 meshes: name one of them with --target: "first", "second"',
    )


def test_the_mesh_that_is_named_is_touched(command, two):
    for name, curvature in (("first", -1.0), ("second", -0.5)):
        place = ["--location", {"first": 0, "second": 6}[name], 0, -1.0 / curvature]
        code, out, _ = command("reconstruct", two, "--target", name, *place, "--json", "-")
        report = json.loads(next(line for line in out.splitlines() if line.startswith("{")))
        assert (code, report["source"]) == (0, name)
        assert report["k1"] == pytest.approx(curvature, rel=0.05)


def test_lines_beside_the_only_mesh_are_no_reason_to_refuse_it(command, two):
    text = two.read_text()
    two.write_text(text[: text.index("o second")])
    code, out, _ = command("reconstruct", two, "--location", 0, 0, 1, "--json", "-")
    assert code == 0
    assert '"source": "first"' in out


def test_a_patch_is_put_onto_the_mesh_that_is_named(command, two, tmp_path):
    contacts = contacts_on_second(tmp_path / "contacts.csv")
    code, _, err = command("fit", contacts, "--onto", two)
    assert code == 1
    assert '"two.obj" has 2 meshes: name one of them with --target: "first", "second"' in err
    code, out, _ = command("fit", contacts, "--onto", two, "--target", "second", "--json", "-")
    report = json.loads(next(line for line in out.splitlines() if line.startswith("{")))
    assert code == 0
    assert report["verification"]["target"] == "second"
    code, _, err = command("fit", contacts, "--target", "second")
    assert code == 2
    assert "--target: expected --onto MESH too" in err
    code, _, err = command("fit", contacts, "--onto", two, "--target", "third")
    assert code == 1
    assert '"two.obj" has no mesh "third": name one of them with --target: "first", "second"' in err
