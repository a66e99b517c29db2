# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The report is one whole page, and its figures are those of the patch or map."""

import json
import re
from html.parser import HTMLParser

import numpy as np
import pytest

pytest.importorskip("bpy", reason="needs Blender as a Python module: run make test")
from scenes import made

TOUCH = {"location": (0.3, -0.2, 1.9), "extent": 0.6, "step": 0.06}
PLACE = ("--location", 0.3, -0.2, 1.9, "--extent", 0.6)
VOID = ("meta", "path", "circle", "rect", "br", "img")


class Page(HTMLParser):
    """Asserts that each tag is closed; keeps rows of tables, headings, addresses and counts of tags."""

    def __init__(self, text):
        super().__init__()
        self.open, self.rows, self.headings, self.counts, self.addresses = [], [], [], {}, []
        self.feed(text)
        assert self.open == []

    def handle_starttag(self, tag, attributes):
        self.counts[tag] = self.counts.get(tag, 0) + 1
        self.addresses += [value for name, value in attributes if name in ("src", "href")]
        if tag == "tr":
            self.rows.append([])
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        if tag not in VOID:
            assert self.open.pop() == tag

    def handle_data(self, data):
        if self.open and self.open[-1] in ("td", "th"):
            self.rows[-1].append(data)
        if self.open and self.open[-1] == "h2":
            self.headings.append(data)


def band(page, name):
    """The share within a band of this name, in %."""
    (row,) = [row for row in page.rows if row[0] == name]
    return float(next(cell for cell in row[1:] if cell.endswith(" %")).removesuffix(" %"))


def corners(picture):
    """The corners (n, 2) of the triangles of a picture."""
    return np.array(re.findall(r"[ML]([\d.]+) ([\d.]+)", picture), dtype=float)


def test_the_page_of_a_patch_is_whole_and_its_shares_are_those_of_its_area(empty, ball, tmp_path):
    patch, report = made(empty.ops.tactile.reconstruct, **TOUCH, noise=0.002)
    empty.ops.tactile.export_report(filepath=str(tmp_path / "patch.html"))
    text = (tmp_path / "patch.html").read_text(encoding="utf-8")
    page = Page(text)
    assert page.addresses == []
    assert "http" not in text
    wanted = ["Pictures", "Deviations", "Tolerance bands", "What was found", "Settings", "Versions"]
    assert page.headings == wanted
    assert report["message"] in text
    assert page.counts["path"] == 3 * len(patch.data.polygons)
    places = np.array(re.findall(r'<circle cx="(.+?)" cy="(.+?)"', text), dtype=float)
    assert len(places) == 3 * report["contacts"]
    assert (np.hypot(*(places - 160.0).T) < 160.0).all()  # on the patch, which fills the picture
    rows = {row[0]: row[1] for row in page.rows if len(row) == 2}
    assert rows["method"] == "bayes"
    # All lengths of the page are in the unit of its scene.
    assert (rows["noise"], rows["extent"], rows["step"]) == ("0.002 m", "0.6 m", "0.06 m")
    assert rows["verdict"] in text.split("<h2>")[0]
    assert rows["texture beside the polynomial"] == "none"
    assert "e-" not in rows["normal"] + rows["first principal direction"] + rows["suggested next plane"]
    assert rows["planes"] == "0° leaning 0°, 60° leaning 0°, 120° leaning 0°"
    assert rows["Blender"] == empty.app.version_string
    # The page counts the area around each vertex that is within the band: a third of each triangle there.
    off = np.array([value.value for value in patch.data.attributes["deviation"].data])
    areas = np.zeros(len(off))
    for polygon in patch.data.polygons:
        areas[list(polygon.vertices)] += polygon.area / 3.0
    for share in (0.5, 1.0):
        within = 100.0 * areas[np.abs(off) <= share / 100.0 * report["radius"]].sum() / areas.sum()
        assert band(page, f"± {share:g} % of the radius") == pytest.approx(within, abs=0.06)
    assert band(page, "± 5 % of the radius") == 100.0


def test_without_a_mesh_the_contacts_are_what_deviates(command, tmp_path):
    s = np.linspace(-0.5, 0.5, 21)
    lines = [
        f"{i},{2 * np.sin(t) * np.cos(a)},{2 * np.sin(t) * np.sin(a)},{2 * np.cos(t)}"
        for i, a in enumerate(np.radians([0, 60, 120]))
        for t in s
    ]
    (tmp_path / "contacts.csv").write_text("\n".join(["curve,x,y,z", *lines]) + "\n")
    code, _, _ = command("fit", tmp_path / "contacts.csv", "--report", tmp_path / "fit.html")
    assert code == 0
    page = Page((tmp_path / "fit.html").read_text(encoding="utf-8"))
    assert band(page, "± 0.5 % of the radius") == 100.0
    assert page.counts["figure"] == 3  # two pictures, for there is no mesh to deviate from, and the histogram


@pytest.mark.long
def test_the_page_of_a_map(command, files, tmp_path):
    arguments = ("--spacing", 1, "--extent", 0.6, "--report", tmp_path / "map.html")
    assert command("map", files / "ball.ply", *arguments)[0] == 0
    text = (tmp_path / "map.html").read_text(encoding="utf-8")
    page = Page(text)
    assert page.counts["figure"] == 4  # three views and the histogram
    assert page.addresses == []
    pictures = text.split("<svg")[1:4]
    for picture in pictures:  # a ball that fills the picture
        from_middle = np.hypot(*(corners(picture) - 160.0).T)
        assert 150.0 < from_middle.max() < 160.0
        assert len(picture) < 2_000_000
    assert band(page, "± 5 % of the extent") == 100.0
    assert "Error: pale green at 0, dark red from" in text
    assert re.search(r"(\d+) patches at \1 points, 0 in doubt", text)


@pytest.mark.long
def test_the_page_of_a_whole_object(command, files, tmp_path):
    arguments = (
        "--tolerance",
        0.02,
        "--report",
        tmp_path / "object.html",
        "--json",
        tmp_path / "object.json",
    )
    assert command("object", files / "ball.ply", *arguments)[0] == 0
    page = Page((tmp_path / "object.html").read_text(encoding="utf-8"))
    record = json.loads((tmp_path / "object.json").read_text())
    assert page.counts["figure"] == 5  # three views, their scale and the histogram
    assert band(page, "± 5 × the tolerance") == 100.0 * (record["deviation_max"] < 0.1)
    rows = {row[0]: row[1] for row in page.rows if len(row) == 2}
    assert rows["touched"].endswith(f"{record['touches']} times")


def test_what_cannot_be_reported_is_said(empty, command, files, tmp_path):
    code, _, err = command("reconstruct", files / "ball.ply", *PLACE, "--report", tmp_path / "r.txt")
    assert code == 2
    assert "--report: expected a file .html" in err
    report = tmp_path / "nowhere" / "r.html"
    assert command("reconstruct", files / "ball.ply", *PLACE, "--report", report)[0] == 1
    empty.ops.wm.read_homefile(use_empty=True)
    with pytest.raises(RuntimeError, match="Select a patch, its probe, a stability map"):
        empty.ops.tactile.export_report(filepath=str(tmp_path / "r.html"))


def test_names_of_objects_are_no_html(empty, ball, tmp_path):
    ball.name = "<b>&"
    made(empty.ops.tactile.reconstruct, **TOUCH)
    empty.ops.tactile.export_report(filepath=str(tmp_path / "r.html"))
    page = Page((tmp_path / "r.html").read_text(encoding="utf-8"))
    assert "b" not in page.counts


@pytest.mark.parametrize("key", ["method", "seconds", "shape_index"])
def test_an_edited_patch_gets_a_sentence_in_place_of_a_report(empty, ball, tmp_path, key):
    patch, _ = made(empty.ops.tactile.reconstruct, **TOUCH)
    del patch["tactile"][key]
    with pytest.raises(RuntimeError, match="is no longer a complete patch: touch again"):
        empty.ops.tactile.export_report(filepath=str(tmp_path / "patch.html"))
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("record", [7, "words", {}, {"message": "ok", "status": "ok"}])
@pytest.mark.parametrize("kind", ["tactile_object", "tactile_map"])
def test_an_edited_whole_object_or_map_gets_one_too(empty, ball, tmp_path, kind, record):
    if kind == "tactile_map":
        made(empty.ops.tactile.stability_map, kind, spacing=2.0)
    else:
        made(empty.ops.tactile.touch_all_over, kind, tolerance=0.02, edge=0.3)
    empty.context.object[kind] = record
    with pytest.raises(RuntimeError, match="is no longer a complete surface: touch all over again"):
        empty.ops.tactile.export_report(filepath=str(tmp_path / "object.html"))
    assert list(tmp_path.iterdir()) == []


def test_a_page_says_what_the_panel_says_and_its_scales_begin_where_values_do(empty, ball, tmp_path):
    empty.ops.tactile.pick(target=ball.name, location=TOUCH["location"], new=True)
    empty.ops.tactile.export_report(filepath=str(tmp_path / "page.html"))
    text = (tmp_path / "page.html").read_text()
    assert "Good: heights to ±" in text
    ends = re.findall(r'<text x="0" y="27" text-anchor="start">([^<]+)<', text)
    assert [end.startswith("-") for end in ends[:3]] == [True, False, True]


def test_the_page_of_a_map_counts_touches_by_their_area_and_no_vertices(empty, extension):
    """The vertices of a cylinder belong to its caps as well, which have no error."""
    empty.ops.mesh.primitive_cylinder_add()
    empty.ops.tactile.stability_map(target="Cylinder", spacing=0.5)
    painted = empty.context.object
    record = painted["tactile_map"].to_dict()
    page = Page(extension.tactile_addon.report.pages.map_page(painted))
    rows = dict(extension.tactile_addon.stability_map.map_object.map_table_rows(record))
    (row,) = [row for row in page.rows if row[0] == "± 1 standard deviation"]
    assert row[1] == rows["median standard deviation"]


def test_only_all_of_a_surface_is_100_percent(extension):
    parts = extension.tactile_addon.report.parts
    values, weights = np.array([0.0, 1.0]), np.array([9999.0, 1.0])
    page = Page(parts.bands(values, weights, 0.5, {"radius": 1.0}, [("less", 0.9), ("all", 1.5)]))
    assert (band(page, "less"), band(page, "all")) == (99.9, 100.0)


def test_what_rounding_leaves_of_a_distance_is_0(extension, empty):
    empty.ops.mesh.primitive_cube_add(size=0.002)
    empty.ops.tactile.reconstruct(target="Cube", location=(0.0001, 0.0002, 0.001))
    patch = empty.context.object
    empty.ops.tactile.verify(target="Cube")
    report = patch["tactile"].to_dict()
    report["verification"] |= {"vertex_distance_max": 3e-20, "extra_fit_error": 2e-20}
    rows = extension.tactile_addon.touch.wording.readable_rows(report | {"fit_error": 1e-19})
    assert not re.search(r"e-[1-9]\d", " ".join(value for _, value in rows)), rows
