# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The process that has Blender and touches: `python -m cluster.worker.hand FD`, started by process.py.

It takes orders from a connection and answers each. A watchdog outside of Python ends it if an order takes too
long, even within a call of Blender. It ends itself when the process that started it is gone.
"""

import faulthandler
import os
import queue
import signal
import sys
import threading
from collections import Counter
from collections.abc import Callable
from contextlib import suppress
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

import bpy

from ..data_set import manifest
from ..data_set.columns import FOUND, kind_of
from ..data_set.folder import write_block
from ..data_set.options import Options, WholeOptions
from . import objects, surfaces, touches
from .process import DONE, FAILED, STOP

_writing = threading.Lock()  # Whoever has it may write a file: none is left unfinished where it ends.


class HopelessError(Exception):
    """Nothing can be done on this machine, whatever the object."""


class Hand:
    """Carries out orders. It keeps the last object, because the next block is of the same one in most cases.

    opened : the number of objects that it has opened
    """

    def __init__(self) -> None:
        self.opened = 0
        self._target: Any = None

    def survey(self, path: str, versions: dict[str, str]) -> list[dict[str, Any]]:
        """The facts of the objects in a file. Raises HopelessError if rows made here would differ."""
        here = manifest.versions()
        if here != versions:
            name = next(name for name in {**here, **versions} if here.get(name) != versions.get(name))
            raise HopelessError(
                f"A worker has {name} {here.get(name)}, the data set {versions.get(name)}: start workers "
                "in the same environment"
            )
        self.opened, self._target = self.opened + 1, None
        return objects.survey(path)

    def touch(self, facts: dict[str, Any], options: dict[str, Any], block: int, path: str) -> dict[str, Any]:
        """Touches an object, writes the rows of a block to the file `path`, and returns its summary."""
        rows, seconds = touches.touched(self._object(facts), Options(**options), block)
        return _written(path, rows, facts, seconds, Counter(kind_of(row["status"]) for row in rows))

    def whole(self, facts: dict[str, Any], options: dict[str, Any], block: int, path: str) -> dict[str, Any]:
        """Touches an object all over, writes its row to the file `path`, and returns its summary."""
        row, seconds = surfaces.surface(self._object(facts), WholeOptions(**options))
        counts = {"ok": row["touches"] - row["in_doubt"], "in_doubt": row["in_doubt"]}
        return _written(path, [row], facts | {name: row[name] for name, *_ in FOUND}, seconds, counts)

    def _object(self, facts: dict[str, Any]) -> Any:
        if self._target is None or self._target.facts != facts:
            self._target = None
            self.opened += 1
            self._target = objects.touchable(facts["file"], facts["name"])
            if self._target.facts["hash"] != facts["hash"]:
                self._target = None
                raise OSError(f'"{facts["file"]}" has changed since it was first read')
        return self._target


def _written(path: str, *content: Any) -> dict[str, Any]:
    try:
        with _writing:
            return write_block(Path(path), *content)
    except OSError as error:
        raise HopelessError(str(error)) from error


def answered(run: Callable[..., Any], arguments: tuple[Any, ...]) -> tuple[str, Any]:
    """How a call went, and its result: a value, or a sentence."""
    try:
        return DONE, run(*arguments)
    except HopelessError as error:
        return STOP, str(error)
    except Exception as error:  # Whatever it is, other objects are not concerned.
        words = " ".join(str(error).split()) or type(error).__name__
        return FAILED, words.removeprefix("Error: ")  # Messages of Blender's operators begin with it.


def main() -> None:
    """Answers orders until there are no more."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # The process that started it handles Ctrl+C.
    with suppress(OSError):  # Blender's own folder would stay, because this process is killed in the end.
        os.rmdir(bpy.app.tempdir)
    connection = Connection(int(sys.argv[1]))
    orders: queue.SimpleQueue[Any] = queue.SimpleQueue()
    threading.Thread(target=_listen, args=(connection, orders), daemon=True).start()
    hand = Hand()
    connection.send("ready")
    while True:
        limit, name, arguments = orders.get()
        faulthandler.dump_traceback_later(limit, exit=True)
        answer = answered(getattr(hand, name), arguments)
        faulthandler.cancel_dump_traceback_later()
        connection.send((*answer, hand.opened))


def _listen(connection: Connection, orders: "queue.SimpleQueue[Any]") -> None:
    while True:
        try:
            orders.put(connection.recv())
        except (EOFError, OSError):
            _writing.acquire()
            os._exit(0)  # Nobody waits for the order any more.


if __name__ == "__main__":
    main()
