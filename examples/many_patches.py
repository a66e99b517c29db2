# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Many patches on one object, a line of JSON for each.

In Blender, with the extension installed (not --factory-startup, which disables extensions):

    blender --background scene.blend --python examples/many_patches.py -- --count 50 --output patches.blend

and the same with Blender as a Python module, where BLENDER_USER_RESOURCES names the folder it was
installed to:

    python examples/many_patches.py scene.blend --count 50 --output patches.blend
"""

import argparse
import json
import random
import sys

import bpy

# isort: split
# Blender's own modules can be found once bpy is there.
import addon_utils

# In an installed Blender the extension is enabled already, from a file or from Blender's platform.
if not hasattr(bpy.types, "TACTILE_OT_reconstruct"):
    addon_utils.enable("bl_ext.user_default.tactile_patch", default_set=False)

parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
parser.add_argument("scene", nargs="?", help="a .blend to open (the open scene)")
parser.add_argument("--count", type=int, default=20)
parser.add_argument("--output", help="a .blend to save the patches in")
options = parser.parse_args(sys.argv[sys.argv.index("--") + 1 :] if "--" in sys.argv else sys.argv[1:])
if options.scene:
    bpy.ops.wm.open_mainfile(filepath=options.scene)

target = bpy.context.view_layer.objects.active
if target is None or target.type != "MESH":
    sys.exit("many_patches: make the mesh to touch the active object of the scene")
depsgraph = bpy.context.evaluated_depsgraph_get()
# Vertices of the object as it evaluates, in the world, seeded: the same patches every time.
evaluated = target.evaluated_get(depsgraph)
places = [tuple(evaluated.matrix_world @ vertex.co) for vertex in evaluated.data.vertices]
random.Random(0).shuffle(places)

for place in places[: options.count]:
    try:
        bpy.ops.tactile.reconstruct(target=target.name, location=place)
    except RuntimeError as refusal:  # an edge, a crease, a hole: the sentence says which
        print(json.dumps({"location": place, "error": str(refusal).strip()}))
        continue
    # The patch is the active object now, and keeps its report.
    report = bpy.context.view_layer.objects.active["tactile"].to_dict()
    print(json.dumps({key: report[key] for key in ("patch", "status", "k1", "k2", "fit_error")}))

if options.output:
    bpy.ops.wm.save_as_mainfile(filepath=options.output)
