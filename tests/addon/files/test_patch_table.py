# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What several patches have found, as one table: by File > Export and from the shell."""

import csv

import pytest

pytest.importorskip("bpy", reason="needs Blender as a Python module: run make test")
from scenes import add_sphere


@pytest.fixture
def probes(empty):
    """A scene in millimeters with a ball of radius 20 and two probes on it."""
    settings = empty.context.scene.unit_settings
    settings.system, settings.scale_length, settings.length_unit = "METRIC", 1e-3, "MILLIMETERS"
    add_sphere(empty, radius=20.0)
    for place in ((0.0, -5.0, 19.0), (19.0, 3.0, 4.0)):
        empty.ops.tactile.pick(target="Sphere", location=place, new=True)
    return [obj for obj in empty.data.objects if obj.type == "EMPTY"]


def rows_of(path):
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


def test_a_row_a_probe_with_the_unit_in_the_header(empty, probes, tmp_path, capfd):
    path = tmp_path / "probes.csv"
    assert empty.ops.tactile.export_table(filepath=str(path)) == {"FINISHED"}
    assert 'Wrote a table of 2 patches: "probes.csv"' in capfd.readouterr().out
    rows = rows_of(path)
    assert sorted(row["probe"] for row in rows) == sorted(probe.name for probe in probes)
    for row in rows:
        found = empty.data.objects[row["patch"]]["tactile"].to_dict()
        assert float(row["k1 [1/mm]"]) == pytest.approx(found["k1"], rel=1e-6)
        assert float(row["gaussian_curvature [1/mm²]"]) == pytest.approx(0.0025, rel=0.1)
        assert float(row["x [mm]"]) == pytest.approx(found["frame"]["origin"][0], rel=1e-6)
        assert float(row["vertex_distance_mean [mm]"]) < 0.1
        assert float(row["shape_index"]) == pytest.approx(1.0, abs=0.1)
        assert (row["source"], row["status"]) == ("Sphere", "ok")


def test_lengths_are_divided_by_the_unit_of_the_header(empty, probes, tmp_path):
    empty.context.scene.unit_settings.length_unit = "CENTIMETERS"
    path = tmp_path / "probes.csv"
    empty.ops.tactile.export_table(filepath=str(path))
    for row in rows_of(path):
        found = empty.data.objects[row["patch"]]["tactile"].to_dict()
        assert float(row["radius [cm]"]) == pytest.approx(0.1 * found["radius"], rel=1e-6)
        assert float(row["k2 [1/cm]"]) == pytest.approx(10.0 * found["k2"], rel=1e-6)
        assert float(row["gaussian_curvature [1/cm²]"]) == pytest.approx(0.25, rel=0.1)


def test_only_selected_ones(empty, probes, tmp_path):
    path = tmp_path / "one.csv"
    empty.ops.object.select_all(action="DESELECT")
    probes[1].select_set(True)
    empty.ops.tactile.export_table(filepath=str(path), use_selection=True)
    assert [row["probe"] for row in rows_of(path)] == [probes[1].name]
    probes[1].select_set(False)
    with pytest.raises(RuntimeError, match="There is no patch to export: pick a reference point first"):
        empty.ops.tactile.export_table(filepath=str(path), use_selection=True)


def test_from_the_shell(empty, probes, command, tmp_path):
    blend, path = tmp_path / "probes.blend", tmp_path / "probes.csv"
    empty.ops.wm.save_as_mainfile(filepath=str(blend))
    code, out, _ = command("table", blend, "--output", path)
    assert (code, out.splitlines()[-1]) == (0, "2 rows written")
    assert len(rows_of(path)) == 2
    code, _, err = command("table", blend, "--output", tmp_path / "probes.ply")
    assert code == 2
    assert "--output: expected a file .csv" in err
    empty.ops.wm.read_homefile(use_empty=True)
    code, _, err = command("table", "--output", path)
    assert (code, err) == (1, "tactile: There is no patch to export: pick a reference point first\n")


@pytest.mark.parametrize("start", "=+-@\t\r")
def test_no_spreadsheet_takes_a_name_for_a_formula(empty, probes, command, tmp_path, start):
    name = f"{start}cmd|'/c calc'!A0"
    empty.data.objects["Sphere"].name = name
    empty.ops.tactile.pick(target=empty.context.scene.objects[0].name, location=(0.0, 19.0, 5.0), new=True)
    path = tmp_path / "probes.csv"
    empty.ops.tactile.export_table(filepath=str(path))
    rows = rows_of(path)
    for row in rows:
        words = [row[key] for key in ("probe", "patch", "source", "method", "status", "message")]
        assert not any(word.startswith(tuple("=+-@\t\r")) for word in words)
        assert float(row["k1 [1/mm]"]) < 0.0  # numbers stay as they are
    assert f"'{name}" in [row["source"] for row in rows]
    blend, path = tmp_path / "named.blend", tmp_path / "verified.csv"
    empty.ops.wm.save_as_mainfile(filepath=str(blend))
    place = ("--location", 0, -5, 19, "--extent", 3, "--verify", path)
    assert command("reconstruct", blend, "--target", name, *place)[0] == 0
    (row,) = rows_of(path)
    assert (row["source"], row["target"]) == (f"'{name}", f"'{name}")


@pytest.mark.parametrize(
    "edit",
    [
        lambda record: record.__delitem__("method"),
        lambda record: record.__setitem__("k1_std", "words"),
        lambda record: record.__setitem__("method", 7),
    ],
)
def test_an_edited_patch_is_a_sentence_in_its_row(empty, probes, tmp_path, edit):
    patch = probes[0].children[0]
    edit(patch["tactile"])
    path = tmp_path / "probes.csv"
    assert empty.ops.tactile.export_table(filepath=str(path)) == {"FINISHED"}
    rows = {row["probe"]: row for row in rows_of(path)}
    assert rows[probes[0].name]["message"].endswith("is no longer a complete patch: touch again")
    assert rows[probes[0].name]["k1 [1/mm]"] == ""
    assert float(rows[probes[1].name]["k1 [1/mm]"]) < 0.0
    assert rows[probes[1].name]["status"] == "ok"
