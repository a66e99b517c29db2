# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What a touch puts into the scene: the patch as an object, with attributes and colors."""
