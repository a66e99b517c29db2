# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The objects in files, and one of them as it is touched; it needs bpy."""

from pathlib import Path
from typing import Any

import bpy
import numpy as np

from ..data_set.folder import hash_of
from ..extension import addon, core

detached_mesh, evaluated_mesh = addon("touch.detached_mesh"), addon("touch.evaluated_mesh")
mesh_file = addon("files.mesh_file")
SCENES = (".blend", ".obj")  # These files may have several objects, which have names of their own.


class Touchable:
    """An evaluated mesh object of the open scene that can be touched many times.

    obj : the object of the scene, which is valid until another file is opened
    surface : the mesh for core, in the directions of the world and relative to the object's origin
    offset : (3,), this origin in the world
    points, triangles : (n, 3) and (m, 3), counterclockwise from outside, in the coordinates of `surface`
    facts : plain values that say which object it is
    """

    def __init__(self, obj: Any, path: str) -> None:
        """Raises ValueError, with a sentence, if `obj` cannot be touched."""
        depsgraph = bpy.context.evaluated_depsgraph_get()
        self.obj = obj
        _, _, self.offset = evaluated_mesh.evaluated_object(obj, depsgraph)
        self.surface = detached_mesh.DetachedMesh(obj, depsgraph)
        self.points, self.triangles = self.surface.points, self.surface.triangles
        shape = (self.points, self.triangles, self.offset)
        units = bpy.context.scene.unit_settings
        self.facts = {
            "name": _name_of(obj, path),
            "hash": hash_of(*(np.ascontiguousarray(array).tobytes() for array in shape)),
            "file": path,
            "size": self.surface.size,
            "unit": None if units.system == "NONE" else units.scale_length,
            "vertices": len(self.points),
            "triangles": len(self.triangles),
        }

    def places(self, count: int, rng: np.random.Generator) -> Any:
        """Random points all over the object and the unit normals there, (count, 3) each."""
        return core.scattered(self.points, self.triangles, count, rng)


def survey(path: str) -> list[dict[str, Any]]:
    """The facts of all objects in a file; those of one that cannot be touched have `trouble`, a sentence."""
    return [_facts(obj, path) for obj in _open(path)]


def touchable(path: str, name: str) -> Touchable:
    """The object of this name in a file. Raises OSError or ValueError, with a sentence."""
    for obj in _open(path):
        if _name_of(obj, path) == name:
            return Touchable(obj, path)
    raise OSError(f'"{path}" has no object "{name}" any more')


def _open(path: str) -> list[Any]:
    """The visible mesh objects of a file, sorted by name."""
    mesh_file.open_file(Path(path))
    objects = sorted(bpy.context.view_layer.objects, key=lambda obj: obj.name)
    found = [obj for obj in objects if obj.type == "MESH" and obj.visible_get()]
    if not found:
        raise OSError(f'no visible mesh object is in "{Path(path).name}": show one')
    return found


def _facts(obj: Any, path: str) -> dict[str, Any]:
    try:
        return Touchable(obj, path).facts
    except ValueError as error:
        return {"name": _name_of(obj, path), "hash": None, "file": path, "trouble": str(error)}


def _name_of(obj: Any, path: str) -> str:
    return obj.name if Path(path).suffix.lower() in SCENES else Path(path).stem
