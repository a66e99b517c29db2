# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""How objects are touched, or touched all over: options, checked, and their lengths on one object."""

import math
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from ..extension import core

LARGEST_SEED = 2**63 - 1  # The column of seeds has 64 bits.


@dataclass(frozen=True)
class Length:
    """A length in the object's unit, or a share of its size: the longest edge of its bounding box."""

    value: float
    is_share: bool

    @classmethod
    def of(cls, text: str) -> "Length":
        """Reads words such as 0.002 or 1.5%. Raises ValueError for others."""
        number = text.strip().removesuffix("%")
        try:
            value = float(number)
        except ValueError:
            value = math.nan
        if not 0.0 <= value < math.inf:
            raise ValueError(
                f"expected a length such as 0.002, or a share of the object such as 1.5%, got {text}"
            )
        return cls(value / 100.0, True) if text.strip().endswith("%") else cls(value, False)

    def on(self, size: float) -> float:
        """The length on an object of this size."""
        return self.value * size if self.is_share else self.value

    def __str__(self) -> str:
        return f"{100.0 * self.value:.12g}%" if self.is_share else f"{self.value:.12g}"


class _Common:
    """What options of both commands have: plain values, of which lengths are words, and a seed."""

    def to_dict(self) -> dict[str, Any]:
        """The options as plain values."""
        return asdict(self)  # type: ignore[call-overload]

    def length(self, name: str, size: float) -> float | None:
        """One of the lengths on an object of this size, or None if the surface chooses it."""
        words = getattr(self, name)
        return None if words is None else Length.of(words).on(size)


def _require_seed(seed: int) -> None:
    """Raises ValueError, with a sentence, for a seed that the column of seeds does not hold."""
    if not 0 <= seed <= LARGEST_SEED:
        bound = "of 0 or more" if seed < 0 else f"up to {LARGEST_SEED}"
        raise ValueError(f"seed: expected a number {bound}, got {seed}")


@dataclass(frozen=True)
class Options(_Common):
    """Everything besides the object on which rows depend; lengths are words, see Length, None to be chosen.

    touches : number of touches of each object
    block : number of touches of a task, which fill one file
    azimuths, tilts : of the sampling planes, in degrees
    tolerance : mean deviation of the height to reach by adding planes; None adds none
    """

    touches: int
    block: int
    seed: int
    azimuths: list[float]
    tilts: list[float]
    extent: str | None
    step: str | None
    noise: str
    tolerance: str | None
    method: str
    degree: str
    weight: float | None
    solver: str

    command, parts = "touch", "touches"

    def __post_init__(self) -> None:
        """Raises ValueError, with a sentence, for options that no touch can have."""
        _require_seed(self.seed)
        for name in ("touches", "block"):
            if getattr(self, name) < 1:
                raise ValueError(f"{name}: expected a number of 1 or more, got {getattr(self, name)}")
        if len(self.tilts) != len(self.azimuths):
            raise ValueError(
                f"tilts: expected as many as there are planes, {len(self.azimuths)}, got {len(self.tilts)}"
            )
        self._rehearse()

    def planes(self) -> list[Any]:
        """The sampling planes."""
        pairs = zip(self.azimuths, self.tilts, strict=True)
        return [core.SamplingPlane(math.radians(a), math.radians(t)) for a, t in pairs]

    def fit(self) -> dict[str, Any]:
        """The arguments of core.reconstruct."""
        degree = self.degree if self.degree == "auto" else int(self.degree)
        return {"method": self.method, "degree": degree, "weight": self.weight, "solver": self.solver}

    def exploration(self, size: float) -> dict[str, Any]:
        """The arguments of core.explore_many besides places, for an object of this size."""
        return {
            "extent": self.length("extent", size) or "auto",
            "step": self.length("step", size) or "auto",
            "noise": self.length("noise", size),
            "tolerance": self.length("tolerance", size),
            **self.fit(),
        }

    def blocks(self) -> range:
        """The numbers of an object's blocks."""
        return range(-(-self.touches // self.block))

    def numbers(self, block: int) -> range:
        """The numbers of the touches of a block."""
        return range(block * self.block, min((block + 1) * self.block, self.touches))

    def _rehearse(self) -> None:
        """Raises ValueError if not even a plane could be rebuilt from its own curves."""
        up, along = (0.0, 0.0, 1.0), np.linspace(-1.0, 1.0, 21)
        axes = [plane.axes(up) for plane in self.planes()]
        contours = [core.Contour(np.outer(along, a[:, 0]), plane_normal=a[:, 2]) for a in axes]
        core.reconstruct(np.zeros(3), contours, outward=up, **self.fit())


@dataclass(frozen=True)
class WholeOptions(_Common):
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
        _require_seed(self.seed)
        if self.tolerance is None:
            return
        tolerance, noise = Length.of(self.tolerance), Length.of(self.noise)
        if tolerance.is_share == noise.is_share and tolerance.value < noise.value:
            raise ValueError(f"tolerance: expected the noise {noise} or more, got {tolerance}")

    def blocks(self) -> range:
        """The number of the only task."""
        return range(1)

    def numbers(self, block: int) -> range:
        """The number of its only row."""
        return range(1)
