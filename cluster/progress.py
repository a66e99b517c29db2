# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What a run prints: now and then how far it is, and at the end how much there is and what went wrong."""

import sys
from time import monotonic
from typing import Any

from .data_set.columns import COUNTS

SAY_EVERY = 10.0  # Seconds between lines.
MOST_NAMED = 10  # At most this many objects with errors are named.


class Progress:
    """Counts touches or surfaces, of which `total` are to be made."""

    def __init__(self, noun: str) -> None:
        self.noun = noun
        self.begin(0)

    def begin(self, total: int) -> None:
        """Starts to count up to `total`."""
        self.total, self.done, self.errors = total, 0, 0
        self.start = self._said = monotonic()

    @property
    def rate(self) -> float:
        """The number that is made a second."""
        return self.done / max(monotonic() - self.start, 1e-9)

    def add(self, done: int, errors: int, engine: Any) -> None:
        """Notes that more are done, and prints a line such as "1,200 of 9,000 touches, 80 a second, ..."."""
        self.done, self.errors = self.done + done, self.errors + errors
        if monotonic() - self._said < SAY_EVERY and self.done < self.total:
            return
        self._said = monotonic()
        left = (self.total - self.done) / self.rate / 60.0 if self.done else 0.0
        speed = f"{self.rate:.3g} a second on {_many(engine.threads, 'worker')}, {left:.1f} min left"
        note(f"{self.done:,} of {self.total:,} {self.noun}, {speed}, {_many(self.errors, 'error')}")


def note(text: str) -> None:
    """Prints a line for whoever waits."""
    print(text, file=sys.stderr, flush=True)


def summary(rows: list[dict[str, Any]], run: Any) -> str:
    """A few lines: how much there is, how fast it came, and what could not be touched."""
    totals = {name: sum(row[name] for row in rows) for name in COUNTS}
    words = ", ".join(f"{count:,} {name.replace('_', ' ')}" for name, count in totals.items())
    lines = [f"{_many(len(rows), 'object')}, {sum(totals.values()):,} touches: {words}"]
    if run.progress.done:
        lines.append(f"{run.progress.done:,} {run.progress.noun} now, {run.progress.rate:.3g} a second")
    wrong = [row for row in rows if row["error"]]
    for row in wrong[:MOST_NAMED]:
        lines.append(f"{row['object']} ({row['file']}): {_many(row['error'], 'error')}: {row['message']}")
    if len(wrong) > MOST_NAMED:
        lines.append(f"and {len(wrong) - MOST_NAMED:,} more objects with errors, see {run.data_set.objects}")
    return "\n".join([*lines, f"Data set: {run.data_set.folder}"])


def _many(count: int, noun: str) -> str:
    return f"{count:,} {noun}{'s'[: count != 1]}"
