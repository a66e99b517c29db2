# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Draws every picture of the documentation that a command draws, and puts it where the pages have it.

`make figures` does so in an hour or more; `make figures ONLY=NAME` runs only the commands of pictures with
NAME in their names. Pictures of charts come with their numbers as .csv. docs/figures.md lists all pictures,
also those of a window, which `tests/gui/run.sh` takes.
"""

import argparse
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
ZIP = "build/tactile_patch.zip"


def _chart(name):
    """The files of a chart, with its numbers."""
    return {f"charts/{name}.{end}": f"charts/{name}.{end}" for end in ("png", "csv")}


# What a command draws: {a file in docs: the file in build}. With None the command itself writes to docs.
DRAWN = {
    ("tools.lesson",): dict.fromkeys(("lesson_one.jpg", "lesson_turn.jpg", "lesson_gauss.jpg")),
    ("tools.film", "--zip", ZIP): {"film.webp": None},
    ("benchmarks.chart",): _chart("speed_accuracy") | _chart("speed_accuracy_frame"),
    ("benchmarks.amount",): _chart("amount"),
    ("benchmarks.mesh_size", ZIP): _chart("mesh_size"),
    ("benchmarks.real", "--chart"): _chart("real_surfaces"),
    ("benchmarks.stability",): _chart("stability") | {"charts/stability_all.png": "charts/stability_all.png"},
    ("benchmarks.paper", ZIP): {
        "paper_figures_3_4.jpg": "paper/figures_3_4.jpg",
        "paper_table_1.jpg": "paper/table_1.jpg",
    },
    ("benchmarks.extents", ZIP, "--pictures"): {"extent.jpg": "paper/extent.jpg"},
    ("benchmarks.add_menu", ZIP, "--scans"): {"touched.jpg": "charts/touched.jpg"},
    ("benchmarks.add_menu", ZIP): {"add_menu.jpg": "charts/add_menu.jpg"},
    ("benchmarks.atlas", "--coarsest", "0.002"): _chart("atlas"),
}


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--only", default="", help="only commands that draw a picture with this in its name")
    options = parser.parse_args()
    failed = []
    for words, files in DRAWN.items():
        if not any(options.only in name for name in files):
            continue
        print(f"python -m {' '.join(words)}", flush=True)
        if subprocess.run([sys.executable, "-m", *words], cwd=ROOT, check=False).returncode:
            failed.append(words[0])
            continue
        for name, made in files.items():
            if made:
                shutil.copyfile(ROOT / "build" / made, ROOT / "docs" / name)
    if failed:
        sys.exit(f"figures: {', '.join(failed)} failed; the pictures of the others are in docs")


if __name__ == "__main__":
    main()
