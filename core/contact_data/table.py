# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Contacts from the text of a CSV file, and back. docs/contacts.md describes the format."""

import csv
import io
import itertools
import re
from dataclasses import replace
from typing import Any

from ..contours.contour import Contour
from . import rows
from .comments import (
    CURVE_KEYS,
    FORMAT_VERSION,
    NO_UNIT,
    TITLE,
    UNIT_METERS,
    comments,
    spelled,
    stated,
    unit_named,
)
from .rows import NORMAL_COLUMNS, POINT_COLUMNS, Contacts

COLUMNS = ("curve", "time", *POINT_COLUMNS, *NORMAL_COLUMNS)
STROKE = "stroke"  # The names of curves that do not pass through the reference point begin with this.


def contacts_from_csv(text: str, name: str = "the table") -> Contacts:
    """The Contacts of a table with the columns curve, x, y, z, with numbers as they are.

    The contacts of each curve are sorted by time, if that is given, and repeated ones are kept once.

    name : what messages call the text, such as its file's name

    Raises ValueError with line and column if the text holds no contacts.
    """
    text = text.removeprefix("\ufeff").replace("\r\n", "\n").replace("\r", "\n")
    rows.require_short_lines(name, text)
    unit, metadata = stated(name, text)
    table = _table(name, text, unit)
    contours = table.contours()
    for key in CURVE_KEYS:
        stds = metadata.pop(key, [None])
        stds = stds * len(contours) if len(stds) == 1 else stds
        if len(stds) != len(contours):
            raise ValueError(f"{name}: expected one {key} or {len(contours)}, one a curve, got {len(stds)}")
        contours = [_with_value(name, c, key, std) for c, std in zip(contours, stds, strict=True)]
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
    print(f"# {TITLE}, version {FORMAT_VERSION}, lengths in {unit or NO_UNIT}", file=text)
    for key, values in {"point": point, "outward": outward, **_curve_metadata(contours)}.items():
        if values is not None:
            print("#", key, *("-" if value is None else repr(value) for value in values), file=text)
    table = csv.writer(text, lineterminator="\n")
    titles = [f"{name} [{unit}]" if unit and name in POINT_COLUMNS else name for name in names]
    table.writerow(["curve", *titles])
    for label, contour in zip(labels, contours, strict=True):
        table.writerows([label, *row] for row in _fields(contour, len(names)))
    return text.getvalue()


def _table(name: str, text: str, unit: str) -> rows.RowReader:
    """The header's columns and all rows of a text whose title names this unit, or "" if none does."""
    header, number, start = _header(name, text)
    at = f"{name}, line {number}"
    separator = _separator(header)
    if separator == " ":
        header = re.sub(r"\s+(?=[\[(])", "", header)  # The unit belongs to the column before it.
    width, columns, of_columns = _columns(at, rows.fields_of(at, header, separator))
    if unit and of_columns not in ("", unit):
        raise ValueError(f"{at}: expected lengths in {unit}, as a comment says, got {of_columns}")
    table = rows.RowReader(name, separator, width, columns, of_columns or unit)
    for _, first, block in rows.blocks(text, start, number + 1):
        table.add(first, block)
    return table


def _header(name: str, text: str) -> tuple[str, int, int]:
    """The line with the columns, its number, and the place of the next line.

    This is the first row, or else the last comment above it that names x, y and z.
    """
    header = rows.header_of(text)
    if header is None or not _names_points(header[0]):
        above = text if header is None else text[: header[2]]
        titles = [(line, number, end) for number, line, end in comments(above) if _names_points(line)]
        header = titles[-1] if titles else header
    if header is None:
        raise ValueError(f"{name}: expected a header with the columns curve, x, y, z, got an empty file")
    return header


def _names_points(line: str) -> bool:
    """Whether the fields of a line name the columns x, y and z."""
    titles = line.lower().split(_separator(line).strip(" ") or None)
    return {*POINT_COLUMNS} <= {_name_and_unit(title.strip(' "'))[0] for title in titles}


def _separator(header: str) -> str:
    """What separates the fields of a table with this header."""
    return next((mark for mark in ";\t|," if mark in header), " ")


def _curve_metadata(contours: list[Contour]) -> dict[str, list[float | None]]:
    """The deviations and balls of contours by key: one number for all of them, or one for each."""
    metadata = {key: [getattr(contour, key) for contour in contours] for key in CURVE_KEYS}
    return {
        key: stds[:1] if len(set(stds)) == 1 else stds
        for key, stds in metadata.items()
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


def _with_value(name: str, contour: Contour, key: str, value: float | None) -> Contour:
    """The contour with a value of one of CURVE_KEYS; with a deviation of normals only if it has normals."""
    if key == "normal_std" and contour.normals is None:
        return contour
    values: dict[str, Any] = {key: value}
    try:
        return replace(contour, **values)
    except ValueError as error:
        raise ValueError(f"{name}: {error}") from None


def _columns(at: str, header: list[str]) -> tuple[int, dict[str, int], str]:
    """The number of columns, the place of each known one by name, and the unit of the coordinates."""
    columns: dict[str, int] = {}
    units: dict[str, str] = {}
    for i, title in enumerate(header):
        key, bracketed, suffix = _name_and_unit(title.lower())
        if key not in COLUMNS:
            continue
        if key in POINT_COLUMNS:
            if suffix and spelled(suffix) not in UNIT_METERS:  # Such as x_offset, which is no coordinate.
                continue
            units[key] = unit_named(at, bracketed or suffix)
        if key in columns:
            raise ValueError(f'{at}: expected one column "{key}", got two')
        columns[key] = i
    missing = [key for key in POINT_COLUMNS if key not in columns]
    missing += [
        key for key in NORMAL_COLUMNS if key not in columns and any(k in columns for k in NORMAL_COLUMNS)
    ]
    if missing:
        text = ", ".join(header)
        text = text if len(text) < 60 else f"{text[:57]}..."
        raise ValueError(
            f'{at}: expected the column "{missing[0]}", got "{text}": put commas, semicolons, tabs, "|" or '
            "spaces between the columns curve, x, y, z"
        )
    used = set(units.values())
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
