# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""examples/robot.py stops, goes on from its file and reaches the tolerance."""

import importlib.util
import re
import sys
from pathlib import Path

import pytest

import core

EXAMPLE = Path(__file__).parent.parent / "examples" / "robot.py"


@pytest.fixture
def robot(monkeypatch):
    monkeypatch.setitem(sys.modules, "tactile_core", core)  # as pip installs it
    spec = importlib.util.spec_from_file_location("robot", EXAMPLE)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.long
def test_the_robot_stops_goes_on_and_reaches_the_tolerance(robot, monkeypatch, tmp_path, capsys):
    path = tmp_path / "contacts.csv"
    given = ["robot.py", str(path), "--tolerance", "0.3"]
    monkeypatch.setattr(sys, "argv", [*given, "--touches", "4"])
    with pytest.raises(
        SystemExit, match="robot: stopped after 4 orders; the same command goes on from there"
    ):
        robot.main()
    stopped = len(core.contacts_from_csv(path.read_text()).strokes)
    assert 0 < stopped <= 12
    monkeypatch.setattr(sys, "argv", given)
    before = capsys.readouterr().out
    robot.main()
    text = capsys.readouterr().out
    assert text.startswith(f"{stopped // 3} touches: ")
    assert "The robot did not reach the object." in before + text
    assert re.search(r"The surface is closed(, and all|\. All but \d of \d+) contacts agree with it", text)
    off, within = re.search(r"The surface is (\S+) mm off the pebble; (\d+) %", text).groups()
    assert float(off) < 0.3
    assert int(within) >= 80
    touches = len(core.contacts_from_csv(path.read_text()).strokes) // 3
    start = robot.START, robot.OUTWARD
    atlas = core.explore_object(robot.Pebble(), *start, tolerance=0.3, noise=robot.NOISE, rng=0)
    # Contacts alone cannot be tapped between, so gaps are touched that a free finger only taps.
    assert touches <= 1.5 * len(atlas.patches)
