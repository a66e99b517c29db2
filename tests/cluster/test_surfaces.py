# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Data sets of whole objects: their surfaces and graphs, always the same, and what is refused."""

import subprocess
import sys

import numpy as np
import pytest
from data_sets import blocks_of, rows_of, write_ball, write_torus

pq = pytest.importorskip("pyarrow.parquet", reason="pyarrow is not installed: run make test-cluster")
MOVED = """
import sys
import bpy
bpy.ops.wm.read_homefile(use_empty=True)
bpy.ops.mesh.primitive_uv_sphere_add(segments=96, ring_count=48, location=(5.0, -3.0, 2.0))
bpy.context.object.scale = (-1.0, 1.0, 1.0)
bpy.ops.wm.save_as_mainfile(filepath=sys.argv[1])
"""
WORDS = ("--tolerance", "0.4%", "--limit", "120")
HOLE = np.sin(0.5 * np.pi / 48)  # the radius of the holes of the ball
AROUND = 1.0  # the radius of the torus; that of its tube is 0.4


def whole(folder, *words):
    """Runs `whole` on the objects in folder / "objects" and writes into folder / "set"."""
    from cluster.command_line import main

    return main(["whole", str(folder / "objects"), *WORDS, "--output", str(folder / "set"), *words])


@pytest.fixture(scope="module")
def surfaces(cluster, tmp_path_factory):
    """A folder with a ball, a torus and half a file, and the data set of their surfaces by two workers."""
    folder = tmp_path_factory.mktemp("surfaces")
    ball = write_ball(folder / "objects" / "ball.ply", rings=48).read_bytes()
    write_torus(folder / "objects" / "torus.ply")
    (folder / "objects" / "half.ply").write_bytes(ball[: len(ball) // 2])
    assert whole(folder, "--scheduler", cluster.scheduler.address) == 3
    return folder


@pytest.fixture
def rows(surfaces):
    files = blocks_of(surfaces / "set", "surfaces")
    return {row["object"]: row for path in files for row in pq.read_table(path).to_pylist()}


def test_a_surface_is_where_the_object_is(rows):
    for name, tube in (("ball", 1.0), ("torus", 0.4)):
        row = rows[name]
        vertices, triangles = (np.reshape(row[key], (-1, 3)) for key in ("vertices", "triangles"))
        middle = 0.0
        if name == "torus":
            middle = vertices * [1.0, 1.0, 0.0]
            middle *= AROUND / np.linalg.norm(middle, axis=1, keepdims=True)
        off = np.abs(np.linalg.norm(vertices - middle, axis=1) - tube)
        assert off.mean() < row["tolerance"]
        assert off.mean() == pytest.approx(row["deviation_mean"], abs=2e-3)  # the mesh has flat faces
        deviations = np.abs(row["vertex_deviations"])
        # Vertices are where the surface was felt, and its faces are chords between them.
        assert deviations.mean() == pytest.approx(row["deviation_mean"], abs=1e-3)
        assert row["deviation_mean"] < row["deviation_max"]
        if name == "ball":  # Its mesh has a hole at each pole, which the surface has not.
            # Its farthest place has the distance from the pole that is missing to the hole's radius.
            assert 0.9 * HOLE < row["deviation_max"] < 1.02 * HOLE
            assert row["status"] == "uncertain"
            assert "off the object beside an open edge of its mesh" in row["message"]
        else:
            assert row["deviation_max"] < 3.0 * row["tolerance"]
        assert deviations.max() <= row["deviation_max"] * (1.0 + 1e-6)
        assert np.mean(row["vertex_stds"]) == pytest.approx(row["height_std"])
        a, b, c = vertices[triangles].swapaxes(0, 1)
        normals, outward = np.cross(b - a, c - a), (vertices - middle)[triangles[:, 0]]
        assert (np.einsum("ni,ni->n", normals, outward) > 0.0).mean() > 0.99
    ball = rows["ball"]
    count, faces = len(ball["vertices"]) // 3, len(ball["triangles"]) // 3
    assert ball["is_closed"] and ball["uncovered"] == 0 and count - faces // 2 == 2  # Euler's number


def test_a_graph_has_the_patches_and_who_is_beside_whom(rows):
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    for name in ("ball", "torus"):
        row = rows[name]
        count, edges = row["touches"], np.reshape(row["edges"], (-1, 2))
        names = ("radii", "k1", "k2", "k1_stds", "k2_stds", "height_stds")
        assert {len(row[each]) for each in names} == {count}
        assert row["in_doubt"] <= count and set(row["vertex_nodes"]) <= set(range(count))
        graph = coo_array((np.ones(len(edges)), edges.T), shape=(count, count))
        assert connected_components(graph, directed=False)[0] == 1
        axes = np.reshape(row["axes"], (-1, 3, 3))
        assert axes @ axes.swapaxes(1, 2) == pytest.approx(np.broadcast_to(np.eye(3), axes.shape), abs=1e-9)
    origins = np.reshape(rows["ball"]["origins"], (-1, 3))
    normals = np.reshape(rows["ball"]["axes"], (-1, 3, 3))[:, 2]
    assert np.einsum("ni,ni->n", origins, normals) == pytest.approx(1.0, abs=0.02)
    assert np.median(rows["ball"]["k1"]) == pytest.approx(-1.0, abs=0.05)


def test_objects_have_the_numbers_and_a_broken_file_its_reason(surfaces, rows):
    objects = pq.read_table(surfaces / "set" / "objects.parquet").to_pylist()
    assert [row["object"] for row in objects] == ["ball", "half", "torus"]
    for row in objects:
        found = rows[row["object"]]
        if row["object"] == "half":
            assert (row["touches"], row["error"], row["hash"], row["is_closed"]) == (1, 1, None, None)
            assert row["message"] == found["message"]
            assert found["message"] == 'no mesh could be read from "half.ply": is the file complete?'
            assert found["status"] == "error" and found["vertices"] is None
            continue
        assert row["error"] == 0 and row["seconds"] > 0.0
        names = ("hash", "touches", "in_doubt", "uncovered", "is_closed", "height_std", "tolerance")
        for name in (*names, "deviation_mean", "deviation_max"):
            assert row[name] == found[name]
        assert row["tolerance"] == pytest.approx(0.004 * row["size"])


def test_an_object_that_was_moved_and_mirrored_is_touched_where_it_is(cluster, tmp_path):
    (tmp_path / "objects").mkdir()
    made = [sys.executable, "-c", MOVED, str(tmp_path / "objects" / "moved.blend")]
    subprocess.run(made, check=True, stdout=subprocess.DEVNULL)
    assert whole(tmp_path, "--scheduler", cluster.scheduler.address, "--noise", "0.001") == 0
    (path,) = blocks_of(tmp_path / "set", "surfaces")
    (row,) = pq.read_table(path).to_pylist()
    assert row["is_closed"] and row["noise"] == 0.001
    apart = np.reshape(row["vertices"], (-1, 3)) - (5.0, -3.0, 2.0)
    assert np.abs(np.linalg.norm(apart, axis=1) - 1.0).max() < 0.03
    frames = np.reshape(row["axes"], (-1, 3, 3))
    out = np.reshape(row["origins"], (-1, 3)) - (5.0, -3.0, 2.0)
    assert np.einsum("ni,ni->n", out, frames[:, 2]) == pytest.approx(1.0, abs=0.02)


def test_surfaces_are_the_same_with_one_worker_as_with_two(surfaces, tmp_path):
    (tmp_path / "objects").symlink_to(surfaces / "objects")
    assert whole(tmp_path, "--workers", "1") == 3
    assert rows_of(tmp_path / "set", "surfaces") == rows_of(surfaces / "set", "surfaces")


def test_a_second_run_does_what_is_missing_and_other_options_are_refused(surfaces, cluster, capfd):
    before = rows_of(surfaces / "set", "surfaces")
    blocks = blocks_of(surfaces / "set", "surfaces")
    blocks[0].unlink()
    address = ("--scheduler", cluster.scheduler.address)
    assert whole(surfaces, *address) == 3
    said = capfd.readouterr()
    assert "of 2 blocks are there already" in said.err and said.out.startswith("3 objects, ")
    assert rows_of(surfaces / "set", "surfaces") == before
    assert whole(surfaces, *address, "--seed", "1") == 2
    assert "seed: this data set was begun with 0, and it is now 1: use the same" in capfd.readouterr().err


def test_touches_are_not_mixed_with_surfaces(command, surfaces):
    code, _, error = command(surfaces / "objects", "--output", surfaces / "set")
    assert code == 2 and "use the same again, or another folder" in error
    assert not (surfaces / "set" / "touches").exists()


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["--noise", "1%"], "tolerance: expected the noise 1% or more, got 0.4%"),
        (["--seed", "-1"], "seed: expected a number of 0 or more, got -1"),
        (["--seed", "9" * 30], "seed: expected a number up to 9223372036854775807, got 99999999"),
    ],
)
def test_wrong_words_are_refused_before_anything_is_made(tmp_path, capfd, words, sentence):
    write_ball(tmp_path / "objects" / "ball.ply")
    assert whole(tmp_path, "--workers", "1", *words) == 2
    assert sentence in capfd.readouterr().err
    assert not (tmp_path / "set").exists()
