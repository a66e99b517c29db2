# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""`blender -c tactile reconstruct|fit|map FILE`: a patch or a stability map from the shell."""

import argparse
import csv
import json
import math
import sys
from pathlib import Path

import bpy

from . import contact_file, map_object, measured, patch_object
from .registration import register_patch
from .report import map_readable, readable, verification_columns
from .settings import METHODS, SOLVERS
from .units import ADAPTIVE, METRES
from .verification import verify_patch


def main(args):
    """Blender's entry of the command; `args` is what follows its name. Returns the exit code."""
    sys.stdout.reconfigure(line_buffering=True)
    options = _parser().parse_args([f" {a}" if _is_number(a) else a for a in args])
    try:
        report = _run(options)
        _write(report, options)
    except (RuntimeError, OSError, ValueError) as error:
        print(f"tactile: {_sentence(error)}", file=sys.stderr)
        return 1
    return 0


def _parser():
    parser = argparse.ArgumentParser(prog="blender -c tactile", description=__doc__.splitlines()[0])
    commands = parser.add_subparsers(required=True, metavar="COMMAND")
    patch = commands.add_parser("reconstruct", help="touch a mesh and rebuild the patch around a point")
    vector = {"type": float, "nargs": 3, "metavar": ("X", "Y", "Z")}
    patch.add_argument("--location", **vector, help="where to touch (default: the 3D cursor)")
    patch.add_argument("--normal", **vector, help="outward direction there (default: the surface's)")
    help = "add planes until the height is good to this in the mean, or no plane would help (0: that alone)"
    patch.add_argument("--tolerance", type=float, help=help)
    patch.add_argument("--contacts", type=Path, metavar="CSV", help="write the simulated contacts")
    patch.set_defaults(
        operator=bpy.ops.tactile.reconstruct, record=patch_object.RECORD, words=readable, more={}
    )
    fit = commands.add_parser("fit", help="rebuild the patch that measured contacts show")
    fit.add_argument("files", nargs="+", type=Path, metavar="FILE", help=".csv or .ply, curves of one patch")
    fit.add_argument("--unit", choices=list(contact_file.LENGTHS), help="of the numbers (what the file says)")
    fit.add_argument("--point", **vector, help="where the curves meet (default: the point nearest to all)")
    fit.add_argument("--outward", **vector, help="a direction on the outer side (default: by the normals)")
    fit.add_argument("--flip", action="store_true", default=None, help="the other side is the outer one")
    fit.add_argument("--sensor-std", type=float, help="standard deviation of a contact, at least")
    fit.add_argument(
        "--normal-std", type=float, metavar="DEGREES", help="of measured normals, to fit them too"
    )
    help = "put the patch onto this scanned mesh, .ply, .stl or .obj in the unit of the contacts"
    fit.add_argument("--onto", type=Path, metavar="MESH", help=help)
    _add_fit(fit.add_argument)
    fit.set_defaults(
        operator=bpy.ops.tactile.import_contacts, record=patch_object.RECORD, words=readable, more={}
    )
    stability = commands.add_parser("map", help="touch a mesh all over and paint a copy by how well it goes")
    help = "distance between the points that are touched (a quarter of the extent)"
    stability.add_argument("--spacing", type=float, help=help)
    stability.set_defaults(
        operator=bpy.ops.tactile.stability_map,
        record=map_object.RECORD,
        words=map_readable,
        more={"progress": True},
    )
    for command in (patch, stability):
        _add_inputs(command.add_argument)
    for command in (patch, fit):
        help = "write the distances to the mesh as .csv"
        command.add_argument("--verify", type=Path, metavar="OUT", help=help)
    parser.set_defaults(fail=parser.error, verify=None, contacts=None, onto=None)
    return parser


def _add_inputs(add):
    """The arguments that the commands have in common."""
    add(
        "file",
        nargs="?",
        type=Path,
        metavar="FILE",
        help=".blend, .ply, .stl or .obj; without, the open scene",
    )
    add(
        "--target",
        default="",
        metavar="NAME",
        help="object to touch (default: the active one, or the only mesh)",
    )
    add(
        "--azimuths",
        type=float,
        nargs="+",
        metavar="DEGREES",
        help="three to six plane directions (0 60 120)",
    )
    add("--tilts", type=float, nargs="+", metavar="DEGREES", help="as many plane tilts (0)")
    add(
        "--extent",
        type=float,
        help="length of each half curve (as far as a patch can be trusted; map: size / 8)",
    )
    add("--step", type=float, help="distance between contacts (so many that more would tell little)")
    add("--noise", type=float, help="standard deviation of the simulated sensor (0)")
    add("--seed", type=int, help="of the noise (0)")
    _add_fit(add)


def _add_fit(add):
    """How to fit, and what to write."""
    add("--method", choices=[name for name, _, _ in METHODS], help="how to fit (bayes)")
    add(
        "--degree",
        type=str.strip,
        choices=["auto", *"23456"],
        help="of the polynomial (auto: the least that says what the contacts show)",
    )
    add("--weight", type=float, help="lambda L^2, of the contacts against the smoothness (1000)")
    add("--solver", choices=[name for name, _, _ in SOLVERS], help="of tagc (fast)")
    add("--json", metavar="PATH", help="write the report as JSON; -: one line on standard output")
    add(
        "--output",
        type=Path,
        metavar="OUT",
        help="save the scene with the result, .blend; the result alone as .ply; a patch also as .json",
    )


def _arguments(options):
    """What was given on the command line as the operator's arguments."""
    names = ["location", "normal", "spacing", "extent", "step", "noise", "seed", "method", "weight", "solver"]
    names += ["tolerance"]
    names += ["unit", "point", "outward", "flip", "sensor_std"]
    names = [name for name in names if getattr(options, name, None) is not None]
    given = {name: getattr(options, name) for name in names}
    if options.degree is not None:
        given["degree"] = 0 if options.degree == "auto" else int(options.degree)
    if getattr(options, "normal_std", None) is not None:
        given["normal_std"] = math.radians(options.normal_std)
    if "files" in options:
        return given | _open_contacts(options)
    given["target"] = options.target or _default_target()
    if options.azimuths is not None:
        if not 3 <= len(options.azimuths) <= 6:
            options.fail(f"--azimuths: wanted three to six, got {len(options.azimuths)}")
        given |= {"plane_count": len(options.azimuths), "azimuths": _six_radians(options.azimuths)}
    if options.tilts is not None:
        if len(options.tilts) != given.get("plane_count", 3):
            options.fail("--tilts: wanted as many as there are planes")
        given["tilts"] = _six_radians(options.tilts)
    return given


def _run(options):
    """Opens the file, runs the operator, saves; returns the report."""
    if "files" in options and options.verify is not None and options.onto is None:
        options.fail("--verify: wanted --onto MESH too, to compare with")
    for path in (options.json, options.output, options.contacts, options.verify):
        if path not in (None, "-") and not Path(path).absolute().parent.is_dir():
            raise OSError(f'there is no folder "{Path(path).parent}" to write "{Path(path).name}" to')
    if getattr(options, "file", None) is not None:
        open_file(options.file)
    arguments = _arguments(options)
    before = set(bpy.data.objects)
    options.operator(**arguments, **options.more)
    # By name it may be another, and it is not active where the scene was saved in edit mode.
    (made,) = (obj for obj in set(bpy.data.objects) - before if options.record in obj)
    if options.record == patch_object.RECORD:
        _compare(made, options)
    report = made[options.record].to_dict()
    if options.contacts is not None:
        contact_file.write(options.contacts, patch_object.contacts_of(made))
    if options.output is not None:
        _save(options.output, made)
    return report


def _compare(patch, options):
    """The patch with the mesh that was touched, or with the one that it is put onto."""
    target = None if "files" in options else bpy.data.objects[patch[patch_object.RECORD]["source"]]
    if options.onto is not None:
        before = set(bpy.data.objects)
        _import(options.onto)
        target = next(obj for obj in set(bpy.data.objects) - before if obj.type == "MESH")
        register_patch(patch, target, bpy.context.evaluated_depsgraph_get())
    if target is not None:
        verify_patch(patch, target, bpy.context.evaluated_depsgraph_get())


def _open_contacts(options):
    """The files as arguments; where no .blend is open, in an empty scene of their unit, so numbers stay."""
    if not bpy.data.filepath:
        bpy.ops.wm.read_homefile(use_empty=True)
        _, unit = measured.read(options.files, options.unit or "FILE", 1.0)
        settings = bpy.context.scene.unit_settings
        name = {symbol: name for name, (symbol, _) in METRES.items()}.get(unit)
        settings.system, settings.scale_length = (
            "METRIC" if unit else "NONE",
            contact_file.LENGTHS.get(unit, 1.0),
        )
        if name in ADAPTIVE["METRIC"]:
            settings.length_unit = name
    paths = [path.absolute() for path in options.files]
    if len({path.parent for path in paths}) > 1:
        options.fail("FILE: wanted files of one folder")
    return {
        "filepath": str(paths[0]),
        "directory": str(paths[0].parent),
        "files": [{"name": path.name} for path in paths],
    }


def _save(path, made):
    """The scene; where the path says so, the map or patch alone: .ply with its attributes, or .json."""
    if path.suffix.lower() == ".json" and patch_object.RECORD in made:
        path.write_text(patch_object.reconstruction_of(made) + "\n", encoding="utf-8")
        return
    if path.suffix.lower() != ".ply":
        bpy.ops.wm.save_as_mainfile(filepath=str(path.absolute()))
        return
    with bpy.context.temp_override(selected_objects=[made], window=bpy.context.window_manager.windows[0]):
        bpy.ops.wm.ply_export(
            filepath=str(path.absolute()),
            export_selected_objects=True,
            export_attributes=True,
            export_uv=False,  # whose seams would split vertices
        )


def open_file(path):
    """Makes the file the scene: opens a .blend, imports a mesh into an empty one, coordinates as they are."""
    if path.suffix.lower() == ".blend" and path.is_file():
        bpy.ops.wm.open_mainfile(filepath=str(path.absolute()), load_ui=False)
        return
    _import(path, empty=True)


def _import(path, empty=False):
    """Adds the mesh of a file to the scene, or to an empty one."""
    if not path.is_file():
        raise OSError(f'there is no file "{path}"')
    full = str(path.absolute())
    imports = {
        ".ply": lambda: bpy.ops.wm.ply_import(filepath=full),
        ".stl": lambda: bpy.ops.wm.stl_import(filepath=full),
        ".obj": lambda: bpy.ops.wm.obj_import(filepath=full, forward_axis="Y", up_axis="Z"),
    }
    if path.suffix.lower() not in imports:
        raise OSError(f'cannot read "{path.name}": wanted a .blend, .ply, .stl or .obj file')
    if empty:
        bpy.ops.wm.read_homefile(use_empty=True)
    unreadable, there = f'no mesh could be read from "{path.name}": is the file whole?', set(bpy.data.meshes)
    if path.suffix.lower() == ".ply" and not _has_header(path):
        raise OSError(unreadable)
    try:
        # Importers ask for a window, which is not the current one after `blender -b`.
        with bpy.context.temp_override(window=bpy.context.window_manager.windows[0]):
            imports[path.suffix.lower()]()
    except RuntimeError as error:
        raise OSError(unreadable) from error
    if not any(len(mesh.polygons) for mesh in set(bpy.data.meshes) - there):
        raise OSError(unreadable)


def _has_header(path):
    """Whether the header of a .ply file comes to its end; where it does not, the importer ends Blender."""
    with path.open("rb") as file:
        return b"end_header" in file.read(1 << 16)


def _default_target():
    """The name of the only mesh of the scene, where nothing else is active."""
    if bpy.context.view_layer.objects.active is not None:
        return ""
    meshes = [obj.name for obj in bpy.context.scene.objects if obj.type == "MESH"]
    return meshes[0] if len(meshes) == 1 else ""


def _write(report, options):
    if options.verify is not None:
        with options.verify.open("w", newline="", encoding="utf-8") as file:
            csv.writer(file).writerows(zip(*verification_columns(report), strict=True))
    if options.json == "-":
        print(json.dumps(report, allow_nan=False))
        return
    if options.json is not None:
        Path(options.json).write_text(json.dumps(report, indent=2, allow_nan=False) + "\n", encoding="utf-8")
    print(options.words(report))


def _six_radians(degrees):
    return [math.radians(a) for a in degrees] + [0.0] * (6 - len(degrees))


def _is_number(text):
    """argparse takes -1e-3 for an option; a leading space tells it otherwise."""
    try:
        float(text)
    except ValueError:
        return False
    return True


def _sentence(error):
    """An operator's error without the words Blender puts around it."""
    words = str(error).strip()
    if isinstance(error, RuntimeError):  # there may be more than one report
        words = words.partition("\n")[0].removeprefix("Error: ")
    return " ".join(words.split())
