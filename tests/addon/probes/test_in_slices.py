# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Work in slices between a window's events, without a window."""

from time import perf_counter
from types import SimpleNamespace

import pytest

pytest.importorskip("bpy", reason="needs Blender as a Python module: run make test")


def test_a_slice_ends_when_its_time_is_over_and_the_next_one_goes_on(extension):
    done = []
    operator = extension.tactile_addon.probes.in_slices.InSlices()
    operator._steps = (done.append(number) for number in range(3))
    assert not operator._advance(None, -1.0)  # its time is over after the first step
    assert done == [0]
    assert not operator._advance(None, -1.0)
    assert operator._advance(None, 60.0)
    assert done == [0, 1, 2]


def test_a_slice_is_as_long_as_the_redraw_before_it(extension):
    in_slices = extension.tactile_addon.probes.in_slices
    operator = in_slices.InSlices()
    assert operator._slice() == in_slices.LONGEST_SLICE  # There was none before.
    operator._worked = perf_counter() - 0.5 * in_slices.LONGEST_SLICE
    assert 0.5 * in_slices.LONGEST_SLICE <= operator._slice() <= in_slices.LONGEST_SLICE
    operator._worked = perf_counter() + 60.0
    assert operator._slice() == in_slices.TIMER_SLICE


def test_the_time_that_is_left_is_said_once_a_little_is_done(extension):
    operator = extension.tactile_addon.probes.in_slices.InSlices()
    operator._begun = perf_counter() - 10.0
    for share, words in ((None, "Joining"), (0.01, "Joining"), (0.25, "Joining, 30 s left")):
        operator._done = lambda share=share: ("Joining", share)
        assert operator._said() == (words, share)


def test_the_button_of_the_panel_asks_the_latest_to_stop(extension, empty):
    in_slices = extension.tactile_addon.probes.in_slices
    first, latest = in_slices.InSlices(), in_slices.InSlices()
    in_slices._running[:] = [first, latest]
    assert empty.ops.tactile.stop() == {"FINISHED"}
    in_slices._running.clear()
    assert (first._is_asked, latest._is_asked) == (False, True)
    assert empty.ops.tactile.stop() == {"FINISHED"}  # There is nothing to stop.


def test_a_part_of_the_panel_shows_only_what_runs_for_it(extension):
    in_slices, drawn = extension.tactile_addon.probes.in_slices, []
    layout = SimpleNamespace(
        progress=lambda **given: drawn.append(given["text"]), operator=lambda *_, **__: None
    )
    running = in_slices.InSlices()
    running._done, running.section = lambda: ("Stability Map", None), "map"
    in_slices._running[:] = [running]
    for section, words in (("object", []), ("map", ["Stability Map"]), (None, ["Stability Map"])):
        drawn.clear()
        in_slices.draw_running(layout, section)
        assert drawn == words
    in_slices._running.clear()
