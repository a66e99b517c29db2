# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A cluster of two workers, small objects, and the command on them; all of it needs Dask and Blender."""

import threading
import time
from importlib.util import find_spec
from pathlib import Path

import pytest
from data_sets import FEW, blocks_of, write_ball

MISSING = [name for name in ("bpy", "distributed", "pyarrow") if find_spec(name) is None]


def pytest_collection_modifyitems(items):
    skip = pytest.mark.skip(reason=f"{', '.join(MISSING)} not installed: run make test-cluster")
    for item in items:
        if MISSING and Path(__file__).parent in item.path.parents:
            item.add_marker(skip)


@pytest.fixture(scope="session")
def objects(tmp_path_factory):
    """A folder of three objects, two of them of one name."""
    folder = tmp_path_factory.mktemp("objects")
    write_ball(folder / "a" / "egg.ply", (1.0, 1.0, 1.4))
    write_ball(folder / "b" / "egg.ply", (1.0, 1.2, 0.8))
    write_ball(folder / "pebble.ply", (2.0, 1.5, 1.0))
    return folder


@pytest.fixture(scope="session")
def cluster():
    """A client of a cluster of two workers."""
    from cluster.engine import connected

    with connected(None, 2) as client:
        yield client


@pytest.fixture
def command(cluster, capfd):
    """A function that runs `touch` on that cluster and returns exit code, standard output and error."""
    from cluster.command_line import main

    def run(*words, scheduler=cluster.scheduler.address):
        try:
            code = main(["touch", *map(str, words), "--scheduler", scheduler])
        except SystemExit as ended:
            code = ended.code
        return code, *capfd.readouterr()

    return run


@pytest.fixture(scope="session")
def plain(cluster, objects, tmp_path_factory):
    """The data set of these objects as two workers make it when nothing disturbs them."""
    from cluster.command_line import main

    folder = tmp_path_factory.mktemp("plain")
    address = cluster.scheduler.address
    assert main(["touch", str(objects), *FEW, "--output", str(folder), "--scheduler", address]) == 0
    return folder


@pytest.fixture
def in_the_middle():
    """A function that has something done as soon as a data set in the making has some blocks."""
    threads = []

    def plan(folder, act, blocks=1):
        def watch():
            until = time.monotonic() + 60.0
            while len(blocks_of(folder)) < blocks and time.monotonic() < until:
                time.sleep(0.02)
            act()

        threads.append(threading.Thread(target=watch))
        threads[-1].start()

    yield plan
    for thread in threads:
        thread.join()
