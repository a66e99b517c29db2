# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A patch shows its colors without a button: viewports, the range of colors, its rim, maps below it."""

import math

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


def test_patches_share_a_range_and_may_be_given_one(empty, ball, extension):
    empty.context.scene.unit_settings.length_unit = "MILLIMETERS"
    ball.scale = (1.0, 1.0, 0.5)
    empty.context.view_layer.update()
    patches = [touch(empty, (0, 0, 0.5))]
    own = [patches[0]["tactile"]["color_limit"]]
    patches.append(touch(empty, (1, 0, 0)))
    other = touch(empty, (0, 1, 0))
    other.tactile_colors = "mean_curvature"
    own.append(patches[1]["tactile"]["color_limit"])
    assert own[1] > 2.0 * own[0]
    assert patches[0]["tactile"]["color_limit"] == own[1]  # They share it without Share Range.
    empty.ops.mesh.primitive_uv_sphere_add(segments=64, ring_count=32, location=(9, 0, 0))
    empty.context.object.name = "Distant"
    empty.ops.tactile.reconstruct(target="Distant", location=(9, 0, 1), extent=0.4)
    assert empty.context.object["tactile"]["color_limit"] < own[1]  # Another object has a range of its own.
    empty.context.view_layer.objects.active = patches[0]
    assert empty.ops.tactile.share_range() == {"FINISHED"}  # and says: One range of colors for 2 patches
    assert [patch["tactile"]["color_limit"] for patch in patches] == [max(own)] * 2
    assert empty.data.objects["Distant Patch"]["tactile"]["color_limit"] == max(own)
    assert "tactile_color_range" not in other
    patches[0].tactile_range = 2e-6  # in 1/mm², as the legend has it
    assert patches[0]["tactile"]["color_limit"] == pytest.approx(2.0, rel=1e-6)
    assert patches[0].tactile_range == pytest.approx(2e-6, rel=1e-6)
    assert extension.tactile_addon.scene.color_range.range_field(patches[0]) == (
        "tactile_small_range",
        "1e-6",
    )
    assert patches[0].tactile_small_range == pytest.approx(2.0, rel=1e-6)  # A field has six decimals.
    patches[0].tactile_small_range = 4.0
    assert patches[0].tactile_range == pytest.approx(4e-6, rel=1e-6)
    patches[0].tactile_range = 4e6
    assert extension.tactile_addon.scene.color_range.range_field(patches[0]) == (
        "tactile_large_range",
        "1e6",
    )
    assert patches[0].tactile_large_range == pytest.approx(4.0, rel=1e-6)
    patches[0].tactile_range = 0.0
    assert patches[0]["tactile"]["color_limit"] == own[1]
    patches[1].tactile_colors = "mean_curvature"  # this quantity has another range
    assert "tactile_color_range" not in patches[1]
    assert patches[1]["tactile"]["color_limit"] == other["tactile"]["color_limit"]


def test_patches_whose_curvature_is_as_good_as_0_have_one_range(empty):
    empty.ops.mesh.primitive_cone_add()
    empty.context.object.name = "Sphere"
    places = ((0.3, -0.4, 0.0), (0.45, -0.5, -0.3), (0.1, -0.2, 0.6))
    patches = [touch(empty, place, extent=0.0) for place in places]
    limits = [patch["tactile"]["color_limit"] for patch in patches]
    assert limits == [max(patch["tactile"]["error_limit"] for patch in patches)] * 3
    assert min(limits) > 2.0 * max(patch["tactile"]["own_limit"] for patch in patches)


def test_a_patch_in_doubt_whose_curvature_is_as_good_as_0_stays_pale_beside_a_flat_one(empty):
    empty.ops.mesh.primitive_cylinder_add()
    empty.context.object.name = "Sphere"
    side, lid = (touch(empty, place, extent=0.0) for place in ((0.98, 0.19, 0.99), (0.2, 0.1, 1.0)))
    assert [patch["tactile"]["status"] for patch in (side, lid)] == ["uncertain", "ok"]
    assert side["tactile"]["color_limit"] == side["tactile"]["error_limit"] > 0.0
    assert lid["tactile"]["color_limit"] < 0.01 * side["tactile"]["color_limit"]


def test_a_patch_in_doubt_has_the_range_of_those_that_are_sure(empty, ball):
    sure, noisy, worse = (
        touch(empty, (0, 0, 1)),
        *(touch(empty, (0, 1, 0), extent=0.15, noise=n, seed=1) for n in (0.01, 0.02)),
    )
    patches = (sure, noisy, worse)
    assert [patch["tactile"]["status"] for patch in patches] == ["ok", "uncertain", "uncertain"]
    own = [patch["tactile"]["own_limit"] for patch in patches]
    assert min(own[1:]) > 1.05 * own[0]
    assert [patch["tactile"]["color_limit"] for patch in patches] == [own[0]] * 3
    empty.data.objects.remove(sure)
    last = touch(empty, (0, -1, 0), noise=0.03)
    (limit,) = {patch["tactile"]["color_limit"] for patch in (noisy, worse, last)}
    assert limit >= max(*own[1:], last["tactile"]["own_limit"])


def test_a_tiny_patch_does_not_set_the_range_of_the_others(empty, ball):
    wide, other = touch(empty, (0, 0, 1)), touch(empty, (0, 1, 0))
    own = max(patch["tactile"]["own_limit"] for patch in (wide, other))
    empty.ops.mesh.primitive_uv_sphere_add(segments=64, ring_count=32, radius=0.1, location=(0, 0, 3))
    for obj in (empty.context.object, ball):
        obj.select_set(True)
    empty.context.view_layer.objects.active = ball
    empty.ops.object.join()
    tiny = touch(empty, (0, 0, 3.1), extent=0.04)
    assert tiny["tactile"]["status"] == "ok"
    assert tiny["tactile"]["own_limit"] > 50.0 * own
    assert [patch["tactile"]["color_limit"] for patch in (wide, other, tiny)] == [own] * 3


def test_the_range_goes_with_the_patch_that_sets_it(empty, ball):
    ball.scale = (1.0, 1.0, 0.5)
    empty.context.view_layer.update()
    flat = touch(empty, (0, 0, 0.5))
    assert empty.ops.tactile.pick(target="Sphere", location=(1, 0, 0)) == {"FINISHED"}
    (rim,) = empty.context.object.children
    own = flat["tactile"]["own_limit"]
    assert flat["tactile"]["color_limit"] == rim["tactile"]["own_limit"] > 2.0 * own
    rim.tactile_colors = "mean_curvature"
    assert flat["tactile"]["color_limit"] == own
    rim.tactile_colors = "gaussian_curvature"
    assert flat["tactile"]["color_limit"] == rim["tactile"]["own_limit"] > 2.0 * own
    assert empty.ops.tactile.delete() == {"FINISHED"}
    assert flat["tactile"]["color_limit"] == own


@pytest.mark.parametrize(("place", "extent"), [((0.3, -0.3, 0.9), 0.4), ((0.5699, -0.406, 0.5021), 0.171)])
def test_eevee_draws_a_patch_above_the_mesh_where_it_is_below_it(empty, place, extent):
    empty.ops.mesh.primitive_monkey_add()
    empty.context.object.modifiers.new("Subdivision", "SUBSURF").levels = 2
    patch = touch(empty, place, target="Suzanne", extent=extent)
    deepest = -values(patch.data, "deviation").min()
    radius = patch["tactile"]["radius"]
    assert 0.01 * radius < deepest < 0.1 * radius
    for obj in (patch, *patch.children):
        assert obj["tactile_above"] > deepest


def test_contacts_that_are_close_together_do_not_run_into_a_bar(empty):
    empty.ops.mesh.primitive_cube_add()
    empty.context.object.name = "Sphere"
    patch = touch(empty, (-0.9, 0.4, 1.0), step=0.02)
    (lines,) = patch.children
    contour, contact = values(lines.data, "contour"), values(lines.data, "contact")
    points = positions(lines.data)
    dots = points[(contour == 0) & (contact == 1)]
    assert 0.0 < np.ptp(dots, axis=0).max() < 0.02


def test_eevee_draws_a_patch_above_the_mesh_it_lies_in(empty, ball):
    patch = touch(empty, (0, 0, 1))
    for obj in (patch, *patch.children):
        (material,) = obj.data.materials
        assert material.displacement_method == "DISPLACEMENT"
        assert 1e-3 < obj["tactile_above"] < 1e-2


def test_a_flat_patch_has_a_rim_that_lies_in_it(empty):
    empty.ops.mesh.primitive_cube_add()
    empty.context.object.name = "Sphere"
    patch = touch(empty, (0.1, 0.2, 1.0))
    (lines,) = patch.children
    is_rim = (values(lines.data, "contour") == -1) & (values(lines.data, "contact") == -1)
    rim = positions(lines.data)[is_rim]
    angles = np.sort(np.arctan2(rim[:, 1], rim[:, 0]))
    assert np.diff(angles).max() < math.radians(10.0)
    assert np.hypot(*rim[:, :2].T).min() > 0.3
    assert np.abs(rim[:, 2]).max() < 0.01


def test_the_range_of_a_flat_patch_follows_what_is_significant(empty):
    """Beside a corner a patch is small and its curvature unknown, but it is as flat as any other."""
    empty.ops.mesh.primitive_cube_add()
    ranges = []
    for location in ((0.997, 0.997, 1.0), (0.1, 0.2, 1.0)):
        patch = touch(empty, location, target="Cube", extent=0.0)
        ranges.append(patch["tactile"]["own_limit"])
    assert ranges == pytest.approx([1e-2 / 2.0**2] * 2)
    noisy = touch(empty, (-0.1, 0.2, 1.0), target="Cube", noise=1e-3)
    assert 0.0 < np.abs(values(noisy.data, "gaussian_curvature")).max() < noisy["tactile"]["color_limit"]


def test_a_map_is_drawn_above_its_mesh_and_below_patches(empty, ball):
    empty.ops.tactile.stability_map(target="Sphere", extent=0.4, spacing=0.4)
    painted = empty.context.object
    patch = touch(empty, (0, 0, 1))
    assert patch.show_in_front
    assert not painted.show_in_front
    assert 0.01 < painted["tactile_above"] < 0.02
    assert np.allclose(np.linalg.norm(positions(painted.data), axis=1), 1.0)


def test_a_patch_on_a_cylinder_is_pale_up_to_its_rim(empty):
    """At the rim K of a patch on facets is some half of that of a ball, and its deviation larger."""
    empty.ops.mesh.primitive_cylinder_add()
    empty.context.object.name = "Sphere"
    for place in ((0.64, -0.77, 0.3), (0.1, -0.99, -0.08), (0.83, 0.56, -0.66)):
        patch = touch(empty, place, extent=0.0)
        found, stds = values(patch.data, "gaussian_curvature"), values(patch.data, "gaussian_curvature_std")
        assert np.abs(found).max() > 0.3
        assert np.mean(np.abs(found) > 1.645 * stds) < 0.05
        assert np.abs(found).max() < 0.3 * patch["tactile"]["color_limit"]
        assert patch["tactile"]["own_limit"] < 1.3  # Others that it overlaps do not become pale.


def test_a_patch_that_is_curved_in_part_has_the_range_of_its_curvature(empty):
    empty.ops.mesh.primitive_torus_add(major_segments=96, minor_segments=48)
    empty.context.object.name = "Sphere"
    for place in ((1.0, 0.0, 0.25), (0.9, -0.9, 0.0), (0.55, -0.55, 0.0)):  # K changes its sign at the first
        patch = touch(empty, place, extent=0.0)
        wild = np.percentile(np.abs(values(patch.data, "gaussian_curvature")), 98.0)
        assert patch["tactile"]["own_limit"] == pytest.approx(wild, rel=0.3)
        assert patch["tactile"]["color_limit"] < 7.0


def test_small_areas_do_not_set_a_range(extension):
    """As of tiny patches, whose curvatures may be wild, among those that grow over an object."""
    colors = extension.tactile_addon.scene.colors
    values, areas = np.repeat([-1.0, 50.0], [90, 10]), np.repeat([1.0, 0.01], [90, 10])
    assert colors.symmetric_range(values, 0.5) == pytest.approx(50.0)
    assert colors.range_by_area(values, areas, 0.5) == 1.0
    assert colors.range_by_area(values, np.ones(100), 0.5) == 50.0
    assert colors.range_by_area(values, areas, 2.0) == 2.0
