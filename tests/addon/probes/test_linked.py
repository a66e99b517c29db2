# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Probes and patches of a library: grayed out and unchanged where they are linked, alive as overrides."""

import math

import pytest

pytest.importorskip("bpy", reason="needs Blender as a Python module: run make test")
from scenes import add_sphere

LIBRARY = 'Sphere Probe" comes from a library: make it local, or override it'
WRITERS = ("add_plane", "add_planes", "update", "delete", "verify", "register")


@pytest.fixture
def library(empty, tmp_path):
    """The path of a file whose probe, patch and target are linked into the open scene."""
    add_sphere(empty)
    empty.ops.tactile.pick(target="Sphere", location=(0.3, -0.2, 1.9), extent=0.6, plane_count=4)
    path = str(tmp_path / "library.blend")
    empty.ops.wm.save_as_mainfile(filepath=path)
    empty.ops.wm.read_homefile(use_empty=True)
    with empty.data.libraries.load(path, link=True) as (_, into):
        into.collections, into.objects = ["Tactile Patches"], ["Sphere"]
    scene = empty.context.scene
    scene.collection.children.link(empty.data.collections["Tactile Patches"])
    scene.collection.objects.link(empty.data.objects["Sphere"])
    empty.context.view_layer.update()
    return path


def refusal(operator, **arguments):
    with pytest.raises(RuntimeError) as caught:
        operator(**arguments)
    return str(caught.value)


@pytest.mark.parametrize("active", ["Sphere Probe", "Sphere Patch"])
@pytest.mark.parametrize("name", [*WRITERS, "remove_plane"])
def test_what_writes_is_gray_on_linked_data_and_says_why(empty, library, name, active):
    empty.context.view_layer.objects.active = empty.data.objects[active]
    there = sorted(obj.name for obj in empty.data.objects)
    before = empty.data.objects["Sphere Patch"]["tactile"].to_dict()
    assert not getattr(empty.ops.tactile, name).poll()
    assert LIBRARY in refusal(getattr(empty.ops.tactile, name))
    assert sorted(obj.name for obj in empty.data.objects) == there
    assert empty.data.objects["Sphere Patch"]["tactile"].to_dict() == before


def test_a_linked_probe_is_not_moved_but_another_may_be_picked_next_to_it(empty, library):
    linked = empty.data.objects["Sphere Probe"]
    empty.context.view_layer.objects.active = linked
    assert LIBRARY in refusal(empty.ops.tactile.pick, location=(1.9, 0.3, 0.4))
    assert empty.ops.tactile.pick(target="Sphere", location=(1.9, 0.3, 0.4), extent=0.5, new=True) == {
        "FINISHED"
    }
    made = empty.context.object
    assert made.is_editable
    assert made != linked
    (patch,) = made.children
    assert patch["tactile"]["k1"] == pytest.approx(-0.5, rel=0.03)
    assert all(c.is_editable for obj in (made, patch) for c in obj.users_collection)


def test_what_only_reads_works_on_linked_data(empty, library, tmp_path):
    empty.context.view_layer.objects.active = empty.data.objects["Sphere Probe"]
    assert empty.ops.tactile.export_contacts(filepath=str(tmp_path / "out.csv")) == {"FINISHED"}
    assert empty.ops.tactile.export_patch(filepath=str(tmp_path / "out.json")) == {"FINISHED"}


@pytest.mark.parametrize("whole", [True, False])
def test_the_override_of_a_probe_is_touched_with_its_own_numbers_and_keeps_them(
    empty, library, tmp_path, whole
):
    def own():
        probe = next(o for o in empty.data.objects if o.type == "EMPTY" and o.library is None)
        (patch,) = (child for child in probe.children if "tactile" in child)
        return probe, patch

    context = empty.context
    linked = empty.data.collections["Tactile Patches"]
    linked.override_hierarchy_create(context.scene, context.view_layer, do_fully_editable=whole)
    context.view_layer.update()
    probe, patch = own()
    assert probe.tactile_probe.message == ""
    probe.tactile_probe.azimuths[1] = 0.7
    assert patch["tactile"]["planes"][1][0] == pytest.approx(math.degrees(0.7))
    assert patch.data.is_editable
    context.view_layer.objects.active = probe
    for name in ("add_plane", "update", "verify"):
        assert getattr(empty.ops.tactile, name)() == {"FINISHED"}
    patch.tactile_colors = "mean_curvature"
    assert probe.tactile_probe.plane_count == len(patch["tactile"]["planes"]) == 5
    with empty.data.libraries.load(library, link=True) as (_, into):
        into.objects = ["Sphere Patch"]
    assert len(into.objects[0]["tactile"]["planes"]) == 4
    if whole:  # Blender does not save the changes of a system override
        path = str(tmp_path / "own.blend")
        empty.ops.wm.save_as_mainfile(filepath=path)
        empty.ops.wm.open_mainfile(filepath=path)
        empty.data.objects["Sphere"].update_tag()
        empty.context.view_layer.update()
        probe, patch = own()
        assert probe.tactile_probe.azimuths[1] == pytest.approx(0.7)
        assert len(patch["tactile"]["planes"]) == 5


class Layout:
    """What is drawn into it: the names of properties, and their texts."""

    def __init__(self):
        self.rows = []

    def prop(self, _, name, text=None):
        self.rows.append((name, text))


def test_an_automatic_number_of_an_override_is_the_one_in_use_and_another_may_be_given(
    empty, extension, library
):
    settings = extension.tactile_addon.touch.settings

    def rows(name):
        layout = Layout()
        settings.draw_chosen(layout, probe.tactile_probe, name)
        return layout.rows

    linked = empty.data.collections["Tactile Patches"]
    linked.override_hierarchy_create(empty.context.scene, empty.context.view_layer, do_fully_editable=True)
    probe = next(o for o in empty.data.objects if o.type == "EMPTY" and o.library is None)
    assert rows("extent") == [("extent", None)]  # It was given.
    assert rows("step") == [("used_step", "Step (Auto)"), ("step", None)]
    assert probe.tactile_probe.used_step > 0.0
    assert not probe.tactile_probe.is_property_overridable_library("used_step")
    assert probe.tactile_probe.is_property_overridable_library("step")
    probe.tactile_probe.step = 0.1
    assert rows("step") == [("step", None)]


def test_the_colors_of_a_linked_patch_stay(empty, library):
    patch = empty.data.objects["Sphere Patch"]
    limit = patch["tactile"]["color_limit"]
    patch.tactile_colors = "mean_curvature"
    assert patch["tactile"]["color_limit"] == limit


@pytest.fixture
def linked(empty, tmp_path):
    """A ball of a library, linked into the open scene."""
    add_sphere(empty)
    path = str(tmp_path / "ball.blend")
    empty.ops.wm.save_as_mainfile(filepath=path)
    empty.ops.wm.read_homefile(use_empty=True)
    with empty.data.libraries.load(path, link=True) as (_, into):
        into.objects = ["Sphere"]
    empty.context.scene.collection.objects.link(into.objects[0])
    empty.context.view_layer.update()
    return into.objects[0]


def is_content(probe):
    (patch,) = (child for child in probe.children if "tactile" in child)
    return (patch["tactile"]["status"], probe.tactile_probe.message) == ("ok", "")


@pytest.mark.parametrize("live", [True, False])
def test_a_probe_goes_with_the_override_that_takes_the_place_of_its_target(empty, linked, live):
    empty.ops.tactile.pick(target="Sphere", location=(0.3, -0.2, 1.9), extent=0.6)
    probe, objects = empty.context.object, empty.context.scene.collection.objects
    probe.tactile_probe.live = live
    own = linked.override_create()
    objects.link(own)
    objects.unlink(linked)
    empty.context.view_layer.update()
    assert (probe.tactile_probe.target, probe.parent) == (own, own)
    assert is_content(probe)
    own.location.x += 1.0
    empty.context.view_layer.update()
    assert probe.matrix_world.translation.x == pytest.approx(1.31, abs=0.01)
    assert is_content(probe)


def test_a_probe_on_an_override_is_not_confused_by_the_object_it_is_of(empty, linked):
    own = linked.override_create()
    empty.context.scene.collection.objects.link(own)
    empty.context.view_layer.update()
    assert own.name == linked.name
    empty.ops.tactile.pick(target="Sphere", location=(0.3, -0.2, 1.9), extent=0.6)
    probe = empty.context.object
    for target in (own, linked):
        probe.tactile_probe.target = target
        empty.context.view_layer.update()
        assert is_content(probe), probe.tactile_probe.message
