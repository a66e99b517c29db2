# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The probes of the installed extension in a real Blender, without a window.

Here every update is complete at once; gestures, which are completed when they end, are in tests/gui.
"""

import math
import operator

import numpy as np
import pytest

pytest.importorskip("bpy", reason="needs Blender as a Python module: run make test")
import scenes
from mathutils import Matrix, Vector
from mathutils.bvhtree import BVHTree

RADIUS = 2.0
TOP, SIDE = Vector((0.3, -0.2, 1.9)), Vector((1.9, 0.3, 0.4))
SET = ["Sphere", "Sphere Patch", "Sphere Probe"]
OPERATORS = ("add_plane", "add_planes", "remove_plane", "update", "delete")


@pytest.fixture
def ball(empty):
    """A finely faceted sphere of radius 2, the active object."""
    return scenes.add_sphere(empty, segments=96, rings=48, radius=RADIUS)


def pick(bpy, **arguments):
    """Makes a probe on the active object and returns it with its patch."""
    given = {"target": bpy.context.object.name, "location": TOP, "extent": 0.6, "new": True}
    assert bpy.ops.tactile.pick(**(given | arguments)) == {"FINISHED"}
    probe = bpy.context.object
    (patch,) = probe.children
    return probe, patch


def update(bpy):
    bpy.context.view_layer.update()


def report_of(patch):
    return patch["tactile"].to_dict()


def values(obj, name="position", key="vector", width=3):
    return scenes.values(obj.data, name, key, width)


def state(patch):
    """What a touch writes: the report without its times, and the meshes."""
    report = report_of(patch)
    del report["seconds"]
    colors = values(patch, "curvature_color", "color", 4)
    return (
        report,
        values(patch).tolist(),
        colors.tolist(),
        {name: list(map(list, paths)) for name, paths in patch["tactile_curves"].items()},
    )


def test_a_target_that_is_no_mesh_and_a_scale_that_is_none_are_messages(empty, ball, capfd):
    """A script can set a target that the panel does not offer."""
    probe, patch = pick(empty)
    settings = probe.tactile_probe
    for change, back, message in (
        (
            lambda: setattr(settings, "target", probe),
            lambda: setattr(settings, "target", ball),
            "is not a mesh",
        ),
        (
            lambda: setattr(probe, "scale", (0, 1, 1)),
            lambda: setattr(probe, "scale", (1, 1, 1)),
            "a scale of 0",
        ),
        (
            lambda: setattr(probe, "scale", (1, 1, 3e38)),
            lambda: setattr(probe, "scale", (1, 1, 1)),
            "a scale of 0",
        ),
    ):
        change()
        update(empty)
        assert message in settings.message
        back()
        update(empty)
        assert_touches(probe, patch)
    assert "Traceback" not in "".join(capfd.readouterr())


@pytest.mark.parametrize("what", ["location", "scale", "rotation_euler"])
def test_a_target_that_is_nowhere_is_named_and_comes_back(empty, ball, capfd, what):
    probe, patch = pick(empty)
    before = np.array(getattr(ball, what))
    setattr(ball, what, (float("nan"), 1.0, 1.0))
    update(empty)
    said = '"Sphere" has a location, rotation or scale that is not finite: set it again'
    assert probe.tactile_probe.message == said
    setattr(ball, what, before)
    update(empty)
    assert_touches(probe, patch)
    assert "Traceback" not in "".join(capfd.readouterr())


def state_but_status(patch):
    """The state without the status and message, which a failed touch changes in an earlier patch."""
    report, *meshes = state(patch)
    for key in ("status", "message"):
        del report[key]
    return report, *meshes


def in_world(obj):
    return values(obj) @ np.array(obj.matrix_world)[:3, :3].T + place(obj)


def datablocks(bpy):
    """The names of all datablocks, by the numbers that these keep as long as they live."""
    collections = ("objects", "meshes", "materials", "collections", "node_groups", "images", "curves")
    return {
        name: {block.session_uid: block.name for block in getattr(bpy.data, name)} for name in collections
    }


def names(bpy):
    return sorted(obj.name for obj in bpy.data.objects)


def mark(patch):
    """Moves a vertex to a place where it stays until the patch is rewritten."""
    patch.data.vertices[7].co.z = 55.0


def is_marked(patch):
    return patch.data.vertices[7].co.z == 55.0


def select(bpy, *objects):
    for obj in bpy.context.view_layer.objects:
        obj.select_set(obj in objects)
    bpy.context.view_layer.objects.active = objects[0]


def place(obj):
    return np.array(obj.matrix_world.translation)


def axis(obj, number):
    return np.array(obj.matrix_world.col[number].xyz.normalized())


def assert_touches(probe, patch, center=(0.0, 0.0, 0.0), radius=RADIUS):
    """Probe and patch lie on the ball, upright, and the patch is curved as the ball is."""
    assert probe.tactile_probe.message == ""
    out = (place(probe) - center) / radius
    assert np.linalg.norm(out) == pytest.approx(1.0, abs=2e-3)
    assert axis(probe, 2) == pytest.approx(out, abs=0.04)
    report = report_of(patch)
    assert [report["k1"], report["k2"]] == pytest.approx([-1.0 / radius] * 2, rel=0.03)
    # A point that was touched with noise is off the patch by it, along the normal.
    above = place(probe) - report["frame"]["origin"]
    assert np.cross(above, report["frame"]["normal"]) == pytest.approx(0.0, abs=1e-6)
    assert np.linalg.norm(above) <= max(1e-6, probe.tactile_probe.noise)
    assert place(patch) == pytest.approx(report["frame"]["origin"], abs=1e-5)
    assert np.linalg.norm(in_world(patch) - center, axis=1) == pytest.approx(radius, abs=0.01 * radius)


def test_a_pick_makes_a_probe_with_its_patch(empty, ball):
    probe, patch = pick(empty, extent=0.0)
    assert names(empty) == SET
    assert (patch.name, patch.data.name) == (SET[1], SET[1])
    assert len(empty.data.meshes) == 2
    assert {c.name for obj in (probe, patch) for c in obj.users_collection} == {"Tactile Patches"}
    assert (empty.context.view_layer.objects.active, empty.context.selected_objects) == (probe, [probe])
    settings, report = probe.tactile_probe, report_of(patch)
    assert (settings.is_probe, settings.target, settings.live) == (True, ball, True)
    assert settings.extent == 0.0  # 0 leaves the extent to the surface
    assert 0.5 * RADIUS < report["extent"] <= 1.001 * RADIUS
    assert report["vertices"] > 100
    assert report["vertex_distance_mean"] < 3.0 * report["height_std"]
    # The probe is on the ray from the center through the location, and azimuth 0 is along its x axis.
    assert place(probe) == pytest.approx(RADIUS * np.array(TOP.normalized()), abs=0.01)
    assert np.array(report["axes"])[:, 0] == pytest.approx(axis(probe, 0), abs=1e-4)


def test_an_automatic_number_shows_what_was_chosen_and_is_changed_from_there(empty, ball):
    probe, patch = pick(empty, extent=0.0)
    settings, chosen = probe.tactile_probe, report_of(patch)
    for name in ("extent", "step", "degree"):
        assert getattr(settings, f"used_{name}") == pytest.approx(chosen[name])
    settings.used_extent = 0.4
    assert settings.extent == settings.used_extent == pytest.approx(0.4)
    assert report_of(patch)["extent"] == pytest.approx(0.4)
    settings.used_extent = 0.0
    assert settings.extent == 0.0
    assert settings.used_extent == pytest.approx(chosen["extent"], rel=1e-3)


@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize(
    ("location", "normal", "curvatures"),
    [((2.8, 0, 0), (1, 0, 0), (-1 / 0.8, -1 / 2.8)), ((0, 1.2, 0), (0, -1, 0), (-1 / 0.8, 1 / 1.2))],
    ids=["outer", "inner"],
)
def test_a_torus_from_outside_and_from_inside(empty, location, normal, curvatures, side):
    empty.ops.mesh.primitive_torus_add(
        major_segments=192, minor_segments=96, major_radius=2.0, minor_radius=0.8
    )
    toward = side * np.array(normal)
    probe, patch = pick(empty, location=location, extent=0.3, outward=toward)
    found = sorted(side * report_of(patch)[key] for key in ("k1", "k2"))
    assert found == pytest.approx(curvatures, abs=0.04)
    assert axis(probe, 2) == pytest.approx(toward, abs=0.04)


def test_a_pick_with_a_probe_active_moves_it_with_its_settings(empty, ball):
    azimuths = [0.1, 0.8, 1.5, 2.4, 0.0, 0.0]
    probe, patch = pick(empty, noise=0.002, seed=3, degree=3, plane_count=4, azimuths=azimuths)
    before = datablocks(empty)
    for active, location in ((probe, SIDE), (patch, -SIDE)):
        select(empty, active)
        assert empty.ops.tactile.pick(location=location) == {"FINISHED"}
        assert empty.context.object == probe
        assert datablocks(empty) == before
        assert place(probe) == pytest.approx(RADIUS * np.array(location.normalized()), abs=0.01)
        assert_touches(probe, patch)
        report = report_of(patch)
        assert [report[key] for key in ("noise", "seed", "degree", "extent")] == pytest.approx(
            [0.002, 3, 3, 0.6]
        )
        assert np.radians(report["planes"])[:, 0] == pytest.approx(azimuths[:4])


def test_probes_do_not_share_what_they_write(empty, ball):
    first, one = pick(empty)
    second, other = pick(empty, target="Sphere", location=SIDE)
    assert (len(empty.data.objects), len(empty.data.meshes)) == (5, 3)
    mark(other)
    first.tactile_probe.azimuths[1] = 0.7
    assert report_of(one)["planes"][1][0] == pytest.approx(math.degrees(0.7))
    assert is_marked(other)
    one.tactile_range = 1.0  # Overlapping patches would share one that follows from both.
    before = state(one)
    second.tactile_probe.extent = 0.4
    assert not is_marked(other)
    assert state(one) == before
    assert_touches(second, other)


@pytest.mark.parametrize(
    ("name", "change", "method"),
    [
        ("azimuths", (1, 0.7), "bayes"),
        ("tilts", (0, 0.2), "bayes"),
        ("extent", 0.45, "bayes"),
        ("step", 0.04, "bayes"),
        ("noise", 0.01, "bayes"),
        ("seed", 5, "bayes"),
        ("method", "tagc", "bayes"),
        ("degree", 5, "bayes"),
        ("plane_count", 5, "bayes"),
        ("weight", 10.0, "tagc"),
        ("solver", "descent", "tagc"),
    ],
)
def test_every_setting_rewrites_the_patch_in_place(empty, ball, name, change, method):
    probe, patch = pick(empty, step=0.06, noise=0.005, method=method, degree=4)
    settings, blocks, points = probe.tactile_probe, datablocks(empty), values(patch)
    before, digest = report_of(patch), settings.digest
    if isinstance(change, tuple):
        getattr(settings, name)[change[0]] = change[1]
    else:
        setattr(settings, name, change)
    report = report_of(patch)
    assert datablocks(empty) == blocks
    assert settings.digest != digest
    assert [report["k1"], *report["coefficients"]] != [before["k1"], *before["coefficients"]]
    found = values(patch)
    if (name, method) != (
        "degree",
        "bayes",
    ):  # the degree is that of (1), not of this surface
        assert found.shape != points.shape or np.abs(found - points).max() > 1e-5
    inputs = ("plane_count", "azimuths", "tilts", "extent", "step", "noise", "seed", "method", "degree")
    inputs = {key: getattr(settings, key) for key in (*inputs, "weight", "solver")}
    empty.ops.tactile.reconstruct(target="Sphere", location=place(probe), **inputs)
    other = report_of(empty.context.object)
    for key in ("k1", "k2", "fit_error", "height_std", "radius", "contacts"):
        assert report[key] == pytest.approx(other[key], rel=2e-3, abs=1e-5)
    assert report["planes"] == other["planes"]


def test_a_moved_probe_snaps_back_onto_the_surface(empty, ball):
    probe, patch = pick(empty)
    before = datablocks(empty)
    probe.location += Vector((0.3, 0.25, 0.1))
    wanted = RADIUS * np.array(probe.location.normalized())
    update(empty)
    assert place(probe) == pytest.approx(wanted, abs=0.01)
    assert_touches(probe, patch)
    assert datablocks(empty) == before
    mark(patch)
    for _ in range(3):
        probe.update_tag()
        update(empty)
    assert is_marked(patch), "the snap was taken for another move"


def test_a_probe_under_a_parent_settles(empty, ball):
    probe, patch = pick(empty)
    probe.parent = empty.data.objects.new("Parent", None)
    empty.context.scene.collection.objects.link(probe.parent)
    probe.parent.rotation_euler, probe.parent.scale, probe.scale = (0.4, 0.2, 0), (2, 2, 2), (1.5, 1.5, 1.5)
    update(empty)
    probe.matrix_world = Matrix.Translation(SIDE) @ Matrix.Rotation(1.4, 4, "Y")
    update(empty)
    for _ in range(2):
        probe.update_tag()
        update(empty)
        assert_touches(probe, patch)
    mark(patch)
    for _ in range(3):
        probe.update_tag()
        update(empty)
    assert is_marked(patch), "its own place was taken for a move"


def test_the_planes_turn_with_the_probe_and_its_back_is_the_inside(empty, ball):
    def turn(angle, about):
        probe.matrix_world = probe.matrix_world @ Matrix.Rotation(angle, 4, about)
        update(empty)

    probe, patch = pick(empty)
    e1, n, _ = np.array(report_of(patch)["axes"]).T
    turn(0.5, "Z")
    axes = np.array(report_of(patch)["axes"])
    assert axes[:, 0] == pytest.approx(math.cos(0.5) * e1 + math.sin(0.5) * np.cross(n, e1), abs=1e-4)
    assert axes[:, 1] == pytest.approx(n, abs=1e-4)
    assert report_of(patch)["planes"][0] == [0.0, 0.0]
    turn(0.4, "Y")  # a probe that leans stands up again
    assert_touches(probe, patch)
    turn(math.pi, "X")
    report = report_of(patch)
    assert [report["k1"], report["k2"]] == pytest.approx([1 / RADIUS] * 2, rel=0.03)
    assert axis(probe, 2) == pytest.approx(-n, abs=0.04)
    assert axis(patch, 2) == pytest.approx(-n, abs=0.04)


@pytest.mark.parametrize(
    ("change", "height", "radius"),
    [
        (lambda ball: setattr(ball.location, "z", 0.2), 0.2, RADIUS),
        (lambda ball: setattr(ball.parent.location, "z", 0.3), 0.3, RADIUS),
        (lambda ball: ball.hide_set(True) or setattr(ball.location, "z", 0.2), 0.2, RADIUS),
        (lambda ball: setattr(ball.modifiers["Displace"], "strength", 0.3), 0.0, RADIUS + 0.3),
        (lambda ball: setattr(ball.modifiers["Subdivision"], "levels", 1), 0.0, RADIUS),
        (lambda ball: ball.data.transform(Matrix.Scale(1.15, 4)) or ball.data.update(), 0.0, 1.15 * RADIUS),
    ],
    ids=["moved", "parent", "hidden", "modifier", "level", "vertices"],
)
def test_the_patch_follows_its_target(empty, ball, change, height, radius):
    ball.parent = empty.data.objects.new("Parent", None)
    empty.context.scene.collection.objects.link(ball.parent)
    ball.modifiers.new("Displace", "DISPLACE").mid_level = 0.0
    ball.modifiers["Displace"].strength = 0.0
    ball.modifiers.new("Subdivision", "SUBSURF").levels = 0
    probe, patch = pick(empty, parent=False)
    blocks, digest = datablocks(empty), probe.tactile_probe.digest
    mark(patch)
    change(ball)
    update(empty)
    assert probe.tactile_probe.digest != digest
    assert not is_marked(patch)
    assert_touches(probe, patch, (0.0, 0.0, height), radius)
    assert datablocks(empty) == blocks


def test_what_does_not_concern_the_probe_does_not_change_its_patch(empty, ball):
    probe, patch = pick(empty)
    empty.ops.mesh.primitive_cube_add(location=(9.0, 0.0, 0.0))
    cube, digest = empty.context.object, probe.tactile_probe.digest
    mark(patch)
    cube.location.x = 8.0
    update(empty)
    cube.data.vertices[0].co.x = 5.0
    cube.data.update()
    update(empty)
    ball.data.update()  # the shape stays the same
    update(empty)
    ball.show_wire, probe.empty_display_size, probe.tactile_probe.active_plane = True, 3.0, 1
    update(empty)
    assert is_marked(patch)
    assert probe.tactile_probe.digest == digest


def test_a_probe_that_is_not_live_waits_to_touch_again(empty, ball):
    probe, patch = pick(empty, parent=False)
    before, there, settings = state_but_status(patch), in_world(patch), probe.tactile_probe
    settings.live = False
    settings.extent = 0.5
    probe.location = SIDE
    ball.scale = (1.1, 1.1, 1.1)
    update(empty)
    assert probe.location == SIDE
    assert report_of(patch)["status"] == "outdated"
    assert state_but_status(patch) == before
    assert in_world(patch) == pytest.approx(there, abs=1e-5)
    assert empty.ops.tactile.update() == {"FINISHED"}
    assert report_of(patch)["extent"] == 0.5
    assert_touches(probe, patch, radius=1.1 * RADIUS)
    before = state_but_status(patch)
    settings.azimuths[0] = 0.2
    assert state_but_status(patch) == before
    settings.live = True
    assert report_of(patch)["planes"][0][0] == pytest.approx(math.degrees(0.2))


@pytest.mark.parametrize(
    ("name", "away"),
    [
        ("location", SIDE),
        ("rotation_euler", (0.3, 1.0, 2.0)),
        ("scale", (0.0, 1.0, 1.0)),
        ("scale", (3e38, 1.0, 1.0)),
    ],
)
def test_a_probe_that_is_not_live_leaves_its_patch_where_it_is_when_it_comes_back(empty, ball, name, away):
    probe, patch = pick(empty)
    there, back = in_world(patch), getattr(probe, name).copy()
    probe.tactile_probe.live = False
    setattr(probe, name, away)
    update(empty)
    if name != "scale":  # nothing can be placed under such a scale
        assert in_world(patch) == pytest.approx(there, abs=1e-5)
    setattr(probe, name, back)
    update(empty)
    assert in_world(patch) == pytest.approx(there, abs=1e-5)


def test_a_probe_that_is_scaled_does_not_scale_its_patch(empty, ball):
    probe, patch = pick(empty)
    before, there = state(patch), in_world(patch)
    probe.scale = (2.0, 2.0, 2.0)
    update(empty)
    assert probe.tactile_probe.live
    assert state(patch) == before
    assert in_world(patch) == pytest.approx(there, abs=1e-5)


def test_a_probe_off_the_surface_says_so_and_keeps_its_patch(empty, ball):
    probe, patch = pick(empty)
    before, points, there = state_but_status(patch), in_world(patch), probe.location.copy()
    for height in (9.0, 8.0):
        probe.location = (0.0, 0.0, height)
        update(empty)
        assert probe.tactile_probe.message == (
            f'The location is {height - 2:g} m away from "Sphere", farther than 0.6 m: move it to the surface'
        )
        assert state_but_status(patch) == before
        assert report_of(patch)["status"] == "outdated"
        assert report_of(patch)["message"] == (
            "This patch is from an earlier touch, because the last one failed. " + probe.tactile_probe.message
        )
        assert in_world(patch) == pytest.approx(points, abs=1e-5)
        assert list(probe.location) == [0.0, 0.0, height]
    probe.location = there
    update(empty)
    assert_touches(probe, patch)
    assert report_of(patch)["status"] == "ok"
    probe.tactile_probe.azimuths[1] = 0.0
    assert "run in the same direction" in probe.tactile_probe.message
    probe.tactile_probe.azimuths[1] = 1.0
    assert_touches(probe, patch)


def exclude(bpy, ball):
    hidden = bpy.data.collections.new("Hidden")
    bpy.context.scene.collection.children.link(hidden)
    hidden.objects.link(ball)
    bpy.context.scene.collection.objects.unlink(ball)
    bpy.context.view_layer.layer_collection.children["Hidden"].exclude = True


def to_another_scene(bpy, ball):
    bpy.data.scenes.new("Studio").collection.objects.link(ball)
    bpy.context.scene.collection.objects.unlink(ball)


NO_TARGET = "The probe has no target: choose the mesh to touch"


@pytest.mark.parametrize(
    ("spoil", "sentence", "left"),
    [
        (lambda bpy, ball: bpy.data.objects.remove(ball), NO_TARGET, SET[1:]),
        (lambda bpy, ball: select(bpy, ball) or bpy.ops.object.delete(), NO_TARGET, SET[1:]),
        (lambda bpy, ball: bpy.context.scene.collection.objects.unlink(ball), NO_TARGET, SET[1:]),
        (lambda bpy, _: setattr(bpy.context.object.tactile_probe, "target", None), NO_TARGET, SET),
        (exclude, '"Sphere" is not in this view layer', SET),
        (to_another_scene, '"Sphere" is in the scene "Studio": go there, or choose', SET),
        (lambda _, ball: setattr(ball, "hide_viewport", True), '"Sphere" is disabled in viewports', SET),
        (lambda _, ball: ball.data.clear_geometry() or ball.data.update(), '"Sphere" has no faces', SET),
    ],
    ids=["removed", "deleted", "unlinked", "none", "excluded", "elsewhere", "disabled", "empty"],
)
def test_without_a_target_the_probe_says_so_and_keeps_its_patch(
    empty, extension, ball, capfd, spoil, sentence, left
):
    deleted = extension.tactile_addon.probes.deleted
    probe, patch = pick(empty)
    before, there = state_but_status(patch), in_world(patch)
    spoil(empty, ball)
    for x in (0.4, 0.5):
        update(empty)
        assert sentence in probe.tactile_probe.message
        if left == SET[1:] and "Sphere" in names(empty):  # the handler itself deletes nothing
            settle = extension.tactile_addon.probes.change_handlers._settle
            assert not empty.app.timers.is_registered(settle)  # timers do not run without a window
            deleted.remove()  # as Blender does once it is idle, in a window
        assert names(empty) == left
        assert state_but_status(patch) == before
        assert in_world(patch) == pytest.approx(there, abs=1e-5)
        probe.location.x = probe.tactile_probe.extent = x
    assert "Traceback" not in capfd.readouterr().err
    scenes.add_sphere(empty, segments=96, rings=48, radius=2.1)
    probe.tactile_probe.target = empty.context.object
    assert_touches(probe, patch, radius=2.1)


def test_a_patch_in_edit_mode_is_left_to_its_editor(empty, ball, capfd):
    probe, patch = pick(empty)
    select(empty, patch)
    empty.ops.object.mode_set(mode="EDIT")
    ball.location.z = 0.2
    update(empty)
    probe.tactile_probe.extent = 0.5
    empty.ops.object.mode_set(mode="OBJECT")
    assert "Traceback" not in capfd.readouterr().err
    ball.location.z = 0.1
    update(empty)
    assert_touches(probe, patch, center=(0.0, 0.0, 0.1))


@pytest.mark.parametrize("way", ["copy", "duplicate", "all", "linked"])
def test_a_copy_of_a_probe_has_its_own_patch(empty, ball, way):
    probe, patch = pick(empty, noise=0.002)
    before = state(patch)
    if way == "copy":
        other = probe.copy()
        empty.context.scene.collection.objects.link(other)
    else:
        select(empty, probe, *([] if way == "duplicate" else [patch]))
        empty.ops.object.duplicate(linked=way == "linked")
        other = empty.context.object
    update(empty)
    assert (len(empty.data.objects), len(empty.data.meshes)) == (5, 3)
    assert probe.children[:] == (patch,)
    (second,) = other.children
    assert values(second) == pytest.approx(values(patch), abs=1e-5)
    other.location = SIDE
    other.tactile_probe.noise = 0.0
    update(empty)
    assert_touches(other, second)
    assert report_of(second)["patch"] == second.name
    # Both have one range of colors, which suits both.
    assert report_of(patch)["color_limit"] == report_of(second)["color_limit"]
    assert without_range(state(patch)) == without_range(before)
    assert_touches(probe, patch)


def without_range(found):
    """A state without colors and their range, which patches of one mesh have in common."""
    report, shape, _, contours = found
    return {key: value for key, value in report.items() if key != "color_limit"}, shape, contours


@pytest.mark.parametrize("live", [True, False])
def test_a_patch_outlives_its_probe_as_an_ordinary_object(empty, ball, live):
    probe, patch = pick(empty)
    probe.tactile_probe.live = live
    probe.location = SIDE
    update(empty)
    before, there = state(patch), in_world(patch)
    select(empty, probe)
    empty.ops.object.delete()
    update(empty)
    assert names(empty) == SET[:2]
    assert patch.parent is None
    assert in_world(patch) == pytest.approx(there, abs=1e-5)
    patch.location.x = 5.0
    ball.location.x = 1.0
    update(empty)
    assert place(patch)[0] == 5.0
    assert state(patch) == before


@pytest.mark.parametrize("active", SET[1:])
def test_deleting_takes_all_of_the_probe_and_nothing_else(empty, ball, active):
    pick(empty)
    others = datablocks(empty)
    pick(empty, target="Sphere", location=SIDE)
    select(empty, empty.data.objects[f"{active}.001"])
    assert empty.ops.tactile.delete() == {"FINISHED"}
    assert datablocks(empty) == others
    assert empty.context.object == empty.data.objects["Sphere"]  # The next touch is about it.
    select(empty, empty.data.objects[active])
    assert empty.ops.tactile.delete() == {"FINISHED"}
    assert names(empty) == SET[:1]
    assert all(block.users for blocks in (empty.data.meshes, empty.data.materials) for block in blocks)


def test_without_a_probe_there_is_nothing_to_change(empty, ball):
    def polls():
        return [getattr(empty.ops.tactile, name).poll() for name in OPERATORS]

    assert polls() == [False] * 5
    pick(empty)
    assert polls() == [True, True, False, True, True]
    empty.context.view_layer.objects.active = None
    assert polls() == [False] * 5


def test_a_saved_probe_is_as_it_was_and_goes_on(empty, ball, tmp_path):
    probe, patch = pick(empty, noise=0.002)
    mark(patch)
    before, digest, path = state(patch), probe.tactile_probe.digest, str(tmp_path / "saved.blend")
    empty.ops.wm.save_as_mainfile(filepath=path)
    empty.ops.wm.read_homefile(use_empty=True)
    empty.ops.wm.open_mainfile(filepath=path)
    ball, patch, probe = (empty.data.objects[name] for name in SET)
    ball.update_tag()
    update(empty)
    assert probe.tactile_probe.digest == digest
    assert state(patch) == before
    probe.tactile_probe.azimuths[2] = 1.8
    assert not is_marked(patch)
    assert report_of(patch)["planes"][2][0] == pytest.approx(math.degrees(1.8))
    assert names(empty) == SET


@pytest.mark.parametrize("append", [True, False])
def test_a_probe_comes_to_another_file(empty, ball, tmp_path, capfd, append):
    pick(empty)
    path = str(tmp_path / "saved.blend")
    empty.ops.wm.save_as_mainfile(filepath=path)
    empty.ops.wm.read_homefile(use_empty=True)
    if append:  # its target comes with it into the scene; the patch is made here
        empty.ops.wm.append(directory=f"{path}/Object/", filename="Sphere Probe")
        update(empty)
        probe = empty.data.objects["Sphere Probe"]
        assert_touches(probe, *probe.children)
        probe.tactile_probe.extent = 0.5
        assert_touches(probe, *probe.children)
    else:  # it is linked with its target, and kept up to date in its own file
        with empty.data.libraries.load(path, link=True) as (_, into):
            into.objects = ["Sphere Probe"]
        empty.context.scene.collection.objects.link(empty.data.objects["Sphere Probe"])
        update(empty)
    assert names(empty) == (SET if append else ["Sphere", "Sphere Probe"])
    assert all(block.users for blocks in (empty.data.objects, empty.data.meshes) for block in blocks)
    assert "Traceback" not in capfd.readouterr().err


def test_undo_and_redo_bring_back_probe_and_patch_together(empty, ball):
    def seen():
        _, patch, probe = (empty.data.objects[name] for name in SET)
        settings = probe.tactile_probe
        return (
            settings.azimuths[1],
            settings.digest,
            probe.location[:],
            patch.matrix_basis.copy(),
            state(patch),
        )

    pick(empty)
    empty.ops.ed.undo_push(message="picked")
    states = [seen()]
    empty.data.objects["Sphere Probe"].tactile_probe.azimuths[1] = 0.7
    empty.ops.ed.undo_push(message="turned")
    states.append(seen())
    empty.data.objects["Sphere Probe"].location += Vector((0.2, 0.1, 0.0))
    update(empty)
    empty.ops.ed.undo_push(message="moved")
    states.append(seen())
    assert states[0][-1] != states[1][-1] != states[2][-1]
    for step, number in (("undo", 1), ("undo", 0), ("redo", 1), ("redo", 2), ("undo", 1)):
        getattr(empty.ops.ed, step)()
        for _ in range(2):
            assert seen() == states[number]
            empty.data.objects["Sphere"].update_tag()
            update(empty)
        assert names(empty) == SET


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"target": "Nobody", "new": True}, 'There is no object "Nobody"'),
        ({"target": "Flat", "new": True}, '"Flat" has no faces to touch'),
        ({"location": (0.0, float("nan"), 0.0)}, "coordinates that are not finite"),
        ({"location": (0.0, 0.0, 9.0), "new": True}, "The location is 7 m away"),
        ({"extent": 50.0}, 'The extent 50 m is longer than "Sphere"'),
        ({"azimuths": [0.0] * 6}, "run in the same direction"),
    ],
)
def test_a_failing_pick_gets_a_sentence_and_leaves_all_as_it_was(empty, ball, change, sentence):
    flat = empty.data.objects.new("Flat", empty.data.meshes.new("Flat"))
    empty.context.scene.collection.objects.link(flat)
    probe, patch = pick(empty)
    blocks, before, digest = datablocks(empty), state(patch), probe.tactile_probe.digest
    with pytest.raises(RuntimeError) as caught:
        empty.ops.tactile.pick(**({"target": "Sphere", "location": SIDE, "extent": 0.6} | change))
    assert str(caught.value).startswith("Error: ")
    assert sentence in str(caught.value)
    assert "Traceback" not in str(caught.value)
    update(empty)
    assert datablocks(empty) == blocks
    assert (state(patch), probe.tactile_probe.digest) == (before, digest)
    assert empty.context.object == probe


def test_the_suggested_planes_lower_the_deviation(empty, ball):
    probe, patch = pick(empty, noise=0.005, seed=1, step=0.05)
    for count in (4, 5, 6):
        old = report_of(patch)
        assert empty.ops.tactile.add_plane() == {"FINISHED"}
        new = report_of(patch)
        assert probe.tactile_probe.plane_count == len(new["planes"]) == count
        assert new["planes"][:-1] == old["planes"]
        assert new["planes"][-1] == pytest.approx([old["suggested_plane"]["azimuth"], 0.0], abs=1e-3)
        assert new["height_std"] < old["height_std"]
        assert (new["extent"], new["step"]) == pytest.approx((old["extent"], old["step"]), rel=1e-6)
    assert not empty.ops.tactile.add_plane.poll()


@pytest.mark.parametrize("plane", [4, 5])
def test_a_plane_that_is_not_there_is_not_removed(empty, ball, plane):
    probe, patch = pick(empty, plane_count=4)
    before, azimuths = report_of(patch), probe.tactile_probe.azimuths[:]
    with pytest.raises(RuntimeError, match="There are 4 planes, 0 to 3: choose one of them"):
        empty.ops.tactile.remove_plane(plane=plane)
    assert (report_of(patch), probe.tactile_probe.azimuths[:]) == (before, azimuths)
    assert probe.tactile_probe.plane_count == 4


def test_removing_a_plane_keeps_the_order_of_the_others(empty, ball):
    azimuths, tilts = [0.1, 0.7, 1.3, 1.9, 2.5, 0.0], [0.0, 0.1, 0.2, -0.1, -0.2, 0.0]
    _, patch = pick(empty, plane_count=5, azimuths=azimuths, tilts=tilts)
    for plane, left in ((1, [0, 2, 3, 4]), (3, [0, 2, 3])):
        assert empty.ops.tactile.remove_plane(plane=plane) == {"FINISHED"}
        wanted = np.column_stack([azimuths, tilts])[left]
        assert np.radians(report_of(patch)["planes"]) == pytest.approx(wanted, abs=1e-6)
    assert not empty.ops.tactile.remove_plane.poll()


@pytest.mark.parametrize("shown", ["gaussian_curvature", "mean_curvature", "deviation", "height_std"])
def test_the_colors_show_what_is_chosen_after_an_update_too(empty, ball, shown):
    probe, patch = pick(empty, noise=0.01)
    patch.tactile_colors = shown
    for extent in (0.6, 0.5):
        probe.tactile_probe.extent = extent
        limit, data = report_of(patch)["color_limit"], values(patch, shown, "value", 1)
        report = report_of(patch)
        bend = -report["k1"] - report["k1_std"]
        wanted = {
            "deviation": 3.0 * report["height_std"],
            "mean_curvature": bend,
            "gaussian_curvature": bend**2,
        }
        assert 0.99 < limit / wanted.get(shown, wanted["deviation"]) < 6.0
        rgba = values(patch, "curvature_color", "color", 4)
        red_over_blue = rgba[:, 0] - rgba[:, 2]
        assert np.all(red_over_blue[data > 0.1 * limit] > 0.0)
        assert np.all(red_over_blue[data < -0.1 * limit] < 0.0)
    assert patch.tactile_colors == shown


@pytest.mark.parametrize(
    ("system", "length", "scale", "size", "said"),
    [
        ("METRIC", "METERS", 1.0, 0.5, "0.0123 m, -4.2 1/m, 17.6 1/m²"),
        ("METRIC", "MILLIMETERS", 0.001, 8.0, "0.0123 mm, -4.2 1/mm, 17.6 1/mm²"),
        ("METRIC", "MILLIMETERS", 1.0, 8.0, "12.3 mm, -0.0042 1/mm, 0.0000176 1/mm²"),
        ("METRIC", "ADAPTIVE", 1.0, 0.02, "1.23 cm, -0.042 1/cm, 0.00176 1/cm²"),
        ("METRIC", "ADAPTIVE", 0.001, 8.0, "0.0123 mm, -4.2 1/mm, 17.6 1/mm²"),
        ("METRIC", "ADAPTIVE", 1.0, 1e-9, "1.23e+04 µm, -0.0000042 1/µm, 1.76e-11 1/µm²"),
        ("IMPERIAL", "INCHES", 1.0, 1.0, "0.484 in, -0.107 1/in, 0.0114 1/in²"),
        ("IMPERIAL", "ADAPTIVE", 1.0, 1.0, "0.0404 ft, -1.28 1/ft, 1.64 1/ft²"),
        ("NONE", "METERS", 0.001, 1.0, "0.0123, -4.2, 17.6"),
    ],
)
def test_lengths_are_said_in_the_unit_of_the_scene(empty, extension, system, length, scale, size, said):
    units, settings = extension.tactile_addon.touch.units, empty.context.scene.unit_settings
    settings.system, settings.scale_length = system, scale
    if system != "NONE":
        settings.length_unit = length
    unit = units.unit_of(empty.context.scene, size)
    assert ", ".join(units.say(*given, unit) for given in ((0.0123, 1), (-4.2, -1), (17.64, -2))) == said


@pytest.mark.parametrize(
    ("shown", "title", "low", "power"),
    [
        ("gaussian_curvature", "Gaussian Curvature (1/mm²)", -1.0, -2),
        ("mean_curvature", "Mean Curvature (1/mm)", -1.0, -1),
        ("deviation", "Deviation (mm)", -1.0, 1),
        ("height_std", "Standard Deviation (mm)", 0.0, 1),
    ],
)
def test_the_legend_has_the_range_of_the_colors_in_the_unit_of_the_scene(
    empty, extension, ball, shown, title, low, power
):
    addon, settings = extension.tactile_addon, empty.context.scene.unit_settings
    settings.system, settings.length_unit = "METRIC", "MILLIMETERS"
    _, patch = pick(empty)
    patch.tactile_colors = shown
    record, label = report_of(patch), patch.bl_rna.properties["tactile_colors"].enum_items[shown].name
    lowest = 0.0 if shown in addon.scene.patch_record.POSITIVE else -1.0
    power_of = addon.scene.patch_record.POWERS
    said, begin, labels = addon.viewport.overlay._scale(label, record, power_of[shown], lowest)
    assert (said, begin) == (title, low)
    top = record["color_limit"] * 1000.0**power
    assert [at for at, _ in labels] == [low, 0.5 * (low + 1.0), 1.0]
    assert [float(text) for _, text in labels] == pytest.approx(
        [low * top, 0.5 * (low + 1.0) * top, top], rel=5e-3
    )


def test_rendering_touches_nothing(empty, ball, tmp_path):
    ball.modifiers.new("Subdivision", "SUBSURF").levels = 0  # the render sees a finer mesh, of level 2
    probe, patch = pick(empty)
    scene, digest = empty.context.scene, probe.tactile_probe.digest
    scene.camera = empty.data.objects.new("Camera", empty.data.cameras.new("Camera"))
    scene.collection.objects.link(scene.camera)
    scene.render.engine, scene.cycles.samples = "CYCLES", 1
    scene.render.resolution_x = scene.render.resolution_y = 8
    scene.render.filepath = str(tmp_path / "render.png")
    mark(patch)
    assert empty.ops.render.render(write_still=True) == {"FINISHED"}
    assert (tmp_path / "render.png").exists()
    assert is_marked(patch)
    assert probe.tactile_probe.digest == digest


def test_disabling_takes_handler_and_properties_away_and_enabling_brings_them_back(empty, extension, ball):
    import addon_utils

    def seen():
        handlers = (empty.app.handlers.depsgraph_update_post, empty.app.handlers.blend_import_post)
        modules = [handler.__module__ for each in handlers for handler in each]
        there = [hasattr(empty.types.Object, name) for name in ("tactile_probe", "tactile_colors")]
        return [sum(module.startswith(extension.__name__) for module in modules), *there]

    assert seen() == [2, True, True]
    addon_utils.disable(extension.__name__)
    assert seen() == [0, False, False]
    addon_utils.enable(extension.__name__)
    assert seen() == [2, True, True]
    assert_touches(*pick(empty))


def test_an_instance_is_not_touched_for_what_it_shows(empty, ball, extension):
    touchable = extension.tactile_addon.viewport.mouse._require_touchable
    touchable(ball, ball.matrix_world.copy())
    with pytest.raises(ValueError, match=f'This is an instance of "{ball.name}": make it real'):
        touchable(ball, Matrix.Translation((5.0, 0.0, 0.0)))


@pytest.mark.parametrize("shape", ["uv_sphere", "monkey"])
@pytest.mark.parametrize("share", [0.02, 0.1])
def test_the_nearest_point_of_a_stretched_object_is_nearest_in_the_world(empty, extension, shape, share):
    getattr(empty.ops.mesh, f"primitive_{shape}_add")()
    obj = empty.context.object
    obj.modifiers.new("Subdivision", "SUBSURF").levels = 3
    obj.scale, obj.rotation_euler = (1.0, 2.0, 0.5), (0.3, 0.9, -0.5)
    update(empty)
    depsgraph = empty.context.evaluated_depsgraph_get()
    surface, mesh = (
        extension.tactile_addon.touch.surface.MeshSurface(obj, depsgraph),
        obj.evaluated_get(depsgraph).data,
    )
    world = [obj.matrix_world @ vertex.co for vertex in mesh.vertices]
    tree = BVHTree.FromPolygons(world, [face.vertices[:] for face in mesh.polygons])
    normals = obj.matrix_world.to_3x3().inverted().transposed()
    rng = np.random.default_rng(0)
    excess = []
    for i in rng.choice(len(world), 200, replace=False).tolist():
        off = (normals @ mesh.vertices[i].normal).normalized() * share * surface.size
        location = world[i] + (off if rng.random() < 0.5 else -off)
        point, _, distance = surface.project(list(location))
        nearest = tree.find_nearest(location)[3]
        excess.append(distance / nearest - 1.0)
        assert distance < 1.1 * nearest + 1e-3 * surface.size  # smaller distances are not refined
        assert distance == pytest.approx((location - Vector(point)).length, rel=1e-4, abs=1e-6)
    assert np.quantile(excess, 0.95) < 0.01


@pytest.fixture
def counted(extension, monkeypatch):
    """A function that counts the calls of a function of one of the modules, by its name."""
    calls = {}

    def count(module, name):
        found = operator.attrgetter(module)(extension.tactile_addon)
        function = getattr(found, name)

        def counting(*given, **named):
            calls[name] += 1
            return function(*given, **named)

        calls[name] = 0
        monkeypatch.setattr(found, name, counting)
        return calls

    return count


def test_where_there_is_no_probe_nothing_is_looked_at(empty, ball, counted):
    pick(empty)
    empty.ops.tactile.delete()
    update(empty)
    calls = counted("probes.change_handlers", "_concerned")
    for x in range(3):
        empty.ops.object.empty_add()
        empty.context.object.location.x = x
        ball.location.x = x
        update(empty)
    assert calls == {"_concerned": 0}
    pick(empty, target="Sphere", location=TOP + Vector((2, 0, 0)))
    assert calls["_concerned"] > 0


def test_what_no_probe_depends_on_costs_none_of_them_anything(empty, ball, counted):
    for turn in range(4):
        pick(empty, target="Sphere", location=Matrix.Rotation(turn, 3, "X") @ TOP)
    update(empty)
    counted("probes.change_handlers", "is_outdated"), counted("probes.change_handlers", "update")
    looked, calls = (
        counted("probes.touch_again", "_made"),
        counted("probes.change_handlers", "may_be_outdated"),
    )
    empty.ops.object.empty_add()  # with an object more, the handler checks that all targets are there
    assert (calls["is_outdated"], calls["update"]) == (0, 0)
    calls["may_be_outdated"] = looked["_made"] = 0
    other = empty.context.object
    for x in range(3):
        other.location.x = x
        update(empty)
    assert set(calls.values()) == {0}


def test_a_change_touches_once_what_depends_on_it_and_nothing_else(empty, ball, counted):
    probes = [
        pick(empty, target="Sphere", location=Matrix.Rotation(turn, 3, "X") @ TOP)[1] for turn in range(3)
    ]
    scenes.add_sphere(empty, segments=96, rings=48, radius=RADIUS, location=(9, 0, 0))
    pick(empty, location=TOP + Vector((9, 0, 0)))
    update(empty)
    calls, surfaces = counted("probes.touch_again", "touch_at"), counted("touch.surface", "size_of")
    ball.scale = (1.1, 1.1, 1.1)
    update(empty)
    assert calls["touch_at"] == 3
    assert [report_of(patch)["k1"] for patch in probes] == [pytest.approx(-1 / (1.1 * RADIUS), rel=0.03)] * 3
    calls["touch_at"] = surfaces["size_of"] = 0
    ball.data.transform(Matrix.Scale(1.05, 4))
    ball.data.update()
    update(empty)
    assert calls["touch_at"] == 3
    assert surfaces["size_of"] == 3  # a surface for each touch


def test_children_are_looked_up_once_for_all_probes(empty, extension, ball, monkeypatch):
    for turn in range(4):
        pick(empty, target="Sphere", location=Matrix.Rotation(turn, 3, "X") @ TOP)
    looked = []
    family = extension.tactile_addon.scene.family
    monkeypatch.setattr(
        empty.types.Object, "children", property(lambda obj: looked.append(obj.name) or []), raising=True
    )
    assert family.children_of(ball) == []
    assert looked == ["Sphere"]
    ball.scale = (1.1, 1.1, 1.1)
    update(empty)
    assert looked == ["Sphere"]


def test_a_handler_that_another_script_took_away_is_no_error(empty, extension, ball, capfd):
    import addon_utils

    for name in ("depsgraph_update_post", "blend_import_post", "load_post", "undo_post", "redo_post"):
        handlers = getattr(empty.app.handlers, name)
        handlers[:] = [each for each in handlers if not each.__module__.startswith(extension.__name__)]
    try:
        addon_utils.disable(extension.__name__)
    finally:
        addon_utils.enable(extension.__name__)
    assert "Traceback" not in "".join(capfd.readouterr())
    assert_touches(*pick(empty, target="Sphere"))
