# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The folder of a data set: a file for each task's rows, a manifest, and a file of objects at the end.

Each is written under another name and then renamed, so that there are only complete files. Each file of rows
has the checksum of its name and of all its bytes in its metadata.
"""

import fcntl
import itertools
import json
import re
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from hashlib import sha256
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

from ..extension import addon
from .columns import REPEATED, SCHEMAS, TOUCH_SCHEMA

whole_file = addon("files.whole_file")
SUMMARY = "summary"  # The key of a file's summary in its metadata.
# The key of its checksum, and what that begins with: the summary follows, and as JSON it has no line ends.
CHECKSUM, MARK = "checksum", b"\nsha256:"
NO_CHECKSUM = MARK + 64 * b"0"  # It stands for the checksum while that is computed.
NAME = re.compile(r"[0-9a-f]{16}-\d{5,}(-error)?\.parquet")  # The names of files of rows.
ERROR = "-error"  # Names of files of error rows end with this; if they are deleted, a run tries again.
DIGITS = 16  # Hashes have this many digits.
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
        """Makes the folder. Raises OSError, with a sentence, if nothing can be written to it."""
        try:
            self.parts.mkdir(parents=True, exist_ok=True)
            self.log.open("ab").close()
        except OSError as error:
            raise OSError(
                f'cannot write to the folder "{self.folder}" ({error.strerror}): choose another'
            ) from error

    @contextmanager
    def claimed(self) -> Iterator[None]:
        """Makes the folder, and within this context no other run may work in it.

        The system gives the folder free when this process ends, however it does. Raises OSError, with a
        sentence, if another run has it, or nothing can be written to it.
        """
        self.create()
        with self.log.open("ab") as log:
            try:
                fcntl.flock(log, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError as error:
                raise OSError(
                    f'another run is at work in "{self.folder}": wait for it, or use another folder'
                ) from error
            self._tidy()
            yield

    def _tidy(self) -> None:
        """Removes files that were not finished because somebody was killed while writing."""
        hidden = self.parts.glob(".*.parquet"), self.folder.glob(f".*{whole_file.UNFINISHED}*")
        for left in itertools.chain(*hidden):
            left.unlink(missing_ok=True)

    def block_path(self, key: str, block: int) -> Path:
        """The path of a block's file."""
        return self.parts / f"{key}-{block:05d}.parquet"

    def files(self) -> list[Path]:
        """All files of rows, sorted by name. Raises ValueError, with a sentence, if there is another file."""
        found = sorted(self.parts.glob("[!.]*.parquet"))
        for path in found:
            if not (NAME.fullmatch(path.name) and path.is_file()):
                raise ValueError(f'"{path}" does not belong to this data set: move it elsewhere')
        return found

    def done(self, log: Callable[[str], None]) -> set[str]:
        """The names of all files of rows, up to the block's number; damaged ones are removed and logged."""
        names = set()
        for path in self.files():
            if is_whole(path):
                names.add(path.name.removesuffix(".parquet").removesuffix(ERROR))
            else:
                log(f'"{path}" is damaged, and is made again')
                path.unlink()
        return names

    def summaries(self) -> Iterator[dict[str, Any]]:
        """The summaries of all files of rows, in the order of their names."""
        for path in self.files():
            yield json.loads(pq.read_schema(path).metadata[SUMMARY.encode()])

    def write_errors(self, facts: dict[str, Any], block: int | None, numbers: range, message: str) -> None:
        """Writes rows that say why these touches of an object, or of a block of it, could not be made."""
        common = {"object": facts["name"], "hash": facts.get("hash"), "block": block}
        rows = [common | {"touch": i, "status": "error", "message": message} for i in numbers]
        key = facts.get("hash") or file_key(facts["file"], facts["name"])
        path = self.block_path(key, block or 0)
        write_block(path.with_stem(path.stem + ERROR), rows, facts, 0.0, {"error": len(rows)})

    def write_objects(self, rows: Sequence[dict[str, Any]]) -> None:
        """Writes the file of objects, which is the last one."""
        self._tidy()
        _write(self.objects, pa.Table.from_pylist(list(rows), SCHEMAS[self.parts.name][1]))


def write_block(
    path: Path, rows: list[dict[str, Any]], facts: dict[str, Any], seconds: float, counts: dict[str, int]
) -> dict[str, Any]:
    """Writes rows about the object of these facts with the counts of their kinds; returns the file's summary.

    Raises OSError, with a sentence, if the file cannot be written.
    """
    message = rows[0]["message"] if "error" in counts else None
    summary = {"facts": facts, "counts": counts, "seconds": seconds, "message": message}
    schema = SCHEMAS[path.parent.name][0].with_metadata({SUMMARY: json.dumps(summary)})
    _write(path, pa.Table.from_pylist(rows, schema))
    return summary


def _write(path: Path, content: pa.Table) -> None:
    data = pa.BufferOutputStream()
    # Numbers rarely repeat; as a dictionary they would take more room, and half as long again to write.
    with pq.ParquetWriter(data, content.schema, compression="zstd", use_dictionary=REPEATING) as writer:
        writer.write_table(content)
        writer.add_key_value_metadata({CHECKSUM: NO_CHECKSUM.decode()})
    blank = data.getvalue().to_pybytes()
    with whole_file.replacing(path) as temporary:
        temporary.write_bytes(_with(blank, _checksum(path, blank)))


def is_whole(path: Path) -> bool:
    """Whether a file of rows is as it was written, under the name that it was given."""
    data = path.read_bytes()
    return data == _with(data, _checksum(path, _with(data, NO_CHECKSUM)))


def _with(data: bytes, checksum: bytes) -> bytes:
    """The bytes of a file with this checksum in place of its own."""
    at = data.rfind(MARK)
    return data[:at] + checksum + data[at + len(checksum) :]


def _checksum(path: Path, blank: bytes) -> bytes:
    """The checksum of a file's name and of its bytes, in which NO_CHECKSUM stands for the checksum."""
    return MARK + sha256(path.name.encode() + blank).hexdigest().encode()
