# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The sample scene and the presets are what the documentation says of them."""

from pathlib import Path
from types import SimpleNamespace

import pytest

pytest.importorskip("bpy", reason="needs Blender as a Python module: run make test")

from tools import sample

ROOT = Path(__file__).resolve().parents[1]
FOLDER = ROOT / "tactile_addon" / "presets"
PRESETS = sorted(FOLDER.rglob("*.py"))


def test_the_sample_opens_with_a_probe_whose_patch_is_good_and_follows(empty):
    assert sample.OUTPUT.stat().st_size < sample.LARGEST
    empty.ops.wm.open_mainfile(filepath=str(sample.OUTPUT))
    probe = empty.context.view_layer.objects.active
    assert probe.tactile_probe.is_probe
    (patch,) = (obj for obj in probe.children if "tactile" in obj)
    before = patch["tactile"].to_dict()
    assert before["status"] == "ok"
    assert before["k1"] < -0.5 < 0.05 < before["k2"]  # a saddle, as the note says
    assert "Tactile" in empty.data.objects["Note"].data.body
    assert empty.data.texts["Read Me"].as_string() == empty.data.objects["Note"].data.body
    probe.location.z -= 0.6  # down to the belly
    empty.context.view_layer.update()
    (patch,) = (obj for obj in probe.children if "tactile" in obj)
    after = patch["tactile"].to_dict()
    assert after["status"] == "ok"
    assert after["k1"] < -0.5
    assert after["k2"] < -0.5  # a cap


@pytest.mark.parametrize("path", PRESETS, ids=lambda path: path.parent.name)
def test_the_preset_is_the_papers_method_in_blenders_own_list(extension, empty, ball, path, monkeypatch):
    folder = path.parent.relative_to(FOLDER)
    listed = [Path(each) / path.name for each in empty.utils.preset_paths(str(folder))]
    (found,) = (each for each in listed if each.is_file() and "tactile_patch" in each.parts)
    settings = SimpleNamespace()
    with monkeypatch.context() as patched:
        patched.setattr(empty, "context", SimpleNamespace(active_operator=settings))
        empty.utils.execfile(str(found))
    operator = getattr(empty.ops.tactile, path.parent.name.removeprefix("tactile."))
    operator(target="Sphere", location=(0.3, -0.2, 1.96), **vars(settings))
    (patch,) = (obj for obj in empty.data.objects if "tactile" in obj)
    report = patch["tactile"].to_dict()
    assert (report["method"], report["degree"], len(report["planes"])) == ("tagc", 4, 3)
    assert [round(azimuth) for azimuth, _ in report["planes"]] == [0, 60, 120]
