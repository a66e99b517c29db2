# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What the order in which a processor sums changes: fits, touches and whole objects under several kernels.

`python -m benchmarks.kernels`, from the root of a checkout, prints Markdown tables; it needs bpy to read a
scan and to cast rays. numpy's and scipy's OpenBLAS have a kernel for each kind of processor, and
OPENBLAS_CORETYPE chooses one; each kernel has a process of its own. The differences are from the first kernel
that runs here:

(a) fits of the touches of benchmarks.speed and automatic touches on the pear: the largest difference of
    heights, in radii and in standard deviations, and how many are off by more than 1e-6 of the radius;
(b) pear, ball and box, touched all over: the numbers of touches, ties among them, whether the mesh is closed,
    its mean distance from the object, and the largest difference of the field's distances at places near it,
    in standard deviations. There is a tie where a touch was chosen and another place would bring as much, to
    1e-9: then the order in which they were found decides.
"""

import os
import pickle
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

import core
from core.atlas.frontier import Frontier
from tests import solids
from tools import blender

from . import ROOT, machine, table
from .atlas import NOISE, Scanned, off_mesh
from .speed import fit, touches

# They are in order of age; any x86 processor runs the first. Where a library has no Zen it takes Haswell.
KERNELS = ("Prescott", "Sandybridge", "Haswell", "Zen", "SkylakeX")
PLACES, TOUCHES = 200, 100
AGREES, TIE = 1e-6, 1e-9
TOLERANCE, EDGE, NEAR = 0.008, 0.03, 0.02  # The objects have the size 1.


def places():
    """Points over the unit disk, (PLACES, 2)."""
    azimuths = np.pi * (3.0 - np.sqrt(5.0)) * np.arange(PLACES)
    radii = 0.9 * np.sqrt((np.arange(PLACES) + 0.5) / PLACES)
    return np.column_stack([radii * np.cos(azimuths), radii * np.sin(azimuths)])


def heights(r):
    """Points of a patch (n, 3), the deviations of its heights there (n,), and the patch."""
    x, y = r.radius * places().T
    points = r.frame.to_world(np.column_stack([x, y, r.height(x, y)]))
    return points, r.height_std(x, y), r


def automatic(pear):
    """Touches at random places of the pear; None where one is refused."""
    found = core.explore_many(pear, *pear.random[:TOUCHES].transpose(1, 0, 2), rng=0)
    return [None if isinstance(e, ValueError) else heights(e.result) for e in found]


class Ties:
    """Within this context, the choices that were made while another place would bring as much."""

    def __enter__(self):
        self.count, self.next_touches = 0, Frontier.next_touches
        ties, next_touches = self, Frontier.next_touches

        def counted(frontier, count):
            found = yield from next_touches(frontier, count)
            gains = np.array([*(touch.gain for touch in found), *(-entry[0] for entry in frontier.queue)])
            for touch in found:
                ties.count += int(np.sum(np.abs(gains - touch.gain) <= TIE * touch.gain) > 1)
            return found

        Frontier.next_touches = counted
        return self

    def __exit__(self, *_):
        Frontier.next_touches = self.next_touches


def whole(thing, points, distances):
    """(touches, ties, closed, mean distance in ‰, field and deviations at places near points)."""
    with Ties() as ties:
        atlas = core.explore_object(
            thing, thing.start, thing.outward, tolerance=TOLERANCE, noise=NOISE, rng=0
        )
    mesh = atlas.mesh(EDGE)
    field = atlas.distance(points + np.random.default_rng(0).uniform(-NEAR, NEAR, points.shape))
    return len(atlas.patches), ties.count, mesh.is_closed, float(distances(mesh).mean()), field


def measured():
    """What one kernel finds: fits, automatic touches, and the objects by name."""
    with blender.quiet():
        pear = Scanned("pear")
        objects = {
            "pear": whole(pear, pear.points, lambda mesh: off_mesh(*mesh[:2], pear.points)),
            **{name: exact(solid) for name, solid in (("ball", ball()), ("box", box()))},
        }
        return [heights(fit(case)) for case in touches()], automatic(pear), objects


def ball():
    return solids.ball(0.5)


def box():
    return solids.block(0.5, 0.35, 0.25)


def exact(solid):
    ways = np.random.default_rng(1).normal(size=(1000, 3))
    ways /= np.linalg.norm(ways, axis=1, keepdims=True)
    points = np.array([solid.ray_cast((0.0, 0.0, 0.0), tuple(way), 2.0)[0] for way in ways.tolist()])
    return whole(solid, points, lambda mesh: 1e3 * np.abs(solid.distances(mesh.vertices)))


def by_kernel():
    """What each kernel finds that runs here, by its name."""
    found = {}
    with tempfile.TemporaryDirectory() as folder:
        for kernel in KERNELS:
            path = Path(folder, kernel)
            command = [sys.executable, "-m", "benchmarks.kernels", str(path)]
            environment = os.environ | {"OPENBLAS_CORETYPE": kernel}
            ended = subprocess.run(command, env=environment, cwd=ROOT, capture_output=True, text=True)
            if ended.returncode < 0:  # A signal: this processor lacks instructions, or OpenBLAS is at fault.
                print(f"{kernel} ended with signal {-ended.returncode} and is left out.\n")
            elif ended.returncode:
                sys.exit(ended.stderr)
            else:
                found[kernel] = pickle.loads(path.read_bytes())
    return found


def difference(one, other):
    """The largest difference of heights of two patches, in radii and in deviations; inf if one is refused."""
    if one is None or other is None:
        return (0.0, 0.0) if one is other else (np.inf, np.inf)
    (points, stds, _), (_, _, r) = one, other
    x, y, z = r.frame.to_local(points).T  # The axes of a patch that is round may be turned.
    off = np.abs(z - r.height(x, y))
    return (off / r.radius).max(), (off / np.maximum(stds, 1e-9 * r.radius)).max()


def patches_table(title, runs):
    print(f"(a) {title}\n")
    first, *others = runs
    rows = []
    for kernel in others:
        off = np.array([difference(*pair) for pair in zip(runs[first], runs[kernel], strict=True)])
        most, stds = off.max(axis=0)
        rows.append([kernel, f"{most:.1e}", f"{stds:.1e}", f"{np.sum(off[:, 0] > AGREES)} of {len(off)}"])
    table([f"compared with {first}", "radii", "deviations", f"off by more than {AGREES:g} radii"], rows)


def objects_table(runs):
    print("(b) Whole objects.\n")
    first, rows = next(iter(runs)), []
    for name in runs[first]:
        distance, std = runs[first][name][4]
        for kernel, found in runs.items():
            count, ties, closed, mean, (other, other_std) = found[name]
            known = np.isfinite(std) & np.isfinite(other_std)
            off = (np.abs(other - distance) / std)[known].max()
            cells = [str(count), str(ties), "yes" if closed else "no", f"{mean:.4f}", f"{off:.1e}"]
            rows.append([name, kernel, *cells])
    head = ["touches", "ties", "closed", "mean distance, ‰", f"deviations from {first}"]
    table(["object", "kernel", *head], rows, left=2)


def main():
    runs = by_kernel()
    if len(runs) < 2:
        sys.exit("kernels: fewer than two kernels run here")
    patches_table("Fits.", {kernel: found[0] for kernel, found in runs.items()})
    patches_table("Automatic touches on the pear.", {kernel: found[1] for kernel, found in runs.items()})
    objects_table({kernel: found[2] for kernel, found in runs.items()})
    print(f"{machine('bpy', 'numpy', 'scipy')}.")


if __name__ == "__main__" and sys.argv[1:]:
    Path(sys.argv[1]).write_bytes(pickle.dumps(measured()))
elif __name__ == "__main__":
    main()
