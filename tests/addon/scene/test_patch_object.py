# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A patch that is moved or deleted by itself: what belongs together stays together."""

import numpy as np
import pytest

pytest.importorskip("bpy", reason="needs Blender as a Python module: run make test")
from mathutils import Matrix
from scenes import by_hand, select, step

NO_PATCH = "The probe has no patch: touch again for one, or delete the probe too"
SET = ["Sphere", "Sphere Patch", "Sphere Probe"]


@pytest.fixture
def there(empty, ball):
    """A function that looks up the probe or the patch, anew each time."""
    empty.ops.tactile.pick(target="Sphere", location=(0.3, -0.2, 1.9), extent=0.6)
    empty.ops.ed.undo_push(message="picked")
    return lambda what: empty.data.objects[f"Sphere {what}"]


def names(bpy):
    return sorted(obj.name for obj in bpy.data.objects)


def moved(obj, how):
    matrix = {
        "moved": Matrix.Translation((0.3, 0.2, 0.1)),
        "turned": Matrix.Rotation(0.5, 4, "X"),
        "scaled": Matrix.Diagonal((2.0, 1.0, 1.0, 1.0)),
    }[how]
    obj.matrix_basis = matrix @ obj.matrix_basis


@pytest.mark.parametrize("live", [True, False])
@pytest.mark.parametrize("how", ["moved", "turned", "scaled"])
def test_a_patch_of_a_probe_comes_back_to_its_place(empty, there, how, live):
    before, report = np.array(there("Patch").matrix_world), there("Patch")["tactile"].to_dict()
    there("Probe").tactile_probe.live = live
    moved(there("Patch"), how)
    for _ in range(2):
        empty.context.view_layer.update()
    assert np.array(there("Patch").matrix_world) == pytest.approx(before, abs=1e-6)
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


def test_the_probe_says_so_if_its_patch_was_deleted(empty, there):
    select(empty, there("Patch"))
    by_hand(empty, empty.ops.object.delete)
    assert names(empty) == [SET[0], SET[2]]
    assert there("Probe").tactile_probe.message == NO_PATCH
    for _ in range(2):
        step(empty, "undo")
        assert names(empty) == SET
        assert there("Probe").tactile_probe.message == ""
        assert there("Patch")["tactile"]["status"] == "ok"
        step(empty, "redo")
        assert names(empty) == [SET[0], SET[2]]
        assert there("Probe").tactile_probe.message == NO_PATCH


@pytest.mark.parametrize("again", ["number", "button"])
def test_another_touch_makes_a_patch_again(empty, there, again):
    select(empty, there("Patch"))
    by_hand(empty, empty.ops.object.delete)
    if again == "number":
        there("Probe").tactile_probe.extent = 0.5
    else:
        empty.context.view_layer.objects.active = there("Probe")
        assert empty.ops.tactile.update() == {"FINISHED"}
    assert names(empty) == SET
    assert there("Patch").parent == there("Probe")
    assert there("Probe").tactile_probe.message == ""


@pytest.mark.parametrize("use", ["none", "nested", "instanced"])
def test_an_empty_collection_of_patches_is_removed_if_undo_can_bring_its_links_back(
    empty, extension, there, use
):
    (collection,) = there("Patch").users_collection
    if use == "nested":  # This collection would be the same before and after, so undo would keep it.
        outer = empty.data.collections.new("Outer")
        empty.context.scene.collection.children.link(outer)
        outer.children.link(collection)
        empty.context.scene.collection.children.unlink(collection)
    elif use == "instanced":
        empty.data.objects.new("Instance", None).instance_collection = collection
    deleted = extension.tactile_addon.probes.deleted
    for what in ("Probe", "Patch"):
        deleted.remove()
        assert "Tactile Patches" in empty.data.collections
        empty.data.objects.remove(there(what))
    deleted.remove()
    assert ("Tactile Patches" in empty.data.collections) is (use != "none")


def test_a_file_saved_without_a_window_has_no_empty_collection(empty, there, tmp_path):
    for what in ("Probe", "Patch"):
        empty.data.objects.remove(there(what))
    empty.ops.wm.save_as_mainfile(filepath=str(tmp_path / "saved.blend"))
    assert "Tactile Patches" not in empty.data.collections
