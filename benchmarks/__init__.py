# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Speed and accuracy are claims: each comes from `python -m benchmarks.NAME`, at the root of a checkout.

All run on one thread.
"""

import os
import platform
from importlib.metadata import version
from pathlib import Path
from time import perf_counter

for library in ("OMP", "OPENBLAS", "MKL", "VECLIB_MAXIMUM", "NUMEXPR"):
    os.environ[f"{library}_NUM_THREADS"] = "1"  # read once, when numpy is imported

ROOT = Path(__file__).resolve().parents[1]
SCANS_FOLDER = ROOT.parent / "shared" / "data" / "meshes"


def machine(*packages):
    """The processor, Python and these installed packages with their versions, for a caption."""
    cpu = platform.processor() or platform.machine()
    if (listing := Path("/proc/cpuinfo")).exists():
        lines = listing.read_text(encoding="utf-8").splitlines()
        cpu = next((line.split(":")[1].strip() for line in lines if line.startswith("model name")), cpu)
    versions = (f"{name} {version(name)}" for name in packages)
    return ", ".join([f"one thread, {cpu}; Python {platform.python_version()}", *versions])


def timed(run, *args, **kwargs):
    """Seconds that a call takes, and what it returns."""
    start = perf_counter()
    value = run(*args, **kwargs)
    return perf_counter() - start, value


def table(head, rows, left=1):
    """Prints Markdown; so many columns are aligned to the left."""
    print("|", " | ".join(head), "|")
    print("|" + "---|" * left + "--:|" * (len(head) - left))
    for row in rows:
        print("|", " | ".join(row), "|")
    print()
