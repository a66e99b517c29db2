# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Register onto Mesh of the installed extension in a real Blender, without a window."""

import math

import numpy as np
import pytest

pytest.importorskip("bpy", reason="needs Blender as a Python module: run make test")
from mathutils import Euler, Matrix, Vector

RADIUS = 0.3


@pytest.fixture
def suzanne(empty):
    empty.ops.mesh.primitive_monkey_add()
    obj = empty.context.object
    obj.modifiers.new("Subdivision", "SUBSURF").levels = 3
    obj.scale, obj.rotation_euler = (1.1, 0.9, 1.0), (0.1, 0.2, 0.3)
    empty.context.view_layer.update()
    return obj


def touched(bpy, target, location):
    assert bpy.ops.tactile.reconstruct(target=target.name, location=location, extent=RADIUS) == {"FINISHED"}
    return bpy.context.object


def lost(bpy, patch):
    """Moves the patch somewhere else and returns where it was."""
    matrix = patch.matrix_world.copy()
    patch.matrix_world = Matrix.LocRotScale(Vector((4.0, -3.0, 7.0)), Euler((2.0, 0.7, -1.2)), None) @ matrix
    bpy.context.view_layer.update()
    return matrix


def apart(one, other):
    """The distance between two transforms, and the angle between them in degrees."""
    turn = one.to_quaternion().rotation_difference(other.to_quaternion()).angle
    return (one.translation - other.translation).length, math.degrees(min(turn, 2.0 * math.pi - turn))


def forehead(obj, bpy):
    evaluated = obj.evaluated_get(bpy.context.evaluated_depsgraph_get())
    hit, point, _, _ = evaluated.ray_cast((0.35, -5.0, 0.35), (0.0, 1.0, 0.0))
    assert hit
    return obj.matrix_world @ point


@pytest.mark.long
def test_a_lost_patch_comes_back(empty, suzanne):
    patch = touched(empty, suzanne, forehead(suzanne, empty))
    truth = lost(empty, patch)
    before = [tuple(vertex.co) for vertex in suzanne.data.vertices]
    assert empty.ops.tactile.register(target=suzanne.name) == {"FINISHED"}
    empty.context.view_layer.update()
    distance, angle = apart(patch.matrix_world, truth)
    assert (distance < 0.02 * RADIUS, angle < 2.0) == (True, True), (distance, angle)
    found = patch["tactile"]["registration"].to_dict()
    assert found["residuals"] == sorted(found["residuals"])
    assert found["residuals"][0] < 0.01 * RADIUS
    assert [tuple(vertex.co) for vertex in suzanne.data.vertices] == before
    assert empty.ops.tactile.verify(target=suzanne.name) == {"FINISHED"}
    assert patch["tactile"]["verification"]["extra_fit_error"] < 0.05 * RADIUS


def test_a_mesh_that_is_mirrored_is_still_seen_from_outside(empty, suzanne):
    suzanne.scale.x *= -1.0
    empty.context.view_layer.update()
    patch = touched(empty, suzanne, forehead(suzanne, empty))
    truth = lost(empty, patch)
    assert empty.ops.tactile.register(target=suzanne.name) == {"FINISHED"}
    distance, angle = apart(patch.matrix_world, truth)
    assert (distance < 0.02 * RADIUS, angle < 2.0) == (True, True), (distance, angle)


def test_on_a_ball_others_are_about_as_good_and_can_be_chosen(empty, capfd):
    empty.ops.mesh.primitive_uv_sphere_add(segments=96, ring_count=48)
    ball = empty.context.object
    patch = touched(empty, ball, (0.0, 0.0, 1.0))
    lost(empty, patch)
    assert empty.ops.tactile.register(target=ball.name) == {"FINISHED"}
    found = patch["tactile"]["registration"].to_dict()
    assert found["is_ambiguous"]
    assert "poses are about as good" in capfd.readouterr().out
    first = patch.matrix_world.copy()
    assert patch.matrix_world.translation.length == pytest.approx(1.0, abs=0.01)
    lost(empty, patch)
    assert empty.ops.tactile.register(target=ball.name, pose=2) == {"FINISHED"}
    assert apart(first, patch.matrix_world)[0] + apart(first, patch.matrix_world)[1] > 0.01


def test_what_cannot_be_registered_gets_a_sentence_and_stays(empty, suzanne):
    patch = touched(empty, suzanne, forehead(suzanne, empty))
    lost(empty, patch)
    empty.ops.mesh.primitive_cube_add(size=0.05)
    cube = empty.context.object
    empty.context.view_layer.objects.active = patch
    stays = np.array(patch.matrix_world)
    for arguments, sentence in (
        ({"target": cube.name}, "Vertices: expected a mesh from"),
        ({"target": "Nobody"}, "There is no object"),
    ):
        with pytest.raises(RuntimeError, match=sentence):
            empty.ops.tactile.register(**arguments)
        assert np.array_equal(patch.matrix_world, stays)
        assert "registration" not in patch["tactile"]


def test_the_patch_of_a_probe_is_where_its_probe_is(empty, suzanne, extension):
    place = forehead(suzanne, empty)
    assert empty.ops.tactile.pick(target=suzanne.name, location=place, extent=0.3) == {"FINISHED"}
    with pytest.raises(RuntimeError, match="is that of its probe, so it is known already"):
        empty.ops.tactile.register(target=suzanne.name)
    patch = extension.tactile_addon.probes.probe.patch_near(empty.context.object)
    registration, report = (
        extension.tactile_addon.comparison.operators,
        extension.tactile_addon.touch.wording,
    )
    found = {"target": "A", "pose": 1, "residuals": [0.1, 0.2], "is_ambiguous": False}
    record = {"radius": 1.0, "registration": found}
    assert report.registration_summary(record) == 'The contacts are 0.1 m off "A" (root mean square)'
    record["radius"] = 0.001
    assert "are 100 mm off" in report.registration_summary(record)  # as all in the panel
    patch.parent = None
    depsgraph = empty.context.evaluated_depsgraph_get()
    with pytest.raises(ValueError, match=r"The search has found 5 poses on .*: choose a lower number"):
        registration.Search(patch, suzanne, depsgraph).put(99)


def imported(bpy, suzanne, tmp_path):
    """A patch that was imported from a file and moved away: it is active and knows no mesh."""
    patch = touched(bpy, suzanne, forehead(suzanne, bpy))
    path = tmp_path / "felt.csv"
    assert bpy.ops.tactile.export_contacts(filepath=str(path)) == {"FINISHED"}
    bpy.data.objects.remove(patch)
    assert bpy.ops.tactile.import_contacts(filepath=str(path)) == {"FINISHED"}
    found = bpy.context.object
    lost(bpy, found)
    return found


@pytest.mark.long
@pytest.mark.parametrize("name", ["register", "verify"])
def test_a_patch_of_a_file_asks_for_a_mesh_and_takes_the_one_in_its_field(empty, suzanne, tmp_path, name):
    patch = imported(empty, suzanne, tmp_path)
    operator = getattr(empty.ops.tactile, name)
    said = "was not touched on a mesh of this file: select the mesh, then the patch"
    with pytest.raises(RuntimeError, match=said):
        operator()
    patch.tactile_target = suzanne.name
    assert operator() == {"FINISHED"}
    found = patch["tactile"]["registration" if name == "register" else "verification"].to_dict()
    assert found["target"] == suzanne.name
    suzanne.select_set(True)
    patch.tactile_target = ""
    assert operator() == {"FINISHED"}


@pytest.mark.parametrize("name", ["register", "verify"])
def test_a_mesh_that_is_nowhere_is_named(empty, suzanne, tmp_path, name):
    patch = imported(empty, suzanne, tmp_path)
    suzanne.location.x = float("nan")
    empty.context.view_layer.update()
    with pytest.raises(RuntimeError, match='"Suzanne" has a location, rotation or scale that is not finite'):
        getattr(empty.ops.tactile, name)(target=suzanne.name)
    assert np.isfinite(patch.matrix_world).all()


def test_a_search_that_is_stopped_leaves_the_patch_and_one_that_fails_says_why(
    empty, suzanne, extension, monkeypatch
):
    registration = extension.tactile_addon.comparison.operators
    patch = touched(empty, suzanne, forehead(suzanne, empty))
    lost(empty, patch)
    before, depsgraph = patch.matrix_world.copy(), empty.context.evaluated_depsgraph_get()
    search = registration.Search(patch, suzanne, depsgraph)
    steps = search.steps()
    next(steps)  # It is not done at once.
    for _ in steps:
        pass
    assert patch.matrix_world == before
    assert search.put(1)["registration"]["target"] == suzanne.name
    assert patch.matrix_world != before

    def full(*given, **named):
        raise MemoryError

    monkeypatch.setattr(registration.core, "register", full)
    with pytest.raises(ValueError, match="is too large to be searched: remove what is far"):
        registration.Search(patch, suzanne, depsgraph).put()
    monkeypatch.undo()
    empty.data.objects.remove(patch)
    with pytest.raises(ValueError, match="was deleted while its place was searched for"):
        search.put(1)
