# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The coordinates in mesh files that Blender's importers would read as 0: NaN, infinity, words, overflow."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ...core.contact_data.rows import POINT_COLUMNS
from ..touch.types import Array
from . import ply_contacts

STL_HEAD = 84  # The bytes of the head of a binary .stl; the last four are the number of triangles.
STL_TRIANGLE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
PLY_LINE = 65_000  # Longer lines in a .ply would end Blender.
AFTER_WORD = (1, 2, 3)  # These words follow the one that begins the line of a vertex.
LARGEST = float(np.finfo(np.float32).max)


def unreadable(path: Path) -> int:
    """The number of vertices in a .ply, .stl or .obj file whose coordinates are no finite float32 numbers.

    It is 0 for a .stl or .obj file that is broken otherwise, which importers find. Raises ValueError for a
    .ply file of whose vertices an importer might read something else.
    """
    data = path.read_bytes()
    if path.suffix.lower() == ".ply":
        return _of_ply(data)
    try:
        return {".stl": _of_stl, ".obj": _of_obj}[path.suffix.lower()](data)
    except (ValueError, IndexError):
        return 0


def _of_ply(data: bytes) -> int:
    rows, fields, is_text = ply_contacts.vertex_rows("", data)
    lines = np.frombuffer(data, np.uint8, len(data) if is_text else data.find(b"end_header"))
    if np.diff(np.flatnonzero(lines == ord("\n")), prepend=-1, append=len(lines)).max() > PLY_LINE:
        raise ValueError
    if not is_text:
        return _of_numbers(np.stack([rows[key] for key in POINT_COLUMNS], axis=1))
    names = [name for name, _ in fields]
    return _of_lines(rows, [names.index(key) for key in POINT_COLUMNS])


def _of_stl(data: bytes) -> int:
    triangles = int.from_bytes(data[STL_HEAD - 4 : STL_HEAD], "little")
    if len(data) == STL_HEAD + triangles * STL_TRIANGLE.itemsize:
        return _of_numbers(np.frombuffer(data, STL_TRIANGLE, triangles, STL_HEAD)["corners"].reshape(-1, 3))
    return _of_lines([line for line in data.splitlines() if line.lstrip().startswith(b"vertex")], AFTER_WORD)


def _of_obj(data: bytes) -> int:
    lines = map(bytes.lstrip, data.replace(b"\\\n", b" ").splitlines())  # A backslash continues a line.
    return _of_lines([line for line in lines if line.startswith((b"v ", b"v\t"))], AFTER_WORD)


def _of_lines(lines: Sequence[bytes], places: Sequence[int]) -> int:
    """The number of lines without three finite numbers at these places."""
    try:
        return _of_numbers(np.loadtxt(lines, usecols=places, comments=None, ndmin=2)) if lines else 0
    except ValueError:  # Some line has a word in place of a number.
        return sum(_is_bad(line.split(None, max(places) + 1), places) for line in lines)


def _is_bad(words: Sequence[bytes], places: Sequence[int]) -> bool:
    try:
        row = [words[place] for place in places]
        # Only Python takes 1_0 for 10.
        return any(b"_" in word for word in row) or _of_numbers(np.array([list(map(float, row))])) > 0
    except (ValueError, IndexError):
        return True


def _of_numbers(points: Array) -> int:
    return int(np.count_nonzero(~(np.abs(points) <= LARGEST).all(axis=1)))  # NaN fails every comparison.
