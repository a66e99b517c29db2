# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Whatever happens in the middle: workers and schedulers lost, broken files, no room on the disk, Ctrl+C."""

import json
import os
import shutil
import signal
import socket
import subprocess
import sys
import time
from contextlib import ExitStack, contextmanager
from functools import partial
from pathlib import Path

import pytest
from data_sets import FEW, blocks_of, nothing_is_aside, rows_of, write_ball

pq = pytest.importorskip("pyarrow.parquet", reason="pyarrow is not installed: run make test-cluster")
psutil = pytest.importorskip("psutil", reason="distributed is not installed: run make test-cluster")

ROOT = Path(__file__).parents[2]
# A file whose header announces more faces than Blender's importer survives.
CRASHES = """ply
format ascii 1.0
element vertex 3
property float x
property float y
property float z
element face 4000000000
property list uchar int vertex_indices
end_header
0 0 0
1 0 0
0 1 0
3 0 1 2
"""


def hands():
    """The processes below this one that have Blender."""
    found = []
    for process in psutil.Process().children(recursive=True):
        try:
            if "cluster.worker.hand" in process.cmdline():
                found.append(process)
        except psutil.Error:  # it has just ended
            pass
    return found


def started(*words):
    """The command in a process and a session of its own."""
    return subprocess.Popen(
        [sys.executable, "-m", "cluster", "touch", *map(str, words)],
        cwd=ROOT,
        start_new_session=True,
        preexec_fn=partial(
            signal.signal, signal.SIGINT, signal.SIG_DFL
        ),  # a job in the background would ignore SIGINT
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def wait_for(true, seconds=60.0):
    until = time.monotonic() + seconds
    while not true() and time.monotonic() < until:
        time.sleep(0.01)
    assert true()


@pytest.fixture
def completes(command, objects, plain, tmp_path):
    """A function that runs the command to its end, and returns what it printed on standard error.

    The rows are then those of a run that nothing has disturbed.
    """

    def run(**scheduler):
        code, _, error = command(objects, *FEW, "--output", tmp_path, **scheduler)
        assert code == 0, error
        assert rows_of(tmp_path) == rows_of(plain) and nothing_is_aside(tmp_path)
        return error

    return run


@pytest.fixture
def options(plain):
    """The options of that data set, as plain values."""
    return json.loads((plain / "manifest.json").read_text())["options"]


@pytest.fixture
def hand(objects):
    """A function that starts a process with Blender, which has found the facts of the pebble."""
    from cluster.data_set import manifest
    from cluster.worker.process import HandProcess

    def start():
        process = HandProcess()
        how, (process.facts,) = process.ask(100.0, "survey", str(objects / "pebble.ply"), manifest.versions())
        assert how == "done"
        return process

    return start


def test_a_worker_killed_in_the_middle_costs_its_block(completes, cluster, tmp_path, in_the_middle):
    killed = []

    def kill():
        pid = next(iter(cluster.run(os.getpid).values()))
        killed.extend([psutil.Process(pid), *psutil.Process(pid).children(recursive=True)])
        os.kill(pid, signal.SIGKILL)

    in_the_middle(tmp_path, kill)
    completes()
    assert killed
    wait_for(lambda: not any(p.is_running() and p.status() != "zombie" for p in killed))  # Blender too


def test_blender_killed_in_the_middle_is_tried_again_and_logged(completes, tmp_path, in_the_middle):
    in_the_middle(tmp_path, lambda: [hand.kill() for hand in hands()])
    completes()
    (trouble, *_) = [line for line in (tmp_path / "log.txt").read_text().splitlines() if "SIGKILL" in line]
    assert " block " in trouble and ".ply) block" in trouble


def test_workers_that_somebody_restarts_do_not_end_the_run(completes, cluster, tmp_path, in_the_middle):
    in_the_middle(tmp_path, cluster.restart)
    completes()


def free_port():
    with socket.socket() as found:
        found.bind(("127.0.0.1", 0))
        return found.getsockname()[1]


def dask(name, *words, path=ROOT):
    """Dask's scheduler, or a worker, as a process of its own."""
    return subprocess.Popen(
        [sys.executable, "-m", f"distributed.cli.dask_{name}", *words, "--dashboard-address", "127.0.0.1:0"],
        env=os.environ | {"PYTHONPATH": str(path)},
        cwd=path,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )


@contextmanager
def scheduler(port, path=ROOT, workers=1):
    """The address of a scheduler that has workers, and a function that ends them all."""
    address = f"tcp://127.0.0.1:{port}"
    running = [dask("scheduler", "--host", "127.0.0.1", "--port", str(port), path=path)]
    running += [dask("worker", address, "--nthreads", "1", path=path) for _ in range(workers)]

    def end():
        for process in running:
            process.kill()
            process.wait()

    try:
        yield address, end
    finally:
        end()


def test_a_scheduler_that_is_started_again_goes_on(completes, tmp_path, in_the_middle):
    port = free_port()
    with ExitStack() as running:
        address, end = running.enter_context(scheduler(port))

        def restart():
            end()
            running.enter_context(scheduler(port))

        in_the_middle(tmp_path, restart)
        completes(scheduler=address)


def test_no_scheduler_there_is_said(command, objects, tmp_path, monkeypatch):
    from cluster import engine

    monkeypatch.setattr(engine, "CONNECT", 1.0)
    address = f"tcp://127.0.0.1:{free_port()}"
    code, _, error = command(objects, *FEW, "--output", tmp_path, scheduler=address)
    assert code == 1 and f'no scheduler answers at "{address}"' in error


def test_a_scheduler_without_the_checkout_is_said(command, objects, tmp_path):
    with scheduler(free_port(), path=tmp_path) as (address, _):
        code, _, error = command(objects, *FEW, "--output", tmp_path / "set", scheduler=address)
    assert code == 1 and "Traceback" not in error
    assert "cluster: the scheduler or a worker cannot take orders (" in error
    assert error.endswith("start them in the same environment, with this checkout on their PYTHONPATH\n")


def test_workers_may_come_later(objects, plain, tmp_path):
    with scheduler(free_port(), workers=0) as (address, _):
        run = started(objects, *FEW, "--output", tmp_path, "--scheduler", address)
        assert run.stderr.readline() == "The scheduler has no workers yet: waiting for them\n"
        worker = dask("worker", address, "--nthreads", "1")
        _, error = run.communicate(timeout=60)
        worker.kill()
        worker.wait()
    assert run.returncode == 0, error
    assert rows_of(tmp_path) == rows_of(plain)


def test_a_scheduler_that_stays_away_ends_the_run(command, objects, tmp_path, in_the_middle, monkeypatch):
    from cluster import engine

    monkeypatch.setattr(engine, "CONNECT", 8.0)
    with scheduler(free_port()) as (address, end):
        in_the_middle(tmp_path, end)
        code, _, error = command(objects, *FEW, "--output", tmp_path, scheduler=address)
    assert code == 1
    assert error.endswith("cluster: the scheduler is gone: start it again, and then this command\n")
    assert blocks_of(tmp_path) and nothing_is_aside(tmp_path)


def test_broken_and_empty_files_and_one_that_blender_dies_of_are_error_rows(command, objects, tmp_path):
    bad = tmp_path / "bad"
    write_ball(bad / "good.ply")
    whole = (bad / "good.ply").read_bytes()
    (bad / "half.ply").write_bytes(whole[: len(whole) // 2])
    (bad / "crash.ply").write_text(CRASHES)
    (bad / "no_faces.obj").write_text("v 0 0 0\nv 1 0 0\n")
    (bad / "broken.blend").write_bytes(b"BLENDER-v405" + bytes(3000))
    for kind in ("ply", "stl", "obj", "blend"):
        (bad / f"empty.{kind}").touch()
    words = (bad, "--touches", "3", "--output", tmp_path / "set")
    code, output, _ = command(*words)
    assert code == 3
    found = {
        Path(row["file"]).name: row for row in pq.read_table(tmp_path / "set/objects.parquet").to_pylist()
    }
    good = found.pop("good.ply")
    assert good["error"] == 0 and good["touches"] == 3
    assert len(found) == 8
    for row in found.values():
        assert (row["touches"], row["error"], row["hash"]) == (3, 3, None)
        assert row["message"] in output
    assert found["crash.ply"]["message"] == "Blender ended by SIGABRT"
    assert found["half.ply"]["message"] == 'no mesh could be read from "half.ply": is the file complete?'
    rows = [row for path in blocks_of(tmp_path / "set") for row in pq.read_table(path).to_pylist()]
    assert len(rows) == 27
    assert {row["touch"] for row in rows if row["object"] == "crash"} == {0, 1, 2}
    tried = [
        line for line in (tmp_path / "set" / "log.txt").read_text().splitlines() if "crash.ply: B" in line
    ]
    assert len(tried) == 2
    # The error rows stay as they are, unless their files are deleted.
    assert command(*words)[0] == 3
    (bad / "half.ply").write_bytes(whole)
    for path in (tmp_path / "set" / "touches").glob("*-error.parquet"):
        if pq.read_table(path)["object"][0].as_py() == "half":
            path.unlink()
    code, output, _ = command(*words)
    assert code == 3 and "7 errors" not in output and output.startswith("8 objects")


def test_a_process_that_takes_too_long_is_ended(hand, options, tmp_path):
    from cluster.worker.process import LostError

    busy = hand()
    order = (busy.facts, options | {"touches": 5000, "block": 5000}, 0, str(tmp_path / "block.parquet"))
    with pytest.raises(LostError) as ended:  # half a second is too short for 5000 touches
        busy.ask(0.5, "touch", *order)
    assert str(ended.value).startswith("It took longer than the limit of 0.5 s\n")
    assert "most recent call first" in str(ended.value)  # this says where the process was
    assert busy.is_worn and not list(tmp_path.iterdir())
    stopped = hand()
    os.kill(stopped._process.pid, signal.SIGSTOP)  # a stopped process cannot run its watchdog either
    with pytest.raises(LostError, match=r"It took longer than the limit of 0.1 s"):
        stopped.ask(0.1, "touch", *order)
    assert stopped.is_worn


def test_a_block_that_fails_twice_is_error_rows(cluster, objects, options, tmp_path):
    from cluster.data_set.folder import DataSet
    from cluster.data_set.options import Options
    from cluster.engine import Engine, Outcome
    from cluster.run import Run, summed_up

    class Failing(Engine):
        def performed(self, orders):
            for order in orders:
                if order.label.endswith("block 1"):
                    yield Outcome(order, "failed", "It hung", [f"{order.label}: It hung"] * 2)
                else:
                    yield from super().performed([order])

    run = Run(DataSet(tmp_path), Options(**options), [str(objects / "pebble.ply")])
    run.work(Failing(cluster, 100.0))
    (row,) = summed_up(run.data_set)
    assert (row["touches"], row["error"], row["message"]) == (30, 10, "It hung")
    _, failed, _ = (pq.read_table(path).to_pylist() for path in blocks_of(tmp_path))
    assert [each["touch"] for each in failed] == list(range(10, 20))
    assert {(each["status"], each["message"], each["hash"]) for each in failed} == {
        ("error", "It hung", row["hash"])
    }
    assert (tmp_path / "log.txt").read_text().count("pebble.ply) block 1: It hung") == 2


@pytest.mark.parametrize("place", ["/proc/nothing", "{file}/below", "{file}s"])
def test_a_folder_that_takes_nothing_is_said_at_once(command, objects, tmp_path, place):
    (tmp_path / "file").touch()
    (tmp_path / "files" / "log.txt").mkdir(parents=True)
    folder = place.format(file=tmp_path / "file")
    code, _, error = command(objects, *FEW, "--output", folder)
    assert code == 1
    assert error.startswith(f'cluster: cannot write to the folder "{folder}"') and error.endswith("another\n")


def test_a_full_disk_ends_the_run_and_loses_nothing(completes, objects, plain, tmp_path):
    least = min(path.stat().st_size for path in blocks_of(plain))
    assert least > 15_000

    run = started(objects, *FEW, "--output", tmp_path, "--workers", "1")
    # This process and those below it may write no larger file, which is as on a disk without room.
    psutil.Process(run.pid).rlimit(psutil.RLIMIT_FSIZE, (10_000, 10_000))
    _, error = run.communicate(timeout=100)
    assert run.returncode == 1, error
    assert "make room there, or choose another place" in error and "Traceback" not in error
    assert not blocks_of(tmp_path) and nothing_is_aside(tmp_path)
    completes()


def cut(path):
    path.write_bytes(path.read_bytes()[:-100])


def flip(path):
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 1
    path.write_bytes(data)


def flip_footer(path):
    data = path.read_bytes()
    at = data.index(b'"seconds": ') + 11
    path.write_bytes(data[:at] + bytes([data[at] ^ 1]) + data[at + 1 :])


def foreign(path):
    import pyarrow as pa

    pq.write_table(pa.table({"a": [1]}), path)


def replace_by_another(path):
    path.write_bytes(blocks_of(path.parent.parent)[0].read_bytes())


@pytest.mark.parametrize("damage", [Path.touch, cut, flip, flip_footer, foreign, replace_by_another])
def test_a_damaged_block_is_named_and_made_again(completes, plain, tmp_path, damage):
    shutil.copytree(plain, tmp_path, dirs_exist_ok=True)
    broken = blocks_of(tmp_path)[4]
    if damage is Path.touch:
        broken.unlink()
    damage(broken)
    error = completes()
    assert f'"{broken}" is damaged, and is made again' in error and "8 of 9 blocks are there already" in error
    assert f'"{broken}" is damaged' in (tmp_path / "log.txt").read_text()


def test_a_block_that_is_damaged_during_the_run_is_made_again(completes, tmp_path, in_the_middle):
    in_the_middle(tmp_path, lambda: cut(blocks_of(tmp_path)[0]))
    assert "is damaged, and is made again" in completes()


def test_rows_of_something_else_are_refused_by_name(command, objects, tmp_path):
    words = (objects / "pebble.ply", "--touches", "3", "--output", tmp_path)
    assert command(*words)[0] == 0
    other = tmp_path / "touches" / "mine.parquet"
    foreign(other)
    code, _, error = command(*words)
    assert code == 2 and f'"{other}" does not belong to this data set: move it elsewhere' in error
    other.unlink()
    (tmp_path / "manifest.json").unlink()
    code, _, error = command(*words, "--seed", "1")
    assert code == 2 and "has rows and no manifest.json that says how they were made: put it back" in error
    assert len(blocks_of(tmp_path)) == 1


@pytest.mark.parametrize("files", [{"a.ply": 7}, {"a.ply": {"a": 7}}, [["a.ply", "hash"]]])
def test_a_manifest_of_something_else_is_refused(command, objects, tmp_path, files):
    words = (objects / "pebble.ply", "--touches", "3", "--output", tmp_path)
    assert command(*words)[0] == 0
    kept = json.loads((tmp_path / "manifest.json").read_text())
    (tmp_path / "manifest.json").write_text(json.dumps(kept | {"files": files}))
    code, _, error = command(*words)
    assert code == 2 and "is not the manifest of a data set: use another folder" in error
    assert "Traceback" not in error


def test_a_second_run_in_the_same_folder_is_refused_until_the_first_has_ended(
    command, completes, objects, tmp_path
):
    run = started(objects, *FEW, "--output", tmp_path, "--workers", "1")
    wait_for(lambda: blocks_of(tmp_path))
    os.killpg(run.pid, signal.SIGSTOP)
    before = sorted(tmp_path.rglob("*"))
    code, _, error = command(objects, *FEW, "--output", tmp_path)
    assert code == 1 and f'another run is at work in "{tmp_path}": wait for it, or use another' in error
    assert sorted(tmp_path.rglob("*")) == before
    os.killpg(run.pid, signal.SIGKILL)
    run.communicate()
    completes()


def test_a_name_that_is_not_utf_8_costs_only_its_file(command, objects, tmp_path):
    (tmp_path / "objects").mkdir()
    for name in (b"good.ply", b"caf\xe9.ply"):
        with open(os.fsencode(tmp_path / "objects") + b"/" + name, "wb") as file:
            file.write((objects / "pebble.ply").read_bytes())
    words = (tmp_path / "objects", "--touches", "3", "--output", tmp_path / "set")
    for _ in range(2):
        code, output, error = command(*words)
        assert code == 3 and "Traceback" not in error
        assert "3 errors: The name of the file is not in UTF-8: rename it" in output
        bad, good = pq.read_table(tmp_path / "set" / "objects.parquet").to_pylist()
        assert (good["ok"], bad["error"], bad["object"]) == (3, 3, r"caf\xe9")


def test_a_mesh_with_vertices_that_are_not_finite_is_error_rows(command, objects, tmp_path):
    lines = (objects / "pebble.ply").read_text().splitlines()
    at = lines.index("end_header") + 7
    for name, number in (("nan.ply", "nan"), ("far.ply", "1e39")):
        (tmp_path / name).write_text("\n".join([*lines[:at], f"0 {number} 0", *lines[at + 1 :]]) + "\n")
    words = (tmp_path, objects / "pebble.ply", "--touches", "3", "--output", tmp_path / "set")
    code, output, error = command(*words)
    assert code == 3 and "Traceback" not in error
    assert output.count("has vertices whose coordinates are not finite in single precision") == 2
    rows = {row["object"]: row for row in pq.read_table(tmp_path / "set" / "objects.parquet").to_pylist()}
    assert (rows["pebble"]["ok"], rows["nan"]["error"], rows["far"]["error"]) == (3, 3, 3)


def test_a_worker_whose_run_is_gone_finishes_the_file_that_it_writes(hand, options, tmp_path):
    for tenth in range(4):
        process = hand()
        folder = tmp_path / str(tenth) / "touches"
        folder.mkdir(parents=True)
        order = (100.0, "touch", (process.facts, options, 0, str(folder / "block.parquet")))
        process._connection.send(order)
        wait_for(lambda folder=folder: list(folder.iterdir()))  # It has begun to write.
        process._connection.close()
        process._process.wait(10.0)
        assert [path.name for path in folder.iterdir()] == ["block.parquet"]
        process._said.close()


def test_blender_leaves_no_folder_of_its_own(hand, tmp_path, monkeypatch):
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    started = [hand(), hand()]
    os.kill(started[0]._process.pid, signal.SIGKILL)
    for process in started:
        process.close()
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("ended", [signal.SIGINT, signal.SIGTERM])
def test_an_interrupted_run_ends_cleanly_and_goes_on_later(completes, objects, tmp_path, ended):
    run = started(objects, *FEW, "--output", tmp_path, "--workers", "1")
    wait_for(lambda: blocks_of(tmp_path))
    os.killpg(run.pid, signal.SIGSTOP)  # otherwise it may be done before it is interrupted
    below = psutil.Process(run.pid).children(recursive=True)
    assert len(blocks_of(tmp_path)) < 9
    (os.killpg if ended == signal.SIGINT else os.kill)(run.pid, ended)
    os.killpg(run.pid, signal.SIGCONT)
    _, error = run.communicate(timeout=60)
    assert run.returncode == 130
    assert "cluster: interrupted; run the same command again to continue" in error
    assert "Traceback" not in error
    wait_for(lambda: not any(p.is_running() and p.status() != "zombie" for p in below))
    made = len(blocks_of(tmp_path))
    assert nothing_is_aside(tmp_path)
    assert f"{made} of 9 blocks are there already" in completes()


def test_workers_do_not_print_that_a_heartbeat_met_the_end_of_their_scheduler(cluster):
    def prints(dask_worker):
        import logging

        return logging.getLogger(type(dask_worker).__module__).isEnabledFor(logging.ERROR)

    assert not any(cluster.run(prints).values())


def test_a_worker_of_another_environment_is_refused(command, objects, tmp_path, monkeypatch):
    from cluster.data_set import manifest

    other = manifest.versions() | {"scipy": "0.1"}
    monkeypatch.setattr(manifest, "versions", lambda: other)
    code, _, error = command(objects, *FEW, "--output", tmp_path)
    assert code == 1 and "the data set 0.1: start workers in the same environment" in error


def test_a_worker_without_blender_is_said(objects, monkeypatch):
    from cluster.worker import process, task

    monkeypatch.setattr(process.sys, "executable", "/bin/false")
    how, value, troubles = task.perform("pebble", 10.0, "survey", str(objects / "pebble.ply"), {})
    assert how == "stop" and len(troubles) == 2
    assert value.startswith("Blender cannot be started on ")
    assert value.endswith("(it did not say why): start workers in an environment that has it")


def test_a_process_that_has_opened_enough_gives_way(hand, objects, monkeypatch):
    from cluster.data_set import manifest
    from cluster.worker import process

    monkeypatch.setattr(process, "MOST_OPENED", 2)
    opened = hand()
    assert not opened.is_worn and opened._opened == 1
    opened.ask(100.0, "survey", str(objects / "pebble.ply"), manifest.versions())
    assert opened.is_worn and opened._opened == 2
    opened.close()
