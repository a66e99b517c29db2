# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What users of Blender expect of extensions: tooltips, reasons, units, a manual, a tab of their choice."""

import re
import tomllib
from pathlib import Path
from urllib.parse import unquote, urlsplit

import pytest

pytest.importorskip("bpy", reason="needs Blender as a Python module: run make test")


def interfaces(bpy):
    """The RNA of all operators, and of what a probe has, with the properties in them."""
    found = [getattr(bpy.ops.tactile, name).get_rna_type() for name in dir(bpy.ops.tactile)]
    found.append(bpy.context.object.tactile_probe.bl_rna)
    for rna in found:
        own = [p for p in rna.properties if p.identifier not in ("rna_type", "name") and not p.is_hidden]
        yield rna, own
    yield (
        None,
        [bpy.types.Object.bl_rna.properties[name] for name in ("tactile_colors", "tactile_map_colors")],
    )


def test_all_has_a_tooltip_of_one_sentence_without_a_full_stop(empty):
    empty.ops.mesh.primitive_cube_add()
    seen = 0
    for rna, properties in interfaces(empty):
        internal = rna is not None and rna.identifier == "TACTILE_OT_drag"  # only the handles call it
        for thing in [*filter(None, [rna]), *([] if internal else properties)]:
            if thing is not rna or "_OT_" in rna.identifier:
                seen += 1
                assert re.search(r"\w", thing.description), thing.identifier
                assert not thing.description.endswith("."), thing.description
    assert seen > 80


def test_lengths_and_angles_know_their_units(empty):
    empty.ops.mesh.primitive_cube_add()
    for _, properties in interfaces(empty):
        for known in properties:
            if known.identifier in ("extent", "step", "noise", "spacing", "radius"):
                assert (known.subtype, known.unit) == ("DISTANCE", "LENGTH"), known.identifier
            if known.identifier in ("azimuths", "tilts"):
                assert known.unit == "ROTATION"


def test_no_dialog_has_more_than_five_fields(extension):
    addon = extension.tactile_addon
    operators = (
        addon.whole_object.object_operators.TACTILE_OT_touch_all_over,
        addon.whole_object.object_operators.TACTILE_OT_mesh_again,
        addon.whole_object.object_operators.TACTILE_OT_continue_touching,
        addon.stability_map.map_object.TACTILE_OT_stability_map,
    )
    assert max(len(operator.shown) for operator in operators) <= 5


def test_what_cannot_run_says_why(empty):
    def refused(name):
        with pytest.raises(RuntimeError) as caught:
            getattr(empty.ops.tactile, name)()
        return str(caught.value).partition(".poll() ")[2]

    for obj in list(empty.data.objects):
        empty.data.objects.remove(obj)
    said = "There is no mesh to touch: add one (Shift A), or import a scan (File > Import)"
    assert refused("pick") == said
    empty.ops.object.text_add()
    assert refused("pick") == "Convert the text to a mesh (Object > Convert)"
    empty.ops.object.delete()
    assert refused("pick") == said
    on_probes = ("add_plane", "add_planes", "remove_plane", "update", "delete")
    assert {refused(name) for name in on_probes} == {"Select a probe, or pick a reference point first"}
    for name in ("verify", "register", "export_contacts", "export_patch"):
        assert refused(name).startswith("Select a ")
    empty.ops.mesh.primitive_uv_sphere_add(segments=64, ring_count=32)
    empty.ops.tactile.pick(location=(0.0, 0.0, 1.0), plane_count=6)
    assert refused("add_plane") == "A patch has six planes at most: remove one first"
    for _ in range(3):
        empty.ops.tactile.remove_plane()
    assert refused("remove_plane") == "A patch needs three planes"
    empty.context.view_layer.objects.active = empty.data.objects["Sphere"]
    empty.ops.object.mode_set(mode="EDIT")
    assert refused("pick") == "Points are picked in Object Mode: leave this mode first"
    window = empty.context.window_manager.windows[0]
    view = next(area for area in window.screen.areas if area.type == "VIEW_3D")
    with empty.context.temp_override(window=window, area=view):
        assert refused("reconstruct") == "Patches are fitted in Object Mode: leave this mode first"
        assert refused("import_contacts") == "Contacts are imported in Object Mode: leave this mode first"
    empty.ops.object.mode_set(mode="OBJECT")
    empty.ops.object.camera_add()
    with empty.context.temp_override(window=window, area=view):
        assert refused("reconstruct") == "Select the mesh object to touch"


def test_the_manifest_names_whose_work_ships_and_what_it_is_for(extension, empty):
    text = (Path(extension.__file__).parent / "blender_manifest.toml").read_text(encoding="utf-8")
    manifest = tomllib.loads(text)
    assert "2003 SciPy Developers" in manifest["copyright"]  # scipy is in the wheels
    assert "Import-Export" in manifest["tags"]


def test_online_manual_opens_the_page_that_comes_along_at_the_place(extension, empty):
    prefix, pages = extension.tactile_addon.sidebar.preferences.manual_map()
    folder = Path(unquote(urlsplit(prefix).path))
    for _, page in pages:
        assert "#" not in page  # Windows would drop it
        lead = (folder / page).read_text(encoding="utf-8")
        ((name, section),) = re.findall(r"url=(\w+\.html)#(.+?)\"", lead)
        manual = (folder / name).read_text(encoding="utf-8")
        assert f'id="{section}"' in manual
        for picture in re.findall(r'src="([^"]+)"', manual):
            assert (folder / picture).is_file()
        # The license of the scan is beside its picture.
        assert "verify.jpg" not in manual or "CC BY 4.0" in manual
    assert (prefix, pages) in list(empty.utils.manual_map())


def test_the_tab_is_where_the_preferences_have_it(extension, empty):
    sidebar = extension.tactile_addon.sidebar
    names = [each.__name__ for each in sidebar.panel.PANELS]
    preferences = empty.context.preferences.addons[extension.__name__].preferences

    def tabs():
        return {getattr(empty.types, name).bl_category for name in names}

    assert tabs() == {"Tactile"}
    preferences.tab = "Edit"
    assert tabs() == {"Edit"}
    sidebar.preferences.restore_tab()
    assert tabs() == {"Edit"}
    preferences.tab = ""
    assert tabs() == {"Tactile"}
    preferences.tab = "Tactile"


def test_each_operator_that_a_panel_or_a_menu_names_is_registered(extension, empty):
    folder = Path(extension.tactile_addon.__file__).parent
    sources = [path.read_text(encoding="utf-8") for path in folder.rglob("*.py")]
    names = {name for source in sources for name in re.findall(r'"tactile\.(\w+)"', source)}
    assert {"pick", "delete", "touch_all_over"} <= names
    assert names <= {*dir(empty.ops.tactile), "tool"}  # The last is a tool.
