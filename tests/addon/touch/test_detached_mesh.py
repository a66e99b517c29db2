# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Touches in slices, for maps and whole objects, notice what happens to their target meanwhile.

What an operator does then is in tests/gui/stability.py and tests/gui/whole_object.py.
"""

import numpy as np
import pytest

pytest.importorskip("bpy", reason="needs Blender as a Python module: run make test")


@pytest.fixture
def taken(empty, ball, extension):
    """The mesh of the ball as it was before it is disturbed."""
    mesh = extension.tactile_addon.touch.detached_mesh.DetachedMesh
    return mesh(ball, empty.context.evaluated_depsgraph_get())


def test_a_target_that_stays_is_found_by_whatever_name(empty, ball, taken):
    ball.name = "Another"
    empty.context.view_layer.update()
    assert taken.require_source(empty.context) == ball
    assert taken.require_same(empty.context) == ball


def move(bpy, obj):
    obj.location.x += 1e-3


def delete(bpy, obj):
    bpy.data.objects.remove(obj)


def unlink(bpy, obj):
    bpy.context.scene.collection.objects.unlink(obj)


def edit(bpy, obj):
    bpy.ops.object.mode_set(mode="EDIT")


@pytest.mark.parametrize(
    ("disturb", "message"),
    [
        (move, '"Sphere" was moved while it was touched: start again'),
        (delete, '"Sphere" is gone, so touching was stopped'),
        (unlink, '"Sphere" is gone, so touching was stopped'),
        (edit, "Touching was stopped because Object Mode was left: start it again"),
    ],
)
def test_a_target_that_does_not_stay_is_reported_at_once(empty, ball, taken, disturb, message):
    disturb(empty, ball)
    empty.context.view_layer.update()
    for require in (taken.require_source, taken.require_same):
        with pytest.raises(ValueError, match=message):
            require(empty.context)


@pytest.mark.long
@pytest.mark.parametrize("how", ["vertex", "modifier"])
def test_another_shape_is_noticed_soon_and_for_sure_in_the_end(empty, ball, taken, how):
    if how == "vertex":
        ball.data.vertices[0].co.x += 1e-3
        ball.data.update()
    else:
        ball.modifiers.new("Subdivision", "SUBSURF")
    empty.context.view_layer.update()
    for require in (taken.require_source, taken.require_same):
        with pytest.raises(ValueError, match='"Sphere" was changed while it was touched: start again'):
            require(empty.context)


def test_the_shape_is_compared_for_a_fiftieth_of_the_time(empty, ball, taken, extension, monkeypatch):
    module, now, compared = extension.tactile_addon.touch.detached_mesh, [0.0], []
    inner = module.checksum_of

    def checksum_of(*arguments):
        compared.append(now[0])
        now[0] += 1.0
        return inner(*arguments)

    monkeypatch.setattr(module, "checksum_of", checksum_of)
    monkeypatch.setattr(module, "perf_counter", lambda: now[0])
    while now[0] < 102.0:
        assert taken.require_source(empty.context) == ball
        now[0] += 0.25
    taken.require_same(empty.context)
    assert compared == [0.0, 51.0, 102.0]


def test_a_touch_within_one_bent_facet_is_in_doubt_on_a_map_too(empty, extension):
    """A face of Suzanne's ear has four corners that are not in a plane, and curvatures of its own."""
    empty.ops.mesh.primitive_monkey_add()
    obj, depsgraph = empty.context.object, empty.context.evaluated_depsgraph_get()
    empty.ops.tactile.reconstruct(target=obj.name, location=(-1.1484375, 0.375, 0.4739583), extent=0.06)
    patch = empty.context.object
    assert patch["tactile"]["status"] == "uncertain"
    assert patch["tactile"]["k1_std"] > max(abs(patch["tactile"]["k1"]), abs(patch["tactile"]["k2"])) > 0.5
    mesh = extension.tactile_addon.touch.detached_mesh.DetachedMesh(obj, depsgraph)
    found = extension.tactile_addon.scene.patch_record.reconstruction_of(patch)
    on_mesh = extension.core.with_facets(found, mesh)
    assert on_mesh.status == "uncertain"
    assert on_mesh.k1_std > max(abs(found.k1), abs(found.k2))


@pytest.mark.parametrize("scale", [(1.0, 0.7, 0.04), (-1.0, 0.7, 0.04), (2.0, 2.0, 2.0), (-1.0, -1.0, -1.0)])
def test_the_nearest_place_is_that_in_the_world_whatever_the_scale(empty, extension, scale):
    """In the coordinates of a flat cube its end is nearer than its top. Another turn makes a slanted box."""
    empty.ops.mesh.primitive_cube_add(rotation=(0.4, 0.5, 0.6))
    empty.context.object.scale = scale
    empty.context.view_layer.update()
    mesh = extension.tactile_addon.touch.detached_mesh.DetachedMesh
    cube = mesh(empty.context.object, empty.context.evaluated_depsgraph_get())
    axes, half = np.array(empty.context.object.rotation_euler.to_matrix()), np.abs(scale)
    for local in np.random.default_rng(0).uniform(-0.99, 0.99, (200, 3)) * half:
        depths, point = half - np.abs(local), axes @ local
        axis = depths.argmin()
        outward = np.copysign(1.0, local[axis]) * axes[:, axis]
        foot, normal, distance = cube.project(point.tolist())
        assert distance == pytest.approx(depths.min(), abs=1e-6)
        assert tuple(normal) == pytest.approx(tuple(outward), abs=1e-5)
        assert cube.feet(point[None])[0] == pytest.approx(np.array(foot), abs=1e-6)
        hit, facing = cube.ray_cast((point + 3.0 * outward).tolist(), (-outward).tolist(), 9.0)
        assert tuple(hit) == pytest.approx(tuple(foot), abs=5e-6)
        assert tuple(facing) == pytest.approx(tuple(outward), abs=1e-5)


@pytest.mark.parametrize("scale", [(1.0, 2.0, 3.0), (-1.0, 2.0, 3.0)])
def test_normals_are_those_of_the_scaled_mesh(empty, ball, extension, scale):
    ball.scale = scale
    empty.context.view_layer.update()
    mesh = extension.tactile_addon.touch.detached_mesh.DetachedMesh(
        ball, empty.context.evaluated_depsgraph_get()
    )
    for way in np.random.default_rng(1).normal(size=(100, 3)):
        way /= np.linalg.norm(way)
        hit, normal = mesh.ray_cast((20.0 * way).tolist(), (-way).tolist(), 40.0)
        gradient = np.array(hit) / np.square(scale)
        assert np.array(normal) @ gradient / np.linalg.norm(gradient) > 0.97
