# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Changes core in one place after the other, and says which changes no test notices.

`python -m tools.mutants [--count N] [--seed N] [--first N] [MODULE ...]`, from the root of a checkout. It
draws --count of all places where an operator, a number, a comparison or a condition could be another one.
Each is changed in a copy of the checkout, and the tests of its module run until one fails. A change whose
tests do not end in time counts as noticed. The command prints the changes that survive or time out, and how
many were noticed.
"""

import argparse
import ast
import random
import resource
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[1]
COPIED = ("core", "tests", "tools", "benchmarks", "docs", "examples", "pyproject.toml")
TESTS = {  # The tests of each module of core; those that fail soonest come first.
    "arguments": "reconstruction serialization",
    "atlas/measured": "measured",
    "bayes/evidence": "posterior process measured_normals",
    "bayes/joint_fit": "posterior status measured_normals reconstruction",
    "bayes/kernel": "process measured_normals",
    "bayes/normals": "measured_normals",
    "bayes/other_curves": "other_curves",
    "bayes/posterior": "posterior process status",
    "bayes/prior": "posterior process",
    "bayes/process_fit": "process measured_normals",
    "bayes/roughness": "roughness exploration",
    "bayes/sextic": "posterior measured_normals strokes",
    "contours/common_point": "common_point",
    "contours/contour": "tracking order reconstruction measured_normals exploration",
    "contours/curves": "local_geometry reconstruction status measured_normals",
    "contours/local_geometry": "local_geometry reconstruction",
    "contours/thinning": "thinning order",
    "contours/tracking": "tracking",
    "exploration/extent": "exploration",
    "exploration/touches": "exploration",
    "paper/by_method": "fitting reconstruction",
    "paper/least_squares": "fitting",
    "paper/tagc": "fitting",
    "patch/differential_geometry": "monge geometry",
    "patch/domain": "domain reconstruction strokes",
    "patch/geometry": "geometry verification process",
    "patch/monge": "monge geometry fitting",
    "patch/triangulation": "triangulation",
    "reconstruction/deviations": "process reconstruction posterior",
    "reconstruction/from_contours": "reconstruction strokes",
    "reconstruction/next_plane": "posterior process",
    "reconstruction/result": "status reconstruction geometry process measured_normals posterior",
    "reconstruction/serialization": "serialization",
    "reconstruction/stacks": "reconstruction process measured_normals strokes",
    "reconstruction/start": "reconstruction strokes",
    "reconstruction/status": "status",
    "reconstruction/strokes": "strokes order",
    "exploration/taps": "taps_of_meshes taps",
    "scan/pose_search": "pose_search",
    "scan/sampling": "sampling pose_search",
    "scan/scanned_mesh": "pose_search",
    "scan/verification": "verification",
}
OPERATORS: dict[type, type] = {
    ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult, ast.Pow: ast.Mult,
    ast.Mod: ast.Mult, ast.FloorDiv: ast.Mult, ast.BitAnd: ast.BitOr,
    ast.BitOr: ast.BitAnd, ast.And: ast.Or, ast.Or: ast.And, ast.Lt: ast.GtE, ast.GtE: ast.Lt,
    ast.Gt: ast.LtE, ast.LtE: ast.Gt, ast.Eq: ast.NotEq, ast.NotEq: ast.Eq, ast.Is: ast.IsNot,
    ast.IsNot: ast.Is, ast.In: ast.NotIn, ast.NotIn: ast.In,
}  # fmt: skip
NAMES = {"maximum": "minimum", "minimum": "maximum", "max": "min", "min": "max", "cos": "sin", "sin": "cos"}


class Mutant(NamedTuple):
    """A module with one place changed: its name, a line that describes the change, and its new source."""

    module: str
    said: str
    source: str


def places_of(module: str) -> list[tuple[str, int]]:
    """The places that can be changed in a module of core: (module, number of the node in its syntax tree)."""
    nodes = list(ast.walk(_tree(module)))
    # No test could notice a changed annotation.
    types = [getattr(node, name, None) for node in nodes for name in ("annotation", "returns")]
    skipped = {id(part) for top in types if top is not None for part in ast.walk(top)}
    return [(module, i) for i, node in enumerate(nodes) if id(node) not in skipped and _change(node)]


def mutant_at(module: str, number: int) -> Mutant:
    """The Mutant of one place."""
    tree = _tree(module)
    node = list(ast.walk(tree))[number]
    before, change = ast.unparse(node), _change(node)
    assert change is not None
    change(node)
    said = f"core/{module}.py:{node.lineno}: {before}  ->  {ast.unparse(node)}"  # type: ignore[attr-defined]
    return Mutant(module, said, ast.unparse(tree))


def _tree(module: str) -> ast.Module:
    return ast.parse((ROOT / "core" / f"{module}.py").read_text(encoding="utf-8"))


def _change(node: ast.AST) -> Callable[[ast.AST], None] | None:
    """A function that changes a node like this one, or None if such nodes stay as they are."""
    if isinstance(node, ast.BinOp | ast.BoolOp | ast.AugAssign) and type(node.op) in OPERATORS:
        return lambda n: setattr(n, "op", OPERATORS[type(n.op)]())  # type: ignore[attr-defined]
    if isinstance(node, ast.Compare) and type(node.ops[0]) in OPERATORS:
        return lambda n: n.ops.__setitem__(0, OPERATORS[type(n.ops[0])]())  # type: ignore[attr-defined]
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
        return lambda n: setattr(n, "op", ast.UAdd())
    if isinstance(node, ast.Constant) and type(node.value) is bool:
        return lambda n: setattr(n, "value", not n.value)  # type: ignore[attr-defined]
    if isinstance(node, ast.Constant) and type(node.value) is int:
        return lambda n: setattr(n, "value", n.value + 1)  # type: ignore[attr-defined]
    if isinstance(node, ast.Constant) and type(node.value) is float:
        return lambda n: setattr(n, "value", 2.0 * n.value or 1.0)  # type: ignore[attr-defined]
    if isinstance(node, ast.Attribute) and node.attr in NAMES:
        return lambda n: setattr(n, "attr", NAMES[n.attr])  # type: ignore[attr-defined]
    if isinstance(node, ast.Name) and node.id in NAMES:
        return lambda n: setattr(n, "id", NAMES[n.id])  # type: ignore[attr-defined]
    return None


def outcome(mutant: Mutant, place: Path, seconds: float) -> str:
    """Runs the tests of a mutant in the copy `place`: "died", "survived" or "timed out"."""
    path = place / "core" / f"{mutant.module}.py"
    original = path.read_text(encoding="utf-8")
    path.write_text(mutant.source, encoding="utf-8")
    names = TESTS[mutant.module].split()
    tests = [str(found) for name in names for found in (place / "tests/core").rglob(f"test_{name}.py")]
    command = [sys.executable, "-m", "pytest", "-x", "-q", "-p", "no:cacheprovider", *tests]
    # These are seconds of the processor and not of the clock, so that a busy machine ends no tests.
    limit = (int(seconds), int(seconds))
    try:
        run = subprocess.run(
            command,
            cwd=place,
            capture_output=True,
            check=False,
            preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_CPU, limit),
        )
    finally:
        path.write_text(original, encoding="utf-8")
    if run.returncode < 0:
        return "timed out"
    return "died" if run.returncode else "survived"


def main() -> None:
    parser = argparse.ArgumentParser(description="Which changes of core no test notices.")
    parser.add_argument(
        "modules", nargs="*", metavar="MODULE", help="modules of core, as in bayes/joint_fit (all)"
    )
    parser.add_argument("--count", type=int, default=300, help="number of changes (%(default)s)")
    parser.add_argument("--first", type=int, default=0, help="the drawn change to begin with (%(default)s)")
    parser.add_argument("--seed", type=int, default=0, help="seed of the draw (%(default)s)")
    parser.add_argument(
        "--seconds", type=float, default=120.0, help="of processor time, for a module's tests (%(default)g)"
    )
    options = parser.parse_args()
    every = [place for module in options.modules or TESTS for place in places_of(module)]
    drawn = random.Random(options.seed).sample(every, min(options.count, len(every)))[options.first :]
    # All changes are made first, because the checkout may change while tests run.
    chosen = [mutant_at(*place) for place in drawn]
    outcomes = []
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        for name in COPIED:
            copied = shutil.copytree if (ROOT / name).is_dir() else shutil.copy
            copied(ROOT / name, place / name)
        for mutant in chosen:
            outcomes.append(outcome(mutant, place, options.seconds))
            if outcomes[-1] != "died":
                print(f"{outcomes[-1]}: {mutant.said}", flush=True)
            print(f"\r{len(outcomes)} of {len(chosen)}", end="", file=sys.stderr, flush=True)
    survived, late = outcomes.count("survived"), outcomes.count("timed out")
    print(f"{len(outcomes) - survived} of {len(outcomes)} changes were noticed, {late} by the time limit.")
    print(f"They were drawn by seed {options.seed} from {len(every)} possible ones.")


if __name__ == "__main__":
    main()
