# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs every benchmark whose figures or pictures the pages have, keeps what it prints, and fills the pages.

`make figures` takes hours; `make figures ONLY=NAME` runs only the commands with NAME in their names, and
`python -m tools.figures --fill` only fills the pages again. What a command prints is kept in
docs/figures/NAME.txt, whose last line has the machine and the commit; docs/figures.md, the appendix, has all
of it, each below the docstring of its command. No figure is typed in another page. Those have marks, where
HEAD is how the head of a table begins:

- <!-- table NAME "HEAD" COLUMNS --> ... <!-- end --> shows these columns of the table, from 1 on, or all if
  none is named; 2=error gives column 2 another head.
- <!-- figure NAME "HEAD" "ROW" COLUMN -->...<!-- end --> shows one cell. ROW is the first cell of its row, or
  min or max.
"""

import argparse
import ast
import os
import re
import shlex
import shutil
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[1]
DOCS, KEPT = ROOT / "docs", ROOT / "docs" / "figures"
ZIP = "build/tactile_patch.zip"


class Run(NamedTuple):
    """A command, the heading of what it prints in the appendix, and the pictures that it draws."""

    words: str
    title: str = ""  # Nothing is kept of what a command without a title prints.
    pictures: Mapping[str, str | None] = MappingProxyType(
        {}
    )  # {in docs: in build, or None if it writes there}
    described_in: str = ""  # The module whose docstring says what is measured, if another than the command.


def _chart(name: str) -> dict[str, str | None]:
    """The files of a chart, with its numbers."""
    return {f"charts/{name}.{end}": f"charts/{name}.{end}" for end in ("png", "csv")}


# The caller names the folders $YCB, $MODELS and $PALPATION of public data. A run without its folder is left
# out.
RUNS = {
    "lesson": Run(
        "tools.lesson", "", dict.fromkeys(("lesson_one.jpg", "lesson_turn.jpg", "lesson_gauss.jpg"))
    ),
    "film": Run(f"tools.film --zip {ZIP}", "", {"film.webp": None}),
    "accuracy": Run("benchmarks.accuracy", "Exact surfaces and random shapes"),
    "chart": Run("benchmarks.chart", "", _chart("speed_accuracy")),
    "real": Run("benchmarks.real", "Scans of real objects"),
    "curvatures": Run("benchmarks.curvatures", "How often deviations hold"),
    "facets": Run(f"benchmarks.facets {ZIP}", "Facets"),
    "decimated": Run(f"benchmarks.facets {ZIP} --models $MODELS", "Facets of models, whole and decimated"),
    "stability": Run("benchmarks.stability", "Limits of the methods", _chart("stability")),
    "shapes": Run(
        "benchmarks.atlas --shapes --coarsest 0.002",
        "Made objects, touched all over",
        described_in="benchmarks.atlas_shapes",
    ),
    "atlas": Run("benchmarks.atlas --coarsest 0.002", "Scans, touched all over"),
    "field": Run("benchmarks.field $YCB", "Objects of a public set, touched all over"),
    "add_menu": Run(
        f"benchmarks.add_menu {ZIP}", "Blender's Add menu", {"add_menu.jpg": "charts/add_menu.jpg"}
    ),
    "touched": Run(f"benchmarks.add_menu {ZIP} --scans", "", {"touched.jpg": "charts/touched.jpg"}),
    "models": Run(f"benchmarks.models {ZIP} $MODELS", "Standard models of the field, touched all over"),
    "measured": Run("benchmarks.measured --partial 200 --full 100", "Measured contacts all over objects"),
    "features": Run("benchmarks.measured --features", "Features of few contacts"),
    "orientation": Run("benchmarks.measured --orientation", "Sides of strokes without normals"),
    "palpation": Run("benchmarks.robot $PALPATION", "The contacts of a real robot"),
    "live": Run(f"benchmarks.live {ZIP}", "Live updates in Blender"),
    "paper": Run(f"benchmarks.paper {ZIP}", "The paper's experiments"),
}
# Pictures of a window are taken by tests/gui/run.sh in build/gui, and one picture is drawn by hand.
WINDOW = ("pick", "probe", "deviation", "verify", "stability", "lost", "found", "whole_object")
BY_HAND = "data_flow.svg"
TABLE = re.compile(r'(<!-- table (\w+) "([^"]*)"((?: \d+(?:=[^ >]+)?)*) -->\n).*?(<!-- end -->)', re.DOTALL)
FIGURE = re.compile(r'(<!-- figure (\w+) "([^"]*)" "([^"]*)" (\d+) -->)[^<]*(<!-- end -->)')
HEAD = """# Figures

This appendix has all tables that the benchmarks print. `make figures` makes it, and fills the tables of the
other pages from it. A line of each command names the machine, versions and commit.
A later commit may give other figures. Times are comparable within a table only.
"""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--only", default="", help="only commands with this in their names")
    parser.add_argument("--fill", action="store_true", help="only fill the pages with what is kept")
    options = parser.parse_args()
    failed = [] if options.fill else [name for name in RUNS if options.only in name and not done(name)]
    fill()
    if failed:
        sys.exit(f"figures: {', '.join(failed)} failed; the pages have what the others printed")


def done(name: str) -> bool:
    """Whether a command ran to its end, after which its output and its pictures are in docs."""
    run = RUNS[name]
    if (needed := re.search(r"\$(\w+)", run.words)) and needed[1] not in os.environ:
        print(f"{name} is left out: name the folder of its data, {needed[1]}=FOLDER", file=sys.stderr)
        return True
    print(f"python -m {run.words}", flush=True)
    words = [sys.executable, "-m", *shlex.split(os.path.expandvars(run.words))]
    finished = subprocess.run(words, cwd=ROOT, check=False, stdout=subprocess.PIPE, text=True)
    if finished.returncode:
        return False
    if run.title:
        (KEPT / f"{name}.txt").write_text(finished.stdout, encoding="utf-8", newline="\n")
    for picture, made in run.pictures.items():
        if made:
            shutil.copyfile(ROOT / "build" / made, DOCS / picture)
    return True


def fill() -> None:
    """Writes the appendix, and what is kept into the marks of the pages."""
    (DOCS / "figures.md").write_text(appendix(), encoding="utf-8", newline="\n")
    for page in (ROOT / "README.md", *DOCS.glob("*.md")):
        page.write_text(filled(page.read_text(encoding="utf-8")), encoding="utf-8", newline="\n")


def filled(text: str) -> str:
    """A page with the figures that are kept."""

    def table(mark: re.Match[str]) -> str:
        rows = printed(mark[2], mark[3])
        chosen = [each.partition("=") for each in mark[4].split()]
        columns = [int(number) - 1 for number, _, _ in chosen] or list(range(len(rows[0])))
        lines = [[row[i] for i in columns] for row in rows]
        for at, (_, _, head) in enumerate(chosen):
            lines[0][at] = head.replace("_", " ") or lines[0][at]
        return mark[1] + "\n" + "".join(f"| {' | '.join(line)} |\n" for line in lines) + "\n" + mark[5]

    def figure(mark: re.Match[str]) -> str:
        rows, column = printed(mark[2], mark[3])[2:], int(mark[5]) - 1
        if mark[4] in ("min", "max"):
            choose = min if mark[4] == "min" else max
            cell = choose((row[column] for row in rows if row[column]), key=lambda c: float(c.split()[0]))
        else:
            (cell,) = (row[column] for row in rows if row[0] == mark[4])
        return mark[1] + cell + mark[6]

    return FIGURE.sub(figure, TABLE.sub(table, text))


def printed(name: str, head: str) -> list[list[str]]:
    """The rows of cells of the table whose head begins so; the second row is the rule below the head."""
    for table in re.findall(r"^\|.*(?:\n\|.*)*", kept(name), re.MULTILINE):
        if table.startswith(f"| {head}"):
            return [[cell.strip() for cell in line.strip("|").split("|")] for line in table.split("\n")]
    raise ValueError(f"docs/figures/{name}.txt has no table whose head begins with: {head}")


def kept(name: str) -> str:
    """What a command has printed."""
    return (KEPT / f"{name}.txt").read_text(encoding="utf-8").strip()


def description(module: str) -> str:
    """The docstring of a command's module: what it measures, and what its columns are."""
    path = ROOT / f"{module.replace('.', '/')}.py"
    return ast.get_docstring(ast.parse(path.read_text(encoding="utf-8"))) or ""


def appendix() -> str:
    """The page of all figures, and of the commands behind the pictures."""
    parts, described = [HEAD], set[str]()
    for name, run in RUNS.items():
        if run.title:
            module = run.described_in or run.words.split()[0]
            text = "" if module in described else f"{description(module)}\n\n"
            described.add(module)
            parts.append(f"## {run.title}\n\n{text}`python -m {run.words}` prints:\n\n{kept(name)}\n")
            parts += [f"![{run.title}]({p})\n" for p in run.pictures if not p.endswith(".csv")]
    rows = [
        f"| {', '.join(f'`{p}`' for p in run.pictures if not p.endswith('.csv'))} | `python -m {run.words}` |"
        for run in RUNS.values()
        if run.pictures
    ]
    window = ", ".join(f"`{name}.jpg`" for name in WINDOW)
    rows += [f"| {window} | `tests/gui/run.sh ZIP`, in build/gui |", f"| `{BY_HAND}` | drawn by hand |"]
    return "\n".join([*parts, "## Pictures\n\n| picture | command |\n|---|---|", *rows]) + "\n"


if __name__ == "__main__":
    main()
