# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What the comments of a table state about its contacts: the unit, the reference point, noise, a ball."""

import re
from collections.abc import Iterator
from typing import Any

from ..arguments import LARGEST
from . import rows

FORMAT_VERSION = 3
TITLE = "Tactile Patch contacts"
# The length of each unit in meters.
UNIT_METERS = {
    "km": 1e3,
    "m": 1.0,
    "cm": 1e-2,
    "mm": 1e-3,
    "µm": 1e-6,
    "mi": 1609.344,
    "ft": 0.3048,
    "in": 0.0254,
    "thou": 2.54e-5,
}
NO_UNIT = "no unit"
VECTOR_KEYS, CURVE_KEYS = ("point", "outward"), ("noise", "normal_std", "ball")
KEYS = (*VECTOR_KEYS, *CURVE_KEYS)
# A spreadsheet may have put separators into comments, and at their ends, and quotes around words.
COMMENT = re.compile(r"\n[ \t\"]*(?:#|//)[^\w\n]*([^\n]*)")
VERSION_AND_UNIT = re.compile(
    TITLE + r"\W*version\s*([^\s,;|]*)(?:\W*lengths in ([^,;|\t]*))?", re.IGNORECASE
)
UNIT = re.compile(r"(?:lengths in|(?:length )?units?)[\s:=|,;]+([^\s,;|]+)[\s,;|]*$", re.IGNORECASE)
KEY = re.compile(rf"({'|'.join(KEYS)})(?=[\s,;:=|]|$)", re.IGNORECASE)
LIKE_A_KEY = re.compile(r"(point|outward|noise|normal|ball)(?![a-z])", re.IGNORECASE)
SEPARATORS = re.compile(r"[\s;:=|]+")


def comments(text: str) -> Iterator[tuple[int, str, int]]:
    """(line number, words without the marks, place of the next line) of each comment."""
    number, place = 1, 0
    for comment in COMMENT.finditer("\n" + text):
        number += text.count("\n", place, comment.start())
        place = comment.start()
        yield number, comment[1].replace('"', " "), comment.end()


def stated(name: str, text: str) -> tuple[str, dict[str, Any]]:
    """The unit of the title, or "", and the values of all other comments by key.

    A comment that begins with a key and has digits, or is below the title, is read or refused, and so is one
    that is a unit; others are left to other programs. Raises ValueError with the line.
    """
    unit, values, is_titled = "", dict[str, Any](), False
    for number, comment, _ in comments(text):
        at = f"{name}, line {number}"
        title, like = VERSION_AND_UNIT.match(comment), LIKE_A_KEY.match(comment)
        lengths = UNIT.match(comment)
        if title is not None:
            _require_known_version(at, title[1])
            unit, is_titled = _only_unit(at, unit, title[2] or ""), True
        elif lengths is not None:
            unit = _only_unit(at, unit, lengths[1])
        elif like is not None and (is_titled or re.search(r"\d", comment)):
            key, numbers = _key_and_numbers(at, comment, like[0].lower())
            if key in values:
                raise ValueError(f"{at}: expected {key} once, got it twice")
            values[key] = numbers
    return unit, values


def spelled(unit: str) -> str:
    """A unit as UNIT_METERS spells it."""
    unit = unit.lower().replace("μ", "µ")
    return "µm" if unit == "um" else unit


def unit_named(at: str, unit: str) -> str:
    """A unit as UNIT_METERS spells it, or "". Raises ValueError that names the place `at` for others."""
    unit = "" if unit.lower() == NO_UNIT else spelled(unit)
    if unit and unit not in UNIT_METERS:
        raise ValueError(f'{at}: expected a unit out of {", ".join(UNIT_METERS)}, got "{unit[:40]}"')
    return unit


def _only_unit(at: str, before: str, unit: str) -> str:
    """The unit of this comment, or else of those before it. Raises ValueError if they differ."""
    named = unit_named(at, unit.strip())
    if named and before not in ("", named):
        raise ValueError(f"{at}: expected lengths in {before}, as a comment above says, got {named}")
    return named or before


def _key_and_numbers(at: str, comment: str, like: str) -> tuple[str, list[float | None]]:
    """The key and the numbers of a comment that begins like a key. Raises ValueError if it has none."""
    key = KEY.match(comment)
    if key is None:
        wanted = next(key for key in KEYS if key.startswith(like))
        raise ValueError(
            f'{at}: expected "# {wanted}" and its values, got "{comment[:40].strip()}": correct this, or '
            "begin the comment with another word"
        )
    name, words = key[0].lower(), SEPARATORS.split(comment[key.end() :])
    words = [word for word in (word.strip(",") for word in words) if word]
    if name in VECTOR_KEYS and len(words) != 3:
        raise ValueError(f"{at}: expected 3 numbers for {name}, got {len(words)}")
    if not words:
        raise ValueError(f"{at}: expected numbers for {name}, got none")
    if name in VECTOR_KEYS:
        return name, [rows.number_of(f'{at}, "{name}"', word, LARGEST) for word in words]
    return name, [_nonnegative_or_none(f'{at}, "{name}"', word) for word in words]


def _nonnegative_or_none(at: str, word: str) -> float | None:
    """The number of 0 or more in a word, or None for "-"."""
    std = None if word == "-" else rows.number_of(at, word, LARGEST)
    if std is not None and std < 0.0:
        raise ValueError(f"{at}: expected a number of 0 or more, got {word[:40]}")
    return std


def _require_known_version(at: str, version: str) -> None:
    """Raises ValueError for a version of the format that is not known."""
    if not version.isdecimal() or int(version) > FORMAT_VERSION:
        raise ValueError(
            f"{at}: expected version {FORMAT_VERSION} or less, got {version[:40]}: this was written by a "
            "later release"
        )
