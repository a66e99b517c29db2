# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Contact data in files: CSV in and out, PLY in. docs/contact_data.md describes the format."""

import csv
import io
import math
import re
from functools import partial
from pathlib import Path

import numpy as np

from .. import core
from . import units

VERSION = 1
LENGTHS = dict(units.METRES.values())  # metres in each unit
POINT, NORMAL = ("x", "y", "z"), ("nx", "ny", "nz")
COLUMN = re.compile(r"(curve|time|n?[xyz])(?:\s*[\[(]\s*(.*?)\s*[\])]|_(\w+))?")
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


def read(path):
    """(contours, unit) of a .csv or .ply file, unit "" where it names none; numbers as they are.

    The contacts of each curve, by time where that is given, each once; no normal_std. Raises OSError
    where there is no such file, ValueError with line and column where it holds no contacts.
    """
    path = Path(path)
    if not path.is_file():
        raise OSError(f'there is no file "{path}"')
    readers = {".csv": _read_csv, ".txt": _read_csv, ".tsv": _read_csv, ".ply": _read_ply}
    if path.suffix.lower() not in readers:
        raise OSError(f'cannot read "{path.name}": wanted a .csv or .ply file of contacts')
    return readers[path.suffix.lower()](f'"{path.name}"', path.read_bytes())


def write(path, contours, unit=""):
    """The contours as CSV, with their normals where all have some; reading it gives the same numbers."""
    names = POINT + (NORMAL if all(c.normals is not None for c in contours) else ())
    text = io.StringIO()
    print(f"# Tactile Patch contacts, version {VERSION}, lengths in {unit or 'no unit'}", file=text)
    table = csv.writer(text, lineterminator="\n")
    table.writerow(["curve", *(f"{name} [{unit}]" if unit and name in POINT else name for name in names)])
    for number, contour in enumerate(contours, 1):
        rows = np.hstack([contour.points, contour.normals]) if len(names) == 6 else contour.points
        table.writerows([number, *row] for row in rows.tolist())
    Path(path).write_text(text.getvalue(), encoding="utf-8", newline="\n")


def _contours(labels, points, normals, times):
    """One a label, in the order of their first contacts; of normals some may be None, and times too."""
    by_curve = {}
    for row, label in enumerate(labels):
        by_curve.setdefault(label, []).append(row)
    contours = []
    for rows in by_curve.values():
        if times is not None:
            rows.sort(key=times.__getitem__)
        # A sensor at rest writes one contact many times: it is no more certain for that.
        first = np.sort(np.unique(points[rows], axis=0, return_index=True)[1])
        rows = np.array(rows)[first]
        some = normals is not None and normals[rows[0]] is not None
        contours.append(core.Contour(points[rows], normals=[normals[row] for row in rows] if some else None))
    return contours


def _read_csv(name, data):
    lines = [(f"{name}, line {number}", line) for number, line in enumerate(_lines(name, data), 1)]
    lines = [(at, line) for at, line in lines if line.strip() and not line.lstrip().startswith("#")]
    if not lines:
        raise ValueError(f"{name}: wanted a header with the columns curve, x, y, z, got an empty file")
    at, header = lines[0]
    separator = next((s for s in ";\t" if s in header), ",")
    width, columns, unit = _columns(at, _fields(at, header, separator))
    labels, points, normals, times, last = [], [], [], [], {}
    for at, line in lines[1:]:
        fields = _fields(at, line, separator)
        if not any(fields):
            continue
        _require_width(at, fields, width)
        row = {key: fields[i] if i < len(fields) else "" for key, i in columns.items()}
        value = partial(_value, at, row)
        labels.append(row.get("curve", "1"))
        if not labels[-1]:
            raise ValueError(f'{at}: wanted a number or a name in the column "curve", got none')
        points.append([*map(value, POINT)])
        measured = "nx" in row and any(row[key] for key in NORMAL)
        if measured is not last.setdefault(labels[-1], measured):
            raise ValueError(f"{at}: wanted normals all along a curve or nowhere, got some")
        normals.append([*map(value, NORMAL)] if measured else None)
        if "time" in row:
            times.append(value("time"))
    if not points:
        raise ValueError(f"{name}: wanted contacts below the header, got none")
    return _contours(labels, np.array(points), normals, times or None), unit


def _value(at, row, key):
    return _number(f'{at}, column "{key}"', row[key])


def _require_width(at, fields, width):
    if any(fields[width:]):
        raise ValueError(
            f"{at}: wanted {width} fields, got {len(fields)}: decimal commas need semicolons or tabs "
            "between the fields"
        )


def _lines(name, data):
    if data[:2] in (b"\xff\xfe", b"\xfe\xff"):
        text = data.decode("utf-16", errors="replace")
    elif b"\0" in data:
        raise ValueError(f"{name}: wanted a text file, got bytes that are none")
    else:
        try:
            text = data.decode("utf-8-sig")
        except UnicodeDecodeError:
            text = data.decode("latin-1")
    return text.replace("\r\n", "\n").replace("\r", "\n").split("\n")


def _fields(at, line, separator):
    try:
        (fields,) = csv.reader([line], delimiter=separator, skipinitialspace=True)
    except csv.Error:
        raise ValueError(f"{at}: wanted fields of some letters, got a longer one") from None
    return [field.strip() for field in fields]


def _columns(at, header):
    """How many there are, {column: its place}, and the unit of the coordinates."""
    columns, found = {}, {}
    for i, title in enumerate(header):
        match = COLUMN.fullmatch(title.lower())
        if match is None:
            continue
        key, bracketed, suffix = match.groups()
        unit = (bracketed or suffix or "").replace("μ", "µ")
        unit = "µm" if unit == "um" else unit
        if key in POINT and unit and unit not in LENGTHS:
            if suffix:  # as in x_offset
                continue
            raise ValueError(f'{at}: wanted a unit out of {", ".join(LENGTHS)}, got "{unit}"')
        if key in columns:
            raise ValueError(f'{at}: wanted one column "{key}", got two')
        columns[key], found[key] = i, unit
    missing = [key for key in POINT if key not in columns]
    missing += [key for key in NORMAL if key not in columns and any(k in columns for k in NORMAL)]
    if missing:
        raise ValueError(f'{at}: wanted the column "{missing[0]}", got "{_shown(header)}"')
    used = {found[key] for key in POINT}
    if len(used) > 1:
        raise ValueError(f"{at}: wanted x, y and z in one unit, got {' and '.join(sorted(used))}")
    return len(header), columns, used.pop()


def _shown(header):
    text = ", ".join(header)
    return text if len(text) < 60 else text[:57] + "..."


def _number(at, text):
    plain = text.replace(",", ".") if "." not in text else text
    try:
        value = float(plain.replace("_", "?"))  # which Python would overlook
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise ValueError(f'{at}: wanted a number, got "{text[:40]}"')
    return value


def _read_ply(name, data):
    head, end, body = data.partition(b"end_header")
    lines = [line.split() for line in head.decode("latin-1").splitlines()]
    order = PLY_ORDERS.get(lines[1][1]) if len(lines) > 1 and len(lines[1]) > 1 else None
    if not data.startswith(b"ply") or not end or order is None:
        raise ValueError(f"{name}: wanted the header of a .ply file, got another or half of one")
    body = body.partition(b"\n")[2]
    before, count, fields = _ply_vertices(name, lines, order)
    text = body.splitlines() if lines[1][1] == "ascii" else None
    sizes = [number * (1 if text is not None else np.dtype(kinds).itemsize) for kinds, number in before]
    start, size = sum(sizes), 1 if text is not None else np.dtype(fields).itemsize
    if len(body if text is None else text) < start + count * size:
        raise ValueError(f"{name}: wanted {count} contacts, got a file that ends before: is it whole?")
    if text is None:
        rows = np.frombuffer(body, fields, count, start)
    else:
        rows = _ply_rows(name, len(lines) + 2 + start, text[start : start + count], fields)
    table = {key: rows[key].astype(rows[key].dtype.newbyteorder("=")) for key in rows.dtype.names}
    points = np.column_stack([table[key] for key in POINT])
    if not np.isfinite(points).all():
        raise ValueError(f"{name}: wanted finite coordinates, got NaN or infinity among them")
    normals = np.column_stack([table[key] for key in NORMAL]) if set(NORMAL) <= set(table) else None
    labels = table["curve"].tolist() if "curve" in table else ["1"] * count
    return _contours(labels, points, normals, table["time"].tolist() if "time" in table else None), ""


def _ply_vertices(name, lines, order):
    """(fields, how many) of the rows before the vertices; how many vertices there are, and their fields."""
    elements = []
    for line in lines[2:]:
        try:
            if line[:1] == ["element"]:
                elements.append((line[1], int(line[2]), []))
            elif line[:1] == ["property"]:
                elements[-1][2].append(
                    (line[-1].lower(), "list" if line[1] == "list" else PLY_TYPES[line[1]])
                )
        except (IndexError, ValueError, KeyError):
            raise ValueError(f'{name}: wanted an element or a property, got "{" ".join(line)}"') from None
    before = []
    for element, count, properties in elements:
        if count < 0 or any(kind == "list" for _, kind in properties):
            break
        fields = [(key, order + kind) for key, kind in properties]
        if element == "vertex":
            if not {*POINT} <= {*dict(fields)} or count < 1 or len(dict(fields)) < len(fields):
                break
            return before, count, fields
        before.append((fields, count))
    raise ValueError(f"{name}: wanted vertices with the properties x, y and z, got none of that kind")


def _ply_rows(name, first, lines, fields):
    """The values of lines of text, the first of them the file's line `first`."""
    rows = np.zeros(len(lines), [(key, "f8") for key, _ in fields])
    for i, line in enumerate(lines):
        at, words = f"{name}, line {first + i}", line.decode("latin-1").split()
        if len(words) != len(fields):
            raise ValueError(f"{at}: wanted {len(fields)} numbers, got {len(words)}")
        rows[i] = tuple(_number(f'{at}, "{key}"', word) for (key, _), word in zip(fields, words, strict=True))
    return rows
