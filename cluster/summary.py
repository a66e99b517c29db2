# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The summary of a data set at the end of a run."""

from typing import Any

from .data_set.columns import COUNTS

MOST_NAMED = 10  # At most this many objects with errors are named.


def summary(rows: list[dict[str, Any]], run: Any) -> str:
    """A few lines: how much there is, how fast it came, and what could not be touched."""
    totals = {name: sum(row[name] for row in rows) for name in COUNTS}
    words = ", ".join(f"{count:,} {name.replace('_', ' ')}" for name, count in totals.items())
    lines = [f"{len(rows):,} object{'s'[: len(rows) != 1]}, {sum(totals.values()):,} touches: {words}"]
    if run.progress.done:
        lines.append(f"{run.progress.done:,} {run.progress.noun} now, {run.progress.rate:.3g} a second")
    wrong = [row for row in rows if row["error"]]
    for row in wrong[:MOST_NAMED]:
        lines.append(f"{row['object']} ({row['file']}): {row['error']:,} errors: {row['message']}")
    if len(wrong) > MOST_NAMED:
        lines.append(f"and {len(wrong) - MOST_NAMED:,} more objects with errors, see {run.data_set.objects}")
    return "\n".join([*lines, f"Data set: {run.data_set.folder}"])
