# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What is in a data set, what another run does to it, and what is refused."""

import json

import numpy as np
import pytest
from data_sets import FEW, blocks_of, nothing_is_aside, rows_of, write_ball

pq = pytest.importorskip("pyarrow.parquet", reason="pyarrow is not installed: run make test-cluster")


def rows(folder):
    return [row for path in blocks_of(folder) for row in pq.read_table(path).to_pylist()]


def test_two_objects_of_one_name_are_two(plain):
    objects = pq.read_table(plain / "objects.parquet").to_pylist()
    assert [row["object"] for row in objects] == ["egg", "egg", "pebble"]
    assert len({row["hash"] for row in objects}) == 3
    assert [row["touches"] for row in objects] == [30, 30, 30]
    for row in objects:
        found = [each for each in rows(plain) if each["hash"] == row["hash"]]
        assert sorted(each["touch"] for each in found) == list(range(30))
        assert {each["object"] for each in found} == {row["object"]}
        assert sum(row[name] for name in ("ok", "in_doubt", "refused", "error")) == 30
        assert row["seconds"] > 0.0 and row["unit"] is None


def test_a_row_tells_the_patch(plain):
    (egg,) = {row["hash"] for row in rows(plain) if row["object"] == "pebble"}
    found = [row for row in rows(plain) if row["hash"] == egg and row["status"] == "ok"]
    assert len(found) > 15
    for row in found:
        contacts, normals = (np.reshape(row[name], (-1, 3)) for name in ("contacts", "normals"))
        assert len(contacts) == len(normals) == sum(row["curves"])
        assert len(row["curves"]) == len(row["azimuths"]) == len(row["tilts"]) == len(row["stops"]) / 2
        # All contacts are on the ellipsoid, up to its faces; the frame is right-handed and points outward.
        assert np.abs(np.linalg.norm(contacts / [2.0, 1.5, 1.0], axis=1) - 1.0).max() < 0.02
        axes = np.reshape(row["axes"], (3, 3))
        assert axes @ axes.T == pytest.approx(np.eye(3), abs=1e-12)
        assert np.linalg.det(axes) > 0.0 and np.dot(axes[2], row["outward"]) > 0.8
        assert np.linalg.norm(np.subtract(row["origin"], row["location"])) < 0.1 * row["radius"]
        assert row["k1"] <= row["k2"] and row["k1"] < 0.0  # it is convex
        local = (contacts - row["origin"]) @ axes.T
        assert np.hypot(*local.T[:2]).max() == pytest.approx(row["radius"], rel=1e-6)
        assert 0.0 <= row["mesh_error"] < 0.05 * row["radius"]
        assert row["noise"] == 0.0 and row["seed"] == 0


def test_noise_is_a_share_of_the_object_where_it_is_said_so(command, objects, tmp_path):
    words = ("--touches", "10", "--noise", "0.1%", "--extent", "10%", "--step", "0.02")
    code, *_ = command(objects / "pebble.ply", *words, "--output", tmp_path / "set")
    assert code == 0
    size = pq.read_table(tmp_path / "set" / "objects.parquet")["size"][0].as_py()
    assert size == pytest.approx(4.0, rel=0.01)
    for row in rows(tmp_path / "set"):
        assert (row["noise"], row["step"]) == pytest.approx((0.001 * size, 0.02))
        assert row["extent"] == pytest.approx(0.1 * size)


def test_units_and_meanings_are_in_the_files(plain):
    from cluster.data_set import columns

    files = ((blocks_of(plain)[0], columns.TOUCHES), (plain / "objects.parquet", columns.OBJECTS))
    for path, wanted in files:
        schema = pq.read_schema(path)
        for name, _, unit, meaning in wanted:
            found = schema.field(name).metadata
            assert (found[b"unit"].decode(), found[b"description"].decode()) == (unit, meaning), name


def test_rows_are_the_same_with_one_worker_as_with_two(plain, objects, tmp_path):
    from cluster.command_line import main

    words = ["touch", str(objects), *FEW, "--output", str(tmp_path), "--workers", "1"]
    assert main(words) == 0
    assert rows_of(tmp_path) == rows_of(plain)


def test_another_seed_gives_other_rows_and_another_place_of_the_file_the_same(
    command, plain, objects, tmp_path
):
    other, moved = tmp_path / "other", tmp_path / "moved"
    copy = tmp_path / "a copy" / "egg.ply"
    copy.parent.mkdir()
    copy.write_bytes((objects / "a" / "egg.ply").read_bytes())
    assert command(copy, *FEW, "--output", moved)[0] == 0
    assert {path.name for path in blocks_of(moved)} < {path.name for path in blocks_of(plain)}
    for path in blocks_of(moved):
        assert pq.read_table(path) == pq.read_table(plain / "touches" / path.name)
    assert command(copy, *FEW, "--output", other, "--seed", "1")[0] == 0
    assert not np.allclose(rows(other)[0]["location"], rows(moved)[0]["location"])


def test_a_second_run_does_what_is_missing(command, objects, tmp_path, plain):
    assert command(objects / "a", *FEW, "--output", tmp_path)[0] == 0
    first, second, third = blocks_of(tmp_path)
    second.unlink()
    (tmp_path / "touches" / ".left-aside.parquet").write_bytes(b"half of a block")
    times = [path.stat().st_mtime_ns for path in (first, third)]
    code, output, error = command(objects, *FEW, "--output", tmp_path)  # objects are added as well
    assert code == 0 and "2 of 9 blocks are there already" in error
    assert "3 objects, 90 touches" in output
    assert [path.stat().st_mtime_ns for path in (first, third)] == times
    assert rows_of(tmp_path) == rows_of(plain)
    assert nothing_is_aside(tmp_path)


def test_a_changed_option_version_or_object_is_refused(command, tmp_path):
    ball = write_ball(tmp_path / "ball.ply")
    words = (ball, "--touches", "4", "--output", tmp_path / "set")
    assert command(*words)[0] == 0
    before = rows_of(tmp_path / "set")
    code, _, error = command(*words, "--extent", "5%")
    assert code == 2
    assert error.startswith(
        "cluster: extent: this data set was begun with auto, and it is now 5%: use the same"
    )
    manifest = tmp_path / "set" / "manifest.json"
    kept = manifest.read_text()
    manifest.write_text(kept.replace('"scipy": "', '"scipy": "0.'))
    code, _, error = command(*words)
    assert code == 2 and "scipy: this data set was begun with 0." in error
    manifest.write_text(kept[:40])
    code, _, error = command(*words)
    assert code == 2 and "is not the manifest of a data set: use another folder" in error
    manifest.write_text(kept)
    write_ball(ball, (1.0, 1.0, 1.1))
    code, _, error = command(*words)
    assert (
        code == 2
        and "has changed since this data set was begun, or can no longer be read: put the old" in error
    )
    assert rows_of(tmp_path / "set") == before
    assert json.loads(manifest.read_text()) == json.loads(kept)


def test_the_same_object_twice_is_touched_once(command, tmp_path):
    write_ball(tmp_path / "one.ply")
    write_ball(tmp_path / "two.ply")
    code, output, error = command(tmp_path, "--touches", "4", "--output", tmp_path / "set")
    assert code == 0 and output.startswith("1 object, 4 touches")
    assert "two.ply) is the same as one (" in error


def test_a_list_that_names_itself_is_refused(command, tmp_path):
    (tmp_path / "all.txt").write_text("all.txt\n")
    code, _, error = command(tmp_path / "all.txt", "--output", tmp_path / "set")
    assert code == 2 and f'in the list "{tmp_path / "all.txt"}", got a list' in error


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["nowhere.ply"], 'objects: there is no file or folder "nowhere.ply"'),
        ([__file__], "objects: expected .ply, .stl, .obj, .blend files, folders or .txt lists, got"),
        ([".ci"], "objects: expected .ply, .stl, .obj, .blend files, got folders or lists without any"),
        (["pebble", "--seed", "-1"], "seed: expected a number of 0 or more, got -1"),
        (["pebble", "--seed", "9" * 30], "seed: expected a number up to 9223372036854775807, got 99999999"),
        (["pebble", "--touches", "0"], "expected a number of 1 or more, got 0"),
        (["pebble", "--limit", "nan"], "expected a number above 0, got nan"),
        (
            ["pebble", "--noise", "-1"],
            "expected a length such as 0.002, or a share of the object such as 1.5%, got -1",
        ),
        (["pebble", "--tilts", "5"], "tilts: expected as many as there are planes, 3, got 1"),
        (["pebble", "--tilts", "0", "0", "95"], "tilt: expected less than 90 degrees, got 95"),
        (["pebble", "--azimuths", "0", "60"], "three curves are needed, got 2: add a sampling plane"),
        (["pebble", "--azimuths", "0", "0.5", "60"], "curves 1 and 2 run in the same direction"),
    ],
)
def test_wrong_words_are_refused_before_anything_is_made(command, objects, tmp_path, words, sentence):
    words = [str(objects / "pebble.ply") if word == "pebble" else word for word in words]
    code, _, error = command(*words, "--output", tmp_path / "set")
    assert code == 2 and sentence in error
    assert not (tmp_path / "set").exists()


def test_a_list_names_files_next_to_it(objects):
    from cluster.input_files import files_of

    listed = objects / "all.txt"
    listed.write_text("pebble.ply\n\na\n")
    expected = [str(objects / name) for name in ("a/egg.ply", "pebble.ply")]
    assert files_of([listed]) == expected
    assert files_of([listed, objects / "a" / "egg.ply"]) == expected  # each file is there once
    listed.unlink()


def test_each_object_of_a_scene_is_one(command, tmp_path):
    square = "v 0 0 {0}\nv 1 0 {0}\nv 0 1 {0}\nv 1 1 {0}\n"
    faces = ("f 1 2 4 3\n", "f 5 6 8 7\n")
    (tmp_path / "two.obj").write_text(
        f"o Near\n{square.format(0)}{faces[0]}o Far\n{square.format(3)}{faces[1]}"
    )
    assert command(tmp_path / "two.obj", "--touches", "3", "--output", tmp_path / "set")[0] == 0
    objects = pq.read_table(tmp_path / "set" / "objects.parquet").to_pylist()
    assert [row["object"] for row in objects] == ["Far", "Near"]
    for row in rows(tmp_path / "set"):
        assert row["location"][2] == pytest.approx({"Near": 0.0, "Far": 3.0}[row["object"]])


@pytest.mark.parametrize("name", ["sha256:x", "sha256:" + 64 * "0", "a\nsha256:" + 64 * "0"])
def test_no_name_is_taken_for_a_checksum(tmp_path, name):
    from cluster.data_set import folder

    data_set = folder.DataSet(tmp_path, "touches")
    data_set.create()
    facts = {"name": name, "file": f"/{name}.ply", "hash": None}
    data_set.write_errors(facts, 0, range(3), f"{name} is broken")
    (path,) = data_set.files()
    assert folder.is_whole(path)
    assert pq.read_table(path)["object"].to_pylist() == [name] * 3
    assert not folder.is_whole(path.rename(data_set.block_path("0" * 16, 7)))
