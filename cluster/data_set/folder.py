# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The folder of a data set: a file for each task's rows, a manifest, and a file of objects at the end.

Each is written under another name and then renamed, so that there are only complete files.
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
SUMMARY = "summary"  # The key of a file's summary in its metadata.
ERROR = "-error.parquet"  # Files of error rows end with this; if they are deleted, a run tries again.
DIGITS = 16  # Hashes have so many digits.
REPEATING = [field.name for field in TOUCH_SCHEMA if field.type == REPEATED] + ["stops.list.element"]


def hash_of(*parts: bytes) -> str:
    """The hash of all parts."""
    digest = sha256()
    for part in parts:
        digest.update(part)
    return digest.hexdigest()[:DIGITS]


def file_key(path: str, name: str) -> str:
    """The word that replaces the hash of an object that cannot be read in the names of files."""
    return hash_of(path.encode(), b"\0", name.encode())


class DataSet:
    """The files of a data set in `folder`; its rows, touches or surfaces, are in the folder `parts`."""

    def __init__(self, folder: Path, parts: str = "touches") -> None:
        self.folder, self.parts = folder, folder / parts
        self.manifest, self.objects = folder / "manifest.json", folder / "objects.parquet"
        self.log = folder / "log.txt"

    def create(self) -> None:
        """Makes the folder, and removes the unfinished files of an interrupted run.

        Raises OSError, with a sentence, if nothing can be written to it.
        """
        try:
            self.parts.mkdir(parents=True, exist_ok=True)
            self._tidy()
        except OSError as error:
            raise OSError(
                f'cannot write to the folder "{self.folder}" ({error.strerror}): choose another'
            ) from error

    def _tidy(self) -> None:
        """Removes files that were not finished because somebody was interrupted while writing."""
        for left in self.parts.glob(".*.parquet"):
            left.unlink(missing_ok=True)

    def block_path(self, key: str, block: int) -> Path:
        """The path of a block's file."""
        return self.parts / f"{key}-{block:05d}.parquet"

    def done(self) -> set[str]:
        """The names of all files of rows, up to the block's number."""
        names = (path.name for path in self.parts.glob("[!.]*.parquet"))
        return {name.removesuffix(ERROR).removesuffix(".parquet") for name in names}

    def summaries(self) -> Iterator[dict[str, Any]]:
        """The summaries of all files of rows, in the order of their names."""
        for path in sorted(self.parts.glob("[!.]*.parquet")):
            yield json.loads(pq.read_schema(path).metadata[SUMMARY.encode()])

    def write_errors(self, facts: dict[str, Any], block: int | None, numbers: range, message: str) -> None:
        """Writes rows that say why these touches of an object, or of a block of it, could not be made."""
        common = {"object": facts["name"], "hash": facts.get("hash"), "block": block}
        rows = [common | {"touch": i, "status": "error", "message": message} for i in numbers]
        key = facts.get("hash") or file_key(facts["file"], facts["name"])
        path = self.block_path(key, block or 0)
        write_block(path.with_name(path.stem + ERROR), rows, facts, 0.0, {"error": len(rows)})

    def write_objects(self, rows: Sequence[dict[str, Any]]) -> None:
        """Writes the file of objects, which is the last one."""
        self._tidy()
        _write(self.objects, table(list(rows), SCHEMAS[self.parts.name][1]))


def write_block(
    path: Path, rows: list[dict[str, Any]], facts: dict[str, Any], seconds: float, counts: dict[str, int]
) -> dict:
    """Writes rows about the object of these facts with the counts of their kinds; returns the file's summary.

    Raises OSError, with a sentence, if the file cannot be written.
    """
    message = rows[0]["message"] if "error" in counts else None
    summary = {"facts": facts, "counts": counts, "seconds": seconds, "message": message}
    _write(path, table(rows, SCHEMAS[path.parent.name][0], {SUMMARY: json.dumps(summary)}))
    return summary


def _write(path: Path, content: Any) -> None:
    with whole_file.replacing(path) as temporary:
        # Numbers rarely repeat; as a dictionary they would take more room, and half as long again to write.
        pq.write_table(content, temporary, compression="zstd", use_dictionary=REPEATING)
