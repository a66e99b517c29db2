# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Contact data in files: CSV in and out, PLY in, JSON out. docs/contact_data.md describes the formats."""

import csv
import io
import itertools
import json
from dataclasses import replace
from pathlib import Path

from ... import core
from ...core.arguments import LARGEST
from ..touch import units
from . import contact_rows, ply_contacts, whole_file
from .contact_rows import NORMAL_COLUMNS, POINT_COLUMNS, Contacts

FILE_VERSION = 2
TITLE = "# Tactile Patch contacts, version "
UNIT_METERS = dict(units.METERS.values())  # The length of each unit in meters.
VECTOR_KEYS, DEVIATION_KEYS = ("point", "outward"), ("noise", "normal_std")  # Keys of the comments.
COLUMNS = ("curve", "time", *POINT_COLUMNS, *NORMAL_COLUMNS)
STROKE = "stroke"  # The names of curves that run beside the reference point begin with this.


def read(path):
    """The Contacts of a .csv or .ply file, with numbers as they are.

    The contacts of each curve are sorted by time, if that is given, and each is there once. Raises OSError if
    there is no such file, and ValueError with line and column if it holds no contacts.
    """
    path = Path(path)
    if not path.is_file():
        raise OSError(f'there is no file "{path}"')
    readers = {".csv": _read_csv, ".txt": _read_csv, ".tsv": _read_csv, ".ply": ply_contacts.read}
    if path.suffix.lower() not in readers:
        raise OSError(f'cannot read "{path.name}": expected a .csv or .ply file of contacts')
    try:
        return readers[path.suffix.lower()](f'"{path.name}"', path)
    except MemoryError:
        name = f'"{path.name}"'
        raise ValueError(f"{name}: expected contacts that fit into memory, got more") from None


def contacts_of(r):
    """The Contacts that a reconstruction was fitted to; fitting them gives the same reconstruction."""
    noise, (origin, normal) = r.noise * r.radius, (r.frame.origin, r.frame.axes[:, 2])
    contours = [replace(contour, noise=noise) for contour in r.contours]
    strokes = (core.Contour(r.strokes, noise=noise),) if len(r.strokes) else ()
    return Contacts(contours, "", origin.tolist(), normal.tolist(), strokes)


def write(path, contacts):
    """Writes Contacts as CSV, such that `read` finds the same numbers.

    Contours that have normals are written with them. Comments say what else a fit takes: the reference point,
    the outward direction, and the deviations of contacts and of normals, for all contours or for each.
    """
    contours, unit, point, outward, strokes = contacts
    labels = [str(number) for number in range(1, len(contours) + 1)]
    labels += [f"{STROKE} {number}" for number in range(1, len(strokes) + 1)]
    contours = [*contours, *strokes]
    names = POINT_COLUMNS + (NORMAL_COLUMNS if any(c.normals is not None for c in contours) else ())
    told = {"point": point, "outward": outward}
    for key in DEVIATION_KEYS:
        stds = [getattr(c, key) for c in contours]
        if any(std is not None for std in stds):
            told[key] = stds[:1] if len(set(stds)) == 1 else stds
    text = io.StringIO()
    print(f"{TITLE}{FILE_VERSION}, lengths in {unit or 'no unit'}", file=text)
    for key, values in told.items():
        if values is not None:
            print("#", key, *("-" if value is None else repr(value) for value in values), file=text)
    table = csv.writer(text, lineterminator="\n")
    table.writerow(
        ["curve", *(f"{name} [{unit}]" if unit and name in POINT_COLUMNS else name for name in names)]
    )
    for label, contour in zip(labels, contours, strict=True):
        rows = contour.points.tolist()
        if len(names) == 6:
            blank = [[""] * 3] * len(rows)
            normals = blank if contour.normals is None else contour.normals.tolist()
            rows = [row + normal for row, normal in zip(rows, normals, strict=True)]
        table.writerows([label, *row] for row in rows)
    whole_file.write_text(path, text.getvalue())


def write_patch(path, r):
    """Writes a reconstruction as JSON, which core.from_dict reads."""
    whole_file.write_text(path, json.dumps(core.to_dict(r), allow_nan=False) + "\n")


def _read_csv(name, path):
    text = _text(name, path)
    contact_rows.require_short_lines(name, text)
    told = _told(name, text)
    found = contact_rows.header_of(text)
    if found is None:
        raise ValueError(f"{name}: expected a header with the columns curve, x, y, z, got an empty file")
    header, number, start = found
    at = f"{name}, line {number}"
    separator = next((s for s in ";\t" if s in header), ",")
    width, columns, unit = _columns(at, contact_rows.fields_of(at, header, separator))
    rows = contact_rows.Rows(name, separator, width, columns)
    for _, first, block in contact_rows.blocks(text, start, number + 1):
        rows.add(first, block)
    contours = rows.contours()
    for key in DEVIATION_KEYS:
        stds = told.pop(key, [None])
        stds = stds * len(contours) if len(stds) == 1 else stds
        if len(stds) != len(contours):
            raise ValueError(f"{name}: expected one {key} or {len(contours)}, one a curve, got {len(stds)}")
        contours = [_with(name, c, key, std) for c, std in zip(contours, stds, strict=True)]
    beside = [label.lower().startswith(STROKE) for label in rows.labels]
    strokes = tuple(itertools.compress(contours, beside))
    contours = [c for c, stroke in zip(contours, beside, strict=True) if not stroke]
    return Contacts(contours, unit, **told, strokes=strokes)


def _with(name, contour, key, std):
    """The contour with this deviation; with one of normals only if it has normals."""
    if key == "normal_std" and contour.normals is None:
        return contour
    try:
        return replace(contour, **{key: std})
    except ValueError as error:
        raise ValueError(f"{name}: {error}") from None


def _told(name, text):
    """What the comments of a file that `write` has written say, by key; nothing for other files."""
    if not text.startswith(TITLE):
        return {}
    told, start, number = {}, 0, 1
    while text.startswith("#", start):
        end = text.find("\n", start) + 1 or len(text)
        at, line = f"{name}, line {number}", text[start:end]
        if number == 1:
            _require_version(at, line.removeprefix(TITLE).partition(",")[0].strip())
        key, *words = line[1:].rstrip(",;\t\n ").split() or [""]  # A spreadsheet may leave separators behind.
        if key in VECTOR_KEYS and len(words) != 3:
            raise ValueError(f"{at}: expected 3 numbers for {key}, got {len(words)}")
        if key in VECTOR_KEYS:
            told[key] = [contact_rows.number_of(f'{at}, "{key}"', word, LARGEST) for word in words]
        elif key in DEVIATION_KEYS:
            told[key] = [_deviation(f'{at}, "{key}"', word) for word in words]
        start, number = end, number + 1
    return told


def _deviation(at, word):
    """The number of 0 or more in a word, or None for "-"."""
    std = None if word == "-" else contact_rows.number_of(at, word, LARGEST)
    if std is not None and std < 0.0:
        raise ValueError(f"{at}: expected a number of 0 or more, got {word[:40]}")
    return std


def _require_version(at, version):
    if not version.isdecimal() or int(version) > FILE_VERSION:
        raise ValueError(
            f"{at}: expected version {FILE_VERSION} or less, got {version[:40]}: this was written by a "
            "later release"
        )


def _text(name, path):
    """The whole text of a file, with line ends as in Python."""
    data = path.read_bytes()
    if data[:2] in (b"\xff\xfe", b"\xfe\xff"):
        text = data.decode("utf-16", errors="replace")
    elif b"\0" in data:
        raise ValueError(f"{name}: expected a text file, got binary data")
    else:
        try:
            text = data.decode("utf-8-sig")
        except UnicodeDecodeError:
            text = data.decode("latin-1")
    return text.replace("\r\n", "\n").replace("\r", "\n")


def _columns(at, header):
    """The number of columns, the place of each known one by name, and the unit of the coordinates."""
    columns, found = {}, {}
    for i, title in enumerate(header):
        key, bracketed, suffix = _parts(title.lower())
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
        raise ValueError(f'{at}: expected the column "{missing[0]}", got "{_shown(header)}"')
    used = {found[key] for key in POINT_COLUMNS}
    if len(used) > 1:
        raise ValueError(f"{at}: expected x, y and z in one unit, got {' and '.join(sorted(used))}")
    return len(header), columns, used.pop()


def _shown(header):
    text = ", ".join(header)
    return text if len(text) < 60 else text[:57] + "..."


def _parts(title):
    """A column's name, and its unit as in "x [mm]" or "x_mm", or ""."""
    place = next((i for i, letter in enumerate(title) if letter in "[(_"), len(title))
    name, mark, rest = title[:place], title[place : place + 1], title[place + 1 :]
    if mark == "_":
        return (name, "", rest) if rest.replace("_", "0").isalnum() else ("", "", "")
    if mark and rest[-1:] not in ("]", ")"):
        return "", "", ""
    return name.rstrip(), rest[:-1].strip(), ""
