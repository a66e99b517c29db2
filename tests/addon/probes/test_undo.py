# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Undo and redo of what happens to a probe's target and patch, in the order in which a window has it.

A window stores an operator's step of undo before any handler sees what the operator has done. `by_hand`
does so here.
"""

from types import SimpleNamespace

import pytest

pytest.importorskip("bpy", reason="needs Blender as a Python module: run make test")
from scenes import by_hand, select, step


@pytest.fixture
def probe(empty, ball):
    """The name of a probe on the ball."""
    empty.ops.tactile.pick(target="Sphere", location=(0.3, -0.2, 1.9), extent=0.6)
    empty.ops.ed.undo_push(message="picked")
    return empty.context.object.name


def settings_of(bpy, probe):
    return bpy.data.objects[probe].tactile_probe


def test_undo_of_a_deleted_target_gives_it_back_to_its_probe(empty, extension, probe):
    select(empty, empty.data.objects["Sphere"])
    by_hand(empty, empty.ops.object.delete)
    assert settings_of(empty, probe).message == "The probe has no target: choose the mesh to touch"
    for _ in range(2):
        extension.tactile_addon.probes.deleted.remove()  # as Blender does once it is idle, in a window
        step(empty, "undo")
        settings = settings_of(empty, probe)
        assert (settings.target, settings.message) == (empty.data.objects["Sphere"], "")
        assert empty.data.objects["Sphere Patch"]["tactile"]["status"] == "ok"
        step(empty, "redo")
        assert settings_of(empty, probe).target is None


def test_undo_does_not_take_another_object_of_that_name_for_the_target(empty, extension, probe):
    select(empty, empty.data.objects["Sphere"])
    by_hand(empty, empty.ops.object.delete)
    extension.tactile_addon.probes.deleted.remove()
    empty.ops.mesh.primitive_uv_sphere_add(radius=2.0)
    empty.context.object.name = "Sphere"
    empty.context.view_layer.update()
    empty.ops.ed.undo_push(message="another")
    empty.data.objects["Sphere"].location.x = 1.0
    empty.context.view_layer.update()
    empty.ops.ed.undo_push(message="moved")
    step(empty, "undo")
    assert settings_of(empty, probe).target is None


def test_a_choice_of_a_target_ends_the_memory_of_the_one_that_was_lost(empty, probe):
    select(empty, empty.data.objects["Sphere"])
    by_hand(empty, empty.ops.object.delete)
    settings = settings_of(empty, probe)
    assert settings.lost.endswith(" Sphere")
    settings.target = None
    assert settings.lost == ""


def in_panel(bpy, owner, name, value):
    """Sets a property as Blender's own panels do: its step of undo is stored before any handler sees it."""
    path = f"scene.objects[{owner!r}].{name}"
    by_hand(bpy, bpy.ops.wm.context_set_value, data_path=path, value=repr(value))


def rest(bpy):
    """Stores a step of undo without a change: undo keeps in memory what the next step does not change."""
    bpy.ops.ed.undo_push(message="rest")


def pointers(bpy):
    """Whether all that objects and collections point to is in the file."""
    data = bpy.data
    there = {b.as_pointer() for kind in (data.objects, data.meshes, data.collections) for b in kind}
    to = [block for obj in data.objects for block in (obj.data, obj.parent)]
    collections = *data.collections, bpy.context.scene.collection
    to += [block for collection in collections for block in (*collection.objects, *collection.children)]
    return all(block.as_pointer() in there for block in to if block is not None)


def test_undo_leaves_no_pointer_to_a_patch_that_a_handler_has_made_after_the_step(empty, probe):
    select(empty, empty.data.objects["Sphere Patch"])
    by_hand(empty, empty.ops.object.delete)
    rest(empty)
    in_panel(empty, probe, "rotation_euler", (0.1, 0.2, 0.3))
    assert "Sphere Patch" in empty.data.objects
    step(empty, "undo")
    assert pointers(empty)
    assert "Sphere Patch" not in empty.data.objects
    step(empty, "redo")
    assert pointers(empty)
    assert empty.data.collections["Tactile Patches"].objects[0].name == probe


def test_undo_leaves_a_patch_where_it_was_that_a_handler_had_made_before_the_step(empty, probe):
    select(empty, empty.data.objects["Sphere Patch"])
    by_hand(empty, empty.ops.object.delete)
    rest(empty)
    in_panel(empty, probe, "rotation_euler", (0.1, 0.2, 0.3))
    rest(empty)
    rest(empty)
    in_panel(empty, "Sphere", "show_name", True)
    step(empty, "undo")
    patch = empty.data.objects["Sphere Patch"]
    assert patch.users_collection == (empty.data.collections["Tactile Patches"],)
    assert patch.parent.name == probe
    assert patch["tactile"]["status"] == "ok"


def test_undo_leaves_no_pointer_to_the_mesh_that_a_linked_copy_got_after_the_step(empty, probe):
    in_panel(empty, "Sphere", "hide_viewport", True)
    select(empty, empty.data.objects[probe])
    empty.data.objects["Sphere Patch"].select_set(True)
    by_hand(empty, empty.ops.object.duplicate, linked=True)
    rest(empty)
    first, second = (empty.data.objects[name] for name in ("Sphere Patch", "Sphere Patch.001"))
    assert first.data == second.data
    in_panel(empty, "Sphere", "hide_viewport", False)
    assert first.data != second.data
    step(empty, "undo")
    assert pointers(empty)
    step(empty, "redo")
    assert pointers(empty)


def test_undo_takes_back_the_collection_that_a_handler_has_made_after_the_step(empty, probe):
    select(empty, empty.data.objects["Sphere Patch"])
    by_hand(empty, empty.ops.object.delete)
    empty.context.scene.collection.objects.link(empty.data.objects[probe])
    empty.data.collections.remove(empty.data.collections["Tactile Patches"])
    rest(empty)
    rest(empty)
    in_panel(empty, probe, "rotation_euler", (0.1, 0.2, 0.3))
    assert "Tactile Patches" in empty.data.collections
    step(empty, "undo")
    assert pointers(empty)
    assert "Tactile Patches" not in empty.data.collections


def test_undo_of_a_deleted_target_gives_others_back_what_they_had_of_it(empty, extension, probe):
    ball = empty.data.objects["Sphere"]
    for name in ("Child", "Wrapped"):
        empty.ops.mesh.primitive_cube_add()
        empty.context.object.name = name
    empty.data.objects["Child"].parent = ball
    empty.data.objects["Wrapped"].modifiers.new("Wrap", "SHRINKWRAP").target = ball
    select(empty, ball)
    rest(empty)
    by_hand(empty, empty.ops.object.delete)
    extension.tactile_addon.probes.deleted.remove()
    step(empty, "undo")
    ball = empty.data.objects["Sphere"]
    assert empty.data.objects["Child"].parent == ball
    assert empty.data.objects["Wrapped"].modifiers["Wrap"].target == ball
    assert settings_of(empty, probe).target == ball


def test_undo_leaves_no_pointer_to_patches_that_are_still_growing(empty, extension, probe):
    rest(empty)
    rest(empty)
    patches = extension.tactile_addon.whole_object.whole_mesh.GrowingPatches
    growing = patches(empty.context.scene, SimpleNamespace(name="Sphere", origin=(0.0, 0.0, 0.0), size=2.0))
    assert "Sphere Touches" in empty.data.objects
    empty.ops.ed.undo()
    assert pointers(empty)
    assert "Sphere Touches" not in empty.data.objects
    growing.remove()
