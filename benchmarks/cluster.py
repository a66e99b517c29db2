# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Data sets of touches: what they cost compared with plain loops, and how many workers they can keep busy.

`python -m benchmarks.cluster [--quick]`, from the root of a checkout with cluster/requirements.txt installed.
It prints Markdown tables:

(a) touches a second by one worker and by two, and by one and two plain loops over as many touches
    (plain_loop.py); both take turns, and the table has medians. `processor` is the processor time of the
    plain loops over that of all processes of the cluster, which other programs hardly change;
(b) what a block costs in addition to its touches, on the worker and at the scheduler;
(c) the memory of all processes while 1000 objects are touched by processes that are never replaced;
(d) the share of the workers' time that goes into touches, computed from (a) and (b).
"""

import argparse
import json
import subprocess
import sys
import tempfile
from contextlib import contextmanager
from pathlib import Path
from statistics import median
from time import perf_counter

import numpy as np
import psutil

from cluster.data_set.folder import DataSet
from cluster.data_set.options import Options
from cluster.engine import Engine, connected
from cluster.run import Run

from . import ROOT, SCANS_FOLDER, machine, table

KINDS = {"automatic": {}, "fixed": {"extent": "6.25%", "step": "0.5%"}}
SCANS = ("pear.ply", "lemon.ply", "bottle_bleach.ply", "asteroid_eros.ply")
WORKERS, BLOCKS = (1, 10, 100, 1000), (10, 50, 500, 5000)
LIMIT = 600.0


def options(touches, block, seed=0, **more):
    plain = dict.fromkeys(("extent", "step", "tolerance", "weight"))
    given = {"noise": "0.1%", "azimuths": (0.0, 60.0, 120.0), "tilts": (0.0, 0.0, 0.0)}
    fit = {"method": "bayes", "degree": "auto", "solver": "fast"}
    return Options(**plain | given | fit | {"touches": touches, "block": block, "seed": seed} | more)


def family():
    """This process and all its present descendants."""
    return [psutil.Process(), *psutil.Process().children(recursive=True)]


def processor_time(processes):
    """{process id: seconds of processor time}."""
    times = {}
    for process in processes:
        try:
            times[process.pid] = sum(process.cpu_times()[:2])
        except psutil.Error:  # It has ended.
            continue
    return times


@contextmanager
def clocked(spent):
    """Appends (seconds, processor time of all processes of the family, that of this process) to a list.

    Processes that end meanwhile do not count.
    """
    before, start = processor_time(family()), perf_counter()
    yield
    seconds, after = perf_counter() - start, processor_time(family())
    own = psutil.Process().pid
    work = {pid: after[pid] - before.get(pid, 0.0) for pid in after}
    spent.append((seconds, sum(work.values()), work[own]))


def made(engine, files, settings):
    """Makes a data set with warm workers: (seconds, processor time, that of client and scheduler)."""
    spent = []
    with tempfile.TemporaryDirectory() as folder:
        run = Run(DataSet(Path(folder)), settings, [str(path) for path in files])
        with clocked(spent):
            run.work(engine)
    return spent[0]


def looped(files, settings, count):
    """(seconds, processor time) of `count` plain loops side by side, each over all files."""
    words = [[path.stem, str(path)] for path in files]
    command = [sys.executable, "-m", "benchmarks.plain_loop", json.dumps(words)]
    loops = [
        subprocess.Popen(
            [*command, json.dumps(options(**settings | {"seed": seed}).to_dict())],
            cwd=ROOT, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
        )
        for seed in range(count)
    ]  # fmt: skip
    for loop in loops:
        loop.stdout.readline()
    for loop in loops:
        loop.stdin.write("\n")
        loop.stdin.flush()
    times = [json.loads(loop.communicate()[0].splitlines()[-1]) for loop in loops]
    return max(seconds for seconds, _ in times), sum(work for _, work in times)


def rates(files, runs, touches):
    """Prints (a); returns {kind: seconds of processor time of a touch}."""
    pairs = {(kind, workers): [] for kind in KINDS for workers in (1, 2)}
    for workers in (1, 2):
        with connected(None, workers, None) as client:
            engine = Engine(client, LIMIT)
            made(engine, files, options(2 * 60, 60, seed=99, **KINDS["fixed"]))  # This warms up.
            for _ in range(runs):
                for kind, more in KINDS.items():
                    plain = looped(files, {"touches": touches[kind], "block": 500, **more}, workers)
                    cluster = made(engine, files, options(workers * touches[kind], 500, **more))
                    pairs[kind, workers].append((plain, cluster))
                    _say(kind, workers, plain, cluster)
    rows, seconds = [], {}
    for (kind, workers), found in pairs.items():
        total = workers * len(files) * touches[kind]
        seconds[kind] = median(plain[1] for plain, _ in found) / total
        speeds = [total / median(pair[i][0] for pair in found) for i in (0, 1)]
        ratios = [median(plain[i] / cluster[i] for plain, cluster in found) for i in (0, 1)]
        rows.append([kind, f"{workers}", *(f"{v:.0f}" for v in speeds), *(f"{v:.2f}" for v in ratios)])
    print(f"(a) {len(files)} scans, {touches} touches of each scan by each worker, in blocks of 500.\n")
    table(["touches", "workers", "plain loops /s", "data set /s", "ratio", "processor"], rows, left=1)
    return seconds


def _say(kind, workers, plain, cluster):
    """Prints what a pair of runs has taken as soon as it ends, because all of them take long."""
    times = [f"{seconds:.1f} s, processor {work:.1f} s" for seconds, work, *_ in (plain, cluster)]
    print(f"{kind}, {workers}: plain loops {times[0]}; data set {times[1]}", file=sys.stderr, flush=True)


def overhead(files, count):
    """Prints (b); returns the seconds that a block costs on its worker, and at client and scheduler.

    The former include opening another object for each block.
    """
    fixed = KINDS["fixed"]
    with connected(None, 1, None) as client:
        engine = Engine(client, LIMIT)
        made(engine, files[:1], options(2, 1, seed=99, **fixed))
        seconds, work, central = made(engine, files[:1], options(count, 1, **fixed))
    touches = looped(files[:1], {"touches": count, "block": 1, **fixed}, 1)[1]
    opening = looped(files, {"touches": 1, "block": 1, **fixed}, 1)[1] / len(files) - touches / count
    worker, center = (work - central - touches) / count, central / count
    idle = max(seconds - work, 0.0) / count
    print(f"(b) What a block costs in addition to its touches, from {count} blocks of one touch.\n")
    rows = [["worker, processor time", worker], ["opening another object, processor time", opening]]
    rows.append(["client and scheduler, processor time", center])
    rows.append(["clock beyond all processor time, as where other programs run", idle])
    table(["", "ms"], [[name, f"{1e3 * value:.1f}"] for name, value in rows])
    return worker + opening, center


def write_ball(path, radii, rings=32):
    """An ellipsoid as binary .ply."""
    polar, azimuth = np.meshgrid(
        np.pi * (np.arange(rings) + 0.5) / rings, np.pi * np.arange(2 * rings) / rings, indexing="ij"
    )
    unit = np.stack([np.sin(polar) * np.cos(azimuth), np.sin(polar) * np.sin(azimuth), np.cos(polar)], -1)
    index = np.arange(2 * rings**2).reshape(rings, 2 * rings)
    right = np.roll(index, -1, axis=1)
    corners = np.stack([index[:-1], index[1:], right[1:], right[:-1]], -1).reshape(-1, 4)
    faces = np.empty(len(corners), dtype=[("count", "u1"), ("corners", "<i4", 4)])
    faces["count"], faces["corners"] = 4, corners
    head = f"ply\nformat binary_little_endian 1.0\nelement vertex {unit.size // 3}\n"
    head += "".join(f"property float {axis}\n" for axis in "xyz")
    head += f"element face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n"
    path.write_bytes(head.encode() + (unit * radii).astype("<f4").tobytes() + faces.tobytes())


def memory(count):
    """Prints (c), with the megabytes by which the processes grow for each object."""
    rng, seen = np.random.default_rng(0), []
    with tempfile.TemporaryDirectory() as folder, connected(None, 1, None) as client:
        client.run(_never_worn)
        engine, step = Engine(client, LIMIT), count // 5
        files = [Path(folder, f"{i}.ply") for i in range(count)]
        for path in files:
            write_ball(path, rng.uniform(0.7, 1.3, 3))
        for start in range(0, count, step):
            made(engine, files[start : start + step], options(10, 10, **KINDS["fixed"]))
            sizes = [(process.memory_info().rss / 2**20, process) for process in family()]
            seen.append([size for size, process in sizes if "resource_tracker" not in str(process.cmdline())])
    print("(c) Memory in MB after this many objects, 10 touches of each.\n")
    names = ["client and scheduler", "Dask's worker", "its Blender"]
    head = ["", *(f"{start + step}" for start in range(0, count, step)), "growth an object"]
    growths = [(last - first) / (count - step) for first, last in zip(seen[0], seen[-1], strict=True)]
    table(
        head,
        [[name, *(f"{sizes[i]:.0f}" for sizes in seen), f"{growths[i]:.3f}"] for i, name in enumerate(names)],
    )


def _never_worn():
    from cluster.worker import process

    process.MOST_OPENED = sys.maxsize


def on_paper(seconds, worker, center):
    """Prints (d), from the seconds that `rates` and `overhead` return."""
    print("(d) The share of the workers' time that goes into touches, by workers and touches a block.\n")
    rows = []
    for kind, each in seconds.items():
        for count in WORKERS:
            shares = [_share(each, worker, center, count, block) for block in BLOCKS]
            least = max(9.0 * worker, 0.9 * count * center) / each
            files = count / (least * each + worker)
            cells = [f"{share:.2f}" for share in shares]
            rows.append([kind, f"{count}", *cells, f"{least:.0f}", f"{files:.1f}"])
    table(["touches", "workers", *map(str, BLOCKS), "block for .9", "files/s then"], rows, left=1)
    for kind, each in seconds.items():
        most = (500 * each + worker) / center
        print(f"With blocks of 500 {kind} touches one scheduler keeps {most:.0f} workers busy.")


def _share(each, worker, center, count, block):
    """The share of the time that goes into touches, if the scheduler hands out one block after the other."""
    return block * each / max(block * each + worker, count * center)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="less of everything")
    quick = parser.parse_args().quick
    files = [SCANS_FOLDER / name for name in SCANS[: 2 if quick else None]]
    if not files[0].is_file():
        sys.exit(f"cluster: there are no scans in {SCANS_FOLDER}")
    touches = {"automatic": 100, "fixed": 300} if quick else {"automatic": 500, "fixed": 1000}
    seconds = rates(files, 3 if quick else 5, touches)
    worker, center = overhead(files, 100 if quick else 300)
    memory(100 if quick else 1000)
    on_paper(seconds, worker, center)
    print(f"\n{machine('bpy', 'numpy', 'scipy', 'distributed', 'pyarrow')}.")


if __name__ == "__main__":
    main()
