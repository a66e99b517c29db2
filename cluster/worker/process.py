# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A hand in a process of its own: started, asked, watched and ended."""

import os
import signal
import subprocess
import sys
import tempfile
from multiprocessing import Pipe
from time import monotonic
from typing import Any

from ..extension import ROOT

DONE, FAILED, STOP = "done", "failed", "stop"  # How an order went: STOP where all others would go so too.
START = 120.0  # seconds that Blender may take to start, beside an order's limit
MOST_OPENED = 200  # objects that a process opens before another takes its place
THREADS = ("OMP", "OPENBLAS", "MKL", "VECLIB_MAXIMUM", "NUMEXPR")
TAIL = 2000  # characters of what a process has said last


class LostError(Exception):
    """The process has ended, or was ended, in the middle of an order; says why."""


class HandProcess:
    """A process that has Blender; nothing is forked, so what Blender has in it is never copied."""

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
        """Whether another should take its place, so that memory stays flat."""
        return self._opened >= MOST_OPENED or self._process.poll() is not None

    def ask(self, limit: float, name: str, *arguments: Any) -> tuple[str, Any]:
        """How an order went, and what came of it; see hand.py. Raises LostError where the process is gone."""
        start, allowed = monotonic(), limit + (START if self._is_new else 1.0)
        try:
            self._connection.send((limit, name, arguments))
            if self._connection.poll(allowed):
                how, value, self._opened = self._connection.recv()
                self._is_new = False
                return how, value
        except (EOFError, OSError):
            pass
        raise LostError(self._end(monotonic() - start >= limit, limit))

    def close(self) -> None:
        """Ends it, whatever it does."""
        self._connection.close()
        self._process.kill()
        self._process.wait()
        self._said.close()

    def _end(self, is_late: bool, limit: float) -> str:
        """Ends it, and says why it is gone, with its last words."""
        try:
            code = self._process.wait(1.0)
        except subprocess.TimeoutExpired:
            self._process.kill()
            code = self._process.wait()
        self._said.seek(max(0, os.fstat(self._said.fileno()).st_size - TAIL))
        words = self._said.read().decode(errors="replace").strip()
        self.close()
        if is_late:
            return f"It took longer than the limit of {limit:g} s\n{words}"
        way = f"by {signal.Signals(-code).name}" if code < 0 else f"with code {code}"
        return f"Blender ended {way}\n{words}"
