# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Patches and time: other frames, other scenes, and edits during which no handler ran.

A patch follows, or says that it is from an earlier touch; it never says that all is well where it is not.
"""

import numpy as np
import pytest

pytest.importorskip("bpy", reason="needs Blender as a Python module: run make test")
from scenes import add_sphere

STALE = "This patch is from an earlier touch, and the probe or its target has changed since: touch again."


@pytest.fixture
def probe(empty, ball):
    """A probe on a ball that grows from radius 2 to 2.4 within ten frames."""
    for frame, scale in ((1, 1.0), (11, 1.2)):
        ball.scale = (scale, scale, scale)
        ball.keyframe_insert("scale", frame=frame)
    for curve in curves_of(ball.animation_data.action):
        for point in curve.keyframe_points:
            point.interpolation = "LINEAR"
    empty.context.scene.frame_set(1)
    empty.ops.tactile.pick(target="Sphere", location=(0.3, -0.2, 1.9), extent=0.6)
    return empty.context.object


def curves_of(action):
    """The animation curves of an action, which Blender 5 keeps in a channel bag."""
    if hasattr(action, "fcurves"):
        return action.fcurves
    return action.layers[0].strips[0].channelbags[0].fcurves


def record_of(probe):
    (patch,) = probe.children
    return patch["tactile"]


def curvature(probe):
    return record_of(probe)["k1"]


def said(probe):
    record = record_of(probe)
    return record["status"], record["message"]


def test_a_patch_follows_its_animated_target(empty, probe):
    for frame, radius in ((6, 2.2), (11, 2.4), (1, 2.0)):
        empty.context.scene.frame_set(frame)
        assert curvature(probe) == pytest.approx(-1.0 / radius, rel=0.03)
        assert np.linalg.norm(probe.matrix_world.translation) == pytest.approx(radius, rel=2e-3)
        assert said(probe)[0] == "ok"


def test_a_patch_follows_a_modifier_that_is_animated(empty, ball):
    displace = ball.modifiers.new("Displace", "DISPLACE")
    displace.mid_level = 0.0
    for frame, strength in ((1, 0.0), (2, 0.4)):
        displace.strength = strength
        displace.keyframe_insert("strength", frame=frame)
    empty.context.scene.frame_set(1)
    empty.ops.tactile.pick(target="Sphere", location=(0.3, -0.2, 1.9), extent=0.6)
    probe = empty.context.object
    empty.context.scene.frame_set(2)
    assert curvature(probe) == pytest.approx(-1.0 / 2.4, rel=0.03)


def test_a_patch_that_waits_says_that_it_is_outdated_and_takes_it_back(empty, probe):
    before = said(probe)
    probe.tactile_probe.live = False
    empty.context.scene.frame_set(6)
    assert said(probe) == ("outdated", STALE)
    assert curvature(probe) == pytest.approx(-0.5, rel=0.03)
    empty.context.scene.frame_set(1)
    assert said(probe) == before
    empty.context.scene.frame_set(6)
    assert empty.ops.tactile.update() == {"FINISHED"}
    assert said(probe)[0] == "ok"
    assert curvature(probe) == pytest.approx(-1.0 / 2.2, rel=0.03)
    empty.context.scene.frame_set(1)
    assert said(probe) == ("outdated", STALE)


@pytest.mark.parametrize("change", ["location", "extent", "scale", "vertices"])
def test_whatever_a_waiting_probe_has_not_felt_makes_its_patch_outdated(empty, ball, change):
    empty.ops.tactile.pick(target="Sphere", location=(0.3, -0.2, 1.9), extent=0.6)
    probe = empty.context.object
    probe.tactile_probe.live = False
    before = said(probe)
    if change == "location":
        probe.location.x += 0.2
    elif change == "extent":
        probe.tactile_probe.extent = 0.5
    elif change == "scale":
        ball.scale = (1.1, 1.0, 1.0)
    else:
        ball.data.vertices[0].co *= 1.0001
        ball.data.update()
    empty.context.view_layer.update()
    assert said(probe) == ("outdated", STALE)
    probe.tactile_probe.live = True
    assert said(probe)[0] == before[0] == "ok"


def test_without_a_window_every_frame_has_time_for_a_touch(empty, extension, probe, monkeypatch):
    live = extension.tactile_addon.probes.change_handlers
    monkeypatch.setattr(live, "_look_at", counting := Counting(live._look_at))
    empty.context.scene.frame_set(2)
    assert counting.in_time == [True]  # without a window a touch is always in time
    record_of(probe)["seconds"]["touch"] = 1.0
    assert live._seconds(probe) > live.CHEAP
    live._look_at(probe, empty.context.evaluated_depsgraph_get(), {}, False, True)
    assert said(probe)[0] == "ok"  # nothing has changed
    empty.context.scene.frame_set(3)
    assert said(probe)[0] == "ok"


class Counting:
    def __init__(self, function):
        self.function, self.in_time = function, []

    def __call__(self, probe, depsgraph, reshaped, in_time, complete):
        self.in_time.append(in_time)
        return self.function(probe, depsgraph, reshaped, in_time, complete)


@pytest.mark.parametrize("live", [True, False])
def test_an_edit_in_another_scene_is_seen_in_the_first_one(empty, ball, live):
    empty.ops.tactile.pick(target="Sphere", location=(0.3, -0.2, 1.9), extent=0.6)
    probe, first = empty.context.object, empty.context.scene
    probe.tactile_probe.live = live
    second = empty.data.scenes.new("Second")
    second.collection.objects.link(ball)
    empty.context.window.scene = second
    empty.context.view_layer.update()
    for vertex in ball.data.vertices:
        vertex.co *= 1.2
    ball.data.update()
    empty.context.view_layer.update()
    empty.context.window.scene = first
    empty.context.view_layer.update()
    assert_followed_or_said(probe, live, -1.0 / 2.4)


def assert_followed_or_said(probe, live, wanted):
    if live:
        assert curvature(probe) == pytest.approx(wanted, rel=0.03)
        assert said(probe)[0] == "ok"
    else:
        assert curvature(probe) == pytest.approx(-0.5, rel=0.03)
        assert said(probe) == ("outdated", STALE)


@pytest.mark.parametrize("live", [True, False])
@pytest.mark.parametrize("reopened", [True, False])
def test_an_edit_while_the_extension_was_off_is_seen_once_it_is_on(
    empty, extension, ball, tmp_path, live, reopened
):
    import addon_utils

    empty.ops.tactile.pick(target="Sphere", location=(0.3, -0.2, 1.9), extent=0.6)
    empty.context.object.tactile_probe.live = live
    addon_utils.disable(extension.__name__)
    try:
        for vertex in ball.data.vertices:
            vertex.co *= 1.2
        ball.data.update()
        empty.context.view_layer.update()
        path = str(tmp_path / "edited.blend")
        empty.ops.wm.save_as_mainfile(filepath=path)
    finally:
        addon_utils.enable(extension.__name__)
    if reopened:
        empty.ops.wm.open_mainfile(filepath=path)
    empty.data.objects["Sphere Probe"].update_tag()
    empty.context.view_layer.update()
    assert_followed_or_said(empty.data.objects["Sphere Probe"], live, -1.0 / 2.4)


@pytest.mark.parametrize("live", [True, False])
def test_another_name_is_no_other_target_and_no_other_probe(empty, extension, ball, live):
    empty.ops.tactile.pick(target="Sphere", location=(0.3, -0.2, 1.9), extent=0.6)
    probe, record = empty.context.object, record_of(empty.context.object)
    probe.tactile_probe.live = live
    before, shown = record.to_dict(), probe.children[0].data.vertices[0].co.copy()
    ball.name = "Globe"
    empty.context.view_layer.update()
    probe.name = "Finger"
    empty.context.view_layer.update()
    assert record.to_dict() == before | {"source": "Globe"}
    ball.location.x += 1.0
    empty.context.view_layer.update()
    assert said(probe)[0] == "ok"
    assert record["frame"]["origin"][0] == pytest.approx(before["frame"]["origin"][0] + 1.0, abs=1e-5)
    assert record["frame"]["origin"][:] == pytest.approx(tuple(probe.matrix_world.translation), abs=1e-5)
    assert record["seconds"].to_dict() == before["seconds"]  # nothing was touched
    assert probe.children[0].data.vertices[0].co == shown
    ball.scale.x = 1.1
    empty.context.view_layer.update()
    assert said(probe) == (("ok", said(probe)[1]) if live else ("outdated", STALE))
    assert empty.ops.tactile.update() == {"FINISHED"}
    assert said(probe)[0] == "ok"


def test_a_renamed_target_gives_its_probe_to_another_that_is_chosen(empty, ball):
    empty.ops.tactile.pick(target="Sphere", location=(0.3, -0.2, 1.9), extent=0.6)
    probe = empty.context.object
    probe.tactile_probe.live = False
    other, ball.name = add_sphere(empty), "Globe"
    empty.context.view_layer.update()
    probe.tactile_probe.target = other
    empty.context.view_layer.update()
    assert probe.parent == other
    assert said(probe) == ("outdated", STALE)
    place = record_of(probe)["frame"]["origin"].to_list()
    other.location.x += 1.0  # the patch is not of this ball, so it stays
    empty.context.view_layer.update()
    assert record_of(probe)["frame"]["origin"].to_list() == place
    assert record_of(probe)["source"] == "Globe"
