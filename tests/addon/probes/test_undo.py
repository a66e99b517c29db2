# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Undo and redo of what happens to a probe's target and patch, in the order in which a window has it.

There an operator's step of undo is stored before any handler sees what it has done, as here where it
stores the step itself.
"""

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
