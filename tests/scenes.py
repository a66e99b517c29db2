# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What tests put into a scene, and what they see of one: what an operator made, values, datablocks."""

from functools import cache

import bmesh
import bpy
import numpy as np

# Words of a command that touches the ball of the fixture `files`.
PLACE = ["--location", "0.3", "-2e-1", "1.9", "--extent", "0.6"]


@cache
def _sphere(segments, rings):
    """Vertices and faces of a unit sphere: Blender takes long to make one."""
    mesh = bmesh.new()
    bmesh.ops.create_uvsphere(mesh, u_segments=segments, v_segments=rings, radius=1.0)
    mesh.verts.index_update()
    faces = [[v.index for v in face.verts] for face in mesh.faces]
    # Blender numbers the faces of a sphere differently in each process: touches would begin elsewhere.
    faces = sorted(face[(i := face.index(min(face))) :] + face[:i] for face in faces)
    vertices = np.array([v.co for v in mesh.verts])
    mesh.free()
    return vertices, faces


def is_of_facets(record):
    """Whether the record of a patch has the doubt that its curvature is that of facets."""
    return any(doubt["code"] == "facets" for doubt in record["doubts"])


def add_sphere(bpy, segments=128, rings=64, radius=2.0, location=(0.0, 0.0, 0.0)):
    """Adds a finely faceted sphere, active and the only one selected, and returns it."""
    vertices, faces = _sphere(segments, rings)
    mesh = bpy.data.meshes.new("Sphere")
    mesh.from_pydata(radius * vertices, [], faces)
    obj = bpy.data.objects.new("Sphere", mesh)
    obj.location = location
    bpy.context.collection.objects.link(obj)
    for other in bpy.context.selected_objects:
        other.select_set(False)
    obj.select_set(True)
    bpy.context.view_layer.objects.active = obj
    bpy.context.view_layer.update()
    return obj


def made(operator, record="tactile", **arguments):
    """Runs an operator; returns the object with such a record that it makes, and the record."""
    before = set(bpy.data.objects)
    assert operator(**arguments) == {"FINISHED"}
    (obj,) = (obj for obj in set(bpy.data.objects) - before if record in obj)
    return obj, obj[record].to_dict()


def values(mesh, name, key="value", width=1):
    """The values of an attribute, (n,) or (n, width)."""
    attribute = mesh.attributes[name]
    out = np.empty(len(attribute.data) * width)
    attribute.data.foreach_get(key, out)
    return out.reshape(-1, width) if width > 1 else out


def positions(mesh):
    return values(mesh, "position", "vector", 3)


def datablocks(bpy):
    """The names of datablocks, by kind."""
    kinds = ("objects", "meshes", "materials", "collections", "node_groups", "images", "curves")
    return {kind: sorted(block.name for block in getattr(bpy.data, kind)) for kind in kinds}


def by_hand(bpy, operator, **arguments):
    """Runs an operator as a key does: its step of undo is stored first, then the handlers run."""
    assert operator("EXEC_DEFAULT", True, **arguments) == {"FINISHED"}
    bpy.context.view_layer.update()


def step(bpy, name):
    """Runs undo or redo, whichever is named."""
    getattr(bpy.ops.ed, name)()
    bpy.context.view_layer.update()


def select(bpy, obj):
    bpy.ops.object.select_all(action="DESELECT")
    obj.select_set(True)
    bpy.context.view_layer.objects.active = obj
    bpy.context.view_layer.update()
    bpy.ops.ed.undo_push(message="selected")
