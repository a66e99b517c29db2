# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""`blender -c tactile reconstruct|fit|map FILE`: a patch or a stability map from the shell."""

import argparse
import csv
import io
import json
import math
import sys
from pathlib import Path

import bpy

from .comparison.register_operator import register_patch
from .comparison.verify_operator import verify_patch
from .files import contact_file, measured, mesh_file, whole_file
from .scene import patch_object
from .stability_map.map_report import map_readable
from .touch.settings import METHODS, SOLVERS
from .touch.units import ADAPTIVE, METERS
from .touch.wording import readable, verification_columns

VECTOR = {"type": float, "nargs": 3, "metavar": ("X", "Y", "Z")}
# What the operators take as it is given.
PLAIN = {"location", "outward", "spacing", "extent", "step", "noise", "seed", "method", "weight", "solver"}
PLAIN |= {"tolerance", "unit", "point", "flip", "radius"}


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
    except MemoryError:
        print("tactile: there is not enough memory for this: take a smaller file", file=sys.stderr)
        return 1
    return 0


def _parser():
    parser = argparse.ArgumentParser(prog="blender -c tactile", description=__doc__.splitlines()[0])
    commands = parser.add_subparsers(required=True, metavar="COMMAND")
    for name, add_arguments, help in (
        ("reconstruct", _add_reconstruct, "touch a mesh and rebuild the patch around a point"),
        ("fit", _add_fit, "rebuild the patch that measured contacts show"),
        ("map", _add_map, "touch a mesh all over and paint a copy by how well it goes"),
    ):
        add_arguments(commands.add_parser(name, help=help))
    parser.set_defaults(fail=parser.error, record=patch_object.RECORD, words=readable, more={})
    parser.set_defaults(**dict.fromkeys(("file", "contacts", "onto", "verify", "normal_std")))
    return parser


def _add_reconstruct(command):
    add = command.add_argument
    add("--location", **VECTOR, help="where to touch (default: the 3D cursor)")
    add("--outward", **VECTOR, help="outward direction there (default: the surface's own)")
    help = "add planes until the height is good to this in the mean, or no plane would help (0: that alone)"
    add("--tolerance", type=float, help=help)
    add("--contacts", type=Path, metavar="CSV", help="write the simulated contacts")
    _add_inputs(add)
    _add_verify(add)
    command.set_defaults(operator=bpy.ops.tactile.reconstruct)


def _add_fit(command):
    add = command.add_argument
    add("files", nargs="+", type=Path, metavar="FILE", help=".csv or .ply, curves of one patch")
    add("--unit", choices=list(contact_file.LENGTHS), help="of the numbers (what the file says)")
    add("--point", **VECTOR, help="where the curves meet (default: the point nearest to all)")
    help = "a place among strokes, which all curves are then (default, of strokes alone: their mean)"
    add("--location", **VECTOR, help=help)
    add("--radius", type=float, help="of strokes alone: how far from that place contacts count (all)")
    add("--outward", **VECTOR, help="a direction on the outer side (default: by the normals)")
    add("--flip", action="store_true", default=None, help="the other side is the outer one")
    add("--noise", type=float, help="standard deviation of a contact, at least")
    add("--normal-std", type=float, metavar="DEGREES", help="of measured normals, to fit them too")
    help = "put the patch onto this scanned mesh, .ply, .stl or .obj in the unit of the contacts"
    add("--onto", type=Path, metavar="MESH", help=help)
    _add_method(add)
    _add_verify(add)
    command.set_defaults(operator=bpy.ops.tactile.import_contacts)


def _add_map(command):
    add = command.add_argument
    help = "distance between the points that are touched (a quarter of the extent)"
    add("--spacing", type=float, help=help)
    _add_inputs(add)
    command.set_defaults(operator=bpy.ops.tactile.stability_map, more={"progress": True})
    command.set_defaults(record=patch_object.MAP_RECORD, words=map_readable)


def _add_verify(add):
    add("--verify", type=Path, metavar="OUT", help="write the distances to the mesh as .csv")


def _add_inputs(add):
    """What to touch, and how."""
    help = ".blend, .ply, .stl or .obj; without, the open scene"
    add("file", nargs="?", type=Path, metavar="FILE", help=help)
    help = "object to touch (default: the active one, or the only mesh)"
    add("--target", default="", metavar="NAME", help=help)
    degrees = {"type": float, "nargs": "+", "metavar": "DEGREES"}
    add("--azimuths", **degrees, help="three to six plane directions (0 60 120)")
    add("--tilts", **degrees, help="as many plane tilts (0)")
    help = "length of each half curve (as far as a patch can be trusted; map: size / 8)"
    add("--extent", type=float, help=help)
    add("--step", type=float, help="distance between contacts (so many that more would tell little)")
    add("--noise", type=float, help="standard deviation of the simulated sensor (0)")
    add("--seed", type=int, help="of the noise (0)")
    _add_method(add)


def _add_method(add):
    """How to fit, and what to write."""
    add("--method", choices=[name for name, _, _ in METHODS], help="how to fit (bayes)")
    help = "of the polynomial (auto: the least that says what the contacts show)"
    add("--degree", type=str.strip, choices=["auto", *"23456"], help=help)
    add("--weight", type=float, help="lambda L^2, of the contacts against the smoothness (1000, 1e5)")
    add("--solver", choices=[name for name, _, _ in SOLVERS], help="of tagc (fast)")
    add("--json", metavar="PATH", help="write the report as JSON; -: one line on standard output")
    help = "save the scene with the result, .blend; the result alone as .ply; a patch also as .json"
    add("--output", type=Path, metavar="OUT", help=help)


def _arguments(options):
    """What was given on the command line as the operator's arguments."""
    given = {name: value for name, value in vars(options).items() if name in PLAIN and value is not None}
    if options.degree is not None:
        given["degree"] = 0 if options.degree == "auto" else int(options.degree)
    if options.normal_std is not None:
        given["normal_std"] = math.radians(options.normal_std)
    if "files" in options:
        if "location" in given:
            if "point" in given:
                options.fail("--location: wanted it or --point, got both")
            given |= {"point": given.pop("location"), "strokes": True}
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
    _require_outputs(options)
    if options.file is not None:
        mesh_file.open_file(options.file)
    arguments = _arguments(options)
    before = set(bpy.data.objects)
    options.operator(**arguments, **options.more)
    # Its name may be another's, and it is not active where the scene was saved in edit mode.
    (made,) = (obj for obj in set(bpy.data.objects) - before if options.record in obj)
    if options.record == patch_object.RECORD:
        _compare(made, options)
    report = made[options.record].to_dict()
    if options.contacts is not None:
        r = patch_object.reconstruction_of(made)
        contact_file.write(options.contacts, contact_file.contacts_of(r))
    if options.output is not None:
        _save(options.output, made)
    return report


def _require_outputs(options):
    """Ends the command where a file to write is one to read, or cannot be one, before anything is done."""
    given = {name: getattr(options, name) for name in ("json", "output", "contacts", "verify")}
    outputs = {name: Path(path) for name, path in given.items() if path not in (None, "-")}
    scene = bpy.data.filepath and Path(bpy.data.filepath)
    inputs = [*vars(options).get("files", []), *filter(None, (options.file, options.onto, scene))]
    taken = {path.resolve(): "reads" for path in inputs}
    for name, path in outputs.items():
        if path.exists() and not path.is_file():
            options.fail(f"--{name}: wanted the name of a file, got {path}")
        if path.resolve() in taken:
            options.fail(f"--{name}: wanted another file than one that this {taken[path.resolve()]}: {path}")
        taken[path.resolve()] = "writes"
        if not path.absolute().parent.is_dir():
            raise OSError(f'there is no folder "{path.parent}" to write "{path.name}" to')
    kinds = [".blend", ".ply", *([".json"] if options.record == patch_object.RECORD else [])]
    if "output" in outputs and options.output.suffix.lower() not in kinds:
        options.fail(f"--output: wanted a file {' or '.join(kinds)}, got {options.output}")


def _compare(patch, options):
    """The patch with the mesh that was touched, or with the one that it is put onto."""
    target = None if "files" in options else bpy.data.objects[patch[patch_object.RECORD]["source"]]
    if options.onto is not None:
        target = mesh_file.add(options.onto)
        register_patch(patch, target, bpy.context.evaluated_depsgraph_get())
    if target is not None:
        verify_patch(patch, target, bpy.context.evaluated_depsgraph_get())


def _open_contacts(options):
    """The files as arguments; where no .blend is open, in an empty scene of their unit, so numbers stay."""
    if not bpy.data.filepath:
        bpy.ops.wm.read_homefile(use_empty=True)
        unit = measured.read(options.files, options.unit or "FILE", 1.0).unit
        settings = bpy.context.scene.unit_settings
        name = {symbol: name for name, (symbol, _) in METERS.items()}.get(unit)
        settings.system = "METRIC" if unit else "NONE"
        settings.scale_length = contact_file.LENGTHS.get(unit, 1.0)
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
    kind = path.suffix.lower()
    if kind == ".json":
        contact_file.write_patch(path, patch_object.reconstruction_of(made))
    elif kind == ".ply":
        mesh_file.write(path, made)
    else:
        mesh_file.save_scene(path)


def _default_target():
    """The name of the only mesh of the scene, where nothing else is active."""
    if bpy.context.view_layer.objects.active is not None:
        return ""
    meshes = [obj.name for obj in bpy.context.scene.objects if obj.type == "MESH"]
    return meshes[0] if len(meshes) == 1 else ""


def _write(report, options):
    if options.verify is not None:
        table = io.StringIO()
        csv.writer(table).writerows(zip(*verification_columns(report), strict=True))
        whole_file.write_text(options.verify, table.getvalue())
    if options.json == "-":
        print(json.dumps(report, allow_nan=False))
        return
    if options.json is not None:
        whole_file.write_text(options.json, json.dumps(report, indent=2, allow_nan=False) + "\n")
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
