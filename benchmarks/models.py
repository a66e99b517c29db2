# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The standard models of the field, touched all over with the dialog's defaults.

`python -m benchmarks.models ZIP FOLDER [--only NAME]`, from the root of a checkout; ZIP is the built
extension, and FOLDER has models as .obj, .ply or .stl, such as those of
github.com/alecjacobson/common-3d-test-models. It prints a Markdown table, and below it what the report says
of each model that is not ok, and draws build/charts/models.jpg, models above and what was felt of them below.

Columns are those of benchmarks.add_menu.
"""

from functools import partial
from pathlib import Path

from tools import blender

from . import machine, parser_of
from .add_menu import print_touched


def imported(path):
    """Imports a model into the scene, as it comes."""
    import bpy

    importer = getattr(bpy.ops.wm, f"{path.suffix[1:]}_import")
    importer(filepath=str(path))
    bpy.context.object.name = path.stem


def main():
    parser = parser_of(__doc__, takes_zip=True)
    parser.add_argument("folder", type=Path, help="the folder of models")
    parser.add_argument("--only", default="", help="only models with this in their names")
    options = parser.parse_args()
    blender.start(options.zip)
    paths = [p for p in sorted(options.folder.iterdir()) if p.suffix in (".obj", ".ply", ".stl")]
    adds = {path.stem: partial(imported, path) for path in paths if options.only in path.name}
    print_touched(adds, "models")
    print(f"{machine('bpy', 'numpy', 'scipy')}.")


if __name__ == "__main__":
    main()
