# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What a place shows of why the surface is far off there: open edges, narrow gaps, pockets, facets."""

import numpy as np
import pytest

pytest.importorskip("bpy", reason="needs Blender as a Python module: run make test")


@pytest.fixture
def why(extension, empty):
    """A function that gives the sentence on a place of the active object."""

    def why(place, off, patch=None):
        surface = extension.tactile_addon.touch.detached_mesh.DetachedMesh(
            empty.context.object, empty.context.evaluated_depsgraph_get()
        )
        why_far = extension.tactile_addon.whole_object.both_ways.why_far
        found = why_far(surface, np.subtract(place, surface.origin), off, patch, {"size": surface.size})
        return found and str(found).removeprefix(f"The surface is up to {off:g} m off the object ")

    return why


def without(bpy, obj, where):
    """Deletes the faces of an object whose centers are at such places."""
    kept = [tuple(face.vertices) for face in obj.data.polygons if not where(face.center)]
    points = [tuple(vertex.co) for vertex in obj.data.vertices]
    obj.data.clear_geometry()
    obj.data.from_pydata(points, [], kept)
    bpy.context.view_layer.update()


def test_a_hole_is_named_only_beside_it(empty, ball, why):
    without(empty, ball, lambda center: center.z > 1.95)
    beside = "beside an open edge of its mesh, as around a hole: close the hole or use a smaller tolerance."
    assert why((0.6, 0.0, 1.9), 0.3) == beside
    assert why((0.0, 0.0, -2.0), 0.3) is None


@pytest.mark.parametrize("place", [(0.0, 0.0, 0.51), (0.0, 0.0, 0.49)])
def test_a_narrow_gap_is_named_with_its_width(empty, why, place):
    for z in (0.0, 1.01):
        empty.ops.mesh.primitive_cube_add(size=1.0, location=(0.0, 0.0, z))
    for obj in empty.data.objects:
        obj.select_set(True)
    empty.ops.object.join()
    gap = "where a wall or gap is 0.01 m wide: touch such parts as objects of their own or fill the gap."
    assert why(place, 0.3) == gap
    assert why((0.0, 0.5, 0.1), 0.3) is None


def test_a_pocket_is_named_where_few_directions_lead_outside(empty, ball, why):
    """A cavity with a narrow mouth, whose rim is not near the place."""
    without(empty, ball, lambda center: center.z > 1.98)
    ball.modifiers.new("Solidify", "SOLIDIFY").thickness = 0.2
    empty.context.view_layer.update()
    hidden = "where its own parts nearly hide it: delete what is inside or touch that part as an object of "
    assert why((0.0, 0.0, -1.8), 0.1) == f"{hidden}its own."


def test_facets_are_named_where_touches_follow_them(empty, extension, why):
    empty.ops.mesh.primitive_ico_sphere_add(subdivisions=2)
    place = tuple(empty.context.object.data.polygons[0].center)
    found = extension.tactile_addon.touch.touch_object
    surface = extension.tactile_addon.touch.detached_mesh.DetachedMesh(
        empty.context.object, empty.context.evaluated_depsgraph_get()
    )
    point, normal = found.nearest_point(surface, place, 1.0)
    patch = extension.core.explore(surface, point, normal, farthest=0.5).result
    follow = "where touches follow single facets: add a Subdivision modifier or use a smaller tolerance."
    assert why(place, 0.1, patch) == follow
    assert why(place, 0.1) is None
