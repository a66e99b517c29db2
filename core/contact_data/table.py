# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Contacts from the text of a CSV file, and back. docs/contact_data.md describes the format."""

import csv
import io
import itertools
from dataclasses import replace
from typing import Any

from ..arguments import LARGEST
from ..contours.contour import Contour
from . import rows
from .rows import NORMAL_COLUMNS, POINT_COLUMNS, Contacts

FORMAT_VERSION = 3
WITHOUT_BALL = 2  # Files without a ball have the version that earlier releases read, too.
TITLE = "# Tactile Patch contacts, version "
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
VECTOR_KEYS, CURVE_KEYS = ("point", "outward"), ("noise", "normal_std", "ball")  # Keys of the comments.
COLUMNS = ("curve", "time", *POINT_COLUMNS, *NORMAL_COLUMNS)
STROKE = "stroke"  # The names of curves that do not pass through the reference point begin with this.


def contacts_from_csv(text: str, name: str = "the table") -> Contacts:
    """The Contacts of a table with the columns curve, x, y, z, with numbers as they are.

    The contacts of each curve are sorted by time, if that is given, and each is there once.

    name : what messages call the text, such as its file's name

    Raises ValueError with line and column if the text holds no contacts.
    """
    text = text.removeprefix("\ufeff").replace("\r\n", "\n").replace("\r", "\n")
    rows.require_short_lines(name, text)
    metadata = _metadata(name, text)
    table = _table(name, text)
    contours = table.contours()
    for key in CURVE_KEYS:
        stds = metadata.pop(key, [None])
        stds = stds * len(contours) if len(stds) == 1 else stds
        if len(stds) != len(contours):
            raise ValueError(f"{name}: expected one {key} or {len(contours)}, one a curve, got {len(stds)}")
        contours = [_with(name, c, key, std) for c, std in zip(contours, stds, strict=True)]
    is_stroke = [label.lower().startswith(STROKE) for label in table.labels]
    strokes = tuple(itertools.compress(contours, is_stroke))
    contours = [c for c, stroke in zip(contours, is_stroke, strict=True) if not stroke]
    return Contacts(contours, table.unit, **metadata, strokes=strokes)


def contacts_to_csv(contacts: Contacts) -> str:
    """Contacts as the text of a CSV file, such that `contacts_from_csv` finds the same numbers.

    Contours that have normals are written with them. Comments have what else a fit takes: the reference
    point, the outward direction, and the deviations of contacts and of normals and the radius of a ball whose
    centers were recorded, for all contours or for each.
    """
    contours, unit, point, outward, strokes = contacts
    labels = [str(number) for number in range(1, len(contours) + 1)]
    labels += [f"{STROKE} {number}" for number in range(1, len(strokes) + 1)]
    contours = [*contours, *strokes]
    names = POINT_COLUMNS + (NORMAL_COLUMNS if any(c.normals is not None for c in contours) else ())
    text = io.StringIO()
    version = WITHOUT_BALL if all(contour.ball is None for contour in contours) else FORMAT_VERSION
    print(f"{TITLE}{version}, lengths in {unit or 'no unit'}", file=text)
    for key, values in {"point": point, "outward": outward, **_curve_metadata(contours)}.items():
        if values is not None:
            print("#", key, *("-" if value is None else repr(value) for value in values), file=text)
    table = csv.writer(text, lineterminator="\n")
    titles = [f"{name} [{unit}]" if unit and name in POINT_COLUMNS else name for name in names]
    table.writerow(["curve", *titles])
    for label, contour in zip(labels, contours, strict=True):
        table.writerows([label, *row] for row in _fields(contour, len(names)))
    return text.getvalue()


def _table(name: str, text: str) -> rows.RowReader:
    """The header's columns and all rows of a text."""
    found = rows.header_of(text)
    if found is None:
        raise ValueError(f"{name}: expected a header with the columns curve, x, y, z, got an empty file")
    header, number, start = found
    at = f"{name}, line {number}"
    separator = next((s for s in ";\t" if s in header), ",")
    width, columns, unit = _columns(at, rows.fields_of(at, header, separator))
    table = rows.RowReader(name, separator, width, columns, unit)
    for _, first, block in rows.blocks(text, start, number + 1):
        table.add(first, block)
    return table


def _curve_metadata(contours: list[Contour]) -> dict[str, list[float | None]]:
    """What is known of contours by key: one number for all of them, or one for each."""
    found = {key: [getattr(contour, key) for contour in contours] for key in CURVE_KEYS}
    return {
        key: stds[:1] if len(set(stds)) == 1 else stds
        for key, stds in found.items()
        if any(std is not None for std in stds)
    }


def _fields(contour: Contour, width: int) -> list[list[Any]]:
    """The rows of a contour's contacts, with normals or blanks if the table has six columns of numbers."""
    points: list[list[Any]] = contour.points.tolist()
    if width == len(POINT_COLUMNS):
        return points
    blank = [[""] * 3] * len(points)
    normals = blank if contour.normals is None else contour.normals.tolist()
    return [point + normal for point, normal in zip(points, normals, strict=True)]


def _with(name: str, contour: Contour, key: str, std: float | None) -> Contour:
    """The contour with this deviation; with one of normals only if it has normals."""
    if key == "normal_std" and contour.normals is None:
        return contour
    known: dict[str, Any] = {key: std}
    try:
        return replace(contour, **known)
    except ValueError as error:
        raise ValueError(f"{name}: {error}") from None


def _metadata(name: str, text: str) -> dict[str, Any]:
    """The values in the comments of a text that `contacts_to_csv` has written, by key; {} for others."""
    if not text.startswith(TITLE):
        return {}
    metadata: dict[str, Any] = {}
    start, number, version = 0, 1, 0
    while text.startswith("#", start):
        end = text.find("\n", start) + 1 or len(text)
        at, line = f"{name}, line {number}", text[start:end]
        if number == 1:
            version = _version(at, line.removeprefix(TITLE).partition(",")[0].strip())
        key, *words = line[1:].rstrip(",;\t\n ").split() or [""]  # A spreadsheet may leave separators behind.
        if key == "ball" and version <= WITHOUT_BALL:
            raise ValueError(
                f"{at}: expected no ball in a file of version {version}: make it {FORMAT_VERSION}"
            )
        if key in VECTOR_KEYS and len(words) != 3:
            raise ValueError(f"{at}: expected 3 numbers for {key}, got {len(words)}")
        if key in VECTOR_KEYS:
            metadata[key] = [rows.number_of(f'{at}, "{key}"', word, LARGEST) for word in words]
        elif key in CURVE_KEYS:
            metadata[key] = [_nonnegative_or_none(f'{at}, "{key}"', word) for word in words]
        start, number = end, number + 1
    return metadata


def _nonnegative_or_none(at: str, word: str) -> float | None:
    """The number of 0 or more in a word, or None for "-"."""
    std = None if word == "-" else rows.number_of(at, word, LARGEST)
    if std is not None and std < 0.0:
        raise ValueError(f"{at}: expected a number of 0 or more, got {word[:40]}")
    return std


def _version(at: str, version: str) -> int:
    """The version of the format. Raises ValueError for one that is not known."""
    if not version.isdecimal() or int(version) > FORMAT_VERSION:
        raise ValueError(
            f"{at}: expected version {FORMAT_VERSION} or less, got {version[:40]}: this was written by a "
            "later release"
        )
    return int(version)


def _columns(at: str, header: list[str]) -> tuple[int, dict[str, int], str]:
    """The number of columns, the place of each known one by name, and the unit of the coordinates."""
    columns: dict[str, int] = {}
    found: dict[str, str] = {}
    for i, title in enumerate(header):
        key, bracketed, suffix = _name_and_unit(title.lower())
        if key not in COLUMNS:
            continue
        unit = (bracketed or suffix).replace("μ", "µ")
        unit = "µm" if unit == "um" else unit
        if key in POINT_COLUMNS and unit and unit not in UNIT_METERS:
            if suffix:  # Columns such as x_offset are not coordinates.
                continue
            raise ValueError(f'{at}: expected a unit out of {", ".join(UNIT_METERS)}, got "{unit}"')
        if key in columns:
            raise ValueError(f'{at}: expected one column "{key}", got two')
        columns[key], found[key] = i, unit
    missing = [key for key in POINT_COLUMNS if key not in columns]
    missing += [
        key for key in NORMAL_COLUMNS if key not in columns and any(k in columns for k in NORMAL_COLUMNS)
    ]
    if missing:
        text = ", ".join(header)
        text = text if len(text) < 60 else f"{text[:57]}..."
        raise ValueError(f'{at}: expected the column "{missing[0]}", got "{text}"')
    used = {found[key] for key in POINT_COLUMNS}
    if len(used) > 1:
        raise ValueError(f"{at}: expected x, y and z in one unit, got {' and '.join(sorted(used))}")
    return len(header), columns, used.pop()


def _name_and_unit(title: str) -> tuple[str, str, str]:
    """A column's name, and its unit as in "x [mm]" or "x_mm", or ""."""
    place = next((i for i, letter in enumerate(title) if letter in "[(_"), len(title))
    name, mark, rest = title[:place], title[place : place + 1], title[place + 1 :]
    if mark == "_":
        return (name, "", rest) if rest.replace("_", "0").isalnum() else ("", "", "")
    if mark and rest[-1:] not in ("]", ")"):
        return "", "", ""
    return name.rstrip(), rest[:-1].strip(), ""
