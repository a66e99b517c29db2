# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A run: it looks through the files, has missing blocks touched, and sums up."""

from collections import Counter
from collections.abc import Iterable, Iterator
from datetime import datetime
from pathlib import Path
from typing import Any

from .data_set import manifest
from .data_set.columns import COUNTS
from .data_set.folder import DataSet, file_key
from .data_set.options import Options, WholeOptions
from .engine import Engine, Order, Outcome
from .input_files import printable
from .progress import Progress, note
from .worker.process import FAILED, STOP

TRIES = 2  # Blocks that are damaged once they are written are made again this often.
MISNAMED = "The name of the file is not in UTF-8: rename it"


class StoppedError(Exception):
    """A worker cannot go on, whatever the object; the message is a sentence."""


class Run:
    """What has to be done for a data set, and how far it is."""

    def __init__(self, data_set: DataSet, options: Options | WholeOptions, files: list[str]) -> None:
        """Raises ValueError for the folder of another data set, and OSError if it cannot be written to."""
        self.data_set, self.options = data_set, options
        self.files = [printable(path) for path in files]
        self._misnamed = set(self.files) - set(files)
        self.old = manifest.begun(data_set, options)
        data_set.create()
        if self.old is None:
            manifest.write(data_set, options, {})
        self.progress = Progress(options.parts)

    def work(self, engine: Engine) -> None:
        """Makes what is missing. Raises ValueError for files that have changed, StoppedError and OSError."""
        done = self.data_set.done(self._log)
        objects = self._survey(engine, done)
        blocks = {
            f"{facts['hash']}-{block:05d}": (facts, block)
            for facts in objects
            for block in self.options.blocks()
        }
        missing = [value for name, value in blocks.items() if name not in done]
        if len(missing) < len(blocks):
            self._log(f"{len(blocks) - len(missing)} of {len(blocks)} blocks are there already")
        for _ in range(TRIES):
            self._make(engine, missing)
            done = self.data_set.done(self._log)
            missing = [value for name, value in blocks.items() if name not in done]
            if not missing:
                return
        raise StoppedError(
            f'files in "{self.data_set.folder}" are damaged as soon as they are written: use another disk'
        )

    def _make(self, engine: Engine, missing: list[tuple[dict[str, Any], int]]) -> None:
        """Has these blocks of objects touched."""
        self.progress.begin(sum(len(self.options.numbers(block)) for _, block in missing))
        orders = {self._label(*each): each for each in missing}
        for outcome in self._outcomes(engine, (self._order(*each) for each in missing)):
            facts, block = orders[outcome.order.label]
            numbers, errors = self.options.numbers(block), 0
            if outcome.how == FAILED:
                note(f"{outcome.order.label}: {outcome.value}")
                self.data_set.write_errors(facts, block, numbers, outcome.value)
                errors = len(numbers)
            self.progress.add(len(numbers), errors, engine)

    def _survey(self, engine: Engine, done: set[str]) -> list[dict[str, Any]]:
        """The facts of all objects that are to be touched, each once, which also go into the manifest."""
        known = {path for path in self.files if f"{file_key(path, Path(path).stem)}-00000" in done}
        versions = manifest.versions()
        orders = (
            Order(path, "survey", (path, versions))
            for path in self.files
            if path not in known | self._misnamed
        )
        note(f"{len(self.files) - len(known):,} files to look through")
        facts: dict[str, list[dict[str, Any]]] = {path: [] for path in self.files}
        facts |= {path: [_broken(path, MISNAMED)] for path in self._misnamed - known}
        for outcome in self._outcomes(engine, orders):
            path = outcome.order.label
            facts[path] = [_broken(path, outcome.value)] if outcome.how == FAILED else outcome.value
        hashes = {path: {each["name"]: each["hash"] for each in facts[path]} for path in self.files}
        if self.old is not None:
            manifest.require_same_objects(self.old, hashes)
            hashes = self.old["files"] | hashes
        manifest.write(self.data_set, self.options, hashes)
        return list(self._distinct(each for path in self.files for each in facts[path]))

    def _distinct(self, objects: Iterable[dict[str, Any]]) -> Iterator[dict[str, Any]]:
        """The objects that can be touched, each geometry once; for the others it writes error rows."""
        seen: dict[str, dict[str, Any]] = {}
        for facts in objects:
            if facts["hash"] is None:
                self._log(f"{_title(facts)}: {facts['trouble']}")
                self.data_set.write_errors(facts, None, range(self.options.touches), facts["trouble"])
            elif facts["hash"] in seen:
                self._log(f"{_title(facts)} is the same as {_title(seen[facts['hash']])}: touched once")
            else:
                seen[facts["hash"]] = facts
                yield facts

    def _outcomes(self, engine: Engine, orders: Iterable[Order]) -> Iterator[Outcome]:
        for outcome in engine.performed(orders):
            for trouble in outcome.troubles:
                self._log(trouble, aloud=False)
            if outcome.how == STOP:
                raise StoppedError(outcome.value)
            yield outcome

    def _order(self, facts: dict[str, Any], block: int) -> Order:
        path = str(self.data_set.block_path(facts["hash"], block).resolve())
        return Order(
            self._label(facts, block), self.options.command, (facts, self.options.to_dict(), block, path)
        )

    def _label(self, facts: dict[str, Any], block: int) -> str:
        return f"{_title(facts)} block {block}"

    def _log(self, text: str, aloud: bool = True) -> None:
        """Writes a text to the folder's log and, if `aloud`, to the terminal."""
        now = datetime.now().astimezone().isoformat(timespec="seconds")
        with self.data_set.log.open("a", encoding="utf-8") as file:
            file.write(f"{now} {text}\n")
        if aloud:
            note(text)


def summed_up(data_set: DataSet) -> list[dict[str, Any]]:
    """The rows of the file of objects, which is written as well, from the summaries of all blocks."""
    rows: dict[str, dict[str, Any]] = {}
    for summary in data_set.summaries():
        facts, counts = summary["facts"], Counter(summary["counts"])
        key = facts["hash"] or file_key(facts["file"], facts["name"])
        row = rows.setdefault(key, facts | {"object": facts["name"], "touches": 0, "seconds": 0.0})
        row["touches"] += counts.total()
        row["seconds"] += summary["seconds"]
        row["message"] = row.get("message") or summary["message"]
        for name in COUNTS:
            row[name] = row.get(name, 0) + counts[name]
    found = sorted(rows.values(), key=lambda row: (row["object"], row["file"], row["hash"] or ""))
    data_set.write_objects(found)
    return found


def _broken(path: str, trouble: str) -> dict[str, Any]:
    """The facts of a file that has no objects that can be touched."""
    return {"name": Path(path).stem, "file": path, "hash": None, "trouble": trouble}


def _title(facts: dict[str, Any]) -> str:
    return f"{facts['name']} ({facts['file']})"
