# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""How far a run is, in one line, which is overwritten on a terminal and repeated now and then elsewhere."""

import sys
from time import monotonic

SAY_EVERY = {True: 0.5, False: 10.0}  # Seconds between lines, by whether they go to a terminal.


class Progress:
    """Counts touches or surfaces, of which `total` are to be made, and prints how many are made a second."""

    def __init__(self, noun: str) -> None:
        self.noun = noun
        self._is_terminal, self._width = sys.stderr.isatty(), 0
        self.begin(0)

    def begin(self, total: int) -> None:
        """Starts to count up to `total`."""
        self.total, self.done, self.errors = total, 0, 0
        self.start = self._said = monotonic()

    @property
    def rate(self) -> float:
        """The number that is made a second."""
        return self.done / max(monotonic() - self.start, 1e-9)

    def add(self, done: int, errors: int, workers: int) -> None:
        """Notes that more are done, and prints the line if it is time."""
        self.done, self.errors = self.done + done, self.errors + errors
        if monotonic() - self._said >= SAY_EVERY[self._is_terminal] or self.done == self.total:
            self._said = monotonic()
            self._say(self.line(workers))

    def line(self, workers: int) -> str:
        """A sentence such as "1,200 of 9,000 touches, 80 a second on 2 workers, 2 min left, 3 errors"."""
        left = (self.total - self.done) / self.rate if self.done else 0.0
        words = [
            f"{self.done:,} of {self.total:,} {self.noun}",
            f"{self.rate:.3g} a second on {workers} worker{'s'[: workers != 1]}",
        ]
        words.append(f"{_duration(left)} left")
        if self.errors:
            words.append(f"{self.errors:,} errors")
        return ", ".join(words)

    def note(self, text: str) -> None:
        """Prints something else in lines of its own."""
        print("\r" + text.ljust(self._width) if self._width else text, file=sys.stderr, flush=True)
        self._width = 0

    def end(self) -> None:
        """Leaves the line as it is."""
        if self._width:
            print(file=sys.stderr, flush=True)
            self._width = 0

    def _say(self, line: str) -> None:
        if self._is_terminal:
            print("\r" + line.ljust(self._width), end="", file=sys.stderr, flush=True)
            self._width = len(line)
        else:
            print(line, file=sys.stderr, flush=True)


def _duration(seconds: float) -> str:
    if seconds < 90.0:
        return f"{seconds:.0f} s"
    return f"{seconds / 60.0:.0f} min" if seconds < 5400.0 else f"{seconds / 3600.0:.1f} h"
