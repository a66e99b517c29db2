# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Where the time goes when a probe follows the mouse: one live update, on a small and on a large mesh.

`python -m benchmarks.live ZIP`, from the root of a checkout; ZIP is the built extension.

A wavy sheet is touched once, so that Blender builds its tree of the faces. Then the first plane is turned by
a degree again and again, as dragging its handle does. The Markdown table has medians of processor time in
milliseconds, on one thread in one Blender without a window: `ray casts` are Blender's part of tracking, `fit`
is the reconstruction with its report, `mesh write` rewrites patch and contours with normals and colors, and
`all` is the whole update with Blender's evaluation of what has changed, without the redraw. The extent is
given, and the last column says how many times as long an update takes that chooses it. Two columns are not
live: the first touch, which builds that tree, and the end of a gesture, which measures the distances to the
mesh.
"""

import math
from statistics import median
from time import process_time

import numpy as np

from tools import blender

from . import machine, parser_of, table, timed

FACES = (10_000, 1_000_000)
UPDATES, ENDS = 101, 7
STAGES = ("ray casts", "tracking", "fit", "mesh write", "all")


def sheet(bpy, faces):
    """A wavy sheet of about that many faces, the only object of the scene."""
    bpy.ops.wm.read_homefile(use_empty=True)
    side = math.isqrt(faces)
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=side, y_subdivisions=side, size=2.0)
    obj = bpy.context.object
    co = np.empty((len(obj.data.vertices), 3), dtype=np.float32)
    obj.data.vertices.foreach_get("co", co.ravel())
    co[:, 2] = 0.3 * np.sin(2.0 * co[:, 0]) * np.cos(1.5 * co[:, 1])
    obj.data.vertices.foreach_set("co", co.ravel())
    obj.data.update()
    return obj


def as_in_a_window(addon):
    """Makes updates leave out what takes long, as in a drag; returns the function that ends the gesture."""
    update = addon.probes.touch_again.update
    # Without a window the second of two callbacks for one angle would end the gesture.
    addon.probes.change_handlers.is_pending = lambda probe: False
    addon.probes.change_handlers.update = lambda probe, depsgraph, complete: update(
        probe, depsgraph, complete=False
    )
    return update


class Clock:
    """Adds up the time spent in functions of modules, which it wraps."""

    def __init__(self):
        self.spent = {}

    def wrap(self, owner, name, stage):
        inner = getattr(owner, name)

        def counted(*args, **kwargs):
            seconds, value = timed(inner, *args, **kwargs)
            self.spent[stage] = self.spent.get(stage, 0.0) + seconds
            return value

        setattr(owner, name, counted)


def measure(bpy, update, clock, faces):
    """A row of the table in milliseconds: medians by stage, the first touch, and the end of a gesture."""
    obj = sheet(bpy, faces)
    first, _ = timed(bpy.ops.tactile.pick, target=obj.name, location=(0.2, 0.1, 0.05))
    probe = bpy.context.object
    (patch,) = probe.children
    chosen = median(run["all"] for run in updates(probe, clock))
    probe.tactile_probe.extent = patch["tactile"]["extent"]
    runs = updates(probe, clock)
    depsgraph = bpy.context.evaluated_depsgraph_get()
    once = first, median(timed(update, probe, depsgraph, complete=True)[0] for _ in range(ENDS))
    stages = [median(run[stage] for run in runs) for stage in STAGES]
    cells = [*(f"{1e3 * seconds:.1f}" for seconds in (*stages, *once)), f"{chosen / stages[-1]:.1f}"]
    return [f"{len(obj.data.polygons)}", f"{len(patch.data.vertices)}", *cells]


def updates(probe, clock):
    """The seconds of each stage, of live updates."""
    probe.tactile_probe.azimuths[0], runs = 0.0, []
    for i in range(UPDATES):
        clock.spent.clear()
        start = process_time()
        probe.tactile_probe.azimuths[0] = math.radians(1 + i % 50)
        runs.append({**clock.spent, "all": process_time() - start})
    return runs


def main():
    parser = parser_of(__doc__, takes_zip=True)
    options = parser.parse_args()
    extension = blender.start(options.zip)
    import bpy

    addon, core, clock = extension.tactile_addon, extension.core, Clock()
    touches, tracking = core.exploration.touches, core.contours.tracking
    clock.wrap(addon.touch.surface.MeshSurface, "ray_cast", "ray casts")
    for name in ("first_contact", "_extended"):
        clock.wrap(tracking, name, "tracking")
    clock.wrap(touches, "fitted", "fit")
    clock.wrap(addon.touch.touch_object, "reconstruction_report", "fit")
    clock.wrap(addon.scene.patch_object, "rewrite", "mesh write")
    update = as_in_a_window(addon)
    columns = ("faces", "patch vertices", *STAGES, "first touch", "end of a gesture", "automatic / given")
    with blender.quiet():
        rows = [measure(bpy, update, clock, faces) for faces in FACES]
    table(columns, rows, left=0)
    print(f"Milliseconds of the processor, medians of {UPDATES} updates; {machine('bpy')}.")


if __name__ == "__main__":
    main()
