# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What the command does: it opens files, runs the operator, saves, and writes the report."""

import argparse
import csv
import io
import json
import math
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import bpy

from .. import core
from ..core.arguments import many
from .comparison.operators import Search, verification_columns, verify_patch
from .files import contact_file, export_operators, measured, mesh_file, whole_file
from .report import pages
from .scene import patch_record
from .stability_map.map_object import map_table_rows
from .touch.types import Object
from .touch.units import ADAPTIVE, METERS
from .touch.wording import readable_rows, table
from .whole_object.object_report import object_table_rows


class Misuse(ValueError):
    """Words on the command line that do not go together."""


class Command(NamedTuple):
    """What a command runs.

    operator : the name of the operator
    record : the property in which the result keeps its report
    words : what says a report in words
    kinds : the endings that --output may have
    more : arguments of the operator that are not options
    """

    operator: str
    record: str
    words: Callable[[Any], str]
    kinds: tuple[str, ...]
    more: dict[str, Any]


PATCH_FILES = (".blend", ".ply", ".json")
MESH_FILES = (".blend", ".ply")
COMMANDS = {
    "reconstruct": Command(
        "reconstruct", patch_record.RECORD, lambda report: table(readable_rows(report)), PATCH_FILES, {}
    ),
    "fit": Command(
        "import_contacts", patch_record.RECORD, lambda report: table(readable_rows(report)), PATCH_FILES, {}
    ),
    "table": Command("", "", lambda report: f"{many(report['rows'], 'row', 'rows')} written", (".csv",), {}),
    "object": Command(
        "touch_all_over",
        patch_record.ATLAS_RECORD,
        lambda report: table(object_table_rows(report)),
        MESH_FILES,
        {"progress": True},
    ),
    "join": Command(
        "import_contacts",
        patch_record.ATLAS_RECORD,
        lambda report: table(object_table_rows(report)),
        MESH_FILES,
        {"whole": True, "progress": True},
    ),
    "map": Command(
        "stability_map",
        patch_record.MAP_RECORD,
        lambda report: table(map_table_rows(report)),
        MESH_FILES,
        {"progress": True},
    ),
}
# Operators would replace negative numbers by 0.
NEVER_NEGATIVE = ("radius", "noise", "normal_std", "seed")


def _require_numbers(options: argparse.Namespace) -> None:
    """Raises Misuse for numbers that operators cannot have."""
    for name in NEVER_NEGATIVE:
        value = getattr(options, name)
        if value is not None and not 0.0 <= value < math.inf:
            raise Misuse(f"--{name.replace('_', '-')}: expected a finite number of 0 or more, got {value:g}")


def _arguments(options: argparse.Namespace) -> dict[str, Any]:
    """The operator's arguments from the options."""
    _require_numbers(options)
    operators: Any = bpy.ops
    taken = getattr(operators.tactile, COMMANDS[options.command].operator).get_rna_type().properties
    given = {name: value for name, value in vars(options).items() if value is not None and name in taken}
    if options.degree is not None:
        given["degree"] = 0 if options.degree == "auto" else int(options.degree)
    if options.files:
        if options.location is not None:
            if options.point is not None:
                raise Misuse("--location: expected this or --point, got both")
            given |= {"point": options.location, "strokes": True}
        if "point" in given:
            given["exact_point"] = json.dumps(given.pop("point"))
        return given | _open_contacts(options)
    given["target"] = options.target or _default_target(options.file)
    if options.azimuths is not None:
        if not 3 <= len(options.azimuths) <= 6:
            raise Misuse(f"--azimuths: expected three to six, got {len(options.azimuths)}")
        given |= {"plane_count": len(options.azimuths), "azimuths": _six_radians(options.azimuths)}
    if options.tilts is not None:
        if len(options.tilts) != given.get("plane_count", 3):
            raise Misuse("--tilts: expected as many as there are planes")
        given["tilts"] = _six_radians(options.tilts)
    return given


def run(options: argparse.Namespace) -> dict[str, Any]:
    """Opens the file, runs the operator, saves, and returns the report."""
    _open(options)
    if options.command == "table":
        patches = export_operators.patches_of(bpy.context.view_layer.objects)
        export_operators.write_table(options.output, patches, bpy.context.scene)
        return {"rows": len(patches)}
    arguments = _arguments(options)
    before: set[Object] = set(bpy.data.objects)
    command = COMMANDS[options.command]
    operators: Any = bpy.ops
    getattr(operators.tactile, command.operator)(**arguments, **command.more)
    # It cannot be found by name, and it is not active if the scene was saved in edit mode.
    added: set[Object] = set(bpy.data.objects) - before
    (made,) = (obj for obj in added if command.record in obj)
    if command.record == patch_record.RECORD:
        _compare(made, options)
    report = made[command.record].to_dict()
    if command.record == patch_record.RECORD:  # Elsewhere it says that nothing is left to be computed.
        report["is_verified"] = report["vertices"] > 0 or "verification" in report
    if patch_record.GRAPH in made:
        report["graph"] = json.loads(made[patch_record.GRAPH])
    if options.contacts is not None:
        contact_file.write(options.contacts, contact_file.contacts_of(patch_record.reconstruction_of(made)))
    if options.report is not None:
        pages.write(options.report, made)
    if options.output is not None:
        _save(options.output, made)
    return report


def _open(options: argparse.Namespace) -> None:
    """Checks the options and opens the file. Raises Misuse where an option needs another."""
    if options.files and options.verify is not None and options.onto is None:
        raise Misuse("--verify: expected --onto MESH too, the mesh to compare with")
    if options.command == "fit" and options.target and options.onto is None:
        raise Misuse("--target: expected --onto MESH too, the file that has this mesh")
    if options.command == "table" and options.output is None:
        raise Misuse("--output: expected OUT, the table to write")
    _require_outputs(options)
    if options.file is not None:
        mesh_file.open_file(options.file)
    if not options.files and options.unit is not None:
        if bpy.data.filepath or options.file is None:
            raise Misuse("--unit: expected a .ply, .stl or .obj file, because a .blend names its own unit")
        _set_unit(options.unit)


def _require_outputs(options: argparse.Namespace) -> None:
    """Raises Misuse, before anything is done, if a file to write is also read or cannot be a file."""
    given = {name: getattr(options, name) for name in ("json", "output", "contacts", "verify", "report")}
    outputs = {name: Path(path) for name, path in given.items() if path not in (None, "-")}
    scene = bpy.data.filepath and Path(bpy.data.filepath)
    inputs = [*(options.files or ()), *filter(None, (options.file, options.onto, scene))]
    kinds = {"output": COMMANDS[options.command].kinds, "report": (".html",)}
    taken = {path.resolve(): "reads" for path in inputs}
    for name, path in outputs.items():
        if path.exists() and not path.is_file():
            raise Misuse(f"--{name}: expected the name of a file, got {path}")
        if path.resolve() in taken:
            raise Misuse(
                f"--{name}: expected a file other than those that this command "
                f"{taken[path.resolve()]}, got {path}"
            )
        taken[path.resolve()] = "writes"
        if not path.absolute().parent.is_dir():
            raise OSError(f'there is no folder "{path.parent}" to write "{path.name}" to')
        if name in kinds and path.suffix.lower() not in kinds[name]:
            raise Misuse(f"--{name}: expected a file {' or '.join(kinds[name])}, got {path}")


def _compare(patch: Object, options: argparse.Namespace) -> None:
    """Compares the patch with the mesh that was touched, or with the one onto which it is put."""
    target = None if options.files else bpy.data.objects[patch[patch_record.RECORD]["source"]]
    if options.onto is not None:
        target = mesh_file.named(options.onto, mesh_file.add(options.onto), options.target or "")
        Search(patch, target, bpy.context.evaluated_depsgraph_get()).put()
    if target is not None:
        verify_patch(patch, target, bpy.context.evaluated_depsgraph_get())


def _open_contacts(options: argparse.Namespace) -> dict[str, Any]:
    """The files as arguments. If no .blend is open, an empty scene gets their unit, so that numbers stay."""
    if not bpy.data.filepath:
        bpy.ops.wm.read_homefile(use_empty=True)
        _set_unit(measured.read(options.files, options.unit or "FILE", 1.0, options.command == "join").unit)
    paths = [path.absolute() for path in options.files]
    if len({path.parent for path in paths}) > 1:
        raise Misuse("FILE: expected files from one folder")
    return {
        "filepath": str(paths[0]),
        "directory": str(paths[0].parent),
        "files": [{"name": path.name} for path in paths],
    }


def _set_unit(unit: str) -> None:
    """Gives the scene a unit of core.UNIT_METERS, in which its numbers stay as they are, or none for ""."""
    settings: Any = bpy.context.scene.unit_settings
    name = {symbol: name for name, (symbol, _) in METERS.items()}.get(unit)
    settings.system = "METRIC" if unit else "NONE"
    settings.scale_length = core.UNIT_METERS.get(unit, 1.0)
    if name in ADAPTIVE["METRIC"]:
        settings.length_unit = name


def _save(path: Path, made: Object) -> None:
    """Saves the scene, or by the path's ending only the patch or map: .ply with attributes, or .json."""
    kind = path.suffix.lower()
    if kind == ".json":
        contact_file.write_patch(path, patch_record.reconstruction_of(made))
    elif kind == ".ply":
        mesh_file.write(path, made)
    else:
        mesh_file.save_scene(path)


def _default_target(file: Path | None) -> str:
    """The name of the scene's only mesh, if nothing else is active. Raises OSError if there are several."""
    if bpy.context.view_layer.objects.active is not None:
        return ""
    objects: list[Object] = list(bpy.context.scene.objects)
    meshes = sorted((obj for obj in objects if obj.type == "MESH"), key=lambda obj: str(obj.name))
    meshes = [obj for obj in meshes if len(obj.data.polygons)] or meshes
    return mesh_file.named(file or Path(bpy.data.filepath or "scene"), meshes, "").name if meshes else ""


def write(report: Mapping[str, Any], options: argparse.Namespace) -> None:
    """Prints the report, or writes it to the files that were named."""
    if options.verify is not None:
        text = io.StringIO()
        csv.writer(text).writerows(zip(*verification_columns(report), strict=True))
        whole_file.write_text(options.verify, text.getvalue())
    if options.json == "-":
        print(json.dumps(report, allow_nan=False))
        return
    if options.json is not None:
        whole_file.write_text(options.json, json.dumps(report, indent=2, allow_nan=False) + "\n")
    print(COMMANDS[options.command].words(report))


def _six_radians(degrees: list[float]) -> list[float]:
    return [math.radians(a) for a in degrees] + [0.0] * (6 - len(degrees))
