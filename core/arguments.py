# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Checks of what callers pass in: a ValueError names the argument, what was wanted and what came."""

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]


def finite_array(name: str, value: ArrayLike, shape: tuple[int | None, ...]) -> Array:
    """`value` as a float64 array of `shape`, where None stands for any length.

    Raises ValueError where the shape differs or a number is not finite.
    """
    try:
        array = np.array(value, dtype=np.float64)
    except (TypeError, ValueError):
        raise ValueError(f"{name}: wanted numbers of shape {_shape_text(shape)}, got {value!r}") from None
    fits = len(shape) == array.ndim and all(
        size in (None, got) for size, got in zip(shape, array.shape, strict=True)
    )
    if not fits:
        raise ValueError(f"{name}: wanted shape {_shape_text(shape)}, got {array.shape}")
    if not np.isfinite(array).all():
        raise ValueError(f"{name}: wanted finite numbers, got NaN or infinity among them")
    return array


def _shape_text(shape: tuple[int | None, ...]) -> str:
    return "(" + ", ".join("n" if size is None else str(size) for size in shape) + ")"


def unit_vector(name: str, value: ArrayLike) -> Array:
    """`value` (3,) scaled to length 1. Raises ValueError where it has no direction."""
    vector = finite_array(name, value, (3,))
    largest = np.abs(vector).max()
    if largest == 0.0:
        raise ValueError(f"{name}: wanted a vector with a direction, got (0, 0, 0)")
    vector /= largest  # the square of a denormal or of 1e200 has no length
    return vector / math.sqrt(vector @ vector)


def number(name: str, value: float, *, above: float | None = None, least: float | None = None) -> float:
    """`value` as a float, above one bound or at least the other. Raises ValueError elsewhere."""
    try:
        result = float(value)
    except (TypeError, ValueError):
        raise ValueError(f"{name}: wanted {_number_text(above, least)}, got {value!r}") from None
    low = (above is not None and result <= above) or (least is not None and result < least)
    if low or not math.isfinite(result):
        raise ValueError(f"{name}: wanted {_number_text(above, least)}, got {result:g}")
    return result


def _number_text(above: float | None, least: float | None) -> str:
    wanted = "a finite number"
    if above is not None:
        wanted += f" above {above:g}"
    if least is not None:
        wanted += f" of {least:g} or more"
    return wanted
