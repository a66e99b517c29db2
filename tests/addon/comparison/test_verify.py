# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Verify Against Mesh of the installed extension in a real Blender, without a window."""

import csv
import json
import math
import re

import numpy as np
import pytest

pytest.importorskip("bpy", reason="needs Blender as a Python module: run make test")
from mathutils import Matrix
from scenes import add_sphere, positions, values

RADIUS = 2.0
TOP = (0.3, -0.2, 1.9)
TOUCH = {"target": "Sphere", "location": TOP, "extent": 0.6, "step": 0.06}


def add_ball(bpy, radius=RADIUS, name="Sphere"):
    ball = add_sphere(bpy, radius=radius)
    ball.name = name
    return ball


@pytest.fixture
def patch(empty):
    """The patch of a finely faceted ball of radius 2; it is active, and nothing else is selected."""
    add_ball(empty)
    assert empty.ops.tactile.reconstruct(**TOUCH) == {"FINISHED"}
    return empty.context.object


def verified(bpy, patch, **arguments):
    assert bpy.ops.tactile.verify(**arguments) == {"FINISHED"}
    return patch["tactile"]["verification"].to_dict()


def state(obj):
    """All of a mesh object that a verification might change by mistake."""
    names = sorted(obj.data.attributes.keys())
    return (
        obj.name,
        [list(row) for row in obj.matrix_world],
        [tuple(vertex.co) for vertex in obj.data.vertices],
        names,
        obj.data.materials.keys(),
        sorted(obj.keys()),
    )


def activate(bpy, obj, *others):
    bpy.ops.object.select_all(action="DESELECT")
    for one in (obj, *others):
        one.select_set(True)
    bpy.context.view_layer.objects.active = obj


def test_by_default_the_mesh_that_was_touched(empty, patch):
    ball = empty.data.objects["Sphere"]
    before, report = state(ball), patch["tactile"].to_dict()
    names, deviation = set(empty.data.objects.keys()), values(patch.data, "deviation")
    found = verified(empty, patch)
    assert found["target"] == "Sphere"
    assert found["vertices"] == report["vertices"] > 200
    assert found["vertex_distance_mean"] == pytest.approx(report["vertex_distance_mean"])
    assert found["vertex_distance_max"] == pytest.approx(report["vertex_distance_max"])
    assert 0.0 < found["vertex_distance_median"] <= found["vertex_distance_max"]
    assert found["vertex_distance_mean"] <= found["vertex_distance_rms"] <= found["vertex_distance_max"]
    assert found["contacts"] == report["contacts"] == 60
    assert found["fit_error"] == pytest.approx(report["fit_error"])
    assert found["extra_contours"] == 9
    assert found["extra_points"] > 9 * 20
    assert found["extra_fit_error"] < 0.005
    assert found["total_absolute_curvature"] == pytest.approx(report["total_absolute_curvature"])
    assert found["overlap"] == 1.0
    # Nothing else has changed: not the ball, not the rest of the report, not the deviation.
    after = patch["tactile"].to_dict()
    assert after.pop("verification") == found
    assert patch.tactile_colors == "deviation"
    shown = {"color_limit"}  # of the deviation now
    assert {key: after[key] for key in after.keys() - shown} == {
        key: report[key] for key in report.keys() - shown
    }
    assert state(ball) == before
    assert set(empty.data.objects.keys()) == names
    assert values(patch.data, "deviation") == pytest.approx(deviation, abs=1e-6)


def test_another_mesh_of_known_distance_by_name_and_by_selection(empty, patch):
    """A ball 0.01 larger about the same center is 0.01 outside the patch."""
    other, report = add_ball(empty, RADIUS + 0.01, "Larger"), patch["tactile"].to_dict()
    activate(empty, patch)
    named = verified(empty, patch, target="Larger")
    assert named["target"] == "Larger"
    assert named["vertex_distance_mean"] == pytest.approx(0.01, rel=0.05)
    assert named["extra_fit_error"] == pytest.approx(0.01, rel=0.1)
    assert values(patch.data, "deviation").mean() == pytest.approx(-0.01, rel=0.1)
    assert patch["tactile"]["status"] == "uncertain"
    activate(empty, patch, other)
    selected = verified(empty, patch)
    assert selected == named
    # Verified against the ball that was touched, the patch has its first status and message again.
    activate(empty, patch)
    assert verified(empty, patch)["target"] == "Sphere"
    assert [patch["tactile"][key] for key in ("status", "message")] == [report["status"], report["message"]]


@pytest.mark.parametrize("scale", [1.0, 1e-3, 40.0])
def test_patch_and_mesh_moved_turned_and_in_another_unit(empty, patch, scale):
    one = verified(empty, patch)
    turn = Matrix.Rotation(0.7, 4, (1.0, 2.0, -0.5))
    move = Matrix.Translation((3.0 * scale, -scale, 0.5 * scale)) @ turn @ Matrix.Scale(scale, 4)
    ball = empty.data.objects["Sphere"]
    for obj in (ball, patch):
        obj.matrix_world = move @ obj.matrix_world
    empty.context.view_layer.update()
    other = verified(empty, patch)
    assert set(one) == set(other)
    for key, value in one.items():
        if isinstance(value, float):
            expected = value * (scale if "distance" in key or "error" in key else 1.0)
            assert other[key] == pytest.approx(expected, rel=0.02, abs=2e-6 * scale), key
    assert other["vertices"] == pytest.approx(one["vertices"], abs=2)
    # The result is the same where the mesh's own coordinates keep the old unit and its transform scales them.
    ball.data.transform(Matrix.Scale(1.0 / scale, 4))
    ball.matrix_world = ball.matrix_world @ Matrix.Scale(scale, 4)
    empty.context.view_layer.update()
    again = verified(empty, patch)
    assert again["vertex_distance_mean"] == pytest.approx(other["vertex_distance_mean"], rel=0.02)


def test_large_faces_contradict_a_patch_too(empty, extension):
    """None of the plane's vertices is over the patch, and all of it is off the plane."""
    empty.ops.mesh.primitive_plane_add(size=10.0)
    assert empty.ops.tactile.reconstruct(target="Plane", location=(0.0, 0.0, 0.0), extent=0.6) == {"FINISHED"}
    patch = empty.context.object
    verified(empty, patch)
    verdict = extension.tactile_addon.touch.wording.verdict
    assert verdict(patch["tactile"]).startswith("Good: heights to")
    patch.location.z += 0.05
    empty.context.view_layer.update()
    assert verified(empty, patch)["vertices"] == 0
    assert patch["tactile"]["message"].startswith(
        "Between the curves the surface is up to 8.3 % of the radius off"
    )
    assert verdict(patch["tactile"]).startswith("Doubtful: ")


def test_a_patch_moved_off_its_mesh(empty, patch):
    patch.matrix_world = Matrix.Translation(0.05 * patch.matrix_world.col[2].xyz) @ patch.matrix_world
    empty.context.view_layer.update()
    found = verified(empty, patch)
    assert found["vertex_distance_max"] == pytest.approx(0.05, rel=0.05)
    assert found["contact_distance_max"] < 1e-3
    assert values(patch.data, "deviation").mean() == pytest.approx(0.05, rel=0.05)


def test_the_scenes_unit_is_the_panels(empty, patch, extension):
    addon = extension.tactile_addon
    settings = empty.context.scene.unit_settings
    settings.system, settings.scale_length, settings.length_unit = "METRIC", 0.001, "MILLIMETERS"
    found = verified(empty, patch)
    unit = addon.touch.units.unit_of(empty.context.scene, patch["tactile"]["radius"])
    head, *rows, points = addon.comparison.operators.verification_table(patch["tactile"])
    assert head == ("in mm", "Mesh | Contacts")
    assert [row[0] for row in rows] == ["Mean", "Median", "Maximum", "RMS"]
    assert rows[0][1].startswith(f"{found['vertex_distance_mean']:.3g} | ")
    assert points == ("Points", f"{found['vertices']} | 60")
    rows = dict(addon.comparison.operators.main_rows(patch["tactile"]))
    assert rows["Overlap"] == "100 %"
    farthest = np.abs(values(patch.data, "deviation")).max()
    assert rows["Largest Deviation"] == addon.touch.units.say(farthest, 1, unit)


def test_half_covered_and_nothing_below(empty, patch, capfd):
    cut = add_ball(empty, name="Half").data
    point = np.array(patch["tactile"]["frame"]["origin"])
    across = np.cross(point, (1.0, 0.0, 0.0))
    at = np.array([vertex.co for vertex in cut.vertices])
    empty.ops.object.mode_set(mode="EDIT")
    empty.ops.mesh.select_all(action="SELECT")
    empty.ops.mesh.bisect(plane_co=point, plane_no=across, clear_inner=True)
    empty.ops.object.mode_set(mode="OBJECT")
    assert len(cut.vertices) < 0.6 * len(at)
    activate(empty, patch)
    found = verified(empty, patch, target="Half")
    assert found["overlap"] == pytest.approx(0.5, abs=0.03)
    assert found["vertices"] < patch["tactile"]["vertices"]
    assert "the mesh covers 5" in capfd.readouterr().out.replace("covers 4", "covers 5")
    add_ball(empty, 0.1, "Far")
    activate(empty, patch)
    found = verified(empty, patch, target="Far")
    assert (found["vertices"], found["extra_contours"], found["overlap"]) == (0, 0, 0.0)
    assert 'Nothing of "Far" is below the patch' in capfd.readouterr().out


def test_layers_hidden_from_a_finger_do_not_count(empty, patch):
    single = verified(empty, patch)
    for i, radius in enumerate((0.99, 0.95)):  # inner walls, which face outward too
        add_ball(empty, radius * RADIUS, f"Wall {i}")
    empty.context.view_layer.objects.active = empty.data.objects["Sphere"]
    for obj in empty.data.objects:
        obj.select_set(obj.name in ("Sphere", "Wall 0", "Wall 1"))
    empty.ops.object.join()
    activate(empty, patch)
    nested = verified(empty, patch, target="Sphere")
    assert nested == pytest.approx(single)


def test_a_coarse_mesh_has_no_vertices_over_the_patch(empty, capfd):
    empty.ops.mesh.primitive_plane_add(size=10.0)
    assert empty.ops.tactile.reconstruct(location=(0.5, 0.2, 0.0), extent=3.0) == {"FINISHED"}
    found = verified(empty, empty.context.object)
    assert (found["vertices"], found["overlap"], found["extra_contours"]) == (0, 1.0, 9)
    assert found["extra_fit_error"] == pytest.approx(0.0, abs=1e-5)
    assert "vertex_distance_mean" not in found
    words = 'Info: "Plane" is 0 m off the patch on average, and either is 0 m off the other at most'
    assert words in capfd.readouterr().out


def test_a_mesh_that_contradicts_the_patch_is_a_doubt_with_a_warning(empty, patch, capfd):
    ball = empty.data.objects["Sphere"]
    at = positions(ball.data)
    away = np.linalg.norm(at - np.array(patch["tactile"]["frame"]["origin"]), axis=1)
    at *= 1.0 + 0.05 * np.clip(1.0 - away / 0.5, 0.0, 1.0)[:, None]
    ball.data.vertices.foreach_set("co", at.ravel())  # setting the attribute keeps Blender's old tree
    ball.data.update()
    found = verified(empty, patch)
    assert patch["tactile"]["status"] == "uncertain"
    assert patch["tactile"]["height_error"] == pytest.approx(found["vertex_distance_mean"], rel=0.2)
    message = patch["tactile"]["message"]
    # The bump is highest at the point, and taps are around it.
    mean, most = patch["tactile"]["height_error"], found["vertex_distance_max"]
    words = re.match(r"Between the curves the surface is up to (\d+) % of the radius off the patch", message)
    assert mean < 0.01 * float(words[1]) * patch["tactile"]["radius"] < most
    assert f"Warning: {message}" in capfd.readouterr().out


def test_the_vertices_of_a_coarse_mesh_do_not_change_a_good_verdict(empty):
    """They are farther out than the rest of their facets, and off by more than twice the deviation."""
    empty.ops.mesh.primitive_ico_sphere_add(subdivisions=4)
    assert empty.ops.tactile.reconstruct(location=(0.9, -0.4, -0.1), extent=0.4) == {"FINISHED"}
    patch = empty.context.object
    found = verified(empty, patch)
    assert found["vertices"] == 25
    assert found["vertex_distance_mean"] > 2.0 * patch["tactile"]["height_std"]
    assert patch["tactile"]["height_error"] < 2.0 * patch["tactile"]["height_std"]
    assert patch["tactile"]["status"] == "ok"


def test_the_report_has_the_vertices_of_the_verification(empty, patch):
    before = patch["tactile"]["vertex_distance_max"]
    patch.location.z += 0.05
    found = verified(empty, patch)
    record = patch["tactile"].to_dict()
    assert record["vertex_distance_max"] == found["vertex_distance_max"] > before + 0.02
    assert record["vertex_distance_mean"] == found["vertex_distance_mean"]
    assert record["vertices"] == found["vertices"]


def test_a_probes_patch_by_the_probe_and_until_it_is_touched_again(empty):
    add_ball(empty)
    empty.ops.tactile.pick(target="Sphere", location=TOP, extent=0.6, new=True)
    probe = empty.context.object
    (patch,) = probe.children
    verified(empty, patch)
    digest = probe.tactile_probe.digest
    empty.context.view_layer.update()
    assert "verification" in patch["tactile"]
    assert probe.tactile_probe.digest == digest
    probe.tactile_probe.extent = 0.5
    assert "verification" not in patch["tactile"]


def test_a_linked_copy_keeps_its_own_deviation(empty, patch):
    copy = patch.copy()
    empty.context.collection.objects.link(copy)
    add_ball(empty, RADIUS + 0.01, "Larger")
    activate(empty, patch)
    deviation = values(copy.data, "deviation")
    verified(empty, patch, target="Larger")
    assert patch.data != copy.data
    assert (values(copy.data, "deviation") == deviation).all()


def several(bpy, patch):
    activate(bpy, patch, add_ball(bpy, name="One"), add_ball(bpy, name="Two"))


def of_a_later_version(bpy, patch):
    patch["tactile_reconstruction"] = patch["tactile_reconstruction"].replace('"version": 4', '"version": 5')


def scaled(*scale):
    def spoil(bpy, patch):
        patch.scale = scale
        bpy.context.view_layer.update()

    return spoil


def no_source(bpy, patch):
    bpy.data.objects.remove(bpy.data.objects["Sphere"])


def with_empty(bpy, patch):
    bpy.data.objects.new("Nothing", None)
    return {"target": "Nothing"}


def with_no_faces(bpy, patch):
    bpy.context.scene.collection.objects.link(bpy.data.objects.new("Bare", bpy.data.meshes.new("Bare")))
    return {"target": "Bare"}


@pytest.mark.parametrize(
    ("spoil", "sentence"),
    [
        (lambda bpy, patch: {"target": "Nobody"}, 'There is no object "Nobody"'),
        (no_source, '"Sphere Patch" was not touched on a mesh of this file: select the mesh'),
        (with_empty, '"Nothing" is not a mesh'),
        (with_no_faces, '"Bare" has no faces'),
        (several, "2 meshes are selected: select one besides the patch"),
        (of_a_later_version, "can no longer be read: touch again .version: expected 4, got 5"),
        (scaled(1.0, 2.0, 1.0), "is stretched, mirrored or has a scale of 0"),
        (scaled(-1.0, 1.0, 1.0), "is stretched, mirrored or has a scale of 0"),
        (scaled(-1.0, -1.0, -1.0), "is stretched, mirrored or has a scale of 0"),
        (scaled(0.0, 0.0, 0.0), "is stretched, mirrored or has a scale of 0"),
    ],
)
def test_bad_input_gets_a_sentence_and_changes_nothing(empty, patch, spoil, sentence):
    arguments = spoil(empty, patch) or {}
    record, objects = patch["tactile"].to_dict(), [o for o in empty.data.objects if o.type == "MESH"]
    before = [state(obj) for obj in objects]
    with pytest.raises(RuntimeError, match=sentence):
        empty.ops.tactile.verify(**arguments)
    assert patch["tactile"].to_dict() == record
    assert [state(obj) for obj in objects] == before


def test_linked_data_is_not_written(empty, patch, tmp_path):
    path = str(tmp_path / "library.blend")
    empty.ops.wm.save_as_mainfile(filepath=path)
    empty.ops.wm.read_homefile(use_empty=True)
    with empty.data.libraries.load(path, link=True) as (_, wanted):
        wanted.objects = ["Sphere", "Sphere Patch"]
    for obj in wanted.objects:
        empty.context.scene.collection.objects.link(obj)
    linked = empty.data.objects["Sphere Patch"]
    empty.context.view_layer.objects.active = linked
    with pytest.raises(RuntimeError, match="comes from a library: make it local, or override it"):
        empty.ops.tactile.verify()
    ball = empty.data.objects["Sphere"]
    empty.context.view_layer.objects.active = ball
    assert empty.ops.tactile.reconstruct(location=TOP, extent=0.6) == {"FINISHED"}
    assert empty.ops.tactile.verify() == {"FINISHED"}


def test_without_a_patch_and_in_edit_mode_the_button_is_gray(empty, patch):
    empty.context.view_layer.objects.active = empty.data.objects["Sphere"]
    assert not empty.ops.tactile.verify.poll()
    empty.ops.object.mode_set(mode="EDIT")
    assert not empty.ops.tactile.verify.poll()
    empty.ops.object.mode_set(mode="OBJECT")
    activate(empty, patch)
    assert empty.ops.tactile.verify.poll()


def test_one_undo_takes_all_of_it_back(empty, patch):
    add_ball(empty, RADIUS + 0.01, "Larger")
    activate(empty, patch)
    name, deviation, status = patch.name, values(patch.data, "deviation"), patch["tactile"]["status"]
    empty.ops.ed.undo_push(message="before")
    empty.ops.tactile.verify("EXEC_DEFAULT", True, target="Larger")
    empty.ops.ed.undo_push(message="after")
    empty.ops.ed.undo()
    if "verification" in empty.data.objects[name]["tactile"]:  # the push above was one step more
        empty.ops.ed.undo()
    patch = empty.data.objects[name]
    assert "verification" not in patch["tactile"]
    assert patch["tactile"]["status"] == status
    assert (values(patch.data, "deviation") == deviation).all()
    empty.ops.ed.redo()
    assert empty.data.objects[name]["tactile"]["verification"]["target"] == "Larger"


def test_from_the_shell(empty, command, tmp_path):
    ball, report, table = (tmp_path / name for name in ("ball.ply", "report.json", "table.csv"))
    add_ball(empty)
    empty.ops.wm.ply_export(filepath=str(ball))
    words = ["reconstruct", ball, "--location", *TOP, "--extent", 0.6]
    code, out, _ = command(*words, "--json", report, "--verify", table)
    assert code == 0
    assert "distance on more curves" in out
    assert "100 % of the area" in out
    found = json.loads(report.read_text())["verification"]
    (row,) = csv.DictReader(table.read_text(encoding="utf-8").splitlines())
    assert [row[key] for key in ("patch", "source", "target", "status")] == [
        "ball Patch",
        "ball",
        "ball",
        "ok",
    ]
    for key, value in found.items():
        if key != "target":
            length = "distance" in key or "error" in key
            assert float(row[f"{key} [unit of the file]" if length else key]) == value
    assert math.isclose(found["overlap"], 1.0)
    code, _, err = command(*words, "--verify", tmp_path / "no" / "table.csv")
    assert (code, 'to write "table.csv" to' in err) == (1, True)
    # Where no vertex is over the patch the cells are empty.
    empty.ops.wm.read_homefile(use_empty=True)
    empty.ops.mesh.primitive_plane_add(size=10.0)
    assert command("reconstruct", "--location", 0.5, 0.2, 0, "--extent", 1, "--verify", table)[0] == 0
    (row,) = csv.DictReader(table.read_text(encoding="utf-8").splitlines())
    cells = [row[key] for key in ("vertices", "vertex_distance_mean [unit of the file]", "contacts")]
    assert cells == ["0", "", "72"]


@pytest.mark.parametrize("disturb", ["move", "delete", "patch"])
def test_what_changes_while_it_is_compared_ends_it_with_a_sentence(empty, patch, extension, disturb):
    operator = extension.tactile_addon.comparison.operators
    ball = empty.data.objects["Sphere"]
    verification = operator.Verification(patch, ball)
    verification.look(empty.context.evaluated_depsgraph_get())
    next(verification.steps())
    if disturb == "delete":
        empty.data.objects.remove(ball)
    else:
        (ball if disturb == "move" else patch).location.x += 0.1
    empty.context.view_layer.update()
    said = "was deleted while it was verified" if disturb == "delete" else "was changed while it was verified"
    with pytest.raises(ValueError, match=said):
        verification.look(empty.context.evaluated_depsgraph_get())
    assert "verification" not in patch["tactile"]


def test_in_steps_it_finds_what_it_finds_at_once(empty, patch, extension):
    """The result is the same even where Blender evaluates the mesh again between two steps."""
    operator = extension.tactile_addon.comparison.operators
    ball, wanted, done = empty.data.objects["Sphere"], verified(empty, patch), []
    deviation = values(patch.data, "deviation")
    verification = operator.Verification(patch, ball)
    verification.look(empty.context.evaluated_depsgraph_get())
    for share in verification.steps():
        done.append(share)
        ball.data.update()  # the shape stays, but the evaluated mesh is freed
        empty.context.view_layer.update()
        verification.look(empty.context.evaluated_depsgraph_get())
    assert len(done) > 4
    assert done == sorted(done)
    assert done[-1] <= 1.0
    assert verification.write()["verification"] == wanted
    assert (values(patch.data, "deviation") == deviation).all()
