# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Links between the pages lead somewhere, what commands name is there, and the site can be searched."""

import re
import shutil
import subprocess
import tomllib
from pathlib import Path

import pytest

import core
from tools import check_site, figures

ROOT = Path(__file__).parent.parent
PAGES = [*sorted(ROOT.glob("*.md")), *sorted((ROOT / "docs").glob("*.md"))]
SITE = ROOT / "build" / "site" / "html"
LINK = re.compile(r"\]\(([^)\s]+)\)")
FENCE = re.compile(r"^ *```.*?^ *```", re.DOTALL | re.MULTILINE)
MOST_BYTES, MOST_LINES, MOST_WORDS = 300_000, 75, 30


def slug(heading):
    """The anchor of a heading, as repositories' pages and the site have it."""
    plain = re.sub(r"\[([^\]]*)\]\([^)]*\)|[`*]", r"\1", heading.lower())
    return re.sub(r"\s", "-", re.sub(r"[^\w\s-]", "", plain.strip()))


def anchors(path):
    text = FENCE.sub("", path.read_text(encoding="utf-8"))
    return {slug(heading) for heading in re.findall(r"^#+ (.*)$", text, re.MULTILINE)}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_links_lead_somewhere(page):
    for link in LINK.findall(FENCE.sub("", page.read_text(encoding="utf-8"))):
        if re.match(r"https?://", link):
            continue
        # contributing.md and changelog.md are pages of only the site, made of the files next to README.md.
        name, _, anchor = link.partition("#")
        target = page.parent / name if name else page
        if page.parent.name == "docs" and name in ("contributing.md", "changelog.md"):
            target = ROOT / name.upper().replace(".MD", ".md")
        assert target.exists(), link
        if anchor:
            assert anchor in anchors(target), link


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_commands_name_what_is_there(page):
    text = page.read_text(encoding="utf-8")
    targets = re.findall(r"^([\w-]+):", (ROOT / "Makefile").read_text(encoding="utf-8"), re.MULTILINE)
    for target in re.findall(r"(?:^|`)make ([a-z-]+)", text, re.MULTILINE):
        assert target in targets
    for module in re.findall(r"python -m ((?:benchmarks|tools)\.\w+)", text):
        assert (ROOT / f"{module.replace('.', '/')}.py").is_file(), module
    for script in re.findall(r"`((?:benchmarks|examples|tools|tests)/[\w/]+\.\w+)", text):
        assert (ROOT / script).is_file(), script


def test_the_page_of_figures_has_all_pictures_and_commands_draw_those_that_are_there():
    page = (ROOT / "docs" / "figures.md").read_text(encoding="utf-8")
    named = set(re.findall(r"`([\w/]+\.(?:png|jpg|webp|svg))`", page))
    docs = ROOT / "docs"
    there = {
        path.relative_to(docs).as_posix()
        for path in docs.rglob("*")
        if path.suffix in (".png", ".jpg", ".webp", ".svg")
    }
    assert named == there
    drawn = {name for files in figures.DRAWN.values() for name in files}
    windows = set(re.findall(r"\w+", re.search(r"build/gui/\{([^}]*)\}\.jpg", page)[1]))
    assert {name for name in drawn if not name.endswith(".csv")} == (
        there - {f"{window}.jpg" for window in windows} - {"data_flow.svg"}
    )
    assert all((docs / name).is_file() for name in drawn)
    for words in figures.DRAWN:
        assert (ROOT / f"{words[0].replace('.', '/')}.py").is_file()


def test_sentences_have_thirty_words_at_most():
    """Sentences have 30 words at most; tables may quote longer messages."""
    for page in [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").glob("*.md"))]:
        for sentence in sentences(page.read_text(encoding="utf-8")):
            assert len(re.findall(r"[\w'’.%‰]+", sentence)) <= MOST_WORDS, sentence


def sentences(text):
    """The sentences of a page, without code, formulas, tables and headings; code counts as a word."""
    text = re.sub(r"^\$\$.*?\$\$$", "", FENCE.sub("", text), flags=re.DOTALL | re.MULTILINE)
    lines = [line for line in text.split("\n") if not re.match(r"\s*[|#!]", line)]
    for block in re.split(r"\n\s*\n|\n\s*(?:[-*]|\d+\.) ", "\n".join(lines)):
        plain = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", block)
        plain = re.sub(r"`[^`]*`|\$[^$]*\$", "Code", plain).replace("*", "")
        yield from re.split(r"(?<=[.?!:])[\")”]?\s+(?=[A-Z0-9\"“(.])", " ".join(plain.split()))


def test_the_readme_is_short_and_its_picture_small():
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    assert len(text.splitlines()) <= MOST_LINES
    assert 10_000 < (ROOT / "docs" / "film.webp").stat().st_size < MOST_BYTES


def test_the_figures_of_the_readme_are_those_of_the_docs():
    readme, speed, rest = (
        " ".join((ROOT / name).read_text(encoding="utf-8").split())
        for name in ("README.md", "docs/speed_and_accuracy.md", "docs/benchmarks.md")
    )
    speed += rest
    process, cubic = re.search(
        r"is (\S+) of a Gaussian process's and (\S+) of a cubic spline's", readme
    ).groups()
    assert f"the mean error is {process} of the Gaussian process's, {cubic} of the cubic spline's" in speed
    low, high = re.search(r"the 90 % intervals hold (\d+) to (\d+) % of the surface", readme).groups()
    assert f"Its intervals hold {low} to {high} % here" in speed
    sure, doubt, refused, _, off, _, turned = re.search(r"\| all " + 7 * r"\| (\d+) ", speed).groups()
    assert f"{int(sure) + int(doubt) + int(refused)} automatic touches on scans: {sure} are sure" in readme
    assert f"{off} of these are off by more than 2 % of the radius, and {turned} are turned by more" in readme
    (update,) = re.findall(r"\| 1000000 \| \d+ \|(?: \S+ \|){4} (\S+) \| \S+ \| \S+ \| \S+ \|", speed)
    assert f"in {float(update):.0f} ms" in readme


def test_the_reference_has_all_that_core_offers():
    page = (ROOT / "docs" / "reference.md").read_text(encoding="utf-8")
    offered = {name for name in core.__all__ if callable(getattr(core, name))}
    assert set(re.findall(r"^::: core\.(\w+)$", page, re.MULTILINE)) == offered


def test_the_citation_has_the_version():
    manifest = tomllib.loads((ROOT / "blender_manifest.toml").read_text(encoding="utf-8"))
    assert f"\nversion: {manifest['version']}\n" in (ROOT / "CITATION.cff").read_text(encoding="utf-8")


def test_the_checker_of_the_site_finds_what_is_broken(tmp_path):
    (tmp_path / "a.html").write_text(
        '<h1 id="top"></h1><a href="b.html#here">b</a><a href="#top">t</a><a href="https://elsewhere.org">e</a>'
    )
    (tmp_path / "b.html").write_text('<p id="here"></p><a href="a.html">a</a>')
    assert list(check_site.problems(tmp_path)) == []
    (tmp_path / "b.html").write_text(
        '<a href="c.html">c</a><script src="https://elsewhere.org/x.js"></script>'
    )
    (tmp_path / "s.css").write_text("body { background: url(//elsewhere.org/x.png) }")
    found = "\n".join(check_site.problems(tmp_path))
    for words in (
        "b.html#here names no place",
        "c.html leads nowhere",
        "x.js is loaded from another host",
        "x.png is",
    ):
        assert words in found


def test_the_site_is_searched_without_a_server():
    browser = shutil.which("chromium") or shutil.which("google-chrome")
    if browser is None or not SITE.is_dir():
        pytest.skip("needs build/site/html, by make site, and a Chromium")
    command = [
        browser,
        "--headless",
        "--no-sandbox",
        "--disable-gpu",
        "--virtual-time-budget=8000",
        "--dump-dom",
    ]
    page = subprocess.run(
        [*command, f"{SITE.as_uri()}/index.html?q=umbilic"], capture_output=True, text=True, timeout=120
    )
    assert re.search(r'md-search-result__meta">\d+ matching document', page.stdout)
    assert "<mark>umbilic" in page.stdout


def test_the_lesson_shows_what_core_finds():
    lesson = pytest.importorskip("tools.lesson", reason="needs matplotlib: make chart installs it")
    for curvatures in lesson.SHAPES.values():
        assert lesson.felt(*curvatures) == pytest.approx(curvatures, abs=0.03)


def test_no_two_lines_for_the_shell_write_the_same_file():
    pages = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
    lines = [line for page in pages for line in page.read_text(encoding="utf-8").splitlines()]
    lines = [line.strip() for line in lines if re.match(r" *blender .*-c tactile ", line)]
    options = r" --(?:output|report|verify|json|contacts) (\S+)"
    written = [name for line in dict.fromkeys(lines) for name in re.findall(options, line) if name != "-"]
    assert sorted(written) == sorted(set(written))
