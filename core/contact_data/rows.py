# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Rows of contacts as arrays: many at once, or one by one where a row is blank, short or wrong."""

import csv
import math
import re
from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..arguments import LARGEST, Array
from ..contours.contour import Contour

POINT_COLUMNS, NORMAL_COLUMNS = ("x", "y", "z"), ("nx", "ny", "nz")
THOUSANDS = re.compile(r"[-+]?[1-9]\d{0,2},\d{3}")  # The comma may be decimal or that of thousands.
COMMENT_MARKS = ("#", "//")
LETTERS_AT_ONCE = 1 << 16  # This number of letters is read together.
LONGEST_LINE = 1 << 20  # Lines have at most this many letters, for the words of one take 80 times its memory.


class Contacts(NamedTuple):
    """Contact data of one object.

    contours : curves through the reference point
    unit : of all lengths, such as "mm"; "" if it is unknown
    point : the reference point, three numbers, or None
    outward : a direction to the outer side, three numbers, or None
    strokes : curves that do not pass through the reference point
    """

    contours: list[Contour]
    unit: str
    point: list[float] | None = None
    outward: list[float] | None = None
    strokes: tuple[Contour, ...] = ()


def blocks(text: str, start: int = 0, number: int = 1) -> Iterator[tuple[int, int, str]]:
    """(place, line number, some lines in one string) from a place of the text on, without empty blocks."""
    while start < len(text):
        end = text.find("\n", start + LETTERS_AT_ONCE) + 1 or len(text)
        block = text[start:end]
        if not block.isspace():
            yield start, number, block
        number += block.count("\n")
        start = end


def require_short_lines(name: str, text: str) -> None:
    """Raises ValueError for the first line that is too long to be taken apart."""
    for _, number, block in blocks(text):
        above = block.rfind("\n", 0, -1) + 1  # Only the last line of a block may be long.
        letters = len(block) - above
        if letters > LONGEST_LINE:
            at = f"{name}, line {number + block.count(chr(10), 0, above)}"
            raise ValueError(
                f"{at}: expected {LONGEST_LINE:,} letters or fewer, got {letters:,}: write each contact on a "
                "line of its own"
            )


def header_of(text: str) -> tuple[str, int, int] | None:
    """The first line that is neither empty nor a comment, its number, and the place of the next; or None."""
    for start, number, block in blocks(text):
        for line in block.split("\n"):
            if is_row(line):
                return line, number, start + len(line) + 1
            number += 1
            start += len(line) + 1
    return None


def is_row(line: str) -> bool:
    """Whether a line has fields, and is neither blank nor a comment."""
    words = line.strip().lstrip('"')
    return bool(words) and not words.startswith(COMMENT_MARKS)


class RowReader:
    """The rows of a table, which are added in blocks; `contours` makes curves of all of them.

    columns : the places of the known columns, by name
    unit : that of the coordinates, or ""
    """

    def __init__(self, name: str, separator: str, width: int, columns: Mapping[str, int], unit: str) -> None:
        self._name, self._separator, self._width, self._columns = name, separator, width, columns
        self.unit = unit
        self._keys = [key for key in (*POINT_COLUMNS, *NORMAL_COLUMNS, "time") if key in columns]
        self._curves: dict[str, int] = {}  # The curves by their labels,
        self._measured: dict[str, bool] = {}  # and whether they have normals.
        self._with_comma, self._is_decimal = "", False  # A number, and whether a comma is surely decimal.
        self._numbers, self._labels = [np.empty((0, len(self._keys)))], [np.empty(0, dtype=np.intp)]

    def add(self, number: int, block: str) -> None:
        """Adds lines from this number on. Raises ValueError with line and column if one is no contact."""
        try:
            labels, numbers = self._parse_block(block)
        except ValueError:  # A row is blank, short, without a normal, or wrong.
            labels, numbers = self._parse_lines(number, block)
        ids = [self._curves.setdefault(label, len(self._curves)) for label in labels]
        self._labels.append(np.array(ids, dtype=np.intp))
        self._numbers.append(numbers)

    @property
    def labels(self) -> list[str]:
        """The names of the curves, in the order of `contours`."""
        return list(self._curves)

    def contours(self) -> list[Contour]:
        """The contours of all rows, in the order of `labels`. Raises ValueError if there are none."""
        numbers, labels = np.vstack(self._numbers), np.concatenate(self._labels)
        if not len(numbers):
            raise ValueError(f"{self._name}: expected contacts below the header, got none")
        if self._with_comma and not self._is_decimal:
            raise ValueError(
                f"{self._name}: expected decimal commas or those of thousands, got numbers that may have "
                f'either, such as "{self._with_comma}": write decimal points, or leave out the commas of '
                "thousands"
            )
        return contours(
            self._name,
            labels,
            points=numbers[:, :3],
            normals=numbers[:, 3:6] if "nx" in self._columns else None,
            times=numbers[:, -1] if "time" in self._columns else None,
            titles=self.labels,
        )

    def _parse_block(self, block: str) -> tuple[list[str], Array]:
        """The labels and numbers (n, k) of a block, column by column.

        Raises ValueError without a message if any row needs `_parse_lines`: blank, short, mixed or malformed.
        """
        commented = any(mark in block for mark in COMMENT_MARKS)
        lines = filter(is_row if commented else str.strip, block.split("\n"))
        if '"' in block:
            rows = [fields_of("", line, self._separator) for line in lines]
        else:
            rows = [line.split(self._separator.strip(" ") or None) for line in lines]
        columns = list(zip(*rows, strict=True))
        if rows and len(columns) != self._width:
            raise ValueError
        labels = ["1"] * len(rows)
        if "curve" in self._columns and rows:
            labels = list(map(str.strip, columns[self._columns["curve"]]))
        numbers = np.empty((len(rows), len(self._keys)))
        for i, key in enumerate(self._keys if rows else ()):
            numbers[:, i] = numbers_of(columns[self._columns[key]])
            self._note_commas(columns[self._columns[key]])
        measured, distinct = "nx" in self._columns, set(labels)
        mixed = any(self._measured.setdefault(label, measured) is not measured for label in distinct)
        if mixed or "" in distinct or np.abs(numbers[:, :3]).max(initial=0.0) > LARGEST:
            raise ValueError
        return labels, numbers

    def _parse_lines(self, number: int, block: str) -> tuple[list[str], Array]:
        """The labels and numbers (n, k) of a block, line by line. Raises ValueError with line and column."""
        labels, numbers = [], []
        for line_number, line in enumerate(block.split("\n"), number):
            at = f"{self._name}, line {line_number}"
            fields = fields_of(at, line, self._separator) if is_row(line) else []
            if any(fields):
                label, values = self._parse_row(at, fields)
                labels.append(label)
                numbers.append(values)
        return labels, np.array(numbers).reshape(-1, len(self._keys))

    def _parse_row(self, at: str, fields: list[str]) -> tuple[str, list[float]]:
        """The label and the k numbers of a row at the place `at`, with NaN for missing normals."""
        if any(fields[self._width :]):
            raise ValueError(
                f"{at}: expected {self._width} fields, got {len(fields)}: decimal commas need semicolons or "
                "tabs between the fields"
            )
        row = {key: fields[i] if i < len(fields) else "" for key, i in self._columns.items()}
        label = row.get("curve", "1")
        if not label:
            raise ValueError(f'{at}: expected a number or a name in the column "curve", got none')
        measured = "nx" in row and any(row[key] for key in NORMAL_COLUMNS)
        if measured is not self._measured.setdefault(label, measured):
            raise ValueError(f"{at}: expected normals at all contacts of a curve or at none, got some")
        blank = () if measured else NORMAL_COLUMNS
        return label, [math.nan if key in blank else self._value(at, row, key) for key in self._keys]

    def _value(self, at: str, row: Mapping[str, str], key: str) -> float:
        """The number in the column `key` of a row. Raises ValueError that names place and column."""
        self._note_commas([row[key]])
        return number_of(f'{at}, column "{key}"', row[key], LARGEST if key in POINT_COLUMNS else math.inf)

    def _note_commas(self, words: Sequence[str]) -> None:
        """Looks for a comma in numbers, until one can only be decimal."""
        if not self._is_decimal and "," in "".join(words):
            for word in (word.strip() for word in words if "," in word):
                self._with_comma = word
                self._is_decimal = self._is_decimal or THOUSANDS.fullmatch(word) is None


def contours(
    name: str,
    labels: NDArray[np.intp],
    points: Array,
    normals: Array | None,
    times: Array | None,
    titles: Sequence[object],
) -> list[Contour]:
    """A contour for each label 0, 1, ..., with its contacts sorted by time, if there is one.

    labels, points, times : (n,), (n, 3), (n,)
    normals : (n, 3), NaN along curves without any; None if there are none at all
    titles : the name of each label

    Raises ValueError with `name` and the curve that Contour refuses.
    """
    order = np.argsort(labels, kind="stable") if times is None else np.lexsort((times, labels))
    curves = []
    for rows in np.split(order, np.flatnonzero(np.diff(labels[order])) + 1):
        own = None if normals is None or np.isnan(normals[rows[0]]).all() else normals[rows]
        try:
            curves.append(Contour(points[rows], normals=own))
        except ValueError as error:
            at = f'{name}, curve "{titles[labels[rows[0]]]}"'
            raise ValueError(f"{at}: {error}") from None
    return curves


def fields_of(at: str, line: str, separator: str) -> list[str]:
    """The fields of a line, without spaces around them. Raises ValueError that names the place `at`."""
    line = " ".join(line.split()) if separator == " " else line
    try:
        (fields,) = csv.reader([line], delimiter=separator, skipinitialspace=True)
    except csv.Error:
        raise ValueError(f"{at}: expected short fields, got a very long one") from None
    return [field.strip() for field in fields]


def numbers_of(texts: Sequence[str]) -> Array:
    """The numbers of many words, with decimal points or commas. Raises ValueError if one is no number."""
    if "_" in "".join(texts):  # Python would ignore it.
        raise ValueError
    try:
        numbers = np.fromiter(map(float, texts), float, len(texts))
    except ValueError:
        plain = (text.replace(",", ".") if "." not in text else text for text in texts)
        numbers = np.fromiter(map(float, plain), float, len(texts))
    if not np.isfinite(numbers).all():
        raise ValueError
    return numbers


def number_of(at: str, text: str, largest: float = math.inf) -> float:
    """The number of a word. Raises ValueError that names the place `at` for none, or beyond +-`largest`."""
    try:
        (value,) = numbers_of([text])
    except ValueError:
        raise ValueError(f'{at}: expected a number, got "{text[:40]}"') from None
    if abs(value) > largest:
        raise ValueError(
            f'{at}: expected numbers up to {largest:g}, got "{text[:40]}": use another unit of length'
        )
    return float(value)
