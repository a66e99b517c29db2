# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The core by pip: the wheel in a new environment, without Blender, and README's lines there."""

import re
import shutil
import subprocess
import sys
import venv
import zipfile
from pathlib import Path

import pytest

from tools import release

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")


def run(*words, cwd):
    done = subprocess.run([str(word) for word in words], cwd=cwd, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    folder = tmp_path_factory.mktemp("wheel")
    run(sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", "--wheel-dir", folder, ROOT, cwd=folder)
    (path,) = folder.iterdir()
    return path


@pytest.mark.long
def test_the_wheel_is_the_core_and_nothing_else(wheel):
    with zipfile.ZipFile(wheel) as archive:
        names = {name for name in archive.namelist() if ".dist-info/" not in name}
        metadata = archive.read(next(n for n in archive.namelist() if n.endswith("METADATA"))).decode()
    there = [p for p in (ROOT / "core").rglob("*") if p.is_file() and "__pycache__" not in p.parts]
    assert names == {f"tactile_core/{p.relative_to(ROOT / 'core').as_posix()}" for p in there}
    assert "tactile_core/py.typed" in names
    for line in (
        f"Version: {release.manifest_version(ROOT)}",
        "Requires-Python: >=3.11",
        "Requires-Dist: numpy>=",
        "Requires-Dist: scipy>=",
    ):
        assert f"\n{line}" in metadata


@pytest.mark.long
def test_the_lines_of_the_readme_run_in_a_new_environment(wheel, tmp_path):
    venv.create(tmp_path / "env", with_pip=True)
    python = tmp_path / "env" / ("Scripts/python.exe" if sys.platform == "win32" else "bin/python")
    run(python, "-m", "pip", "install", "--quiet", wheel, cwd=tmp_path)
    (code,) = re.findall(r"^```python\n(.*?)^```", README, re.DOTALL | re.MULTILINE)
    shutil.copytree(ROOT / "examples", tmp_path / "examples")
    printed = run(python, "-W", "error", "-c", code, cwd=tmp_path)
    k1, k1_std, k2, k2_std = map(float, re.match(r"(\S+) \+- (\S+) (\S+) \+- (\S+) ok ", printed).groups())
    said = re.search(r"curvatures are (-0\.\d+) and (-0\.\d+) 1/mm", README)
    assert abs(k1 - float(said[1])) < 2.0 * k1_std
    assert abs(k2 - float(said[2])) < 2.0 * k2_std
