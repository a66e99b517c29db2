# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""One touch, from an object of the scene to its report; nothing in the scene changes."""
