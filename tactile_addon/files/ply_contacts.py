# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The contacts of a .ply file: its vertices, with normals, curves and times if it has them.

Blender's own import keeps these attributes, too, but in single precision, and reads NaN and words as 0.
"""

import itertools
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Literal, TypeAlias

import numpy as np

from ...core.arguments import LARGEST
from ...core.contact_data import rows as contact_rows
from ...core.contact_data.rows import NORMAL_COLUMNS, POINT_COLUMNS, Contacts
from ..touch.types import Array

# Names and types of the properties of an element; a list has the types of its length and of its items.
Fields: TypeAlias = list[tuple[str, Any]]
PLY_ROWS = 1000  # This many rows of a .ply are read together.
PLY_TYPES = {
    **dict.fromkeys(("char", "int8"), "i1"),
    **dict.fromkeys(("uchar", "uint8"), "u1"),
    **dict.fromkeys(("short", "int16"), "i2"),
    **dict.fromkeys(("ushort", "uint16"), "u2"),
    **dict.fromkeys(("int", "int32"), "i4"),
    **dict.fromkeys(("uint", "uint32"), "u4"),
    **dict.fromkeys(("float", "float32"), "f4"),
    **dict.fromkeys(("double", "float64"), "f8"),
}
PLY_ORDERS = {"ascii": "=", "binary_little_endian": "<", "binary_big_endian": ">"}


def read(name: str, path: Path) -> Contacts:
    """The Contacts of a file. Raises ValueError, with its name and the place, if it holds none."""
    rows, fields, first = vertex_rows(name, path.read_bytes())
    rows = _ply_rows(name, first, rows, fields) if first else rows
    table = {key: rows[key].astype(rows[key].dtype.newbyteorder("=")) for key in rows.dtype.names}
    points = np.column_stack([table[key] for key in POINT_COLUMNS])
    wild = ~(np.abs(points.astype(float)) <= LARGEST).all(axis=1)  # NaN counts as wild.
    if wild.any():
        at = f"{name}, contact {np.argmax(wild) + 1}"
        raise ValueError(f"{at}: expected finite coordinates up to {LARGEST:g}, got others")
    normals = (
        np.column_stack([table[key] for key in NORMAL_COLUMNS]) if set(NORMAL_COLUMNS) <= set(table) else None
    )
    labels, titles = _in_order(table.get("curve", np.ones(len(points))))
    contours = contact_rows.contours(name, labels, points, normals, table.get("time"), titles)
    if not {"curve", "time"} & set(table):  # These are bare points without an order.
        return Contacts([], "", strokes=tuple(contours))
    return Contacts(contours, "")


def vertex_rows(name: str, data: bytes) -> tuple[Any, Fields, int]:
    """The rows of the vertices, their fields, and the number of the first line.

    The rows are lines of text, or an array with these fields, for which the number is 0. Raises ValueError if
    there are none.
    """
    end = data.find(b"end_header", 0, contact_rows.LONGEST_LINE)
    lines = [line.split() for line in data[: max(end, 0)].decode("latin-1").splitlines()]
    kind = next((line[1] for line in lines if line[:1] == ["format"] and len(line) > 1), None)
    order = PLY_ORDERS.get(kind)
    if not data.startswith(b"ply") or end < 0 or order is None:
        raise ValueError(f"{name}: expected the complete header of a .ply file, got something else")
    below = data.find(b"\n", end) + 1 or len(data)
    before, count, fields = _ply_vertices(name, lines, order)
    if kind == "ascii":
        text, start = data[below:].splitlines(), sum(number for _, number in before)
        size, room = 1, len(text)
    else:
        start = below
        for kinds, number in before:
            start = _after(data, start, kinds, number)
        size, room = np.dtype(fields).itemsize, len(data)
    if room < start + count * size:
        raise ValueError(f"{name}: expected {count} contacts, got a file that ends earlier: is it complete?")
    if kind != "ascii":
        return np.frombuffer(data, fields, count, start), fields, 0
    return text[start : start + count], fields, len(lines) + 2 + start


def _after(data: bytes, start: int, fields: Fields, count: int) -> int:
    """The place after `count` rows with these fields from `start` on, or one beyond the data."""
    lists, skipped = [], 0  # The bytes before each list, and the types of its length and of its items.
    for _, kind in fields:
        if isinstance(kind, str):
            skipped += np.dtype(kind).itemsize
        else:
            lists.append((skipped, *(np.dtype(part).itemsize for part in kind)))
            skipped = 0
    if not lists:
        return start + count * skipped
    order: Literal["big", "little"] = (
        "big" if fields[0][1][0].startswith(PLY_ORDERS["binary_big_endian"]) else "little"
    )
    for _ in range(count):
        for before, length, item in lists:
            start += before + length
            start += item * int.from_bytes(data[start - length : start], order)
        start += skipped
        if start > len(data):
            break
    return start


def _in_order(labels: Array) -> tuple[Array, list[float]]:
    """Numbers from 0 in the order in which labels first appear, and the label of each number."""
    titles, first, places = np.unique(labels, return_index=True, return_inverse=True)
    order = np.argsort(first)
    rank = np.empty_like(order)
    rank[order] = np.arange(len(order))
    return rank[places.ravel()], titles[order].tolist()


def _ply_vertices(
    name: str, lines: list[list[str]], order: str
) -> tuple[list[tuple[Fields, int]], int, Fields]:
    """(fields, number) of the rows before the vertices, the number of vertices, and their fields."""
    elements = _elements(name, lines, order)
    places = [place for place, (element, *_) in enumerate(elements) if element == "vertex"]
    _, count, fields = elements[places[0]] if len(places) == 1 else ("", 0, [])
    # The words of a line have their places up to its first list.
    plain = dict(itertools.takewhile(lambda field: isinstance(field[1], str), fields))
    is_fixed = order == PLY_ORDERS["ascii"] or len(plain) == len(fields)
    if count < 1 or not is_fixed or not {*POINT_COLUMNS} <= {*plain} or len(dict(fields)) < len(fields):
        raise ValueError(f"{name}: expected vertices with the properties x, y and z, got none of that kind")
    return [(kinds, number) for _, number, kinds in elements[: places[0]]], count, fields


def _elements(name: str, lines: list[list[str]], order: str) -> list[tuple[str, int, Fields]]:
    """The name, number and fields of each element; a list has the types of its length and items."""
    elements: list[tuple[str, int, Fields]] = []
    for line in lines:
        try:
            if line[:1] == ["element"]:
                elements.append((line[1], int(line[2]), []))
                if elements[-1][1] < 0:
                    raise ValueError
            elif line[:1] == ["property"]:
                kinds = [order + PLY_TYPES[word] for word in line[1:-1] if word != "list"]
                (kind,) = [tuple(kinds)] if line[1] == "list" else kinds
                elements[-1][2].append((line[-1].lower(), kind))
        except (IndexError, ValueError, KeyError):
            raise ValueError(f'{name}: expected an element or a property, got "{" ".join(line)}"') from None
    return elements


def _ply_rows(name: str, first: int, lines: Sequence[bytes], fields: Fields) -> Array:
    """The values of lines of text, of which the first is line `first` of the file."""
    rows = np.empty(len(lines), [(key, "f8") for key, _ in fields])
    for start in range(0, len(lines), PLY_ROWS):
        part = (line.decode("latin-1") for line in lines[start : start + PLY_ROWS])
        words = [line.split(None, len(fields)) for line in part]  # Millions of words would take gigabytes.
        some = rows[start : start + PLY_ROWS]
        try:
            columns = list(zip(*words, strict=True))
            for (key, _), column in zip(fields, columns, strict=True):
                some[key] = contact_rows.numbers_of(column)
        except ValueError:
            _refuse_ply_row(name, first + start, words, fields)
    return rows


def _refuse_ply_row(name: str, first: int, words: Sequence[Sequence[str]], fields: Fields) -> None:
    """Raises ValueError for the first row that cannot be read."""
    for number, row in enumerate(words, first):
        at = f"{name}, line {number}"
        if len(row) != len(fields):
            got = len(row) if len(row) < len(fields) else "more"
            raise ValueError(f"{at}: expected {len(fields)} numbers, got {got}")
        for (key, _), word in zip(fields, row, strict=True):
            contact_rows.number_of(f'{at}, "{key}"', word)
