# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Build the extension's zip files with Blender's own packaging tool, taken from the bpy module.

The manifest says which wheels there are and for which platforms; those missing in wheels/ are
downloaded by the version, Python and platform their names spell. The paths of the zips built go to
stdout, everything else to stderr.
"""

import argparse
import importlib.util
import json
import platform
import re
import shutil
import subprocess
import sys
import tempfile
import tomllib
from pathlib import Path
from typing import Any

import markdown

ROOT = Path(__file__).resolve().parents[1]
MANIFEST = ROOT / "blender_manifest.toml"
PROJECT = ROOT / "pyproject.toml"
# Blender's own list of patterns can only exclude files. So what ships is named here, and nothing else that
# lies in a checkout, such as an environment or a scan, can get into a release.
SHIPPED = ("__init__.py", "LICENSE", "core", "tactile_addon")
# These pages ship as HTML, with their pictures: they are what Blender's Online Manual opens.
DOCS = ROOT / "docs"
MANUAL = ("viewport", "patch", "lesson", "maps", "scan", "messages")
PAGE = """<!doctype html><html lang="en"><meta charset="utf-8"><title>Tactile Patch</title>
<meta name="viewport" content="width=device-width">
<style>body {{ max-width: 50em; margin: 2em auto; padding: 0 1em; font: 1rem/1.5 sans-serif; }}
img {{ max-width: 100%; }} table {{ display: block; overflow-x: auto; }}
td, th {{ padding: 0.2em 1em 0.2em 0; text-align: left; }}
pre {{ background: #eee; padding: 1em; overflow: auto; }}</style>
{}
</html>
"""
LEAD = """<!doctype html><meta charset="utf-8"><title>Tactile Patch</title>
<meta http-equiv="refresh" content="0; url={}.html#{}">
"""
# For each Python of the wheels, the first Blender that has it and, if there is one, the first that no longer
# has it.
SERIES = {"311": ("4.5.0", "5.1.0"), "313": ("5.1.0",)}
MACHINES = {"x86_64": "x64", "amd64": "x64", "aarch64": "arm64"}


def main() -> None:
    parser = argparse.ArgumentParser(description="Build the extension's zip files.")
    parser.add_argument(
        "--wheels",
        choices=("all", "host", "none"),
        default="host",
        help="all: a zip for every platform; host (default): one for this platform; "
        "none: one without scipy, for a Blender whose Python has it",
    )
    parser.add_argument(
        "--each-series", action="store_true", help="also a zip for each series of Blender, half as large"
    )
    parser.add_argument("--output", type=Path, default=ROOT / "build" / "dist", metavar="DIR")
    args = parser.parse_args()

    manifest = tomllib.loads(MANIFEST.read_text(encoding="utf-8"))
    platforms = {
        "all": manifest["platforms"],
        "host": [p for p in manifest["platforms"] if p == host_platform()],
        "none": [],
    }[args.wheels]
    if args.wheels == "host" and not platforms:
        sys.exit(f"No wheels are listed for {host_platform()}; use --wheels none.")
    wheels = [w for w in manifest["wheels"] if wheel_platform(w) in platforms]

    tool = packaging_tool()
    for wheel in wheels:
        download(ROOT / wheel)
    args.output.mkdir(parents=True, exist_ok=True)
    if not args.each_series:
        build(tool, manifest, platforms, wheels, args.output)
        return
    for python, series in SERIES.items():
        of_python = [wheel for wheel in wheels if f"-cp{python}-" in wheel]
        supported = {wheel_platform(wheel) for wheel in of_python}
        chosen = [name for name in platforms if name in supported]
        if chosen:
            build(tool, manifest, chosen, of_python, args.output, series)


def build(
    tool: Path,
    manifest: dict[str, Any],
    platforms: list[str],
    wheels: list[str],
    folder: Path,
    series: tuple[str, ...] = (),
) -> None:
    """Make a zip for each platform, or one without wheels for none; for one series of Blender, or for all."""
    with tempfile.TemporaryDirectory(dir=folder) as temporary:
        source, output = Path(temporary, "source"), Path(temporary, "zip")
        output.mkdir()
        stage(source, platforms, wheels, series)
        run(tool, "validate", source)
        if platforms:
            run(tool, "build", "--source-dir", source, "--output-dir", output, "--split-platforms")
        else:
            name = f"{manifest['id']}-{manifest['version']}-nowheels.zip"
            run(tool, "build", "--source-dir", source, "--output-filepath", output / name)
        mark = f"-blender{series[0].removesuffix('.0')}" if series else ""
        for path in sorted(output.iterdir()):
            print(shutil.move(path, folder / f"{path.stem}{mark}.zip"))


def host_platform() -> str:
    """This machine's platform by Blender's name, such as "linux-x64"."""
    system = platform.system().lower().replace("darwin", "macos")
    machine = platform.machine().lower()
    return f"{system}-{MACHINES.get(machine, machine)}"


def urls(project: Path = PROJECT) -> dict[str, str]:
    """The addresses of what is published, by their names in pyproject.toml; none until somebody publishes."""
    return dict(tomllib.loads(project.read_text(encoding="utf-8"))["project"].get("urls", {}))


def wheel_platform(wheel: str) -> str:
    """The platform of a wheel, by Blender's name."""
    tag = Path(wheel).stem.rsplit("-", 1)[1]
    system = {"man": "linux", "win": "windows", "mac": "macos"}[tag[:3]]
    return f"{system}-{'arm64' if tag.endswith('arm64') else 'x64'}"


def packaging_tool() -> Path:
    """The path of Blender's command line for extensions, found without starting Blender."""
    spec = importlib.util.find_spec("bpy")
    if spec is not None and spec.origin is not None:
        found = Path(spec.origin).parent.glob("*/scripts/addons_core/bl_pkg/cli/blender_ext.py")
        if tool := next(found, None):
            return tool
    sys.exit("This Python has no bpy module, hence no Blender packaging tool: use `make zip`.")


def download(wheel: Path) -> None:
    """Fetch the wheel that this path names from PyPI, unless it is there."""
    if wheel.exists():
        return
    print(f"Downloading {wheel.name}", file=sys.stderr)
    name, version, python, abi, tags = wheel.stem.split("-")
    wheel.parent.mkdir(exist_ok=True)
    # The file goes into its own folder first, because a part of a wheel must not pass for a wheel later.
    with tempfile.TemporaryDirectory(dir=wheel.parent) as folder:
        command = [sys.executable, "-m", "pip", "download", "--quiet", "--no-deps"]
        command += ["--only-binary=:all:", "--implementation", "cp", "--abi", abi]
        command += ["--python-version", python.removeprefix("cp"), "--dest", folder]
        for tag in tags.split("."):
            command += ["--platform", tag]
        status = subprocess.run([*command, f"{name}=={version}"], stdout=sys.stderr).returncode
        if status or not Path(folder, wheel.name).exists():
            sys.exit(f"Downloading {wheel.name} with pip failed; is there a network connection?")
        Path(folder, wheel.name).replace(wheel)


def stage(folder: Path, platforms: list[str], wheels: list[str], series: tuple[str, ...] = ()) -> None:
    """Copy what ships to `folder`, with a manifest of these platforms, wheels and Blenders only."""
    for name in SHIPPED:
        if (ROOT / name).is_dir():
            shutil.copytree(ROOT / name, folder / name)
        else:
            folder.mkdir(exist_ok=True)
            shutil.copy2(ROOT / name, folder)
    write_manual(folder / "manual")
    for wheel in wheels:
        (folder / wheel).parent.mkdir(exist_ok=True)
        shutil.copy2(ROOT / wheel, folder / wheel)

    text = MANIFEST.read_text(encoding="utf-8")
    expected = tomllib.loads(text)
    for key, values in (("platforms", platforms), ("wheels", wheels)):
        array = f"{key} = {json.dumps(values)}\n" if values else ""
        text = re.sub(rf"^{key} = \[[^]]*\]\n", array, text, flags=re.MULTILINE)
        expected[key] = values
    if website := urls().get("Documentation"):
        text = re.sub(r"^license = ", f'website = "{website}"\nlicense = ', text, flags=re.MULTILINE)
        expected["website"] = website
    limits = dict(zip(("blender_version_min", "blender_version_max"), series, strict=False))
    if limits:
        lines = "".join(f'{key} = "{value}"\n' for key, value in limits.items())
        text = re.sub(r"^blender_version_min = .*\n", lines, text, flags=re.MULTILINE)
        expected |= limits
    # The text is edited so that all else stays as it is written. This notices if an edit has missed.
    if tomllib.loads(text) != {key: value for key, value in expected.items() if value}:
        sys.exit(f"{MANIFEST.name}: platforms and wheels must be plain arrays, `key = [...]`.")
    (folder / MANIFEST.name).write_text(text, encoding="utf-8")


def write_manual(folder: Path) -> None:
    """Write the manual to `folder` as pages of HTML, with the pictures they show."""
    folder.mkdir()
    for name in MANUAL:
        text = shipped_links((DOCS / f"{name}.md").read_text(encoding="utf-8"))
        body = markdown.markdown(text, extensions=["tables", "fenced_code", "toc"])
        (folder / f"{name}.html").write_text(PAGE.format(body), encoding="utf-8")
        for picture in re.findall(r"!\[.*?\]\((.+?)\)", text):
            shutil.copy2(DOCS / picture, folder)
        # Windows opens files without the part after "#", so each section has a page that leads to it.
        for section in set(re.findall(r'<h[23] id="(.+?)"', body)) - set(MANUAL):
            (folder / f"{section}.html").write_text(LEAD.format(name, section), encoding="utf-8")


def shipped_links(text: str) -> str:
    """Markdown whose links to pages of the docs lead to HTML, or are plain words where no page ships."""

    def lead(found: re.Match[str]) -> str:
        words, name, anchor = found.groups()
        return f"[{words}]({name}.html{anchor})" if name in MANUAL else words

    return re.sub(r"(?<!!)\[([^\]]+)\]\((\w+)\.md(#[\w-]+|)\)", lead, text)


def run(tool: Path, *arguments: str | Path) -> None:
    """Run Blender's tool; what it prints is shown only when it fails."""
    result = subprocess.run(
        [sys.executable, tool, *arguments],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )
    if result.returncode:
        sys.exit(f"{result.stdout.rstrip()}\nBlender's packaging tool refused to {arguments[0]}.")


if __name__ == "__main__":
    main()
