# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Links between the pages lead somewhere, what commands name is there, and the site can be searched."""

import re
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

import core
from tools import check_site, figures

ROOT = Path(__file__).parent.parent
PAGES = [
    *sorted(ROOT.glob("*.md")),
    *sorted((ROOT / "docs").glob("*.md")),
    ROOT / "benchmarks" / "SCANS.md",
]
SITE = ROOT / "build" / "site" / "html"
LINK = re.compile(r"\]\(([^)\s]+)\)")
FENCE = re.compile(r"^ *```.*?^ *```", re.DOTALL | re.MULTILINE)
MOST_BYTES, MOST_LINES, MOST_WORDS, MOST_WORDS_IN_ALL = 300_000, 75, 30, 18_000
MARK, WORD = re.compile(r"<!--.*?-->"), re.compile(r"\S*\w\S*")


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


def test_every_picture_is_drawn_by_a_command_or_taken_of_a_window_and_stands_on_a_page():
    docs = ROOT / "docs"
    there = {
        path.relative_to(docs).as_posix()
        for path in docs.rglob("*")
        if path.suffix in (".png", ".jpg", ".webp", ".svg")
    }
    drawn = {picture for run in figures.RUNS.values() for picture in run.pictures}
    taken = {f"{name}.jpg" for name in figures.WINDOW} | {figures.BY_HAND}
    assert there == {name for name in drawn if not name.endswith(".csv")} | taken
    assert all((docs / name).stat().st_size < MOST_BYTES for name in drawn | taken)
    shown = {picture for page in PAGES for picture in LINK.findall(page.read_text(encoding="utf-8"))}
    assert there <= {name.removeprefix("docs/") for name in shown}


def test_every_command_of_a_figure_is_there():
    for run in figures.RUNS.values():
        assert (ROOT / f"{run.words.split()[0].replace('.', '/')}.py").is_file(), run.words
        if run.title:  # The appendix says what is measured, in the words of the docstring.
            assert len(figures.description(run.described_in or run.words.split()[0])) > 200, run.words


@pytest.mark.long
@pytest.mark.parametrize(
    "run", [run for run in figures.RUNS.values() if " " in run.words], ids=lambda run: run.words
)
def test_a_command_of_a_figure_has_no_word_that_it_does_not_know(run):
    """So that `make figures` does not fail after hours: only the word that is added is unknown."""
    pytest.importorskip("matplotlib", reason="needs what benchmarks draw with: make chart installs it")
    command = [sys.executable, "-m", *run.words.split(), "--unknown"]
    found = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert found.stderr.rstrip().endswith("error: unrecognized arguments: --unknown"), found.stderr


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_figures_are_those_that_commands_printed(page):
    text = page.read_text(encoding="utf-8")
    assert text == (figures.appendix() if page.name == "figures.md" else figures.filled(text))
    # At the start of a line or in a table such a mark would end the paragraph or the cell.
    assert not re.search(r"^ *(<!-- figure|\|.*<!--)", text, re.MULTILINE)


def test_a_mark_shows_columns_and_cells_of_what_was_printed(tmp_path, monkeypatch):
    monkeypatch.setattr(figures, "KEPT", tmp_path)
    (tmp_path / "a.txt").write_text(
        "| x | y | z |\n|---|--:|--:|\n| one | 0.1 | 7 |\n| two | 0.3 | |\n\n"
        "| k | v |\n|---|--:|\n| k | 5 |\n"
    )
    page = '<!-- table a "x | y" 1 3=the_last -->\nold\n<!-- end --> <!-- figure a "k" "k" 2 -->4<!-- end -->'
    page += '<!-- figure a "x" "max" 2 -->4<!-- end -->'
    assert re.sub("<!--.*?-->", "", figures.filled(page)) == (
        "\n\n| x | the last |\n| --- | --: |\n| one | 7 |\n| two |  |\n\n 50.3"
    )
    assert figures.filled(figures.filled(page)) == figures.filled(page)
    with pytest.raises(ValueError, match="has no table whose head begins with: q"):
        figures.filled('<!-- figure a "q" "k" 2 -->4<!-- end -->')


def test_pages_have_few_words():
    pages = [ROOT / "CONTRIBUTING.md", *(ROOT / "docs").glob("*.md")]
    words = {p.name: len(WORD.findall(MARK.sub("", p.read_text(encoding="utf-8")))) for p in pages}
    del words["figures.md"]  # the appendix, which is generated
    assert sum(words.values()) <= MOST_WORDS_IN_ALL, words


def test_sentences_have_thirty_words_at_most():
    """Sentences have 30 words at most; tables may quote longer messages."""
    written = [page for page in PAGES if page.name not in ("CHANGELOG.md", "figures.md")]
    for page in written:
        for sentence in sentences(page.read_text(encoding="utf-8")):
            assert len(re.findall(r"[\w'’.%‰]+", sentence)) <= MOST_WORDS, sentence


def sentences(text):
    """The sentences of a page, without code, formulas, tables and headings; code counts as a word."""
    text = re.sub(r"^\$\$.*?\$\$$", "", FENCE.sub("", MARK.sub("", text)), flags=re.DOTALL | re.MULTILINE)
    lines = [line for line in text.split("\n") if not re.match(r"\s*[|#!]", line)]
    for block in re.split(r"\n\s*\n|\n\s*(?:[-*]|\d+\.) ", "\n".join(lines)):
        plain = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", block)
        plain = re.sub(r"`[^`]*`|\$[^$]*\$", "Code", plain).replace("*", "")
        yield from re.split(r"(?<=[.?!:])[\")”]?\s+(?=[A-Z0-9\"“(.])", " ".join(plain.split()))


def test_the_readme_is_short_and_its_picture_small():
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    assert len(text.splitlines()) <= MOST_LINES
    assert 10_000 < (ROOT / "docs" / "film.webp").stat().st_size < MOST_BYTES


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
