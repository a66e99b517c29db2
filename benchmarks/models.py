# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The standard models of the field, touched all over with the dialog's defaults.

`python -m benchmarks.models ZIP FOLDER [--only NAME]`, from the root of a checkout; ZIP is the built
extension, and FOLDER has models as .obj, .ply or .stl, such as those of
github.com/alecjacobson/common-3d-test-models. It prints a Markdown table, and below it what the report says
of each model that is not ok, and draws build/charts/models.jpg, models above and what was felt of them below.

Columns are those of benchmarks.add_menu.
"""

import argparse
import sys
from pathlib import Path

from tools import blender

from . import machine, table
from .add_menu import draw, row, touched


def imported(path):
    """Imports a model into the scene, as it comes."""
    import bpy

    importer = getattr(bpy.ops.wm, f"{path.suffix[1:]}_import")
    importer(filepath=str(path))
    bpy.context.object.name = path.stem


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("zip", type=Path, help="the built extension")
    parser.add_argument("folder", type=Path, help="the folder of models")
    parser.add_argument("--only", default="", help="only models with this in their names")
    options = parser.parse_args()
    rows, messages, pairs = [], [], []
    with blender.quiet():
        blender.start(options.zip)
        import bpy

        bpy.ops.wm.read_homefile(use_empty=True)
        for path in sorted(options.folder.iterdir()):
            if path.suffix not in (".obj", ".ply", ".stl") or options.only not in path.name:
                continue
            try:
                source, made, seconds = touched(lambda path=path: imported(path))
            except RuntimeError as error:
                messages.append(f"{path.stem}: {error}")
                continue
            rows.append(row(path.stem, source, made, seconds))
            print(*rows[-1], made["tactile_object"]["message"], file=sys.stderr, flush=True)
            if rows[-1][-1] != "ok":
                messages.append(f"{path.stem}: {made['tactile_object']['message']}")
            pairs.append((source, made))
        draw(pairs, "models")
    table(["model", "touches", "open / Euler / pieces", "mean", "largest", "CPU s", "status"], rows)
    print("\n\n".join(messages))
    print(f"\n{machine('bpy', 'numpy', 'scipy')}.")


if __name__ == "__main__":
    main()
