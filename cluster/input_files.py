# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The files that the words of the command stand for."""

import os
from collections.abc import Iterable, Iterator
from pathlib import Path

KINDS = (".ply", ".stl", ".obj", ".blend")
LIST = ".txt"


def files_of(words: Iterable[Path]) -> list[str]:
    """The absolute paths of files, of those in folders and of those in lists, each once, in order.

    Raises ValueError, with a sentence, for words that are none of these.
    """
    found = sorted({str(path.resolve()) for word in words for path in _files(word)})
    if not found:
        raise ValueError(f"objects: expected {', '.join(KINDS)} files, got folders or lists without any")
    return found


def _files(path: Path) -> Iterator[Path]:
    if path.is_dir():
        yield from (each for each in path.rglob("*") if each.suffix.lower() in KINDS and each.is_file())
    elif not path.is_file():
        raise ValueError(f'objects: there is no file or folder "{path}"')
    elif path.suffix.lower() == LIST:
        for line in path.read_text(encoding="utf-8", errors="surrogateescape").splitlines():
            if line.strip().lower().endswith(LIST):
                raise ValueError(f'objects: expected files or folders in the list "{path}", got a list')
            if line.strip():
                yield from _files(path.parent / line.strip())
    elif path.suffix.lower() in KINDS:
        yield path
    else:
        raise ValueError(f'objects: expected {", ".join(KINDS)} files, folders or .txt lists, got "{path}"')


def printable(path: str) -> str:
    """The path as text that can be stored; bytes that are not UTF-8 are escaped."""
    return os.fsencode(path).decode("utf-8", "backslashreplace")
