# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Patches that were edited by hand or script, and numbers that Blender's single precision cannot hold."""

import numpy as np
import pytest

pytest.importorskip("bpy", reason="needs Blender as a Python module: run make test")

EDITED = "was edited and is no longer a complete patch: touch again"
EDITS = [
    lambda patch: patch.data.clear_geometry(),
    lambda patch: patch.data.attributes.remove(patch.data.attributes["deviation"]),
    lambda patch: patch.__setitem__("tactile", 7),
    lambda patch: patch.__setitem__("tactile", "words"),
    lambda patch: patch["tactile"].__setitem__("radius", 0.0),
    lambda patch: patch["tactile"].__setitem__("radius", float("nan")),
    lambda patch: patch["tactile"].__delitem__("frame"),
    lambda patch: patch["tactile"].__setitem__("source", 3),
]
IDS = ["geometry", "attribute", "number", "words", "radius", "nan", "frame", "source"]


@pytest.fixture
def probe(empty, ball):
    empty.ops.tactile.pick(target="Sphere", location=(0.3, -0.2, 1.9), extent=0.6)
    return empty.context.object


@pytest.mark.parametrize("edit", EDITS, ids=IDS)
def test_an_edited_patch_is_a_sentence_everywhere_and_is_touched_again(empty, probe, tmp_path, capfd, edit):
    (patch,) = probe.children
    edit(patch)
    kept = patch["tactile"].to_dict() if hasattr(patch["tactile"], "to_dict") else patch["tactile"]
    for operator, path in (
        (empty.ops.tactile.verify, {"target": "Sphere"}),
        (empty.ops.tactile.export_contacts, {"filepath": str(tmp_path / "out.csv")}),
        (empty.ops.tactile.export_patch, {"filepath": str(tmp_path / "out.json")}),
    ):
        with pytest.raises(RuntimeError) as caught:
            operator(**path)
        assert EDITED in str(caught.value) or "does not say what it was fitted to" in str(caught.value)
        assert "Traceback" not in str(caught.value)
    assert list(tmp_path.iterdir()) == []
    patch.tactile_colors = "mean_curvature"
    found = patch["tactile"].to_dict() if hasattr(patch["tactile"], "to_dict") else patch["tactile"]
    assert repr(found) == repr(kept)
    probe.tactile_probe.extent = 0.5  # a handler answers this with another touch
    assert probe.tactile_probe.message == ""
    assert patch["tactile"]["extent"] == 0.5
    assert empty.ops.tactile.verify() == {"FINISHED"}
    edit(patch)
    probe.location = (0.0, 0.0, 9.0)  # no surface is near, so no patch is made
    empty.context.view_layer.update()
    assert "The location is" in probe.tactile_probe.message
    probe.location = (0.3, -0.2, 1.9)
    assert empty.ops.tactile.update() == {"FINISHED"}
    assert patch["tactile"]["status"] == "ok"
    assert "Traceback" not in "".join(capfd.readouterr())


def sphere(radius, center=0.0):
    rows, s = [], np.linspace(-0.5, 0.5, 25)
    for number, angle in enumerate((0.0, 1.0, 2.0)):
        for x, z in zip(np.sin(s), np.cos(s) - 1.0, strict=True):
            p = radius * np.array([x * np.cos(angle), x * np.sin(angle), z]) + center
            rows.append(",".join(map(repr, [number, *p.tolist()])))
    return "curve,x,y,z\n" + "\n".join(rows)


@pytest.mark.parametrize("radius", [1e40, 1e16, 1e-16, 1e-30])
def test_what_single_precision_does_not_hold_is_refused(empty, tmp_path, radius):
    (tmp_path / "contacts.csv").write_text(sphere(radius))
    before = [list(kind) for kind in (empty.data.objects, empty.data.meshes, empty.data.materials)]
    with pytest.raises(RuntimeError, match="and Blender's numbers range from 1e-15 to 1e"):
        empty.ops.tactile.import_contacts(filepath=str(tmp_path / "contacts.csv"))
    assert [list(kind) for kind in (empty.data.objects, empty.data.meshes, empty.data.materials)] == before


@pytest.mark.parametrize("radius", [1e14, 1e-14])
def test_what_it_holds_has_finite_numbers_only(empty, tmp_path, radius):
    (tmp_path / "contacts.csv").write_text(sphere(radius))
    assert empty.ops.tactile.import_contacts(filepath=str(tmp_path / "contacts.csv")) == {"FINISHED"}
    patch = empty.context.object
    for attribute in patch.data.attributes:
        key = {"FLOAT": "value", "FLOAT_VECTOR": "vector", "FLOAT_COLOR": "color"}.get(attribute.data_type)
        if key is not None:
            width = {"value": 1, "vector": 3, "color": 4}[key]
            found = np.empty(width * len(attribute.data), dtype=np.float32)
            attribute.data.foreach_get(key, found)
            assert np.isfinite(found).all(), attribute.name


def test_what_was_converted_is_no_patch_and_the_probe_makes_a_new_one(empty, extension, probe, capfd):
    (patch,) = probe.children
    empty.context.view_layer.objects.active = patch
    for obj in empty.context.selected_objects:
        obj.select_set(False)
    patch.select_set(True)
    empty.ops.object.convert(target="CURVE")
    with pytest.raises(ValueError, match="Wanted a patch or its probe"):
        extension.reconstruction_of(patch)
    probe.location = (0.4, -0.2, 1.9)
    empty.context.view_layer.update()
    assert extension.reconstruction_of(probe).status == "ok"
    assert "Traceback" not in capfd.readouterr().err


def test_a_patch_that_is_being_edited_is_not_touched_again(empty, extension, probe):
    (patch,) = probe.children
    empty.context.view_layer.objects.active = patch
    empty.ops.object.mode_set(mode="EDIT")
    count = len(patch.data.polygons)
    assert not empty.ops.tactile.update.poll()
    with pytest.raises(ValueError, match="is being edited: leave its Edit Mode first"):
        extension.tactile_addon.probes.probe.require_unlocked(probe)
    empty.ops.object.mode_set(mode="OBJECT")
    assert len(patch.data.polygons) == count
    assert empty.ops.tactile.update() == {"FINISHED"}


def test_colors_of_another_domain_are_no_patchs(empty, probe):
    (patch,) = probe.children
    mesh = patch.data
    mesh.attributes.remove(mesh.attributes["curvature_color"])
    mesh.attributes.new("curvature_color", "FLOAT_COLOR", "CORNER")
    with pytest.raises(RuntimeError, match=EDITED):
        empty.ops.tactile.verify(target="Sphere")
    probe.tactile_probe.extent = 0.5
    assert empty.ops.tactile.verify() == {"FINISHED"}
