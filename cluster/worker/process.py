# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A hand in a process of its own, which is started, given orders, watched and ended here."""

import os
import platform
import signal
import subprocess
import sys
import tempfile
from contextlib import suppress
from multiprocessing import Pipe
from typing import Any

from ..extension import ROOT

DONE, FAILED, STOP = "done", "failed", "stop"  # How an order went; STOP if all others would fail, too.
START = 120.0  # Blender may take this many seconds to start.
GRACE = 1.0  # A process that is about to end gets this many seconds.
TIMEOUT, UNENDED = "Timeout (", "It did not end by itself"  # The watchdog writes the first.
MOST_OPENED = 200  # A process that has opened this many objects is replaced.
THREADS = ("OMP", "OPENBLAS", "MKL", "VECLIB_MAXIMUM", "NUMEXPR")
TAIL = 20_000  # This many of the last characters that a process has written are read.


class LostError(Exception):
    """The process has ended, or was ended, during an order; the message says why."""


class NotStartedError(LostError):
    """Blender cannot be started on this machine."""


class HandProcess:
    """A process that has Blender. It is not forked, so that nothing of Blender is copied."""

    def __init__(self) -> None:
        ours, theirs = Pipe()
        environment = dict(os.environ) | {f"{name}_NUM_THREADS": "1" for name in THREADS}
        environment["PYTHONPATH"] = os.pathsep.join([str(ROOT), os.environ.get("PYTHONPATH", "")])
        self._connection, self._said, self._opened = ours, tempfile.TemporaryFile(), 0  # noqa: SIM115
        self._process = subprocess.Popen(
            [sys.executable, "-m", "cluster.worker.hand", str(theirs.fileno())],
            env=environment,
            stdin=subprocess.DEVNULL,
            stdout=self._said,
            stderr=self._said,
            pass_fds=[theirs.fileno()],
        )
        theirs.close()
        self._is_new = True

    @property
    def is_worn(self) -> bool:
        """Whether it should be replaced, so that memory does not grow."""
        return self._opened >= MOST_OPENED or self._process.poll() is not None

    def ask(self, limit: float, name: str, *arguments: Any) -> tuple[str, Any]:
        """How an order went, and its result; see hand.py. Raises LostError if the process is gone."""
        self._start()
        with suppress(EOFError, OSError):
            self._connection.send((limit, name, arguments))
            if self._connection.poll(limit + GRACE):
                how, value, self._opened = self._connection.recv()
                return how, value
        way, words = self._end()
        if TIMEOUT in words or way == UNENDED:
            way = f"It took longer than the limit of {limit:g} s"
        raise LostError(f"{way}\n{words}")

    def close(self) -> None:
        """Ends the process, whatever it does."""
        self._connection.close()
        self._process.kill()
        self._process.wait()
        self._said.close()

    def _start(self) -> None:
        """Waits for a new process until it says that Blender is there."""
        if not self._is_new:
            return
        with suppress(EOFError, OSError):
            if self._connection.poll(START):
                self._connection.recv()
                self._is_new = False
                return
        _, words = self._end()
        last = (words.splitlines() or ["it did not say why"])[-1]
        raise NotStartedError(
            f"Blender cannot be started on {platform.node()} ({last}): start workers in an environment "
            "that has it"
        )

    def _end(self) -> tuple[str, str]:
        """Ends the process, and returns how it had ended by itself, and its last words."""
        try:
            code = self._process.wait(GRACE)
            way = f"by {signal.Signals(-code).name}" if code < 0 else f"with code {code}"
        except subprocess.TimeoutExpired:
            way = None
            self._process.kill()
            self._process.wait()
        self._said.seek(max(0, os.fstat(self._said.fileno()).st_size - TAIL))
        words = self._said.read().decode(errors="replace").strip()
        self.close()
        return UNENDED if way is None else f"Blender ended {way}", words
