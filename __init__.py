# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Tactile Patch: Blender's entry. The add-on is imported on enabling, so that `core` can do without it."""


def register():
    from . import tactile_addon

    tactile_addon.register()


def unregister():
    from . import tactile_addon

    tactile_addon.unregister()
