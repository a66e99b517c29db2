# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The samples of docs/scripting.md that read a data set run, wherever the packages they import are there."""

import re
from importlib.util import find_spec
from pathlib import Path

import pytest

PAGE = Path(__file__).parents[2] / "docs" / "scripting.md"
SAMPLES = [
    code
    for code in re.findall(r"^```py\n(.*?)^```", PAGE.read_text(encoding="utf-8"), re.DOTALL | re.MULTILINE)
    if "touches_of_scans" in code
]


@pytest.mark.parametrize("code", SAMPLES, ids=lambda code: re.search(r"import (pandas|torch)", code)[1])
def test_a_sample_reads_the_data_set(code, plain, tmp_path, monkeypatch, capsys):
    missing = [name for name in re.findall(r"^import (\w+)", code, re.MULTILINE) if find_spec(name) is None]
    if missing:
        pytest.skip(f"{', '.join(missing)} not installed")
    (tmp_path / "touches_of_scans").symlink_to(plain)
    monkeypatch.chdir(tmp_path)
    scope = {}
    exec(compile(code, PAGE.name, "exec"), scope)
    if "Touches" in scope:
        touches = list(scope["Touches"]())
        local, curvatures = touches[0]
        assert local.shape[1] == 3 and curvatures[0] <= curvatures[1]
        assert local[:, :2].norm(dim=1).max() == pytest.approx(1.0, abs=1e-6)
        loader = scope["torch"].utils.data.DataLoader(scope["Touches"](), batch_size=None, num_workers=2)
        assert len(list(loader)) == len(touches)  # the two workers read each touch once
    else:
        assert "pebble" in capsys.readouterr().out
