# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The options of a touch that chooses what is not given."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ..arguments import list_of, number, number_or_none, set_fields
from ..contours.contour import SamplingPlane
from ..contours.tracking import generator_of
from ..reconstruction.options import FitOptions

MOST_EVEN = 24  # At most this many planes are laid out evenly.


def planes_of(planes: int | Sequence[SamplingPlane]) -> tuple[SamplingPlane, ...]:
    """This many evenly spread planes, or the planes that are given. Raises ValueError for neither."""
    if isinstance(planes, int | np.integer):
        is_possible = 3 <= planes <= MOST_EVEN
        chosen = tuple(SamplingPlane(math.pi * i / planes) for i in range(planes)) if is_possible else ()
    else:
        chosen = tuple(list_of("planes", planes, SamplingPlane))
    if not chosen:
        raise ValueError(f"planes: expected 3 to {MOST_EVEN}, or sampling planes, got {planes}")
    return chosen


@dataclass(frozen=True, eq=False)
class ExplorationOptions:
    """The options of `explore`, checked. Raises ValueError for bad ones.

    planes : sampling planes
    farthest, largest_std, tolerance : lengths, or None, as in `explore`
    most_planes : planes are added until there are this many
    extent, step : lengths; None or "auto" if the touch chooses them
    noise, rng, tangent : as in `track`
    method, degree, weight, solver : as in `reconstruct`
    """

    planes: Sequence[SamplingPlane] = planes_of(3)
    farthest: float | None = None
    largest_std: float | None = None
    tolerance: float | None = None
    most_planes: float = 6.0
    extent: float | None = None
    step: float | None = None
    noise: float = 0.0
    rng: np.random.Generator | int | None = None
    tangent: ArrayLike | None = None
    method: str = "bayes"
    degree: int | str = "auto"
    weight: float | None = None
    solver: str = "fast"

    def __post_init__(self) -> None:
        generator_of(self.rng)
        _ = self.fit
        extent, step = _length("extent", self.extent), _length("step", self.step)
        if extent and step and step > extent:
            raise ValueError(f"step: expected no more than the extent {extent:g}, got {step:g}")
        set_fields(
            self,
            planes=planes_of(self.planes),
            extent=extent,
            step=step,
            farthest=extent or _length("farthest", self.farthest),
            largest_std=_length("largest_std", self.largest_std),
            tolerance=number_or_none("tolerance", self.tolerance, least=0.0),
            most_planes=number("most_planes", self.most_planes, least=3.0),
            noise=number("noise", self.noise, least=0.0),
        )

    @property
    def fit(self) -> FitOptions:
        """The options of the fit that is returned. The contours have their own noise."""
        return FitOptions(self.method, self.degree, None, None, self.weight, self.solver)


def _length(name: str, length: float | str | None) -> float | None:
    """The length checked, or None for None and "auto"."""
    automatic = length is None or (isinstance(length, str) and length == "auto")
    return None if automatic else number(name, length, above=0.0)  # type: ignore[arg-type]
