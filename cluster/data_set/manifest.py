# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The manifest says how and from what a data set was made; a run with other options is refused."""

import json
from importlib.metadata import version as version_of
from typing import Any

from .. import extension
from .folder import DataSet, whole_file
from .options import Options, WholeOptions

FORMAT = 2
PACKAGES = ("bpy", "numpy", "scipy")


def versions() -> dict[str, str]:
    """The versions of everything on which rows depend."""
    found = {"format": str(FORMAT), "tactile_patch": extension.version()}
    return found | {name: version_of(name) for name in PACKAGES}


def read(data_set: DataSet) -> dict[str, Any] | None:
    """The manifest of a data set that was begun, or None if there is none.

    Raises ValueError, with a sentence, if it cannot be read, or there are rows without one.
    """
    if not data_set.manifest.exists():
        if data_set.files():
            raise ValueError(
                f'"{data_set.folder}" has rows and no manifest.json that says how they were made: put it '
                "back, or use another folder"
            )
        return None
    try:
        found = json.loads(data_set.manifest.read_text(encoding="utf-8"))
        found = {key: dict(found[key]) for key in ("versions", "options", "files")}
        hashes = [value for objects in found["files"].values() for value in objects.values()]
        if not all(value is None or isinstance(value, str) for value in hashes):
            raise TypeError
    except (OSError, ValueError, LookupError, TypeError, AttributeError, RecursionError) as error:
        raise ValueError(
            f'"{data_set.manifest}" is not the manifest of a data set: use another folder'
        ) from error
    return found


def begun(data_set: DataSet, options: Options | WholeOptions) -> dict[str, Any] | None:
    """What `read` returns. Raises ValueError if the data set was made by other versions or options."""
    old = read(data_set)
    if old is None:
        return None
    for kind, now in (("versions", versions()), ("options", options.to_dict())):
        for name in sorted(now.keys() | old[kind].keys()):
            was, wanted = old[kind].get(name), now.get(name)
            if was != wanted:
                raise ValueError(
                    f"{name}: this data set was begun with {_said(was)}, and it is now "
                    f"{_said(wanted)}: use the same again, or another folder"
                )
    return old


def require_same_objects(old: dict[str, Any], files: dict[str, Any]) -> None:
    """Raises ValueError if a file does not have the objects that it had; files may be added."""
    for path, hashes in files.items():
        had = old["files"].get(path, {})
        if any(known is not None and hashes.get(name) != known for name, known in had.items()):
            raise ValueError(
                f'"{path}" has changed since this data set was begun, or can no longer be read: put the '
                "old file back, or use another folder"
            )


def write(data_set: DataSet, options: Options | WholeOptions, files: dict[str, Any]) -> None:
    """Writes the manifest; `files` are the hashes of objects by their names, by the paths of files."""
    content = {"versions": versions(), "options": options.to_dict(), "files": files}
    whole_file.write_text(data_set.manifest, json.dumps(content, indent=1) + "\n")


def _said(value: Any) -> str:
    return "auto" if value is None else json.dumps(value).strip('"')
