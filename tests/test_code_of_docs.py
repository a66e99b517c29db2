# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Every sample of code in README.md and docs/ runs as it is written, page by page, in order, and prints what
the page shows below it.

The examples lie in the folder that they run in. Suzanne is in the scene.
"""

import re
import shlex
import shutil
import sys
from pathlib import Path

import pytest

pytest.importorskip("bpy", reason="needs Blender as a Python module: run make test")

import core

ROOT = Path(__file__).resolve().parents[1]
BLOCK = re.compile(r"^( *)```(python|sh|)\n(.*?)^ *```", re.DOTALL | re.MULTILINE)
PAGES = {
    path.relative_to(ROOT).as_posix(): found
    for path in (ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md")))
    if (found := [(kind, code) for _, kind, code in BLOCK.findall(path.read_text(encoding="utf-8"))])
}
# Other commands: make and benchmarks are looked up by test_docs.py, examples/ is run by test_demo.py.
ELSEWHERE = ("make ", "sudo apt install ", "git clone ", "python -m benchmarks.", "python examples/")
ELSEWHERE += (
    "export TACTILE_SCANS=",
    "python -m cluster ",
    "blender --background scene.blend --python examples/",
)


def suzanne(bpy):
    """Makes a scene with Suzanne, active, and a copy named Scan; returns a place on her forehead."""
    bpy.ops.wm.read_homefile(use_empty=True)
    bpy.ops.mesh.primitive_monkey_add(size=2.0)
    obj, place = bpy.context.object, (0.32, -0.19, 0.84)
    obj.modifiers.new("Subdivision", "SUBSURF").levels = 2
    bpy.context.scene.cursor.location = place
    scan = obj.copy()
    scan.name = "Scan"
    bpy.context.scene.collection.objects.link(scan)
    return place


@pytest.fixture
def folder(empty, tmp_path, monkeypatch):
    """The files that samples read, in the current folder, and the scene that is open."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setitem(sys.modules, "tactile_core", core)  # as pip installs it
    shutil.copytree(ROOT / "examples", tmp_path / "examples")
    suzanne(empty)
    return tmp_path


def commands(code):
    """The commands of a sample for the shell, with its loops unrolled."""
    lines = iter(line.strip() for line in code.splitlines() if line.strip())
    for line in lines:
        loop = re.fullmatch(r"for (\w+) in (.*); do", line)
        if not loop:
            yield line
            continue
        body = []
        while (line := next(lines)) != "done":
            body.append(line)
        for value in loop[2].split():
            yield from (each.replace(f"${loop[1]}", value) for each in body)


def run_shell(bpy, command, line):
    if line.startswith(ELSEWHERE):
        return
    words = shlex.split(line)
    at = words.index("-c")
    assert words[0] == "blender" and words[at + 1] == "tactile", line
    bpy.ops.wm.read_homefile(use_empty=True)  # each line starts a Blender of its own
    if words[1] == "-b":
        bpy.ops.wm.open_mainfile(filepath=str(Path(words[2]).resolve()))
    code, out, err = command(*words[at + 2 :])
    # The contacts that are joined are on the top of a pebble, so their surface is open.
    assert code == (3 if words[at + 2] == "join" else 0), f"{line}\n{out}\n{err}"
    return out


NUMBER = re.compile(r"-?\b\d+(?:\.\d+)?(?:e[+-]\d+)?")


def assert_printed(shown, out):
    """Each line is printed with the same words and about the same numbers: other versions round otherwise."""
    printed = {NUMBER.sub("#", line): line for line in out.splitlines()}
    for line in shown.splitlines():
        words = NUMBER.sub("#", line)
        assert words in printed, f"{line}\n{out}"
        numbers = [[float(n) for n in NUMBER.findall(each)] for each in (line, printed[words])]
        assert numbers[0] == pytest.approx(numbers[1], rel=0.2), f"{line}\n{printed[words]}"


@pytest.mark.long
@pytest.mark.parametrize("page", PAGES)
def test_samples_run(page, empty, command, folder):
    scope, out = {}, None
    for kind, code in PAGES[page]:
        if kind == "python":
            # Commands for the shell before it leave the scene in the unit of their file.
            empty.context.scene.unit_settings.system = "METRIC"
            empty.context.scene.unit_settings.scale_length = 1.0
            exec(compile(code, f"{page}, a sample", "exec"), scope)
        elif kind == "sh":
            out = "".join(run_shell(empty, command, line) or "" for line in commands(code))
        elif out and not code.startswith("#"):  # the sample of a file has its own test
            assert_printed(code, out)


def test_the_sample_of_the_format_is_read(extension, tmp_path):
    text = (ROOT / "docs" / "contacts.md").read_text(encoding="utf-8")
    (sample,) = re.findall(r"^```\n(# Tactile Patch contacts.*?)^```", text, re.DOTALL | re.MULTILINE)
    (tmp_path / "sample.csv").write_text(sample)
    found = extension.tactile_addon.files.measured.read([str(tmp_path / "sample.csv")], "FILE", 1.0)
    assert found.unit == "mm"
    assert [len(curve.points) for curve in found.contours] == [5, 5, 5]
    r = extension.core.reconstruct(found.point, found.contours, outward=found.outward)
    assert r.status == "ok", r.message
