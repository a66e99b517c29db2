# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""How whole objects are touched: the options of `whole`, checked."""

from dataclasses import asdict, dataclass
from typing import Any

from .options import Length, Lengths, require_seed


@dataclass(frozen=True)
class WholeOptions(Lengths):
    """Everything besides the object on which surfaces depend; an object is one task and one row.

    tolerance : mean deviation of the height to reach for each patch, a length as in Options, or None
    most : largest number of touches of an object
    """

    seed: int
    noise: str
    tolerance: str | None
    most: int

    command, parts, touches = "whole", "surfaces", 1

    def __post_init__(self) -> None:
        """Raises ValueError, with a sentence, for options that no object can be touched with."""
        require_seed(self.seed)
        if self.tolerance is None:
            return
        tolerance, noise = Length.of(self.tolerance), Length.of(self.noise)
        if tolerance.is_share == noise.is_share and tolerance.value < noise.value:
            raise ValueError(f"tolerance: expected the noise {noise} or more, got {tolerance}")

    def to_dict(self) -> dict[str, Any]:
        """The options as plain values."""
        return asdict(self)

    def blocks(self) -> range:
        """The number of the only task."""
        return range(1)

    def numbers(self, block: int) -> range:
        """The number of its only row."""
        return range(1)
