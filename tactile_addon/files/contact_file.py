# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Contact data in files: CSV in and out, PLY in, JSON out. docs/contacts.md describes the formats."""

import json
from dataclasses import replace
from pathlib import Path

from ... import core
from ...core import Contacts
from . import ply_contacts, whole_file

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
        return ply_contacts.read(name, path)
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
