# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The extension's packages from the checkout, under the name that Blender would give their parent.

The add-on's `__init__` is left out, because it would import the whole user interface.
"""

import sys
import tomllib
from importlib import import_module
from pathlib import Path
from types import ModuleType

ROOT = Path(__file__).resolve().parents[1]
NAME = "tactile_patch"


def _package(name: str, folder: Path) -> None:
    module = ModuleType(name)
    module.__path__ = [str(folder)]
    sys.modules.setdefault(name, module)


_package(NAME, ROOT)
_package(f"{NAME}.tactile_addon", ROOT / "tactile_addon")
core = import_module(f"{NAME}.core")


def addon(module: str) -> ModuleType:
    """A module of tactile_addon; most of them import bpy."""
    return import_module(f"{NAME}.tactile_addon.{module}")


def version() -> str:
    """The version of the extension."""
    return tomllib.loads((ROOT / "blender_manifest.toml").read_text(encoding="utf-8"))["version"]
