# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Contact data in files: CSV in and out, PLY in, JSON out. docs/contacts.md describes the formats.

Blender's own import of a .ply keeps normals, curves and times of vertices, too, but in single precision, and
reads NaN and words as 0.
"""

import itertools
import json
from dataclasses import replace
from pathlib import Path
from typing import Any, Literal, TypeAlias

import numpy as np

from ... import core
from ...core.arguments import LARGEST
from ...core.contact_data import rows as contact_rows
from ...core.contact_data.rows import NORMAL_COLUMNS, POINT_COLUMNS, Contacts
from ..touch.types import Array
from . import whole_file

# Names and types of the properties of an element; a list has the types of its length and of its items.
Fields: TypeAlias = list[tuple[str, Any]]
Element: TypeAlias = tuple[str, int, Fields]  # Its name, the number of its rows, and their properties.
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
TABLES = (".csv", ".txt", ".tsv")


def read(path: str | Path) -> Contacts:
    """The Contacts of a .csv or .ply file, with numbers as they are.

    The contacts of each curve are sorted by time, if that is given, and each is there once. Raises OSError if
    there is no such file, and ValueError with line and column if it holds no contacts.
    """
    path = Path(path)
    if not path.is_file():
        raise OSError(f'there is no file "{path}"')
    name, kind = f'"{path.name}"', path.suffix.lower()
    if kind == ".ply":
        return _read_ply(name, path)
    if kind in TABLES:
        return core.contacts_from_csv(_text(name, path), name)
    raise OSError(f"cannot read {name}: expected a .csv or .ply file of contacts")


def contacts_of(r: core.Reconstruction) -> Contacts:
    """The Contacts that a reconstruction was fitted to; fitting them gives the same reconstruction."""
    noise, (origin, normal) = r.noise * r.radius, (r.point, r.frame.axes[:, 2])
    contours = [replace(contour, noise=noise) for contour in r.contours]
    strokes = (core.Contour(r.strokes, noise=noise),) if len(r.strokes) else ()
    return Contacts(contours, "", origin.tolist(), normal.tolist(), strokes)


def write(path: str | Path, contacts: Contacts) -> None:
    """Writes Contacts as CSV, such that `read` finds the same numbers."""
    whole_file.write_text(path, core.contacts_to_csv(contacts))


def write_patch(path: str | Path, r: core.Reconstruction) -> None:
    """Writes a reconstruction as JSON, which core.from_dict reads."""
    whole_file.write_text(path, json.dumps(core.to_dict(r), allow_nan=False) + "\n")


def _text(name: str, path: Path) -> str:
    """The whole text of a file in one of the usual encodings."""
    data = path.read_bytes()
    if data[:2] in (b"\xff\xfe", b"\xfe\xff"):
        return data.decode("utf-16", errors="replace")
    if b"\0" in data:
        raise ValueError(f"{name}: expected a text file, got binary data")
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return data.decode("latin-1")


def _read_ply(name: str, path: Path) -> Contacts:
    """The Contacts of a .ply file: its vertices, with normals, curves and times if it has them."""
    rows, fields, first = vertex_rows(name, path.read_bytes())
    titles = [key for key, _ in fields]
    if first:  # The header of a table above the rows keeps the numbers of their lines.
        lines = [" ".join(titles), *(row.decode("latin-1") for row in rows)]
        contours = core.contacts_from_csv("\n" * (first - 2) + "\n".join(lines), name).contours
    else:
        contours = _contours(name, rows)
    if not {"curve", "time"} & set(titles):  # These are bare points without an order.
        return Contacts([], "", strokes=tuple(contours))
    return Contacts(contours, "")


def _contours(name: str, rows: Array) -> list[core.Contour]:
    """The contours of the rows of a binary file, (n,), with the properties of a vertex as fields."""
    table = {key: rows[key].astype(rows[key].dtype.newbyteorder("=")) for key in rows.dtype.names}
    points = np.column_stack([table[key] for key in POINT_COLUMNS])
    wild = ~(np.abs(points.astype(float)) <= LARGEST).all(axis=1)  # NaN counts as wild.
    if wild.any():
        at = f"{name}, contact {np.argmax(wild) + 1}"
        raise ValueError(f"{at}: expected finite coordinates up to {LARGEST:g}, got others")
    normals = (
        np.column_stack([table[key] for key in NORMAL_COLUMNS]) if set(NORMAL_COLUMNS) <= set(table) else None
    )
    titles, labels = np.unique(table.get("curve", np.ones(len(points))), return_inverse=True)
    return contact_rows.contours(name, labels, points, normals, table.get("time"), titles.tolist())


def vertex_rows(name: str, data: bytes) -> tuple[Any, Fields, int]:
    """The rows of the vertices, their fields, and the number of the first line.

    The rows are lines of text, or an array with these fields, for which the number is 0. Raises ValueError if
    there are none.
    """
    end = data.find(b"end_header", 0, contact_rows.LONGEST_LINE)
    lines = [line.split() for line in data[: max(end, 0)].decode("latin-1").splitlines()]
    kind = next((line[1] for line in lines if line[:1] == ["format"] and len(line) > 1), "")
    if not data.startswith(b"ply") or end < 0 or kind not in PLY_ORDERS:
        raise ValueError(f"{name}: expected the complete header of a .ply file, got something else")
    below = data.find(b"\n", end) + 1 or len(data)
    before, count, fields = _ply_vertices(name, _elements(name, lines, PLY_ORDERS[kind]), kind)
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
    sizes = [
        [np.dtype(part).itemsize for part in ([kind] if isinstance(kind, str) else kind)]
        for _, kind in fields
    ]
    if all(len(parts) == 1 for parts in sizes):
        return start + count * sum(size for (size,) in sizes)
    is_big = any(kind[0].startswith(PLY_ORDERS["binary_big_endian"]) for _, kind in fields)
    order: Literal["big", "little"] = "big" if is_big else "little"
    for _ in range(count):
        for first, *items in sizes:
            start += first
            for item in items:  # The first is the number of these.
                start += item * int.from_bytes(data[start - first : start], order)
        if start > len(data):
            break
    return start


def _ply_vertices(
    name: str, elements: list[Element], kind: str
) -> tuple[list[tuple[Fields, int]], int, Fields]:
    """(fields, number) of the rows before the vertices, the number of vertices, and their fields."""
    places = [place for place, (element, *_) in enumerate(elements) if element == "vertex"]
    _, count, fields = elements[places[0]] if len(places) == 1 else ("", 0, [])
    # The words of a line have their places up to its first list.
    plain = dict(itertools.takewhile(lambda field: isinstance(field[1], str), fields))
    is_fixed = kind == "ascii" or len(plain) == len(fields)
    if count < 1 or not is_fixed or not {*POINT_COLUMNS} <= {*plain} or len(dict(fields)) < len(fields):
        raise ValueError(f"{name}: expected vertices with the properties x, y and z, got none of that kind")
    return [(kinds, number) for _, number, kinds in elements[: places[0]]], count, fields


def _elements(name: str, lines: list[list[str]], order: str) -> list[Element]:
    """The elements that the lines of a header name."""
    elements: list[Element] = []
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
