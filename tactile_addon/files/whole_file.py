# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Files that are written completely or not at all: beside the old file, which the new one then replaces."""

import os
import secrets
import shutil
from contextlib import contextmanager, suppress
from pathlib import Path


@contextmanager
def replacing(path):
    """The path of a file that replaces `path` once it is written, at the end of the block.

    Raises OSError, with a sentence, if that fails. The old file is then as it was, and nothing is beside it.
    """
    if Path(path).exists() and not Path(path).is_file():
        raise OSError(f'"{path}" is not a file that can be replaced: choose another name')
    try:
        target = Path(path).resolve()  # A link stays, and its target is replaced.
    except RuntimeError as error:  # Links point to each other.
        raise OSError(f'cannot write "{Path(path).name}" ({error}): choose another place') from error
    temporary = target.with_name(f".{target.stem[:40]}-{secrets.token_hex(4)}{target.suffix[:40]}")
    try:
        yield temporary
        with temporary.open("rb+") as file:
            os.fsync(file.fileno())
        if target.exists():
            shutil.copymode(target, temporary)
        os.replace(temporary, target)
    except OSError as error:
        raise OSError(
            f'cannot write "{target.name}" ({error.strerror or error}): '
            "make room there, or choose another place"
        ) from error
    finally:
        with suppress(OSError):
            temporary.unlink(missing_ok=True)


def write_text(path, text):
    """Writes a text in UTF-8, with line ends as they are, as the file `path`."""
    with replacing(path) as temporary, temporary.open("w", encoding="utf-8", newline="") as file:
        file.write(text)
