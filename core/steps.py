# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Generators that do long work in short steps and return its result."""

from collections.abc import Callable, Generator
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

R = TypeVar("R")


def result_of(steps: Generator[Any, Any, R]) -> R:
    """What steps return once they are done."""
    try:
        while True:
            next(steps)
    except StopIteration as end:
        return end.value


def part_of(steps: Generator[float, None, R], start: float, end: float) -> Generator[float, None, R]:
    """Yields the progress of steps as that from `start` to `end` of longer work; returns their result."""
    while True:
        try:
            share = next(steps)
        except StopIteration as stop:
            return stop.value
        yield start + (end - start) * share


def chunked(
    function: Callable[..., tuple[Any, ...]], size: int, share: float, *arrays: NDArray[Any]
) -> Generator[float, None, tuple[Any, ...]]:
    """The arrays that a function returns for arrays of n rows, computed for `size` rows at a time.

    Yields `share` after each chunk and each array. The function is called once if there are no rows.
    """
    parts, chunks = [], []
    for start in range(0, max(len(arrays[0]), 1), size):
        parts.append(function(*(array[start : start + size] for array in arrays)))
        yield share
    for values in zip(*parts, strict=True):
        chunks.append(np.concatenate(values))
        yield share
    return tuple(chunks)
