# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A look at the faces of a mesh before its first touch: contacts need normals that point outward."""

import zlib
from typing import Any

import numpy as np

from ... import core
from .arrays import read_array
from .types import Array, Object

SEEN = 100  # The faults of this many shapes are kept, because a mesh of a million faces takes a second.
ROUNDED = (
    1e-3  # Where vertices are rounded by more of the size, faces coincide: touches say so by themselves.
)
_faults: dict[tuple[int, int], str] = {}


def require_oriented(evaluated: Object, co: Array) -> None:
    """Raises ValueError, with a sentence, if faces of an evaluated object point inward or are doubled.

    co : (n, 3), the coordinates of its vertices
    """
    mesh, name = evaluated.data, evaluated.name
    if np.spacing(np.abs(co).max()) > ROUNDED * np.ptp(co, axis=0).max():
        return
    index: Any = mesh.attributes.get(".corner_vert")  # It is 100 times as fast. There is none in edit mode.
    items, key = (mesh.loops, "vertex_index") if index is None else (index.data, "value")
    corners = read_array(items, key, dtype=np.int32)
    shape = zlib.crc32(co.data), zlib.crc32(corners.data)
    if shape not in _faults:
        if len(_faults) >= SEEN:
            _faults.clear()
        starts = read_array(mesh.polygons, "loop_start", dtype=np.int32)
        _faults[shape] = core.orientation_fault(co, corners, starts)
    if _faults[shape] == core.DOUBLED:
        raise ValueError(
            f'"{name}" has faces that lie on others and face the opposite way: use Merge by Distance in Edit '
            "Mode, then Recalculate Outside"
        )
    if _faults[shape] == core.INWARD:
        raise ValueError(f'"{name}" has faces that point inward: use Recalculate Outside in Edit Mode')
