# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A probe that is a child of its target: where both it and its patch are when the target changes."""

import numpy as np
import pytest

pytest.importorskip("bpy", reason="needs Blender as a Python module: run make test")
from mathutils import Euler, Matrix, Vector
from scenes import add_sphere, by_hand, select, step

MOTION = Matrix.Translation((3.0, -2.0, 1.0)) @ Euler((0.5, 0.3, -0.8)).to_matrix().to_4x4()
TOP = (0.3, -0.2, 1.9)


@pytest.fixture
def suzanne(empty):
    empty.ops.mesh.primitive_monkey_add(rotation=(0.1, 0.2, 0.3), location=(0.3, -0.2, 0.1))
    empty.context.object.scale = (1.2, 0.8, 1.0)
    empty.context.object.modifiers.new("Subdivision", "SUBSURF").levels = 2
    empty.context.view_layer.update()
    return empty.context.object


def pick(bpy, location, **arguments):
    assert bpy.ops.tactile.pick(location=location, extent=0.3, **arguments) == {"FINISHED"}
    (patch,) = bpy.context.object.children
    return bpy.context.object, patch


@pytest.fixture
def touches(extension, monkeypatch):
    """A list that grows by one with each touch of a probe."""
    found, touch_at = [], extension.tactile_addon.probes.touch_again.touch_at
    counting = lambda probe, *given, **named: found.append(probe.name) or touch_at(probe, *given, **named)  # noqa: E731
    monkeypatch.setattr(extension.tactile_addon.probes.touch_again, "touch_at", counting)
    return found


def worlds(*objects):
    return [np.array(obj.matrix_world) for obj in objects]


def close(*pairs):
    for found, wanted in pairs:
        assert np.array(found) == pytest.approx(np.array(wanted), abs=2e-5)


def is_unsheared(obj):
    linear = np.array(obj.matrix_world)[:3, :3]
    return np.allclose(linear.T @ linear, np.eye(3), atol=1e-5)


def test_a_pick_leaves_the_world_as_it_is(empty, suzanne):
    there = suzanne.matrix_world.copy()
    probe, patch = pick(empty, (-0.05, -0.9, 0.6))
    other, its = pick(empty, (-0.05, -0.9, 0.6), parent=False, new=True, target=suzanne.name)
    assert (probe.parent, other.parent) == (suzanne, None)
    empty.context.view_layer.update()
    close(*zip(worlds(probe, patch), worlds(other, its), strict=True))
    close((probe.matrix_basis, probe.matrix_world), (suzanne.matrix_world, there))
    assert is_unsheared(probe)
    assert is_unsheared(patch)


@pytest.mark.parametrize("live", [True, False])
def test_a_target_that_moves_as_a_whole_takes_its_probe_along_and_is_not_touched_again(
    empty, extension, suzanne, touches, live
):
    probe, patch = pick(empty, (-0.05, -0.9, 0.6))
    probe.tactile_probe.live = live
    report = patch["tactile"].to_dict()
    before, at = worlds(probe, patch), extension.reconstruction_of(patch)
    for power in (1, 2, 3):
        suzanne.matrix_world = MOTION @ suzanne.matrix_world
        empty.context.view_layer.update()
        motion = np.linalg.matrix_power(np.array(MOTION), power)
        close(*zip(worlds(probe, patch), motion @ before, strict=True))
        close((probe.matrix_basis, probe.matrix_world))
    assert touches == []
    now, found = patch["tactile"].to_dict(), extension.reconstruction_of(patch)
    assert (now["status"], now["message"]) == (report["status"], report["message"])
    assert [now[key] for key in ("k1", "k2", "height_std", "coefficients")] == [
        report[key] for key in ("k1", "k2", "height_std", "coefficients")
    ]
    close((now["frame"]["origin"], found.frame.origin), (now["frame"]["d1"], found.frame.axes[:, 0]))
    close((found.frame.origin, motion[:3, :3] @ at.frame.origin + motion[:3, 3]))
    close((found.frame.axes, motion[:3, :3] @ at.frame.axes))
    close((now["axes"], motion[:3, :3] @ report["axes"]))


def test_a_thousand_small_motions_do_not_wear_a_patch_off_its_place(empty, suzanne, touches):
    _, patch = pick(empty, (-0.05, -0.9, 0.6))
    there = suzanne.matrix_world.inverted() @ patch.matrix_world
    for angle in range(1000):
        suzanne.rotation_euler.z = 0.1 * angle
        suzanne.location.x = 0.01 * angle
        empty.context.view_layer.update()
    close((suzanne.matrix_world @ there, patch.matrix_world))
    assert touches == []


@pytest.mark.parametrize("scale", [(2.0, 2.0, 2.0), (1.2, 1.6, 0.7), (-1.2, 0.8, 1.0)])
@pytest.mark.parametrize("live", [True, False])
def test_a_target_that_is_scaled_is_touched_again_by_a_patch_without_shear(
    empty, extension, suzanne, touches, scale, live
):
    probe, patch = pick(empty, (-0.05, -0.9, 0.6))
    probe.tactile_probe.live = live
    local = suzanne.matrix_world.inverted() @ probe.matrix_world.translation
    suzanne.scale = scale
    empty.context.view_layer.update()
    assert bool(touches) is live
    assert (patch["tactile"]["status"] == "outdated") is not live
    assert is_unsheared(probe)
    assert is_unsheared(patch)
    off = suzanne.matrix_world @ local - probe.matrix_world.translation
    assert off.length < 1e-3
    if live:
        depsgraph = empty.context.evaluated_depsgraph_get()
        fresh = extension.tactile_addon.probes.touch_again.touch_at(probe, depsgraph, complete=True)
        assert patch["tactile"]["k1"] == pytest.approx(fresh.result.patch.k1, rel=1e-4, abs=1e-4)
        close((fresh.result.frame.origin, patch.matrix_world.translation))


@pytest.mark.parametrize("way", ["deleted", "removed", "unlinked"])
def test_a_probe_stays_where_it_is_when_its_target_is_deleted(empty, extension, suzanne, way):
    probe, patch = pick(empty, (-0.05, -0.9, 0.6))
    suzanne.matrix_world = MOTION @ suzanne.matrix_world
    empty.context.view_layer.update()
    names, before = [probe.name, patch.name], worlds(probe, patch)
    if way == "deleted":
        select(empty, suzanne)
        by_hand(empty, empty.ops.object.delete)
    elif way == "removed":
        empty.data.objects.remove(suzanne)
    else:
        empty.context.scene.collection.objects.unlink(suzanne)
    for _ in range(2):
        empty.context.view_layer.update()
    extension.tactile_addon.probes.deleted.remove()
    probe, patch = (empty.data.objects[name] for name in names)
    close(*zip(worlds(probe, patch), before, strict=True))
    assert probe.parent is None
    assert sorted(obj.name for obj in empty.data.objects) == [
        "Suzanne Patch",
        "Suzanne Probe",
    ]


def test_undo_of_a_deleted_target_restores_link_parent_and_place(empty, extension, suzanne):
    probe, patch = pick(empty, (-0.05, -0.9, 0.6))
    suzanne.matrix_world = MOTION @ suzanne.matrix_world
    empty.context.view_layer.update()
    before = worlds(probe, patch)
    select(empty, suzanne)
    by_hand(empty, empty.ops.object.delete)
    for _ in range(2):
        extension.tactile_addon.probes.deleted.remove()
        step(empty, "undo")
        suzanne, probe, patch = (
            empty.data.objects[name] for name in ("Suzanne", "Suzanne Probe", "Suzanne Patch")
        )
        assert (probe.parent, probe.tactile_probe.target) == (suzanne, suzanne)
        close(*zip(worlds(probe, patch), before, strict=True))
        assert patch["tactile"]["status"] != "outdated"
        step(empty, "redo")
        assert empty.data.objects["Suzanne Probe"].parent is None
        close((empty.data.objects["Suzanne Probe"].matrix_world, before[0]))


def test_undo_of_a_move_and_of_a_scale_brings_probe_and_patch_back(empty, suzanne):
    pick(empty, (-0.05, -0.9, 0.6))
    empty.ops.ed.undo_push(message="picked")

    def seen():
        return worlds(*(empty.data.objects[f"Suzanne {what}"] for what in ("Probe", "Patch")))

    states = [seen()]
    for motion in (MOTION, Matrix.Diagonal((1.5, 1.0, 0.8, 1.0)), MOTION):
        empty.data.objects["Suzanne"].matrix_basis = motion @ empty.data.objects["Suzanne"].matrix_basis
        empty.ops.ed.undo_push(message="moved")  # before any handler runs, as when a number is set in a panel
        empty.context.view_layer.update()
        states.append(seen())
    for name, number in (("undo", 2), ("undo", 1), ("undo", 0), ("redo", 1), ("redo", 2), ("redo", 3)):
        step(empty, name)
        close(*zip(seen(), states[number], strict=True))
        assert empty.data.objects["Suzanne Patch"]["tactile"]["status"] != "outdated"


def test_a_probe_that_is_moved_to_another_object_or_gets_another_target_goes_with_that(empty, suzanne):
    probe, _ = pick(empty, (-0.05, -0.9, 0.6))
    ball = add_sphere(empty, location=(9, 0, 0))
    empty.context.view_layer.objects.active = probe
    pick(empty, (9.3, -0.2, 1.9), target=ball.name)
    assert (probe.parent, probe.tactile_probe.target) == (ball, ball)
    place = probe.matrix_world.copy()
    probe.tactile_probe.target = suzanne
    assert probe.parent == suzanne
    close((probe.matrix_world, place))
    probe.parent = None
    probe.tactile_probe.target = ball
    assert probe.parent is None


def test_a_target_that_depends_on_the_probe_does_not_become_its_parent(empty, extension, suzanne):
    probe, _ = pick(empty, (-0.05, -0.9, 0.6), parent=False)
    suzanne.parent = probe
    extension.tactile_addon.probes.anchor.attach(probe, suzanne)
    assert probe.parent is None


def test_a_probe_without_a_parent_touches_a_target_that_was_moved(empty, touches):
    ball = add_sphere(empty)
    probe, _ = pick(empty, TOP, parent=False)
    ball.location.z = 0.1
    empty.context.view_layer.update()
    assert touches == [probe.name]
    assert (probe.matrix_world.translation - Vector((0.0, 0.0, 0.1))).length == pytest.approx(2.0, abs=2e-3)


def test_a_target_scaled_to_nothing_is_named_and_not_the_probe_which_it_takes_along(empty, suzanne):
    probe, patch = pick(empty, (-0.05, -0.9, 0.6))
    before = patch["tactile"]["status"]
    for scale in ((0.0, 0.0, 0.0), (1.0, 0.0, 1.0)):
        suzanne.scale = scale
        empty.context.view_layer.update()
        assert '"Suzanne" has a scale of 0 in some direction' in probe.tactile_probe.message
        assert patch["tactile"]["status"] == "outdated"
        suzanne.scale = (1.2, 0.8, 1.0)
        empty.context.view_layer.update()
        assert (probe.tactile_probe.message, patch["tactile"]["status"]) == ("", before)
