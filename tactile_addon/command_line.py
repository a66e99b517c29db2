# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The words of `blender -c tactile reconstruct|fit|object|join|map|table FILE`."""

import argparse
import re
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from .. import core
from .command_run import Misuse, run, write
from .touch.settings import METHODS, SOLVERS

NEGATIVE = re.compile(r"-(\.?\d|inf|nan)")  # argparse takes -1e-3 for an option, unless a space precedes it.
UNCERTAIN = 3  # The exit code of `join` for a surface that is not closed or in doubt.
VECTOR: dict[str, Any] = {"type": float, "nargs": 3, "metavar": ("X", "Y", "Z")}
NUMBER: dict[str, Any] = {"type": float}
COUNT: dict[str, Any] = {"type": int}
DEGREES: dict[str, Any] = {"type": float, "nargs": "+", "metavar": "DEGREES"}
# How each option is read, whatever the command.
OPTIONS: dict[str, dict[str, Any]] = {
    "file": {"nargs": "?", "type": Path, "metavar": "FILE"},
    "files": {"nargs": "+", "type": Path, "metavar": "FILE"},
    "--target": {"metavar": "NAME"},
    "--unit": {"choices": list(core.UNIT_METERS)},
    **dict.fromkeys(("--location", "--outward", "--point"), VECTOR),
    "--flip": {"action": "store_true", "default": None},
    **dict.fromkeys(("--azimuths", "--tilts"), DEGREES),
    **dict.fromkeys(("--spacing", "--extent", "--step", "--edge", "--tolerance"), NUMBER),
    **dict.fromkeys(("--radius", "--noise", "--weight"), NUMBER),
    "--normal-std": {"type": float, "metavar": "RADIANS"},
    **dict.fromkeys(("--seed", "--most"), COUNT),
    "--method": {"choices": [name for name, _, _ in METHODS]},
    "--degree": {"type": str.strip, "choices": ["auto", *"23456"]},
    "--solver": {"choices": [name for name, _, _ in SOLVERS]},
    "--onto": {"type": Path, "metavar": "MESH"},
    "--contacts": {"type": Path, "metavar": "CSV"},
    "--verify": {"type": Path, "metavar": "OUT"},
    "--json": {"metavar": "PATH"},
    "--output": {"type": Path, "metavar": "OUT"},
    "--report": {"type": Path, "metavar": "HTML"},
}
# What options do, in groups that commands have in common.
MESH = {
    "file": ".blend, .ply, .stl or .obj (the open scene)",
    "--target": "object to touch (default: the active one of a .blend, or the only mesh)",
    "--unit": "unit of a .ply, .stl or .obj file, for the report (unknown)",
}
SENSOR = {"--noise": "standard deviation of the simulated sensor (0)", "--seed": "seed of the noise (0)"}
TOUCH = {
    **MESH,
    "--azimuths": "three to six plane directions (0 60 120)",
    "--tilts": "tilts of the planes, one each (0)",
    "--extent": "length of each half curve (as far as a patch can be trusted; map: size / 8)",
    "--step": "distance between contacts (such that more would add little)",
    **SENSOR,
}
MEASURED = {
    "--unit": "unit of the numbers (the file's)",
    "--outward": "a direction on the outer side (default: by the normals)",
    "--flip": "use the other side as the outer one",
    "--noise": "noise floor: a contact has at least this standard deviation",
}
WRITTEN = {
    "--json": "write the report as JSON; -: one line on standard output",
    "--output": "save the scene with the surface as .blend, or the surface alone as .ply",
    "--report": "write a page for a browser: pictures, deviations, tolerance bands, settings, versions",
}
FIT = {
    "--method": "how to fit (bayes)",
    "--degree": "degree of the polynomial (auto: the lowest that describes what the contacts show)",
    "--weight": "lambda L^2, the weight of the contacts against smoothness (1000, 1e5)",
    "--solver": "solver of tagc (fast)",
    **WRITTEN,
    "--output": "save the scene with the result as .blend, or the result alone as .ply; a patch also as "
    ".json",
}
VERIFY = {"--verify": "write the distances to the mesh as .csv"}
# What each command does, and its options.
COMMANDS: dict[str, tuple[str, dict[str, str]]] = {
    "reconstruct": (
        "touch a mesh and rebuild the patch around a point",
        {
            "--location": "where to touch (default: the 3D cursor)",
            "--outward": "outward direction there (default: the surface's own)",
            "--tolerance": "add planes until the mean deviation of the height is down to this or no plane "
            "would help",
            "--contacts": "write the simulated contacts",
            **TOUCH,
            **FIT,
            **VERIFY,
        },
    ),
    "fit": (
        "rebuild the patch from measured contacts",
        {
            "files": ".csv or .ply with the curves of one patch",
            **MEASURED,
            "--point": "where the curves meet (default: the point nearest to all)",
            "--location": "a place among strokes; all curves are then strokes (default for strokes alone: "
            "their mean)",
            "--radius": "for strokes alone: use contacts up to this distance from the place (all)",
            "--normal-std": "standard deviation of measured normals, to fit them too (one degree is 0.0175)",
            "--onto": "put the patch onto this scanned mesh, .ply, .stl or .obj in the unit of the contacts",
            "--target": "the mesh in that file (default: the only one)",
            **FIT,
            **VERIFY,
        },
    ),
    "object": (
        "touch a whole object and join the patches to one surface",
        {
            **MESH,
            "--location": "where to begin (default: any place that works)",
            "--tolerance": "standard deviation to reach for heights (size / 500)",
            "--edge": "length of the triangles' edges (chosen by the curvature)",
            "--most": "number of touches after which to stop (1000)",
            **SENSOR,
            **WRITTEN,
        },
    ),
    "join": (
        "join measured contacts of a whole object to one surface",
        {
            "files": ".csv or .ply with curves all over an object",
            **MEASURED,
            "--tolerance": "standard deviation to reach for heights (1.2 %% of each patch)",
            **WRITTEN,
        },
    ),
    "map": (
        "touch a mesh all over and paint a copy by how well touches go",
        {
            "--spacing": "distance between the points that are touched (half of the extent)",
            **TOUCH,
            **FIT,
        },
    ),
    "table": (
        "write the results of a scene's patches as a table, one row each",
        {"file": ".blend (the open scene)", "--output": "the table to write, .csv"},
    ),
}


def main(args: Sequence[str]) -> int:
    """Blender calls this for the command with the words that follow its name; returns the exit code."""
    stdout: Any = sys.stdout
    stdout.reconfigure(line_buffering=True)
    parser = _parser()
    options = parser.parse_args([f" {a}" if NEGATIVE.match(a) else a for a in args])
    try:
        report = run(options)
        write(report, options)
    except Misuse as error:
        parser.error(str(error))
    except (RuntimeError, OSError, ValueError) as error:
        print(f"tactile: {_sentence(error)}", file=sys.stderr)
        return 1
    except MemoryError:
        print("tactile: there is not enough memory for this: use a smaller file", file=sys.stderr)
        return 1
    return UNCERTAIN if options.command == "join" and report["status"] != "ok" else 0


def _parser() -> argparse.ArgumentParser:
    """The parser of all commands; options that a command does not have, or that are not given, are None."""
    parser = argparse.ArgumentParser(
        prog="blender -c tactile",
        description="Touch meshes, or read measured contacts, and rebuild the surface.",
    )
    commands = parser.add_subparsers(required=True, metavar="COMMAND", dest="command")
    for name, (does, options) in COMMANDS.items():
        command = commands.add_parser(name, help=does)
        for option, help in options.items():
            command.add_argument(option, **OPTIONS[option], help=help)
    parser.set_defaults(**dict.fromkeys(option.strip("-").replace("-", "_") for option in OPTIONS))
    return parser


def _sentence(error: Exception) -> str:
    """The message of an operator's error, without the words that Blender adds."""
    words = str(error).strip()
    if isinstance(error, RuntimeError):  # There may be several reports.
        words = words.partition("\n")[0].removeprefix("Error: ")
    return " ".join(words.split())
