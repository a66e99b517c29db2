# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The words of `blender -c tactile reconstruct|fit|object|join|map|table FILE`."""

import argparse
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from .. import core
from .command_run import Misuse, run, write
from .touch.settings import METHODS, SOLVERS

NOT_OF_ALL = (
    "file",
    "contacts",
    "json",
    "report",
    "onto",
    "verify",
    "normal_std",
    "degree",
    "azimuths",
    "tilts",
)
SURFACE = "save the scene with the surface as .blend, or the surface alone as .ply"
UNCERTAIN = 3  # The exit code of `join` for a surface that is not closed or in doubt.
VECTOR: dict[str, Any] = {"type": float, "nargs": 3, "metavar": ("X", "Y", "Z")}


def main(args: Sequence[str]) -> int:
    """Blender calls this for the command with the words that follow its name; returns the exit code."""
    stdout: Any = sys.stdout
    stdout.reconfigure(line_buffering=True)
    parser = _parser()
    options = parser.parse_args([f" {a}" if _is_number(a) else a for a in args])
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
    parser = argparse.ArgumentParser(
        prog="blender -c tactile",
        description="Touch meshes, or read measured contacts, and rebuild the surface.",
    )
    commands = parser.add_subparsers(required=True, metavar="COMMAND", dest="command")
    for name, add_arguments, help in (
        ("reconstruct", _add_reconstruct, "touch a mesh and rebuild the patch around a point"),
        ("fit", _add_fit, "rebuild the patch from measured contacts"),
        ("object", _add_object, "touch a whole object and join the patches to one surface"),
        ("join", _add_join, "join measured contacts of a whole object to one surface"),
        ("map", _add_map, "touch a mesh all over and paint a copy by how well touches go"),
        ("table", _add_table, "write the results of a scene's patches as a table, one row each"),
    ):
        add_arguments(commands.add_parser(name, help=help).add_argument)
    parser.set_defaults(**dict.fromkeys(NOT_OF_ALL))
    return parser


def _add_reconstruct(add: Callable[..., Any]) -> None:
    add("--location", **VECTOR, help="where to touch (default: the 3D cursor)")
    add("--outward", **VECTOR, help="outward direction there (default: the surface's own)")
    add(
        "--tolerance",
        type=float,
        help="add planes until the mean deviation of the height is down to this or no plane would help",
    )
    add("--contacts", type=Path, metavar="CSV", help="write the simulated contacts")
    _add_inputs(add)
    _add_verify(add)


def _add_fit(add: Callable[..., Any]) -> None:
    _add_contacts(add, ".csv or .ply with the curves of one patch")
    add("--point", **VECTOR, help="where the curves meet (default: the point nearest to all)")
    add(
        "--location",
        **VECTOR,
        help="a place among strokes; all curves are then strokes (default for strokes alone: their mean)",
    )
    add(
        "--radius",
        type=float,
        help="for strokes alone: use contacts up to this distance from the place (all)",
    )
    add(
        "--normal-std",
        type=float,
        metavar="RADIANS",
        help="standard deviation of measured normals, to fit them too (one degree is 0.0175)",
    )
    add(
        "--onto",
        type=Path,
        metavar="MESH",
        help="put the patch onto this scanned mesh, .ply, .stl or .obj in the unit of the contacts",
    )
    add("--target", default="", metavar="NAME", help="the mesh in that file (default: the only one)")
    _add_method(add)
    _add_verify(add)


def _add_contacts(add: Callable[..., Any], help: str) -> None:
    """Adds the options of measured contacts."""
    add("files", nargs="+", type=Path, metavar="FILE", help=help)
    _add_unit(add, "unit of the numbers (the file's)")
    add("--outward", **VECTOR, help="a direction on the outer side (default: by the normals)")
    add("--flip", action="store_true", default=None, help="use the other side as the outer one")
    add("--noise", type=float, help="noise floor: a contact has at least this standard deviation")


def _add_unit(add: Callable[..., Any], help: str) -> None:
    add("--unit", choices=list(core.UNIT_METERS), help=help)


def _add_join(add: Callable[..., Any]) -> None:
    _add_contacts(add, ".csv or .ply with curves all over an object")
    add("--tolerance", type=float, help="standard deviation to reach for heights (1.2 %% of each patch)")
    _add_output(add, SURFACE)


def _add_map(add: Callable[..., Any]) -> None:
    add("--spacing", type=float, help="distance between the points that are touched (half of the extent)")
    _add_inputs(add)


def _add_object(add: Callable[..., Any]) -> None:
    _add_target(add)
    add("--location", **VECTOR, help="where to begin (default: any place that works)")
    add("--tolerance", type=float, help="standard deviation to reach for heights (size / 500)")
    add("--edge", type=float, help="length of the triangles' edges (chosen by the curvature)")
    add("--most", type=int, help="number of touches after which to stop (1000)")
    _add_sensor(add)
    _add_output(add, SURFACE)


def _add_table(add: Callable[..., Any]) -> None:
    add("file", nargs="?", type=Path, metavar="FILE", help=".blend (the open scene)")
    add("--output", type=Path, metavar="OUT", required=True, help="the table to write, .csv")


def _add_verify(add: Callable[..., Any]) -> None:
    add("--verify", type=Path, metavar="OUT", help="write the distances to the mesh as .csv")


def _add_inputs(add: Callable[..., Any]) -> None:
    """Adds the options of what to touch, and how."""
    _add_target(add)
    degrees: dict[str, Any] = {"type": float, "nargs": "+", "metavar": "DEGREES"}
    add("--azimuths", **degrees, help="three to six plane directions (0 60 120)")
    add("--tilts", **degrees, help="tilts of the planes, one each (0)")
    add(
        "--extent",
        type=float,
        help="length of each half curve (as far as a patch can be trusted; map: size / 8)",
    )
    add("--step", type=float, help="distance between contacts (such that more would add little)")
    _add_sensor(add)
    _add_method(add)


def _add_target(add: Callable[..., Any]) -> None:
    add("file", nargs="?", type=Path, metavar="FILE", help=".blend, .ply, .stl or .obj (the open scene)")
    add(
        "--target",
        default="",
        metavar="NAME",
        help="object to touch (default: the active one of a .blend, or the only mesh)",
    )
    _add_unit(add, "unit of a .ply, .stl or .obj file, for the report (unknown)")


def _add_sensor(add: Callable[..., Any]) -> None:
    add("--noise", type=float, help="standard deviation of the simulated sensor (0)")
    add("--seed", type=int, help="seed of the noise (0)")


def _add_method(add: Callable[..., Any]) -> None:
    """Adds the options of how to fit, and what to write."""
    add("--method", choices=[name for name, _, _ in METHODS], help="how to fit (bayes)")
    add(
        "--degree",
        type=str.strip,
        choices=["auto", *"23456"],
        help="degree of the polynomial (auto: the lowest that describes what the contacts show)",
    )
    add("--weight", type=float, help="lambda L^2, the weight of the contacts against smoothness (1000, 1e5)")
    add("--solver", choices=[name for name, _, _ in SOLVERS], help="solver of tagc (fast)")
    _add_output(
        add, "save the scene with the result as .blend, or the result alone as .ply; a patch also as .json"
    )


def _add_output(add: Callable[..., Any], help: str) -> None:
    add("--json", metavar="PATH", help="write the report as JSON; -: one line on standard output")
    add("--output", type=Path, metavar="OUT", help=help)
    add(
        "--report",
        type=Path,
        metavar="HTML",
        help="write a page for a browser: pictures, deviations, tolerance bands, settings, versions",
    )


def _is_number(text: str) -> bool:
    """Whether a word is a number: argparse would take -1e-3 for an option, unless a space precedes it."""
    try:
        float(text)
    except ValueError:
        return False
    return True


def _sentence(error: Exception) -> str:
    """The message of an operator's error, without the words that Blender adds."""
    words = str(error).strip()
    if isinstance(error, RuntimeError):  # There may be several reports.
        words = words.partition("\n")[0].removeprefix("Error: ")
    return " ".join(words.split())
