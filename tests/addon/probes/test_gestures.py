# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Probes while a handle is dragged, as in a window: what takes long waits for the end of the gesture."""

import math

import numpy as np
import pytest

pytest.importorskip("bpy", reason="needs Blender as a Python module: run make test")


COMMON = ("extent", "step", "degree", "status", "message", "k1", "k2", "height_std")


@pytest.fixture
def gesture(extension, monkeypatch):
    """Makes all updates those of a gesture; returns a function that ends the gesture."""
    probes = extension.tactile_addon.probes
    update = probes.touch_again.update
    monkeypatch.setattr(
        probes.change_handlers, "update", lambda probe, depsgraph, complete: update(probe, depsgraph, False)
    )
    return lambda bpy, probe: update(probe, bpy.context.evaluated_depsgraph_get(), complete=True)


@pytest.fixture
def ridge(empty):
    """The active object: a sheet, 2 wide, that is nearly flat except for a ridge along y."""
    empty.ops.mesh.primitive_grid_add(x_subdivisions=200, y_subdivisions=200, size=2.0)
    obj = empty.context.object
    co = np.empty((len(obj.data.vertices), 3), dtype=np.float32)
    obj.data.vertices.foreach_get("co", co.ravel())
    x, y = co[:, 0], co[:, 1]
    co[:, 2] = 0.05 * (x**2 + y**2) + 0.12 * np.exp(-((x / 0.15) ** 2))
    obj.data.vertices.foreach_set("co", co.ravel())
    obj.data.update()
    return obj


def pick(bpy, target, x, **given):
    assert bpy.ops.tactile.pick(target=target.name, location=(x, 0.0, 0.1), new=True, **given) == {"FINISHED"}
    probe = bpy.context.object
    (patch,) = probe.children
    return probe, patch


def report_of(patch):
    return patch["tactile"].to_dict()


def slide(bpy, probe, patch, xs):
    """Drags the point along x and returns the reports on the way."""
    reports = []
    for x in xs:
        probe.location.x = x
        bpy.context.view_layer.update()
        assert probe.tactile_probe.message == ""
        reports.append(report_of(patch))
    return reports


@pytest.mark.long
def test_while_the_point_is_dragged_extent_and_verdict_are_those_of_its_end(empty, ridge, gesture):
    probe, patch = pick(empty, ridge, -0.6)
    first = report_of(patch)
    extents = []
    for x in np.linspace(-0.58, 0.0, 15):
        (dragged,) = slide(empty, probe, patch, [x])
        assert not dragged["is_verified"]
        assert probe.empty_display_size == pytest.approx(0.6 * dragged["extent"])  # the handles fit the patch
        gesture(empty, probe)
        ended = report_of(patch)
        assert ended["is_verified"]
        assert [dragged[name] for name in COMMON] == [ended[name] for name in COMMON]
        extents.append(ended["extent"])
    assert extents[-1] < 0.5 * first["extent"]
    assert probe.tactile_probe.extent == 0.0


def test_an_extent_that_is_given_stays_while_the_point_is_dragged(empty, ridge, gesture):
    probe, patch = pick(empty, ridge, -0.6, extent=0.3)
    reports = slide(empty, probe, patch, np.linspace(-0.5, 0.0, 5))
    assert [report["extent"] for report in reports] == pytest.approx([0.3] * 5)
    assert "uncertain" in [report["status"] for report in reports]


def test_while_the_extent_is_dragged_numbers_are_those_of_its_end(empty, ridge, gesture):
    probe, patch = pick(empty, ridge, -0.3)
    for extent in (0.4, 0.25, 0.12, 0.05):
        probe.tactile_probe.extent = extent
        empty.context.view_layer.update()
        dragged = report_of(patch)
        assert not dragged["is_verified"]
        gesture(empty, probe)
        ended = report_of(patch)
        for name in set(COMMON) - {"status", "message"}:  # the mesh may contradict a patch in the end
            assert dragged[name] == ended[name], name


def test_at_the_end_of_a_gesture_the_patch_is_that_of_a_fresh_touch(empty, ridge, gesture):
    probe, patch = pick(empty, ridge, -0.6)
    slide(empty, probe, patch, np.linspace(-0.5, -0.1, 9))
    assert not report_of(patch)["is_verified"]
    copy = probe.copy()  # it has no patch, so no earlier touch to start from
    empty.context.collection.objects.link(copy)
    gesture(empty, probe)
    gesture(empty, copy)
    dragged, (fresh,) = report_of(patch), copy.children
    fresh = report_of(fresh)
    for report in (dragged, fresh):
        for name in ("seconds", "patch"):
            del report[name]
    assert dragged == fresh


def test_a_plane_that_comes_while_another_is_turned_is_felt_too(empty, ridge, gesture):
    probe, patch = pick(empty, ridge, -0.6)
    probe.tactile_probe.plane_count = 4
    empty.context.view_layer.update()
    assert len(report_of(patch)["planes"]) == 4
    for degrees in (2, 4, 6):
        probe.tactile_probe.azimuths[0] = math.radians(degrees)
    report = report_of(patch)
    assert report["planes"][0][0] == pytest.approx(6.0)
    assert report["status"] == "ok"
    assert len(report["planes"]) == 4
