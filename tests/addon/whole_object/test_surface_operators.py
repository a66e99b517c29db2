# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What can be done with the surface of a whole object: another mesh of it, its range, its farthest place."""

import numpy as np
import pytest

pytest.importorskip("bpy", reason="needs Blender as a Python module: run make test")
from scenes import made, positions, values


@pytest.fixture
def surface(empty, ball):
    return made(empty.ops.tactile.touch_all_over, "tactile_object", tolerance=0.02)[0]


def edges(mesh):
    ends = np.array([edge.vertices for edge in mesh.edges])
    return np.linalg.norm(np.diff(positions(mesh)[ends], axis=1), axis=2)


@pytest.mark.long
def test_another_edge_length_needs_no_touches(empty, surface):
    before, graph = surface["tactile_object"].to_dict(), surface["tactile_graph"]
    surface.tactile_range = 0.5
    objects = len(empty.data.objects)
    assert empty.ops.tactile.mesh_again(edge=0.2) == {"FINISHED"}
    assert len(empty.data.objects) == objects
    record = surface["tactile_object"].to_dict()
    assert np.median(edges(surface.data)) == pytest.approx(0.2, rel=0.3)
    assert record["edge"] == pytest.approx(np.median(edges(surface.data)), rel=0.02)
    assert record["vertices"] == len(surface.data.vertices) < 0.5 * before["vertices"]
    for name in ("touches", "tolerance", "source", "patches", "is_closed"):
        assert record[name] == before[name]
    assert record["color_limit"] == 0.5
    assert surface["tactile_graph"] == graph
    assert record["deviation_max"] >= np.abs(values(surface.data, "deviation")).max() * (1.0 - 1e-6) > 0.0
    assert empty.ops.tactile.mesh_again() == {"FINISHED"}
    assert surface["tactile_object"]["vertices"] == before["vertices"]


@pytest.mark.long
def test_a_cylinder_is_pale_by_gaussian_curvature(empty):
    empty.ops.mesh.primitive_cylinder_add()
    surface, _ = made(empty.ops.tactile.touch_all_over, "tactile_object")
    surface.tactile_colors = "gaussian_curvature"
    known = np.abs(values(surface.data, "gaussian_curvature"))
    assert np.quantile(known, 0.98) < 0.2 * surface["tactile_object"]["color_limit"]


@pytest.mark.long
def test_the_tip_of_a_cone_is_not_red_where_no_curvature_is_known(empty):
    empty.ops.mesh.primitive_cone_add()
    surface, _ = made(empty.ops.tactile.touch_all_over, "tactile_object")
    surface.tactile_colors = "gaussian_curvature"
    known = np.abs(values(surface.data, "gaussian_curvature"))
    assert np.quantile(known, 0.99) <= 0.5 * surface["tactile_object"]["color_limit"]


@pytest.mark.long
def test_edges_that_no_thin_wall_makes_shorter_are_not_said_to_be(empty, capfd):
    empty.ops.mesh.primitive_cylinder_add()
    made(empty.ops.tactile.touch_all_over, "tactile_object")
    assert empty.ops.tactile.mesh_again(edge=0.1) == {"FINISHED"}
    assert "thin walls" not in capfd.readouterr().out


@pytest.mark.long
def test_colors_show_how_far_long_edges_are_off(empty):
    empty.ops.mesh.primitive_cone_add()
    surface, _ = made(empty.ops.tactile.touch_all_over, "tactile_object")
    assert empty.ops.tactile.mesh_again(edge=0.2) == {"FINISHED"}
    record = surface["tactile_object"]
    assert record["deviation_max"] > 4.0 * record["tolerance"]
    off = np.abs(values(surface.data, "deviation"))
    # The tip of the cone is cut off, which places of the surface show less than the tip itself.
    assert 0.5 * record["deviation_max"] < off.max() <= record["deviation_max"] * (1.0 + 1e-6)
    place = np.subtract(record["deviation_place"], record["origin"])
    nearest = np.argmin(np.linalg.norm(positions(surface.data) - place, axis=1))
    assert off[nearest] > record["tolerance"]


@pytest.mark.long
def test_where_a_wall_is_thin_the_report_has_the_length_of_edges_that_were_made(empty, extension, capfd):
    empty.ops.mesh.primitive_cube_add()
    empty.context.object.scale.z = 0.05
    surface, before = made(empty.ops.tactile.touch_all_over, "tactile_object")
    assert empty.ops.tactile.mesh_again(edge=0.5) == {"FINISHED"}
    record = surface["tactile_object"].to_dict()
    assert record["edge"] == before["edge"] == pytest.approx(0.25 * 0.1, rel=0.1)
    rows = dict(extension.tactile_addon.whole_object.object_report.object_rows(record))
    assert rows["Edge Length"].endswith(" m")
    assert f"; edges are {rows['Edge Length']} long, as thin walls need" in capfd.readouterr().out
    assert surface.show_in_front and not surface.modifiers


@pytest.mark.long
def test_an_edge_length_that_does_not_suit_the_object_changes_nothing(empty, surface):
    before = surface["tactile_object"].to_dict()
    with pytest.raises(RuntimeError, match="The edge length 5 m is larger than 2 m"):
        empty.ops.tactile.mesh_again(edge=5.0)
    assert surface["tactile_object"].to_dict() == before


@pytest.mark.long
def test_only_the_last_surface_can_be_meshed_again(empty, surface, ball):
    empty.context.view_layer.objects.active = ball
    made(empty.ops.tactile.touch_all_over, "tactile_object", tolerance=0.05, most=2)
    assert empty.ops.tactile.mesh_again(edge=0.3) == {"FINISHED"}
    empty.context.view_layer.objects.active = surface
    with pytest.raises(RuntimeError, match="Only the last surface that was touched"):
        empty.ops.tactile.mesh_again(edge=0.3)


@pytest.mark.long
@pytest.mark.long
def test_an_incomplete_surface_is_continued_where_it_ended(empty, ball):
    surface, few = made(empty.ops.tactile.touch_all_over, "tactile_object", tolerance=0.01, most=4)
    assert few["uncovered"] and few["felt"] < 0.9
    objects = len(empty.data.objects)
    assert empty.ops.tactile.continue_touching(more=2) == {"FINISHED"}
    record = surface["tactile_object"].to_dict()
    assert (record["touches"], record["most"]) == (6, 6)
    assert record["felt"] > few["felt"]
    assert empty.ops.tactile.continue_touching() == {"FINISHED"}
    record = surface["tactile_object"].to_dict()
    assert (record["status"], record["is_closed"], record["tolerance"]) == ("ok", True, few["tolerance"])
    assert empty.ops.tactile.continue_touching(tolerance=0.005) == {"FINISHED"}
    finer = surface["tactile_object"].to_dict()
    assert (finer["status"], finer["tolerance"]) == ("ok", pytest.approx(0.005))
    assert finer["deviation_mean"] < record["deviation_mean"]
    assert len(empty.data.objects) == objects
    with pytest.raises(RuntimeError, match="is finer than the coordinates of"):
        empty.ops.tactile.continue_touching(tolerance=1e-9)
    ball.data.vertices[0].co.x += 1e-3
    ball.data.update()
    with pytest.raises(RuntimeError, match="was changed while it was touched: start again"):
        empty.ops.tactile.continue_touching()
    assert surface["tactile_object"].to_dict() == finer


def test_a_range_is_given_in_the_unit_of_the_legend(surface):
    own = surface["tactile_object"]["color_limit"]
    surface.tactile_range = 2.0
    assert surface["tactile_object"]["color_limit"] == pytest.approx(2.0)
    surface.tactile_range = 0.0
    assert surface["tactile_object"]["color_limit"] == own


@pytest.mark.long
def test_the_farthest_place_is_shown_where_the_surface_is_now(empty, surface):
    surface.location.x += 3.0
    empty.context.view_layer.update()
    assert empty.ops.tactile.look_farthest() == {"FINISHED"}
    assert tuple(empty.context.scene.cursor.location) == (0.0, 0.0, 0.0)
    assert empty.context.view_layer.objects.active == surface
    assert surface.tactile_colors == "deviation"


def test_a_place_below_a_lid_is_looked_at_from_aside(empty, extension):
    operators = extension.tactile_addon.whole_object.object_operators
    for height in (0.3, -0.3):  # The second lid is below the plate and hides nothing.
        empty.ops.mesh.primitive_grid_add(x_subdivisions=4, y_subdivisions=4, size=2.0)
        plate = empty.context.object
        empty.ops.mesh.primitive_plane_add(size=0.8, location=(0.0, 0.0, height))
        plate.select_set(True)
        empty.context.view_layer.objects.active = plate
        empty.ops.object.join()
        seen = plate.evaluated_get(empty.context.evaluated_depsgraph_get())
        middle = min(plate.data.vertices, key=lambda vertex: vertex.co.length)
        sight = operators._free_sight(seen, middle, 2.0)
        assert (sight.z < 0.9) is (height > 0.0)
        assert sight.z > 0.3
        assert not seen.ray_cast(middle.co + 0.001 * sight, sight)[0]


@pytest.mark.long
def test_a_surface_reaches_what_is_nearer_than_an_edge_is_long(empty, surface, capfd):
    record = surface["tactile_object"]
    surface.data.attributes["deviation"].data.foreach_set("value", np.zeros(len(surface.data.vertices)))
    for largest, is_reached in ((0.9 * record["edge"], True), (3.0 * record["edge"], False)):
        record["deviation_max"] = largest
        assert empty.ops.tactile.look_farthest() == {"FINISHED"}
        assert ("which does not reach it" not in capfd.readouterr().out) is is_reached


@pytest.mark.long
def test_quick_and_fine_have_other_tolerances(empty, ball):
    for accuracy, share in (("quick", 200), ("normal", 500), ("fine", 1250)):
        empty.context.view_layer.objects.active = ball
        options = {"accuracy": accuracy, "most": 1}
        _, record = made(empty.ops.tactile.touch_all_over, "tactile_object", **options)
        assert record["tolerance"] == pytest.approx(4.0 / share)


def dialog_of(extension):
    """The dialog of Touch All Over without a window, and its `words`."""
    operator = extension.tactile_addon.whole_object.object_operators.TACTILE_OT_touch_all_over

    class Dialog:
        _is_reshaped, accuracy, noise = True, "normal", 0.0

        def words(self, context, target, tolerance=0.0):
            self.tolerance = tolerance
            return operator._estimate(self, context, target)

    return Dialog()


def test_a_dialog_names_the_tolerance(extension, empty, ball):
    dialog = dialog_of(extension)
    assert dialog.words(empty.context, ball, tolerance=0.02) == "Tolerance 0.02 m"
    assert dialog.words(empty.context, ball) == "Tolerance 0.008 m"
    assert dialog._warnings == []


def test_a_dialog_can_tell_that_facets_will_be_felt(extension, empty):
    dialog = dialog_of(extension)
    empty.ops.mesh.primitive_ico_sphere_add(subdivisions=2)
    obj = empty.context.object
    for is_faceted in (True, False):
        dialog.words(empty.context, obj)
        assert dialog._is_faceted is is_faceted
        assert dialog._warnings == ["Touches will feel its facets one by one"] * is_faceted
        assert empty.ops.tactile.add_subdivision(target=obj.name) == {"FINISHED"}


def test_a_dialog_can_tell_that_walls_are_thin(extension, empty):
    dialog = dialog_of(extension)
    empty.ops.mesh.primitive_cube_add(size=1.0)
    empty.context.object.scale.z = 0.01
    empty.context.view_layer.update()
    dialog.words(empty.context, empty.context.object)
    assert dialog._warnings == ["Walls of 1 % of its size may be bridged or pierced"]
