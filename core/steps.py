# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Generators that do long work in short steps and return its result."""

from collections.abc import Generator
from typing import Any, TypeVar

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
