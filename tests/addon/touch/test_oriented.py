# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes whose faces point inward or are doubled are refused before their first touch; the advice helps."""

import pytest

pytest.importorskip("bpy", reason="needs Blender as a Python module: run make test")
import bmesh
from scenes import made

INWARD = '"Sphere" has faces that point inward: use Recalculate Outside in Edit Mode'
DOUBLED = "has faces that lie on others and face the opposite way: use Merge by Distance in Edit Mode, then"


def turn(obj, where):
    mesh = bmesh.new()
    mesh.from_mesh(obj.data)
    bmesh.ops.reverse_faces(mesh, faces=[face for face in mesh.faces if where(face)])
    mesh.to_mesh(obj.data)
    mesh.free()


def double(obj):
    mesh = bmesh.new()
    mesh.from_mesh(obj.data)
    mesh.from_mesh(obj.data)
    mesh.faces.ensure_lookup_table()
    bmesh.ops.reverse_faces(mesh, faces=mesh.faces[len(obj.data.polygons) :])
    mesh.to_mesh(obj.data)
    mesh.free()


FAULTS = {
    "inverted": (lambda obj: turn(obj, lambda face: True), INWARD),
    "half": (lambda obj: turn(obj, lambda face: face.index % 128 < 64), INWARD),
    "one": (lambda obj: turn(obj, lambda face: face.index == 300), INWARD),
    "doubled": (double, DOUBLED),
}


def mended(bpy):
    """What the sentences advise, for the active object."""
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="SELECT")
    bpy.ops.mesh.remove_doubles()
    bpy.ops.mesh.normals_make_consistent(inside=False)
    bpy.ops.object.mode_set(mode="OBJECT")


@pytest.mark.parametrize("fault", FAULTS)
def test_each_command_names_the_fault_first_and_its_advice_helps(empty, ball, fault):
    patch, _ = made(empty.ops.tactile.reconstruct, target=ball.name, location=(2.0, 0.0, 0.0))
    spoil, message = FAULTS[fault]
    spoil(ball)
    tactile = empty.ops.tactile
    for command in (
        lambda: tactile.reconstruct(target=ball.name, location=(0.0, 2.0, 0.0)),
        lambda: tactile.pick(target=ball.name, location=(0.0, 2.0, 0.0)),
        lambda: tactile.stability_map(target=ball.name),
        lambda: tactile.touch_all_over(target=ball.name),
        lambda: tactile.verify(target=ball.name),
    ):
        empty.context.view_layer.objects.active = patch
        with pytest.raises(RuntimeError, match=message):
            command()
    empty.context.view_layer.objects.active = ball
    mended(empty)
    _, record = made(tactile.reconstruct, target=ball.name, location=(0.0, 2.0, 0.0))
    assert record["status"] == "ok"
    assert record["k2"] == pytest.approx(-0.5, abs=0.01)


@pytest.mark.parametrize("name", ["plane", "cube", "uv_sphere", "cone", "torus", "grid", "monkey"])
def test_what_the_add_menu_makes_is_right(empty, extension, name):
    getattr(empty.ops.mesh, f"primitive_{name}_add")()
    obj, depsgraph = empty.context.object, empty.context.evaluated_depsgraph_get()
    for scale in (1.0, -1.0):
        obj.scale.x = scale
        empty.context.view_layer.update()
        extension.tactile_addon.touch.detached_mesh.DetachedMesh(obj, depsgraph)
