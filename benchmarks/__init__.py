# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Commands that measure what the documentation claims: `python -m benchmarks.NAME`, in a checkout's root.

Each process computes on one thread.
"""

import argparse
import os
import platform
import shutil
import subprocess
import sys
from importlib.metadata import version
from pathlib import Path
from time import process_time

for library in ("OMP", "OPENBLAS", "MKL", "VECLIB_MAXIMUM", "NUMEXPR"):
    os.environ[f"{library}_NUM_THREADS"] = "1"  # numpy reads this once, on import.

ROOT = Path(__file__).resolve().parents[1]
SCANS_FOLDER = Path(os.environ.get("TACTILE_SCANS", ROOT.parent / "shared" / "data" / "meshes"))
NO_SCANS = (
    f"there are no scans in {SCANS_FOLDER}: download the nine that benchmarks/SCANS.md lists into one "
    "folder, and name it by TACTILE_SCANS"
)


def scan_files(words=""):
    """The files of the scans with `words` in their names, sorted. Ends the command if there are none."""
    found = sorted(path for path in SCANS_FOLDER.glob("*.*") if words in path.stem)
    return found or sys.exit(NO_SCANS)


def commit():
    """The commit of the code, "later than" it if files were changed since; nothing outside a checkout.

    Files in docs do not count: `make figures` writes there after each command.
    """

    def git(*words):
        run = subprocess.run(["git", *words], cwd=ROOT, capture_output=True, text=True, check=False)
        return run.stdout.strip()

    if shutil.which("git") is None or not (ROOT / ".git").exists():
        return ""
    head = git("rev-parse", "--short", "HEAD")
    return f"later than {head}" if git("status", "--porcelain", "--untracked-files=no", ":!docs") else head


def machine(*packages):
    """The processor, the commit, Python and these installed packages with their versions, for a caption."""
    cpu = platform.processor() or platform.machine()
    if (listing := Path("/proc/cpuinfo")).exists():
        lines = listing.read_text(encoding="utf-8").splitlines()
        cpu = next((line.split(":")[1].strip() for line in lines if line.startswith("model name")), cpu)
    versions = [f"{name} {version(name)}" for name in packages]
    if code := commit():
        versions.append(f"commit {code}")
    return ", ".join([f"one thread, {cpu}; Python {platform.python_version()}", *versions])


def parser_of(text, takes_zip=False):
    """The parser of the command with this docstring, which may take the built extension first."""
    parser = argparse.ArgumentParser(description=text.splitlines()[0])
    if takes_zip:
        parser.add_argument("zip", type=Path, metavar="ZIP", help="the built extension")
    return parser


def timed(run, *args, **kwargs):
    """(seconds of the processor that a call takes, what it returns)."""
    start = process_time()
    value = run(*args, **kwargs)
    return process_time() - start, value


def table(head, rows, left=1):
    """Prints a Markdown table; its first `left` columns are aligned to the left, the others to the right."""
    print("|", " | ".join(head), "|")
    print("|" + "---|" * left + "--:|" * (len(head) - left))
    for row in rows:
        print("|", " | ".join(row), "|")
    print()
