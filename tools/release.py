# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Makes all files of a release in build/release/VERSION, or says in a sentence why there can be none.

- The zips are for one system and all Blenders each, to be installed from disk. One has no wheels.
- repository/ is a static repository as Blender defines it (index.json, and index.html with links to drop into
  Blender). Its zips are for one system and one series of Blender each, so they are half as large, and Blender
  takes the one that fits.
- CHANGES.md is the changelog's section, and SHA256SUMS has the checksums of the zips.
"""

import hashlib
import re
import shutil
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from pathlib import Path

from tools import build

ROOT = Path(__file__).resolve().parents[1]
SECTION = re.compile(r"^## \[([^]]+)\] - (\S+)\n(.*?)(?=^## \[|\Z)", re.DOTALL | re.MULTILINE)
UNRELEASED = re.compile(r"^## \[Unreleased\]\n\s*(?!## \[)\S", re.MULTILINE)
DATE = re.compile(r"\d{4}-\d\d-\d\d")
VERSION = re.compile(r"\d+\.\d+\.\d+")


def main() -> None:
    reasons = list(disagreements(ROOT))
    if reasons:
        reasons.append("without a release, `make zip` makes the same zips to install, in build/dist")
        sys.exit("\n".join(f"release: {reason}" for reason in reasons))
    version = manifest_version(ROOT)
    folder = folder_of_version()
    shutil.rmtree(folder, ignore_errors=True)
    run("tools/build.py", "--wheels", "all", "--output", folder)
    run("tools/build.py", "--wheels", "none", "--output", folder)
    run("tools/build.py", "--wheels", "all", "--each-series", "--output", folder / "repository")
    generate(folder / "repository")
    _, text = section(ROOT, version)
    (folder / "CHANGES.md").write_text(text, encoding="utf-8", newline="\n")
    write_checksums(folder)
    for path in sorted(folder.rglob("*.*")):
        print(f"{path.stat().st_size / 1e6:7.1f} MB  {path.relative_to(ROOT)}")


def folder_of_version() -> Path:
    """Where the release of this checkout's version is, or will be."""
    return ROOT / "build" / "release" / manifest_version(ROOT)


def manifest_version(root: Path) -> str:
    """The version that the manifest has."""
    text = (root / "blender_manifest.toml").read_text(encoding="utf-8")
    return str(tomllib.loads(text)["version"])


def disagreements(root: Path) -> Iterator[str]:
    """Yields a sentence for each thing that does not agree with the manifest's version."""
    version = manifest_version(root)
    if not VERSION.fullmatch(version):
        yield f'blender_manifest.toml has the version "{version}": expected three numbers, as in 1.0.0'
    date, text = section(root, version)
    if date is None:
        yield f"CHANGELOG.md does not begin with a section [{version}], the manifest's version: write it"
    elif not DATE.fullmatch(date):
        yield f"CHANGELOG.md has [{version}] - {date}: give it the date of the release, as in 2026-01-31"
    elif not text:
        yield f"CHANGELOG.md says nothing in its section [{version}]: write what is new"
    if UNRELEASED.search((root / "CHANGELOG.md").read_text(encoding="utf-8")):
        yield f"CHANGELOG.md has changes in its section [Unreleased]: move them to [{version}]"
    if f"\nversion: {version}\n" not in (root / "CITATION.cff").read_text(encoding="utf-8"):
        yield f"CITATION.cff has another version than the manifest's {version}: change it"
    if f'\n__version__ = "{version}"' not in (root / "core" / "__init__.py").read_text(encoding="utf-8"):
        yield f"core/__init__.py has another __version__ than the manifest's {version}: change it"
    yield from unpublished(root)
    if git(root, "status", "--porcelain"):
        yield "there are changes that are not committed: commit them"
    if f"v{version}" not in git(root, "tag", "--points-at", "HEAD").split():
        yield f"this commit has no tag v{version}: git tag v{version}"


def unpublished(root: Path) -> Iterator[str]:
    """Yields a sentence for each address that is not known, or that the first page does not have."""
    found = build.urls(root / "pyproject.toml")
    readme = (root / "README.md").read_text(encoding="utf-8")
    for name in ("Documentation", "Repository", "Extensions"):
        if name not in found:
            yield f"pyproject.toml has no address of the {name} in [project.urls]: fill it in"
        elif found[name] not in readme:
            yield f"README.md does not have {found[name]}: name it under Install, in place of `make zip`"


def section(root: Path, version: str) -> tuple[str | None, str]:
    """Date and text of the changelog's first version; None and "" if it is another one."""
    found = SECTION.search((root / "CHANGELOG.md").read_text(encoding="utf-8"))
    if found is None or found[1] != version:
        return None, ""
    return found[2], found[3].strip() + "\n" if found[3].strip() else ""


def git(root: Path, *arguments: str) -> str:
    """The output of a git command in the checkout `root`."""
    return subprocess.run(
        ["git", *arguments], cwd=root, check=True, capture_output=True, text=True
    ).stdout.strip()


def run(script: str, *arguments: str | Path) -> None:
    """Run a script of this checkout, which says itself why it fails."""
    status = subprocess.run([sys.executable, ROOT / script, *arguments], stdout=subprocess.DEVNULL).returncode
    if status:
        sys.exit(status)


def generate(repository: Path) -> None:
    """Write the repository's index.json and index.html by Blender's own tool."""
    build.run(build.packaging_tool(), "server-generate", "--repo-dir", repository, "--html")


def write_checksums(folder: Path) -> None:
    """Write SHA256SUMS of all zips, as sha256sum --check reads it."""
    lines = [
        f"{hashlib.sha256(path.read_bytes()).hexdigest()}  {path.relative_to(folder).as_posix()}\n"
        for path in sorted(folder.rglob("*.zip"))
    ]
    (folder / "SHA256SUMS").write_text("".join(lines), encoding="utf-8", newline="\n")


if __name__ == "__main__":
    main()
