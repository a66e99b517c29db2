# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Scenes and meshes in files, by Blender's own importers and exporter, without a window."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import bpy
import numpy as np

from ...core.arguments import many
from ...core.contact_data.rows import POINT_COLUMNS
from ..touch.types import Array, Object
from . import contact_file, whole_file

STL_HEAD = 84  # The bytes of the head of a binary .stl; the last four are the number of triangles.
STL_TRIANGLE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
PLY_LINE = 65_000  # Longer lines in a .ply would end Blender.
AFTER_WORD = (1, 2, 3)  # These words follow the one that begins the line of a vertex.
LARGEST = float(np.finfo(np.float32).max)
MOST_NAMES = 10  # A sentence lists no more meshes.
# The operators that import files with these endings, and their options.
IMPORTS = {
    ".ply": ("ply_import", {}),
    ".stl": ("stl_import", {}),
    ".obj": ("obj_import", {"forward_axis": "Y", "up_axis": "Z"}),
}


def open_file(path: Path) -> None:
    """Makes a file the scene: opens a .blend, or imports a mesh into an empty scene, unchanged."""
    if path.suffix.lower() == ".blend" and path.is_file():
        bpy.ops.wm.open_mainfile(filepath=str(path.absolute()), load_ui=False)
    else:
        meshes = add(path, empty=True)
        # Lines may be first, and the importer activates what is.
        bpy.context.view_layer.objects.active = meshes[0] if len(meshes) == 1 else None
        bpy.context.scene.unit_settings.system = "NONE"  # Such a file does not name its unit.


def named(path: Path, meshes: Sequence[Object], name: str) -> Object:
    """The mesh object of this name, or the only one if `name` is "". Raises OSError that lists them."""
    found = [obj for obj in meshes if name in ("", obj.name)]
    if len(found) == 1:
        return found[0]
    wrong = f'no mesh "{name}"' if name else many(len(meshes), "mesh", "meshes")
    names = ", ".join(f'"{obj.name}"' for obj in meshes[:MOST_NAMES])
    more = f" and {len(meshes) - MOST_NAMES} more" if len(meshes) > MOST_NAMES else ""
    raise OSError(f'"{path.name}" has {wrong}: name one of them with --target: {names}{more}')


def add(path: Path, empty: bool = False) -> list[Object]:
    """Adds a .ply, .stl or .obj file to the scene, or to an empty one; returns what has faces, by name.

    Raises OSError with a sentence for the user.
    """
    if not path.is_file():
        raise OSError(f'there is no file "{path}"')
    if path.suffix.lower() not in IMPORTS:
        raise OSError(f'cannot read "{path.name}": expected a .blend, .ply, .stl or .obj file')
    if empty:
        bpy.ops.wm.read_homefile(use_empty=True)
    _require_readable(path)
    there = set(bpy.data.objects)
    operator, options = IMPORTS[path.suffix.lower()]
    try:
        # Importers need a window, and after `blender -b` none is current.
        with bpy.context.temp_override(window=bpy.context.window_manager.windows[0]):
            getattr(bpy.ops.wm, operator)(filepath=str(path.absolute()), **options)
    except RuntimeError as error:
        raise _unreadable(path) from error
    added: set[Object] = set(bpy.data.objects) - there
    meshes = [obj for obj in added if obj.type == "MESH" and len(obj.data.polygons)]
    if not meshes:
        raise _unreadable(path)
    return sorted(meshes, key=lambda obj: obj.name)


def _require_readable(path: Path) -> None:
    """Raises OSError for a file that would end Blender, or of which Blender would read something else."""
    try:
        is_wild = ARE_WILD[path.suffix.lower()](path.read_bytes())
    except ValueError as error:
        raise _unreadable(path) from error
    if is_wild:
        raise OSError(
            f'"{path.name}" has vertices whose coordinates are not finite in single precision: correct or '
            "delete these"
        )


def _of_ply(data: bytes) -> bool:
    """Whether vertices are wild. Raises ValueError if an importer might read something else of them."""
    rows, fields, is_text = contact_file.vertex_rows("", data)
    lines = np.frombuffer(data, np.uint8, len(data) if is_text else data.find(b"end_header"))
    if np.diff(np.flatnonzero(lines == ord("\n")), prepend=-1, append=len(lines)).max() > PLY_LINE:
        raise ValueError
    if not is_text:
        return _are_wild(np.stack([rows[key] for key in POINT_COLUMNS], axis=1))
    names = [name for name, _ in fields]
    return _of_lines(rows, [names.index(key) for key in POINT_COLUMNS])


def _of_stl(data: bytes) -> bool:
    triangles = int.from_bytes(data[STL_HEAD - 4 : STL_HEAD], "little")
    if len(data) == STL_HEAD + triangles * STL_TRIANGLE.itemsize:
        return _are_wild(np.frombuffer(data, STL_TRIANGLE, triangles, STL_HEAD)["corners"])
    return _of_lines([line for line in data.splitlines() if line.lstrip().startswith(b"vertex")], AFTER_WORD)


def _of_obj(data: bytes) -> bool:
    lines = map(bytes.lstrip, data.replace(b"\\\n", b" ").splitlines())  # A backslash continues a line.
    return _of_lines([line for line in lines if line.startswith((b"v ", b"v\t"))], AFTER_WORD)


def _of_lines(lines: Sequence[bytes], places: Sequence[int]) -> bool:
    """Whether any line has not three finite numbers at these places."""
    try:
        return bool(lines) and _are_wild(np.loadtxt(lines, usecols=places, comments=None, ndmin=2))
    except ValueError:  # Some line has a word in place of a number.
        return True


def _are_wild(points: Array) -> bool:
    return not (np.abs(points) <= LARGEST).all()  # NaN fails every comparison.


# Functions that tell of the bytes of a file whether it has vertices whose coordinates are no finite float32
# numbers. It has none if it is broken otherwise, which importers find.
ARE_WILD = {".ply": _of_ply, ".stl": _of_stl, ".obj": _of_obj}


def _unreadable(path: Path) -> OSError:
    return OSError(f'no mesh could be read from "{path.name}": is the file complete?')


def write(path: Path, obj: Object) -> None:
    """Writes the mesh of an object without modifiers, with its attributes, as .ply.

    Raises OSError with a sentence, as save_scene does; the old file is then as it was.
    """
    seen: Any = {"selected_objects": [obj], "window": bpy.context.window_manager.windows[0]}
    with whole_file.replacing(path) as temporary, bpy.context.temp_override(**seen):
        bpy.ops.wm.ply_export(
            filepath=str(temporary),
            export_selected_objects=True,
            apply_modifiers=False,
            export_attributes=True,
            export_uv=False,  # Seams would split vertices.
        )


def save_scene(path: Path) -> None:
    """Writes the open scene as .blend."""
    with whole_file.replacing(path) as temporary:
        try:
            bpy.ops.wm.save_as_mainfile(filepath=str(temporary), copy=True)
        except RuntimeError as error:  # If the disk is full, Blender says that there is no such file.
            raise OSError("Blender has not written all of it") from error
