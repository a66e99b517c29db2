# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Touch All Over by the installed extension in a real Blender, without a window.

Progress, Esc and what happens to the scene meanwhile are in tests/gui/whole_object.py.
"""

import numpy as np
import pytest

pytest.importorskip("bpy", reason="needs Blender as a Python module: run make test")
from mathutils import Matrix
from scenes import datablocks, made, positions, values


def touched(bpy, **arguments):
    """Runs the operator; the surface and its record."""
    return made(bpy.ops.tactile.touch_all_over, "tactile_object", **arguments)


def test_a_ball_is_closed_and_where_the_ball_is(empty, ball):
    ball.matrix_world = Matrix.Translation((5.0, 6.0, 7.0)) @ Matrix.Rotation(0.5, 4, "X")
    empty.context.view_layer.update()
    surface, record = touched(empty, tolerance=0.01)
    assert record["is_closed"]
    assert record["uncovered"] == 0
    assert record["source"] == ball.name
    place = np.array(surface.matrix_world)
    points = positions(surface.data) @ place[:3, :3].T + place[:3, 3] - (5.0, 6.0, 7.0)
    assert np.abs(np.linalg.norm(points, axis=1) - 2.0).max() < 0.02
    assert values(surface.data, "gaussian_curvature") == pytest.approx(0.25, abs=0.05)
    assert values(surface.data, "mean_curvature") == pytest.approx(-0.5, abs=0.05)
    assert np.abs(values(surface.data, "deviation")).max() == pytest.approx(record["deviation_max"])
    assert record["deviation_mean"] < 0.01
    assert set(values(surface.data, "patch")) <= set(range(record["patches"]))


def test_colors_show_what_is_chosen(empty, ball):
    surface, record = touched(empty, tolerance=0.01)
    for shown in ("height_std", "deviation", "gaussian_curvature"):
        surface.tactile_colors = shown
        wild = np.percentile(np.abs(values(surface.data, shown)), 98.0)
        least = 1e-3 * record["radius"] ** (-2 if shown == "gaussian_curvature" else 1)
        assert surface["tactile_object"]["color_limit"] == pytest.approx(max(wild, least), rel=1e-5)


@pytest.mark.parametrize(
    ("inputs", "message"),
    [
        ({"tolerance": -1.0}, "The tolerance is a length of 0 or more, got"),
        (
            {"tolerance": 0.01, "noise": 0.02},
            "The tolerance 1 cm is below the noise",
        ),
        ({"edge": float("nan")}, "The edge is a length of 0 or more, got"),
    ],
)
def test_what_cannot_be_is_refused_and_nothing_is_left(empty, ball, inputs, message):
    before = datablocks(empty)
    with pytest.raises(RuntimeError, match=message):
        empty.ops.tactile.touch_all_over(**inputs)
    assert datablocks(empty) == before


def test_a_budget_ends_it_with_what_there_is(empty, ball):
    _, record = touched(empty, tolerance=0.01, most=3)
    assert record["touches"] == 3
    assert not record["is_closed"]
    assert record["uncovered"] > 0


def test_nothing_begins_at_the_corners_of_a_sheet(empty):
    empty.ops.mesh.primitive_plane_add(size=2.0)
    before = datablocks(empty)
    with pytest.raises(RuntimeError, match="Touching could not begin: choose another location"):
        empty.ops.tactile.touch_all_over(tolerance=1e-3)  # it has no other vertices
    assert datablocks(empty) == before


def test_a_probe_or_a_place_says_where_to_begin(empty, ball):
    surface, _ = touched(empty, location=(0.0, 0.0, 2.0), tolerance=0.01, most=1)
    assert np.abs(positions(surface.data)[:, 2]).min() > 0.5
    empty.ops.tactile.pick(target=ball.name, location=(0.0, 2.0, 0.0))
    surface, _ = touched(empty, tolerance=0.01, most=1)
    assert np.abs(positions(surface.data)[:, 1]).min() > 0.5


def test_an_edited_surface_has_no_report(empty, ball, tmp_path):
    surface, _ = touched(empty, tolerance=0.02)
    surface.data.attributes.remove(surface.data.attributes["deviation"])
    page = tmp_path / "page.html"
    with pytest.raises(RuntimeError, match="was edited and is no longer a complete surface: touch all over"):
        empty.ops.tactile.export_report(filepath=str(page))
    assert not page.exists()
