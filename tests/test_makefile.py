# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What make installs in addition to Blender."""

import subprocess
from pathlib import Path

ROOT = Path(__file__).parents[1]


def test_peers_are_installed_one_by_one_with_their_markers_and_blender_s_numpy(tmp_path):
    stamp, ready = tmp_path / "peers", tmp_path / "ready"
    # This is newer than what the environment is made from, in whatever order a checkout wrote its files.
    ready.touch()
    command = ["make", f"PEERS={stamp}", f"READY={ready}", "VENV_PY=echo", str(stamp)]
    printed = subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True).stdout
    installed = [line for line in printed.splitlines() if line.startswith("-m pip install")]
    lines = Path(ROOT, "benchmarks", "requirements.txt").read_text(encoding="utf-8").splitlines()
    wanted = [line for line in lines if line and not line.startswith("#")]
    assert [line.split("tools/requirements.txt ")[1] for line in installed] == wanted
    assert any("python_version" in line for line in wanted)
