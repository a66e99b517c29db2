# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Checks of arguments: a ValueError names the argument, what was expected and what was given."""

import math
import reprlib
from collections.abc import Iterable
from typing import Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]
T = TypeVar("T")
UNIT_ROUNDING = 4e-16  # Rounding changes a unit vector's length by at most this.
DECIMALS = 9  # Shares are compared to this decimal, so that rounding does not choose.
LARGEST, SMALLEST = 1e50, 1e-50  # The sixth powers of lengths between these are finite numbers.


def finite_array(
    name: str, value: ArrayLike, shape: tuple[int | None, ...], largest: float = math.inf
) -> Array:
    """`value` as a float64 array of `shape`, in which None stands for any length.

    Raises ValueError if the shape differs, or a number is masked, not finite or beyond +-`largest`.
    """
    if np.ma.is_masked(value):  # type: ignore[no-untyped-call]
        raise ValueError(f"{name}: expected numbers, got masked ones among them: remove them")
    try:
        array = np.array(value)
        if array.dtype.kind not in "biufO":  # It is text or complex.
            raise TypeError
        array = array.astype(np.float64, copy=False)
    except (TypeError, ValueError, OverflowError):
        raise ValueError(
            f"{name}: expected numbers of shape {_shape_text(shape)}, got {shown(value)}"
        ) from None
    fits = len(shape) == array.ndim and all(
        size in (None, got) for size, got in zip(shape, array.shape, strict=True)
    )
    if not fits:
        raise ValueError(f"{name}: expected shape {_shape_text(shape)}, got {array.shape}")
    size = np.abs(array).max(initial=0.0)
    if not math.isfinite(size):
        raise ValueError(f"{name}: expected finite numbers, got NaN or infinity among them")
    if size > largest:
        raise ValueError(
            f"{name}: expected numbers up to {largest:g}, got larger ones: use another unit of length"
        )
    return array


def set_fields(instance: object, **values: Any) -> None:
    """Writes checked values into fields of a frozen dataclass, whose own __setattr__ raises."""
    vars(instance).update(values)


def list_of(name: str, values: Iterable[T], kind: type[T]) -> list[T]:
    """The list of `values`. Raises ValueError if they are no list, or one of them is of another kind.

    One array (n, 3) in place of a list of such arrays is refused, because it would count as its rows, and
    one string, because it would count as its letters.
    """
    shape = getattr(values, "shape", ())
    if len(shape) == 2:
        raise ValueError(f"{name}: expected a list, got one array of shape {shape}: put it into a list")
    try:
        items = None if isinstance(values, str) else list(values)
    except TypeError:
        items = None
    if items is None:
        raise ValueError(f"{name}: expected a list, got {shown(values)}")
    for value in items:
        if not isinstance(value, kind):
            raise ValueError(f"{name}: expected a list of {kind.__name__}, got {shown(value)} in it")
    return items


def shown(value: object) -> str:
    """Any value in a line, cut short if it is long."""
    return " ".join(reprlib.repr(value).split())


def many(count: int, one: str, several: str) -> str:
    """A count with its noun in a message, as in "1 touch"."""
    return f"{count} {one if count == 1 else several}"


def _shape_text(shape: tuple[int | None, ...]) -> str:
    return "(" + ", ".join("n" if size is None else str(size) for size in shape) + ")"


def unit_vector(name: str, value: ArrayLike) -> Array:
    """`value` (3,) scaled to length 1. Raises ValueError if it has no direction."""
    v = finite_array(name, value, (3,))
    if abs(math.hypot(*v) - 1.0) <= UNIT_ROUNDING:  # Scaling again would change its last bit.
        return v
    if not v.any():
        raise ValueError(f"{name}: expected a vector with a direction, got (0, 0, 0)")
    v /= np.abs(v).max()  # The squares of 1e200 and of denormal numbers would be lost.
    return v / math.hypot(*v)


def unit_vectors(name: str, vectors: Array) -> Array:
    """Finite `vectors` (n, 3) scaled to length 1. Raises ValueError if one of them has no direction."""
    largest = np.abs(vectors).max(axis=1, keepdims=True, initial=0.0)
    if not largest.all():
        raise ValueError(f"{name}: expected vectors with a direction, got (0, 0, 0) among them: remove them")
    # The squares of 1e200 and of denormal numbers would be lost.
    scaled = vectors / largest
    return scaled / np.linalg.norm(scaled, axis=1, keepdims=True)


def number(name: str, value: float, *, above: float | None = None, least: float | None = None) -> float:
    """`value` as a float that is above one bound, or at least the other. Raises ValueError if it is not.

    What is to be above 0 is SMALLEST or more, so that its shares are above 0, too.
    """
    try:
        if getattr(value, "ndim", 0) or isinstance(value, np.complexfloating | np.ma.MaskedArray):
            raise TypeError
        result = float(value)
    except (TypeError, ValueError, OverflowError):
        raise ValueError(f"{name}: expected {_number_text(above, least)}, got {shown(value)}") from None
    low = (above is not None and result <= above) or (least is not None and result < least)
    if low or not math.isfinite(result):
        raise ValueError(f"{name}: expected {_number_text(above, least)}, got {result:g}")
    if abs(result) > LARGEST:
        raise ValueError(f"{name}: expected a number up to {LARGEST:g}, got {result:g}")
    if above == 0.0 and result < SMALLEST:
        raise ValueError(f"{name}: expected a number of {SMALLEST:g} or more, got {result:g}")
    return result


def number_or_none(
    name: str, value: float | None, *, above: float | None = None, least: float | None = None
) -> float | None:
    """None for None, and for a value what `number` returns."""
    return None if value is None else number(name, value, above=above, least=least)


def _number_text(above: float | None, least: float | None) -> str:
    wanted = "a finite number"
    if above is not None:
        wanted += f" above {above:g}"
    if least is not None:
        wanted += f" of {least:g} or more"
    return wanted
