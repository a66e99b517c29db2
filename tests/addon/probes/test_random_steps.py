# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Random sequences of what people do: after each a patch agrees with a fresh touch or says it does not.

TACTILE_STEPS=1000 TACTILE_SEED=... takes more steps than the 50 of each run, with other dice.
"""

import os
import random

import pytest

bpy = pytest.importorskip("bpy", reason="needs Blender as a Python module: run make test")
import steps_at_random as steps

STEPS, SEED = int(os.environ.get("TACTILE_STEPS", "50")), int(os.environ.get("TACTILE_SEED", "0"))


def tidy(extension):
    """Does what Blender does by itself in a window, but not here."""
    bpy.context.view_layer.update()
    extension.tactile_addon.probes.deleted.remove()
    bpy.context.view_layer.update()


@pytest.mark.long
@pytest.mark.parametrize("seed", [SEED, SEED + 1])
def test_after_any_steps_all_agree_or_the_patch_says_that_it_is_outdated(
    empty, extension, tmp_path, capfd, seed
):
    dice, path, taken = random.Random(seed), str(tmp_path / "saved.blend"), []
    steps.begin()
    tidy(extension)
    for _ in range(STEPS):
        taken.append(steps.choose(dice))
        if taken[-1] == steps.RELOAD:
            empty.ops.wm.save_as_mainfile(filepath=path)
            empty.ops.wm.open_mainfile(filepath=path)
            for obj in empty.context.scene.objects:  # a window updates what it shows
                obj.update_tag()
        else:
            steps.take(taken[-1], dice)
        tidy(extension)
        assert steps.faults() == [], f"after {len(taken)} steps with the seed {seed}: {taken[-5:]}"
    assert "Traceback" not in "".join(capfd.readouterr())
