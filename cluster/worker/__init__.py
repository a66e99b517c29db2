# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What a worker does: a process of its own, with Blender in it, touches objects."""
