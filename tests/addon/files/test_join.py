# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Measured contacts of several files as one whole object, by the operator and from the shell."""

import json

import numpy as np
import pytest

pytest.importorskip("bpy", reason="needs Blender as a Python module: run make test")
from scenes import datablocks, made, positions, values

from core import Contacts, Contour, atlas_of

CENTER, RADIUS = np.array([40.0, -3.0, 7.0]), 2.0
GOLDEN = np.pi * (3.0 - np.sqrt(5.0))


def ball(count=3000):
    """Contacts all over a ball, and their normals."""
    z = 1.0 - (2.0 * np.arange(count) + 1.0) / count
    turn, out = GOLDEN * np.arange(count), np.sqrt(1.0 - z**2)
    normals = np.column_stack([out * np.cos(turn), out * np.sin(turn), z])
    return CENTER + RADIUS * normals, normals


def raster(rows):
    """Rows of a bump that faces +z, without normals."""
    x = np.linspace(-1.0, 1.0, 60)
    for y in rows:
        yield np.column_stack([x, np.full(60, y), 0.3 * np.exp(-(x**2 + y**2) / 0.3)])


ROWS = np.linspace(-1.0, 1.0, 17)


@pytest.fixture
def write(extension, empty, tmp_path):
    """A function that writes strokes to a file of a given name and returns the path."""

    def write(name, strokes, **known):
        contact_file = extension.tactile_addon.files.contact_file
        contact_file.write(tmp_path / name, Contacts([], "", strokes=tuple(strokes), **known))
        return tmp_path / name

    return write


@pytest.fixture
def three_files(write):
    """Three files, each with a third of the contacts of a ball and with a reference point of its own."""
    points, normals = ball()
    thirds = np.array_split(np.random.default_rng(0).permutation(len(points)), 3)
    return [
        write(f"part{i}.csv", [Contour(points[some], normals=normals[some])], point=points[some[0]].tolist())
        for i, some in enumerate(thirds)
    ]


@pytest.fixture
def two_halves(write):
    return [
        write(f"half{i}.csv", [Contour(row) for row in raster(some)])
        for i, some in enumerate((ROWS[::2], ROWS[1::2]))
    ]


def joined(bpy, paths, **options):
    files = [{"name": path.name} for path in paths]
    place = {"filepath": str(paths[0]), "directory": str(paths[0].parent), "files": files}
    return made(bpy.ops.tactile.import_contacts, "tactile_object", **place, whole=True, **options)


@pytest.mark.long
def test_contacts_of_three_files_become_one_closed_surface(empty, three_files):
    surface, record = joined(empty, three_files, tolerance=0.02)
    assert surface.name == "part0.csv and 2 more Surface"
    unit = empty.context.scene.unit_settings
    assert (unit.system, unit.length_unit) == ("METRIC", "METERS")
    assert surface.tactile_range == pytest.approx(record["color_limit"])  # It is in 1/m^2, as of a patch.
    assert (record["source"], record["contacts"]) == ("part0.csv and 2 more", 3000)
    assert empty.context.view_layer.objects.active == surface
    assert record["is_closed"]
    assert record["message"].startswith("The surface is closed, and all contacts agree with it. No noise was")
    assert "deviation_mean" not in record
    place = np.array(surface.matrix_world)[:3, 3]
    off = np.linalg.norm(positions(surface.data) + place - CENTER, axis=1) - RADIUS
    assert np.abs(off).max() < 0.02
    assert values(surface.data, "gaussian_curvature") == pytest.approx(0.25, abs=0.06)
    assert not values(surface.data, "deviation").any()
    graph = json.loads(surface["tactile_graph"])
    assert len(graph["nodes"]) == record["patches"]
    assert len(graph["edges"]) == record["edges"] > 0
    curves = np.vstack([edge["curve"] for edge in graph["edges"]])
    assert np.abs(np.linalg.norm(curves - CENTER, axis=1) - RADIUS).max() < 0.03


def test_one_patch_of_files_with_points_of_their_own_is_still_refused(empty, three_files):
    files = [{"name": path.name} for path in three_files]
    with pytest.raises(RuntimeError, match="The files name different reference points"):
        empty.ops.tactile.import_contacts(directory=str(three_files[0].parent), files=files)


@pytest.mark.long
def test_where_no_normals_were_measured_the_outer_side_is_required(empty, two_halves):
    before = datablocks(empty)
    with pytest.raises(
        RuntimeError, match="Outward: expected a direction where contacts have no normals and do not close"
    ):
        joined(empty, two_halves)
    assert datablocks(empty) == before
    for outward, flip in (((0, 0, 1), False), ((0, 0, -1), True)):
        surface, record = joined(empty, two_halves, outward=outward, flip=flip, tolerance=4e-3)
        assert not record["is_closed"]
        assert record["status"] == "uncertain"
        assert record["message"].startswith("Nothing was felt beyond")
        normals = np.empty(3 * len(surface.data.vertices), dtype=np.float32)
        surface.data.vertices.foreach_get("normal", normals)
        # The mesh ends up to an edge beyond the last contacts, where the closed surface begins to turn away.
        over = np.abs([vertex.co[:2] for vertex in surface.data.vertices]).max(axis=1) <= 1.0
        up = normals.reshape(-1, 3)[:, 2] > 0.2
        assert up[over].all() and up.mean() > 0.99


@pytest.mark.long
def test_files_may_tell_the_outer_side_unless_they_contradict_each_other(empty, write):
    up = write("up.csv", [Contour(row) for row in raster(ROWS)], outward=[0.0, 0.0, 1.0])
    assert joined(empty, [up])[1]["patches"] > 1
    down = write("down.csv", [Contour(row) for row in raster(ROWS)], outward=[0.0, 0.0, -1.0])
    with pytest.raises(RuntimeError, match="Outward: expected a direction"):
        joined(empty, [up, down])


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"tolerance": -1.0}, "Tolerance: expected a finite number above 0, got -1"),
        ({"outward": (0, 0, 0)}, "Outward: expected"),
    ],
)
def test_what_cannot_be_is_refused_and_nothing_is_left(empty, two_halves, options, message):
    before = datablocks(empty)
    with pytest.raises(RuntimeError, match=message):
        joined(empty, two_halves, **{"outward": (0, 0, 1)} | options)
    assert datablocks(empty) == before


def test_too_few_contacts_get_a_sentence(empty, write):
    few = write("few.csv", [Contour(next(raster([0.0]))[:12])])
    with pytest.raises(RuntimeError, match="Contacts: expected 40 or more at different places, got 12"):
        joined(empty, [few], outward=(0, 0, 1))


@pytest.mark.long
def test_the_shell_joins_them_too(command, two_halves, tmp_path):
    paths = tmp_path / "out.json", tmp_path / "out.ply", tmp_path / "out.html"
    outputs = [word for pair in zip(("--json", "--output", "--report"), paths, strict=True) for word in pair]
    given = [*two_halves, "--outward", 0, 0, 1, "--tolerance", 4e-3]
    code, out, _ = command("join", *given, *outputs)
    assert code == 3  # There is a surface, and it is open.
    rows = {line[:32].strip(): line[32:].strip() for line in out.splitlines()}
    assert rows["measured"] == "half0.csv and 1 more, 1020 contacts"
    report = json.loads(paths[0].read_text())
    points = [*raster(ROWS[::2]), *raster(ROWS[1::2])]
    same = atlas_of(points, outward=(0, 0, 1), tolerance=4e-3)
    assert report["patches"] == len(report["graph"]["nodes"]) == len(same.patches)
    assert paths[1].stat().st_size > 10_000
    assert "Deviations" not in paths[2].read_text()
    code, _, err = command("join", *two_halves)
    assert code == 1
    assert "outward: expected a direction" in err.lower()


@pytest.mark.long
def test_the_shell_has_no_doubt_about_a_closed_surface(command, three_files):
    code, out, _ = command("join", *three_files, "--tolerance", 0.02)
    assert code == 0
    assert "all contacts agree with it" in " ".join(out.split())


@pytest.mark.parametrize(
    ("scale", "shift", "sentence"),
    [
        (1e39, 0.0, "The surface has a radius of 2e+39 and reaches to 2e+39, and Blender's"),
        (1e-30, 0.0, "The surface has a radius of 2e-30 and reaches to 2e-30, and Blender's"),
        (1.0, 1e12, "Neighboring coordinates at the surface are 6.6e+04 apart in single precision"),
    ],
)
def test_contacts_that_single_precision_does_not_hold_are_refused(command, write, scale, shift, sentence):
    points, normals = ball(400)
    path = write("ball.csv", [Contour(scale * (points - CENTER) + shift, normals=normals)])
    code, out, err = command("join", path, "--json", "-")
    assert code == 1
    assert err.startswith(f"tactile: {sentence}") or f"\ntactile: {sentence}" in err
    assert "{" not in out


def test_contacts_in_one_place_are_too_few(empty, write):
    path = write("one.csv", [Contour([[1.0, 2.0, 3.0]], normals=[[0.0, 0.0, 1.0]])])
    with pytest.raises(RuntimeError, match="Contacts: expected 40 or more at different places, got 1:"):
        joined(empty, [path])


def test_normals_without_a_direction_are_named(empty, write):
    points, normals = ball(400)
    path = write("ball.csv", [Contour(points, normals=0.0 * normals)])
    with pytest.raises(RuntimeError, match=r"Normals: expected vectors with a direction, got \(0, 0, 0\)"):
        joined(empty, [path])


def test_normals_that_contradict_each_other_are_refused_before_anything_is_joined(empty, command, write):
    points, normals = ball()
    half = [Contour(points[i::2], normals=(1 - 2 * i) * normals[i::2]) for i in (0, 1)]
    paths = [write(f"half{i}.csv", [some]) for i, some in enumerate(half)]
    before = datablocks(empty)
    sentence = "ormals: expected those of neighboring contacts on one side, got opposite ones around "
    with pytest.raises(RuntimeError, match=sentence):
        joined(empty, paths)
    assert datablocks(empty) == before
    code, _, err = command("join", *paths)
    assert code == 1
    assert sentence in err
    code, _, err = command("join", paths[0], "--noise", 5)
    assert code == 1
    assert "oise: expected less than the size of what was felt, 4, got 5" in err
