# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Lengths and curvatures in words, in the unit in which the scene shows lengths."""

import math
from collections.abc import Mapping
from typing import Any, TypeAlias

import bpy

from ... import core

Unit: TypeAlias = tuple[str, float]  # A name, which may be "", and the length in units of the world.
ADAPTIVE = {
    "METRIC": ("KILOMETERS", "METERS", "CENTIMETERS", "MILLIMETERS", "MICROMETERS"),
    "IMPERIAL": ("MILES", "FEET", "INCHES", "THOU"),
}
# Symbol and meters of each unit, by Blender's name.
METERS = dict(zip((*ADAPTIVE["METRIC"], *ADAPTIVE["IMPERIAL"]), core.UNIT_METERS.items(), strict=True))
# In an adaptive unit lengths are at least 1 or this, because few count micrometers or thous.
LEAST = {"MILLIMETERS": 1e-2, "INCHES": 1e-2}
PLAIN = 1e-6  # Numbers from here on have no exponent, although Python writes one below 1e-4.
SHARE = 0.1  # The unit suits this share of an object, which is about the radius of a patch.
ZERO = 1e-6  # A number below this, in units of the radius or the size, counts as 0.
SUPERSCRIPTS = {1: "", 2: "²"}


def unit_of(scene: bpy.types.Scene, size: float) -> Unit:
    """(name, length in units of the world) of the unit for a thing of this size; the name may be "".

    It is the scene's own unit, unless numbers would become very long.
    """
    settings = scene.unit_settings
    if settings.system == "NONE":
        return "", 1.0
    name: str = settings.length_unit
    meters = size * settings.scale_length * (1.0 + 1e-6)
    if name == "ADAPTIVE" or not 1e-1 <= meters / METERS[name][1] <= 1e4:
        names = ADAPTIVE[settings.system]
        name = next((n for n in names if LEAST.get(n, 1.0) * METERS[n][1] <= meters), names[-1])
    symbol, meters = METERS[name]
    return symbol, meters / settings.scale_length


def unit_of_report(report: Mapping[str, Any]) -> Unit:
    """The unit of all numbers of a patch, a map or a whole object, which is one for all of one object."""
    size = report.get("object_size") or report.get("size")
    return unit_of(bpy.context.scene, SHARE * size if size else report["radius"])


def say_of(report: Mapping[str, Any], value: float, power: int = 1, std: float | None = None) -> str:
    """A value in length^power in words, in the unit of a report."""
    return say(value, power, unit_of_report(report), std)


def say(value: float, power: int, unit: Unit, std: float | None = None) -> str:
    """A value in length^power in words, such as "0.0123 mm" or "-4.2 ± 0.3 1/mm²"."""
    scale = unit[1] ** power
    if std is None:
        return f"{_digits(value / scale)} {symbol(power, unit)}".strip()
    value, spread = known(value / scale, std / scale), float(f"{std / scale:.1g}")
    # Both have the same decimals.
    digits = f".{max(_decimals(spread), 0)}f" if PLAIN <= spread < 1.0 / PLAIN else ".3g"
    return f"{value:{digits}} ± {spread:{digits}} {symbol(power, unit)}".strip()


def _digits(number: float) -> str:
    """Three digits of a number, which has no exponent as long as few zeros do, so that eyes can compare."""
    is_short = PLAIN <= abs(number) < 1e-4
    return f"{float(f'{number:.3g}'):.8f}".rstrip("0") if is_short else f"{number:.3g}"


def rounded(value: float, power: int, size: float) -> float:
    """A value in length^power of a thing of this size; what single precision leaves of 0 is 0."""
    return value if abs(value) > ZERO * size**power else 0.0


def known(value: float, std: float) -> float:
    """The value, rounded to the place of the first digit of its standard deviation."""
    if not 0.0 < std < math.inf:
        return value
    return round(value, _decimals(std)) + 0.0  # -0.0 + 0.0 is 0.0.


def _decimals(std: float) -> int:
    """How many decimals it takes to the first digit of a standard deviation; below 0 before the point."""
    return -int(f"{std:.0e}".partition("e")[2])


def length(value: float) -> str:
    """A length in words for a message, in the unit of the open scene."""
    return say(value, 1, unit_of(bpy.context.scene, abs(value) if 0.0 < abs(value) < math.inf else 1.0))


def duration(seconds: float) -> str:
    """About how long something takes, in words."""
    return f"{rough(max(seconds, 1.0))} s" if seconds < 60.0 else f"{rough(seconds / 60.0)} min"


def rough(number: float) -> int:
    """A number with one significant digit, as an estimate has it."""
    return int(float(f"{number:.0e}"))


def symbol(power: int, unit: Unit) -> str:
    """The unit of length^power, such as "mm" or "1/mm²"; "" for a plain number or if lengths have no unit."""
    name = unit[0] if power else ""
    return f"1/{name}{SUPERSCRIPTS[-power]}" if name and power < 0 else name
