# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The folder of a data set: a file for each task's rows, a manifest, and a file of objects at the end.

All are written aside and renamed, so that there are only whole ones.
"""

import json
from collections.abc import Iterator, Sequence
from hashlib import sha256
from pathlib import Path
from typing import Any

import pyarrow.parquet as pq

from ..extension import addon
from .columns import REPEATED, SCHEMAS, TOUCH_SCHEMA, table

whole_file = addon("files.whole_file")
SUMMARY = "summary"  # key of a file's metadata
ERROR = "-error.parquet"  # ends the names of files of error rows; without them a run tries again
DIGITS = 16  # of hashes
REPEATING = [field.name for field in TOUCH_SCHEMA if field.type == REPEATED] + ["stops.list.element"]


def hash_of(*parts: bytes) -> str:
    """A hash of all of these."""
    digest = sha256()
    for part in parts:
        digest.update(part)
    return digest.hexdigest()[:DIGITS]


def file_key(path: str, name: str) -> str:
    """What stands for the hash of an object that cannot be read, in names of files."""
    return hash_of(path.encode(), b"\0", name.encode())


class DataSet:
    """The files of a data set in `folder`; its rows are in the folder `parts`: touches, or surfaces."""

    def __init__(self, folder: Path, parts: str = "touches") -> None:
        self.folder, self.parts = folder, folder / parts
        self.manifest, self.objects = folder / "manifest.json", folder / "objects.parquet"
        self.log = folder / "log.txt"

    def create(self) -> None:
        """Makes the folder, and takes away what an interrupted run has left aside.

        Raises OSError, with a sentence, where nothing can be written to it.
        """
        try:
            self.parts.mkdir(parents=True, exist_ok=True)
            self._tidy()
        except OSError as error:
            raise OSError(
                f'cannot write to the folder "{self.folder}" ({error.strerror}): choose another'
            ) from error

    def _tidy(self) -> None:
        """Takes away what was left aside by whoever was interrupted while it wrote."""
        for left in self.parts.glob(".*.parquet"):
            left.unlink(missing_ok=True)

    def block_path(self, key: str, block: int) -> Path:
        """Where the file of a block is."""
        return self.parts / f"{key}-{block:05d}.parquet"

    def done(self) -> set[str]:
        """Names, without what follows the block, of all files of rows."""
        names = (path.name for path in self.parts.glob("[!.]*.parquet"))
        return {name.removesuffix(ERROR).removesuffix(".parquet") for name in names}

    def summaries(self) -> Iterator[dict[str, Any]]:
        """The summary of each file of rows, in the order of their names."""
        for path in sorted(self.parts.glob("[!.]*.parquet")):
            yield json.loads(pq.read_schema(path).metadata[SUMMARY.encode()])

    def write_errors(self, facts: dict[str, Any], block: int | None, numbers: range, message: str) -> None:
        """Rows that say why these touches of an object, or of a block of it, could not be made."""
        common = {"object": facts["name"], "hash": facts.get("hash"), "block": block}
        rows = [common | {"touch": i, "status": "error", "message": message} for i in numbers]
        key = facts.get("hash") or file_key(facts["file"], facts["name"])
        path = self.block_path(key, block or 0)
        write_block(path.with_name(path.stem + ERROR), rows, facts, 0.0, {"error": len(rows)})

    def write_objects(self, rows: Sequence[dict[str, Any]]) -> None:
        """The file of objects, which is the last that is written."""
        self._tidy()
        _write(self.objects, table(list(rows), SCHEMAS[self.parts.name][1]))


def write_block(
    path: Path, rows: list[dict[str, Any]], facts: dict[str, Any], seconds: float, counts: dict[str, int]
) -> dict:
    """Writes rows about the object of these facts, and how many touches ended how; the file's summary.

    Raises OSError, with a sentence, where the file cannot be written.
    """
    message = rows[0]["message"] if "error" in counts else None
    summary = {"facts": facts, "counts": counts, "seconds": seconds, "message": message}
    _write(path, table(rows, SCHEMAS[path.parent.name][0], {SUMMARY: json.dumps(summary)}))
    return summary


def _write(path: Path, content: Any) -> None:
    with whole_file.replacing(path) as temporary:
        # Numbers rarely repeat, and as a dictionary they would take half as long again, and more room.
        pq.write_table(content, temporary, compression="zstd", use_dictionary=REPEATING)
