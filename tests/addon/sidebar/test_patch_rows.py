# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What the sidebar says: a verdict first, found values, and what each row means."""

import re
from types import SimpleNamespace

import pytest

pytest.importorskip("bpy", reason="needs Blender as a Python module: run make test")
UNIT = ("mm", 1.0)


@pytest.fixture
def millimeters(empty):
    """A scene with numbers in millimeters, which it shows."""
    settings = empty.context.scene.unit_settings
    settings.scale_length, settings.length_unit = 0.001, "MILLIMETERS"
    return empty


@pytest.fixture
def wording(extension, millimeters):
    return extension.tactile_addon.touch.wording


@pytest.fixture
def ball(empty, millimeters):
    """The probe of a ball of radius 1, and its report."""
    empty.ops.mesh.primitive_uv_sphere_add(segments=64, ring_count=32)
    empty.ops.tactile.pick(location=(0.3, 0.2, 1.0))
    (patch,) = empty.context.object.children
    return empty.context.object, patch["tactile"].to_dict()


def record(status="ok", message="The patch describes its contacts.", **more):
    base = {"status": status, "message": message, "doubts": [], "height_std": 0.0123, "radius": 1.0}
    return base | {"k1": -2.0, "k1_std": 0.3, "k2": 0.0, "k2_std": 0.01} | more


def test_all_lengths_of_one_object_have_one_unit_without_an_exponent_where_zeros_are_few(extension):
    say = extension.tactile_addon.touch.units.say
    lengths = (3.04e-4, 4.006e-5, 3.99e-5, -1.2345e-6, 9.9996e-5)
    words = ["0.000304 m", "0.0000401 m", "0.0000399 m", "-0.00000123 m", "0.0001 m"]
    assert [say(value, 1, ("m", 1.0)) for value in lengths] == words
    assert say(-8.52e-8, 1, ("m", 1e-3)) == "-0.0000852 m"  # A unit of the world is a kilometer.
    assert say(8.52e-5, 1, ("", 1.0)) == "0.0000852"
    assert say(3e-9, 1, ("m", 1.0)) == "3e-09 m"
    assert say(0.0, 1, ("m", 1.0)) == "0 m"
    assert say(8.52e-5, -1, ("m", 1.0)) == "0.0000852 1/m"


def test_a_number_has_no_digit_beyond_the_first_one_of_its_deviation(extension, wording):
    units = extension.tactile_addon.touch.units
    assert units.say(-0.00303, -1, UNIT, 0.0203) == "0.00 ± 0.02 1/mm"
    assert units.say(0.0109, -1, UNIT, 0.0098) == "0.01 ± 0.01 1/mm"
    assert units.say(-1.7481, -1, UNIT, 0.0302) == "-1.75 ± 0.03 1/mm"
    assert units.say(-0.4, -1, UNIT, 0.01) == "-0.40 ± 0.01 1/mm"
    assert units.say(1234.5, -1, UNIT, 2.0) == "1234 ± 2 1/mm"
    assert units.say(1.2345e6, -1, UNIT, 2e4) == "1230000 ± 20000 1/mm"
    assert units.say(1.2345e8, -1, UNIT, 2e6) == "1.23e+08 ± 2e+06 1/mm"
    assert units.say(437.2, 1, UNIT, 12.0) == "440 ± 10 mm"
    assert units.say(0.123456, 1, UNIT, 1e-9) == "0.123 ± 1e-09 mm"
    assert units.say(0.125, 1, UNIT, 0.0) == "0.125 ± 0 mm"
    assert units.say(-2.03e-3, -1, UNIT, 4e-5) == "-0.00203 ± 0.00004 1/mm"
    assert units.say(3.34e-7, -1, UNIT, 7e-4) == "0.0000 ± 0.0007 1/mm"
    assert units.say(-0.002, -1, UNIT, 7e-4) == "-0.0020 ± 0.0007 1/mm"
    flat = {"k1": 2e-40, "k2": -1e-7, "k1_std": 0.01, "k2_std": 0.01, "radius": 1.0}
    assert wording.curvatures(flat) == "0 and 0 1/mm"


@pytest.mark.parametrize(
    ("more", "is_uncertain"),
    [
        ({}, False),
        ({"k2_std": 0.2}, True),
        ({"k1_std": 2.1}, True),
        ({"k1_std": 1.9}, False),
        ({"k2_std": 0.09}, False),  # It is known to be about flat.
        ({"k2_std": 0.09, "radius": 2.0}, True),
        ({"k1_std": float("inf")}, True),
    ],
)
def test_a_good_verdict_says_where_curvatures_are_uncertain(wording, more, is_uncertain):
    said = wording.verdict(record(**more))
    good = "Good: heights to ± 0.0123 mm"
    assert said == ("Good heights, to ± 0.0123 mm; curvatures are uncertain" if is_uncertain else good)
    assert (wording.curvatures(record(**more)) == "not certain") is is_uncertain


def test_a_good_verdict_on_facets_says_what_shows_curvatures(wording):
    assert wording.verdict(record(facet_std=0.1)).startswith("Good: heights")
    assert "facets" not in wording.verdict(record(facet_std=0.1, k2_std=0.2))  # Facets make a quarter of it.
    words = wording.verdict(record(facet_std=0.15, k2_std=0.2))
    assert words == "Good on facets: subdivide the mesh if the shape is smooth"


def test_a_patch_in_a_facet_of_a_coarse_mesh_is_not_shown_for_its_shape(extension, wording, empty):
    empty.ops.mesh.primitive_monkey_add()
    facet = empty.context.object.data.polygons[300]
    place, width = facet.center.copy(), facet.area**0.5
    empty.ops.tactile.pick(location=place)  # A patch of a hundredth of this facet is flat, and sure.
    obj = empty.context.object
    report = obj.children[0]["tactile"].to_dict()
    assert report["extent"] > width and extension.core.SUBDIVIDE in wording.verdict(report)
    assert dict(drawn_of(empty, extension, obj))["tactile.add_subdivision"]
    obj.tactile_probe.extent = 0.01 * width
    report = obj.children[0]["tactile"].to_dict()
    assert report["status"] == "ok" and wording.verdict(report).startswith("Good on facets")


def test_a_flat_patch_has_no_shape_index(wording, empty):
    empty.ops.mesh.primitive_cube_add()
    empty.ops.tactile.pick(target="Cube", location=(0.2, 0.1, 1.0))
    (patch,) = empty.context.object.children
    assert dict(wording.other_rows(patch["tactile"].to_dict()))["Shape Index"] == "–"


def test_the_verdict_says_good_and_how_good(wording):
    assert wording.verdict(record()) == "Good: heights to ± 0.0123 mm"
    blind = record(
        message="The patch describes its contacts. These planes cannot show 3 of the 28 ways to bend."
    )
    assert wording.verdict(blind) == "Good: heights to ± 0.0123 mm"


def test_the_reasons_say_what_limits_a_good_patch(wording, empty):
    empty.ops.mesh.primitive_cube_add()
    empty.ops.tactile.pick(target="Cube", location=(0.9, 0.2, 1.0), extent=0.5)
    (patch,) = empty.context.object.children
    words = wording.verdict(patch["tactile"].to_dict())
    assert words.startswith("Good: heights to ± ")
    (reason,) = wording.reasons(patch["tactile"].to_dict())
    assert reason.endswith(" 3 of 6 half curves ended at a crease, before the extent.")


def test_the_deviation_at_the_rim_stands_below_the_mean(wording, ball):
    rows = dict(wording.other_rows(ball[1]))
    mean, rim = (float(rows[key].split()[1]) for key in ("Height", "At the Rim"))
    assert 1.5 < rim / mean < 10.0
    assert dict(wording.other_rows({**ball[1], "height_std_rim": 0.04}))["At the Rim"] == "± 0.04 mm"


@pytest.mark.parametrize("status", ["uncertain", "not_converged"])
def test_the_verdict_says_what_to_do_where_there_is_doubt(wording, status):
    message = (
        "Heights are accurate to 5.3 % of the radius on average: use a shorter extent or add sampling planes."
        " These planes cannot show 3 of the 28 ways to bend. All half curves end at a crease."
    )
    advice = {"heights": "use a shorter extent or add sampling planes", "gap": "add sampling planes"}
    doubts = [{"code": code, "sentence": f"The {code}", "advice": words} for code, words in advice.items()]
    found = record(status, message, doubts=doubts)
    assert wording.verdict(found) == "Doubtful: use a shorter extent or add sampling planes"
    assert wording.reasons(found) == [message, "The gap: add sampling planes."]


def test_the_verdict_on_an_earlier_patch_is_none(wording):
    assert wording.verdict(record("outdated")) == "Outdated: touch again"


def test_rows_are_distinguished_by_how_they_begin(wording, ball):
    _, report = ball
    rows = wording.main_rows(report) + wording.other_rows(report)
    labels = [label for label, value in rows if value]  # a heading has no value
    assert len({label[:5] for label in labels}) == len(labels) == len(set(labels))
    assert max(map(len, labels)) <= 11


def test_every_row_says_what_it_is(wording, extension, ball):
    _, report = ball
    addon = extension.tactile_addon
    rows = wording.main_rows(report) + wording.other_rows(report) + wording.plane_rows(report)
    labels = [label for label, value in rows if value] + [
        "Error on 9 More Curves",
        "Total Curvature",
        "Expected Accuracy with It",
    ]
    assert not [
        label for label in labels if not re.match(r"[A-Z1\d].{15,}", addon.sidebar.rows.tip_of(label))
    ]
    assert addon.sidebar.rows.tip_of("Error on 9 More Curves") != addon.sidebar.rows.tip_of("Fit Error")


@pytest.mark.long
@pytest.mark.parametrize("scale", [(2.0, 2.0, 2.0), (8.0, 1.0, 1.0)])
def test_a_map_knows_about_how_many_points_it_will_touch(extension, empty, scale):
    empty.ops.mesh.primitive_uv_sphere_add(segments=128, ring_count=64)
    empty.context.object.scale = scale
    planes = [extension.core.SamplingPlane(azimuth) for azimuth in (0.0, 1.0, 2.0)]
    touches = extension.tactile_addon.stability_map.stability.StabilityMap(
        empty.context.object,
        empty.context.evaluated_depsgraph_get(),
        planes,
        spacing=0.5,
        **{"extent": 0.0, "step": 0.0, "noise": 0.0, "seed": 0},
        **{"method": "bayes", "degree": "auto", "weight": None, "solver": "fast"},
    )
    empty.ops.tactile.stability_map(spacing=0.5)
    points = empty.context.object["tactile_map"]["points"]
    assert touches.expected_count() == pytest.approx(points, rel=0.1)


def test_lengths_in_messages_are_in_the_unit_of_the_scene(extension, empty):
    empty.ops.mesh.primitive_cube_add(size=0.05)
    empty.context.scene.unit_settings.length_unit = "MILLIMETERS"
    with pytest.raises(RuntimeError, match=r'The extent 200 mm is longer than "Cube" \(50 mm\)'):
        empty.ops.tactile.pick(target="Cube", location=(0.0, 0.0, 0.025), extent=0.2)
    with pytest.raises(RuntimeError, match=r"got nan mm, 0 mm and 0 mm"):
        empty.ops.tactile.pick(target="Cube", location=(0.0, 0.0, 0.025), extent=float("nan"))


def test_panels_have_the_scene_s_unit_unless_numbers_in_it_would_be_long(extension, empty):
    units, scene = extension.tactile_addon.touch.units, empty.context.scene
    assert scene.unit_settings.length_unit == "METERS"
    assert [units.unit_of(scene, size)[0] for size in (5.0, 0.05, 0.012, 0.005)] == ["m", "cm", "cm", "mm"]
    record = {"radius": 0.01, "size": 0.2, "tolerance": 2e-4, "height_std": 1e-5, "color_limit": 48.0}
    assert extension.tactile_addon.touch.units.unit_of_report(record)[0] == "cm"
    empty.ops.mesh.primitive_cube_add()
    empty.context.object["tactile_object"] = record
    for shown in ("mean_curvature", "deviation"):  # One object has one unit, whatever is shown.
        empty.context.object.tactile_colors = shown
        assert extension.tactile_addon.scene.shown.unit_of_range(empty.context.object)[1][0] == "cm"
    record["color_limit"] = 48.0
    empty.context.object["tactile_object"] = record
    empty.context.object.tactile_colors = "mean_curvature"
    assert empty.context.object.tactile_range == pytest.approx(0.48)


class Layout:
    """Keeps what a panel draws in `drawn`, as (text, whether it is not gray); its parts share the list."""

    def __init__(self, whole=None):
        self.drawn, self.whole = [] if whole is None else whole.drawn, whole
        self.active = self.enabled = True

    @property
    def is_gray(self):
        return not (self.active and self.enabled) or (self.whole is not None and self.whole.is_gray)

    def part(self, *_, **__):
        return Layout(self)

    row = column = split = box = part

    def label(self, *, text="", **_):
        self.drawn.append((text, not self.is_gray))

    def panel(self, *_, **__):
        return self.part(), self.part()

    def operator(self, name, *_, text="", **__):
        self.drawn.append((text or name, not self.is_gray))
        return SimpleNamespace()

    def prop(self, *_, **__):
        pass

    prop_search = prop


@pytest.mark.parametrize(
    "width, line", [(250, ["K", "", "0.00312 ± 0.002 1/mm²"]), (300, ["K", "0.00312 ± 0.002 1/mm²"])]
)
def test_a_value_that_has_no_room_next_to_its_label_stands_below_it(extension, width, line):
    context = SimpleNamespace(
        preferences=SimpleNamespace(system=SimpleNamespace(ui_scale=1.0)), region=SimpleNamespace(width=width)
    )
    layout, rows = Layout(), [("Shape Index", "0.57"), ("K", "0.00312 ± 0.002 1/mm²")]
    extension.tactile_addon.sidebar.rows.draw_rows(context, layout, rows)
    assert [text for text, _ in layout.drawn] == ["Shape Index", "0.57", *line]


@pytest.mark.parametrize(
    ("sentence", "lines"),
    [
        ("Good: heights to ± 1 mm", ["Good", "heights to ± 1 mm"]),
        ("Doubtful: add a Subdivision modifier if so", ["Doubtful: add a Subdivision", "modifier if so"]),
        ("Doubtful: " + 20 * "word ", ["Doubtful: word word word word", "word word word word word …"]),
    ],
)
def test_a_verdict_has_two_lines_of_which_none_is_empty(extension, sentence, lines):
    context = SimpleNamespace(
        preferences=SimpleNamespace(system=SimpleNamespace(ui_scale=1.0)), region=SimpleNamespace(width=250)
    )
    layout = Layout()
    extension.tactile_addon.sidebar.rows.draw_sentence(context, layout, sentence, "INFO", in_two=True)
    assert [text for text, _ in layout.drawn] == lines


def test_the_button_that_helps_is_below_the_curvatures(extension, empty):
    empty.ops.mesh.primitive_ico_sphere_add(subdivisions=2)
    empty.ops.tactile.pick(location=(0.6, -0.6, 0.6))
    record = empty.context.object.children[0]["tactile"]
    assert {doubt["code"] for doubt in record["doubts"]} & {"facets", "folds"}
    names = [text for text, _ in drawn_of(empty, extension, empty.context.object)]
    assert names.index("κ2") < names.index("tactile.add_subdivision")


def test_the_advice_alone_says_whether_the_button_helps(extension, empty, ball):
    obj, record = empty.context.object, empty.context.object.children[0]["tactile"]
    for advice, helps in (("use a shorter extent", False), (extension.core.SUBDIVIDE, True)):
        record["doubts"] = [{"code": "folds", "sentence": "The surface turns", "advice": advice}]
        assert dict(drawn_of(empty, extension, obj))["tactile.add_subdivision"] is helps


def drawn_of(bpy, extension, obj):
    """What the panel of the result draws of an object: (text, whether it is not gray)."""
    context = SimpleNamespace(
        view_layer=bpy.context.view_layer,
        scene=bpy.context.scene,
        preferences=SimpleNamespace(system=SimpleNamespace(ui_scale=1.0)),
        region=SimpleNamespace(width=300),
        space_data=SimpleNamespace(shading=SimpleNamespace(type="MATERIAL")),
    )
    layout = Layout()
    extension.tactile_addon.sidebar.panel.TACTILE_PT_result.draw_active(None, context, layout, obj)
    return layout.drawn


def test_what_a_registration_has_found_stays_in_the_panel(extension, empty):
    empty.ops.mesh.primitive_monkey_add()
    empty.context.object.modifiers.new("Subdivision", "SUBSURF").levels = 3
    empty.context.view_layer.update()
    place = {"location": (0.0, -0.7, 0.5), "extent": 0.4}
    assert empty.ops.tactile.reconstruct(target="Suzanne", **place) == {"FINISHED"}
    patch = empty.context.object
    assert not any("root mean square" in text for text, _ in drawn_of(empty, extension, patch))
    patch.location.x += 3.0
    empty.context.view_layer.update()
    assert empty.ops.tactile.register(target="Suzanne") == {"FINISHED"}
    words = " ".join(text for text, _ in drawn_of(empty, extension, patch))
    assert '"Suzanne" (root mean square)' in words


def test_the_numbers_of_an_earlier_touch_are_gray(extension, empty, ball):
    probe, _ = ball
    assert empty.ops.tactile.verify() == {"FINISHED"}
    probe.tactile_probe.live = False

    def drawn():
        return drawn_of(empty, extension, probe)

    numbers = ("κ1", "κ2", "Height", "Curvedness", "Overlap")
    assert all(dict(drawn())[name] for name in numbers[:4])
    probe.tactile_probe.extent = 0.2
    empty.context.view_layer.update()
    assert not any(dict(drawn())[name] for name in numbers)


def test_a_single_thing_is_not_said_in_the_plural(extension, empty):
    addon = extension.tactile_addon
    found = {"target": "Cube", "vertices": 1, "overlap": 1.0, "extra_points": 9}
    found |= {"vertex_distance_mean": 0.5, "vertex_distance_max": 0.5}
    report = {"status": "ok", "radius": 1.0, "verification": found}
    wording = addon.comparison.operators
    words = wording.verification_summary(report)[1]
    assert words.startswith('At 1 vertex, "Cube" is 0.5 m off the patch on average')
    found["vertices"] = 2
    assert wording.verification_summary(report)[1].startswith('At 2 vertices, "Cube" is')
    measured = {"status": "ok", "is_closed": True, "patches": 1, "contacts": 1, "height_std": 0.1}
    measured |= {"tolerance": None, "radius": 1.0}
    assert "1 patch of 1 contact;" in addon.whole_object.object_report.object_summary(measured)
    made = addon.stability_map.map_object.map_table_rows(
        {
            "source": "Cube",
            "touched": 1,
            "points": 1,
            "patches": 1,
            "in_doubt": 0,
            "refused": {},
            "object_size": 2,
        }
        | {
            "method": "bayes",
            "degree": "auto",
            "spacing": 1.0,
            "extent": 1.0,
            "step": 0.1,
            "object_size": 2.0,
        }
    )
    assert dict(made)["touched"] == "Cube, at 1 of 1 point"


def test_the_list_of_probes_leads_to_each(extension, empty):
    empty.ops.mesh.primitive_cylinder_add(vertices=64)
    for place in ((0.2, 0.1, 1.0), (0.0, -1.0, 0.1)):
        assert empty.ops.tactile.pick(target="Cylinder", location=place, new=True) == {"FINISHED"}
    context = SimpleNamespace(
        scene=empty.context.scene,
        preferences=SimpleNamespace(system=SimpleNamespace(ui_scale=1.0)),
        region=SimpleNamespace(width=300),
        view_layer=empty.context.view_layer,
    )
    layout = Layout()
    panel = extension.tactile_addon.sidebar.panel.TACTILE_PT_probes
    panel.draw_active(None, context, layout, empty.context.object)
    rows = [text.split("   ") for text, _ in layout.drawn if text.startswith("Cylinder")]
    assert [name for name, _ in rows] == ["Cylinder Probe", "Cylinder Probe.001"]
    assert rows[0][1] == "0 and 0 1/m"
    assert float(rows[1][1].split()[0]) == pytest.approx(-1.0, abs=0.05)
    assert empty.ops.tactile.activate(name="Cylinder Probe") == {"FINISHED"}
    assert empty.context.object.name == "Cylinder Probe"
    with pytest.raises(RuntimeError, match='There is no probe "Nothing" in this view layer'):
        empty.ops.tactile.activate(name="Nothing")
