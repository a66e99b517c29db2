# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A release needs version, changelog, citation and tag to agree; each zip has the wheels that fit it."""

import hashlib
import subprocess
import tomllib
from pathlib import Path

import pytest

import core
from tools import build, check_site, release

ROOT = Path(__file__).resolve().parents[1]
CHANGES = "# Changelog\n\n## [1.2.0] - {}\n\n### Added\n\n- More.\n\n## [1.1.0] - 2026-01-02\n\n- Less.\n"
URLS = [(name, f"https://example.org/{name}") for name in ("Documentation", "Repository", "Extensions")]


def git(folder, *arguments):
    names = ["-c", "user.name=A", "-c", "user.email=a@example.org", "-c", "commit.gpgsign=false"]
    subprocess.run(["git", *names, *arguments], cwd=folder, check=True, capture_output=True)


@pytest.fixture
def checkout(tmp_path):
    """A checkout whose version, changelog, citation and tag agree on 1.2.0."""
    (tmp_path / "blender_manifest.toml").write_text('version = "1.2.0"\n')
    (tmp_path / "CITATION.cff").write_text("title: T\nversion: 1.2.0\n")
    (tmp_path / "core").mkdir()
    (tmp_path / "core" / "__init__.py").write_text('"""C."""\n__version__ = "1.2.0"\n')
    (tmp_path / "CHANGELOG.md").write_text(CHANGES.format("2026-11-22"))
    (tmp_path / "pyproject.toml").write_text("[project.urls]\n" + "".join(f'{n} = "{a}"\n' for n, a in URLS))
    (tmp_path / "README.md").write_text(" ".join(address for _, address in URLS))
    git(tmp_path, "init")
    git(tmp_path, "add", ".")
    git(tmp_path, "commit", "--message", "All")
    git(tmp_path, "tag", "v1.2.0")
    return tmp_path


def test_what_agrees_can_be_released(checkout):
    assert list(release.disagreements(checkout)) == []
    assert release.section(checkout, "1.2.0") == ("2026-11-22", "### Added\n\n- More.\n")


@pytest.mark.parametrize(
    ("name", "text", "words"),
    [
        ("CHANGELOG.md", CHANGES.format("unreleased"), "has [1.2.0] - unreleased: give it the date"),
        ("CHANGELOG.md", "## [1.1.0] - 2026-01-02\n", "does not begin with a section [1.2.0]"),
        ("CHANGELOG.md", "## [1.2.0] - 2026-01-02\n\n", "says nothing in its section [1.2.0]"),
        (
            "CHANGELOG.md",
            "## [Unreleased]\n\n- M.\n\n## [1.2.0] - 2026-01-02\n\n- L.\n",
            "section [Unreleased]: move",
        ),
        ("CITATION.cff", "version: 1.1.0\n", "has another version than the manifest's 1.2.0"),
        ("core/__init__.py", '\n__version__ = "1.1.0"\n', "another __version__ than the manifest's 1.2.0"),
        ("blender_manifest.toml", 'version = "1.2"\n', "expected three numbers"),
        ("blender_manifest.toml", 'version = "1.3.0"\n', "no tag v1.3.0: git tag v1.3.0"),
        (
            "pyproject.toml",
            "[project]\n",
            "pyproject.toml has no address of the Repository in [project.urls]",
        ),
        ("README.md", "make zip", "README.md does not have https://example.org/Extensions: name it under"),
    ],
)
def test_what_does_not_agree_is_said(checkout, name, text, words):
    (checkout / name).write_text(text)
    reasons = list(release.disagreements(checkout))
    assert any(words in reason for reason in reasons), reasons
    assert "there are changes that are not committed: commit them" in reasons


def test_an_empty_section_of_what_is_not_released_may_stay(checkout):
    text = (checkout / "CHANGELOG.md").read_text()
    (checkout / "CHANGELOG.md").write_text(text.replace("## [1.2.0]", "## [Unreleased]\n\n## [1.2.0]"))
    assert list(release.disagreements(checkout)) == ["there are changes that are not committed: commit them"]


def test_a_commit_after_the_tag_is_no_release(checkout):
    git(checkout, "commit", "--allow-empty", "--message", "More")
    assert list(release.disagreements(checkout)) == ["this commit has no tag v1.2.0: git tag v1.2.0"]


def test_the_core_of_this_checkout_has_the_version_of_the_manifest():
    assert core.__version__ == release.manifest_version(ROOT)


def test_the_changelog_of_this_checkout_begins_with_the_version_of_the_manifest():
    date, text = release.section(ROOT, release.manifest_version(ROOT))
    assert date is not None
    assert text


def test_checksums_are_those_of_the_zips(tmp_path):
    (tmp_path / "repository").mkdir()
    (tmp_path / "a.zip").write_bytes(b"a")
    (tmp_path / "repository" / "b.zip").write_bytes(b"b")
    release.write_checksums(tmp_path)
    lines = (tmp_path / "SHA256SUMS").read_text().splitlines()
    wanted = [("a.zip", b"a"), ("repository/b.zip", b"b")]
    assert lines == [f"{hashlib.sha256(data).hexdigest()}  {name}" for name, data in wanted]


def test_the_manual_that_ships_leads_nowhere_else(tmp_path):
    build.write_manual(tmp_path / "manual")
    assert list(check_site.problems(tmp_path / "manual")) == []
    text = (tmp_path / "manual" / "viewport.html").read_text(encoding="utf-8")
    assert 'href="messages.html"' in text
    assert ".md" not in text


def test_a_refused_release_says_how_to_get_a_zip_without_one(monkeypatch):
    monkeypatch.setattr(release, "disagreements", lambda _: ["there is no tag"])
    with pytest.raises(SystemExit, match=r"release: there is no tag\nrelease: without a release, `make zip`"):
        release.main()


@pytest.mark.parametrize("urls", [{}, {"Documentation": "https://example.org/docs"}])
def test_the_manifest_has_the_website_that_is_published(tmp_path, monkeypatch, urls):
    monkeypatch.setattr(build, "urls", lambda: urls)
    build.stage(tmp_path / "staged", [], [])
    staged = tomllib.loads((tmp_path / "staged" / build.MANIFEST.name).read_text(encoding="utf-8"))
    assert staged.get("website") == urls.get("Documentation")


def test_a_zip_of_a_series_has_its_wheels_and_its_blenders_and_no_other(tmp_path, monkeypatch):
    manifest = tomllib.loads(build.MANIFEST.read_text(encoding="utf-8"))
    monkeypatch.setattr(build.shutil, "copy2", lambda source, target: None)  # the wheels have 40 MB each
    ranges = []
    for python, series in build.SERIES.items():
        wheels = [wheel for wheel in manifest["wheels"] if f"-cp{python}-" in wheel]
        build.stage(tmp_path / python, ["linux-x64"], wheels, series)
        staged = tomllib.loads((tmp_path / python / build.MANIFEST.name).read_text(encoding="utf-8"))
        ranges.append((staged["blender_version_min"], staged.get("blender_version_max")))
        assert staged["wheels"] == wheels
        assert staged["version"] == manifest["version"]
    # Each Blender from the least one of the manifest on is in one of these ranges.
    assert ranges[0][0] == manifest["blender_version_min"]
    assert [least for least, _ in ranges[1:]] == [most for _, most in ranges[:-1]]
    assert ranges[-1][1] is None
    assert sum(len([w for w in manifest["wheels"] if f"-cp{p}-" in w]) for p in build.SERIES) == len(
        manifest["wheels"]
    )
