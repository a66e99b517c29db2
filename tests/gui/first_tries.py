# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Run in a window of Blender: what is tried first, a torus of facets and Suzanne as Blender's menu adds them.

Its pictures are next to the scene.
"""

import sys
from pathlib import Path

import bpy
import gui
from mathutils import Vector

sys.path.insert(0, str(Path(__file__).parent))
from common import ASIDE, check, extent, handle, is_complete, look, open_tab, patch, picture, probe, until

SUBDIVIDE_BUTTON = (893, 522)
SMALL = 0.043


def only(add, **given):
    """Adds an object, which becomes the only one in the file."""
    for obj in list(bpy.data.objects):
        bpy.data.objects.remove(obj)
    add(location=(0.0, 0.0, 0.0), **given)
    return bpy.context.object


def pick(obj, place, **given):
    window, area, region = gui.find()
    with bpy.context.temp_override(window=window, area=area, region=region):
        bpy.ops.tactile.pick(target=obj.name, location=place, new=True, **given)
    yield 1
    yield from until(is_complete)


def header(place):
    """What the header says while a pick's mouse is over a place of the world; the pick is canceled."""
    operator, said = bpy.types.TACTILE_OT_pick, []
    inner = operator._hover
    operator._hover = lambda self, context, event: said.append(inner(self, context, event)) or said[-1]
    window, area, region = gui.find()
    with bpy.context.temp_override(window=window, area=area, region=region):
        bpy.ops.tactile.pick("INVOKE_DEFAULT", True, new=True)
    yield 1
    x, y = (round(v) for v in gui.view_point(place))
    gui.xdo("mousemove", x - 5, y, "sleep", 0.3, "mousemove", x, y)
    yield 2
    picture("header")
    gui.xdo("key", "Escape")
    yield 1
    operator._hover = inner
    return said[-1]


def facets():
    torus = only(bpy.ops.mesh.primitive_torus_add)
    look((0, 0, 0), (1, -1, 1), 5)
    said = yield from header((0.9, -0.86, 0.1))
    check(
        "while picking, the header has a verdict that is not good",
        "Doubtful: add a Subdivision" in said,
        said,
    )
    check("... and Esc leaves nothing", probe() is None)
    yield from pick(torus, (0.9, -0.86, 0.05))
    look(probe().matrix_world.translation, (1, -1, 0.6), 1.5)
    yield 1
    check("a touch of facets is about them", "Subdivision" in patch()["tactile"]["doubts"][0]["advice"], "")
    check("... and goes over several of them", patch()["tactile"]["radius"] > 0.3, "")
    picture("facets")
    bpy.ops.ed.undo_push(message="Picked")
    gui.click(*SUBDIVIDE_BUTTON)
    yield 1
    yield from until(lambda: bool(bpy.data.objects["Torus"].modifiers))
    yield from until(is_complete)
    gui.xdo("mousemove", *ASIDE)
    yield 0.5
    record = patch()["tactile"].to_dict()
    check(
        "Add Subdivision makes it smooth", record["status"] == "ok" and abs(record["k1"] + 4.0) < 0.4, record
    )
    picture("subdivided")
    gui.xdo("mousemove", *ASIDE, "sleep", 0.2, "key", "ctrl+z")
    yield from until(lambda: not bpy.data.objects["Torus"].modifiers)
    yield from until(is_complete)
    check("one Ctrl Z takes it back", not bpy.data.objects["Torus"].modifiers, "")
    check("... and the verdict with it", "Subdivision" in patch()["tactile"]["doubts"][0]["advice"], "")


def forehead():
    monkey = only(bpy.ops.mesh.primitive_monkey_add)
    modifier = monkey.modifiers.new("Subdivision", "SUBSURF")
    modifier.levels = 3
    bpy.context.view_layer.update()
    place = Vector((0.0, -0.73, 0.62))
    look(place, (0.2, -1, 0.3), 3)
    yield from pick(monkey, place)
    record = patch()["tactile"].to_dict()
    print("forehead", record["extent"], record["status"], record["message"], flush=True)
    check("an automatic extent on the forehead is good", record["status"] == "ok", record["message"])
    picture("forehead")
    yield from small(monkey)


def small(target):
    """A probe of little extent, seen from afar."""
    probe().tactile_probe.extent = SMALL
    yield 1
    found, tilts, azimuths = probe(), [*probe().tactile_probe.tilts], [*probe().tactile_probe.azimuths]
    place = found.matrix_world.translation.copy()
    for _ in range(3):
        before = probe().matrix_world.translation.copy()
        at = gui.view_point(before)
        gui.drag(at, (at[0] + 30, at[1] + 12))
        yield 1
        yield from until(is_complete)
        moved = (probe().matrix_world.translation - before).length
        check("a small probe is moved by its center", moved > 0.05, moved)
    settings = probe().tactile_probe
    check("... and no plane is tilted", [*settings.tilts] == tilts, [*settings.tilts])
    check(
        "... nor turned, nor the extent changed", [*settings.azimuths] == azimuths and settings.extent > 0.042
    )
    picture("small")
    look(probe().matrix_world.translation, (0.2, -1, 0.3), 0.5)
    yield 0.5
    turned = [round(v) for v in handle(probe().tactile_probe.azimuths[0])]
    gui.xdo("mousemove", turned[0] - 8, turned[1], "sleep", 0.3, "mousemove", *turned)
    yield 2.5
    picture("tooltip")
    gui.drag(turned, (turned[0] + 10, turned[1] - 40))
    yield 1
    yield from until(is_complete)
    check("seen from near its planes turn", [*probe().tactile_probe.azimuths] != azimuths)
    check("... and it stays", (probe().matrix_world.translation - place).length > 0.05)


def map_and_views():
    """The map by reach, and one legend in a quad view."""
    window, area, region = gui.find()
    with bpy.context.temp_override(window=window, area=area, region=region):
        bpy.ops.tactile.stability_map(target="Suzanne", spacing=0.3)
    painted = bpy.context.object
    look((0, 0, 0), (0.2, -1, 0.3), 4)
    for shown in ("reach", "reason"):
        painted.tactile_map_colors = shown
        yield 1
        picture(f"map_{shown}")
    with bpy.context.temp_override(window=window, area=area, region=region):
        bpy.ops.screen.region_quadview()
    yield 1.5
    picture("quad")


def cubes():
    """A point on the edge of a cube, and a cube of a millimeter, which the view clips until it is touched."""
    cube = only(bpy.ops.mesh.primitive_cube_add)
    look((0, 0, 0), (1, -1, 0.6), 5)
    yield from pick(cube, (1.0, -1.0, 0.2))
    said = patch()["tactile"]["message"]
    check("the advice for a point on an edge: move away", "move the point away from the edge" in said, said)
    picture("cube_edge")
    cube = only(bpy.ops.mesh.primitive_cube_add, size=1e-3)
    look((0, 0, 0), (0.5, -1, 0.6), 2.5e-3)
    yield 1
    picture("millimeter_clipped")
    window, area, region = gui.find()
    with bpy.context.temp_override(window=window, area=area, region=region):
        bpy.ops.tactile.pick("INVOKE_DEFAULT", True, new=True)
    yield 1
    gui.click(*(round(v) for v in gui.view_point((1e-4, -5e-4, 1e-4))))
    yield 1
    yield from until(lambda: probe() is not None and is_complete())
    gui.xdo("mousemove", *ASIDE)
    yield 1
    check(
        "a cube of a millimeter is seen", area.spaces.active.clip_start < 1e-4, area.spaces.active.clip_start
    )
    check("... and touched", abs(extent(probe()) - 5e-4) < 2e-4, extent(probe()))
    picture("millimeter")


def ranges():
    """Two patches of one mesh."""
    ball = only(bpy.ops.mesh.primitive_uv_sphere_add, segments=64, ring_count=32, scale=(1.0, 1.0, 0.5))
    look((0, 0, 0), (1, -1, 1), 4)
    for place in ((0.0, 0.0, 0.5), (1.0, 0.0, 0.0)):
        yield from pick(ball, place)
        bpy.ops.ed.undo_push(message="Picked")
    limits = {o["tactile"]["color_limit"] for o in bpy.data.objects if "tactile" in o}
    check("two patches have one range", len(limits) == 1, limits)
    picture("ranges")


def steps():
    yield from open_tab()
    yield from ranges()
    yield from cubes()
    yield from facets()
    yield from forehead()
    yield from map_and_views()


gui.play(steps())
