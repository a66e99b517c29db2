# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Automatic extents, steps and planes in Blender: no more of them than a touch needs."""

import math
import re

import numpy as np
import pytest

pytest.importorskip("bpy", reason="needs Blender as a Python module: run make test")
from scenes import made, positions

PLACE = (0.2, 0.1, 0.06)


@pytest.fixture
def sheet(empty):
    """A wavy sheet, which three planes do not show well."""
    empty.ops.mesh.primitive_grid_add(x_subdivisions=200, y_subdivisions=200, size=2.0)
    obj = empty.context.object
    co = positions(obj.data)
    co[:, 2] = 0.2 * np.sin(3.0 * co[:, 0]) * np.cos(2.0 * co[:, 1])
    obj.data.vertices.foreach_set("co", co.astype(np.float32).ravel())
    obj.data.update()
    return obj


def reconstruct(bpy, **arguments):
    return made(bpy.ops.tactile.reconstruct, target="Grid", location=PLACE, **arguments)[1]


def test_planes_are_added_while_they_help(empty, sheet):
    three = reconstruct(empty, extent=0.5)
    report = reconstruct(empty, extent=0.5, tolerance=0.0)
    added = report["added_planes"]
    assert three["added_planes"] == []
    assert len(report["planes"]) == 3 + len(added) > 3
    assert [plane[0] for plane in report["planes"][3:]] == pytest.approx([p["azimuth"] for p in added])
    assert added[0]["azimuth"] == pytest.approx(three["suggested_plane"]["azimuth"])
    assert added[0]["height_std_before"] == three["height_std"]
    assert report["height_std"] == added[-1]["height_std"] < 0.5 * three["height_std"]
    assert report["vertex_distance_mean"] < three["vertex_distance_mean"]
    assert report["contacts"] > three["contacts"]


@pytest.mark.parametrize("seed", range(4))
def test_a_rough_mesh_is_felt_over_many_edges_and_not_on_one_face(empty, seed):
    empty.ops.mesh.primitive_grid_add(x_subdivisions=99, y_subdivisions=99, size=2.0)
    mesh, edge = empty.context.object.data, 2.0 / 99
    co = positions(mesh)
    co[:, 2] = np.random.default_rng(seed).normal(0.0, 0.12 * edge, len(co))
    mesh.vertices.foreach_set("co", co.astype(np.float32).ravel())
    mesh.update()
    patch, report = made(empty.ops.tactile.reconstruct, target="Grid", location=(0.013, 0.021, 0.0))
    assert report["status"] == "ok"
    assert report["radius"] > 10.0 * edge
    assert np.abs(positions(patch.data)[:, 2]).max() < 0.03 * report["radius"]


def test_planes_are_added_until_it_is_good_enough(empty, sheet):
    stds = [plane["height_std"] for plane in reconstruct(empty, extent=0.5, tolerance=0.0)["added_planes"]]
    report = reconstruct(empty, extent=0.5, tolerance=1.001 * stds[0])
    assert [plane["height_std"] for plane in report["added_planes"]] == stds[:1]
    assert reconstruct(empty, extent=0.5, tolerance=1.0)["added_planes"] == []


def test_more_planes_make_a_better_patch_not_a_larger_one(empty, sheet):
    before, after = reconstruct(empty), reconstruct(empty, tolerance=0.0)
    assert after["added_planes"]
    assert after["extent"] <= before["extent"] * (1.0 + 1e-9)
    assert after["height_std"] < 0.9 * before["height_std"]


def test_a_plane_along_which_nothing_can_be_felt_is_not_added(empty):
    """A flat disk with a gap where the fourth plane is suggested."""
    turns = np.arange(0, 360, 5)
    n, after = len(turns), np.roll(np.arange(len(turns)), -1)
    rim = np.column_stack([np.cos(np.radians(turns)), np.sin(np.radians(turns)), np.zeros(n)])
    faces = [(0, 1 + i, 1 + after[i]) for i in range(n)]
    there = np.abs(turns % 180 + 2.5 - 90.0) > 15.0
    faces += [(1 + i, 1 + n + i, 1 + n + after[i], 1 + after[i]) for i in np.flatnonzero(there)]
    mesh = empty.data.meshes.new("Disk")
    mesh.from_pydata(np.vstack([np.zeros(3), 0.02 * rim, rim]).tolist(), [], faces)
    empty.context.scene.collection.objects.link(empty.data.objects.new("Disk", mesh))
    inputs = {"target": "Disk", "location": (0.001, 0.0005, 0.0), "extent": 0.8}
    three = made(empty.ops.tactile.reconstruct, **inputs)[1]
    assert 75.0 < three["suggested_plane"]["azimuth"] < 105.0
    report = made(empty.ops.tactile.reconstruct, tolerance=0.0, **inputs)[1]
    assert (report["added_planes"], len(report["planes"])) == ([], 3)
    assert report["coefficients"] == three["coefficients"]


def test_a_probe_keeps_the_planes_that_were_added(empty, sheet):
    empty.ops.tactile.pick(target="Grid", location=PLACE, new=True)
    probe = empty.context.object
    settings, (patch,) = probe.tactile_probe, probe.children
    assert empty.ops.tactile.add_planes() == {"FINISHED"}
    report, digest = patch["tactile"].to_dict(), settings.digest
    count = settings.plane_count
    assert count == 3 + len(report["added_planes"]) > 3
    assert np.degrees(settings.azimuths[:count]) == pytest.approx([plane[0] for plane in report["planes"]])
    assert (settings.extent, settings.step, settings.is_probe) == (0.0, 0.0, True)
    empty.context.view_layer.update()
    assert settings.digest == digest
    assert patch["tactile"].to_dict() == report
    settings.azimuths[0] += 0.1  # the probe goes on being live
    assert patch["tactile"]["planes"][0][0] == pytest.approx(math.degrees(0.1))


def test_while_a_gesture_goes_on_the_extent_is_that_of_its_end(empty, sheet, extension):
    empty.ops.tactile.pick(target="Grid", location=PLACE, new=True)
    probe = empty.context.object
    probe.location.x += 0.3
    touch_at = extension.tactile_addon.probes.touch_again.touch_at
    depsgraph = empty.context.evaluated_depsgraph_get()
    going, ended = (touch_at(probe, depsgraph, complete=complete).report for complete in (False, True))
    assert (going["extent"], going["message"]) == (ended["extent"], ended["message"])
    stops = {stop for pair in going["stops"] for stop in pair}
    assert stops == {"fit no longer matched", "no contact"}
    assert re.search(r" \d of 6 half curves ended (at|where) .*, \d (at|where) .*\.$", ended["message"])


def test_the_shell_asks_for_planes_too(command, files):
    code, out, err = command(
        "reconstruct", files / "ball.ply", "--location", "0", "0", "2", "--tolerance", "0"
    )
    assert (code, err) == (0, "")
    assert "more planes" in out
    assert "has become ±" in out


@pytest.mark.long
@pytest.mark.parametrize(("name", "noise"), [("cad_block.stl", 0.0), ("shell_gastropod.stl", 0.05)])
def test_no_patch_across_an_edge_or_a_rib(empty, extension, scans, name, noise):
    """Touches without a warning, all over the mesh, are off it by no more than they say."""
    extension.tactile_addon.files.mesh_file.open_file(scans / name)
    obj = empty.context.scene.objects[0]
    faces = np.array([(*face.center, face.area) for face in obj.data.polygons])
    chosen = np.random.default_rng(5).choice(len(faces), 40, p=faces[:, 3] / faces[:, 3].sum())
    planes = [extension.core.SamplingPlane(azimuth) for azimuth in np.radians([0.0, 60.0, 120.0])]
    inputs = {"extent": 0.0, "step": 0.0, "noise": noise, "seed": 0, "method": "bayes", "degree": "auto"}
    add_on, depsgraph = extension.tactile_addon, empty.context.evaluated_depsgraph_get()
    silent = trusted = 0
    for at in faces[chosen, :3]:
        try:
            touched = add_on.touch.touch_object.touch(obj, depsgraph, at, planes, **inputs)
        except ValueError:  # there is no patch on a crease or near one
            continue
        touched = add_on.touch.touch_object.completed(touched)
        if touched.report["status"] == "ok":
            trusted += 1
            off = extension.core.tapped(touched.result, touched.surface).height
            silent += off > 3.0 * touched.report["height_std"]
    assert trusted > 0
    assert silent == 0
