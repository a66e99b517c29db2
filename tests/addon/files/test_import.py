# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Measured contours in and patches out, in a real Blender; windows and dropped files are in tests/gui."""

import json
import re
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("bpy", reason="needs Blender as a Python module: run make test")
import surfaces
from scenes import PLACE, add_sphere, datablocks, made, positions, values

from core import Contacts, Contour, from_dict

SURFACE = surfaces.torus(40, 20, 0.6)
HIDDEN = surfaces.graph({(2, 1): 3.0 / 900.0, (0, 3): -1.0 / 900.0})


def contours_of(surface, noise=0.02):
    return surface.track(surfaces.planes((0, 60, 120)), noise=noise, rng=1)


@pytest.fixture
def measured(extension, empty, tmp_path):
    """A function that writes contacts of a surface, without the reference point, and returns the path."""

    def write(surface=SURFACE, name="scan.csv", normals=True, unit="", shuffle=False):
        contours = contours_of(surface)
        for c in contours:
            object.__setattr__(c, "points", np.delete(c.points, 12, axis=0))
            object.__setattr__(c, "normals", np.delete(c.normals, 12, axis=0) if normals else None)
            if shuffle:
                object.__setattr__(c, "points", np.random.default_rng(0).permutation(c.points))
            object.__setattr__(c, "noise", None)
        contact_file = extension.tactile_addon.files.contact_file
        contact_file.write(tmp_path / name, Contacts(contours, unit))
        return str(tmp_path / name)

    return write


def imported(bpy, path, **options):
    return made(bpy.ops.tactile.import_contacts, filepath=path, **options)


def test_contacts_become_a_patch(empty, measured):
    patch, report = imported(empty, measured())
    assert patch.name == "scan.csv Patch"
    assert empty.context.view_layer.objects.active == patch
    assert report["source"] == "scan.csv"
    assert report["status"] == "ok"
    assert (report["contacts"], report["curves"], report["unit"]) == (72, 3, "")
    assert [report["k1"], report["k2"]] == pytest.approx([SURFACE.k1, SURFACE.k2], abs=2e-3)
    assert report["frame"]["origin"] == pytest.approx(SURFACE.point, abs=0.03)
    assert report["frame"]["normal"] == pytest.approx(SURFACE.normal, abs=0.02)
    assert len(report["misses"]) == 3
    assert max(report["misses"]) < 0.05
    assert list(patch.matrix_world.translation) == pytest.approx(report["frame"]["origin"], abs=1e-5)
    assert [len(path) for path in patch["tactile_curves"]["contours"]] == [3 * 24] * 3


@pytest.mark.parametrize("normals", [True, False], ids=["by normals", "by the bulge"])
def test_the_outward_side(empty, measured, normals):
    path = measured(normals=normals)
    assert np.dot(imported(empty, path)[1]["frame"]["normal"], SURFACE.normal) > 0.99
    flipped = imported(empty, path, flip=True)[1]
    assert np.dot(flipped["frame"]["normal"], SURFACE.normal) < -0.99
    assert flipped["k1"] == pytest.approx(-SURFACE.k2, abs=2e-3)
    given = imported(empty, path, outward=list(-SURFACE.normal))[1]
    assert np.dot(given["frame"]["normal"], SURFACE.normal) < -0.99
    both = imported(empty, path, outward=list(-SURFACE.normal), flip=True)[1]
    assert np.dot(both["frame"]["normal"], SURFACE.normal) > 0.99


def test_without_normals_a_flat_patch_looks_up(empty, measured):
    path = measured(surfaces.plane(), normals=False)
    assert imported(empty, path)[1]["frame"]["normal"] == pytest.approx([0, 0, 1], abs=0.01)


def test_the_reference_point_may_be_given(empty, measured):
    path, near = measured(), SURFACE.point + 0.001
    _, report = imported(empty, path, point=list(near))
    # The origin is on the surface, below the point.
    assert report["frame"]["origin"] == pytest.approx(near, abs=0.02)
    assert "misses" not in report
    assert "misses" in imported(empty, path)[1]  # a point that was given is not kept for the next import


@pytest.mark.parametrize(
    ("named", "unit", "scale", "factor"),
    [
        ("mm", "FILE", 1.0, 1e-3),
        ("mm", "FILE", 1e-3, 1.0),
        ("mm", "NONE", 1.0, 1.0),
        ("", "FILE", 1.0, 1.0),
        ("", "cm", 1.0, 1e-2),
        ("mm", "in", 1.0, 0.0254),
    ],
)
def test_units(empty, measured, named, unit, scale, factor):
    path = measured(unit=named)
    empty.context.scene.unit_settings.scale_length = scale
    _, report = imported(empty, path, unit=unit)
    assert report["frame"]["origin"] == pytest.approx(factor * SURFACE.point, abs=0.03 * factor)
    assert report["k1"] * factor == pytest.approx(SURFACE.k1, abs=2e-3)
    assert report["unit"] == {"FILE": named, "NONE": ""}.get(unit, unit)


def wiped(extension, path, marked, noise=0.02, also=()):
    """Writes rows of contacts as of a robot's raster on the torus, as strokes or curves; returns the path."""
    rows = []
    for c in SURFACE.track(surfaces.planes((0, 35, 90, 120)), extent=12.0, step=0.4, noise=noise, rng=1):
        rows += [Contour(c.points[i::3] - 1e-3 * i) for i in range(3)]
    contact_file = extension.tactile_addon.files.contact_file
    contours, strokes = ([*also], rows) if marked else ([*also, *rows], [])
    contact_file.write(path, Contacts(contours, "", None, None, tuple(strokes)))
    return str(path)


@pytest.mark.parametrize("marked", [True, False])
def test_strokes_without_contours_become_a_patch_around_a_place(extension, empty, tmp_path, marked):
    path = wiped(extension, tmp_path / "wiped.csv", marked)
    options = {"point": list(SURFACE.point + 0.3), "noise": 0.02, **({} if marked else {"strokes": True})}
    patch, report = imported(empty, path, **options)
    assert report["status"] == "ok"
    assert (report["curves"], report["strokes"]) == (0, 12)
    assert [report["k1"], report["k2"]] == pytest.approx([SURFACE.k1, SURFACE.k2], abs=3e-3)
    off = SURFACE.point + 0.3 - report["frame"]["origin"]
    assert np.linalg.norm(np.cross(off, report["frame"]["normal"])) < 0.01
    assert report["frame"]["normal"] == pytest.approx(SURFACE.normal, abs=0.03)
    assert "misses" not in report
    (strokes,) = patch["tactile_curves"]["strokes"]
    assert (len(patch["tactile_curves"]["contours"]), len(strokes)) == (0, 3 * report["contacts"])
    _, near = imported(empty, path, radius=6.0, **options)
    assert near["radius"] < 6.0 < report["radius"]
    r = extension.reconstruction_of(patch)
    assert len(r.strokes) == report["contacts"]
    assert report["k1"] == pytest.approx(r.patch.k1)


def test_without_a_place_it_is_the_mean_of_the_strokes(extension, empty, tmp_path):
    _, report = imported(empty, wiped(extension, tmp_path / "wiped.csv", True))
    assert report["status"] == "ok"
    assert report["frame"]["origin"] == pytest.approx(SURFACE.point, abs=2.0)


def test_strokes_with_contours_are_fitted_and_go_out_again(extension, empty, tmp_path):
    path = wiped(extension, tmp_path / "both.csv", True, also=contours_of(SURFACE))
    _, report = imported(empty, path, point=list(SURFACE.point))
    assert (report["curves"], report["strokes"]) == (3, 12)
    assert report["contacts"] > 100  # 72 of the curves, and 36 to 100 means of the strokes
    out = tmp_path / "out.csv"
    empty.ops.tactile.export_contacts(filepath=str(out))
    _, again = imported(empty, str(out))
    assert (again["curves"], again["strokes"]) == (3, 1)
    for key in ("k1", "k2", "radius", "height_std"):
        assert again[key] == pytest.approx(report[key], rel=1e-2)


def test_strokes_that_carry_no_patch_are_refused_with_a_sentence(extension, empty, tmp_path):
    line = np.column_stack([np.linspace(-9, 9, 50), np.zeros((50, 2))])
    contact_file = extension.tactile_addon.files.contact_file
    path = tmp_path / "line.csv"
    contact_file.write(path, Contacts([], "", None, None, (Contour(line),)))
    before = datablocks(empty)
    with pytest.raises(RuntimeError, match="The strokes run along a line, two lines or a ring"):
        empty.ops.tactile.import_contacts(filepath=str(path))
    with pytest.raises(RuntimeError, match=r"expected none with .*which fits contours only"):
        empty.ops.tactile.import_contacts(filepath=str(path), method="tagc")
    assert datablocks(empty) == before


def test_contacts_in_any_order_are_drawn_along_their_curve(empty, measured):
    patch, report = imported(empty, measured(normals=False, shuffle=True))
    assert [report["k1"], report["k2"]] == pytest.approx([SURFACE.k1, SURFACE.k2], abs=2e-3)
    for path in patch["tactile_curves"]["contours"]:
        steps = np.linalg.norm(np.diff(np.reshape(path, (-1, 3)), axis=0), axis=1)
        assert steps.max() < 2.3  # it is 2 across the reference point, which is no contact


def test_what_a_file_says_of_its_patch_counts_unless_something_else_is_given(empty, measured, tmp_path):
    """The file names the side opposite to the bulge, and a point near the one where the curves meet."""
    path = Path(measured(normals=False))
    point, down = SURFACE.point + 0.01 * SURFACE.normal, -SURFACE.normal
    comments = "".join(
        f"# {key} {' '.join(map(repr, values.tolist()))}\n"
        for key, values in (("point", point), ("outward", down))
    )
    title, *rows = path.read_text().splitlines(keepends=True)
    path.write_text(title + comments + "# noise 0.5\n" + "".join(rows))
    _, report = imported(empty, str(path))
    assert report["frame"]["origin"] == pytest.approx(point, abs=0.1)  # the noise is .5
    assert np.dot(report["frame"]["normal"], down) > 0.99
    assert "misses" not in report
    _, other = imported(empty, str(path), point=list(SURFACE.point), outward=list(SURFACE.normal))
    assert other["frame"]["origin"] == pytest.approx(SURFACE.point, abs=0.1)
    assert np.dot(other["frame"]["normal"], SURFACE.normal) > 0.99
    _, sharp = imported(empty, str(path), noise=0.01)
    assert sharp["height_std"] < report["height_std"]
    _, scaled = imported(empty, str(path), unit="cm")
    assert scaled["frame"]["origin"] == pytest.approx(0.01 * point, abs=1e-3)
    assert scaled["height_std"] == pytest.approx(0.01 * report["height_std"], rel=1e-9)
    copy = tmp_path / "copy.csv"
    copy.write_text(path.read_text().replace("# point ", "# point 1"))
    words = "The files name different reference points: import them one by one"
    with pytest.raises(RuntimeError, match=words):
        imported(empty, str(path), directory=str(tmp_path), files=[{"name": path.name}, {"name": copy.name}])


def test_one_file_a_curve(extension, empty, tmp_path):
    names = []
    for number, contour in enumerate(contours_of(SURFACE)):
        rows = [",".join(map(str, row)) for row in contour.points.tolist()]
        names.append({"name": f"curve{number}.csv"})
        (tmp_path / names[-1]["name"]).write_text("\n".join(["x,y,z", *rows]))
    bpy = empty
    assert bpy.ops.tactile.import_contacts(directory=str(tmp_path), files=names) == {"FINISHED"}
    report = bpy.context.object["tactile"]
    assert (report["curves"], report["source"]) == (3, "curve0.csv")


def test_measured_normals_show_what_curves_hide(empty, measured):
    path = measured(HIDDEN)
    errors = []
    for normal_std, blind in ((0.0, 3), (0.02, 0)):
        patch, report = imported(empty, path, point=(0, 0, 0), normal_std=normal_std, degree=4)
        assert report["blind"] == blind
        errors.append(surfaces.off_data(HIDDEN, from_dict(json.loads(patch["tactile_reconstruction"]))))
    assert errors[1] < 0.1 * errors[0]


@pytest.mark.parametrize(
    ("text", "options", "words"),
    [
        ("x,y,z\n0,0,a\n", {}, '"contacts.csv", line 2, column "z": expected a number'),
        ("x,y,z\n0,0,1\n", {}, "The common point needs two or more curves, got 1"),
        ("finger,x,y,z\n1,0,0,1\n2,1,0,1\n", {}, 'got 1: name the curve of each contact in a column "curve"'),
        ("x,y,z\n0,0,1\n", {"point": (0, 0, 0)}, "Curve 1 has 1 of the 3 contacts it needs"),
        ("x,y,z\n1e60,0,1\n", {}, "expected numbers up to"),
        (None, {}, "There is no file"),
    ],
)
def test_what_cannot_be_imported_leaves_the_scene_as_it_was(empty, tmp_path, text, options, words):
    if text is not None:
        (tmp_path / "contacts.csv").write_text(text)
    before = datablocks(empty)
    with pytest.raises(RuntimeError, match=words):
        empty.ops.tactile.import_contacts(filepath=str(tmp_path / "contacts.csv"), **options)
    assert datablocks(empty) == before


def test_undo_takes_it_away(empty, measured):
    path = measured()
    empty.ops.ed.undo_push(message="Before")
    before = datablocks(empty)
    imported(empty, path)
    empty.ops.ed.undo_push(message="Imported")
    empty.ops.ed.undo()
    assert datablocks(empty) == before


def test_the_drop_handler_takes_the_files_in_a_viewport_only(extension, empty):
    handler = empty.types.TACTILE_FH_contacts
    assert handler.bl_import_operator == "tactile.import_contacts"
    assert handler.bl_file_extensions.split(";") == [".csv", ".ply"]
    window = empty.context.window_manager.windows[0]
    for area in window.screen.areas:
        with empty.context.temp_override(window=window, area=area):
            assert handler.poll_drop(empty.context) == (area.type == "VIEW_3D")


def test_contacts_go_out_and_come_back(extension, empty, measured, tmp_path):
    _, report = imported(empty, measured())
    out = tmp_path / "out.csv"
    assert empty.ops.tactile.export_contacts(filepath=str(out)) == {"FINISHED"}
    contours = extension.tactile_addon.files.contact_file.read(out).contours
    given = contours_of(SURFACE)
    for one, other in zip(given, contours, strict=True):
        assert other.points == pytest.approx(np.delete(one.points, 12, axis=0), abs=1e-5)
        assert other.normals == pytest.approx(np.delete(one.normals, 12, axis=0), abs=1e-5)
    _, again = imported(empty, str(out))
    assert again["frame"]["origin"] == pytest.approx(report["frame"]["origin"], abs=1e-5)
    assert again["height_std"] == pytest.approx(report["height_std"], rel=1e-3)


def test_a_patch_goes_out_as_json(extension, empty, measured, tmp_path):
    _, report = imported(empty, measured())
    assert empty.ops.tactile.export_patch(filepath=str(tmp_path / "out.json")) == {"FINISHED"}
    r = from_dict(json.loads((tmp_path / "out.json").read_text()))
    assert [r.patch.k1, r.patch.k2, r.status] == [report["k1"], report["k2"], report["status"]]
    assert r.mean_height_std == pytest.approx(report["height_std"])


def test_a_probes_patch_goes_out_too(extension, empty, tmp_path):
    add_sphere(empty)
    empty.ops.tactile.pick(target="Sphere", location=(0.3, -0.2, 1.9), extent=0.6)
    for operator, name in (
        (empty.ops.tactile.export_contacts, "c.csv"),
        (empty.ops.tactile.export_patch, "p.json"),
    ):
        assert operator(filepath=str(tmp_path / name)) == {"FINISHED"}
    r = from_dict(json.loads((tmp_path / "p.json").read_text()))
    contours = extension.tactile_addon.files.contact_file.read(tmp_path / "c.csv").contours
    assert len(r.contacts) == sum(len(c.points) for c in contours) - 3
    assert np.linalg.norm(np.vstack([c.points for c in contours]), axis=1) == pytest.approx(2.0, abs=2e-3)


def test_nothing_goes_out_without_a_patch(empty, measured, tmp_path):
    empty.ops.mesh.primitive_cube_add()
    assert not empty.ops.tactile.export_contacts.poll()
    assert not empty.ops.tactile.export_patch.poll()
    patch, _ = imported(empty, measured())
    with pytest.raises(RuntimeError, match="No such file or directory"):
        empty.ops.tactile.export_contacts(filepath=str(tmp_path / "no" / "out.csv"))
    del patch["tactile_reconstruction"]
    for export in (empty.ops.tactile.export_contacts, empty.ops.tactile.export_patch):
        with pytest.raises(RuntimeError, match="is not complete: end the gesture, or touch again"):
            export(filepath=str(tmp_path / "out"))


def test_what_is_shown_is_not_what_is_kept(extension, empty, measured, tmp_path):
    """Edits of the patch do not change what is exported; a move of the patch moves it."""
    patch, report = imported(empty, measured())
    before = extension.reconstruction_of(patch)
    patch.data.vertices[7].co.z += 5.0
    assert empty.ops.tactile.export_patch(filepath=str(tmp_path / "out.json")) == {"FINISHED"}
    r = from_dict(json.loads((tmp_path / "out.json").read_text()))
    assert np.array_equal(r.contacts, before.contacts)
    assert (r.patch.k1, r.patch.k2) == (report["k1"], report["k2"])
    patch.location.x += 0.25
    patch.scale *= 2.0
    empty.context.view_layer.update()
    moved = extension.reconstruction_of(patch)
    assert moved.frame.origin == pytest.approx(np.add(r.frame.origin, (0.25, 0.0, 0.0)), abs=1e-5)
    assert moved.contacts == pytest.approx(2.0 * r.contacts, rel=1e-5, abs=1e-5)
    assert moved.patch.k1 == pytest.approx(0.5 * r.patch.k1, rel=1e-5)
    with pytest.raises(ValueError, match="Wanted a patch or its probe"):
        extension.reconstruction_of(None)


def test_blenders_own_exporters_keep_vertices_and_colors(empty, measured, tmp_path):
    patch, _ = imported(empty, measured())
    count = len(patch.data.vertices)
    colors = values(patch.data, "curvature_color", "color", 4)
    empty.ops.wm.ply_export(filepath=str(tmp_path / "p.ply"), export_selected_objects=True)
    empty.ops.wm.obj_export(
        filepath=str(tmp_path / "p.obj"),
        export_selected_objects=True,
        export_colors=True,
        forward_axis="Y",
        up_axis="Z",
    )
    lines = (tmp_path / "p.obj").read_text().splitlines()
    vertices = [line.split() for line in lines if line.startswith("v ")]
    assert len(vertices) == count
    assert all(len(vertex) == 7 for vertex in vertices)
    world = positions(patch.data) @ np.array(patch.matrix_world)[:3, :3].T
    world += patch.matrix_world.translation
    assert np.array([v[1:4] for v in vertices], dtype=float) == pytest.approx(world, abs=1e-4)
    empty.ops.wm.ply_import(filepath=str(tmp_path / "p.ply"))
    mesh = empty.context.object.data
    assert len(mesh.vertices) == count
    (color,) = mesh.color_attributes
    found = np.array([tuple(value.color) for value in color.data])
    assert np.abs(found - colors).max() < 0.01


FIT = ["--json", "-"]


def report_in(out):
    (line,) = [line for line in out.splitlines() if line.startswith("{")]
    return json.loads(line)


def test_fit_from_the_shell(command, empty, measured, tmp_path):
    path = measured(unit="mm")
    for output in ("out.blend", "out.ply", "out.json"):
        code, out, err = command("fit", path, *FIT, "--output", tmp_path / output)
        assert (code, err) == (0, "")
        report = report_in(out)
        assert report["is_verified"] is False  # There is no mesh.
        # Lengths are in the unit of the file.
        assert report["k1"] == pytest.approx(SURFACE.k1, abs=2e-3)
        assert report["unit"] == "mm"
        assert (tmp_path / output).is_file()
    r = from_dict(json.loads((tmp_path / "out.json").read_text()))
    assert r.patch.k1 == report["k1"]
    head = (tmp_path / "out.ply").read_bytes()[:2000].decode("latin-1")
    assert f"element vertex {len(r.mesh()[0])}\n" in head
    empty.ops.wm.open_mainfile(filepath=str(tmp_path / "out.blend"))
    assert empty.context.scene.unit_settings.scale_length == pytest.approx(1e-3)
    assert empty.data.objects["scan.csv Patch"]["tactile"]["unit"] == "mm"


def test_every_option_of_fit_arrives(command, empty, measured):
    empty.ops.wm.read_homefile(use_empty=True)
    path, point = measured(), [str(x) for x in SURFACE.point]
    options = ["--unit", "cm", "--point", *point, "--outward", *(str(-x) for x in SURFACE.normal)]
    options += ["--method", "quadratic-variation", "--degree", "5", "--weight", "500", "--noise", "0.05"]
    code, out, _ = command("fit", path, *options, *FIT)
    assert code == 0
    report = report_in(out)
    assert [report[key] for key in ("method", "degree", "unit")] == ["quadratic-variation", 5, "cm"]
    assert report["frame"]["origin"] == pytest.approx(SURFACE.point, rel=1e-6)
    assert np.dot(report["frame"]["normal"], SURFACE.normal) < -0.99
    code, out, _ = command("fit", path, "--flip", "--normal-std", "0.0175", *FIT)
    report = report_in(out)
    assert report["blind"] == 0
    assert np.dot(report["frame"]["normal"], SURFACE.normal) < -0.99
    code, out, _ = command("fit", path)
    assert code == 0
    assert "curves miss it by" in out
    assert "72 on 3 curves" in out


def test_the_shell_tells_how_many_contacts_were_given_and_how_many_means_are_fitted(command):
    example = str(Path(__file__).resolve().parents[3] / "examples" / "contacts.csv")
    code, out, _ = command("fit", example)
    assert code == 0
    assert re.search(r"^contacts +240 on 3 curves and 5 strokes, fitted as 1\d\d$", out, re.MULTILINE)
    code, out, _ = command("fit", example, "--location", "0", "0", "17", "--radius", "8")
    assert code == 0
    assert re.search(r"^contacts +240 on 8 strokes, fitted as \d\d$", out, re.MULTILINE)


@pytest.mark.parametrize(
    ("words", "code", "sentence"),
    [
        (["missing.csv"], 1, 'there is no file "'),
        (["{folder}/bad.csv"], 1, '"bad.csv", line 2, column "y": expected a number, got "two"'),
        (["{folder}/scan.csv", "--output", "{folder}/no/out.ply"], 1, 'to write "out.ply" to'),
        (["{folder}/ball.obj"], 1, "expected a .csv or .ply file of contacts"),
        ([], 2, "FILE"),
        (["{folder}/scan.csv", "--unit", "furlong"], 2, "--unit"),
        (["{folder}/scan.csv", "{folder}/no/scan.csv"], 1, "there is no file"),
    ],
)
def test_what_cannot_be_fitted(command, empty, measured, tmp_path, words, code, sentence):
    measured()
    (tmp_path / "bad.csv").write_text("x,y,z\n1,two,3\n")
    (tmp_path / "ball.obj").write_text("")
    found, out, err = command("fit", *(word.format(folder=tmp_path) for word in words))
    assert found == code
    assert sentence in err
    assert "Traceback" not in out + err


def test_simulated_contacts_from_the_shell_are_a_data_set(command, files):
    csv = files / "contacts.csv"
    code, out, _ = command(
        "reconstruct", files / "ball.ply", *PLACE, "--noise", "1e-3", "--contacts", csv, *FIT
    )
    assert code == 0
    report = report_in(out)
    code, out, _ = command("fit", csv, "--noise", "1e-3", *FIT)  # The file has the reference point.
    assert code == 0
    again = report_in(out)
    assert again["contacts"] == report["contacts"]
    for key in ("k1", "k2", "height_std"):
        assert again[key] == pytest.approx(report[key], rel=0.02)


@pytest.mark.parametrize("place", ["common_point", "contacts_from_csv"])
def test_contacts_beyond_memory_are_a_sentence(empty, extension, tmp_path, monkeypatch, place):
    def exhausted(*_, **__):
        raise MemoryError

    (tmp_path / "contacts.csv").write_text("x,y,z\n0,0,0\n")
    monkeypatch.setattr(extension.tactile_addon.files.measured.core, place, exhausted)
    before = datablocks(empty)
    with pytest.raises(RuntimeError, match="There are more contacts than fit into memory: use fewer of them"):
        empty.ops.tactile.import_contacts(filepath=str(tmp_path / "contacts.csv"))
    assert datablocks(empty) == before
