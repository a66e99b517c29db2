# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The options of a fit."""

from dataclasses import dataclass

import numpy as np

from ..arguments import number_or_none, set_fields, shown
from ..paper.by_method import PAPER_METHODS, SOLVERS

METHODS = ("bayes", *PAPER_METHODS)


@dataclass(frozen=True)
class FitOptions:
    """The options of `reconstruct`, checked.

    method : one of METHODS
    degree : 2 to 6, or "auto"
    noise : the standard deviation that a contact has at least, a length; None for the contours' own
    weight : lambda L^2 of "tagc" and "quadratic-variation"; None for 1000 and 1e5
    solver : one of SOLVERS
    point_std : the standard deviation of the point along the normal, a length; None to find it
    radius : without contours, contacts count up to this distance from the point; None for all

    Raises ValueError for bad ones.
    """

    method: str = "bayes"
    degree: int | str = "auto"
    noise: float | None = None
    point_std: float | None = None
    weight: float | None = None
    solver: str = "fast"
    radius: float | None = None

    def __post_init__(self) -> None:
        for name, choices in (("method", METHODS), ("solver", SOLVERS)):
            value = getattr(self, name)
            if not isinstance(value, str) or value not in choices:
                raise ValueError(f"{name}: expected one of {', '.join(choices)}, got {shown(value)}")
        degree = self.degree
        if not isinstance(degree, int | np.integer | str) or degree not in ("auto", 2, 3, 4, 5, 6):
            raise ValueError(f'degree: expected a whole number from 2 to 6 or "auto", got {shown(degree)}')
        set_fields(
            self,
            degree=degree if isinstance(degree, str) else int(degree),
            noise=number_or_none("noise", self.noise, least=0.0),
            point_std=number_or_none("point_std", self.point_std, least=0.0),
            weight=number_or_none("weight", self.weight, above=0.0),
            radius=number_or_none("radius", self.radius, above=0.0),
        )
