# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Scenes and meshes in files, by Blender's own importers and exporter, without a window."""

import bpy


def open_file(path):
    """Makes the file the scene: opens a .blend, imports a mesh into an empty one, coordinates as they are."""
    if path.suffix.lower() == ".blend" and path.is_file():
        bpy.ops.wm.open_mainfile(filepath=str(path.absolute()), load_ui=False)
    else:
        add(path, empty=True)


def add(path, empty=False):
    """Adds the mesh of a .ply, .stl or .obj file to the scene, or to an empty one; returns its object.

    Raises OSError with a sentence for the user.
    """
    if not path.is_file():
        raise OSError(f'there is no file "{path}"')
    full, kind = str(path.absolute()), path.suffix.lower()
    imports = {
        ".ply": lambda: bpy.ops.wm.ply_import(filepath=full),
        ".stl": lambda: bpy.ops.wm.stl_import(filepath=full),
        ".obj": lambda: bpy.ops.wm.obj_import(filepath=full, forward_axis="Y", up_axis="Z"),
    }
    if kind not in imports:
        raise OSError(f'cannot read "{path.name}": wanted a .blend, .ply, .stl or .obj file')
    if empty:
        bpy.ops.wm.read_homefile(use_empty=True)
    unreadable, there = f'no mesh could be read from "{path.name}": is the file whole?', set(bpy.data.objects)
    if kind == ".ply" and not _has_header(path):
        raise OSError(unreadable)
    try:
        # Importers ask for a window, which is not the current one after `blender -b`.
        with bpy.context.temp_override(window=bpy.context.window_manager.windows[0]):
            imports[kind]()
    except RuntimeError as error:
        raise OSError(unreadable) from error
    for obj in set(bpy.data.objects) - there:
        if obj.type == "MESH" and len(obj.data.polygons):
            return obj
    raise OSError(unreadable)


def _has_header(path):
    """Whether the header of a .ply file comes to its end; where it does not, the importer ends Blender."""
    with path.open("rb") as file:
        return b"end_header" in file.read(1 << 16)


def write(path, obj):
    """The mesh of an object with its attributes, as .ply."""
    with bpy.context.temp_override(selected_objects=[obj], window=bpy.context.window_manager.windows[0]):
        bpy.ops.wm.ply_export(
            filepath=str(path.absolute()),
            export_selected_objects=True,
            export_attributes=True,
            export_uv=False,  # whose seams would split vertices
        )
