# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Tactile Patch, as Blender finds it. The add-on is imported when enabled, so `core` works without it."""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from . import core


def register() -> None:
    from . import tactile_addon

    tactile_addon.register()


def unregister() -> None:
    from . import tactile_addon

    tactile_addon.unregister()


def reconstruction_of(obj: Any) -> "core.Reconstruction":
    """The core.Reconstruction of a patch, or of its probe or contours, in the world, where the patch is now.

    Raises ValueError, with a sentence, if there is none.
    """
    from .tactile_addon.probes import probe
    from .tactile_addon.scene import patch_record

    patch = probe.patch_near(obj)
    if patch is None:
        raise ValueError("Wanted a patch or its probe, got another object or none")
    return patch_record.reconstruction_of(patch)
