# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A patch shows its colors without a button: viewports, the range of colors, its rim, maps below it."""

import numpy as np
import pytest

pytest.importorskip("bpy", reason="needs Blender as a Python module: run make test")
from scenes import positions, values


@pytest.fixture
def ball(empty):
    empty.ops.mesh.primitive_uv_sphere_add(segments=64, ring_count=32)
    return empty.context.object


def shadings(bpy):
    areas = (area for screen in bpy.data.screens for area in screen.areas if area.type == "VIEW_3D")
    return [area.spaces.active.shading for area in areas]


def touch(bpy, location, target="Sphere", extent=0.4, **arguments):
    bpy.ops.tactile.reconstruct(target=target, location=location, extent=extent, **arguments)
    return bpy.context.object


def test_a_script_has_the_viewports_show_colors_but_not_those_set_otherwise(empty):
    empty.ops.wm.read_homefile(use_empty=False, use_factory_startup=True)
    empty.ops.mesh.primitive_uv_sphere_add(segments=64, ring_count=32)
    first, *others = (each for each in shadings(empty) if each.color_type == "MATERIAL")
    first.color_type = "RANDOM"
    assert others
    touch(empty, (0, 0, 1))
    assert {shading.color_type for shading in others} == {"VERTEX"}
    assert first.color_type == "RANDOM"


def test_patches_of_a_mesh_share_a_range_and_may_be_given_one(empty, ball):
    empty.context.scene.unit_settings.length_unit = "MILLIMETERS"
    ball.scale = (1.0, 1.0, 0.5)
    empty.context.view_layer.update()
    patches = [touch(empty, (0, 0, 0.5))]
    own = patches[0]["tactile"]["color_limit"]
    patches.append(touch(empty, (1, 0, 0)))
    limits = [patch["tactile"]["color_limit"] for patch in patches]
    assert limits[0] == limits[1] > own  # It bends more at the rim.
    bends = [max(-patch["tactile"]["k1"], -patch["tactile"]["k2"]) for patch in patches]
    assert min(bends) < limits[0] < 2.5 * max(bends)
    patches[0].tactile_colors = "gaussian_curvature"
    assert patches[0]["tactile"]["color_limit"] == pytest.approx(limits[0] ** 2)
    patches[0].tactile_colors = "shape_index"
    assert patches[0]["tactile"]["color_limit"] == 1.0
    patches[0].tactile_colors = "mean_curvature"
    empty.ops.mesh.primitive_uv_sphere_add(segments=64, ring_count=32, radius=9.0, location=(20, 0, 0))
    empty.context.object.name = "Distant"
    empty.ops.tactile.reconstruct(target="Distant", location=(20, 0, 9), extent=4.0)
    assert empty.context.object["tactile"]["color_limit"] < limits[0]  # It has a range of its own.
    patches[0].tactile_range = 2e-3  # in 1/mm, as the legend has it
    assert patches[0]["tactile"]["color_limit"] == pytest.approx(2.0, rel=1e-6)
    assert patches[0].tactile_range == pytest.approx(2e-3, rel=1e-6)
    assert patches[1]["tactile"]["color_limit"] == limits[1]
    patches[0].tactile_range = 0.0
    assert patches[0]["tactile"]["color_limit"] == limits[0]


def test_a_flat_patch_is_pale_and_a_bent_one_beside_it_is_not(empty):
    empty.ops.mesh.primitive_cylinder_add(vertices=128)
    empty.context.object.name = "Sphere"
    lid, side = (touch(empty, place, extent=0.0) for place in ((0.2, 0.1, 1.0), (0.0, -1.0, 0.1)))
    limit = lid["tactile"]["color_limit"]
    assert side["tactile"]["color_limit"] == limit
    assert np.abs(values(lid.data, "mean_curvature")).max() < 0.05 * limit
    assert np.median(values(side.data, "mean_curvature")) < -0.3 * limit
    side.tactile_colors = "gaussian_curvature"
    found = np.abs(values(side.data, "gaussian_curvature"))
    assert np.median(found) < 0.1 * side["tactile"]["color_limit"]
    for patch in (lid, side):
        patch.tactile_colors = "shape_index"
    assert (lid["tactile"]["is_gray"], side["tactile"]["is_gray"]) == (True, False)  # A plane has none.


def test_a_touch_that_knows_nothing_does_not_set_the_range(empty, ball):
    sure = touch(empty, (0, 0, 1))
    limit = sure["tactile"]["color_limit"]
    noisy = touch(empty, (0, 1, 0), extent=0.15, noise=0.02, seed=1)
    assert noisy["tactile"]["status"] == "uncertain"
    (both,) = {patch["tactile"]["color_limit"] for patch in (sure, noisy)}
    assert 0.75 * limit <= both <= limit


def test_curvatures_that_may_as_well_be_0_are_pale(empty, ball):
    noisy = touch(empty, (0, 1, 0), extent=0.15, noise=0.02, seed=1)
    found = noisy["tactile"]
    assert max(abs(found[k]) - found[f"{k}_std"] for k in ("k1", "k2")) < 0.2 * found["k1_std"]
    assert abs(found["mean_curvature"]) < found["color_limit"]
    assert found["color_limit"] > max(found["k1_std"], found["k2_std"])


def test_a_tiny_patch_does_not_set_the_range_of_the_others(empty, ball):
    wide, other = touch(empty, (0, 0, 1)), touch(empty, (0, 1, 0))
    own = wide["tactile"]["color_limit"]
    empty.ops.mesh.primitive_uv_sphere_add(segments=64, ring_count=32, radius=0.1, location=(0, 0, 3))
    for obj in (empty.context.object, ball):
        obj.select_set(True)
    empty.context.view_layer.objects.active = ball
    empty.ops.object.join()
    tiny = touch(empty, (0, 0, 3.1), extent=0.04)
    assert tiny["tactile"]["status"] == "ok"
    assert tiny["tactile"]["k1"] == pytest.approx(-10.0, rel=0.1)
    (limit,) = {patch["tactile"]["color_limit"] for patch in (wide, other, tiny)}
    assert own <= limit <= 2.0 * own


@pytest.mark.parametrize(("place", "extent"), [((0.3, -0.3, 0.9), 0.4), ((0.5699, -0.406, 0.5021), 0.171)])
def test_eevee_draws_a_patch_above_the_mesh_where_it_is_below_it(empty, place, extent):
    empty.ops.mesh.primitive_monkey_add()
    empty.context.object.modifiers.new("Subdivision", "SUBSURF").levels = 2
    patch = touch(empty, place, target="Suzanne", extent=extent)
    deepest = -values(patch.data, "deviation").min()
    radius = patch["tactile"]["radius"]
    assert 0.01 * radius < deepest < 0.1 * radius
    assert patch["tactile_above"] > deepest


def test_eevee_draws_a_patch_above_the_mesh_it_lies_in(empty, ball):
    patch = touch(empty, (0, 0, 1))
    (material,) = patch.data.materials
    assert material.displacement_method == "DISPLACEMENT"
    assert 1e-3 < patch["tactile_above"] < 1e-2


def test_a_map_is_drawn_above_its_mesh_and_below_patches(empty, ball):
    empty.ops.tactile.stability_map(target="Sphere", extent=0.4, spacing=0.4)
    painted = empty.context.object
    patch = touch(empty, (0, 0, 1))
    assert patch.show_in_front
    assert not painted.show_in_front
    assert 0.01 < painted["tactile_above"] < 0.02
    assert np.allclose(np.linalg.norm(positions(painted.data), axis=1), 1.0)


def test_ranges_are_round_numbers_between_the_usual_bend_and_twice_as_much(extension):
    bend_range = extension.tactile_addon.scene.shown.bend_range
    assert bend_range([1.0], [2.0], 1.0) == 1.5
    assert bend_range([1.0, 0.0, 0.0], [1.0, 1.0, 1.0], 1.0) == pytest.approx(0.8)  # large flat faces
    assert bend_range([1.0, 30.0], [1.0, 1e-3], 1.0) == 2.0  # a narrow bend
    assert bend_range([], [], 4.0) == bend_range([0.0], [1.0], 4.0) == pytest.approx(2.5e-3)
