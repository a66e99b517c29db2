# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The samples for Python alone of README.md and docs/ run page by page, on contacts with normals and
without, in one file and in several."""

import re
import shutil
import sys
from importlib.util import find_spec
from pathlib import Path

import pytest

import core

ROOT = Path(__file__).resolve().parents[1]
PAGES = ("README.md", "docs/contacts.md", "docs/scripting.md", "docs/whole_objects.md")
BLOCK = re.compile(r"^```python\n(.*?)^```", re.DOTALL | re.MULTILINE)


def without_normals(path):
    """Contacts without normals show no outer side, so the file names it."""
    rows = path.read_text().splitlines()
    found = [row if row.startswith("#") else ",".join(row.split(",")[:4]) for row in rows]
    path.write_text("\n".join([found[0], "# outward 0 0 1", *found[1:]]))


def in_several_files(path):
    """Writes each curve and stroke once more, into a file of its own."""
    found = core.contacts_from_csv(path.read_text())
    for k, curve in enumerate((*found.contours, *found.strokes)):
        alone = found._replace(contours=[], strokes=(curve,))
        (path.parent / f"contacts_{k}.csv").write_text(core.contacts_to_csv(alone))


@pytest.mark.long
@pytest.mark.parametrize("change", [None, without_normals, in_several_files])
@pytest.mark.parametrize("page", PAGES)
def test_samples_run_with_normals_and_without(page, change, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setitem(sys.modules, "tactile_core", core)  # as pip installs it
    shutil.copytree(ROOT / "examples", tmp_path / "examples")
    if change:
        change(tmp_path / "examples" / "contacts.csv")
    scope = {}
    for code in BLOCK.findall((ROOT / page).read_text(encoding="utf-8")):
        # Samples of Blender are run by test_code_of_docs.py; trimesh is a peer of the charts only.
        if "import bpy" not in code and ("trimesh" not in code or find_spec("trimesh")):
            exec(compile(code, f"{page}, a sample", "exec"), scope)
    assert {"contacts", "felt"} & set(scope)
