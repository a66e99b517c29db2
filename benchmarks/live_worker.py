# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Times the live updates of any checkout, so that two can be compared in one run; benchmarks.live starts it.

`python benchmarks/live_worker.py ROOT`, whose extension is built. Each line of the input is answered by
seconds of processor time: `sheet FACES` touches a wavy sheet, `update DEGREES` turns its first plane as a
drag of the handle does, and `end` ends the gesture.
"""

import math
import os
import sys
from pathlib import Path
from time import process_time


def sheet(bpy, faces):
    """A wavy sheet of about that many faces, the only object of the scene."""
    import numpy as np

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
    rooms = hasattr(addon, "probes")
    update = addon.probes.touch_again.update if rooms else addon.probe.update
    handlers = addon.probes.change_handlers if rooms else addon.live
    handlers.update = lambda probe, depsgraph, complete: update(probe, depsgraph, complete=False)
    return update


def main():
    sys.path.insert(0, sys.argv[1])  # This comes before the folder of this file.
    from tools import blender

    answers, output = os.fdopen(os.dup(1), "w"), os.open(os.devnull, os.O_WRONLY)
    os.dup2(output, 1)  # Blender itself prints there.
    extension = blender.start(Path(sys.argv[1], "build", "tactile_patch.zip"))
    import bpy

    end, probe = as_in_a_window(extension.tactile_addon), None
    for line in sys.stdin:
        task, *given = line.split()
        start = process_time()
        if task == "sheet":
            obj = sheet(bpy, int(given[0]))
            start = process_time()
            bpy.ops.tactile.pick(target=obj.name, location=(0.2, 0.1, 0.05))
            probe = bpy.context.object
        elif task == "update":
            probe.tactile_probe.azimuths[0] = math.radians(float(given[0]))
        else:
            end(probe, bpy.context.evaluated_depsgraph_get(), complete=True)
        print(process_time() - start, file=answers, flush=True)


if __name__ == "__main__":
    main()
