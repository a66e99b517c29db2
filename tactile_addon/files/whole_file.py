# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Files that are written completely or not at all: next to the old file, which the new one then replaces."""

import errno
import os
import secrets
import shutil
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

UNFINISHED = ".unfinished"  # This is before the suffix of files that are being written.


@contextmanager
def replacing(path: str | Path) -> Iterator[Path]:
    """The path of a file that replaces `path` once it is written, at the end of the block.

    Raises OSError, with a sentence, if that fails. The old file is then as it was, and nothing is next to it.
    If this process is killed, a hidden file stays.
    """
    if Path(path).exists() and not Path(path).is_file():
        raise OSError(f'"{path}" is not a file that can be replaced: choose another name')
    try:
        target = Path(path).resolve()  # A link stays, and its target is replaced.
    except RuntimeError as error:  # Links point to each other.
        raise OSError(f'cannot write "{Path(path).name}" ({error}): choose another place') from error
    name = f".{target.stem[:40]}-{secrets.token_hex(4)}{UNFINISHED}{target.suffix[:40]}"
    temporary = target.with_name(name)
    try:
        temporary.touch()  # Blender's exporters do not tell why they cannot,
        temporary.unlink()  # and keep a file that is there.
        yield temporary
        with temporary.open("rb+") as file:
            size = file.seek(0, os.SEEK_END)
            file.write(b"\0")  # On a full disk Blender reports success, but there is no room for this byte.
            file.flush()
            file.truncate(size)
            os.fsync(file.fileno())
        if target.exists():
            shutil.copymode(target, temporary)
        os.replace(temporary, target)
    except OSError as error:
        is_forbidden = error.errno in (errno.EACCES, errno.EPERM, errno.EROFS)
        advice = "get the right to write there" if is_forbidden else "make room there"
        raise OSError(
            f'cannot write "{target.name}" ({error.strerror or error}): {advice}, or choose another place'
        ) from error
    finally:
        with suppress(OSError):
            temporary.unlink(missing_ok=True)


def write_text(path: str | Path, text: str) -> None:
    """Writes a text in UTF-8, with line ends as they are, as the file `path`; raises as `replacing`."""
    with replacing(path) as temporary, temporary.open("w", encoding="utf-8", newline="") as file:
        file.write(text)
