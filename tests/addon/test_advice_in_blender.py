# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Advice helps: doubts that only Blender knows are gone where their advice was followed."""

import math

import numpy as np
import pytest

pytest.importorskip("bpy", reason="needs Blender as a Python module: run make test")
import bmesh


@pytest.fixture
def why_far(extension, empty):
    """A function that gives the code of the doubt about a place of the active object, or None."""
    room = extension.tactile_addon

    def why_far(place, patch_at=None):
        depsgraph, patch = empty.context.evaluated_depsgraph_get(), None
        surface = room.touch.detached_mesh.DetachedMesh(empty.context.object, depsgraph)
        if patch_at is not None:
            point, normal = room.touch.touch_object.nearest_point(surface, patch_at, 1.0)
            patch = extension.core.explore(surface, point, normal, farthest=0.5).result
        place = np.subtract(place, surface.origin)
        found = room.whole_object.both_ways.why_far(surface, place, 0.1, patch, {"size": surface.size})
        return found and found.code

    return why_far


def edited(bpy, obj, change):
    """Changes the mesh of an object by a function of its BMesh."""
    mesh = bmesh.new()
    mesh.from_mesh(obj.data)
    change(mesh)
    mesh.to_mesh(obj.data)
    mesh.free()
    obj.data.update()
    bpy.context.view_layer.update()


def cut_top(mesh):
    top = [face for face in mesh.faces if face.calc_center_median().z > 1.95]
    bmesh.ops.delete(mesh, geom=top, context="FACES")


def test_closing_a_hole_helps(empty, ball, why_far):
    edited(empty, ball, cut_top)
    assert why_far((0.46, 0.0, 1.93)) == "open_edges"
    edited(empty, ball, lambda mesh: bmesh.ops.holes_fill(mesh, edges=mesh.edges))
    assert why_far((0.46, 0.0, 1.93)) is None


def test_filling_a_narrow_gap_helps(empty, why_far):
    for z in (0.0, 1.01):
        empty.ops.mesh.primitive_cube_add(size=1.0, location=(0.0, 0.0, z))
    for obj in empty.data.objects:
        obj.select_set(True)
    empty.ops.object.join()
    assert why_far((0.2, 0.1, 0.5)) == "narrow"
    empty.data.objects.remove(empty.context.object)
    empty.ops.mesh.primitive_cube_add(size=1.0, location=(0.0, 0.0, 0.505))
    empty.context.object.scale.z = 2.01
    empty.context.view_layer.update()
    assert why_far((0.2, 0.1, 0.5)) is None


def test_deleting_what_is_inside_helps(empty, ball, why_far):
    edited(empty, ball, cut_top)
    ball.modifiers.new("Solidify", "SOLIDIFY").thickness = 0.2
    empty.context.view_layer.update()
    assert why_far((0.0, 0.0, -1.8)) == "hidden"
    ball.modifiers.clear()
    empty.context.view_layer.update()
    assert why_far((0.0, 0.0, -1.8)) is None


def test_a_subdivision_modifier_helps_where_touches_follow_single_facets(empty, why_far):
    empty.ops.mesh.primitive_ico_sphere_add(subdivisions=2)
    place = tuple(empty.context.object.data.polygons[0].center)
    assert why_far(place, patch_at=place) == "single_facets"
    assert empty.ops.tactile.add_subdivision(target=empty.context.object.name) == {"FINISHED"}
    assert why_far(place, patch_at=place) is None


def test_moving_the_point_away_from_an_edge_helps(empty):
    empty.ops.mesh.primitive_cube_add()
    cube, found = empty.context.object, []
    for x in (1.0, 0.9):
        empty.ops.tactile.reconstruct(target=cube.name, location=(x, 0.0, 1.0))
        found.append([doubt["code"] for doubt in empty.context.object["tactile"]["doubts"]])
    assert found[0][0] == "at_edge"
    assert found[1] == []


@pytest.mark.long
@pytest.mark.parametrize(("code", "edge"), [("off_mesh", 0.5), ("share", 0.25)])
def test_a_shorter_edge_length_helps(empty, code, edge):
    empty.ops.mesh.primitive_cone_add()
    empty.ops.tactile.touch_all_over(tolerance=0.02, edge=edge)
    record = empty.context.object["tactile_object"]
    assert [doubt["code"] for doubt in record["doubts"]] == [code]
    assert "use a shorter edge length" in record["message"]
    assert empty.ops.tactile.mesh_again(edge=0.05) == {"FINISHED"}
    assert empty.context.object["tactile_object"]["status"] == "ok"


@pytest.mark.long
def test_a_shorter_edge_length_helps_against_holes(empty):
    empty.ops.mesh.primitive_grid_add(x_subdivisions=100, y_subdivisions=100)
    for vertex in empty.context.object.data.vertices:
        vertex.co.z = 0.35 * math.sin(6.0 * vertex.co.x)
    empty.ops.tactile.touch_all_over(tolerance=0.04)
    for edge in np.arange(0.5, 0.8, 0.025):  # Which of them leave holes depends on the lattice.
        empty.ops.tactile.mesh_again(edge=edge)
        record = empty.context.object["tactile_object"]
        if "holes" in [doubt["code"] for doubt in record["doubts"]]:
            break
    else:
        pytest.fail("no edge leaves holes")
    assert empty.ops.tactile.mesh_again(edge=0.05) == {"FINISHED"}
    assert empty.context.object["tactile_object"]["status"] == "ok"


@pytest.mark.long
def test_a_smaller_tolerance_reaches_into_a_slot(empty):
    profile = [(-1, -5), (1, -5), (1, 5), (0.45, 5), (0.45, 1), (0.35, 1), (0.35, 5), (-1, 5)]
    mesh = empty.data.meshes.new("Slotted")
    mesh.from_pydata([(x, 0.0, 0.1 * z) for x, z in profile], [], [range(len(profile))])
    slotted = empty.data.objects.new("Slotted", mesh)
    slotted.modifiers.new("Solidify", "SOLIDIFY").thickness = 1.4
    empty.context.collection.objects.link(slotted)
    empty.ops.tactile.touch_all_over(target=slotted.name, tolerance=0.05)
    record = empty.context.object["tactile_object"]
    assert "out_of_reach" in [doubt["code"] for doubt in record["doubts"]]
    assert empty.ops.tactile.continue_touching(tolerance=0.02) == {"FINISHED"}
    assert empty.context.object["tactile_object"]["status"] == "ok"
