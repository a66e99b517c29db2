# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Nothing that is only drawn reaches other programs: what Blender exports is where the objects are."""

import numpy as np
import pytest

pytest.importorskip("bpy", reason="needs Blender as a Python module: run make test")
from scenes import made
from scipy.spatial import KDTree

CLOSE = 1e-6  # As a share of the size: files have single precision.
AXES = {"forward_axis": "Y", "up_axis": "Z"}


def ply(bpy, path):
    """With attributes if all objects have the same; Blender may end where one between others lacks some."""
    kinds = {tuple(sorted(each.data.attributes.keys())) for each in bpy.context.selected_objects}
    bpy.ops.wm.ply_export(
        filepath=path, export_selected_objects=True, export_attributes=len(kinds) == 1, **AXES
    )
    return lambda: bpy.ops.wm.ply_import(filepath=path, **AXES)


def stl(bpy, path):
    bpy.ops.wm.stl_export(filepath=path, export_selected_objects=True, **AXES)
    return lambda: bpy.ops.wm.stl_import(filepath=path, **AXES)


def obj(bpy, path):
    bpy.ops.wm.obj_export(filepath=path, export_selected_objects=True, **AXES)
    return lambda: bpy.ops.wm.obj_import(filepath=path, **AXES)


def glb(bpy, path):
    addon_utils = pytest.importorskip("addon_utils")
    addon_utils.enable("io_scene_gltf2", default_set=False)
    bpy.ops.export_scene.gltf(filepath=path, use_selection=True, export_apply=True)
    return lambda: bpy.ops.import_scene.gltf(filepath=path)


def fbx(bpy, path):
    """Along the axes of Blender; turned, its angles are off by up to 2e-5 of the size."""
    addon_utils = pytest.importorskip("addon_utils")
    addon_utils.enable("io_scene_fbx", default_set=False)
    bpy.ops.export_scene.fbx(filepath=path, use_selection=True, axis_forward="Y", axis_up="Z")
    return lambda: bpy.ops.wm.fbx_import(filepath=path)


def dae(bpy, path):
    if not getattr(bpy.app.build_options, "collada", False):
        pytest.skip("this Blender has no Collada")
    bpy.ops.wm.collada_export(filepath=path, selected=True)
    return lambda: bpy.ops.wm.collada_import(filepath=path)


def usdc(bpy, path):
    bpy.ops.wm.usd_export(filepath=path, selected_objects_only=True)
    return lambda: bpy.ops.wm.usd_import(filepath=path)


def abc(bpy, path):
    bpy.ops.wm.alembic_export(filepath=path, selected=True, as_background_job=False)
    return lambda: bpy.ops.wm.alembic_import(filepath=path, as_background_job=False)


def world_points(objects):
    """The vertices (n, 3) of mesh objects in the world."""
    found = []
    for each in objects:
        points = np.array([v.co for v in each.data.vertices])
        matrix = np.array(each.matrix_world)
        found.append(points @ matrix[:3, :3].T + matrix[:3, 3])
    return np.vstack(found)


def patches(bpy):
    """Patches over each other."""
    for place in ((0, 0, 2), (0.2, 0, 1.99), (0, 0.2, 1.99)):
        yield made(bpy.ops.tactile.reconstruct, target="Sphere", location=place, extent=0.6)[0]


def surface(bpy):
    """A surface that does not cover its object."""
    found, record = made(
        bpy.ops.tactile.touch_all_over, "tactile_object", target="Sphere", most=2, tolerance=0.1, edge=0.3
    )
    assert record["uncovered"] > 0
    yield found


def stability_map(bpy):
    yield made(bpy.ops.tactile.stability_map, "tactile_map", target="Sphere", extent=0.5, spacing=1.5)[0]


def everything(bpy):
    """Objects with different attributes, the surface between patches."""
    first, *others = patches(bpy)
    yield from (first, *surface(bpy), *others, *stability_map(bpy))


@pytest.mark.filterwarnings("ignore:Setting the shape:DeprecationWarning")  # Of Blender's .fbx exporter.
@pytest.mark.parametrize("make", [patches, surface, stability_map, everything])
@pytest.mark.parametrize("export", [ply, stl, obj, glb, fbx, dae, usdc, abc])
def test_exports_have_what_is_there_and_not_what_is_drawn(empty, ball, tmp_path, make, export):
    written = list(make(empty))
    empty.context.view_layer.update()
    wanted = world_points(written)
    for each in empty.context.scene.objects:
        each.select_set(each in written)
    load = export(empty, str(tmp_path / f"out.{export.__name__}"))
    empty.ops.wm.read_homefile(use_empty=True)
    with empty.context.temp_override(window=empty.context.window_manager.windows[0]):
        load()
    empty.context.view_layer.update()
    found = world_points(each for each in empty.context.scene.objects if each.type == "MESH")
    size = np.ptp(wanted, axis=0).max()
    assert KDTree(found).query(wanted)[0].max() <= CLOSE * size
    assert KDTree(wanted).query(found)[0].max() <= CLOSE * size
