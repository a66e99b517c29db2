# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What viewports show of objects of any size, without a window."""

import pytest

pytest.importorskip("bpy", reason="needs Blender as a Python module: run make test")


@pytest.mark.parametrize(
    ("size", "start", "end"), [(2.0, 0.01, 1000.0), (0.001, 2e-5, 1000.0), (1e3, 0.5, 2e4)]
)
def test_a_view_is_clipped_such_that_its_depths_suit_the_object(extension, empty, size, start, end):
    areas = [area for screen in empty.data.screens for area in screen.areas if area.type == "VIEW_3D"]
    if not areas:
        pytest.skip("this Blender has no screens without a window")
    for area in areas:
        area.spaces.active.clip_start, area.spaces.active.clip_end = 0.01, 1000.0
    empty.ops.mesh.primitive_cube_add(size=size)
    empty.ops.tactile.pick(location=(0.0, 0.0, 0.5 * size))
    for area in areas:
        found = area.spaces.active
        assert (found.clip_start, found.clip_end) == pytest.approx((start, end), rel=1e-3)
        found.clip_start = 1e-7
    empty.ops.tactile.pick(location=(0.0, 0.0, 0.5 * size), new=True)
    for area in areas:
        least = max(1e-6, 5e-4 * size)  # Blender itself has no less than a micrometer.
        assert area.spaces.active.clip_start == pytest.approx(least, rel=1e-3)
