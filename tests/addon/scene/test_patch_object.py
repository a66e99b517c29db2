# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A patch that is moved or deleted by itself, and its contours: what belongs together stays together."""

import numpy as np
import pytest

pytest.importorskip("bpy", reason="needs Blender as a Python module: run make test")
import scenes
from mathutils import Matrix
from scenes import by_hand, select, step

NO_PATCH = "The probe has no patch: touch again for one, or delete the probe too"
SET = ["Sphere", "Sphere Contours", "Sphere Patch", "Sphere Probe"]


@pytest.fixture
def there(empty, ball):
    """A function that looks up the probe, the patch or the contours, anew each time."""
    empty.ops.tactile.pick(target="Sphere", location=(0.3, -0.2, 1.9), extent=0.6)
    empty.ops.ed.undo_push(message="picked")
    return lambda what: empty.data.objects[f"Sphere {what}"]


def names(bpy):
    return sorted(obj.name for obj in bpy.data.objects)


def tidy(extension):
    """Does what Blender does in a window once it is idle; without a window no timer runs."""
    extension.tactile_addon.probes.deleted.remove()


def moved(obj, how):
    matrix = {
        "moved": Matrix.Translation((0.3, 0.2, 0.1)),
        "turned": Matrix.Rotation(0.5, 4, "X"),
        "scaled": Matrix.Diagonal((2.0, 1.0, 1.0, 1.0)),
    }[how]
    obj.matrix_basis = matrix @ obj.matrix_basis


def places(there):
    return [np.array(there(what).matrix_world) for what in ("Patch", "Contours")]


@pytest.mark.parametrize("live", [True, False])
@pytest.mark.parametrize("how", ["moved", "turned", "scaled"])
@pytest.mark.parametrize("what", ["Patch", "Contours"])
def test_what_belongs_to_a_probe_comes_back_to_its_place(empty, there, what, how, live):
    before, report = places(there), there("Patch")["tactile"].to_dict()
    there("Probe").tactile_probe.live = live
    moved(there(what), how)
    for _ in range(2):
        empty.context.view_layer.update()
    assert places(there) == [pytest.approx(place, abs=1e-6) for place in before]
    assert there("Patch")["tactile"].to_dict() == report


def test_a_patch_without_a_probe_goes_where_it_is_moved(empty, ball):
    empty.ops.tactile.reconstruct(target="Sphere", location=(0.3, -0.2, 1.9), extent=0.6)
    patch = empty.context.object
    patch.location.x = 5.0
    empty.context.view_layer.update()
    assert patch.matrix_world.translation.x == 5.0


def test_a_patch_that_constraints_hold_is_left_to_them(empty, there):
    there("Patch").constraints.new("LIMIT_LOCATION").use_max_x = True
    for _ in range(3):
        empty.context.view_layer.update()
    there("Probe").update_tag()
    empty.context.view_layer.update()
    assert there("Patch").matrix_world.translation.x == pytest.approx(0.0, abs=1e-6)


def test_contours_go_with_a_patch_that_is_deleted_and_the_probe_says_so(empty, extension, there):
    select(empty, there("Patch"))
    by_hand(empty, empty.ops.object.delete)
    tidy(extension)
    assert names(empty) == [SET[0], SET[3]]
    assert [mesh.name for mesh in empty.data.meshes] == ["Sphere"]
    assert not empty.data.materials
    assert there("Probe").tactile_probe.message == NO_PATCH
    for _ in range(2):
        step(empty, "undo")
        tidy(extension)
        assert names(empty) == SET
        assert there("Probe").tactile_probe.message == ""
        assert there("Patch")["tactile"]["status"] == "ok"
        step(empty, "redo")
        tidy(extension)
        assert names(empty) == [SET[0], SET[3]]
        assert there("Probe").tactile_probe.message == NO_PATCH


def test_undo_of_what_came_after_leaves_no_contours_of_a_patch_that_was_deleted(empty, extension, there):
    select(empty, there("Patch"))
    by_hand(empty, empty.ops.object.delete)
    tidy(extension)
    select(empty, empty.data.objects["Sphere"])
    step(empty, "undo")  # back to the step that was stored before the contours were removed
    tidy(extension)
    assert names(empty) == [SET[0], SET[3]]
    assert [mesh.name for mesh in empty.data.meshes] == ["Sphere"]


@pytest.mark.parametrize("again", ["number", "button"])
@pytest.mark.parametrize("idle", [True, False])
def test_another_touch_makes_a_patch_again_with_the_contours_that_are_left(
    empty, extension, there, idle, again
):
    before = scenes.datablocks(empty)
    select(empty, there("Patch"))
    by_hand(empty, empty.ops.object.delete)
    if idle:
        tidy(extension)
    if again == "number":
        there("Probe").tactile_probe.extent = 0.5
    else:
        empty.context.view_layer.objects.active = there("Probe")
        assert empty.ops.tactile.update() == {"FINISHED"}
    tidy(extension)
    after = scenes.datablocks(empty)
    assert after["objects"] == before["objects"]
    assert [len(found) for found in after.values()] == [len(found) for found in before.values()]
    assert there("Contours").parent == there("Patch")
    assert there("Patch").parent == there("Probe")
    assert places(there)[1] == pytest.approx(places(there)[0], abs=1e-6)
    assert there("Probe").tactile_probe.message == ""


@pytest.mark.parametrize("with_probe", [True, False])
def test_nothing_is_left_of_contours_whose_patch_and_probe_are_deleted(empty, extension, ball, with_probe):
    operator = empty.ops.tactile.pick if with_probe else empty.ops.tactile.reconstruct
    operator(target="Sphere", location=(0.3, -0.2, 1.9), extent=0.6)
    empty.context.view_layer.update()
    select(empty, empty.data.objects["Sphere Patch"])
    if with_probe:
        empty.data.objects["Sphere Probe"].select_set(True)
    by_hand(empty, empty.ops.object.delete)
    tidy(extension)
    assert names(empty) == ["Sphere"]


def test_contours_that_were_taken_from_their_patch_stay(empty, extension, there):
    select(empty, there("Contours"))
    by_hand(empty, empty.ops.object.parent_clear, type="CLEAR_KEEP_TRANSFORM")
    tidy(extension)
    there("Probe").tactile_probe.extent = 0.5
    tidy(extension)
    assert names(empty) == SET
    assert there("Contours").parent is None
