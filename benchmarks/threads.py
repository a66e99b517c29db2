# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What threads of numpy's and scipy's linear algebra do to an automatic touch, by the clock.

`python -m benchmarks.threads`, from the root of a checkout, prints a Markdown table of medians; it needs bpy
to cast rays. The first row is on one thread. The second is as users have it: scipy's OpenBLAS has one thread
while core calls it, and numpy's has as many as there are processors. The third is as it would be if both had
threads. Each row is a process of its own.
"""

import os
import subprocess
import sys
from pathlib import Path
from statistics import median
from time import perf_counter

import numpy as np

ROWS = {"one thread": "1", "as users have it": "", "threads for both": "both"}
# The number of touches, the height of the bumps of a ball of radius 1, and its vertices along a meridian.
TOUCHES, ROUGH, FINE = 30, 0.02, 160


def ball():
    """A ball with bumps, in Blender's tree."""
    import bpy  # noqa: F401  # It brings mathutils.
    from mathutils.bvhtree import BVHTree

    polar, around = np.meshgrid(np.linspace(0.0, np.pi, FINE), np.linspace(0.0, 2.0 * np.pi, 2 * FINE))
    radius = 1.0 + ROUGH * np.sin(5.0 * polar) ** 2 * np.sin(9.0 * around)
    points = radius * (np.sin(polar) * np.cos(around), np.sin(polar) * np.sin(around), np.cos(polar))
    at = np.arange(polar.size).reshape(polar.shape)
    faces = np.stack([at[:-1, :-1], at[:-1, 1:], at[1:, 1:], at[1:, :-1]], axis=-1)
    return BVHTree.FromPolygons(points.reshape(3, -1).T.tolist(), faces.reshape(-1, 4).tolist())


def seconds():
    """The median seconds of automatic touches all around the ball."""
    import core

    surface, took = Tree(ball()), []
    for azimuth in np.linspace(0.0, 6.0, TOUCHES):
        up = np.array([np.cos(azimuth), np.sin(azimuth), 0.3]) / np.hypot(1.0, 0.3)
        point, _ = surface.ray_cast(tuple(2.0 * up), tuple(-up), 2.0)
        start = perf_counter()
        core.explore(surface, point, up)
        took.append(perf_counter() - start)
    return median(took)


class Tree:
    """Blender's tree as a surface that core can touch."""

    def __init__(self, tree):
        self.tree = tree

    def ray_cast(self, origin, direction, distance):
        hit, normal, _, _ = self.tree.ray_cast(origin, direction, distance)
        return None if hit is None else (tuple(hit), tuple(normal))


def main():
    from . import ROOT, machine, table

    limits = [name for name in os.environ if name.endswith("_NUM_THREADS")]
    free = {name: value for name, value in os.environ.items() if name not in limits}
    took = {}
    for title, mode in ROWS.items():
        command = [sys.executable, __file__, mode]
        environment = dict(os.environ) if mode == "1" else free
        took[title] = float(
            subprocess.run(command, env=environment, cwd=ROOT, check=True, capture_output=True).stdout
        )
    least = took["one thread"]
    table(
        ["touches", "ms", "times"],
        [[t, f"{1e3 * each:.2f}", f"{each / least:.1f}"] for t, each in took.items()],
    )
    print(f"{os.cpu_count()} processors. The first row is on {machine('numpy', 'scipy')}.")


if __name__ == "__main__" and __package__:
    main()
elif __name__ == "__main__":
    sys.path[0] = str(Path(__file__).parents[1])
    from core import lapack

    if sys.argv[1] == "both":
        lapack._threads = lambda: None
    print(seconds())
